"""The files of a study.

Report.html, results.json, results.parquet, study.toml, and recording.rrd with the verdicts and the growth of the
errors.
"""

from __future__ import annotations

import json
import platform
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.studies import study_charts as figures
from sinssim.experiments.studies.attitude_claims import guarantee
from sinssim.experiments.studies.study_charts import at_one_rate, labeller, line_labeller, over_rates
from sinssim.experiments.studies.study_exhibits import html_report
from sinssim.experiments.studies.study_results import Case, ErrorGrowth, Row, StudyResult
from sinssim.formatting import capital, number_text
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.result import Media
from sinssim.recording.run_directory import plain, processor, versions, write_directory
from sinssim.recording.stream_tables import write_table
from sinssim.system.outputs import write_text


def results(comparison: StudyResult) -> dict[str, Any]:
    """Return all results of a study as plain numbers and words.

    Returns:
        The contents of `results.json`; unknown numbers are None.
    """
    study = comparison.study
    contents = {
        "study": study.name,
        "description": study.description,
        "status": comparison.status,
        "seed": study.seed,
        "seconds": round(comparison.seconds, 2),
        "verdicts": [asdict(verdict) for verdict in comparison.verdicts],
        "picks": [asdict(pick) for pick in comparison.picks],
        "motions": [
            {"part": part, "motion": name, **asdict(facts)} for (part, name), facts in comparison.motions.items()
        ],
        "costs": [{**asdict(cost), "operations_per_step": cost.operations.total} for cost in comparison.costs.values()],
        "attitude_costs": [
            {
                **asdict(cost),
                "operations_per_step": cost.operations.total,
                "matrix_operations_per_step": cost.matrix.total,
            }
            for cost in comparison.attitude_costs
        ],
        "headings": [
            {name: value for name, value in vars(heading).items() if name not in ("time", "heading", "truth")}
            for heading in comparison.headings
        ],
        "coordinate_errors": [
            {**asdict(error.case), **{key: value for key, value in vars(error).items() if key != "case"}}
            for error in comparison.coordinate_errors
        ],
        "orders": [asdict(order) for order in comparison.orders],
        "guarantees": {
            name: asdict(guarantee(name)) for name in dict.fromkeys(row.algorithm for row in comparison.rows)
        },
        "cases": [asdict(row) for row in comparison.rows],
        "versions": versions(),
    }
    return {key: plain(value) for key, value in contents.items()}


def write_study(comparison: StudyResult, folder: Path) -> None:
    """Write all results of a study.

    Raises:
        OSError: it cannot be written.
    """
    import tomli_w

    about = {**versions(), "Python": platform.python_version(), "processor": processor()}
    write_text(folder / "study.toml", tomli_w.dumps(_without_none(comparison.study.model_dump())))
    write_text(folder / "results.json", json.dumps(results(comparison), indent=2, ensure_ascii=False) + "\n")
    _write_parquet(comparison, folder / "results.parquet")
    if comparison.coordinate_errors:
        _write_coordinates(comparison, folder / "coordinates.parquet")
    write_text(folder / "report.html", html_report(comparison, about))
    record_study(comparison, folder / "recording.rrd")


def _write_parquet(comparison: StudyResult, path: Path) -> None:
    import pyarrow as pa

    columns: dict[str, Any] = {}
    for name in (f.name for f in fields(Row)):
        values = [getattr(row, name) for row in comparison.rows]
        columns[name] = pa.array(["/".join(f"{r:g}" for r in v) for v in values] if name == "schedule_hz" else values)
    write_table(pa.table(columns), path)


def _write_coordinates(comparison: StudyResult, path: Path) -> None:
    """Write the errors in further coordinates: a row for each case and column."""
    import pyarrow as pa

    columns: dict[str, Any] = {}
    for name in (f.name for f in fields(Case)):
        values = [getattr(error.case, name) for error in comparison.coordinate_errors]
        columns[name] = pa.array(["/".join(f"{r:g}" for r in v) for v in values] if name == "schedule_hz" else values)
    for name in ("coordinates", "column", "max_error", "final_error"):
        columns[name] = pa.array([getattr(error, name) for error in comparison.coordinate_errors])
    write_table(pa.table(columns), path)


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, list | tuple) else value


_PANELS = 6
_LINES = 12
_LEGEND = 8
"""Maximum number of names in a legend; with more, the figures beside it show the colours."""
_POINTS = 400
_LEAST = 1e-12  # smaller errors are drawn as this one


def record_study(comparison: StudyResult, path: Path) -> None:
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


class StudyMedia(Media[StudyResult]):
    """Numbers, streams, figure and files of a study."""

    def summary(self, result: StudyResult) -> dict[str, Any]:

        return results(result)

    def figure(self, result: StudyResult, quantity: str | None = None) -> Any:
        from sinssim.experiments.studies.study_charts import (
            against_rate,
            bars,
            labeller,
            line_labeller,
            over_rates,
            palette,
        )
        from sinssim.recording.figures import figure_of

        paint = palette(result)
        for part in result.study.parts:
            rows = [row for row in result.of_part(part.title) if row.status == "done"]
            if rows and over_rates(part):
                return figure_of(against_rate(rows, labeller(rows), paint))
            if rows:
                return figure_of(bars(rows, labeller(rows, pace=True), line_labeller(part, rows), paint))
        raise InputError(f"the study {result.study.name} has no finished navigation to draw.")

    def save(self, result: StudyResult, directory: Path, *, overwrite: bool) -> Path:

        return write_directory(directory, lambda folder: write_study(result, folder), overwrite=overwrite)


StudyResult.media = StudyMedia()
