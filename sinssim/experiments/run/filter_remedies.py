"""The causes of a filter's innovations in words, and the keys of a scenario that remove each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from sinssim import units
from sinssim.formatting import listed, number_text
from sinssim.logs.log_files import other_units
from sinssim.sensors.aiding_registry import measurement_kind

if TYPE_CHECKING:
    from sinssim.estimation.filter_result import Hypothesis
    from sinssim.scenario import Scenario

_KEY_UNITS: dict[str, tuple[str, float]] = {
    "m": ("m", 1.0), "mps": ("m/s", 1.0), "ppm": ("ppm", units.PPM), "deg": ("°", units.DEG),
    "arcmin": ("arcmin", units.ARCMIN), "arcsec": ("arcsec", units.ARCSEC),
}  # fmt: skip
"""Display unit and its size, by the unit in a key's name."""

_RECORDED: dict[str, tuple[str, float]] = {"m": ("m", 1.0), "rad": ("deg", units.DEG), "mps": ("m/s", 1.0)}
"""Unit of the keys of a recorded sensor, and its size, by the unit of its kind of measurement."""

_OF_START: dict[str, tuple[str, str, float, str]] = {
    "initial position": ("position", "m", 1.0, "north, east, down"),
    "initial velocity": ("velocity", "m/s", 1.0, "north, east, down"),
    "initial tilt": ("tilt", "°", units.DEG, "about north, about east"),
    "initial heading": ("heading", "°", units.DEG, ""),
}
"""What it is, display unit and its size, and axes of an error of the initial state."""

_SENSOR_UNITS = {
    "bias": {"gyro": ("°/h", units.DEG_H), "accelerometer": ("mg", 1e3 * units.UG)},
    "scale": {"gyro": ("ppm", units.PPM), "accelerometer": ("ppm", units.PPM)},
    "misalignment": {"gyro": ("arcmin", units.ARCMIN), "accelerometer": ("arcmin", units.ARCMIN)},
}
"""Display units of the errors of the inertial sensors."""

_WALKS = {
    "gyro": ("imu.gyro_rrw_deg_h_sqrt_h", "°/h/√h", units.DEG_H / 60.0),
    "accelerometer": ("imu.accel_rrw_ug_sqrt_h", "µg/√h", units.UG / 60.0),
}
"""Key, display unit and its size of the random walk of a bias."""

_SATELLITES = ("gnss lever arm", "gnss time offset", "gnss-velocity delay")


def short(value: float, digits: int = 3) -> str:
    """Return a number as TOML takes it, with few digits."""
    return f"{float(f'{value:.{digits}g}'):g}"


def with_sigma(cause: Hypothesis, size: float, unit: str) -> str:
    """Return the estimates of a hypothesis with their σ, in a display unit.

    Args:
        size: of the unit, SI.
    """
    values = [
        f"{short(value / size)} ± {short(sigma / size, 2)}"
        for value, sigma in zip(cause.value, cause.sigma, strict=True)
    ]
    text = values[0] if len(values) == 1 else f"[{', '.join(values)}]"
    return f"{text}{unit}" if unit == "°" else f"{text} {unit}"


def wide(value: float) -> str:
    """Return a 1σ with which a filter takes an error in, three times as large, with two digits."""
    return short(3.0 * abs(value), 2)


