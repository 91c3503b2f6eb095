"""Writes the results of a study: report.html, results.json, results.parquet, recording.rrd, study.toml."""

from __future__ import annotations

import json
import platform
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from sinssim.experiments.studies.claims.guarantees import guarantee
from sinssim.experiments.studies.results import Case, Row, StudyResult
from sinssim.experiments.studies.study_report import html_report
from sinssim.recording.store.parquet import write_table
from sinssim.recording.store.summary import plain, processor, versions
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

    from sinssim.experiments.studies.study_recording import record

    about = {**versions(), "Python": platform.python_version(), "processor": processor()}
    write_text(folder / "study.toml", tomli_w.dumps(_without_none(comparison.study.model_dump())))
    write_text(folder / "results.json", json.dumps(results(comparison), indent=2, ensure_ascii=False) + "\n")
    _write_parquet(comparison, folder / "results.parquet")
    if comparison.coordinate_errors:
        _write_coordinates(comparison, folder / "coordinates.parquet")
    write_text(folder / "report.html", html_report(comparison, about))
    record(comparison, folder / "recording.rrd")


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
