"""Rotation of the sensor block in its vehicle: the [imu.rotation] table, its sequences, angles, rates and motion.

The block turns on an outer axis that is fixed in the vehicle (more exactly, in the axes of `mounting_deg`), and
optionally on an inner axis that the outer one carries. Angles are read by an encoder on each axis.

Ready sequences of half and quarter turns with stops (Levinson and Majure, Navigation 34, 1987; Yuan, Liao and Han,
Meas. Sci. Technol. 23, 2012, 025102, describe eight and sixteen positions on two axes and what they have to cancel).
The order here is the package's own and follows from their conditions:

- "4-position": quarter turns on one axis, four forwards and four back. Biases across the axis cancel over the stops,
  and the scale factor's drift of the turns forwards by that of the turns back.
- "8-position": half turns on two axes. The four orientations of the block have equal times, so that all three biases
  cancel over the stops. Every half turn has one of the opposite sign in each position of the other axis, so that scale
  factor and misalignment of the gyros cancel over the turns. The time spent in turns remains: every half turn passes
  the same side.
- "16-position": the eight and then the same with all signs reversed, so that the turns pass both sides and biases
  cancel over the turns as well.

The outer axis a is fixed in the vehicle and wobbles, the inner axis e is fixed in the block. With the angles α and β

    (1) q_vb = q(ν) ∘ q(α a) ∘ q(β e)
    (2) ν = ε [u cos(nα + χ) + w sin(nα + χ)],   u, w, a orthogonal: the wobble, n cycles a turn
    (3) ω_vb^b = C(β e)ᵀ [C(α a)ᵀ ω_ν + α̇ a] + β̇ e,   ω_ν = (sin ε / ε) ν̇ − (1 − cos ε)/ε² ν × ν̇

as |ν| = ε is constant, so that ν̇ is perpendicular to ν (Shuster, A Survey of Attitude Representations, J. Astronaut.
Sci. 41, 1993, eq. 4.97 for the rate of a rotation vector).

The rate changes between two values by 3x² − 2x³ of the fraction x of the time it takes, with continuous angular
acceleration.

The sensors measure the motion of the block. With D = C_bv it feels ω' = D ω + ω_vb^b and f' = D f at its reference
point, which is where its axes cross. Over a sample, with D₀ in its middle, the increments are

    (4) ∫ω' dt = D₀ ∫ω dt + ∫(D − D₀) ω dt + ∫ω_vb^b dt,   ∫f' dt = D₀ ∫f dt + ∫(D − D₀) f dt

The vehicle's own increments keep their accuracy, and the quadrature (Gauss-Legendre) sees only the product with the
small turn within half a sample.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim import rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.toml_section import Axis, Duration, Keys, NotNegative, Positive, Section, Turn, Vector3
from sinssim.truth.sampling import integrate_samples
from sinssim.truth.trajectory import DerivedMotion, Trajectory
from sinssim.units import ARCSEC, DEG

PART = 2048
"""Instants that are computed at a time, so that what is between stays in the processor's cache."""


Piece = tuple[str, float, float, float]
"""Axis, duration s, rate at the begin and at the end rad/s."""


