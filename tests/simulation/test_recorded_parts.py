"""A summary, a run in words, and the parts of a run on recorded sensors, from numbers that are chosen."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.recording.store.directory import RunDirectory
from sinssim.simulation import outages
from sinssim.simulation.execute_log import RecordedMotion, _aid, _compared_with, _error, _height, _known_errors
from sinssim.simulation.finish import about, keep
from sinssim.simulation.result import Run
from sinssim.simulation.stages import Stages
from sinssim.strapdown.nav_error import NavError
from tests.recording.store.test_filter_streams import motion
from tests.recording.store.test_summary import ERROR
from tests.simulation.test_parts_of_a_run import scenario, truth


def test_the_height_of_recorded_sensors() -> None:
    """The first barometer with two readings; its interval is the median one."""
    m = SimpleNamespace(
        kind="baro-height", time=np.array([1.0, 1.5, 3.0, 3.25]), arrival=np.array([2.0, 3.0, 4.0, 5.0]),
        value=np.array([[7.0], [8.0], [9.0], [6.0]]),
    )  # fmt: skip
    sensed = [SimpleNamespace(measurements=one) for one in (SimpleNamespace(kind="heading"), Sized(m))]
    prepared = SimpleNamespace(log=SimpleNamespace(sensed=sensed))
    run = SimpleNamespace(scenario=SimpleNamespace(navigation=SimpleNamespace(vertical="baro-loop")))
    found = _height(run, prepared)
    assert (found.arrival.tolist(), found.value.tolist(), found.interval) == (
        [2.0, 3.0, 4.0, 5.0],
        [7.0, 8.0, 9.0, 6.0],
        0.5,
    )
    with pytest.raises(InputError, match="needs heights"):
        _height(run, SimpleNamespace(log=SimpleNamespace(sensed=sensed[:1])))
    run.scenario.navigation.vertical = "free"
    assert _height(run, prepared) is None


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
    run = Run(own)
    run.summary, run.about_filter = {"a": 1.5}, ("A line.",)
    place = keep(RunDirectory(tmp_path / "run"), run, "<p>page</p>")
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
    run = Run(scenario())
    assert repr(run) == "Run(x: not finished)"
    run.summary = {
        "status": "finished",
        "algorithms": {"euler": numbers(1.5), "poisson": dict.fromkeys(numbers(1.0))},
        "filter": {"smoothed": numbers(2.5)},
    }
    run.time, run.aided = np.array([2.5, 3.0, 47.5]), "aided"
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
    run = SimpleNamespace(aided=SimpleNamespace(estimate=estimate), solutions=solutions)
    given = SimpleNamespace(name="r.pos")
    assert _compared_with(run, given) == (given, "r.pos")
    reference, name = _compared_with(run, None)
    assert (name, reference.name, reference.latitude.tolist()) == (
        "the aided solution",
        "the aided solution",
        estimate.solution.latitude.tolist(),
    )
    estimate.smoothed = SimpleNamespace(solution=motion(90.0, "s"))
    reference, name = _compared_with(run, None)
    assert (name, reference.height.tolist()) == ("the smoothed solution", estimate.smoothed.solution.height.tolist())
    estimate.time = np.zeros(1)
    reference, name = _compared_with(run, None)
    assert (name, reference.longitude.tolist()) == ("the solution euler", solutions["euler"].longitude.tolist())
    assert _compared_with(SimpleNamespace(aided=None, solutions={"euler": solutions["euler"]}), None) == (None, None)
    unknown = _error(None, solutions["euler"])
    assert unknown.time.tolist() == [5.0, 6.0, 8.0]
    assert np.isnan([unknown.position_ned, unknown.velocity_ned, unknown.attitude]).all()
    assert _error(SimpleNamespace(error_of=lambda s: ("of", s)), "solution") == ("of", "solution")


def test_a_recorded_motion_before_navigation_is_its_start() -> None:
    found = RecordedMotion(truth(), 3.0, 9.0)
    assert found.state(np.float64(7.0)) is found.first
    rows = found.state(np.array([3.0, 5.0]))
    assert (rows.latitude.tolist(), rows.longitude.tolist(), rows.height.tolist()) == (
        [0.9] * 2,
        [0.3] * 2,
        [5000.0] * 2,
    )
    assert rows.velocity_ned.tolist() == [[10.0, 20.0, -1.0]] * 2
    assert rows.q_nb.tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2


def test_outages_of_a_run_and_of_further_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The growth of the error begins with each outage; a further pass has its own estimate and its number."""
    sigma = np.outer([1.0, 2.0, 3.0, 4.0], [3.0, 4.0, 12.0])
    estimate = SimpleNamespace(solution="own", smoothed=None, sigma=sigma)
    other = SimpleNamespace(solution="other", smoothed=SimpleNamespace(solution="smooth"), sigma=2.0 * sigma)
    double = NavError(ERROR.time, 2.0 * ERROR.position_ned, ERROR.velocity_ned, ERROR.attitude)
    errors = {"own": ERROR, "other": double, "smooth": ERROR}
    reference = SimpleNamespace(name="r", error_of=lambda solution: errors[solution])
    passed = []
    monkeypatch.setattr(outages, "_pass", lambda run, prepared, spans: passed.append(spans) or other)
    run = SimpleNamespace(aided=SimpleNamespace(estimate=estimate), scenario=SimpleNamespace(log="log"))
    log = SimpleNamespace(outages=((5.5, 8.0),), passes=(), reference=reference, fixes=None)
    found = outages.judged_outages(run, SimpleNamespace(log=log))
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
    found = outages.judged_outages(run, SimpleNamespace(log=log))
    assert passed == list(log.passes)
    shown = [(one["pass"], one["horizontal_error_m"], one["horizontal_sigma_m"]) for one in found.numbers["each"]]
    assert shown == [(1, 26.0, 20.0), (2, 34.0, 30.0), (2, pytest.approx(2.0), 40.0)]
    assert [one["smoothed_max_horizontal_error_m"] for one in found.numbers["each"]] == pytest.approx([13.0, 17.0, 1.0])
    assert [time.tolist() for time, _ in found.growth] == [[0.0, 1.0], [0.5, 2.5], [0.0, 1.0]]
    run.aided = None
    assert outages.judged_outages(run, SimpleNamespace(log=log)) is None


