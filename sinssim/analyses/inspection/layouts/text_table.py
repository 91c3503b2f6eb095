"""Reads the numbers of a text file of unknown layout: its delimiter, its line of names, its columns."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.streams import Clock
from sinssim.logs.text.dates import date_seconds, is_date
from sinssim.logs.text.rows import WHITESPACE, CutRows, cut_rows, split, text_rows
from sinssim.logs.text.table import bad_row, read_columns
from sinssim.system.user_file import open_file

_HEAD_LINES = 200
_LARGEST = 1e30
"""Numbers from here on are no measurements: times in ns since 1970 are below 1e20."""
_COMMENT = ("#", "%", "//", "!")
_LONGEST_WORD = 500  # letters of a name with its unit; what is longer is no name, and is compared with many patterns
_DELIMITERS = (";", "\t", "|", ",")
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
        values: (N, columns); NaN for fields that are no numbers, or beyond 1e30; dates are seconds since the whole
            second of the first.
        decimal: the decimal sign, "." or ",".
        dates: columns that hold dates or times of day, from 0, with the first one as text.
        clocks: clock of each such column; None for times of day.
        comment: what a comment before the numbers says of the columns, or their names and units in a heading that the
            description cannot name: of several lines, with repeated names, not in UTF-8; None if there is none of that
            many words.
        rows: values of columns that select these rows of the file; empty if they are all its rows.
        kinds: texts of the columns that hold a few different words, from 0, (N,) each.
        lasts: duration of the fixes that were recorded with it, s; None if it is not known.
        notes: a sentence on each row that was cut short and is left out.
        uneven: lines of other rows that are left out, from 1, because they have another number of fields.
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
    rows: dict[str, str] = field(default_factory=dict)
    kinds: dict[int, NDArray[np.str_]] = field(default_factory=dict)
    lasts: float | None = None
    notes: tuple[str, ...] = ()
    uneven: tuple[int, ...] = ()

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
        if self.rows:
            keys["rows"] = dict(self.rows)
        return keys

    def selected(self, column: int, value: str, chosen: NDArray[np.bool_]) -> TextTable:
        """Return some rows: those in which a column has a value.

        Args:
            column: from 0.
            chosen: the rows, (N,).
        """
        rows = {**self.rows, str(self.label(column)): value}
        kinds = {k: texts[chosen] for k, texts in self.kinds.items() if k != column}
        return replace(self, values=self.values[chosen], rows=rows, kinds=kinds)

    def label(self, column: int) -> str | int:
        """Return the name of a column, or its number from 1."""
        return column + 1 if self.names is None else self.names[column]


def _number(text: str) -> float:
    try:
        return float(text.replace(",", ".") if _COMMA.fullmatch(text) else text)
    except ValueError:
        return float("nan")


def _is_value(text: str) -> bool:
    return bool(np.isfinite(_number(text))) or is_date(text)


def read_table(path: Path) -> TextTable:
    """Read all columns of a text file.

    Raises:
        InputError: the file cannot be read, or is no table of numbers.
    """
    try:
        with open_file(path) as file:
            head = [file.readline(100_000) for _ in range(_HEAD_LINES)]
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from error
    if any(b"\0" in line for line in head):
        raise InputError(f"{path} is neither a file of a known format nor a text file.")
    lines = [line.decode("utf-8", "replace").rstrip("\r\n").removeprefix("\ufeff") for line in head if line]
    delimiter = _delimiter(lines)
    widths = [len(split(line, delimiter)) if line.strip() else 0 for line in lines]
    numeric = [
        width > 1 and _is_row(split(line, delimiter)) and not line.lstrip().startswith(_COMMENT)
        for line, width in zip(lines, widths, strict=True)
    ]
    if not any(numeric):
        raise InputError(
            f"{path} is not a table of numbers: none of its first {len(lines)} lines contains several numbers. Give a "
            "log with rows of numbers, or a file of a format of `sinssim list formats`."
        )
    heading = first = numeric.index(True)
    if first and 0 < widths[first - 1] < widths[first] and all(map(_is_value, split(lines[first - 1], delimiter))):
        heading -= 1  # a first row of which one number is left
    cut = cut_rows(path, delimiter, heading)
    first = cut.first or first
    fields = split(lines[first], delimiter)
    decimal = "," if delimiter != "," and any(_COMMA.fullmatch(f) for f in fields) else "."
    names, comment = _heading(lines[:heading], widths[:heading], delimiter, widths[first], fields[-1] == "")
    if names is not None and "\ufffd" in lines[heading - 1]:
        latin = head[heading - 1].decode("latin-1").rstrip("\r\n").removeprefix("ï»¿")
        names, comment = None, tuple(split(latin, delimiter))
    if any(len(word) > _LONGEST_WORD for word in names or comment or ()):
        names = comment = None
    dates = {k: f for k, f in enumerate(fields) if is_date(f)}
    values, kinds, whole = _values(path, delimiter, first, widths[first], decimal, dates, cut)
    values = np.where(np.abs(values) < _LARGEST, values, np.nan)
    clocks = {k: date_seconds([text])[1] for k, text in dates.items()}
    skip = heading - (names is not None)
    uneven = () if whole else _uneven(path, delimiter, first, widths[first], cut)
    return TextTable(
        path, delimiter, skip, names, values, decimal, dates, comment, clocks, kinds=kinds, notes=cut.notes,
        uneven=uneven,
    )  # fmt: skip


def _heading(
    lines: list[str], widths: list[int], delimiter: str, width: int, ends_empty: bool
) -> tuple[tuple[str, ...] | None, tuple[str, ...] | None]:
    """Return the names of the columns, and what is known of columns that cannot be named.

    Args:
        width: number of fields of a row of numbers.
        ends_empty: whether such a row ends with a delimiter.
    """
    if not lines:
        return None, None
    if lines[-1].lstrip().startswith(_COMMENT):
        fields = split(lines[-1].lstrip(" #%/!"), delimiter)
        return None, tuple(fields) if len(fields) == width else None
    begin = len(lines)
    while begin and widths[begin - 1] == width and not lines[begin - 1].lstrip().startswith(_COMMENT):
        begin -= 1
    heading = [split(line, delimiter) for line in lines[begin:]]
    if not heading:
        last = split(lines[-1], delimiter)
        if ends_empty and len(last) == width - 1:
            return None, (*last, "")
        apart = [field for field in re.split(r"\s*:\s*", lines[-1].strip()) if field]  # names with blanks in them
        return None, tuple(apart) if len(apart) == width else None
    if len(heading) == 1:
        distinct = len(set(heading[0])) == width
        return (tuple(heading[0]), None) if distinct else (None, tuple(heading[0]))
    units = [unit.strip("()[]<>") for unit in heading[1]]
    return None, tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(heading[0], units, strict=True))


def _is_row(fields: list[str]) -> bool:
    """Return whether fields are a row of numbers: the first or the second is one, and few of the others are words."""
    values = sum(_is_value(f) for f in fields)
    return values >= 2 and values >= 0.5 * sum(bool(f) for f in fields)


def _delimiter(lines: list[str]) -> str:
    """Return the delimiter that gives most lines the same number of fields."""
    text = [line for line in lines if line.strip() and not line.lstrip().startswith(_COMMENT)] or lines
    for delimiter in _DELIMITERS:
        counts = [len(split(line, delimiter)) - 1 for line in text]
        common = int(np.median(counts)) if counts else 0
        if common and sum(count == common for count in counts) >= 0.8 * len(counts):
            return delimiter
    return WHITESPACE


_MOST_KINDS = 40
"""Different words of a column that tells kinds of rows apart."""


def _values(
    path: Path, delimiter: str, skip: int, width: int, decimal: str, dates: dict[int, str], cut: CutRows
) -> tuple[Array, dict[int, NDArray[np.str_]], bool]:
    """Return the numbers after the heading, (N, width), the words of columns that hold a few, and if no row is uneven.

    Rows of another width are left out.
    """
    from pyarrow import ArrowInvalid, string

    uneven: list[bool] = []

    def left_out(_: object) -> str:
        uneven[:] = [True]
        return "skip"

    try:
        table = read_columns(
            path, delimiter, width, skip, cut, decimal_point=decimal, encoding="latin-1", invalid_row_handler=left_out,
            column_types={str(k): string() for k in dates}, strings_can_be_null=True,
            quote_char=False if delimiter == WHITESPACE else '"',
        )  # fmt: skip
    except ArrowInvalid as error:
        raise bad_row(path, (), (), delimiter, error) from error
    if not table.num_rows:
        raise InputError(f"{path} contains no row of {width} numbers after line {skip}.")
    columns, kinds = [], {}
    for k, column in enumerate(table.columns):
        if k in dates:
            columns.append(date_seconds(column.to_pylist())[0])
            continue
        try:
            columns.append(column.cast("float64", safe=False).to_numpy())  # ns of dates have 19 digits
        except (ArrowInvalid, NotImplementedError):
            texts = [text if isinstance(text, str) else "" for text in column.to_pylist()]
            columns.append(np.array([_number(text) for text in texts]))  # some fields are words, such as "null"
            if column.type == string() and 1 < len(column.unique()) <= _MOST_KINDS:
                kinds[k] = np.array([text.encode("latin-1").decode("utf-8", "replace").strip() for text in texts])
    return np.column_stack(columns), kinds, not uneven


def _uneven(path: Path, delimiter: str, skip: int, width: int, cut: CutRows) -> tuple[int, ...]:
    """Return the lines, from 1, of rows with another number of fields."""
    rows = text_rows(path, delimiter, skip, cut, comments=False)
    return tuple(line for line, fields in rows if len(fields) != width)
