"""A multirotor: [motion] with type = "multirotor", in closed form, from take-off to landing.

The place follows straight lines and arcs; along each, the speed rises and falls by S(x) of the other vehicles, so that
acceleration and jerk are continuous. With the way s, the tangent t, the normal n and the curvature κ in the level plane
at the start,

    ṙ = ṡ t,  r̈ = s̈ t + κṡ² n,  r⃛ = (s⃛ − κ²ṡ³) t + 3κṡs̈ n

The rotors push along the body's upward axis, and the drag of the body is proportional to its velocity in the air. The
specific force of the rotors in a wind w, f = r̈ − g + c (ṙ − w), therefore gives roll φ and pitch θ in axes turned by
the heading ψ (differential flatness: Mellinger and Kumar, IEEE ICRA 2011, 2520):

    −f/|f| = (sin θ cos φ, −sin φ, cos θ cos φ)

Their rates follow from ḟ = r⃛ + c (r̈ − ẇ). The tilt is that of the model; what the sensors measure is exact on the
Earth.

Gusts are tones of each level component whose powers are those of a Gauss–Markov process, 2σ²T/(1 + ω²T²). They displace
the vehicle: with its loop u = −ω₀² r − √2 ω₀ ṙ, which the rotors follow with the lag τ, a tone is followed by

    (1) r/w = c / (s² + cs + (ω₀² + √2 ω₀ s)/(1 + τs)),  s = iω

The rotors lag behind the commands of the legs, too. With the place r_c that these command, the loop and its
feedforward, u = r̈_c + cṙ_c − ω₀² e − √2 ω₀ ė after the lag, the deviation e = r − r_c follows

    (2) τ e⃛ + (1 + cτ) ë + (c + √2 ω₀) ė + ω₀² e = −τ (r⃛_c + c r̈_c)

Its jerk is a polynomial by collocation in each of many short pieces, of which acceleration, velocity and place are the
integrals. Wind and displacements rise by S from the ground to the end of the take-off, and fall while it lands; so does
the vibration by the rotors: of each the imbalance, once a turn, and the blades that pass its arm.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from math import comb
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import A_TURN, Frequency, Heading, Section
from sinssim.truth.motion import Mounting, TrueEarth
from sinssim.truth.motions.analytic import ClosedFormMotion, Leaning, OnEarth
from sinssim.truth.motions.surface_vehicles import rising, s_curve
from sinssim.truth.motions.vibration import Shaking, Tone
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, DEG, G0

_Distance = Annotated[float, Field(ge=-1e5, le=1e5)]
_Length = Annotated[float, Field(gt=0.0, le=1e5)]
_GUSTS, _ROTORS = 71, 72
"""Branches of the random numbers."""
_SPREAD = 0.01
"""1σ of the relative differences of the rotors' speeds."""
_DEGREE, _PIECE = 8, 1.5
"""Degree of the jerk of a deviation, and length of a piece in units of the lag of the rotors or of the loop's time."""
_TONES, _SLOWEST, _FASTEST = 30, 0.05, 20.0
"""Tones of the gusts; the lowest frequency times their correlation time; and the highest one, rad/s, beyond which the
body does not follow."""


class TakeOff(Section):
    """Climb vertically from the ground."""

    example: ClassVar[dict[str, Any]] = {"height_m": 30.0}

    type: Literal["take_off"]
    height_m: _Length = Field(description="height above the place of take-off")


class Ground(Section):
    """Stand on the ground, before take-off or after landing."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 20.0}

    type: Literal["stop"]
    duration_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(description="time at rest")


class Hover(Section):
    """Remain in place in the air."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 10.0}

    type: Literal["hover"]
    duration_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(description="duration")


class Yaw(Section):
    """Turn about the vertical in place."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["yaw"]
    angle_deg: Annotated[float, A_TURN] = Field(
        ge=-3600.0, le=3600.0, description="change of the heading, right positive"
    )


class FlyTo(Section):
    """Fly straight to a point and stop there; the heading does not change."""

    example: ClassVar[dict[str, Any]] = {"north_m": 100.0, "east_m": 50.0}

    type: Literal["fly_to"]
    north_m: _Distance = Field(description="place north of that of take-off")
    east_m: _Distance = Field(description="place east of it")
    height_m: _Length | None = Field(default=None, description="height above it; default: the present one")


class Orbit(Section):
    """Fly along an arc, with the heading turning along."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 360.0}

    type: Literal["orbit"]
    angle_deg: Annotated[float, A_TURN] = Field(ge=-36_000.0, le=36_000.0, description="angle, right positive")
    radius_m: Annotated[float, Field(ge=1.0, le=1e4)] = Field(default=30.0, description="radius")


