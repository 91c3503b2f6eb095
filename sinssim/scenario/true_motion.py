"""The true motion of a scenario, with the sensor block at its place and mounting."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.arguments import check_kind
from sinssim.scenario.sections.imu import ImuSection

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


def block_of(vehicle: Trajectory, section: ImuSection) -> Trajectory:
    """Return the true motion of the IMU, which is that of a rotating IMU with [imu.rotation].

    Args:
        vehicle: the true motion at the block's place, in the axes of its mounting.
        section: the [imu] section of a scenario.

    Returns:
        The motion of the rotating IMU; that of the vehicle without [imu.rotation].

    Raises:
        InputError: the section is not an [imu] section.
    """
    check_kind("section", section, ImuSection, "ImuSection, for example scenario.imu")
    if section.rotation is None:
        return vehicle
    from sinssim.truth.motions.turning_block import TurningBlock

    return TurningBlock(vehicle, section.rotation.turning(vehicle.start, vehicle.end))