@dataclass(frozen=True)
class Profile:
    """The angle of one axis over time: pieces in which the rate goes smoothly from one value to another."""

    begin: Array  # begin of each piece, increasing, (K,) s
    lasts: Array  # duration of each piece, (K,) s
    angle: Array  # at the begin of each piece, (K,) rad
    rate: Array  # at the begin of each piece, (K,) rad/s
    gain: Array  # change of the rate within each piece, (K,) rad/s

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return angle, (N,) rad, and rate, (N,) rad/s, at instants, (N,) s."""
        k = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, len(self.begin) - 1)
        since, lasts = t - self.begin[k], self.lasts[k]
        x = since / lasts
        rate = self.rate[k] + self.gain[k] * x * x * (3.0 - 2.0 * x)
        angle = self.angle[k] + self.rate[k] * since + self.gain[k] * lasts * x * x * x * (1.0 - 0.5 * x)
        return angle, rate

    @classmethod
    def constant(cls, rate: float, start: float, end: float) -> Self:
        """Return the profile of a constant rate, with the angle 0 at the start."""
        ones = np.ones(1)
        return cls(start * ones, (end - start) * ones, 0.0 * ones, rate * ones, 0.0 * ones)

    @classmethod
    def repeated(cls, cycle: Sequence[Piece], axis: str, start: float, end: float) -> Self:
        """Return the profile of one axis along a cycle that is repeated to the end."""
        lasts = np.array([piece[1] for piece in cycle])
        count = int(np.ceil((end - start) / lasts.sum())) + 1
        turning = np.array([piece[0] == axis for piece in cycle])
        before, after = (np.where(turning, [piece[k] for piece in cycle], 0.0) for k in (2, 3))
        turns = 0.5 * (before + after) * lasts
        number = np.arange(count)[:, None]
        begin = start + number * lasts.sum() + (np.cumsum(lasts) - lasts)
        angle = number * turns.sum() + (np.cumsum(turns) - turns)
        whole = [np.broadcast_to(row, begin.shape).ravel() for row in (lasts, angle, before, after - before)]
        return cls(begin.ravel(), whole[0], whole[1], whole[2], whole[3])


@dataclass(frozen=True)
class Turning:
    """The rotation of a block in its vehicle."""

    outer: Array  # unit vector of the outer axis in the vehicle, (3,)
    inner: Array  # unit vector of the inner axis in the block, (3,)
    # angles of the two axes
    outer_profile: Profile
    inner_profile: Profile
    wobble: float  # ε, rad
    cycles: int  # n
    phase: float  # χ, rad
    breaks: Array  # instants at which a derivative of the rates jumps, (K,) s
    fastest: float  # angular frequency beyond which the attitude has no significant content, rad/s

    @property
    def two_axes(self) -> bool:
        """Whether the inner axis turns at all; otherwise the unit has only the outer one."""
        return bool(np.any(self.inner_profile.rate) or np.any(self.inner_profile.gain))

    def angles(self, t: Array) -> Array:
        """Return the angles α and β, (N, 2) rad, at instants (N,) s."""
        angles = np.empty((len(t), 2))
        for first in range(0, len(t), PART):
            part = slice(first, first + PART)
            angles[part, 0], angles[part, 1] = self.outer_profile.at(t[part])[0], self.inner_profile.at(t[part])[0]
        return angles

    def without_wobble(self, angles: Array) -> Array:
        """Return the attitude that angles α and β, (N, 2) rad, mean, as a navigator takes it from its encoders: q_vb,
        (N, 4)."""
        outer = rotation.quaternion_from_rotation_vector(angles[:, :1] * self.outer)
        return rotation.multiply(outer, rotation.quaternion_from_rotation_vector(angles[:, 1:] * self.inner))

    def _wobble(self, alpha: Array) -> tuple[Array, Array]:
        """Return ν and dν/dα, (N, 3) each."""
        u = np.cross(self.outer, np.eye(3)[np.argmin(np.abs(self.outer))])
        u /= np.linalg.norm(u)
        w, at = np.cross(self.outer, u), (self.cycles * alpha + self.phase)[:, None]
        nu = self.wobble * (u * np.cos(at) + w * np.sin(at))  # (2)
        return nu, self.wobble * self.cycles * (w * np.cos(at) - u * np.sin(at))

    def attitude(self, t: Array) -> Array:
        """Return the true attitude of the block at instants: q_vb, v_v = C_vb v_b, (N, 4)."""
        angles = self.angles(t)
        q_vb = self.without_wobble(angles)
        if not self.wobble:
            return q_vb
        nu = self._wobble(angles[:, 0])[0]
        return rotation.multiply(rotation.quaternion_from_rotation_vector(nu), q_vb)  # (1)

    def rate(self, t: Array) -> Array:
        """Return the rate of the block relative to the vehicle at instants: ω_vb in the block's axes, (N, 3) rad/s."""
        alpha, alpha_rate = self.outer_profile.at(t)
        beta, beta_rate = self.inner_profile.at(t)
        omega = alpha_rate[:, None] * self.outer
        if self.wobble:
            nu, slope = self._wobble(alpha)
            change, e = slope * alpha_rate[:, None], self.wobble
            tilting = np.sinc(e / np.pi) * change - 0.5 * np.sinc(0.5 * e / np.pi) ** 2 * np.cross(nu, change)
            outer = rotation.quaternion_from_rotation_vector(alpha[:, None] * self.outer)
            omega = omega + rotation.rotate(rotation.conjugate(outer), tilting)
        inner = rotation.quaternion_from_rotation_vector(-beta[:, None] * self.inner)
        return np.asarray(rotation.rotate(inner, omega) + beta_rate[:, None] * self.inner)  # (3)


