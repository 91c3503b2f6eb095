"""The errors of very many runs, in a file without a name, from which a part is read at a time.

What statistics need at once is all runs at some epochs, or all epochs of some runs. The file holds spans of epochs one
after another; in a span the columns; in a column a row for each run. Either part is a few contiguous pieces.
"""

from __future__ import annotations

import tempfile
import threading
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles.run_errors import (
    COMPONENTS,
    EVERYTHING,
    KeptErrors,
    RunErrors,
    bytes_of,
    column_names,
    empty,
    groups_of,
    spans_of,
)
from sinssim.system.memory import machine_memory

IN_MEMORY = 128 * 2**20
"""Bytes of the errors of an ensemble up to which they are kept as arrays in memory."""
_OF_MEMORY = 0.7
_BYTES = 8


class StoredErrors(KeptErrors):
    """The errors of N runs at K epochs in a file; the numbers of a run that do not depend on the epoch are in memory.

    The other attributes of `RunErrors` are properties, which read the file at each use; `column` reads a part of it.
    """

    def __init__(
        self, count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str], sensors: Sequence[str], folder: Path
    ) -> None:
        """Begin with all values missing; the file in `folder` disappears with this object."""
        runs = empty(count, 0, keys, blocks, sensors)
        self.number, self.seed, self.end = runs.number, runs.seed, runs.end
        self.failure, self.values, self.final = runs.failure, runs.values, runs.final
        self._epochs, self._blocks, self._sensors = epochs, tuple(blocks), tuple(sensors)
        self.names = column_names(blocks, sensors, bool(blocks))
        self._place = {name: place for place, name in enumerate(self.names)}
        self._spans = spans_of(count, epochs)
        self._lock = threading.Lock()
        file = tempfile.TemporaryFile(dir=folder, prefix=".errors-", buffering=0)  # noqa: SIM115
        weakref.finalize(self, file.close)
        self._file = file

    def spans(self) -> list[slice]:
        """Return parts of the epochs whose columns are small, all runs of them together."""
        return self._spans

    def groups(self) -> list[slice]:
        """Return parts of the runs whose columns are small, all epochs of them together."""
        return groups_of(len(self), self._epochs)

    def put(self, part: RunErrors, first: int) -> None:
        """Put the errors of runs from the row `first` on, with the same epochs, keys, blocks and sensors."""
        self.put_runs(part, first)
        for span in self._spans:
            for name in self.names:
                rows = np.ascontiguousarray(part.column(name, span))
                self._write(rows, self._offset(name, span, first))

    def column(self, name: str, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        """Read one of the columns `names` at some epochs of some runs, (R, E).

        Raises:
            InputError: they do not fit in the memory.
        """
        first, last, _ = runs.indices(len(self))
        begin, end, _ = epochs.indices(self._epochs)
        found = self._room(last - first, end - begin)
        for span in self._spans:
            low, high = max(span.start, begin), min(span.stop, end)
            if low >= high or last <= first:
                continue
            rows = np.empty((last - first, span.stop - span.start))
            self._read(rows, self._offset(name, span, first))
            found[:, low - begin : high - begin] = rows[:, low - span.start : high - span.start]
        return found

    @property
    def position_ned(self) -> Array:
        """Position errors, (N, K, 3) m."""
        return self._stacked(COMPONENTS[:3])

    @property
    def velocity_ned(self) -> Array:
        """Velocity errors, (N, K, 3) m/s."""
        return self._stacked(COMPONENTS[3:6])

    @property
    def attitude(self) -> Array:
        """Rotation vectors of the attitude errors, (N, K, 3) rad."""
        return self._stacked(COMPONENTS[6:])

    @property
    def sigma(self) -> Array | None:
        """1σ that a filter states for the nine errors, (N, K, 9); None without a filter."""
        return self._stacked([f"sigma_{name}" for name in COMPONENTS]) if self._blocks else None

    @property
    def nees(self) -> Mapping[str, Array]:
        """Normalised squared errors by block of the filter, (N, K) each."""
        return self._named("nees", self._blocks)

    @property
    def nees_freedom(self) -> Mapping[str, Array]:
        """Their degrees of freedom."""
        return self._named("nees_freedom", self._blocks)

    @property
    def nis(self) -> Mapping[str, Array]:
        """Sums of the normalised squared innovations by sensor, (N, K) each."""
        return self._named("nis", self._sensors)

    @property
    def nis_freedom(self) -> Mapping[str, Array]:
        """Their degrees of freedom."""
        return self._named("nis_freedom", self._sensors)

    def _named(self, kind: str, names: Sequence[str]) -> Mapping[str, Array]:
        return {name: self.column(f"{kind} {name}") for name in names}

    def _stacked(self, names: Sequence[str]) -> Array:
        values = self._room(len(self), self._epochs, len(names))
        for span in self._spans:
            for place, name in enumerate(names):
                values[:, span, place] = self.column(name, span)
        return values

    def _room(self, *shape: int) -> Array:
        """Return an array that is still to be filled, if the memory holds it."""
        needed, have = float(np.prod(shape, dtype=np.float64)) * _BYTES, _OF_MEMORY * machine_memory()
        if needed > have:
            raise InputError(
                f"an array of {' × '.join(map(str, shape))} numbers needs {needed / 1e9:.3g} GB of memory, and "
                f"{have / 1e9:.3g} GB can be used on this machine. Read a part of the errors: errors.column(name, "
                "epochs, runs) for each of errors.spans(), for example."
            )
        return np.empty(shape)

    def _offset(self, name: str, span: slice, run: int) -> int:
        """Return where a run's row of a column in a span begins."""
        width = span.stop - span.start
        before = len(self) * len(self.names) * span.start
        return int(_BYTES * (before + self._place[name] * len(self) * width + run * width))

    def _write(self, values: Array, offset: int) -> None:
        left = values.data.cast("B")
        with self._lock:
            self._file.seek(offset)
            while left:
                left = left[self._file.write(left) :]

    def _read(self, values: Array, offset: int) -> None:
        left = values.data.cast("B")
        with self._lock:
            self._file.seek(offset)
            while left:
                count = self._file.readinto(left)
                assert count, "the file has a row for each run"
                left = left[count:]


Errors = RunErrors | StoredErrors
"""The errors of all runs of an ensemble: arrays, or a file if they are many."""


def errors_for(
    count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str], sensors: Sequence[str], folder: Path
) -> Errors:
    """Return the errors of an ensemble that are still to be put: in memory, or in a file if they are many."""
    if bytes_of(count, epochs, len(blocks), len(sensors)) <= IN_MEMORY:
        return empty(count, epochs, keys, blocks, sensors)
    return StoredErrors(count, epochs, keys, blocks, sensors, folder)
