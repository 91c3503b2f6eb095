"""Overlapping Allan deviation, straight from its definition (IEEE 952-2020, annex on the Allan variance)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def allan_deviation(increments: NDArray[np.float64], interval: float, samples: int) -> float:
    """Return the overlapping Allan deviation of the rate whose integrals are given.

    Args:
        increments: integrals of the rate over equal intervals, (N,).
        interval: length of one interval, s.
        samples: intervals in one averaging time.

    Returns:
        √⟨(θ_{k+2m} − 2θ_{k+m} + θ_k)²⟩ / (√2 m T).
    """
    angle = np.concatenate([[0.0], np.cumsum(increments)])
    second = angle[2 * samples :] - 2.0 * angle[samples:-samples] + angle[: -2 * samples]
    return float(np.sqrt(np.mean(second**2) / 2.0) / (samples * interval))
