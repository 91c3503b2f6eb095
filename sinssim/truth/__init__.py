"""Sources of true motion: flights, parked vehicles, analytic motions, and the exact increments along them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.truth.sampling import Channel as Channel
    from sinssim.truth.sampling import FlightEvent as FlightEvent
    from sinssim.truth.trajectory import Trajectory as Trajectory

__getattr__, __dir__, __all__ = on_first_use(__name__)
