"""The numbers of a filter for `summary.json`, and what they mean in sentences."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from sinssim import units
from sinssim.estimation import Estimate, Innovations
from sinssim.estimation.consistency import MEANING, ActualConsistency, ChiSquare
from sinssim.estimation.state_model import FLICKER
from sinssim.experiments.run.filter_remedies import diagnosis_numbers
from sinssim.experiments.run.run_result import DrawnPath
from sinssim.experiments.run.run_streams import state_columns
from sinssim.experiments.run.summary_types import (
    AlignmentNumbers,
    Detection,
    FaultNumbers,
    FilterNumbers,
    HeadingNumbers,
    RestNumbers,
    SensorNumbers,
    SensorUse,
    StateNumbers,
    Test,
)
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import hints
from sinssim.scenario.notes import times_not_reached
from sinssim.sensors.aiding.gnss import Gnss, Jump, Ramp
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.strapdown.navigation_error import error_numbers_of, known_error_numbers_of
from sinssim.truth.trajectory import Trajectory
from sinssim.units import listed, number_text

if TYPE_CHECKING:
    from sinssim.simulation.truth_comparison import Aided


BEFORE, AFTER, REJECTED = "before the start of the filter", "after the end of the filter", "rejected by the gate"
"""Reasons for which a reading is not used, beside those of `sinssim.estimation.measurement_epochs`."""


def use_of_readings(aided: Aided) -> dict[str, SensorUse]:
    """Return what became of the readings of each sensor; those taken and those unused, by reason, are all of them."""
    total = {s.measurements.label: len(s.measurements) for s in aided.sensed}
    return {i.sensor: _of_sensor(i, total.get(i.sensor, len(i.time))) for i in aided.estimate.innovations}


def _of_sensor(i: Innovations, total: int) -> SensorUse:
    unused = Counter({BEFORE: total - len(i.time)})
    for row in np.flatnonzero(~i.accepted).tolist():
        unused[REJECTED if np.isfinite(i.nis[row]) else i.reason[row] or AFTER] += 1
    return {
        "readings": total,
        "taken": int(np.count_nonzero(i.accepted)),
        "unused": {reason: number for reason, number in unused.items() if number},
    }


def unused_sentences(sensors: Mapping[str, SensorUse]) -> Iterator[str]:
    """Report readings outside of the time of the filter; its own remarks report those within."""
    for reason in (BEFORE, AFTER):
        some = [(name, s["unused"].get(reason, 0), s["readings"]) for name, s in sensors.items()]
        words = [f"{number} of {total} of {name}" for name, number, total in some if number]
        if words:
            yield f"Measurements {reason}, which are not used: {', '.join(words)}."


_ESTIMATE_UNITS = (
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


def filter_numbers(aided: Aided, scenario: Scenario) -> FilterNumbers:
    """Return the entry of a filter in `summary.json`.

    A state is observable if the motion shows it and the filter has at least halved its σ; hints explain findings.
    """
    from sinssim.estimation.consistency import consistency

    estimate = aided.estimate
    judged, truly = consistency(estimate), _actual(aided)
    findings, known = [*judged.sentences, *truly.sentences], aided.true_parameters_known
    numbers_of = error_numbers_of if known else known_error_numbers_of
    end, used = estimate.divergence, use_of_readings(aided)
    detected = dict(_detected(aided, scenario))
    sensors: dict[str, SensorNumbers] = {
        i.sensor: {
            "kind": i.kind,
            **used[i.sensor],
            "refused": s.rejected,
            "refused_expected": s.expected,
            "withdrawn_s": i.withdrawn if np.isfinite(i.withdrawn) else None,
            "first_refused_s": _first(i.time, ~i.accepted & np.isfinite(i.nis)),
            "verdict": s.verdict,
            "tests": {t.name: _test_numbers(t) for t in s.tests},
            "detection": detected.get(i.sensor),
        }
        for i, s in zip(estimate.innovations, judged.sensors, strict=True)
    }
    numbers: FilterNumbers = {
        "divergence": None
        if end is None
        else {"time_s": end.time, "measurement": end.measurement, "reason": end.reason},
        "remarks": [*estimate.remarks, *times_not_reached(scenario, aided.end)],
        "consistent": not findings,
        "findings": findings,
        "hints": list(hints(scenario)) if findings and known else [],
        "aided": numbers_of(aided.error_blocks) if len(estimate.time) else None,
        "sensors": sensors,
        "faults": list(_faults(aided, scenario)),
        "detections": detections(estimate.innovations),
        "nees": {
            name: {"states": _uncertain(estimate, name), "verdict": verdict, **_test_numbers(test)}
            for name, (test, verdict) in truly.nees.items()
        },
        "noise": {n: {"verdict": verdict, **_test_numbers(test)} for n, (test, verdict) in truly.noise.items()},
        "states": dict(_state_numbers(aided)),
    }
    if not known:
        numbers["recorded"] = True
    if (smoothed := aided.smoothed_error) is not None:
        numbers["smoothed"] = numbers_of(lambda: [smoothed])
    if (backward := aided.backward_error) is not None:
        numbers["backward"] = numbers_of(lambda: [backward])
    if (alignment := _alignment(aided, scenario)) is not None:
        numbers["alignment"] = alignment
    if (diagnosis := diagnosis_numbers(estimate, scenario)) is not None:
        numbers["diagnosis"] = diagnosis
    return numbers


def _detected(aided: Aided, scenario: Scenario) -> Iterator[tuple[str, RestNumbers]]:
    """Yield what sensors that detect rest in the inertial readings have made of it, for a simulated run."""
    from sinssim.sensors.aiding.standstill import Standstill

    if scenario.aiding is None or not aided.true_parameters_known:
        return
    sensed = {readings.measurements.label: readings for readings in aided.sensed}
    for name, sensor in scenario.aiding.sensors().items():
        label = name.replace("_", "-")
        if isinstance(sensor, Standstill) and sensor.detect and label in sensed:
            at_rest, missed, readings, moving = sensor.compared(sensed[label], aided.trajectory)
            yield label, {"at_rest": at_rest, "missed": missed, "readings": readings, "in_motion": moving}


def _rest_sentences(sensors: Mapping[str, SensorNumbers]) -> Iterator[str]:
    """Compare detected rest with the true one."""
    for label, numbers in sensors.items():
        if (d := numbers.get("detection")) is not None:
            yield (
                f"{label}: rest was detected from the inertial readings. Of {d['at_rest']} instants at rest "
                f"{_share(d['missed'], d['at_rest'])} were missed; of {d['readings']} readings "
                f"{_share(d['in_motion'], d['readings'])} are in motion (false alarms)."
            )


def _share(part: int, whole: int) -> str:
    return f"{part} ({100.0 * part / whole:.2g} %)" if whole else "none"


def _alignment(aided: Aided, scenario: Scenario) -> AlignmentNumbers | None:
    """Return the result of an alignment for the heading, coarse and fine or transfer; None without one."""
    estimate, section, aiding = aided.estimate, scenario.filter, scenario.aiding
    masters = [i.time[-1] for i in estimate.innovations if i.sensor.startswith("master-") and len(i.time)]
    if not len(estimate.time) or section is None or aiding is None or not aided.true_parameters_known:
        return None
    method: str = section.alignment
    if section.alignment_s is not None:
        at = len(estimate.time) - 1
    elif masters:
        method, at = "transfer", int(np.searchsorted(estimate.time, max(masters) + 1e-6)) - 1
    else:
        return None
    heading = estimate.model.slices["attitude"].stop - 1

    def row(k: int) -> HeadingNumbers:
        sigma, error = float(estimate.sigma[k, heading]), float(aided.block_error("attitude", slice(k, k + 1))[0, 2])
        return {
            "time_s": float(estimate.time[k]),
            "heading_sigma_arcmin": sigma / units.ARCMIN,
            "heading_error_arcmin": error / units.ARCMIN,
        }

    return {"method": method, "coarse_s": section.alignment_s, "begin": row(0), "end": row(at)}


def _alignment_sentence(alignment: AlignmentNumbers) -> str:
    """Describe the accuracy of an alignment."""
    begin, end = alignment["begin"], alignment["end"]

    def known(at: HeadingNumbers) -> str:
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


def _faults(aided: Aided, scenario: Scenario) -> Iterator[FaultNumbers]:
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
    lost = False
    for begin in _series(accepted):
        if accepted[begin] and lost:
            return float(time[begin])
        lost = lost or not accepted[begin]
    return None


def _series(accepted: np.ndarray[Any, Any]) -> list[int]:
    """Return where series of rejections or acceptances begin that are `_IN_A_ROW` long."""
    edges = np.flatnonzero(np.diff(accepted.astype(int), prepend=-1, append=-1))
    return [begin for begin, end in pairwise(edges.tolist()) if end - begin >= _IN_A_ROW]


def detections(innovations: Sequence[Innovations]) -> list[Detection]:
    """Return when the monitor has withdrawn fixes, and when the gate begins to reject them in a first long series."""
    begun: dict[Literal["gate", "monitor"], dict[str, float]] = {"gate": {}, "monitor": {}}
    for i in innovations:
        if not measurement_kind(i.kind).on_gnss_clock:
            continue
        known = np.isfinite(i.nis)
        time, accepted = i.time[known], i.accepted[known]
        series = (float(time[begin]) for begin in _series(accepted) if not accepted[begin])
        begun["gate"][i.sensor] = next(series, math.inf)
        begun["monitor"][i.sensor] = i.withdrawn
    first = {by: min(times.values(), default=math.inf) for by, times in begun.items()}
    return [
        {"time_s": first[by], "by": by, "sensors": [sensor for sensor, time in times.items() if time == first[by]]}
        for by, times in sorted(begun.items(), key=lambda item: first[item[0]])
        if math.isfinite(first[by])
    ]


class Moment(NamedTuple):
    """An instant, s, with a word for a chart or a map, and a sentence for a log."""

    time: float
    word: str
    text: str


def detected(of: Detection) -> Moment:
    """Return a detection in words."""
    word = "withdrawn" if of["by"] == "monitor" else "rejected"
    return Moment(of["time_s"], word, f"{word} by the {of['by']}: {listed(of['sensors'])}")


def moments(scenario: Scenario, detections: Sequence[Detection], span: tuple[float, float]) -> list[Moment]:
    """Return when forged fixes begin in a run over a span, s, and when they are detected."""
    gnss = None if scenario.aiding is None else scenario.aiding.sensor(Gnss)
    forged = () if gnss is None else (*gnss.jumps, *gnss.ramps)
    begun = [(fault.from_s, type(fault).__name__.lower()) for fault in forged if span[0] <= fault.from_s < span[1]]
    return [*(Moment(begin, kind, f"GNSS {kind} begins") for begin, kind in begun), *map(detected, detections)]


_TOUCHING = 0.2
"""Part of a span within which the words of two marks would touch."""


def together(some: Iterable[tuple[float, str]], span: tuple[float, float]) -> list[tuple[float, str]]:
    """Return instants with words in the order of time; words that would touch in a span, s, are joined at the first."""
    joined = list[tuple[float, str]]()
    first = 0
    for time, words in sorted(some):
        if joined and time - joined[-1][0] < _TOUCHING * (span[1] - span[0]):
            joined[first] = joined[first][0], f"{joined[first][1]}, {words}"
            joined.append((time, ""))
        else:
            first = len(joined)
            joined.append((time, words))
    return joined


def places_of(some: Iterable[Moment], path: Trajectory) -> DrawnPath:
    """Return the true places of moments within a motion, with their words."""
    named = together([(at, f"{word} {at:g} s") for at, word, _ in some], (path.start, path.end))
    if not named:
        return DrawnPath("faults", np.empty(0), np.empty(0), np.empty(0), "refused")
    state = path.state(np.array([at for at, _ in named]))
    words = tuple(text for _, text in named)
    return DrawnPath("faults", state.latitude, state.longitude, state.height, "refused", words)


def fault_sentences(numbers: FilterNumbers) -> Iterator[str]:
    """Report for every jump and ramp whether the gate caught it."""
    for fault in numbers["faults"]:
        begin, first, error = fault["from_s"], fault["first_refused_s"], fault["max_horizontal_error_m"]
        what = f"The GNSS {fault['kind']} from {begin:g} s to {fault['to_s']:g} s"
        how = f"it rejected {fault['refused']} of {fault['readings']} measurements"
        far = "" if error is None else f", and the error of the solution reached {number_text(error)} m"
        if fault["caught"] and first is not None:
            yield f"{what} was detected by the gate: {how}, the first {first - begin:.0f} s after its start{far}."
            if (again := fault["believed_again_s"]) is not None:
                yield (
                    f"From {again:.0f} s on, with GNSS errors of {number_text(fault['forged_then_m'])} m, the "
                    f"filter accepted the fixes again: without GNSS, its uncertainty had grown so large that the gate "
                    "could not detect the fault."
                )
        elif monitored := _withdrawn(numbers, begin):
            yield (
                f"{what} was detected by the monitor of the innovations {monitored - begin:.0f} s after its start: the "
                f"fixes are withdrawn from then on{far}."
            )
        else:
            inconsistent = any(s["verdict"] in MEANING for s in numbers["sensors"].values())
            seen = ", but the tests of the innovations fail" if inconsistent else ", and the innovations do not show it"
            yield f"{what} was not detected by the gate: {how}{far}{seen}."


def _withdrawn(numbers: FilterNumbers, begin: float) -> float | None:
    """Return when the monitor has withdrawn the fixes after an instant; None for never, or before it."""
    times = [s["withdrawn_s"] for s in numbers["sensors"].values()]
    return min((time for time in times if time is not None and time >= begin), default=None)


def sentences(numbers: FilterNumbers, *, diagnosed: bool = True) -> Iterator[str]:
    """Summarise a filter in sentences, the most important first; `diagnosed`, with what its diagnosis says to try."""
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
        from sinssim.estimation.consistency import FALSE_ALARM

        bad = []
        for verdict, meaning in MEANING.items():
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
        if diagnosed and "diagnosis" in numbers:
            yield from numbers["diagnosis"]["what_to_try"]
    yield from numbers["remarks"]
    yield from _rest_sentences(numbers["sensors"])
    yield from unused_sentences(numbers["sensors"])


def _actual(aided: Aided) -> ActualConsistency:
    """Return a filter's consistency with the truth; empty for a filter that made no step."""
    from sinssim.estimation.consistency import ActualConsistency, actual_consistency

    history = aided.estimate.history
    if history is None or not len(history.time) or not aided.true_parameters_known:
        return ActualConsistency({}, {}, ())
    return actual_consistency(aided.estimate.model, history, aided.nominal_errors)


