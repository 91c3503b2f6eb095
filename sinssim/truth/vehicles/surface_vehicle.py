"""The true motion of a vehicle on a road or on the sea, as a smooth curve through closely spaced knots.

The course follows the legs on the ellipsoid; the body's response to the road or to the waves is added to height,
attitude and, at sea, to the place. The spline through the knots is the truth: the ideal sensors are exact along it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

import sinssim.earth
from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.models import Ellipsoid
from sinssim.section import Heading, Height, Latitude, Longitude
from sinssim.truth.channel import Channel
from sinssim.truth.motion import AT_REFERENCE_POINT, NORMAL_EARTH, Mounting, PlacedMotion, Progress, TrueEarth
from sinssim.truth.vehicles.legs import VehicleLeg
from sinssim.truth.vehicles.profile import Course, Profile

if TYPE_CHECKING:
    from sinssim.truth.curve import Curve


class Body(NamedTuple):
    """Displacement and attitude that the body adds to the course: north, east, up (m), roll, pitch (rad), all (K,)."""

    north: Array
    east: Array
    up: Array
    roll: Array
    pitch: Array


class SurfaceVehicle(PlacedMotion):
    """What [drive] and [voyage] have in common; the vehicle begins at rest."""

    travels: ClassVar[bool] = True
    knot_rate: ClassVar[float]
    """Knots per second of the curve."""
    lead_s: ClassVar[float] = 0.0
    """Time before the start in which the body comes into its motion, s."""
    height_channel: ClassVar[str]
    """Name of the channel of what moves the body."""

    latitude_deg: Latitude = Field(description="latitude of the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the start")
    altitude_m: Height = Field(default=0.0, description="height of the road or the sea above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading at the start")
    legs: tuple[VehicleLeg, ...] = Field(min_length=1, description="the legs, in order")

    if TYPE_CHECKING:  # each kind has these keys, with its own limits and defaults
        acceleration_mps2: float
        lateral_mps2: float

    @property
    def profile(self) -> Profile:
        """Speed and heading along the legs.

        Raises:
            InputError: a leg is impossible; the message names it.
        """
        heading = np.radians(self.heading_deg)
        return Profile(self.table, self.legs, heading, self.acceleration_mps2, self.lateral_mps2)

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return the duration of the legs; see `Motion.duration`."""
        return self.profile.duration

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return ∫ω² dt of the legs; see `Motion.turning`."""
        return self.profile.turning

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        """Return the motion of the body on its course.

        Args:
            time: s, (K,).
            north, east: way along the course since the start, m, (K,).

        Returns:
            The body's motion, and the height of what carries it, m, (K,).
        """
        raise NotImplementedError

    def trajectory(
        self,
        block: Mounting = AT_REFERENCE_POINT,
        earth: TrueEarth = NORMAL_EARTH,
        seed: int = 0,
        progress: Progress | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> Curve:
        """Return the motion of the block; see `Motion.trajectory`."""
        from sinssim.truth.curve import Curve  # needs the compiler

        profile = self.profile
        count = int(np.ceil(profile.duration * self.knot_rate)) + 1
        step = profile.duration / (count - 1)
        before = round(self.lead_s / step)
        time = np.asarray(np.arange(-before, count) * step, dtype=np.float64)
        course = profile.at(time)
        north, east = (_running(course.speed * part(course.heading), step) for part in (np.cos, np.sin))
        north, east = north - north[before], east - east[before]
        body, height = self.body(course, time, north, east, seed)
        now = slice(before, None)
        latitude, longitude = self._along(north[now], east[now], earth.figure)
        q_nb = rotation.quaternion_from_euler(body.roll[now], body.pitch[now], course.heading[now])
        m, n = sinssim.earth.radii(latitude, earth.figure)
        latitude = latitude + body.north[now] / (m + self.altitude_m)
        longitude = longitude + body.east[now] / ((n + self.altitude_m) * np.cos(latitude))
        place = sinssim.earth.geodetic_to_ecef(latitude, longitude, self.altitude_m + body.up[now], earth.figure)
        return Curve(
            time[now],
            place,
            rotation.multiply(sinssim.earth.q_en(latitude, longitude), q_nb),
            block.lever_arm_m,
            block.q_bs,
            earth.gravity,
            earth.figure,
            profile.events,
            {self.height_channel: Channel(time[now], height[now], "m")},
        )

    def _along(self, north: Array, east: Array, ellipsoid: Ellipsoid) -> tuple[Array, Array]:
        """Return latitude and longitude of a course from its running north and east components, rad."""
        start, height = np.radians(self.latitude_deg), self.altitude_m
        latitude = np.full(len(north), start)
        for _ in range(3):  # the radius changes by 1e-5 in 10 km: each round gains five digits
            m, _ = sinssim.earth.radii(latitude, ellipsoid)
            latitude = start + np.concatenate([[0.0], np.cumsum(np.diff(north) / (0.5 * (m[1:] + m[:-1]) + height))])
        _, n = sinssim.earth.radii(latitude, ellipsoid)
        parallel = (n + height) * np.cos(latitude)
        east_turn = np.concatenate([[0.0], np.cumsum(np.diff(east) / (0.5 * (parallel[1:] + parallel[:-1])))])
        return latitude, np.radians(self.longitude_deg) + east_turn


def _running(values: Array, step: float) -> Array:
    """Return the running integral by trapezoids, (K,)."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))]) * step
