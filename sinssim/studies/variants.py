"""The three sets of sensors of section 8.1 on the same motion: what they read, at any rate, and navigation from it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.scenario.imu import ImuSection
from sinssim.studies.samples import sums

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


@dataclass(frozen=True)
class Readings:
    """What one set of sensors reads along a motion.

    Attributes:
        imu: increments; of a set without gyros, those that its accelerometers give.
        attitude: measured attitude in inertial space at the edges, (N+1, 4), of a set that measures it.
        accelerometers: increments of single accelerometers, (N, 6) m/s, of a set without gyros.
        arm: of that set's cube, m.
        rate: inertial angular rate at the start, (3,) rad/s, which that set has to be told.
    """

    imu: ImuData
    attitude: Array | None = None
    accelerometers: Array | None = None
    arm: float = 0.0
    rate: Array | None = None

    def at(self, ratio: int) -> Readings:
        """Return the same readings at a lower rate.

        Args:
            ratio: how many samples make one.

        Returns:
            Sums of the increments, and every so-manieth attitude.
        """
        count = len(self.imu) // ratio
        time = self.imu.time[: count * ratio + 1 : ratio].copy()
        if self.accelerometers is not None and self.rate is not None:
            from sinssim.strapdown.gyro_free import cube, gyro_free_increments

            summed = sums(self.accelerometers, ratio)
            imu = gyro_free_increments(time, summed, cube(self.arm), self.rate)
            return Readings(imu, None, summed, self.arm, self.rate)
        if ratio == 1:
            return self
        imu = ImuData(time, sums(self.imu.dtheta, ratio), sums(self.imu.dvel, ratio))
        return Readings(imu, None if self.attitude is None else self.attitude[: count * ratio + 1 : ratio].copy())

    def navigate(self, initial: NavState, height: Array | None, options: dict[str, Any]) -> NavSolution:
        """Navigate from the readings.

        Args:
            initial: state at the start.
            height: reference height at the edges, (N+1,) m, or None.
            options: those of `sinssim.navigate`; a measured attitude needs no algorithm, frame or vertical channel.

        Returns:
            The solution.

        Raises:
            InputError: an option that the data or the engine do not admit.
            RunError: the frame cannot follow the motion.
        """
        if self.attitude is not None:
            from sinssim.strapdown.measured_attitude import navigate_by_attitude

            return navigate_by_attitude(
                self.imu.time,
                self.imu.dvel,
                self.attitude,
                initial,
                gravity=options["gravity"],
                ellipsoid=options["ellipsoid"],
                height=height,
            )
        from sinssim.strapdown.navigate import navigate

        return navigate(self.imu, initial, height=height, **options)


def read(
    variant: str,
    trajectory: Trajectory,
    ideal: ImuData,
    section: ImuSection,
    seed: int,
) -> Readings:
    """Return what a set of sensors reads at the highest rate.

    Args:
        variant: one of `sinssim.studies.claim_names.VARIANTS`.
        trajectory: the true motion.
        ideal: ideal increments of an ordinary block along it.
        section: the sensors' errors. The attitude sensor drifts as the gyros are biased.
        seed: of the errors.

    Returns:
        The readings.
    """
    from sinssim.sensors import emulate
    from sinssim.sensors.imu_errors import draw

    if arm := re.fullmatch(r"six-accelerometers-([\d.]+)m", variant):
        from sinssim.sensors.accelerometers import emulate_accelerometers
        from sinssim.strapdown.gyro_free import cube
        from sinssim.truth.accelerometers import accelerometer_increments

        layout = cube(float(arm[1]))
        rate_hz = 1.0 / float(ideal.time[1] - ideal.time[0])
        time, dvel = accelerometer_increments(trajectory, layout.position, layout.direction, round(rate_hz, 6))
        measured = emulate_accelerometers(time, dvel, section, seed)
        return Readings(ideal, None, measured, float(arm[1]), trajectory.rates(np.asarray(ideal.time[0]))[0])
    measured_imu = emulate(ideal, section, seed)
    if variant == "attitude-sensor":
        from sinssim.sensors.attitude_sensor import AttitudeSensorErrors, inertial_attitude, sense_attitude

        q_ib = inertial_attitude(trajectory.state(ideal.time), ideal.time, trajectory.ellipsoid)
        errors = AttitudeSensorErrors(drift=draw(section, seed).gyro.bias)
        return Readings(measured_imu, sense_attitude(ideal.time, q_ib, errors, seed))
    return Readings(measured_imu)
