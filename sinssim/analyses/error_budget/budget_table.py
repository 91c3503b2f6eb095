"""The tables of a covariance budget on the console."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.analyses.error_budget.limits import Allowance, Answer
from sinssim.analyses.error_budget.result import BudgetResult
from sinssim.recording.scales import ANGLES, LENGTHS, SPEEDS, suiting
from sinssim.units import NAUTICAL_MILE

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

_KINDS = {"given": "same in every run", "one run": "from one run", "random": ""}
_ANY = 1000.0
"""Factor beyond which the largest value of a source is not printed."""
_LEAST = 1e-4
"""Sources with a smaller share of the horizontal mean square are counted, not listed."""

_ROUNDING = 1e-9
"""Share of the limit below which a margin is rounding."""

FIXED_GAINS = (
    "If a source is halved or limited, the gains of the filter do not change; a filter whose model contains the "
    "change performs as well or better."
)
"""What ranking and limits of an aided budget assume."""

RATE = "R95 divided by the time since the start"
"""Definition of the rate."""


def units_of_budget(result: BudgetResult) -> tuple[tuple[str, float], tuple[str, float], tuple[str, float]]:
    """Return one unit each for the lengths, velocities and angles in all tables and figures of a budget.

    Args:
        result: the budget.

    Returns:
        Name and size in SI of the units.
    """
    errors = result.root_mean_square()
    return (
        suiting(LENGTHS, errors[:, :3], result.cep, result.r95),
        suiting(SPEEDS, errors[:, 3:6]),
        suiting(ANGLES, errors[:, 6:]),
    )


def number(value: float) -> str:
    """Write a number with four significant digits, a small one without an exponent."""
    if 1e-7 < abs(value) < 1e-4:
        return f"{value:.{3 - math.floor(math.log10(abs(value)))}f}"
    return "–" if math.isnan(value) else f"{value:,.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


def show(result: BudgetResult, answers: Sequence[Answer], console: Console, times: Sequence[float] = ()) -> None:
    """Print a budget: errors over time, the ranking, and the answers to requirements.

    Args:
        result: the budget.
        answers: answers to requirements.
        console: the console to print on.
        times: instants of the table beside the usual ones, s.
    """
    what = "inertial navigation" if result.solution == "inertial" else "inertial navigation with the filter"
    console.print(f"{result.scenario.name}: covariance budget of {what}\n", markup=False)
    console.print(_over_time(result, times))
    for t in result.instants_to_rank:
        console.print(_ranking(result, t))
    hours = float(result.time[-1]) / 3600.0
    rate = float(result.r95[-1]) / NAUTICAL_MILE / hours
    console.print(f"Rate at the end: {number(rate)} nmi/h ({RATE}).", markup=False)
    if result.solution == "filter":
        console.print(FIXED_GAINS, markup=False)
    for answer in answers:
        console.print()
        for line in lines_of(answer):
            console.print(line, markup=False)
        console.print(_allowances(answer))


def _table(title: str, heads: Sequence[tuple[str, str]]) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head, justify in heads:
        table.add_column(head, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    return table


def time_columns(result: BudgetResult, times: Sequence[float]) -> tuple[list[str], list[list[str]]]:
    """Return heads with units, and the cells, of the errors over time.

    Args:
        result: the budget.
        times: instants beside the usual ones, s.

    Returns:
        Heads and rows.
    """
    rows = result.table_rows(times)
    values = result.root_mean_square()[rows]
    circles = [result.cep[rows], result.r95[rows]]
    (length, metre), (speed, mps), (angle, rad) = units_of_budget(result)
    names = ("north", "east", "down", "v north", "v east", "v down", "tilt n", "tilt e", "heading")
    sizes = [(length, metre)] * 3 + [(speed, mps)] * 3 + [(angle, rad)] * 3
    heads = ["t, s", f"CEP, {length}", f"R95, {length}", *(f"{n}, {u}" for n, (u, _) in zip(names, sizes, strict=True))]
    cells = []
    for k, row in enumerate(rows):
        own = [values[k, i] / size for i, (_, size) in enumerate(sizes)]
        cells.append([f"{result.time[row]:g}", *(number(float(v)) for v in (*(c[k] / metre for c in circles), *own))])
    return heads, cells


def _over_time(result: BudgetResult, times: Sequence[float]) -> Table:
    heads, cells = time_columns(result, times)
    table = _table("Errors over time: root mean square over all runs; CEP and R95 are the radii of 50 % and 95 % of "
    "the runs",
                   [(head.replace(", ", "\n"), "right") for head in heads])  # fmt: skip
    for row in cells:
        table.add_row(*row)
    return table


def ranking_cells(result: BudgetResult, t: float) -> tuple[list[str], list[list[str]], int]:
    """Return the ranking at an instant.

    Args:
        result: the budget.
        t: instant, s.

    Returns:
        Heads, cells, and the number of sources that are too small to be listed.
    """
    ranked = result.improvements(t)
    (unit, metre), _, _ = units_of_budget(result)
    shown = [one for one in ranked if abs(one.share) >= _LEAST]
    heads = ["source", "group", "value", "", "share", f"R95 alone, {unit}", f"R95 decrease if halved, {unit}", ""]
    cells = [
        [one.source.name, one.source.group.replace("_", " "), number(one.source.value), one.source.unit,
         f"{100.0 * one.share:.2f} %", number(one.alone / metre), number(one.gain / metre), _KINDS[one.source.kind]]
        for one in shown
    ]  # fmt: skip
    return heads, cells, len(ranked) - len(shown)


def when(result: BudgetResult, t: float) -> str:
    """Return an instant of a ranking in words."""
    return f"at the end, {t:g} s" if t == result.time[-1] else f"where R95 is largest, at {t:g} s"


def _ranking(result: BudgetResult, t: float) -> Table:
    heads, cells, small = ranking_cells(result, t)
    justify = ["left", "left", "right", "left", "right", "right", "right", "left"]
    title = f"What to improve first, {when(result, t)}"
    table = _table(title, list(zip(heads, justify, strict=True)))
    for row in cells:
        table.add_row(*row)
    if small:
        plural = "source" if small == 1 else "sources"
        table.caption, table.caption_justify = f"{small} {plural} below 0.01 % of the mean square", "left"
    return table


def lines_of(answer: Answer) -> Iterator[str]:
    """Yield the answer to a requirement in sentences.

    Args:
        answer: the answer.

    Yields:
        Whole sentences.
    """
    one, size, unit = answer.requirement, answer.requirement.unit_size, answer.requirement.unit
    verdict = "met" if answer.met else "NOT MET"
    yield f"{one.text}: {verdict}. {one.meaning[0].upper()}{one.meaning[1:]}."
    side = "below" if answer.met else "above"
    share = abs(answer.margin) / one.limit
    apart = f"{number(abs(answer.margin) / size)} {unit} ({100.0 * share:.3g} %) {side} the limit"
    yield (
        f"{'The largest value' if one.when == 'run' else 'It'} is {number(answer.value / size)} {unit} at "
        f"{answer.time:g} s, {'which is the limit' if share < _ROUNDING else apart}."
    )
    if answer.exceeded is not None:
        yield f"It is {answer.exceeded.text}."
    if answer.joint is not None:
        yield _joint(answer.joint, answer)
    if not any(allowance.possible for allowance in answer.allowances):
        yield "No single source can be made small enough: even with any one of them at zero, the limit is exceeded."
    if answer.everything.possible and not answer.met:
        yield f"It is met with all sources in the table {number(answer.everything.factor)} times as large as they are."


def _joint(joint: Allowance, answer: Answer) -> str:
    one = answer.requirement
    names = " and ".join(source.name for source in joint.sources)
    if not joint.possible:
        return (
            f"Not even with {names} at zero: the other sources alone give {number(joint.without / one.unit_size)} "
            f"{one.unit}."
        )
    if math.isinf(joint.factor):
        return f"{names} have no effect on it."
    values = ", ".join(
        f"{source.name} {number(value)} {source.unit}"
        for source, value in zip(joint.sources, joint.values, strict=True)
    )
    return f"Together, by the common factor {number(joint.factor)}, they may be at most: {values}."


def allowance_cells(answer: Answer) -> list[list[str]]:
    """Return the cells of the largest values of the sources: source, present and largest value, remark."""
    one, cells = answer.requirement, []
    for allowance in answer.allowances:
        source: Source = allowance.sources[0]
        unit = source.unit
        if not allowance.possible:
            rest = f"{number(allowance.without / one.unit_size)} {one.unit}"
            unit, largest, remark = "", "–", f"not even at zero, because the other sources give {rest}"
        elif allowance.factor > _ANY:
            unit, largest, remark = "", "any", f"more than {_ANY:g} times the present value"
        else:
            largest, remark = number(allowance.values[0]), f"{number(allowance.factor)} times the present value"
        cells.append([source.name, f"{number(source.value)} {source.unit}", f"{largest} {unit}".rstrip(), remark])
    return cells


def _allowances(answer: Answer) -> Table:
    heads = [("source", "left"), ("now", "right"), ("at most", "right"), ("", "left")]
    table = _table("Largest value of each source with which it is met, if all others do not change", heads)
    for row in allowance_cells(answer):
        table.add_row(*row)
    return table
