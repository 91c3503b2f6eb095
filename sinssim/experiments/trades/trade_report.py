"""The report of a trade study: a self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sinssim.experiments.trades import trade_figure as figures
from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.summary import (
    MARKS,
    cell_table,
    definitions,
    failure_lines,
    headline,
    instants,
    requirement_lines,
)
from sinssim.experiments.trades.trade_grid_figure import MOST_PANELS
from sinssim.recording.figures.canvas import to_svg
from sinssim.recording.report.page import page, table, words

_STYLE = """
.command { font-family: ui-monospace, "Liberation Mono", monospace; font-size: .78rem; white-space: normal;
  overflow-wrap: anywhere; text-align: left; min-width: 24rem; }
"""
_CLASSES = {MARKS["met"]: "met", MARKS["not met"]: "missed"}
"""Styles of the verdicts of cells, by their first words."""


def trade_report(result: TradeResult, drawn: Sequence[figures.Picture], about: Mapping[str, str]) -> str:
    """Return the report of a trade study.

    Args:
        result: the study.
        drawn: its pictures.
        about: versions and machine, by name.

    Returns:
        An HTML page with its figures as SVG.
    """
    study = result.study
    body = [f"<h1>{words(study.name)}: a trade study</h1>"]
    if study.description:
        body.append(f'<p class="lead">{words(study.description)}</p>')
    body.append(f'<p class="note">{words(headline(result))}</p>')
    body += [f"<p><strong>{words(note)}</strong></p>" for note in result.notes]
    if study.requirements:
        lines = "".join(f"<li>{words(line)}</li>" for line in requirement_lines(result))
        body += ["<h2>Requirements</h2>", f"<ul>{lines}</ul>"]
    body.append("<h2>Trade-offs</h2>")
    panels = len(result) // (study.shape[-1] * (study.shape[-2] if len(study.axes) > 1 else 1))
    if panels > MOST_PANELS:
        body.append(f"<p class=note>The figures show {MOST_PANELS} of {panels} panels; the table has all.</p>")
    for one in drawn:
        body += [f"<h3>{words(one.title)}</h3>", to_svg(one.figure, one.name)]
    body.append("<h2>Cells</h2>")
    for when in (None, *instants(result)):
        heads, rows, count = cell_table(result, when, bands=True)
        body.append(f"<h3>{'At the end' if when is None else words(when.instant).capitalize()}</h3>")
        judged = len(study.requirements) if when is None else 0
        numbers = range(len(heads) - judged)
        if study.cell == "budget" or not judged:  # bands leave no room for the verdicts
            body.append(_cells(heads, rows, range(len(heads)), count))
            continue
        body.append(_cells(heads, rows, numbers, count))
        body.append("<h3>Verdicts</h3>")
        body.append(_cells(heads, rows, [*range(count), *range(len(numbers), len(heads))], count))
    if result.failures:
        lines = "".join(f"<li>{words(line)}</li>" for line in failure_lines(result))
        body += ["<h2>Failed cells</h2>", f"<ul>{lines}</ul>"]
    body += ["<h2>Definitions</h2>", _definitions(result), "<h2>How it was computed</h2>", _method(result, about)]
    return page(f"{study.name}: trade study", body, _STYLE)


def _cells(heads: Sequence[str], rows: Sequence[Sequence[str]], columns: Sequence[int], names: int) -> str:
    """Return some columns of the table of cells."""
    lines = [tuple(_marked(row[k]) for k in columns) for row in rows]
    return table(tuple(words(heads[k]) for k in columns), lines, names)


def _marked(text: str) -> str:
    word, colon, value = text.partition(": ")
    kind = _CLASSES.get(word)
    return f'<span class="{kind}">{words(word.lower())}</span>{words(colon + value)}' if kind else words(text)


def _definitions(result: TradeResult) -> str:
    lines = [(words(name), f'<td class="text">{words(text)}</td>') for name, text in definitions(result).items()]
    return table(("", "<th class=name>definition</th>"), lines)


def _method(result: TradeResult, about: Mapping[str, str]) -> str:
    software = ", ".join(f"{name} {version}" for name, version in about.items())
    lines = [
        (str(one.cell.number), f'<td class="command">{words(result.command(one.cell.number))}</td>')
        for one in result.cells
    ]
    commands = table(("cell", "<th class=name>command for this cell</th>"), lines, 0)
    return (
        "<p>Every cell has the numbers of its separate command, bit for bit. Cells on the same true motion share it. "
        f"{result.computed} cells were computed in {result.seconds:.1f} s by this call.</p>"
        f"<details><summary>Commands of the cells</summary>{commands}</details>"
        f"<p class=note>{words(software)}</p>"
    )
