"""The Rerun recording of a study: the verdicts as text, and the growth of the errors as plots of the viewer."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.experiments.studies import study_charts as figures
from sinssim.experiments.studies.naming import at_one_rate, labeller, line_labeller, over_rates
from sinssim.experiments.studies.results import ErrorGrowth, Row, StudyResult
from sinssim.formatting import capital, number_text
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views

_PANELS = 6
_LINES = 12
_LEGEND = 8
"""Maximum number of names in a legend; with more, the figures beside it show the colours."""
_POINTS = 400
_LEAST = 1e-12  # smaller errors are drawn as this one


def record(comparison: StudyResult, path: Path) -> None:
    """Write the recording."""
    ends = [history.time[-1] for history in comparison.histories.values()]
    algorithms = tuple(dict.fromkeys(row.algorithm for row in comparison.rows))
    run = RunInfo(comparison.study.name, 0.0, float(max(ends, default=1.0)), algorithms, labels={"kind": "study"})
    with Recording(path, run.application, all_views(run)) as recording:
        paint = figures.palette(comparison)
        panels = _draw_growth(recording, comparison, paint)
        recording.document("comparison/verdicts", _markdown(comparison))
        run = RunInfo(
            run.name,
            run.start,
            run.end,
            algorithms,
            labels={"kind": "study", "panels": json.dumps(panels)},
            ranges=dict(recording.ranges),
        )
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw_growth(
    recording: Recording, comparison: StudyResult, paint: figures.Paint
) -> list[tuple[str, str, float, bool]]:
    """Record the growth of the errors over the motion, below `comparison/growth`.

    Returns:
        Entity, title, end of the motion and whether there is room for a legend, of each panel.
    """
    panels: list[tuple[str, str, float, bool]] = []
    for number_, part in enumerate(comparison.study.parts, start=1):
        rows = comparison.of_part(part.title)
        for motion in dict.fromkeys(row.motion for row in rows):
            here = [row for row in rows if row.motion == motion and row.status == "done"]
            if not here:
                continue
            shown = at_one_rate(here)
            if len(shown) > _LINES:
                shown = [row for row in shown if not row.algorithm.endswith(("-ortho", "-norm"))][: 2 * _LINES]
            label = line_labeller(part, rows)
            histories = [comparison.history(row) for row in shown]
            end = min(history.time[-1] for history in histories)
            time = np.linspace(histories[0].time[0], end, _POINTS)
            entity = f"comparison/growth/{number_}/{motion.replace(' ', '_').replace(',', '')}"
            names = [label(row) for row in shown]
            kind = "attitude" if over_rates(part) else "horizontal"
            values = np.column_stack([_log_error(history, kind, time) for history in histories])
            values[0] = np.nan  # the error at the start is zero and has no logarithm
            recording.series(entity, time, values, names, colors=[_rgb(paint[name]) for name in names], widths=1.6)
            what = "attitude, log₁₀ ″" if kind == "attitude" else "horizontal, log₁₀ m"
            rate = f", {shown[0].rate_hz:g} Hz" if part.rates_hz else ""
            panels.append((entity, f"{motion}{rate}: {what}", float(end), len(names) <= _LEGEND))
    return panels[:_PANELS]


def _log_error(history: ErrorGrowth, kind: str, time: Array) -> Array:
    errors: Array = history.attitude if kind == "attitude" else history.horizontal
    return np.log10(np.maximum(np.interp(time, history.time, errors), _LEAST))


def _rgb(color: str) -> tuple[int, int, int]:
    r, g, b = bytes.fromhex(color.removeprefix("#"))
    return r, g, b


def _markdown(comparison: StudyResult) -> str:
    lines = [f"# {comparison.study.name}", "", comparison.study.description, ""]
    if comparison.verdicts:
        lines += ["| claim | verdict | measured | expected |", "|---|---|---|---|"]
        lines += [f"| {v.title} | {v.verdict} | {v.measured} | {v.expected} |" for v in comparison.verdicts]
        lines.append("")
    for verdict in comparison.verdicts:
        lines += [f"**{verdict.verdict.upper()}**: {capital(verdict.sentence)}. {verdict.reason}", ""]
        lines += [*(f"- {f'*{judged}*: ' if judged else ''}{point}" for point, judged in verdict.lines), ""]
    for part in comparison.study.parts:
        rows = comparison.of_part(part.title)
        if not rows:
            continue
        lines += [f"## {part.title}", ""]
        lines += _rates_table(rows) if over_rates(part) else _cases_table(rows)
        label = labeller(rows, pace=True)
        failed = [row for row in rows if row.status == "failed"]
        lines += ["", *(f"- **{row.motion} · {label(row)}** failed: {row.message}" for row in failed), ""]
    return "\n".join(lines)


def _cases_table(rows: list[Row]) -> list[str]:
    label = labeller(rows, pace=True)
    cells = [
        f"| {row.motion} | {label(row)} | {number_text(row.max_horizontal_error_m)} | "
        f"{number_text(row.max_attitude_error_arcsec)} |"
        for row in rows
    ]
    return ["| motion | | horizontal, m | attitude, ″ |", "|---|---|---|---|", *cells]


def _rates_table(rows: list[Row]) -> list[str]:
    """Largest attitude errors, a table for each motion."""
    label, rates = labeller(rows), sorted({row.rate_hz for row in rows})
    lines: list[str] = []
    for motion in dict.fromkeys(row.motion for row in rows):
        errors = {(label(row), row.rate_hz): row.max_attitude_error_arcsec for row in rows if row.motion == motion}
        lines += [f"| {motion}: attitude, ″ | " + " | ".join(f"{rate:g} Hz" for rate in rates) + " |"]
        lines += ["|---|" + "---|" * len(rates)]
        for name in dict.fromkeys(name for name, _ in errors):
            cells = (number_text(errors.get((name, rate), float("nan")), 2) for rate in rates)
            lines.append(f"| {name} | {' | '.join(cells)} |")
        lines.append("")
    return lines
