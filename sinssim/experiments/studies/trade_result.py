"""The result of a trade study: numbers of its cells over the grid, as a table, and as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, html_table
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.experiments.studies.trade_cells import Cell, SourceParts, command_of, place_name
from sinssim.experiments.studies.trade_schema import Axis, TradeStudy, value_text
from sinssim.recording.result import Media, Result
from sinssim.statistics.circular_error import END
from sinssim.statistics.percentiles import runs_for_band
from sinssim.statistics.requirements import QUANTITIES, SHARES, Quantity, Requirement, parse_quantity, quantity_of
from sinssim.system.files import draft
from sinssim.units import (
    ANGLE_SCALE,
    KNOT,
    LENGTH_SCALE,
    SPEED_SCALE,
    number_text,
    percent,
    suiting,
    two_digits,
    with_band,
)


@dataclass(eq=False, repr=False)
class TradeResult(Result):
    """The result of a trade study.

    Attributes:
        study: the study.
        cells: the cells with their numbers; the last axis changes fastest.
        status: "finished", "interrupted" or "failed".
        directory: directory of the study; None if nothing is kept.
        seconds: duration of the computation, s, of this call alone.
        computed: number of cells computed by this call; the others had been finished before.
        notes: remarks on how it was computed, whole sentences.
        media: what draws and writes it.
    """

    study: TradeStudy
    cells: tuple[Cell, ...]
    status: str = "finished"
    directory: Path | None = None
    seconds: float = 0.0
    computed: int = 0
    notes: list[str] = field(default_factory=list)
    media: Media[TradeResult] = field(kw_only=True, repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.cells)

    def __repr__(self) -> str:
        grid = " × ".join(map(str, self.shape))
        return f"TradeResult({self.study.name}: {grid} {self.study.cell} cells, {len(self.failures)} failed)"

    def _repr_html_(self) -> str:
        rows = [
            (self.name(cell.number), cell.status, *(f"{cell.value(q.column):.4g}" for q in self.study.drawn))
            for cell in self.cells
        ]
        return html_table(repr(self), rows, ("cell", "status", *(q.column for q in self.study.drawn)))

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return self.study.shape

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes of the grid."""
        return self.study.axes

    @property
    def failures(self) -> dict[int, str]:
        """Why cells failed, by their number from 1."""
        return {cell.number: cell.failure for cell in self.cells if cell.failure}

    @property
    def finished(self) -> int:
        """Number of cells with numbers."""
        return sum(cell.status == "finished" for cell in self.cells)

    def values(self, quantity: str | Quantity) -> Array:
        """Return a quantity over the grid.

        Args:
            quantity: for example "r95(end)", "heading(1800 s)"; or a column of the table, such as "nees_mean".

        Returns:
            SI, rates in nmi/h, of the shape of the grid; NaN where a cell has none.

        Raises:
            InputError: the study does not have the quantity.
        """
        return self._grid(self._column(quantity))

    def band(self, quantity: str | Quantity) -> tuple[Array, Array]:
        """Return the 95 % band of a quantity over the grid; NaN for budgets, which have no scatter.

        Args:
            quantity: as for `values`.

        Returns:
            Its low and its high end, as for `values`.

        Raises:
            InputError: the study does not have the quantity.
        """
        column = self._column(quantity)
        return self._grid(f"{column}_low"), self._grid(f"{column}_high")

    def _grid(self, column: str) -> Array:
        return np.array([cell.value(column) for cell in self.cells]).reshape(self.shape)

    def _column(self, quantity: str | Quantity) -> str:
        if isinstance(quantity, Quantity):
            return quantity.column
        columns = self.columns
        if quantity in columns:
            return quantity
        column = parse_quantity(quantity).column
        if column not in columns:
            known = [quantity.text for quantity in self.study.quantities]
            raise InputError(
                f"the study {self.study.name} does not have {shortened(repr(quantity))}: give its time in times_s, or "
                f"the quantity in draw. It has {', '.join(known)}."
            )
        return column

    @property
    def columns(self) -> list[str]:
        """Names of the numbers of the cells."""
        names: dict[str, None] = {cell.column: None for cell in self.study.quantities}
        for cell in self.cells:
            names |= dict.fromkeys(cell.numbers.values if cell.numbers is not None else ())
        return list(names)

    def verdicts(self, requirement: str | None = None) -> NDArray[np.str_]:
        """Return verdicts over the grid.

        Args:
            requirement: one of `study.require`; all of them together by default.

        Returns:
            "met", "not met", "undecided", or "" where a cell has no verdict.

        Raises:
            InputError: the study does not have the requirement.
        """
        texts = [cell.text for cell in self.study.requirements]
        if requirement is not None and requirement not in texts:
            raise unknown_name("requirement", requirement, texts)
        wanted = texts if requirement is None else [requirement]
        return np.array([cell.verdict_on(wanted) for cell in self.cells]).reshape(self.shape)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row for each cell: values of the axes by their keys, status, numbers by column, verdicts, failure."""
        columns, rows = self.columns, []
        for cell in self.cells:
            row: dict[str, Any] = {"cell": cell.number}
            for axis, k in zip(self.study.axes, cell.place, strict=True):
                row |= dict(axis.settings(k))
                if axis.labels:
                    row[axis.title] = axis.labels[k]
            row |= {"status": cell.status}
            row |= {column: cell.value(column) for column in columns}
            for text in self.study.require:
                verdict = cell.verdict(text.strip())
                row[text] = None if verdict is None else verdict.verdict
            rows.append(row | {"failure": cell.failure})
        return rows

    def name(self, number: int) -> str:
        """Return the values of a cell in words.

        Args:
            number: its number, from 1.

        Returns:
            "grade tactical, gyro bias σ 0.01 deg/h".
        """
        return place_name(self.study, self._cell(number).place)

    def command(self, number: int, program: str = "sinssim") -> str:
        """Return the command that computes a cell by itself, with the same numbers.

        Args:
            number: its number, from 1.
            program: how sinssim is called.

        Returns:
            `sinssim budget …` or `sinssim ensemble …`.
        """
        return command_of(self.study, self._cell(number), program)

    def digest(self, number: int) -> str:
        """Return the digest of a cell's scenario and of the requested results.

        Args:
            number: its number, from 1.

        Returns:
            SHA-256 in hexadecimal; "" if the cell has no scenario.
        """
        return self._cell(number).digest

    def _cell(self, number: int) -> Cell:
        if not 1 <= number <= len(self.cells):
            raise InputError(f"cell {number}: the study has the cells 1 to {len(self.cells)}.")
        return self.cells[number - 1]

    def to_table(self) -> Any:
        """Return a row for each cell as a `pyarrow.Table`.

        Returns:
            The columns of `rows`; values of an axis that are not numbers are texts.
        """
        import pyarrow as pa

        rows, columns = self.rows, {}
        for name in rows[0]:
            values = [row[name] for row in rows]
            kinds = {float if isinstance(value, float) else type(value) for value in values}
            if kinds == {int, float}:
                values = [float(value) for value in values]
            elif kinds not in ({bool}, {int}, {float}) and not kinds <= {str, type(None)}:
                values = [value_text(value) for value in values]
            columns[name] = pa.array(values, pa.string() if type(None) in kinds else None)
        return pa.table(columns)

    def to_parquet(self, path: Path | str) -> Path:
        """Write a row for each cell as a Parquet file.

        Args:
            path: the file.

        Returns:
            The file.

        Raises:
            InputError: it cannot be written.
        """
        import pyarrow.parquet as pq

        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            with draft(Path(path)) as beside:
                pq.write_table(self.to_table(), beside)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error
        return Path(path)


SHORT = {
    "cep": "CEP", "r95": "R95", "rate": "rate", "velocity_north": "v north", "velocity_east": "v east",
    "velocity_down": "v down", "tilt_north": "tilt n", "tilt_east": "tilt e", "heading": "heading",
    "position_north": "north", "position_east": "east", "position_down": "height", "tse": "TSE", "nse": "NSE",
    "fte": "FTE", "tse_vertical": "TSE vertical", "miss": "miss",
}  # fmt: skip
"""Names of quantities as heads of columns."""
_SHOWN = ("cep", "r95", "rate", "velocity_north", "velocity_east", "tilt_north", "tilt_east", "heading")
"""Quantities of the tables; the files have all."""
_SCALES = {"length": LENGTH_SCALE, "speed": SPEED_SCALE, "angle": ANGLE_SCALE}
_NAMED = 3
"""Most cells that are named by their values in a sentence; more are named by their numbers."""
MARKS = {"met": "met", "not met": "NOT MET", "undecided": "undecided"}

DEFINITIONS = {
    "CEP, R95": "radius of the circle that contains half, or 95 %, of all runs",
    "velocity, tilt, heading": "root mean square over all runs of the error; 1σ where its mean is zero",
}
_OF_KIND = {
    "budget": {"rate": "R95 divided by the time since the start; 1 nmi = 1852 m"},
    "ensemble": {
        "CEP, R95": "50th and 95th percentile over the runs; the error of a failed run is infinite",
        "rate": f"R95 of {END}, of each run; 1 nmi = 1852 m",
        "velocity, tilt, heading": "root mean square over the runs that did not fail; 1σ where its mean is zero",
        "band": "95 % confidence: of percentiles by order statistics, of a root mean square by χ² for normal errors",
        "NEES": "mean of all states per degree of freedom, over runs and epochs, 1 is expected; and the share of the "
        "epochs at which the mean over the runs lies in its 95 % band",
    },
}


def definitions(result: TradeResult) -> dict[str, str]:
    """Return what each number of a study means, by its name."""
    texts = {**DEFINITIONS, **_OF_KIND[result.study.cell]}
    return texts if "nees_mean" in result.columns else {k: v for k, v in texts.items() if k != "NEES"}


def headline(result: TradeResult) -> str:
    """Return what a study is of, in a sentence or two."""
    study, count = result.study, len(result)
    what = "covariance budget" if study.cell == "budget" else "ensemble"
    grid = " × ".join(f"{len(axis.values)} values of {axis.title}" for axis in study.axes)
    runs = sorted({int(v) for cell in result.cells if math.isfinite(v := cell.value("runs"))})
    of_runs = f" of {' to '.join(dict.fromkeys((str(runs[0]), str(runs[-1]))))} runs" if runs else ""
    parts = [f"{count} {what}{'s' if count > 1 else ''}{of_runs} of {study.scenario.rpartition('/')[2]}: {grid}."]
    if study.set:
        parts.append(f"The same in every cell: {', '.join(study.set)}.")
    if runs and runs[0] < (needed := runs_for_band(0.95)):
        parts.append(f"R95 has no upper bound with fewer than {needed} runs.")
    if result.status != "finished":
        parts.append(f"The study {'was interrupted' if result.status == 'interrupted' else 'failed'}: "
                     f"{result.finished} of {count} cells are finished.")  # fmt: skip
    if result.failures:
        parts.append(f"{len(result.failures)} of {count} cells failed.")
    return " ".join(parts)


@dataclass(frozen=True)
class Unit:
    """The unit in which a quantity is printed."""

    name: str
    size: float

    def text(self, value: float) -> str:
        """Return a number in this unit with three digits."""
        return "∞" if value == math.inf else number_text(value / self.size)


def unit_for(result: TradeResult, *quantities: Quantity) -> Unit:
    """Return the unit of the requirement on a single quantity, else the one that suits the largest value in all cells.

    The quantities have one dimension.
    """
    first = quantities[0]
    if first.quantity == "rate":
        return Unit("nmi/h", 1.0)
    if len(quantities) == 1:
        for requirement in result.study.requirements:
            if (
                requirement.quantity == first.quantity
                and first.when == requirement.when
                and requirement.unit in ("m", "nmi", "deg", "arcmin")
            ):
                return Unit(requirement.unit, requirement.unit_size)
    values = np.concatenate([result.values(requirement).ravel() for requirement in quantities])
    return Unit(*suiting(_SCALES[first.dimension], values[np.isfinite(values)]))


def label_of(quantity: Quantity) -> str:
    """Return a quantity in words: "R95 at the end", "heading error at 1800 s, rms"."""
    if quantity.quantity in SHARES:
        return f"{SHORT[quantity.quantity]} {quantity.instant}"
    return f"{QUANTITIES[quantity.quantity][1]} {quantity.instant}, rms"


def cell_table(
    result: TradeResult, when: Quantity | None = None, bands: bool = False
) -> tuple[list[str], list[list[str]], int]:
    """Return heads with units, rows, and the number of columns of words at the left, of the table with a row for each
    cell, at the instant of the quantity `when`, by default at the end. With `bands`, CEP, R95 and rate of ensembles
    have the ends of their 95 % bands."""
    study = result.study
    at = when or Quantity("r95", "end")
    shown = [q for q in study.quantities if q.quantity in _SHOWN and (q.when, q.time) == (at.when, at.time)]
    kinds = [[q for q in shown if q.dimension == kind and q.quantity != "rate"] for kind in _SCALES]
    units = {q: unit_for(result, *kind) if len(kind) > 1 else unit_for(result, q) for kind in kinds for q in kind}
    units |= {q: unit_for(result, q) for q in shown if q not in units}
    nees = "nees_mean" in result.columns and when is None
    judged = [cell for cell in study.requirements if when is None]
    heads = ["cell", *(axis.heading for axis in study.axes), *(f"{SHORT[q.quantity]}, {units[q].name}" for q in shown)]
    heads += ["NEES / n", "in band"] if nees else []
    heads += [cell.text for cell in judged]
    rows = []
    for cell in result.cells:
        row = [str(cell.number), *names(result, cell)]
        if cell.numbers is None:
            row += [cell.status, *[""] * (len(heads) - len(row) - 1)]
            rows.append(row)
            continue
        row += [_value(cell, q, units[q], bands and q.quantity in SHARES) for q in shown]
        if nees:
            row += [number_text(cell.value("nees_mean")), percent(cell.value("nees_share_in_band"))]
        rows.append(row + [verdict_text(cell, requirement) for requirement in judged])
    return heads, rows, 1 + len(study.axes)


def names(result: TradeResult, cell: Cell) -> list[str]:
    """Return the names of the values of a cell, one for each axis."""
    return [axis.name_of(k) for axis, k in zip(result.study.axes, cell.place, strict=True)]


def _value(cell: Cell, quantity: Quantity, unit: Unit, band: bool) -> str:
    value, low, high = (cell.value(f"{quantity.column}{end}") for end in ("", "_low", "_high"))
    return with_band(value, low, high, unit.size) if band and not math.isnan(low) else unit.text(value)


def verdict_text(cell: Cell, requirement: Requirement) -> str:
    """Return the verdict of a cell on a requirement, and its value if no column shows it; "" without one."""
    verdict = cell.verdict(requirement.text)
    if verdict is None:
        return ""
    shown = requirement.when == "end" and requirement.quantity in _SHOWN
    return MARKS[verdict.verdict] + (f": {verdict.text}" if verdict.text and not shown else "")


def requirement_lines(result: TradeResult) -> list[str]:
    """Return in whole sentences which cells meet each requirement, and all of them together."""
    study = result.study
    lines = []
    for requirement in study.requirements:
        lines.append(f"{requirement.text}: {_met(result, [requirement])}")
    if len(lines) > 1:
        lines.append(f"All {len(lines)} requirements together: {_met(result, study.requirements)}")
    return lines


def _met(result: TradeResult, requirements: Sequence[Requirement]) -> str:
    """Return how many cells meet some requirements, and which."""
    word: dict[str, list[Cell]] = {"met": [], "not met": [], "undecided": []}
    for cell in result.cells:
        if verdict := cell.verdict_on(requirement.text for requirement in requirements):
            word[verdict].append(cell)
    judged = sum(map(len, word.values()))
    met, undecided = word["met"], word["undecided"]
    sure = " with 95 % confidence" if result.study.cell == "ensemble" else ""
    text = f"met{sure} in {len(met)} of {judged} cells"
    if met and len(met) < judged:
        numbers = [cell.number for cell in met]
        text += f" ({'; '.join(map(result.name, numbers)) if len(met) <= _NAMED else _ranges(numbers)})"
    if undecided:
        more = [v.more_runs for cell in undecided for r in requirements if (v := cell.verdict(r.text)) and v.more_runs]
        hint = f"; about {two_digits(max(more))} more runs would decide them" if more and len(requirements) == 1 else ""
        text += f", undecided in {len(undecided)}{hint}"
    return text + "."


def _ranges(numbers: Sequence[int]) -> str:
    """Return rising numbers with runs of neighbours in short: "1–5, 8, 9"."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    words = (f"{p[0]}–{p[-1]}" if len(p) > 2 else ", ".join(map(str, p)) for p in parts)
    return f"numbers {', '.join(words)}"


