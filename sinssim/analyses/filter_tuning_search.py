"""`sinssim tune`: noises of a filter and the installation of its sensors by the likelihood of its innovations.

A held-out part of the data judges them. The filter runs over the data once, without a gate, and `linear_replay` gives
the innovations with other noises. The first part of the data determines the keys; the rest, which they never saw,
judges them. Measurements beyond the bound of one in ten thousand are left out and the rest is fitted again, since a few
outliers would decide a noise. If a noise changes by more than a third, the filter runs again about the better estimate.

A lever arm, a delay or the mounting is the mean of a state without variance, so that the innovations depend on it
linearly; the filter runs again about a better value.

A key is refused if the likelihood is flat along it: its 95 % interval is wider than a factor of a hundred. Where it is
flat to one side only, the limit of the other side is given, at which L, with the other keys fitted, has fallen by 1.35
(one-sided, χ² of one degree of freedom).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim.analyses.filter_tuning_data import (
    INSTALLED,
    TuningData,
    installed_errors,
    installed_part,
    installed_values,
    starts_of,
)
from sinssim.analyses.filter_tuning_result import Judged, Tuned, TuningResult
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.estimation.linear_replay import Assumptions, Series, densities_of, nis_of
from sinssim.estimation.maximum_likelihood import (
    WIDE,
    Maximum,
    drop_outliers,
    log_likelihood,
    maximum,
    maximum_without_outliers,
)
from sinssim.progress import Progress, silent
from sinssim.units import number_text

HELD_OUT = 1.0 / 3.0
"""Share of the data, at its end, that judges the keys by default."""

_LEAST = math.log(1e-7)
"""Logarithm of the least noise over that to begin with."""

_GRID, _STRIDE = 0.25, 2
"""Steps of the logarithm by which one-sided limits are sought, and how many of them at once with the others fitted."""

_FALL = 1.3528
"""Fall of L at a one-sided limit of 95 %: half of χ² of one degree of freedom at 90 %."""

_AGAIN, _PASSES = 0.3, 4
"""Change of a logarithm, or of the installation in steps, beyond which the filter runs again, relative to a 1σ above 1;
most runs."""


class _Pass:
    """A pass of the filter, with its replays for logarithms of values over those to begin with."""

    def __init__(self, data: TuningData, start: Mapping[str, float], at: Array) -> None:
        self._data, self._start, self.scenario = data, dict(start), data.scenario
        self.unit = np.array(
            [INSTALLED[whole].unit if (whole := installed_part(key)[0]) else math.nan for key in start]
        )
        values = self.of(at)
        self.line = data.run(values)
        self._model, _ = data.assumed(values)
        self._densities = densities_of(self._model)
        self._before, self._mounting = values, (data.scenario.imu.mounting_deg or (0.0, 0.0, 0.0))
        ends = [
            data.limits(key, value) if installed_part(key)[0] else (_LEAST, data.most(key, value))
            for key, value in start.items()
        ]
        self.least, self.most = np.array(ends).reshape(-1, 2).T
        self.dropped = {
            name: np.zeros(len(checked.data.time), dtype=bool)
            for name, checked in zip(self.line.names, self.line.around.readings, strict=True)
        }

    def of(self, x: Array) -> dict[str, float]:
        """Return the values for logarithms, and for steps of the installation, (n,)."""
        return {
            key: value_of(value, float(of), float(unit))
            for (key, value), of, unit in zip(self._start.items(), x, self.unit, strict=True)
        }

    def _assumptions(self, x: Array) -> Assumptions:
        values = self.of(x)
        error = np.zeros(self._model.size)
        for block, errors in installed_errors(values, self._before, self._mounting).items():
            error[self._model.slices[block]] = errors
        noises = {key: self._before[key] if installed_part(key)[0] else value for key, value in values.items()}
        model, readings = self._data.assumed(noises)
        if model.states != self._model.states or not np.array_equal(model.decay, self._model.decay):
            raise InputError(f"{', '.join(self._start)} change the states of the filter: give noises alone.")
        densities, before = densities_of(model), self._model.sigma
        process = np.divide(densities, self._densities, out=np.ones_like(densities), where=self._densities > 0.0)
        start = np.divide(model.sigma, before, out=np.ones_like(before), where=before > 0.0)
        sigma = {}
        for name, checked in zip(self.line.names, self.line.around.readings, strict=True):
            if name in readings:
                rows = np.searchsorted(readings[name].time, checked.data.time - 1e-9)
                sigma[name] = readings[name].sigma[rows] / checked.data.sigma
        return Assumptions(process, start, sigma, error=error)

    def replay(self, sets: Array, until: float = math.inf) -> list[Series]:
        """Return the innovations for B sets of logarithms, (B, n), until an instant, s."""
        return self.line.replay([self._assumptions(x) for x in sets], self.dropped, until)


def tune(
    scenario: str | Path,
    settings: Sequence[str] = (),
    *,
    keys: Sequence[str] = (),
    held_out: float = HELD_OUT,
    progress: Progress = silent,
) -> TuningResult:
    """Find the noises of a scenario's filter under which its innovations are most probable.

    Args:
        scenario: file or name of a scenario with a filter, simulated or with [log].
        settings: settings "key=value" that replace values of the file.
        keys: keys to tune, "key" or "key=value" with a value to begin with; by default the noises that matter.
        held_out: share of the data, at its end, that judges the values, 0 … 0.9.
        progress: function that is called with the work and the fraction done.

    Returns:
        The values with their 95 % intervals, and how the held-out part judges them.

    Raises:
        InputError: there is no filter, or a key is no noise of it.
        RunError: the filter diverges.
    """
    if not 0.0 <= held_out <= 0.9:
        raise InputError(f"held_out = {held_out:g} must be between 0 and 0.9.")
    progress("Reading", 0.0)
    data = TuningData(str(scenario), settings)
    start = starts_of(data, keys)
    at, passes, replays = np.zeros(len(start)), 0, 0
    for k in range(_PASSES):
        begin = 0.05 + 0.9 * k / _PASSES
        progress("Filtering", begin)
        line, passes = _Pass(data, start, at), passes + 1
        if not line.line.events:
            raise InputError(f"{scenario} has no measurements to tune the filter by.")
        first, last = line.line.events[0].time, line.line.events[-1].time
        split = first + (1.0 - held_out) * (last - first)
        if k:  # the values are nearly those of this pass, and its outliers are known before they are fitted
            drop_outliers(line.dropped, line.replay(at[None], split))
        fitted = _fit(line, at, split, partial(_fitting, progress, begin), outliers=not k)
        replays += fitted.steps
        if np.max(np.abs(fitted.x - at) / np.maximum(fitted.sigma, 1.0), initial=0.0) < _AGAIN:
            break  # a key that the data do not tell changes nothing
        at = fitted.x
    tuned, fitted, more = _decided(line, start, fitted, split)
    outliers = {name: int(rows.sum()) for name, rows in line.dropped.items() if rows.any()}
    progress("Judging", 0.97)
    gain, judged = _judged(line, fitted.x, split)
    progress("Done", 1.0)
    return TuningResult(
        str(scenario), tuple(settings), data.prepared is None, tuned, outliers, split, last, gain, judged,
        (passes, replays + more),
    )  # fmt: skip


def _fitting(progress: Progress, begin: float, count: int) -> None:
    progress("Fitting", begin + 0.9 / _PASSES * count / (count + 10.0))


def _fit(
    line: _Pass, at: Array, split: float, progress: Callable[[int], None], free: NDArray[np.bool_] | None = None,
    *, outliers: bool = True,
) -> Maximum:  # fmt: skip
    """Fit the free logarithms from a start, all by default, and leave out `outliers`."""
    free = np.ones(len(at), dtype=bool) if free is None else free

    def replay(sets: Array) -> list[Series]:
        whole = np.tile(at, (len(sets), 1))
        whole[:, free] = sets
        return line.replay(whole, split)

    low, high = line.least[free], line.most[free]
    if outliers:
        best = maximum_without_outliers(replay, line.dropped, at[free], low, high, progress)
    else:
        best = maximum(replay, at[free], low, high, progress)
    x, sigma = at.copy(), np.full(len(at), math.inf)
    x[free], sigma[free] = best.x, best.sigma
    return replace(best, x=x, sigma=sigma)


def _decided(
    line: _Pass, start: Mapping[str, float], fitted: Maximum, split: float
) -> tuple[tuple[Tuned, ...], Maximum, int]:
    """Refuse the keys that the data cannot tell, one after the other, and fit the others again.

    A refused key stays, unless the data exclude its value: then it takes the limit that it exceeds.
    """
    count, free, limits = 0, np.ones(len(start), dtype=bool), dict[int, tuple[float, float]]()
    while free.any():
        worst = int(np.argmax(np.where(free, fitted.sigma, -1.0)))
        if fitted.sigma[worst] <= WIDE:
            break
        low, high, more = _one_sided(line, fitted, worst, split, free)
        free[worst], limits[worst], at = False, (low, high), fitted.x.copy()
        at[worst] = min(max(0.0, low), high)
        fitted = _fit(line, at, split, lambda _: None, free)
        count += more + fitted.steps
    tuned = []
    for k, (key, value) in enumerate(start.items()):
        if free[k]:
            half = 1.96 * float(fitted.sigma[k])
            low, high = fitted.x[k] - half, fitted.x[k] + half
        else:
            low, high = limits[k]
        unit = float(line.unit[k])
        refused = "" if free[k] or not low <= 0.0 <= high else _refusal(key, value, low, high, unit)
        best, least, most = (value_of(value, float(end), unit) for end in (fitted.x[k], low, high))
        whole, number = installed_part(key)
        values = installed_values(line.scenario, whole) if number else ()
        tuned.append(Tuned(key, value, best, least, most, refused, values))
    return tuple(tuned), fitted, count


def value_of(start: float, x: float, unit: float) -> float:
    """Return the value of a key for the logarithm of it over that to begin with, or with a `unit` for steps from it."""
    return start * math.exp(x) if math.isnan(unit) else start + unit * x


def _refusal(key: str, value: float, low: float, high: float, unit: float) -> str:
    text = f"the data cannot tell {key}"
    if not math.isnan(unit):
        return f"{text}: " + (
            "the motion does not show it" if math.isinf(high) else
            f"its 95 % interval is ± {number_text(0.5 * unit * (high - low), 2)} wide"
        )  # fmt: skip
    if math.isinf(low) and math.isinf(high):
        return f"{text}: far smaller and far larger values are as probable"
    if math.isinf(low):
        return f"{text} from zero: it is at most {number_text(value * math.exp(high), 3)} (95 %)"
    if math.isinf(high):
        return f"{text} from far larger values: it is at least {number_text(value * math.exp(low), 3)} (95 %)"
    return f"{text}: its 95 % interval spans more than a factor of a hundred"


def _one_sided(line: _Pass, fitted: Maximum, k: int, split: float, free: NDArray[np.bool_]) -> tuple[float, float, int]:
    """Return the logarithms of one key at which L has fallen by `_FALL` on each side, and the replays.

    L is the largest one for the other free keys. A limit is infinite where it does not fall so far.
    """
    if not math.isnan(line.unit[k]):
        half = 1.96 * float(fitted.sigma[k])
        return float(fitted.x[k]) - half, float(fitted.x[k]) + half, 0
    grid = np.arange(-_GRID * math.ceil(-_LEAST / _GRID), line.most[k] + 1e-9, _GRID)
    sets = np.tile(fitted.x, (len(grid), 1))
    sets[:, k] = grid
    alone = log_likelihood(line.replay(sets, split))  # the others unchanged: a limit is not nearer
    top = float(alone.max())
    likely = np.flatnonzero(alone > top - _FALL)
    others, count, limits = free & (np.arange(len(free)) != k), 1, []
    for sign, first in ((-1, int(likely[0])), (1, int(likely[-1]))):
        limit = sign * math.inf
        for j in range(first + sign, len(grid) if sign > 0 else -1, sign * _STRIDE):
            sets[j] = fitted.x
            sets[j, k] = grid[j]
            there = _fit(line, sets[j], split, lambda _: None, others, outliers=False)
            count += there.steps
            if there.value < top - _FALL:
                limit = float(grid[j])
                break
        limits.append(limit)
    return limits[0], limits[1], count


def _judged(line: _Pass, x: Array, split: float) -> tuple[float, tuple[Judged, ...]]:
    """Judge values by the held-out part, whose outliers with them are left out."""
    drop_outliers(line.dropped, [_later(of, split) for of in line.replay(x[None])])
    both = [part for of in line.replay(np.vstack([0.0 * x, x])) if len((part := _later(of, split)).time)]
    if not both:
        return math.nan, ()
    before, after = log_likelihood(both)
    judged = []
    for of in both:
        sums, components = nis_of(of.value, of.covariance).sum(axis=1), of.value.shape[1] * of.value.shape[2]
        judged.append(Judged(of.sensor, len(of.time), *(float(total) / components for total in sums)))
    return 2.0 * float(after - before), tuple(judged)


def _later(series: Series, split: float) -> Series:
    rows = series.time > split
    return Series(series.sensor, series.time[rows], series.row[rows], series.value[:, rows], series.covariance[:, rows])
