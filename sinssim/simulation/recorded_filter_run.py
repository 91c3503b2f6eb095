"""Runs a scenario's filter on recorded sensors, and compares the estimate with a reference if there is one.

The reference takes the place of a true motion, from which further aiding sensors are emulated beside recorded ones. The
errors in outages of recorded fixes are those of a pass without their readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth
from sinssim.alignment.initial_conditions import RecordedStart, recorded_start
from sinssim.data import Array, ImuData, NavSolution, NavState, rows_of, short_repr
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError
from sinssim.estimation import ErrorModel, Estimate, Smoothed
from sinssim.estimation.filter_start import Start
from sinssim.logs.log_files import recorded_errors
from sinssim.logs.recorded_log import RecordedLog, gnss_readings, recorded_log
from sinssim.logs.recorded_streams import FixStream
from sinssim.logs.reference_solution import Reference
from sinssim.progress import Progress, silent
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import Excitation, filter_model, with_states
from sinssim.scenario.filter_section import InitialSigmaSection
from sinssim.scenario.run_memory import ROWS
from sinssim.scenario.true_motion import mounting
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, Vehicle
from sinssim.simulation.aided_run import coarse_alignment, filtered, with_noise_factor
from sinssim.simulation.truth_comparison import Aided, Rows
from sinssim.strapdown.navigation_error import NavError, unknown_error
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCMIN


@dataclass(frozen=True)
class ReferenceMotion:
    """The motion of the sensor block as a whole reference has it; a `sinssim.Trajectory`, as far as it goes."""

    reference: Reference  # with position, velocity and attitude
    # start, end: of the run, s
    start: float
    end: float
    gravity: str = "normal"  # name of the gravity model
    # events, channels: none
    events: tuple[FlightEvent, ...] = ()
    channels: dict[str, Channel] = field(default_factory=dict)

    @property
    def ellipsoid(self) -> Ellipsoid:
        """Reference ellipsoid of the heights."""
        return self.reference.ellipsoid

    def state(self, t: ArrayLike) -> NavState:
        """Return states of the block; raise InputError where the reference does not have them."""
        time = np.atleast_1d(np.asarray(t, dtype=np.float64))
        states = self.reference.state_at(time)
        if states is None:
            missing = [what for what in ("velocity", "attitude") if what not in self.reference.knows]
            raise InputError(
                "[aiding] with [log] is simulated from log.reference, but "
                + (
                    f"{self.reference.name} has no {' and no '.join(missing)}."
                    if missing
                    else f"{self.reference.name} does not cover the whole run, {time[0]:.3f} to {time[-1]:.3f} s. Cut "
                    "the run to the reference (log.from_s, log.to_s)."
                )
            )
        if np.ndim(t) == 0:
            return rows_of(states, 0)
        return states

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Raise InputError, because a reference has no angular rates."""
        raise InputError(
            "[aiding] with [log] is simulated from log.reference, which has no angular rates: give the simulated "
            "sensor the lever arm [0, 0, 0]."
        )

    def increments(self, rate_hz: float) -> ImuData:
        """Raise InputError, because the increments are the recorded ones."""
        raise InputError("the increments of a scenario with [log] are the recorded ones.")


_ELLIPSOID = "wgs84"
_RATE_DIGITS = 6


@short_repr
@dataclass(frozen=True)
class Prepared:
    """A scenario with recorded sensors, and what its files hold.

    Attributes:
        scenario: the scenario; rate, span, initial 1σ and states of the filter are written out.
        log: the recorded sensors.
        start: where navigation starts.
        moved: rotation and acceleration that the unit sensed.
    """

    scenario: Scenario
    log: RecordedLog
    start: RecordedStart
    moved: Excitation


def prepare(scenario: Scenario, log: RecordedLog | None = None) -> Prepared:
    """Read the files of a scenario with [log] unless their contents are given; write out what follows from them."""
    section = scenario.log
    assert section is not None
    log = recorded_log(section, scenario.imu.mounting_deg) if log is None else log
    start = recorded_start(log, section.start, scenario.imu.mounting_deg, scenario.navigation.gravity)
    imu, time = log.imu, log.imu.time
    rate = float(f"{log.rate_hz:.{_RATE_DIGITS}g}")
    if "rate_hz" in scenario.imu.model_fields_set and abs(scenario.imu.rate_hz / rate - 1.0) > 0.02:
        raise InputError(
            f"imu.rate_hz = {scenario.imu.rate_hz:g}, but {section.imu.file} has {rate:g} samples per second: remove "
            "imu.rate_hz, or check the unit of its times."
        )
    interval = np.diff(time)
    moved = Excitation(
        float(time[-1] - time[0]),
        float(np.sum(np.sum(imu.dtheta**2, axis=1) / interval)),
        float(np.sum(np.sum(imu.dvel**2, axis=1) / interval)),
    )
    update: dict[str, object] = {
        "imu": scenario.imu.model_copy(update={"rate_hz": rate}),
        "log": section.model_copy(
            update={
                "from_s": max(float(time[0]), 0.0),
                "to_s": float(time[-1]),
                "imu": section.imu if log.axes is None else section.imu.model_copy(update={"axes": log.axes}),
            }
        ),
    }
    if scenario.filter is not None:
        sigma_section = scenario.filter.initial_sigma
        start_sigma = {
            "position_m": float(max(start.position[:2])),
            "height_m": float(start.position[2]),
            "velocity_mps": start.velocity,
            "tilt_arcmin": start.tilt / ARCMIN,
            "heading_arcmin": start.heading / ARCMIN,
        }
        given = sigma_section.model_dump(exclude_none=True)
        sigma = InitialSigmaSection(**{**start_sigma, **given})
        update["filter"] = scenario.filter.model_copy(update={"initial_sigma": sigma})
    whole = scenario.model_copy(update=update)
    return Prepared(with_states(whole, moved), log, start, moved)


