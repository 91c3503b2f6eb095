"""The stages of a run: progress and duration of each."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from sinssim.progress import Progress

STAGES = {
    "flight": "Flying",
    "truth": "Fitting the true motion",
    "imu": "Sensing",
    "navigate": "Navigating",
    "budget": "Sources of the phases",
    "filter": "Filtering",
    "record": "Recording",
}
"""The stages of a run in order, and the text of the bar of each."""


class Stages:
    """Reports the stages of a run and measures the duration of each."""

    def __init__(self, progress: Progress) -> None:
        """Start the clock."""
        self.report = progress
        self._seconds = dict.fromkeys(STAGES, 0.0)
        self._begin = time.perf_counter()

    def within(self, stage: str) -> Progress:
        """Return a function of the present work within a stage and the fraction done.

        Args:
            stage: one of `STAGES`.
        """
        return lambda what, fraction: self.report(f"{stage}: {what}", fraction)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Measure a stage, or a further part of it."""
        begin = time.perf_counter()
        if not self._seconds[stage]:
            self.report(stage, 0.0)
        try:
            yield
        finally:
            self._seconds[stage] += time.perf_counter() - begin
        self.report(stage, 1.0)

    def timing(self) -> dict[str, float]:
        """Return the wall-clock time of each stage and of all of them together, s."""
        total = time.perf_counter() - self._begin
        return {f"{stage}_s": round(s, 4) for stage, s in (*self._seconds.items(), ("total", total))}
