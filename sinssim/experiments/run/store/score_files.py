"""Writes scores of other programs' solutions beside a run: RUN/scores/NAME with streams and numbers, and the report."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.scoring.score import Judge, Score
from sinssim.recording.store.parquet import write_stream
from sinssim.recording.store.streams import error_stream, nav_stream
from sinssim.recording.store.summary import plain, versions
from sinssim.strapdown.nav_error import NavError
from sinssim.system.drafts import Draft
from sinssim.system.outputs import publish, write_text, written

FOLDER = "scores"
"""Name of the folder of scores in a run directory."""
RECORDING = "recording.rrd"
"""Name of the recording in that folder."""


def known_numbers(error: NavError, span: tuple[float, float]) -> dict[str, float | None]:
    """Return the error statistics within a span, of what is known.

    Args:
        error: errors of a solution; NaN where it has nothing.
        span: first and last time, s.

    Returns:
        As `sinssim.strapdown.error_numbers.error_numbers`, with None for quantities without a value.
    """
    rows = (error.time >= span[0] - 1e-6) & (error.time <= span[1] + 1e-6)
    found: dict[str, float | None] = {}
    for name, values in (
        ("horizontal_error_m", error.horizontal),
        ("height_error_m", error.height),
        ("velocity_error_mps", error.speed),
        ("attitude_error_arcsec", error.angle / units.ARCSEC),
    ):
        part: Array = values[rows]
        part = part[np.isfinite(part)]
        found[f"final_{name}"] = float(part[-1]) if len(part) else None
        found[f"rms_{name}"] = float(np.sqrt(np.mean(part * part))) if len(part) else None
        found[f"max_{name}"] = float(np.abs(part).max()) if len(part) else None
    return found


def ranking(numbers: Mapping[str, Mapping[str, float | None]]) -> list[str]:
    """Return the algorithms from the smallest to the largest rms of the horizontal error.

    Args:
        numbers: results of `known_numbers` by algorithm.

    Returns:
        Their names; those without a number are last.
    """

    def size(name: str) -> float:
        value = numbers[name]["rms_horizontal_error_m"]
        return float("inf") if value is None else value

    return sorted(numbers, key=size)


def check_names(judge: Judge, names: Sequence[str]) -> None:
    """Refuse names that cannot be those of a further algorithm.

    Raises:
        InputError: a name is that of an algorithm of the run, is used twice, or cannot be that of a folder.
    """
    for name in names:
        if not re.fullmatch(r"[\w.+ -]{1,80}", name) or name.startswith(".") or name != name.strip():
            raise InputError(f"--name {name!r}: letters, digits, blanks, . + - and _ are possible, at most 80.")
        if name in judge.run.solutions:
            raise InputError(f"the run has a solution {name!r} already; give another name with --name.")
        if list(names).count(name) > 1:
            raise InputError(f"two solutions have the name {name!r}; give each one with --name.")


def write_scores(
    judge: Judge, scores: Sequence[Score], span: tuple[float, float], report: str, record: Callable[[Path], None]
) -> Path:
    """Write the scores beside the run; the run's own files stay as they are.

    Args:
        span: time over which they are compared, s.

    Raises:
        InputError: nothing can be written there.
    """
    folder = judge.run.path / FOLDER
    try:
        with Draft(judge.run.path, FOLDER) as beside:
            top = beside.path / FOLDER
            for score in scores:
                place = top / score.name
                place.mkdir(parents=True)
                write_stream(nav_stream(score.name, score.solution), place)
                write_stream(error_stream(score.name, score.error.at, score.solution.time), place)
                text = json.dumps(to_json(score, span), indent=2, ensure_ascii=False)
                write_text(place / "score.json", text + "\n")
            write_text(top / "report.html", report)
            record(top / RECORDING)
            new = {path.relative_to(beside.path).as_posix() for path in top.rglob("*")}
            publish(beside, judge.run.path, [name for name in written(judge.run.path) or () if name not in new])
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror or error}.") from error
    return folder / "report.html"


def to_json(score: Score, span: tuple[float, float]) -> dict[str, Any]:
    """Return a score as plain numbers.

    Args:
        span: time over which it is compared, s.
    """
    own = (float(score.error.time[0]), float(score.error.time[-1]))
    found = {
        "name": score.name,
        "file": str(score.path),
        "format": score.format,
        "start_s": own[0],
        "end_s": own[1],
        "rows": len(score.error.time),
        "compute_s": score.seconds,
        "errors": known_numbers(score.error, own),
        "compared_from_s": span[0],
        "compared_to_s": span[1],
        "errors_compared": known_numbers(score.error, span),
        "notes": list(score.sentences),
        "versions": versions(),
    }
    return {key: plain(value) for key, value in found.items()}
