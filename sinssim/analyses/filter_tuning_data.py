"""The data that a filter is tuned by, the filter with other values of its keys, and the keys that matter."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from sinssim import rotation
from sinssim.content import find_content
from sinssim.data import Array, Measurements
from sinssim.errors import InputError, RunError
from sinssim.estimation.filter_loop import followed
from sinssim.estimation.linear_replay import LinearPass, densities_of
from sinssim.estimation.state_model import ErrorModel
from sinssim.logs.log_files import recorded_errors
from sinssim.logs.recorded_log import gnss_readings
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import filter_model, with_states
from sinssim.scenario.filter_section import FilterSection
from sinssim.scenario.load import scenario_of_text
from sinssim.scenario.true_motion import fly
from sinssim.sensors.aiding.land_vehicle import LandVehicle, angles_of
from sinssim.sensors.aiding_sensor import AidingReadings
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.simulation.aided_run import aid_run, readings_along
from sinssim.simulation.guided_passes import is_guided
from sinssim.simulation.navigation_stage import first_state, recorded_start
from sinssim.simulation.recorded_filter_run import Prepared, aid_recorded, all_readings, prepare
from sinssim.simulation.truth_and_sensors import RecordedMotion, sense, sense_recorded, truth_along
from sinssim.system.files import read_text
from sinssim.truth.motion import attitude
from sinssim.units import DEG, listed

_MOST = (1e3, 100.0, 30.0, 10.0, 3.0, 1.1)
"""Largest noises over that to begin with, of which the first that is allowed holds."""


class Installed(NamedTuple):
    """A key that says how the sensors are installed: its error is a constant that the filter could have as a state."""

    block: str  # that state
    sigma: str  # key of its 1σ
    parts: tuple[int, ...]  # numbers of the values that are tuned; none for a single value
    unit: float  # step of the search, in the key's unit; a 95 % interval of ± 2.3 steps says nothing
    size: float  # size of the state for 1 in the key's unit


INSTALLED = {
    "log.gnss.lever_arm_m": Installed("gnss lever arm", "log.gnss.lever_arm_sigma_m", (1, 2, 3), 0.5, 1.0),
    "log.gnss.time_offset_s": Installed("gnss time offset", "log.gnss.time_offset_sigma_s", (), 0.05, -1.0),
    "log.gnss.velocity_delay_s": Installed("gnss-velocity delay", "log.gnss.velocity_delay_sigma_s", (), 0.05, 1.0),
    "aiding.land_vehicle.lever_arm_m": Installed(
        "land-vehicle lever arm", "aiding.land_vehicle.lever_arm_sigma_m", (1, 2, 3), 0.5, 1.0),
    "imu.mounting_deg": Installed("land-vehicle mounting", "aiding.land_vehicle.mounting_sigma_deg", (2, 3), 0.5, DEG),
}  # fmt: skip
"""The keys of the installation, which are found on recorded sensors. Of the mounting the constraint of a land vehicle
shows pitch and yaw."""

_NOTHING = 1e-9
"""1σ of a state that is known, in its key's unit."""


def installed_part(key: str) -> tuple[str, int]:
    """Return the key of the installation that a key or a numbered value of it belongs to, "" for none, and the number,
    0 for a single value."""
    whole, _, number = key.rpartition(".")
    if whole in INSTALLED and number.isdigit():
        return whole, int(number)
    return (key, 0) if key in INSTALLED else ("", 0)


_NOISES = ("random_walk", "instability", "rate_walk")
"""Fields of the inertial sensors whose keys are tuned by default, beside the 1σ of their biases."""


