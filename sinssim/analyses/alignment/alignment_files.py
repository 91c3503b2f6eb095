"""Writes the directory of an alignment: numbers as JSON, the recording, the figure of the expected errors."""

from __future__ import annotations

import json
from pathlib import Path

from sinssim.analyses.alignment.report import AlignmentResult
from sinssim.recording.store.directory import write_directory
from sinssim.system.outputs import write_text


def write_alignment(result: AlignmentResult, directory: Path, *, overwrite: bool = False) -> Path:
    """Write an alignment's directory: alignment.json, recording.rrd, and alignment.svg if errors are expected.

    Raises:
        InputError: the place is taken or cannot be written.
    """
    from sinssim.recording.figures.canvas import save
    from sinssim.recording.rerun.exhibits import record

    exhibits = result.exhibits

    def write(folder: Path) -> None:
        write_text(folder / "alignment.json", json.dumps(result.summary, indent=2, ensure_ascii=False) + "\n")
        record(exhibits, folder / "recording.rrd")
        if exhibits.figure:
            save(result.plot(), folder / "alignment.svg")

    return write_directory(directory, write, overwrite=overwrite)