def _test_numbers(test: ChiSquare) -> Test:
    return {"value": test.value, "lower_95": test.lower, "upper_95": test.upper, "probability": test.probability}


def _uncertain(estimate: Estimate, name: str) -> int:
    """Return the number of a block's states, or of all, that are compared with the truth and not known exactly."""
    compared = estimate.model.compared
    rows = compared[name] if name in compared else np.vstack(list(compared.values()))
    return int(np.count_nonzero(np.any(rows[:, estimate.sigma[-1] > 0.0], axis=1)))


def _state_numbers(aided: Aided) -> Iterator[tuple[str, StateNumbers]]:
    from sinssim.estimation.consistency import observability

    estimate = aided.estimate
    if not len(estimate.time):
        return
    seen = None if estimate.history is None else observability(estimate.model, estimate.history)
    kinds = {s.measurements.label: s.measurements.kind for s in aided.sensed}
    columns = [column for block in estimate.model.blocks for column in state_columns(block, kinds)]
    errors = aided.state_errors_at(slice(-1, None))[0]
    known = aided.true_parameters_known
    parameters = {} if known else {b.name: estimate.parameters[b.name][-1] for b in estimate.model.blocks[3:]}
    estimates = np.empty(0) if known else np.concatenate([np.full(9, math.nan), *parameters.values()])
    for row in np.vstack(list(estimate.model.compared.values())):
        states = np.flatnonzero(row)
        begin, end = float(np.linalg.norm(estimate.sigma[0, states])), float(estimate.sigma[-1, states[0]])
        if len(states) > 1:  # a sum of processes
            end = math.sqrt(row @ estimate.covariance[-1] @ row)
        numbers: StateNumbers = {
            "sigma_start": begin,
            "sigma_end": end,
            "error_end": float(errors[states].sum()),
            "reduction": begin / end if end > 0.0 else None,
        }
        if not known:
            numbers["estimate_end"] = float(estimates[states].sum())
        if seen is not None:
            numbers["observable"] = bool(seen.observable[states].any()) and 2.0 * end <= begin
        column = columns[states[0]]
        yield column.replace(f"_{FLICKER}_1_", f"_{FLICKER}_") if len(states) > 1 else column, numbers


def for_people(column: str, *values: float | None) -> tuple[str, str, list[float]]:
    """Return the name of a column in words, its display unit, and its SI values in that unit, NaN for None."""
    ending, unit, size = next(row for row in _ESTIMATE_UNITS if column.endswith(row[0]))
    if "misalignment" in column:  # as in grades and in the table of the sensors' errors
        unit, size = "arcsec", units.ARCSEC
    stem = column.removesuffix(ending).replace("_", " ")
    return stem, unit, [float("nan") if v is None else v / size for v in values]