Half = tuple[str, float]
_OUT, _IN = "outer", "inner"
_EIGHT: tuple[Half, ...] = (
    (_IN, 180.0), (_OUT, 180.0), (_IN, -180.0), (_OUT, -180.0),
    (_OUT, 180.0), (_IN, 180.0), (_OUT, -180.0), (_IN, -180.0),
)  # fmt: skip
SEQUENCES: dict[str, tuple[Half, ...]] = {
    "4-position": ((_OUT, 90.0),) * 4 + ((_OUT, -90.0),) * 4,
    "8-position": _EIGHT,
    "16-position": _EIGHT + tuple((axis, -turn) for axis, turn in _EIGHT),
}
"""Turns of the ready sequences: axis, and angle in degrees."""

MOST_PER_SAMPLE = 2.0
"""Most degrees that the block may turn in one sample: the fits of the engine over five samples then see ten degrees,
and their error, which grows with the fifth power of the angle, is below that of any sensor."""
FEWEST_IN_RAMP = 5
"""Samples that a change of the turning rate must last: those of a fit."""

_Tilt = Annotated[float, Field(ge=0.0, le=3600.0)]
_Cycles = Annotated[int, Field(ge=1, le=100_000)]
_SlowRate = Annotated[float, Field(gt=0.0, le=3600.0)]
_EitherRate = Annotated[float, Field(ge=-3600.0, le=3600.0)]


class Step(Section):
    """One turn of an explicit sequence."""

    axis: Literal["outer", "inner"] = Field(default="outer", description="which axis turns")
    turn_deg: float = Field(description="angle of the turn, positive by the right-hand rule about the axis")

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if not 0.0 < abs(self.turn_deg) <= 36_000.0:
            raise ValueError(
                f"turn_deg = {self.turn_deg:g} must be a turn of at most 36000 degrees in either direction; dwell_s "
                "gives the time between turns"
            )
        return self


