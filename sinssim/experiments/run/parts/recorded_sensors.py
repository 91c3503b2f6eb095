"""Recorded sensors, [log]: the motion, what the solutions are compared with, and what the filter estimates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation
from sinssim.charts import WIDE, Axis, Chart, Charts, Line, Rule, over
from sinssim.data import NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.exhibits import Beside, Item, Section, Sentence, Table
from sinssim.experiments.run.error_exhibits import (
    Compared,
    error_exhibits,
    error_table,
    failure_exhibits,
    note_on_errors,
    schuler_period,
    singularity_exhibits,
)
from sinssim.experiments.run.filter_exhibits import THREE, mark_at, spread_of
from sinssim.experiments.run.motion_exhibits import (
    between_text,
    distance_text,
    facts_table,
    ground_speed,
    mark_of_many,
    motion_charts,
    place_text,
)
from sinssim.experiments.run.run_result import Part
from sinssim.experiments.run.sensor_exhibits import recorded_readings
from sinssim.recording import style
from sinssim.recording.style import thinned
from sinssim.recording.track_map import NOTE, Track, track_map
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import RecordedMotion
from sinssim.units import DEG, LENGTH_SCALE, UG, Scale, duration_words, fixed, suiting

if TYPE_CHECKING:
    from sinssim.data import NavSolution
    from sinssim.estimation import Estimate
    from sinssim.experiments.run.summary_types import ErrorNumbers, LogNumbers, RunSummary
    from sinssim.logs.recorded_log import RecordedLog
    from sinssim.simulation.truth_comparison import Aided
    from sinssim.strapdown.navigation_error import NavError


@dataclass(frozen=True)
class Log(Part["LogNumbers"]):
    """The recording of a run on recorded sensors."""

    name, title, place = "log", "The recording", "motion"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the sensors are recorded."""
        return isinstance(run.truth, RecordedMotion)

    def numbers(self) -> LogNumbers:
        """Return what is known of the recording, for `summary.json`."""
        motion = self.run.truth
        assert isinstance(motion, RecordedMotion)
        log, reference = motion.prepared.log, motion.reference
        return {
            "reference_file": None if log.reference is None else log.reference.name,
            "compared_with": None if reference is None else reference.name,
            "knows": [] if reference is None else list(reference.knows),
            "notes": [*log.notes, motion.prepared.start.words],
            "time_0_gps_s": None if log.zero is None else round(log.zero.seconds + log.zero.fraction, 6),
        }

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield remarks on the recording, and what the solutions are compared with."""
        yield from map(Sentence, self.entry["notes"])
        yield Sentence(compared_words(self.entry))

    def exhibits(self) -> Iterator[Item]:
        """Yield map, facts and plots of the recorded motion, as the best solution has it, and the inertial data."""
        run, log = self.run, _log(self.run)
        name, best = best_solution(run, self.aided)
        state = _state(best)
        color = style.COLORS.get(name, style.COLORS["quaternion"])
        tracks = [Track.of(name, best.time, best, style.tint(color) if log.reference is not None else color)]
        if (reference := log.reference) is not None:
            tracks.append(Track.of("reference", reference.time, reference, "truth"))
        spread = spread_of(self.aided) if name == "aided" and self.aided is not None else None
        shown = track_map(tracks, WGS84, outages=log.outages, spread=spread, note=NOTE.format(name))
        yield Beside([shown, self._facts(name, best)])
        marks = _outage_marks(log)
        yield from motion_charts(best.time, state, marks, run.scenario.output.angles)
        yield Section("Inertial data", list(recorded_readings(run.sensed.measured, marks)))

    def _facts(self, name: str, best: NavSolution) -> Table:
        """Return what the motion is in a few numbers, and how many measurements there are."""
        state, time = _state(best), self.run.time
        roll, pitch, _ = (angle / DEG for angle in rotation.euler_from_quaternion(state.q_nb))
        speed = ground_speed(state)
        sensed = [readings.measurements for readings in _log(self.run).sensed]
        return facts_table(f"the {name} solution", [
            ("duration", duration_words(float(time[-1] - time[0]))),
            ("distance over ground (∫ ground speed dt)", distance_text(best.time, speed)),
            ("start", place_text(state, 0)),
            ("end", place_text(state, -1)),
            ("height", between_text(state.height, 1, "m")),
            ("ground speed", between_text(speed, 1, "m/s")),
            ("roll of the IMU", between_text(roll, 1, "°")),
            ("pitch of the IMU", between_text(pitch, 1, "°")),
            *((f"recorded, {m.label}", f"{len(m)} measurements") for m in sensed),
        ])  # fmt: skip


def best_solution(run: Navigated, aided: Aided | None) -> tuple[str, NavSolution]:
    """Return the solution that stands for the recorded motion: smoothed, else aided, else the first one."""
    if aided is not None and len(aided.estimate.time) > 1:
        smoothed = aided.estimate.smoothed
        if smoothed is not None and aided.estimate.divergence is None:
            return "smoothed", smoothed.solution
        return "aided", aided.estimate.solution
    return next(iter(run.solutions.items()))


def compared_words(about: LogNumbers) -> str:
    """Return a sentence on what the solutions are compared with."""
    against, knows = about["compared_with"], about["knows"]
    if about["reference_file"] is not None:
        missing = [what for what in ("velocity", "attitude") if what not in knows]
        without = f"; it has no {' and no '.join(missing)}" if missing else ""
        return f"Errors are differences from the reference {against}{without}."
    if against is None:
        return "There is no reference and only one solution, so the errors are unknown."
    return f"There is no reference: differences from {against} are shown, which is not the truth."


def recorded_errors(run: Navigated, aided: Aided | None, summary: RunSummary) -> Iterator[Item]:
    """Yield the errors against the reference, or the differences from one of the solutions."""
    log, algorithms = summary["log"], summary["algorithms"]
    against = log["compared_with"]
    items = list(failure_exhibits(summary["failures"]))
    if against is not None:
        items += [error_table(algorithms), note_on_errors(against)]
        if summary["failures"].keys() != algorithms.keys():
            period = schuler_period(_state(best_solution(run, aided)[1]), WGS84)
            items += error_exhibits(Compared(run.time, known_errors(run.errors), "north"), period)
    title = "Navigation errors" if log["reference_file"] is not None else "Differences of the solutions"
    yield Section(title, items, on=("page",))
    yield Section("Singular attitudes", list(singularity_exhibits(summary["singularities"])), on=("page",))


def known_errors(errors: Mapping[str, NavError]) -> dict[str, NavError]:
    """Return errors at the rows at which the position is known."""
    known = {}
    for name, error in errors.items():
        rows = np.flatnonzero(np.isfinite(error.position_ned).all(axis=1))
        if len(rows) > 1:
            known[name] = error.rows(rows)
    return known


def _state(solution: NavSolution) -> NavState:
    s = solution
    return NavState(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)


def _log(run: Navigated) -> RecordedLog:
    """Return the recording of a run on recorded sensors."""
    assert isinstance(run.truth, RecordedMotion)
    return run.truth.prepared.log


_NAMED_OUTAGES = 4
"""Number of outages up to which each is named at the top of a plot."""


def _outage_marks(log: RecordedLog) -> list[Rule]:
    if len(log.outages) > _NAMED_OUTAGES:
        return [mark_of_many(begin) for begin, _ in log.outages]
    return [mark_at(begin, "outage") for begin, _ in log.outages]


def after_filter(motion: RecordedMotion, aided: Aided, span: tuple[float, float]) -> Iterator[Item]:
    """Yield the difference from the reference with the uncertainty of both, and the estimated errors of the IMU."""
    log, x = motion.prepared.log, over(span)
    if (reference := log.reference) is not None and reference.position_sigma is not None:
        rows = thinned(len(aided.estimate.time))
        time, sigma = aided.estimate.time[rows], aided.estimate.sigma[rows]
        stated = reference.sigma_at(time)
        assert stated is not None
        lines = (
            Line(label="aided minus reference, horizontal", x=time, y=aided.error_at(rows).horizontal, color="aided"),
            Line(label="1σ of the filter", x=time, y=np.hypot(sigma[:, 0], sigma[:, 1]), color="bound"),
            Line(label="1σ that the reference states", x=time, y=np.hypot(stated[:, 0], stated[:, 1]), color="truth",
                 dash="--"),
        )  # fmt: skip
        y = Axis(units=fixed(*suiting(LENGTH_SCALE, lines[0].y)), low=0.0)
        chart = Chart(key="filter/reference", title="Horizontal", x=x, y=y, marks=(*_outage_marks(log), *lines))
        title = "Difference from the reference, and the uncertainty of both"
        yield Section(title, [Charts("reference", ((chart,),), WIDE)])
    charts = list(_estimates(aided.estimate, x))
    if charts:
        rows_of = tuple(tuple(charts[k : k + 3]) for k in range(0, len(charts), 3))
        size = (THREE[0], len(rows_of) * THREE[1])
        drawn = Charts("estimates", rows_of, size, widths=(1.0, 1.0, 1.0))
        yield Section("Estimated errors of the IMU, with ±1σ", [drawn])


ESTIMATES: dict[str, tuple[str, Scale]] = {
    "gyro bias": ("Gyro bias", fixed("deg/s", DEG)),
    "accelerometer bias": ("Accelerometer bias", fixed("mg", 1e3 * UG)),
    "gyro scale": ("Gyro scale factor", fixed("%", 1e-2)),
    "accelerometer scale": ("Accelerometer scale factor", fixed("%", 1e-2)),
    "gyro instability": ("Gyro instability", fixed("deg/s", DEG)),
    "accelerometer instability": ("Accelerometer instability", fixed("mg", 1e3 * UG)),
}
"""Titles and units of the estimated errors of the inertial sensors."""


def _estimates(estimate: Estimate, x: Axis) -> Iterator[Chart]:
    """Yield the estimated errors of the inertial sensors with their bands."""
    rows = thinned(len(estimate.time))
    time = estimate.time[rows]
    for name, (title, unit) in ESTIMATES.items():
        if name not in estimate.parameters or not len(time):
            continue
        values, sigma = estimate.parameters[name][rows], estimate.sigma[rows][:, estimate.model.slices[name]]
        if not sigma.any():
            continue
        lines: list[Line] = []
        for axis, value, spread in zip("xyz", values.T, sigma.T, strict=False):
            pale = style.tint(style.COLORS[axis])
            lines += [
                Line(x=time, y=end, color=pale, weight="hair", counts=False) for end in (value + spread, value - spread)
            ]
            lines.append(Line(label=axis, x=time, y=value, color=axis))
        key = f"filter/estimates/{name.replace(' ', '_')}"
        yield Chart(key=key, title=title, x=x, y=Axis(units=unit), marks=tuple(lines))
