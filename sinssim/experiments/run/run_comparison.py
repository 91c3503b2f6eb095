"""Finished runs beside each other, and the page of a list."""

from __future__ import annotations

import datetime
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

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
from sinssim.experiments.run.finished_runs import Entry, FinishedRun, flat_keys, kind_of
from sinssim.experiments.run.run_curves import Source, chosen_exhibits, differing, source_of
from sinssim.experiments.run.summary_types import ErrorNumbers
from sinssim.logs.stored_run import is_of_another, warn_of_version
from sinssim.recording import style
from sinssim.recording.page import page_of
from sinssim.recording.result import RunDirectory, write_json
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.files import open_file, write_text
from sinssim.units import duration_words, fixed, size_text

_LEAST_SPAN = 1.0


@dataclass(frozen=True)
class ComparedRuns:
    """Runs with the errors of one solution of each."""

    runs: Mapping[str, FinishedRun]  # by label, in the order given; the labels are the names of their directories
    solutions: Mapping[str, str]  # name of the solution by label
    errors: Mapping[str, NavError]  # its errors by label
    span: tuple[float, float]  # first and last time that all have, s
    others: Sequence[Path] = ()  # ensembles and budgets beside them
    chosen: str | None = None  # the solution that was asked for, None for that of each headline

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
        return differing([dict(flat_keys(run.scenario)) for run in self.runs.values()])

    @cached_property
    def sources(self) -> list[Source]:
        """What has curves: the runs with all their solutions and scores, then ensembles and budgets."""
        runs = [source_of(run.path, label, self.chosen) for label, run in self.runs.items()]
        return [*runs, *(source_of(path, _label(path, self.others)) for path in self.others)]


def compare_runs(folders: Sequence[Path], solution: str | None = None) -> ComparedRuns:
    """Read the errors of finished runs, cut to the time in common, by default of the solution in the headline; and
    ensembles and budgets beside them."""
    if len(folders) < 2:
        raise InputError("a comparison needs at least two runs; give the directories of two or more.")
    twice = [str(path) for i, path in enumerate(folders) if path.resolve() in [o.resolve() for o in folders[:i]]]
    if twice:
        raise InputError(f"{twice[0]} is given twice; give each run once.")
    others = [folder for folder in folders if kind_of(folder) in ("ensemble", "error budget")]
    finished_runs = [FinishedRun(folder) for folder in folders if folder not in others]
    for run in finished_runs:
        warn_of_version(run.path)
    labels = [_label(run.path, folders) for run in finished_runs]
    runs = dict(zip(labels, finished_runs, strict=True))
    solutions = {label: run.solution(solution) for label, run in runs.items()}
    errors = {label: run.errors(solutions[label]) for label, run in runs.items()}
    return ComparedRuns(runs, solutions, errors, _common(errors) if errors else (0.0, 0.0), others, solution)


def _label(path: Path, paths: Sequence[Path]) -> str:
    """Return the name of a directory; its path if another one has the same name."""
    names = [other.resolve().name for other in paths]
    return path.resolve().name if names.count(path.resolve().name) == 1 else str(path)


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


def comparison_exhibits(compared: ComparedRuns, place: Path = Path()) -> Exhibits:
    """Return what finished runs beside each other have to show, for a page in the folder `place`."""
    page: tuple[Medium, ...] = ("page",)
    curves, keys = chosen_exhibits(compared.sources, place)
    items: list[Item] = [Section("Runs", [_runs(compared)])]
    if compared.errors:
        items = [Sentence(_span(compared), on=page), *items, *_errors(compared)]
        curves += error_exhibits(compared, _period(compared), apart=False, magnitudes=False)
    items += [Section("Errors over time", curves, on=page), Section("What differs in the scenarios", keys, on=page)]
    return Exhibits("Comparison of " + ", ".join(source.label for source in compared.sources), items)


def _span(compared: ComparedRuns) -> str:
    start, end = compared.span
    cut = " A run that is longer is cut to it." if compared.is_cut else ""
    return f"Errors from {start:g} s to {end:g} s ({duration_words(end - start)}), which all runs have.{cut}"


def _errors(compared: ComparedRuns) -> Iterator[Item]:
    """Yield the table of errors, and which runs did not finish."""
    start, end = compared.span
    yield error_table(compared.numbers, f"errors from {start:g} s to {end:g} s, which all runs have", "run")
    yield note_on_errors(where="comparison.json; all samples: sinssim.load_streams of each run")
    for label, run in compared.runs.items():
        if run.status != "finished":
            yield Sentence(f"{label} {run.status}: {run.summary.get('message', '')}", on=("console",))


