"""The true motion of a block on a turntable, with the errors of the table.

In position p the block's attitude is C_nb = e^[τ×] A_p e^[ε_p×]. A_p is the nominal attitude: that of the first
position, turned by the nominal turns. τ is the tilt of the base, the same in all positions, in north-east-down axes.
ε_p is the error of the position, in the block's axes. The turn before position p is about the axis e^[η_p×] n_p: n_p
is the nominal axis in the block, and η_p its error, at right angles to it. After the turn, the table settles from
where the turn led into its position. Turn and settling are rotations about a fixed axis each, so that attitude, rate
and increments are closed forms (`sinssim.truth.motions.rotation_table`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.truth.motions.rotation_table import Dwell, RotationTable, Turn
from sinssim.truth.turntable.section import TurntableSection
from sinssim.units import ARCSEC, DEG

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


def draw_table_errors(section: TurntableSection, seed: int) -> TableErrors:
    """Return the errors of a table in one run.

    Args:
        section: the [turntable] table of a scenario.
        seed: the run's seed.

    Returns:
        The errors.
    """
    from sinssim.statistics.random_numbers import normals

    turns = section.all_turns
    sigma = section.position_sigma_arcsec * ARCSEC

    def drawn(term: str, count: int) -> Array:
        return np.stack([normals(seed, f"turntable {term}", axis, count) for axis in range(3)], axis=1)

    normal = np.array([turn.axis for turn in turns]).reshape(-1, 3)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    wobble = sigma * drawn("axis", len(turns))
    return TableErrors(
        section.tilt_sigma_arcsec * ARCSEC * drawn("tilt", 1)[0],
        sigma * drawn("position", len(turns) + 1),
        wobble - normal * np.sum(wobble * normal, axis=1, keepdims=True),
    )


def start_attitude(section: TurntableSection) -> Array:
    """Return the nominal attitude of the first position, q_nb, (4,).

    Args:
        section: the [turntable] table of a scenario.
    """
    return rotation.quaternion_from_euler(*np.radians(section.start_deg))


def table_motion(section: TurntableSection, errors: TableErrors) -> tuple[Array, RotationTable]:
    """Return the motion of a block on a table.

    Args:
        section: the [turntable] table of a scenario.
        errors: the errors of the table.

    Returns:
        Attitude q_nb in the first position, (4,), and the motion from it.
    """
    exp = rotation.quaternion_from_rotation_vector
    q_first = rotation.multiply(exp(errors.tilt), rotation.multiply(start_attitude(section), exp(errors.position[0])))
    steps: list[Dwell | Turn] = [Dwell(section.first_dwell_s or section.dwell_s)]
    for k, turn in enumerate(section.all_turns):
        nominal = np.array(turn.axis) / np.linalg.norm(turn.axis)
        axis = rotation.rotate(exp(errors.axis[k]), nominal)
        angle = turn.angle_deg * DEG
        left = settling(nominal, axis, angle, errors.position[k], errors.position[k + 1])
        rate = (turn.rate_deg_s or section.rate_deg_s) * DEG
        steps.append(Turn((axis[0], axis[1], axis[2]), angle, rate, section.ramp_s))
        size = float(np.linalg.norm(left))
        if size > 0.0:
            full = size / ((1.0 - _SETTLING) * section.settle_s)
            steps.append(Turn((left[0], left[1], left[2]), size, full, _SETTLING * section.settle_s))
        else:
            steps.append(Dwell(section.settle_s))
        steps.append(Dwell(turn.dwell_s or section.dwell_s))
    return q_first, RotationTable(steps)


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
