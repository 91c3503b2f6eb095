"""The report of a covariance budget: a self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence

from sinssim.analyses.error_budget.budget_figure import growth_figure, ranking_figure, sigma_figure
from sinssim.analyses.error_budget.budget_table import (
    RATE,
    allowance_cells,
    lines_of,
    number,
    ranking_cells,
    time_columns,
    units_of_budget,
    when,
)
from sinssim.analyses.error_budget.limits import Answer
from sinssim.analyses.error_budget.result import BudgetResult
from sinssim.recording.figures.canvas import to_svg
from sinssim.recording.report.page import page, table, words
from sinssim.units import NAUTICAL_MILE


def budget_report(result: BudgetResult, answers: Sequence[Answer], times: Sequence[float] = ()) -> str:
    """Return the report.

    Args:
        result: the budget.
        answers: answers to requirements.
        times: instants of the table beside the usual ones, s.

    Returns:
        An HTML page with its figures as SVG.
    """
    what = "inertial navigation" if result.solution == "inertial" else "inertial navigation with the filter"
    body = [
        f"<h1>{words(result.scenario.name)}: covariance budget</h1>",
        f'<p class="lead">{words(result.scenario.description)}</p>',
        f"<p>Errors of {what} over all possible runs, by source. They are propagated along the true motion by the "
        "linear error equations, without random numbers.</p>",
        _ends(result),
    ]
    if answers:
        body += ["<h2>Requirements</h2>", *(part for answer in answers for part in _requirement(answer))]
    body += ["<h2>Growth of the error</h2>", to_svg(growth_figure(result, answers), "growth")]
    heads, cells = time_columns(result, times)
    body += ["<h3>Errors at selected times (root mean square over all runs)</h3>", table(heads, cells, 0)]
    body.append("<h2>What to improve first</h2>")
    for number_, t in enumerate(result.instants_to_rank):
        name = when(result, t)
        figure = to_svg(ranking_figure(result, t), f"ranking{number_}")
        body += [f"<h3>{words(name[0].upper() + name[1:])}</h3>", figure, _ranking(result, t)]
    body += [
        "<h2>Position, velocity and attitude</h2>",
        to_svg(sigma_figure(result, answers), "sigma"),
        *_notes(result),
    ]
    return page(f"{result.scenario.name}: covariance budget", body)


def _ends(result: BudgetResult) -> str:
    cep, r95, hours = float(result.cep[-1]), float(result.r95[-1]), float(result.time[-1]) / 3600.0
    (unit, metre), _, _ = units_of_budget(result)
    rate = f"{number(r95 / NAUTICAL_MILE / hours)} nmi/h as {RATE}"
    return (
        f"<p>After {result.time[-1]:g} s, half of all runs are within <strong>{number(cep / metre)} {unit}</strong> "
        f"(CEP) and 95 % within <strong>{number(r95 / metre)} {unit}</strong> (R95), {rate}.</p>"
    )


def _requirement(answer: Answer) -> list[str]:
    mark, word = ("met", "met") if answer.met else ("missed", "not met")
    _, *sentences = lines_of(answer)
    one = answer.requirement
    heads = ("source", "now", "at most", "")
    cells = [[*map(words, row[:3]), _text(row[3])] for row in allowance_cells(answer)]
    return [
        f'<h3>{words(one.text)}: <span class="{mark}">{word}</span></h3>',
        f"<p>{words(one.meaning[0].upper() + one.meaning[1:])}. {words(' '.join(sentences))}</p>",
        "<p class=note>Largest value of each source with which the requirement is met, if all others do not "
        "change:</p>",
        table(heads, cells, 1),
    ]


def _ranking(result: BudgetResult, t: float) -> str:
    heads, cells, small = ranking_cells(result, t)
    rows = [[*map(words, row[:3]), _text(row[3]), *map(words, row[4:7]), _text(row[7])] for row in cells]
    also = f'<p class="note">{small} more below 0.01 % of the mean square.</p>' if small else ""
    return table(heads, rows, 2) + also


def _text(value: str) -> str:
    return f"<td class=name>{words(value)}</td>"


def _notes(result: BudgetResult) -> list[str]:
    notes = ["The results are valid to first order in the errors; docs/budgets.md lists the effects that this omits."]
    if result.solution == "filter":
        notes.append(
            "Dotted: the covariance of the filter. A difference from the budget means that the filter's model differs "
            "from the true errors. If a source is halved or limited, the gains do not change; a filter whose model "
            "contains the change performs as well or better. The gate of the filter is not considered."
        )
    if any(source.kind == "one run" for source in result.sources):
        notes.append("Sources “from one run” are computed from the sensor outputs with only this source.")
    return [f'<p class="note">{words(note)}</p>' for note in notes]
