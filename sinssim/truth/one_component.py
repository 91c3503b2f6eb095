"""The [one_component] table, the chapter's system in a vertical plane, and its true motion with ideal readings.

V(t), H(t) and the pitch ϑ(t) of the body are curves through the rows of [one_component.motion]. They give the pitch of
the accelerometers α = ϑ + α_a0 and, as in the chapter's equations,

    ẏ = V/R,    ω = ϑ̇ − ẏ,    a_ξ = V̇,    a_η = g + Ḧ − V²/R,
    a_x = a_ξ cos α + a_η sin α,    a_y = a_η cos α − a_ξ sin α

With `altitude_effects` the motion is that of a point at the distance r = R + H from the centre of the Earth:

    ẏ = V/r,    a_ξ = V̇ + V Ḣ/r,    a_η = g (R/r)² + Ḧ − V²/r
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sinssim.data import Array
from sinssim.earth.ellipsoids import MEAN_GRAVITY, MEAN_RADIUS
from sinssim.errors import InputError
from sinssim.toml_section import Duration, NotNegative, Rate, Section, Source
from sinssim.truth.sampling import sample_edges
from sinssim.units import DEG

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Row = tuple[float, float]

_SHORTEST = 1e-3  # s between two rows; nearer ones make derivatives that no vehicle has

_PER_PERIOD = 100.0  # intervals in a Schuler period, at least

SENSOR_OF = {"measured": "attitude_sensor", "one-integral": "gyro", "two-integrals": "arm_accelerometer"}
"""The table of the sensor that each variant takes its pitch from."""

WAYS = {
    "measured": "pitch measured directly by an attitude sensor",
    "one-integral": "pitch by one integral of a gyro's rate",
    "two-integrals": "pitch by two integrals of the angular acceleration from accelerometers on an arm",
}
"""What each variant does."""


def _rows(value: Any) -> Any:
    """Take a number as the only row of a table."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return ((0.0, value),)
    if not isinstance(value, tuple):
        raise ValueError("give a number, or rows of time in s and value, like [[0.0, 100.0], [60.0, 150.0]]")
    for number, row in enumerate(value, start=1):
        if not isinstance(row, tuple) or len(row) != 2:
            raise ValueError(f"row {number} must be time in s and value, like [60.0, 150.0]")
    return value


def _in_order(rows: tuple[Row, ...]) -> tuple[Row, ...]:
    if rows[0][0] != 0.0:
        raise ValueError(f"the first row is at {rows[0][0]:g} s; it must be at 0 s, the start")
    for number, ((before, _), (after, _)) in enumerate(pairwise(rows), start=2):
        if not after - before >= _SHORTEST:
            raise ValueError(
                f"row {number} at {after:.12g} s must be at least {_SHORTEST:g} s after row {number - 1} at "
                f"{before:.12g} s"
            )
    return rows


def _within(most: float) -> AfterValidator:
    """Return the check of rows with a limit of magnitude."""

    def check(rows: tuple[Row, ...]) -> tuple[Row, ...]:
        for number, (_, value) in enumerate(rows, start=1):
            if abs(value) > most:
                raise ValueError(f"the value {value:g} of row {number} must be from {-most:g} to {most:g}")
        return _in_order(rows)

    return AfterValidator(check)


_Count = Field(min_length=1, max_length=100_000)
_SpeedRows = Annotated[tuple[Row, ...], _Count, BeforeValidator(_rows), _within(12_000.0)]
_HeightRows = Annotated[tuple[Row, ...], _Count, BeforeValidator(_rows), _within(1e6)]
_AngleRows = Annotated[tuple[Row, ...], _Count, BeforeValidator(_rows), _within(36_000.0)]

_Error = Annotated[float, Field(ge=-1e6, le=1e6)]
_Scale = Annotated[float, Field(ge=-1e5, le=1e5)]


