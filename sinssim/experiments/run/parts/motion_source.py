"""Where the motion of some runs comes from: a track, [track], or recorded sensors, [log]; and the gravity along it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sinssim import rotation
from sinssim.charts import PAIR, WIDE, Axis, Chart, Charts, Line, Rule, over
from sinssim.data import NavSolution, rows_of
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import Estimate
from sinssim.exhibits import Beside, Column, Item, Section, Sentence, Table
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
from sinssim.experiments.run.summary_types import ErrorNumbers, LogNumbers, RunSummary
from sinssim.recording import style
from sinssim.recording import track_map as maps
from sinssim.recording.result import Json
from sinssim.recording.streams import Stream, gravity_stream
from sinssim.recording.style import thinned
from sinssim.recording.track_map import NOTE, track_map
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import RecordedMotion, Truth
from sinssim.simulation.truth_comparison import Aided
from sinssim.strapdown.navigation_error import NavError
from sinssim.truth.true_gravity_disturbance import Disturbed, GravityValues, gravity_numbers, gravity_values
from sinssim.units import ARCSEC, DEG, LENGTH_SCALE, MGAL, UG, Scale, duration_words, fixed, number_text, suiting

if TYPE_CHECKING:
    from sinssim.logs.recorded_log import RecordedLog
    from sinssim.truth.track_curve import TrackFit


@dataclass(frozen=True)
class Track(Part[Mapping[str, Json]]):
    """The track of a run."""

    name, place = "track", "motion"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true motion is made from a track."""
        return run.scenario.track is not None

    @property
    def fit(self) -> TrackFit:
        """How the curve fits the track's samples."""
        scenario = self.run.scenario
        assert scenario.track is not None
        return scenario.track.prepared(scenario.truth).fit

    def numbers(self) -> Mapping[str, Json]:
        """Return how far the motion passes from the track, for `summary.json`."""
        from sinssim.truth.track_curve import fit_numbers

        return fit_numbers(self.fit)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield how the curve fits the samples, and what is assumed."""
        from sinssim.truth.track_curve import fit_sentences

        yield from (Sentence(sentence, on=("console",)) for sentence in fit_sentences(self.fit))

    def exhibits(self) -> Iterator[Item]:
        """Yield the source of the curve, and the quality of the fit."""
        from sinssim.truth.track_curve import ANGLE, HORIZONTAL, VERTICAL, fit_lines

        track, fit, truth = self.run.scenario.track, self.fit, self.run.truth
        assert track is not None
        assert isinstance(truth, Truth)
        planned, title = bool(track.waypoints), "planned route" if track.waypoints else "recorded track"
        facts = [("made from", track.what), ("vehicle", track.vehicle), *fit_lines(fit)]
        items: list[Item] = [
            *(Sentence(sentence, "warning") for sentence in fit.warnings),
            Table((Column(title, words=True), Column("", words=True)), facts),
            *(Sentence(sentence, "note") for sentence in fit.notes),
        ]
        channels, x = truth.trajectory.channels, over((truth.trajectory.start, truth.trajectory.end))
        if not planned and HORIZONTAL in channels:
            lines = tuple(
                Line(label=label, x=channels[name].time, y=channels[name].values, color=color)
                for label, name, color in (("horizontal", HORIZONTAL, "y"), ("vertical, up", VERTICAL, "z"))
            )
            charts = [Chart(key="track/distance", title="Distance of the curve from the samples", x=x,
                            y=Axis(units=fixed("m"), least=1e-3), marks=lines)]  # fmt: skip
            if ANGLE in channels:
                angle = Line(label="angle", x=channels[ANGLE].time, y=channels[ANGLE].values, color="x")
                charts.append(Chart(key="track/angle", title="Angle from the recorded attitude", x=x,
                                    y=Axis(units=fixed("deg", DEG), least=1e-4 * DEG), marks=(angle,)))  # fmt: skip
            size = (0.5 * PAIR[0] * len(charts), PAIR[1])
            items.append(Charts("track", (tuple(charts),), size, on=("page",)))
        yield Section(f"The {title}", items)


@dataclass(frozen=True)
class TrueGravity(Part[Mapping[str, Json]]):
    """The gravity field of a run whose true field is not normal gravity."""

    name, place = "gravity", "motion"

    @classmethod
    def belongs_to(cls, run: Navigated) -> bool:
        """Return whether the true field is not normal gravity."""
        return isinstance(run.truth, Truth) and isinstance(run.truth.trajectory, Disturbed)

    @property
    def _motion(self) -> Disturbed:
        assert isinstance(self.run.truth, Truth)
        assert isinstance(self.run.truth.trajectory, Disturbed)
        return self.run.truth.trajectory

    @cached_property
    def values(self) -> GravityValues:
        """The field along the motion."""
        return gravity_values(self._motion)

    def numbers(self) -> Mapping[str, Json]:
        """Return deflections and anomalies along the motion, for `summary.json`."""
        return gravity_numbers(self._motion)

    def streams(self) -> Iterator[Stream]:
        """Yield the field along the motion."""
        yield gravity_stream(self.values)

    def brief(self, algorithms: Mapping[str, ErrorNumbers]) -> Iterator[Item]:
        """Yield the size of the field along the motion, and the part of it that the navigator knows."""
        v, degree = self.values, self.run.scenario.navigation.gravity_degree
        north, east, down = (number_text(float(np.sqrt(np.mean(a**2)))) for a in (
            v.xi / ARCSEC, v.eta / ARCSEC, v.disturbance / MGAL
        ))  # fmt: skip
        known = "normal gravity alone" if degree is None else f"the field to degree {degree}"
        yield Sentence(
            f"True gravity along the motion: deflection of the vertical {north} arcsec to the north and {east} arcsec "
            f"to the east, disturbance {down} mGal, rms; the navigator knows {known}.", on=("console",),
        )  # fmt: skip

    def exhibits(self) -> Iterator[Item]:
        """Yield deflections and disturbance of gravity over time."""
        v = self.values
        x, arcsec, mgal = over((float(v.time[0]), float(v.time[-1]))), fixed("arcsec", ARCSEC), fixed("mGal", MGAL)
        deflections = (
            Line(label="ξ, north", x=v.time, y=v.xi, color="x"), Line(label="η, east", x=v.time, y=v.eta, color="y"),
        )  # fmt: skip
        down = (Line(label="gravity disturbance, down", x=v.time, y=v.disturbance, color="z"),)
        yield Charts("gravity", ((
            Chart(key="gravity/deflection", title="Deflection of the vertical", x=x,
                  y=Axis(units=arcsec, least=1e-3 * ARCSEC), marks=deflections),
            Chart(key="gravity/disturbance", title="Gravity beyond normal gravity", x=x,
                  y=Axis(units=mgal, least=1e-3 * MGAL), marks=down),
        ),), PAIR, on=("page",))  # fmt: skip


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
        state = rows_of(best, slice(None))
        color = style.COLORS.get(name, style.COLORS["quaternion"])
        tracks = [maps.Track.of(name, best.time, best, style.tint(color) if log.reference is not None else color)]
        if (reference := log.reference) is not None:
            tracks.append(maps.Track.of("reference", reference.time, reference, "truth"))
        spread = spread_of(self.aided) if name == "aided" and self.aided is not None else None
        shown = track_map(tracks, WGS84, outages=log.outages, spread=spread, note=NOTE.format(name))
        yield Beside([shown, self._facts(name, best)])
        marks = _outage_marks(log)
        yield from motion_charts(best.time, state, marks, run.scenario.output.angles)
        yield Section("Inertial data", list(recorded_readings(run.sensed.measured, marks)))

    def _facts(self, name: str, best: NavSolution) -> Table:
        """Return what the motion is in a few numbers, and how many measurements there are."""
        state, time = rows_of(best, slice(None)), self.run.time
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
            period = schuler_period(rows_of(best_solution(run, aided)[1], slice(None)), WGS84)
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
