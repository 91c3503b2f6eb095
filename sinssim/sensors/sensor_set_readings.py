"""Readings of the sensor sets of section 8.1 and of a redundant set on one motion, with a run's true errors.

The readings are given at any rate. The true errors of a run are drawn once for all uses.

An attitude sensor is a gyro with three degrees of freedom that measures the attitude in inertial space.

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

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState, short_repr
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError
from sinssim.sensors.fault_detection import Monitored, combine, monitor
from sinssim.sensors.imu.compensation import Compensation
from sinssim.sensors.imu.emulation import measured_increments, perfect_increments
from sinssim.sensors.imu.error_term_table import OF_TURNS, of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.sensors.imu.rotation_encoder import EncoderErrors, draw_encoders
from sinssim.sensors.sensor_set_section import AttitudeSensor, Platform, Redundant, SixAccelerometers
from sinssim.sensors.single_sensors import (
    APART,
    SingleSensors,
    compensate_single_sensors,
    cube,
    draw_accelerometers,
    draw_single_sensors,
    emulate_accelerometers,
    emulate_single_sensors,
    gyro_free_increments,
    perfect_readings,
)
from sinssim.statistics.random_numbers import normals
from sinssim.units import ARCSEC, PPM

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

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


@short_repr
@dataclass(frozen=True)
class TrueErrors:
    """The true errors of one run's sensors."""

    imu: ImuErrors  # errors of a block of three gyros and three accelerometers
    calibration: ImuErrors | None = None  # calibration values of these errors, None without a calibration
    # errors of the six single accelerometers in threes, for a set that has them
    accelerometers: tuple[TriadErrors, ...] = ()
    attitude_sensor: AttitudeSensorErrors | None = None  # errors of the attitude sensor, for a set that has one
    single_sensors: tuple[ImuErrors, ...] = ()  # errors of the single sensors in threes, for a redundant set
    single_calibrations: tuple[ImuErrors, ...] = ()  # calibration values of these errors; empty without a calibration
    # the sensor block with the 1σ that [compensation] leaves, by which a redundant set is monitored
    left: Imu | None = None
    platform: PlatformErrors | None = None  # errors of the torquers and of the gimbals' pick-offs, for a platform
    encoders: EncoderErrors | None = None  # errors of the encoders, for a block that turns


def draw_true_errors(imu: Imu, seed: int = 0, compensation: Compensation | None = None) -> TrueErrors:
    """Return the errors of one run's sensors, SI: given values plus random ones."""
    if isinstance(imu.sensor_set, Redundant):
        blocks = draw_single_sensors(imu, len(imu.sensor_set.axes), seed)
        if compensation is None:
            return TrueErrors(blocks[0], single_sensors=blocks)
        known = tuple(compensation.draw(block, seed + k * APART) for k, block in enumerate(blocks))
        left = compensation.left(imu)
        return TrueErrors(blocks[0], single_sensors=blocks, single_calibrations=known, left=left)
    block_errors = draw(imu, seed)
    return TrueErrors(
        block_errors,
        None if compensation is None else compensation.draw(block_errors, seed),
        tuple(draw_accelerometers(imu, 6, seed)) if isinstance(imu.sensor_set, SixAccelerometers) else (),
        draw_attitude_sensor(imu, seed) if isinstance(imu.sensor_set, AttitudeSensor) else None,
        platform=draw_platform(imu, seed) if isinstance(imu.sensor_set, Platform) else None,
        encoders=draw_encoders(imu, seed),
    )


@short_repr
@dataclass(frozen=True)
class Readings:
    """Readings of one sensor set along a motion."""

    # increments of angle and velocity; those of angle are NaN for a set that measures the attitude, and come from
    # differences of accelerometers for a set of six accelerometers
    imu: ImuData
    # attitude relative to inertial space at the edges, (N+1, 4), for a set that measures it, else None
    attitude: Array | None = None
    # increments of single accelerometers, (N, 6) m/s, for a set without gyros, else None
    accelerometers: Array | None = None
    arm: float = 0.0  # arm of that set's cube, m
    rate: Array | None = None  # inertial angular rate at the start, (3,) rad/s, which that set needs as initial value
    single: SingleSensors | None = None  # readings of the single sensors of a redundant set, else None
    # what the monitoring of such a set found for gyros and accelerometers; empty without monitoring
    monitored: tuple[Monitored, ...] = ()
    compensated: ImuData | None = None  # increments after the [compensation], None without one
    single_compensated: SingleSensors | None = None  # the single sensors' readings after it, for a redundant set

    def at(self, ratio: int) -> Readings:
        """Return the readings at a lower rate; samples that are left over at the end are dropped.

        A gyro or accelerometer that is read less often counts the same pulses, so its increments are summed.
        """
        if ratio == 1:
            return self
        count = len(self.imu) // ratio
        time = self.imu.time[: count * ratio + 1 : ratio].copy()
        if self.accelerometers is not None and self.rate is not None:
            return _six(time, sums(self.accelerometers, ratio), self.arm, self.rate)
        imu = ImuData(time, sums(self.imu.dtheta, ratio), sums(self.imu.dvel, ratio))
        return Readings(imu, None if self.attitude is None else self.attitude[: count * ratio + 1 : ratio].copy())


def sums(rows: Array, ratio: int) -> Array:
    """Return the increments at a lower rate, each the sum of `ratio` consecutive ones; a remainder at the end is
    dropped.

    Noise, quantisation and all other errors of the samples are the same at every rate; only the resolution of the
    motion differs.
    """
    if ratio == 1:
        return rows
    count = len(rows) // ratio
    return np.asarray(rows[: count * ratio].reshape(count, ratio, -1).sum(axis=1))


