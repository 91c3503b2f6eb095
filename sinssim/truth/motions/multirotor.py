"""A multirotor: [motion] with type = "multirotor", in closed form, from take-off to landing.

The place follows straight lines and arcs; along each, the speed rises and falls by S(x) of the other vehicles, so that
acceleration and jerk are continuous. With the way s, the tangent t, the normal n and the curvature κ in the level plane
at the start,

    ṙ = ṡ t,  r̈ = s̈ t + κṡ² n,  r⃛ = (s⃛ − κ²ṡ³) t + 3κṡs̈ n

The rotors push along the body's upward axis, and the drag of the body is proportional to its velocity. The specific
force of the rotors, f = r̈ − g + c ṙ in still air, therefore gives roll φ and pitch θ in axes turned by the heading ψ
(differential flatness: Mellinger and Kumar, IEEE ICRA 2011, 2520):

    −f/|f| = (sin θ cos φ, −sin φ, cos θ cos φ)

Their rates follow from ḟ = r⃛ + c r̈. The tilt is that of the model; what the sensors measure is exact on the Earth.
"""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, Union

import numpy as np
from pydantic import Field

from sinssim import rotation
from sinssim.data import Array
from sinssim.toml_section import A_TURN, Section
from sinssim.truth.motion import Mounting, TrueEarth
from sinssim.truth.motions.analytic import ByQuadrature, ClosedFormMotion, OnEarth
from sinssim.truth.motions.surface_vehicles import s_curve
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, G0

_Distance = Annotated[float, Field(ge=-1e5, le=1e5)]
_Length = Annotated[float, Field(gt=0.0, le=1e5)]


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


class MultirotorFlight(ByQuadrature):
    """The motion along pieces in each of which speed or heading change by S, or neither; see the module's text.

    Args:
        rows: begin and lasting, s; speed and its change, m/s; way since the beginning of the line or arc, m; course and
            angle of climb at its beginning, rad; curvature, 1/m; its beginning, (3,) m; heading and its change, rad;
            (K, 13).
        drag: c, 1/s.
    """

    def __init__(self, rows: Array, drag: float) -> None:
        self._rows, self._drag = rows, drag
        self.breaks = np.unique(np.concatenate([rows[:, 0], rows[:, 0] + rows[:, 1]]))
        self.fastest = 8.0 * np.pi / float(rows[:, 1].min())

    def _path(self, t: Array) -> tuple[Array, ...]:
        """Return place, velocity, acceleration and jerk, (N, 3) each, heading and its rate, (N,)."""
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

    def _angles(self, t: Array) -> tuple[Array, ...]:
        """Return roll, pitch, heading and their rates."""
        _, v, a, jerk, heading, turning = self._path(t)
        c, s = np.cos(heading), np.sin(heading)

        def ahead(of: Array) -> tuple[Array, Array, Array]:
            return c * of[:, 0] + s * of[:, 1], c * of[:, 1] - s * of[:, 0], of[:, 2]

        fx, fy, fz = ahead(a + self._drag * v - [0.0, 0.0, G0])
        gx, gy, gz = ahead(jerk + self._drag * a)
        gx, gy = gx + turning * fy, gy - turning * fx
        size = np.sqrt(fx * fx + fy * fy + fz * fz)
        upright = fx * fx + fz * fz
        roll, pitch = np.arcsin(fy / size), np.arctan2(-fx, -fz)
        growth = (fx * gx + fy * gy + fz * gz) / size**2
        rolling = (gy - fy * growth) / np.sqrt(upright)
        return roll, pitch, heading, rolling, (fz * gx - fx * gz) / upright, turning

    def attitude(self, t: Array) -> Array:
        return rotation.quaternion_from_euler(*self._angles(t)[:3])

    def rate(self, t: Array) -> Array:
        roll, pitch, _, rolling, pitching, turning = self._angles(t)
        c, s = np.cos(roll), np.sin(roll)
        across = turning * np.cos(pitch)
        return np.stack(
            [rolling - turning * np.sin(pitch), pitching * c + across * s, across * c - pitching * s], axis=1
        )

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        r, v, a, *_ = self._path(t)
        return r, v, a


class _Plan:
    """Lays out legs as the rows of `MultirotorFlight`."""

    def __init__(self, motion: MultirotorMotion) -> None:
        self._keys = motion
        self.time, self._place, self._heading = 0.0, np.zeros(3), motion.heading_deg * DEG
        self.rows: list[tuple[float, ...]] = []
        self.events: list[FlightEvent] = []
        for number, leg in enumerate(motion.legs, start=1):
            self.events.append(FlightEvent(self.time, f"leg {number} ({leg.type}) begins"))
            self._leg(leg)
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
    """A multirotor in still air: take-off, hovering, lines, arcs, survey grids and landing. It tilts as its rotors
    have to push."""

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

    rules = (
        (lambda s: s.changed("roll_deg", "pitch_deg"),
         "{it} has no meaning for a multirotor, whose tilt follows from its motion: remove it"),
        (lambda s: s.acceleration_mps2 >= 0.45 * G0,
         "acceleration_mps2 = {s.acceleration_mps2:g}: the rotors would have to push downwards; give less than 4.4"),
        (lambda s: s.on_ground,
         "{it}: a multirotor takes off, flies, lands, and stops on the ground; put a take_off or a land leg before it"),
    )  # fmt: skip

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

    def motion(self) -> MultirotorFlight:
        return MultirotorFlight(np.array(self._plan.rows), self.drag_per_s)

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        level = (1.0, 0.0, 0.0, 0.0)
        vehicle = OnEarth(self.motion(), *self.place, level, self.duration_s, earth.gravity, earth.figure)
        vehicle.events = tuple(self._plan.events)
        return block.of(vehicle)
