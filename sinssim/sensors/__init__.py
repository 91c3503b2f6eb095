"""Sensors: their readings of the true motion, by equation (2) and further error terms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.sensors.imu.emulation import emulate as emulate
    from sinssim.sensors.imu.generated_imu_keys import TriadErrors as TriadErrors
    from sinssim.sensors.imu.grades import GRADES as GRADES
    from sinssim.sensors.imu.imu_errors import ImuErrors as ImuErrors
    from sinssim.sensors.imu.imu_section import Imu as Imu
    from sinssim.sensors.imu.imu_section import draw as draw

__getattr__, __dir__, __all__ = on_first_use(__name__)
