"""Reads the numbers of a text file of unknown layout: its delimiter, its line of names, its columns."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.streams import Clock
from sinssim.logs.text.dates import date_seconds, is_date

_HEAD_LINES = 200
_COMMENT = ("#", "%", "//", "!")
_DELIMITERS = (";", "\t", ",")
"""A semicolon or a tab comes first: beside it a comma is a decimal one."""
_COMMA = re.compile(r"[-+]?\d+,\d+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class TextTable:
    """The numbers of a text file.

    Attributes:
        path: the file.
        delimiter: "," ";" a tab, or "whitespace".
        skip_lines: lines before the line of names, or before the numbers if there is none.
        names: names of the columns; None without a line of names.
        values: (N, columns); NaN for fields that are no numbers; dates are seconds since the whole second of the first.
        decimal: the decimal sign, "." or ",".
        dates: columns that hold dates or times of day, from 0, with the first one as text.
        clocks: clock of each such column; None for times of day.
        comment: what a comment before the numbers says of the columns; None if there is none of that many words.
    """

    path: Path
    delimiter: str
    skip_lines: int
    names: tuple[str, ...] | None
    values: Array
    decimal: str = "."
    dates: dict[int, str] = field(default_factory=dict)
    comment: tuple[str, ...] | None = None
    clocks: dict[int, Clock | None] = field(default_factory=dict)

    @property
    def words(self) -> tuple[str, ...] | None:
        """What is known of the columns: their names, or the words of a comment; None if there are none."""
        return self.names or self.comment

    def layout(self) -> dict[str, Any]:
        """Return the keys of a description that say how the file is written."""
        keys: dict[str, Any] = {}
        if self.delimiter != ",":
            keys["delimiter"] = self.delimiter
        if self.skip_lines:
            keys["skip_lines"] = self.skip_lines
        if self.decimal != ".":
            keys["decimal"] = self.decimal
        return keys

    def label(self, column: int) -> str | int:
        """Return the name of a column, or its number from 1."""
        return column + 1 if self.names is None else self.names[column]


def _split(line: str, delimiter: str) -> list[str]:
    return line.split() if delimiter == "whitespace" else [field.strip() for field in line.strip().split(delimiter)]


def _number(text: str) -> float:
    try:
        return float(text.replace(",", ".") if _COMMA.fullmatch(text) else text)
    except ValueError:
        return float("nan")


def _is_value(text: str) -> bool:
    return bool(np.isfinite(_number(text))) or is_date(text)


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
        raise InputError(f"{path} is neither a file of a known format nor a text file.")
    lines = [line.decode("utf-8", "replace").rstrip("\r\n").removeprefix("\ufeff") for line in head if line]
    delimiter = _delimiter(lines)
    widths = [len(_split(line, delimiter)) if line.strip() else 0 for line in lines]
    numeric = [
        width > 1 and _is_row(_split(line, delimiter)) and not line.lstrip().startswith(_COMMENT)
        for line, width in zip(lines, widths, strict=True)
    ]
    if not any(numeric):
        raise InputError(
            f"{path} is not a table of numbers: none of its first {len(lines)} lines contains several numbers. Give a "
            "log with rows of numbers, or a file of a format of `sinssim list formats`."
        )
    first = numeric.index(True)
    fields = _split(lines[first], delimiter)
    decimal = "," if delimiter != "," and any(_COMMA.fullmatch(f) for f in fields) else "."
    names = comment = None
    if first and lines[first - 1].lstrip().startswith(_COMMENT):
        comment = _names(lines[first - 1].lstrip(" #%/!"), delimiter, widths[first])
    elif first:
        names = _names(lines[first - 1], delimiter, widths[first])
    dates = {k: f.strip('"') for k, f in enumerate(fields) if is_date(f)}
    values = _values(path, delimiter, first, widths[first], decimal, dates)
    clocks = {k: date_seconds([text])[1] for k, text in dates.items()}
    return TextTable(path, delimiter, first - (names is not None), names, values, decimal, dates, comment, clocks)


def _is_row(fields: list[str]) -> bool:
    """Return whether fields are a row of numbers: the first or the second is one, and few of the others are words."""
    values = sum(_is_value(f) for f in fields)
    return values >= 2 and values >= 0.5 * sum(bool(f) for f in fields)


def _names(line: str, delimiter: str, width: int) -> tuple[str, ...] | None:
    """Return the names of the columns, which differ and are as many as the columns; None if the line has none."""
    fields = [f.strip('"') for f in _split(line, delimiter)]
    return tuple(fields) if len(fields) == width and len(set(fields)) == width else None


def _delimiter(lines: list[str]) -> str:
    """Return the delimiter that gives most lines the same number of fields."""
    text = [line for line in lines if line.strip() and not line.lstrip().startswith(_COMMENT)] or lines
    for delimiter in _DELIMITERS:
        counts = [line.count(delimiter) for line in text]
        common = int(np.median(counts)) if counts else 0
        if common and sum(count == common for count in counts) >= 0.8 * len(counts):
            return delimiter
    return "whitespace"


def _values(path: Path, delimiter: str, skip: int, width: int, decimal: str, dates: dict[int, str]) -> Array:
    """Return the numbers after the heading, (N, width)."""
    from pyarrow import ArrowInvalid, csv, string

    names = [str(k) for k in range(width)]
    if delimiter == "whitespace":
        return _slow_values(path, delimiter, skip, width, dates)
    try:
        table = csv.read_csv(
            path,
            read_options=csv.ReadOptions(skip_rows=skip, column_names=names),
            parse_options=csv.ParseOptions(delimiter=delimiter, invalid_row_handler=lambda row: "skip"),
            convert_options=csv.ConvertOptions(
                decimal_point=decimal, column_types={names[k]: string() for k in dates}, strings_can_be_null=True
            ),
        )
    except ArrowInvalid:
        return _slow_values(path, delimiter, skip, width, dates)
    columns = []
    for k, column in enumerate(table.columns):
        if k in dates:
            columns.append(date_seconds(column.to_pylist())[0])
            continue
        try:
            columns.append(column.cast("float64", safe=False).to_numpy())  # ns of dates have 19 digits
        except (ArrowInvalid, NotImplementedError):
            columns.append(np.full(len(column), np.nan))
    return np.column_stack(columns)


def _slow_values(path: Path, delimiter: str, skip: int, width: int, dates: dict[int, str]) -> Array:
    """Return the numbers line by line: blanks of any number, or rows of unequal length."""
    rows, stamps = [], []
    with path.open(encoding="utf-8", errors="replace") as file:
        for k, line in enumerate(file):
            if k < skip:
                continue
            fields = _split(line, delimiter)
            if len(fields) == width and not re.match(r"\s*(#|%|//|!)", line):
                rows.append([float("nan") if j in dates else _number(f) for j, f in enumerate(fields)])
                stamps.append([fields[j] for j in dates])
    if not rows:
        raise InputError(f"{path} contains no row of {width} numbers after line {skip}.")
    values = np.array(rows)
    for j, column in zip(dates, zip(*stamps, strict=True), strict=True):
        values[:, j] = date_seconds(column)[0]
    return values
