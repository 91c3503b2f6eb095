"""Reads and writes the columns of a text file: its rows and fields, and blocks of numbers, by pyarrow.

Whatever knows the columns of a file (a format, a description, the inspection of an unknown one) reads them here. A
logger that began or ended within a row leaves a first or a last row that is cut short. Doubles are written with the
digits that give them back.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.system.files import open_file, open_text
from sinssim.system.process import machine_memory

WHITESPACE = "whitespace"
"""The delimiter for columns separated by any number of spaces and tabs."""
COMMENTS = ("#", "%")
"""Beginnings of lines that are no rows."""

Row = tuple[int, list[str]]
"""Number of a line, from 1, and its fields."""

_TAIL = 1 << 16  # bytes at the end of a file, which hold its last rows
_PART = re.compile(r"[-+0-9.eE:/TZ]*")
"""Part of a number or a date."""
_LONGEST = 1 << 20  # bytes of a line; a longer one is no row


class Layout(Protocol):
    """How rows and columns of a file are written.

    Attributes:
        delimiter: one character, or `WHITESPACE`.
        skip_lines: lines before the line of names, or before the numbers.
        numbered: whether columns are numbered, in a text file without a line of names.
        rows: texts by the name of a column, or by its number, from 1; None for all rows.
        decimal: the decimal sign.
    """

    @property
    def delimiter(self) -> str: ...
    @property
    def skip_lines(self) -> int: ...
    @property
    def numbered(self) -> bool: ...
    @property
    def rows(self) -> dict[str, str] | None: ...
    @property
    def decimal(self) -> str: ...


@dataclass(frozen=True)
class CutRows:
    """The rows of a file that were cut short."""

    end: int  # length of the file without a cut last row, bytes
    # first, last: line of a cut first and last row, from 1; None if it is whole
    first: int | None = None
    last: int | None = None
    notes: tuple[str, ...] = ()  # a sentence on each


def split(line: str, delimiter: str) -> list[str]:
    """Return the fields of a line, without blanks and quotation marks around them; a quoted delimiter ends no field."""
    if delimiter == WHITESPACE:
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.strip("\r\n ").split(delimiter)]
    fields = next(csv.reader([line.strip("\r\n ")], delimiter=delimiter, skipinitialspace=True), [])
    return [field.strip().strip('"').strip() for field in fields]


def text_rows(
    path: Path, delimiter: str, skip: int = 0, cut: CutRows | None = None, *, comments: bool = True
) -> Iterator[Row]:
    """Yield the rows of a text file, which may have any byte, that are not empty, with one character or `WHITESPACE`
    between fields, without those that were cut short and, with `comments`, those that begin with # or %."""
    left_out = () if cut is None else (cut.first, cut.last)
    with open_text(path, encoding="utf-8-sig", errors="surrogateescape") as file:  # which accepts any byte
        for number, line in enumerate(file, start=1):
            if number <= skip or number in left_out or not (plain := line.strip()):
                continue
            if not (comments and plain[0] in COMMENTS):
                yield number, split(line, delimiter)


def numbers_of(path: Path, rows: Iterable[Row], width: int, delimiter: str = WHITESPACE) -> Array:
    """Return rows of numbers: (N, width); NaN for empty fields."""
    numbers: list[list[float]] = []
    for line, fields in rows:
        if len(fields) != width:
            raise uneven(path, line, len(fields), str(width), delimiter)
        try:
            numbers.append([float(field or "nan") for field in fields])
        except ValueError as error:
            raise not_a_number(path, line, fields) from error
    return np.array(numbers).reshape(-1, width)


def uneven(path: Path, line: int, count: int, wanted: str, delimiter: str, hint: str = "") -> InputError:
    """Return the error on a row with another number of fields than wanted."""
    between = "blanks" if delimiter == WHITESPACE else repr(delimiter)
    return InputError(
        f"{path}, line {line}: it has {count} field{'s' * (count != 1)}; {wanted} separated by {between} are "
        f"needed{hint}."
    )


