"""Flights by their own navigator: equal to those by the truth without errors, displaced by the errors otherwise."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

import sinssim
from sinssim.content import package_content
from sinssim.data import ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, RunError
from sinssim.recording.page import page_of
from sinssim.scenario import Scenario, filter_model, load_scenario
from sinssim.simulation import guided_passes as closing
from sinssim.simulation.guided_passes import NEAR, LiveFlight, apart, by_sections, closed_loop, solution_errors
from sinssim.simulation.total_system_error import ending
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.flight.guidance import QUANTITIES as ALL
from sinssim.truth.flight.guidance import AirData, Guidance, SolutionErrors
from sinssim.truth.flight.legs.landing import LandLeg
from sinssim.truth.trajectory import Trajectory
from tests.slow import slow

KNOT = 0.5144444444444445
SCHULER = math.sqrt(9.81 / 6.378e6)


def plan(
    source: str = "quaternion",
    initial: dict[str, float] | None = None,
    navigator: tuple[Any, ...] = (),
    **guidance: Any,
) -> Scenario:
    """Return a flight of a minute to a waypoint in the north, from the equator, with sensors without errors."""
    return Scenario.model_validate(
        {
            "name": "north",
            "flight": {
                "aircraft": "737",
                "start": {"on": "air", "latitude_deg": 0.0, "longitude_deg": 10.0, "altitude_m": 5000.0},
                "guidance": {"source": source, **guidance},
                "legs": [{"type": "waypoint", "name": "N", "latitude_deg": 0.095, "longitude_deg": 10.0}],
            },
            "imu": {"grade": "ideal", "rate_hz": 50.0},
            "navigation": {"algorithms": ["quaternion"], "vertical": "truth", "initial_error": initial or {}},
            "navigator": navigator,
        }
    )  # fmt: skip


def test_without_errors_it_is_the_flight_by_the_truth() -> None:
    path, guided = closed_loop(plan())
    assert len(guided.moved) == 1
    assert guided.moved[0] < 1e-4
    assert apart(path, guided.by_truth) == guided.moved[0]


@pytest.fixture(scope="module")
def drifted() -> sinssim.Run:
    """A velocity error of 1 m/s to the east at the start: the navigator thinks that it drifts to the east."""
    run = sinssim.run(plan(initial={"velocity_east_mps": 1.0}))
    assert isinstance(run, sinssim.Run)
    return run


def test_the_true_path_is_displaced_by_what_the_navigator_believes(drifted: sinssim.Run) -> None:
    """δv sin(ω t)/ω at the end, less the way that the autopilot needs to follow a drift of 1 m/s, of seconds."""
    entry = drifted.parts["guidance"].entry
    (leg,) = entry["legs"]
    believed = math.sin(SCHULER * leg["end_s"]) / SCHULER
    assert 50.0 < believed < 60.0
    assert leg["navigation_error_m"] == pytest.approx(believed, rel=2e-3)
    assert -leg["right_m"] == pytest.approx(believed, rel=0.05)
    assert abs(leg["along_m"]) < 2.0
    assert entry["displacement_max_m"] == pytest.approx(math.hypot(leg["right_m"], leg["along_m"]), rel=0.01)


def test_the_waypoint_is_missed_on_the_true_path(drifted: sinssim.Run) -> None:
    """The place of the true path at the end, by plane geometry about the waypoint, which the navigator sees ahead."""
    entry, path = drifted.parts["guidance"].entry, drifted.truth.trajectory
    (miss,) = entry["waypoints"]
    end = path.state(np.array([miss["time_s"]]))
    east = 6378137.0 * float(end.longitude[0] - math.radians(10.0))
    north = 6335439.3 * float(end.latitude[0] - math.radians(0.095))  # radius of the meridian at the equator
    course = math.atan2(end.velocity_ned[0, 1], end.velocity_ned[0, 0])
    assert miss["waypoint"] == "N"
    assert miss["left_to_go_m"] == pytest.approx(-north * math.cos(course) - east * math.sin(course), rel=1e-3)
    assert miss["right_m"] == pytest.approx(east * math.cos(course) - north * math.sin(course), rel=1e-3)
    assert miss["right_m"] < -55.0


def test_a_navigator_of_somebody_else_guides(drifted: sinssim.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has the same errors of the start, and its own height and integration: a hundredth of the displacement."""
    monkeypatch.setenv("SINSSIM_PROGRAMS", "allow")
    file = package_content("scenarios") / "new_navigator" / "python" / "my_navigator.py"
    table = {"name": "mine", "command": [sys.executable, "-I", "-S", str(file)]}
    run = sinssim.run(plan("mine", {"velocity_east_mps": 1.0}, navigator=(table,)))
    assert isinstance(run, sinssim.Run)
    guided = run.truth.guided
    assert guided is not None
    assert guided.source == "mine"
    assert guided.moved[-1] < NEAR < 50.0 < guided.moved[0]
    assert apart(run.truth.trajectory, drifted.truth.trajectory) < 0.5
    assert run.parts["guidance"].entry["displacement_max_m"] > 50.0


def test_a_program_of_another_version_cannot_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SINSSIM_PROGRAMS", "allow")
    (tmp_path / "old.py").write_text("print('sinssim 2')")
    table = {"name": "old", "command": [sys.executable, "-I", "-S", str(tmp_path / "old.py")], "form": "text"}
    with pytest.raises(RunError, match="the flight cannot follow old: it answers in version 2 of the prot") as error:
        sinssim.run(plan("old", {}, navigator=(table,)), tmp_path / "run")
    assert error.value.exit_code == 2
    assert not (tmp_path / "run").exists()


SAME = r"""
import struct, sys
import numpy as np
import sinssim
read, rows = sys.stdin.buffer.read, []
read(16)
while True:
    kind, index, size = struct.unpack("<HHI", read(8))
    data = read(size)
    if kind == 1: numbers = struct.unpack_from("<62d", data)
    if kind == 3: rows.append(struct.unpack("<8d", data))
    if kind == 5: break
rows, x = np.array(rows), np.array(numbers[2:12])
imu = sinssim.ImuData(np.append(numbers[1], rows[:, 0]), rows[:, 2:5].copy(), rows[:, 5:8].copy())
s = sinssim.navigate(imu, sinssim.NavState(x[0], x[1], x[2], x[3:6], x[6:10]), algorithm="quaternion", vertical="free")
states = np.column_stack([s.time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb])
out = sys.stdout.buffer
out.write(struct.pack("<8sII", b"SINSSIM\0", 1, 0))
for row in states: out.write(struct.pack("<HHI11d", 6, 0, 88, *row))
"""


