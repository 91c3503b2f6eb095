"""Curves of finished runs, ensembles and budgets on the same axes, from which the reader of a page chooses.

A run has its solutions and those that were scored. An ensemble and a budget have CEP and R95 of the position, and the
root mean square of the other errors.
"""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from sinssim.charts import PAIR, Axis, Chart, Charts, Dash, Line, in_rows, over
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.exhibits import Column, Interactive, Item, Sentence, Table
from sinssim.experiments.run.finished_runs import FinishedRun, flat_keys, kind_of
from sinssim.logs.stored_run import ERROR_COLUMNS, first_line, reason_of
from sinssim.recording import style
from sinssim.recording.live_chart import deflated
from sinssim.statistics.percentiles import cep, r95
from sinssim.strapdown.navigation_error import NavError
from sinssim.toml_mistakes import read_toml
from sinssim.units import ANGLE_SCALE, HEIGHT_SCALE, LENGTH_SCALE, SPEED_SCALE, TIME_SCALE, Scale

QUANTITIES: dict[str, tuple[str, Scale]] = {
    "horizontal": ("Horizontal position error", LENGTH_SCALE),
    "height": ("Height error, magnitude", HEIGHT_SCALE),
    "speed": ("Velocity error, magnitude", SPEED_SCALE),
    "attitude": ("Attitude error, angle", ANGLE_SCALE),
}
"""Title and units of each quantity."""
_VALUES, _LEAST, _MOST = 300_000, 24, 4096
"""Numbers of all curves of a page, and least and most columns of extremes of a curve."""
_AT_FIRST = 8
"""Most curves that are drawn before the reader chooses."""
_KEYS, _LONG = 60, 80
"""Most keys of a table without scripts, and most letters of a value."""
_NO_CURVES = "–"


@dataclass(frozen=True, eq=False)
class Curve:
    """The errors of a solution, or their size over many runs.

    Attributes:
        name: of the solution, "CEP", "R95" or "rms".
        time: (N,) s.
        values: magnitudes by quantity, (N,) SI each.
        shown: whether it is a headline curve, which a page draws at first.
        dash: pattern.
        step: width of the columns of which the curve has only the extremes, s; 0 if it has all values.
    """

    name: str
    time: Array
    values: Mapping[str, Array]
    shown: bool = False
    dash: Dash = ""
    step: float = 0.0

    def thinned(self, columns: int) -> Curve:
        """Return the curve with the least and the greatest value in each of a number of equal parts of its time."""
        if len(self.time) <= 2 * columns:
            return self
        edges = np.linspace(self.time[0], self.time[-1], columns + 1)
        first = np.unique(np.searchsorted(self.time, edges[:-1]))
        step = float(edges[1] - edges[0])
        at = (edges[:-1, None] + step * np.array([0.25, 0.75])).ravel() if len(first) == columns else None
        last = np.append(first[1:], len(self.time)) - 1
        at = np.column_stack((self.time[first], self.time[last])).ravel() if at is None else at
        values = {}
        for key, rows in self.values.items():
            low, high = np.fmin.reduceat(rows, first), np.fmax.reduceat(rows, first)
            rising = ~(rows[last] < rows[first])
            values[key] = np.column_stack((np.where(rising, low, high), np.where(rising, high, low))).ravel()
        return replace(self, time=at, values=values, step=step)


@dataclass(frozen=True)
class Source:
    """A finished run, an ensemble or a budget on a page."""

    label: str  # its name on the page
    path: Path  # its directory
    curves: Sequence[Curve]  # those that it has; none if it cannot be drawn

    @property
    def names(self) -> str:
        """The names of its curves, for a table without scripts."""
        return ", ".join(curve.name for curve in self.curves) or _NO_CURVES

    @cached_property
    def keys(self) -> dict[str, str]:
        """The keys of its scenario with dots, and their values as text."""
        file = self.path / "scenario.toml"
        return dict(flat_keys(read_toml(file)[1])) if file.is_file() else {}


def source_of(path: Path, label: str, solution: str | None = None) -> Source:
    """Return what the directory of a run, an ensemble or a budget has to draw, with its label on the page and the
    solution of a run that is drawn at first, by default that of its headline figure; raise InputError if it has no
    curves, or they cannot be read."""
    from pyarrow import ArrowException

    kind = kind_of(path)
    try:
        if kind == "ensemble":
            return Source(label, path, list(_of_ensemble(path)))
        if kind == "error budget":
            return Source(label, path, list(_of_budget(path)))
    except (OSError, KeyError, ValueError, ArrowException) as error:
        raise InputError(f"{path} cannot be read as an {kind}: {first_line(error)}. {reason_of(path)}") from error
    run = FinishedRun(path)
    chosen = run.solution(solution)
    curves = [_of_errors(name, run.errors(name), shown=name == chosen) for name in run.with_errors]
    return Source(label, path, [*curves, *_of_scores(path)])


