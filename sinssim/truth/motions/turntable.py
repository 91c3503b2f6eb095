"""Sequences on a rotation table: dwells and turns, and the calibration of a sensor block on a turntable, [turntable].

The rate of a turn rises to its value over a ramp and falls over another: linearly (profile "trapezoidal") or as half a
cosine wave ("smooth", with continuous angular acceleration). In both cases a ramp covers half the angle of the full
rate, so that a turn by an angle lasts angle/rate + ramp. During a turn the axis is fixed in block and table, and the
integral of the rate is the axis times the angle turned. Such sequences are used to calibrate sensor blocks (Titterton
and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 8).

In the calibration, the block's attitude in position p is C_nb = e^[τ×] A_p e^[ε_p×]. A_p is the nominal attitude: that
of the first position, turned by the nominal turns. τ is the tilt of the base, the same in all positions, in
north-east-down axes. ε_p is the error of the position, in the block's axes. The turn before position p is about the
axis e^[η_p×] n_p: n_p is the nominal axis in the block, and η_p its error, at right angles to it. After the turn, the
table settles from where the turn led into its position. Turn and settling are rotations about a fixed axis each, so
that attitude, rate and increments are closed forms.

A predefined sequence begins in its first position, with the start's roll and pitch, and has one further position after
each of its turns. Every turn is about an axis of the block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.toml_section import A_TURN, Axis, Duration, Heading, Height, Keys, Latitude, Longitude, Section, known_name
from sinssim.truth.motion import NORMAL_EARTH, Mounting, PlacedMotion, TrueEarth, attitude
from sinssim.truth.motions.analytic import ClosedFormMotion, OnEarth, TurnsOnly
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, DEG

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class PositionSequence:
    """A sequence of positions."""

    about: str  # one sentence
    source: str  # where it is published
    # axis in the block's axes, and angle, degrees, of the turn before each position but the first
    turns: tuple[tuple[tuple[float, float, float], float], ...]
    # attitude of the first position
    roll_deg: float = 0.0
    pitch_deg: float = 0.0


_SIX = ((_X, 90.0), (_X, 90.0), (_X, 90.0), (_Z, 90.0), (_Z, 180.0))
_FULL_TURNS = tuple((axis, angle) for axis in (_X, _Y, _Z) for angle in (360.0, -360.0))
_ROUND = {axis: ((axis, 90.0),) * 3 for axis in (_X, _Y, _Z)}
_THERE_AND_BACK = {axis: ((axis, 90.0),) * 3 + ((axis, -90.0),) * 3 for axis in (_X, _Y)}
_BACKWARDS = (0.0, 0.0, -1.0)

SEQUENCES: dict[str, PositionSequence] = {
    "six-positions": PositionSequence(
        "each axis of the IMU up and down",
        "Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, section 8.3; Syed et al., A "
        "new multi-position calibration method for MEMS inertial navigation systems, Meas. Sci. Technol. 18 (2007) "
        "1897-1907",
        _SIX,
    ),
    "six-positions-and-rates": PositionSequence(
        "each axis up and down, then a full turn forwards and one back about each axis",
        "the classical separate tests: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, "
        "sections 8.3 and 8.4",
        (*_SIX, *_FULL_TURNS),
    ),
    "24-positions": PositionSequence(
        "each of the six faces of a cube down in each of four headings: all orientations of a cube",
        "the rotation group of the cube, whose positions weigh all axes alike; the order of the positions is this "
        "package's",
        (
            *_ROUND[_Z], (_X, 90.0), *_ROUND[_Y], (_X, 90.0), *_ROUND[_Z], (_X, 90.0), *_ROUND[_Y],
            (_Z, 90.0), *_ROUND[_X], (_Z, 180.0), *_ROUND[_X],
        ),
    ),
    "19-positions": PositionSequence(
        "18 turns of 90° about the three axes, forwards and back: for the systematic method",
        "Xie Bo et al., Multiposition calibration method of laser gyro strapdown inertial navigation system, Journal "
        "of Convergence Information Technology, 2011, as the demonstration of 19 positions in the PSINS toolbox by Yan "
        "Gongmin has it; here in axes forward, right, down, with one dwell for all positions",
        (
            *_THERE_AND_BACK[_X], (_BACKWARDS, 90.0), *_THERE_AND_BACK[_Y],
            *((_BACKWARDS, 90.0),) * 2, *((_BACKWARDS, -90.0),) * 3,
        ),
        roll_deg=-90.0,
    ),
}  # fmt: skip
"""Ready sequences by name."""


PROFILES = {
    "trapezoidal": "the rate rises and falls linearly",
    "smooth": "the rate rises and falls as half a cosine wave",
}


@dataclass(frozen=True)
class Dwell:
    """The table is at rest."""

    duration: float


@dataclass(frozen=True)
class Turn:
    """The table turns about an axis of the block."""

    axis: tuple[float, float, float]  # axis in the block's axes, of any non-zero length
    angle: float  # angle, right-handed about the axis, rad
    rate: float  # the full rate, rad/s, positive
    ramp: float = 1.0  # duration of the rise of the rate, and also of its fall, s, positive
    profile: str = "smooth"  # one of `PROFILES`


@dataclass(frozen=True)
class _Step:
    start: float
    axis: Array  # unit, (3,)
    rate: float  # signed full rate
    ramp: float
    cruise: float  # time at the full rate
    smooth: bool
    attitude: Array  # q_mb at the start

    @property
    def end(self) -> float:
        """End of the turn, s."""
        return self.start + 2.0 * self.ramp + self.cruise

    def _ramps(self, t: Array) -> tuple[Array, Array]:
        """Return the completed fractions of the first and of the last ramp, 0…1."""
        since = t - self.start
        return (
            np.clip(since / self.ramp, 0.0, 1.0),
            np.clip((since - self.ramp - self.cruise) / self.ramp, 0.0, 1.0),
        )

    def angle_rate(self, t: Array) -> Array:
        """Return the rate, zero outside the step."""
        up, down = self._ramps(t)
        if self.smooth:
            return np.asarray(0.5 * self.rate * (np.cos(np.pi * down) - np.cos(np.pi * up)))
        return np.asarray(self.rate * (up - down))

    def angle(self, t: Array) -> Array:
        """Return the angle turned: 0 before the step, the full angle after it."""
        up, down = self._ramps(t)
        cruised = np.clip(t - self.start - self.ramp, 0.0, self.cruise)
        if self.smooth:  # ∫½(1 − cos πx) dx = x/2 − sin(πx)/2π
            ramps = 0.5 * (up + down) + (np.sin(np.pi * down) - np.sin(np.pi * up)) / (2.0 * np.pi)
        else:
            ramps = 0.5 * up * up + down - 0.5 * down * down
        return np.asarray(self.rate * (self.ramp * ramps + cruised))


class RotationTable(TurnsOnly):
    """A sequence of dwells and turns from time 0, with its duration, s; the block is in the middle of the table, which
    stands still after the last step."""

    def __init__(self, steps: Sequence[Dwell | Turn]) -> None:
        time, attitude = 0.0, np.array([1.0, 0.0, 0.0, 0.0])
        turns: list[_Step] = []
        breaks: list[float] = []
        for number, step in enumerate(steps, start=1):
            if isinstance(step, Dwell):
                if not (np.isfinite(step.duration) and step.duration > 0.0):
                    raise InputError(
                        f"step {number} of the rotation table: its dwell of {step.duration!r} s must be positive."
                    )
                time += step.duration
                continue
            turn = _checked_turn(number, step, time, attitude)
            turns.append(turn)
            breaks += [time, time + turn.ramp, time + turn.ramp + turn.cruise, turn.end]
            time = turn.end
            attitude = rotation.normalize(
                rotation.multiply(attitude, rotation.quaternion_from_rotation_vector(turn.axis * step.angle))
            )
        self.duration = time
        self.breaks = np.array(breaks)
        self.fastest = max((abs(turn.rate) + np.pi / turn.ramp for turn in turns), default=0.0)
        self._turns = turns

    def attitude(self, t: Array) -> Array:
        q = np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))
        last = np.append([turn.start for turn in self._turns[1:]], np.inf)
        for turn, next_start in zip(self._turns, last, strict=False):
            begun = (t >= turn.start) & (t < next_start)
            phi = np.outer(turn.angle(t[begun]), turn.axis)
            q[begun] = rotation.multiply(turn.attitude, rotation.quaternion_from_rotation_vector(phi))
        return q

    def rate(self, t: Array) -> Array:
        total = np.zeros((len(t), 3))
        for turn in self._turns:
            during = (t >= turn.start) & (t <= turn.end)
            total[during] += np.outer(turn.angle_rate(t[during]), turn.axis)
        return total

    def turn(self, left: Array, right: Array) -> Array:
        total = np.zeros((len(left), 3))
        for turn in self._turns:
            during = (right > turn.start) & (left < turn.end)
            total[during] += np.outer(turn.angle(right[during]) - turn.angle(left[during]), turn.axis)
        return total


def _checked_turn(number: int, step: Turn, start: float, attitude: Array) -> _Step:
    where = f"step {number} of the rotation table"
    if step.profile not in PROFILES:
        raise unknown_name(f"profile in {where}", step.profile, PROFILES)
    for name, value, unit in (("rate", step.rate, "rad/s"), ("ramp", step.ramp, "s")):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{where}: its {name} of {value!r} {unit} must be positive and finite.")
    length = float(np.linalg.norm(step.axis))
    if not (np.isfinite(length) and length > 0.0):
        raise InputError(f"{where}: its axis {step.axis} must have three finite numbers, not all zero.")
    cruise = abs(step.angle) / step.rate - step.ramp
    if not cruise >= 0.0:
        raise InputError(
            f"{where}: a turn by {np.degrees(step.angle):g}° never reaches {np.degrees(step.rate):g}°/s with ramps of "
            f"{step.ramp:g} s; use a ramp of at most {abs(step.angle) / step.rate:g} s or a lower rate."
        )
    rate = float(np.copysign(step.rate, step.angle))
    return _Step(start, np.array(step.axis) / length, rate, step.ramp, cruise, step.profile == "smooth", attitude)


class DwellStep(Section):
    """The table is at rest."""

    type: Literal["dwell"]
    duration_s: Duration = Field(description="duration")

    def step(self) -> Dwell:
        """Return the step of the motion."""
        return Dwell(self.duration_s)


class TurnStep(Section):
    """The table turns about an axis of the sensor block."""

    type: Literal["turn"]
    axis: Axis = Field(description="axis of the turn in the axes of the sensor block: forward, right, down")
    angle_deg: float = Field(ge=-3.6e7, le=3.6e7, description="angle of the turn, right-handed about the axis")
    rate_deg_s: float = Field(ge=1e-6, le=360_000.0, description="full rate of the turn")
    ramp_s: float = Field(
        default=1.0, ge=1e-3, le=1e6, description="duration of the rise of the rate, and also of its fall"
    )
    profile: Literal["smooth", "trapezoidal"] = Field(default="smooth", description="shape of the rise and the fall")

    @model_validator(mode="after")
    def _can_be_done(self) -> Self:
        if abs(self.angle_deg) < self.rate_deg_s * self.ramp_s:
            raise ValueError(
                f"a turn by {self.angle_deg:g}° never reaches {self.rate_deg_s:g}°/s with ramps of {self.ramp_s:g} s; "
                f"give a ramp_s of at most {abs(self.angle_deg) / self.rate_deg_s:g}, or a lower rate"
            )
        return self

    def step(self) -> Turn:
        """Return the step of the motion."""
        return Turn(self.axis, self.angle_deg * DEG, self.rate_deg_s * DEG, self.ramp_s, self.profile)


Step = Annotated[DwellStep | TurnStep, Field(discriminator="type")]


class RotationTableMotion(ClosedFormMotion):
    """A sequence of steps on a rotation table."""

    type: Literal["rotation-table"]
    steps: tuple[Step, ...] = Field(min_length=1, description="steps of the table in order")

    @property
    def duration_s(self) -> float:
        """Duration of the sequence, s."""
        return sum(
            step.duration_s if isinstance(step, DwellStep) else abs(step.angle_deg) / step.rate_deg_s + step.ramp_s
            for step in self.steps
        )

    def motion(self) -> RotationTable:
        return RotationTable([step.step() for step in self.steps])

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return ∫ω² dt of the turns at their full rates; see `Motion.turning`."""
        turns = [step for step in self.steps if not isinstance(step, DwellStep)]
        return sum(abs(step.angle_deg) * step.rate_deg_s * DEG**2 for step in turns)


