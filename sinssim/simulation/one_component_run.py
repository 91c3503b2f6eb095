"""Computes a one-component run: the motion, the readings, the navigation, its errors, and the error equations.

The sensors are two accelerometers, and one sensor of the pitch for each variant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.arguments import first_not_finite
from sinssim.data import Array, short_repr
from sinssim.errors import RunError
from sinssim.statistics.random_numbers import normals
from sinssim.strapdown.one_component_system import (
    ConstantErrors,
    ErrorSources,
    OneComponentSolution,
    PlaneErrors,
    closed_form,
    error_along_motion,
    error_first_order,
    error_pendulum,
    simulate,
    simulate_measured,
    simulate_two_integrals,
)
from sinssim.truth.one_component import (
    ArmAccelerometer,
    OneComponent,
    PlaneAccelerometer,
    PlaneAttitudeSensor,
    PlaneGyro,
    PlaneIncrements,
    PlaneInitialError,
    PlaneMotion,
    PlaneState,
)
from sinssim.units import ARCMIN, ARCSEC, DEG_H, DEG_SQRT_H, PPM, UG


@dataclass(frozen=True)
class PlaneReadings:
    """Readings of the sensors of one variant; those of the other variants are None."""

    time: Array  # edges of the intervals, (N+1,) s
    dvel: Array  # integrals of the specific force along the body and up, (N, 2) m/s
    dtheta: Array | None = None  # integrals of the rate, of "one-integral", (N,) rad
    angle: Array | None = None  # inertial angle α − y at the edges, of "measured", (N+1,) rad
    dvel_arm: Array | None = None  # integrals of the specific force at the end of the arm, of "two-integrals", (N,) m/s


def ideal_readings(motion: PlaneMotion, ideal: PlaneIncrements, system: OneComponent) -> PlaneReadings:
    """Return what sensors without errors read."""
    if system.gyro is not None:
        return PlaneReadings(ideal.time, ideal.dvel, dtheta=ideal.dtheta)
    if system.attitude_sensor is not None:
        return PlaneReadings(ideal.time, ideal.dvel, angle=motion.state(ideal.time).pitch - ideal.coordinate)
    assert system.arm_accelerometer is not None  # each variant has its sensor
    arm = system.arm_accelerometer.arm_m
    return PlaneReadings(ideal.time, ideal.dvel, dvel_arm=ideal.dvel[:, 1] + arm * ideal.drate)


def with_errors(ideal: PlaneReadings, system: OneComponent, seed: int) -> PlaneReadings:
    """Return the readings of the sensors with their errors. `seed`: the run's seed, for the noise."""
    interval = np.diff(ideal.time)
    sensors = (system.accelerometer_x, system.accelerometer_y)
    dvel = np.stack(
        [ideal.dvel[:, i] + _push_error(s, ideal.dvel[:, i], interval, seed, i) for i, s in enumerate(sensors)], axis=1
    )
    if (gyro := system.gyro) is not None and ideal.dtheta is not None:
        error = gyro.bias_deg_h * DEG_H * interval + gyro.scale_ppm * PPM * ideal.dtheta
        if gyro.random_walk_deg_sqrt_h:
            noise = normals(seed, "one-component gyro", 0, len(interval))
            error += gyro.random_walk_deg_sqrt_h * DEG_SQRT_H * np.sqrt(interval) * noise
        return PlaneReadings(ideal.time, dvel, dtheta=ideal.dtheta + error)
    if (sensor := system.attitude_sensor) is not None and ideal.angle is not None:
        error = sensor.bias_arcsec * ARCSEC + sensor.drift_deg_h * DEG_H * ideal.time
        if sensor.noise_arcsec:
            noise = normals(seed, "one-component attitude sensor", 0, len(ideal.time))
            error += sensor.noise_arcsec * ARCSEC * noise
        return PlaneReadings(ideal.time, dvel, angle=ideal.angle + error)
    arm, read = system.arm_accelerometer, ideal.dvel_arm
    assert arm is not None  # each variant has its sensor
    assert read is not None
    return PlaneReadings(ideal.time, dvel, dvel_arm=read + _push_error(arm, read, interval, seed, 2))


def _push_error(sensor: PlaneAccelerometer, dvel: Array, interval: Array, seed: int, axis: int) -> Array:
    """Return the error of an accelerometer's increments, (N,) m/s."""
    error = sensor.bias_ug * UG * interval + sensor.scale_ppm * PPM * dvel
    if sensor.random_walk_ug_sqrt_hz:
        noise = normals(seed, "one-component accelerometer", axis, len(interval))
        error += sensor.random_walk_ug_sqrt_hz * UG * np.sqrt(interval) * noise
    return np.asarray(error)


SOURCES = ("accelerometers", "pitch sensor", "initial values")
"""Groups of errors, each of which is simulated alone as well."""


