"""Tables of columns as arrays of doubles: text, Parquet or npz as described, or columns named with their units, in SI.

Files beyond the memory are refused. Columns named with their units are text or Parquet; their quantities are those of
the dictionary of names (`sinssim.logs.column_names`).
"""

from __future__ import annotations

import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.logs.column_description import Column
from sinssim.logs.column_names import SPELLED, meaning_of, usual_name
from sinssim.logs.gps_time import date_seconds, is_date
from sinssim.logs.numeric_columns import (
    COMMENTS,
    CutRows,
    Layout,
    Row,
    bad_row,
    cut_rows,
    read_columns,
    read_rows,
    selected_text,
    split,
)
from sinssim.logs.recorded_streams import Clock
from sinssim.system.files import open_file, user_file
from sinssim.system.process import machine_memory

TEXT = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log")
"""Suffixes of text files."""
SUFFIXES = (*TEXT, ".parquet", ".npz")
"""Suffixes of the files that can be a log."""

_COPIES = 4  # copies of every number at once: as read, by columns, in the block's axes and in SI, as increments
_BYTES_OF_TEXT = 8  # bytes of memory per byte of text: a number has at least two bytes, an entry in a list of lines 60
_SHOWN = 20  # names of columns listed in a message
_LONGEST = 60  # characters of a name or value in a message


