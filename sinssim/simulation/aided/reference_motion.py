"""A reference in place of a true motion, from which further aiding sensors are emulated beside recorded ones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array, ImuData, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.errors import InputError
from sinssim.logs.reference import Reference
from sinssim.truth.channel import Channel, FlightEvent


@dataclass(frozen=True)
class ReferenceMotion:
    """The motion of the sensor block as a whole reference has it; a `sinssim.Trajectory`, as far as it goes.

    Attributes:
        reference: with position, velocity and attitude.
        start, end: of the run, s.
        gravity: name of the gravity model.
        events, channels: none.
    """

    reference: Reference
    start: float
    end: float
    gravity: str = "normal"
    events: tuple[FlightEvent, ...] = ()
    channels: dict[str, Channel] = field(default_factory=dict)

    @property
    def ellipsoid(self) -> Ellipsoid:
        """Reference ellipsoid of the heights."""
        return self.reference.ellipsoid

    def state(self, t: ArrayLike) -> NavState:
        """Return states of the block; raise InputError where the reference does not have them."""
        time = np.atleast_1d(np.asarray(t, dtype=np.float64))
        found = self.reference.state_at(time)
        if found is None:
            missing = [what for what in ("velocity", "attitude") if what not in self.reference.knows]
            raise InputError(
                "[aiding] with [log] is simulated from log.reference, but "
                + (
                    f"{self.reference.name} has no {' and no '.join(missing)}."
                    if missing
                    else f"{self.reference.name} does not cover the whole run, {time[0]:.3f} to {time[-1]:.3f} s. Cut "
                    "the run to the reference (log.from_s, log.to_s)."
                )
            )
        if np.ndim(t) == 0:
            return NavState(
                found.latitude[0], found.longitude[0], found.height[0], found.velocity_ned[0], found.q_nb[0]
            )
        return found

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Raise InputError: a reference has no angular rates."""
        raise InputError(
            "[aiding] with [log] is simulated from log.reference, which has no angular rates: give the simulated "
            "sensor the lever arm [0, 0, 0]."
        )

    def increments(self, rate_hz: float) -> ImuData:
        """Raise InputError: the increments are the recorded ones."""
        raise InputError("the increments of a scenario with [log] are the recorded ones.")