class _OnAxes(Section):
    """Axes, bearings and encoders of a rotating IMU."""

    inner_axis: Axis = Field(
        default=(0.0, 0.0, 1.0), description="direction of the inner axis in the IMU, forward, right, down"
    )
    wobble_arcsec: _Tilt = Field(default=0.0, description="amplitude of the wobble of the outer axis")
    wobble_cycles: _Cycles = Field(default=2, description="cycles of the wobble in one turn of the outer axis")
    wobble_phase_deg: float = Field(default=0.0, description="direction of the wobble at zero angle")
    encoder_bias_arcsec: tuple[float, float] | None = Field(
        default=None, description="given error of the outer and the inner encoder"
    )
    encoder_bias_sigma_arcsec: NotNegative = Field(
        default=0.0, description="1σ of a random error of each encoder, added to the given one"
    )
    encoder_noise_arcsec: NotNegative = Field(default=0.0, description="1σ of each measurement of an encoder")
    encoder_quantum_arcsec: NotNegative = Field(default=0.0, description="resolution of an encoder")
    encoder_periodic_arcsec: NotNegative = Field(
        default=0.0,
        description="amplitude of an error that is a sine of the angle, for example due to an eccentric disc",
    )
    encoder_cycles: _Cycles = Field(default=1, description="cycles of the periodic error in one turn")
    encoder_phase_deg: float = Field(default=0.0, description="phase of the periodic error at zero angle")

    @property
    def outer(self) -> Vector3:
        """Direction of the outer axis."""
        raise NotImplementedError

    @property
    def fastest_deg_s(self) -> float:
        """Highest rate of either axis, deg/s."""
        raise NotImplementedError

    @property
    def _total_deg_s(self) -> float:
        """Highest rate of the block in the vehicle, deg/s."""
        return self.fastest_deg_s

    @property
    def mean_square_rate_deg2_s2(self) -> float:
        """Mean square of the turning rate over the run, for estimates."""
        raise NotImplementedError

    def _profiles(self, start: float, end: float) -> tuple[Profile, Profile, Array]:
        """Return the angles of the outer and the inner axis, and the instants at which their accelerations jump."""
        raise NotImplementedError

    def turning(self, start: float, end: float) -> Turning:
        """Return the rotation of the block during a run; both angles are 0 at its start."""
        outer_profile, inner_profile, breaks = self._profiles(start, end)
        outer, inner = (np.array(axis, dtype=np.float64) for axis in (self.outer, self.inner_axis))
        return Turning(
            outer / np.linalg.norm(outer),
            inner / np.linalg.norm(inner),
            outer_profile,
            inner_profile,
            self.wobble_arcsec * ARCSEC,
            self.wobble_cycles,
            self.wobble_phase_deg * DEG,
            breaks,
            self._total_deg_s * DEG * (1.0 + (self.wobble_cycles if self.wobble_arcsec else 0)),
        )

    def check_rate(self, rate_hz: float) -> None:
        """Raise ValueError if the samples cannot follow the turning."""
        if self.fastest_deg_s > MOST_PER_SAMPLE * rate_hz * (1.0 + 1e-9):
            key = "rate_deg_s"
            if getattr(self, "rate_deg_s", 0.0) < self.fastest_deg_s:
                key = "inner_rate_deg_s"
            raise ValueError(
                f"rotation.{key} = {getattr(self, key):g} rotates the IMU by {self.fastest_deg_s / rate_hz:g} degrees "
                f"per sample, more than the algorithms can follow; at rate_hz = {rate_hz:g} it can be at most "
                f"{MOST_PER_SAMPLE * rate_hz:g}"
            )
        ramp = getattr(self, "ramp_s", math.inf)
        if ramp * rate_hz < FEWEST_IN_RAMP * (1.0 - 1e-9):
            raise ValueError(
                f"rotation.ramp_s = {ramp:g} is shorter than {FEWEST_IN_RAMP} samples, which the samples cannot "
                f"follow; at rate_hz = {rate_hz:g} it must be at least {FEWEST_IN_RAMP / rate_hz:g}"
            )


class Continuous(_OnAxes):
    """The IMU rotates at constant rates during the entire run."""

    type: Literal["continuous"] = Field(description="constant rate")
    axis: Axis = Field(default=(0.0, 0.0, 1.0), description="direction of the outer axis, forward, right, down")
    rate_deg_s: _EitherRate = Field(default=6.0, description="rate about the outer axis; not 0")
    inner_rate_deg_s: _EitherRate = Field(default=0.0, description="rate about the inner axis; 0 for one axis")

    @property
    def outer(self) -> Vector3:
        return self.axis

    @property
    def fastest_deg_s(self) -> float:
        return max(abs(self.rate_deg_s), abs(self.inner_rate_deg_s))

    @property
    def mean_square_rate_deg2_s2(self) -> float:
        return self.rate_deg_s**2 + self.inner_rate_deg_s**2

    @property
    def _total_deg_s(self) -> float:
        return abs(self.rate_deg_s) + abs(self.inner_rate_deg_s)

    def _profiles(self, start: float, end: float) -> tuple[Profile, Profile, Array]:
        outer, inner = (Profile.constant(rate * DEG, start, end) for rate in (self.rate_deg_s, self.inner_rate_deg_s))
        return outer, inner, np.zeros(0)

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if self.rate_deg_s == 0.0:
            raise ValueError("rate_deg_s = 0 does not rotate the IMU: give another rate, or remove [imu.rotation]")
        return self


