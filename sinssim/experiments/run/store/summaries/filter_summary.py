"""Summary of a filter: accepted and rejected measurements, consistency, estimated sensor errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.experiments.run.store.filter_streams import state_columns
from sinssim.experiments.run.store.summaries.diagnosis_summary import diagnosis_numbers
from sinssim.experiments.run.store.summaries.use_of_readings import unused_sentences, use_of_readings
from sinssim.formatting import number_text, signed
from sinssim.scenario.filter.filter_states import hints
from sinssim.scenario.notes import times_not_reached
from sinssim.sensors.aiding.gnss import Gnss, Jump, Ramp
from sinssim.strapdown.error_numbers import error_numbers_of, known_error_numbers_of

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.estimation.checks.against_truth import ActualConsistency
    from sinssim.estimation.checks.consistency import ChiSquare
    from sinssim.scenario import Scenario
    from sinssim.simulation.aided.truth_comparison import Aided


_UNITS = (
    ("_rad_per_mps2", "deg/g", units.DEG / units.G0),
    ("_radps", "deg/h", units.DEG_H),
    ("_mps2", "µg", units.UG),
    ("_mps", "m/s", 1.0),
    ("_rad", "arcmin", units.ARCMIN),
    ("_m", "m", 1.0),
    ("_s", "s", 1.0),
    ("", "ppm", units.PPM),
)
"""Unit suffixes of columns, and the corresponding display units."""


_IN_A_ROW = 30
"""Number of consecutive readings rejected or accepted that is not by chance."""

_INCONSISTENT = {
    "optimistic": "the noise is larger than assumed",
    "pessimistic": "the noise is smaller than assumed",
    "outliers": "single measurements have large errors, and the others have smaller errors than assumed",
    "coloured": "innovations that are not white",
}
"""Verdicts on a sensor's innovations that speak against a filter, and their meaning."""


def filter_numbers(aided: Aided, scenario: Scenario) -> dict[str, Any]:
    """Return the entry of a filter in `summary.json`.

    Args:
        scenario: the scenario that was run, with the jumps and ramps that the gate had to detect.

    Returns:
        `divergence`, `remarks` and `consistent`, with `findings` and explaining `hints`; the errors of the solutions
        `aided`, `smoothed` and `backward` in the form of the algorithms' errors; the heading's σ and error before and
        after an alignment, if there was one; for each sensor the use of its readings and the tests on its innovations;
        for each jump and ramp of the scenario whether the gate caught it; `nees`, the mean over the run per state, for
        all states and each block, and `noise`, the variance of each noise of the inertial sensors relative to the
        assumed variance, with their 95 % bands; for each state, named with its unit, σ at the start and at the end, the
        error at the end, and whether it is observable: the motion shows it, and the filter at least halved its σ.
    """
    from sinssim.estimation.checks.consistency import consistency
    from sinssim.scenario.filter.unknown_gravity import gravity_notes

    estimate = aided.estimate
    judged, truly = consistency(estimate), _actual(aided)
    findings = [*judged.sentences, *truly.sentences]
    known = aided.true_parameters_known
    smoothed, backward = aided.smoothed_error, aided.backward_error
    numbers_of = error_numbers_of if known else known_error_numbers_of
    end, used = estimate.divergence, use_of_readings(aided)
    return {
        "divergence": None
        if end is None
        else {"time_s": end.time, "measurement": end.measurement, "reason": end.reason},
        "remarks": [*estimate.remarks, *times_not_reached(scenario, aided.end)],
        "consistent": not findings,
        "findings": findings,
        **({} if known else {"recorded": True}),
        "hints": [*gravity_notes(scenario), *hints(scenario)] if findings and known else [],
        "aided": numbers_of(aided.error_blocks) if len(estimate.time) else None,
        **({} if smoothed is None else {"smoothed": numbers_of(lambda: [smoothed])}),
        **({} if backward is None else {"backward": numbers_of(lambda: [backward])}),
        **_alignment(aided, scenario),
        **diagnosis_numbers(estimate, scenario),
        "sensors": {
            i.sensor: {
                "kind": i.kind,
                **used[i.sensor],
                "refused": s.rejected,
                "refused_expected": s.expected,
                "first_refused_s": _first(i.time, ~i.accepted & np.isfinite(i.nis)),
                "verdict": s.verdict,
                "tests": {t.name: _test_numbers(t) for t in s.tests},
            }
            for i, s in zip(estimate.innovations, judged.sensors, strict=True)
        },
        "faults": list(_faults(aided, scenario)),
        "nees": {
            name: {"states": _uncertain(estimate, name), "verdict": verdict, **_test_numbers(test)}
            for name, (test, verdict) in truly.nees.items()
        },
        "noise": {n: {"verdict": verdict, **_test_numbers(test)} for n, (test, verdict) in truly.noise.items()},
        "states": dict(_states(aided)),
    }