def _of_errors(name: str, error: NavError, *, shown: bool = False) -> Curve:
    values = {"horizontal": error.horizontal, "height": np.abs(error.height), "speed": error.speed,
              "attitude": error.angle}  # fmt: skip
    known = {key: rows for key, rows in values.items() if np.isfinite(rows).any()}
    return Curve(name, error.time, known, shown)


def _of_scores(run: Path) -> Iterator[Curve]:
    """Yield the solutions of other programs that were scored beside a run."""
    from pyarrow import parquet

    for file in sorted((run / "scores").glob("*/error_*.parquet")):
        table = parquet.read_table(file, columns=list(ERROR_COLUMNS))
        rows = [table[column].to_numpy() for column in ERROR_COLUMNS]
        error = NavError(rows[0], np.stack(rows[1:4], 1), np.stack(rows[4:7], 1), np.stack(rows[7:10], 1))
        yield _of_errors(f"{file.parent.name} (scored)", error, shown=True)


def _of_ensemble(path: Path) -> Iterator[Curve]:
    """Yield the circles of an ensemble and the root mean squares over its runs that did not fail."""
    from pyarrow import parquet

    time = np.array(json.loads((path / "ensemble.json").read_text(encoding="utf-8"))["epochs_s"], float)
    names = [f"{what}_{axis}_{unit}" for what, unit in (("position", "m"), ("velocity", "mps"), ("attitude", "rad"))
             for axis in "ned"]  # fmt: skip
    tables = [
        parquet.read_table(file, columns=[*names, "failure"]) for file in sorted((path / "runs").glob("*.parquet"))
    ]
    failed = np.concatenate([np.array(table["failure"].to_pylist()) != "" for table in tables])

    def of(name: str) -> Array:
        parts = [table[name].combine_chunks().flatten().to_numpy() for table in tables]
        return np.concatenate(parts).reshape(len(failed), len(time))

    def rms(block: Sequence[str]) -> Array:
        squares = np.sum([of(name)[~failed] ** 2 for name in block], axis=0)
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(np.nansum(squares, axis=0) / np.isfinite(squares).sum(axis=0)))

    horizontal = np.where(failed[:, None], np.inf, np.hypot(of(names[0]), of(names[1])))
    yield Curve("CEP", time, {"horizontal": np.asarray(cep(horizontal).value)}, shown=True)
    yield Curve("R95", time, {"horizontal": np.asarray(r95(horizontal).value)}, shown=True, dash="--")
    values = {"height": rms(names[2:3]), "speed": rms(names[3:6]), "attitude": rms(names[6:])}
    yield Curve("rms", time, values, shown=True)


def _of_budget(path: Path) -> Iterator[Curve]:
    """Yield the circles of a budget, and the roots of variance and squared mean, of all sources together."""
    from pyarrow import parquet

    table = parquet.read_table(path / "budget.parquet", filters=[("source", "=", "total")])
    time = table["time_s"].to_numpy()

    def rms(*parts: str) -> Array:
        squares = [table[f"{kind}_{part}"].to_numpy() ** 2 for kind in ("sigma", "mean") for part in parts]
        return np.asarray(np.sqrt(np.sum(squares, axis=0)))

    yield Curve("CEP", time, {"horizontal": table["cep_m"].to_numpy()}, shown=True)
    yield Curve("R95", time, {"horizontal": table["r95_m"].to_numpy()}, shown=True, dash="--")
    velocity = rms(*(f"velocity_{axis}_mps" for axis in ("north", "east", "down")))
    attitude = rms("tilt_north_rad", "tilt_east_rad", "heading_rad")
    yield Curve("rms", time, {"height": rms("position_down_m"), "speed": velocity, "attitude": attitude}, shown=True)


def chosen_exhibits(sources: Sequence[Source], place: Path) -> tuple[list[Item], list[Item]]:
    """Return what a page shows of some runs, in the order of the rows of the table whose last column is "curves": their
    curves, and the keys that differ, with the script for choosing. Addresses of reports lead from the page's folder."""
    count = max(1, sum(len(source.curves) for source in sources))
    columns = int(min(max(_VALUES / (2 * len(QUANTITIES) * count), _LEAST), _MOST))
    sources = [replace(source, curves=[curve.thinned(columns) for curve in source.curves]) for source in sources]
    first = [(source, curve) for source in sources for curve in source.curves if curve.shown][:_AT_FIRST]
    if not first:
        return [Sentence("None of them has curves.")], []
    leading = {id(next(curve for curve in source.curves if curve.shown)) for source, _ in first}
    order = sorted((id(curve) for _, curve in first), key=lambda curve: curve not in leading)
    # the first curve of each has the colour of its row
    paint = dict(zip(order, style.others(len(order)), strict=True))
    thin = f"the least and the greatest value in each of {columns} equal parts of its time"
    note = (
        f"A long curve has {thin}. A run shows magnitudes of its errors, an ensemble and a budget their size over many "
        "runs."
    )
    curves: list[Item] = [_charts(first, paint), Sentence(note, "note", on=("page",))]
    keys = _table_of_keys(list({source.label: source for source, _ in first}.values()))
    return curves, [*keys, Interactive("several_runs", lambda: _data(sources, paint, place))]


