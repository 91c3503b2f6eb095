"""A summary, a run in words, and the parts of a run on recorded sensors, from numbers that are chosen."""

from __future__ import annotations

import json
from dataclasses import make_dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.run.parts import judged_outages
from sinssim.experiments.run.run_execution import RunMedia, about, keep
from sinssim.experiments.run.run_result import Run
from sinssim.recording.result import RunDirectory
from sinssim.simulation import recorded_filter_run
from sinssim.simulation.navigation_stage import aid, best_reference
from sinssim.simulation.truth_and_sensors import RecordedMotion, Stages, _heights, sense_recorded
from sinssim.strapdown.navigation_error import NavError
from tests.experiments.run.test_filter_streams import motion
from tests.recording.test_summary import ERROR
from tests.simulation.test_parts_of_a_run import scenario, truth


def test_the_height_of_recorded_sensors() -> None:
    """The first barometer with two readings; its interval is the median one."""
    m = SimpleNamespace(
        kind="baro-height", time=np.array([1.0, 1.5, 3.0, 3.25]), arrival=np.array([2.0, 3.0, 4.0, 5.0]),
        value=np.array([[7.0], [8.0], [9.0], [6.0]]),
    )  # fmt: skip
    sensed = [SimpleNamespace(measurements=one) for one in (SimpleNamespace(kind="heading"), Sized(m))]
    prepared = SimpleNamespace(log=SimpleNamespace(sensed=sensed))
    found = _heights(prepared)  # type: ignore[arg-type]
    assert (found.arrival.tolist(), found.value.tolist(), found.interval) == (
        [2.0, 3.0, 4.0, 5.0],
        [7.0, 8.0, 9.0, 6.0],
        0.5,
    )
    with pytest.raises(InputError, match="needs heights"):
        _heights(SimpleNamespace(log=SimpleNamespace(sensed=sensed[:1])))  # type: ignore[arg-type]
    motion: Any = SimpleNamespace(prepared=SimpleNamespace(log=SimpleNamespace(imu="imu", sensed=sensed)))
    for vertical, expected in (("baro-loop", [7.0, 8.0, 9.0, 6.0]), ("free", None)):
        own = scenario(navigation={"vertical": vertical})
        heights = sense_recorded(own, motion).height
        assert (heights if heights is None else heights.value.tolist()) == expected


class Sized(SimpleNamespace):
    def __init__(self, of: SimpleNamespace) -> None:
        super().__init__(**vars(of))

    def __len__(self) -> int:
        return len(self.time)


def test_what_a_summary_says_of_any_run(tmp_path: Path) -> None:
    clock = Stages(lambda stage, fraction: None)
    own = scenario(imu={"grade": "ideal", "rate_hz": 40.0}, aiding={"gnss": {}}, filter={})
    found = about(own, clock, "failed", "why")
    assert list(found) == ["scenario", "status", "message", "seed", "rate_hz", "timing", "versions"]
    assert [found[key] for key in ("scenario", "status", "message", "seed", "rate_hz")] == [
        "x",
        "failed",
        "why",
        11,
        40.0,
    ]
    assert "message" not in about(own, clock, "finished")
    place = keep(RunDirectory(tmp_path / "run"), own, ("A line.",), {"a": 1.5}, "<p>page</p>")
    assert place == tmp_path / "run"
    assert json.loads((place / "summary.json").read_text()) == {"a": 1.5}
    assert (place / "report.html").read_text() == "<p>page</p>"
    assert "A line." in (place / "scenario.toml").read_text()
    assert sorted(p.name for p in place.iterdir() if not p.name.startswith(".")) == [
        "report.html",
        "scenario.toml",
        "summary.json",
    ]


def test_a_run_in_words() -> None:
    summary = {
        "status": "finished",
        "start_s": 2.5,
        "end_s": 47.5,
        "algorithms": {"euler": numbers(1.5), "poisson": dict.fromkeys(numbers(1.0))},
        "filter": {"smoothed": numbers(2.5)},
    }
    run = Run(scenario(), None, "aided", {}, summary, media=RunMedia())  # type: ignore[arg-type]
    assert repr(run) == "Run(x: finished; 2.5 … 47.5 s; euler, poisson; with a filter)"
    cells = run._repr_html_().replace(' style="text-align: left"', "")
    heads = ("solution", "horizontal error at the end, m", "largest", "velocity error at the end, m/s", "largest",
             "attitude error at the end, arcsec", "largest")  # fmt: skip
    assert "".join(f"<th>{head}</th>" for head in heads) in cells
    rows = [("euler", "1.5", "3", "4.5", "6", "7.5", "9"), ("smoothed", "2.5", "5", "7.5", "10", "12.5", "15")]
    assert "".join(f"<tr>{''.join(f'<td>{one}</td>' for one in row)}</tr>" for row in rows) in cells
    assert "poisson</td>" not in cells


