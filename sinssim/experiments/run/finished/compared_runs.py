"""Finished runs beside each other: errors over the time that they have in common, and the keys that differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.run.finished.finished_run import FinishedRun
from sinssim.experiments.run.store.score_files import known_numbers
from sinssim.logs.stored.made_by import warn_of_version
from sinssim.strapdown.nav_error import NavError

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
