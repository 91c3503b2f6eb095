"""All that a command gives, as text: what it prints, and the files that it writes, arrays by a few of their values.

Two such texts are compared word for word; numbers may differ as far as another processor computes them differently.
"""

from __future__ import annotations

import base64
import difflib
import json
import re
import zlib
from collections.abc import Iterator, Sequence
from html.parser import HTMLParser
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array

_FEW = 3
"""Values shown of an array, its ends among them."""
_DIGITS = 5
"""Digits shown of a number in a file."""
_NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_LONG = re.compile(r"-?\d+\.\d{7,}(?:[eE][-+]?\d+)?")
_NOISE = 1e-9
"""Size below which a number is that of rounding errors: nanometres and billionths of a radian."""
_PASSING = re.compile(
    r"(?<=RecordingInfo:start_time )\[[^;]*\]|(?<=EncodedImage:blob )\[[^;]*\]|(?<=versions\.)\w+ = .*"
    r"|\d{4}-\d\d-\d\d \d\d:\d\d|(?<=flight_cached = )(?:True|False)"
)
"""When something was written, and by which software; pictures, which most tests do not draw."""
_UNREAD = re.compile(r"\.|[0-9a-f]{24}\.json|\d+-\d+\.parquet")
"""Names of files that nobody reads: the mark of a folder, and what is kept so that a study can be continued."""
_SAID = ("alt", "aria-label", "title", "stroke", "stroke-dasharray", "value", "min", "max", "step", "placeholder")
"""Attributes of a page that say something."""


def text_of(printed: str, folder: Path, hidden: tuple[str, ...] = ()) -> str:
    """Return what commands printed and wrote into a folder as text, without files whose names end like `hidden`."""
    lines = [line.rstrip() for line in printed.splitlines()]
    for file in sorted(path for path in folder.rglob("*") if path.is_file() and not _UNREAD.match(path.name)):
        lines += [f"== {file.relative_to(folder)}", *(() if file.name.endswith(hidden) else _lines(file))]
    text = "\n".join(lines) + "\n"
    return _PASSING.sub("…", text.replace(str(folder.resolve()), "FOLDER").replace(str(folder), "FOLDER"))


def _lines(file: Path) -> Iterator[str]:
    """Yield the contents of a file."""
    match file.suffix:
        case ".json":
            yield from _flat(json.loads(file.read_text(encoding="utf-8")))
        case ".html":
            page = _Page()
            page.feed(file.read_text(encoding="utf-8"))
            yield from page.lines
        case ".parquet":
            yield from _columns(file)
        case ".rrd":
            yield from _recorded(file)
        case ".svg" | ".png" | ".mcap":
            yield "no words"
        case ".sbet":
            yield _few(np.fromfile(file, "<f8").reshape(-1, 17))
        case ".mat":
            from scipy.io import loadmat

            yield from _flat({key: _fields(of) for key, of in loadmat(file, squeeze_me=True).items() if key[0] != "_"})
        case _:
            rows = [_LONG.sub(_shorter, row)[:400] for row in file.read_text(encoding="utf-8").splitlines()]
            yield from rows if len(rows) < 150 else [f"{len(rows)} lines", *(rows[k] for k in _places(len(rows), 7))]


def _shorter(number: re.Match[str]) -> str:
    return f"{float(number[0]):.8g}"


def _places(count: int, few: int = _FEW) -> list[int]:
    """Return evenly spread places, the first and the last among them."""
    return sorted({round(k * (count - 1) / (few - 1)) for k in range(few)}) if count > few else list(range(count))


def _few(values: Sequence[Any] | Array) -> str:
    """Return some values of an array, and how many there are."""
    shown = " ".join(_short(values[k]) for k in _places(len(values)))
    return f"{len(values)}: {shown}" if len(values) > _FEW else shown


