"""Evaluates injected GNSS outages of recorded data: those of the run, or those of further passes of its filter."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.earth.models import WGS84
from sinssim.simulation.initial_error import initial_state_with_errors

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.estimation.from_scenario.recorded_run import JudgedOutages, Prepared
    from sinssim.estimation.initial_alignment.start import Start
    from sinssim.logs.reference import Reference
    from sinssim.simulation.result import Run


def first_of(run: Run, prepared: Prepared) -> Start:
    """Return the start of the filter, with the errors that the scenario adds to it."""
    from sinssim.estimation.initial_alignment.start import Start

    error = run.scenario.navigation.initial_error
    first = initial_state_with_errors(prepared.start.state, error, WGS84, run.scenario.seed, "north")
    return Start(run.compensated, first, None)


def judged_outages(run: Run, prepared: Prepared) -> JudgedOutages | None:
    """Return the errors at the end of each outage, against the reference or else the withheld fixes.

    Args:
        run: the run, with its aided solution.
        prepared: scenario and data.

    Returns:
        The errors of the outages of the run and of each further pass, which is computed here; None without outages.
    """
    from sinssim.estimation.from_scenario.recorded_run import JudgedOutages
    from sinssim.recording.store.summaries.log_summary import outage_errors, outage_numbers

    log, aided = prepared.log, run.aided
    if aided is None or not (log.outages or any(log.passes)):
        return None
    reference = _reference(run, prepared)
    if reference is None:
        return JudgedOutages({"each": []}, ())
    found, growth = [], []
    for number, spans in enumerate(log.passes or (log.outages,), start=1):
        estimate = _pass(run, prepared, spans) if log.passes else aided.estimate
        error = reference.error_of(estimate.solution)
        smoothed = None if estimate.smoothed is None else reference.error_of(estimate.smoothed.solution)
        of_pass = outage_errors(estimate, error, smoothed, spans)
        for one in of_pass:
            if log.passes:
                one["pass"] = number
            rows = (error.time >= one["from_s"]) & (error.time <= one["to_s"] + 1e-9) & np.isfinite(error.horizontal)
            growth.append((error.time[rows] - one["from_s"], error.horizontal[rows]))
        found += of_pass
    return JudgedOutages({"against": reference.name, **outage_numbers(found)}, tuple(growth))


def _reference(run: Run, prepared: Prepared) -> Reference | None:
    """Return what the outages are judged by."""
    from sinssim.logs.reference import Reference

    log, section = prepared.log, run.scenario.log
    assert section is not None
    if log.reference is not None or log.fixes is None or section.gnss is None:
        return log.reference
    f, arm = log.fixes, section.gnss.lever_arm_m
    return Reference("the withheld fixes", f.time, f.latitude, f.longitude, f.height, lever_arm=arm)


def _pass(run: Run, prepared: Prepared, spans: tuple[tuple[float, float], ...]) -> Estimate:
    """Run the filter once more, without the satellites of some spans."""
    from sinssim.estimation.from_scenario.recorded_run import aid_recorded
    from sinssim.logs.aiding import gnss_readings

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
    return aid_recorded(changed, run.compensated, first_of(run, prepared), history=settings.smooth)
