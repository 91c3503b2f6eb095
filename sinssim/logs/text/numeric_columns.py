"""Reads and writes the columns of a text file: blocks of bytes without heading, comments and cut rows, by pyarrow.

Whatever knows the columns of a file (a format, a description, the inspection of an unknown one) reads them here.
Doubles are written with the digits that give them back.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.text.rows import (
    COMMENTS,
    WHITESPACE,
    CutRows,
    Row,
    cut_rows,
    is_number,
    not_a_number,
    text_rows,
    uneven,
)
from sinssim.system.resources import machine_memory
from sinssim.system.user_file import open_file

_BLOCK = 1 << 20  # bytes of text at once
_COMMENT_LINE = re.compile(rb"(?m)^[ \t]*[#%][^\n]*\n?")


class _Rows(io.RawIOBase):
    """The rows of a file, for pyarrow: without heading and cut rows; blanks are single, if they separate columns."""

    def __init__(self, path: Path, delimiter: str, skip: int, cut: CutRows, *, comments: bool) -> None:
        self._path, self._comments = path, comments
        self._blanks, self._end = delimiter == WHITESPACE, cut.end
        self._file = open_file(path)
        self._rest = self._ready = b""
        for _ in range(cut.first or skip):
            self._file.readline()

    def readable(self) -> bool:
        return True

    def close(self) -> None:
        self._file.close()
        super().close()

    def first_line(self) -> bytes:
        """Return the first line that is not read yet, or the beginning of a long one; b"" at the end."""
        while not self._ready and (block := self._block()):
            if not (self._comments or self._blanks):
                self._ready = block
                continue
            at = block.rfind(b"\n") + 1
            if at:
                self._ready, self._rest = self._plain(self._rest + block[:at]), block[at:]
            else:
                self._rest += block
            if len(self._rest) > 16 * _BLOCK:
                raise InputError(f"{self._path}: a line has over {len(self._rest)} bytes; this is not text in columns.")
        if not self._ready:
            self._ready, self._rest = self._plain(self._rest), b""
        at = self._ready.find(b"\n")
        return self._ready if at < 0 else self._ready[:at]

    def read(self, size: int = -1) -> bytes:
        """Return up to so many bytes; none at the end."""
        self.first_line()
        if not 0 <= size < len(self._ready):
            size = len(self._ready)
        ready, self._ready = self._ready[:size], self._ready[size:]
        return ready

    def _block(self) -> bytes:
        return self._file.read(max(min(_BLOCK, self._end - self._file.tell()), 0))

    def _plain(self, text: bytes) -> bytes:
        """Return whole lines without comments and superfluous blanks."""
        if b"\r" in text:
            text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        if self._comments and b"\0" in text:
            raise ValueError("zero bytes")
        if self._comments and (b"#" in text or b"%" in text):
            text = _COMMENT_LINE.sub(b"", text)
        if self._blanks:
            text = text.replace(b"\t", b" ")
            while b"  " in text:
                text = text.replace(b"  ", b" ")
        if b" \n" in text:
            text = text.replace(b" \n", b"\n")
        return text.replace(b"\n ", b"\n").strip(b" ").lstrip(b"\n")


def _parse(source: _Rows | io.BytesIO | Path, delimiter: str, width: int, **options: Any) -> Any:
    from pyarrow import csv

    reads, parses = ({k: options.pop(k) for k in keys if k in options} for keys in (_READS, _PARSES))
    return csv.read_csv(
        source,
        read_options=csv.ReadOptions(column_names=[str(k) for k in range(width)], block_size=_BLOCK, **reads),
        parse_options=csv.ParseOptions(delimiter=" " if delimiter == WHITESPACE else delimiter, **parses),
        convert_options=csv.ConvertOptions(**options),
    )


_READS = ("use_threads", "encoding", "skip_rows")
_PARSES = ("quote_char", "invalid_row_handler")


def read_columns(
    rows: Path | bytes, delimiter: str, width: int, skip: int = 0, cut: CutRows | None = None, *,
    comments: bool = False, **options: Any,
) -> Any:  # fmt: skip
    """Read columns of any kind: numbers, dates, words.

    Args:
        delimiter: one character, or `WHITESPACE`.
        comments: whether lines that begin with # or % are left out.
        **options: of pyarrow's `ReadOptions`, `ParseOptions` and `ConvertOptions`.

    Returns:
        A table of pyarrow with the columns "0", "1", …, or some of them.
    """
    if isinstance(rows, bytes):
        return _parse(io.BytesIO(rows), delimiter, width, **options)
    size = rows.stat().st_size
    cut = cut or CutRows(size)
    with _Rows(rows, delimiter, skip, cut, comments=comments) as source:
        if source.first_line():
            if comments or delimiter == WHITESPACE or cut.end < size:
                return _parse(source, delimiter, width, **options)
            return _parse(rows, delimiter, width, skip_rows=cut.first or skip, **options)  # pyarrow reads it faster
    from pyarrow import array, float64, table

    return table({str(k): array([], float64()) for k in range(width)})


def read_numbers(
    path: Path, widths: Collection[int], notes: list[str], *, delimiter: str = WHITESPACE, skip: int = 0
) -> Array:
    """Read a text file of numbers.

    Lines that are empty or begin with # or % are left out, and so are a first and a last row that were cut short.

    Args:
        notes: a sentence on each row that was cut short is added.
        delimiter: one character, or `WHITESPACE`.
        skip: lines at the beginning that are left out, for example names of columns.

    Returns:
        (N, k) with k in `widths` and N ≥ 1; "nan" and empty fields are NaN.
    """
    from pyarrow import float64

    try:
        if 5 * path.stat().st_size > machine_memory():
            raise InputError(f"{path} does not fit into this machine's memory. Split it into parts.")
        cut = cut_rows(path, delimiter, skip)
        notes += cut.notes
        with _Rows(path, delimiter, skip, cut, comments=True) as source:
            first = source.first_line()
            if not first:
                raise InputError(f"{path} holds no rows of numbers.")
            width = first.count(b" " if delimiter == WHITESPACE else delimiter.encode()) + 1
            if width not in widths:
                raise ValueError("unexpected number of columns")
            table = _parse(
                source, delimiter, width, use_threads=False, quote_char=False,
                column_types={str(k): float64() for k in range(width)},
                null_values=["", "nan", "NaN", "NAN", "-nan"],
            )  # fmt: skip
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    except InputError:
        raise
    except Exception as error:  # pyarrow raises various errors for a row that is not as the others
        raise bad_row(path, text_rows(path, delimiter, skip, cut), widths, delimiter, error, numbers=True) from error
    numbers = np.empty((width, table.num_rows))  # columns are contiguous
    for column, read in zip(numbers, table.columns, strict=True):
        column[:] = read.to_numpy()
    return numbers.T


def bad_row(
    path: Path, rows: Iterable[Row], widths: Collection[int], delimiter: str, error: Exception, *, hint: str = "",
    numbers: bool = False,
) -> InputError:  # fmt: skip
    """Return the error that names the first row which is not as the others.

    Args:
        error: what the parser said, for a file in which no such row is found.
    """
    first = 0
    for line, fields in rows:
        if any("\0" in field for field in fields):
            return InputError(f"{path}, line {line}: this is not text, it has zero bytes.")
        if len(fields) not in widths or (first and len(fields) != first):
            wanted = str(first or " or ".join(str(width) for width in sorted(widths)))
            return uneven(path, line, len(fields), wanted, delimiter, hint)
        first = len(fields)
        if numbers and not all(is_number(field or "nan") for field in fields):
            return not_a_number(path, line, fields)
    reason = "".join(c if c.isprintable() else " " for c in str(error)).strip().rstrip(".")
    return InputError(f"{path} cannot be read as {'numbers' if numbers else 'text'} in columns: {reason[:300]}.")


def head_numbers(head: bytes, rows: int = 5) -> Array | None:
    """Return the first rows of a text file of numbers with blanks between them, for recognising its format.

    Args:
        head: the first bytes of the file.
        rows: number of rows wanted; a row that the head cuts off is left out.

    Returns:
        (R, k) with R ≤ rows, or None if the rows are not numbers of the same count.
    """
    if b"\0" in head:
        return None
    lines = head.splitlines()
    if len(head) >= 4096 and lines:
        lines = lines[:-1]
    numbers: list[list[float]] = []
    for line in lines:
        if not line.strip() or line.lstrip()[:1].decode("latin-1") in COMMENTS:
            continue
        try:
            numbers.append([float(field) for field in line.split()])
        except ValueError:
            return None
        if len(numbers) == rows:
            break
    if len(numbers) > 2 and len(numbers[0]) < len(numbers[1]):  # cut short
        del numbers[0]
    if not numbers or any(len(row) != len(numbers[0]) for row in numbers):
        return None
    return np.array(numbers)


def check_finite(path: Path, values: Array, what: str) -> None:
    """Refuse values that are not finite.

    Args:
        values: (N,) or (N, k).
    """
    fine = np.isfinite(values) if values.ndim == 1 else np.isfinite(values).all(axis=1)
    if not fine.all():
        raise InputError(f"{path}, row {int(np.argmin(fine)) + 1}: the {what} is missing or not finite.")


def write_columns(
    path: Path,
    columns: Sequence[NDArray[Any] | Sequence[str]],
    *,
    header: str = "",
    delimiter: str = " ",
) -> None:
    """Write columns of numbers or words.

    Args:
        columns: (N,) each.
        header: lines above, each with its end of line.
    """
    import pyarrow as pa
    from pyarrow import csv

    names = [str(i) for i in range(len(columns))]
    table = pa.table({name: pa.array(np.ascontiguousarray(c) if isinstance(c, np.ndarray) else c)
                      for name, c in zip(names, columns, strict=True)})  # fmt: skip
    with path.open("wb") as file:
        file.write(header.encode())
        options = csv.WriteOptions(include_header=False, delimiter=delimiter, quoting_style="none")
        csv.write_csv(table, file, options)


def rounded(time: Array, digits: int = 9) -> Array:
    """Return times without the last digits, which sums of times leave: 345618.01, not 345618.00999999995.

    Args:
        time: (N,) s.

    Returns:
        (N,) s.
    """
    return np.round(time, digits)


def columns_of(*parts: Array) -> list[Array]:
    """Return columns of arrays: (N,) each.

    Args:
        parts: (N,) or (N, k) each.
    """
    return [column for part in parts for column in (part[:, np.newaxis] if part.ndim == 1 else part).T]
