"""The directory of a comparison of finished runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sinssim.experiments.run.finished.compared_runs import ComparedRuns
from sinssim.recording.store.directory import RunDirectory
from sinssim.system.outputs import write_text


def write_comparison(
    compared: ComparedRuns, report: str, target: Path, *, overwrite: bool = False
) -> tuple[dict[str, Any], Path]:
    """Write `comparison.json` and `report.html`.

    Args:
        report: the report's page.

    Returns:
        Contents of `comparison.json`, and the directory.

    Raises:
        InputError: the directory already has other contents, or cannot be written.
    """
    contents = {
        "from_s": compared.span[0],
        "to_s": compared.span[1],
        "runs": {
            label: {
                "directory": str(run.path),
                "scenario": run.summary["scenario"],
                "status": run.status,
                "solution": compared.solutions[label],
                "errors": compared.numbers[label],
            }
            for label, run in compared.runs.items()
        },
        "differences": compared.differences,
    }
    folder = RunDirectory(target, overwrite=overwrite)
    with folder.writing():
        write_text(folder.path / "report.html", report)
        text = json.dumps(contents, indent=2, ensure_ascii=False, allow_nan=False)
        write_text(folder.path / "comparison.json", text + "\n")
        return contents, folder.keep()
