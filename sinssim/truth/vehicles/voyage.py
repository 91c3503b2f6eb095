"""A ship, the table [voyage]: the waves, and the response of the hull."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.section import Heading
from sinssim.truth.vehicles.profile import Course
from sinssim.truth.vehicles.response import respond
from sinssim.truth.vehicles.surface_vehicle import Body, SurfaceVehicle
from sinssim.units import DEG

_Period = Annotated[float, Field(ge=0.2, le=60.0)]
_Damping = Annotated[float, Field(gt=0.0, lt=1.0)]

SEA_STATES = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0, 7.5, 11.5, 14.0)
"""Significant height of the waves by sea state, the middle of its range in the WMO's code table 3700, m."""


class Voyage(SurfaceVehicle):
    """A ship: legs on the sea, long-crested waves of one direction, and the response of the hull. The waves have the
    two-parameter Bretschneider spectrum (ITTC), which is the Pierson-Moskowitz spectrum for the default period. Heave,
    surge and sway follow the waves, and roll and pitch follow the wave slope across and along the hull, each as a
    damped oscillator. The frequency of encounter depends on the speed and the heading.
    """

    table: ClassVar[str] = "voyage"
    knot_rate: ClassVar[float] = 10.0
    lead_s: ClassVar[float] = 200.0
    height_channel: ClassVar[str] = "wave_height_m"

    sea_state: Annotated[int, Field(ge=0, le=9)] = Field(
        default=3, description="WMO sea state; the wave height is the middle of its range"
    )
    significant_height_m: Annotated[float, Field(ge=0.0, le=20.0)] | None = Field(
        default=None, description="significant wave height; default: that of sea_state"
    )
    peak_period_s: Annotated[float, Field(ge=1.0, le=30.0)] | None = Field(
        default=None, description="peak period of the spectrum; default: that of the Pierson-Moskowitz spectrum"
    )
    waves_towards_deg: Heading = Field(default=90.0, description="direction towards which the waves travel")
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.05, description="mean acceleration and deceleration"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=2.0)] = Field(
        default=0.1, description="lateral acceleration in turns for which no rate is given"
    )
    heel_deg_per_mps2: Annotated[float, Field(ge=0.0, le=30.0)] = Field(
        default=5.0, description="outward heel in turns per lateral acceleration"
    )
    roll_period_s: _Period = Field(default=10.0, description="natural period of roll")
    roll_damping: _Damping = Field(default=0.1, description="damping ratio of roll")
    pitch_period_s: _Period = Field(default=6.0, description="natural period of pitch")
    pitch_damping: _Damping = Field(default=0.4, description="damping ratio of pitch")
    heave_period_s: _Period = Field(default=6.0, description="natural period of heave, surge and sway")
    heave_damping: _Damping = Field(default=0.4, description="damping ratio of heave, surge and sway")

    @property
    def height_m(self) -> float:
        """The significant height of the waves, m."""
        return SEA_STATES[self.sea_state] if self.significant_height_m is None else self.significant_height_m

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        """Return the motion of the body; see `SurfaceVehicle.body`."""
        step = float(time[1] - time[0])
        heel = -self.heel_deg_per_mps2 * DEG * course.speed * course.rate
        towards = np.radians(self.waves_towards_deg)
        height, along, slope = (np.zeros(len(time)) for _ in range(3))
        if self.height_m > 0.0:
            from sinssim.truth.vehicles import sea  # needs the compiler

            waves = sea.waves(self.height_m, sea.peak(self.height_m, self.peak_period_s), seed)
            ahead = north * np.cos(towards) + east * np.sin(towards)
            sea.ride(waves, time, ahead, height, along, slope)
        off = towards - course.heading

        def hull(u: Array, period: float, damping: float) -> Array:
            return respond(u, step, 1.0 / period, damping, on_carrier=False)

        sway = hull(along, self.heave_period_s, self.heave_damping)
        return Body(
            sway * np.cos(towards),
            sway * np.sin(towards),
            hull(height, self.heave_period_s, self.heave_damping),
            hull(heel - slope * np.sin(off), self.roll_period_s, self.roll_damping),
            hull(slope * np.cos(off), self.pitch_period_s, self.pitch_damping),
        ), height
