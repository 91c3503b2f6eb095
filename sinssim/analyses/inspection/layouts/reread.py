"""Turns another meaning of three readings into keys of their description: unit, order and signs of the columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sinssim.data import Array
from sinssim.logs.text.names import UNITS

Kind = Literal["rates", "increments"]
_SAME = 0.05
"""Relative difference of two factors that mean one unit: the interval of increments varies by as much, and units differ
by a factor of two or more."""


@dataclass(frozen=True)
class Reread:
    """A right triad as columns of the stated one: right_i = scale · sign_i · stated_source(i)."""

    source: tuple[int, ...]
    signs: tuple[int, ...]
    scale: float

    def unit(self, name: str, kind: Kind, unit: str, interval: float) -> tuple[Kind, str] | None:
        """Return the kind and the unit with which the stated numbers are the right ones; None if there are none.

        Args:
            name: "gyro" or "accel".
            interval: usual interval of the samples, s.
        """
        size = self.scale * UNITS[name, kind][unit]
        other: Kind = "rates" if kind == "increments" else "increments"
        for of, factor in ((kind, 1.0), (other, interval if kind == "increments" else 1.0 / interval)):
            for candidate, si in UNITS[name, of].items():
                if abs(si * factor / size - 1.0) < _SAME:
                    return of, candidate
        return None


def reread(matrix: Array) -> Reread | None:
    """Return a matrix from stated to right readings as a scale, an order and signs; None if it is another one."""
    scale = float(np.abs(matrix).max())
    if not np.allclose(np.sort(np.abs(matrix), axis=1), [[0.0, 0.0, scale]] * 3, atol=1e-9 * scale):
        return None
    source = tuple(int(np.argmax(np.abs(row))) for row in matrix)
    return Reread(source, tuple(int(np.sign(matrix[i, j])) for i, j in enumerate(source)), scale)


def description_of(
    kind: Kind, triads: dict[str, dict[str, Any]], matrices: dict[str, Array], interval: float
) -> tuple[Kind, dict[str, dict[str, Any]]] | None:
    """Return kind and triads of the description of a log after a correction.

    Args:
        triads: the tables gyro and accel, and gravity if there is one, as stated.
        matrices: from the stated readings of gyro and accel, in the order of their columns, to the right ones, (3, 3).
        interval: usual interval of the samples, s.

    Returns:
        The right ones; None if no unit, order and signs of columns express it.
    """
    kinds, found = set(), {}
    for name, keys in triads.items():
        of = "gyro" if name == "gyro" else "accel"
        own = reread(matrices[of])
        unit = None if own is None else own.unit(of, kind, keys["unit"], interval)
        if own is None or unit is None:
            return None
        kinds.add(unit[0])
        found[name] = {**keys, "unit": unit[1]}
        stated: Sequence[int] = keys.get("signs", (1, 1, 1))
        signs = [sign * stated[j] for sign, j in zip(own.signs, own.source, strict=True)]
        if isinstance(keys["columns"], str) and own.source != (0, 1, 2):
            return None  # one array of three columns has a fixed order
        if own.source != (0, 1, 2):
            found[name]["columns"] = [keys["columns"][j] for j in own.source]
        if signs != [1, 1, 1] or "signs" in keys:
            found[name]["signs"] = signs
    return (kinds.pop(), found) if len(kinds) == 1 else None