def is_number(field: str) -> bool:
    """Return whether a field is a number."""
    try:
        float(field)
    except ValueError:
        return False
    return True


def not_a_number(path: Path, line: int, fields: Sequence[str]) -> InputError:
    """Return the error on the first field of a row that is no number."""
    word = next((field for field in fields if field and not is_number(field)), "")
    return InputError(f"{path}, line {line}: {shortened(repr(word), 60)} is not a number.")


def cut_row(name: str, line: int, place: Literal["first", "last"], fields: int, width: int) -> str:
    """Return the sentence on a row that was cut short. `line`: its number, from 1."""
    return f"{name}, line {line}: the {place} row was cut short ({fields} of {width} fields) and is left out."


def cut_rows(path: Path, delimiter: str, skip: int, width: int | None = None) -> CutRows:
    """Find the first and the last row of a text file if they were cut short; none if the neighbour of a short row is
    not whole. A cut row has fewer fields than the row beside it, or than names of columns give (`width`), or ends
    within a number without the end of a line. A remark in words after the last row is left out like a cut row. Empty
    lines and those that begin with # or % are no rows; the delimiter is one character, or `WHITESPACE`."""
    with open_file(path) as file:
        begin: list[Row] = []
        for number in range(1, skip + 1000):
            line = file.readline(_LONGEST)
            if not line or len(begin) == 3:
                break
            if number > skip and (fields := _fields(line, delimiter)):
                begin.append((number, fields))
        size = file.seek(0, 2)
        file.seek(max(size - _TAIL, 0))
        end = file.read().splitlines(keepends=True)[-20:]
    if len(begin) < 3:
        return CutRows(size)
    width = width or len(begin[1][1])
    first, notes = None, []
    whole = len(begin[1][1]) == len(begin[2][1]) == width
    if whole and width - len(begin[0][1]) > 0 and _alike(begin[0][1][::-1], begin[1][1][::-1]):
        first = begin[0][0]
        notes.append(cut_row(path.name, first, "first", len(begin[0][1]), width))
    rows = [(k, fields) for k, line in enumerate(end) if (fields := _fields(line, delimiter))]
    if len(rows) < 2 or len(rows[-2][1]) != width:
        return CutRows(size, first, None, tuple(notes))
    k, fields = rows[-1]
    remark = len(fields) < width and not any(map(_numeric, fields)) and any(map(_numeric, rows[-2][1]))
    if not remark and not _alike(fields, rows[-2][1]):
        return CutRows(size, first, None, tuple(notes))
    whole = end[k].endswith((b"\n", b"\r")) or not _numeric(rows[-2][1][-1]) or _numeric(fields[-1])
    if len(fields) > width or (len(fields) == width and whole):
        return CutRows(size, first, None, tuple(notes))
    whole_bytes = size - sum(map(len, end[k:]))
    last = _lines(path, whole_bytes) + 1
    note = f"{path.name}, line {last}: the last line is no row of numbers and is left out."
    notes.append(note if remark else cut_row(path.name, last, "last", len(fields), width))
    return CutRows(whole_bytes, first, last, tuple(notes))


def _fields(line: bytes, delimiter: str) -> list[str]:
    """Return the fields of a row; none for an empty line, a comment, or one with quotation marks."""
    plain = line.decode("latin-1").strip()
    if not plain or plain[0] in COMMENTS or '"' in plain:
        return []
    return plain.split(None if delimiter == WHITESPACE else delimiter)


def _alike(some: list[str], row: list[str]) -> bool:
    """Return whether fields are numbers where those of a whole row are; of the last one, a part may be left."""
    *whole, part = some
    alike = all(_numeric(field) == _numeric(other) for field, other in zip(whole, row, strict=False))
    return alike and _PART.fullmatch(part) is not None


def _numeric(field: str) -> bool:
    return is_number(field.replace(",", "."))


