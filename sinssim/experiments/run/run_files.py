"""The files that every run has: scenario, own content, report and summary."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.recording.run_directory import RunDirectory, versions
from sinssim.scenario.plan_summary import own_files
from sinssim.scenario.use_key import FOLDER
from sinssim.simulation.stages import Stages
from sinssim.system.outputs import write_text

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import RunSummary
    from sinssim.scenario import Scenario


def about(scenario: Scenario, stages: Stages, status: str, message: str = "") -> dict[str, Any]:
    """Return the part of a summary that does not depend on the success of the run: entries of `summary.json`.

    Args:
        status: "finished", "failed" or "interrupted".
    """
    plane = scenario.one_component
    return {
        "scenario": scenario.name,
        "status": status,
        **({"message": message} if message else {}),
        "seed": scenario.seed,
        "rate_hz": scenario.imu.rate_hz if plane is None else plane.rate_hz,
        "timing": stages.timing(),
        "versions": versions(),
        **({"own_content": files} if (files := [file.to_json() for file in own_files(scenario)]) else {}),
    }


def keep(
    folder: RunDirectory,
    scenario: Scenario,
    about_filter: Sequence[str],
    summary: RunSummary,
    report: str | None,
    *,
    beside: str = "",
) -> Path:
    """Complete the run directory and move it into its place.

    Args:
        about_filter: lines that explain the filter's default states.
        summary: contents of `summary.json`.
        report: the report's page, if there is one.
        beside: as for `RunDirectory.keep`.
    """
    with folder.writing():
        write_text(folder.path / "scenario.toml", scenario.to_toml(about_filter))
        for file in own_files(scenario):  # in the layout of a project folder, from which the run can be repeated
            place = folder.path / FOLDER / file.place
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.contents)
        if report is not None:
            write_text(folder.path / "report.html", report)
        write_text(folder.path / "summary.json", json.dumps(summary, indent=2, allow_nan=False) + "\n")
        return folder.keep(beside=beside)