@pytest.mark.slow
def test_the_same_engine_in_a_program_flies_the_same_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SINSSIM_PROGRAMS", "allow")
    (tmp_path / "same.py").write_text(SAME)
    table = {"name": "mine", "command": [sys.executable, str(tmp_path / "same.py")]}
    scenarios = [plan(source, {"velocity_east_mps": 1.0}, navigator=(table,)) for source in ("quaternion", "mine")]
    free = [
        s.model_copy(update={"navigation": s.navigation.model_copy(update={"vertical": "free"})}) for s in scenarios
    ]
    (path, _), (other, guided) = map(closed_loop, free)
    assert guided.moved[0] > 50.0
    assert apart(path, other) < 1e-6


def test_the_loop_is_closed(drifted: sinssim.Run) -> None:
    """One more pass with the errors of the last one does not move the path."""
    scenario, path = drifted.scenario, drifted.truth.trajectory
    guided = drifted.truth.guided
    assert guided is not None
    assert guided.left < NEAR < guided.moved[0]
    from sinssim.scenario.true_motion import true_motion

    assert apart(true_motion(scenario, errors=solution_errors(scenario, path)), path) < NEAR


def with_air_data(
    quantities: tuple[str, ...], *, sections: bool = False, **aiding: Any
) -> tuple[Trajectory, Trajectory]:
    """Return a flight of two minutes by ideal inertial sensors and an air-data sensor, and that by the truth."""
    contents = plan(quantities=quantities).contents()
    contents["flight"]["legs"] = [{"type": "turn", "heading_deg": 60.0}, {"type": "hold", "duration_s": 100.0}]
    scenario = Scenario.model_validate({**contents, "aiding": aiding, "filter": {}})
    path, guided = closed_loop(scenario)
    if sections:
        assert not guided.in_sections
        assert apart(by_sections(scenario, guided.by_truth, lambda fraction: None)[0], path) < 3e-3
    return path, guided.by_truth


@pytest.mark.parametrize("sections", [False, *slow(True)])
def test_the_autopilot_holds_the_airspeed_of_the_sensor(sections: bool) -> None:
    """A reading that is 2 % too large lets the calibrated airspeed, which is held, fall by 2 %; the throttle needs some
    of the two minutes. By passes and by sections it is the same flight."""
    sensor = {"sigma_mps": 1e-9, "scale_ppm": 2e4, "rate_hz": 10.0, "latency_s": 0.2}
    path, by_truth = with_air_data(ALL, sections=sections, airspeed=sensor)
    seen, true = (flown.channels["calibrated_airspeed_mps"].values[-1] for flown in (path, by_truth))
    assert seen == pytest.approx(true / 1.02, rel=1e-3)


def test_an_airspeed_sensor_without_errors_changes_nothing() -> None:
    """At the rate of the autopilot; one of 1 Hz is up to a second late, and is seen in the turn."""
    path, by_truth = with_air_data(ALL, airspeed={"sigma_mps": 1e-9, "rate_hz": 30.0})
    assert apart(path, by_truth) < NEAR
    slow_path, _ = with_air_data(ALL, airspeed={"sigma_mps": 1e-9, "rate_hz": 1.0})
    assert 0.01 < apart(slow_path, by_truth) < 10.0


@pytest.mark.parametrize(("quantities", "lower"), [(("position", "velocity", "attitude"), 30.0), (ALL, 0.0)])
def test_a_height_that_the_navigator_does_not_give_is_that_of_the_barometer(
    quantities: tuple[str, ...], lower: float
) -> None:
    barometer = {"sigma_m": 1e-9, "bias_m": 30.0, "bias_sigma_m": 1e-9, "rate_hz": 10.0}
    path, by_truth = (flown.state(110.0).height for flown in with_air_data(quantities, baro=barometer))
    assert float(by_truth - path) == pytest.approx(lower, abs=0.05)


def test_a_reading_belongs_to_the_instant_before_its_lag(monkeypatch: pytest.MonkeyPatch) -> None:
    """Climbing by 100 m/s, readings of 105 and 207 m that arrive 0.2 s after 11 and 12 s of the clock."""
    measurements = SimpleNamespace(arrival=np.array([11.2, 12.2]), value=np.array([[105.0], [207.0]]))
    sensor = SimpleNamespace(latency_s=0.2, read=lambda vehicle: (SimpleNamespace(measurements=measurements),))
    monkeypatch.setattr(closing, "air_sensors", lambda scenario: {"height": sensor})
    path: Any = SimpleNamespace(start=10.0, state=lambda time: SimpleNamespace(height=100.0 * (time - 10.0)))
    time, arrival, errors = closing._readings(plan(), path)["height"]
    np.testing.assert_allclose((time, arrival, errors), ([1.0, 2.0], [1.2, 2.2], [5.0, 7.0]), rtol=1e-12)


def test_errors_across_the_date_line_and_north() -> None:
    """From 180° W − ε to 180° E − ε are −2 ε, and from a heading of 1° to one of 359° are −2°."""
    none, still, c, s = np.zeros(1), np.zeros((1, 3)), math.cos(math.radians(0.5)), math.sin(math.radians(0.5))
    here = NavState(none, 1e-7 - np.pi + none, none, still, np.array([[c, 0.0, 0.0, s]]))
    there = NavSolution(none, none, np.pi - 1e-7 + none, none, still, np.array([[c, 0.0, 0.0, -s]]), none)
    path: Any = SimpleNamespace(state=lambda time: here)
    (errors,) = closing._state_errors(plan(), path, there, np.zeros(1, np.intp))
    assert errors[1] == pytest.approx(-2e-7, rel=1e-6, abs=0.0)
    assert errors[8] == pytest.approx(math.radians(-2.0))


