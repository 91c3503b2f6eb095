"""The parts of a run, from numbers that are chosen: start, height reference, alignment, sources, clock."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.analyses.error_budget.budget_result import Added
from sinssim.data import ImuData, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, RunError
from sinssim.experiments.run.parts.phases import add_sources, budgets_of_phases
from sinssim.scenario import Scenario
from sinssim.scenario.navigation_section import InitialErrorSection, initial_state_with_errors
from sinssim.simulation import navigation_stage, truth_and_sensors
from sinssim.simulation.navigation_stage import solve
from sinssim.simulation.truth_and_sensors import STAGES, Sensed, Stages, Truth
from sinssim.strapdown.navigation_error import navigation_error

MINUTE, SECOND = pi / 10_800.0, pi / 648_000.0
LATITUDE, LONGITUDE, HEIGHT = 0.9, 0.3, 5000.0


def truth(q_nb: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> NavState:
    place = (np.asarray(LATITUDE), np.asarray(LONGITUDE), np.asarray(HEIGHT))
    return NavState(*place, np.array([10.0, 20.0, -1.0]), np.array(q_nb))


def known(ideal: Any = None, state: Any = None, trajectory: Any = None, time: Any = (0.0, 1.0)) -> Truth:
    """Return a true motion that holds what is given."""
    of = trajectory or SimpleNamespace(state=lambda t: truth(), start=0.0, end=1.0, ellipsoid=WGS84)
    found = Truth(of, "block", 1.0, np.asarray(time))  # type: ignore[arg-type]
    vars(found).update(ideal=ideal, state=state)
    return found


def scenario(**tables: Any) -> Scenario:
    own = {"name": "x", "seed": 11, "parked": {"latitude_deg": 50.0, "duration_s": 5.0}, "imu": {"grade": "ideal"}}
    return Scenario.model_validate({**own, **tables})


def test_random_errors_of_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """With draws of 1, 2 and 3: errors of 5 and 10 m north and east, 21 m up; 0.5, 1, 1.5 m/s; φ = (4, 8, 90)′.

    φ turns the solution to the truth: a level body that points north has a heading error of −φ_down."""
    drawn = []

    def normals(seed: int, term: str, axis: int, count: int) -> np.ndarray:
        drawn.append((seed, term, axis))
        return np.array([axis + 1.0])

    monkeypatch.setattr("sinssim.statistics.random_numbers.normals", normals)
    error = InitialErrorSection(
        position_sigma_m=5.0,
        height_sigma_m=7.0,
        velocity_sigma_mps=0.5,
        tilt_sigma_arcmin=4.0,
        heading_sigma_arcmin=30.0,
    )
    found = initial_state_with_errors(truth(), error, WGS84, 17)
    rows = {name: np.atleast_1d(value) for name, value in vars(truth()).items()}
    true = NavState(**{name: value if value.shape == (1,) else value[None] for name, value in rows.items()})
    own = NavState(*(np.atleast_1d(v) if np.ndim(v) == 0 else np.asarray(v)[None] for v in vars(found).values()))
    zero = np.zeros(1)
    from sinssim.data import NavSolution

    solution = NavSolution(zero, own.latitude, own.longitude, own.height, own.velocity_ned, own.q_nb, zero)
    difference = navigation_error(true, solution)
    np.testing.assert_allclose(difference.position_ned, [[5.0, 10.0, -21.0]], atol=2e-4)  # second order: 10²/2R tan φ
    np.testing.assert_allclose(difference.velocity_ned, [[0.5, 1.0, 1.5]], atol=1e-12)
    np.testing.assert_allclose(difference.attitude, [[4.0 * MINUTE, 8.0 * MINUTE, 90.0 * MINUTE]], atol=1e-12)
    _, _, heading = rotation.euler_from_quaternion(found.q_nb)
    assert heading == pytest.approx(2.0 * pi - 90.0 * MINUTE, abs=1e-5)
    terms = ["initial position", "initial velocity", "initial attitude"]
    assert drawn == [(17, term, axis) for term in terms for axis in range(3)]


def test_the_start_without_errors_is_the_truth_bit_for_bit() -> None:
    q = (0.1, 0.7, -0.5, 0.5)
    for axes in ("north", "transported"):
        found = initial_state_with_errors(truth(q), InitialErrorSection(), WGS84, axes=axes)
        assert (found.latitude, found.longitude, found.height) == (LATITUDE, LONGITUDE, HEIGHT)
        assert found.velocity_ned.tolist() == [10.0, 20.0, -1.0]
        assert found.q_nb.tolist() == list(q)


def test_a_start_a_kilometre_from_the_pole() -> None:
    """In transported axes 300 m north and 400 m east are a step over the ice, with velocity and attitude unturned.

    At 1 km from the pole along the meridian 0.3: the pole's plane has x along the meridian 0, y along 90° east. North
    is towards the pole, east to the left of that."""
    a, f = 6378137.0, 1.0 / 298.257223563
    polar_radius = a / (1.0 - f)  # of curvature at the pole, a²/b
    near = NavState(
        np.asarray(pi / 2 - 1000.0 / polar_radius), np.asarray(0.3), np.asarray(0.0), np.array([3.0, 4.0, -1.0]),
        np.array([1.0, 0.0, 0.0, 0.0]),
    )  # fmt: skip
    error = InitialErrorSection(
        north_m=300.0, east_m=400.0, height_m=20.0, velocity_north_mps=1.0, velocity_east_mps=-2.0
    )
    found = initial_state_with_errors(near, error, WGS84, axes="transported")
    out, east = np.array([cos(0.3), sin(0.3)]), np.array([-sin(0.3), cos(0.3)])
    place = 1000.0 * out - 300.0 * out + 400.0 * east
    assert (pi / 2 - found.latitude) * polar_radius == pytest.approx(np.hypot(*place), abs=1e-3)
    assert found.longitude == pytest.approx(np.arctan2(place[1], place[0]), abs=1e-6)
    assert found.height == pytest.approx(20.0, abs=1e-9)
    over_ice = -4.0 * out + 2.0 * east  # 4 m/s north, 2 m/s east, at the old place
    new_out = place / np.hypot(*place)
    new_east = np.array([-new_out[1], new_out[0]])
    np.testing.assert_allclose(found.velocity_ned, [-over_ice @ new_out, over_ice @ new_east, -1.0], atol=1e-6)
    _, _, heading = rotation.euler_from_quaternion(found.q_nb)
    ahead = -out  # north at the old place
    assert np.arctan2(ahead @ new_east, -ahead @ new_out) == pytest.approx(np.angle(np.exp(1j * heading)), abs=1e-6)


def test_the_height_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    """The readings of a barometer by their arrival; the true height without one, or without its loop."""
    true, baro = np.array([7.0, 8.0]), {"baro": {"rate_hz": 4.0}}
    motion = known(state=SimpleNamespace(height=true), trajectory="trajectory")

    def height(of: Any) -> Any:
        return Sensed(of, motion, None, None).height  # type: ignore[arg-type]

    assert height(scenario(aiding=baro, filter={}, navigation={"vertical": "free"})) is true
    assert height(scenario(navigation={"vertical": "baro-loop"})) is true
    looped = scenario(aiding=baro, navigation={"vertical": "baro-loop"})
    readings = SimpleNamespace(time=np.zeros(2), arrival=np.array([0.5, 0.75]), value=np.array([[31.0], [33.0]]))
    seeds = []

    def read(self: Any, vehicle: Any) -> list[SimpleNamespace]:
        seeds.append((vehicle.trajectory, vehicle.seed))
        return [SimpleNamespace(measurements=readings)]

    monkeypatch.setattr("sinssim.sensors.aiding.air_data.Barometer.read", read)
    found = height(looped)
    assert (found.arrival.tolist(), found.value.tolist(), found.interval) == ([0.5, 0.75], [31.0, 33.0], 0.25)
    assert seeds == [("trajectory", 11)]
    readings.time = np.zeros(0)
    with pytest.raises(InputError, match="cover the whole run"):
        _ = height(looped)
    assert height(looped.model_copy(update={"filter": object()})) is None


def test_an_alignment_takes_the_first_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """10 s of intervals of 2.5 s from 3 s on: four samples; 11 s need a fifth one."""
    time = 3.0 + 2.5 * np.arange(9)
    imu = ImuData(
        time, np.arange(24.0).reshape(8, 3), 100.0 + np.arange(24.0).reshape(8, 3), np.arange(48).reshape(8, 6)
    )
    seen = []

    def aligned(
        session: ImuData, place: Any, method: str, errors: Any, gravity: str, ellipsoid: Any
    ) -> tuple[str, None]:
        seen.append((session, place, method, gravity, ellipsoid))
        return "state", None

    monkeypatch.setattr(navigation_stage, "aligned_state", aligned)
    for duration, count in ((10.0, 4), (11.0, 5)):
        own = scenario(
            imu={"grade": "tactical"}, navigation={"alignment": {"duration_s": duration}, "gravity": "normal"}
        )
        assert navigation_stage.align_itself(own, imu, "place", "ellipsoid") == (count, "state")
        session = seen[-1][0]
        np.testing.assert_array_equal(session.time, time[: count + 1])
        np.testing.assert_array_equal(session.dtheta, imu.dtheta[:count])
        np.testing.assert_array_equal(session.dvel, imu.dvel[:count])
    assert seen[-1][1:] == ("place", own.navigation.alignment.method, "normal", "ellipsoid")
    long = scenario(imu={"grade": "tactical"}, navigation={"alignment": {"duration_s": 20.0}})
    with pytest.raises(InputError, match=r"duration_s = 20: the run lasts 20 s"):
        navigation_stage.align_itself(long, imu, None, None)
    rest = navigation_stage.without_alignment(imu, 3)
    np.testing.assert_array_equal(rest.time, time[3:])
    for name in ("dtheta", "dvel", "flags"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(imu, name)[3:])
    assert navigation_stage.without_alignment(ImuData(time, imu.dtheta, imu.dvel), 3).flags is None


def test_the_sources_of_phases() -> None:
    """Squares of the change within two intervals: 9 + 16 and 144 m² of one source, and so on; small shares go."""
    tilt = np.array([3.0, 4.0, 2.0]) * SECOND
    first = np.zeros((2, 9, 9))
    first[0, [0, 1, 6, 7, 8], [0, 1, 6, 7, 8]] = [9.0, 16.0, tilt[0] ** 2, tilt[1] ** 2, (6.0 * MINUTE) ** 2]
    first[1, 0, 0] = 25.0
    second = np.zeros((2, 9, 9))
    second[0, 1, 1], second[0, 8, 8] = 75.0, (0.5 * MINUTE) ** 2
    second[1, 1, 1] = 144.0
    added = Added(np.array([0.0, 20.0]), np.array([20.0, 50.0]), {"bias": first, "start": second}, {})
    start = Added(np.array([5.0]), np.array([5.0]), {"bias": second[1:], "start": first[1:]}, {})
    found = SimpleNamespace(added=added, first=lambda: start)
    rows = [{"phase": "alignment", "to_s": 105.0}, {"phase": "taxi", "to_s": 120.0}, {"phase": "flight", "to_s": 150.0}]
    add_sources(rows, found, 100.0)
    assert rows[1]["sources"] == {
        "horizontal": {"horizontal_sigma_m": pytest.approx(10.0), "shares": {"start": 0.75, "bias": 0.25}},
        "heading": {
            "heading_sigma_arcmin": pytest.approx(sqrt(36.25)),
            "shares": {"bias": pytest.approx(36.0 / 36.25)},
        },
        "tilt": {"tilt_sigma_arcsec": pytest.approx(5.0), "shares": {"bias": 1.0}},
    }
    later = {
        "horizontal_sigma_m": pytest.approx(13.0),
        "shares": {"start": pytest.approx(144 / 169), "bias": pytest.approx(25 / 169)},
    }
    assert rows[2]["sources"]["horizontal"] == later
    assert rows[2]["sources"]["tilt"] == {"tilt_sigma_arcsec": 0.0, "shares": {}}
    turned = {
        "horizontal_sigma_m": pytest.approx(13.0),
        "shares": {"bias": pytest.approx(144 / 169), "start": pytest.approx(25 / 169)},
    }
    assert rows[0]["sources"]["horizontal"] == turned
    for none, said in (("why", "why"), (SimpleNamespace(added=None), "no phase ends after the navigation begins.")):
        row = {"phase": "taxi", "to_s": 3.0}
        add_sources([row], none, 0.0)
        assert row["no_sources"] == said


def test_budgets_of_the_phases(monkeypatch: pytest.MonkeyPatch) -> None:
    """The ends of the phases, since the start of the run and not beyond its end."""
    asked = []

    def budget(own: Any, *, solution: str, truth: Any, marks: list[float]) -> str:
        asked.append((own, solution, truth.trajectory, truth.block, truth.ideal, truth.state, marks))
        if solution == "filter":
            raise InputError("It cannot be.")
        return "budget"

    monkeypatch.setattr("sinssim.analyses.error_budget.covariance_budget.budget", budget)
    own = SimpleNamespace(filter="f")
    motion = known("i", "s", "t", [30.0, 31.0, 90.0])
    run: Any = SimpleNamespace(scenario=own, truth=motion)
    phases = [SimpleNamespace(end=40.0), SimpleNamespace(end=95.0)]
    assert budgets_of_phases(run, phases) == {"inertial": "budget", "filter": "It cannot be."}
    assert asked == [(own, kind, "t", "block", "i", "s", [10.0, 60.0]) for kind in ("inertial", "filter")]
    own.filter = None
    assert budgets_of_phases(run, phases) == {"inertial": "budget"}


def test_the_clock_of_the_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Instants of 10, 12, 15 (3 s of imu), 20, 24 (4 s), 30, 30.5 (a further half of imu), 41 s: 31 s in all."""
    instants = iter([10.0, 12.0, 15.0, 20.0, 24.0, 30.0, 30.5, 41.0])
    monkeypatch.setattr(truth_and_sensors, "time", SimpleNamespace(perf_counter=lambda: next(instants)))
    told: list[tuple[str, float]] = []
    clock = Stages(lambda stage, fraction: told.append((stage, fraction)))
    with clock("imu"):
        pass
    with clock("filter"):
        clock.within("filter")("gyro scale", 0.25)
    with clock("imu"):
        pass
    assert clock.timing() == {
        **{f"{stage}_s": 0.0 for stage in STAGES}, "imu_s": 3.5, "filter_s": 4.0, "total_s": 31.0
    }  # fmt: skip
    assert told == [
        ("imu", 0.0),
        ("imu", 1.0),
        ("filter", 0.0),
        ("filter: gyro scale", 0.25),
        ("filter", 1.0),
        ("imu", 1.0),
    ]