@dataclass(frozen=True)
class RecordedAided(Aided):
    """An aided solution on recorded sensors, whose true errors are not known."""

    reference: Reference | None = None  # what the solution is compared with; None for nothing

    def _error_of(self, solution: NavSolution) -> NavError:
        if self.reference is None:
            return unknown_error(solution.time)
        return self.reference.error_of(solution)

    @property
    def true_parameters_known(self) -> bool:
        """Whether the true values of the sensors' parameters are known: they are not."""
        return False

    def block_error(self, block: str, rows: Rows = slice(None)) -> Array:
        """Return the differences from the reference in the states of one block, NaN where it does not tell."""
        if block in self.estimate.parameters:
            return np.full_like(self.estimate.parameters[block][rows], np.nan)
        return super().block_error(block, rows)


def aid_recorded(
    prepared: Prepared, imu: ImuData, start: Start, *, history: bool = True, progress: Progress = silent
) -> Estimate:
    """Run a scenario's filter on recorded sensors from increments that the engine navigates on, after compensation; if
    the filter diverged, the estimate ends there. The history is for smoothing and observability; the progress is what a
    diagnosis tries and the fraction done."""
    scenario, section = prepared.scenario, prepared.scenario.filter
    assert section is not None
    lasts = float(imu.time[-1] - imu.time[0])
    model: ErrorModel = filter_model(scenario, lasts, recorded_errors(scenario.log))
    measurements = [
        with_noise_factor(readings.measurements, section.measurement_noise_factor)
        for readings in all_readings(prepared)
    ]
    begin = start
    if section.alignment_s is not None:
        begin = coarse_alignment(scenario, _ELLIPSOID, start, measurements, model)
    row_s = 0.0 if section.smooth and history else lasts / ROWS
    return filtered(
        scenario,
        begin,
        measurements,
        model,
        _ELLIPSOID,
        None,
        history,
        row_s,
        bridged=prepared.log.bridged,
        progress=progress,
    )


def all_readings(prepared: Prepared) -> tuple[AidingReadings, ...]:
    """Return the recorded readings, and those of sensors that [aiding] emulates from the reference."""
    log, aiding = prepared.log, prepared.scenario.aiding
    if aiding is None:
        return log.sensed
    velocity = next((r.measurements for r in log.sensed if r.measurements.kind == "gnss-velocity"), None)
    q_bs = mounting(prepared.scenario).q_bs
    imu_readings: list[AidingReadings] = []
    others: dict[str, AidingSensor] = {}
    for name, sensor in aiding.sensors().items():
        own_readings = sensor.from_imu(log.imu, velocity, q_bs) if sensor.needs_no_truth else None
        if own_readings is None:
            others[name] = sensor
        else:
            imu_readings += [AidingReadings(m, m.time, {}) for m in own_readings]
    if others and log.reference is None:
        raise InputError(
            f"[aiding] has {', '.join(others)}, which are simulated from a reference: add [log.reference], or "
            "remove them. Standstill with detect = true and land_vehicle follow from the inertial data."
        )
    emulated = imu_readings
    if others:
        assert log.reference is not None
        motion = ReferenceMotion(log.reference, float(log.imu.time[0]), float(log.imu.time[-1]))
        vehicle = Vehicle(motion, prepared.scenario.seed)
        emulated = [*imu_readings, *(readings for sensor in others.values() for readings in sensor.read(vehicle))]
    labels = {readings.measurements.label for readings in log.sensed}
    twice = [readings.measurements.label for readings in emulated if readings.measurements.label in labels]
    if twice:
        raise InputError(f"{twice[0]} is both recorded ([log]) and simulated ([aiding]): remove one of them.")
    return (*log.sensed, *emulated)


def compare_recorded(
    estimate: Estimate, sensed: Sequence[AidingReadings], reference: Reference | None, end: float
) -> RecordedAided:
    """Compare an estimate on recorded sensors with a reference. `reference`: what it is compared with; None for
    nothing; `end`: end of the run, s."""
    nothing = cast("Trajectory", None)  # there is no true motion; nothing here asks for it
    smoothed = _differences(estimate, estimate.smoothed, reference)
    backward = _differences(estimate, estimate.backward, reference)
    nominal = np.zeros((0, estimate.model.size))
    return RecordedAided(
        tuple(sensed),
        estimate,
        {},
        nothing,
        smoothed[0],
        smoothed[1],
        nominal,
        end,
        backward[0],
        backward[1],
        reference,
    )


