"""Writes the results of an ensemble: report.html, figures, summary.json, recording.rrd."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.experiments.ensembles.predicted import predicted_sigma
from sinssim.experiments.ensembles.summary import ensemble_numbers
from sinssim.recording.store.summary import plain, versions
from sinssim.system.outputs import write_text

if TYPE_CHECKING:
    from sinssim.experiments.ensembles.result import EnsembleResult

FIGURES = ("ensemble.svg", "ensemble.png")
"""The picture of an ensemble for a paper."""


def to_json(result: EnsembleResult, numbers: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return an ensemble as plain numbers with units in the names.

    Args:
        numbers: its numbers, if they are known.

    Returns:
        The contents of `summary.json`.
    """
    return dict(plain({**(numbers or ensemble_numbers(result)), "versions": versions()}))


def write_ensemble(result: EnsembleResult, folder: Path, status: str = "finished") -> list[str]:
    """Write the report of an ensemble, its figure, its numbers and its recording.

    Args:
        status: "finished", "interrupted" or "failed".

    Raises:
        OSError: they cannot be written.
    """
    from sinssim.experiments.ensembles.ensemble_exhibits import exhibits_of
    from sinssim.recording.figures.canvas import save
    from sinssim.recording.figures.charts import figure_of
    from sinssim.recording.report.exhibits import page_of
    from sinssim.recording.rerun.exhibits import record

    numbers = ensemble_numbers(result, status)
    exhibits = exhibits_of(result, numbers, predicted_sigma(result.plan) if status == "finished" else None)
    write_text(folder / "report.html", page_of(exhibits))
    picture = figure_of(exhibits.chosen(exhibits.figure))
    for name in FIGURES:
        save(picture, folder / name)
    record(exhibits, folder / "recording.rrd")
    text = json.dumps(to_json(result, numbers), indent=2, ensure_ascii=False, allow_nan=False)
    write_text(folder / "summary.json", text + "\n")
    return ["report.html", "summary.json", "recording.rrd", *FIGURES]