def _runs(compared: ComparedRuns) -> Table:
    """Return the runs: scenario, solution, times, date; and ensembles and budgets."""
    heads = ("scenario", "solution", "status", "date", "seed", "time [s]")
    rows = []
    for source in compared.sources:
        time = source.curves[0].time
        run = compared.runs.get(source.label)
        if run is None or run.path != source.path:
            date = datetime.datetime.fromtimestamp(source.path.stat().st_mtime).astimezone()
            about = ("", source.names, str(kind_of(source.path)), f"{date:%Y-%m-%d %H:%M}", "–")
        else:
            time = compared.errors[source.label].time
            about = (str(run.summary["scenario"]), compared.solutions[source.label], run.status,
                     f"{run.date:%Y-%m-%d %H:%M}", str(run.summary.get("seed", "–")))  # fmt: skip
        rows.append((source.label, *about, f"{time[0]:g} … {time[-1]:g}", source.names))
    columns = [Column(head, words=head not in ("seed", "time [s]")) for head in heads]
    paint = style.others(len(rows))
    return Table((Column("run", words=True), *columns, _CURVES), rows, colors=paint)


_CURVES = Column("curves", words=True, on=("page",))
"""The column in which the script of a page has its check boxes."""


def _period(compared: ComparedRuns) -> float:
    """Return Schuler's period at the place of the first run, s."""
    run = next(iter(compared.runs.values()))
    latitude, height = run.place()
    ellipsoid = str(run.scenario.get("truth", {}).get("ellipsoid", "wgs84"))
    state = NavState(latitude, np.zeros(1), height, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]))
    return schuler_period(state, ellipsoid_by_name(ellipsoid))


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
        write_text(folder.path / "report.html", page_of(comparison_exhibits(compared, folder.target)))
        write_json(folder.path / "comparison.json", contents)
        return contents, folder.keep()


def list_page(entries: Sequence[Entry], folder: Path, place: Path) -> str:
    """Return the runs in a folder, as `runs_in` returns them, as a page, HTML, in the folder `place`, on which the
    reader draws their curves on the same axes."""
    sources = []
    for entry in entries:
        label = _place(entry.path, folder)
        try:
            sources.append(source_of(entry.path, label))
        except InputError:
            sources.append(Source(label, entry.path, []))
    curves, keys = chosen_exhibits(sources, place)
    texts = [source.names for source in sources]
    items = [Section("Runs", list(list_exhibits(entries, folder, texts))), Section("Errors over time", curves),
             Section("What differs in the scenarios", keys)]  # fmt: skip
    return page_of(Exhibits(f"Runs in {folder.resolve().name}", items))


def write_list(entries: Sequence[Entry], folder: Path) -> Path:
    """Write the page of the runs in a folder to runs.html there, in place of an older one, and return its place."""
    page = folder / "runs.html"
    if os.path.lexists(page) and (page.is_symlink() or not page.is_file() or _TITLE not in _beginning(page)):
        raise InputError(f"{page} is no list of runs that sinssim wrote; move it away or rename it.")
    try:
        write_text(page, list_page(entries, folder, folder))
    except OSError as error:
        raise InputError(f"{page} cannot be written: {error.strerror or error}.") from error
    return page


_TITLE = "<title>Runs in "


def _beginning(file: Path) -> str:
    with open_file(file) as opened:
        return bytes(opened.read(4096)).decode(errors="replace")


def _place(path: Path, folder: Path | None) -> str:
    """Return the name of a run's directory, in the folder of a list if there is one."""
    return str(path if folder in (None, path) else path.relative_to(folder))


def list_exhibits(entries: Sequence[Entry], folder: Path, curves: Sequence[str] = ()) -> Iterator[Item]:
    """Yield the runs in a folder; on a page, with the names of their curves."""
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
    names: list[tuple[str, ...]] = [(text,) for text in curves] or [()] * len(entries)
    rows = [
        (
            _place(entry.path, folder if curves else None),
            entry.kind if entry.status in ("", "finished") else f"{entry.kind}, {entry.status}",
            entry.scenario, "" if (rms := entry.rms_horizontal_error_m) is None else rms, entry.solution,
            size_text(entry.size_bytes), f"{entry.date:%Y-%m-%d %H:%M}", *text,
        )
        for entry, text in zip(entries, names, strict=True)
    ]  # fmt: skip
    yield Table((*columns, _CURVES) if curves else columns, rows)
    yield Sentence(f"{len(entries)} in {folder}, {size_text(sum(entry.size_bytes for entry in entries))}.")
    for entry in entries:
        if is_of_another(entry.path):
            yield Sentence(f"{entry.path} was written by sinssim {entry.sinssim}.")
        if entry.problem:
            yield Sentence(f"Not read: {entry.problem}")
