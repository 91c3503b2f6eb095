"""Finished runs beside each other.

Errors over the time that they have in common, the keys that differ, report, directory, and tables.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.table import Table

from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import InputError
from sinssim.experiments.run.error_exhibits import error_plots, error_tables, error_text
from sinssim.experiments.run.finished_runs import Entry, FinishedRun
from sinssim.experiments.run.run_report import STYLE, schuler_period
from sinssim.experiments.run.run_scores import known_numbers
from sinssim.formatting import size_text
from sinssim.logs.run_version import is_of_another, warn_of_version
from sinssim.recording import style
from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.page import swatch, table, words
from sinssim.recording.run_directory import RunDirectory
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.outputs import write_text
from sinssim.units import duration_words

if TYPE_CHECKING:
    from rich.console import Console


_NOT_COMPARED = ("name", "description", "views", "recording")
_LEAST_SPAN = 1.0


@dataclass(frozen=True)
class ComparedRuns:
    """Runs with the errors of one solution of each.

    Attributes:
        runs: by label, in the order given; the labels are the names of their directories.
        solutions: name of the solution by label.
        errors: its errors by label.
        span: first and last time that all have, s.
    """

    runs: Mapping[str, FinishedRun]
    solutions: Mapping[str, str]
    errors: Mapping[str, NavError]
    span: tuple[float, float]

    axes = "north"

    @property
    def time(self) -> Array:
        """First and last time, (2,) s."""
        return np.array(self.span)

    @cached_property
    def numbers(self) -> dict[str, dict[str, float | None]]:
        """Error statistics over the span in common, by label."""
        return {label: known_numbers(error, self.span) for label, error in self.errors.items()}

    @property
    def is_cut(self) -> bool:
        """Whether a run is longer than the span in common."""
        return any(e.time[0] < self.span[0] - 1e-6 or e.time[-1] > self.span[1] + 1e-6 for e in self.errors.values())

    @cached_property
    def differences(self) -> dict[str, list[str]]:
        """The keys of the scenarios that differ: values as text, in the order of the runs, "–" for a missing key."""
        flat = [dict(_flat(run.scenario)) for run in self.runs.values()]
        keys = list(dict.fromkeys(key for one in flat for key in one))
        rows = {key: [one.get(key, "–") for one in flat] for key in keys}
        return {key: values for key, values in rows.items() if len(set(values)) > 1}


def compare_runs(folders: Sequence[Path], solution: str | None = None) -> ComparedRuns:
    """Read finished runs to be compared.

    Args:
        solution: the solution to compare, which all runs have; by default that of each run's headline figure.

    Returns:
        The runs with their errors, cut to the time in common.

    Raises:
        InputError: a directory holds no run with errors, one is given twice, or two runs have no time in common.
    """
    if len(folders) < 2:
        raise InputError("a comparison needs at least two runs; give the directories of two or more.")
    twice = [str(one) for i, one in enumerate(folders) if one.resolve() in [o.resolve() for o in folders[:i]]]
    if twice:
        raise InputError(f"{twice[0]} is given twice; give each run once.")
    found = [FinishedRun(folder) for folder in folders]
    for run in found:
        warn_of_version(run.path)
    names = [run.name for run in found]
    labels = [run.name if names.count(run.name) == 1 else str(run.path) for run in found]
    runs = dict(zip(labels, found, strict=True))
    solutions = {label: run.solution(solution) for label, run in runs.items()}
    errors = {label: run.errors(solutions[label]) for label, run in runs.items()}
    return ComparedRuns(runs, solutions, errors, _common(errors))


def _common(errors: Mapping[str, NavError]) -> tuple[float, float]:
    """Return the time that all have, after checking that there is some."""
    begins = max(errors, key=lambda label: errors[label].time[0])
    ends = min(errors, key=lambda label: errors[label].time[-1])
    start, end = float(errors[begins].time[0]), float(errors[ends].time[-1])
    if end - start < _LEAST_SPAN:
        spans = ", ".join(f"{label} {e.time[0]:g} s to {e.time[-1]:g} s" for label, e in errors.items())
        raise InputError(
            f"the runs have no time in common: {begins} begins when {ends} has ended ({spans}). Errors are compared at "
            "the same times since the start; recorded sensors have the times of their log."
        )
    return start, end


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a scenario with dots, and their values as text."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if path or key not in _NOT_COMPARED:
                yield from _flat(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for number, item in enumerate(value, start=1):
            yield from _flat(item, f"{path}.{number}")
    else:
        yield path, ", ".join(map(_text, value)) if isinstance(value, list) else _text(value)


def _text(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


_MOST_KEYS = 60


def compare_runs_report(compared: ComparedRuns) -> str:
    """Return the report."""
    start, end = compared.span
    title = "Comparison of " + ", ".join(compared.runs)
    body = [f"<h1>{words(title)}</h1>"]
    note = " A run that is longer is cut to it." if compared.is_cut else ""
    body.append(
        f"<p>Errors from {start:g} s to {end:g} s ({duration_words(end - start)}), which all runs have.{note}</p>"
    )
    body += ["<h2>Runs</h2>", _runs(compared), "<h2>Errors</h2>"]
    body += error_tables(compared.numbers, "comparison.json; all samples: sinssim.load_streams of each run")
    body += ["<h2>Errors over time</h2>", *error_plots(compared, _period(compared), apart=False)]
    body += ["<h2>What differs in the scenarios</h2>", *_differences(compared)]
    return page.page(title, body, STYLE + svg_plot.STYLE)


def _runs(compared: ComparedRuns) -> str:
    """Return the table of the runs: scenario, solution, times, date."""
    colors = dict(zip(compared.runs, map(style.css, style.colors(list(compared.runs))), strict=True))
    lines = []
    for label, run in compared.runs.items():
        time = compared.errors[label].time
        cells = (words(str(run.summary["scenario"])), words(compared.solutions[label]))
        lines.append(
            (
                swatch(colors[label]) + words(label),
                *cells,
                words(run.status),
                f"{run.date:%Y-%m-%d %H:%M}",
                str(run.summary.get("seed", "–")),
                f"{time[0]:g} … {time[-1]:g}",
            )
        )
    return table(("run", "scenario", "solution", "status", "date", "seed", "time [s]"), lines, 5)


def _period(compared: ComparedRuns) -> float:
    """Return Schuler's period at the place of the first run, s."""
    run = next(iter(compared.runs.values()))
    latitude, height = run.place()
    ellipsoid = str(run.scenario.get("truth", {}).get("ellipsoid", "wgs84"))
    state = NavState(latitude, np.zeros(1), height, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]))
    return schuler_period(state, ellipsoid_by_name(ellipsoid))


