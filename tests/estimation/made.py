"""Histories and innovations of a few rows with round numbers, for tests whose answers are worked out by hand."""

from __future__ import annotations

import numpy as np

from sinssim.data import Array, NavState
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.filter_result import History, Innovations, Reasons
from sinssim.estimation.linearisation import Observed

MODEL = ErrorModel((Block("position", 2.0), Block("velocity", 0.5), Block("attitude", 1e-3)), 1e-4, 1e-3)
"""Nine states, of noise 1e-4 rad/√s and 1e-3 m/s/√s."""


def reading(residual: Array, h: Array, interval: float = 0.0) -> Observed:
    """Return a reading of unit variance that is linear in the errors."""
    return Observed(0, 0, residual, h, np.ones(len(residual)), interval, lambda errors: residual - errors @ h.T)


def history(time: Array, **given: Array) -> History:
    """Return a history of R rows: unit matrices, no noise, no feedback and unit covariances unless given."""
    rows, n = len(time), 9
    unit, none = np.tile(np.eye(n), (rows, 1, 1)), np.zeros((rows, n))
    of = {"transition": unit, "noise": 0.0 * unit, "covariance": unit, "state": none, "fed_back": none,
          "information": 0.0 * unit, "decay": unit, "compensated": none, "on_edge": None, **given}  # fmt: skip
    still = NavState(*(np.zeros((rows, *shape)) for shape in ((), (), (), (3,), (4,))))
    return History(time=np.asarray(time), navigation=still, **of)  # type: ignore[arg-type]


def readings(
    sensor: str, time: Array, accepted: Array, *, nis: Array | None = None, kind: str = "gnss-position",
    reasons: dict[int, str] | None = None, value: Array | None = None, covariance: Array | None = None,
    bound: float = 9.0,
) -> Innovations:  # fmt: skip
    """Return innovations of one sensor; `nis` is 1 unless given."""
    count = len(time)
    value = np.zeros((count, 1)) if value is None else value
    covariance = np.eye(value.shape[1]) if covariance is None else covariance
    lower = np.tile(covariance[np.tril_indices(len(covariance))], (count, 1))
    return Innovations(
        sensor, kind, np.asarray(time, dtype=float), value, lower, np.ones(count) if nis is None else nis,
        np.asarray(accepted, dtype=bool), Reasons(count, reasons or {}), bound,
    )  # fmt: skip