def read(
    trajectory: Trajectory, ideal: ImuData, imu: Imu, seed: int = 0, errors: TrueErrors | None = None
) -> tuple[Readings, Readings]:
    """Return the readings of a sensor set without errors, and its actual readings; `ideal` are the increments of a
    usual block along the motion, at its rate."""
    true = draw_true_errors(imu, seed) if errors is None else errors
    if isinstance(imu.sensor_set, SixAccelerometers):
        return _read_six(trajectory, ideal, imu, seed, true, imu.sensor_set.arm_m)
    if isinstance(imu.sensor_set, Redundant):
        return _read_redundant(ideal, imu, seed, true, imu.sensor_set)
    measured, left = measured_increments(trajectory, ideal, imu, true.imu, seed, true.calibration)
    if true.attitude_sensor is None:
        return Readings(perfect_increments(trajectory, ideal, imu)), Readings(measured, compensated=left)
    attitude = inertial_attitude(trajectory.state(ideal.time), ideal.time, trajectory.ellipsoid)
    read_out = sense_attitude(ideal.time, attitude, true.attitude_sensor, seed)
    without_gyros = replace(measured, dtheta=np.full_like(measured.dtheta, np.nan))
    return Readings(ideal, attitude), Readings(without_gyros, read_out)


def _read_redundant(
    ideal: ImuData, imu: Imu, seed: int, errors: TrueErrors, of: Redundant
) -> tuple[Readings, Readings]:
    perfect = Readings(ideal, single=perfect_readings(ideal, of.axes))
    single = emulate_single_sensors(ideal, imu, errors.single_sensors, seed)
    used: _Used = (None, None)
    monitored: tuple[Monitored, ...] = ()
    for _ in range(len(of.axes)):  # until an excluded sensor does not act on the compensation of the others any more
        calibrated, before = _compensated(single, errors.single_calibrations, of.axes, used), used
        if of.mode != "none":
            monitored = monitor(errors.left or imu, ideal.time, calibrated or single)
            used = monitored[0].used, monitored[1].used
        if calibrated is None or _same(used, before):
            break
    read = Readings(_combined(single, of.axes, used), single=single, monitored=monitored)
    if calibrated is None:
        return perfect, read
    return perfect, replace(read, compensated=_combined(calibrated, of.axes, used), single_compensated=calibrated)


_Used = tuple[Array | None, Array | None]
_PASSES = 20
_STANDS = 4e-16  # relative


def _same(used: _Used, before: _Used) -> bool:
    """Return whether the same sensors are in use; None stands for all."""
    return all(
        bool(np.all(new)) if old is None else np.array_equal(new, old)
        for new, old in zip(used, before, strict=True)
        if new is not None
    )


def _combined(single: SingleSensors, directions: Array, used: _Used) -> ImuData:
    dtheta, dvel = (
        combine(rows, directions, use) for rows, use in zip((single.dtheta, single.dvel), used, strict=True)
    )
    return ImuData(single.time, dtheta, dvel, axis_flags(single, used))


def _compensated(
    single: SingleSensors, calibrations: tuple[ImuErrors, ...], directions: Array, used: _Used
) -> SingleSensors | None:
    """Return the compensated readings of each sensor, None without a calibration.

    The input across a sensitive axis is that of the combination. It is repeated with the compensated readings until it
    stands still: each pass divides the difference by the reciprocal of the largest misalignment.
    """
    if not calibrations:
        return None
    estimate, compensated = _combined(single, directions, used), single
    for _ in range(_PASSES):
        before = estimate
        compensated = compensate_single_sensors(single, calibrations, directions, before)
        estimate = _combined(compensated, directions, used)
        if all(
            np.abs(new - old).max(initial=0.0) <= _STANDS * np.abs(new).max(initial=0.0)
            for new, old in ((estimate.dtheta, before.dtheta), (estimate.dvel, before.dvel))
        ):
            break
    return compensated


def unmonitored(readings: Readings, directions: Array) -> ImuData:
    """Return the increments that a redundant set gives without monitoring, from all sensors, after the [compensation]
    if there is one."""
    single = readings.single_compensated or readings.single
    assert single is not None
    return _combined(single, directions, (None, None))


def axis_flags(single: SingleSensors, used: Sequence[Array | None]) -> NDArray[np.uint8] | None:
    """Return the flags of the estimate, (N, 6): on each axis those of all sensors of the kind that are used. None if
    the sensors set no flags."""
    if single.flags is None:
        return None
    of_kind = []
    for flags, use in zip(np.split(single.flags, 2, axis=1), used, strict=True):
        kept = flags if use is None else np.where(use, flags, np.uint8(0))
        of_kind.append(np.bitwise_or.reduce(kept, axis=1))
    return np.repeat(np.stack(of_kind, axis=1), 3, axis=1)


def _read_six(
    trajectory: Trajectory, ideal: ImuData, imu: Imu, seed: int, errors: TrueErrors, arm: float
) -> tuple[Readings, Readings]:
    from sinssim.truth.motions.mounted_block import velocity_increments

    layout, rate = cube(arm), trajectory.rates(ideal.time[0])[0]
    time, force = velocity_increments(trajectory, layout.position, imu.rate_hz)
    measured = emulate_accelerometers(time, force, layout.direction, imu, seed, errors.accelerometers)
    return _six(time, layout.feel(force), arm, rate), _six(time, measured, arm, rate)


def _six(time: Array, dvel: Array, arm: float, rate: Array) -> Readings:
    return Readings(gyro_free_increments(time, dvel, cube(arm), rate), None, dvel, arm, rate)
