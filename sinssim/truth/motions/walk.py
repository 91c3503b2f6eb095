"""A walk with the sensor block on one shoe: [motion] with type = "walk", in closed form.

The foot stands, swings to its next place, and stands again. The frame m is the ground, a plane through the first place;
x is the first heading, z down. With u = 0…1 in a swing of duration D between footholds P and P', the place, the height
of the foot above the ground and its pitch are

    r = P + (P' − P) S(u),  h = c sin⁴πu − p sin⁶πx,  θ = −A sin⁴πu (cos πu + 0.3),  S(u) = u − sin(2πu)/2π

and the heading turns by S(u), too. The toe first points down, then up. x = 0…1 is the last part of the swing, in which
the sole yields by p: the peak of its acceleration, 6π²p/τ² in a time τ, is the shock of the heel strike. It begins
smoothly, so that increments at 1 kHz describe it to 1e-6 m in an hour. Velocity, rate and their first derivatives are
zero at both ends, and the foot stands exactly still between the swings. The body axes follow from heading and pitch,
C_mb = R_z(ψ) R_y(θ), with the rate (−ψ̇ sin θ, θ̇, ψ̇ cos θ).

The footholds lie on the path. Lengths and durations of the strides scatter; those of a leg are scaled so that the leg
has its length and its mean duration, and a closed path remains closed. The increments are integrated to rounding by
quadrature between the instants at which a derivative jumps.

Stance and swing, rates and forces of feet: J. Perry, Gait Analysis, 1992 (a foot is flat on the ground for 0.4 of a
stride); E. Foxlin, IEEE Computer Graphics and Applications 25(6), 2005; J.-O. Nilsson et al., IEEE/ION PLANS, 2012.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sinssim import rotation
from sinssim.data import Array
from sinssim.toml_section import A_TURN, Section
from sinssim.truth.motion import Mounting, TrueEarth, attitude
from sinssim.truth.motions.analytic import ByQuadrature, ClosedFormMotion, OnEarth
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, G0

_Strides = Annotated[float, Field(gt=0.0, le=1e5)]
_Scatter = Annotated[float, Field(ge=0.0, le=0.2)]


class StraightWalk(Section):
    """Straight ahead."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 50.0}

    type: Literal["straight"]
    distance_m: _Strides = Field(description="distance, in whole strides of about stride_m")


class TurningWalk(Section):
    """Along an arc."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["turn"]
    angle_deg: Annotated[float, A_TURN] = Field(
        ge=-3600.0, le=3600.0, description="change of the heading, right positive"
    )
    radius_m: Annotated[float, Field(ge=0.3, le=1e4)] = Field(default=2.0, description="radius of the arc")


class StandingWalk(Section):
    """Stand still on both feet."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 10.0}

    type: Literal["stop"]
    duration_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(description="time at rest")


