"""Finished runs beside each other.

Errors over the time that they have in common, the keys that differ, report, directory, and tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import InputError
from sinssim.exhibits import Column, Exhibits, Item, Medium, Section, Sentence, Table
from sinssim.experiments.run.error_exhibits import (
    error_exhibits,
    error_table,
    known_numbers,
    note_on_errors,
    schuler_period,
)
from sinssim.experiments.run.finished_runs import Entry, FinishedRun
from sinssim.formatting import size_text
from sinssim.logs.stored_run import is_of_another, warn_of_version
from sinssim.recording import style
from sinssim.recording.page import page_of
from sinssim.recording.result import RunDirectory, write_json
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.outputs import write_text
from sinssim.units import duration_words, fixed

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import ErrorNumbers

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
    def numbers(self) -> dict[str, ErrorNumbers]:
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
        keys = list(dict.fromkeys(key for entries in flat for key in entries))
        rows = {key: [entries.get(key, "–") for entries in flat] for key in keys}
        return {key: values for key, values in rows.items() if len(set(values)) > 1}


def compare_runs(folders: Sequence[Path], solution: str | None = None) -> ComparedRuns:
    """Read the errors of finished runs, cut to the time in common, by default of the solution in the headline."""
    if len(folders) < 2:
        raise InputError("a comparison needs at least two runs; give the directories of two or more.")
    twice = [str(path) for i, path in enumerate(folders) if path.resolve() in [o.resolve() for o in folders[:i]]]
    if twice:
        raise InputError(f"{twice[0]} is given twice; give each run once.")
    finished_runs = [FinishedRun(folder) for folder in folders]
    for run in finished_runs:
        warn_of_version(run.path)
    names = [run.name for run in finished_runs]
    labels = [run.name if names.count(run.name) == 1 else str(run.path) for run in finished_runs]
    runs = dict(zip(labels, finished_runs, strict=True))
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


def comparison_exhibits(compared: ComparedRuns) -> Exhibits:
    """Return what finished runs beside each other have to show."""
    start, end = compared.span
    page: tuple[Medium, ...] = ("page",)
    title = f"errors from {start:g} s to {end:g} s, which all runs have"
    cut = " A run that is longer is cut to it." if compared.is_cut else ""
    span = f"Errors from {start:g} s to {end:g} s ({duration_words(end - start)}), which all runs have.{cut}"
    where = "comparison.json; all samples: sinssim.load_streams of each run"
    errors = error_table(compared.numbers, title, "run")
    unfinished = {label: run for label, run in compared.runs.items() if run.status != "finished"}
    items: list[Item] = [
        Sentence(span, on=page),
        Section("Runs", [_runs(compared)]),
        errors,
        note_on_errors(where=where),
        *(Sentence(f"{label} {run.status}: {run.summary.get('message', '')}", on=("console",))
          for label, run in unfinished.items()),
        Section("Errors over time", list(error_exhibits(compared, _period(compared), apart=False)), on=page),
        Section("What differs in the scenarios", list(_differences(compared)), on=page),
    ]  # fmt: skip
    return Exhibits("Comparison of " + ", ".join(compared.runs), items)


def _runs(compared: ComparedRuns) -> Table:
    """Return the runs: scenario, solution, times, date."""
    heads = ("scenario", "solution", "status", "date", "seed", "time [s]")
    rows = []
    for label, run in compared.runs.items():
        time = compared.errors[label].time
        rows.append(
            (label, str(run.summary["scenario"]), compared.solutions[label], run.status, f"{run.date:%Y-%m-%d %H:%M}",
             str(run.summary.get("seed", "–")), f"{time[0]:g} … {time[-1]:g}")
        )  # fmt: skip
    first = Column("run", words=True)
    paint = style.colors(list(compared.runs))
    return Table((first, *(Column(head, words=head not in ("seed", "time [s]")) for head in heads)), rows, colors=paint)


def _period(compared: ComparedRuns) -> float:
    """Return Schuler's period at the place of the first run, s."""
    run = next(iter(compared.runs.values()))
    latitude, height = run.place()
    ellipsoid = str(run.scenario.get("truth", {}).get("ellipsoid", "wgs84"))
    state = NavState(latitude, np.zeros(1), height, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]))
    return schuler_period(state, ellipsoid_by_name(ellipsoid))


def _differences(compared: ComparedRuns) -> Iterator[Item]:
    """Yield the keys that differ."""
    rows = compared.differences
    if not rows:
        yield Sentence("The scenarios are the same.")
        return
    heads = (Column("key", words=True), *(Column(label, words=True) for label in compared.runs))
    yield Table(heads, [(key, *values) for key, values in list(rows.items())[:_MOST_KEYS]])
    if len(rows) > _MOST_KEYS:
        yield Sentence(f"And {len(rows) - _MOST_KEYS} more; comparison.json has all of them.", "note")


def write_comparison(compared: ComparedRuns, target: Path, *, overwrite: bool = False) -> tuple[dict[str, Any], Path]:
    """Write `comparison.json` and `report.html`; return the contents of the former, and the directory."""
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
        write_text(folder.path / "report.html", page_of(comparison_exhibits(compared)))
        write_json(folder.path / "comparison.json", contents)
        return contents, folder.keep()


def list_exhibits(entries: Sequence[Entry], folder: Path) -> Iterator[Item]:
    """Yield the runs in a folder."""
    if not entries:
        yield Sentence(
            f"No runs in {folder}. `sinssim run SCENARIO` writes one to runs/SCENARIO, or to the folder given with -o; "
            "`sinssim runs DIR` lists those in another folder."
        )
        return
    columns = (
        *(Column(head, words=True) for head in ("directory", "kind", "scenario")), Column("horizontal rms", fixed("m")),
        Column("of", words=True), Column("size"), Column("date", words=True),
    )  # fmt: skip
    rows = [
        (
            str(entry.path), entry.kind if entry.status in ("", "finished") else f"{entry.kind}, {entry.status}",
            entry.scenario, "" if (rms := entry.rms_horizontal_error_m) is None else rms, entry.solution,
            size_text(entry.size_bytes), f"{entry.date:%Y-%m-%d %H:%M}",
        )
        for entry in entries
    ]  # fmt: skip
    yield Table(columns, rows)
    yield Sentence(f"{len(entries)} in {folder}, {size_text(sum(entry.size_bytes for entry in entries))}.")
    for entry in entries:
        if is_of_another(entry.path):
            yield Sentence(f"{entry.path} was written by sinssim {entry.sinssim}.")
        if entry.problem:
            yield Sentence(f"Not read: {entry.problem}")
