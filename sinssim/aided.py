"""The aided solution of a run: what the filter is told about a scenario, its estimate, and how far that is from truth.

The filter is told the truth about all noises: the standard deviations that the emulated errors were drawn from. An
error that a scenario gives as a number is unknown to it, with a standard deviation as large as the number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from sinssim import units
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState
from sinssim.errors import InputError, SinssimError
from sinssim.estimation import Block, ErrorModel, Estimate, error_model, nominal_errors, state_errors
from sinssim.estimation.coarse import Start, at_rest, in_motion
from sinssim.estimation.estimate import estimate
from sinssim.estimation.model import crossing_time
from sinssim.estimation.nominal import rows_of
from sinssim.nav_error import NavError, navigation_error
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.scenario.aiding import AidingSection
    from sinssim.sensors.aiding import Sensed
    from sinssim.truth.trajectory import Trajectory

_LEAST_POSITION_M, _LEAST_VELOCITY_MPS, _LEAST_ANGLE_ARCMIN = 0.1, 0.01, 0.1
"""What the filter is told of an initial state that is exact: no covariance is singular."""

_APART = 1 << 41
"""Far from the seeds of scenarios and of calibrations."""


@dataclass(frozen=True)
class Aided:
    """An aided solution, and the truth about it.

    Attributes:
        sensed: what the aiding sensors gave.
        estimate: what the filter made of it.
        truth: true states at its epochs, K rows.
        parameters: true values of the sensors' parameters by block, (size,) or (K, size) each.
        state_errors: actual errors in the filter's own states, (K, n).
        error: of the aided solution, K rows.
        smoothed_error: of the smoothed solution, if there is one.
        smoothed_state_errors: its actual errors in the filter's own states, if there is one.
        nominal_errors: actual errors of what the filter's linear model is about, `Estimate.history`, (R, n).
        end: of the run, s; a filter may have ended before.
    """

    sensed: tuple[Sensed, ...]
    estimate: Estimate
    truth: NavState
    parameters: dict[str, Array]
    state_errors: Array
    error: NavError
    smoothed_error: NavError | None
    smoothed_state_errors: Array | None
    nominal_errors: Array
    end: float


def aid_run(scenario: Scenario, trajectory: Trajectory, imu: ImuData, initial: NavState) -> Aided:
    """Emulate a scenario's aiding sensors, estimate by its filter, and compare with the truth.

    Args:
        scenario: with an [aiding] and a [filter] section.
        trajectory: the true motion.
        imu: increments that the engine navigates on.
        initial: state that navigation starts from.

    Returns:
        The aided solution; of a filter that diverged, what there was until then.

    Raises:
        InputError: a sensor that cannot read in so short a run, a coarse alignment of a vehicle that moves, rates that
            do not fit together.
    """
    from sinssim.sensors.aiding import aid

    section, aiding = scenario.filter, scenario.aiding
    assert section is not None
    assert aiding is not None
    sensed = tuple(aid(trajectory, aiding, scenario.seed, _better_system(scenario, trajectory)))
    model, edges = filter_model(scenario, float(imu.time[-1] - imu.time[0])), imu.time
    told = [_told(s.measurements, section.measurement_noise_factor) for s in sensed]
    start = Start(imu, initial, None)
    if section.alignment_s is not None:
        start = _aligned(scenario, trajectory, start, told, model)
    found = estimate(
        start.imu,
        start.state,
        [_after(m, float(start.imu.time[0])) for m in told],
        model,
        covariance=start.covariance,
        loop=section.loop,
        rate_hz=section.rate_hz,
        gate=section.gate or None,
        smooth=section.smooth,
        history=True,
        gravity=scenario.navigation.gravity,
        ellipsoid=trajectory.ellipsoid.name,
    )
    return _compared(scenario, trajectory, edges, sensed, found)


def filter_model(scenario: Scenario, duration: float = 3600.0) -> ErrorModel:
    """Return the error model of a scenario's filter.

    Args:
        scenario: with an [aiding] and a [filter] section.
        duration: of the run, s.

    Returns:
        Navigation, the inertial sensors' blocks that the section names, and those of the aiding sensors.
    """
    f, start = scenario.filter, scenario.navigation.initial_error
    assert f is not None
    assert scenario.aiding is not None

    def told(given: float | None, least: float, *known: float) -> float:
        return max(least, math.hypot(*known)) if given is None else given

    own, s = f.initial_sigma, start
    north = told(own.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.north_m)
    east = told(own.position_m, _LEAST_POSITION_M, s.position_sigma_m, s.east_m)
    height = told(own.height_m, _LEAST_POSITION_M, s.height_sigma_m, s.height_m)
    velocity = [
        told(own.velocity_mps, _LEAST_VELOCITY_MPS, s.velocity_sigma_mps, v)
        for v in (s.velocity_north_mps, s.velocity_east_mps, s.velocity_down_mps)
    ]
    tilt = told(own.tilt_arcmin, _LEAST_ANGLE_ARCMIN, s.tilt_sigma_arcmin, s.roll_arcmin, s.pitch_arcmin)
    heading = told(own.heading_arcmin, _LEAST_ANGLE_ARCMIN, s.heading_sigma_arcmin, s.heading_arcmin)
    return error_model(
        inertial_sigma(scenario),
        position=(north, east, height),
        velocity=velocity,
        attitude=np.array([tilt, tilt, heading]) * units.ARCMIN,
        imu=f.states,
        extra=_aiding_blocks(scenario.aiding, f.measurement_noise_factor),
        duration=duration,
    )


def inertial_sigma(scenario: Scenario) -> ImuErrors:
    """Return the standard deviations of the inertial sensors' errors that a scenario's filter is told.

    Args:
        scenario: with a [filter] section.

    Returns:
        Of what is left after the calibration, if there is one; noises in the section's parts of the true.
    """
    from sinssim.alignment.budget import Expected, expected_errors
    from sinssim.scenario.imu import ImuSection
    from sinssim.sensors.compensation import KNOWN

    assert scenario.filter is not None
    noise = expected_errors(scenario.imu)
    calibrated = scenario.compensation
    kept = noise
    if calibrated is not None:
        kept = expected_errors(ImuSection(grade="ideal", **calibrated.model_dump()))
    factor = scenario.filter.inertial_noise_factor

    def triad(name: Literal["gyro", "accel"]) -> TriadErrors:
        def size(of: Expected, field: str) -> Array:  # what is fixed and what is drawn, together
            return np.asarray(np.hypot(getattr(getattr(of.mean, name), field), getattr(getattr(of.sigma, name), field)))

        own: TriadErrors = getattr(noise.sigma, name)
        return replace(
            own,
            **dict[str, Any](ramp=size(noise, "ramp"), **{field: size(kept, field) for field in KNOWN}),
            random_walk=factor * own.random_walk,
            instability=factor * own.instability,
        )

    some_run = draw(scenario.imu, scenario.seed)
    return replace(
        some_run if calibrated is None else replace(some_run, arms=np.zeros((3, 3)), delay=0.0),
        gyro=triad("gyro"),
        accel=triad("accel"),
        warm_up=noise.sigma.warm_up,
    )


def _aiding_blocks(aiding: AidingSection, factor: float) -> Iterator[Block]:
    """Yield the blocks of what aiding sensors are off by, where they are."""

    def block(name: str, sigma: Sequence[float], tau: float = math.inf) -> Iterator[Block]:
        if any(sigma):
            yield Block(name, factor * np.array(sigma), correlation_time=tau)

    if (g := aiding.gnss) is not None:
        slow = (g.correlated_position_sigma_m, g.correlated_position_sigma_m, g.correlated_height_sigma_m)
        if g.position:
            yield from block("gnss-position bias", slow, g.correlation_time_s)
        if g.velocity:
            yield from block("gnss-velocity bias", (g.correlated_velocity_sigma_mps,) * 3, g.correlation_time_s)
        yield from block("gnss lever arm", (g.lever_arm_sigma_m,) * 3)
    if (b := aiding.baro) is not None:
        yield from block("baro bias", (b.bias_sigma_m,), b.bias_correlation_time_s)
        yield from block("baro scale", (units.PPM * math.hypot(b.scale_sigma_ppm, b.scale_ppm or 0.0),))
    if (m := aiding.magnetometer) is not None:
        yield from block("magnetometer bias", (units.DEG * math.hypot(m.bias_sigma_deg, m.bias_deg or 0.0),))
        yield from block("magnetometer deviation", (units.DEG * m.deviation_sigma_deg,) * 2)
    if (a := aiding.airspeed) is not None:
        yield from block("airspeed bias", (math.hypot(a.bias_sigma_mps, a.bias_mps or 0.0),))
        yield from block("airspeed scale", (units.PPM * math.hypot(a.scale_sigma_ppm, a.scale_ppm or 0.0),))
        yield from block("airspeed wind", (a.wind_sigma_mps,) * 2, a.wind_correlation_time_s)
    if (o := aiding.odometer) is not None:
        yield from block("odometer scale", (units.PPM * math.hypot(o.scale_sigma_ppm, o.scale_ppm or 0.0),))
    if (r := aiding.attitude) is not None:
        yield from block("attitude bias", (units.ARCMIN * r.bias_sigma_arcmin,) * 3, r.bias_correlation_time_s)
    if (t := aiding.star_tracker) is not None:
        yield from block("star-tracker bias", (units.ARCSEC * t.bias_sigma_arcsec,) * 3)
    if (w := aiding.master) is not None:
        if w.velocity:
            yield from block("master-velocity bias", (w.velocity_drift_mps,) * 3, w.drift_time_s)
        if w.attitude:
            yield from block("master-attitude bias", (units.ARCMIN * w.mounting_sigma_arcmin,) * 3)


def _better_system(scenario: Scenario, trajectory: Trajectory) -> NavSolution | None:
    """Return what the better system of a transfer alignment navigates, from the true state at its own place."""
    section = scenario.aiding.master if scenario.aiding is not None else None
    if section is None:
        return None
    from sinssim.scenario.imu import ImuSection
    from sinssim.sensors import emulate
    from sinssim.strapdown import navigate
    from sinssim.truth.vibration import Vibrating

    place = Vibrating(trajectory, (), section.lever_arm_m)
    ideal = place.increments(scenario.imu.rate_hz)
    imu = emulate(ideal, ImuSection(grade=section.grade, rate_hz=scenario.imu.rate_hz), scenario.seed + _APART)
    return navigate(
        imu,
        place.state(place.start),
        algorithm="quaternion",
        gravity=scenario.navigation.gravity,
        ellipsoid=trajectory.ellipsoid.name,
        vertical="baro-loop",
        height=place.state(ideal.time).height,
    )


def _aligned(
    scenario: Scenario, trajectory: Trajectory, start: Start, told: Sequence[Measurements], model: ErrorModel
) -> Start:
    """Return where the filter starts after the scenario's coarse alignment."""
    section, imu, sigma = scenario.filter, start.imu, inertial_sigma(scenario)
    assert section is not None
    assert section.alignment_s is not None
    count = int(np.searchsorted(imu.time, imu.time[0] + section.alignment_s - 1e-9))
    if count >= len(imu):
        raise InputError(
            f"filter.alignment_s = {section.alignment_s:g}: the run lasts {imu.time[-1] - imu.time[0]:g} s, and the "
            "filter needs a part of it after the alignment."
        )
    if section.alignment == "at-rest":
        try:
            return at_rest(imu, start.state, model, sigma, count)
        except SinssimError as error:
            raise InputError(
                f"filter.alignment_s = {section.alignment_s:g}: the vehicle must stand that long, with gyros that feel "
                f"the Earth turn, and {error}"
            ) from error
    fixes = {m.kind: m for m in told if m.label in ("gnss-position", "gnss-velocity")}
    gravity, ellipsoid = scenario.navigation.gravity, trajectory.ellipsoid.name
    try:
        return in_motion(imu, fixes["gnss-position"], fixes["gnss-velocity"], sigma, count, gravity, ellipsoid)
    except SinssimError as error:
        raise type(error)(f"filter.alignment_s = {section.alignment_s:g}: {error}") from error