def _differences(compared: ComparedRuns) -> Iterator[str]:
    """Yield the table of the keys that differ."""
    rows = compared.differences
    if not rows:
        yield "<p>The scenarios are the same.</p>"
        return
    lines = [
        (words(key), *(f'<td class="text">{words(value)}</td>' for value in values))
        for key, values in list(rows.items())[:_MOST_KEYS]
    ]
    yield table(("key", *(f'<th class="name">{words(label)}</th>' for label in compared.runs)), lines)
    if len(rows) > _MOST_KEYS:
        yield f'<p class="note">And {len(rows) - _MOST_KEYS} more; comparison.json has all of them.</p>'


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


_ERRORS = (
    ("horizontal\nfinal, m", "final_horizontal_error_m", 1.0),
    ("\nrms, m", "rms_horizontal_error_m", 1.0),
    ("\nmax, m", "max_horizontal_error_m", 1.0),
    ("height\nmax, m", "max_height_error_m", 1.0),
    ("velocity\nmax, m/s", "max_velocity_error_mps", 1.0),
    ("attitude\nmax, arcmin", "max_attitude_error_arcsec", 60.0),
)


def show_list(entries: Sequence[Entry], folder: Path, console: Console) -> None:
    """Print the runs in a folder."""
    if not entries:
        console.print(
            f"No runs in {folder}. `sinssim run SCENARIO` writes one to runs/SCENARIO, or to the folder given with -o; "
            "`sinssim runs DIR` lists those in another folder.",
            markup=False,
            highlight=False,
        )
        return
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading, side in (
        ("directory", "left"), ("kind", "left"), ("scenario", "left"), ("horizontal\nrms, m", "right"),
        ("\nof", "left"), ("\nsize", "right"), ("\ndate", "left"),
    ):  # fmt: skip
        table.add_column(heading, justify=side, no_wrap=heading != "directory", overflow="fold")  # type: ignore[arg-type]
    for entry in entries:
        kind = entry.kind if entry.status in ("", "finished") else f"{entry.kind}, {entry.status}"
        value = "" if entry.rms_horizontal_error_m is None else error_text(entry.rms_horizontal_error_m)
        table.add_row(
            str(entry.path), kind, entry.scenario, value, entry.solution, size_text(entry.size_bytes),
            f"{entry.date:%Y-%m-%d %H:%M}",
        )  # fmt: skip
    console.print(table)
    total = sum(entry.size_bytes for entry in entries)
    console.print(f"{len(entries)} in {folder}, {size_text(total)}.", markup=False, highlight=False)
    for entry in entries:
        if is_of_another(entry.path):
            console.print(f"{entry.path} was written by sinssim {entry.sinssim}.", markup=False, highlight=False)
        if entry.problem:
            console.print(f"Not read: {entry.problem}", markup=False, highlight=False)


def show_comparison(compared: ComparedRuns, console: Console) -> None:
    """Print the errors of finished runs beside each other."""
    start, end = compared.span
    table = Table(
        title=f"errors from {start:g} s to {end:g} s, which all runs have",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for heading in ("run", "solution"):
        table.add_column(heading, no_wrap=True)
    for heading, _, _ in _ERRORS:
        table.add_column(heading, justify="right", no_wrap=True)
    for label, numbers in compared.numbers.items():
        cells = [error_text(None if (v := numbers[key]) is None else v / size) for _, key, size in _ERRORS]
        table.add_row(label, compared.solutions[label], *cells)
    console.print(table)
    for label, run in compared.runs.items():
        if run.status != "finished":
            console.print(f"{label} {run.status}: {run.summary.get('message', '')}", markup=False)
