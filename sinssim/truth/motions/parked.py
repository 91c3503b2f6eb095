"""True motion of a parked vehicle at any place and attitude, the poles included; increments in closed form."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from sinssim import earth, rotation
from sinssim.arguments import quaternion, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.toml_section import Duration, Heading, Height, Latitude, Longitude
from sinssim.truth.motion import AT_REFERENCE_POINT, NORMAL_EARTH, Mounting, PlacedMotion, Progress, TrueEarth, attitude
from sinssim.truth.motions.analytic import ClosedForm
from sinssim.truth.sampling import block_state, check_instants, checked_place, sample_edges


class Parked(ClosedForm):
    """A vehicle at rest on the Earth: the block measures only the Earth's rate and the reaction to gravity.

    At a pole the heading is measured from the meridian of the given longitude.

    Args:
        latitude, longitude: geodetic, rad.
        height: above the ellipsoid, m.
        q_nb: attitude of the vehicle, v_n = C_nb v_b, (4,).
        duration: s, from time 0.
        lever_arm: from the given position to the sensor block, in the vehicle's axes, (3,) m.
        q_bs: mounting of the block, v_b = C_bs v_s, (4,).
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Raises:
        InputError: the latitude is beyond a pole, the duration is not positive, or the gravity model is unknown.
    """

    def __init__(
        self,
        latitude: float,
        longitude: float,
        height: float,
        q_nb: ArrayLike,
        duration: float,
        lever_arm: ArrayLike = (0.0, 0.0, 0.0),
        q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
    ) -> None:
        latitude, longitude, height = checked_place(latitude, longitude, height)
        q_nb, q_bs = quaternion("q_nb", q_nb), quaternion("q_bs", q_bs)
        lever_arm = vector("lever_arm", lever_arm, 3, "m")
        super().__init__(duration, gravity, ellipsoid)

        longitude -= 2.0 * np.pi * np.round(longitude / (2.0 * np.pi))  # into [−π, π]
        q_ns = rotation.multiply(rotation.normalize(q_nb), rotation.normalize(q_bs))
        place = NavState(np.asarray(latitude), np.asarray(longitude), np.asarray(height), np.zeros(3), q_ns)
        if np.any(lever_arm != 0.0):
            q_en = earth.q_en(latitude, longitude)
            arm = rotation.rotate(rotation.multiply(q_en, rotation.normalize(q_nb)), lever_arm)
            position = earth.geodetic_to_ecef(latitude, longitude, height, ellipsoid) + arm
            place = block_state(position, np.zeros(3), rotation.multiply(q_en, q_ns), ellipsoid)
        self._place = place
        # ω_ie in north-east-down axes, and f = −g
        w = ellipsoid.omega
        earth_rate = np.array([w * np.cos(place.latitude), 0.0, -w * np.sin(place.latitude)])
        force = -earth.gravity_ned(place.latitude, place.height, gravity, ellipsoid)
        q_sn = rotation.conjugate(place.q_nb)
        self._omega, self._force = rotation.rotate(q_sn, earth_rate), rotation.rotate(q_sn, force)

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block; see `Trajectory.state`."""
        shape = check_instants(t, self.start, self.end).shape
        place = self._place
        return NavState(
            np.full(shape, place.latitude),
            np.full(shape, place.longitude),
            np.full(shape, place.height),
            np.zeros((*shape, 3)),
            np.tile(place.q_nb, (*shape, 1)),
        )

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the sensor block; see `Trajectory.rates`."""
        shape = check_instants(t, self.start, self.end).shape
        return np.tile(self._omega, (*shape, 1)), np.tile(self._force, (*shape, 1))

    def increments(self, rate_hz: float) -> ImuData:
        """Return the increments, which are the same in every sample; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        count = len(edges) - 1
        return ImuData(edges, np.tile(self._omega / rate_hz, (count, 1)), np.tile(self._force / rate_hz, (count, 1)))


class ParkedVehicle(PlacedMotion):
    """A stationary vehicle at any place on the Earth, including the poles, with any attitude."""

    table: ClassVar[str] = "parked"

    latitude_deg: Latitude = Field(description="geodetic latitude, north positive")
    longitude_deg: Longitude = Field(default=0.0, description="longitude, east positive")
    altitude_m: Height = Field(default=0.0, description="height above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="roll, right side down positive")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="pitch, nose up positive")
    heading_deg: Heading = Field(default=0.0, description="heading, clockwise from north")
    duration_s: Duration = Field(description="duration")

    def trajectory(
        self,
        block: Mounting = AT_REFERENCE_POINT,
        earth: TrueEarth = NORMAL_EARTH,
        seed: int = 0,
        progress: Progress | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> Parked:
        """Return the motion of the block; see `Motion.trajectory`."""
        q_nb = attitude(self.roll_deg, self.pitch_deg, self.heading_deg)
        return Parked(*self.place, q_nb, self.duration_s, block.lever_arm_m, block.q_bs, earth.gravity, earth.figure)