def test_withheld_fixes_judge_outages_if_there_is_no_reference() -> None:
    gnss = SimpleNamespace(lever_arm_m=(0.5, -1.5, 2.5))
    run = SimpleNamespace(scenario=SimpleNamespace(log=SimpleNamespace(gnss=gnss)))
    fixes = SimpleNamespace(time=np.array([5.0, 6.0]), latitude=np.array([0.1, 0.2]), longitude=np.array([0.3, 0.5]),
                            height=np.array([7.0, 9.0]))  # fmt: skip
    found = outages._reference(run, SimpleNamespace(log=SimpleNamespace(reference=None, fixes=fixes)))
    assert (found.name, found.lever_arm) == ("the withheld fixes", (0.5, -1.5, 2.5))
    for name in ("time", "latitude", "longitude", "height"):
        np.testing.assert_array_equal(getattr(found, name), getattr(fixes, name))
    assert outages._reference(run, SimpleNamespace(log=SimpleNamespace(reference="r", fixes=fixes))) == "r"


def test_the_known_errors_of_a_unit_are_those_given_as_numbers() -> None:
    imu = {"grade": "ideal", "gyro_bias_deg_h": [3.0, -4.0, 5.0], "accel_bias_sigma_ug": 70.0}
    found = _known_errors(SimpleNamespace(scenario=scenario(imu=imu)))
    np.testing.assert_allclose(found.gyro.bias, np.array([3.0, -4.0, 5.0]) * np.pi / 648_000.0)
    assert found.accel.bias.tolist() == [0.0, 0.0, 0.0]


def test_a_filter_without_a_reference_is_compared_with_its_smoothed_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until the end of the run; the smoothed solution itself has no known error then."""
    where, seen = "sinssim.estimation.from_scenario.recorded_run", []
    estimate = SimpleNamespace(smoothed=SimpleNamespace(solution="smoothed"), solution="aided")
    monkeypatch.setattr(f"{where}.aid_recorded", lambda *args, **options: estimate)
    monkeypatch.setattr(f"{where}.all_readings", lambda prepared: "readings")
    monkeypatch.setattr(f"{where}.as_reference", lambda name, solution: (name, solution))
    monkeypatch.setattr(
        f"{where}.compare_recorded", lambda *args: seen.append(args) or SimpleNamespace(smoothed_error=None)
    )
    monkeypatch.setattr("sinssim.simulation.execute_log.first_of", lambda run, prepared: "first")
    run = SimpleNamespace(time=np.array([3.0, 9.0]), compensated="imu")
    prepared = SimpleNamespace(log=SimpleNamespace(reference=None))
    _aid(run, prepared, None, None)
    prepared.log.reference = "given"
    _aid(run, prepared, None, None)
    assert seen == [
        (estimate, "readings", ("the smoothed solution", "smoothed"), 9.0), (estimate, "readings", "given", 9.0),
    ]  # fmt: skip
