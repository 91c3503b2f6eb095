"""The leg "land": approach, flare, touchdown and roll-out on a stated runway."""

from __future__ import annotations

import math
from collections.abc import Iterator
from math import atan2, cos, hypot, pi, remainder, sin, tan
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import Heading, Latitude, Longitude, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import BANK, HEADING, HEIGHT, INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.leg import DeadReckoning, LegBase, LegError, bearing, distance
from sinssim.truth.flight.legs.ground import on_wheels
from sinssim.truth.flight.planned_path import PlannedTrack
from sinssim.units import DEG, KNOT

_A, _E2 = 6_378_137.0, 6.694379990141e-3  # WGS84
_AIM_M = 300.0  # where the glide path meets the runway, beyond the threshold [m]
_SPACING = 250.0  # of the points of the planned approach [m]
_INTERCEPT = 40.0 * DEG  # largest angle at which the extended centreline is met [rad]
_AHEAD = 3.0  # time ahead in which an offset from the centreline is taken back, in time constants of the heading
_FLARE_S, _TOUCHDOWN_MPS = 4.0, 0.6  # sink rate of the flare: height of the wheels over this time, plus this much
_LAG_S = 0.5  # lag of the sink rate behind its reference [s]
_HARD_MPS = 4.0  # sink rate beyond which the touchdown is a crash [m/s]
_WHEELS_LIMIT_S = 40.0  # time for the flare [s]
_BRAKE_RAMP = 0.2  # change of the brakes' setting [1/s]
_DECELERATION = 2.0  # of the roll-out in dead reckoning [m/s²]


