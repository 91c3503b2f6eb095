"""Decides the textbook chapter's claims, and further laws, from the numbers of a study, and recommends engines.

A part of a study names the claims that it has the numbers for; the study names those that need no navigation. The
rules for rates and cost are here.

The recommended engine of a part is the cheapest of those that are accurate enough on every motion: its errors are
negligible beside those of good sensors, or hardly larger than those of the best engine. On every motion the largest
horizontal error must be at most a tenth of a nautical mile per hour, or 1.1 of the least, and the drift of the
attitude, as for the claims, at most 0.3′ per hour, or 1.1 of the least. With ideal sensors the first limit usually
decides. With real sensors, whose errors are common to all engines, it is mostly the second.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from sinssim.experiments.studies.attitude_claims import coning_drift, euler_heading, euler_limit, orthogonality
from sinssim.experiments.studies.attitude_cost import matrix_costs
from sinssim.experiments.studies.position_claims import (
    accelerometer_term,
    computer_errors,
    gravity_series,
    gyro_free,
    gyro_term,
    latitude_rate,
    simplified_radii,
)
from sinssim.experiments.studies.step_cost import OF_FUNCTION
from sinssim.experiments.studies.study_charts import varying
from sinssim.experiments.studies.study_results import (
    ALLOWED_ARCSEC_H,
    EULER,
    LOOKS_AHEAD,
    LOW_ORDER,
    PLAIN,
    Evidence,
    Outcome,
    Pick,
    Point,
    Row,
    StudyResult,
    Verdict,
    base,
    by,
    drift_at,
    needed,
    of_motion,
    overall,
    undecided,
)
from sinssim.experiments.studies.study_schema import CLAIMS, Part
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.strapdown.attitude import family
from sinssim.units import NAUTICAL_MILE, UG, number_text

NEGLIGIBLE = 0.1
"""A rate is sufficient if its error is less than this fraction of the error of sensors of the 1 nmi/h grade."""
SENSORS_UG = math.sqrt(2.0) * GRADE_TABLE["laser-standard"].accel.bias / UG
"""Their error of the horizontal acceleration: biases of two accelerometers, 1σ."""

_ENOUGH_HZ = 20.0
_LEAST_HZ, _MOST_HZ = 50.0, 80.0


def velocity_rate(evidence: Evidence) -> Outcome:
    """Decide on slow velocity and position with fast attitude, relative to the errors of accelerometers.

    Both act as an error of the acceleration: the drift of the velocity in perfect navigation with slow rates, and the
    bias of the accelerometers. So the comparison depends neither on a draw nor on the duration.
    """
    numbers: dict[str, float] = {}
    points = []
    limit = NEGLIGIBLE * SENSORS_UG
    worst: dict[float, tuple[float, str]] = {}
    for motion, rows in by(evidence.rows, of_motion).items():
        slow = {r.schedule_hz[1]: r for r in rows if r.schedule_hz and r.schedule_hz[1] == r.schedule_hz[2]}
        if _ENOUGH_HZ not in slow:
            return undecided("velocity and position at 20 Hz with perfect sensors")
        for rate, row in slow.items():
            worst[rate] = max(worst.get(rate, (0.0, "")), (row.velocity_drift_ug, motion))
            numbers[f"{motion}: {rate:g} Hz, µg"] = row.velocity_drift_ug
            numbers[f"{motion}: {rate:g} Hz, m"] = row.max_horizontal_error_m
        enough = slow[_ENOUGH_HZ].velocity_drift_ug < limit
        drifts = ", ".join(
            f"{rate:g} Hz {number_text(row.velocity_drift_ug, 2)} ± "
            f"{number_text(row.velocity_drift_uncertainty_ug, 1)} µg"
            for rate, row in sorted(slow.items(), reverse=True)
        )
        points.append(Point(f"{motion}: {drifts}", "confirmed" if enough else "refuted"))
    if not points:
        return undecided("any result")
    loads = {r.pace: r.operations_per_step for r in evidence.rows if r.schedule_hz and r.operations_per_step > 0.0}
    numbers |= {f"{pace}: operations per step": load for pace, load in loads.items()}
    if loads:
        shown = ", ".join(f"{pace} {load:.0f}" for pace, load in loads.items())
        points.append(Point(f"operations per fast step: {shown}"))
    numbers |= {f"{rate:g} Hz, part of the sensors' error": drift / SENSORS_UG for rate, (drift, _) in worst.items()}
    insufficient = [
        f"{rate:g} Hz costs {100.0 * drift / SENSORS_UG:.2g} % on {motion}"
        for rate, (drift, motion) in sorted(worst.items())
        if drift >= limit
    ]
    drift, motion = worst[_ENOUGH_HZ]
    reason = (
        "Drift of the velocity by the slow rates alone, with perfect sensors: it acts like an error of the "
        f"acceleration. A rate is sufficient below {limit:.3g} µg, {100.0 * NEGLIGIBLE:g} % of the biases of two level "
        f"accelerometers of the 1 nmi/h grade. At {_ENOUGH_HZ:g} Hz it is {100.0 * drift / SENSORS_UG:.2g} % of them "
        f"on {motion}"
        + (f"; lower rates are not sufficient everywhere: {'; '.join(insufficient)}" if insufficient else "")
        + ":"
    )
    measured = f"{number_text(drift, 2)} µg at {_ENOUGH_HZ:g} Hz ({motion})"
    return Outcome(overall(points), reason, tuple(points), numbers, measured, f"below {limit:.3g} µg")


def attitude_rate(evidence: Evidence) -> Outcome:
    """Find the lowest rate that keeps attitude within a few tenths of a minute of arc in an hour, motion by motion."""
    numbers: dict[str, float] = {}
    points: list[Point] = []
    high: dict[str, Row] = {}
    for motion, at_motion in by(evidence.rows, of_motion).items():
        rows = list(needed(at_motion).values())
        good = [r for r in rows if base(r.algorithm) not in (*LOW_ORDER, *PLAIN)]
        if not good:
            return Outcome("refuted", f"On {motion} no algorithm of high order drifts by less than 0.3′/h at any rate.")
        best = high[motion] = _least(good)
        numbers[f"{motion}: high order, Hz"] = best.rate_hz
        numbers[f"{motion}: high order, arcsec/h"] = best.attitude_drift_arcsec_h
        fact = evidence.facts.get(motion)
        up_to = f" (up to {fact.max_rate_deg_s:.0f} deg/s)" if fact else ""
        text = f"{motion}{up_to}: high order from {_shown(best)}"
        causal = [r for r in good if base(r.algorithm) not in LOOKS_AHEAD]
        if base(best.algorithm) in LOOKS_AHEAD:
            text += f", without later samples {f'from {_shown(_least(causal))}' if causal else 'at no rate'}"
        if causal:
            numbers[f"{motion}: high order without later samples, Hz"] = _least(causal).rate_hz
        slower = [r for r in rows if base(r.algorithm) in LOW_ORDER]
        text += ", " + _low_order(motion, at_motion, slower, numbers)
        uncompensated = [r.rate_hz for r in rows if base(r.algorithm) in PLAIN]
        if uncompensated:
            text += f", high order without coning compensation from {min(uncompensated):g} Hz"
            numbers[f"{motion}: high order without coning compensation, Hz"] = min(uncompensated)
        points.append(Point(text, _of_attitude(best.rate_hz, _least(slower).rate_hz if slower else math.inf)))
    if not points:
        return undecided("any result")
    worst = max(high, key=lambda motion: high[motion].rate_hz)
    reason = (
        "Lowest rate from which on the attitude drifts by at most 0.3′ in an hour, half as much as a gyro of the "
        "1 nmi/h grade. The drift is a line fitted to the error, so that the duration of a motion does not matter. The "
        f"claim is confirmed on a motion if a high order needs {_LEAST_HZ:g} to {_MOST_HZ:g} Hz, and partly so if it "
        f"needs less but a low order needs more than {_LEAST_HZ:g} Hz. {high[worst].rate_hz:g} Hz with a high order is "
        f"enough on every motion, and necessary on {worst}:"
    )
    measured = f"high order from {high[worst].rate_hz:g} Hz ({worst})"
    return Outcome(overall(points), reason, tuple(points), numbers, measured, "50–80 Hz (0.3′ in an hour)")


def _shown(row: Row) -> str:
    ahead = ", uses later samples" if base(row.algorithm) in LOOKS_AHEAD else ""
    drift, apart = row.attitude_drift_arcsec_h, row.attitude_drift_uncertainty_arcsec_h
    return f"{row.rate_hz:g} Hz ({row.algorithm}{ahead}, {number_text(drift, 2)} ± {number_text(apart, 1)} ″/h)"


def _least(rows: list[Row]) -> Row:
    return min(rows, key=lambda row: (row.rate_hz, row.attitude_drift_arcsec_h))


def _of_attitude(high: float, low: float) -> str:
    return "confirmed" if _LEAST_HZ <= high <= _MOST_HZ else "partly" if high < _LEAST_HZ < low else "refuted"


def _low_order(motion: str, rows: list[Row], slower: list[Row], numbers: dict[str, float]) -> str:
    """Return the words on first and second order; their drifts at 100 Hz and at the highest rate if none is enough."""
    if slower:
        numbers[f"{motion}: low order, Hz"] = _least(slower).rate_hz
        return f"first and second order from {_least(slower).rate_hz:g} Hz"
    rates = sorted({100.0, max(row.rate_hz for row in rows)} & {row.rate_hz for row in rows})
    drifts = {rate: drift_at(rows, LOW_ORDER, rate) for rate in rates}
    numbers |= {f"{motion}: low order at {rate:g} Hz, arcsec/h": drift for rate, drift in drifts.items()}
    shown = ", ".join(f"{number_text(drift)} ″/h at {rate:g} Hz" for rate, drift in drifts.items())
    return f"first and second order at no rate (at best {shown})"


_OTHERS = ("direction cosines", "Euler angles")
_FAMILIES = {
    "quaternion": "quaternions",
    "two-quaternions": "quaternions",
    "poisson": _OTHERS[0],
    EULER: _OTHERS[1],
    "rotation-vector": "beyond the chapter, rotation vectors",
}


def cheapest(evidence: Evidence) -> Outcome:
    """Compare families by the operations per second of motion that keep attitude within a few tenths of a minute of
    arc in an hour.

    The chapter's algorithms, which make a step of every sample, decide; rotation vectors of several samples per step
    are listed beside them. The whole navigation decides; the attitude alone is compared, too.
    """
    numbers: dict[str, float] = {}
    points = []
    won, margins, alone = [], [], []
    for motion, rows in by(evidence.rows, of_motion).items():
        best: dict[str, Row] = {}
        for row in needed(rows).values():
            group = _FAMILIES.get(family(row.algorithm))
            if group and (group not in best or _load(row) < _load(best[group])):
                best[group] = row
        chapter = sorted((f for f in best if f in ("quaternions", *_OTHERS)), key=lambda f: _load(best[f]))
        if "quaternions" not in chapter or len(chapter) < 2:
            return undecided("quaternions and another of the chapter's families within 0.3′/h")
        won.append(chapter[0] == "quaternions")
        margins.append(min(_load(best[f]) for f in chapter if f != "quaternions") / _load(best["quaternions"]) - 1.0)
        attitude = _attitude_loads(rows)
        others = [load for group, load in attitude.items() if group in _OTHERS]
        if "quaternions" in attitude and others:
            alone.append(min(others) / attitude["quaternions"] - 1.0)
        for group, load in attitude.items():
            numbers[f"{motion}: {group}, attitude alone, 1000 operations/s"] = load / 1e3
        for group, row in best.items():
            numbers[f"{motion}: {group}, 1000 operations/s"] = _load(row) / 1e3
            numbers[f"{motion}: {group}, µs/s"] = row.ns_per_step * row.rate_hz / 1e3
        words = [
            f"{group} {_load(row) / 1e3:.3g} thousand ({row.algorithm} at {row.rate_hz:g} Hz"
            + (", uses later samples)" if base(row.algorithm) in LOOKS_AHEAD else ")")
            for group, row in ((f, best[f]) for f in (*chapter, *(f for f in best if f not in chapter)))
        ]
        points.append(Point(f"{motion}: {', '.join(words)}", "confirmed" if won[-1] else "refuted"))
    if not points:
        return undecided("any result")
    reason = (
        f"Quaternions need the fewest operations on {sum(won)} of {len(won)} motions; the best of the others "
        f"takes {100.0 * min(margins):+.1f} % to {100.0 * max(margins):+.1f} %"
        + (f", of the attitude alone {100.0 * min(alone):+.1f} % to {100.0 * max(alone):+.1f} %" if alone else "")
        + ". Operations of the whole navigation per second of motion, for 0.3′ in an hour; a sine counts as "
        f"{OF_FUNCTION:g}:"
    )
    measured = f"best of the others: {100.0 * min(margins):+.1f} %"
    return Outcome(overall(points), reason, tuple(points), numbers, measured, "more than 0 %")


def trigonometric_matrix() -> Outcome:
    """Compare B by sines and cosines of three angles with B from a quaternion: operations, and time in bulk."""
    by_products, by_functions = matrix_costs()
    ratio = by_functions.operations.total / by_products.operations.total
    slower = by_functions.ns / by_products.ns
    if_one = replace(by_functions.operations, function=0.0).total + by_functions.operations.function
    numbers = {
        "quaternion, operations": by_products.operations.total,
        "angles, operations": by_functions.operations.total,
        "angles, operations if a function were one": if_one,
        "quaternion, ns": by_products.ns,
        "angles, ns": by_functions.ns,
    }
    reason = (
        "B from a quaternion takes sums and products only. B from three angles takes six sines and cosines, 14 "
        "multiplications and 4 additions; a sine to rounding takes "
        f"{OF_FUNCTION:g} operations (reduction and a polynomial of degree 15). If a function were one operation, the "
        f"angles would seem to need {if_one:.0f}. One matrix, and its time among many:"
    )
    points = tuple(
        Point(f"{name}: {cost.operations.total:.0f} operations, {cost.ns:.2g} ns", verdict)
        for name, cost, verdict in (
            ("from a quaternion", by_products, ""),
            ("from angles by six functions", by_functions, "confirmed" if min(ratio, slower) > 1.0 else "refuted"),
        )
    )
    measured = f"{ratio:.2g} × operations, {slower:.2g} × time"
    return Outcome(overall(points), reason, points, numbers, measured, "more than 1")


def _load(row: Row) -> float:
    return row.operations_per_step * row.rate_hz


def _attitude_loads(rows: list[Row]) -> dict[str, float]:
    """Return, by family, the least operations per second of the attitude alone that keep it within 0.3′/h."""
    least: dict[str, float] = {}
    for row in needed(rows).values():
        group, load = _FAMILIES.get(family(row.algorithm)), row.attitude_operations_per_step * row.rate_hz
        if group and load < least.get(group, math.inf):
            least[group] = load
    return least


_DECIDERS: dict[str, Callable[[Evidence], Outcome]] = {
    "velocity-rate": velocity_rate,
    "attitude-rate": attitude_rate,
    "cheapest": cheapest,
    "orthogonality": orthogonality,
    "euler-heading": euler_heading,
    "euler-limit": euler_limit,
    "simplified-radii": simplified_radii,
    "latitude-rate": latitude_rate,
    "computer-errors": computer_errors,
    "gyro-free": gyro_free,
    "coning-drift": coning_drift,
}
_COMPUTED: dict[str, Callable[[], Outcome]] = {
    "trigonometric-matrix": trigonometric_matrix,
    "accelerometer-term": accelerometer_term,
    "gyro-term": gyro_term,
    "gravity-series": gravity_series,
}
"""Claims decided by a computation of their own, without navigations."""


def decide(comparison: StudyResult) -> list[Verdict]:
    """Decide the claims that a study's parts have numbers for.

    The verdicts are in the order of the chapter; "undecided" if the study ended early or lacks numbers.
    """
    verdicts = []
    for claim, sentence in CLAIMS.items():
        parts = [part for part in comparison.study.parts if claim in part.decides]
        titles = [part.title for part in parts]
        if not titles and claim not in comparison.study.decides:
            continue
        planned = sum(part.cases * len(part.motions) for part in parts)
        done = sum(row.part in titles for row in comparison.rows)
        if comparison.status != "finished" and done < planned:  # an incomplete set of numbers is not conclusive
            outcome = undecided(f"{planned - done} of its {planned} navigations were not reached")
        elif claim in _COMPUTED:
            outcome = _COMPUTED[claim]()
        else:
            outcome = _DECIDERS[claim](_evidence(comparison, titles))
        points, judged = tuple(p.text for p in outcome.points), tuple(p.verdict for p in outcome.points)
        verdicts.append(
            Verdict(
                claim, sentence, outcome.verdict, outcome.reason, points, outcome.numbers, judged, outcome.measured,
                outcome.expected,
            )
        )  # fmt: skip
    return verdicts


def _evidence(comparison: StudyResult, titles: list[str]) -> Evidence:
    rows = [row for row in comparison.rows if row.part in titles and row.status == "done"]
    return Evidence(
        rows,
        {row.motion: comparison.motions[row.part, row.motion] for row in rows},
        comparison.history_or_none,
        [heading for heading in comparison.headings if heading.part in titles],
    )


ALLOWED_MILES_PER_HOUR = 0.1
"""A tenth of the error of sensors of the 1 nmi/h grade."""
HARDLY_WORSE = 1.1
_LIMITS = f"{ALLOWED_MILES_PER_HOUR:g} nmi/h and {ALLOWED_ARCSEC_H / 60.0:g}′/h, or within 10 % of the least error"

_ENGINE = ("algorithm", "frame", "gravity", "curvature", "ellipsoid")


@dataclass(frozen=True)
class _Candidate:
    """An engine at one rate or schedule, on all motions of its part."""

    name: str
    rows: tuple[Row, ...]
    worst: str  # error and motion of the case nearest to the limit or farthest beyond it
    excess: float  # its error over the limit in this case
    error: float  # largest ratio of its error to the least of any engine, over all motions and both errors

    @property
    def cost(self) -> tuple[float, float]:
        """Processor time per second of motion, µs; for schedules with equal time, then the sum of their slower rates,
        Hz."""
        row = self.rows[0]
        return row.ns_per_step * row.rate_hz * 1e-3, sum(row.schedule_hz[1:])

    @property
    def horizontal(self) -> float:
        return max(row.max_horizontal_error_m for row in self.rows)

    @property
    def drift(self) -> float:
        return max(row.attitude_drift_arcsec_h for row in self.rows)

    @property
    def words(self) -> str:
        return (
            f"{number_text(self.horizontal)} m and {number_text(self.drift)} ″/h at most, {number_text(self.cost[0])} "
            "µs of processor time per second of motion"
        )


def picks(comparison: StudyResult) -> list[Pick]:
    """Return a pick for each sensor set of every part that has more than a single engine at a single rate."""
    return [
        _pick(part, sensors, variant, [
            row for row in comparison.of_part(part.title) if (row.sensors, row.variant) == (sensors, variant)
        ])
        for part in comparison.study.parts if len(part.engines) * len(part.pace) > 1
        for sensors in part.sensors for variant in part.variants
    ]  # fmt: skip


def _pick(part: Part, sensors: str, variant: str, rows: Sequence[Row]) -> Pick:
    count = len(part.engines) * len(part.pace)
    planned = count * len(part.motions)
    if len(rows) < planned:
        missing = f"{planned - len(rows)} of its {planned} navigations were not reached"
        return Pick(part.title, sensors, variant, "", f"Undecided: {missing}.")
    candidates = _candidates(rows)
    failed = count - len(candidates)
    without = f" {failed} of {count} failed on some motion." if failed else ""
    if not candidates:
        return Pick(part.title, sensors, variant, "", f"None: every engine failed on some motion.{without}")
    best = min(candidates, key=lambda candidate: candidate.error)
    enough = [candidate for candidate in candidates if candidate.excess <= 1.0]
    # costs that agree to one percent count as equal, because times are measured
    least = min((candidate.cost[0] for candidate in enough), default=0.0)
    cheap = [candidate for candidate in enough if candidate.cost[0] <= 1.01 * least]
    chosen = min(cheap, key=lambda candidate: (candidate.cost[1], candidate.error), default=best)
    numbers = {
        "max_horizontal_error_m": chosen.horizontal,
        "attitude_drift_arcsec_h": chosen.drift,
        "us_per_second": chosen.cost[0],
        "candidates": float(count),
        "accurate_enough": float(len(enough)),
        "best_max_horizontal_error_m": best.horizontal,
        "best_attitude_drift_arcsec_h": best.drift,
        "best_us_per_second": best.cost[0],
    }
    return Pick(part.title, sensors, variant, chosen.name, _reason(chosen, best, enough, candidates) + without, numbers)


def _candidates(rows: Sequence[Row]) -> list[_Candidate]:
    """Collect the results of each engine at each rate or schedule, without those that failed on some motion."""
    least = {
        motion: (min(row.max_horizontal_error_m for row in here), min(row.attitude_drift_arcsec_h for row in here))
        for motion, here in by([row for row in rows if row.status == "done"], lambda row: row.motion).items()
    }
    dimensions = [name for name in varying(rows) if name in _ENGINE]
    several = len({row.pace for row in rows}) > 1
    engines = by(rows, lambda row: "\n".join([*(str(getattr(row, name)) for name in _ENGINE), row.pace]))
    candidates = []
    for group in engines.values():
        if any(row.status != "done" for row in group):
            continue
        judged = []
        for row in group:
            metres, drift = least[row.motion]
            allowed = ALLOWED_MILES_PER_HOUR * NAUTICAL_MILE * row.duration_s / 3600.0
            judged += [
                (row, " m", row.max_horizontal_error_m, metres, max(allowed, HARDLY_WORSE * metres)),
                (row, " ″/h", row.attitude_drift_arcsec_h, drift, max(ALLOWED_ARCSEC_H, HARDLY_WORSE * drift)),
            ]
        row, unit, error, _, allowed = max(judged, key=lambda case: case[2] / case[4])
        words = " · ".join([str(getattr(group[0], name)) for name in dimensions] or [group[0].algorithm])
        name = f"{words} at {group[0].pace} Hz" if several else words
        worst = f"{number_text(error)}{unit} on {row.motion}"
        ratio = max(error / max(low, 1e-12) for _, _, error, low, _ in judged)
        candidates.append(_Candidate(name, tuple(group), worst, error / allowed, ratio))
    return candidates


def _reason(
    chosen: _Candidate, best: _Candidate, enough: Sequence[_Candidate], candidates: Sequence[_Candidate]
) -> str:
    text, limits = f"{chosen.name}: {chosen.words}.", f"{_LIMITS}, on every motion"
    if not enough:
        return f"{text} It has the smallest errors; none of {len(candidates)} stays below {limits}."
    text += f" {len(enough)} of {len(candidates)} stay below {limits}; of these it needs the least computation."
    cheaper = [candidate for candidate in candidates if candidate.excess > 1.0 and candidate.cost < chosen.cost]
    if cheaper:
        nearest = min(cheaper, key=lambda candidate: candidate.excess)
        text += f" Cheaper, but in error by {nearest.worst}: {nearest.name}."
    if best is not chosen:
        text += f" {best.name} has the smallest errors: {best.words}."
    return text
