"""The files of a study: report.html, results.json, results.parquet, study.toml and recording.rrd."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from sinssim.errors import InputError
from sinssim.exhibits import Exhibits
from sinssim.experiments.studies.attitude_claims import guarantee
from sinssim.experiments.studies.study_charts import finished
from sinssim.experiments.studies.study_exhibits import exhibits_of
from sinssim.experiments.studies.study_results import Case, Row, StudyResult
from sinssim.recording.result import Media
from sinssim.recording.run_directory import plain, versions, write_directory
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
    """Write all results of a study."""
    import tomli_w

    from sinssim.recording.report.exhibit_page import page_of
    from sinssim.recording.rerun.exhibit_recording import record

    exhibits = exhibits_of(comparison)
    write_text(folder / "study.toml", tomli_w.dumps(_without_none(comparison.study.model_dump())))
    write_text(folder / "results.json", json.dumps(results(comparison), indent=2, ensure_ascii=False) + "\n")
    _write_parquet(comparison, folder / "results.parquet")
    if comparison.coordinate_errors:
        _write_coordinates(comparison, folder / "coordinates.parquet")
    write_text(folder / "report.html", page_of(exhibits))
    record(exhibits, folder / "recording.rrd")


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


class StudyMedia(Media[StudyResult]):
    """Numbers, exhibits and files of a study."""

    def summary(self, result: StudyResult) -> dict[str, Any]:
        return results(result)

    def exhibits(self, result: StudyResult) -> Exhibits:
        return exhibits_of(result)

    def figure(self, result: StudyResult, quantity: str | None = None) -> Any:
        if not finished(result.rows):
            raise InputError(f"the study {result.study.name} has no finished navigation to draw.")
        return super().figure(result)

    def save(self, result: StudyResult, directory: Path, *, overwrite: bool) -> Path:
        return write_directory(directory, lambda folder: write_study(result, folder), overwrite=overwrite)


StudyResult.media = StudyMedia()