class LandLeg(LegBase):
    """Approach a runway on its glide path, flare, touch down and brake. The leg can begin at any place before the glide
    path, at a height at which the aircraft meets the path from below. The aircraft turns onto the extended centreline,
    slows down, extends flaps and gear, follows the glide path to the flare, and brakes on the runway to the exit speed,
    at which the leg ends."""

    example: ClassVar[dict[str, Any]] = {
        "latitude_deg": 51.4775, "longitude_deg": -0.4850, "heading_deg": 90.0, "altitude_m": 70.0
    }  # fmt: skip
    ends: ClassVar[Literal["runway", "air"]] = "runway"
    lands: ClassVar[bool] = True
    plans: ClassVar[frozenset[str]] = frozenset({"track", "height"})

    type: Literal["land"]
    latitude_deg: Latitude = Field(description="latitude of the threshold")
    longitude_deg: Longitude = Field(description="longitude of the threshold")
    altitude_m: float = Field(ge=-430.0, le=4500.0, description="height of the runway above the ellipsoid")
    heading_deg: Heading = Field(description="heading of the runway")
    length_m: float = Field(default=3000.0, ge=200.0, le=10_000.0, description="length of the runway")
    glide_deg: float = Field(default=3.0, ge=2.0, le=6.0, description="angle of the glide path")
    exit_mps: float = Field(default=8.0, ge=1.0, le=20.0, description="ground speed at the end of the roll-out")
    timeout_s: Timeout = Field(default=3600.0, description="the leg fails if it takes longer")

    def end_height(self, height: float) -> float:
        """Return `altitude_m`; refuse a runway above the aircraft; see `LegBase.end_height`."""
        if height < self.altitude_m + 100.0:
            raise ValueError(
                f"begins at {height:g} m, and the runway is at altitude_m = {self.altitude_m:g}: begin at least 100 m "
                "above the runway"
            )
        return self.altitude_m

    def reckon(self, plan: DeadReckoning) -> float:
        """Return the duration, s: the way to the threshold and the roll-out; see `LegBase.reckon`."""
        threshold = math.radians(self.latitude_deg), math.radians(self.longitude_deg)
        heading = self.heading_deg * DEG
        straight = distance(plan.latitude, plan.longitude, *threshold)
        ahead = bearing(plan.latitude, plan.longitude, *threshold)
        approach = (plan.performance.approach_kt or plan.performance.cruise_kt) * KNOT
        slowing = max(0.0, plan.airspeed - approach) / plan.performance.acceleration_mps2
        fast = min(0.5 * (plan.airspeed + approach) * slowing, 0.8 * straight)
        seconds = plan.turn(remainder(ahead - plan.heading, 2.0 * pi), None)
        seconds += fast / max(0.5 * (plan.airspeed + approach), 1.0)
        plan.airspeed, plan.altitude = approach, self.altitude_m
        seconds += (straight - fast + _AIM_M) / max(plan.ground_speed(heading), 1.0)
        plan.latitude, plan.longitude = threshold
        plan.heading, plan.airspeed = heading, self.exit_mps
        plan.ahead(0.5 * (approach**2 - self.exit_mps**2) / _DECELERATION + _AIM_M)
        return seconds + max(0.0, approach - self.exit_mps) / _DECELERATION

    def planned(self, plan: DeadReckoning) -> tuple[PlannedTrack, ...]:
        """Return the final approach, from where the glide path begins to the threshold; see `LegBase.planned`.

        How the aircraft meets the centreline before it is not planned.
        """
        slope, level = tan(self.glide_deg * DEG), plan.altitude
        begin = (level - self.altitude_m) / slope - _AIM_M
        self.reckon(plan)
        if begin <= 0.0:
            return ()
        left = np.linspace(begin, 0.0, 2 + int(begin / _SPACING))
        latitude, longitude = _Runway(self).before(left)
        heights = self.altitude_m + (left + _AIM_M) * slope
        return (PlannedTrack(latitude, longitude, heights, self.altitude_m, bounded=True),)

    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Approach, flare and roll out; see `LegBase.fly`."""
        assert performance.approach_kt is not None  # refused before the flight
        runway = _Runway(self)
        yield from self._approach(runway, pilot, state, performance)
        yield from self._flare(runway, pilot, state, performance.standing_height_m)
        yield from self._roll_out(runway, pilot, state, performance)

    def _approach(
        self, runway: _Runway, pilot: Autopilot, state: AircraftState, performance: Performance
    ) -> Iterator[None]:
        """Meet the centreline and the glide path, and follow them to the height of the flare."""
        slope = tan(self.glide_deg * DEG)
        pilot.lateral, pilot.vertical = HEADING, HEIGHT
        level = pilot.height
        left, offset = runway.place(state)
        needed = (level - self.altitude_m) / slope - _AIM_M
        if left < needed:
            raise LegError(
                f"there is no approach to this runway from here: its threshold is {left / 1e3:.1f} km ahead along its "
                f"heading of {self.heading_deg:g}°, and a glide path of {self.glide_deg:g}° from {level:.0f} m needs "
                f"{needed / 1e3:.1f} km",
                "a waypoint farther out, a lower height, or the runway's other heading",
            )
        approach = (performance.approach_kt or 0.0) * KNOT
        ahead = _AHEAD * pilot.heading_time
        pilot.airspeed, pilot.gear = approach, 1.0
        while True:
            left, offset = runway.place(state)
            pilot.heading = runway.heading_to(offset, ahead, state)
            pilot.flaps = performance.landing_flaps * max(0.0, min(1.0, 1.0 - (state.cas - approach) / 20.0))
            glide = self.altitude_m + (left + _AIM_M) * slope
            sink = state.ground_speed * slope
            # the height's reference moves at the sink rate: its loop needs it ahead by sink/height_rate
            pilot.height = min(level, glide - sink / pilot.height_rate)
            pilot.descent_limit = 1.5 * sink + 1.0
            if pilot.runway_height is None and left < 5000.0:
                pilot.runway_height = self.altitude_m
            wheels = state.height - self.altitude_m - performance.standing_height_m
            if pilot.runway_height is not None and wheels < _FLARE_S * (sink - _TOUCHDOWN_MPS) + _LAG_S * sink:
                break
            if left < -self.length_m:
                raise LegError("it flew past the runway", "a lower height at the beginning of the approach")
            yield
        if abs(offset) > 20.0 or abs(remainder(pilot.heading - state.psi, 2.0 * pi)) > 20.0 * DEG:
            raise LegError(
                f"the approach is not aligned at the flare: {abs(offset):.0f} m from the centreline",
                "an approach that begins farther out, or a weaker wind",
            )

    def _flare(self, runway: _Runway, pilot: Autopilot, state: AircraftState, standing_height: float) -> Iterator[None]:
        """Reduce the sink rate with the height, engines idle, until the wheels touch."""
        pilot.may_touch, pilot.fixed_throttle = True, 0.0
        ahead = _AHEAD * pilot.heading_time
        limit = state.time + _WHEELS_LIMIT_S
        while not state.on_wheels:
            left, offset = runway.place(state)
            pilot.heading = runway.heading_to(offset, ahead, state)
            wheels = max(0.0, state.height - self.altitude_m - standing_height)
            pilot.height = state.height - (wheels / _FLARE_S + _TOUCHDOWN_MPS) / pilot.height_rate
            if wheels < 2.0:
                pilot.lateral, pilot.bank = BANK, 0.0
                pilot.heading, pilot.steering = runway.heading, True
            if state.time > limit or left < -self.length_m:
                raise LegError(
                    f"it does not touch down: {-left:.0f} m beyond the threshold it is still {wheels:.1f} m high",
                    "a weaker wind, or a slower approach",
                )
            if state.climb < -_HARD_MPS and wheels < 0.5:
                raise LegError(f"the touchdown is too hard: {-state.climb:.1f} m/s", "weaker wind or turbulence")
            yield
        left, offset = runway.place(state)
        if left > 0.0 or abs(offset) > 30.0:
            raise LegError(
                f"it touches down {'before the threshold' if left > 0.0 else 'beside the runway'}: {abs(left):.0f} m "
                f"{'before' if left > 0.0 else 'beyond'} the threshold, {abs(offset):.0f} m from the centreline",
                "a weaker wind, or an approach that begins farther out",
            )

    def _roll_out(
        self, runway: _Runway, pilot: Autopilot, state: AircraftState, performance: Performance
    ) -> Iterator[None]:
        """Lower the nose, brake along the centreline to the exit speed."""
        elevator = pilot.elevator
        on_wheels(pilot, state)
        begin = state.time
        while state.ground_speed > self.exit_mps or not state.on_wheels:
            left, offset = runway.place(state)
            along = max(state.ground_speed, 5.0) * 5.0
            pilot.heading = runway.heading - max(-0.1, min(0.1, atan2(offset, along)))
            pilot.fixed_elevator = elevator * max(0.0, 1.0 - (state.time - begin) / 4.0)
            pilot.brakes = min(performance.braking, pilot.brakes + _BRAKE_RAMP * INTERVAL) if state.on_wheels else 0.0
            if left < -self.length_m:
                raise LegError(
                    f"it overruns the end of the runway at {state.ground_speed:.0f} m/s (length_m = {self.length_m:g})",
                    "a longer runway",
                )
            yield
        pilot.flaps, pilot.may_touch = 0.0, False
        pilot.descent_limit = pilot.usual_descent


class _Runway:
    """A runway's threshold and heading, with offsets on the plane that touches the ellipsoid there."""

    def __init__(self, leg: LandLeg) -> None:
        self.heading = leg.heading_deg * DEG
        self._latitude, self._longitude = leg.latitude_deg * DEG, leg.longitude_deg * DEG
        self._cos, self._sin = cos(self.heading), sin(self.heading)
        w2 = 1.0 - _E2 * sin(self._latitude) ** 2
        self._north = _A * (1.0 - _E2) / w2**1.5 + leg.altitude_m
        self._east = (_A / w2**0.5 + leg.altitude_m) * cos(self._latitude)

    def place(self, state: AircraftState) -> tuple[float, float]:
        """Return the way left to the threshold along the runway, and the offset to the right of the centreline, m."""
        north = (state.latitude - self._latitude) * self._north
        east = remainder(state.longitude - self._longitude, 2.0 * pi) * self._east
        return -(north * self._cos + east * self._sin), east * self._cos - north * self._sin

    def before(self, left: Array) -> tuple[Array, Array]:
        """Return latitude and longitude, (K,) rad, of places on the centreline at distances before the threshold, m."""
        return self._latitude - left * self._cos / self._north, self._longitude - left * self._sin / self._east

    def heading_to(self, offset: float, ahead_s: float, state: AircraftState) -> float:
        """Return the heading that takes back an offset within a time, with the drift angle taken off, rad."""
        angle = atan2(offset, max(state.ground_speed, 20.0) * ahead_s)
        angle = max(-_INTERCEPT, min(_INTERCEPT, angle))
        drift = remainder(state.track - state.psi, 2.0 * pi) if hypot(state.ground_speed, 0.0) > 20.0 else 0.0
        return self.heading - angle - drift