def test_both_alignments_come_before_the_first_section() -> None:
    def lasting(alignment: float | None, of_filter: float | None) -> float:
        navigation = SimpleNamespace(alignment=None if alignment is None else SimpleNamespace(duration_s=alignment))
        aided: Any = SimpleNamespace(navigation=navigation, filter=SimpleNamespace(alignment_s=of_filter))
        return closing._alignment(aided)

    assert [lasting(60.0, 30.0), lasting(60.0, None), lasting(None, 30.0)] == [90.0, 60.0, 30.0]


def sections_of(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(closing, "_SHORTEST", seconds)
    monkeypatch.setattr(closing, "_SECTIONS", 1000)


def test_by_sections_it_is_the_same_flight(drifted: sinssim.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    sections_of(20.0, monkeypatch)
    guided = drifted.truth.guided
    assert guided is not None
    fractions: list[float] = []
    path, moved = by_sections(drifted.scenario, guided.by_truth, fractions.append)
    assert len(moved) == 3
    assert max(moved) < NEAR
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert apart(path, drifted.truth.trajectory) < 1e-4


@pytest.mark.parametrize("seconds", [8.0, *slow(1.0)])
def test_later_than_a_section_the_loop_is_closed_step_by_step(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the autopilot sees in a section was computed before it began: no trial changes a bit, none is a pass."""
    scenario = plan(initial={"velocity_east_mps": 5.0}, latency_s=1.2 * seconds)
    by_passes, guided = closed_loop(scenario)
    assert guided.moved[0] > 100.0
    sections_of(seconds, monkeypatch)
    path, moved = by_sections(scenario, guided.by_truth, lambda fraction: None)
    assert len(moved) >= 45.0 / seconds
    assert set(moved) == {0.0}
    assert apart(path, by_passes) < 1e-4


@pytest.mark.parametrize(
    ("moved", "left"), [([3.0], 3.0), ([3.0, 0.3], 0.3), ([100.0, 1.0, 0.1], 0.01), ([9.0, 100.0, 1.0, 3.0], 3.0)]
)
def test_what_is_left_follows_from_the_gains(moved: list[float], left: float) -> None:
    """The slower of the last two gains; without two of them the last move."""
    assert closing._to_go(moved) == pytest.approx(left)


def test_the_share_of_a_change_is_the_largest_of_its_quantities() -> None:
    """Metres of latitude and height are compared with each other, degrees with degrees; the second change of the
    attitude is a twentieth of the first, of the others a hundredth, and rows that only one flight has do not count."""

    def errors(position_m: float, velocity: float, attitude: float, rate: float = 0.0, rows: int = 5) -> SolutionErrors:
        values = np.zeros((rows, 12))
        values[2] = [position_m / 6378137.0, 0.0, 1e-3 * position_m, 0, velocity, 0, attitude, 0, 0, 0, 0, rate]
        values[5:] = 1e3
        return SolutionErrors(Guidance(source="quaternion"), values)

    first = errors(0.0, 0.0, 0.0)
    assert closing._share([first, errors(100.0, 2.0, 0.1, rows=9), errors(101.0, 1.98, 0.105)]) == pytest.approx(0.05)
    assert closing._share([first, errors(100.0, 2.0, 0.1), errors(100.0, 3.0, 0.1)]) == pytest.approx(0.5)
    assert closing._share([first, errors(100.0, 2.0, 0.1), errors(100.0, 2.0, 0.1, 1e-9)]) == np.inf
    assert closing._share([first, first, first]) == 0.0


def test_a_pass_that_would_move_it_by_less_is_not_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Passes move the path by 1 m and 5 cm; the errors change by 1 m, 5 cm, and 0.5 mm: a further pass is worth
    0.5 mm."""
    rows = iter([1.0, 1.05, 1.0505])
    moves = iter([1.0, 0.05])

    def errors(scenario: Scenario, path: Any) -> SolutionErrors:
        return SolutionErrors(Guidance(source="quaternion"), np.full((3, 12), next(rows)) * ([0, 0, 1] + [0] * 9))

    monkeypatch.setattr(closing, "true_motion", lambda *given, **keys: None)
    monkeypatch.setattr(closing, "solution_errors", errors)
    monkeypatch.setattr(closing, "apart", lambda one, other: next(moves))
    _, guided = closed_loop(plan())
    assert guided.moved == (1.0, 0.05)
    assert guided.left == pytest.approx(0.05 * 0.0005 / 0.05, rel=1e-9)


def test_what_does_not_settle_is_flown_in_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gains of less than a factor of 3, twice: as if a gate opened in one pass and closed in the next."""
    assert not closing._settles_slowly([100.0, 90.0])
    assert not closing._settles_slowly([100.0, 90.0, 0.9])
    assert closing._settles_slowly([1000.0, 100.0, 90.0, 80.0])
    sections_of(20.0, monkeypatch)
    monkeypatch.setattr(closing, "_MOST", 1)
    run = sinssim.run(plan(initial={"velocity_east_mps": 1.0}))
    assert isinstance(run, sinssim.Run)
    entry = run.summary["guidance"]
    assert entry["in_sections"] is True
    assert len(entry["moved_m"]) == 3
    assert "The plan was flown in 3 sections, because a decision of the navigator" in page_of(run.exhibits)


def test_increments_close_on_the_truth_as_those_of_any_flight(drifted: sinssim.Run) -> None:
    path = drifted.truth.trajectory
    imu = path.increments(100.0)
    solution = sinssim.navigate(imu, path.state(imu.time[0]), vertical="truth", height=path.state(imu.time).height)
    assert navigation_error(path.state(imu.time), solution).horizontal.max() < 1e-5


def test_a_late_navigator_flies_on() -> None:
    """Half a second late the aircraft believes to be 70 m behind its place: it reaches the waypoint later."""
    path, guided = closed_loop(plan(latency_s=0.5))
    assert path.end - guided.by_truth.end == pytest.approx(0.5, abs=0.05)
    state = path.state(np.linspace(path.start, path.end, 200))
    assert np.isfinite(state.velocity_ned).all()
    assert np.ptp(state.height) < 20.0


def test_a_flight_into_the_ground_is_a_result(capsys: pytest.CaptureFixture[str]) -> None:
    """A height that is 150 m too large, and a descent to 100 m: the ground is reached where 150 m are believed."""
    from rich.console import Console

    from sinssim.recording.console import show

    low = plan().flight
    assert low is not None
    start = {"on": "air", "latitude_deg": 0.0, "longitude_deg": 10.0, "altitude_m": 350.0}
    legs = [{"type": "descend", "altitude_m": 100.0}, {"type": "hold", "duration_s": 60.0}]
    contents = plan(initial={"height_m": 150.0}).contents()
    contents["flight"] |= {"start": start, "legs": legs}
    contents["navigation"]["vertical"] = "free"
    run = sinssim.run(Scenario.model_validate(contents))
    assert isinstance(run, sinssim.Run)
    assert run.summary["status"] == "finished"
    assert run.summary["guidance"]["ended_early"] == "leg 1 (descend): the aircraft hit the ground"
    path, end = run.truth.trajectory, run.summary["guidance"]["end"]
    last = path.state(np.array([path.end]))
    assert end["time_s"] == path.end
    assert abs(end["height_m"]) < 5.0
    assert end["height_m"] == last.height[0]
    assert (end["latitude_deg"], end["longitude_deg"]) == pytest.approx((0.0, 10.0), abs=0.1)
    before = path.state(np.array([path.end - 0.5])).height[0]
    assert end["descent_mps"] == pytest.approx((before - last.height[0]) / 0.5, rel=0.2)
    assert end["threshold_m"] is None
    assert run.solutions["quaternion"].height[-1] == pytest.approx(150.0, abs=15.0)
    show(run.exhibits, Console(width=400))
    out = capsys.readouterr().out
    assert f"The flight ends early, at {path.end:.1f} s, in leg 1 (descend): the aircraft hit the ground. It is" in out
    assert f"sinking at {end['descent_mps']:.1f} m/s." in out


def test_the_end_of_an_approach_is_told_from_the_threshold() -> None:
    """A tenth of a degree of latitude from the equator: a degree of WGS 84's meridian is 110 574.3 m there."""
    leg = LandLeg(type="land", latitude_deg=0.0, longitude_deg=10.0, heading_deg=0.0, altitude_m=300.0)
    flight = plan().flight
    assert flight is not None
    path = sinssim.fly(load_scenario("parked", ["parked.latitude_deg=0.1", "parked.longitude_deg=10"]))
    found = ending(flight.model_copy(update={"legs": (*flight.legs, leg)}), path)
    assert found["threshold_m"] == pytest.approx(11057.43 * (1.0 + 300.0 / 6335439.0), abs=0.05)
    assert found["descent_mps"] == pytest.approx(0.0, abs=1e-9)
    assert ending(flight, path)["threshold_m"] is None


def test_what_is_not_navigated_is_true() -> None:
    """A navigator with an error in position alone does not guide by attitude."""
    _, guided = closed_loop(plan(initial={"east_m": 200.0}, quantities=("attitude", "velocity", "height")))
    assert guided.moved[0] < 0.5


def test_whose_air_data_the_autopilot_sees_is_said(drifted: sinssim.Run) -> None:
    part = drifted.parts["guidance"]
    assert part.entry["seen"] == {"airspeed": "true", "height": "solution"}
    said = next(replace(part, entry={**part.entry, "seen": {"airspeed": "sensor", "height": "sensor"}}).brief({}))
    assert "a perfect navigator with perfect air data would have taken it" in said.text
    assert "Its airspeed is that of [aiding.airspeed], its height that of [aiding.baro]." in said.text


def test_the_console_and_the_report_tell_it(drifted: sinssim.Run, capsys: pytest.CaptureFixture[str]) -> None:
    from rich.console import Console

    from sinssim.recording.console import show

    show(drifted.exhibits, Console(width=120))
    out = capsys.readouterr().out
    assert "The flight follows quaternion: at its end it is" in out
    assert "Its airspeed is true, its height that of the solution." in " ".join(out.split())
    assert "Waypoints of the navigator on the true path" in out
    from sinssim.scenario.plan_summary import plan_lines

    assert "guidance    by its navigator, source = quaternion" in list(plan_lines(drifted.scenario))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ('flight.guidance.source="euler"', '"euler" is not computed in this scenario: it has quaternion'),
        ('flight.guidance.source="aided"', r'"aided" needs a \[filter\]'),
        ('flight.guidance.quantities=["wind"]', "wind"),
        ("flight.guidance.quantities=[]", "quantities"),
        ("flight.guidance.latency_s=11", "latency_s"),
        ("flight.guidance.rate_hz=60", "rate_hz"),
    ],
)
def test_what_cannot_guide_is_refused(change: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scenario("first_flight", ['navigation.algorithms=["quaternion"]', change])


def test_a_budget_is_that_of_the_path_by_the_navigator() -> None:
    """Half a second longer than by the truth is the flight of a late navigator; an alignment has no such flight."""
    late = plan(latency_s=0.5)
    assert sinssim.budget(late).time[-1] == pytest.approx(closed_loop(late)[0].end, abs=0.02)
    with pytest.raises(InputError, match=r'flight\.guidance\.source = "quaternion": .*`ensemble` and `budget` fly'):
        sinssim.align(late)


@pytest.mark.slow
def test_every_run_of_an_ensemble_flies_by_its_own_navigator() -> None:
    """The errors of each run are those of a single run with its seed, on a path of its own."""
    noisy = plan().model_copy(update={"imu": plan().imu.model_copy(update={"grade": "tactical"})})
    result = sinssim.ensemble(noisy, 2, threads=1)
    ends = []
    for number, seed in enumerate(result.errors.seed):
        run = sinssim.run(noisy.model_copy(update={"seed": int(seed)}))
        assert isinstance(run, sinssim.Run)
        assert result.errors.end[number] == run.truth.time[-1]
        np.testing.assert_array_equal(result.errors.final[number, :3], run.errors["quaternion"].position_ned[-1])
        ends.append(run.truth.trajectory.state(50.0).longitude)
    assert ends[0] != ends[1]


@pytest.mark.slow
def test_a_whole_flight() -> None:
    """84 minutes: without errors 1 mm, with a laser unit's at most four flights after the first."""
    sources = ['navigation.algorithms=["quaternion"]', 'flight.guidance.source="quaternion"']
    _, guided = closed_loop(load_scenario("first_flight", [*sources, "imu.grade=ideal"]))
    assert guided.moved[-1] < 1e-3
    assert len(guided.moved) == 1
    _, guided = closed_loop(load_scenario("first_flight", sources))
    assert len(guided.moved) <= 4
    assert guided.left < 1e-3
    for before, after in zip(guided.moved[:-1], guided.moved[1:], strict=True):
        assert after < before / 50.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        ["first_flight", 'flight.guidance.source="quaternion"', 'navigation.algorithms=["quaternion"]'],
        ["first_flight", 'flight.guidance.source="poisson-1"', 'navigation.algorithms=["poisson-1"]',
         "imu.rate_hz=50", "flight.guidance.latency_s=0.4", "flight.guidance.rate_hz=10"],
        ["aided_airliner", 'flight.guidance.source="aided"'],
    ],
    ids=["laser", "late", "aided"],
)  # fmt: skip
def test_by_passes_and_by_sections(settings: list[str]) -> None:
    """An hour and more: the two ways to close the loop agree to 1 cm."""
    scenario = filter_model.with_states(load_scenario(settings[0], settings[1:]))
    path, guided = closed_loop(scenario)
    assert not guided.in_sections
    other, moved = by_sections(scenario, guided.by_truth, lambda fraction: None)
    assert max(moved) < NEAR
    assert apart(path, other) < 1e-2


