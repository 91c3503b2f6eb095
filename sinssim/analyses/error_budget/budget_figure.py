"""Figures of a covariance budget: circles over time, shares of the sources, ranking, standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.analyses.error_budget.budget_table import units_of_budget
from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.analyses.error_budget.limits import Answer
from sinssim.analyses.error_budget.result import BudgetResult
from sinssim.data import Array
from sinssim.formatting import number_text
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.recording.figures.limits import CIRCLES, Judged, draw_limits, of_quantities
from sinssim.statistics.requirements.requirement import COMPONENTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 8
"""Number of sources with a colour of their own; the others are one."""
OTHERS = "all others"

_PALETTE = (
    (0, 114, 178), (230, 159, 0), (0, 158, 115), (213, 94, 0), (204, 121, 167), (86, 180, 233), (120, 100, 200),
    (160, 160, 60),
)  # fmt: skip


def full_label(source: Source) -> str:
    """Return a source's name with what it belongs to, for example "gyros: bias"."""
    return f"{source.group.replace('_', ' ')}: {source.label}"


def shares(result: BudgetResult) -> tuple[list[str], Array]:
    """Return the shares of the horizontal mean square over time, the largest sources first.

    Args:
        result: the budget.

    Returns:
        Labels, and shares that add up to 1, (k, E). The given errors together are one source. Zero where there is no
        error at all.
    """
    square = {s.name: np.trace(result.covariance[s.name][:, :2, :2], axis1=1, axis2=2) for s in result.sources
              if s.name in result.covariance}  # fmt: skip
    labels = {s.name: full_label(s) for s in result.sources}
    if result.bias[:, :2].any():
        square["given"], labels["given"] = np.sum(result.bias[:, :2] ** 2, axis=1), "errors equal in every run"
    whole = np.asarray(sum(square.values(), np.zeros(len(result.time))))
    part = {n: np.divide(v, whole, out=np.zeros_like(v), where=whole > 0.0) for n, v in square.items()}
    order = sorted(part, key=lambda n: -float(part[n].mean() + part[n][-1]))
    names, rows = [labels[n] for n in order[:SHOWN]], [part[n] for n in order[:SHOWN]]
    if len(order) > SHOWN:
        names.append(OTHERS)
        rows.append(np.asarray(sum(part[n] for n in order[SHOWN:])))
    return names, np.array(rows)


def palette(labels: Sequence[str]) -> list[style.Rgb]:
    """Return one colour for each label of `shares`."""
    colors = [_PALETTE[k % len(_PALETTE)] for k in range(len(labels))]
    return [(170, 170, 170) if label == OTHERS else color for label, color in zip(labels, colors, strict=True)]


def time_unit(result: BudgetResult) -> tuple[str, float]:
    """Return the unit of the time axis and its size, s."""
    return ("h", 3600.0) if result.time[-1] > 3.0 * 3600.0 else ("min", 60.0) if result.time[-1] > 300.0 else ("s", 1.0)