def _charts(curves: Sequence[tuple[Source, Curve]], paint: Mapping[int, style.Rgb]) -> Charts:
    """Return the charts of some curves, in colours by their identity."""
    labels = [f"{source.label}: {curve.name}" for source, curve in curves]
    span = (min(float(curve.time[0]) for _, curve in curves), max(float(curve.time[-1]) for _, curve in curves))
    charts = []
    for key, (title, units) in QUANTITIES.items():
        lines = tuple(
            Line(
                label=label, x=curve.time, y=curve.values[key], color=paint[id(curve)], dash=curve.dash, step=curve.step
            )
            for label, (_, curve) in zip(labels, curves, strict=True)
            if key in curve.values
        )
        charts.append(Chart(key=f"several/{key}", title=title, x=over(span), y=Axis(units=units, low=0.0), marks=lines))
    return Charts("several", in_rows(charts, 2), (PAIR[0], 2.0 * PAIR[1]), on=("page",))


def differing(keys: Sequence[Mapping[str, str]]) -> dict[str, list[str]]:
    """Return the keys of scenarios that differ: values in their order, "–" for a missing key."""
    names = list(dict.fromkeys(key for entries in keys for key in entries))
    rows = {name: [entries.get(name, "–") for entries in keys] for name in names}
    return {name: values for name, values in rows.items() if len(set(values)) > 1}


def _table_of_keys(sources: Sequence[Source]) -> Iterator[Item]:
    rows = differing([source.keys for source in sources])
    if not rows:
        yield Sentence("The scenarios are the same.")
        return
    heads = (Column("key", words=True), *(Column(source.label, words=True) for source in sources))
    yield Table(heads, [(key, *values) for key, values in list(rows.items())[:_KEYS]])
    if len(rows) > _KEYS:
        yield Sentence(f"And {len(rows) - _KEYS} more; each scenario.toml has all of its keys.", "note")


def _data(sources: Sequence[Source], drawn: Mapping[int, style.Rgb], place: Path) -> tuple[dict[str, Any], list[Array]]:
    """Return what the script several_runs.js needs: names, keys and units as deflated JSON, and the curves that are not
    drawn at first; the charts of the page have the others."""
    arrays: dict[bytes, Array] = {}

    def number(values: Array) -> int:
        small = np.where(np.isfinite(values), values, np.nan).astype("<f4")
        arrays.setdefault(small.tobytes(), small)
        return numbers.setdefault(small.tobytes(), len(numbers))

    numbers: dict[bytes, int] = {}
    entries = [
        {
            "label": source.label, "report": _report(source.path, place),
            "curves": [
                {"name": curve.name, "dash": [6, 4] if curve.dash else [], "shown": id(curve) in drawn,
                 "color": style.css(drawn[id(curve)]) if id(curve) in drawn else None,
                 "headline": curve.shown, "step": curve.step,
                 "of": {key: [number(curve.time), number(rows)] for key, rows in curve.values.items()
                        if id(curve) not in drawn}}
                for curve in source.curves
            ],
        }
        for source in sources
    ]  # fmt: skip
    keys: dict[str, dict[str, list[int]]] = {}
    for row, source in enumerate(sources):
        for key, text in source.keys.items():
            keys.setdefault(key, {}).setdefault(text[:_LONG], []).append(row)
    keys = {key: rows for key, rows in keys.items() if len(next(iter(rows.values()))) < len(sources)}
    scales = {key: _units(scale) for key, (_, scale) in QUANTITIES.items()}
    whole = {"entries": entries, "keys": keys, "scales": scales, "times": _units(TIME_SCALE),
             "palette": [style.css(color) for color in style.others(24)]}  # fmt: skip
    text = json.dumps(whole, ensure_ascii=False, allow_nan=False)
    return {"packed": base64.b64encode(deflated(text.encode())).decode()}, list(arrays.values())


def _units(scale: Scale) -> list[tuple[str, float, float | None]]:
    return [(name, size, most if np.isfinite(most) else None) for name, size, most in scale]


def _report(path: Path, place: Path) -> str:
    """Return the address of a run's report from the folder of a page; "" without a report."""
    report = path / "report.html"
    return quote(Path(os.path.relpath(report, place)).as_posix()) if report.is_file() else ""
