"""The Rerun recording of a covariance budget: circles, shares of the sources, standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.analyses.error_budget.budget_figure import (
    full_label,
    growth_figure,
    judged_of,
    palette,
    ranking_figure,
    shares,
)
from sinssim.analyses.error_budget.budget_table import lines_of, number, ranking_cells, when
from sinssim.analyses.error_budget.limits import Answer
from sinssim.analyses.error_budget.result import BudgetResult
from sinssim.recording.figures.canvas import to_png
from sinssim.recording.figures.limits import CIRCLES, Judged, of_quantities
from sinssim.recording.rerun.limits import record_limits
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.scales import ANGLES, LENGTHS, SPEEDS, suiting
from sinssim.statistics.requirements.requirement import COMPONENTS

_SOURCES = 6


def record(result: BudgetResult, answers: Sequence[Answer], path: Path) -> None:
    """Write the recording.

    Args:
        result: the budget.
        answers: answers to requirements.
        path: the file.
    """
    labels = {"kind": "budget"}
    run = RunInfo(result.scenario.name, float(result.time[0]), float(result.time[-1]), (), labels=labels)
    with Recording(path, run.application, all_views(run)) as recording:
        labels |= _draw(recording, result, judged_of(answers))
        for name, figure in (("growth", growth_figure(result, answers)), ("ranking", ranking_figure(result))):
            image = rr.EncodedImage(contents=to_png(figure), media_type="image/png")
            recording.static(f"budget/figures/{name}", image)
        recording.document("budget/tables", _markdown(result, answers))
        run = RunInfo(run.name, run.start, run.end, (), labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw(recording: Recording, result: BudgetResult, judged: Judged) -> dict[str, str]:
    """Record the plots, and return the units for their titles."""
    time, sigma = result.time, result.sigma()
    circle, metre = suiting(LENGTHS, result.r95)
    recording.series(
        "budget/circles", time, np.column_stack([result.cep, result.r95]) / metre, ["CEP", "R95"],
        colors=[(204, 121, 167), (0, 114, 178)],
    )  # fmt: skip
    lasts = float(time[-1])
    record_limits(
        recording, "budget/circles", of_quantities(judged, CIRCLES), metre, 0.0, lasts, float(result.r95.max())
    )
    names, parts = shares(result)
    recording.series("budget/shares", time, 100.0 * parts.T, names, colors=palette(names))
    paint = dict(zip(names, palette(names), strict=True))
    shown = [source for source in result.sources if full_label(source) in paint]
    shown.sort(key=lambda source: names.index(full_label(source)))
    if shown:
        values = np.column_stack([result.radius(0.95, source.name) for source in shown[:_SOURCES]])
        labels = [full_label(source) for source in shown[:_SOURCES]]
        recording.series("budget/r95_alone", time, values / metre, labels, colors=[paint[label] for label in labels])
    found = {"circle": circle}
    for k, (name, scale) in enumerate((("position", LENGTHS), ("velocity", SPEEDS), ("attitude", ANGLES))):
        part = sigma[:, 3 * k : 3 * k + 3]
        unit, size = suiting(scale, part)
        axes = ["north", "east", "down"] if name != "attitude" else ["tilt north", "tilt east", "heading"]
        colors = [(213, 94, 0), (0, 158, 115), (86, 180, 233)]
        recording.series(f"budget/sigma/{name}", time, part / size, axes, colors=colors)
        chosen = of_quantities(judged, COMPONENTS[3 * k : 3 * k + 3])
        record_limits(recording, f"budget/sigma/{name}", chosen, size, 0.0, lasts, float(part.max()))
        found[name] = unit
    return found


def _markdown(result: BudgetResult, answers: Sequence[Answer]) -> str:
    """Return the requirements and the rankings as text."""
    end = f"**{number(float(result.cep[-1]))} m** CEP and **{number(float(result.r95[-1]))} m** R95"
    lines = [f"# {result.scenario.name}", "", f"{end} at the end, {result.time[-1]:g} s", ""]
    for answer in answers:
        lines += [f"- {sentence}" for sentence in lines_of(answer)] + [""]
    for t in result.instants_to_rank:
        heads, cells, _ = ranking_cells(result, t)
        chosen = (0, 2, 3, 4, 5)
        lines += [f"## What to improve first, {when(result, t)}", ""]
        lines += ["| " + " | ".join(heads[k] for k in chosen) + " |", "|" + "---|" * len(chosen)]
        lines += ["| " + " | ".join(row[k] for k in chosen) + " |" for row in cells]
        lines.append("")
    return "\n".join(lines)
