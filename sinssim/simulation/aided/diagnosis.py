"""Runs a filter whose innovations speak against it again under other hypotheses, over the beginning of a run."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sinssim.data import ImuData, Measurements
from sinssim.estimation.checks.candidates import widened
from sinssim.estimation.checks.consistency import consistency
from sinssim.estimation.checks.cure import vibration_untold
from sinssim.estimation.checks.diagnosis import LimitReachedError, diagnose
from sinssim.estimation.estimate import estimate
from sinssim.estimation.explanation import Diagnosis
from sinssim.estimation.initial_alignment.start import Start
from sinssim.estimation.model import ErrorModel
from sinssim.estimation.result import Estimate, Innovations
from sinssim.progress import Progress, silent

_FIRST_S = 300.0
"""Shortest time that is looked at. It is doubled until the innovations within it speak against the filter, so that a
fault that shows early costs little however long the run is."""

_SAMPLES, _MOST, _FEWEST = 3_000_000, 70, 30
"""Limit of the search: inertial samples that all its runs take together, about two minutes at 40 µs for each; most runs
in any case, more than any model has needed; and runs that are allowed however long the time is: those of the states,
of the start and of the measurement noise, the most likely causes, which come first. The search for inertial noise, with
six decades for each sensor, is then cut."""


def diagnosed(
    found: Estimate,
    start: Start,
    readings: Sequence[Measurements],
    options: Mapping[str, Any],
    progress: Progress = silent,
) -> Estimate:
    """Return an estimate with its diagnosis, if its innovations speak against the filter.

    Args:
        start: increments, state and covariance that the filter started with.
        options: arguments of `estimate`.
    """
    if consistency(found).consistent:
        return found
    begin, end = float(start.imu.time[0]), float(start.imu.time[-1])
    lasts = _FIRST_S
    while begin + lasts < end and (options["encoders"] is not None or _consistent_until(found, begin + lasts)):
        lasts *= 2.0
    seen = _diagnosis(found, start, readings, options, min(begin + lasts, end), progress)
    if seen is not None and seen.cause is not None and seen.cause.kind != "inertial noise":
        # a better explanation was found than the vibration that the estimate's remark suspects
        suspected = vibration_untold(found.innovations, start.imu, found.model, options["added_noise"])
        found = replace(found, remarks=tuple(remark for remark in found.remarks if remark not in suspected))
    return replace(found, diagnosis=seen)


def _consistent_until(found: Estimate, until: float) -> bool:
    """Return whether the innovations up to an instant are consistent."""
    part = tuple(_part(one, until) for one in found.innovations)
    ends = found.divergence is not None and found.divergence.time <= until
    return not ends and consistency(replace(found, innovations=part, divergence=None)).consistent


def _part(innovations: Innovations, until: float) -> Innovations:
    """Return the innovations up to an instant."""
    k = int(np.searchsorted(innovations.time, until, "right"))
    i = innovations
    return replace(
        i, time=i.time[:k], value=i.value[:k], lower=i.lower[:k], nis=i.nis[:k], accepted=i.accepted[:k],
        reason=i.reason[:k],
    )  # fmt: skip


def _diagnosis(
    found: Estimate,
    start: Start,
    readings: Sequence[Measurements],
    options: Mapping[str, Any],
    until: float,
    progress: Progress,
) -> Diagnosis | None:
    edges = start.imu.time
    stop = int(np.searchsorted(edges, until - 1e-9))
    imu = ImuData(edges[: stop + 1], start.imu.dtheta[:stop], start.imu.dvel[:stop])
    within = [_rows(m, m.time <= edges[stop] + 1e-9) for m in readings]

    most = most_runs(stop)
    runs, refused, begin = 0, 0, time.perf_counter()

    def run(model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Estimate:
        nonlocal runs, refused
        if runs >= most and not smooth:  # the size of the best explanation is found in any case
            refused += 1
            raise LimitReachedError("the search is at its limit.")
        progress(_tried(found.model, model, factors), min(runs / most, 1.0))
        runs += 1
        told = [replace(m, sigma=factors.get(m.label, 1.0) * m.sigma) for m in within]
        own = {**options, "axes": model.axes}
        known = widened(start.covariance, found.model, model)
        return estimate(imu, start.state, told, model, covariance=known, smooth=smooth, history=False, **own)

    interval = float(np.median(np.diff(imu.time)))
    seen = diagnose(run, found.model, interval, float(edges[stop]))
    progress("done", 1.0)
    took = time.perf_counter() - begin
    return None if seen is None else replace(seen, runs=runs, seconds=took, cut=refused > 0)


def most_runs(samples: int) -> int:
    """Return how many runs of the filter a search may take."""
    return min(max(_SAMPLES // max(samples, 1), _FEWEST), _MOST)


def _tried(own: ErrorModel, model: ErrorModel, factors: Mapping[str, float]) -> str:
    """Return in which a model differs from the filter's own, in a few words."""
    if factors:
        return f"σ of {', '.join(factors)}"
    if (model.gyro_noise, model.accel_noise) != (own.gyro_noise, own.accel_noise):
        return "inertial noise"
    known = {block.name: block for block in own.blocks}
    for block in model.blocks:
        there = known.get(block.name)
        if there is None or not np.array_equal(there.sigma, block.sigma):
            return (
                block.name
                if there is None or block.name not in ("position", "velocity", "attitude")
                else f"initial {block.name}"
            )
        if there is not block:
            return f"random walk of {block.name}"
    return "the filter itself"


def _rows(m: Measurements, which: np.ndarray[Any, np.dtype[np.bool_]]) -> Measurements:
    """Return some readings."""
    if which.all():
        return m
    correlation = None if m.correlation is None else m.correlation[which]
    m = replace(m, correlation=correlation, sigma=m.sigma[which])
    return replace(m, time=m.time[which], arrival=m.arrival[which], value=m.value[which])
