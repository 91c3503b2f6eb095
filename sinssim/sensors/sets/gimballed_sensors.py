"""Errors of gimballed sensors: a platform's torquers and pick-offs, and a direct attitude sensor.

The attitude sensor is a gyro with three degrees of freedom that measures the attitude in inertial space.

On a platform three gyros and three accelerometers are mounted. Its servo motors hold the gyros at null, so the platform
turns at the rate at which the gyros are torqued, and drifts with the gyros' own drift d:

    ω_ip = (1 + κ) ω_commanded − d                                          about the platform's axes

d is what the gyros read at zero input: bias, its variations, random walk, g-sensitivity in platform axes. The errors
that multiply what a gyro senses (scale factor, misalignment, non-linearity) do not act: the gyros sense no turn of the
vehicle. In their place, the scale factor κ of the torquers multiplies the commanded rate, which is that of the Earth
and of the vehicle's motion around it. A gyro with a torquer that measures by rebalancing has κ as its scale factor,
therefore the default 1σ of κ is that of the gyros' scale factor. A platform that keeps its direction in inertial space
is not torqued and has no such error.

Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 3; Britting, Inertial Navigation
Systems Analysis, 1971, ch. 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.sensors.imu.error_term_table import OF_TURNS, of_triad
from sinssim.sensors.imu.imu import Imu, draw
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.sets.sensor_set import AttitudeSensor, Platform
from sinssim.statistics.random_numbers import normals
from sinssim.units import ARCSEC, PPM

(_SCALE,) = (term for term in of_triad("gyro") if term.field == "scale")


@dataclass(frozen=True)
class PlatformErrors:
    """The errors of a platform apart from those of its gyros and accelerometers."""

    # κ, relative errors of the rates at which the platform turns when torqued, (3,)
    torquer_scale: Array = field(default_factory=lambda: np.zeros(3))
    # errors of the gimbal angles roll, pitch and azimuth, (3,) rad
    pickoff: Array = field(default_factory=lambda: np.zeros(3))
    pickoff_noise: float = 0.0  # 1σ of each measurement of a gimbal angle, rad


def without_errors_of_turns(errors: ImuErrors) -> ImuErrors:
    """Return the errors of a block of three gyros and three accelerometers without what a platform does not have: scale
    factor, misalignment and non-linearity of the gyros, which act on what they sense."""
    cleared = {name: 0.0 * getattr(errors.gyro, name) for name in OF_TURNS}
    return replace(errors, gyro=replace(errors.gyro, **cleared))


def torquer_sigma(imu: Imu) -> float:
    """Return the 1σ of the scale factors of torquing, a ratio: the given one, or that of the scale factor of the gyros;
    0 beside given scale factors without one."""
    platform = imu.sensor_set
    assert isinstance(platform, Platform)
    if platform.torquer_scale_sigma_ppm is not None:
        return platform.torquer_scale_sigma_ppm * PPM
    return 0.0 if platform.torquer_scale_ppm is not None else float(imu.sigma.gyro.scale.max())


def draw_platform(imu: Imu, seed: int = 0) -> PlatformErrors:
    """Return the errors of the platform in one run: given values plus random ones."""
    platform = imu.sensor_set
    if not isinstance(platform, Platform):
        raise InputError(f'sensor_set.type = "{platform.type}" has no platform.')

    def three(term: str) -> Array:
        return np.concatenate([normals(seed, term, axis, 1) for axis in range(3)])

    scale = np.array(platform.torquer_scale_ppm or (0.0, 0.0, 0.0)) * PPM + torquer_sigma(imu) * three("torquer scale")
    pickoff = np.array(platform.pickoff_arcsec or (0.0, 0.0, 0.0))
    pickoff = pickoff + (platform.pickoff_sigma_arcsec or 0.0) * three("gimbal pick-off")
    return PlatformErrors(scale, pickoff * ARCSEC, platform.pickoff_noise_arcsec * ARCSEC)


@dataclass(frozen=True)
class AttitudeSensorErrors:
    """The errors of the sensor: bias and drift of its inertial reference, and noise of the readings."""

    # rotation vector of the reference's error at the first reading, inertial axes, (3,) rad
    bias: Array = field(default_factory=lambda: np.zeros(3))
    drift: Array = field(default_factory=lambda: np.zeros(3))  # rate of this error, inertial axes, (3,) rad/s
    noise: float = 0.0  # 1σ of every reading about every axis of the body, rad


def draw_attitude_sensor(imu: Imu, seed: int = 0) -> AttitudeSensorErrors:
    """Return the errors of the attitude sensor in one run: given values plus random ones. By default its drift follows
    from the gyro biases of the block."""
    sensor = imu.sensor_set
    if not isinstance(sensor, AttitudeSensor):
        raise InputError(f'sensor_set.type = "{sensor.type}" has no attitude sensor.')
    drift_fields = {"gyro_bias_deg_h": sensor.drift_deg_h, "gyro_bias_sigma_deg_h": sensor.drift_sigma_deg_h}
    if any(value is not None for value in drift_fields.values()):
        imu = imu.model_copy(update=drift_fields)
    drift = draw(imu, seed).gyro.bias
    normal = [normals(seed, "attitude sensor bias", i, 1) for i in range(3)]
    bias = np.array(sensor.bias_arcsec or (0.0, 0.0, 0.0)) + (sensor.bias_sigma_arcsec or 0.0) * np.concatenate(normal)
    return AttitudeSensorErrors(bias * ARCSEC, drift, sensor.noise_arcsec * ARCSEC)


def inertial_attitude(state: NavState, time: Array, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the attitude q_ib, (N, 4), relative to the inertial frame that coincides with the Earth-fixed one at t =
    0."""
    longitude = state.longitude + ellipsoid.omega * np.asarray(time, dtype=np.float64)
    return rotation.multiply(earth.q_en(state.latitude, longitude), state.q_nb)


def sense_attitude(time: Array, q_ib: Array, errors: AttitudeSensorErrors, seed: int = 0) -> Array:
    """Return the readings of the sensor, (N, 4): q̃_ib = q(bias + drift (t − t₀)) ∘ q_ib ∘ q(noise). The noise of each
    axis has its own random numbers."""
    off = errors.bias + np.multiply.outer(time - time[0], errors.drift)
    measured = rotation.multiply(rotation.quaternion_from_rotation_vector(off), q_ib)
    if errors.noise:
        white = [normals(seed, "attitude sensor noise", i, len(time)) for i in range(3)]
        noise = rotation.quaternion_from_rotation_vector(errors.noise * np.stack(white, axis=1))
        measured = rotation.multiply(measured, noise)
    return rotation.normalize(measured)
