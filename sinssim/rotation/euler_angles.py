"""Euler angles as people read them: headings in a chosen range, and angles that count full turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.errors import check_name
from sinssim.rotation.quaternions import euler_from_quaternion

HEADING_RANGES: dict[str, float] = {"0..360": 0.0, "-180..180": -np.pi, "-90..270": -0.5 * np.pi}
"""Least heading of each range, rad."""


def heading_in(range_: str, heading: ArrayLike) -> Array:
    """Return headings in a range of 360°.

    Args:
        range_: one of `HEADING_RANGES`; the last is that of the formulas for a parked vehicle.
        heading: (...) rad.

    Returns:
        (...) rad, in [least, least + 2π).

    Raises:
        InputError: the range is unknown, or a heading is not a number.
    """
    check_name("range of the heading", range_, HEADING_RANGES)
    least = HEADING_RANGES[range_]
    turned = np.mod(numbers("the heading", heading) - least, 2.0 * np.pi)
    turned = np.where(turned >= 2.0 * np.pi, 0.0, turned)  # a tiny negative angle plus 2π rounds to 2π
    return np.asarray(turned + least)


def shown_heading(choice: str | None, heading: ArrayLike) -> Array:
    """Return consecutive headings in the range that a scenario requests.

    Args:
        choice: one of `HEADING_RANGES`, "continuous" for headings that count full turns, None for 0…360°.
        heading: (N,) rad; for "continuous", consecutive ones differ by less than 180°.

    Returns:
        (N,) rad.
    """
    if choice == "continuous":
        return np.asarray(np.unwrap(numbers("the heading", heading)))
    return heading_in(choice or "0..360", heading)


def continuous_angles(q_nb: ArrayLike) -> tuple[Array, Array, Array]:
    """Return Euler angles that count full turns of roll and heading.

    Consecutive attitudes must differ by less than 180°. Pitch stays within ±90°. A passage through pitch ±90° changes
    roll and heading by 180° at once, because these are the same attitudes; angles integrated through it, as those of
    the Euler equations, would take pitch beyond 90° instead.

    Args:
        q_nb: consecutive attitudes, (N, 4).

    Returns:
        Roll, pitch, heading, (N,) rad each; the first roll lies in (−π, π], the first heading in [0, 2π).

    Raises:
        InputError: the attitudes are not quaternions.
    """
    roll, pitch, heading = euler_from_quaternion(q_nb)
    return np.unwrap(roll), pitch, np.unwrap(heading)
