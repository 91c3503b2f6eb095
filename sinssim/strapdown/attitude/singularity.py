"""Finds passages of Euler angles through their singular attitude and the resulting attitude errors."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, degrees, radians, sin

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState, SingularityEvent

NEAR = radians(85.0)
"""Pitch above which a passage lasts [rad]."""


def _steep_rows(q_nb: Array) -> tuple[list[tuple[int, int]], Array]:
    """Return first and last row of every passage, and |sin pitch| of all rows."""
    sine = np.abs(2.0 * (q_nb[:, 0] * q_nb[:, 2] - q_nb[:, 1] * q_nb[:, 3]))
    steep = np.concatenate(([False], sine > sin(NEAR), [False]))
    edges = np.flatnonzero(steep[1:] != steep[:-1])
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)], sine


def singularity_events(
    solution: NavSolution, navigate_again: Callable[[int, int, NavState], NavSolution]
) -> tuple[SingularityEvent, ...]:
    """Return the passages of a solution through pitch ±90° and their damage.

    The damage of a passage is measured on its increments: a singularity-free algorithm starts from the solution just
    before it, and the two attitudes are compared just after it.

    Args:
        solution: a solution by an algorithm that is singular there.
        navigate_again: function that navigates between two rows from a given state without the singularity.
    """
    passages, sine = _steep_rows(solution.q_nb)
    events = []
    for steep_first, steep_last in passages:
        first, last = max(steep_first - 1, 0), min(steep_last + 1, len(solution.time) - 1)
        if last == first:
            continue
        reference = navigate_again(first, last, solution.state(first))
        difference = rotation.multiply(rotation.conjugate(reference.q_nb[-1]), solution.q_nb[last])
        damage = float(np.linalg.norm(rotation.rotation_vector_from_quaternion(difference)))
        nearest = 90.0 - degrees(asin(min(1.0, float(np.max(sine[first : last + 1])))))
        start, end = float(solution.time[first]), float(solution.time[last])
        events.append(
            SingularityEvent(
                start,
                end,
                damage,
                f"{solution.algorithm}: pitch came within {nearest:.2f}° of ±90° between {start:.2f} s and "
                f"{end:.2f} s; the resulting attitude error is {_three_digits(degrees(damage) * 3600.0)}″.",
            )
        )
    return tuple(events)


def _three_digits(value: float) -> str:
    """Write a number with three significant digits, for example 4090 or 0.0661."""
    return f"{float(f'{value:.3g}'):g}"