@styled
def growth_figure(result: BudgetResult, answers: Sequence[Answer] = ()) -> Figure:
    """Draw CEP and R95 over time with the requirements on them, and the shares of the sources below.

    Args:
        result: the budget.
        answers: answers to requirements.

    Returns:
        The figure.
    """
    figure = new_figure(11.0, 7.6)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 1.2])
    word, size = time_unit(result)
    (unit, metre), _, _ = units_of_budget(result)
    time = result.time / size
    above.plot(time, result.r95 / metre, color=style.css(style.COLORS["aided"]), label="R95: 95 % of all runs")
    above.plot(time, result.cep / metre, color=style.css(style.COLORS["smoothed"]), label="CEP: half of all runs")
    above.set_ylim(bottom=0.0)
    circles = of_quantities(judged_of(answers), CIRCLES)
    draw_limits(above, circles, float(result.r95.max()), metre, size, float(result.time[-1]))
    above.set(ylabel=f"horizontal error [{unit}]", title="CEP and R95")
    above.set(xlim=(time[0], time[-1]))
    above.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    labels, parts = shares(result)
    colors = [style.css(color) for color in palette(labels)]
    some = np.flatnonzero(parts.sum(axis=0) > 0.0)  # an exact start has no error to share
    if len(some):
        below.stackplot(time[some], 100.0 * parts[:, some], labels=labels, colors=colors, lw=0.3, edgecolor="white")
    below.set(ylim=(0.0, 100.0), xlabel=f"time [{word}]", ylabel="share of the mean square [%]")
    below.set_title("Horizontal position: shares of the sources")
    handles, names = below.get_legend_handles_labels()
    below.legend(handles[::-1], names[::-1], loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def judged_of(answers: Sequence[Answer]) -> Judged:
    """Return the requirements with their verdicts, as figures take them."""
    return [(answer.requirement, "met" if answer.met else "not met") for answer in answers]


@styled
def ranking_figure(result: BudgetResult, t: float | None = None) -> Figure:
    """Draw R95 by each source alone, and its gain if the source were halved.

    Args:
        result: the budget.
        t: instant, s; the end by default.

    Returns:
        The figure.
    """
    (unit, metre), _, _ = units_of_budget(result)
    ranked = [one for one in result.improvements(t) if one.alone > 0.0][:12]
    figure = new_figure(11.0, 1.4 + 0.3 * max(len(ranked), 1))
    left, right = figure.subplots(1, 2, sharey=True)
    rows = np.arange(len(ranked))[::-1]
    for panel, values, title in (
        (left, np.array([one.gain for one in ranked]), "Decrease of R95 if this source were halved"),
        (right, np.array([one.alone for one in ranked]), "R95 from this source alone"),
    ):
        panel.barh(rows, values / metre, color=style.css(style.COLORS["aided"]), height=0.7)
        room = float(values.max() / metre) if len(values) else 1.0
        for row, value in zip(rows, values / metre, strict=True):
            text = "0" if abs(value) < 5e-4 * room else number_text(float(value))
            panel.text(max(value, 0.0) + 0.015 * room, row, text, va="center", fontsize=style.SMALL)
        panel.set(xlim=(0.0, 1.18 * room), xlabel=unit, title=title, yticks=rows,
                  yticklabels=[full_label(one.source) for one in ranked])  # fmt: skip
        panel.grid(False, axis="y")
    return figure


@styled
def sigma_figure(result: BudgetResult, answers: Sequence[Answer] = ()) -> Figure:
    """Draw the standard deviations of position, velocity and attitude over time, and the limits of requirements.

    Args:
        result: the budget.
        answers: answers to requirements.

    Returns:
        The figure.
    """
    figure = new_figure(11.0, 3.6)
    word, size = time_unit(result)
    sigma, time, limits = result.sigma(), result.time / size, list[Any]()
    own = None if result.filter_covariance is None else np.sqrt(np.einsum("kii->ki", result.filter_covariance))
    titles = (
        ("position", ("north", "east", "down")),
        ("velocity", ("north", "east", "down")),
        ("attitude", ("tilt north", "tilt east", "heading")),
    )
    panels = zip(figure.subplots(1, 3), titles, units_of_budget(result), strict=True)
    for number, (panel, (title, names), (unit, one)) in enumerate(panels):
        part = slice(3 * number, 3 * number + 3)
        for k, name in enumerate(names):
            color = style.css(style.COLORS[("north", "east", "down")[k]])
            panel.plot(time, sigma[:, part][:, k] / one, color=color, label=name)
            if own is not None:
                panel.plot(time, own[:, part][:, k] / one, color=style.INK, lw=style.THIN, ls=":",
                           label="filter's own" if k == 2 else None)  # fmt: skip
        panel.set(title=f"σ of the {title}", ylabel=unit, xlabel=f"time [{word}]", xlim=(time[0], time[-1]))
        panel.set_ylim(0.0, 1.25 * max(float(sigma[:, part].max()) / one, 1e-12))
        judged = of_quantities(judged_of(answers), COMPONENTS[part])
        panel.legend(loc="upper left", ncols=2)
        limits += draw_limits(panel, judged, float(sigma[:, part].max()), one, size, float(result.time[-1]))
    if limits:
        figure.legend(handles=limits, loc="outside lower center", ncols=3)
    return figure
