"""A flight that follows its own navigator: fly, sense, navigate, and fly again with the errors of the navigator.

The errors of a navigator depend so weakly on the path that each pass brings the path some two digits nearer to that of
the closed loop. The last pass is a flight like any other: the accuracy of its curve and increments is that of a flight
by truth. The sensors' random numbers are those of the run, in every pass the same.

Where the passes do not settle, because a decision of the navigator turns with the path, the flight proceeds by
sections: each is flown until it settles, from the end of the one before. What lies before a section is then the same in
all of its trials, and a decision within it is taken once the path before it is known. With a latency of more than a
section, no trial changes anything: that is the loop as it is, step by step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef
from sinssim.errors import RunError
from sinssim.rotation import conjugate, euler_from_quaternion, multiply, rotate
from sinssim.scenario import Scenario, filter_model
from sinssim.scenario.true_motion import mounting, true_motion
from sinssim.sensors.aiding.air_data import Airspeed, Barometer
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.simulation.navigation_stage import by_one, first_state, navigate
from sinssim.simulation.truth_and_sensors import Sensed, sense, truth_along
from sinssim.truth.flight.flight_log import FlightLog
from sinssim.truth.flight.flight_process import SectionedFlight
from sinssim.truth.flight.guidance import TRUTH, AirData, Guided, SolutionErrors, finite_rows
from sinssim.truth.trajectory import Trajectory

Rows = NDArray[np.intp]

NEAR = 1e-3
"""Distance from the path of the closed loop below which a flight is taken for it, m."""
_MOST, _GAIN = 12, 3.0
"""Passes after the first, and the factor by which one at least of two has to bring the path nearer."""
_SECTIONS, _SHORTEST, _TRIALS = 16, 60.0, 40
"""Sections of a flight, the shortest one, s, and the trials of each. More sections take fewer trials, but all that has
been flown before is navigated again in each."""
_STEP, _STEP_SHARE, _MARGIN = 1.0, 1e-3, 0.5
"""Steps of a flight that is guided while it is flown, s, and of what has been flown, since all of it is sensed again;
the end of what has been flown that is not sensed yet, because the curve through the later knots still changes it, s."""
_RATE = 10.0
"""Rate at which two paths are compared, Hz."""


def is_guided(scenario: Scenario) -> bool:
    """Return whether a scenario has a flight that follows its navigator."""
    return scenario.flight is not None and scenario.flight.guidance.source != TRUTH


def closed_loop(
    scenario: Scenario,
    progress: Callable[[float], None] | None = None,
    meanwhile: Callable[[], None] | None = None,
) -> tuple[Trajectory, Guided]:
    """Fly a plan by the navigator that the scenario names; return the motion of the sensor block, and how it came
    about. `progress` is called with the fraction of the passes flown, 0…1, and `meanwhile` once while another process
    flies. RunError: a section of the flight does not settle, or the navigator has no solution."""
    scenario = filter_model.with_states(scenario)
    assert scenario.flight is not None  # it is guided
    source, moved, left = scenario.flight.guidance.source, list[float](), np.inf
    report = progress or (lambda fraction: None)

    def part_of(number: int) -> Callable[[float], None]:
        begin, end = 1.0 - 0.5**number, 1.0 - 0.5 ** (number + 1)
        return lambda fraction: report(begin + (end - begin) * fraction)

    path = by_truth = true_motion(scenario, part_of(0), meanwhile, errors="none")
    flown = list[SolutionErrors]()
    while left > NEAR:
        if len(moved) == _MOST or _settles_slowly(moved):
            path, moved = by_sections(scenario, by_truth, part_of(len(moved) + 1))
            report(1.0)
            return path, Guided(source, by_truth, tuple(moved), max(moved), in_sections=True)
        flown.append(solution_errors(scenario, path))
        if len(flown) > 2 and (left := moved[-1] * _share(flown[-3:])) <= NEAR:  # without a further flight
            break
        before, path = path, true_motion(scenario, part_of(len(moved) + 1), errors=flown[-1])
        moved.append(apart(before, path))
        left = _to_go(moved)
    report(1.0)
    return path, Guided(source, by_truth, tuple(moved), left)


def _to_go(moved: Sequence[float]) -> float:
    """Return how far a path is from that of the closed loop, m: what the slower of the last two gains leaves of how far
    the last pass has moved it. `moved`: how far each pass has moved the path, m."""
    shares = [after / before for before, after in pairwise(moved[-3:])]
    return moved[-1] * (min(max(shares), 1.0) if len(shares) == 2 else 1.0)


def _share(errors: Sequence[SolutionErrors]) -> float:
    """Return how large the last change of a navigator's errors on three flights, one after the other, is as a share of
    the one before: the largest share of position, velocity, attitude and rates. A path moves as the errors that it is
    flown with change."""
    count = min(len(of.values) for of in errors)
    values = np.stack([of.values[:count] for of in errors])
    values[:, :, :2] *= WGS84.a  # in metres, as the height
    before, after = np.abs(np.diff(values, axis=0)).reshape(2, count, 4, 3).max(axis=(1, 3))
    return float(np.divide(after, before, out=np.where(after > 0.0, np.inf, 0.0), where=before > 0.0).max())


def _settles_slowly(moved: list[float]) -> bool:
    """Return whether neither of the last two passes has gained much on the one before."""
    gains = [before / after for before, after in pairwise(moved[-3:])]
    return len(gains) == 2 and max(gains) < _GAIN


def by_sections(
    scenario: Scenario, by_truth: Trajectory, progress: Callable[[float], None]
) -> tuple[Trajectory, list[float]]:
    """Fly a plan by its navigator, whose filter has its states written out, section by section, each until it settles,
    beginning with the flight by the true motion. Return the motion of the sensor block, and how far the last trial of
    each section moved its path, m. RunError: a section does not settle, or the navigator has no solution."""
    assert scenario.flight is not None
    guidance, duration = scenario.flight.guidance, by_truth.end - by_truth.start
    believed = solution_errors(scenario, by_truth)
    length, moved, over = max(duration / _SECTIONS, _SHORTEST), list[float](), False
    begin, until = 0.0, length + _alignment(scenario)
    with SectionedFlight(scenario.flight, scenario.seed, believed) as flying:
        while not over:
            log, over = flying.fly(until, believed)
            for _ in range(_TRIALS):
                errors = solution_errors(scenario, true_motion(scenario, errors=log))
                believed = _continued(believed, errors, begin)
                flying.keep(kept=False)
                before, (log, over) = log, flying.fly(until, believed)
                distance = _between(before, log)
                if distance < NEAR:
                    break
            else:
                raise RunError(
                    f"the flight by {guidance.source} does not settle between {begin:.6g} and {until:.6g} s: after "
                    f"{_TRIALS} trials its path still moves by {distance:.3g} m from one trial to the next."
                )
            flying.keep(kept=True)
            moved.append(distance)
            begin, until = until, until + length
            progress(min(begin / duration, 1.0))
    return true_motion(scenario, errors=believed), moved


def _alignment(scenario: Scenario) -> float:
    """Return how long a scenario aligns before it navigates, s."""
    alignment, aided = scenario.navigation.alignment, scenario.filter
    return (0.0 if alignment is None else alignment.duration_s) + (0.0 if aided is None else aided.alignment_s or 0.0)


def _continued(believed: SolutionErrors, errors: SolutionErrors, begin: float) -> SolutionErrors:
    """Return errors that a flight has been flown with until an instant, s, with what is known of those after it.

    Those after the end of what is known begin with its errors of position, velocity and attitude.
    """
    rate, rows, fresh = errors.guidance.rate_hz, believed.values, errors.values
    later = rows[len(fresh) :].copy()
    later[:, :9] += fresh[-1, :9] - rows[min(len(fresh), len(rows)) - 1, :9]
    first, end = round(begin * rate), len(fresh) / rate

    def readings(before: AirData | None, now: AirData | None) -> AirData | None:
        if before is None or now is None:
            return None
        flown, known, after = before.time < begin, now.time >= begin, before.time >= end
        columns = zip(before, now, strict=True)
        return AirData(*(np.concatenate([old[flown], new[known], old[after]]) for old, new in columns))

    return SolutionErrors(
        errors.guidance, np.concatenate([rows[:first], fresh[first:], later]),
        readings(believed.airspeed, errors.airspeed), readings(believed.height, errors.height),
    )  # fmt: skip


def _between(log: FlightLog, other: FlightLog) -> float:
    """Return the largest distance of two flights at the same instants, or of their ends if one is longer, m."""
    a, b = log.position_ecef, other.position_ecef
    count = min(len(a), len(b))
    return float(max(np.linalg.norm(a[:count] - b[:count], axis=1).max(), np.linalg.norm(a[-1] - b[-1])))


def solution_errors(scenario: Scenario, path: Trajectory) -> SolutionErrors:
    """Return the errors of the navigator along a path, as the autopilot sees them."""
    assert scenario.flight is not None
    guidance = scenario.flight.guidance
    truth = truth_along(path, scenario)
    sensed = sense(scenario, truth)
    time = np.arange(0.0, path.end - path.start, 1.0 / guidance.rate_hz)
    if guidance.source in scenario.solution_names:
        try:
            solution = navigate(by_one(scenario, guidance.source), sensed).solutions[guidance.source]
        except RunError as error:
            raise RunError(
                f"the flight cannot follow {guidance.source}: {error}", time=error.time, exit_code=error.exit_code
            ) from error
    else:  # nothing is smoothed or diagnosed here
        from sinssim.simulation.aided_run import aid_run

        start, errors, monitored = first_state(scenario, truth), sensed.errors, sensed.readings.monitored
        assert errors is not None  # those of simulated sensors are known
        aided = aid_run(scenario, path, sensed.imu, start, errors, monitored=monitored, history=False)
        solution = aided.estimate.solution
    values = finite_rows(_errors_at(scenario, path, sensed, solution, time))
    return SolutionErrors(guidance, values, **_readings(scenario, path))


def _errors_at(scenario: Scenario, path: Trajectory, sensed: Sensed, solution: NavSolution, time: Array) -> Array:
    """Return the errors of a solution at some instants since the start, (K, 12); zero before it begins."""
    rows = np.searchsorted(solution.time, path.start + time + 1e-9, side="right") - 1  # the last row before
    begun = rows >= 0  # before it navigates, the true motion guides
    rows = np.maximum(rows, 0)
    values = np.zeros((len(time), 12))
    values[begun, :9] = _state_errors(scenario, path, solution, rows[begun])
    values[begun, 9:] = _rate_errors(scenario, sensed, path.start + time)[begun]
    return values


class LiveFlight:
    """A flight that a navigator elsewhere guides while it is flown; a context manager.

    The autopilot sees the true motion with the errors of the last solution that has come. They are held for a step.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Bring the aircraft to the start of a scenario's flight."""
        assert scenario.flight is not None
        self.scenario, self.over, self._known = scenario, False, 0.0
        self._errors = SolutionErrors(scenario.flight.guidance, np.zeros((1, 12)))
        self._flying = SectionedFlight(scenario.flight, scenario.seed, self._errors, once=True)

    def __enter__(self) -> LiveFlight:
        return self

    def __exit__(self, *error: Any) -> None:
        """End the process that flies."""
        self._flying.__exit__(*error)

    def step(self) -> tuple[Sensed, float]:
        """Fly on for a step; return what the sensors have read so far, and until when it is final, s."""
        self._known += max(_STEP, _STEP_SHARE * self._known)
        self.log, self.over = self._flying.fly(self._known + _MARGIN, self._errors)
        self._path = true_motion(self.scenario, errors=self.log)
        self._sensed = sense(self.scenario, truth_along(self._path, self.scenario))
        return self._sensed, self._path.end if self.over else self._known

    def believe(self, solution: NavSolution) -> None:
        """Let the next steps see the errors of the last row of a solution, at an instant that has been flown."""
        guidance, last = self._errors.guidance, float(solution.time[-1])
        time = np.array([last - 1.0 / guidance.rate_hz, last])
        values = _errors_at(self.scenario, self._path, self._sensed, solution, time)[-1:]
        self._errors = SolutionErrors(guidance, values)