_Rate = Annotated[float, Field(ge=1e-3, le=3600.0)]
_Dwell = Annotated[float, Field(gt=0.0, le=1e6)]
_Error = Annotated[float, Field(ge=0.0, le=36_000.0)]
_RAMP, _SETTLE = 1.0, 1.0
_USUAL = "19-positions"
_SETTLING = 0.4
"""Part of the settling in which its rate rises, and in which it falls."""


@dataclass(frozen=True)
class TableErrors:
    """The errors of a table in one run."""

    tilt: Array  # τ, (3,) rad
    position: Array  # ε_p of each position, (P, 3) rad
    axis: Array  # η of each turn, (P − 1, 3) rad


class TableTurn(Section):
    """A turn about an axis of the sensor block, and the dwell in the position after it."""

    axis: Axis = Field(description="axis of the turn in the axes of the sensor block: forward, right, down")
    angle_deg: Annotated[float, A_TURN] = Field(
        ge=-36_000.0, le=36_000.0, description="angle of the turn, right-handed about the axis"
    )
    rate_deg_s: _Rate | None = Field(
        default=None, description="full rate of this turn; default: that of the table [turntable]"
    )
    dwell_s: _Dwell | None = Field(
        default=None, description="dwell after this turn; default: that of the table [turntable]"
    )