def _told(measurements: Measurements, factor: float) -> Measurements:
    """Return readings with the noise that the filter is told."""
    return replace(measurements, sigma=factor * measurements.sigma)


def _after(measurements: Measurements, start: float) -> Measurements:
    """Return the readings after the filter's start."""
    m, later = measurements, measurements.time > start + 1e-9
    return replace(m, time=m.time[later], arrival=m.arrival[later], value=m.value[later], sigma=m.sigma[later])


def _compared(
    scenario: Scenario, trajectory: Trajectory, edges: Array, sensed: tuple[Sensed, ...], found: Estimate
) -> Aided:
    """Put the truth beside an estimate."""
    truth = trajectory.state(found.time)
    parameters = _true_parameters(scenario, edges, sensed, found.time, found.model)
    errors = state_errors(found.model, found, truth, parameters, trajectory.ellipsoid)
    error = navigation_error(truth, found.solution, trajectory.ellipsoid)
    smoothed_error = smoothed_errors = None
    if (smoothed := found.smoothed) is not None:
        there = trajectory.state(smoothed.time)
        own = _true_parameters(scenario, edges, sensed, smoothed.time, found.model)
        smoothed_error = navigation_error(there, smoothed.solution, trajectory.ellipsoid)
        smoothed_errors = state_errors(found.model, smoothed, there, own, trajectory.ellipsoid)
    nominal = np.zeros((0, found.model.size))
    if (history := found.history) is not None:
        rows = found.rows
        kept = {name: value[rows] if value.ndim > 1 else value for name, value in parameters.items()}
        nominal = nominal_errors(found.model, history, rows_of(truth, rows), kept, trajectory.ellipsoid)
    return Aided(
        sensed, found, truth, parameters, errors, error, smoothed_error, smoothed_errors, nominal, float(edges[-1])
    )


