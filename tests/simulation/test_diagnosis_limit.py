"""A diagnosis shows what it tries, and ends at its limit with what it has found until then."""

from __future__ import annotations

import pytest

import sinssim
from sinssim.simulation import aided_run
from tests.scenario.test_unknown_gravity import parked

LOUD = parked(
    imu={"grade": "laser-navigation", "rate_hz": 2.0},
    parked={"latitude_deg": 46.5, "longitude_deg": 7.5, "heading_deg": 40.0, "duration_s": 130.0},
    filter={"alignment_s": 30.0, "measurement_noise_factor": 0.2, "diagnose": True},
)
"""A filter that assumes a fifth of the noise of its readings."""


def searched() -> tuple[list[tuple[str, float]], dict]:
    told: list[tuple[str, float]] = []
    result = sinssim.run(LOUD, progress=lambda text, fraction: told.append((text, fraction)))
    work = [(text, part) for text, part in told if text.startswith("filter: ")]
    return work, result.summary["filter"]["diagnosis"]


@pytest.fixture(scope="module")
def unlimited() -> tuple[list[tuple[str, float]], dict]:
    return searched()


def test_a_search_shows_its_work_and_ends_at_its_limit(unlimited, monkeypatch: pytest.MonkeyPatch) -> None:
    work, whole = unlimited
    texts, parts = zip(*work, strict=True)
    assert texts[0] == "filter: the filter itself"
    assert {"filter: gyro scale", "filter: initial position", "filter: σ of zero-velocity"} <= set(texts)
    assert {"filter: inertial noise", "filter: done"} <= set(texts)
    assert list(parts) == sorted(parts)
    assert parts[-1] == 1.0
    assert whole["cause"] == "zero-velocity"
    assert whole["sensors"]["zero-velocity"]["sigma_factor"] == pytest.approx(5.0, rel=0.15)  # 300 numbers: σ 4.1 %
    assert (whole["runs"], whole["cut"]) == (len(work) - 1, False)
    assert 0.0 < whole["seconds"] < 600.0
    assert f"The search took {whole['runs']} runs" in whole["what_to_try"][-1]

    monkeypatch.setattr(aided_run, "_SAMPLES", 1)
    monkeypatch.setattr(aided_run, "_FEWEST", 6)
    work, part = searched()
    assert (part["runs"], part["cut"]) == (6, True)
    assert [text for text, _ in work] == [*texts[:6], "filter: done"]
    gains = {one["name"]: one["gain"] for one in whole["hypotheses"]}
    assert len(part["hypotheses"]) == 5  # without the filter itself
    assert all(one["gain"] == gains[one["name"]] for one in part["hypotheses"])
    assert "It ended at this limit" in part["what_to_try"][-1]


def test_a_factor_whose_spread_is_not_found_is_not_advised(unlimited, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit falls on the run for the 1σ of the factor, the last before the search for inertial noise."""
    work, whole = unlimited
    last = max(k for k, (text, _) in enumerate(work) if text == "filter: σ of zero-velocity")
    monkeypatch.setattr(aided_run, "_SAMPLES", 1)
    monkeypatch.setattr(aided_run, "_FEWEST", last)
    _, part = searched()
    assert "zero-velocity" in {one["name"] for one in whole["hypotheses"]}
    assert "zero-velocity" not in {one["name"] for one in part["hypotheses"]}


@pytest.mark.parametrize(("samples", "most"), [(30_000, 70), (72_000, 41), (720_000, 30), (0, 70)])
def test_the_limit_of_runs(samples: int, most: int) -> None:
    """300 s, 12 min and 2 h at 100 Hz."""
    assert aided_run.most_runs(samples) == most