class Table:
    """The columns of one log.

    Args:
        path: a text file (`TEXT`), or a .parquet or .npz file.
        layout: description of the columns.
        wanted: the columns to read.
        kind: one of `SUFFIXES`; default: that of the file.
        comments: whether lines of text that begin with # or % are left out.

    Raises:
        InputError: the file cannot be read or does not fit into memory, or two of its columns have the same name.

    Attributes:
        notes: a sentence on each row that was cut short and is left out.
    """

    def __init__(
        self, path: Path, layout: Layout, wanted: Sequence[Column], kind: str | None = None, *, comments: bool = False
    ) -> None:
        suffix = kind or path.suffix.lower()
        if suffix not in SUFFIXES:
            raise InputError(
                f"{path}: a log is a text file ({', '.join(TEXT)}) or a .parquet or .npz file, not "
                f"{suffix or 'a file without a suffix'}."
            )
        if layout.numbered and suffix not in TEXT:
            raise InputError(
                f"{path}: the columns of a {suffix} file have names; only text files without names have numbered "
                "columns."
            )
        self.path, self._layout, self._text, self._comments = path, layout, suffix in TEXT, comments
        self.notes: tuple[str, ...] = ()
        self._first_cut: int | None = None
        if layout.rows and not self._text:
            raise InputError(f"{path}: rows selects lines of text files only, not of a {suffix} file.")
        try:
            with open_file(path):  # its message for a missing file is clearer than pyarrow's
                pass
            if self._text:
                self.names, self._columns = self._read_text(frozenset(wanted))
            else:
                self.names, self._columns = (_parquet if suffix == ".parquet" else _npz)(path, frozenset(wanted))
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
        except InputError:
            raise
        except MemoryError as error:
            raise InputError(f"{path} does not fit into memory: {error}. Read a part of it.") from error
        except Exception as error:  # numpy, pyarrow and zipfile raise various errors for an invalid file
            reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
            words = f"a {suffix} file"
            raise InputError(f"{path} cannot be read as {words}: {reason[:300] or type(error).__name__}.") from error

    def _read_text(self, wanted: frozenset[Column]) -> Columns:
        """Return the names of the columns of a text file, and the wanted ones."""
        import pyarrow as pa

        path, layout = self.path, self._layout
        _check_text(path, layout)
        size = _BYTES_OF_TEXT * path.stat().st_size
        if size > machine_memory():
            raise _too_large(path, size)
        skip, width = layout.skip_lines, None
        if not layout.numbered and (names := next(self._rows(), None)) is not None:
            skip, width = names[0], len(names[1])
        if layout.rows:
            cut = CutRows(path.stat().st_size)  # rows that are not selected may have any width
        else:
            cut = cut_rows(path, layout.delimiter, skip, width)
        self.notes, self._first_cut = cut.notes, cut.first
        rows = (row for row in self._rows() if row[0] not in (cut.first, cut.last))
        line, fields = next(rows, (0, []))
        if not fields:
            raise InputError(
                f"{path} holds no samples: it has no lines (delimiter = {layout.delimiter!r}, skip_lines = "
                f"{layout.skip_lines})."
            )
        known: list[Column] = list(range(1, len(fields) + 1)) if layout.numbered else list(fields)
        numbers = {name: str(k) for k, name in enumerate(known) if name in wanted and known.count(name) == 1}
        text = selected_text(path, layout) if layout.rows else path
        try:
            table = read_columns(
                text, layout.delimiter, len(fields), skip, cut, comments=self._comments, decimal_point=layout.decimal,
                include_columns=[*numbers.values()] or ["0"],
            )  # fmt: skip
        except pa.ArrowException as error:
            hint = f", as in line {line} (skip_lines = {layout.skip_lines})"
            raise bad_row(path, rows, [len(fields)], layout.delimiter, error, hint=hint) from error
        columns = {name: table.column(k) for name, k in numbers.items()}
        return known, {
            name: (column.cast(pa.string()) if pa.types.is_temporal(column.type) else column).to_numpy()
            for name, column in columns.items()
        }

    def _rows(self) -> Iterator[Row]:
        return read_rows(self.path, self._layout, comments=self._comments)

    @property
    def rows(self) -> int:
        """Number of rows of the columns that were read."""
        return len(next(iter(self._columns.values())))

    def place(self, sample: int) -> str:
        """Return the place of a sample for a message: "log.csv, sample 7 (line 9)"."""
        if self._text:
            rows = self._rows()
            if not self._layout.numbered:
                next(rows, None)
            for k, (line, _) in enumerate(row for row in rows if row[0] != self._first_cut):
                if k == sample:
                    return f"{self.path}, sample {sample} (line {line})"
        return f"{self.path}, sample {sample}"

    def column(self, name: Column, width: int = 1, *, gaps: bool = False) -> Array:
        """Return a column as doubles: (N,), or (N, 3) for an array of three columns. With `gaps` numbers may be
        missing; they are then NaN."""
        if name not in self._columns:
            raise self._missing(name)
        raw = self._columns[name]
        shown = _short(repr(name))
        if raw.ndim == 2 and raw.shape[1] == width == 1:
            raw = raw[:, 0]
        if raw.shape[1:] != (() if width == 1 else (width,)) or raw.ndim == 0:
            wanted = "one number per sample, (N,)," if width == 1 else f"{width} numbers per sample, (N, {width}),"
            raise InputError(f"{self.path}: the column {shown} has shape {raw.shape}; {wanted} are needed.")
        if raw.dtype.kind in "cMmbV":
            what = {"c": "complex numbers", "b": "true and false", "V": "records"}.get(raw.dtype.kind, "dates or times")
            raise InputError(f"{self.path}: the column {shown} holds {what} ({raw.dtype}); numbers are needed.")
        try:
            values = np.asarray(raw, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            k = next((k for k, value in enumerate(raw.flat) if not _is_number(value)), 0)
            hint = (
                " If it belongs to a heading, skip the heading (skip_lines) and number the columns."
                if k == 0 and not self._comments
                else ""
            )
            raise InputError(
                f"{self.place(k // width)}: the column {shown} holds {_short(repr(raw.item(k)))}, not a number.{hint}"
            ) from error
        if not values.size:
            raise InputError(f"{self.path} holds no samples: the column {shown} is empty.")
        if gaps:
            return values
        finite = np.isfinite(values) if width == 1 else np.isfinite(values).all(axis=1)
        if not finite.all():
            raise InputError(f"{self.place(int(np.argmin(finite)))}: the column {shown} is empty or not finite.")
        return values

    def times(self, name: Column, unit: float) -> tuple[Array, Clock | None]:
        """Return a column of times, which may hold dates or times of day, (N,) s, from numbers in a unit, s, and the
        clock that dates give; None for numbers and for times of day."""
        raw = self.texts(name)
        if raw is None or not is_date(raw[0]):
            return self.column(name) * unit, None
        time, clock = date_seconds(raw)
        if not np.isfinite(time).all():
            k = int(np.argmin(np.isfinite(time)))
            raise InputError(f"{self.place(k)}: the column {_short(repr(name))} contains {raw[k]!r} instead of a date.")
        return time, clock

    def texts(self, name: Column) -> list[str] | None:
        """Return the fields of a column that begins with a text, (N,); None for another one."""
        raw = self._columns.get(name)
        words = raw is not None and raw.dtype.kind == "O" and len(raw) > 0 and isinstance(raw[0], str)
        return raw.tolist() if words and raw is not None else None

    def _missing(self, name: Column) -> InputError:
        if isinstance(name, int):
            return InputError(f"{self.path}: there is no column {name}; it has {len(self.names)} columns.")
        names = [_short(str(known)) for known in self.names]
        if Counter(self.names)[name] > 1:
            return InputError(
                f"{self.path} has {Counter(self.names)[name]} columns {_short(repr(name))}; one is needed."
            )
        if len(names) > _SHOWN:
            near = unknown_name("column", _short(name), names)
            return InputError(f"{self.path}: {str(near).split(' Known: ')[0]} It has {len(names)} columns.")
        return InputError(f"{self.path}: {unknown_name('column', _short(name), names)}")


Columns = tuple[list[Column], dict[Column, NDArray[Any]]]


def _npz(path: Path, wanted: frozenset[Column]) -> Columns:
    if not zipfile.is_zipfile(user_file(path)):
        raise ValueError("it is not an archive of arrays as written by numpy.savez")
    with zipfile.ZipFile(user_file(path)) as archive:
        names: list[Column] = [name.removesuffix(".npy") for name in archive.namelist()]
        members = [info for info in archive.infolist() if info.filename.removesuffix(".npy") in wanted]
        _fits(path, sum(info.file_size for info in members))
        arrays: dict[Column, NDArray[Any]] = {}
        for info in members:
            with archive.open(info) as file:
                shape, _, kind = _header(file)
                # the size in a header is used only if the archive is large enough
                if np.prod(shape, dtype=float) * kind.itemsize > info.file_size:
                    raise ValueError(f"the array {info.filename} of shape {shape} is incomplete")
            with archive.open(info) as file:
                arrays[info.filename.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    return names, {name: values for name, values in arrays.items() if names.count(name) == 1}


def _header(file: Any) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        return np.lib.format.read_array_header_1_0(file)
    return np.lib.format.read_array_header_2_0(file)


def _parquet(path: Path, wanted: frozenset[Column]) -> Columns:
    from pyarrow import parquet

    with parquet.ParquetFile(user_file(path)) as file:
        raw = file.schema_arrow.names
        names: list[Column] = [name.strip().strip('"') for name in raw]
        chosen = {n: name for name, n in zip(raw, names, strict=True) if n in wanted and names.count(n) == 1}
        _fits(path, 8 * file.metadata.num_rows * len(chosen))
        table = file.read(columns=[*chosen.values()])
    return names, {name: table.column(of).to_numpy() for name, of in chosen.items()}


def _check_text(path: Path, layout: Layout) -> None:
    """Refuse a file that is not text, or whose line of names is not in UTF-8."""
    with open_file(path) as file:
        first = file.read(4096)
        if first.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in first:
            raise InputError(
                f"{path}, line 1: this is not text in UTF-8; it looks like "
                + ("UTF-16" if first[:2] in (b"\xff\xfe", b"\xfe\xff") else "binary data or UTF-16")
                + ". Save it as UTF-8."
            )
        file.seek(0)
        for _ in range(layout.skip_lines):
            if not file.readline():
                lines = sum(1 for _ in open_file(path))
                raise InputError(f"{path} has {lines} lines; skip_lines = {layout.skip_lines} skips all of them.")
        names = b"" if layout.numbered else file.readline(1 << 20)
    try:
        names.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}, line {layout.skip_lines + 1}: the line of names is not in UTF-8, its byte {error.start + 1} is "
            f"0x{names[error.start]:02x}. Save the file as UTF-8, or skip that line (skip_lines = "
            f"{layout.skip_lines + 1}) and number the columns."
        ) from error


