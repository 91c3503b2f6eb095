"""The diagnosis of a filter, in summary.json and in the report.

Rejected measurements, likely causes, the keys that they name, and remedies.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from sinssim import units
from sinssim.estimation.consistency import FALSE_ALARM, consistency
from sinssim.estimation.filter_diagnosis import refusals, size_of_innovations
from sinssim.estimation.filter_result import Refusals
from sinssim.exhibits import Column, Item, Sentence, Table
from sinssim.experiments.run.filter_remedies import cause_and_remedy
from sinssim.experiments.run.summary_types import DiagnosisNumbers, HypothesisNumbers, RefusedSpan
from sinssim.formatting import listed, number_text
from sinssim.sensors.aiding_registry import measurement_kind

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.estimation.filter_result import Diagnosis
    from sinssim.scenario import Scenario


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
    """Return the entry of `summary.json`, None for a filter without a diagnosis.

    Returns:
        The time looked at, the spans of refused readings, by sensor the factor by which its innovations are larger
        than assumed and the factor of its σ that explains them, all hypotheses with their estimates, the cause if there
        is one, and `what_to_try` in sentences.
    """
    diagnosis = estimate.diagnosis
    if diagnosis is None:
        return _without_hypotheses(estimate)
    factors = {h.name: h.value[0] for h in diagnosis.hypotheses if h.kind == "measurement noise" and len(h.value) == 1}
    return {
        "until_s": diagnosis.until,
        "runs": diagnosis.runs,
        "seconds": round(diagnosis.seconds, 1),
        "cut": diagnosis.cut,
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
    """Tell what the search took, and whether it ended before everything was tried."""
    if diagnosis.runs:
        cut = (
            " It ended at this limit of runs, before everything was tried: the search for noise comes last. A shorter "
            "scenario that shows the fault early is searched in full."
        )
        yield (
            f"The search took {diagnosis.runs} runs of the filter over the data until {round(diagnosis.until, 1):g} s, "
            f"{number_text(diagnosis.seconds, 2)} s in all.{cut if diagnosis.cut else ''}"
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
        note=f"The filter ran again with each explanation, until {round(numbers['until_s'], 1):g} s. The gain is twice "
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
