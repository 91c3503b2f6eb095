"""Injected GNSS outages of recorded data: those of the run, or those of further passes of its filter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array
from sinssim.experiments.run.part import Part
from sinssim.simulation.aiding import recorded_start
from sinssim.simulation.navigation import Navigated
from sinssim.simulation.sensed import Sensed
from sinssim.simulation.truth import RecordedMotion
from sinssim.strapdown.nav_error import NavError

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.logs.reference import Reference
    from sinssim.simulation.aided.recorded_run import Prepared

_SHARES = {"median": 50.0, "p90": 90.0}


@dataclass(frozen=True)
class JudgedOutages:
    """The errors of injected outages.

    Attributes:
        numbers: the entry `outages` of the summary.
        growth: for each outage the time since its beginning, (K,) s, and the horizontal error, (K,) m.
    """

    numbers: dict[str, Any]
    growth: tuple[tuple[Array, Array], ...]


@dataclass(frozen=True)
class Outages(Part):
    """The injected outages of a run on recorded sensors with a filter."""

    name = "outages"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether outages are injected, and a filter bridges them."""
        if not isinstance(run.truth, RecordedMotion) or run.scenario.filter is None:
            return False
        log = run.truth.prepared.log
        return bool(log.outages or any(log.passes))

    @cached_property
    def judged(self) -> JudgedOutages:
        """Errors at the end of each outage, against the reference or else the withheld fixes.

        They are those of the run's own outages, or of each further pass, which is computed here.
        """
        motion, aided = self.run.truth, self.aided
        assert isinstance(motion, RecordedMotion)
        assert aided is not None
        prepared, log = motion.prepared, motion.prepared.log
        reference = _reference(prepared)
        if reference is None:
            return JudgedOutages({"each": []}, ())
        found, growth = [], []
        for number, spans in enumerate(log.passes or (log.outages,), start=1):
            estimate = _pass(self.run.sensed, prepared, spans) if log.passes else aided.estimate
            error = reference.error_of(estimate.solution)
            smoothed = None if estimate.smoothed is None else reference.error_of(estimate.smoothed.solution)
            of_pass = outage_errors(estimate, error, smoothed, spans)
            for one in of_pass:
                if log.passes:
                    one["pass"] = number
                rows = (error.time >= one["from_s"]) & (error.time <= one["to_s"] + 1e-9)
                rows &= np.isfinite(error.horizontal)
                growth.append((error.time[rows] - one["from_s"], error.horizontal[rows]))
            found += of_pass
        return JudgedOutages({"against": reference.name, **outage_numbers(found)}, tuple(growth))

    def with_filter(self, numbers: Any) -> Mapping[str, Any]:
        """Return the errors of the outages, for `summary.json`."""
        return self.judged.numbers


def outage_errors(
    estimate: Estimate, error: NavError, smoothed: NavError | None, outages: Sequence[tuple[float, float]]
) -> list[dict[str, Any]]:
    """Return the errors at the end of each outage.

    Args:
        estimate: the aided solution.
        error: its differences from the reference, or from the withheld fixes, at the filter's epochs.
        smoothed: the same of the smoothed solution, if there is one.
        outages: beginning and end of each, s.

    Returns:
        For every outage its times, the horizontal and height error and the velocity error of the filter at the last
        known instant, its own 1σ of the horizontal position there, and the largest horizontal error of the smoothed
        solution within it.
    """
    found = []
    for begin, end in outages:
        during = (error.time > begin) & (error.time <= end + 1e-9)
        known = np.flatnonzero(during & np.isfinite(error.position_ned).all(axis=1))
        if not len(known):
            continue
        k = int(known[-1])
        one: dict[str, Any] = {
            "from_s": float(begin),
            "to_s": float(end),
            "at_s": float(error.time[k]),
            "horizontal_error_m": float(error.horizontal[k]),
            "height_error_m": float(error.height[k]),
            "velocity_error_mps": float(error.speed[k]),
            "horizontal_sigma_m": float(np.hypot(*estimate.sigma[k, :2])),
        }
        if smoothed is not None:
            inside = (smoothed.time > begin) & (smoothed.time <= end + 1e-9)
            values = smoothed.horizontal[inside]
            values = values[np.isfinite(values)]
            one["smoothed_max_horizontal_error_m"] = float(values.max()) if len(values) else math.nan
        found.append(one)
    return found


def outage_numbers(found: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the errors of outages together.

    Args:
        found: the errors of each, of `outage_errors`.

    Returns:
        `each`: the same; `median` and `p90` over the outages of the magnitude of each error; `error_over_sigma`: root
        mean square of the horizontal error over the filter's own 1σ, which is 1 on average for a filter that is right.
    """
    ratio = [one["horizontal_error_m"] / one["horizontal_sigma_m"] for one in found]
    return {
        "each": list(found),
        **{word: _share(found, percent) for word, percent in _SHARES.items()},
        "error_over_sigma": float(np.sqrt(np.mean(np.square(ratio)))) if ratio else math.nan,
    }


def _share(found: Sequence[Mapping[str, float]], percent: float) -> dict[str, float]:
    """Return a percentile over the outages of the magnitude of each error."""
    keys = [key for key in (found[0] if found else ()) if key.endswith(("_m", "_mps"))]
    values = {key: np.abs([one[key] for one in found]) for key in keys}
    known = {key: row[np.isfinite(row)] for key, row in values.items()}
    return {key: float(np.percentile(row, percent)) if len(row) else math.nan for key, row in known.items()}


def _reference(prepared: Prepared) -> Reference | None:
    """Return what the outages are judged by."""
    from sinssim.logs.reference import Reference

    log, section = prepared.log, prepared.scenario.log
    assert section is not None
    if log.reference is not None or log.fixes is None or section.gnss is None:
        return log.reference
    f, arm = log.fixes, section.gnss.lever_arm_m
    return Reference("the withheld fixes", f.time, f.latitude, f.longitude, f.height, lever_arm=arm)


def _pass(sensed: Sensed, prepared: Prepared, spans: tuple[tuple[float, float], ...]) -> Estimate:
    """Run the filter once more, without the satellites of some spans."""
    from sinssim.logs.aiding import gnss_readings
    from sinssim.simulation.aided.recorded_run import aid_recorded

    log, section, settings = prepared.log, prepared.scenario.log, prepared.scenario.filter
    assert section is not None
    assert section.gnss is not None
    assert log.fixes is not None
    assert settings is not None
    without = gnss_readings(log.fixes, section.gnss, spans)
    kinds = {one.measurements.label for one in without}
    others = (one for one in log.sensed if one.measurements.label not in kinds)
    once = settings.model_copy(update={"backward": False})  # outages are judged forwards, and smoothed
    scenario = prepared.scenario.model_copy(update={"filter": once})
    changed = replace(prepared, scenario=scenario, log=replace(log, sensed=(*without, *others), outages=spans))
    start = recorded_start(prepared.scenario, sensed)
    return aid_recorded(changed, sensed.imu, start, history=settings.smooth)
