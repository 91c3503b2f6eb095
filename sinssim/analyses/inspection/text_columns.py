"""Columns of a text file of unknown layout: delimiter, line of names, numbers, and the time.

A file whose rows alternate between several units or kinds of records is split into its parts. Of three columns it is
judged what their numbers look like: gyros, accelerometers, a magnetometer, copies of other columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.column_names import (
    TIME_UNITS,
    UNITS,
    epoch_unit,
    means,
    quantity,
    says,
    says_other,
    says_time,
    triads,
    unit_in_name,
    unit_of,
)
from sinssim.logs.gps_time import date_seconds, is_date
from sinssim.logs.numeric_columns import (
    COMMENTS,
    WHITESPACE,
    CutRows,
    bad_row,
    cut_rows,
    read_columns,
    split,
    text_rows,
)
from sinssim.logs.recorded_streams import Clock
from sinssim.system.files import open_file

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
    """The numbers of a text file."""

    path: Path  # the file
    delimiter: str  # "," ";" a tab, or "whitespace"
    skip_lines: int  # lines before the line of names, or before the numbers if there is none
    names: tuple[str, ...] | None  # names of the columns; None without a line of names
    # (N, columns); NaN for fields that are no numbers, or beyond 1e30; dates are seconds since the whole second of the
    # first
    values: Array
    decimal: str = "."  # the decimal sign, "." or ","
    # columns that hold dates or times of day, from 0, with the first one as text
    dates: dict[int, str] = field(default_factory=dict)
    # what a comment before the numbers says of the columns, or their names and units in a heading that the description
    # cannot name: of several lines, with repeated names, not in UTF-8; None if there is none of that many words
    comment: tuple[str, ...] | None = None
    clocks: dict[int, Clock | None] = field(default_factory=dict)  # clock of each such column; None for times of day
    # values of columns that select these rows of the file; empty if they are all its rows
    rows: dict[str, str] = field(default_factory=dict)
    # texts of the columns that hold a few different words, from 0, (N,) each
    kinds: dict[int, NDArray[np.str_]] = field(default_factory=dict)
    lasts: float | None = None  # duration of the fixes that were recorded with it, s; None if it is not known
    notes: tuple[str, ...] = ()  # a sentence on each row that was cut short and is left out
    # lines of other rows that are left out, from 1, because they have another number of fields
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
        """Return some rows: those in which a column has a value. `column`: from 0; `chosen`: the rows, (N,)."""
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
    """Read all columns of a text file."""
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
        latin = head[heading - 1].decode("latin-1").rstrip("\r\n").removeprefix("ï»¿").lstrip(" #%")
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
    """Return the names of the columns, and what is known of columns that cannot be named. `width`: number of fields of
    a row of numbers; `ends_empty`: whether such a row ends with a delimiter."""
    if not lines:
        return None, None
    if lines[-1].lstrip().startswith(_COMMENT):
        fields = split(lines[-1].lstrip(" #%/!"), delimiter)
        if len(fields) == width and len(set(fields)) == width and lines[-1].lstrip().startswith(COMMENTS):
            return tuple(fields), None
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


_INSTANCE = re.compile(
    r"^(?:i|inst\w*|id|(?:imu|gps|gnss|sensor|unit|device)[\W_]*(?:id|index|no|nr|number|instance)?)$"
)
_MOST_UNITS = 8
_ALTERNATES = 0.2
"""Least share of rows whose kind is not that of the row before: a status changes a few times in a whole log."""


def split_kinds(table: TextTable) -> tuple[list[TextTable], list[str]]:
    """Split a file by the column that tells kinds of rows or units apart. Return the parts, or the file itself if
    nothing alternates; of several units the first one; and a sentence on what is left out."""
    for k, texts in table.kinds.items():
        if _alternates(texts):
            chosen = {str(text): texts == text for text in np.unique(texts) if text}
            return [table.selected(k, text, rows) for text, rows in chosen.items() if rows.sum() > 2], []
    for k, name in enumerate(table.words or ()):
        values = table.values[:, k]
        if not _INSTANCE.match(name.strip().lower()) or not np.isfinite(values).all():
            continue
        units = np.unique(values)
        if 1 < len(units) <= _MOST_UNITS and (units == np.rint(units)).all() and _alternates(values):
            first = table.selected(k, str(int(units[0])), values == units[0])
            words = ", ".join(str(int(unit)) for unit in units)
            text = (
                f"{table.path} contains {len(units)} units ({name} = {words}), of which {name} = {int(units[0])} is "
                "used."
            )
            return [first], [text]
    return [table], []


def _alternates(values: NDArray[Any]) -> bool:
    return len(values) > 3 and float(np.mean(values[1:] != values[:-1])) > _ALTERNATES


_RATES = (1.0, 10_000.0)
"""Samples a second of inertial sensors, from slow recorders to raw outputs."""
_USUAL = 200.0
"""Samples a second in the middle of those of users' units, 50 to 1000."""
_CLEAR = 1.2
"""Least difference of the evidence for two units, in decades of the rate, with which the first one is taken."""


class UncertainUnitError(InputError):
    """Several units of the times of a file are possible."""