def _lines(path: Path, end: int) -> int:
    """Return the number of lines within the first bytes of a file."""
    count = 0
    with open_file(path) as file:
        while end > 0 and (block := file.read(min(end, 1 << 20))):
            count, end = count + block.count(b"\n"), end - len(block)
    return count


def names_in(fields: list[str]) -> list[str]:
    """Return the names of columns in the fields of a line, which may begin with # or %."""
    first = fields[0].lstrip("".join(COMMENTS)).strip()
    return [first, *fields[1:]] if first or not fields[0] else fields[1:]


def read_rows(path: Path, layout: Layout, *, comments: bool = False) -> Iterator[Row]:
    """Yield the line of names, if there is one, and every row that is read. `path`: a text file; any byte is accepted;
    `comments`: whether lines that begin with # or % are left out."""
    rows, names = text_rows(path, layout.delimiter, layout.skip_lines, comments=comments), None
    if not layout.numbered and (first := next(rows, None)) is not None:
        names = names_in(first[1])
        yield first[0], names
    if not layout.rows:
        yield from rows
        return
    wanted = _wanted(path, layout.rows, names)
    for number, fields in rows:
        if all(k < len(fields) and fields[k] == text for k, text in wanted):
            yield number, fields


def selected_text(path: Path, layout: Layout) -> bytes:
    """Return the rows of a file that the layout selects, without the line of names."""
    text = io.StringIO(newline="")
    delimiter = " " if layout.delimiter == WHITESPACE else layout.delimiter
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    rows = list(read_rows(path, layout))[not layout.numbered :]
    if not rows:
        chosen = ", ".join(f"{name} = {value}" for name, value in (layout.rows or {}).items())
        raise InputError(f"{path} has no row with {chosen}; see the key rows.")
    writer.writerows(fields for _, fields in rows)
    return text.getvalue().encode("utf-8", "surrogateescape")


def _wanted(path: Path, rows: dict[str, str], names: Sequence[str] | None) -> list[tuple[int, str]]:
    """Return the columns that select rows, from 0, and their texts."""
    wanted = []
    for name, text in rows.items():
        if names is not None and name in names:
            wanted.append((names.index(name), text))
        elif names is not None:
            raise InputError(f"{path}: rows: {unknown_name('column', name, names)}")
        elif name.isdecimal() and int(name) >= 1:
            wanted.append((int(name) - 1, text))
        else:
            raise InputError(f"{path}: rows: {name!r} is no number of a column, from 1; the columns have no names.")
    return wanted


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
    """Read columns of any kind, numbers, dates, words, with one character or `WHITESPACE` between them, without lines
    that begin with # or % for `comments`: a table of pyarrow with the columns "0", "1", …, or some of them. The options
    are those of pyarrow's `ReadOptions`, `ParseOptions` and `ConvertOptions`."""
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
    """Read a text file of numbers, with one character or `WHITESPACE` between them: (N, k) with k in `widths` and N ≥
    1; "nan" and empty fields are NaN. Lines that are empty or begin with # or % are left out, and so are those to skip
    at the beginning, such as names of columns, and a first and a last row that were cut short, on each of which a note
    is added."""
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
    """Return the error that names the first row which is not as the others. `error`: what the parser said, for a file
    in which no such row is found."""
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
    """Return at most some first rows of a text file of numbers with blanks between them, (R, k), from its first bytes,
    for recognising its format; None if the rows are not numbers of the same count. A row that the head cuts off is left
    out."""
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
    """Refuse values that are not finite. `values`: (N,) or (N, k)."""
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
    """Write columns of numbers or words. `columns`: (N,) each; `header`: lines above, each with its end of line."""
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
    """Return times, (N,) s, without the last digits, which sums of times leave: 345618.01, not 345618.00999999995."""
    return np.round(time, digits)


def columns_of(*parts: Array) -> list[Array]:
    """Return columns of arrays: (N,) each. `parts`: (N,) or (N, k) each."""
    return [column for part in parts for column in (part[:, np.newaxis] if part.ndim == 1 else part).T]
