"""Reads the numbers of a text file of unknown layout: its delimiter, its line of names, its columns."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError

_HEAD_LINES = 200
_COMMENT = ("#", "%", "//", "!")
_DELIMITERS = (",", ";", "\t")


@dataclass(frozen=True)
class TextTable:
    """The numbers of a text file.

    Attributes:
        path: the file.
        delimiter: "," ";" a tab, or "whitespace".
        skip_lines: lines before the line of names, or before the numbers if there is none.
        names: names of the columns; None without a line of names.
        values: (N, columns); NaN for fields that are not numbers.
    """

    path: Path
    delimiter: str
    skip_lines: int
    names: tuple[str, ...] | None
    values: Array

    def label(self, column: int) -> str | int:
        """Return the name of a column, or its number from 1."""
        return column + 1 if self.names is None else self.names[column]


def _split(line: str, delimiter: str) -> list[str]:
    return line.split() if delimiter == "whitespace" else [field.strip() for field in line.strip().split(delimiter)]


def _number(field: str) -> float:
    try:
        return float(field)
    except ValueError:
        return float("nan")


def read_table(path: Path) -> TextTable:
    """Read all columns of a text file.

    Args:
        path: the file.

    Returns:
        Its numbers.

    Raises:
        InputError: the file cannot be read, or is no table of numbers.
    """
    try:
        with path.open("rb") as file:
            head = [file.readline(100_000) for _ in range(_HEAD_LINES)]
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    if any(b"\0" in line for line in head):
        raise InputError(f"{path} is neither a known format nor text.")
    lines = [line.decode("utf-8", "replace").rstrip("\r\n") for line in head if line]
    delimiter = _delimiter(lines)
    widths = [len(_split(line, delimiter)) if line.strip() else 0 for line in lines]
    numeric = [
        width > 1 and sum(np.isfinite(_number(f)) for f in _split(line, delimiter)) >= max(0.5 * width, 2)
        for line, width in zip(lines, widths, strict=True)
    ]
    if not any(numeric):
        raise InputError(
            f"{path} is no table of numbers: none of its first {len(lines)} lines has several numbers. Give a log of "
            "rows of numbers, or a file of a format of `sinssim list formats`."
        )
    first = numeric.index(True)
    names: tuple[str, ...] | None = None
    if first and not lines[first - 1].lstrip().startswith(_COMMENT):
        fields = _split(lines[first - 1], delimiter)
        if len(fields) == widths[first] and len(set(fields)) == len(fields):
            names = tuple(fields)
    values = _values(path, delimiter, first, widths[first])
    return TextTable(path, delimiter, first - (names is not None), names, values)


def _delimiter(lines: list[str]) -> str:
    """Return the delimiter that gives most lines the same number of fields."""
    text = [line for line in lines if line.strip() and not line.lstrip().startswith(_COMMENT)] or lines
    for delimiter in _DELIMITERS:
        counts = [line.count(delimiter) for line in text]
        common = int(np.median(counts)) if counts else 0
        if common and sum(count == common for count in counts) >= 0.8 * len(counts):
            return delimiter
    return "whitespace"


def _values(path: Path, delimiter: str, skip: int, width: int) -> Array:
    """Return the numbers after the heading, (N, width)."""
    from pyarrow import ArrowInvalid, csv

    separator = " " if delimiter == "whitespace" else delimiter
    try:
        if delimiter == "whitespace":
            raise ArrowInvalid("blanks of any number")
        table = csv.read_csv(
            path,
            read_options=csv.ReadOptions(skip_rows=skip, autogenerate_column_names=True),
            parse_options=csv.ParseOptions(delimiter=separator, invalid_row_handler=lambda row: "skip"),
        )
        columns = []
        for column in table.columns:
            try:
                columns.append(column.cast("float64").to_numpy())
            except (ArrowInvalid, NotImplementedError):
                columns.append(np.full(len(column), np.nan))
        return np.column_stack(columns)
    except ArrowInvalid:
        return _slow_values(path, delimiter, skip, width)


def _slow_values(path: Path, delimiter: str, skip: int, width: int) -> Array:
    """Return the numbers line by line: blanks of any number, or rows of unequal length."""
    rows = []
    with path.open(encoding="utf-8", errors="replace") as file:
        for k, line in enumerate(file):
            if k < skip:
                continue
            fields = _split(line, delimiter)
            if len(fields) == width and not re.match(r"\s*(#|%|//|!)", line):
                rows.append([_number(field) for field in fields])
    if not rows:
        raise InputError(f"{path} has no row of {width} numbers after line {skip}.")
    return np.array(rows)