class _InTurns(_OnAxes):
    """A rotation in turns with ramps and stops, in cycles that are repeated until the end of the run."""

    if TYPE_CHECKING:  # each kind has these keys, with its own defaults and descriptions
        rate_deg_s: _SlowRate
        ramp_s: Positive
        dwell_s: float

    @property
    def turns(self) -> tuple[Half, ...]:
        """Turns of one cycle."""
        raise NotImplementedError

    @property
    def fastest_deg_s(self) -> float:
        return self.rate_deg_s

    @property
    def mean_square_rate_deg2_s2(self) -> float:
        """Mean square of the turning rate, the ramps taken for turns at the full rate."""
        angle = sum(abs(turn) for _, turn in self.turns)
        return angle * self.rate_deg_s / (angle / self.rate_deg_s + len(self.turns) * (self.ramp_s + self.dwell_s))

    def _cycle(self) -> list[Piece]:
        """Return the pieces of one cycle: each turn has a ramp, a cruise, a ramp, and a stop."""
        pieces: list[Piece] = []
        for axis, turn in self.turns:
            rate, ramp = float(np.copysign(self.rate_deg_s, turn)) * DEG, self.ramp_s
            cruise = abs(turn) / self.rate_deg_s - ramp  # the two ramps take half a ramp's angle each
            pieces.append((axis, ramp, 0.0, rate))
            if cruise > 1e-9:
                pieces.append((axis, cruise, rate, rate))
            pieces.append((axis, ramp, rate, 0.0))
            if self.dwell_s:
                pieces.append((axis, self.dwell_s, 0.0, 0.0))
        return pieces

    def _profiles(self, start: float, end: float) -> tuple[Profile, Profile, Array]:
        outer, inner = (Profile.repeated(self._cycle(), axis, start, end) for axis in (_OUT, _IN))
        return outer, inner, outer.begin[(outer.begin > start) & (outer.begin < end)]

    def _check_ramps(self, turn: float, key: str) -> None:
        rate, ramp = self.rate_deg_s, self.ramp_s
        if rate * ramp > turn * (1.0 + 1e-9):
            raise ValueError(
                f"ramp_s = {ramp:g}: {key} = {turn:g} is over before the rate of {rate:g} deg/s is reached; use a ramp "
                f"of at most {turn / rate:g} s or a lower rate_deg_s"
            )


class Reversing(_InTurns):
    """The IMU rotates forwards and backwards by the same angle, which cancels the effect of the scale-factor error."""

    type: Literal["reversing"] = Field(description="forwards and back")
    axis: Axis = Field(default=(0.0, 0.0, 1.0), description="direction of the outer axis, forward, right, down")
    rate_deg_s: _SlowRate = Field(default=6.0, description="rate about the outer axis between the ramps")
    turn_deg: Turn = Field(default=360.0, description="angle of each turn; complete turns average best")
    ramp_s: Positive = Field(default=1.0, description="time in which the rate changes from 0 to rate_deg_s, and back")
    dwell_s: Annotated[float, Field(ge=0.0, le=1e9)] = Field(default=0.0, description="time at rest after each turn")

    @property
    def outer(self) -> Vector3:
        return self.axis

    @property
    def turns(self) -> tuple[Half, ...]:
        return (_OUT, self.turn_deg), (_OUT, -self.turn_deg)

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        self._check_ramps(self.turn_deg, "turn_deg")
        return self