def time_column(table: TextTable) -> tuple[int, str, float]:
    """Find the time of a log of inertial readings: column, from 0, unit, and interval, s. The unit is that of the name;
    or else that in which the stamps are dates; or else that with the rate and the duration of an inertial log."""
    best: tuple[float, int, list[tuple[float, str, float]]] = (np.inf, -1, [])
    for k, column in enumerate(table.values.T):
        word = "" if table.words is None else table.words[k]
        if not np.isfinite(column).all() or len(column) < 3 or says_other(word):
            continue
        steps = np.diff(column)
        forward = steps[steps > 0.0]
        # stamps may repeat: those of several samples in one packet, or of a clock coarser than the samples
        if len(forward) < 0.1 * len(steps) or (steps < 0.0).mean() > 0.02:
            continue
        middle = float(column[-1] - column[0]) / len(steps)
        if not middle > 0.0:
            continue
        spread = min(float(np.percentile(np.abs(steps - middle), 90.0)) / middle, 3.0)
        spread = round(spread, 1) + 1e-3 * k  # of columns that are alike the first one, in every file of a logger
        middle = middle if len(forward) < 0.9 * len(steps) else float(np.median(forward))
        units = sorted(_units(table, k, middle), reverse=True)
        if units:
            sure = units[0][0] == np.inf or len(units) == 1
            of_sensor = says(word, r"header\W*stamp")  # of ROS: that of the sensor, not that of the recording
            best = min(best, (spread - 10.0 * says_time(word) - 5.0 * sure - 1.0 * of_sensor, k, units))
    _, k, units = best
    if k < 0:
        counts = [str(word) for word in table.words or () if means(word, "count") and not says_time(word)]
        of = f" ({counts[0]!r} is a count, no time)" if counts else ""
        raise InputError(
            f"{table.path}: no column{of} increases from row to row by the interval of inertial sensors "
            f"({_RATES[0]:g} to {_RATES[1]:g} samples per second) in s, ms, us or ns. Describe the columns in "
            "[log.imu] of a scenario (rate_hz for rows without times), and inspect the scenario."
        )
    (evidence, unit, interval), *others = units
    if others and not evidence - others[0][0] > _CLEAR:
        of = " or ".join(
            f"in {unit} there are {1.0 / step:.4g} samples per second over {len(table.values) * step:.4g} s"
            for _, unit, step in units[:2]
        )
        raise UncertainUnitError(
            f"{table.path}: the unit of the times in column {table.label(k)!r} is not certain: {of}. Put the unit into "
            "the name of the column (t_s, t_ms, t_us), or describe the columns in [log.imu] of a scenario (time_unit), "
            "and inspect the scenario."
        )
    return k, unit, interval


def _units(table: TextTable, k: int, middle: float) -> Iterator[tuple[float, str, float]]:
    """Yield the evidence for each unit of a column of times, infinite for a certain one, and the interval in it, s."""
    column, word = table.values[:, k], "" if table.words is None else table.words[k]
    if k in table.dates:
        yield np.inf, "s", middle
        return
    certain = "100us" if says(word, r"^sampletimefine") else unit_in_name(word) or epoch_unit(column, middle)
    if certain is not None and unit_in_name(word) is None and middle * TIME_UNITS[certain] * _RATES[0] > 1.0 + 1e-3:
        certain = None  # a counter since the start of a computer, which looks like dates
    if certain is not None:
        yield np.inf, certain, middle * TIME_UNITS[certain]
        return
    fractions = bool((column != np.rint(column)).any())
    for unit, scale in TIME_UNITS.items():
        interval = middle * scale
        if unit == "100us" or not _RATES[0] <= 1.0 / interval <= _RATES[1]:
            continue
        evidence = -abs(np.log10(1.0 / interval / _USUAL))
        evidence += 2.5 * (fractions == (unit == "s"))  # loggers count whole ms, us and ns
        if table.lasts is not None:  # what is recorded together lasts as long
            ratio = len(column) * interval / table.lasts
            evidence += 2.5 * (0.2 < ratio < 5.0)
        yield float(evidence), unit, interval


Three = tuple[int, int, int]
"""Columns x, y, z, from 0."""

_COPY = 0.999
"""Least correlation of two columns of the same readings."""
_FILLED = 0.2
"""Least share of rows with readings: rows of other sensors between them leave these fields empty."""
_COARSEST = float(np.radians(2.0))
"""Coarsest resolution of gyros, rad/s: 11 bits of ±2000 °/s, with the sign. Coarser steps are no rad/s."""
_LASTING_S = 10.0
_LASTING = 0.7
"""Least ratio of the mean of the readings over `_LASTING_S`, as a vector, to the mean of their magnitudes, in half of
the windows: gravity lasts, and the accelerations of a vehicle change within seconds."""


