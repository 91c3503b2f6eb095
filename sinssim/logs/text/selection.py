"""Reads the rows of a text file, or those in which columns have given texts: one of several units, a kind of record."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from sinssim.errors import InputError, unknown_name
from sinssim.logs.text.description import WHITESPACE
from sinssim.system.user_file import open_text

Row = tuple[int, list[str]]
"""Number of a line, from 1, and its fields."""


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


def read_rows(path: Path, layout: RowLayout) -> Iterator[Row]:
    """Yield the line of names, if there is one, and every row that is read.

    Args:
        path: a text file; any byte is accepted.
        layout: how it is written.

    Raises:
        InputError: a column that selects rows does not exist.
    """
    rows = _all_rows(path, layout)
    if not layout.rows:
        yield from rows
        return
    names = None
    if not layout.numbered and (first := next(rows, None)) is not None:
        names = first[1]
        yield first
    wanted = _wanted(path, layout.rows, names)
    for number, fields in rows:
        if all(k < len(fields) and fields[k].strip() == text for k, text in wanted):
            yield number, fields


def selected_text(path: Path, layout: RowLayout) -> bytes:
    """Return a file with the line of names, if there is one, and the rows that the layout selects.

    Args:
        path: a text file.
        layout: how it is written, with rows.

    Raises:
        InputError: no row has the texts, or a column does not exist.
    """
    text = io.StringIO(newline="")
    delimiter = " " if layout.delimiter == WHITESPACE else layout.delimiter
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    count = 0
    for count, (_, fields) in enumerate(read_rows(path, layout), start=1):  # noqa: B007
        writer.writerow(fields)
    if count <= (not layout.numbered):
        said = ", ".join(f"{name} = {value}" for name, value in (layout.rows or {}).items())
        raise InputError(f"{path} has no row with {said}; see the key rows.")
    return text.getvalue().encode("latin-1")


def _all_rows(path: Path, layout: RowLayout) -> Iterator[Row]:
    # Latin-1 accepts any byte
    with open_text(path, encoding="latin-1", newline="") as file:
        lines = (line for number, line in enumerate(file) if number >= layout.skip_lines)
        if layout.delimiter == WHITESPACE:
            split = ((number, line.split()) for number, line in enumerate(lines, start=1))
            yield from ((layout.skip_lines + number, fields) for number, fields in split if fields)
            return
        reader = csv.reader(lines, delimiter=layout.delimiter)
        yield from ((layout.skip_lines + reader.line_num, fields) for fields in reader if fields)


def _wanted(path: Path, rows: dict[str, str], names: Sequence[str] | None) -> list[tuple[int, str]]:
    """Return the columns that select rows, from 0, and their texts."""
    found = []
    plain = [name.removeprefix("ï»¿").strip().strip('"') for name in names or ()]
    for name, text in rows.items():
        if names is not None and name in plain:
            found.append((plain.index(name), text))
        elif names is not None:
            raise InputError(f"{path}: rows: {unknown_name('column', name, plain)}")
        elif name.isdecimal() and int(name) >= 1:
            found.append((int(name) - 1, text))
        else:
            raise InputError(f"{path}: rows: {name!r} is no number of a column, from 1; the columns have no names.")
    return found