class PlaneCourse(Section):
    """The motion in the vertical plane. Each quantity is a constant, or rows of time in s and value."""

    velocity_mps: _SpeedRows = Field(
        default=((0.0, 0.0),), description="V along the great circle: a constant, or rows of time and value"
    )
    height_m: _HeightRows = Field(default=((0.0, 0.0),), description="H, in the same form")
    pitch_deg: _AngleRows = Field(
        default=((0.0, 0.0),), description="pitch ϑ of the body, nose up positive, in the same form"
    )
    interpolation: Literal["monotone", "spline"] = Field(
        default="monotone",
        description="monotone: cubic interpolation without overshoot, with continuous velocity, height rate and pitch "
        "rate; spline: natural cubic spline, whose second derivatives are also continuous, but which may overshoot",
    )


class PlaneAccelerometer(Section):
    """Errors of an accelerometer."""

    bias_ug: _Error = Field(default=0.0, description="constant error")
    scale_ppm: _Scale = Field(default=0.0, description="error of the scale factor")
    random_walk_ug_sqrt_hz: NotNegative = Field(default=0.0, le=1e6, description="white noise of the specific force")


class ArmAccelerometer(PlaneAccelerometer):
    """The accelerometer on an arm of the variant "two-integrals". It is parallel to y, and the difference of the two
    outputs is ω̇ times the arm."""

    arm_m: Annotated[float, Field(ge=-1000.0, le=1000.0)] = Field(
        description="distance ahead of accelerometer y; negative: behind it"
    )

    @model_validator(mode="after")
    def _has_an_arm(self) -> Self:
        if abs(self.arm_m) < 1e-4:
            raise ValueError(
                f"arm_m = {self.arm_m:g} gives no angular acceleration; give a distance of at least 0.0001 m"
            )
        return self


class PlaneGyro(Section):
    """Errors of the gyro of the variant "one-integral": nose-up positive, opposite to Δω₀ of the chapter."""

    bias_deg_h: _Error = Field(default=0.0, description="constant error")
    scale_ppm: _Scale = Field(default=0.0, description="error of the scale factor")
    random_walk_deg_sqrt_h: NotNegative = Field(default=0.0, le=1e6, description="white noise of the rate")


class PlaneAttitudeSensor(Section):
    """Errors of the attitude sensor of the variant "measured", which measures the pitch in inertial space: nose-up
    positive."""

    bias_arcsec: _Error = Field(default=0.0, description="constant error")
    drift_deg_h: _Error = Field(default=0.0, description="drift of this error")
    noise_arcsec: NotNegative = Field(default=0.0, le=1e6, description="1σ of each measurement")


class PlaneInitialError(Section):
    """Errors of the initial values, computed minus true."""

    position_m: _Error = Field(default=0.0, description="along the great circle, R Δy")
    velocity_mps: Annotated[float, Field(ge=-1e4, le=1e4)] = Field(default=0.0, description="ΔV")
    pitch_arcmin: Annotated[float, Field(ge=-10_800.0, le=10_800.0)] = Field(
        default=0.0, description='Δα; no key of "measured"'
    )
    rate_deg_h: _Error = Field(default=0.0, description='Δω; a key of "two-integrals" only')


