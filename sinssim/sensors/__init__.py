"""What the sensors make of the truth: equation (2) and everything on top of it."""

from sinssim.scenario.grades import GRADES
from sinssim.sensors.emulate import emulate
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors, draw

__all__ = ["GRADES", "ImuErrors", "TriadErrors", "draw", "emulate"]