def cause_and_remedy(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return a cause in words, and what to try."""
    section = scenario.filter
    assert section is not None
    if cause.kind == "measurement noise":
        return _noise_of_readings(cause, scenario)
    if cause.kind == "inertial noise":
        factor, noise_factor = number_text(cause.value[0], 3), section.inertial_noise_factor * cause.value[0]
        return (
            f"the noise of gyros and accelerometers is {factor} times the assumed noise",
            f"filter.inertial_noise_factor = {short(noise_factor)}, or for vibration filter.vibration_noise = 0.4",
        )
    if cause.kind == "bias walk" and cause.name not in _WALKS:
        return sensor_walk(cause, scenario)
    if cause.kind == "bias walk":
        key, unit, size = _WALKS[cause.name]
        walk = f"{short(cause.value[0] / size)}"
        return f"the biases of the {cause.name}s have a random walk of {walk} {unit}", f"{key} = {walk}"
    if cause.kind == "initial state":
        return initial_state(cause, scenario)
    if cause.name in _SATELLITES:
        return _of_satellites(cause, scenario)
    triad, _, error = cause.name.partition(" ")
    if triad not in _WALKS:
        return sensor_error(cause, scenario)
    unit, size = _SENSOR_UNITS[error][triad]
    what = f"the {error} of the {triad}s is {with_sigma(cause, size, unit)}"
    if cause.name in (section.states or ()):
        return (
            f"{what}, which is much larger than the filter assumes",
            "a grade or keys of [imu] with a larger 1σ of this error",
        )
    states = ", ".join(f'"{name}"' for name in (*(section.states or ()), cause.name))
    return f"{what}; it is not a state of the filter", f"filter.states = [{states}]"


def sensor_error(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return an error of an aiding sensor in words, and the keys that make it a state.

    Args:
        cause: a hypothesis on a block of the sensor.
    """
    sensor, error = _parts(cause.name)
    largest = max(cause.value, key=abs)
    others = [] if scenario.log is None else list(scenario.log.others)
    for number, other in enumerate(others, start=1):
        if other.name != sensor:
            continue
        where, (unit, size) = f"log.others.{number}", _RECORDED[measurement_kind(other.kind).unit]
        if error == "scale":
            estimate = with_sigma(cause, units.PPM, "ppm")
            return (
                f"the {_words(error)} of {sensor} is {estimate}",
                f"{where}.scale_sigma_ppm = {wide(largest / units.PPM)}",
            )
        estimate = with_sigma(cause, size, "°" if unit == "deg" else unit)
        text = f'{{ value = {wide(largest / size)}, unit = "{unit}" }}'
        return f"the {_words(error)} of {sensor} is {estimate}", f"{where}.bias_sigma = {text}"
    key = _key(cause.name, scenario)
    if key.rpartition("_")[2] in _KEY_UNITS:
        unit, size = _KEY_UNITS[key.rpartition("_")[2]]
        estimate = with_sigma(cause, size, unit)
        return f"the {_words(error)} of {sensor} is {estimate}", f"{key} = {wide(largest / size)}"
    estimate = with_sigma(cause, 1.0, "in SI units")
    return (
        f"the {_words(error)} of {sensor} is {estimate}",
        f'a state "{cause.name}" in the method states() of the sensor',
    )


def _key(block: str, scenario: Scenario) -> str:
    """Return the key of [aiding] with the 1σ of a sensor's error, "" if there is none."""
    sensors = {} if scenario.aiding is None else scenario.aiding.sensors()
    keys = (
        f"aiding.{table}.{state.key}"
        for table, sensor in sensors.items()
        for state in sensor.states()
        if state.key and state.block == block
    )
    return next(keys, "")


def sensor_walk(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return a random walk of an aiding sensor's error in words, and the keys that describe it.

    A Gauss-Markov process of 1σ s and correlation time τ begins as a random walk of the density q = s √(2/τ).

    Args:
        cause: a hypothesis on the walk of its bias.
    """
    sensor, density = cause.name, cause.value[0]
    others = [] if scenario.log is None else list(scenario.log.others)
    for number, other in enumerate(others, start=1):
        if other.name == sensor and other.bias_sigma is not None:
            unit, size = _RECORDED[measurement_kind(other.kind).unit]
            sigma = (other.bias_sigma.value or 0.0) * other_units(other)[other.bias_sigma.unit]
            tau = 2.0 * (sigma / density) ** 2
            what = f"the error of {sensor} has a random walk of {short(density / size)} {unit}/√s"
            return what, f"log.others.{number}.bias_correlation_time_s = {short(tau, 2)}"
    return f"the error of {sensor} has a random walk", f"a correlation time of the state {sensor} bias"


def _parts(name: str) -> tuple[str, str]:
    """Return the sensor and the error of a block, "lever arm" included."""
    for error in ("lever arm", "time offset"):
        if name.endswith(f" {error}"):
            return name.removesuffix(f" {error}"), error
    sensor, _, error = name.rpartition(" ")
    return sensor, error


def _words(error: str) -> str:
    return {"bias": "constant error", "scale": "scale factor error", "wind": "wind (north, east)"}.get(error, error)


def initial_state(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return an error of the initial state in words, and the keys that let the filter take it in.

    Args:
        cause: a hypothesis on the initial state, with its size.
    """
    what, unit, size, axes = _OF_START[cause.name]
    if not cause.value:
        amount = ""
    else:
        amount = f" of {with_sigma(cause, size, unit)}" + (f" ({axes})" if axes else "")
    keys = []
    shown = cause.value or (0.0,)
    if what == "position":
        sides = [("position_m", max(map(abs, shown[:2]))), ("height_m", abs(shown[-1]))]
    elif what == "velocity":
        sides = [("velocity_mps", max(map(abs, shown)))]
    else:
        sides = [(f"{what}_arcmin", max(map(abs, shown)) / units.ARCMIN)]
    keys = [f"filter.initial_sigma.{key} = {wide(value)}" for key, value in sides if value > 0.0]
    given = _given_start(cause.name, scenario)
    tried = " and ".join(keys) or "larger keys of filter.initial_sigma"
    return f"the {cause.name} has an error{amount}, which is larger than the filter assumes", f"{given}{tried}"


def _given_start(name: str, scenario: Scenario) -> str:
    """Return what to look at first for a recorded start."""
    if scenario.log is None or name != "initial heading" or scenario.log.start.heading_deg is None:
        return ""
    return f"a value of log.start.heading_deg other than {number_text(scenario.log.start.heading_deg, 4)}, or "


def _sure(cause: Hypothesis) -> tuple[float, ...]:
    """Return the estimates, zero where the readings do not show one: within its ±3σ, if another lies outside."""
    outside = [abs(value) > 3.0 * sigma for value, sigma in zip(cause.value, cause.sigma, strict=True)]
    if not any(outside):
        return cause.value
    return tuple(value if shown else 0.0 for value, shown in zip(cause.value, outside, strict=True))


def _of_satellites(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return an error of the installation of the GNSS receiver in words, and its keys."""
    log = None if scenario.log is None else scenario.log.gnss
    where = "aiding.gnss" if log is None else "log.gnss"
    sure = _sure(cause)
    wide = f"{max(3.0 * abs(v) for v in sure):.2g}"
    match cause.name:
        case "gnss lever arm":
            what = f"the lever arm of the antenna has an error of {with_sigma(cause, 1.0, 'm')} (forward, right, down)"
            key, state = "lever_arm_m", f"{where}.lever_arm_sigma_m = {wide}"
            values = None if log is None else [a + b for a, b in zip(log.lever_arm_m, sure, strict=True)]
        case "gnss time offset":
            late = cause.value[0]
            side, size = ("late", 1.0) if late > 0.0 else ("early", -1.0)
            shown = replace(cause, value=(size * late,))
            what = f"the time stamps of the fixes are too {side} by {with_sigma(shown, 1.0, 's')}"
            key, state = "time_offset_s", f"{where}.time_offset_sigma_s = {wide}"
            values = None if log is None else [log.time_offset_s - late]
        case _:
            what = f"the GNSS velocities are older than their time stamps by {with_sigma(cause, 1.0, 's')}"
            key, state = "velocity_delay_s", f"{where}.velocity_delay_sigma_s = {wide}"
            values = None if log is None else [log.velocity_delay_s + cause.value[0]]
    if values is None or (key == "velocity_delay_s" and values[0] < 0.0):
        return what, f"{state}, with which the filter estimates it"
    text = f"{short(values[0])}" if len(values) == 1 else "[" + ", ".join(f"{short(value)}" for value in values) + "]"
    return what, f"{where}.{key} = {text}, or {state}, with which the filter estimates it"


def _noise_of_readings(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return wrong σ of readings in words, and the keys."""
    sensors = cause.name.split(", ")
    spread = cause.sigma or (0.0,) * len(cause.value)
    factors = listed(
        [
            number_text(factor, 3) + (f" ± {number_text(sigma, 2)}" if sigma else "")
            for factor, sigma in zip(cause.value, spread, strict=True)
        ]
    )
    many = len(sensors) > 1
    what = f"the σ of {listed(sensors)} {'are' if many else 'is'} {factors} times the assumed value{'s' * many}"
    return what, " and ".join(_keys_of_noise(sensors, cause.value, scenario))


def _keys_of_noise(sensors: Sequence[str], factors: Sequence[float], scenario: Scenario) -> list[str]:
    log = scenario.log
    gnss = None if log is None else log.gnss
    numbers = {} if log is None else {other.name: number for number, other in enumerate(log.others, start=1)}
    keys: dict[str, str] = {}
    others = []
    for sensor, factor in zip(sensors, factors, strict=True):
        if gnss is not None and sensor == "gnss-position":
            keys["log.gnss.sigma_factor"] = short(gnss.sigma_factor * factor)
        elif gnss is not None and sensor == "gnss-velocity":
            keys["log.gnss.velocity_sigma_factor"] = short(gnss.velocity_sigma_factor * factor)
        elif log is not None and sensor in numbers:
            sigma = log.others[numbers[sensor] - 1].sigma
            size = "" if sigma.value is None else f'{{ value = {short(sigma.value * factor)}, unit = "{sigma.unit}" }}'
            keys[f"log.others.{numbers[sensor]}.sigma"] = size or f"{short(factor)} times the present value"
        else:
            others.append(factor)
    if others and scenario.filter is not None:
        mean = math.exp(sum(map(math.log, others)) / len(others))
        keys["filter.measurement_noise_factor"] = short(scenario.filter.measurement_noise_factor * mean)
    return [f"{key} = {value}" for key, value in keys.items()]
