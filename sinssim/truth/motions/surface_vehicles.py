"""The true motion of a land vehicle, [drive], and of a ship, [voyage]: a smooth curve through closely spaced knots.

The course follows the legs on the ellipsoid; the body's response to the road or to the waves is added to height,
attitude and, at sea, to the place. The spline through the knots is the truth: the ideal sensors are exact along it.

Changes of speed and of the rate of turn follow S(x) = x − sin(2πx)/2π on 0…1, whose first two derivatives are zero at
both ends. The way ∫v dt and the heading ∫r dt have closed forms with ∫S dx = x²/2 + (cos 2πx − 1)/4π².

The body is a damped oscillator of natural angular frequency ω₀ and damping ratio ζ. What carries it moves the spring,
and the damper too if it stands on the carrier as that of a suspension does (base excitation):

    z̈ + 2ζω₀(ż − u̇) + ω₀²(z − u) = 0,   H = (1 + 2iζr)/(1 − r² + 2iζr),   r = ω/ω₀

The damper of a hull acts against still water: its term is ż alone, and H = 1/(1 − r² + 2iζr). See Den Hartog,
Mechanical Vibrations, 4th ed., 1956, ch. 2.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Union

import numpy as np
from pydantic import Field

import sinssim.earth
from sinssim import rotation
from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError
from sinssim.toml_section import A_TURN, Heading, Height, Keys, Latitude, Longitude, Section
from sinssim.truth.motion import NORMAL_EARTH, Mounting, PlacedMotion, TrueEarth
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.truth.curve import Curve


_Lasting = Annotated[float, Field(gt=0.0, le=86_400.0)]
_Distance = Annotated[float, Field(gt=0.0, le=2e6)]
_Speed = Annotated[float, Field(gt=0.0, le=60.0)]


class Stop(Section):
    """Brake to a standstill and remain at rest."""

    example: ClassVar[dict[str, Any]] = {"duration_s": 60.0}

    type: Literal["stop"]
    duration_s: _Lasting = Field(description="time at rest, after braking")


class Straight(Section):
    """Straight ahead on a constant heading; the speed changes at the beginning of the leg."""

    example: ClassVar[dict[str, Any]] = {"distance_m": 2000.0, "speed_mps": 8.0}
    exactly_one = (Keys(("distance_m", "duration_s"), "a straight leg ends after distance_m or after duration_s"),)

    type: Literal["straight"]
    distance_m: _Distance | None = Field(default=None, description="distance, including the change of speed")
    duration_s: _Lasting | None = Field(default=None, description="duration, including the change of speed")
    speed_mps: _Speed | None = Field(default=None, description="target speed; default: that of the previous leg")


class Turn(Section):
    """A turn at constant speed, with a smooth beginning and end."""

    example: ClassVar[dict[str, Any]] = {"angle_deg": 90.0}

    type: Literal["turn"]
    angle_deg: Annotated[float, A_TURN] = Field(
        ge=-3600.0, le=3600.0, description="change of the heading, right positive"
    )
    rate_deg_s: Annotated[float, Field(gt=0.0, le=60.0)] | None = Field(
        default=None, description="largest rate of the turn; default: the rate that follows from lateral_mps2"
    )


VehicleLeg = Annotated[Union[Straight, Turn, Stop], Field(discriminator="type")]  # noqa: UP007
"""One leg, selected by `type`."""


_RAMP = 0.25
"""Part of a turn at whose beginning and end the rate changes."""
_LEAST_RAMP_S = 2.0
"""Shortest time in which the rate of a turn changes [s]."""


def s_curve(x: Array) -> tuple[Array, Array, Array]:
    """Return S(x), ∫S dx from 0 and dS/dx at x in 0…1; see the module's text."""
    turn = 2.0 * np.pi * x
    c = np.cos(turn)
    return x - np.sin(turn) / (2.0 * np.pi), 0.5 * x * x + (c - 1.0) / (4.0 * np.pi**2), 1.0 - c