def _alignment(aided: Aided, scenario: Scenario) -> dict[str, Any]:
    """Return the result of an alignment for the heading: coarse and fine, or transfer alignment."""
    found, section, aiding = aided.estimate, scenario.filter, scenario.aiding
    masters = [i.time[-1] for i in found.innovations if i.sensor.startswith("master-") and len(i.time)]
    if not len(found.time) or section is None or aiding is None or not aided.true_parameters_known:
        return {}
    method: str = section.alignment
    if section.alignment_s is not None:
        at = len(found.time) - 1
    elif masters:
        method, at = "transfer", int(np.searchsorted(found.time, max(masters) + 1e-6)) - 1
    else:
        return {}
    heading = found.model.slices["attitude"].stop - 1

    def row(k: int) -> dict[str, float]:
        sigma, error = float(found.sigma[k, heading]), float(aided.block_error("attitude", slice(k, k + 1))[0, 2])
        return {
            "time_s": float(found.time[k]),
            "heading_sigma_arcmin": sigma / units.ARCMIN,
            "heading_error_arcmin": error / units.ARCMIN,
        }

    return {"alignment": {"method": method, "coarse_s": section.alignment_s, "begin": row(0), "end": row(at)}}


def _alignment_sentence(alignment: Mapping[str, Any]) -> str:
    """Describe the accuracy of an alignment."""
    begin, end = alignment["begin"], alignment["end"]

    def known(at: Mapping[str, float]) -> str:
        size, unit = _angle_unit(at["heading_sigma_arcmin"])  # one unit for both, for comparison
        error, sigma = abs(at["heading_error_arcmin"]) / size, at["heading_sigma_arcmin"] / size
        return f"{error:.3g} {unit} (1σ {sigma:.3g} {unit})"

    later = f"{known(end)} at {end['time_s']:g} s"
    match alignment["method"]:
        case "transfer":
            return f"Aligned by the master system: the heading error was {known(begin)} at the start and {later}."
        case "in-motion":
            how = f"in motion during the first {alignment['coarse_s']:g} s"
        case "by-course":
            how = f"by the course, within the first {alignment['coarse_s']:g} s"
        case _:
            how = f"at rest during the first {alignment['coarse_s']:g} s"
    start = f"the filter started at {begin['time_s']:g} s with a heading error of {known(begin)}"
    return f"Aligned {how}: {start}; the error was {later}."


def _angle_unit(arcmin: float) -> tuple[float, str]:
    """Return the display unit of an angle, in arcmin, and its name."""
    return (60.0, "deg") if arcmin >= 60.0 else (1.0, "arcmin") if arcmin >= 1.0 else (1.0 / 60.0, "arcsec")


def _first(time: np.ndarray[Any, Any], which: np.ndarray[Any, Any]) -> float | None:
    return float(time[np.argmax(which)]) if which.any() else None


def _faults(aided: Aided, scenario: Scenario) -> Iterator[dict[str, Any]]:
    """Yield the filter's response to every jump and ramp of the satellite receiver."""
    gnss = None if scenario.aiding is None else scenario.aiding.sensor(Gnss)
    time = aided.estimate.time
    if gnss is None or not len(time):
        return
    faults: list[Jump | Ramp] = [*gnss.jumps, *gnss.ramps]
    for fault in faults:
        if fault.from_s >= aided.end:
            continue  # reported in the remarks
        end = time[-1] if fault.to_s is None else min(fault.to_s, time[-1])
        affected = ("gnss-position", "gnss-velocity") if isinstance(fault, Ramp) else ("gnss-position",)
        readings = refused = 0
        first = again = None
        for i in aided.estimate.innovations:
            if i.sensor not in affected:
                continue
            during = (i.time >= fault.from_s) & (i.time <= end) & np.isfinite(i.nis)
            readings += int(np.count_nonzero(during))
            refused += int(np.count_nonzero(during & ~i.accepted))
            at = _first(i.time, during & ~i.accepted)
            first = at if first is None or (at is not None and at < first) else first
            back = _believed_again(i.time[during], i.accepted[during])
            again = back if again is None or (back is not None and back < again) else again
        during_it = slice(np.searchsorted(time, fault.from_s), np.searchsorted(time, end, side="right"))
        horizontal = aided.error_at(during_it).horizontal
        yield {
            "kind": type(fault).__name__.lower(),
            "from_s": fault.from_s,
            "to_s": float(end),
            "readings": readings,
            "refused": refused,
            "first_refused_s": first,
            "believed_again_s": again,
            "forged_then_m": None if again is None else _forged(fault, again),
            "caught": refused > 0.5 * readings,
            "max_horizontal_error_m": float(horizontal.max()) if len(horizontal) else None,
        }