def unlike_gyros(table: TextTable, three: Three, accel: Three) -> float:
    """Return how little three columns without names look like gyros.

    A gyro reads about zero in the middle of a log, where a magnetometer has a field; the three have about the same
    noise; and most loggers put them beside the accelerometers.
    """
    values = table.values[:, list(three)]
    values = values[np.isfinite(values).all(axis=1)]
    middle, most = np.abs(np.median(values, axis=0)), np.percentile(np.abs(values), 95.0, axis=0)
    shifted = float((middle / np.maximum(most, 1e-30)).max())
    return shifted + uneven(values) + 0.5 * (abs(three[0] - accel[0]) != 3)


def uneven(values: Array) -> float:
    """Return the decimal logarithm of the ratio of the largest to the least noise of three columns.

    Its measure is a percentile of the second differences, which a few wrong rows do not change.
    """
    noise = np.percentile(np.abs(np.diff(values, n=2, axis=0)), 90.0, axis=0)
    return float(np.log10(max(noise.max(), 1e-30) / max(noise.min(), 1e-30)))


def copies(table: TextTable, first: Three, other: Three) -> bool:
    """Return whether three columns are those of another triad in another unit."""
    pairs = table.values[:, [*first, *other]]
    pairs = pairs[np.isfinite(pairs).all(axis=1)]
    return bool(len(pairs) > 3 and all(abs(np.corrcoef(pairs[:, k], pairs[:, k + 3])[0, 1]) > _COPY for k in range(3)))


def quaternion(table: TextTable) -> set[int]:
    """Return the first four neighbours with the norm 1 in every row."""
    for k in range(table.values.shape[1] - 3):
        norm = np.linalg.norm(table.values[:, k : k + 4], axis=1)
        if np.nanmax(np.abs(norm - 1.0), initial=0.0) < 1e-3 and np.isfinite(norm).any():
            return set(range(k, k + 4))
    return set()


def varies(table: TextTable, three: Three) -> bool:
    """Return whether three columns have numbers in enough rows, and none of them is constant."""
    values = table.values[:, list(three)]
    filled = bool((np.isfinite(values).mean(axis=0) > _FILLED).all())
    return filled and bool((np.nanstd(values, axis=0) > 0.0).all())


def lasts(values: Array, interval: float) -> bool:
    """Return whether readings have a lasting part as large as gravity, unlike those without gravity."""
    width = min(max(round(_LASTING_S / interval), 1), len(values))
    whole = values[: len(values) // width * width].reshape(-1, width, 3)
    mean, size = np.nanmean(whole, axis=1), np.nanmean(np.linalg.norm(whole, axis=2), axis=1)
    return bool(np.median(np.linalg.norm(mean, axis=1) / np.maximum(size, 1e-30)) > _LASTING)


def turns(table: TextTable, interval: float) -> bool:
    """Return whether gyros with names turn by a radian within `_LASTING_S` half of the time: gravity does not last."""
    for three in triads(table.words):
        if table.words is None or {quantity(table.words[k]) for k in three} != {"gyro"} or not varies(table, three):
            continue
        values = table.values[:, list(three)] * UNITS["gyro", "rates"][gyro_unit_of(table, three, "rates")[0]]
        width = min(max(round(_LASTING_S / interval), 1), len(values))
        angle = np.nansum(values[: len(values) // width * width].reshape(-1, width, 3), axis=1) * interval
        return bool(np.median(np.linalg.norm(angle, axis=1)) > 1.0)
    return False


def spread(values: Array) -> float:
    """Return the range of the middle half of the magnitudes over their median: small where gravity is most of them."""
    low, middle, high = np.percentile(np.linalg.norm(values, axis=1), (25.0, 50.0, 75.0))
    return float((high - low) / max(middle, 1e-30))


def repeats(values: Array) -> float:
    """Return the share of rows that repeat the row before: high for readings of slower sensors, such as receivers."""
    return float((np.diff(values, axis=0) == 0.0).all(axis=1).mean()) if len(values) > 1 else 0.0


def says_no_gravity(table: TextTable, word: str | None) -> bool:
    """Return whether names say that gravity is removed: linear or user acceleration, or this file of Sensor Logger."""
    if table.path.stem.lower() == "accelerometer" and "seconds_elapsed" in (table.words or ()):
        return True
    return any(means(text, "without gravity") for text in (word, table.path.stem, *table.rows.values()))


def gyro_unit_of(table: TextTable, three: Three, kind: Literal["rates", "increments"]) -> tuple[str, bool]:
    """Return the unit of the gyros from the names, or the likeliest one from the numbers, and whether it is sure."""
    named = None if table.words is None else unit_of(table.words[three[0]], tuple(UNITS["gyro", kind]))
    if named is not None:
        return named, True
    if kind == "increments":
        return "rad", False
    # a turn of a vehicle is 5 to 100 °/s: numbers above 10 are no rad/s
    values = table.values[:, list(three)]
    fast = float(np.nanpercentile(np.abs(values), 99.0))
    return ("deg/s" if fast > 6.0 or resolution(values) > _COARSEST else "rad/s"), False


def resolution(values: Array) -> float:
    """Return the least step between the values of three columns, the largest of the three; 0 without one."""
    steps = [np.diff(np.unique(axis[np.isfinite(axis)])) for axis in values.T]
    return max((float(s[s > 1e-6].min(initial=np.inf)) for s in steps if (s > 1e-6).any()), default=0.0)
