"""The rows of a text file in columns: their fields, those that were cut short, those in which columns have given texts.

A logger that began or ended within a row leaves a first or a last row that is cut short.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.system.user_file import open_file, open_text

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


class RowLayout(Protocol):
    """How the rows of a file are written.

    Attributes:
        delimiter: one character, or `WHITESPACE`.
        skip_lines: lines before the line of names, or before the numbers.
        numbered: whether columns are numbered, in a text file without a line of names.
        rows: texts by the name of a column, or by its number, from 1; None for all rows.
    """

    @property
    def delimiter(self) -> str: ...
    @property
    def skip_lines(self) -> int: ...
    @property
    def numbered(self) -> bool: ...
    @property
    def rows(self) -> dict[str, str] | None: ...


@dataclass(frozen=True)
class CutRows:
    """The rows of a file that were cut short.

    Attributes:
        end: length of the file without a cut last row, bytes.
        first, last: line of a cut first and last row, from 1; None if it is whole.
        notes: a sentence on each.
    """

    end: int
    first: int | None = None
    last: int | None = None
    notes: tuple[str, ...] = ()


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
    """Yield the rows of a text file that are not empty.

    Args:
        path: a text file; any byte is accepted.
        delimiter: one character, or `WHITESPACE`.
        cut: rows that were cut short, which are left out.
        comments: whether lines that begin with # or % are left out.
    """
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
    """Return the sentence on a row that was cut short.

    Args:
        line: its number, from 1.
    """
    return f"{name}, line {line}: the {place} row was cut short ({fields} of {width} fields) and is left out."


def cut_rows(path: Path, delimiter: str, skip: int, width: int | None = None) -> CutRows:
    """Find the first and the last row of a text file if they were cut short.

    A cut row has fewer fields than the row beside it, or ends within a number without the end of a line. A remark in
    words after the last row is left out like a cut row.

    Args:
        path: the file; empty lines and those that begin with # or % are no rows.
        delimiter: one character, or `WHITESPACE`.
        width: number of fields of a row, if names of columns give it.

    Returns:
        The rows; none if the neighbour of a short row is not whole.
    """
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


def read_rows(path: Path, layout: RowLayout, *, comments: bool = False) -> Iterator[Row]:
    """Yield the line of names, if there is one, and every row that is read.

    Args:
        path: a text file; any byte is accepted.
        comments: whether lines that begin with # or % are left out.
    """
    rows = text_rows(path, layout.delimiter, layout.skip_lines, comments=comments)
    if not layout.rows:
        yield from rows
        return
    names = None
    if not layout.numbered and (first := next(rows, None)) is not None:
        names = first[1]
        yield first
    wanted = _wanted(path, layout.rows, names)
    for number, fields in rows:
        if all(k < len(fields) and fields[k] == text for k, text in wanted):
            yield number, fields


def selected_text(path: Path, layout: RowLayout) -> bytes:
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