def _true_parameters(
    scenario: Scenario, edges: Array, sensed: tuple[Sensed, ...], time: Array, model: ErrorModel
) -> dict[str, Array]:
    """Return the true values of the parameters of all sensors at some instants, by block."""
    errors = draw(scenario.imu, scenario.seed)
    left = {"gyro": errors.gyro, "accelerometer": errors.accel}
    if scenario.compensation is not None:
        from sinssim.sensors.compensation import draw_calibration

        known = draw_calibration(scenario.imu, scenario.compensation, scenario.seed)
        for name, triad in (("gyro", known.gyro), ("accelerometer", known.accel)):
            true = left[name]
            left[name] = replace(
                true,
                bias=true.bias - triad.bias,
                scale=true.scale - triad.scale,
                misalignment=true.misalignment - triad.misalignment,
                bias_temperature=true.bias_temperature - triad.bias_temperature,
            )
    found: dict[str, Array] = {}
    left_over = replace(errors, gyro=left["gyro"], accel=left["accelerometer"])
    drifts = _alone(left_over, ("rate_walk", "ramp", "bias_temperature"), edges, time, scenario.seed, 1.0)
    for k, (name, triad) in enumerate(left.items()):
        bias = triad.bias + drifts[k]
        if triad.flicker:  # what of it is quicker the filter takes for noise
            bias = bias + _alone(left_over, ("flicker",), edges, time, scenario.seed, crossing_time(triad))[k]
        found[f"{name} bias"], found[f"{name} scale"] = bias, triad.scale
        found[f"{name} misalignment"] = triad.misalignment[~np.eye(3, dtype=bool)]
    instabilities = _alone(left_over, ("instability", "correlation_time"), edges, time, scenario.seed, 0.0)
    found |= dict(zip(("gyro instability", "accelerometer instability"), instabilities, strict=True))
    for sensor in sensed:
        for name, value in sensor.parameters.items():
            if value.ndim > 1:
                value = np.column_stack([np.interp(time, sensor.time, column) for column in value.T])
            found[name] = value
    return {name: value for name, value in found.items() if name in model.slices}