def air_sensors(scenario: Scenario) -> dict[str, Airspeed | Barometer]:
    """Return the air-data sensors that the autopilot of a flight by its navigator sees, by "airspeed" and "height"."""
    if not is_guided(scenario) or scenario.aiding is None or scenario.flight is None:
        return {}
    by_solution = "height" in scenario.flight.guidance.quantities
    seen = {
        "airspeed": scenario.aiding.sensor(Airspeed),
        "height": None if by_solution else scenario.aiding.sensor(Barometer),
    }
    return {name: sensor for name, sensor in seen.items() if sensor is not None}


def _readings(scenario: Scenario, path: Trajectory) -> dict[str, AirData]:
    """Return the readings of the sensors that the autopilot sees, those that the filter gets."""
    of = {}
    for name, sensor in air_sensors(scenario).items():
        (readings,) = sensor.read(Vehicle(path, scenario.seed))
        arrival = readings.measurements.arrival
        time = arrival - sensor.latency_s  # that of the measurement is a lag earlier
        if name == "height":
            true = path.state(time).height
        else:
            true = np.interp(time, path.channels["airspeed_mps"].time, path.channels["airspeed_mps"].values)
        of[name] = AirData(time - path.start, arrival - path.start, readings.measurements.value[:, 0] - true)
    return of


