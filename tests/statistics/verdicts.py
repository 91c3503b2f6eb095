"""The verdict on a requirement by the errors of an ensemble at all of its instants."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.data import Array
from sinssim.statistics.requirements import CONFIDENCE, Requirement, Verdict, tally, verdict_of


def verdict(
    requirement: Requirement, time: Any, errors: Any, counts: Any = None, error: float = 1.0 - CONFIDENCE
) -> Verdict:
    """Judge by the errors of runs at some instants, (N, E): at the end, at a time, or at all of them."""
    instants, values = np.asarray(time, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if values.ndim == 2 and values.shape[1:] == instants.shape and len(instants):
        rows = _rows(requirement, instants)
        instants, values, counts = instants[rows], values[:, rows], None if counts is None else counts[:, rows]
    return verdict_of(requirement, instants, tally(requirement, instants, values, counts), error)


def _rows(requirement: Requirement, instants: Array) -> slice | list[int]:
    if requirement.when == "at":
        return [int(np.argmin(np.abs(instants - requirement.time)))]
    return slice(-1, None) if requirement.when == "end" else slice(None)
