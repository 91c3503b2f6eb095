"""The errors of the runs of an ensemble at its epochs: in memory, in a temporary file, and as Parquet tables.

Statistics need all runs at some epochs, or all epochs of some runs. The temporary file has no name and holds spans of
epochs one after another; in a span the columns; in a column a row for each run. Either part is a few contiguous pieces.
"""

from __future__ import annotations

import math
import tempfile
import threading
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, short_repr
from sinssim.errors import InputError, RunError
from sinssim.statistics.circular_error import to_nmi_h
from sinssim.system.files import draft
from sinssim.system.process import machine_memory

if TYPE_CHECKING:
    from sinssim.strapdown.navigation_error import NavError


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
OnRun = Callable[[], None]
"""Called after each finished run; it may raise to abandon the others."""
AT_ONCE = 2**20
"""Numbers of one column, runs times epochs, that statistics over all runs hold at a time: 8 MB."""


@dataclass
class KeptErrors:
    """Errors of R runs at K epochs, in memory or in a file.

    A value is NaN where a run failed, has ended, or its filter has not begun.
    """

    number: NDArray[np.int64]  # numbers of the runs, (R,)
    seed: NDArray[np.int64]  # their seeds, (R,)
    end: Array  # end of each run, s, (R,)
    failure: list[str]  # why a run failed, R texts, "" for a run that did not
    values: dict[str, Array]  # values of the varied keys by key, (R,) each
    final: Array  # the errors at each run's own end, (R, 9), in the order of `COMPONENTS`
    blocks: tuple[str, ...]  # blocks of a filter's states; none without a filter
    sensors: tuple[str, ...]  # its aiding sensors
    # columns by the planned path of a flight, see `sinssim.simulation.total_system_error.path_columns`
    path: tuple[str, ...] = field(default=(), kw_only=True)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, see `column_names`."""
        return column_names(self.blocks, self.sensors, bool(self.blocks), self.path)

    def column(self, name: str, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        """Return one of the columns `names` at some epochs of some runs, (R, E)."""
        raise NotImplementedError

    def stacked(self, names: Sequence[str]) -> Array:
        """Return neighbouring columns of one kind side by side, (R, K, n)."""
        raise NotImplementedError

    @property
    def position_ned(self) -> Array:
        """Position errors, (R, K, 3) m."""
        return self.stacked(COMPONENTS[:3])

    @property
    def velocity_ned(self) -> Array:
        """Velocity errors, (R, K, 3) m/s."""
        return self.stacked(COMPONENTS[3:6])

    @property
    def attitude(self) -> Array:
        """Rotation vectors of the attitude errors in the true local level, (R, K, 3) rad."""
        return self.stacked(COMPONENTS[6:])

    @property
    def sigma(self) -> Array | None:
        """1σ that a filter states for the nine errors, (R, K, 9); None without a filter."""
        return self.stacked([f"sigma_{name}" for name in COMPONENTS]) if self.blocks else None

    @property
    def nees(self) -> Mapping[str, Array]:
        """Normalised squared errors by block of the filter, (R, K) each."""
        return {name: self.column(f"nees {name}") for name in self.blocks}

    @property
    def nees_freedom(self) -> Mapping[str, Array]:
        """Their degrees of freedom."""
        return {name: self.column(f"nees_freedom {name}") for name in self.blocks}

    @property
    def nis(self) -> Mapping[str, Array]:
        """Sums of the normalised squared innovations since the previous epoch, by sensor, (R, K) each."""
        return {name: self.column(f"nis {name}") for name in self.sensors}

    @property
    def nis_freedom(self) -> Mapping[str, Array]:
        """Their degrees of freedom."""
        return {name: self.column(f"nis_freedom {name}") for name in self.sensors}

    def __len__(self) -> int:
        return len(self.number)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each run failed, (R,)."""
        return np.array([bool(text) for text in self.failure], dtype=np.bool_)

    @property
    def epochs(self) -> int:
        """Number of epochs."""
        raise NotImplementedError

    def spans(self) -> list[slice]:
        """Return parts of the epochs whose columns are small, each with all runs."""
        return spans_of(len(self), self.epochs)

    def groups(self) -> list[slice]:
        """Return parts of the runs whose columns are small, each with all epochs."""
        return groups_of(len(self), self.epochs)

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
    """Errors of runs in memory: `table` has them by column, run and epoch, (C, R, K). Columns are views of it."""

    table: Array

    def column(self, name: str, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        return self.table[self.names.index(name), runs, epochs]

    def stacked(self, names: Sequence[str]) -> Array:
        first, second = map(self.names.index, names[:2])
        step = second - first
        return np.moveaxis(self.table[first : first + step * len(names) : step], 0, -1)

    def put(self, part: RunErrors, first: int) -> None:
        """Put the errors of runs from the row `first` on, with the same epochs, keys, blocks and sensors."""
        self.put_runs(part, first)
        self.table[:, first : first + len(part)] = part.table

    @property
    def epochs(self) -> int:
        return int(self.table.shape[2])


def column_names(
    blocks: Sequence[str], sensors: Sequence[str], sigma: bool, path: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return the names of the columns that are kept of each run at each epoch.

    These are the components, each followed by "sigma_" and its name with a filter; then "nees" and "nees_freedom" with
    a space and a block of the filter's states, "nis" and "nis_freedom" with an aiding sensor; and those by a planned
    path.
    """
    kinds = (("nees", blocks), ("nees_freedom", blocks), ("nis", sensors), ("nis_freedom", sensors))
    errors = [text for name in COMPONENTS for text in ((name, f"sigma_{name}") if sigma else (name,))]
    return (*errors, *(f"{kind} {name}" for kind, names in kinds for name in names), *path)


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
    count: int,
    epochs: int,
    keys: Sequence[str],
    blocks: Sequence[str] = (),
    sensors: Sequence[str] = (),
    path: Sequence[str] = (),
) -> RunErrors:
    """Return the errors of runs that are still to be filled in, all NaN; with `sigma` if there are blocks."""
    return RunErrors(
        number=np.zeros(count, np.int64),
        seed=np.zeros(count, np.int64),
        end=np.full(count, np.nan),
        failure=[""] * count,
        values={key: np.full(count, np.nan) for key in keys},
        final=np.full((count, 9), np.nan),
        blocks=tuple(blocks),
        sensors=tuple(sensors),
        path=tuple(path),
        table=np.full((len(column_names(blocks, sensors, bool(blocks), path)), count, epochs), np.nan),
    )


def bytes_of(runs: int, epochs: int, blocks: int = 0, sensors: int = 0, path: int = 0) -> float:
    """Return the memory of the errors of some runs, bytes; of a filter with some blocks and aiding sensors, and of
    columns by a planned path."""
    return 8.0 * runs * epochs * (9 + 9 * bool(blocks) + 2 * blocks + 2 * sensors + path)


def rows_at(epochs: Array, time: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the epochs, (K,) s, that a solution at instants `time`, (N,) s, reaches, and its rows there.

    These are numbers of the epochs, (k,), and the last row at or before each, with the last of all, (k + 1,).
    """
    reached = np.flatnonzero((epochs >= time[0] - WITHIN) & (epochs <= time[-1] + WITHIN))
    rows = np.searchsorted(time, epochs[reached] + WITHIN, side="right") - 1
    return reached, np.append(rows, len(time) - 1)


def store_errors(errors: RunErrors, row: int, error: NavError, epochs: NDArray[np.intp]) -> None:
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


IN_MEMORY = 128 * 2**20
"""Bytes of the errors of an ensemble up to which they are kept as arrays in memory."""
_OF_MEMORY = 0.7
_BYTES = 8


class StoredErrors(KeptErrors):
    """The errors of many runs in a file, which is read at each use; what does not depend on the epoch is in memory."""

    def __init__(
        self, count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str], sensors: Sequence[str], folder: Path,
        path: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Begin with all values missing; the file in `folder` disappears with this object."""
        runs = empty(count, 0, keys, blocks, sensors, path)
        super().__init__(**{part.name: getattr(runs, part.name) for part in fields(KeptErrors)})
        self._epochs = epochs
        self._place = {name: place for place, name in enumerate(self.names)}
        self._spans = spans_of(count, epochs)
        self._lock = threading.Lock()
        file = tempfile.TemporaryFile(dir=folder, prefix=".errors-", buffering=0)  # noqa: SIM115
        weakref.finalize(self, file.close)
        self._file = file

    @property
    def epochs(self) -> int:
        return self._epochs

    def put(self, part: RunErrors, first: int) -> None:
        """Put the errors of runs from the row `first` on, with the same epochs, keys, blocks and sensors."""
        self.put_runs(part, first)
        for span in self._spans:
            for name in self.names:
                rows = np.ascontiguousarray(part.column(name, span))
                self._write(rows, self._offset(name, span, first))

    def column(self, name: str, epochs: slice = EVERYTHING, runs: slice = EVERYTHING) -> Array:
        """Read one of the columns `names` at some epochs of some runs, (R, E)."""
        first, last, _ = runs.indices(len(self))
        begin, end, _ = epochs.indices(self._epochs)
        values = self._room(last - first, end - begin)
        for span in self._spans:
            low, high = max(span.start, begin), min(span.stop, end)
            if low >= high or last <= first:
                continue
            rows = np.empty((last - first, span.stop - span.start))
            self._read(rows, self._offset(name, span, first))
            values[:, low - begin : high - begin] = rows[:, low - span.start : high - span.start]
        return values

    def stacked(self, names: Sequence[str]) -> Array:
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
    count: int, epochs: int, keys: Sequence[str], blocks: Sequence[str], sensors: Sequence[str], folder: Path,
    path: Sequence[str] = (),
) -> Errors:  # fmt: skip
    """Return the errors of an ensemble that are still to be put: in memory, or in a file if they are many."""
    if bytes_of(count, epochs, len(blocks), len(sensors), len(path)) <= IN_MEMORY:
        return empty(count, epochs, keys, blocks, sensors, path)
    return StoredErrors(count, epochs, keys, blocks, sensors, folder, path)


def write_tables(errors: Errors, epochs: Array, mean_rates: Array, end_rates: Array, folder: Path) -> tuple[Path, Path]:
    """Write `errors.parquet` and `runs.parquet`, with the runs' rates in both definitions, (N,) m/s."""
    import pyarrow as pa

    by_epoch = (pa.table(_by_epoch(errors, epochs, runs)) for runs in errors.groups())
    by_run = iter([pa.table(_by_run(errors, mean_rates, end_rates))])
    return _write(by_epoch, folder / "errors.parquet"), _write(by_run, folder / "runs.parquet")


def _write(parts: Iterator[Any], path: Path) -> Path:
    """Write the parts of a table, one after another."""
    import pyarrow.parquet as pq

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        first = next(parts)
        with draft(path) as beside, pq.ParquetWriter(beside, first.schema, compression="zstd") as writer:
            writer.write_table(first)
            for part in parts:
                writer.write_table(part)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
    return path


def _by_epoch(errors: Errors, epochs: Array, runs: slice) -> dict[str, Any]:
    number = errors.number[runs]
    return {
        "run": np.repeat(number, len(epochs)),
        "time_s": np.tile(epochs, len(number)),
        **{name: errors.column(name, runs=runs).ravel() for name in errors.names},
    }


def _by_run(errors: Errors, mean_rates: Array, end_rates: Array) -> dict[str, Any]:
    return {
        "run": errors.number,
        "seed": errors.seed,
        "end_s": errors.end,
        "failure": errors.failure,
        **errors.values,
        "mean_rate_nmi_h": to_nmi_h(mean_rates),
        "end_rate_nmi_h": to_nmi_h(end_rates),
        **{f"final_{name}": errors.final[:, i] for i, name in enumerate(COMPONENTS)},
    }
