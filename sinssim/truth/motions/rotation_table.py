"""Sequences on a rotation table: dwells, and turns about an axis of the block.

The rate of a turn rises to its value over a ramp and falls over another: linearly (profile "trapezoidal") or as half a
cosine wave ("smooth", with continuous angular acceleration). In both cases a ramp covers half the angle of the full
rate, so that a turn by an angle lasts angle/rate + ramp. During a turn the axis is fixed in block and table, and the
integral of the rate is the axis times the angle turned. Such sequences are used to calibrate sensor blocks (Titterton
and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.section import Axis, Duration, Section
from sinssim.truth.motion import NORMAL_EARTH, TrueEarth
from sinssim.truth.motions.analytic import ClosedFormMotion, no_displacement
from sinssim.units import DEG

PROFILES = {
    "trapezoidal": "the rate rises and falls linearly",
    "smooth": "the rate rises and falls as half a cosine wave",
}


@dataclass(frozen=True)
class Dwell:
    """The table is at rest.

    Attributes:
        duration: s.
    """

    duration: float


@dataclass(frozen=True)
class Turn:
    """The table turns about an axis of the block.

    Attributes:
        axis: axis in the block's axes, of any non-zero length.
        angle: angle, right-handed about the axis, rad.
        rate: the full rate, rad/s, positive.
        ramp: duration of the rise of the rate, and also of its fall, s, positive.
        profile: one of `PROFILES`.
    """

    axis: tuple[float, float, float]
    angle: float
    rate: float
    ramp: float = 1.0
    profile: str = "smooth"


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


class RotationTable:
    """A sequence of dwells and turns; the table stands still after the last one.

    Args:
        steps: the steps in order, from time 0.

    Attributes:
        duration: duration of the sequence, s.

    Raises:
        InputError: a duration, rate or ramp is not positive, an axis is zero, a profile is unknown, or a turn is too
            short for its rate; the message names the step.
    """

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
            breaks += [time, time + turn.ramp, time + turn.ramp + turn.cruise, time + 2.0 * turn.ramp + turn.cruise]
            time = breaks[-1]
            attitude = rotation.normalize(
                rotation.multiply(attitude, rotation.quaternion_from_rotation_vector(turn.axis * step.angle))
            )
        self.duration = time
        self.breaks = np.array(breaks)
        self.fastest = max((abs(turn.rate) + np.pi / turn.ramp for turn in turns), default=0.0)
        self._turns = turns

    def attitude(self, t: Array) -> Array:
        """Return q_mb, (N, 4); see `AnalyticMotion.attitude`."""
        q = np.tile([1.0, 0.0, 0.0, 0.0], (len(t), 1))
        last = np.append([turn.start for turn in self._turns[1:]], np.inf)
        for turn, next_start in zip(self._turns, last, strict=False):
            begun = (t >= turn.start) & (t < next_start)
            phi = np.outer(turn.angle(t[begun]), turn.axis)
            q[begun] = rotation.multiply(turn.attitude, rotation.quaternion_from_rotation_vector(phi))
        return q

    def rate(self, t: Array) -> Array:
        """Return the angular rate in body axes, (N, 3) rad/s; see `AnalyticMotion.rate`."""
        total = np.zeros((len(t), 3))
        for turn in self._turns:
            during = (t >= turn.start) & (t <= turn.end)
            total[during] += np.outer(turn.angle_rate(t[during]), turn.axis)
        return total

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration, all zero; see `AnalyticMotion.place`."""
        return no_displacement(t)

    def turn(self, left: Array, right: Array) -> Array:
        """Return the integral of the rate, (N, 3) rad; see `AnalyticMotion.turn`."""
        total = np.zeros((len(left), 3))
        for turn in self._turns:
            during = (right > turn.start) & (left < turn.end)
            total[during] += np.outer(turn.angle(right[during]) - turn.angle(left[during]), turn.axis)
        return total

    def push(self, left: Array, right: Array) -> Array:
        """Return zero, (N, 3) m/s: the block is in the middle of the table; see `AnalyticMotion.push`."""
        return np.zeros((len(left), 3))


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
        """Return the motion about the place; see `ClosedFormMotion.motion`."""
        return RotationTable([step.step() for step in self.steps])

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return ∫ω² dt of the turns at their full rates; see `Motion.turning`."""
        turns = [step for step in self.steps if not isinstance(step, DwellStep)]
        return sum(abs(step.angle_deg) * step.rate_deg_s * DEG**2 for step in turns)
