"""A direct attitude sensor: a gyro with three degrees of freedom that measures the attitude in inertial space."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.sensors.imu.imu import Imu, draw
from sinssim.sensors.sets.sensor_set import AttitudeSensor
from sinssim.statistics.random_numbers import normals
from sinssim.units import ARCSEC


@dataclass(frozen=True)
class AttitudeSensorErrors:
    """The errors of the sensor: bias and drift of its inertial reference, and noise of the readings.

    Attributes:
        bias: rotation vector of the reference's error at the first reading, inertial axes, (3,) rad.
        drift: rate of this error, inertial axes, (3,) rad/s.
        noise: 1σ of every reading about every axis of the body, rad.
    """

    bias: Array = field(default_factory=lambda: np.zeros(3))
    drift: Array = field(default_factory=lambda: np.zeros(3))
    noise: float = 0.0


def draw_attitude_sensor(imu: Imu, seed: int = 0) -> AttitudeSensorErrors:
    """Return the errors of one run's attitude sensor: given values plus random ones.

    Args:
        imu: the sensor block, whose sensor_set is an attitude sensor. By default its drift follows
            from its gyro biases.
        seed: the run's seed.

    Returns:
        The errors, SI.

    Raises:
        InputError: the seed cannot be used, or the block has another sensor set.
    """
    sensor = imu.sensor_set
    if not isinstance(sensor, AttitudeSensor):
        raise InputError(f'sensor_set.type = "{sensor.type}" has no attitude sensor.')
    own = {"gyro_bias_deg_h": sensor.drift_deg_h, "gyro_bias_sigma_deg_h": sensor.drift_sigma_deg_h}
    if any(value is not None for value in own.values()):
        imu = imu.model_copy(update=own)
    drift = draw(imu, seed).gyro.bias
    normal = [normals(seed, "attitude sensor bias", i, 1) for i in range(3)]
    bias = np.array(sensor.bias_arcsec or (0.0, 0.0, 0.0)) + (sensor.bias_sigma_arcsec or 0.0) * np.concatenate(normal)
    return AttitudeSensorErrors(bias * ARCSEC, drift, sensor.noise_arcsec * ARCSEC)


def inertial_attitude(state: NavState, time: Array, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the attitude relative to the inertial frame that coincides with the Earth-fixed one at t = 0.

    Args:
        state: true states, N rows.
        time: times of the states, (N,) s.

    Returns:
        Quaternions q_ib, (N, 4).
    """
    longitude = state.longitude + ellipsoid.omega * np.asarray(time, dtype=np.float64)
    return rotation.multiply(earth.q_en(state.latitude, longitude), state.q_nb)


def sense_attitude(time: Array, q_ib: Array, errors: AttitudeSensorErrors, seed: int = 0) -> Array:
    """Return the readings of the sensor: q̃_ib = q(bias + drift (t − t₀)) ∘ q_ib ∘ q(noise).

    Args:
        time: times of the readings, (N,) s.
        q_ib: true attitudes, (N, 4).
        seed: the run's seed; the noise of each axis has its own random numbers.

    Returns:
        Measured attitudes, unit quaternions, (N, 4).

    Raises:
        InputError: the seed cannot be used.
    """
    off = errors.bias + np.multiply.outer(time - time[0], errors.drift)
    measured = rotation.multiply(rotation.quaternion_from_rotation_vector(off), q_ib)
    if errors.noise:
        white = [normals(seed, "attitude sensor noise", i, len(time)) for i in range(3)]
        noise = rotation.quaternion_from_rotation_vector(errors.noise * np.stack(white, axis=1))
        measured = rotation.multiply(measured, noise)
    return rotation.normalize(measured)
