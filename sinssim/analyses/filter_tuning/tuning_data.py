"""The data that a filter is tuned by, the filter with other values of its keys, and the keys that matter."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.content import find_content
from sinssim.data import Measurements
from sinssim.errors import InputError, RunError
from sinssim.estimation.filter_loop import followed
from sinssim.estimation.linear_replay import LinearPass, densities_of
from sinssim.estimation.state_model import ErrorModel
from sinssim.logs.recorded_log import gnss_readings
from sinssim.scenario.filter_model import filter_model, with_states
from sinssim.scenario.load import scenario_of_text
from sinssim.scenario.recorded_sensors import recorded_sensors
from sinssim.scenario.true_motion import fly
from sinssim.sensors.aiding_sensor import AidingReadings
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.simulation.aided_run import aid_run, readings_along
from sinssim.simulation.closed_loop import is_guided
from sinssim.simulation.navigation_stage import first_state, recorded_start
from sinssim.simulation.recorded_filter_run import Prepared, aid_recorded, all_readings, prepare
from sinssim.simulation.truth_and_sensors import RecordedMotion, sense, sense_recorded, truth_along
from sinssim.system.files import read_text

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.scenario.filter_section import FilterSection

_MOST = (1e3, 100.0, 30.0, 10.0, 3.0, 1.1)
"""Largest noises over that to begin with, of which the first that is allowed holds."""

_NOISES = ("random_walk", "instability", "rate_walk")
"""Fields of the inertial sensors whose keys are tuned by default, beside the 1σ of their biases."""


class TuningData:
    """The data of a scenario, and the filter with other values of its keys."""

    def __init__(self, name: str, settings: Sequence[str]) -> None:
        """Read the recording, or simulate the sensors."""
        self.name, self._settings = name, tuple(settings)
        self._file = find_content("scenarios", name)
        self._text = read_text(self._file)  # once, whatever becomes of the file
        self._known: deque[tuple[Mapping[str, float], dict[str, Measurements]]] = deque(maxlen=8)
        scenario = self.loaded({})
        if scenario.filter is None:
            raise InputError(f"{name} has no [filter] to tune: add [filter] and an aiding sensor.")
        self.prepared: Prepared | None = None
        if scenario.log is not None:
            self.prepared = prepare(scenario)
            self.scenario = _plain(self.prepared.scenario)
            return
        if is_guided(scenario):
            raise InputError(
                f"{name}: a flight that follows its own filter is another flight with each tuning; remove "
                "[flight.guidance], or tune a recording of it."
            )
        self.scenario = _plain(with_states(scenario))
        self._truth = truth_along(fly(self.scenario), self.scenario)
        self._sensed = sense(self.scenario, self._truth)
        self._aiding = readings_along(self.scenario, self._truth.trajectory, self._sensed.imu)

    def loaded(self, values: Mapping[str, float]) -> Scenario:
        """Return the scenario of the file with values of keys."""
        changed = [*self._settings, *(f"{key}={value!r}" for key, value in values.items())]
        return scenario_of_text(self._text, self._file.parent, changed, source=self.name, name=self._file.stem)

    def with_values(self, values: Mapping[str, float]) -> Scenario:
        """Return the scenario with values of keys; the states of the filter, the start and the data stay."""
        there, first = self.loaded(values), filter_of(self.scenario)
        update: dict[str, Any] = {"states": first.states}
        if self.prepared is not None:
            given = filter_of(there).initial_sigma.model_dump(exclude_none=True)
            update["initial_sigma"] = first.initial_sigma.model_copy(update=given)
        imu = there.imu.model_copy(update={"rate_hz": self.scenario.imu.rate_hz})
        of_filter = filter_of(there).model_copy(update=update)
        return _plain(there.model_copy(update={"imu": imu, "filter": of_filter}))

    def most(self, key: str, value: float) -> float:
        """Return the logarithm of the largest value of a key that is tried, over the value to begin with."""
        for factor in _MOST:
            with suppress(InputError):
                self.loaded({key: factor * value})
                return math.log(factor)
        return 0.0

    def run(self, values: Mapping[str, float]) -> LinearPass:
        """Run the filter; raise RunError if it diverges."""
        scenario, of_pass = self.with_values(values), LinearPass()
        with followed(of_pass):
            if self.prepared is not None:
                prepared = self._prepared(scenario, values)
                sensed = sense_recorded(scenario, RecordedMotion(prepared, None))
                estimate = aid_recorded(prepared, sensed.imu, recorded_start(scenario, sensed), history=False)
            else:
                sigma = {of.measurements.label: of.measurements.sigma for of in self._readings(scenario, values)}
                aiding = tuple(
                    replace(of, measurements=replace(of.measurements, sigma=sigma[of.measurements.label]))
                    for of in self._aiding
                )
                assert self._sensed.errors is not None  # those of simulated sensors are known
                estimate = aid_run(
                    scenario, self._truth.trajectory, self._sensed.imu, first_state(scenario, self._truth),
                    self._sensed.errors, aiding=aiding, monitored=self._sensed.readings.monitored, history=False,
                ).estimate  # fmt: skip
        if (end := estimate.divergence) is not None:
            raise RunError(
                f"the filter diverges at {end.time:.2f} s ({end.reason}): correct the data or the start before the "
                "noises are tuned (sinssim inspect, filter.diagnose)."
            )
        return of_pass

    def assumed(self, values: Mapping[str, float]) -> tuple[ErrorModel, dict[str, Measurements]]:
        """Return the error model, and by name the readings as the filter assumes them, if that depends on the keys."""
        scenario = self.with_values(values)
        imu = self._sensed.imu if self.prepared is None else self.prepared.log.imu
        recorded = () if self.prepared is None else recorded_sensors(scenario)
        model = filter_model(scenario, float(imu.time[-1] - imu.time[0]), recorded)
        of_readings = {k: v for k, v in values.items() if k.startswith(("log.", "aiding.", "filter.measurement"))}
        if not of_readings:
            return model, {}
        if of_readings not in (there for there, _ in self._known):  # the sets of a step differ in one key
            factor = filter_of(scenario).measurement_noise_factor
            measurements = (of.measurements for of in self._readings(scenario, values))
            self._known.append((of_readings, {m.label: replace(m, sigma=factor * m.sigma) for m in measurements}))
        return model, next(readings for there, readings in self._known if there == of_readings)

    def _readings(self, scenario: Scenario, values: Mapping[str, float]) -> Sequence[AidingReadings]:
        if self.prepared is not None:
            return all_readings(self._prepared(scenario, values))
        if not any(key.startswith("aiding.") for key in values):
            return self._aiding
        return readings_along(scenario, self._truth.trajectory, self._sensed.imu)

    def _prepared(self, scenario: Scenario, values: Mapping[str, float]) -> Prepared:
        """Return the recording with values of keys; its files are read again for those of [log] without [log.gnss]."""
        assert self.prepared is not None
        if any(key.startswith("log.") and not key.startswith("log.gnss.") for key in values):
            return replace(prepare(self.loaded(values)), scenario=scenario)
        log, section = self.prepared.log, scenario.log
        if log.fixes is not None and section is not None and section.gnss is not None:
            of_fixes = gnss_readings(log.fixes, section.gnss, log.outages)
            labels = {readings.measurements.label for readings in of_fixes}
            others = (readings for readings in log.sensed if readings.measurements.label not in labels)
            log = replace(log, sensed=(*of_fixes, *others))
        return replace(self.prepared, scenario=scenario, log=log)


def filter_of(scenario: Scenario) -> FilterSection:
    """Return the filter of a scenario that has one."""
    assert scenario.filter is not None
    return scenario.filter


def _plain(scenario: Scenario) -> Scenario:
    """Return the scenario of a pass for its innovations alone: forwards, to first order, without a gate."""
    update = {
        "kind": "error-state", "smooth": False, "backward": False, "diagnose": False, "gate": 0.0, "monitor_s": 0.0,
    }  # fmt: skip
    return scenario.model_copy(update={"filter": filter_of(scenario).model_copy(update=update), "filters": ()})


def starts_of(data: TuningData, keys: Sequence[str]) -> dict[str, float]:
    """Return the keys with the values to begin with; those that matter without any.

    Raises:
        InputError: a key is given twice, has no positive value to begin with, or is no noise of the filter.
    """
    if not keys:
        return dict(_default_keys(data))
    start: dict[str, float] = {}
    for text in keys:
        key, given, value = (part.strip() for part in text.partition("="))
        if key in start:
            raise InputError(f"{key} is given twice; give each key once.")
        start[key] = _number(text, value) if given else _value(data.scenario, key)
        if not (math.isfinite(start[key]) and start[key] > 0.0):
            raise InputError(
                f"{key} = {start[key]:g}: a noise is found by its logarithm, and needs a positive value to begin with: "
                f"{key}=VALUE."
            )
        if not _matters(data, key, start[key]):
            raise InputError(f"{key} is no noise of the filter: its innovations do not depend on it.")
    return start


def _number(text: str, value: str) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise InputError(f"{text}: the value to begin with must be a number.") from error


def _matters(data: TuningData, key: str, value: float) -> bool:
    (model, readings), (other, louder) = (data.assumed({key: factor * value}) for factor in (1.0, 0.99))
    return not (
        np.array_equal(model.sigma, other.sigma)
        and np.array_equal(densities_of(model), densities_of(other))
        and all(np.array_equal(readings[name].sigma, louder[name].sigma) for name in readings)
    )


def _default_keys(data: TuningData) -> Iterator[tuple[str, float]]:
    """Yield the keys that matter, with their values."""
    scenario, log = data.scenario, data.scenario.log
    if log is None or data.prepared is None:
        for name in ("inertial_noise_factor", "measurement_noise_factor"):
            yield f"filter.{name}", getattr(filter_of(scenario), name)
        return
    keys = []
    for term in TERMS:
        mean, sigma = scenario.imu.stated(term)
        if term.field in _NOISES and float(np.max(mean)) > 0.0:
            keys.append(_written(data, term, ""))
        block = f"{term.triad.replace('accel', 'accelerometer')} bias"
        if term.field == "bias" and float(np.max(sigma)) > 0.0 and block in (filter_of(scenario).states or ()):
            keys.append(_written(data, term, "sigma_"))
    kinds = {of.measurements.label for of in data.prepared.log.sensed}
    keys += ["log.gnss.sigma_factor"] * ("gnss-position" in kinds)
    keys += ["log.gnss.velocity_sigma_factor"] * ("gnss-velocity" in kinds)
    keys += [f"log.others.{k}.sigma.value" for k, of in enumerate(log.others, 1) if of.sigma.value is not None]
    for name, sensor in (scenario.aiding.sensors() if scenario.aiding is not None else {}).items():
        states = {state.key for state in sensor.states()}
        for key in type(sensor).model_fields:
            value = getattr(sensor, key)
            if "sigma" in key and key not in states and isinstance(value, float) and value > 0.0:
                keys.append(f"aiding.{name}.{key}")
    for key in keys:
        if _matters(data, key, value := _value(scenario, key)):
            yield key, value


def _written(data: TuningData, term: ErrorTerm, of: str) -> str:
    """Return the key of an error term, or of its 1σ, in the unit that the file has."""
    keys = [f"imu.{term.name}_{of}{unit}" for unit in term.units]
    for key in keys:
        with suppress(InputError):  # the file has another unit
            data.loaded({key: 1.0})
            return key
    return keys[0]


def _value(scenario: Scenario, key: str) -> float:
    """Return the value of a key: what the scenario gives, or of [imu] what its grade has."""
    table, _, name = key.partition(".")
    for term in TERMS if table == "imu" else ():
        for unit, size in term.units.items():
            if name in (f"{term.name}_{unit}", f"{term.name}_sigma_{unit}"):
                mean, sigma = scenario.imu.stated(term)
                return float(np.max(np.abs(sigma if "_sigma_" in name else mean))) / size
    here: Any = scenario
    for part in key.split("."):
        if isinstance(here, tuple | list):
            here = here[int(part) - 1] if part.isdigit() and 0 < int(part) <= len(here) else None
        else:
            here = getattr(here, part, None)
    if not isinstance(here, int | float) or isinstance(here, bool):
        raise InputError(f"{key} has no number to begin with in this scenario: give {key}=VALUE.")
    return float(here)
