"""Errors of the filter in outages of recorded fixes: a pass without their readings, and its errors at their ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim import earth

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.logs.recorded_streams import FixStream
    from sinssim.logs.reference_solution import Reference
    from sinssim.simulation.recorded_filter_run import Prepared
    from sinssim.simulation.truth_and_sensors import Sensed
    from sinssim.strapdown.navigation_error import NavError


OutageErrors = dict[str, float]
"""The times of an outage, the errors at its end and the filter's 1σ by key; NaN where unknown. Its number of the pass
is there if there are several."""


def outage_reference(prepared: Prepared) -> Reference | None:
    """Return what the outages are judged by."""
    from sinssim.logs.reference_solution import Reference

    log, section = prepared.log, prepared.scenario.log
    assert section is not None
    if log.reference is not None or log.fixes is None or section.gnss is None:
        return log.reference
    f, arm = log.fixes, section.gnss.lever_arm_m
    return Reference("the withheld fixes", f.time, f.latitude, f.longitude, f.height, lever_arm=arm)


def outage_pass(sensed: Sensed, prepared: Prepared, spans: tuple[tuple[float, float], ...]) -> Estimate:
    """Run the filter once more, without the satellites of some spans."""
    from sinssim.logs.recorded_log import gnss_readings
    from sinssim.simulation.navigation_stage import recorded_start
    from sinssim.simulation.recorded_filter_run import aid_recorded

    log, section, settings = prepared.log, prepared.scenario.log, prepared.scenario.filter
    assert section is not None
    assert section.gnss is not None
    assert log.fixes is not None
    assert settings is not None
    without = gnss_readings(log.fixes, section.gnss, spans)
    kinds = {sensor.measurements.label for sensor in without}
    others = (sensor for sensor in log.sensed if sensor.measurements.label not in kinds)
    once = settings.model_copy(update={"backward": False})  # outages are judged forwards, and smoothed
    scenario = prepared.scenario.model_copy(update={"filter": once})
    changed = replace(prepared, scenario=scenario, log=replace(log, sensed=(*without, *others), outages=spans))
    start = recorded_start(prepared.scenario, sensed)
    return aid_recorded(changed, sensed.imu, start, history=settings.smooth)


def outage_errors(
    estimate: Estimate, error: NavError, smoothed: NavError | None, outages: Sequence[tuple[float, float]]
) -> list[OutageErrors]:
    """Return the errors at the end of each outage.

    Args:
        error: its differences from the reference, or from the withheld fixes, at the filter's epochs.
        smoothed: the same of the smoothed solution, if there is one.
        outages: beginning and end of each, s.

    Returns:
        For every outage its times, the horizontal and height error and the velocity error of the filter at the last
        known instant, its own 1σ of the horizontal position there, and the largest horizontal error of the smoothed
        solution within it.
    """
    rows = []
    for begin, end in outages:
        during = (error.time > begin) & (error.time <= end + 1e-9)
        known = np.flatnonzero(during & np.isfinite(error.position_ned).all(axis=1))
        if not len(known):
            continue
        k = int(known[-1])
        row: OutageErrors = {
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
            row["smoothed_max_horizontal_error_m"] = float(values.max()) if len(values) else math.nan
        rows.append(row)
    return rows


STRAIGHT_S = 2.0  # s; velocity by the fixes alone: two intervals of a receiver with one fix a second, or a longer one


def straight_line_error(fixes: FixStream, begin: float, at: float) -> float:
    """Return the horizontal distance of a withheld fix from the straight line through the last fixes before, m.

    Args:
        begin: beginning of the outage, s.
        at: time of the withheld fix, s.

    Returns:
        The distance; NaN with fewer than two fixes in the seconds before the outage.
    """
    known = np.isfinite(fixes.latitude) & np.isfinite(fixes.longitude)
    time, latitude, longitude = fixes.time[known], fixes.latitude[known], fixes.longitude[known]
    withheld = int(np.argmin(np.abs(time - at)))
    interval = float(np.median(np.diff(time)))
    before = np.flatnonzero((time <= begin) & (time > begin - max(STRAIGHT_S, interval) - 0.5 * interval))
    if len(before) < 2 or before[-1] >= withheld:
        return math.nan
    first, last = int(before[0]), int(before[-1])
    ahead = (time[withheld] - time[last]) / (time[last] - time[first])
    r1, r2 = earth.radii(latitude[last])
    north, east = ((x[withheld] - x[last]) - ahead * (x[last] - x[first]) for x in (latitude, np.unwrap(longitude)))
    return math.hypot(float(r1) * north, float(r2) * math.cos(latitude[last]) * east)
