"""The interface of motions in closed form, and the trajectory that places one on the Earth.

Algorithms are tested on motions with exactly known attitude, rates and increments: coning, rocking, rotation tables.
These motions are defined in an inertial frame m. They are used in two ways:

- `inertial_increments`: in inertial space without gravity, as in the literature, for algorithms alone. Both increments
  are closed forms.
- `OnEarth`: the frame m is fixed to the Earth at a place, and Earth rate, Coriolis acceleration and gravity are
  added exactly, so that the result is a `Trajectory` for complete navigation. The motion's own part of both increments
  remains a closed form; the Earth's part, ∫C_bm ω_ie dt and ∫C_be (2ω_ie × ṙ + ω_ie × (ω_ie × r) − gravitation) dt, is
  Gauss-Legendre quadrature to rounding.

The motions are in `coning_and_rocking` and `turntable`. `ClosedForm` is the base class of all trajectories in closed
form.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from sinssim import earth, rotation
from sinssim.arguments import quaternion
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError, shortened
from sinssim.toml_section import Heading, Height, Latitude, Longitude
from sinssim.truth.motion import NORMAL_EARTH, Mounting, PlacedMotion, TrueEarth, attitude
from sinssim.truth.sampling import (
    BlockMotion,
    Channel,
    FlightEvent,
    block_state,
    checked_duration,
    checked_place,
    integrate_samples,
    sample_edges,
)
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, G0


class ClosedForm(BlockMotion):
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

    def __init__(self, duration: float, gravity: str, ellipsoid: Ellipsoid) -> None:
        earth.gravity_number(gravity)
        self.end = checked_duration(duration)
        self.gravity = gravity
        self.ellipsoid = ellipsoid


class AnalyticMotion(Protocol):
    """A motion of body axes b in a frame m, in closed form.

    Attributes:
        fastest: angular frequency beyond which attitude and acceleration have no significant content, rad/s.
        breaks: instants at which a derivative of the motion jumps, (K,) s.
    """

    @property
    def fastest(self) -> float: ...
    @property
    def breaks(self) -> Array: ...

    def attitude(self, t: Array) -> Array:
        """Return q_mb, (N, 4), at instants (N,) s."""
        ...

    def rate(self, t: Array) -> Array:
        """Return the angular rate ω_mb in body axes, (N, 3) rad/s, at instants (N,) s."""
        ...

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration in m, each (N, 3), at instants (N,) s."""
        ...

    def turn(self, left: Array, right: Array) -> Array:
        """Return ∫ω_mb dt in body axes, component by component, (N, 3) rad, over intervals (N,) s: closed form."""
        ...

    def push(self, left: Array, right: Array) -> Array:
        """Return ∫C_bm r̈ dt, (N, 3) m/s, over intervals (N,) s: closed form."""
        ...


class TurnsOnly:
    """An analytic motion whose body does not move, with its attitude and rates in a subclass."""

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        return np.zeros((len(t), 3)), np.zeros((len(t), 3)), np.zeros((len(t), 3))

    def push(self, left: Array, right: Array) -> Array:
        return np.zeros((len(left), 3))


class ByQuadrature:
    """An analytic motion whose increments are integrals to rounding of its rate and acceleration, over consecutive
    intervals."""

    fastest: float
    breaks: Array

    if TYPE_CHECKING:  # see `AnalyticMotion`

        def attitude(self, t: Array) -> Array: ...
        def rate(self, t: Array) -> Array: ...
        def place(self, t: Array) -> tuple[Array, Array, Array]: ...

    def turn(self, left: Array, right: Array) -> Array:
        return integrate_samples(self.rate, np.append(left, right[-1:]), self.fastest, self.breaks, 3)

    def push(self, left: Array, right: Array) -> Array:
        def force(t: Array) -> Array:
            return np.asarray(rotation.rotate(rotation.conjugate(self.attitude(t)), self.place(t)[2]))

        return integrate_samples(force, np.append(left, right[-1:]), self.fastest, self.breaks, 3)


