"""Reading errors of the inertial sensors that are the same in every run, from the emulator with one source alone.

They are the errors that no constant describes linearly: faults, a limited range, arms and delay of the accelerometers,
and the null shift of laser gyros. The emulated readings less the true increments drive the linear error equations.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sinssim.analyses.error_budget.inputs.sources import Source
from sinssim.data import Array, ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.errors import ImuErrors
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.terms import TERMS
from sinssim.sensors.sets.geometry import along
from sinssim.sensors.sets.sensor_set import Redundant

if TYPE_CHECKING:
    from sinssim.scenario import Scenario


def given_readings(scenario: Scenario, ideal: ImuData) -> tuple[list[Source], Array, Array]:
    """Return reading errors of one run, one series for each source.

    Args:
        ideal: true increments, N intervals.

    Returns:
        The sources, and their errors of the increments, (s, N, 3) rad and (s, N, 3) m/s.
    """
    from sinssim.sensors.imu.compensation import compensate
    from sinssim.sensors.imu.emulate import emulate

    block = scenario.imu.with_triads(TriadErrors(), TriadErrors())
    limits = {
        term.triad: TriadErrors(limit=float(scenario.imu.stated(term)[0])) for term in TERMS if term.field == "limit"
    }
    if isinstance(own := scenario.imu.sensor_set, Redundant):
        for (kind, limit), increments in zip(limits.items(), (ideal.dtheta, ideal.dvel), strict=True):
            largest = float(np.abs(along(increments, own.axes) / np.diff(ideal.time)[:, None]).max())
            if 0.0 < limit.limit < largest:
                raise InputError(
                    f"the {kind} range of a redundant set has no budget: single sensors reach it. Remove the range, or "
                    "use an ensemble."
                )
        return [], _stacked([], ideal), _stacked([], ideal)
    alone: list[tuple[str, str, str, ImuErrors]] = []
    if any(limit.limit for limit in limits.values()):
        alone.append(("range", "range of the sensors", "gyros", ImuErrors(limits["gyro"], limits["accel"])))
    if block.faults:
        alone.append(("faults", "faults", "gyros", ImuErrors(faults=block.faults)))
    if block.null_shift is not None:
        alone.append(
            ("null_shift", "null shift", "gyros", ImuErrors(null_shift=block.null_shift, warm_up=block.warm_up))
        )
    if scenario.compensation is None:  # which removes both
        if np.any(block.arms):
            alone.append(("accel_arms", "arms", "accelerometers", ImuErrors(arms=block.arms)))
        if block.delay:
            alone.append(("accel_delay", "delay", "accelerometers", ImuErrors(delay=block.delay)))
    sources, theta, velocity = [], [], []
    for name, label, group, errors in alone:
        read = emulate(ideal, errors, scenario.seed)
        if scenario.compensation is not None:
            read = compensate(read, ImuErrors())
        read = replace(read, time=ideal.time)
        error = read.dtheta - ideal.dtheta, read.dvel - ideal.dvel
        if not (error[0].any() or error[1].any()):
            continue
        sources.append(Source(name, label, group, "one run", float("nan"), ""))
        theta.append(error[0])
        velocity.append(error[1])
    return sources, _stacked(theta, ideal), _stacked(velocity, ideal)


def _stacked(series: list[Array], ideal: ImuData) -> Array:
    return np.array(series) if series else np.zeros((0, len(ideal), 3))
