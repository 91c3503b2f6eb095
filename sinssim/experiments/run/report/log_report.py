"""The report of a run on recorded sensors: a self-contained HTML page with its drawings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import WGS84
from sinssim.experiments.run.parts.log import best_solution
from sinssim.experiments.run.report.errors import Compared, error_plots, error_tables, failure, singularity_table
from sinssim.experiments.run.report.filter import filter_section
from sinssim.experiments.run.report.flight import between_text, motion_plots, place_text
from sinssim.experiments.run.report.run_report import STYLE, ended, made, schuler_period, sections, sentences
from sinssim.experiments.run.report.track import draw_map
from sinssim.recording import style
from sinssim.recording.report import page, plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line, Mark
from sinssim.recording.scales import thinned
from sinssim.scales import LENGTHS, duration_words, suiting
from sinssim.sensors.imu.grades import grade_name
from sinssim.simulation.truth import RecordedMotion
from sinssim.strapdown.nav_error import NavError

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.experiments.run.part import Part
    from sinssim.experiments.run.result import Reached, Run
    from sinssim.logs.load import RecordedLog
    from sinssim.scenario import Scenario
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.navigation import Navigated

_WIDTH, _HEIGHT = 376, 150
_AXES = ("x", "y", "z")
_NAMED_OUTAGES = 4
"""Number of outages up to which each is named at the top of a plot."""


def log_report(reached: Reached | Run, summary: Mapping[str, Any]) -> str:
    """Return the report of a run on recorded sensors.

    Args:
        summary: contents of `summary.json`.
    """
    scenario, run, aided = reached.scenario, reached.navigated, reached.aided
    assert run is not None  # it is finished
    span = (float(run.time[0]), float(run.time[-1]))
    body = [f"<h1>{words(scenario.name)}</h1>", f'<p class="lead">{words(scenario.description)}</p>']
    if summary["status"] != "finished":
        body.append(f'<p class="broken"><strong>The run {ended(summary)}</strong> {words(summary["message"])}</p>')
    body += [f"<p>{words(sentence)}</p>" for sentence in _in_short(scenario, summary, reached.parts)]
    body += ["<h2>The recording</h2>", *_recording(run, aided, span)]
    about = summary["log"]
    against = about["compared_with"] or "nothing"
    what = "Navigation errors" if about["reference_file"] is not None else "Differences of the solutions"
    body += [f"<h2>{what}</h2>", *map(failure, summary["failures"].items())]
    if about["compared_with"] is not None:
        body += error_tables(summary["algorithms"], against=against)
        if summary["failures"].keys() != summary["algorithms"].keys():
            body += error_plots(Compared(run.time, _known(run.errors), "north"), _schuler(run, aided))
    body += ["<h2>Singular attitudes</h2>", singularity_table(summary["singularities"])]
    if aided is not None and "filter" in summary:
        body += ["<h2>The aided solution</h2>", *filter_section(aided, summary, span)]
        body += _uncertainty_of_reference(_log(run), aided, span)
        body += _estimates(aided.estimate, span)
        body += sections(reached, "filter")
    body += ["<h2>How the run was computed</h2>", *made(scenario, summary)]
    body += ["<h2>Scenario</h2>", f"<pre>{page.verbatim(scenario.to_toml(reached.about_filter).strip())}</pre>"]
    return page.page(f"{scenario.name}: run", body, STYLE)


def _in_short(scenario: Scenario, summary: Mapping[str, Any], parts: Mapping[str, Part]) -> Iterator[str]:
    """Yield the main results in a few sentences."""
    duration = summary["end_s"] - summary["start_s"]
    yield (
        f"Recorded sensors, {duration_words(duration)} at {scenario.imu.rate_hz:g} Hz; the filter assumes the "
        f"grade {grade_name(scenario.imu.grade)} with the changes in [imu]. Navigation in the frame "
        f"“{scenario.navigation.frame}”."
    )
    for part in parts.values():
        yield from sentences(part.brief(summary["algorithms"]))


def _known(errors: Mapping[str, NavError]) -> dict[str, NavError]:
    """Return errors at the rows at which the position is known."""
    found = {}
    for name, error in errors.items():
        rows = np.flatnonzero(np.isfinite(error.position_ned).all(axis=1))
        if len(rows) > 1:
            found[name] = NavError(
                error.time[rows], error.position_ned[rows], error.velocity_ned[rows], error.attitude[rows]
            )
    return found


def _state(solution: NavSolution) -> NavState:
    s = solution
    return NavState(s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb)


def _schuler(run: Navigated, aided: Aided | None) -> float:
    return schuler_period(_state(best_solution(run, aided)[1]), WGS84)


def _log(run: Navigated) -> RecordedLog:
    """Return the recording of a run on recorded sensors."""
    assert isinstance(run.truth, RecordedMotion)
    return run.truth.prepared.log


def _recording(run: Navigated, aided: Aided | None, span: tuple[float, float]) -> Iterator[str]:
    """Yield map, facts and plots of the recorded motion, as the best solution has it."""
    name, best = best_solution(run, aided)
    state, log = _state(best), _log(run)
    tracks: dict[str, NavSolution] = {}
    if (reference := log.reference) is not None:
        nothing = np.zeros(len(reference.time))
        tracks["reference"] = NavSolution(
            reference.time, reference.latitude, reference.longitude, reference.height,
            np.zeros((len(nothing), 3)), np.tile((1.0, 0.0, 0.0, 0.0), (len(nothing), 1)), nothing,
        )  # fmt: skip
    colors = [
        style.css(style.tint(style.COLORS.get(name, style.COLORS["quaternion"]))),
        style.css(style.COLORS["truth"]),
    ]
    colors = colors[: 1 + len(tracks)]
    chart = draw_map(best.time, state, tracks, colors, WGS84, name=name, outages=log.outages)
    roll, pitch, _ = (angle / units.DEG for angle in rotation.euler_from_quaternion(state.q_nb))
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    distance = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(best.time)))
    facts = [
        ("duration", duration_words(span[1] - span[0])),
        ("distance over ground (∫ ground speed dt)", f"{distance / 1e3:.3f} km"),
        ("start", place_text(state, 0)),
        ("end", place_text(state, -1)),
        ("height", between_text(state.height, 1, "m")),
        ("ground speed", between_text(speed, 1, "m/s")),
        ("roll of the IMU", between_text(roll, 1, "°")),
        ("pitch of the IMU", between_text(pitch, 1, "°")),
        *((f"recorded, {m.label}", f"{len(m)} measurements") for m in (one.measurements for one in log.sensed)),
    ]
    listed = table((f"the {name} solution", ""), [(words(k), f'<td class="text">{words(v)}</td>') for k, v in facts])
    yield (
        f'<div class="pair"><div>{chart}<p class="note">Azimuthal equidistant projection about the middle of '
        "the track, where the axes point east and north. Dotted: meridians and parallels.</p></div>"
        f"<div>{listed}</div></div>"
    )
    marks = _outage_marks(log)
    yield from motion_plots(best.time, state, marks, run.scenario.output.angles)
    yield "<h3>Inertial data</h3>" + '<div class="pair">'
    yield from _readings(run, span, marks)
    yield "</div>"


def _outage_marks(log: RecordedLog) -> list[Mark]:
    outages = log.outages
    if len(outages) > _NAMED_OUTAGES:
        return [Mark(begin, "", faint=True) for begin, _ in outages]
    return [Mark(begin, "outage") for begin, _ in outages]


def _readings(run: Navigated, span: tuple[float, float], marks: list[Mark]) -> Iterator[str]:
    interval = np.diff(run.time)[:, None]
    colors = [style.css(color) for color in style.colors(_AXES)]
    for title, unit, rows in (
        ("Inertial angular rate", "deg/s", run.sensed.measured.dtheta / interval / units.DEG),
        ("Specific force", "m/s²", run.sensed.measured.dvel / interval),
    ):
        lines = [Line(axis, run.time[1:], rows[:, i], colors[i], 0.8) for i, axis in enumerate(_AXES)]
        yield plot.plot(title, unit, lines, span, marks=marks)


def _uncertainty_of_reference(log: RecordedLog, aided: Aided, span: tuple[float, float]) -> Iterator[str]:
    """Draw the horizontal difference from the reference with the reference's own 1σ and the filter's."""
    reference = log.reference
    if reference is None or reference.position_sigma is None:
        return
    rows = thinned(len(aided.estimate.time))
    time = aided.estimate.time[rows]
    error, own = aided.error_at(rows).horizontal, reference.sigma_at(time)
    assert own is not None
    of_filter = np.hypot(aided.estimate.sigma[rows, 0], aided.estimate.sigma[rows, 1])
    of_reference = np.hypot(own[:, 0], own[:, 1])
    unit, size = suiting(LENGTHS, error)
    yield "<h3>Difference from the reference, and the uncertainty of both</h3>"
    lines = [
        Line("aided minus reference, horizontal", time, error, style.css(style.COLORS["aided"]), 1.2, "", size),
        Line("1σ of the filter", time, of_filter, style.css(style.COLORS["bound"]), 1.4, "", size),
        Line("1σ that the reference states", time, of_reference, style.css(style.COLORS["truth"]), 1.4, "6 4", size),
    ]
    yield plot.plot("Horizontal", unit, lines, span, marks=_outage_marks(log), width=1140, height=220, from_zero=True)


_ESTIMATES = {
    "gyro bias": ("Gyro bias", "deg/s", units.DEG),
    "accelerometer bias": ("Accelerometer bias", "mg", 1e3 * units.UG),
    "gyro scale": ("Gyro scale factor", "%", 1e-2),
    "accelerometer scale": ("Accelerometer scale factor", "%", 1e-2),
    "gyro instability": ("Gyro instability", "deg/s", units.DEG),
    "accelerometer instability": ("Accelerometer instability", "mg", 1e3 * units.UG),
}


def _estimates(estimate: Estimate, span: tuple[float, float]) -> Iterator[str]:
    """Draw the estimated errors of the inertial sensors with their bands."""
    own = [name for name in _ESTIMATES if name in estimate.parameters]
    if not own or not len(estimate.time):
        return
    rows = thinned(len(estimate.time))
    colors = [style.css(color) for color in style.colors(_AXES)]
    pale = [style.css(style.tint(color)) for color in style.colors(_AXES)]
    yield '<h3>Estimated errors of the IMU, with ±1σ</h3><div class="three">'
    for name in own:
        title, unit, size = _ESTIMATES[name]
        values, sigma = estimate.parameters[name][rows], estimate.sigma[rows][:, estimate.model.slices[name]]
        if not sigma.any():
            continue
        time, lines = estimate.time[rows], []
        for i, axis in enumerate(_AXES[: values.shape[1]]):
            lines += _band(time, values[:, i], sigma[:, i], pale[i], size)
            lines.append(Line(axis, time, values[:, i], colors[i], 1.3, "", size))
        yield plot.plot(title, unit, lines, span, width=_WIDTH, height=_HEIGHT)
    yield "</div>"


def _band(time: Array, values: Array, sigma: Array, color: str, size: float) -> list[Line]:
    one = Line("", time, values + sigma, color, 0.8, "", size, reference=True)
    return [one, replace(one, values=values - sigma)]