class Survey(Section):
    """Fly a grid of parallel lines, the first along the heading and the next ones to its right."""

    example: ClassVar[dict[str, Any]] = {"length_m": 120.0, "width_m": 60.0, "spacing_m": 20.0}

    type: Literal["survey"]
    length_m: _Length = Field(description="length of a line")
    width_m: _Length = Field(description="distance between the first and the last line")
    spacing_m: Annotated[float, Field(ge=0.5, le=1e4)] = Field(description="largest distance between two lines")


class Land(Section):
    """Descend vertically to the ground."""

    example: ClassVar[dict[str, Any]] = {}

    type: Literal["land"]


MultirotorLeg = Annotated[Union[Ground, TakeOff, Hover, Yaw, FlyTo, Orbit, Survey, Land], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""


class Wind(NamedTuple):
    """The wind about a multirotor: its mean, (2,) m/s north and east, and M tones of its gusts.

    `gusts` and `moves` are the complex amplitudes of the gusts, m/s, and of the displacements, m, (M, 2); `omega` is in
    rad/s, (M,).
    """

    mean: Array
    omega: Array
    gusts: NDArray[np.complex128]
    moves: NDArray[np.complex128]

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return the wind with its derivative, (2, N, 2), and the displacement with its three, (4, N, 2)."""
        angle, orders = np.multiply.outer(t, self.omega), (1j * self.omega[:, None]) ** np.arange(4)
        columns = [self.gusts * orders[:, [k]] for k in range(2)] + [self.moves * orders[:, [k]] for k in range(4)]
        amplitudes = np.hstack(columns)
        values = np.cos(angle) @ amplitudes.real - np.sin(angle) @ amplitudes.imag
        values[:, :2] += self.mean
        both = np.moveaxis(values.reshape(len(t), 6, 2), 1, 0)
        return both[:2], both[2:]


class MultirotorFlight(Leaning):
    """The motion along pieces in each of which speed or heading change by S, or neither; see the module's text.

    Args:
        rows: begin and lasting, s; speed and its change, m/s; way since the beginning of the line or arc, m; course and
            angle of climb at its beginning, rad; curvature, 1/m; its beginning, (3,) m; heading and its change, rad;
            (K, 13).
        drag: c, 1/s.
        wind: the wind.
        lifts: begin and end of each take-off and landing, s, and the change of the part of the wind; (L, 3).
        loop, lag: ω₀, rad/s, and τ, s.
        latitude: of the place, degrees.
    """

    def __init__(
        self, rows: Array, drag: float, wind: Wind, lifts: Array, loop: float, lag: float, latitude: float
    ) -> None:
        super().__init__(latitude)
        self._rows, self._drag, self._wind, self._lifts = rows, drag, wind, lifts
        self.breaks = np.unique(np.concatenate([rows[:, 0], rows[:, 0] + rows[:, 1]]))
        self.fastest = 8.0 * np.pi / float(rows[:, 1].min()) + float(wind.omega.max(initial=0.0))
        self._beside: tuple[Array, ...] = ()  # heading, its rate, the wind and its derivative of the last instants
        self._lagging = _Lag(self, rows, lifts, drag, loop, lag) if lag and len(lifts) else None
        if self._lagging is not None:
            self.fastest = max(self.fastest, 2.0 / lag)
            self.breaks = np.union1d(self.breaks, self._lagging.edges)

    def _blown(self, t: Array) -> tuple[Array, Array]:
        """Return the wind with its derivative, (2, N, 3), and the displacement with its three, (4, N, 3)."""
        wind, moved = np.zeros((2, len(t), 3)), np.zeros((4, len(t), 3))
        if self._lagging is not None:
            out, off = _part(self._lifts, t)[:, :, None], self._lagging.at(t)
            for order in range(4):  # Leibniz
                moved[order] = sum(comb(order, k) * out[k] * off[order - k] for k in range(order + 1))
        if not (self._wind.mean.any() or self._wind.omega.size):
            return wind, moved
        out, (w, q) = _part(self._lifts, t)[:, :, None], self._wind.at(t)
        wind[:, :, :2] = out[0] * w[0], out[0] * w[1] + out[1] * w[0]
        for order in range(4):  # Leibniz
            moved[order, :, :2] += sum(comb(order, k) * out[k] * q[order - k] for k in range(order + 1))
        return wind, moved

    def moves(self, t: Array) -> tuple[Array, ...]:
        *vectors, heading, turning = self.path(t)
        wind, moved = self._blown(t)
        self._last, self._beside = None, (heading, turning, *wind)
        return tuple(vector + by for vector, by in zip(vectors, moved, strict=True))

    def path(self, t: Array) -> tuple[Array, ...]:
        """Return place, velocity, acceleration and jerk, (N, 3) each, heading and its rate, (N,), as commanded."""
        begins = self._rows[:, 0]
        p = self._rows[np.clip(np.searchsorted(begins, t, side="right") - 1, 0, len(begins) - 1)].T
        begin, lasting, speed, change, way, course, climb, bend = p[:8]
        x = np.clip((t - begin) / lasting, 0.0, 1.0)
        s, integral, slope = s_curve(x)
        moves = (x > 0.0) & (x < 1.0)
        turn = change * slope * moves / lasting
        jolt = change * 2.0 * np.pi * np.sin(2.0 * np.pi * x) * moves / lasting**2
        gone = way + lasting * (speed * x + change * integral)
        v = speed + change * s
        angle = course + bend * gone
        level, up = np.cos(climb), np.sin(climb)
        tangent = np.stack([np.cos(angle) * level, np.sin(angle) * level, -up], axis=1)
        normal = np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(t)], axis=1)
        half = 0.5 * bend * gone  # chord: s sinc(κs/2) in the direction of half the turn
        chord = gone * np.sinc(half / np.pi)
        ahead = np.stack([np.cos(course + half) * level, np.sin(course + half) * level, -up], axis=1)
        r = p[8:11].T + chord[:, None] * ahead
        velocity = v[:, None] * tangent
        acceleration = turn[:, None] * tangent + (bend * v * v)[:, None] * normal
        jerk = (jolt - bend**2 * v**3)[:, None] * tangent + (3.0 * bend * v * turn)[:, None] * normal
        heading = p[11] + p[12] * s + bend * gone
        return r, velocity, acceleration, jerk, heading, p[12] * slope * moves / lasting + bend * v

    def down(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Return the direction against the push of the rotors; see `Leaning`."""
        _, v, a, jerk, g, change = self.bent(t)
        heading, turning, wind, gusting = self._beside
        return g - a - self._drag * (v - wind), change - jerk - self._drag * (a - gusting), heading, turning


class _Lag:
    """The deviation from the commands of a flight by the lag of its rotors, (2), without wind; the arguments are those
    of the flight."""

    def __init__(
        self, flight: MultirotorFlight, rows: Array, lifts: Array, drag: float, loop: float, lag: float
    ) -> None:
        equation = np.array([loop**2, drag + np.sqrt(2.0) * loop, 1.0 + drag * lag, lag])  # of e and its derivatives
        calm = 40.0 / -float(np.roots(equation[::-1]).real.max())  # s, after which nothing is left
        spans = list(self._spans(rows, lifts, calm, _PIECE * min(lag, 1.0 / loop)))
        self._begins = np.array([begin for begin, _ in spans])
        self._ends = np.array([end for _, end in spans])
        self.edges = np.union1d(self._begins, self._ends)
        half = 0.5 * (self._ends - self._begins)
        x = np.polynomial.chebyshev.chebpts1(_DEGREE + 1)
        time = (self._begins[:, None] + half[:, None] * (x + 1.0)).ravel()
        _, _, a, jerk, *_ = flight.path(time)
        push = -lag * (jerk + drag * a).reshape(len(half), len(x), 3)
        # the jerk's coefficients, then columns of unit ë, ė and e at the beginning
        jerks = np.concatenate([np.eye(_DEGREE + 1), np.zeros((_DEGREE + 1, 3))], axis=1)
        unit = _integrals(np.broadcast_to(jerks, (len(half), *jerks.shape)), half, np.eye(3, _DEGREE + 4, _DEGREE + 1))
        at_nodes = sum(
            part * np.einsum("nj,pjk->pnk", np.vander(x, of.shape[1], increasing=True), of)
            for part, of in zip(equation[::-1], unit, strict=True)
        )
        matrix, ours = at_nodes[:, :, : _DEGREE + 1], at_nodes[:, :, _DEGREE + 1 :]
        answers = np.linalg.solve(matrix, np.concatenate([push, -ours], axis=2))
        ends = [of.sum(axis=1) for of in _integrals(answers, half, np.eye(3, 6, 3))[1:]]
        steps = np.stack(ends, axis=1)  # ë, ė and e at the end, of the push and of the beginning, (P, 3, 6)
        begun = np.zeros((len(half), 3, 3))
        for k in range(1, len(half)):
            if self._begins[k] == self._ends[k - 1]:
                begun[k] = steps[k - 1, :, :3] + steps[k - 1, :, 3:] @ begun[k - 1]
        jerks = answers[:, :, :3] + answers[:, :, 3:] @ begun
        # e, ė, ë and the jerk of each piece by powers of x, (P + 1, powers, 4, 3); the last piece is rest
        self._powers = np.zeros((len(half) + 1, _DEGREE + 4, 4, 3))
        for order, of in enumerate(_integrals(jerks, half, begun)[::-1]):
            self._powers[:-1, : of.shape[1], order] = of
        self._ends = np.append(self._ends, np.inf)

    @staticmethod
    def _spans(rows: Array, lifts: Array, calm: float, longest: float) -> Iterator[tuple[float, float]]:
        """Yield begin and end of the pieces: none on the ground, none long after a command, and there longer ones where
        the commands change slowly."""
        for row in rows:
            begin, lasting, speed, change, bend = (float(row[k]) for k in (0, 1, 2, 3, 7))
            rising, falling = (lifts[lifts[:, 2] * sign > 0.0] for sign in (1.0, -1.0))
            if np.sum(rising[:, 0] <= begin) <= np.sum(falling[:, 1] <= begin):
                continue
            smooth = 0.5 / max(abs(bend) * max(speed, speed + change), 1e-9)
            smooth = min(smooth, 0.25 * lasting) if change else smooth
            until = begin + min(lasting, calm)
            edges = np.linspace(begin, until, int(np.ceil((until - begin) / min(smooth, longest))) + 1)
            if lasting > calm and (change or bend):
                end = begin + lasting
                edges = np.append(edges, np.linspace(until, end, int(np.ceil((end - until) / smooth)) + 1)[1:])
            if lasting <= calm or change or bend:
                edges[-1] = begin + lasting  # as the next row begins
            yield from pairwise(edges.tolist())

    def at(self, t: Array) -> Array:
        """Return the deviation with its three derivatives, (4, N, 3)."""
        k = np.clip(np.searchsorted(self._begins, t, side="right") - 1, 0, None)
        k[t >= self._ends[k]] = len(self._begins)
        half = 0.5 * (self._ends - np.append(self._begins, 0.0))
        x = ((t - np.append(self._begins, 0.0)[k]) / half[k] - 1.0)[:, None, None]
        values = self._powers[k, -1]
        for power in range(self._powers.shape[1] - 2, -1, -1):
            values = values * x + self._powers[k, power]
        return np.moveaxis(values, 1, 0)


def _integrals(jerk: Array, half: Array, begun: Array) -> list[Array]:
    """Return polynomials on −1…1 by their powers, (P, powers, K), and their three integrals over pieces of given
    half-lengths, (P,) s, which begin with the rows of `begun`, ((P,) 3, K)."""
    integrals = [jerk]
    for row in range(3):
        last = integrals[-1]
        number = np.arange(1, last.shape[1] + 1)[:, None]
        inner = last * half[:, None, None] / number
        first = begun[..., row, :] - np.sum(inner * (-1.0) ** number, axis=1)
        integrals.append(np.concatenate([first[:, None], inner], axis=1))
    return integrals


def _part(lifts: Array, t: Array) -> Array:
    """Return the part of wind, lag and vibration that acts, with its three derivatives by time, (4, N)."""
    part = np.zeros((4, len(t)))
    for begin, end, change in lifts:
        part[0, t >= end] += change
        within = (t > begin) & (t < end)
        part[:, within] += change * np.stack(rising(t[within], begin, end - begin)[1:])
    return part


class _Plan:
    """Lays out legs as the rows of `MultirotorFlight`."""

    def __init__(self, motion: MultirotorMotion) -> None:
        self._keys = motion
        self.time, self._place, self._heading = 0.0, np.zeros(3), motion.heading_deg * DEG
        self.rows: list[tuple[float, ...]] = []
        self.lifts: list[tuple[float, float, float]] = []
        self.events: list[FlightEvent] = []
        for number, leg in enumerate(motion.legs, start=1):
            begin = self.time
            self.events.append(FlightEvent(begin, f"leg {number} ({leg.type}) begins"))
            self._leg(leg)
            if isinstance(leg, TakeOff | Land):
                self.lifts.append((begin, self.time, 1.0 if isinstance(leg, TakeOff) else -1.0))
            self.events.append(FlightEvent(self.time, f"leg {number} ({leg.type}) ends"))

    def _leg(self, leg: Any) -> None:
        north, east, down = self._place
        match leg:
            case Ground() | Hover():
                self._wait(leg.duration_s)
            case Yaw():
                angle = leg.angle_deg * DEG
                self._wait(2.0 * abs(angle) / (self._keys.yaw_deg_s * DEG), angle)  # S rises at most twice the mean
                self._heading += angle
            case TakeOff():
                self._line(np.array([north, east, -leg.height_m]), self._keys.climb_mps)
            case Land():
                self._line(np.array([north, east, 0.0]), self._keys.climb_mps)
            case FlyTo():
                height = down if leg.height_m is None else -leg.height_m
                self._line(np.array([leg.north_m, leg.east_m, height]), self._keys.speed_mps)
            case Orbit():
                bend = np.copysign(1.0 / leg.radius_m, leg.angle_deg)
                self._run(leg.radius_m * abs(leg.angle_deg) * DEG, self._keys.speed_mps, self._heading, 0.0, bend)
                self._heading += leg.angle_deg * DEG
            case Survey():
                lines = int(np.ceil(leg.width_m / leg.spacing_m - 1e-9)) + 1
                c, s = np.cos(self._heading), np.sin(self._heading)
                along = leg.length_m * np.array([c, s, 0.0])
                across = leg.width_m / (lines - 1) * np.array([-s, c, 0.0])
                for number in range(lines):
                    self._line(self._place + (along if number % 2 == 0 else -along), self._keys.speed_mps)
                    if number + 1 < lines:
                        self._line(self._place + across, self._keys.speed_mps)

    def _add(self, lasting: float, speed: float, change: float, *line: float, turn: float = 0.0) -> None:
        self.rows.append((self.time, lasting, speed, change, *line[:4], *self._place, self._heading, turn))
        self.time += lasting

    def _wait(self, lasting: float, turn: float = 0.0) -> None:
        self._add(lasting, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, turn=turn)

    def _line(self, to: Array, speed: float) -> None:
        way = to - self._place
        length = float(np.linalg.norm(way))
        if length > 0.0:
            level = float(np.hypot(way[0], way[1]))
            self._run(length, speed, float(np.arctan2(way[1], way[0])), float(np.arctan2(-way[2], level)), 0.0)
            self._place = to

    def _run(self, length: float, speed: float, course: float, climb: float, bend: float) -> None:
        """Speed up, fly and slow down along a line or an arc; a short one is flown more slowly."""
        speed = min(speed, float(np.sqrt(length * self._keys.acceleration_mps2)))
        ramp = speed / self._keys.acceleration_mps2
        half = 0.5 * speed * ramp
        cruise = (length - 2.0 * half) / speed
        shape = (course, climb, bend)
        self._add(ramp, 0.0, speed, 0.0, *shape)
        if cruise > 1e-9:
            self._add(cruise, speed, 0.0, half, *shape)
        self._add(ramp, speed, -speed, length - half, *shape)
        if bend:
            middle = course + 0.5 * bend * length
            chord = length * np.sinc(0.5 * bend * length / np.pi)
            self._place = self._place + chord * np.array([np.cos(middle), np.sin(middle), 0.0])


class MultirotorMotion(ClosedFormMotion):
    """A multirotor: take-off, hovering, lines, arcs, survey grids and landing. It tilts as its rotors have to push,
    against the wind as well."""

    travels: ClassVar[bool] = True

    type: Literal["multirotor"]
    legs: tuple[MultirotorLeg, ...] = Field(min_length=1, description="the legs, in order")
    speed_mps: Annotated[float, Field(gt=0.0, le=60.0)] = Field(default=8.0, description="speed along lines and arcs")
    climb_mps: Annotated[float, Field(gt=0.0, le=30.0)] = Field(
        default=2.0, description="vertical speed of take-off and landing"
    )
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=20.0)] = Field(
        default=1.5, description="mean acceleration and deceleration; the largest is twice as large"
    )
    yaw_deg_s: Annotated[float, Field(gt=0.0, le=720.0)] = Field(default=60.0, description="largest rate of a yaw leg")
    drag_per_s: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.2, description="deceleration by the air per velocity"
    )
    wind_mps: Annotated[float, Field(ge=0.0, le=40.0)] = Field(default=0.0, description="mean wind")
    wind_from_deg: Heading = Field(default=0.0, description="direction that it comes from")
    gust_sigma_mps: Annotated[float, Field(ge=0.0, le=15.0)] = Field(
        default=0.0, description="1σ of the gusts, north and east, which displace the multirotor"
    )
    gust_s: Annotated[float, Field(ge=0.1, le=1000.0)] = Field(default=3.0, description="their correlation time")
    loop_rad_s: Annotated[float, Field(ge=0.1, le=5.0)] = Field(
        default=1.0, description="natural frequency of the loop that holds the place and follows the legs"
    )
    rotor_lag_s: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        default=0.15, description="lag of the push of the rotors behind the loop, that of the tilt included"
    )
    rotors: Annotated[int, Field(ge=3, le=16)] = Field(default=4, description="number of the rotors")
    rotor_hz: Frequency = Field(default=95.0, description="turns of a rotor per second in hover")
    blades: Annotated[int, Field(ge=2, le=8)] = Field(default=2, description="blades of a rotor")
    rotor_rms_g: Annotated[float, Field(ge=0.0, le=50.0)] = Field(
        default=0.0,
        description="rms vibration by the rotors in flight, along each axis: forward and right by their imbalance, at "
        "rotor_hz, and down by their blades, at blades times rotor_hz",
    )
    rotor_rms_arcsec: Annotated[float, Field(ge=0.0, le=36_000.0)] = Field(
        default=0.0, description="the same in roll and pitch, by the blades"
    )

    rules = (
        (lambda s: not s.wind_mps and s.changed("wind_from_deg"),
         "{it} has no effect without wind_mps: give the mean wind"),
        (lambda s: not s.gust_sigma_mps and s.changed("gust_s"),
         "{it} has no effect without gusts: give gust_sigma_mps"),
        (lambda s: 0.0 < s.rotor_lag_s < 0.01,
         "rotor_lag_s = {s.rotor_lag_s:g} is shorter than that of any rotor: give 0, for none, or at least 0.01"),
        (lambda s: not (s.rotor_rms_g or s.rotor_rms_arcsec) and s.changed("rotors", "rotor_hz", "blades"),
         "{it} has no effect without vibration by the rotors: give rotor_rms_g or rotor_rms_arcsec"),
        (lambda s: s.unstable,
         "rotor_lag_s = {s.rotor_lag_s:g} is too long for loop_rad_s = {s.loop_rad_s:g}: the loop would oscillate with "
         "growing amplitude; give a shorter lag or a slower loop"),
        (lambda s: s.changed("roll_deg", "pitch_deg"),
         "{it} has no meaning for a multirotor, whose tilt follows from its motion: remove it"),
        (lambda s: s.acceleration_mps2 >= 0.45 * G0,
         "acceleration_mps2 = {s.acceleration_mps2:g}: the rotors would have to push downwards; give less than 4.4"),
        (lambda s: s.on_ground,
         "{it}: a multirotor takes off, flies, lands, and stops on the ground; put a take_off or a land leg before it"),
    )  # fmt: skip

    @property
    def unstable(self) -> bool:
        """Whether the loop of (1) is: τs³ + (1 + cτ)s² + (c + √2ω₀)s + ω₀², by Routh's criterion."""
        c, lag, loop = self.drag_per_s, self.rotor_lag_s, self.loop_rad_s
        return bool((1.0 + c * lag) * (c + np.sqrt(2.0) * loop) <= lag * loop**2)

    @property
    def on_ground(self) -> str:
        """The first leg that flies on the ground, or takes off or stops in the air; "" for none."""
        aloft = False
        for number, leg in enumerate(self.legs, start=1):
            if aloft == isinstance(leg, Ground | TakeOff):
                return f"legs.{number} ({leg.type})"
            aloft = not isinstance(leg, Ground | Land)
        return ""

    @cached_property
    def _plan(self) -> _Plan:
        return _Plan(self)

    @property
    def duration_s(self) -> float:
        """Duration of the flight, s."""
        return self._plan.time

    @property
    def rms_rate(self) -> float:
        """Of the turns of the legs, with those of the tilt neglected."""
        rows = np.array(self._plan.rows)
        turned = 1.5 * (rows[:, 12] / rows[:, 1]) ** 2 + (rows[:, 7] * (rows[:, 2] + 0.5 * rows[:, 3])) ** 2
        return float(np.sqrt(np.sum(turned * rows[:, 1]) / self.duration_s))

    @property
    def is_drawn(self) -> bool:
        return bool(self.gust_sigma_mps or self.rotor_rms_g or self.rotor_rms_arcsec)

    def wind(self, seed: int) -> Wind:
        """Return the wind of a seed: the gusts' tones at random frequencies, evenly spread over their logarithm."""
        course = self.wind_from_deg * DEG
        mean = -self.wind_mps * np.array([np.cos(course), np.sin(course)])
        if not self.gust_sigma_mps:
            return Wind(mean, np.zeros(0), np.zeros((0, 2), np.complex128), np.zeros((0, 2), np.complex128))
        generator = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(_GUSTS,))))
        edges = np.geomspace(_SLOWEST / self.gust_s, max(_FASTEST, 10.0 / self.gust_s), _TONES + 1)
        omega = edges[:-1] * (edges[1:] / edges[:-1]) ** generator.random(_TONES)
        power = np.diff(np.arctan(edges * self.gust_s))  # of 2T/(1 + ω²T²) in each piece
        amplitude = self.gust_sigma_mps * np.sqrt(2.0 * power / power.sum())
        gusts = amplitude[:, None] * np.exp(2j * np.pi * generator.random((_TONES, 2)))
        s, c, loop = 1j * omega, self.drag_per_s, self.loop_rad_s
        control = (loop**2 + np.sqrt(2.0) * loop * s) / (1.0 + self.rotor_lag_s * s)
        return Wind(mean, omega, gusts, (c / (s * s + c * s + control))[:, None] * gusts)  # (1)

    def motion(self, seed: int = 0) -> MultirotorFlight:
        """Return the motion with the gusts of a seed; see the base."""
        lifts = np.array(self._plan.lifts).reshape(-1, 3)
        rows, loop = np.array(self._plan.rows), (self.loop_rad_s, self.rotor_lag_s)
        return MultirotorFlight(rows, self.drag_per_s, self.wind(seed), lifts, *loop, self.latitude_deg)

    def shaking(self, seed: int) -> Shaking | None:
        """Return the lines of each rotor, whose speeds differ by about a hundredth; see the base."""
        if not (self.rotor_rms_g or self.rotor_rms_arcsec):
            return None
        generator = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed, spawn_key=(_ROTORS,))))
        tones = []
        for speed in self.rotor_hz * (1.0 + _SPREAD * generator.standard_normal(self.rotors)):
            imbalance, blades, roll, pitch = 2.0 * np.pi * generator.random(4)
            passing = self.blades * speed
            size = np.sqrt(2.0 / self.rotors) * self.rotor_rms_g * G0 / (2.0 * np.pi * np.array([speed, passing])) ** 2
            turn = np.sqrt(2.0 / self.rotors) * self.rotor_rms_arcsec * ARCSEC
            tones += [
                Tone("forward", size[0], speed, imbalance), Tone("right", size[0], speed, imbalance - 0.5 * np.pi),
                Tone("down", size[1], passing, blades), Tone("roll", turn, passing, roll),
                Tone("pitch", turn, passing, pitch),
            ]  # fmt: skip
        lifts = np.array(self._plan.lifts).reshape(-1, 3)
        return Shaking(tuple(tones), lambda t: _part(lifts, t)[:3])

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        level = (1.0, 0.0, 0.0, 0.0)
        vehicle = OnEarth(self.motion(seed), *self.place, level, self.duration_s, earth.gravity, earth.figure)
        vehicle.events = tuple(self._plan.events)
        return block.of(vehicle)
