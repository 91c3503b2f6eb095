"""The errors of some runs at the epochs: everything that is kept of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import RunError
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from sinssim.strapdown.nav_error import NavError

VECTORS = ("position_ned", "velocity_ned", "attitude")
"""Errors by component: m, m/s, and the rotation vector φ of `NavError`, rad."""

COMPONENTS = tuple(
    f"{what}_{axis}_{unit}"
    for what, unit in (("position", "m"), ("velocity", "mps"), ("attitude", "rad"))
    for axis in "ned"
)
"""The nine errors, in the order of `RunErrors.final`."""

WITHIN = 1e-6
"""s: an instant of a solution that is later than an epoch by less counts as the epoch."""
EVERYTHING = slice(None)
AT_ONCE = 2**20
"""Numbers of one column, runs times epochs, that statistics over all runs hold at a time: 8 MB."""


@dataclass
class KeptErrors:
    """What the errors of runs have in common, in memory or in a file.

    Attributes:
        number: numbers of the runs, (R,).
        seed: their seeds, (R,).
        end: end of each run, s, (R,).
        failure: why a run failed, R texts, "" for a run that did not.
        values: values of the varied keys by key, (R,) each.
        final: the errors at each run's own end, (R, 9), in the order of `COMPONENTS`.
    """

    number: NDArray[np.int64]
    seed: NDArray[np.int64]
    end: Array
    failure: list[str]
    values: dict[str, Array]
    final: Array

    def __len__(self) -> int:
        return len(self.number)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each run failed, (R,)."""
        return np.array([bool(text) for text in self.failure], dtype=np.bool_)

    def put_runs(self, part: KeptErrors, first: int) -> None:
        """Put what does not depend on the epoch, of runs from the row `first` on."""
        rows = slice(first, first + len(part))
        self.failure[rows] = part.failure
        for there, here in ((self.number, part.number), (self.seed, part.seed), (self.end, part.end)):
            there[rows] = here
        self.final[rows] = part.final
        for key, values in self.values.items():
            values[rows] = part.values[key]


@short_repr
@dataclass
class RunErrors(KeptErrors):
    """Errors of R runs at K epochs; a value is NaN where a run failed, has ended, or its filter has not begun.

    Attributes:
        number, seed, end, failure, values, final: as those of `KeptErrors`.
        position_ned, velocity_ned, attitude: errors in the true local level, (R, K, 3): m, m/s, rad.
        sigma: 1σ that a filter states for the same nine errors, (R, K, 9); None without a filter.
        nees: normalised squared errors by block of the filter, (R, K) each.
        nees_freedom: their degrees of freedom, (R, K) each.
        nis: sum of the normalised squared innovations since the previous epoch, by sensor, (R, K) each.
        nis_freedom: their degrees of freedom, (R, K) each.
    """

    position_ned: Array
    velocity_ned: Array
    attitude: Array
    sigma: Array | None = None
    nees: dict[str, Array] = field(default_factory=dict)
    nees_freedom: dict[str, Array] = field(default_factory=dict)
    nis: dict[str, Array] = field(default_factory=dict)
    nis_freedom: dict[str, Array] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, see `column_names`."""
        return column_names(tuple(self.nees), tuple(self.nis), self.sigma is not None)

    def column(self, name: str, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        """Return one of the columns `names` at some epochs of some runs, (R, E): a view."""
        kind, _, block = name.partition(" ")
        if block:
            return np.asarray(getattr(self, kind)[block][runs, epochs])
        number = COMPONENTS.index(name.removeprefix("sigma_"))
        if name.startswith("sigma_"):
            assert self.sigma is not None
            return self.sigma[runs, epochs, number]
        vectors: Array = getattr(self, VECTORS[number // 3])
        return vectors[runs, epochs, number % 3]

    def put(self, part: RunErrors, first: int) -> None:
        """Put the errors of runs from the row `first` on, with the same epochs, keys, blocks and sensors."""
        self.put_runs(part, first)
        for name in self.names:
            self.column(name, runs=slice(first, first + len(part)))[:] = part.column(name)

    def spans(self) -> list[slice]:
        """Return parts of the epochs whose columns are small, all runs of them together."""
        return spans_of(len(self), self.position_ned.shape[1])

    def groups(self) -> list[slice]:
        """Return parts of the runs whose columns are small, all epochs of them together."""
        return groups_of(len(self), self.position_ned.shape[1])


def column_names(blocks: Sequence[str], sensors: Sequence[str], sigma: bool) -> tuple[str, ...]:
    """Return the names of the columns that are kept of each run at each epoch.

    These are the components, each followed by "sigma_" and its name with a filter; then "nees" and "nees_freedom" with
    a space and a block of the filter's states, "nis" and "nis_freedom" with an aiding sensor.
    """
    kinds = (("nees", blocks), ("nees_freedom", blocks), ("nis", sensors), ("nis_freedom", sensors))
    errors = [text for name in COMPONENTS for text in ((name, f"sigma_{name}") if sigma else (name,))]
    return (*errors, *(f"{kind} {name}" for kind, names in kinds for name in names))


def spans_of(runs: int, epochs: int) -> list[slice]:
    """Return parts of the epochs, each as small as `AT_ONCE` allows for all runs, but of two epochs at least.

    Two, because numpy adds the runs of a single epoch in another order, which would change the last bits of a mean.
    """
    return _parts(epochs, min(math.ceil(runs * epochs / AT_ONCE), epochs // 2))


def groups_of(runs: int, epochs: int) -> list[slice]:
    """Return parts of the runs, each as small as `AT_ONCE` allows for all epochs."""
    return _parts(runs, min(math.ceil(runs * epochs / AT_ONCE), runs))


def _parts(length: int, number: int) -> list[slice]:
    edges = [length * part // max(number, 1) for part in range(max(number, 1) + 1)]
    return [slice(a, b) for a, b in pairwise(edges)]


def empty(
    count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str] = (), sensors: Sequence[str] = ()
) -> RunErrors:
    """Return the errors of runs that are still to be filled in, all NaN; with `sigma` if there are blocks."""

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


def bytes_of(runs: int, epochs: int, blocks: int = 0, sensors: int = 0) -> float:
    """Return the memory of the errors of some runs, bytes; of a filter with some blocks and aiding sensors."""
    return 8.0 * runs * epochs * (9 + 9 * bool(blocks) + 2 * blocks + 2 * sensors)


def rows_at(epochs: Array, time: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the epochs, (K,) s, that a solution at instants `time`, (N,) s, reaches, and its rows there.

    These are numbers of the epochs, (k,), and the last row at or before each, with the last of all, (k + 1,).
    """
    reached = np.flatnonzero((epochs >= time[0] - WITHIN) & (epochs <= time[-1] + WITHIN))
    rows = np.searchsorted(time, epochs[reached] + WITHIN, side="right") - 1
    return reached, np.append(rows, len(time) - 1)


def fill_in(errors: RunErrors, row: int, error: NavError, epochs: NDArray[np.intp]) -> None:
    """Fill in a run's errors."""
    for number, name in enumerate(VECTORS):
        values = getattr(error, name)
        getattr(errors, name)[row, epochs] = values[:-1]
        errors.final[row, 3 * number : 3 * number + 3] = values[-1]


def check_finite(error: NavError) -> None:
    """Raise for errors that are not finite."""
    finite = np.all([np.isfinite(getattr(error, name)).all(axis=1) for name in VECTORS], axis=0)
    if not finite.all():
        time = float(error.time[int(np.argmin(finite))])
        raise RunError(f"its errors are not finite at t = {time:.2f} s: it diverged.", time=time)