def _fits(path: Path, size: int) -> None:
    """Refuse a file whose columns, including copies, do not fit into the machine's memory."""
    if _COPIES * size > machine_memory():
        raise _too_large(path, _COPIES * size)


def _too_large(path: Path, size: int) -> InputError:
    return InputError(
        f"{path} would need {size / 1e9:.3g} GB of memory; this machine has {machine_memory() / 1e9:.3g} GB. Split it "
        "into parts, or average samples first."
    )


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"


def _is_number(value: Any) -> bool:
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


_PARQUET = b"PAR1"
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")
_ANGLES = ("roll", "pitch", "heading")


class _Layout(NamedTuple):
    delimiter: str
    skip_lines: int = 0
    numbered: bool = False
    decimal: str = "."
    rows: dict[str, str] | None = None


def names_of(path: Path, head: bytes) -> tuple[str, list[str]]:
    """Return the delimiter of a table, "" for Parquet, and the names of its columns from its first bytes; no names if
    the file is no table."""
    if head.startswith(_PARQUET):
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            return "", list(pq.read_schema(user_file(path)).names)
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{path} cannot be read as Parquet: {error}.") from error
    lines = head.decode("utf-8-sig", "replace").splitlines()
    line = next((line for line in lines if line.strip() and not line.startswith(COMMENTS)), "")
    delimiter = max(",;\t", key=line.count)
    return delimiter, split(line, delimiter) if line else []


