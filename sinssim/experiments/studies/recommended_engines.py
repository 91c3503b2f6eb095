"""The recommended engine of each part of a study: the cheapest of those that are accurate enough on every motion.

Its errors are negligible beside those of good sensors, or hardly larger than those of the best engine. On every motion
the largest horizontal error must be at most a tenth of a nautical mile per hour, or 1.1 of the least, and the drift of
the attitude, as for the claims, at most 0.3′ per hour, or 1.1 of the least. With ideal sensors the first limit usually
decides. With real sensors, whose errors are common to all engines, it is mostly the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sinssim.experiments.studies.study_charts import varying
from sinssim.experiments.studies.study_results import ALLOWED_ARCSEC_H, Pick, Row, StudyResult, by
from sinssim.experiments.studies.study_schema import Part
from sinssim.formatting import number_text
from sinssim.units import NAUTICAL_MILE

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
