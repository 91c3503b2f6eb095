"""Sensors: their readings of the true motion, by equation (2) and further error terms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.sensors.imu.emulate import emulate
    from sinssim.sensors.imu.errors import ImuErrors, TriadErrors, draw
    from sinssim.sensors.imu.grades import GRADES

__all__ = ["GRADES", "ImuErrors", "TriadErrors", "draw", "emulate"]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "GRADES": "sinssim.sensors.imu.grades",
        "ImuErrors": "sinssim.sensors.imu.errors",
        "TriadErrors": "sinssim.sensors.imu.errors",
        "draw": "sinssim.sensors.imu.errors",
        "emulate": "sinssim.sensors.imu.emulate",
    },
)