def test_what_an_algorithm_navigates_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every choice of [navigation] reaches the engine; an algorithm that fails leaves the others."""
    seen: dict[str, Any] = {}

    def navigate_set(imu: Any, attitude: Any, initial: Any, of: Any, height: Any) -> str:
        seen[of.algorithm] = (imu, attitude, initial, {**vars(of), "height": height})
        if of.algorithm == "euler":
            raise RunError("it fails.", time=2.0)
        return f"by {of.algorithm}"

    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate_set", navigate_set)
    own = scenario(
        navigation={
            "algorithms": ["poisson", "euler"], "frame": "transverse", "gravity": "normal", "curvature": "simplified",
            "ellipsoid": "krasovsky-1940", "vertical": "baro-loop", "baro_time_constant_s": 70.0,
            "route_deg": [50.0, 10.0, -30.0, 40.0], "rates_hz": [100.0, 50.0, 10.0], "slow_quantities": "extrapolate",
            "initial_error": {"height_m": 25.0},
        }
    )  # fmt: skip
    imu, height = ImuData(np.array([0.0, 1.0]), np.zeros((1, 3)), np.zeros((1, 3))), np.array([5.0, 6.0])
    found, failed = solve(own, known(), imu, "q", height)
    assert (found, list(failed), failed["euler"].time) == ({"poisson": "by poisson"}, ["euler"], 2.0)
    assert seen["poisson"][0] is imu
    assert (seen["poisson"][1], float(seen["poisson"][2].height)) == ("q", 5025.0)
    options = seen["poisson"][3]
    assert options.pop("route") == pytest.approx(np.array([50.0, 10.0, -30.0, 40.0]) * pi / 180.0)
    assert options.pop("height") is height
    assert options == {
        "algorithm": "poisson", "frame": "transverse", "gravity": "normal", "ellipsoid": "krasovsky-1940",
        "curvature": "simplified", "vertical": "baro-loop", "baro_time_constant": 70.0,
        "azimuth": 0.0, "rates_hz": (100.0, 50.0, 10.0), "slow_quantities": "extrapolate",
    }  # fmt: skip
    turned = scenario(
        navigation={"frame": "wander", "azimuth_deg": 30.0, "vertical": "free", "algorithms": ["poisson"]}
    )
    solve(turned, known(), imu, None, None)
    options = seen["poisson"][3]
    assert (
        options["azimuth"],
        options["vertical"],
        options["height"],
        options["baro_time_constant"],
        options["route"],
    ) == (pytest.approx(pi / 6.0), "free", None, 50.0, None)
    with pytest.raises(RunError, match="it fails"):
        solve(scenario(navigation={"algorithms": ["euler"]}), known(), imu, None, None)


def test_navigation_after_an_alignment(monkeypatch: pytest.MonkeyPatch) -> None:
    """It begins after the samples of the alignment, on the navigator's ellipsoid, with the heights from there on."""
    seen: dict[str, Any] = {}

    def align(own: Any, imu: Any, place: Any, ellipsoid: Any) -> tuple[int, str]:
        seen["ellipsoid"] = ellipsoid.name
        return 2, "aligned"

    def navigate_set(imu: Any, attitude: Any, initial: Any, of: Any, height: Any) -> str:
        seen.update(time=imu.time.tolist(), initial=initial, height=height.tolist())
        return "solution"

    monkeypatch.setattr(navigation_stage, "align_itself", align)
    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate_set", navigate_set)
    navigation = {"alignment": {"duration_s": 10.0}, "ellipsoid": "krasovsky-1940", "vertical": "truth"}
    own = scenario(imu={"grade": "tactical"}, navigation=navigation)
    imu = ImuData(np.arange(4.0), np.zeros((3, 3)), np.zeros((3, 3)))
    solve(own, known(time=imu.time), imu, None, np.array([5.0, 6.0, 8.0, 9.0]))
    assert seen == {"ellipsoid": "krasovsky-1940", "time": [2.0, 3.0], "initial": "aligned", "height": [8.0, 9.0]}