def _forged(fault: Jump | Ramp, time: float) -> float:
    """Return the error of the satellites' position by a fault, m."""
    if isinstance(fault, Ramp):
        return math.hypot(fault.north_mps, fault.east_mps, fault.up_mps) * (time - fault.from_s)
    return math.hypot(fault.north_m, fault.east_m, fault.up_m)


def _believed_again(time: np.ndarray[Any, Any], accepted: np.ndarray[Any, Any]) -> float | None:
    """Return when readings were accepted again after a series of rejections, both `_IN_A_ROW` long; None for never."""
    edges = np.flatnonzero(np.diff(accepted.astype(int), prepend=-1, append=-1))
    lost = False
    for begin, end in pairwise(edges.tolist()):
        if end - begin < _IN_A_ROW:
            continue
        if accepted[begin] and lost:
            return float(time[begin])
        lost = lost or not accepted[begin]
    return None


def fault_sentences(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Report for every jump and ramp whether the gate caught it.

    Args:
        numbers: result of `filter_numbers`.
    """
    for fault in numbers["faults"]:
        begin, first, error = fault["from_s"], fault["first_refused_s"], fault["max_horizontal_error_m"]
        what = f"The GNSS {fault['kind']} from {begin:g} s to {fault['to_s']:g} s"
        how = f"it rejected {fault['refused']} of {fault['readings']} measurements"
        far = "" if error is None else f", and the error of the solution reached {number_text(error)} m"
        if fault["caught"]:
            yield f"{what} was detected by the gate: {how}, the first {first - begin:.0f} s after its start{far}."
            if (again := fault["believed_again_s"]) is not None:
                yield (
                    f"From {again:.0f} s on, with GNSS errors of {number_text(fault['forged_then_m'])} m, the "
                    f"filter accepted the fixes again: without GNSS, its uncertainty had grown so large that the gate "
                    "could not detect the fault."
                )
        else:
            inconsistent = any(s["verdict"] in _INCONSISTENT for s in numbers["sensors"].values())
            seen = ", but the tests of the innovations fail" if inconsistent else ", and the innovations do not show it"
            yield f"{what} was not detected by the gate: {how}{far}{seen}."


def sentences(numbers: Mapping[str, Any]) -> Iterator[str]:
    """Summarise a filter in sentences.

    Args:
        numbers: result of `filter_numbers`.

    Yields:
        Whole sentences, the most important first; verdicts without the underlying tests.
    """
    end = numbers["divergence"]
    if end is not None:
        at = f" at {end['measurement']}" if end["measurement"] else ""
        yield f"The filter diverged at {end['time_s']:.1f} s{at}: {end['reason']}."
    yield from fault_sentences(numbers)
    if "alignment" in numbers:
        yield _alignment_sentence(numbers["alignment"])
    if numbers["consistent"] and not any(s["taken"] for s in numbers["sensors"].values()):
        yield "The filter used no measurement; its errors agree with its covariance."
    elif numbers["consistent"] and numbers.get("recorded"):
        yield "The filter is consistent: its innovations agree with its covariance."
    elif numbers["consistent"]:
        yield "The filter is consistent: its innovations and its errors agree with its covariance."
    else:
        from sinssim.estimation.checks.consistency import FALSE_ALARM

        bad = []
        for verdict, meaning in _INCONSISTENT.items():
            sensors = [name for name, s in numbers["sensors"].items() if s["verdict"] == verdict]
            bad += [f"{verdict} ({meaning}) by {', '.join(sensors)}"] if sensors else []
        large = [name for name, test in numbers["nees"].items() if test["verdict"] != "consistent"]
        bad += [f"errors larger than the covariance of {', '.join(large)}"] if large else []
        wrong = [name for name, test in numbers["noise"].items() if test["verdict"] != "consistent"]
        bad += [f"wrong assumed variance of {', '.join(wrong)}"] if wrong else []
        yield from numbers["hints"]  # the cause precedes its effect
        the = "Therefore the" if numbers["hints"] else "The"
        yield f"{the} filter is not consistent{': ' if bad else ''}{'; '.join(bad)}."
        if bad:
            yield f"A correct filter fails any of these tests in at most {100.0 * FALSE_ALARM:g} % of runs."
        yield from numbers.get("diagnosis", {}).get("what_to_try", ())
    yield from numbers["remarks"]
    yield from unused_sentences(numbers["sensors"])


def _actual(aided: Aided) -> ActualConsistency:
    """Return a filter's consistency with the truth; empty for a filter that made no step."""
    from sinssim.estimation.checks.against_truth import ActualConsistency, actual_consistency

    history = aided.estimate.history
    if history is None or not len(history.time) or not aided.true_parameters_known:
        return ActualConsistency({}, {}, ())
    return actual_consistency(aided.estimate.model, history, aided.nominal_errors)


def _test_numbers(test: ChiSquare) -> dict[str, float]:
    numbers = {"value": test.value, "lower_95": test.lower, "upper_95": test.upper}
    return {**numbers, "probability": test.probability}


def _uncertain(estimate: Estimate, name: str) -> int:
    """Return the number of states of a block, or of all, that are not known exactly."""
    part = estimate.model.slices.get(name, slice(0, estimate.model.size))
    return int(np.count_nonzero(estimate.sigma[-1, part] > 0.0))


def _states(aided: Aided) -> Iterator[tuple[str, dict[str, Any]]]:
    from sinssim.estimation.checks.observability import observability

    estimate = aided.estimate
    if not len(estimate.time):
        return
    seen = None if estimate.history is None else observability(estimate.model, estimate.history)
    kinds = {s.measurements.label: s.measurements.kind for s in aided.sensed}
    columns = [column for block in estimate.model.blocks for column in state_columns(block, kinds)]
    errors = aided.state_errors_at(slice(-1, None))[0]
    known = aided.true_parameters_known
    own = {} if known else {b.name: estimate.parameters[b.name][-1] for b in estimate.model.blocks[3:]}
    estimates = np.empty(0) if known else np.concatenate([np.full(9, math.nan), *own.values()])
    for i, column in enumerate(columns):
        begin, end = float(estimate.sigma[0, i]), float(estimate.sigma[-1, i])
        yield (
            column,
            {
                "sigma_start": begin,
                "sigma_end": end,
                "error_end": float(errors[i]),
                **({} if known else {"estimate_end": float(estimates[i])}),
                "reduction": begin / end if end > 0.0 else None,
                **({} if seen is None else {"observable": bool(seen.observable[i]) and 2.0 * end <= begin}),
            },
        )


def for_people(column: str, *values: float | None) -> tuple[str, str, list[float]]:
    """Return a state of the filter in display units.

    Args:
        column: name of the state with its SI unit, as in the summary.

    Returns:
        Its name in words, the display unit, and the values in it, NaN for None.
    """
    ending, unit, size = next(row for row in _UNITS if column.endswith(row[0]))
    if "misalignment" in column:  # as in grades and in the table of the sensors' errors
        unit, size = "arcsec", units.ARCSEC
    stem = column.removesuffix(ending).replace("_", " ")
    return stem, unit, [float("nan") if v is None else v / size for v in values]


def filter_markdown(numbers: Mapping[str, Any]) -> str:
    """Return the summary of a filter for a panel of the view.

    Args:
        numbers: result of `filter_numbers`.
    """
    first, *others = sentences(numbers)
    lines = [f"**{first}**", "", *(f"- {sentence}" for sentence in others)]
    lines += ["", "| sensor | accepted | rejected | NIS | verdict |", "|---|---|---|---|---|"]
    for name, s in numbers["sensors"].items():
        nis = s["tests"].get("NIS")
        band = "–" if nis is None else f"{nis['value']:.3g} ({nis['lower_95']:.3g} … {nis['upper_95']:.3g})"
        lines.append(f"| {name} | {s['taken']} | {s['refused']} | {band} | {s['verdict']} |")
    for head, what in (("states | NEES", "nees"), ("noise | variance / assumed variance", "noise")):
        if not numbers[what]:
            continue
        lines += ["", f"| {head} | 95 % band |", "|---|---|---|"]
        lines += [
            f"| {n} | {v['value']:.3g} | {v['lower_95']:.3g} … {v['upper_95']:.3g} |" for n, v in numbers[what].items()
        ]
    last = "estimate" if numbers.get("recorded") else "error"
    lines += ["", f"| state | σ at the start | at the end | {last} |", "|---|---|---|---|"]
    for column, s in numbers["states"].items():
        name, unit, values = for_people(column, s["sigma_start"], s["sigma_end"], s[f"{last}_end"])
        mark = "" if s.get("observable", True) else ", not observable"
        lines.append(f"| {name} [{unit}]{mark} | " + " | ".join(signed(v) for v in values) + " |")
    lines += ["", *(f"- {finding}" for finding in numbers["findings"])]
    return "\n".join(lines)
