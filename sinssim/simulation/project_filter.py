"""The filter of a project: a class `Filter` in a file of its folder `filters`, on the readings of a run.

It gets what a navigator in the vehicle gets: the increments in pieces, and between them the readings in the order of
their arrival, so that a late one comes with an earlier time of validity.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.errors import InputError, RunError
from sinssim.estimation import REGISTRY
from sinssim.scenario import Scenario
from sinssim.simulation.truth_and_sensors import RecordedMotion, Sensed
from sinssim.system.extensions import Item, explained
from sinssim.system.registries import load_entry, registered

_METHODS = ("predict", "update", "solution")
_SAME = 1e-9
"""An instant this close to a sample counts as on it, s."""


class FilterReading(NamedTuple):
    """A reading of an aiding sensor, as the filter of a project gets it."""

    sensor: str  # name of the sensor
    kind: str  # kind of measurement, see `sinssim.data.Measurements`
    time: float  # of validity, s
    value: Array  # (k,)
    sigma: Array  # 1σ of its errors
    lever_arm: Array  # from the block to the sensor, body axes, (3,) m


def filtered_by_project(scenario: Scenario, sensed: Sensed, start: NavState) -> tuple[NavSolution, Array | None]:
    """Return the solution of the filter of a project from a state, and the 1σ that it states, (K, 9), if it does. Raise
    InputError if the class lacks a method, RunError if one fails, or what it returns is no state."""
    assert scenario.filter is not None
    imu = sensed.imu
    calls = _Calls(scenario.filter.kind, start)
    readings = _arriving(scenario, sensed)
    stride = max(round(len(imu) / float(imu.time[-1] - imu.time[0]) / scenario.filter.rate_hz), 1)
    arrivals = np.searchsorted(imu.time, [arrival - _SAME for arrival, _ in readings])
    edges = np.union1d(np.arange(0, len(imu), stride), arrivals[arrivals <= len(imu)])
    edges = np.union1d(edges, [0, len(imu)]).tolist()
    states, sigmas, waiting, before = [], [], 0, 0
    for edge in edges:
        now = float(imu.time[edge])
        if edge > before:
            part = slice(before, edge)
            calls.predict(now, ImuData(imu.time[before : edge + 1], imu.dtheta[part], imu.dvel[part]))
        while waiting < len(readings) and readings[waiting][0] <= now + _SAME:
            calls.update(now, readings[waiting][1])
            waiting += 1
        state, sigma = calls.solution(now)
        states.append(state)
        sigmas.append(sigma)
        before = edge
    columns: dict[str, Any] = {name: np.array([getattr(state, name) for state in states]) for name in vars(start)}
    stated = [sigma for sigma in sigmas if sigma is not None]
    solution = NavSolution(imu.time[edges], **columns, defect=np.zeros(len(edges)), algorithm=scenario.filter.kind)
    return solution, np.array(stated) if len(stated) == len(edges) else None


def _arriving(scenario: Scenario, sensed: Sensed) -> list[tuple[float, FilterReading]]:
    """Return the readings with their arrivals, in that order."""
    from sinssim.simulation.aided_run import readings_along
    from sinssim.simulation.recorded_filter_run import all_readings

    assert scenario.filter is not None
    if isinstance(sensed.truth, RecordedMotion):
        of_all = all_readings(sensed.truth.prepared)
    else:
        of_all = readings_along(scenario, sensed.truth.trajectory, sensed.imu)
    factor, out = scenario.filter.measurement_noise_factor, []
    for m in (of.measurements for of in of_all):
        arm = np.asarray(m.lever_arm)
        rows = zip(m.arrival.tolist(), m.time.tolist(), m.value, factor * m.sigma, strict=True)
        out += [(arrival, FilterReading(m.label, m.kind, time, z, sigma, arm)) for arrival, time, z, sigma in rows]
    return sorted(out, key=lambda of: of[0])


class _Calls:
    """The methods of a filter, whose failures name its file."""

    def __init__(self, kind: str, start: NavState) -> None:
        item = registered("filters", kind)
        assert isinstance(item, Item)  # the scenario has been checked
        of_file = load_entry(REGISTRY, kind, "", ("Filter",)).Filter
        if missing := [name for name in _METHODS if not callable(getattr(of_file, name, None))]:
            raise InputError(f"the {item.words} cannot be used: {item.file}: the class Filter has no {missing[0]}().")
        self._item, self._filter = item, explained(item, of_file, RunError)(start)

    def predict(self, now: float, increments: ImuData) -> None:
        """Let it predict over some samples that end now."""
        self._call(now, "predict", increments)

    def update(self, now: float, reading: FilterReading) -> None:
        """Let it take a reading that has arrived."""
        self._call(now, "update", reading)

    def solution(self, now: float) -> tuple[NavState, Array | None]:
        """Return its state, and 1σ if it has any."""
        state = self._call(now, "solution")
        wrong = f"the {self._item.words}: solution() at {now:.6g} s"
        if not isinstance(state, NavState):
            raise RunError(f"{wrong} returns a {type(state).__name__} instead of a sinssim.NavState.", time=now)
        for name, value in vars(state).items():
            if not np.all(np.isfinite(value)):
                raise RunError(f"{wrong} has {name} = {np.asarray(value).tolist()}.", time=now)
        sigma = getattr(self._filter, "sigma", None)
        if sigma is None:
            return state, None
        sigma = np.asarray(sigma, dtype=np.float64)
        if sigma.shape != (9,) or not np.all(np.isfinite(sigma) & (sigma >= 0.0)):
            raise RunError(
                f"the {self._item.words}: sigma at {now:.6g} s is {sigma.tolist()}; it is nine standard deviations, of "
                "position, velocity and attitude.", time=now,
            )  # fmt: skip
        return state, sigma

    def _call(self, now: float, name: str, *arguments: object) -> Any:
        try:
            return explained(self._item, getattr(self._filter, name), RunError)(*arguments)
        except RunError as error:
            raise RunError(f"{name}() at {now:.6g} s: {error}", time=now) from error