def rising(t: Array, begin: float, lasting: float) -> list[Array]:
    """Return ∫S dt, S and its three derivatives by time of a change that begins at an instant, (N,) each."""
    x = np.clip((t - begin) / lasting, 0.0, 1.0)
    s, integral, slope = s_curve(x)
    turn, inside = 2.0 * np.pi * x, (x > 0.0) & (x < 1.0)
    bends = 2.0 * np.pi * np.sin(turn) / lasting**2, 4.0 * np.pi**2 * np.cos(turn) * inside / lasting**3
    return [lasting * integral + np.maximum(t - begin - lasting, 0.0), s, slope / lasting, *bends]


class Pieces(NamedTuple):
    """Pieces of the motion, (K,), in each of which the speed changes, or the rate of turn, or neither: what begins, s,
    and the changes of speed, m/s, and of the rate of turn, rad/s."""

    start: Array
    lasting: Array
    speed: Array
    change: Array
    rate: Array
    rate_change: Array
    way: Array
    heading: Array


@dataclass(frozen=True)
class Course:
    """A vehicle's motion along its course."""

    # m/s and m/s², (K,)
    speed: Array
    acceleration: Array
    # rad and rad/s, (K,)
    heading: Array
    rate: Array
    way: Array  # m, (K,)


class Profile:
    """Speed, heading and way of a vehicle as functions of time."""

    def __init__(
        self, table: str, legs: Iterable[VehicleLeg], heading: float, acceleration: float, lateral: float
    ) -> None:
        """Lay out the legs from a heading, rad, with a mean acceleration of changes of speed and a lateral acceleration
        in turns without a rate, m/s²."""
        self._rows: list[tuple[float, ...]] = []  # as `Pieces`
        self._at = (0.0, 0.0, 0.0, heading)  # time, speed, way, heading
        events = []
        for number, leg in enumerate(legs, start=1):
            name = f"leg {number} ({leg.type})"
            events.append(FlightEvent(self._at[0], f"{name} begins"))
            if isinstance(leg, Stop):
                self._change_speed(0.0, acceleration)
                self._add(leg.duration_s)
            elif isinstance(leg, Straight):
                self._straight(leg, f"{table}.legs.{number} ({leg.type})", acceleration)
            else:
                self._turn(leg, f"{table}.legs.{number} ({leg.type})", lateral)
            events.append(FlightEvent(self._at[0], f"{name} ends"))
        self.events = tuple(events)
        self.duration = self._at[0]
        # about ∫ω² dt of the turns, rad²/s
        self.turning = sum((rate + 0.5 * change) ** 2 * lasting for _, lasting, _, _, rate, change, _, _ in self._rows)

    def _add(self, lasting: float, change: float = 0.0, rate: float = 0.0, rate_change: float = 0.0) -> None:
        time, speed, way, heading = self._at
        self._rows.append((time, lasting, speed, change, rate, rate_change, way, heading))
        self._at = (
            time + lasting,
            speed + change,
            way + (speed + 0.5 * change) * lasting,
            heading + (rate + 0.5 * rate_change) * lasting,
        )

    def _change_speed(self, speed: float, acceleration: float) -> None:
        change = speed - self._at[1]
        if change:
            self._add(abs(change) / acceleration, change=change)
            time, _, way, heading = self._at
            self._at = (time, speed, way, heading)  # without a rounding error

    def _straight(self, leg: Straight, name: str, acceleration: float) -> None:
        time, before, way, _ = self._at
        speed = before if leg.speed_mps is None else leg.speed_mps
        if speed == 0.0:
            raise InputError(f"{name}: the vehicle is at rest; give speed_mps, or use a stop.")
        self._change_speed(speed, acceleration)
        if leg.duration_s is not None:
            left = leg.duration_s - (self._at[0] - time)
            ended, of = f"duration_s = {leg.duration_s:g}", f"{self._at[0] - time:.4g} s"
        else:
            left = ((leg.distance_m or 0.0) - (self._at[2] - way)) / speed
            ended, of = f"distance_m = {leg.distance_m:g}", f"{self._at[2] - way:.4g} m"
        if left < 0.0:
            raise InputError(
                f"{name}: {ended} is too short for the change of speed from {before:g} to {speed:g} m/s, which takes "
                f"{of}; give a larger value, or a larger acceleration_mps2."
            )
        if left > 0.0:
            self._add(left)

    def _turn(self, leg: Turn, name: str, lateral: float) -> None:
        speed = self._at[1]
        if speed == 0.0:
            raise InputError(f"{name}: the vehicle is at rest; a turn needs a straight leg with a speed before it.")
        angle = np.radians(leg.angle_deg)
        rate = lateral / speed if leg.rate_deg_s is None else np.radians(leg.rate_deg_s)
        steady = abs(angle) / rate
        ramp = max(_LEAST_RAMP_S, _RAMP * steady)
        steady -= ramp
        if steady < 0.0:  # a small turn: it only begins and ends
            steady, rate = 0.0, abs(angle) / ramp
        rate = np.copysign(rate, angle)
        self._add(ramp, rate_change=rate)
        if steady > 0.0:
            self._add(steady, rate=rate)
        self._add(ramp, rate=rate, rate_change=-rate)

    def at(self, time: Array) -> Course:
        """Return the motion at instants, (K,) s; before 0 and after the end, the vehicle moves on at its speed."""
        rows = np.array(self._rows).T
        p = Pieces(*rows[:, np.clip(np.searchsorted(rows[0], time, side="right") - 1, 0, rows.shape[1] - 1)])
        into = time - p.start
        x = np.clip(into / p.lasting, 0.0, 1.0)
        s, integral, slope = s_curve(x)
        integral *= p.lasting
        beyond = np.maximum(into - p.lasting, 0.0)
        return Course(
            speed=p.speed + p.change * s,
            acceleration=p.change * slope / p.lasting,
            heading=p.heading + p.rate * into + p.rate_change * (integral + beyond),
            rate=p.rate + p.rate_change * s,
            way=p.way + p.speed * into + p.change * (integral + beyond),
        )


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
    def is_drawn(self) -> bool:
        return True

    @property
    def profile(self) -> Profile:
        """Speed and heading along the legs."""
        heading = np.radians(self.heading_deg)
        return Profile(self.table, self.legs, heading, self.acceleration_mps2, self.lateral_mps2)

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        return self.profile.duration

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        return self.profile.turning

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        """Return the motion of the body, and the height of what carries it, m, (K,), on a course whose way north and
        east since the start is given, m, (K,)."""
        raise NotImplementedError

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Curve:
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


