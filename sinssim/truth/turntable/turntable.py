"""The [turntable] table: a sequence of positions and turns for calibration, and its true motion with its errors.

In position p the block's attitude is C_nb = e^[τ×] A_p e^[ε_p×]. A_p is the nominal attitude: that of the first
position, turned by the nominal turns. τ is the tilt of the base, the same in all positions, in north-east-down axes.
ε_p is the error of the position, in the block's axes. The turn before position p is about the axis e^[η_p×] n_p: n_p
is the nominal axis in the block, and η_p its error, at right angles to it. After the turn, the table settles from
where the turn led into its position. Turn and settling are rotations about a fixed axis each, so that attitude, rate
and increments are closed forms (`sinssim.truth.motions.rotation_table`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from sinssim import rotation
from sinssim.data import Array
from sinssim.section import A_TURN, Axis, Heading, Height, Keys, Latitude, Longitude, Section, known_name
from sinssim.truth.motion import (
    AT_REFERENCE_POINT,
    NORMAL_EARTH,
    Mounting,
    PlacedMotion,
    Progress,
    TrueEarth,
    attitude,
)
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.rotation_table import Dwell, RotationTable, Turn
from sinssim.truth.trajectory import Trajectory
from sinssim.truth.turntable.sequences import SEQUENCES, Sequence
from sinssim.units import ARCSEC, DEG

_Rate = Annotated[float, Field(ge=1e-3, le=3600.0)]
_Dwell = Annotated[float, Field(gt=0.0, le=1e6)]
_Error = Annotated[float, Field(ge=0.0, le=36_000.0)]
_RAMP, _SETTLE = 1.0, 1.0
_USUAL = "19-positions"
_SETTLING = 0.4
"""Part of the settling in which its rate rises, and in which it falls."""


@dataclass(frozen=True)
class TableErrors:
    """The errors of a table in one run.

    Attributes:
        tilt: τ, (3,) rad.
        position: ε_p of each position, (P, 3) rad.
        axis: η of each turn, (P − 1, 3) rad.
    """

    tilt: Array
    position: Array
    axis: Array


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
        own = self.ready
        return self.turns if own is None else tuple(TableTurn(axis=axis, angle_deg=a) for axis, a in own.turns)

    @property
    def ready(self) -> Sequence | None:
        """The ready sequence, None with given turns."""
        return None if self.turns else SEQUENCES[self.sequence or _USUAL]

    @property
    def start_deg(self) -> tuple[float, float, float]:
        """Roll, pitch and heading of the first position."""
        own = self.ready
        roll = self.roll_deg if self.roll_deg is not None else own.roll_deg if own else 0.0
        pitch = self.pitch_deg if self.pitch_deg is not None else own.pitch_deg if own else 0.0
        return roll, pitch, self.heading_deg

    @property
    def dwells(self) -> tuple[tuple[float, float], ...]:
        """Beginning and end of the dwell in each position, s."""
        first = self.first_dwell_s or self.dwell_s
        found, time = [(0.0, first)], first
        for turn in self.all_turns:
            time += self.turn_duration(turn)
            found.append((time, time + (turn.dwell_s or self.dwell_s)))
            time = found[-1][1]
        return tuple(found)

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
        """Return the errors of the table in one run.

        Args:
            seed: the run's seed.
        """
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
        """Return the motion of a block on the table.

        Returns:
            Attitude q_nb in the first position, (4,), and the motion from it.
        """
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

    def trajectory(
        self,
        block: Mounting = AT_REFERENCE_POINT,
        earth: TrueEarth = NORMAL_EARTH,
        seed: int = 0,
        progress: Progress | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> Trajectory:
        """Return the motion of the block, with errors drawn from the seed; see `Motion.trajectory`."""
        q_first, motion = self.motion(self.draw_errors(seed))
        return block.of(OnEarth(motion, *self.place, q_first, motion.duration, earth.gravity, earth.figure))


def settling(nominal: Array, axis: Array, angle: float, before: Array, after: Array) -> Array:
    """Return the rotation from where a turn leads into the position after it.

    Args:
        nominal: nominal axis of the turn, a unit vector, (3,).
        axis: its true axis, a unit vector, (3,).
        angle: angle, rad.
        before, after: errors ε of the positions before and after the turn, (3,) rad.

    Returns:
        s of e^[s×] = e^[−θn'×] e^[−ε_p×] e^[θn×] e^[ε_{p+1}×], (3,) rad.
    """
    exp, multiply = rotation.quaternion_from_rotation_vector, rotation.multiply
    left = multiply(exp(-angle * axis), exp(-before))
    return rotation.rotation_vector_from_quaternion(multiply(left, multiply(exp(angle * nominal), exp(after))))
