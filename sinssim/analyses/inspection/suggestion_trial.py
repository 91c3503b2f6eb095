"""Trial of a suggested scenario on its log: the filter runs without the fixes of regular outages, which judge it.

Where the inertial data agree badly with the fixes, or their noise is larger than assumed, the filter trusts its own
prediction and refuses the fixes that contradict it. A larger noise lets it follow them. The trial takes the least of a
few noises with which the error at the end of the outages is at most that of the fixes alone, a straight line. Where the
innovations are much smaller than their 1σ, the fixes are better than described, and the filter trusts them too little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.analyses.inspection.log_corrections import since
from sinssim.analyses.inspection.stream_findings import Finding, doubt, fact
from sinssim.analyses.inspection.stream_inspection import Inspection
from sinssim.analyses.inspection.velocity_match import seen
from sinssim.errors import SinssimError
from sinssim.progress import Progress, silent
from sinssim.units import number_text

if TYPE_CHECKING:
    from sinssim.estimation.filter_result import Innovations
    from sinssim.logs.recorded_log import RecordedLog
    from sinssim.scenario import Scenario

OUTAGE_S, EVERY_S = 5.0, 20.0
"""Length and period of the outages, s: for as long, the inertial data of a phone are better than a straight line."""
_LONGEST_S = 420.0
"""Longest part of a log that is tried, s: 20 outages; the filter takes about 1 s for a minute of it."""
_ENOUGH, _PASSES = 15, 4
"""Number of outages from which one pass of the filter suffices, and most passes, which withhold different fixes."""
_REFUSED = 0.1
"""Share of refused positions from which the filter does not follow the fixes."""
_FACTORS = (3.0, 10.0, 30.0, 100.0)
"""Larger noises of the inertial data that are tried, as `filter.inertial_noise_factor`."""
_CLEARLY = 1.5
"""Factor by which other settings reduce the error relative to the fixes alone before they are taken."""
_TOO_SMALL = 0.5
"""Size of the innovations in units of their 1σ below which smaller 1σ of the fixes are tried."""
_MORE_MOTION = 2.0
"""Factor by which the way of another part of the log is longer before it is tried instead of the beginning."""
_LEAST_OFFSET = 0.05
"""Offset of the clocks from which it is tried although the motion does not prove it, s."""
Setting = tuple[str, str, float]
"""Table, key and value."""


@dataclass(frozen=True)
class Outcome:
    """What outages show of a scenario: medians over them, m."""

    error: float  # horizontal error of the filter at the end
    sigma: float  # its own 1σ
    alone: float  # error of the straight line through the last fixes before
    outages: int  # number of outages
    refused: float  # share of the positions that the gate refuses
    before: float  # horizontal distance of the filter from the last fix before
    # robust size of the horizontal innovations of positions and of velocities in units of their 1σ; infinite without
    # any
    innovations: tuple[float, float]

    @property
    def good(self) -> bool:
        """Whether the filter follows the fixes, and is no worse than they are alone."""
        return self.error <= self.alone and self.refused < _REFUSED

    @property
    def overconfident(self) -> bool:
        """Whether the filter does not follow the fixes, or its errors are larger than it states."""
        return not self.good and (self.refused >= _REFUSED or self.error > 2.0 * self.sigma)

    @property
    def badness(self) -> float:
        """The error relative to that of the fixes alone; a filter that does not follow them is ten times as bad."""
        return self.error / max(self.alone, 1e-9) * (1.0 if self.refused < _REFUSED else 10.0)

    @property
    def words(self) -> str:
        """The error, and the refused positions if they are many."""
        refused = f", with {100.0 * self.refused:.0f} % of the positions refused" if self.refused >= _REFUSED else ""
        return f"{number_text(self.error)} m{refused}"


@dataclass(frozen=True)
class Trial:
    """The trial of a suggested scenario."""

    plain: Outcome  # what outages show of the scenario as it was
    chosen: Outcome  # the same with the chosen settings
    settings: tuple[Setting, ...] = ()  # the settings

    @property
    def finding(self) -> Finding:
        """The result as a finding."""
        best = self.chosen
        numbers: dict[str, Any] = {
            "outages": best.outages, "outage_error_m": best.error, "outage_sigma_m": best.sigma,
            "outage_fixes_alone_m": best.alone,
        }  # fmt: skip
        text = (
            f"The suggested scenario was run without the fixes of {best.outages} outages of {OUTAGE_S:g} s. The median "
            f"horizontal error at their ends is {best.words}; that of a straight line through the last fixes is "
            f"{number_text(best.alone)} m."
        )
        if best.good:
            return fact("trial", text, **numbers)
        fix = f"The filter states a 1σ of {number_text(best.sigma)} m there. Without fixes, a straight line is better."
        refused = best.refused >= _REFUSED
        if best.before > max(best.alone, 0.5 * best.error) and best.innovations[0] < _TOO_SMALL and not refused:
            text += (
                f" The filter is {number_text(best.before)} m from the last fix already: the errors of the fixes last, "
                "and their 1σ is larger than what changes from fix to fix."
            )
        return doubt("trial", text, fix, **numbers)

    def written(self, text: str) -> str:
        """Return the text of the scenario with the settings, and with the result in a comment before its first key."""
        for table, key, value in self.settings:
            why = f"by trial: without it, the error in outages of {OUTAGE_S:g} s was {self.plain.words}"
            text = text.replace(f"[{table}]\n", f"[{table}]\n{key} = {value!r}  # {why}\n", 1)
        start = text.index("name = ") if self.chosen.good else 0  # doubts about the navigation come before the name
        return f"# {self.finding.sentence}\n{text[start:]}"


def try_suggestion(
    text: str, folder: Path, inspection: Inspection, progress: Progress = silent
) -> Trial | SinssimError | None:
    """Run a suggested scenario, whose paths are relative to a folder, without the fixes of regular outages, and with
    other settings where they are needed. Return the trial; the error of a scenario that does not run; None if no outage
    can be judged."""
    trial = _Attempts(text, folder, inspection, progress)
    try:
        plain = trial.outcome(())
    except SinssimError as error:
        return error
    if plain is None:
        return None
    best = Trial(plain, plain)
    if abs(inspection.unproven_late) > _LEAST_OFFSET:
        offset: Setting = ("log.imu", "time_offset_s", round(-inspection.unproven_late, 2))
        best = trial.better(best, (offset,))
    if settings := trial.better_fixes(best.chosen):
        best = trial.better(best, (*best.settings, *settings))
    outset = best
    for factor in _FACTORS if outset.chosen.overconfident else ():
        best = trial.better(best, (*outset.settings, ("filter", "inertial_noise_factor", factor)))
        if best.chosen.good:
            break
    return best


class _Attempts:
    """The attempts with one suggested scenario: its text and folder, what is inspected, and the log once it is read."""

    def __init__(self, text: str, folder: Path, inspection: Inspection, progress: Progress) -> None:
        self.text, self.folder, self.inspection, self.progress = text, folder, inspection, progress
        self.log: RecordedLog | None = None
        self.count = 0

    def outcome(self, settings: tuple[Setting, ...]) -> Outcome | None:
        """Return what outages show with some settings; None if no outage can be judged."""
        from sinssim.scenario.load import scenario_of_text

        self.progress("Trying the scenario in outages", self.count / (len(_FACTORS) + 2))
        self.count += 1
        overrides = [f"{table}.{key}={value}" for table, key, value in settings]
        scenario = scenario_of_text(self.text, self.folder, overrides)
        if scenario.log is None or scenario.log.gnss is None or scenario.filter is None:
            return None
        if any(table.startswith("log") for table, _, _ in settings):
            return _outcome(_short(scenario, self.inspection), None)[0]
        outcome, self.log = _outcome(_short(scenario, self.inspection), self.log)
        return outcome

    def better_fixes(self, outcome: Outcome) -> tuple[Setting, ...]:
        """Return the factors of the 1σ of fixes that the innovations show to be too large."""
        keys = ("sigma_factor", "velocity_sigma_factor")
        return tuple(
            ("log.gnss", key, float(f"{size:.2g}"))
            for key, size in zip(keys, outcome.innovations, strict=True)
            if 0.0 < size < _TOO_SMALL and f"\n{key} = " not in self.text
        )

    def better(self, best: Trial, settings: tuple[Setting, ...]) -> Trial:
        """Return a trial with the settings if they are clearly better or good, the best one so far otherwise."""
        try:
            outcome = self.outcome(settings)
        except SinssimError:
            return best
        if outcome is None or not (
            (outcome.good and not best.chosen.good) or _CLEARLY * outcome.badness < best.chosen.badness
        ):
            return best
        return Trial(best.plain, outcome, settings)


def _short(scenario: Scenario, inspection: Inspection) -> Scenario:
    """Return a scenario that ends after the part that is tried, and whose filter runs forwards only."""
    section, settings = scenario.log, scenario.filter
    assert section is not None
    assert settings is not None
    assert inspection.inertial is not None
    update: dict[str, object] = {"outages": None}
    begin, end = section.from_s or 0.0, section.to_s or float(np.ptp(inspection.inertial.time))
    if begin + _LONGEST_S < end:
        if not section.start.is_given and scenario.aiding is None:  # both hold for one beginning
            begin = _moving(inspection, begin, end)
        update |= {"from_s": begin, "to_s": begin + _LONGEST_S} if begin else {"to_s": _LONGEST_S}
    forwards = settings.model_copy(update={"smooth": False, "backward": False, "diagnose": False})
    return scenario.model_copy(update={"log": section.model_copy(update=update), "filter": forwards})


def _moving(inspection: Inspection, begin: float, end: float) -> float:
    """Return where the part that is tried begins, s: a vehicle that stands for a long time shows nothing at first."""
    fixes = inspection.fixes
    curve = None if fixes is None else seen(fixes)
    if curve is None:
        return begin
    time = np.array([since(inspection, t) for t in curve.time])
    way = np.append(0.0, np.cumsum(np.diff(time) * curve.speed[1:]))
    begins = np.append(begin, time[(time > begin) & (time < end - _LONGEST_S)])
    ways = np.interp(begins + _LONGEST_S, time, way) - np.interp(begins, time, way)
    longest = int(np.argmax(ways))
    return round(float(begins[longest]), 3) if ways[longest] > _MORE_MOTION * ways[0] else begin


def _robust_size(innovations: Sequence[Innovations], kind: str) -> float:
    """Return the size of the horizontal innovations of a kind in units of their 1σ; infinite without any."""
    parts = [i.value[:, :2] / i.sigma_at(slice(None))[:, :2] for i in innovations if i.kind == kind]
    # the median of |x| is 0.6745 σ
    return float(np.nanmedian(np.abs(np.concatenate(parts)))) / 0.6745 if parts else float("inf")


def _outcome(scenario: Scenario, log: RecordedLog | None) -> tuple[Outcome | None, RecordedLog]:
    """Return what outages show of a scenario, None if there is none, and the log, which may be given."""
    from sinssim.logs.log_settings import Outages
    from sinssim.simulation.navigation_stage import recorded_start
    from sinssim.simulation.recorded_filter_run import (
        outage_errors,
        outage_pass,
        outage_reference,
        prepare,
        straight_line_error,
    )
    from sinssim.simulation.truth_and_sensors import RecordedMotion, sense_recorded

    prepared = prepare(scenario, log)
    log = prepared.log
    reference = outage_reference(replace(prepared, log=replace(log, reference=None)))
    if reference is None or log.fixes is None:
        return None, log
    sensed = sense_recorded(prepared.scenario, RecordedMotion(prepared, log.reference))
    start, end = float(log.imu.time[0]), float(log.imu.time[-1])
    rows: list[tuple[float, ...]] = []
    innovations: list[Innovations] = []
    for number in range(_PASSES):
        regular = Outages(length_s=OUTAGE_S, every_s=EVERY_S, first_s=start + EVERY_S + number * OUTAGE_S)
        spans = regular.spans(start, end)
        estimate = outage_pass(sensed.imu, prepared, recorded_start(prepared.scenario, sensed), spans)
        error = reference.error_of(estimate.solution)
        known = np.isfinite(error.horizontal)
        for row in outage_errors(estimate, error, None, spans):
            alone = straight_line_error(log.fixes, row["from_s"], row["at_s"])
            before = error.horizontal[known & (error.time <= row["from_s"])][-1:]
            rows.append((row["horizontal_error_m"], row["horizontal_sigma_m"], alone, *before))
        beyond = [span for span in spans if span[1] > estimate.time[-1]]  # after a divergence
        rows += [(np.inf, np.inf, straight_line_error(log.fixes, *span), np.inf) for span in beyond]
        innovations += estimate.innovations
        if len(rows) >= _ENOUGH:
            break
    judged = np.array([row for row in rows if len(row) == 4 and np.isfinite(row[2])])
    if not len(judged):
        return None, log
    error_m, sigma, alone, before_m = (float(median) for median in np.median(judged, axis=0))
    accepted = np.concatenate([i.accepted for i in innovations if i.kind == "gnss-position"] or [np.ones(1, bool)])
    sizes = _robust_size(innovations, "gnss-position"), _robust_size(innovations, "gnss-velocity")
    return Outcome(error_m, sigma, alone, len(judged), float(np.mean(~accepted)), before_m, sizes), log