@pytest.mark.parametrize(("distance_m", "followed", "settings"), [
    (30e3, 0.05, ["flight.legs.2.altitude_m=800", "flight.legs.3.latitude_deg=-1.0787", "imu.rate_hz=20"]),
    *slow((300e3, 0.02, list[str]())),
])  # fmt: skip
def test_a_heading_error_turns_the_true_track(distance_m: float, followed: float, settings: list[str]) -> None:
    """From rest on the equator to the north: 0.1° over 300 km miss the waypoint by 524 m to the left.

    There the Earth's rate, resolved by the wrong heading, causes errors along the track alone. On the short way, the
    autopilot follows a believed path 1.3 m to the right of the planned one.
    """
    run = sinssim.run(load_scenario("heading_error", settings))
    assert isinstance(run, sinssim.Run)
    (miss,) = run.parts["guidance"].entry["waypoints"]
    assert miss["right_m"] == pytest.approx(-distance_m * math.radians(0.1), rel=0.01)
    errors = run.parts["planned_path"].errors
    last = np.flatnonzero(errors.leg == 2)[-1]
    assert errors.tse[last, 0] == pytest.approx(-distance_m * math.radians(0.1), rel=followed)


@pytest.mark.slow
def test_an_ensemble_of_crossings_misses_as_its_budget_predicts() -> None:
    """The first waypoint, after an hour: six runs, and the sum of (miss/σ)² in its central interval of 99.9 %."""
    place = '[{name="20W", latitude_deg=53.0, longitude_deg=-20.0}]'
    scenario = load_scenario("oceanic_crossing", ["imu.rate_hz=10", f"flight.legs.1.waypoints={place}"])
    (predicted,) = sinssim.budget(scenario).waypoints
    missed = sinssim.ensemble(scenario, 6, threads=1).errors.column("miss_1_m")[:, -1]
    low, high = chi2.ppf([0.0005, 0.9995], 6)
    assert low < float(np.sum(((missed - predicted.mean) / predicted.sigma) ** 2)) < high


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 7))
def test_a_drag_off_displaces_the_aircraft_against_what_it_believes(seed: int) -> None:
    """2 m/s over the time of the ramp, if nothing rejects it: the autopilot holds the believed track within some 10 m,
    so the true one is displaced as far to the other side. The gate rejects it from its first velocities on; the
    monitor alone withdraws the fixes before 60 s of it are over."""

    def flown(*settings: str) -> tuple[Any, Any, float]:
        run = sinssim.run(load_scenario("spoofed_airliner", [f"seed={seed}", *settings]))
        assert isinstance(run, sinssim.Run)
        errors, summary = run.parts["planned_path"].errors, run.summary["filter"]
        return errors, summary, 2.0 * float(errors.time[-1] - 400.0)

    errors, summary, forged = flown("filter.gate=0")
    assert summary["faults"][0]["refused"] == 0
    assert errors.nse[-1, 0] == pytest.approx(forged, rel=0.03)
    assert errors.tse[-1, 0] == pytest.approx(-forged, rel=0.03, abs=10.0)
    errors, summary, _ = flown()
    assert summary["faults"][0]["first_refused_s"] <= 402.0
    assert np.abs(errors.tse[-1, 0]) < 60.0
    errors, summary, forged = flown("filter.gate=0", "filter.monitor_s=60")
    assert 400.0 <= summary["sensors"]["gnss-velocity"]["withdrawn_s"] < 460.0
    assert np.abs(errors.tse[-1, 0]) < 0.5 * forged