def _differences(
    estimate: Estimate, further: Estimate | Smoothed | None, reference: Reference | None
) -> tuple[NavError, Array] | tuple[None, None]:
    """Return the differences of a further solution from the reference, as errors and as errors in the states."""
    if further is None:
        return None, None
    errors = unknown_error(further.time) if reference is None else reference.error_of(further.solution)
    states = np.full((len(further.time), estimate.model.size), np.nan)
    states[:, :9] = np.hstack([errors.position_ned, errors.velocity_ned, errors.attitude])
    return errors, states


def as_reference(name: str, solution: NavSolution) -> Reference:
    """Return a solution in the form of a reference, with which others are compared."""
    s = solution
    return Reference(name, s.time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)


OutageErrors = dict[str, float]
"""The times of an outage, the errors at its end and the filter's 1σ by key; NaN where unknown. Its number of the pass
is there if there are several."""


def outage_reference(prepared: Prepared) -> Reference | None:
    """Return what the outages are judged by."""
    log, section = prepared.log, prepared.scenario.log
    assert section is not None
    if log.reference is not None or log.fixes is None or section.gnss is None:
        return log.reference
    f, arm = log.fixes, section.gnss.lever_arm_m
    return Reference("the withheld fixes", f.time, f.latitude, f.longitude, f.height, lever_arm=arm)


def outage_pass(imu: ImuData, prepared: Prepared, start: Start, spans: tuple[tuple[float, float], ...]) -> Estimate:
    """Run the filter once more from its start, without the satellites of some spans."""
    log, section, settings = prepared.log, prepared.scenario.log, prepared.scenario.filter
    assert section is not None
    assert section.gnss is not None
    assert log.fixes is not None
    assert settings is not None
    without = gnss_readings(log.fixes, section.gnss, spans)
    kinds = {sensor.measurements.label for sensor in without}
    others = (sensor for sensor in log.sensed if sensor.measurements.label not in kinds)
    once = settings.model_copy(update={"backward": False})  # outages are judged forwards, and smoothed
    scenario = prepared.scenario.model_copy(update={"filter": once})
    changed = replace(prepared, scenario=scenario, log=replace(log, sensed=(*without, *others), outages=spans))
    return aid_recorded(changed, imu, start, history=settings.smooth)


def outage_errors(
    estimate: Estimate, error: NavError, smoothed: NavError | None, outages: Sequence[tuple[float, float]]
) -> list[OutageErrors]:
    """Return for every outage its times, s, the horizontal and height error and the velocity error of the filter at the
    last known instant, its own 1σ of the horizontal position there, and the largest horizontal error of the smoothed
    solution, if there is one, within it. Errors are differences from the reference, or from the withheld fixes, at the
    filter's epochs."""
    rows = []
    for begin, end in outages:
        during = (error.time > begin) & (error.time <= end + 1e-9)
        known = np.flatnonzero(during & np.isfinite(error.position_ned).all(axis=1))
        if not len(known):
            continue
        k = int(known[-1])
        row: OutageErrors = {
            "from_s": float(begin),
            "to_s": float(end),
            "at_s": float(error.time[k]),
            "horizontal_error_m": float(error.horizontal[k]),
            "height_error_m": float(error.height[k]),
            "velocity_error_mps": float(error.speed[k]),
            "horizontal_sigma_m": float(np.hypot(*estimate.sigma[k, :2])),
        }
        if smoothed is not None:
            inside = (smoothed.time > begin) & (smoothed.time <= end + 1e-9)
            values = smoothed.horizontal[inside]
            values = values[np.isfinite(values)]
            row["smoothed_max_horizontal_error_m"] = float(values.max()) if len(values) else math.nan
        rows.append(row)
    return rows


STRAIGHT_S = 2.0  # s; velocity by the fixes alone: two intervals of a receiver with one fix a second, or a longer one


def straight_line_error(fixes: FixStream, begin: float, at: float) -> float:
    """Return the horizontal distance, m, of a withheld fix at a time from the straight line through the last fixes
    before the beginning of the outage, s; NaN with fewer than two fixes in the seconds before it."""
    known = np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude)
    time, latitude, longitude = fixes.time[known], fixes.latitude[known], fixes.longitude[known]
    withheld = int(np.argmin(np.abs(time - at)))
    interval = float(np.median(np.diff(time)))
    before = np.flatnonzero((time <= begin) & (time > begin - max(STRAIGHT_S, interval) - 0.5 * interval))
    if len(before) < 2 or before[-1] >= withheld:
        return math.nan
    first, last = int(before[0]), int(before[-1])
    ahead = (time[withheld] - time[last]) / (time[last] - time[first])
    r1, r2 = earth.radii(latitude[last])
    north, east = ((x[withheld] - x[last]) - ahead * (x[last] - x[first]) for x in (latitude, np.unwrap(longitude)))
    return math.hypot(float(r1) * north, float(r2) * math.cos(latitude[last]) * east)
