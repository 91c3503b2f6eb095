"""The errors of some runs at the epochs: everything that is kept of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array

VECTORS = ("position_ned", "velocity_ned", "attitude")
"""Errors by component: m, m/s, and the rotation vector φ of `NavError`, rad."""

COMPONENTS = tuple(
    f"{what}_{axis}_{unit}"
    for what, unit in (("position", "m"), ("velocity", "mps"), ("attitude", "rad"))
    for axis in "ned"
)
"""The nine errors, in the order of `RunErrors.final`."""


@dataclass
class RunErrors:
    """Errors of R runs at K epochs; a value is NaN where a run failed, has ended, or its filter has not begun.

    Attributes:
        number: numbers of the runs, (R,).
        seed: their seeds, (R,).
        end: end of each run, s, (R,).
        failure: why a run failed, R texts, "" for a run that did not.
        values: values of the varied keys by key, (R,) each.
        position_ned, velocity_ned, attitude: errors in the true local level, (R, K, 3): m, m/s, rad.
        final: the errors at each run's own end, (R, 9), in the order of the three.
        sigma: 1σ that a filter states for the same nine errors, (R, K, 9); None without a filter.
        nees: normalised squared errors by block of the filter, (R, K) each.
        nees_freedom: their degrees of freedom, (R, K) each.
        nis: sum of the normalised squared innovations since the previous epoch, by sensor, (R, K) each.
        nis_freedom: their degrees of freedom, (R, K) each.
    """

    number: NDArray[np.int64]
    seed: NDArray[np.int64]
    end: Array
    failure: list[str]
    values: dict[str, Array]
    position_ned: Array
    velocity_ned: Array
    attitude: Array
    final: Array
    sigma: Array | None = None
    nees: dict[str, Array] = field(default_factory=dict)
    nees_freedom: dict[str, Array] = field(default_factory=dict)
    nis: dict[str, Array] = field(default_factory=dict)
    nis_freedom: dict[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.number)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each run failed, (R,)."""
        return np.array([bool(text) for text in self.failure], dtype=np.bool_)


def empty(
    count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str] = (), sensors: Sequence[str] = ()
) -> RunErrors:
    """Return the errors of runs that are still to be filled in: all NaN.

    Args:
        count: number of runs R.
        epochs: number of epochs K.
        keys: varied keys.
        blocks: blocks of a filter's states.
        sensors: aiding sensors.

    Returns:
        The errors; with `sigma` if there are blocks.
    """

    def nan(*shape: int) -> Array:
        return np.full((count, *shape), np.nan)

    return RunErrors(
        number=np.zeros(count, np.int64),
        seed=np.zeros(count, np.int64),
        end=nan(),
        failure=[""] * count,
        values={key: nan() for key in keys},
        position_ned=nan(epochs, 3),
        velocity_ned=nan(epochs, 3),
        attitude=nan(epochs, 3),
        final=nan(9),
        sigma=nan(epochs, 9) if blocks else None,
        nees={name: nan(epochs) for name in blocks},
        nees_freedom={name: nan(epochs) for name in blocks},
        nis={name: nan(epochs) for name in sensors},
        nis_freedom={name: nan(epochs) for name in sensors},
    )


def put(errors: RunErrors, part: RunErrors, first: int) -> None:
    """Put the errors of some runs among those of more runs.

    Args:
        errors: errors of more runs, changed in place.
        part: errors of some of them, with the same epochs, keys, blocks and sensors.
        first: row of the first of them.
    """
    rows = slice(first, first + len(part))
    errors.failure[rows] = part.failure
    for one in fields(RunErrors):
        there, here = getattr(errors, one.name), getattr(part, one.name)
        if isinstance(there, dict):
            for name, values in there.items():
                values[rows] = here[name]
        elif isinstance(there, np.ndarray):
            there[rows] = here


def bytes_of(runs: int, epochs: int, blocks: int = 0, sensors: int = 0) -> float:
    """Return the memory of the errors of some runs.

    Args:
        runs: number of runs.
        epochs: number of epochs.
        blocks: number of blocks of a filter's states.
        sensors: number of aiding sensors.

    Returns:
        Bytes.
    """
    return 8.0 * runs * epochs * (9 + 9 * bool(blocks) + 2 * blocks + 2 * sensors)
