"""The leg "waypoint": to a place on the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import atan2, cos, hypot, pi, remainder, sin
from typing import Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Latitude, Longitude, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning, bearing, distance
from sinssim.truth.flight.leg import Bank, LegBase
from sinssim.units import DEG

_MEAN_RADIUS = 6_371_009.0  # radius for bearings and distances to a waypoint [m]
_ROUNDS = 20  # iterations for the turn towards a waypoint, whose angle and end depend on each other: enough for 0.1 s


class WaypointLeg(LegBase):
    """Fly straight to a place on the ground at constant height and airspeed.

    Attributes:
        latitude_deg: latitude, degrees.
        longitude_deg: longitude, degrees.
        capture_radius_m: distance from the place at which the leg ends, m.
        bank_deg: largest angle of bank, degrees; None: the aircraft's usual angle.
    """

    example: ClassVar[dict[str, Any]] = {"latitude_deg": 51.47, "longitude_deg": -0.45}

    type: Literal["waypoint"]
    latitude_deg: Latitude = Field(description="latitude of the waypoint")
    longitude_deg: Longitude = Field(description="longitude of the waypoint")
    capture_radius_m: float = Field(
        default=500.0, ge=20.0, le=20_000.0, description="distance from the waypoint at which it counts as reached"
    )
    bank_deg: Bank | None = Field(
        default=None, description="largest angle of bank; default: the aircraft's usual angle"
    )
    timeout_s: Timeout = Field(default=7200.0, description="the leg fails if it takes longer")

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: a turn onto the bearing, then straight ahead; see `LegBase.reckon`."""
        target = math.radians(self.latitude_deg), math.radians(self.longitude_deg)
        if distance(plan.latitude, plan.longitude, *target) <= self.capture_radius_m:
            return 0.0
        begin = plan.latitude, plan.longitude, plan.heading, plan.turning
        seconds = 0.0
        for _ in range(_ROUNDS):  # a turn onto the bearing of the place from the end of the turn
            towards = plan.heading_along(bearing(plan.latitude, plan.longitude, *target))
            if towards is None:
                return math.inf
            plan.latitude, plan.longitude, plan.heading, plan.turning = begin
            seconds = plan.turn(math.remainder(towards - plan.heading, 2.0 * math.pi), self.bank_deg)
        left = max(0.0, distance(plan.latitude, plan.longitude, *target) - self.capture_radius_m)
        ahead = bearing(plan.latitude, plan.longitude, *target)
        seconds += left / max(plan.ground_speed(ahead), 1.0)
        back = bearing(*target, plan.latitude, plan.longitude)
        plan.latitude, plan.longitude = target
        plan.move(self.capture_radius_m * math.cos(back), self.capture_radius_m * math.sin(back))
        plan.heading = plan.heading_along(back + math.pi) or 0.0
        return seconds

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Keep the track on the bearing of the place; see `LegBase.fly`."""
        pilot.bank_limit = pilot.usual_bank if self.bank_deg is None else self.bank_deg * DEG
        latitude, longitude = self.latitude_deg * DEG, self.longitude_deg * DEG
        while True:
            # Great-circle bearing and distance on the mean sphere.
            east = sin(longitude - state.longitude) * cos(latitude)
            north = cos(state.latitude) * sin(latitude) - sin(state.latitude) * cos(latitude) * cos(
                longitude - state.longitude
            )
            along = sin(state.latitude) * sin(latitude) + cos(state.latitude) * cos(latitude) * cos(
                longitude - state.longitude
            )
            if _MEAN_RADIUS * atan2(hypot(north, east), along) < self.capture_radius_m:
                break
            # The heading for this track is the bearing minus the drift angle.
            pilot.heading = atan2(east, north) - remainder(state.track - state.psi, 2.0 * pi)
            yield
        pilot.heading %= 2.0 * pi
        pilot.bank_limit = pilot.usual_bank