class OneComponent(Source):
    """The one-component system of chapter 8 (section 8.1): two accelerometers and a sensor that determines the
    pitch."""

    table: ClassVar[str] = "one_component"
    in_space: ClassVar[bool] = False
    rules = (
        (lambda s: getattr(s, SENSOR_OF[s.variant]) is None
         and (SENSOR_OF[s.variant], "with arm_m" if s.variant == "two-integrals" else "without keys it has no errors"),
         'variant = "{s.variant}" needs the table [one_component.{it[0]}]: add it, {it[1]}'),
        (lambda s: next((kind for kind in SENSOR_OF.items() if kind[0] != s.variant and getattr(s, kind[1])), None),
         '[one_component.{it[1]}] is the sensor of variant = "{it[0]}"; here variant = "{s.variant}": remove the '
         "table, or change the variant"),
        (lambda s: s.variant == "measured" and s.initial_error.pitch_arcmin,
         'initial_error.pitch_arcmin = {it:g} has no effect with variant = "measured", which measures the pitch: give '
         "attitude_sensor.bias_arcsec"),
        (lambda s: s.variant != "two-integrals" and s.initial_error.rate_deg_h,
         'initial_error.rate_deg_h = {it:g} has no effect with variant = "{s.variant}", which does not integrate the '
         'rate; it is a key of "two-integrals"'),
    )  # fmt: skip

    variant: Literal["measured", "one-integral", "two-integrals"] = Field(
        description="measured: by [one_component.attitude_sensor]; one-integral: by [one_component.gyro]; "
        "two-integrals: by [one_component.arm_accelerometer]"
    )
    duration_s: Duration = Field(description="duration")
    rate_hz: Rate = Field(default=20.0, description="measurements per second")
    radius_m: Annotated[float, Field(ge=1e3, le=1e9)] = Field(
        default=MEAN_RADIUS, description="radius R of the spherical Earth"
    )
    gravity_mps2: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(
        default=MEAN_GRAVITY, description="gravity g; the chapter's g₀ is 9.8"
    )
    altitude_effects: bool = Field(
        default=False,
        description="whether the true motion has the radius R + H, the acceleration V·dH/dt/(R + H) and a gravity "
        "that decreases with H; the equations of the chapter neglect these effects",
    )
    coordinate_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = Field(default=0.0, description="y at the start")
    mounting_angle_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = Field(
        default=0.0, description="α_a0 of the accelerometers in the body: ϑ = α_a − α_a0"
    )
    motion: PlaneCourse = Field(default=PlaneCourse())
    accelerometer_x: PlaneAccelerometer = Field(default=PlaneAccelerometer())
    accelerometer_y: PlaneAccelerometer = Field(default=PlaneAccelerometer())
    gyro: PlaneGyro | None = None
    attitude_sensor: PlaneAttitudeSensor | None = None
    arm_accelerometer: ArmAccelerometer | None = None
    initial_error: PlaneInitialError = Field(default=PlaneInitialError())

    @model_validator(mode="after")
    def _intervals_are_short(self) -> Self:
        period = 2.0 * math.pi * math.sqrt(self.radius_m / self.gravity_mps2)
        if self.rate_hz * period < _PER_PERIOD:
            raise ValueError(
                f"rate_hz = {self.rate_hz:g} gives intervals of {1.0 / self.rate_hz:g} s, too long for the Schuler "
                f"period of {period:.6g} s; give at least {_PER_PERIOD / period:.3g}"
            )
        return self

    @model_validator(mode="after")
    def _motion_lasts_as_long(self) -> Self:
        for key in ("velocity_mps", "height_m", "pitch_deg"):
            rows = getattr(self.motion, key)
            if len(rows) > 1 and rows[-1][0] < self.duration_s:
                raise ValueError(
                    f"motion.{key} ends at {rows[-1][0]:g} s, before the run, at duration_s = {self.duration_s:g}: add "
                    "a row at the end of the run or later"
                )
        return self


_BLOCK = 16384  # pieces integrated together, so that no temporary is as long as a run


@dataclass(frozen=True)
class PlaneState:
    """True motion in the vertical plane at N instants."""

    time: Array  # (N,) s
    velocity: Array  # V along the great circle, (N,) m/s
    height: Array  # H, (N,) m
    body_pitch: Array  # ϑ, (N,) rad
    pitch: Array  # α = ϑ + α_a0 of the accelerometer x, (N,) rad
    rate: Array  # ω in inertial space, (N,) rad/s
    horizontal: Array  # specific force a_ξ, (N,) m/s²
    vertical: Array  # specific force a_η, (N,) m/s²


@dataclass(frozen=True)
class PlaneIncrements:
    """Integrals of what ideal sensors read over N intervals."""

    time: Array  # edges of the intervals, (N+1,) s
    coordinate: Array  # y at the edges, (N+1,) rad
    dvel: Array  # of a_x and a_y, (N, 2) m/s
    dtheta: Array  # of ω, (N,) rad
    drate: Array  # of ω̇, (N,) rad/s