@dataclass(frozen=True)
class SourceErrors:
    """The errors by one of `SOURCES`: simulated, minus those with perfect sensors, and the closed form at rest."""

    name: str
    simulated: PlaneErrors
    closed: PlaneErrors


@short_repr
@dataclass(frozen=True)
class OneComponentResult:
    """A one-component run.

    Attributes:
        section: the [one_component] table.
        truth: true motion at the edges of the intervals.
        coordinate: true y at the edges, (N+1,) rad.
        ideal: readings of sensors without errors.
        measured: readings with errors.
        solution: what the system computes.
        error: its errors.
        perfect: errors of the same computation with perfect sensors and initial values: method and rounding.
        along_motion: solution of (8.10).
        pendulum: solution of (8.11).
        first_order: solution of (8.12).
        closed: closed form of a body at rest, of all constant errors.
        by_source: errors by each group of sources that has any.
    """

    section: OneComponent
    truth: PlaneState
    coordinate: Array
    ideal: PlaneReadings
    measured: PlaneReadings
    solution: OneComponentSolution
    error: PlaneErrors
    perfect: PlaneErrors
    along_motion: PlaneErrors
    pendulum: PlaneErrors
    first_order: PlaneErrors
    closed: PlaneErrors
    by_source: tuple[SourceErrors, ...]

    @property
    def caused(self) -> PlaneErrors:
        """Errors that sensors and initial values cause: those of the run minus those with perfect sensors."""
        return _less(self.error, self.perfect)


def compute(section: OneComponent, seed: int) -> OneComponentResult:
    """Compute a one-component run; the seed is that of the noise."""
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is reported
        return _compute(section, seed)


def _compute(section: OneComponent, seed: int) -> OneComponentResult:
    motion = PlaneMotion(section)
    increments = motion.increments(section.rate_hz)
    time = increments.time
    truth = motion.state(time)
    ideal = ideal_readings(motion, increments, section)
    measured = with_errors(ideal, section, seed)

    def errors_of(readings: PlaneReadings, with_: OneComponent) -> tuple[OneComponentSolution, PlaneErrors]:
        computed = navigate(readings, with_, truth, increments)
        wrong = PlaneErrors(
            time,
            computed.velocity - truth.velocity,
            computed.coordinate - increments.coordinate,
            computed.pitch - truth.pitch,
        )
        return computed, wrong

    solution, error = errors_of(measured, section)
    perfect = errors_of(ideal, only(section, ""))[1]
    by_source = []
    for name in SOURCES:
        alone = only(section, name)
        if alone != only(section, ""):
            simulated = _less(errors_of(with_errors(ideal, alone, seed), alone)[1], perfect)
            by_source.append(SourceErrors(name, simulated, _at_rest(time, alone, truth)))
    sources = error_sources(ideal, measured, section)
    nodes = motion.state(_with_middles(time))
    equations = (
        error_along_motion(time, sources, nodes.pitch, nodes.vertical, section.radius_m),
        error_pendulum(time, sources, nodes.pitch, nodes.vertical, section.radius_m),
        error_first_order(time, sources, nodes.pitch, section.gravity_mps2, section.radius_m),
        _at_rest(time, section, truth),
    )
    _check_finite(error, perfect, *equations, *(source.simulated for source in by_source))
    return OneComponentResult(
        section, truth, increments.coordinate, ideal, measured, solution, error, perfect, *equations, tuple(by_source)
    )


def navigate(
    readings: PlaneReadings, section: OneComponent, truth: PlaneState, increments: PlaneIncrements
) -> OneComponentSolution:
    """Run the system of a variant on its readings, from the true initial values with their errors."""
    error, radius = section.initial_error, section.radius_m
    velocity = float(truth.velocity[0]) + error.velocity_mps
    coordinate = float(increments.coordinate[0]) + error.position_m / radius
    pitch = float(truth.pitch[0]) + error.pitch_arcmin * ARCMIN
    at = {"velocity": velocity, "coordinate": coordinate, "radius": radius}
    if readings.angle is not None:
        return simulate_measured(readings.time, readings.angle, readings.dvel, **at)
    if readings.dtheta is not None:
        return simulate(readings.time, readings.dtheta, readings.dvel, pitch=pitch, **at)
    assert readings.dvel_arm is not None  # one of the three is read
    assert section.arm_accelerometer is not None
    rate = float(truth.rate[0]) + error.rate_deg_h * DEG_H
    return simulate_two_integrals(
        readings.time, readings.dvel_arm, readings.dvel, section.arm_accelerometer.arm_m, pitch=pitch, rate=rate, **at
    )