def numbers(size: float) -> dict[str, float]:
    keys = ("final_horizontal_error_m", "max_horizontal_error_m", "final_velocity_error_mps", "max_velocity_error_mps",
            "final_attitude_error_arcsec", "max_attitude_error_arcsec")  # fmt: skip
    return {key: size * (k + 1) for k, key in enumerate(keys)}


def test_what_recorded_sensors_are_compared_with() -> None:
    """A recorded reference; else the smoothed or the aided solution; else the first of two algorithms."""
    solutions = {"euler": motion(1.0, "euler"), "poisson": motion(40.0, "poisson")}
    estimate = SimpleNamespace(time=np.zeros(2), smoothed=None, solution=motion(80.0, "a"))
    aided: Any = SimpleNamespace(estimate=estimate)
    unknown_motion, given = RecordedMotion(None, None), SimpleNamespace(name="r.pos")  # type: ignore[arg-type]
    known = RecordedMotion(None, given)  # type: ignore[arg-type]
    assert best_reference(known, aided, solutions) is given

    def best(of: Any, by: Any = solutions) -> Any:
        return best_reference(unknown_motion, of, by)

    reference = best(aided)
    assert (reference.name, reference.latitude.tolist()) == (
        "the aided solution",
        estimate.solution.latitude.tolist(),
    )
    estimate.smoothed = SimpleNamespace(solution=motion(90.0, "s"))
    reference = best(aided)
    assert (reference.name, reference.height.tolist()) == (
        "the smoothed solution",
        estimate.smoothed.solution.height.tolist(),
    )
    estimate.time = np.zeros(1)
    reference = best(aided)
    assert (reference.name, reference.longitude.tolist()) == (
        "the solution euler",
        solutions["euler"].longitude.tolist(),
    )
    assert best(None, {"euler": solutions["euler"]}) is None
    unknown = unknown_motion.error_of(solutions["euler"], "north")
    assert unknown.time.tolist() == [5.0, 6.0, 8.0]
    assert np.isnan([unknown.position_ned, unknown.velocity_ned, unknown.attitude]).all()
    by: Any = SimpleNamespace(error_of=lambda s: ("of", s))
    assert RecordedMotion(None, by).error_of("solution", "north") == ("of", "solution")  # type: ignore[arg-type]


def test_a_recorded_motion_is_known_by_its_start() -> None:
    """Its axes are those of the place where it starts, and its outages are two events each."""
    imu, first = SimpleNamespace(time=np.array([3.0, 9.0])), truth()
    log = SimpleNamespace(imu=imu, outages=((4.0, 5.0),))
    found = RecordedMotion(SimpleNamespace(log=log, start=SimpleNamespace(state=first)), None)  # type: ignore[arg-type]
    assert found.first is first
    assert found.time.tolist() == [3.0, 9.0]
    assert [(event.time, event.text) for event in found.events] == [
        (4.0, "GNSS withheld"),
        (5.0, "GNSS available again"),
    ]
    assert found.axes("wander") == "north"
    first.latitude[...] = 1.565
    assert found.axes("wander") == "transported"
    assert found.axes("level") == "north"


