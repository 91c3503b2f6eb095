"""The true errors of one run's sensors, drawn once for all uses."""

from __future__ import annotations

from dataclasses import dataclass

from sinssim.sensors.imu.compensation import Compensation
from sinssim.sensors.imu.encoder import EncoderErrors, draw_encoders
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu import Imu, draw
from sinssim.sensors.sets.accelerometers import APART, draw_accelerometers
from sinssim.sensors.sets.attitude_sensor import AttitudeSensorErrors, draw_attitude_sensor
from sinssim.sensors.sets.platform import PlatformErrors, draw_platform
from sinssim.sensors.sets.sensor_set import AttitudeSensor, Platform, Redundant, SixAccelerometers
from sinssim.sensors.sets.single_sensors import draw_single_sensors
from sinssim.system.short_repr import short_repr


@short_repr
@dataclass(frozen=True)
class TrueErrors:
    """The true errors of one run's sensors.

    Attributes:
        imu: errors of a block of three gyros and three accelerometers.
        calibration: calibration values of these errors, None without a calibration.
        accelerometers: errors of the six single accelerometers in threes, for a set that has them.
        attitude_sensor: errors of the attitude sensor, for a set that has one.
        single_sensors: errors of the single sensors in threes, for a redundant set.
        single_calibrations: calibration values of these errors; empty without a calibration.
        left: the sensor block with the 1σ that [compensation] leaves, by which a redundant set is monitored.
        platform: errors of the torquers and of the gimbals' pick-offs, for a platform.
        encoders: errors of the encoders, for a block that turns.
    """

    imu: ImuErrors
    calibration: ImuErrors | None = None
    accelerometers: tuple[TriadErrors, ...] = ()
    attitude_sensor: AttitudeSensorErrors | None = None
    single_sensors: tuple[ImuErrors, ...] = ()
    single_calibrations: tuple[ImuErrors, ...] = ()
    left: Imu | None = None
    platform: PlatformErrors | None = None
    encoders: EncoderErrors | None = None


def draw_true_errors(imu: Imu, seed: int = 0, compensation: Compensation | None = None) -> TrueErrors:
    """Return the errors of one run's sensors: given values plus random ones.

    Args:
        imu: the sensor block: the sensor set, and its errors.
        seed: the run's seed.
        compensation: its compensation, if there is one.

    Returns:
        The errors, SI.

    Raises:
        InputError: the seed cannot be used.
    """
    if isinstance(imu.sensor_set, Redundant):
        blocks = draw_single_sensors(imu, len(imu.sensor_set.axes), seed)
        if compensation is None:
            return TrueErrors(blocks[0], single_sensors=blocks)
        known = tuple(compensation.draw(one, seed + k * APART) for k, one in enumerate(blocks))
        left = compensation.left(imu)
        return TrueErrors(blocks[0], single_sensors=blocks, single_calibrations=known, left=left)
    own = draw(imu, seed)
    return TrueErrors(
        own,
        None if compensation is None else compensation.draw(own, seed),
        tuple(draw_accelerometers(imu, 6, seed)) if isinstance(imu.sensor_set, SixAccelerometers) else (),
        draw_attitude_sensor(imu, seed) if isinstance(imu.sensor_set, AttitudeSensor) else None,
        platform=draw_platform(imu, seed) if isinstance(imu.sensor_set, Platform) else None,
        encoders=draw_encoders(imu, seed),
    )
