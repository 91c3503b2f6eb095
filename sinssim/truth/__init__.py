"""Sources of truth: flights, parked vehicles, analytic motions, and the exact increments along them."""

from sinssim.truth.fly import fly
from sinssim.truth.trajectory import Channel, FlightEvent, Trajectory

__all__ = ["Channel", "FlightEvent", "Trajectory", "fly"]