def test_outages_of_a_run_and_of_further_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The growth of the error begins with each outage; a further pass has its own estimate and its number."""
    sigma = np.outer([1.0, 2.0, 3.0, 4.0], [3.0, 4.0, 12.0])
    estimate = SimpleNamespace(solution="own", smoothed=None, sigma=sigma)
    other = SimpleNamespace(solution="other", smoothed=SimpleNamespace(solution="smooth"), sigma=2.0 * sigma)
    double = NavError(ERROR.time, 2.0 * ERROR.position_ned, ERROR.velocity_ned, ERROR.attitude)
    errors = {"own": ERROR, "other": double, "smooth": ERROR}
    reference = SimpleNamespace(name="r", error_of=lambda solution: errors[solution])
    passed = []
    monkeypatch.setattr(judged_outages, "recorded_start", lambda scenario, sensed: "start")
    monkeypatch.setattr(
        recorded_filter_run, "outage_pass", lambda *given: passed.append((given[0], *given[2:])) or other
    )
    aided: Any = SimpleNamespace(estimate=estimate)

    def judged() -> Any:
        motion = RecordedMotion(SimpleNamespace(log=log, scenario=SimpleNamespace(log="log")), None)  # type: ignore[arg-type]
        run: Any = SimpleNamespace(truth=motion, sensed=SimpleNamespace(imu="imu"))
        return judged_outages.Outages(run, aided).judged

    log = SimpleNamespace(outages=((5.5, 8.0),), passes=(), reference=reference, fixes=None)
    found = judged()
    assert (found.numbers["against"], passed) == ("r", [])
    (one,) = found.numbers["each"]
    assert (one["at_s"], one["horizontal_error_m"], one["horizontal_sigma_m"], "pass" in one) == (
        8.0,
        17.0,
        15.0,
        False,
    )
    (growth,) = found.growth
    assert (growth[0].tolist(), growth[1].tolist()) == ([0.5, 2.5], [13.0, 17.0])
    log.passes = (((5.0, 6.0),), ((5.5, 8.0), (8.0, 9.0)))
    found = judged()
    assert passed == [("imu", "start", spans) for spans in log.passes]
    shown = [(one["pass"], one["horizontal_error_m"], one["horizontal_sigma_m"]) for one in found.numbers["each"]]
    assert shown == [(1, 26.0, 20.0), (2, 34.0, 30.0), (2, pytest.approx(2.0), 40.0)]
    assert [one["smoothed_max_horizontal_error_m"] for one in found.numbers["each"]] == pytest.approx([13.0, 17.0, 1.0])
    assert [time.tolist() for time, _ in found.growth] == [[0.0, 1.0], [0.5, 2.5], [0.0, 1.0]]
    motion = RecordedMotion(SimpleNamespace(log=log), None)  # type: ignore[arg-type]
    for settings, expected in ((None, False), ("filter", True)):
        run: Any = SimpleNamespace(truth=motion, scenario=SimpleNamespace(filter=settings))
        assert judged_outages.Outages.belongs_to(run) is expected
    log.passes = log.outages = ()
    assert not judged_outages.Outages.belongs_to(run)


def test_withheld_fixes_judge_outages_if_there_is_no_reference() -> None:
    gnss = SimpleNamespace(lever_arm_m=(0.5, -1.5, 2.5))
    own = SimpleNamespace(log=SimpleNamespace(gnss=gnss))
    fixes = SimpleNamespace(time=np.array([5.0, 6.0]), latitude=np.array([0.1, 0.2]), longitude=np.array([0.3, 0.5]),
                            height=np.array([7.0, 9.0]))  # fmt: skip
    found = recorded_filter_run.outage_reference(
        SimpleNamespace(scenario=own, log=SimpleNamespace(reference=None, fixes=fixes))
    )
    assert (found.name, found.lever_arm) == ("the withheld fixes", (0.5, -1.5, 2.5))
    for name in ("time", "latitude", "longitude", "height"):
        np.testing.assert_array_equal(getattr(found, name), getattr(fixes, name))
    given = SimpleNamespace(scenario=own, log=SimpleNamespace(reference="r", fixes=fixes))
    assert recorded_filter_run.outage_reference(given) == "r"


def test_the_known_errors_of_a_unit_are_those_given_as_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    imu = {"grade": "ideal", "gyro_bias_deg_h": [3.0, -4.0, 5.0], "accel_bias_sigma_ug": 70.0}
    seen = []
    monkeypatch.setattr("sinssim.sensors.imu.compensation.compensate", lambda imu, known: seen.append(known) or "left")
    motion: Any = SimpleNamespace(prepared=SimpleNamespace(log=SimpleNamespace(imu="imu")))
    sensed = sense_recorded(scenario(imu=imu, compensation={"gyro_bias_sigma_deg_h": 1.0}), motion)
    assert (sensed.measured, sensed.imu) == ("imu", "left")
    (found,) = seen
    np.testing.assert_allclose(found.gyro.bias, np.array([3.0, -4.0, 5.0]) * np.pi / 648_000.0)
    assert found.accel.bias.tolist() == [0.0, 0.0, 0.0]


def test_a_filter_without_a_reference_is_compared_with_its_smoothed_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until the end of the run; the smoothed solution itself has no known error then."""
    where, seen = "sinssim.simulation.recorded_filter_run", []
    estimate = SimpleNamespace(smoothed=SimpleNamespace(solution="smoothed"), solution="aided")
    monkeypatch.setattr(f"{where}.aid_recorded", lambda *args, **options: estimate)
    monkeypatch.setattr(f"{where}.all_readings", lambda prepared: "readings")
    monkeypatch.setattr(f"{where}.as_reference", lambda name, solution: (name, solution))
    compared = make_dataclass("Compared", ["smoothed_error", "seconds"])(None, 0.0)
    monkeypatch.setattr(f"{where}.compare_recorded", lambda *args: seen.append(args) or compared)
    monkeypatch.setattr("sinssim.simulation.navigation_stage.recorded_start", lambda scenario, sensed: "first")
    prepared: Any = SimpleNamespace(log=SimpleNamespace(imu=SimpleNamespace(time=np.array([3.0, 9.0]))))
    for reference in (None, "given"):
        motion = RecordedMotion(prepared, reference)  # type: ignore[arg-type]
        aid(None, SimpleNamespace(truth=motion, imu="imu"))  # type: ignore[arg-type]
    assert seen == [
        (estimate, "readings", ("the smoothed solution", "smoothed"), 9.0), (estimate, "readings", "given", 9.0),
    ]  # fmt: skip