class PlaneMotion:
    """The motion of a [one_component] table."""

    def __init__(self, system: OneComponent) -> None:
        """Lay the curves through the rows."""
        motion, self.duration = system.motion, system.duration_s
        self._radius, self._gravity = system.radius_m, system.gravity_mps2
        self._at_height = system.altitude_effects
        self._mounting, self._start = system.mounting_angle_deg * DEG, system.coordinate_deg * DEG
        smooth = motion.interpolation == "spline"
        self._velocity = _curve(motion.velocity_mps, smooth)
        self._height = _curve(motion.height_m, smooth)
        self._body_pitch = _curve(motion.pitch_deg, smooth, DEG)
        knots = (curve.x for curve in (self._velocity, self._height, self._body_pitch))
        self._knots = np.unique(np.concatenate([k for k in knots if len(k) > 2] or [np.zeros(1)]))
        if self._at_height:
            _check_height(self._height, self.duration, self._radius)

    def state(self, time: Array) -> PlaneState:
        """Return the true motion at instants, (N,) s."""
        v, height, theta = self._velocity(time), self._height(time), self._body_pitch(time)
        turn, horizontal, vertical = self._felt(time, v, height)
        rate = self._body_pitch(time, 1) - turn
        return PlaneState(time, v, height, theta, theta + self._mounting, rate, horizontal, vertical)

    def _felt(self, time: Array, velocity: Array, height: Array) -> tuple[Array, Array, Array]:
        """Return ẏ, rad/s, and the specific force along the local horizon and up, m/s²."""
        along, up = self._velocity(time, 1), self._height(time, 2)
        if not self._at_height:
            return velocity / self._radius, along, self._gravity + up - velocity**2 / self._radius
        r = self._radius + height
        gravity = self._gravity * (self._radius / r) ** 2
        return velocity / r, along + velocity * self._height(time, 1) / r, gravity + up - velocity**2 / r

    def increments(self, rate_hz: float) -> PlaneIncrements:
        """Return the integrals of ideal readings by Gauss-Legendre quadrature, exact to rounding between rows."""
        time = sample_edges(0.0, self.duration, rate_hz)
        edges = np.unique(np.concatenate((time, self._knots[self._knots < time[-1]])))
        sums = np.concatenate(list(self._pieces(edges)))
        pieces = np.searchsorted(edges, time)  # the rows inside an interval cut it into pieces
        push = np.add.reduceat(sums[:, :2], pieces[:-1])
        coordinate = self._start + np.concatenate(([0.0], np.cumsum(sums[:, 2])))[pieces]
        truth = self.state(time)
        dtheta = np.diff(truth.body_pitch) - np.add.reduceat(sums[:, 2], pieces[:-1])
        return PlaneIncrements(time, coordinate, push, dtheta, np.diff(truth.rate))

    def _pieces(self, edges: Array) -> Iterator[Array]:
        """Yield the integrals of a_x, a_y and ẏ over smooth pieces, block by block, (B, 3)."""
        nodes, weights = np.polynomial.legendre.leggauss(6)
        for first in range(0, len(edges) - 1, _BLOCK):
            ends = edges[first : first + _BLOCK + 1]
            half = 0.5 * np.diff(ends)[:, None]
            time = (ends[:-1, None] + half * (1.0 + nodes)).ravel()
            state = self.state(time)
            c, s = np.cos(state.pitch), np.sin(state.pitch)
            turn = self._body_pitch(time, 1) - state.rate
            felt = (state.horizontal * c + state.vertical * s, state.vertical * c - state.horizontal * s, turn)
            yield np.stack([half[:, 0] * (f.reshape(len(half), -1) @ weights) for f in felt], axis=1)


def _curve(rows: tuple[Row, ...], smooth: bool, unit: float = 1.0) -> PPoly:
    """Return a piecewise polynomial through rows, constant for a single one."""
    from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

    time, values = np.array(rows, dtype=np.float64).T
    values = unit * values
    if len(time) == 1:
        return PPoly(values[None, :], np.array([0.0, 1.0]))
    if smooth:
        return CubicSpline(time, values, bc_type="natural")
    monotone = PchipInterpolator(time, values)
    return PPoly(monotone.c, monotone.x)


def _check_height(height: PPoly, duration: float, radius: float) -> None:
    """Raise for a height at which the motion would come near to the centre of the Earth."""
    time = np.linspace(0.0, duration, 10_001)
    lowest = float(height(time).min())
    if lowest < -0.5 * radius:
        raise InputError(
            f"one_component.motion.height_m reaches {lowest:g} m; with altitude_effects it must stay above half the "
            f"radius, {-0.5 * radius:g} m."
        )
