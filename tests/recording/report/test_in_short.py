"""The first sentences of a run's report, and how it was computed."""

from __future__ import annotations

import platform
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_report as report
from sinssim.scenario import Scenario
from tests.recording.spies import cells, html, read

SCENARIO = Scenario.model_validate(
    {
        "name": "short", "seed": 41, "parked": {"latitude_deg": 50.0, "duration_s": 20.0},
        "imu": {"grade": "tactical", "rate_hz": 250.0}, "navigation": {"frame": "wander", "vertical": "truth"},
    }
)  # fmt: skip


def errors(final: float, largest: float) -> dict[str, float]:
    return {"final_horizontal_error_m": final, "max_horizontal_error_m": largest}


def summary(algorithms: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "algorithms": algorithms, "failures": {}, "start_s": 100.0, "end_s": 1000.0, "flagged_samples": {}, **more,
    }  # fmt: skip


def sentences(
    monkeypatch: pytest.MonkeyPatch, algorithms: dict[str, Any], parts: tuple[Any, ...] = (), **more: Any
) -> list[str]:
    monkeypatch.setattr(report, "flagged_words", lambda flagged, samples: f"{samples} samples.")
    found = {str(k): part for k, part in enumerate(parts)}
    run: Any = SimpleNamespace(scenario=SCENARIO, parts=found)
    monkeypatch.setattr(report, "error_table", lambda *_: Sentence("(table)"))
    monkeypatch.setattr(report, "sentences", lambda numbers: ["(filter)"])
    of: Any = {"status": "finished", "timing": {}, "singularities": {}, **summary(algorithms, **more)}
    return [item.text for item in report.brief(run, of) if isinstance(item, Sentence) and "page" in item.on]


def test_what_was_run(monkeypatch: pytest.MonkeyPatch) -> None:
    first, height, *rest = sentences(monkeypatch, {"quaternion": errors(1234.5, 5432.1)})
    assert first.startswith("IMU tactical (")
    assert first.endswith("250 Hz, seed 41; navigation for 15 min in the frame “wander”.")
    assert height.startswith("Height of the inertial solutions: ")
    assert rest[-2:] == ["225000 samples.", "Horizontal error: 1234 m at the end, 5432 m at most."]


def test_the_smallest_and_the_largest_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the unit of the largest; sorted by the largest error, not the last one."""
    own = {"a": errors(700.0, 90_000.0), "b": errors(900.0, 40_000.0), "c": errors(200_500.0, 300_000.0)}
    aided = {"filter": {"aided": errors(0.012, 0.25)}}
    *_, said, with_filter = sentences(monkeypatch, own, **aided)
    assert said == (
        "Horizontal error of b (smallest) to c (largest): 0.9000 km to 200.5 km at the end, 40.00 km to 300.0 km at "
        "most. The algorithms’ errors at the end differ by up to 199.8 km."
    )
    assert with_filter == "With the aiding sensors and the filter: 12.00 mm at the end, 250.0 mm at most."


def test_alike_are_those_that_differ_by_less_than_half_a_thousandth(monkeypatch: pytest.MonkeyPatch) -> None:
    own = {"a": errors(500.0, 700.0), "b": errors(500.2, 700.2)}
    assert sentences(monkeypatch, own)[-1] == (
        "Horizontal error of all algorithms: 500.0 m at the end, 700.0 m at most. The algorithms’ errors at the end "
        "differ by up to 200.0 mm."
    )
    apart = {"a": errors(500.0, 700.0), "b": errors(500.3, 700.2)}
    assert "of b (smallest) to" not in sentences(monkeypatch, apart)[-1]
    assert "of a (smallest) to b (largest): 500.0 m to 500.3 m" in sentences(monkeypatch, apart)[-1]


def test_failures_and_a_platform(monkeypatch: pytest.MonkeyPatch) -> None:
    own = {"a": errors(500.0, 700.0), "b": {"final_horizontal_error_m": None}}
    *_, gone, said = sentences(monkeypatch, own, failures={"b": {"text": "it fell."}})
    assert gone == "No result from b; the section on navigation errors gives the reason."
    assert said == "Horizontal error: 500.0 m at the end, 700.0 m at most."
    none = sentences(monkeypatch, {"b": {}}, failures={"b": {"text": "it fell."}})
    assert none[-1].startswith("No result from b;")
    both = {"platform": errors(1.0, 2.0), "quaternion": errors(3.0, 4.0)}
    told = [Sentence("Of the platform."), Sentence("For the console.", on=("console",))]
    part = SimpleNamespace(compares=2, brief=lambda algorithms: told if list(algorithms) == list(both) else [])
    assert sentences(monkeypatch, both, (part,))[-1] == "Of the platform."
    part.compares = 3
    assert sentences(monkeypatch, both, (part,))[-1].startswith("Horizontal error of platform (smallest)")
    assert not sentences(monkeypatch, {})


@pytest.mark.parametrize(
    ("metres", "largest", "text"),
    [(0.1234567, None, "123.5 mm"), (0.1234567, 0.6, "0.1235 m"), (123456.0, None, "123.5 km"),
     (float("nan"), None, "not a number"), (-2.5, None, "-2.500 m")],
)  # fmt: skip
def test_lengths(metres: float, largest: float | None, text: str) -> None:
    assert report.length_text(metres, largest) == text


def test_how_it_ended() -> None:
    assert report.ended("failed") == "failed."
    assert report.ended("interrupted").startswith("was interrupted; this report shows the results up to")


def test_how_it_was_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report, "processor", lambda: "a <fast> one")
    own = {"kind": "algorithm", "name": "cayley", "sha256": "0123456789abcdef", "file": "/x/cayley.py"}
    found: Any = {
        "timing": {"flight_s": 1.236, "imu_s": 0.0, "filter_s": 2.5, "total_s": 0.0}, "flight_cached": True,
        "versions": {"sinssim": "9.8", "numpy": "7.6"}, "own_content": [own],
    }  # fmt: skip
    assert cells(html(report.computed_with(SCENARIO, found))) == [
        ["stage", "time, s", ""], ["flight", "1.24", "from the cache"], ["filter", "2.50", ""], ["total", "0.00", ""],
        ["computed with", ""], ["seed", "41"], ["IMU rate", "250 Hz"], ["sinssim", "9.8"], ["numpy", "7.6"],
        ["Python", platform.python_version()], ["processor", "a &lt;fast&gt; one"],
        ["own algorithm", "cayley, SHA-256 0123456789ab…, /x/cayley.py"],
    ]  # fmt: skip
    assert "flown now" in read(html(report.computed_with(SCENARIO, found | {"flight_cached": False})))