class Leaning(ByQuadrature):
    """An analytic motion over the ground about a place, whose body leans so that its downward axis has a direction.

    The motion follows the ellipsoid: `moves` gives the way north and east, x and y, and the change of height. The level
    falls away from that of the place by x²/2M + y²/2N, with the radii of curvature there, and the vertical turns by x/M
    and y/N. With the heading ψ, and the direction (x, y, z) in axes turned by it, roll φ and pitch θ follow from

        (x, y, z)/|(x, y, z)| = (sin θ cos φ, −sin φ, cos θ cos φ)
    """

    def __init__(self, latitude_deg: float) -> None:
        """Begin at a latitude, degrees."""
        from sinssim.earth.geodetic_coordinates import radii  # needs the compiler

        self._bend = 1.0 / np.array([float(of) for of in radii(latitude_deg * DEG)])  # 1/M, 1/N
        self._last: tuple[Array, tuple[Array, ...]] | None = None

    def moves(self, t: Array) -> tuple[Array, ...]:
        """Return the way north, east and downwards along the ellipsoid with its three derivatives, (N, 3) each."""
        raise NotImplementedError

    def down(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Return the direction in the frame m, of any length, with its derivative, (N, 3) each; heading and its rate,
        rad and rad/s, (N,)."""
        raise NotImplementedError

    def bent(self, t: Array) -> tuple[Array, ...]:
        """Return place, velocity, acceleration and jerk in the frame m, and gravity there with its derivative, (N, 3)
        each."""
        last = self._last  # attitude, rate and place of the same instants are wanted one after another
        if last is not None and last[0] is t:
            return last[1]
        r, v, a, j = self.moves(t)
        x, x1, x2, x3 = (of[:, :2] for of in (r, v, a, j))
        falls = 0.5 * x * x, x * x1, x1 * x1 + x * x2, 3.0 * x1 * x2 + x * x3
        for of, fall in zip((r, v, a, j), falls, strict=True):
            of[:, 2] += fall @ self._bend
        g, change = np.full_like(r, G0), np.zeros_like(r)
        g[:, :2], change[:, :2] = -G0 * self._bend * x, -G0 * self._bend * x1
        self._last = t, (r, v, a, j, g, change)
        return self._last[1]

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        r, v, a, *_ = self.bent(t)
        return r, v, a

    def _angles(self, t: Array) -> tuple[Array, ...]:
        """Return roll, pitch, heading and their rates."""
        of, change, heading, turning = self.down(t)
        c, s = np.cos(heading), np.sin(heading)
        x, y, z = c * of[:, 0] + s * of[:, 1], c * of[:, 1] - s * of[:, 0], of[:, 2]
        x1 = c * change[:, 0] + s * change[:, 1] + turning * y
        y1, z1 = c * change[:, 1] - s * change[:, 0] - turning * x, change[:, 2]
        size, upright = np.sqrt(x * x + y * y + z * z), x * x + z * z
        growth = (x * x1 + y * y1 + z * z1) / size**2
        rolling = (y * growth - y1) / np.sqrt(upright)
        return np.arcsin(-y / size), np.arctan2(x, z), heading, rolling, (z * x1 - x * z1) / upright, turning

    def attitude(self, t: Array) -> Array:
        return rotation.quaternion_from_euler(*self._angles(t)[:3])

    def rate(self, t: Array) -> Array:
        roll, pitch, _, rolling, pitching, turning = self._angles(t)
        c, s = np.cos(roll), np.sin(roll)
        across = turning * np.cos(pitch)
        return np.stack(
            [rolling - turning * np.sin(pitch), pitching * c + across * s, across * c - pitching * s], axis=1
        )


def inertial_increments(motion: AnalyticMotion, rate_hz: float, duration: float) -> ImuData:
    """Return a motion's increments in inertial space without gravity, in closed form (the motion, from time 0)."""
    _check_motion(motion)
    edges = sample_edges(0.0, checked_duration(duration), rate_hz)
    return ImuData(edges, motion.turn(edges[:-1], edges[1:]), motion.push(edges[:-1], edges[1:]))


def _check_motion(motion: AnalyticMotion) -> None:
    if not all(hasattr(motion, name) for name in ("attitude", "rate", "place", "turn", "push", "breaks", "fastest")):
        raise InputError(
            f"{shortened(repr(motion))} is not an AnalyticMotion, such as SpinCone, Rocking or RotationTable."
        )


class OnEarth(ClosedForm):
    """An analytic motion at a place on the Earth, with Earth rate and gravity added exactly.

    Args:
        motion: the motion in a frame m that is fixed to the Earth.
        latitude, longitude: geodetic coordinates of the origin of m, rad.
        height: height of the origin of m above the ellipsoid, m.
        q_nm: orientation of m in north-east-down axes at its origin, (4,).
        duration: s, from time 0.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Raises:
        InputError: the latitude is beyond a pole, the duration is not positive, or the gravity model is unknown.
    """

    def __init__(
        self,
        motion: AnalyticMotion,
        latitude: float,
        longitude: float,
        height: float,
        q_nm: ArrayLike,
        duration: float,
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
    ) -> None:
        latitude, longitude, height = checked_place(latitude, longitude, height)
        q_nm = quaternion("q_nm", q_nm)
        super().__init__(duration, gravity, ellipsoid)
        _check_motion(motion)
        self.motion = motion
        self.breaks = motion.breaks
        self.fastest = motion.fastest
        self.smooth = bool(getattr(motion, "smooth", True))
        self._q_em = rotation.multiply(earth.q_en(latitude, longitude), rotation.normalize(q_nm))
        self._q_me = rotation.conjugate(self._q_em)
        self._origin = earth.geodetic_to_ecef(latitude, longitude, height, ellipsoid)
        self._spin = np.array([0.0, 0.0, ellipsoid.omega])

    def _state(self, time: Array) -> NavState:
        position, velocity, _ = self.motion.place(time)
        return block_state(
            self._origin + rotation.rotate(self._q_em, position),
            rotation.rotate(self._q_em, velocity),
            rotation.multiply(self._q_em, self.motion.attitude(time)),
            self.ellipsoid,
        )

    def _rates(self, time: Array) -> tuple[Array, Array]:
        of_earth = self._earth_part(time)
        push = rotation.rotate(rotation.conjugate(self.motion.attitude(time)), self.motion.place(time)[2])
        return of_earth[:, :3] + self.motion.rate(time), of_earth[:, 3:] + push

    def _earth_part(self, time: Array) -> Array:
        """Return C_bm ω_ie and C_be [2ω_ie × ṙ + ω_ie × (ω_ie × r) − gravitation(r)], side by side, (N, 6)."""
        position, velocity, _ = self.motion.place(time)
        r = self._origin + rotation.rotate(self._q_em, position)
        v = rotation.rotate(self._q_em, velocity)
        force = np.cross(self._spin, 2.0 * v + np.cross(self._spin, r))
        force -= earth.gravitation_ecef(r, self.gravity, self.ellipsoid)
        q_be = rotation.multiply(rotation.conjugate(self.motion.attitude(time)), self._q_me)
        return np.concatenate([rotation.rotate(q_be, self._spin), rotation.rotate(q_be, force)], axis=1)

    def increments(self, rate_hz: float) -> ImuData:
        """Return increments: the motion's closed form plus the Earth's part; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        if isinstance(self.motion, ByQuadrature):
            from sinssim.truth.motions.mounted_block import interpolated  # needs the compiler

            def both(t: Array) -> Array:
                return np.concatenate(self._rates(t), axis=1)

            rates = interpolated(both, self.fastest, self.breaks) if self.smooth and self.fastest < rate_hz else both
            whole = integrate_samples(rates, edges, self.fastest, self.breaks)
            return ImuData(edges, whole[:, :3], whole[:, 3:])
        of_earth = integrate_samples(self._earth_part, edges, self.fastest, self.breaks)
        left, right = edges[:-1], edges[1:]
        return ImuData(
            edges, of_earth[:, :3] + self.motion.turn(left, right), of_earth[:, 3:] + self.motion.push(left, right)
        )


class ClosedFormMotion(PlacedMotion):
    """A motion in closed form about a place and a mean attitude, with a duration that each kind gives."""

    table: ClassVar[str] = "motion"

    if TYPE_CHECKING:  # each kind has its own word, and a duration: a key, or the sum of its steps

        @property
        def type(self) -> str: ...
        @property
        def duration_s(self) -> float: ...

    latitude_deg: Latitude = Field(default=45.0, description="latitude of the place")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the place")
    altitude_m: Height = Field(default=0.0, description="height of the place above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="mean roll")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="mean pitch")
    heading_deg: Heading = Field(default=0.0, description="mean heading")

    def motion(self) -> AnalyticMotion:
        """Return the motion about the place, in the axes of the mean attitude."""
        raise NotImplementedError

    @property
    def rms_rate(self) -> float:
        """Root mean square of the angular rate, rad/s."""
        raise NotImplementedError

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        return self.rms_rate**2 * self.duration_s

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        q_nm = attitude(self.roll_deg, self.pitch_deg, self.heading_deg)
        return block.of(OnEarth(self.motion(), *self.place, q_nm, self.duration_s, earth.gravity, earth.figure))
