"""The tables of a trade study as text: one row for each cell, grids of one quantity, and which cells meet what."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sinssim.experiments.trades.result import CellResult, TradeResult
from sinssim.formatting import capital, number_text
from sinssim.scales import ANGLES, LENGTHS, SPEEDS, suiting
from sinssim.statistics.order_statistics import runs_for_band
from sinssim.statistics.rates import END
from sinssim.statistics.requirements.quantity import Quantity
from sinssim.statistics.requirements.requirement import QUANTITIES, SHARES, Requirement

SHORT = {
    "cep": "CEP", "r95": "R95", "rate": "rate", "velocity_north": "v north", "velocity_east": "v east",
    "velocity_down": "v down", "tilt_north": "tilt n", "tilt_east": "tilt e", "heading": "heading",
    "position_north": "north", "position_east": "east", "position_down": "height",
}  # fmt: skip
"""Names of quantities as heads of columns."""
_SHOWN = ("cep", "r95", "rate", "velocity_north", "velocity_east", "tilt_north", "tilt_east", "heading")
"""Quantities of the tables; the files have all."""
_SCALES = {"length": LENGTHS, "speed": SPEEDS, "angle": ANGLES}
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
    found = {**DEFINITIONS, **_OF_KIND[result.study.cell]}
    return found if "nees_mean" in result.columns else {k: v for k, v in found.items() if k != "NEES"}


def headline(result: TradeResult) -> str:
    """Return what a study is of, in a sentence or two."""
    study, count = result.study, len(result)
    what = "covariance budget" if study.cell == "budget" else "ensemble"
    grid = " × ".join(f"{len(axis.values)} values of {axis.title}" for axis in study.axes)
    runs = sorted({int(v) for one in result.cells if math.isfinite(v := one.value("runs"))})
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
    """Return the unit that suits some quantities of one dimension in all cells.

    Returns:
        The unit of its requirement for a single quantity with one, else the unit that suits the largest value.
    """
    first = quantities[0]
    if first.quantity == "rate":
        return Unit("nmi/h", 1.0)
    if len(quantities) == 1:
        for one in result.study.requirements:
            if one.quantity == first.quantity and first.when == one.when and one.unit in ("m", "nmi", "deg", "arcmin"):
                return Unit(one.unit, one.unit_size)
    values = np.concatenate([result.values(one).ravel() for one in quantities])
    return Unit(*suiting(_SCALES[first.dimension], values[np.isfinite(values)]))


def label_of(quantity: Quantity) -> str:
    """Return a quantity in words: "R95 at the end", "heading error at 1800 s, rms"."""
    if quantity.quantity in SHARES:
        return f"{SHORT[quantity.quantity]} {quantity.instant}"
    return f"{QUANTITIES[quantity.quantity][1]} {quantity.instant}, rms"


def cell_table(
    result: TradeResult, when: Quantity | None = None, bands: bool = False
) -> tuple[list[str], list[list[str]], int]:
    """Return the table with a row for each cell.

    Args:
        when: a quantity whose instant the table is of; the end by default.
        bands: whether ends of the 95 % bands are added to CEP, R95 and rate of ensembles.

    Returns:
        Heads with units, rows, and the number of columns from the left that hold words.
    """
    study = result.study
    at = when or Quantity("r95", "end")
    shown = [q for q in study.quantities if q.quantity in _SHOWN and (q.when, q.time) == (at.when, at.time)]
    kinds = [[q for q in shown if q.dimension == kind and q.quantity != "rate"] for kind in _SCALES]
    units = {q: unit_for(result, *kind) if len(kind) > 1 else unit_for(result, q) for kind in kinds for q in kind}
    units |= {q: unit_for(result, q) for q in shown if q not in units}
    nees = "nees_mean" in result.columns and when is None
    judged = [one for one in study.requirements if when is None]
    heads = ["cell", *(axis.heading for axis in study.axes), *(f"{SHORT[q.quantity]}, {units[q].name}" for q in shown)]
    heads += ["NEES / n", "in band"] if nees else []
    heads += [one.text for one in judged]
    rows = []
    for one in result.cells:
        row = [str(one.cell.number), *names(result, one)]
        if one.numbers is None:
            row += [one.status, *[""] * (len(heads) - len(row) - 1)]
            rows.append(row)
            continue
        row += [_value(one, q, units[q], bands and q.quantity in SHARES) for q in shown]
        if nees:
            row += [number_text(one.value("nees_mean")), _percent(one.value("nees_share_in_band"))]
        rows.append(row + [verdict_text(one, requirement) for requirement in judged])
    return heads, rows, 1 + len(study.axes)


def names(result: TradeResult, one: CellResult) -> list[str]:
    """Return the names of the values of a cell, one for each axis."""
    return [axis.name_of(k) for axis, k in zip(result.study.axes, one.cell.place, strict=True)]


def _value(one: CellResult, quantity: Quantity, unit: Unit, band: bool) -> str:
    text, column = unit.text(one.value(quantity.column)), quantity.column
    if not band or math.isnan(one.value(f"{column}_low")):
        return text
    return f"{text} ({unit.text(one.value(f'{column}_low'))} … {unit.text(one.value(f'{column}_high'))})"


def _percent(value: float) -> str:
    return "–" if math.isnan(value) else f"{100.0 * value:.0f} %"


def verdict_text(one: CellResult, requirement: Requirement) -> str:
    """Return the verdict of a cell on a requirement, and its value if no column shows it; "" without one."""
    found = one.verdict(requirement.text)
    if found is None:
        return ""
    shown = requirement.when == "end" and requirement.quantity in _SHOWN
    return MARKS[found.verdict] + (f": {found.text}" if found.text and not shown else "")


@dataclass(frozen=True)
class Grid:
    """A quantity over two axes, for one place on all others.

    Attributes:
        title: what it shows, with the unit.
        corner: names of the two axes.
        across: values of the second axis.
        rows: value of the first axis, and the quantity for each value of the second.
    """

    title: str
    corner: str
    across: list[str]
    rows: list[list[str]]


def grids(result: TradeResult, quantity: Quantity) -> Iterator[Grid]:
    """Yield a quantity over the last two axes, for each place on the others.

    Yields:
        One grid for each place; a requirement on the quantity that is met is marked by "*".
    """
    study = result.study
    unit, down, across = unit_for(result, quantity), study.axes[-2], study.axes[-1]
    judged = [r for r in study.requirements if (r.quantity, r.when) == (quantity.quantity, quantity.when)
              and (r.when != "at" or r.time == quantity.time)]  # fmt: skip
    for place in itertools.product(*map(range, study.shape[:-2])):
        fixed = ", ".join(f"{axis.title} {axis.name_of(k)} {axis.unit}".rstrip()
                          for axis, k in zip(study.axes, place, strict=False))  # fmt: skip
        rows = []
        for i in range(len(down.values)):
            row = [down.name_of(i)]
            for k in range(len(across.values)):
                one = result.cells[int(np.ravel_multi_index((*place, i, k), study.shape))]
                met = bool(judged) and all((v := one.verdict(r.text)) and v.verdict == "met" for r in judged)
                text = unit.text(one.value(quantity.column)) if one.status == "finished" else one.status
                row.append(f"{text} *" if met else text)
            rows.append(row)
        star = "; * meets " + " and ".join(r.text for r in judged) if judged else ""
        yield Grid(
            capital(f"{label_of(quantity)}, {unit.name}{f': {fixed}' if fixed else ''}{star}"),
            f"{down.heading} \\ {across.heading}", [across.name_of(k) for k in range(len(across.values))], rows,
        )  # fmt: skip


def requirement_lines(result: TradeResult) -> list[str]:
    """Return which cells meet each requirement, and all of them together.

    Returns:
        Whole sentences; none without a requirement.
    """
    study = result.study
    lines = []
    for one in study.requirements:
        lines.append(f"{one.text}: {_met(result, [one])}")
    if len(lines) > 1:
        lines.append(f"All {len(lines)} requirements together: {_met(result, study.requirements)}")
    return lines


def _met(result: TradeResult, requirements: Sequence[Requirement]) -> str:
    """Return how many cells meet some requirements, and which."""
    word: dict[str, list[CellResult]] = {"met": [], "not met": [], "undecided": []}
    for one in result.cells:
        found = [v.verdict for r in requirements if (v := one.verdict(r.text)) is not None]
        if found:
            word["not met" if "not met" in found else "undecided" if "undecided" in found else "met"].append(one)
    judged = sum(map(len, word.values()))
    met, undecided = word["met"], word["undecided"]
    sure = " with 95 % confidence" if result.study.cell == "ensemble" else ""
    text = f"met{sure} in {len(met)} of {judged} cells"
    if met and len(met) < judged:
        numbers = [one.cell.number for one in met]
        text += f" ({'; '.join(map(result.name, numbers)) if len(met) <= _NAMED else _ranges(numbers)})"
    if undecided:
        more = [v.more_runs for one in undecided for r in requirements if (v := one.verdict(r.text)) and v.more_runs]
        hint = f"; about {_rounded(max(more))} more runs would decide them" if more and len(requirements) == 1 else ""
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


def _rounded(number: int) -> int:
    return round(number, 2 - len(str(number))) if number >= 100 else number


def failure_lines(result: TradeResult) -> list[str]:
    """Return the failed cells with their reasons."""
    return [f"cell {number}, {result.name(number)}: failed: {text}" for number, text in result.failures.items()]


def instants(result: TradeResult) -> list[Quantity]:
    """Return one quantity for each of the study's times, by which `cell_table` is asked for their tables."""
    return [Quantity("r95", "at", t) for t in result.study.times_s]
