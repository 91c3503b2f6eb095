"""Standard deviation over runs, with its standard error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sinssim.arguments import doubles
from sinssim.data import Array
from sinssim.errors import InputError


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation over runs.

    Attributes:
        mean: mean over the runs.
        sigma: root of the sample variance about the mean, Σ(x − x̄)²/(N − 1).
        standard_error: of sigma, σ/√(2N), for errors of a normal distribution.
        runs: number N of runs that count.
    """

    mean: Array
    sigma: Array
    standard_error: Array
    runs: Array


def spread(values: Any) -> Spread:
    """Return mean and standard deviation over runs.

    Args:
        values: errors of N runs, (N, …). A value that is not finite does not count: σ describes the successful runs;
            state the number of failed runs with it.

    Returns:
        Arrays of the shape (…); NaN where fewer than two runs count.

    Raises:
        InputError: values is not an array of numbers.
    """
    array = doubles("values", values)
    if not len(array):
        raise InputError(f"values has the shape {array.shape}; give (N, …) with at least one run.")
    finite = np.isfinite(array)
    count = finite.sum(axis=0).astype(np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(finite, array, 0.0).sum(axis=0) / count
        squares = np.where(finite, array - mean, 0.0) ** 2
        sigma = np.sqrt(squares.sum(axis=0) / np.where(count > 1.0, count - 1.0, np.nan))
        return Spread(np.asarray(mean), np.asarray(sigma), np.asarray(sigma / np.sqrt(2.0 * count)), np.asarray(count))
