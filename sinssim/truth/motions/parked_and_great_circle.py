"""Motions in closed form on the ellipsoid: a parked vehicle, and level flight along a great circle of the vertical.

Along the great circle, height and speed are constant. The vertical n (the unit normal of the ellipsoid) runs along a
great circle of directions, n(u) = n₀ cos u + t₀ sin u. The vehicle stays level and points along t = dn/du, so that it
rotates only about its right axis, which is fixed to the Earth: ω_eb^b = (0, −u̇, 0). The formulas do not use meridians,
so that the poles are not singular. Position follows from the vertical (z its polar component, a the equatorial radius)

    r(u) = (N + h) n − e² N z k,    N = a / √(1 − e² z²),    k the polar axis

and constant ground speed V means u̇ = V/|dr/du|. Between meridian and equator the velocity differs from the heading t
by an angle of the order of the ellipsoid's flattening, at most 0.2°.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from sinssim import earth, rotation
from sinssim.arguments import number, quaternion, vector
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid, normal
from sinssim.errors import InputError
from sinssim.toml_section import Duration, Heading, Height, Latitude, Longitude, Speed
from sinssim.truth.motion import Mounting, PlacedMotion, TrueEarth, attitude
from sinssim.truth.motions.analytic import ClosedForm
from sinssim.truth.sampling import block_state, checked_place, sample_edges


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

    def _state(self, time: Array) -> NavState:
        place, count = self._place, len(time)
        latitude, longitude = np.full(count, place.latitude), np.full(count, place.longitude)
        height = np.full(count, place.height)
        return NavState(latitude, longitude, height, np.zeros((count, 3)), np.tile(place.q_nb, (count, 1)))

    def _rates(self, time: Array) -> tuple[Array, Array]:
        return np.tile(self._omega, (len(time), 1)), np.tile(self._force, (len(time), 1))

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

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Parked:
        q_nb = attitude(self.roll_deg, self.pitch_deg, self.heading_deg)
        return Parked(*self.place, q_nb, self.duration_s, block.lever_arm_m, block.q_bs, earth.gravity, earth.figure)


# Harmonics of |dr/du| over half a turn: each is smaller by e²/4, and 16 points resolve seven of them.
_HARMONICS = 7
# Gauss-Legendre points on a sample interval: the error, (u̇ Δt)⁶ over two million, is far below rounding.
_POINTS = 3
_CHUNK = 65536  # samples evaluated at once


class _Motion(NamedTuple):
    angle: Array  # u, (N,) rad
    angle_rate: Array  # u̇, (N,) rad/s
    forward: Array  # t, (N, 3)
    up: Array  # n, (N, 3)
    position: Array  # of the block, Earth-fixed, (N, 3) m
    velocity: Array  # (N, 3) m/s
    acceleration: Array  # (N, 3) m/s²


def _north_east(latitude: float, longitude: float) -> tuple[Array, Array]:
    s, c = np.sin(latitude), np.cos(latitude)
    north = np.array([-s * np.cos(longitude), -s * np.sin(longitude), c])
    return north, np.array([-np.sin(longitude), np.cos(longitude), 0.0])


class GreatCircle(ClosedForm):
    """Level flight along a great circle at constant height and ground speed, also over the poles.

    Args:
        latitude, longitude: of the start, geodetic, rad; at a pole the longitude gives the meridian of north.
        height: above the ellipsoid, constant, m.
        course: direction of the great circle at the start, clockwise from north, rad.
        speed: ground speed, constant, m/s.
        duration: s, from time 0.
        lever_arm: from the point on the circle to the sensor block, in the vehicle's axes, (3,) m.
        q_bs: mounting of the block, v_b = C_bs v_s, (4,).
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Raises:
        InputError: the latitude is beyond a pole, the speed is negative, or the duration is not positive.
    """

    def __init__(
        self,
        latitude: float,
        longitude: float,
        height: float,
        course: float,
        speed: float,
        duration: float,
        lever_arm: ArrayLike = (0.0, 0.0, 0.0),
        q_bs: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
    ) -> None:
        latitude, longitude, height = checked_place(latitude, longitude, height)
        course, speed = number("course", course, "rad"), number("speed", speed, "m/s", low=0.0)
        super().__init__(duration, gravity, ellipsoid)
        self._height, self._speed = height, speed
        self._lever = vector("lever_arm", lever_arm, 3, "m")
        self._q_bs = rotation.normalize(quaternion("q_bs", q_bs))

        north, east = _north_east(latitude, longitude)
        self._n0 = normal(latitude, longitude)
        self._t0 = np.cos(course) * north + np.sin(course) * east
        self._right = np.cross(self._t0, self._n0)  # −(n × t): constant along the circle
        self._q_eb0 = rotation.multiply(
            earth.q_en(latitude, longitude), rotation.quaternion_from_euler(0.0, 0.0, course)
        )
        u = np.arange(2 * (_HARMONICS + 1)) * np.pi / (2 * (_HARMONICS + 1))
        spectrum = np.fft.rfft(np.linalg.norm(self._tangent(u)[0], axis=1)) / len(u)
        # |dr/du| = mean + Re Σ c_k exp(2iku); its integral has c_k/(2ik) instead of c_k
        k = np.arange(1, _HARMONICS + 1)
        self._mean = spectrum[0].real
        self._waves = np.concatenate([[0.0], 2.0 * spectrum[k] / (2j * k)])

    @classmethod
    def between(
        cls,
        start: tuple[float, float],
        end: tuple[float, float],
        height: float,
        speed: float,
        *,
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
    ) -> Self:
        """Return the flight along the shorter arc from one place to another, latitude and longitude in rad, at which it
        ends."""
        a, b = normal(*start), normal(*end)
        across = np.cross(a, b)
        if np.linalg.norm(across) < 1e-9:
            raise InputError(
                f"no great circle is defined from {np.degrees(start)}° to {np.degrees(end)}°: the places coincide or "
                "are antipodal."
            )
        if not (np.isfinite(speed) and speed > 0.0):
            raise InputError(f"speed = {speed!r} m/s along the great circle must be positive and finite.")
        towards = np.cross(across, a)
        north, east = _north_east(*start)
        course = float(np.arctan2(towards @ east, towards @ north))
        angle = float(np.arctan2(np.linalg.norm(across), a @ b))
        flight = cls(*start, height, course, speed, 1.0, gravity=gravity, ellipsoid=ellipsoid)
        flight.end = float(flight._length(np.array(angle))) / speed
        return flight

    def _tangent(self, u: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Return dr/du of the point on the circle, t and n, each (N, 3), and N, N' and N' over z', each (N, 1) m."""
        e2 = self.ellipsoid.e2
        c, s = np.cos(u)[:, None], np.sin(u)[:, None]
        n, t = c * self._n0 + s * self._t0, c * self._t0 - s * self._n0
        z, dz = n[:, 2:], t[:, 2:]
        w = 1.0 - e2 * z * z
        radius = self.ellipsoid.a / np.sqrt(w)
        slope = radius * e2 * z / w
        radius1 = slope * dz
        k = np.array([0.0, 0.0, e2])
        r1 = radius1 * n + (radius + self._height) * t - k * (radius1 * z + radius * dz)
        return r1, t, n, radius, radius1, slope

    def _path(self, u: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return r, dr/du, d²r/du² of the point on the circle, and t and n, each (N, 3)."""
        r1, t, n, radius, radius1, slope = self._tangent(u)
        e2, h = self.ellipsoid.e2, self._height
        z, dz = n[:, 2:], t[:, 2:]
        w = 1.0 - e2 * z * z
        # N'' along the circle, with z'' = −z
        radius2 = radius * e2 * (1.0 + 2.0 * e2 * z * z) / (w * w) * dz * dz - slope * z
        k = np.array([0.0, 0.0, e2])
        r = (radius + h) * n - k * (radius * z)
        r2 = (radius2 - radius - h) * n + 2.0 * radius1 * t - k * (radius2 * z + 2.0 * radius1 * dz - radius * z)
        return r, r1, r2, t, n

    def _length(self, u: Array) -> Array:
        """Distance flown from u = 0, m: the integral of the Fourier series of |dr/du|."""
        wave = np.polynomial.polynomial.polyval(np.exp(2j * u), self._waves)
        return np.asarray(self._mean * u + (wave - self._waves.sum()).real)

    def _motion(self, time: Array) -> _Motion:
        distance = self._speed * time
        u = distance / self._mean
        for _ in range(2):  # Newton: errors of 2e-3, 2e-8, 2e-18 rad, as |dr/du| varies by 1 %
            u = u - (self._length(u) - distance) / np.linalg.norm(self._tangent(u)[0], axis=1)
        r, r1, r2, t, n = self._path(u)
        norm2 = np.einsum("ij,ij->i", r1, r1)
        rate = self._speed / np.sqrt(norm2)
        growth = -rate * rate * np.einsum("ij,ij->i", r1, r2) / norm2  # ü = −u̇² r'·r''/|r'|²
        # the lever arm: forward t, right fixed, down −n, with t' = −n and n' = t
        x, y, z = self._lever
        r = r + x * t + y * self._right - z * n
        r1 = r1 - x * n - z * t
        r2 = r2 - x * t + z * n
        rate_, growth_ = rate[:, None], growth[:, None]
        return _Motion(u, rate, t, n, r, r1 * rate_, r2 * rate_ * rate_ + r1 * growth_)

    def _state(self, time: Array) -> NavState:
        motion = self._motion(time)
        half = 0.5 * motion.angle
        zero = np.zeros_like(half)
        pitched = np.stack([np.cos(half), zero, -np.sin(half), zero], axis=1)
        q_es = rotation.multiply(rotation.multiply(self._q_eb0, pitched), self._q_bs)
        return block_state(motion.position, motion.velocity, q_es, self.ellipsoid)

    def _rates(self, time: Array) -> tuple[Array, Array]:
        motion = self._motion(time)
        w = self.ellipsoid.omega
        x, v, a = motion.position, motion.velocity, motion.acceleration
        # f_e = r̈ + 2 ω_ie × ṙ + ω_ie × (ω_ie × r) − gravitation
        force = a - earth.gravitation_ecef(x, self.gravity, self.ellipsoid)
        force[:, 0] -= 2.0 * w * v[:, 1] + w * w * x[:, 0]
        force[:, 1] += 2.0 * w * v[:, 0] - w * w * x[:, 1]
        axes = np.stack([motion.forward, np.broadcast_to(self._right, x.shape), -motion.up], axis=1)  # C_be
        omega = w * axes[:, :, 2]
        omega[:, 1] -= motion.angle_rate
        q_sb = rotation.conjugate(self._q_bs)
        return rotation.rotate(q_sb, omega), rotation.rotate(q_sb, np.einsum("nij,nj->ni", axes, force))

    def increments(self, rate_hz: float) -> ImuData:
        """Return increments by Gauss-Legendre quadrature, exact to rounding; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        dtheta, dvel = np.empty((len(edges) - 1, 3)), np.empty((len(edges) - 1, 3))
        for first in range(0, len(dtheta), _CHUNK):
            part = slice(first, min(first + _CHUNK, len(dtheta)))
            left, right = edges[:-1][part, None], edges[1:][part, None]
            time = 0.5 * (left + right) + 0.5 * (right - left) * nodes
            omega, force = (rate.reshape(-1, _POINTS, 3) for rate in self._rates(time.reshape(-1)))
            dtheta[part] = 0.5 * (right - left) * np.einsum("j,nji->ni", weights, omega)
            dvel[part] = 0.5 * (right - left) * np.einsum("j,nji->ni", weights, force)
        return ImuData(edges, dtheta, dvel)


class GreatCircleFlight(PlacedMotion):
    """Level flight at constant height and ground speed along a great circle: truth in closed form."""

    table: ClassVar[str] = "great_circle"
    travels: ClassVar[bool] = True

    latitude_deg: Latitude = Field(description="latitude at the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude at the start")
    altitude_m: Height = Field(default=0.0, description="height above the ellipsoid")
    course_deg: Heading = Field(description="course at the start, clockwise from north")
    speed_mps: Speed = Field(description="ground speed")
    duration_s: Duration = Field(description="duration")

    @property
    def usual_speed(self) -> float:
        return self.speed_mps

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> GreatCircle:
        return GreatCircle(
            *self.place,
            np.radians(self.course_deg),
            self.speed_mps,
            self.duration_s,
            block.lever_arm_m,
            block.q_bs,
            earth.gravity,
            earth.figure,
        )