def _alone(
    errors: ImuErrors, fields: tuple[str, ...], edges: Array, time: Array, seed: int, window: float
) -> tuple[Array, Array]:
    """Return what some errors add to the rates and specific forces of this run, (K, 3) each, zeros if there are none.

    It is what the emulator makes of no motion with nothing else wrong, on the mean over the last seconds, one sample at
    least: its own draws are the same whatever else is switched on.
    """
    if not any(np.any(getattr(t, f)) for t in (errors.gyro, errors.accel) for f in fields if f != "correlation_time"):
        return np.zeros(3), np.zeros(3)
    from sinssim.sensors import emulate

    def alone(triad: TriadErrors) -> TriadErrors:
        return TriadErrors(**{field: getattr(triad, field) for field in fields})

    none = np.zeros((len(edges) - 1, 3))
    of_these = ImuErrors(alone(errors.gyro), alone(errors.accel), warm_up=errors.warm_up)
    drift = emulate(ImuData(edges, none, none), of_these, seed)
    last = np.searchsorted(edges, time - 1e-9).clip(1, len(edges) - 1)
    first = np.searchsorted(edges, edges[last] - window - 1e-9).clip(0, last - 1)

    def mean(increments: Array) -> Array:
        total = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
        return np.asarray((total[last] - total[first]) / (edges[last] - edges[first])[:, np.newaxis])

    return mean(drift.dtheta), mean(drift.dvel)
