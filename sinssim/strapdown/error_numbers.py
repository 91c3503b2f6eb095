"""The errors of a solution in a few numbers: at the end, root mean square, largest."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.errors import RunError
from sinssim.strapdown.nav_error import NavError

_QUANTITIES: dict[str, Callable[[NavError], Array]] = {
    "horizontal_error_m": lambda error: error.horizontal,
    "height_error_m": lambda error: error.height,
    "velocity_error_mps": lambda error: error.speed,
    "attitude_error_arcsec": lambda error: error.angle / units.ARCSEC,
}
NO_NUMBERS: dict[str, float] = {f"{kind}_{q}": math.nan for q in _QUANTITIES for kind in ("final", "rms", "max")}
"""The errors of an algorithm without a solution, in the form of `error_numbers`."""


def error_numbers(error: NavError) -> dict[str, float]:
    """Return the error statistics of one algorithm.

    Returns:
        `final_`, `rms_` and `max_` of `horizontal_error_m`, `height_error_m`, `velocity_error_mps` and
        `attitude_error_arcsec`. The final height error has a sign, positive if the solution is too high; all others are
        magnitudes.
    """
    return error_numbers_of(lambda: [error])


def error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return the error statistics of one solution, given block by block.

    Args:
        blocks: returns its errors, one block of rows after the other; called for each quantity, so that only one
            of them is in memory.

    Returns:
        As `error_numbers`.
    """
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])  # a copy
        numbers[f"final_{name}"] = float(values[-1])
        largest = float(np.abs(values, out=values).max())
        with np.errstate(over="ignore", invalid="ignore"):
            numbers[f"rms_{name}"] = float(np.sqrt(np.mean(np.multiply(values, values, out=values))))
        numbers[f"max_{name}"] = largest
    return numbers


def known_error_numbers_of(blocks: Callable[[], Iterable[NavError]]) -> dict[str, float]:
    """Return the statistics of errors that are known at some rows only, as `error_numbers_of`.

    Args:
        blocks: as for `error_numbers_of`; NaN where the errors are not known.

    Returns:
        The statistics over the known rows; "final" is the last known one. NaN for a quantity that is never known.
    """
    numbers = {}
    for name, quantity in _QUANTITIES.items():
        values = np.concatenate([quantity(block) for block in blocks()])
        values = values[np.isfinite(values)]
        numbers[f"final_{name}"] = float(values[-1]) if len(values) else math.nan
        numbers[f"rms_{name}"] = float(np.sqrt(np.mean(values * values))) if len(values) else math.nan
        numbers[f"max_{name}"] = float(np.abs(values).max()) if len(values) else math.nan
    return numbers


def diverged(errors: Mapping[str, NavError]) -> dict[str, RunError]:
    """Find the algorithms whose errors are not finite.

    Returns:
        For each of them an error with the message and the instant from which this holds.
    """
    found = {}
    for name, error in errors.items():
        if all(map(math.isfinite, error_numbers(error).values())):
            continue
        with np.errstate(over="ignore", invalid="ignore"):
            finite = np.isfinite(error.horizontal**2 + error.height**2 + error.speed**2 + error.angle**2)
        time = float(error.time[int(np.argmin(finite))])
        found[name] = RunError(f"its errors are not finite from t = {time:.2f} s on: it diverged.", time=time)
    return found
