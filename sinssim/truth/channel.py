"""What is logged along a true motion: events, and quantities beside the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sinssim.data import Array


@dataclass(frozen=True)
class FlightEvent:
    """An event at one instant, for example the beginning of a leg or lift-off.

    Attributes:
        time: instant in the trajectory's time, s.
        text: one sentence.
    """

    time: float
    text: str


@dataclass(frozen=True)
class Channel:
    """A quantity logged along a trajectory in addition to the motion: airspeed, a control, the wind.

    Attributes:
        time: instants, (K,) s.
        values: one number or one vector per instant, (K,) or (K, m), in `unit`.
        unit: unit of the values in customary notation, "" for a pure number.
    """

    time: Array
    values: Array
    unit: str
