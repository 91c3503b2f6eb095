"""The sensors of the one-component system: two accelerometers, and one sensor of the pitch for each variant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.statistics.random_numbers import normals
from sinssim.truth.one_component_configuration import OneComponent, PlaneAccelerometer
from sinssim.truth.one_component_motion import PlaneIncrements, PlaneMotion
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, PPM, UG


@dataclass(frozen=True)
class PlaneReadings:
    """Readings of the sensors of one variant; those of the other variants are None.

    Attributes:
        time: edges of the intervals, (N+1,) s.
        dvel: integrals of the specific force along the body and up, (N, 2) m/s.
        dtheta: integrals of the rate, of "one-integral", (N,) rad.
        angle: inertial angle α − y at the edges, of "measured", (N+1,) rad.
        dvel_arm: integrals of the specific force at the end of the arm, of "two-integrals", (N,) m/s.
    """

    time: Array
    dvel: Array
    dtheta: Array | None = None
    angle: Array | None = None
    dvel_arm: Array | None = None


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
    """Return the readings of the sensors with their errors.

    Args:
        seed: the run's seed, for the noise.
    """
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
