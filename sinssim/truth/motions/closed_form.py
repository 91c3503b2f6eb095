"""What all trajectories in closed form have in common."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from sinssim import earth
from sinssim.earth.models import Ellipsoid
from sinssim.truth.channel import Channel, FlightEvent
from sinssim.truth.sample_times import checked_duration


class ClosedForm:
    """A trajectory in closed form: it begins at time 0, and nothing is logged beside the motion.

    Args:
        duration: s, from time 0.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Raises:
        InputError: a duration that is not positive, an unknown gravity model.
    """

    start = 0.0
    events: tuple[FlightEvent, ...] = ()
    channels: Mapping[str, Channel] = MappingProxyType({})

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.start:g} … {self.end:g} s)"

    def __init__(self, duration: float, gravity: str, ellipsoid: Ellipsoid) -> None:
        earth.gravity_number(gravity)
        self.end = checked_duration(duration)
        self.gravity = gravity
        self.ellipsoid = ellipsoid