def _state_errors(scenario: Scenario, path: Trajectory, solution: NavSolution, rows: Rows) -> Array:
    """Return the errors of some rows of a solution in position, velocity and the vehicle's attitude, (K, 9)."""
    true, place = path.state(solution.time[rows]), conjugate(mounting(scenario).q_bs)

    def columns(state: NavState | NavSolution, of: Rows | slice) -> Array:
        angles = euler_from_quaternion(multiply(state.q_nb[of], place))
        position = (state.latitude[of], state.longitude[of], state.height[of])
        return np.column_stack([*position, state.velocity_ned[of], *angles])

    errors = columns(solution, rows) - columns(true, slice(None))
    for column in (1, 6, 8):  # longitude, roll and heading
        errors[:, column] = np.remainder(errors[:, column] + np.pi, 2.0 * np.pi) - np.pi
    return errors


def _rate_errors(scenario: Scenario, sensed: Sensed, time: Array) -> Array:
    """Return the errors of the gyros' mean rates over the interval before each of some instants, (K, 3) rad/s.

    They are zero for sensors that measure no rates, and for a block that turns in the vehicle.
    """
    measured, ideal = sensed.imu, sensed.perfect.imu
    if scenario.imu.rotation is not None or not np.isfinite(measured.dtheta).all():
        return np.zeros((len(time), 3))
    angle = np.vstack([np.zeros(3), np.cumsum(measured.dtheta - ideal.dtheta, axis=0)])
    edge = np.clip(np.searchsorted(measured.time, time + 1e-9, side="right") - 1, 1, len(angle) - 1)
    before = np.minimum(np.concatenate([[0], edge[:-1]]), edge - 1)
    rate = (angle[edge] - angle[before]) / (measured.time[edge] - measured.time[before])[:, None]
    return rotate(mounting(scenario).q_bs, rate)


def apart(path: Trajectory, other: Trajectory) -> float:
    """Return the largest distance of two paths at the same instants, m; what only one of them has counts as well."""
    end = min(path.end, other.end)
    time = np.append(np.arange(path.start, end, 1.0 / _RATE), end)
    places = [_place(flown, time) for flown in (path, other)]
    whole = [_place(flown, np.array([flown.end]))[0] for flown in (path, other)]
    return float(max(np.linalg.norm(places[0] - places[1], axis=1).max(), np.linalg.norm(whole[0] - whole[1])))


def _place(path: Trajectory, time: Array) -> Array:
    state = path.state(time)
    return geodetic_to_ecef(state.latitude, state.longitude, state.height, path.ellipsoid)
