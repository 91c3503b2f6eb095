"""The entry `diagnosis` of a filter in summary.json: rejected measurements, likely causes, and remedies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from sinssim import units
from sinssim.estimation.checks.consistency import consistency
from sinssim.estimation.checks.evidence import FALSE_ALARM, refusals, size_of_innovations
from sinssim.estimation.explanation import Refusals
from sinssim.experiments.run.store.summaries.diagnosis_keys import (
    initial_state,
    planted,
    sensor_error,
    sensor_walk,
    short,
    with_sigma,
)
from sinssim.formatting import listed, number_text
from sinssim.sensors.aiding.registry import measurement_kind

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.estimation.explanation import Diagnosis, Hypothesis
    from sinssim.scenario import Scenario

_DISPLAYED = {"mps": ("m/s", 1.0), "rad": ("°", units.DEG), "radps": ("°/s", units.DEG)}
_AXES = {"n": "north", "e": "east", "d": "down"}
"""Display units and axes of innovations."""

_SHOWN = 3
"""Most spans of refused readings of one sensor that are told in words; summary.json has all."""

_UNITS = {
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

_MORE = (
    "Set filter.diagnose = true to search for the cause (a lever arm, a delay, an initial error, a sensor error, or "
    "wrong noise)."
)


def diagnosis_numbers(estimate: Estimate, scenario: Scenario) -> dict[str, Any]:
    """Return the entry, nothing for a filter without a diagnosis.

    Returns:
        `diagnosis` with the time looked at, the spans of refused readings, by sensor the factor by which its
        innovations are larger than assumed and the factor of its σ that explains them, all hypotheses with their
        estimates, the cause if there is one, and `what_to_try` in sentences.
    """
    found = estimate.diagnosis
    if found is None:
        return _without_hypotheses(estimate)
    cause = found.cause
    factors = {
        one.name: one.value[0] for one in found.hypotheses if one.kind == "measurement noise" and len(one.value) == 1
    }
    return {
        "diagnosis": {
            "until_s": found.until,
            "runs": found.runs,
            "seconds": round(found.seconds, 1),
            "cut": found.cut,
            "false_alarm": FALSE_ALARM,
            "refused": [
                {"sensor": r.sensor, "from_s": r.start, "to_s": r.end, "count": r.count} for r in found.refusals
            ],
            "sensors": {
                name: {"innovations_larger_by": None if size != size else size, "sigma_factor": factors.get(name)}
                for name, size in found.sizes.items()
            },
            "cause": None if cause is None else cause.name,
            "hypotheses": [
                {
                    "name": one.name,
                    "kind": one.kind,
                    "value": list(one.value),
                    "sigma": list(one.sigma),
                    "gain": one.gain,
                    "needed": one.needed,
                }
                for one in found.hypotheses
                if math.isfinite(one.gain)
            ],
            "what_to_try": [
                *_refused(list(found.sizes), found.refusals, _kinds(estimate)),
                *_explained(found, factors, scenario),
                *_cost(found),
            ],
        }
    }


def _cost(found: Diagnosis) -> Iterator[str]:
    """Tell what the search took, and whether it ended before everything was tried."""
    if found.runs:
        cut = (
            " It ended at this limit of runs, before everything was tried: the search for noise comes last. A shorter "
            "scenario that shows the fault early is searched in full."
        )
        yield (
            f"The search took {found.runs} runs of the filter over the data until {round(found.until, 1):g} s, "
            f"{number_text(found.seconds, 2)} s in all.{cut if found.cut else ''}"
        )


def _without_hypotheses(estimate: Estimate) -> dict[str, Any]:
    """Return what the innovations say without further runs, nothing for consistent ones."""
    judged = consistency(estimate)
    if judged.consistent or estimate.history is None:
        return {}
    spans = [span for one in estimate.innovations for span in refusals(one)]
    sizes = {one.sensor: size_of_innovations(one) for one in estimate.innovations}
    larger = [
        f"The median of the innovations of {s.sensor} is {number_text(sizes[s.sensor], 3)} times the assumed one."
        for s in judged.sensors
        if s.verdict == "optimistic" and sizes[s.sensor] > 1.0
    ]
    return {
        "diagnosis": {
            "refused": [_span(r) for r in spans],
            "sensors": {
                name: {"innovations_larger_by": None if size != size else size} for name, size in sizes.items()
            },
            "what_to_try": [
                *_refused(list(sizes), spans, _kinds(estimate)),
                *larger,
                _MORE,
            ],
        }
    }


def _kinds(estimate: Estimate) -> dict[str, str]:
    return {one.sensor: one.kind for one in estimate.innovations}


def _span(r: Refusals) -> dict[str, Any]:
    return {"sensor": r.sensor, "from_s": r.start, "to_s": r.end, "count": r.count}


def _refused(sensors: Sequence[str], refused: Sequence[Refusals], kinds: Mapping[str, str]) -> Iterator[str]:
    """Tell when which sensor was refused, and if it is the only one, by how much its readings were off on average."""
    alone = len({r.sensor for r in refused}) == 1
    for sensor in sensors:
        spans = sorted((r for r in refused if r.sensor == sensor), key=lambda r: -r.count)
        if spans:
            shown = sorted(spans[:_SHOWN], key=lambda r: r.start)
            told = ", ".join(f"{r.start:g} … {r.end:g} s ({r.count})" for r in shown)
            rest = len(spans) - _SHOWN
            more = f", and {rest} shorter span{'s' * (rest > 1)}" if rest > 0 else ""
            off = _off(spans[0], kinds.get(sensor, "")) if alone else ""
            yield f"The gate rejected consecutive measurements of {sensor}: {told}{more}.{off}"


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
    one = longest.count == 1
    differs = "The measurement differs from its prediction" if one else "The measurements differ from their predictions"
    which = "" if one else f" on average from {longest.start:g} s on"
    return f" {differs} by {', '.join(parts)}{which}."


def _explained(found: Diagnosis, factors: Mapping[str, float], scenario: Scenario) -> Iterator[str]:
    """Tell what explains the innovations best and the keys to try, and by which factor a σ would have to change."""
    cause, within = found.cause, f"until {round(found.until, 1):g} s"
    faults = list(planted(scenario, found.until))
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
    what, keys = _told(cause, scenario)
    yield (
        f"Most likely cause: {what}. Try {keys}. (The gain is {cause.gain:.0f} for the measurements {within}: twice "
        "the logarithm of the ratio of their probabilities with and without this cause. A correct filter exceeds "
        f"{cause.needed:.0f} in at most {100.0 * FALSE_ALARM:g} % of runs. The search finds one cause at a time: "
        "correct it, and run again.)"
    )
    for other in found.alike:
        what, keys = _told(other, scenario)
        yield (
            f"Equally likely for this motion: {what} (gain {other.gain:.0f}). Try {keys}. Explanations that are equal "
            "on a straight path at constant speed differ in turns and during changes of speed."
        )


def _told(cause: Hypothesis, scenario: Scenario) -> tuple[str, str]:
    """Return a cause in words, and what to try."""
    section = scenario.filter
    assert section is not None
    if cause.kind == "measurement noise":
        return _noise_of_readings(cause, scenario)
    if cause.kind == "inertial noise":
        factor, told = number_text(cause.value[0], 3), section.inertial_noise_factor * cause.value[0]
        return (
            f"the noise of gyros and accelerometers is {factor} times the assumed noise",
            f"filter.inertial_noise_factor = {short(told)}, or for vibration filter.vibration_noise = 0.4",
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
    unit, size = _UNITS[error][triad]
    what = f"the {error} of the {triad}s is {with_sigma(cause, size, unit)}"
    if cause.name in (section.states or ()):
        return (
            f"{what}, which is much larger than the filter assumes",
            "a grade or keys of [imu] with a larger 1σ of this error",
        )
    states = ", ".join(f'"{name}"' for name in (*(section.states or ()), cause.name))
    return f"{what}; it is not a state of the filter", f"filter.states = [{states}]"


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
            told = None if log is None else [a + b for a, b in zip(log.lever_arm_m, sure, strict=True)]
        case "gnss time offset":
            late = cause.value[0]
            side, size = ("late", 1.0) if late > 0.0 else ("early", -1.0)
            shown = replace(cause, value=(size * late,))
            what = f"the time stamps of the fixes are too {side} by {with_sigma(shown, 1.0, 's')}"
            key, state = "time_offset_s", f"{where}.time_offset_sigma_s = {wide}"
            told = None if log is None else [log.time_offset_s - late]
        case _:
            what = f"the GNSS velocities are older than their time stamps by {with_sigma(cause, 1.0, 's')}"
            key, state = "velocity_delay_s", f"{where}.velocity_delay_sigma_s = {wide}"
            told = None if log is None else [log.velocity_delay_s + cause.value[0]]
    if told is None or (key == "velocity_delay_s" and told[0] < 0.0):
        return what, f"{state}, with which the filter estimates it"
    text = f"{short(told[0])}" if len(told) == 1 else "[" + ", ".join(f"{short(value)}" for value in told) + "]"
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
    own = {} if log is None else {other.name: number for number, other in enumerate(log.others, start=1)}
    keys: dict[str, str] = {}
    others = []
    for sensor, factor in zip(sensors, factors, strict=True):
        if gnss is not None and sensor == "gnss-position":
            keys["log.gnss.sigma_factor"] = short(gnss.sigma_factor * factor)
        elif gnss is not None and sensor == "gnss-velocity":
            keys["log.gnss.velocity_sigma_factor"] = short(gnss.velocity_sigma_factor * factor)
        elif log is not None and sensor in own:
            told = log.others[own[sensor] - 1].sigma
            size = "" if told.value is None else f'{{ value = {short(told.value * factor)}, unit = "{told.unit}" }}'
            keys[f"log.others.{own[sensor]}.sigma"] = size or f"{short(factor)} times the present value"
        else:
            others.append(factor)
    if others and scenario.filter is not None:
        mean = math.exp(sum(map(math.log, others)) / len(others))
        keys["filter.measurement_noise_factor"] = short(scenario.filter.measurement_noise_factor * mean)
    return [f"{key} = {value}" for key, value in keys.items()]
