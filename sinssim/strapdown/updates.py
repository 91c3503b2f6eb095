"""The increments of a run in the updates of a mechanization: fast intervals, fits within them, rows of the solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.algorithms import REGISTRY, schedule, three_rates
from sinssim.checks import checked_increments
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.strapdown.increments.fit import is_uniform, weight_table
from sinssim.strapdown.mechanization import Mechanization


@dataclass(frozen=True)
class Updates:
    """Increments in the intervals of the fast part, and the rows that a solution has.

    Attributes:
        sample_time: edges of the given increments, (N+1,) s.
        time: edges of the fast intervals, (M+1,) s; the given ones without a schedule.
        dtheta, dvel: increments in them, (M, 3) rad and m/s.
        uniform: whether all intervals are equal.
        weights: weights of the fit of rate and specific force, see `increments.fit.weight_table`.
        ratio: number of given increments in a fast interval.
        per_row: number of fast intervals between two rows of the solution.
        rates: intervals per medium and per slow update, and whether slow quantities are extrapolated; None without a
            schedule.
    """

    sample_time: Array
    time: Array
    dtheta: Array
    dvel: Array
    uniform: bool
    weights: Array
    ratio: int
    per_row: int
    rates: tuple[int, int, bool] | None

    def at_rows(self, at_samples: Array) -> Array:
        """Return values at the rows of the solution.

        Args:
            at_samples: values at the edges of the given increments, (N+1, …); empty ones stay empty.
        """
        rows = len(self.dtheta) // self.per_row
        step = self.ratio * self.per_row
        return np.ascontiguousarray(at_samples[: rows * step + 1 : step])  # kernels are compiled for such arrays


def updates(imu: ImuData, of: Mechanization) -> Updates:
    """Return the increments of a run in the updates of a mechanization.

    Args:
        imu: increments, N intervals.

    Returns:
        The updates; samples at the end that do not fill a row stay.

    Raises:
        InputError: the increments cannot be used, the algorithm or the schedule needs equal intervals, or the data are
            shorter than one row.
    """
    sample_time, dtheta, dvel = checked_increments(imu)
    time, uniform, entry = sample_time, is_uniform(sample_time), REGISTRY[of.algorithm]
    if entry.needs_equal_intervals and not uniform:
        raise InputError(
            f"{of.algorithm} needs equal sampling intervals, for which its coefficients hold; those of the data range "
            f"from {np.min(np.diff(time)):.6g} s to {np.max(np.diff(time)):.6g} s."
        )
    ratio, per_row, rates, at_rate = 1, entry.samples, None, ""
    if of.rates_hz is not None:
        if not uniform:
            raise InputError("rates_hz: the three-rate schedule needs equal sampling intervals.")
        hz = three_rates(of.rates_hz)
        ratio, per_medium, per_slow = schedule(hz, len(dtheta) / float(time[-1] - time[0]))
        dtheta, dvel = _summed(dtheta, ratio), _summed(dvel, ratio)
        time = np.ascontiguousarray(time[: len(dtheta) * ratio + 1 : ratio])
        per_row, rates = per_medium * per_slow, (per_medium, per_slow, of.slow_quantities == "extrapolate")
        at_rate = f" at the slow rate, {hz[2]:g} Hz"
    if len(dtheta) < per_row:
        raise InputError(
            f"the data, {len(imu)} samples, are shorter than one update of {of.algorithm}"
            f"{at_rate or f', which takes {per_row}'}."
        )
    return Updates(
        sample_time, time, dtheta, dvel, uniform, weight_table(time, uniform), ratio, per_row, rates
    )  # fmt: skip


def _summed(increments: Array, ratio: int) -> Array:
    """Return sums of consecutive increments, (N // ratio, 3); remaining samples at the end are dropped."""
    whole = len(increments) // ratio
    return np.ascontiguousarray(increments[: whole * ratio].reshape(whole, ratio, 3).sum(axis=1))