def respond(u: Array, interval: float, frequency_hz: float, damping: float, *, on_carrier: bool) -> Array:
    """Return the motion z of the body, (K,), which begins at rest on a carrier at rest, from that of the carrier, u.

    The carrier moves on straight lines between its samples, for which the solution is exact (first-order hold).
    """
    from scipy.signal import cont2discrete, lfilter

    w = 2.0 * np.pi * frequency_hz
    numerator = [2.0 * damping * w, w * w] if on_carrier else [w * w]
    top, bottom, _ = cont2discrete((numerator, [1.0, 2.0 * damping * w, w * w]), interval, method="foh")  # type: ignore[call-overload]
    return np.asarray(lfilter(np.ravel(top), bottom, u - u[0]) + u[0])


_SuspensionDamping = Annotated[float, Field(gt=0.0, lt=1.0)]

ROADS = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
"""Classes of roads by ISO 8608: geometric mean of the spectral density of the height at 0.1 cycles/m, m³."""

_FASTEST = 0.35
"""Largest frequency with which the road moves the wheels, in units of the knots' rate."""


class Drive(SurfaceVehicle):
    """A land vehicle: legs on a level road, the roughness of the road, and the suspension of the body. The road has the
    spectral density of ISO 8608, G(n) = G(0.1)·(n/0.1)⁻² for wave numbers n of 0.011 to 2.83 cycles/m. The left and the
    right wheels follow the same profile, so the roughness causes heave and pitch. The body rolls in turns.
    """

    table: ClassVar[str] = "drive"
    knot_rate: ClassVar[float] = 100.0
    height_channel: ClassVar[str] = "road_height_m"

    road: Literal["smooth", "A", "B", "C", "D", "E"] = Field(
        default="B", description="road class of ISO 8608, or smooth"
    )
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.0, description="mean acceleration and braking"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.5, description="lateral acceleration in turns for which no rate is given"
    )
    wheelbase_m: Annotated[float, Field(ge=0.5, le=30.0)] = Field(default=2.7, description="distance between the axles")
    suspension_hz: Annotated[float, Field(ge=0.3, le=10.0)] = Field(
        default=1.3, description="natural frequency of the body on its suspension, heave and pitch"
    )
    suspension_damping: _SuspensionDamping = Field(default=0.3, description="damping ratio of the suspension")
    roll_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.5, description="outward roll in turns per lateral acceleration"
    )
    pitch_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.3, description="pitch per acceleration, nose up positive"
    )

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        step = float(time[1] - time[0])
        f, damping = self.suspension_hz, self.suspension_damping
        lateral = course.speed * course.rate
        roll = respond(-self.roll_deg_per_mps2 * DEG * lateral, step, f, damping, on_carrier=False)
        pitch = respond(self.pitch_deg_per_mps2 * DEG * course.acceleration, step, f, damping, on_carrier=False)
        none = np.zeros(len(course.way))
        if self.road == "smooth":
            return Body(none, none, none, roll, pitch), none
        from scipy.interpolate import CubicSpline

        from sinssim.truth.motions import road_and_sea_spectra as road  # needs the compiler

        highest = min(road.HIGHEST, _FASTEST / step / max(float(course.speed.max()), 1e-9))
        length = float(course.way.max()) + 2.0 * self.wheelbase_m
        heights = road.heights(length, ROADS[self.road], highest, seed)
        surface = CubicSpline(road.STEP * np.arange(len(heights)), heights)
        rear = surface(course.way)
        front = surface(course.way + self.wheelbase_m)
        up = respond(0.5 * (front + rear), step, f, damping, on_carrier=True)
        pitch += respond((front - rear) / self.wheelbase_m, step, f, damping, on_carrier=True)
        return Body(none, none, up, roll, pitch), 0.5 * (front + rear)


_Period = Annotated[float, Field(ge=0.2, le=60.0)]
_HullDamping = Annotated[float, Field(gt=0.0, lt=1.0)]

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
    roll_damping: _HullDamping = Field(default=0.1, description="damping ratio of roll")
    pitch_period_s: _Period = Field(default=6.0, description="natural period of pitch")
    pitch_damping: _HullDamping = Field(default=0.4, description="damping ratio of pitch")
    heave_period_s: _Period = Field(default=6.0, description="natural period of heave, surge and sway")
    heave_damping: _HullDamping = Field(default=0.4, description="damping ratio of heave, surge and sway")

    @property
    def height_m(self) -> float:
        """The significant height of the waves, m."""
        return SEA_STATES[self.sea_state] if self.significant_height_m is None else self.significant_height_m

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        step = float(time[1] - time[0])
        heel = -self.heel_deg_per_mps2 * DEG * course.speed * course.rate
        towards = np.radians(self.waves_towards_deg)
        height, along, slope = (np.zeros(len(time)) for _ in range(3))
        if self.height_m > 0.0:
            from sinssim.truth.motions import road_and_sea_spectra as sea  # needs the compiler

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
