"""Colours and line widths of everything that is drawn: one table.

The colours are Okabe and Ito's set for all kinds of colour vision ("Color universal design", 2008), without black
and without its yellow, so that every line is legible on a dark and on a light background.
"""

from __future__ import annotations

from collections.abc import Sequence

Rgb = tuple[int, int, int]

COLORS: dict[str, Rgb] = {
    # attitude algorithms
    "quaternion": (86, 180, 233),
    "poisson": (230, 159, 0),
    "euler": (204, 121, 167),
    # where a quantity comes from
    "truth": (0, 158, 115),
    "ideal": (0, 158, 115),
    "measured": (213, 94, 0),
    # axes: of the body, and of the local level
    "x": (213, 94, 0),
    "y": (0, 158, 115),
    "z": (86, 180, 233),
    "north": (213, 94, 0),
    "east": (0, 158, 115),
    "down": (86, 180, 233),
    # the rest
    "reference": (140, 140, 140),
    "ground": (120, 120, 120),
    "aircraft": (200, 204, 210),
}

_OTHERS: tuple[Rgb, ...] = ((0, 158, 115), (213, 94, 0), (0, 114, 178), (160, 160, 60), (120, 100, 200))


def colors(names: Sequence[str]) -> list[Rgb]:
    """Return one colour per name: the table's, or for a name that is not in it the next free one.

    Args:
        names: for example algorithms, or axes.

    Returns:
        Red, green, blue of 0…255 each.
    """
    others = [name for name in names if name not in COLORS]
    return [COLORS[n] if n in COLORS else _OTHERS[others.index(n) % len(_OTHERS)] for n in names]


def stacked_widths(count: int) -> list[float]:
    """Return line widths for lines that may lie on one another: each is thinner than the one under it.

    Args:
        count: number of lines, drawn in order.

    Returns:
        Widths in points, widest first.
    """
    return [1.5 * 1.8 ** (count - 1 - i) for i in range(count)] if count <= 3 else [1.5] * count


def tint(color: Rgb) -> Rgb:
    """Return a paler shade of a colour, for the wide line under a thin one."""
    r, g, b = ((2 * c + 3 * 150) // 5 for c in color)
    return (r, g, b)
