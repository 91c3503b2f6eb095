"""The base of pseudo-measurements of a vehicle at rest: zero velocity and zero angular rate.

A reading is zero with a given 1σ. By default there are readings only where the true value is at most σ/3. The true
value then adds at most 1/9 to the χ² of the three components, 3.11 instead of 3 on average, even if the vehicle creeps
for long. The σ that the filter assumes is therefore correct.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sinssim.data import Array, ImuData, Measurements
from sinssim.sensors.aiding_sensor import AidingSensor, Mask, Vehicle, within
from sinssim.toml_section import Span

if TYPE_CHECKING:
    from sinssim.sensors.standstill_detection import Stops

_AT_REST = 1.0 / 3.0
"""Magnitude of the true velocity or rate, in units of the reading's 1σ, up to which a vehicle counts as at rest."""


class Standstill(AidingSensor):
    """Readings of zero while a vehicle stands."""

    assumed: ClassVar = True

    during_s: tuple[Span, ...] | None = Field(
        default=None,
        description="[from, to] of each assumed stop, which may be wrong; default: the intervals in which the true "
        "value is at most a third of the 1σ below",
    )
    detect: bool = Field(
        default=False, description="whether the stops are detected from the inertial data instead; requires learn_s"
    )
    learn_s: tuple[Span, ...] = Field(
        default=(),
        description="[from, to] of each interval at rest, 5 s or more in total, from which the vibration at rest is "
        "learned",
    )

    rules = (
        (lambda s: s.detect and not s.learn_s,
         "detect = true needs learn_s, intervals in which the vehicle is known to be stationary, for example "
         "[[0.0, 20.0]]"),
        (lambda s: s.detect and s.during_s is not None,
         "detect = true finds the stops, and during_s gives them: remove one of the two"),
        (lambda s: s.learn_s and not s.detect, "learn_s is for detect = true: set it, or remove learn_s"),
    )  # fmt: skip

    @property
    def no_budget(self) -> str:
        """Why a budget cannot have it."""
        return "stops are detected from the data of one run (detect = true)" if self.detect else ""

    @property
    def of_fixed_block(self) -> str:
        """Why the block must not turn."""
        return "detects stops in the inertial data (detect = true; during_s gives them instead)" if self.detect else ""

    @property
    def needs_no_truth(self) -> bool:
        """Whether the stops are found in the inertial readings."""
        return self.detect

    def found(self, imu: ImuData, velocity: Measurements | None = None) -> Stops:
        """Return the stops that the inertial readings show.

        Args:
            velocity: "gnss-velocity" that veto a stop, if there are any.
        """
        from sinssim.sensors.standstill_detection import find_stops, learn_rest

        return find_stops(imu, learn_rest(imu, spans=self.learn_s), velocity=velocity)

    def stood(self, vehicle: Vehicle, time: Array, lasting: float) -> Mask | None:
        """Return the instants after so much time of a stop that was found; None where the truth decides."""
        if not self.detect or vehicle.imu is None:
            return None
        inside = np.zeros(len(time), dtype=bool)
        for begin, end in self.found(vehicle.imu).spans:
            inside |= (time >= begin + lasting - 1e-9) & (time <= end + 1e-9)
        return inside

    def stands(self, time: Array, size: Array, sigma: float) -> Mask:
        """Return the instants at which the vehicle is assumed to be at rest."""
        if self.during_s is not None:
            return within(time, self.during_s)
        return np.asarray(size <= _AT_REST * sigma)
