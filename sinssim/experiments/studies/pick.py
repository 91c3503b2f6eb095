"""Picks an engine: the cheapest of those that are accurate enough on every motion of a part.

An engine is accurate enough if its errors are negligible beside those of good sensors, or hardly larger than those of
the best engine of the part. On every motion the largest horizontal error must be at most a tenth of a nautical mile per
hour, or 1.1 of the least, and the drift of the attitude, as for the claims, at most 0.3′ per hour, or 1.1 of the least.
With ideal sensors the first limit usually decides. With real sensors, whose errors are common to all engines, it is
mostly the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sinssim.experiments.studies.claims.outcome import ALLOWED_ARCSEC_H
from sinssim.experiments.studies.naming import varying
from sinssim.experiments.studies.results import Pick, Row, StudyResult
from sinssim.experiments.studies.schema import Part
from sinssim.formatting import number_text
from sinssim.units import NAUTICAL_MILE

ALLOWED_MILES_PER_HOUR = 0.1
"""A tenth of the error of sensors of the 1 nmi/h grade."""
HARDLY_WORSE = 1.1

_ENGINE = ("algorithm", "frame", "gravity", "curvature", "ellipsoid")


@dataclass(frozen=True)
class _Candidate:
    """An engine at one rate or schedule, on all motions of its part."""

    name: str
    rows: tuple[Row, ...]
    worst: tuple[Row, str]  # the case nearest to the limit or farthest beyond it, and its kind of error
    excess: float  # its error over the limit in this case
    error: float  # largest ratio of its error to the least of any engine, over all motions and both errors

    @property
    def cost(self) -> tuple[float, float]:
        """Processor time per second of motion, µs; then, for schedules with equal time, the sum of their slower
        rates."""
        row = self.rows[0]
        return row.ns_per_step * row.rate_hz * 1e-3, sum(row.schedule_hz[1:])

    @property
    def horizontal(self) -> float:
        return max(row.max_horizontal_error_m for row in self.rows)

    @property
    def drift(self) -> float:
        return max(row.attitude_drift_arcsec_h for row in self.rows)


def picks(comparison: StudyResult) -> list[Pick]:
    """Return the recommended engine of every part that compares engines.

    Returns:
        One pick for each part and each of its sensor sets; none for a part with a single engine at a single rate.
    """
    found = []
    for part in comparison.study.parts:
        if len(part.engines) * len(part.pace) < 2:
            continue
        rows = comparison.of_part(part.title)
        for sensors in part.sensors:
            for variant in part.variants:
                own = [row for row in rows if (row.sensors, row.variant) == (sensors, variant)]
                found.append(_pick(part, sensors, variant, own))
    return found


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
    best = min(candidates, key=lambda one: one.error)
    enough = [one for one in candidates if one.excess <= 1.0]
    # costs that agree to one percent count as equal, because times are measured
    least = min((one.cost[0] for one in enough), default=0.0)
    chosen = min(
        (one for one in enough if one.cost[0] <= 1.01 * least), key=lambda one: (one.cost[1], one.error), default=best
    )
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
    done = [row for row in rows if row.status == "done"]
    least: dict[str, tuple[float, float]] = {}
    for motion in dict.fromkeys(row.motion for row in done):
        here = [row for row in done if row.motion == motion]
        least[motion] = (
            min(row.max_horizontal_error_m for row in here),
            min(row.attitude_drift_arcsec_h for row in here),
        )
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault((*(getattr(row, name) for name in _ENGINE), row.pace), []).append(row)
    dimensions = [name for name in varying(rows) if name in _ENGINE]
    paces = len({row.pace for row in rows}) > 1
    found = []
    for own in groups.values():
        if any(row.status != "done" for row in own):
            continue
        judged = []
        for row in own:
            metres, drift = least[row.motion]
            allowed = ALLOWED_MILES_PER_HOUR * NAUTICAL_MILE * row.duration_s / 3600.0
            judged += [
                (row, " m", row.max_horizontal_error_m, metres, max(allowed, HARDLY_WORSE * metres)),
                (row, " ″/h", row.attitude_drift_arcsec_h, drift, max(ALLOWED_ARCSEC_H, HARDLY_WORSE * drift)),
            ]
        row, unit, error, _, allowed = max(judged, key=lambda one: one[2] / one[4])
        words = " · ".join([str(getattr(own[0], name)) for name in dimensions] or [own[0].algorithm])
        found.append(
            _Candidate(
                f"{words} at {own[0].pace} Hz" if paces else words,
                tuple(own),
                (row, unit),
                error / allowed,
                max(error / max(low, 1e-12) for _, _, error, low, _ in judged),
            )
        )
    return found


def _reason(
    chosen: _Candidate, best: _Candidate, enough: Sequence[_Candidate], candidates: Sequence[_Candidate]
) -> str:
    def said(one: _Candidate) -> str:
        return (
            f"{number_text(one.horizontal)} m and {number_text(one.drift)} ″/h at most, {number_text(one.cost[0])} µs "
            "of processor time per second of motion"
        )

    text = f"{chosen.name}: {said(chosen)}."
    allowed = f"{ALLOWED_MILES_PER_HOUR:g} nmi/h and {ALLOWED_ARCSEC_H / 60.0:g}′/h"
    bars = f"{allowed}, or within 10 % of the least error, on every motion"
    if not enough:
        return f"{text} It has the smallest errors; none of {len(candidates)} stays below {bars}."
    text += f" {len(enough)} of {len(candidates)} stay below {bars}; of these it needs the least computation."
    cheaper = [one for one in candidates if one.excess > 1.0 and one.cost < chosen.cost]
    if cheaper:
        out = min(cheaper, key=lambda one: one.excess)
        row, unit = out.worst
        error = row.max_horizontal_error_m if unit == " m" else row.attitude_drift_arcsec_h
        text += f" Cheaper, but in error by {number_text(error)}{unit} on {row.motion}: {out.name}."
    if best is not chosen:
        text += f" {best.name} has the smallest errors: {said(best)}."
    return text
