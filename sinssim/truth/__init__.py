"""Sources of true motion: flights, parked vehicles, analytic motions, and the exact increments along them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.truth.source import fly
    from sinssim.truth.trajectory import Channel, FlightEvent, Trajectory

__all__ = ["Channel", "FlightEvent", "Trajectory", "fly"]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "Channel": "sinssim.truth.trajectory",
        "FlightEvent": "sinssim.truth.trajectory",
        "Trajectory": "sinssim.truth.trajectory",
        "fly": "sinssim.truth.source",
    },
)