def test_the_errors_of_a_trial_continue_those_before() -> None:
    """At 1 Hz a trial knows 4 s, of which the first 2 have been flown; what comes after moves with its last row."""
    rows = np.arange(72.0).reshape(6, 12)
    fresh = 1000.0 + np.arange(48.0).reshape(4, 12)
    readings = AirData(np.arange(6.0), np.arange(6.0) + 0.5, 10.0 * np.arange(6.0))
    later = AirData(np.arange(5.0) - 0.25, np.arange(5.0), 100.0 + np.arange(5.0))
    guidance = plan().flight.guidance.model_copy(update={"rate_hz": 1.0})  # type: ignore[union-attr]
    believed = SolutionErrors(guidance, rows, airspeed=readings)
    found = closing._continued(believed, SolutionErrors(guidance, fresh, airspeed=later), 2.0)
    np.testing.assert_array_equal(found.values[:4], [*rows[:2], *fresh[2:]])
    np.testing.assert_array_equal(found.values[4:, :9], rows[4:, :9] + fresh[-1, :9] - rows[3, :9])
    np.testing.assert_array_equal(found.values[4:, 9:], rows[4:, 9:])
    assert found.airspeed is not None
    np.testing.assert_array_equal(found.airspeed.time, [0.0, 1.0, 2.75, 3.75, 4.0, 5.0])
    np.testing.assert_array_equal(found.airspeed.errors, [0.0, 10.0, 103.0, 104.0, 40.0, 50.0])
    assert found.height is None


