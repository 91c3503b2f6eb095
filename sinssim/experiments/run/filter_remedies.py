"""The diagnosis of a filter, in summary.json and in the report."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from sinssim import units
from sinssim.estimation import Estimate
from sinssim.estimation.consistency import FALSE_ALARM, consistency
from sinssim.estimation.filter_diagnosis import refusals, size_of_innovations
from sinssim.estimation.filter_result import Diagnosis, Hypothesis, Refusals
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.experiments.run.summary_types import DiagnosisNumbers, HypothesisNumbers, RefusedSpan
from sinssim.logs.log_files import other_units
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.units import listed, number_text

if TYPE_CHECKING:
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
    """Return the estimates of a hypothesis with their σ, in a display unit of a size in SI."""
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
    """Return an error of an aiding sensor in words, and the keys that make it a state."""
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
    """Return an error of the initial state in words, and the keys that let the filter take it in."""
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


def planted(scenario: Scenario, until: float) -> Iterator[str]:
    """Yield the keys of faults that a scenario plants before an instant, s, and of which a filter knows nothing."""
    gnss = None if scenario.aiding is None else getattr(scenario.aiding, "gnss", None)
    for key in ("jumps", "ramps"):
        begins = [fault.from_s for fault in getattr(gnss, key, ()) if fault.from_s < until]
        if begins:
            yield f"aiding.gnss.{key} from {min(begins):g} s on"
    instants = [fault.at_s if fault.type == "spike" else fault.from_s for fault in scenario.imu.faults]
    if instants and min(instants) < until:
        yield f"imu.faults from {min(instants):g} s on"


_DISPLAYED = {"mps": ("m/s", 1.0), "rad": ("°", units.DEG), "radps": ("°/s", units.DEG)}
_AXES = {"n": "north", "e": "east", "d": "down"}
"""Display units and axes of innovations."""

_SHOWN = 3
"""Most spans of refused readings of one sensor that are told in words; summary.json has all."""


_MORE = (
    "Set filter.diagnose = true to search for the cause (a lever arm, a delay, an initial error, a sensor error, or "
    "wrong noise)."
)


def diagnosis_numbers(estimate: Estimate, scenario: Scenario) -> DiagnosisNumbers | None:
    """Return the entry of `summary.json`, None for a filter without a diagnosis."""
    diagnosis = estimate.diagnosis
    if diagnosis is None:
        return _without_hypotheses(estimate)
    factors = {h.name: h.value[0] for h in diagnosis.hypotheses if h.kind == "measurement noise" and len(h.value) == 1}
    return {
        "until_s": diagnosis.until,
        "runs": diagnosis.runs,
        "seconds": round(diagnosis.seconds, 1),
        "false_alarm": FALSE_ALARM,
        "refused": [_span(span) for span in diagnosis.refusals],
        "sensors": {
            name: {"innovations_larger_by": None if math.isnan(size) else size, "sigma_factor": factors.get(name)}
            for name, size in diagnosis.sizes.items()
        },
        "cause": None if diagnosis.cause is None else diagnosis.cause.name,
        "hypotheses": [
            {"name": h.name, "kind": h.kind, "value": list(h.value), "sigma": list(h.sigma), "gain": h.gain,
             "needed": h.needed}
            for h in diagnosis.hypotheses if math.isfinite(h.gain)
        ],
        "what_to_try": [
            *_refused(list(diagnosis.sizes), diagnosis.refusals, _kinds(estimate)),
            *_explained(diagnosis, factors, scenario),
            *_cost(diagnosis),
        ],
    }  # fmt: skip


def _cost(diagnosis: Diagnosis) -> Iterator[str]:
    """Tell what the search took."""
    if diagnosis.runs:
        yield (
            f"The search took {diagnosis.runs} runs of the filter over the data until {round(diagnosis.until, 1):g} s, "
            f"{number_text(diagnosis.seconds, 2)} s in all."
        )


def _without_hypotheses(estimate: Estimate) -> DiagnosisNumbers | None:
    """Return what the innovations say without further runs, None for consistent ones."""
    judged = consistency(estimate)
    if judged.consistent or estimate.history is None:
        return None
    spans = [span for sensor in estimate.innovations for span in refusals(sensor)]
    sizes = {sensor.sensor: size_of_innovations(sensor) for sensor in estimate.innovations}
    larger = [
        f"The median of the innovations of {s.sensor} is {number_text(sizes[s.sensor], 3)} times the assumed one."
        for s in judged.sensors
        if s.verdict == "optimistic" and sizes[s.sensor] > 1.0
    ]
    return {
        "refused": [_span(span) for span in spans],
        "sensors": {name: {"innovations_larger_by": None if math.isnan(v) else v} for name, v in sizes.items()},
        "what_to_try": [*_refused(list(sizes), spans, _kinds(estimate)), *larger, _MORE],
    }


def _kinds(estimate: Estimate) -> dict[str, str]:
    return {innovation.sensor: innovation.kind for innovation in estimate.innovations}


def _span(r: Refusals) -> RefusedSpan:
    return {"sensor": r.sensor, "from_s": r.start, "to_s": r.end, "count": r.count}


def _refused(sensors: Sequence[str], refused: Sequence[Refusals], kinds: Mapping[str, str]) -> Iterator[str]:
    """Tell when which sensor was refused, and if it is the only one, by how much its readings were off on average."""
    alone = len({r.sensor for r in refused}) == 1
    for sensor in sensors:
        spans = sorted((r for r in refused if r.sensor == sensor), key=lambda r: -r.count)
        if spans:
            shown = sorted(spans[:_SHOWN], key=lambda r: r.start)
            times = ", ".join(f"{r.start:g} … {r.end:g} s ({r.count})" for r in shown)
            rest = len(spans) - _SHOWN
            more = f", and {rest} shorter span{'s' * (rest > 1)}" if rest > 0 else ""
            off = _off(spans[0], kinds.get(sensor, "")) if alone else ""
            yield f"The gate rejected consecutive measurements of {sensor}: {times}{more}.{off}"


def _off(longest: Refusals, kind: str) -> str:
    """Return by how much the readings of the longest span were off."""
    if not longest.mean or not kind:
        return ""
    known = measurement_kind(kind)
    unit, size = _DISPLAYED.get(known.unit, (known.unit, 1.0))
    axes = [_AXES.get(axis, axis) for axis in known.axes]
    parts = [
        f"{number_text(value / size, 3)} {unit}{f' {axis}' if axis else ''}"
        for value, axis in zip(longest.mean, axes, strict=True)
    ]
    single = longest.count == 1
    differs = (
        "The measurement differs from its prediction" if single else "The measurements differ from their predictions"
    )
    which = "" if single else f" on average from {longest.start:g} s on"
    return f" {differs} by {', '.join(parts)}{which}."


def _explained(diagnosis: Diagnosis, factors: Mapping[str, float], scenario: Scenario) -> Iterator[str]:
    """Tell what explains the innovations best and the keys to try, and by which factor a σ would have to change."""
    cause, within = diagnosis.cause, f"until {round(diagnosis.until, 1):g} s"
    faults = list(planted(scenario, diagnosis.until))
    if faults:
        yield (
            f"The scenario contains faults that the filter does not model: {listed(faults)}. They are the most likely "
            "cause, and no key of the filter corrects them. Remove them to search for other causes."
        )
        return
    if cause is None:
        for sensor, factor in factors.items():
            yield f"The innovations of {sensor} would require a σ of {number_text(factor, 3)} times the assumed one."
        yield (
            f"No single error explains the innovations {within}. The search included a lever arm, delays, initial "
            "errors, errors of the inertial and the aiding sensors, and wrong noise. Look for outliers, wrong axes or "
            "wrong units (sinssim inspect)."
        )
        return
    what, keys = cause_and_remedy(cause, scenario)
    yield (
        f"Most likely cause: {what}. Try {keys}. (The gain is {cause.gain:.0f} for the measurements {within}: twice "
        "the logarithm of the ratio of their probabilities with and without this cause. A correct filter exceeds "
        f"{cause.needed:.0f} in at most {100.0 * FALSE_ALARM:g} % of runs. The search finds one cause at a time: "
        "correct it, and run again.)"
    )
    for other in diagnosis.alike:
        what, keys = cause_and_remedy(other, scenario)
        yield (
            f"Equally likely for this motion: {what} (gain {other.gain:.0f}). Try {keys}. Explanations that are equal "
            "on a straight path at constant speed differ in turns and during changes of speed."
        )


def what_to_try(numbers: DiagnosisNumbers) -> Iterator[Item]:
    """Yield what a diagnosis says to try, and the explanations that the filter ran with."""
    yield from map(Sentence, numbers["what_to_try"])
    if "hypotheses" not in numbers:
        return
    rows = [
        (_name(h), f"{bold}{h['gain']:.0f}{bold}", f"{h['needed']:.1f}", _size(h))
        for k, h in enumerate(_by_cause(numbers["hypotheses"]))
        for bold in ("**" if k == 0 and numbers["cause"] is not None else "",)
    ]  # fmt: skip
    columns = (Column("explanation", words=True), Column("gain"), Column("limit"),
               Column("size ± 1σ, SI; factor of a σ or a noise"))  # fmt: skip
    yield Table(
        columns, rows,
        note=f"The filter ran again with the best explanations, until {round(numbers['until_s'], 1):g} s; the gains of "
        "the others are those of its linear recursion. The gain is twice "
        "the logarithm of the factor by which the measurements become more probable. The limit is the value that the "
        f"gain of any explanation exceeds in at most {100.0 * numbers['false_alarm']:g} % of runs with a correct "
        "filter. A wrong explanation that resembles the correct one has a large gain, too: only the largest gain, in "
        "bold, identifies the cause.",
    )  # fmt: skip


def _by_cause(hypotheses: Sequence[HypothesisNumbers]) -> list[HypothesisNumbers]:
    """Return the explanations with the cause first."""
    return sorted(hypotheses, key=lambda h: (not h["gain"] > h["needed"], -h["gain"]))


def _name(hypothesis: HypothesisNumbers) -> str:
    name = hypothesis["name"]
    match hypothesis["kind"]:
        case "measurement noise":
            return f"σ of {listed(name.split(', '))}"
        case "bias walk":
            return f"random walk of the biases of the {name}s"
        case "inertial noise":
            return "noise of gyros and accelerometers"
        case "initial state":
            return f"error of the {name}"
        case _:
            return name


def _size(hypothesis: HypothesisNumbers) -> str:
    """Return the estimates, three in a line: six angles in one would be wider than the page."""
    if not hypothesis["value"]:
        return "–"
    if not hypothesis["sigma"]:
        return ", ".join(number_text(value, 3) for value in hypothesis["value"])
    texts = [
        f"{number_text(value, 3)} ± {number_text(sigma, 2)}"
        for value, sigma in zip(hypothesis["value"], hypothesis["sigma"], strict=True)
    ]
    return "\n".join(", ".join(texts[k : k + 3]) for k in range(0, len(texts), 3))