def failure_lines(result: TradeResult) -> list[str]:
    """Return the failed cells with their reasons."""
    return [f"cell {number}, {result.name(number)}: failed: {text}" for number, text in result.failures.items()]


def instants(result: TradeResult) -> list[Quantity]:
    """Return one quantity for each of the study's times, by which `cell_table` is asked for their tables."""
    return [Quantity("r95", "at", t) for t in result.study.times_s]


def asked(study: TradeStudy) -> list[Quantity]:
    """Return the quantities of a study's requirements and figures."""
    return list(dict.fromkeys((*map(quantity_of, study.requirements), *study.drawn)))


def what_if(result: TradeResult) -> tuple[dict[str, Any], list[Array]]:
    """Return what a page needs to answer for other sizes of the sources, in all budgets at once: plain values, and the
    parts as arrays, for each cell, source and quantity in order.

    The covariance is quadratic in the size of a random source and the mean is linear in that of a given one, so that
    the page computes the quantities of the cells as exactly as the budgets do.
    """
    study, arrays, cells, quantities = result.study, list[Array](), [], asked(result.study)
    known: dict[str, SourceParts] = {}
    budgets = [(cell, cell.numbers) for cell in result.cells if cell.numbers is not None and cell.numbers.sources]
    for cell, numbers in budgets:
        known |= {source.name: source for source in numbers.sources}
        arrays += [np.ravel(source.parts[quantity.text]) for source in numbers.sources for quantity in quantities]
        cells.append(
            {"name": place_name(study, cell.place, titled=False),
             "sources": [[source.name, source.value if math.isfinite(source.value) else None, source.random]
                         for source in numbers.sources],
             "computed": [numbers.values[quantity.column] for quantity in quantities],
             "times": [numbers.instants[quantity.text] for quantity in quantities]}
        )  # fmt: skip
    units = [unit_for(result, quantity) for quantity in quantities]
    plain = {
        "cells": cells, "study": study.name, "seconds": result.seconds / max(result.computed, 1),
        "filter": any("filter_r95_end_m" in numbers.values for _, numbers in budgets),
        "sources": [{"name": name, "label": f"{source.group}: {source.label}", "unit": source.unit, "key": source.key}
                    for name, source in known.items()],
        "quantities": [
            {"label": f"{label_of(quantity)}", "share": SHARES.get(quantity.quantity, 0.0),
             "rate": quantity.quantity == "rate", "unit": unit.name, "size": unit.size,
             "some": quantity.when == "run"}
            for quantity, unit in zip(quantities, units, strict=True)
        ],
        "requirements": [
            {"text": requirement.text, "quantity": quantities.index(quantity_of(requirement)),
             "limit": requirement.limit / (KNOT if requirement.quantity == "rate" else 1.0)}
            for requirement in study.requirements
        ],
    }  # fmt: skip
    return plain, arrays