class Turntable(PlacedMotion):
    """A calibration on a turntable: dwells in positions, and turns between them. See docs/calibration.md."""

    table: ClassVar[str] = "turntable"
    at_most_one = (Keys(("sequence", "turns"), "the turns"),)

    latitude_deg: Latitude = Field(default=45.0, description="latitude of the laboratory")
    longitude_deg: Longitude = Field(default=0.0, description="longitude of the laboratory")
    altitude_m: Height = Field(default=0.0, description="height of the turntable above the ellipsoid")
    heading_deg: Heading = Field(default=0.0, description="heading of the sensor block in the first position")
    roll_deg: float | None = Field(
        default=None,
        ge=-180.0,
        le=180.0,
        description="roll in the first position; default: that of the sequence, or else 0",
    )
    pitch_deg: float | None = Field(
        default=None,
        ge=-90.0,
        le=90.0,
        description="pitch in the first position; default: that of the sequence, or else 0",
    )
    sequence: Annotated[str, AfterValidator(known_name("sequence of a turntable", SEQUENCES))] | None = Field(
        default=None, description=f"predefined sequence: {', '.join(SEQUENCES)}; default: {_USUAL}, without turns"
    )
    turns: tuple[TableTurn, ...] = Field(default=(), description="turns in order, instead of a predefined sequence")
    dwell_s: _Dwell = Field(default=120.0, description="dwell in each position")
    first_dwell_s: _Dwell | None = Field(default=None, description="dwell in the first position; default: dwell_s")
    rate_deg_s: _Rate = Field(default=10.0, description="full rate of the turns")
    ramp_s: float = Field(
        default=_RAMP, ge=1e-3, le=1e4, description="duration of the rise of the rate, and also of its fall"
    )
    settle_s: float = Field(default=_SETTLE, ge=0.01, le=1e4, description="settling time of the turntable after a turn")
    position_sigma_arcsec: _Error = Field(
        default=0.0,
        description="1σ of the positioning error of the turntable about each axis, independent in each position, and "
        "of the direction error of the axis of each turn",
    )
    tilt_sigma_arcsec: _Error = Field(
        default=0.0, description="1σ of the tilt of the turntable's base about north, east and down"
    )

    @model_validator(mode="after")
    def _can_be_done(self) -> Self:
        for number, turn in enumerate(self.all_turns, start=1):
            rate = turn.rate_deg_s or self.rate_deg_s
            if abs(turn.angle_deg) < rate * self.ramp_s:
                raise ValueError(
                    f"turn {number} by {turn.angle_deg:g}° never reaches {rate:g}°/s with ramp_s = {self.ramp_s:g}; "
                    f"give a ramp_s of at most {abs(turn.angle_deg) / rate:g}, or a lower rate"
                )
        return self

    @property
    def all_turns(self) -> tuple[TableTurn, ...]:
        """The turns, given or of the ready sequence."""
        ready = self.ready
        return self.turns if ready is None else tuple(TableTurn(axis=axis, angle_deg=a) for axis, a in ready.turns)

    @property
    def ready(self) -> PositionSequence | None:
        """The ready sequence, None with given turns."""
        return None if self.turns else SEQUENCES[self.sequence or _USUAL]

    @property
    def start_deg(self) -> tuple[float, float, float]:
        """Roll, pitch and heading of the first position."""
        ready = self.ready
        roll = self.roll_deg if self.roll_deg is not None else ready.roll_deg if ready else 0.0
        pitch = self.pitch_deg if self.pitch_deg is not None else ready.pitch_deg if ready else 0.0
        return roll, pitch, self.heading_deg

    @property
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Beginning and end of the dwell in each position, s."""
        first = self.first_dwell_s or self.dwell_s
        dwells, time = [(0.0, first)], first
        for turn in self.all_turns:
            time += self.turn_duration(turn)
            dwells.append((time, time + (turn.dwell_s or self.dwell_s)))
            time = dwells[-1][1]
        return tuple(dwells)

    def turn_duration(self, turn: TableTurn) -> float:
        """Return the duration of a turn with its settling, s."""
        return abs(turn.angle_deg) / (turn.rate_deg_s or self.rate_deg_s) + self.ramp_s + self.settle_s

    @property
    def duration_s(self) -> float:
        """Duration of the sequence, s."""
        return self.dwells[-1][1]

    @property
    def start_attitude(self) -> Array:
        """The nominal attitude of the first position, q_nb, (4,)."""
        return attitude(*self.start_deg)

    def draw_errors(self, seed: int) -> TableErrors:
        """Return the errors of the table in one run."""
        from sinssim.statistics.random_numbers import normals  # needs the compiler

        turns = self.all_turns
        sigma = self.position_sigma_arcsec * ARCSEC

        def drawn(term: str, count: int) -> Array:
            return np.stack([normals(seed, f"turntable {term}", axis, count) for axis in range(3)], axis=1)

        normal = np.array([turn.axis for turn in turns]).reshape(-1, 3)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        wobble = sigma * drawn("axis", len(turns))
        return TableErrors(
            self.tilt_sigma_arcsec * ARCSEC * drawn("tilt", 1)[0],
            sigma * drawn("position", len(turns) + 1),
            wobble - normal * np.sum(wobble * normal, axis=1, keepdims=True),
        )

    def motion(self, errors: TableErrors) -> tuple[Array, RotationTable]:
        """Return the motion of a block on the table: attitude q_nb in the first position, (4,), and the motion from
        it."""
        exp = rotation.quaternion_from_rotation_vector
        q_first = rotation.multiply(exp(errors.tilt), rotation.multiply(self.start_attitude, exp(errors.position[0])))
        steps: list[Dwell | Turn] = [Dwell(self.first_dwell_s or self.dwell_s)]
        for k, turn in enumerate(self.all_turns):
            nominal = np.array(turn.axis) / np.linalg.norm(turn.axis)
            axis = rotation.rotate(exp(errors.axis[k]), nominal)
            angle = turn.angle_deg * DEG
            left = settling(nominal, axis, angle, errors.position[k], errors.position[k + 1])
            rate = (turn.rate_deg_s or self.rate_deg_s) * DEG
            steps.append(Turn((axis[0], axis[1], axis[2]), angle, rate, self.ramp_s))
            size = float(np.linalg.norm(left))
            if size > 0.0:
                full = size / ((1.0 - _SETTLING) * self.settle_s)
                steps.append(Turn((left[0], left[1], left[2]), size, full, _SETTLING * self.settle_s))
            else:
                steps.append(Dwell(self.settle_s))
            steps.append(Dwell(turn.dwell_s or self.dwell_s))
        return q_first, RotationTable(steps)

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        """Return the motion of the block, with errors drawn from the seed; see `Motion.block_motion`."""
        q_first, motion = self.motion(self.draw_errors(seed))
        return block.of(OnEarth(motion, *self.place, q_first, motion.duration, earth.gravity, earth.figure))


def settling(nominal: Array, axis: Array, angle: float, before: Array, after: Array) -> Array:
    """Return the rotation from where a turn by an angle leads into the position after it: s of e^[s×] = e^[−θn'×]
    e^[−ε_p×] e^[θn×] e^[ε_{p+1}×], (3,) rad, with the nominal axis n and the true axis n'."""
    exp, multiply = rotation.quaternion_from_rotation_vector, rotation.multiply
    left = multiply(exp(-angle * axis), exp(-before))
    return rotation.rotation_vector_from_quaternion(multiply(left, multiply(exp(angle * nominal), exp(after))))