class NamedTable:
    """A table with named columns.

    Args:
        path: the file.
        plain: names of further columns that are read, beside those of the dictionary.

    Raises:
        InputError: it cannot be read, has no names, or two columns of one name.

    Attributes:
        names: of all columns.
        used: those that were asked for.
        notes: a sentence on each row that was cut short and is left out.
    """

    def __init__(self, path: Path, plain: Sequence[str] = ()) -> None:
        with open_file(path) as file:
            delimiter, self.names = names_of(path, file.read(1 << 16))
        if not self.names:
            raise InputError(f"{path} is empty.")
        if doubled := [name for name in self.names if self.names.count(name) > 1]:
            raise InputError(f"{path}: the column {shortened(doubled[0])!r} appears twice.")
        wanted = [name for name in self.names if name in plain or meaning_of(name) is not None]
        kind = ".csv" if delimiter else ".parquet"
        self.path, self.used = path, set[str]()
        self.table = Table(path, _Layout(delimiter or ","), wanted, kind, comments=True)
        self.notes = self.table.notes

    @property
    def listed(self) -> str:
        """The names, for a message."""
        return shortened(", ".join(self.names), 300)

    @property
    def unused(self) -> list[str]:
        """Names of columns that were not asked for."""
        return [name for name in self.names if name not in self.used]

    def find(self, quantity: str) -> list[tuple[str, str]]:
        """Return name and unit of the columns of a quantity, "" for a name without a unit."""
        meanings = ((name, meaning_of(name)) for name in self.names)
        return [(name, meaning[1]) for name, meaning in meanings if meaning is not None and meaning[0] == quantity]

    def numbers(self, name: str) -> Array:
        """Return a column as it is, NaN for empty fields, (N,)."""
        self.used.add(name)
        return self.table.column(name, gaps=True)

    def column(self, quantity: str) -> Array | None:
        """Return the first column of a quantity, SI, (N,); None without one."""
        named = next(iter(self.find(quantity)), None)
        if named is None:
            return None
        values, size = self.numbers(named[0]), SPELLED.get(named[1], 1.0)
        return values if size == 1.0 else values * size

    def complete(self, quantities: Sequence[str]) -> bool:
        """Return whether the columns of several quantities are there."""
        there = [quantity for quantity in quantities if self.find(quantity)]
        missing = [usual_name(quantity) for quantity in quantities if quantity not in there]
        if there and missing:
            given = " and ".join(self.find(quantity)[0][0] for quantity in there)
            raise InputError(f"{self.path} has {given} but not {' and '.join(missing)}: give all of them, or none.")
        return bool(there)

    def vector(self, quantities: Sequence[str]) -> Array | None:
        """Return the columns of several quantities side by side, SI, (N, k); None if none is there."""
        if not self.complete(quantities):
            return None
        return np.column_stack([column for q in quantities if (column := self.column(q)) is not None])

    def quaternion(self) -> Array | None:
        """Return the columns of a quaternion, scalar first, (N, 4); None without them."""
        return self.vector(_QUATERNION)

    def attitude(self) -> Array | None:
        """Return q_nb of the columns of roll, pitch and heading, (N, 4); None without them."""
        angles = self.vector(_ANGLES)
        return None if angles is None else rotation.quaternion_from_euler(*angles.T)