def only(section: OneComponent, source: str) -> OneComponent:
    """Return a table that has the errors of one of `SOURCES` alone; "" for no errors at all."""
    without: dict[str, object] = {}
    if source != "accelerometers":
        without |= {"accelerometer_x": PlaneAccelerometer(), "accelerometer_y": PlaneAccelerometer()}
    if source != "pitch sensor":
        if section.gyro is not None:
            without["gyro"] = PlaneGyro()
        if section.attitude_sensor is not None:
            without["attitude_sensor"] = PlaneAttitudeSensor()
        if section.arm_accelerometer is not None:
            without["arm_accelerometer"] = ArmAccelerometer(arm_m=section.arm_accelerometer.arm_m)
    if source != "initial values":
        without["initial_error"] = PlaneInitialError()
    return section.model_copy(update=without)


def error_sources(ideal: PlaneReadings, measured: PlaneReadings, section: OneComponent) -> ErrorSources:
    """Return what drives the error equations: the differences of the readings, and the initial errors."""
    h, error = np.diff(ideal.time), section.initial_error
    push = measured.dvel - ideal.dvel
    coordinate, pitch = error.position_m / section.radius_m, error.pitch_arcmin * ARCMIN
    angle = pitch - coordinate
    if measured.dtheta is not None and ideal.dtheta is not None:
        mean = (measured.dtheta - ideal.dtheta) / h
        rate = np.stack([mean, mean], axis=1)
    elif measured.angle is not None and ideal.angle is not None:
        wrong = measured.angle - ideal.angle
        angle, mean = float(wrong[0]), np.diff(wrong) / h
        rate = np.stack([mean, mean], axis=1)
    else:
        assert section.arm_accelerometer is not None  # each variant has its sensor
        assert measured.dvel_arm is not None
        assert ideal.dvel_arm is not None
        steps = (measured.dvel_arm - ideal.dvel_arm - push[:, 1]) / section.arm_accelerometer.arm_m
        ends = error.rate_deg_h * DEG_H + np.concatenate(([0.0], np.cumsum(steps)))
        rate = np.stack([ends[:-1], ends[1:]], axis=1)
    return ErrorSources(push / h[:, None], rate, error.velocity_mps, coordinate, angle)


def constant_errors(section: OneComponent, pitch: float) -> ConstantErrors:
    """Return the constant part of the errors for a body at rest, x pitched by α, rad; noise has none."""
    error, g = section.initial_error, section.gravity_mps2
    x, y = (
        sensor.bias_ug * UG + sensor.scale_ppm * PPM * felt
        for sensor, felt in (
            (section.accelerometer_x, g * np.sin(pitch)), (section.accelerometer_y, g * np.cos(pitch)),
        )
    )  # fmt: skip
    coordinate = error.position_m / section.radius_m
    angle, rate, acceleration = error.pitch_arcmin * ARCMIN - coordinate, 0.0, 0.0
    if section.gyro is not None:  # at rest the gyro reads nothing that a scale factor could act on
        rate = section.gyro.bias_deg_h * DEG_H
    elif section.attitude_sensor is not None:
        angle, rate = section.attitude_sensor.bias_arcsec * ARCSEC, section.attitude_sensor.drift_deg_h * DEG_H
    elif (arm := section.arm_accelerometer) is not None:
        rate = error.rate_deg_h * DEG_H
        acceleration = (arm.bias_ug * UG + arm.scale_ppm * PPM * g * np.cos(pitch) - y) / arm.arm_m
    force = float(x * np.cos(pitch) - y * np.sin(pitch))
    return ConstantErrors(force, rate, float(acceleration), error.velocity_mps, coordinate, angle)


def _check_finite(*errors: PlaneErrors) -> None:
    """Raise for errors that grow beyond all numbers, which those of a free fall do."""
    for error in errors:
        for values in (error.velocity, error.coordinate, error.pitch):
            row = first_not_finite(values)
            if row is not None:
                time = float(error.time[row])
                raise RunError(
                    f"the errors of the one-component system are not finite from t = {time:.2f} s on. Where a_η is "
                    "negative, as at a velocity above √(gR), they grow exponentially: give a shorter run or less "
                    "velocity.",
                    time=time,
                )


def _at_rest(time: Array, section: OneComponent, truth: PlaneState) -> PlaneErrors:
    constant = constant_errors(section, float(truth.pitch[0]))
    return closed_form(time, constant, section.gravity_mps2, section.radius_m)


def _less(error: PlaneErrors, other: PlaneErrors) -> PlaneErrors:
    return PlaneErrors(
        error.time,
        error.velocity - other.velocity,
        error.coordinate - other.coordinate,
        error.pitch - other.pitch,
    )


def _with_middles(time: Array) -> Array:
    """Return the edges of the intervals and their middles in turn, (2N+1,) s."""
    both = np.empty(2 * len(time) - 1)
    both[::2], both[1::2] = time, 0.5 * (time[:-1] + time[1:])
    return both