def _short(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return f"{float(value):.{_DIGITS}g}"
    if isinstance(value, list | tuple | np.ndarray):
        return f"[{_few(value)}]"
    if isinstance(value, dict):
        return ", ".join(f"{key} {_short(item)}" for key, item in value.items())
    return str(value)


def _flat(contents: Any, path: str = "") -> Iterator[str]:
    """Yield the values of tables by their paths."""
    if isinstance(contents, dict) and contents:
        for key, value in contents.items():
            yield from _flat(value, f"{path}.{key}".lstrip("."))
    elif isinstance(contents, list) and contents and isinstance(contents[0], dict):
        for number, value in enumerate(contents):
            if number in _places(len(contents), 12):
                yield f"{path}.{number} = {_short(value)}"
    else:
        yield f"{path} = {_short(contents)}"


def _fields(of: Any) -> Any:
    """Return the fields of a structure of MATLAB as a table."""
    names = of.dtype.names if hasattr(of, "dtype") else None
    return {name: _fields(of[name].item()) for name in names} if names else of


class _Page(HTMLParser):
    """The words of a page, its descriptions for the blind, and the numbers that its scripts draw."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self._hidden = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep what the attributes say."""
        self._hidden = tag if tag in ("style", "script") else ""
        given, shown = {name: value or "" for name, value in attrs}, [tag]
        for name in given.keys() & {"data-chart", "data-map", "data-live"}:
            self.lines += [f"{name}:", *_numbers_of(json.loads(given[name]))]
        for name in ("points", "d"):
            if name in given:
                shown.append(_few(re.findall(r"[^\sA-Za-z]+", given[name])))
        shown += [given[name] for name in _SAID if name in given]
        if len(shown) > 1:
            self.lines.append(" ".join(shown))

    def handle_endtag(self, tag: str) -> None:
        """End what is not read."""
        self._hidden = ""

    def handle_data(self, data: str) -> None:
        """Keep words."""
        if not self._hidden and data.strip():
            self.lines.append(" ".join(data.split()))


def _numbers_of(contents: dict[str, Any]) -> Iterator[str]:
    """Yield what a script draws; its numbers are 4-byte floats, as `recording/live_chart.py` packs them."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(contents.pop("numbers")), wbits=-15), np.uint8)
    folded = np.ascontiguousarray(planes.reshape(4, -1).T).view("<u4")[:, 0]
    steps = (folded >> 1) ^ -(folded & 1)
    yield from _flat(contents)
    for part in np.split(steps, np.cumsum(contents["counts"])[:-1]):
        yield _few(np.cumsum(part, dtype=np.uint32).view("<f4").astype(float))


def _columns(file: Path) -> Iterator[str]:
    """Yield the columns of a stream."""
    import pyarrow.parquet as pq

    table = pq.read_table(file)
    for name in table.column_names:
        column = table.column(name)
        yield f"{name} {column.type} {len(column)}: {' '.join(_short(column[k].as_py()) for k in _places(len(column)))}"


def _recorded(file: Path) -> Iterator[str]:
    """Yield the entities of a recording: of each column the first and the last value.

    Those of the streams are in the files of the streams, too.
    """
    from rerun.chunk import RrdReader

    entities: dict[str, dict[str, list[Any]]] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if not name.startswith(("rerun.controls", "log_t")) and not chunk.entity_path.startswith("/streams/"):
                entities.setdefault(chunk.entity_path, {}).setdefault(name, []).extend(
                    (column[0], column[len(column) - 1])
                )
    for path in sorted(entities):
        columns = entities[path].items()
        shown = "; ".join(f"{name} {_short([_known(of[k]) for k in (0, -1)])[:160]}" for name, of in sorted(columns))
        yield f"{path}: {shown}"


def _known(scalar: Any) -> Any:
    """Return a value of a recording; instants in ns."""
    return scalar.value if hasattr(scalar, "value") else scalar.as_py()


def differences(text: str, approved: str) -> list[str]:
    """Return the lines of two texts that differ by more than rounding."""
    lines, others = text.splitlines(), approved.splitlines()
    if len(lines) == len(others):
        pairs = [(a, b) for a, b in zip_longest(lines, others, fillvalue="") if not _same(a, b)]
        return [line for a, b in pairs for line in (f"- {b}", f"+ {a}")]
    changed = difflib.unified_diff(others, lines, lineterm="", n=0)
    return [line for line in changed if not line.startswith(("@@", "--- ", "+++ "))]


def _same(line: str, other: str) -> bool:
    """Return whether two lines have the same words, and numbers that differ in their last digit at most."""
    if line == other:
        return True
    if _NUMBER.sub("#", line) != _NUMBER.sub("#", other):
        return False
    return all(_near(a, b) for a, b in zip(_NUMBER.findall(line), _NUMBER.findall(other), strict=True))


def _near(text: str, other: str) -> bool:
    a, b = (float(number.replace("−", "-")) for number in (text, other))
    last = max(_last_digit(text), _last_digit(other))
    whole = text.lstrip("-−").isdigit() and other.lstrip("-−").isdigit()
    return a == b or (not whole and abs(a - b) <= 1.5 * last) or (abs(a) < _NOISE and abs(b) < _NOISE)


def _last_digit(number: str) -> float:
    """Return the value of a unit in the last digit."""
    mantissa, _, exponent = number.lower().partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