class TuningData:
    """The data of a scenario, and the filter with other values of its keys."""

    def __init__(self, name: str, settings: Sequence[str]) -> None:
        """Read the recording, or simulate the sensors."""
        self.name, self._settings = name, tuple(settings)
        self._file = find_content("scenarios", name)
        self._text = read_text(self._file)  # once, whatever becomes of the file
        self._states: list[str] = []  # settings of states that are known, whose errors are tuned
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
        wholes: dict[str, list[float]] = {}
        given = dict(values)
        for key in values:
            whole, number = installed_part(key)
            if number:
                wholes.setdefault(whole, list(installed_values(self.scenario, whole)))[number - 1] = given.pop(key)
        changed = [*self._settings, *self._states, *(f"{key}={value!r}" for key, value in {**given, **wholes}.items())]
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

    def open_state(self, key: str) -> None:
        """Give the filter the state of an error of the installation, with a σ of nothing."""
        of = INSTALLED[key]
        if self.prepared is None:
            raise InputError(
                f"{key} is tuned on recorded sensors; those of this scenario are simulated with its value."
            )
        if not key.startswith("log.") and (
            self.scenario.aiding is None or self.scenario.aiding.sensor(LandVehicle) is None
        ):
            raise InputError(f"{key} shows in the constraint of a land vehicle: add [aiding.land_vehicle].")
        if any(block.name == of.block for block in self.assumed({})[0].blocks):
            raise InputError(f"{key}: the filter estimates this error itself; remove {of.sigma} to tune it.")
        self._states.append(f"{of.sigma}={_NOTHING}")

    def limits(self, key: str, value: float) -> tuple[float, float]:
        """Return the limits of the error of an installed key from the value to begin with, in its steps."""
        ends = []
        for sign in (-1.0, 1.0):
            for steps in (60.0, 20.0, 6.0, 2.0, 0.5, 0.0):
                with suppress(InputError):
                    self.loaded({key: value + sign * steps * INSTALLED[installed_part(key)[0]].unit})
                    break
            ends.append(sign * steps)
        return ends[0], ends[1]

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
        recorded = () if self.prepared is None else recorded_errors(scenario.log)
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
        reread = ("log.", "imu.mounting_deg")
        if any(key.startswith(reread) and not key.startswith("log.gnss.") for key in values):
            return replace(prepare(self.loaded(values)), scenario=scenario)
        log, section, before = self.prepared.log, scenario.log, self.prepared.scenario.log
        if log.fixes is not None and section is not None and section.gnss is not None:
            assert before is not None
            assert before.gnss is not None
            later = log.fixes.time + (section.gnss.time_offset_s - before.gnss.time_offset_s)
            of_fixes = gnss_readings(replace(log.fixes, time=later), section.gnss, log.outages)
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
    """Return the keys with the values to begin with, those that matter without any; raise InputError for a key that is
    given twice, has no positive value to begin with, or is no noise of the filter."""
    if not keys:
        return dict(_default_keys(data))
    start: dict[str, float] = {}
    for text in keys:
        key, given, value = (part.strip() for part in text.partition("="))
        if key in start or key in {installed_part(of)[0] for of in start}:
            raise InputError(f"{key} is given twice; give each key once.")
        if key not in INSTALLED and (whole := installed_part(key)[0]):
            raise InputError(f"{key} is a value of {whole}, which is tuned as a whole: give --key {whole}.")
        if key in INSTALLED:
            start |= dict(
                _installed_start(data, key, _numbers(text, value) if given else installed_values(data.scenario, key))
            )
            continue
        (start[key],) = _numbers(text, value, 1) if given else (_value(data.scenario, key),)
        if not (math.isfinite(start[key]) and start[key] > 0.0):
            raise InputError(
                f"{key} = {start[key]:g}: a noise is found by its logarithm, and needs a positive value to begin with: "
                f"{key}=VALUE."
            )
        if not _matters(data, key, start[key]):
            raise InputError(
                f"{key} is no noise of the filter: its innovations do not depend on it. Beside noises, "
                f"{listed(list(INSTALLED))} can be tuned."
            )
    return start


def _installed_start(data: TuningData, key: str, values: Sequence[float]) -> Iterator[tuple[str, float]]:
    """Yield the values of a key of the installation to begin with, each with its numbered key."""
    of = INSTALLED[key]
    if len(values) != (3 if of.parts else 1):
        raise InputError(f"{key} begins with {len(values)} numbers; it has {3 if of.parts else 1}.")
    data.open_state(key)
    data.loaded({f"{key}.{k}": value for k, value in enumerate(values, 1)} if of.parts else {key: values[0]})
    yield from ((f"{key}.{k}", values[k - 1]) for k in of.parts)
    if not of.parts:
        yield key, values[0]


def installed_values(scenario: Scenario, key: str) -> tuple[float, ...]:
    """Return the values of a key of the installation."""
    here: Any = scenario
    for part in key.split("."):
        here = getattr(here, part, None)
    if here is None:
        if key == "imu.mounting_deg":
            return (0.0, 0.0, 0.0)
        raise InputError(f"{key} is no key of this scenario, which has no table [{key.rpartition('.')[0]}].")
    return tuple(here) if isinstance(here, tuple) else (float(here),)


def installed_errors(
    values: Mapping[str, float], before: Mapping[str, float], mounting: Sequence[float]
) -> dict[str, Array]:
    """Return by block the errors of the states for values of keys other than those of a pass; the block's mounting has
    a roll, too."""
    errors: dict[str, Array] = {}
    for key, value in values.items():
        whole, number = installed_part(key)
        if whole:
            of = INSTALLED[whole]
            error = errors.setdefault(of.block, np.zeros(max(len(of.parts), 1)))
            error[of.parts.index(number) if number else 0] = of.size * (value - before[key])
    if "land-vehicle mounting" in errors:
        there, here = (
            _ahead([mounting[0], *(of.get(f"imu.mounting_deg.{k}", mounting[k - 1]) for k in (2, 3))])
            for of in (values, before)
        )
        errors["land-vehicle mounting"] = there - here
    return errors


def _ahead(mounting_deg: Sequence[float]) -> Array:
    """Return pitch and yaw of the vehicle's forward axis in the block's axes, rad."""
    return np.array(angles_of(rotation.dcm_from_quaternion(attitude(*mounting_deg))[0]))


def _numbers(text: str, value: str, count: int = 0) -> tuple[float, ...]:
    """Return the number or the numbers of a text, of which there must be `count`, if not 0."""
    with suppress(ValueError, TypeError):
        read = json.loads(value)
        values = tuple(float(part) for part in (read if isinstance(read, list) else [read]))
        if not count or len(values) == count:
            return values
    raise InputError(f"{text}: the value to begin with must be a number.")


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