WalkLeg = Annotated[Union[StraightWalk, TurningWalk, StandingWalk], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""

SHOCK_S = 0.05
"""Duration of the shock of a heel strike, s."""
_UP = 0.3
"""Part of the swing's pitch that is symmetrical in time: the toe points down four times as much as up."""
_LEAST = 0.3
"""Shortest length and duration of a stride, in units of the mean."""


def _bump(u: Array, n: int = 4) -> tuple[Array, Array, Array]:
    """Return sinⁿπu with its first two derivatives by u."""
    s, c = np.sin(np.pi * u), np.cos(np.pi * u)
    return s**n, n * np.pi * s ** (n - 1) * c, n * np.pi**2 * s ** (n - 2) * (n - 1.0 - n * s * s)


def _pitching(u: Array) -> tuple[Array, Array]:
    """Return sin⁴πu (cos πu + 0.3) with its derivative by u."""
    b, b1, _ = _bump(u)
    factor = np.cos(np.pi * u) + _UP
    return b * factor, b1 * factor - b * np.pi * np.sin(np.pi * u)


_LARGEST, _FASTEST = (float(np.abs(values).max()) for values in _pitching(np.linspace(0.0, 1.0, 100_001)))
"""Largest pitch of a swing, in units of A, and its largest derivative by u."""


class Walk(ByQuadrature):
    """The motion of a shoe over its swings; see the module's text.

    Args:
        begin, duration: of each swing, (K,) s.
        place: of the footholds, x and y, (K+1, 2) m.
        heading: of the foot at them, (K+1,) rad.
        clearance, pitch: c, m, and A, rad.
        shock: peak of the acceleration of a heel strike, m/s².
    """

    smooth = False  # polynomials through a shock lose micrometres in an hour of steps

    def __init__(
        self, begin: Array, duration: Array, place: Array, heading: Array, clearance: float, pitch: float, shock: float
    ) -> None:
        self._begin, self._duration = begin, duration
        self._place, self._heading = place, heading
        self._clearance, self._pitch = clearance, pitch
        self._strike = np.minimum(SHOCK_S, duration)  # a swing may be shorter than a usual shock
        self._yield = shock * self._strike**2 / (6.0 * np.pi**2)
        self.breaks = np.concatenate([begin, begin + duration, begin + duration - self._strike])
        # the shock has the angular frequency 6π/τ, the rest of a swing 5π/D, its axes turn by about A
        least = float(np.min(duration, initial=np.inf))
        self.fastest = 6.0 * np.pi / min(SHOCK_S, least) + 5.0 * np.pi * (2.0 + 0.5 * pitch) / least

    def _swing(self, t: Array) -> tuple[NDArray[np.intp], Array, NDArray[np.bool_]]:
        """Return the number of the swing, the part u of it that is over, and whether the foot moves."""
        k = np.clip(np.searchsorted(self._begin, t, side="right") - 1, 0, len(self._begin) - 1)
        u = np.clip((t - self._begin[k]) / self._duration[k], 0.0, 1.0)
        return k, u, (u > 0.0) & (u < 1.0)

    def _angles(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Return heading, pitch and their derivatives by time, rad and rad/s."""
        k, u, moves = self._swing(t)
        change = self._heading[k + 1] - self._heading[k]
        g, g1 = _pitching(u)
        per_second = moves / self._duration[k]
        heading = self._heading[k] + change * (u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi))
        turning = change * (1.0 - np.cos(2.0 * np.pi * u)) * per_second
        return heading, -self._pitch * g * moves, turning, -self._pitch * g1 * per_second

    def attitude(self, t: Array) -> Array:
        heading, pitch, _, _ = self._angles(t)
        return rotation.quaternion_from_euler(np.zeros_like(t), pitch, heading)

    def rate(self, t: Array) -> Array:
        _, pitch, turning, pitching = self._angles(t)
        return np.stack([-turning * np.sin(pitch), pitching, turning * np.cos(pitch)], axis=1)

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        k, u, moves = self._swing(t)
        w = 1.0 / self._duration[k]
        way = self._place[k + 1] - self._place[k]
        turn = 2.0 * np.pi * u
        r, v, a = np.zeros((3, len(t), 3))
        r[:, :2] = self._place[k] + way * (u - np.sin(turn) / (2.0 * np.pi))[:, None]
        v[:, :2] = way * (moves * w * (1.0 - np.cos(turn)))[:, None]
        a[:, :2] = way * (moves * w * w * 2.0 * np.pi * np.sin(turn))[:, None]
        for depth, lasting, n in ((-self._clearance, self._duration[k], 4), (self._yield[k], self._strike[k], 6)):
            x = np.clip(1.0 - (1.0 - u) / (w * lasting), 0.0, 1.0)
            for down, derivative, order in zip((r, v, a), _bump(x, n), range(3), strict=True):
                down[:, 2] += depth * moves * derivative / lasting**order
        return r, v, a


class WalkMotion(ClosedFormMotion):
    """A walk with the sensor block on a shoe: legs of strides of scattering length and duration, in each of which the
    foot stands exactly still and then swings to its next place. `pitch_deg` and `roll_deg` are the slope of the ground
    along and across the first heading."""

    travels: ClassVar[bool] = True

    type: Literal["walk"]
    legs: tuple[WalkLeg, ...] = Field(min_length=1, description="the legs, in order")
    stride_m: Annotated[float, Field(ge=0.2, le=4.0)] = Field(
        default=1.4, description="mean length of a stride, two steps"
    )
    stride_s: Annotated[float, Field(ge=0.3, le=10.0)] = Field(default=1.1, description="mean duration of a stride")
    stance: Annotated[float, Field(ge=0.05, le=0.95)] = Field(
        default=0.4, description="part of a stride in which the foot is flat on the ground"
    )
    length_scatter: _Scatter = Field(default=0.05, description="1σ of the length of a stride, in units of the mean")
    duration_scatter: _Scatter = Field(default=0.03, description="1σ of its duration, in units of the mean")
    clearance_m: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=0.12, description="largest height of the foot above the ground"
    )
    swing_deg_s: Annotated[float, Field(ge=0.0, le=2000.0)] = Field(
        default=600.0, description="largest pitch rate of the foot in a mean swing"
    )
    heel_strike_g: Annotated[float, Field(ge=0.0, le=50.0)] = Field(
        default=8.0, description="peak of the acceleration of a heel strike, within 50 ms"
    )

    rules = (
        (lambda s: s.pitch_amplitude * _LARGEST > 80.0 * DEG,
         "swing_deg_s = {s.swing_deg_s:g}: in a swing of {s.swing_s:.3g} s the foot would pitch by more than 80°; give "
         "a lower rate, a longer stance or a shorter stride_s"),
    )  # fmt: skip

    @property
    def swing_s(self) -> float:
        """Mean duration of a swing, s."""
        return self.stride_s * (1.0 - self.stance)

    @property
    def pitch_amplitude(self) -> float:
        """A, rad."""
        return self.swing_deg_s * DEG * self.swing_s / _FASTEST

    def _strides(self, leg: StraightWalk | TurningWalk) -> int:
        return max(round(_length(leg) / self.stride_m), 1)

    @cached_property
    def _schedule(self) -> tuple[tuple[FlightEvent, ...], float]:
        """Beginning and end of the legs, and that of the walk, s."""
        time, events = 0.0, []
        for number, leg in enumerate(self.legs, start=1):
            events.append(FlightEvent(time, f"leg {number} ({leg.type}) begins"))
            time += leg.duration_s if isinstance(leg, StandingWalk) else self._strides(leg) * self.stride_s
            events.append(FlightEvent(time, f"leg {number} ({leg.type}) ends"))
        return tuple(events), time

    @property
    def duration_s(self) -> float:
        """Duration of the walk, s."""
        return self._schedule[1]

    @property
    def rms_rate(self) -> float:
        """Of the pitch, whose mean square in a swing is about a quarter of the largest one."""
        walked = sum(self._strides(leg) * self.stride_s for leg in self.legs if not isinstance(leg, StandingWalk))
        return self.swing_deg_s * DEG * float(np.sqrt((1.0 - self.stance) / 4.0 * walked / self.duration_s))

    @property
    def is_drawn(self) -> bool:
        return True

    def motion(self, seed: int = 0) -> Walk:
        """Return the motion with the strides of a seed; see the base."""
        from sinssim.statistics.random_numbers import normals  # needs the compiler

        counts = [0 if isinstance(leg, StandingWalk) else self._strides(leg) for leg in self.legs]
        drawn = (self.length_scatter, "length"), (self.duration_scatter, "duration")
        long, lasting = (
            np.maximum(1.0 + sigma * normals(seed, f"stride {what}", 0, sum(counts)), _LEAST) for sigma, what in drawn
        )
        time, at, ahead, first = 0.0, np.zeros(2), 0.0, 0
        begins, swings, places, headings = [np.zeros(0)], [np.zeros(0)], [np.zeros((1, 2))], [np.zeros(1)]
        for leg, count in zip(self.legs, counts, strict=True):
            if isinstance(leg, StandingWalk):
                time += leg.duration_s
                continue
            part = slice(first, first + count)
            way = np.cumsum(long[part]) / np.sum(long[part])
            seconds = self.stride_s * count * lasting[part] / np.sum(lasting[part])
            ends = time + np.cumsum(seconds)
            swings.append((1.0 - self.stance) * seconds)
            begins.append(ends - swings[-1])
            here, turned = _along(leg, way, ahead)
            places.append(at + here)
            headings.append(ahead + turned)
            time, at, ahead, first = float(ends[-1]), places[-1][-1], float(headings[-1][-1]), first + count
        begin, swing = np.concatenate(begins), np.concatenate(swings)
        if not len(begin):  # only standing
            begin, swing, places, headings = np.zeros(1), np.ones(1), [np.zeros((2, 2))], [np.zeros(2)]
        shape = self.clearance_m, self.pitch_amplitude, self.heel_strike_g * G0
        if not any(counts):
            shape = 0.0, 0.0, 0.0
        return Walk(begin, swing, np.concatenate(places), np.concatenate(headings), *shape)

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        q_nm = attitude(self.roll_deg, self.pitch_deg, self.heading_deg)
        duration = self.duration_s
        vehicle = OnEarth(self.motion(seed), *self.place, q_nm, duration, earth.gravity, earth.figure)
        vehicle.events = self._schedule[0]
        return block.of(vehicle)


def _length(leg: StraightWalk | TurningWalk) -> float:
    """Return the length of a leg, m."""
    return leg.distance_m if isinstance(leg, StraightWalk) else leg.radius_m * abs(leg.angle_deg) * DEG


def _along(leg: StraightWalk | TurningWalk, way: Array, heading: float) -> tuple[Array, Array]:
    """Return places, (K, 2) m, after parts of a leg from its beginning, and the change of the heading there, rad."""
    if isinstance(leg, StraightWalk):
        return leg.distance_m * np.outer(way, [np.cos(heading), np.sin(heading)]), np.zeros(len(way))
    turned = leg.angle_deg * DEG * way
    radius = np.copysign(leg.radius_m, leg.angle_deg)
    after = heading + turned
    return radius * np.stack([np.sin(after) - np.sin(heading), np.cos(heading) - np.cos(after)], axis=1), turned
