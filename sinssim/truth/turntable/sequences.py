"""Predefined sequences of positions of a turntable, as laboratories use them.

A sequence begins in its first position, with the start's roll and pitch, and has one further position after each of its
turns. Every turn is about an axis of the block.
"""

from __future__ import annotations

from dataclasses import dataclass

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Sequence:
    """A sequence of positions.

    Attributes:
        about: one sentence.
        source: where it is published.
        turns: axis in the block's axes, and angle, degrees, of the turn before each position but the first.
        roll_deg, pitch_deg: attitude of the first position.
    """

    about: str
    source: str
    turns: tuple[tuple[tuple[float, float, float], float], ...]
    roll_deg: float = 0.0
    pitch_deg: float = 0.0


_SIX = ((_X, 90.0), (_X, 90.0), (_X, 90.0), (_Z, 90.0), (_Z, 180.0))
_FULL_TURNS = tuple((axis, angle) for axis in (_X, _Y, _Z) for angle in (360.0, -360.0))
_ROUND = {axis: ((axis, 90.0),) * 3 for axis in (_X, _Y, _Z)}
_THERE_AND_BACK = {axis: ((axis, 90.0),) * 3 + ((axis, -90.0),) * 3 for axis in (_X, _Y)}
_BACKWARDS = (0.0, 0.0, -1.0)

SEQUENCES: dict[str, Sequence] = {
    "six-positions": Sequence(
        "each axis of the IMU up and down",
        "Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, section 8.3; Syed et al., A "
        "new multi-position calibration method for MEMS inertial navigation systems, Meas. Sci. Technol. 18 (2007) "
        "1897-1907",
        _SIX,
    ),
    "six-positions-and-rates": Sequence(
        "each axis up and down, then a full turn forwards and one back about each axis",
        "the classical separate tests: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, "
        "sections 8.3 and 8.4",
        (*_SIX, *_FULL_TURNS),
    ),
    "24-positions": Sequence(
        "each of the six faces of a cube down in each of four headings: all orientations of a cube",
        "the rotation group of the cube, whose positions weigh all axes alike; the order of the positions is this "
        "package's",
        (
            *_ROUND[_Z], (_X, 90.0), *_ROUND[_Y], (_X, 90.0), *_ROUND[_Z], (_X, 90.0), *_ROUND[_Y],
            (_Z, 90.0), *_ROUND[_X], (_Z, 180.0), *_ROUND[_X],
        ),
    ),
    "19-positions": Sequence(
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
