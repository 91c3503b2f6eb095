"""The keys that a diagnosis names: errors of the aiding sensors and of the initial state, faults of a scenario."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sinssim import units
from sinssim.formatting import number_text
from sinssim.logs.files import other_units
from sinssim.sensors.aiding.registry import measurement_kind

if TYPE_CHECKING:
    from sinssim.estimation.explanation import Hypothesis
    from sinssim.scenario import Scenario

_UNITS: dict[str, tuple[str, float]] = {
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
    told = values[0] if len(values) == 1 else f"[{', '.join(values)}]"
    return f"{told}{unit}" if unit == "°" else f"{told} {unit}"


def wide(value: float) -> str:
    """Return a 1σ with which a filter takes an error in, three times as large, with two digits."""
    return short(3.0 * abs(value), 2)


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
            told = with_sigma(cause, units.PPM, "ppm")
            return (
                f"the {_words(error)} of {sensor} is {told}",
                f"{where}.scale_sigma_ppm = {wide(largest / units.PPM)}",
            )
        told = with_sigma(cause, size, "°" if unit == "deg" else unit)
        text = f'{{ value = {wide(largest / size)}, unit = "{unit}" }}'
        return f"the {_words(error)} of {sensor} is {told}", f"{where}.bias_sigma = {text}"
    key = _key(cause.name, scenario)
    if key.rpartition("_")[2] in _UNITS:
        unit, size = _UNITS[key.rpartition("_")[2]]
        told = with_sigma(cause, size, unit)
        return f"the {_words(error)} of {sensor} is {told}", f"{key} = {wide(largest / size)}"
    told = with_sigma(cause, 1.0, "in SI units")
    return f"the {_words(error)} of {sensor} is {told}", f'a state "{cause.name}" in the method states() of the sensor'


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
        told = ""
    else:
        told = f" of {with_sigma(cause, size, unit)}" + (f" ({axes})" if axes else "")
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
    return f"the {cause.name} has an error{told}, which is larger than the filter assumes", f"{given}{tried}"


def _given_start(name: str, scenario: Scenario) -> str:
    """Return what to look at first for a recorded start."""
    if scenario.log is None or name != "initial heading" or scenario.log.start.heading_deg is None:
        return ""
    return f"a value of log.start.heading_deg other than {number_text(scenario.log.start.heading_deg, 4)}, or "


def planted(scenario: Scenario, until: float) -> Iterator[str]:
    """Yield the keys of faults that a scenario plants before an instant, of which a filter knows nothing.

    Args:
        until: the instant, s.
    """
    gnss = None if scenario.aiding is None else getattr(scenario.aiding, "gnss", None)
    for key in ("jumps", "ramps"):
        begins = [fault.from_s for fault in getattr(gnss, key, ()) if fault.from_s < until]
        if begins:
            yield f"aiding.gnss.{key} from {min(begins):g} s on"
    instants = [fault.at_s if fault.type == "spike" else fault.from_s for fault in scenario.imu.faults]
    if instants and min(instants) < until:
        yield f"imu.faults from {min(instants):g} s on"
