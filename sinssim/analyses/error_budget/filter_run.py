"""The inputs of a filter in a budget: `FilterRun`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sinssim.data import Array, Measurements
from sinssim.estimation.model import ErrorModel


@dataclass(frozen=True)
class FilterRun:
    """What the filter of a scenario is told, and where it starts.

    Attributes:
        model: its error model.
        covariance: P₀, (n, n).
        measurements: readings without random errors, with the 1σ that the filter assumes.
        rate_hz: of its prediction.
        start: first edge of its samples.
    """

    model: ErrorModel
    covariance: Array
    measurements: Sequence[Measurements]
    rate_hz: float
    start: int