class Indexed(_InTurns):
    """The IMU rotates from position to position and stops in each."""

    at_most_one = (Keys(("sequence", "steps"), "the turns"),)

    type: Literal["indexed"] = Field(description="turns with stops")
    sequence: Literal["4-position", "8-position", "16-position"] | None = Field(
        default=None, description='predefined sequence; default: "16-position", if no steps are given'
    )
    steps: tuple[Step, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="turns of your own sequence, instead of a predefined one; it is repeated until the end of the run",
    )
    axis: Axis | None = Field(
        default=None,
        description="direction of the outer axis; default: down for one axis, forward if the inner axis also turns",
    )
    rate_deg_s: _SlowRate = Field(default=20.0, description="rate of the turns between the ramps")
    ramp_s: Positive = Field(default=1.0, description="time in which the rate changes from 0 to rate_deg_s, and back")
    dwell_s: Duration = Field(default=60.0, description="time at rest in each position")

    @property
    def turns(self) -> tuple[Half, ...]:
        if self.steps is not None:
            return tuple((step.axis, step.turn_deg) for step in self.steps)
        return SEQUENCES[self.sequence or "16-position"]

    @property
    def outer(self) -> Vector3:
        if self.axis is not None:
            return self.axis
        return (1.0, 0.0, 0.0) if any(axis == _IN for axis, _ in self.turns) else (0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _one_sequence(self) -> Self:
        for number, (_, turn) in enumerate(self.turns, start=1):
            self._check_ramps(abs(turn), f"steps.{number}.turn_deg")
        return self


Rotation = Annotated[Continuous | Reversing | Indexed, Field(discriminator="type")]


_SLOW, _FEW = 0.2, 4
"""Phase of the fastest oscillation in a sample, rad, up to which four Gauss-Legendre points have an error of 3e-16 of
its amplitude (Abramowitz and Stegun 25.4.30), and their number."""


class TurningBlock(DerivedMotion):
    """A block that turns in its vehicle; `base` is the motion of the vehicle at the place of the block, in the axes of
    the block's mounting."""

    def __init__(self, base: Trajectory, turns: Turning) -> None:
        super().__init__(base)
        self.turns = turns
        self.breaks = np.union1d(self.breaks, turns.breaks)
        self.fastest = turns.fastest + self.fastest

    def _state(self, time: Array) -> NavState:
        s = self.base.state(time)
        return replace(s, q_nb=rotation.multiply(s.q_nb, self.turns.attitude(time)))

    def _rates(self, time: Array) -> tuple[Array, Array]:
        omega, force = self.base.rates(time)
        q_bv = rotation.conjugate(self.turns.attitude(time))
        return rotation.rotate(q_bv, omega) + self.turns.rate(time), rotation.rotate(q_bv, force)

    def increments(self, rate_hz: float) -> ImuData:
        """Return the increments of the rotating IMU's sensors (4); see `Trajectory.increments`."""
        base = self.base.increments(rate_hz)
        edges = base.time
        middle = 0.5 * (edges[1:] + edges[:-1])
        q_bv = rotation.conjugate(self.turns.attitude(middle))

        def turned(t: Array) -> Array:
            omega, force = self.base.rates(t)
            now = rotation.conjugate(self.turns.attitude(t))
            sample = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(middle) - 1)
            # (D − D₀) v without the cancellation: D = E D₀, (E − 1) v = 2 u × (u × v + s₀ v) for E = (s₀, u)
            turn = rotation.multiply(now, rotation.conjugate(q_bv[sample]))
            u, s0 = turn[:, 1:], turn[:, :1]
            rotated = rotation.rotate(q_bv[sample], omega), rotation.rotate(q_bv[sample], force)
            parts = [2.0 * np.cross(u, np.cross(u, v) + s0 * v) for v in rotated]
            parts[0] += self.turns.rate(t)
            return np.concatenate(parts, axis=1)

        points = _FEW if self.fastest <= _SLOW * rate_hz else None
        change = integrate_samples(turned, edges, self.fastest, self.breaks, points=points)
        return ImuData(
            edges,
            rotation.rotate(q_bv, base.dtheta) + change[:, :3],
            rotation.rotate(q_bv, base.dvel) + change[:, 3:],
        )