def test_a_section_that_does_not_settle_is_told(drifted: sinssim.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each trial ends 5 m from the one before."""
    logs = (SimpleNamespace(position_ecef=np.array([[0.0, 0.0, 5.0 * (k % 2)]])) for k in range(100))

    class Flying:
        def __init__(self, *given: Any) -> None: ...
        def __enter__(self) -> Flying:
            return self

        def __exit__(self, *given: Any) -> None: ...
        def fly(self, until: float, believed: Any) -> Any:
            return next(logs), False

        def keep(self, *, kept: bool) -> None: ...

    for name, fake in (("SectionedFlight", Flying), ("solution_errors", lambda *given: None),
                       ("true_motion", lambda *given, **keys: None), ("_continued", lambda *given: None),
                       ("_alignment", lambda scenario: 7.5), ("_TRIALS", 3)):  # fmt: skip
        monkeypatch.setattr(closing, name, fake)
    long: Any = SimpleNamespace(start=0.0, end=1600.0)
    with pytest.raises(RunError) as error:
        by_sections(drifted.scenario, long, lambda fraction: None)
    assert str(error.value) == (
        "the flight by quaternion does not settle between 0 and 107.5 s: after 3 trials its path still moves by 5 m "
        "from one trial to the next."
    )


def test_a_block_that_turns_has_no_errors_of_rates() -> None:
    turning: Any = SimpleNamespace(imu=SimpleNamespace(rotation="continuous"))
    none: Any = SimpleNamespace(imu=None, perfect=SimpleNamespace(imu=None))
    assert not closing._rate_errors(turning, none, np.zeros(4)).any()


def test_errors_of_the_rates_are_about_the_axes_of_the_vehicle() -> None:
    """A block turned by 90° to the right: its forward axis is the vehicle's right one. 1 mrad/s over the first second,
    3 mrad/s over the second, each as a mean since the instant before."""
    time = np.arange(0.0, 2.01, 0.5)
    measured = ImuData(time, np.outer([0.5, 0.5, 1.5, 1.5], [1e-3, 0.0, 0.0]), np.zeros((4, 3)))
    ideal = ImuData(time, np.zeros((4, 3)), np.zeros((4, 3)))
    sensed: Any = SimpleNamespace(imu=measured, perfect=SimpleNamespace(imu=ideal))
    turned: Any = SimpleNamespace(imu=SimpleNamespace(rotation=None))
    with pytest.MonkeyPatch.context() as patch:
        s = math.sqrt(0.5)
        patch.setattr(closing, "mounting", lambda scenario: SimpleNamespace(q_bs=np.array([s, 0.0, 0.0, s])))
        found = closing._rate_errors(turned, sensed, np.array([1.0, 2.0]))
    np.testing.assert_allclose(found, [[0.0, 1e-3, 0.0], [0.0, 3e-3, 0.0]], atol=1e-12)


def test_errors_are_those_of_the_last_solution_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solutions at 10.5, 10.9 and 11.4 s, seen 0, 0.5 and 1 s after a start at 10 s: none, the first, the second."""
    solution: Any = SimpleNamespace(time=np.array([10.5, 10.9, 11.4]))
    path: Any = SimpleNamespace(start=10.0)
    monkeypatch.setattr(closing, "_state_errors", lambda s, p, solution, rows: np.outer(rows + 1.0, np.ones(9)))
    monkeypatch.setattr(closing, "_rate_errors", lambda s, sensed, time: np.outer(time, np.ones(3)))
    sensed: Any = None
    found = closing._errors_at(plan(), path, sensed, solution, np.array([0.0, 0.5, 1.0]))
    assert found[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert found[:, 9].tolist() == [0.0, 10.5, 11.0]


@pytest.mark.parametrize(("quantities", "seen"), [(ALL, ["airspeed"]), (("position",), ["airspeed", "height"])])
def test_which_air_data_the_autopilot_sees(quantities: tuple[str, ...], seen: list[str]) -> None:
    contents = plan(quantities=quantities).contents()
    scenario = Scenario.model_validate({**contents, "aiding": {"airspeed": {}, "baro": {}}, "filter": {}})
    assert list(closing.air_sensors(scenario)) == seen
    assert closing.air_sensors(plan(quantities=quantities)) == {}


@pytest.mark.parametrize(
    ("moved", "slowly"),
    [([], False), ([8.0], False), ([9.0, 8.0], False), ([9.0, 8.0, 4.0], True), ([9.0, 8.0, 2.5], False),
     ([9.0, 2.0, 1.9], False), ([100.0, 9.0, 8.0, 4.0], True)],
)  # fmt: skip
def test_passes_that_gain_little_twice(moved: list[float], slowly: bool) -> None:
    """A gain of at least three in one of the last two is enough."""
    assert closing._settles_slowly(moved) is slowly


def test_the_passes_of_a_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each flies with the errors on the one before, moves the path by 4 m, 1.1 mm and 0.9 mm, and has half of the
    progress that is left; the passes of a loop that gains little are given up for sections."""
    moves, reported, flights = iter([4.0, 1.1e-3, 9e-4, 5.0, 4.0, 3.0]), list[float](), list[Any]()

    def flown(scenario: Scenario, report: Any, meanwhile: Any = None, *, errors: Any) -> str:
        flights.append((errors, meanwhile))
        report(0.5)
        return f"path {len(flights) - 1}"

    met: list[Any] = []
    monkeypatch.setattr(closing, "true_motion", flown)
    monkeypatch.setattr(closing, "solution_errors", lambda scenario, path: f"errors on {path}")
    monkeypatch.setattr(closing, "_share", lambda errors: 1.0)
    monkeypatch.setattr(closing, "apart", lambda one, other: met.append((one, other)) or next(moves))
    path, guided = closed_loop(plan(), reported.append, print)
    assert flights == [("none", print), *((f"errors on path {k}", None) for k in range(3))]
    assert met == [(f"path {k}", f"path {k + 1}") for k in range(3)]
    assert (path, guided.by_truth) == ("path 3", "path 0")
    assert (guided.source, guided.moved, guided.in_sections) == ("quaternion", (4.0, 1.1e-3, 9e-4), False)
    assert reported == [0.25, 0.625, 0.8125, 0.90625, 1.0]

    def in_sections(scenario: Scenario, by_truth: Any, report: Any) -> tuple[Any, list[float]]:
        report(0.5)
        return f"sections of {by_truth}", [2e-4, 3e-4]

    reported.clear()
    monkeypatch.setattr(closing, "by_sections", in_sections)
    path, guided = closed_loop(plan(), reported.append)
    assert (path, guided.by_truth) == ("sections of path 4", "path 4")  # type: ignore[comparison-overlap]
    assert (guided.moved, guided.in_sections) == ((2e-4, 3e-4), True)
    assert reported == [0.25, 0.625, 0.8125, 0.90625, 0.953125, 1.0]  # the sections have the half of the last sixteenth


def test_a_loop_has_at_most_twelve_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each gains four: from 10 km twelve passes lead to less than 1 mm, from 100 km they do not."""
    monkeypatch.setattr(closing, "true_motion", lambda *given, **keys: None)
    monkeypatch.setattr(closing, "solution_errors", lambda scenario, path: None)
    monkeypatch.setattr(closing, "_share", lambda errors: 0.25)
    monkeypatch.setattr(closing, "by_sections", lambda scenario, by_truth, report: (None, [2e-4]))
    for first, in_sections in ((1e4, False), (1e5, True)):
        moves = [first * 4.0**-k for k in range(20)]
        left = iter(moves)
        monkeypatch.setattr(closing, "apart", lambda one, other, left=left: next(left))
        _, guided = closed_loop(plan())
        assert guided.moved == ((2e-4,) if in_sections else tuple(moves[:12]))
        assert next(left) == moves[12]


def test_the_aided_solution_that_guides_is_that_of_the_monitored_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """The errors of the filter's solution are asked for at the rate of the guidance, 4 Hz, since the start."""
    from sinssim.simulation import aided_run

    flight = plan().flight
    assert flight is not None
    scenario: Any = SimpleNamespace(flight=flight.model_copy(update={"guidance": flight.guidance.model_copy(
        update={"source": "aided", "rate_hz": 4.0})}), solution_names=("quaternion",))  # fmt: skip
    sensed = SimpleNamespace(imu="imu", errors="errors", readings=SimpleNamespace(monitored=("gyros",)))
    asked: list[Any] = []
    monkeypatch.setattr(closing, "truth_along", lambda path, scenario: f"truth along {path.start:g}")
    monkeypatch.setattr(closing, "sense", lambda scenario, truth: asked.append(truth) or sensed)
    monkeypatch.setattr(closing, "first_state", lambda scenario, truth: f"start of {truth}")
    monkeypatch.setattr(closing, "_readings", lambda scenario, path: {})
    estimate = SimpleNamespace(estimate=SimpleNamespace(solution="solution"))
    monkeypatch.setattr(aided_run, "aid_run", lambda *given, **keys: asked.append((given[2:], keys)) or estimate)
    monkeypatch.setattr(closing, "_errors_at", lambda *given: asked.append(given[3:]) or np.ones((3, 12)))
    path: Any = SimpleNamespace(start=5.0, end=5.75)
    assert solution_errors(scenario, path).values.tolist() == np.ones((3, 12)).tolist()
    truth, by_filter, (solution, time) = asked
    assert truth == "truth along 5"
    given = ("imu", "start of truth along 5", "errors")
    assert by_filter == (given, {"monitored": ("gyros",), "history": False})
    assert (solution, time.tolist()) == ("solution", [0.0, 0.25, 0.5])


def test_sections_and_their_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flight of 160 s is flown until 67.5 s with 7.5 s of alignment, then 60 s on, until it is over. The first
    section moves by 2 m, then by 0.5 mm; the second by 0.2 mm at once."""
    places = iter([0.0, 2.0, 2.0005, 50.0, 50.0002])
    calls: list[Any] = []

    class Flying:
        def __init__(self, flight: Any, seed: int, believed: Any) -> None:
            calls.append(believed)

        def __enter__(self) -> Flying:
            return self

        def __exit__(self, *given: Any) -> None: ...
        def fly(self, until: float, believed: Any) -> Any:
            calls.append((until, believed))
            return SimpleNamespace(position_ecef=np.array([[0.0, next(places), 0.0]])), until > 100.0

        def keep(self, *, kept: bool) -> None:
            calls.append(kept)

    monkeypatch.setattr(closing, "SectionedFlight", Flying)
    monkeypatch.setattr(closing, "true_motion", lambda scenario, errors: ("path", errors))
    errors = iter("abcdef")
    monkeypatch.setattr(closing, "solution_errors", lambda scenario, path: next(errors))
    monkeypatch.setattr(closing, "_continued", lambda believed, found, begin: f"{believed}{found}{begin:g}")
    monkeypatch.setattr(closing, "_alignment", lambda scenario: 7.5)
    done: list[float] = []
    by_truth: Any = SimpleNamespace(start=5.0, end=165.0)
    path, moved = by_sections(plan(), by_truth, done.append)
    assert calls == [
        "a", (67.5, "a"), False, (67.5, "ab0"), False, (67.5, "ab0c0"), True, (127.5, "ab0c0"), False,
        (127.5, "ab0c0d67.5"), True,
    ]  # fmt: skip
    assert moved == pytest.approx([5e-4, 2e-4])
    assert done == [67.5 / 160.0, 127.5 / 160.0]
    assert path == ("path", "ab0c0d67.5")  # type: ignore[comparison-overlap]


def test_how_far_two_flights_are_apart() -> None:
    """At the same instants, and at the ends, which differ: 6 m at 5.5 s; 8 m where the longer one goes on."""
    at60, at200 = math.radians(60.0), math.radians(200.0)

    def flying(end: float, height: Any) -> Any:
        return SimpleNamespace(start=5.0, end=end, ellipsoid=WGS84, state=lambda time: SimpleNamespace(
            latitude=np.full(len(time), at60), longitude=np.full(len(time), at200),
            height=1000.0 + height(np.asarray(time))))  # fmt: skip

    level = flying(7.0, lambda time: 0.0 * time)
    once = flying(7.0, lambda time: np.where(np.abs(time - 5.5) < 0.05, 6.0, 2.0))
    assert apart(level, once) == pytest.approx(6.0, abs=1e-6)
    longer = flying(9.0, lambda time: np.where(time > 7.0, -8.0, 1.0))
    assert (apart(level, longer), apart(longer, level)) == pytest.approx((8.0, 8.0), abs=1e-6)
    logs: list[Any] = [SimpleNamespace(position_ecef=np.array(rows)) for rows in (
        [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], [[0.0, 3.0, 4.0], [1.0, 2.0, 3.0], [1.0, 2.0, 5.0]],
        [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [1.0, 14.0, 8.0]])]  # fmt: skip
    assert [closing._between(logs[0], other) for other in logs] == pytest.approx([0.0, 5.0, 13.0])


def test_a_live_flight_goes_on_by_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second, or a thousandth of what has been flown; half a second more is flown than is final, except at the end.
    What it sees are the errors of the last row of a solution, at the rate of the guidance."""
    flights: list[Any] = []

    def fly(until: float, errors: Any) -> tuple[str, bool]:
        flights.append((until, errors))
        return f"log {len(flights)}", len(flights) == 3

    flight = LiveFlight.__new__(LiveFlight)
    first: Any = SimpleNamespace(guidance=plan(rate_hz=4.0).flight.guidance)  # type: ignore[union-attr]
    vars(flight).update(scenario="s", over=False, _known=0.0, _errors=first, _flying=SimpleNamespace(fly=fly))
    monkeypatch.setattr(closing, "true_motion", lambda s, errors: SimpleNamespace(log=errors, end=99.0))
    monkeypatch.setattr(closing, "truth_along", lambda path, s: (s, path.log))
    monkeypatch.setattr(closing, "sense", lambda s, truth: ("sensed", *truth))
    assert flight.step() == (("sensed", "s", "log 1"), 1.0)
    assert (flight.log, flight.over) == ("log 1", False)
    asked: list[Any] = []

    def errors_at(s: Any, path: Any, sensed: Any, solution: Any, time: Any) -> Any:
        asked.append((s, path.log, sensed, time.tolist()))
        return np.arange(24.0).reshape(2, 12)

    monkeypatch.setattr(closing, "_errors_at", errors_at)
    flight.believe(SimpleNamespace(time=np.array([0.5, 0.75])))  # type: ignore[arg-type]
    assert asked == [("s", "log 1", ("sensed", "s", "log 1"), [0.5, 0.75])]
    believed = flight._errors
    assert (believed.guidance, believed.values.tolist()) == (first.guidance, [list(np.arange(12.0, 24.0))])
    vars(flight)["_known"] = 2000.0
    assert flight.step() == (("sensed", "s", "log 2"), 2002.0)
    assert flight.step() == (("sensed", "s", "log 3"), 99.0)
    assert flight.over
    assert flights == [(1.5, first), (2002.5, believed), (pytest.approx(2002.0 + 2.002 + 0.5), believed)]


def test_the_airspeed_at_the_instant_of_a_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    """It grows from 80 m/s at 10 s by 4 m/s²; readings of 85 and 87.5 m/s at 11 and 12 s arrive 0.25 s later."""
    measurements = SimpleNamespace(arrival=np.array([11.25, 12.25]), value=np.array([[85.0], [87.5]]))
    sensor = SimpleNamespace(latency_s=0.25, read=lambda vehicle: (SimpleNamespace(measurements=measurements),))
    monkeypatch.setattr(closing, "air_sensors", lambda scenario: {"airspeed": sensor})
    channel = SimpleNamespace(time=np.array([10.0, 20.0]), values=np.array([80.0, 120.0]))
    path: Any = SimpleNamespace(start=10.0, channels={"airspeed_mps": channel})
    time, arrival, errors = closing._readings(plan(), path)["airspeed"]
    np.testing.assert_allclose((time, arrival, errors), ([1.0, 2.0], [1.25, 2.25], [1.0, -0.5]), rtol=1e-12)


def test_every_error_of_a_solution_has_its_column(monkeypatch: pytest.MonkeyPatch) -> None:
    """The vehicle is rolled by 4°, and 6° in the solution, and the block is turned by 90° in it."""
    half, quarter = math.sqrt(0.5), np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])

    def turned(roll: float) -> Any:
        c, s = math.cos(math.radians(roll) / 2.0), math.sin(math.radians(roll) / 2.0)
        return np.array([[c * half, s * half, -s * half, c * half]])  # roll, then a quarter about down

    one = np.ones(1)
    here = NavState(1.0 * one, 2.0 * one, 300.0 * one, np.array([[1.0, 2.0, 3.0]]), turned(4.0))
    rows = [np.concatenate([9.0 * one, value * one]) for value in (1.1, 2.3, 305.0)]
    velocity = np.array([[9.0] * 3, [1.5, 2.25, 2.0]])
    there = NavSolution(np.array([5.0, 7.0]), *rows, velocity, np.vstack([turned(0.0), turned(6.0)]), np.zeros(2))
    asked: list[Any] = []
    path: Any = SimpleNamespace(state=lambda time: asked.append(time.tolist()) or here)
    monkeypatch.setattr(closing, "mounting", lambda scenario: SimpleNamespace(q_bs=quarter))
    (errors,) = closing._state_errors(plan(), path, there, np.ones(1, np.intp))
    assert asked == [[7.0]]
    np.testing.assert_allclose(errors, [0.1, 0.3, 5.0, 0.5, 0.25, -1.0, math.radians(2.0), 0.0, 0.0], atol=1e-12)
