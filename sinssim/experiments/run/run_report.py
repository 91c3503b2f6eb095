"""The report of a run, on simulated or on recorded sensors.

A self-contained HTML page with its drawings, for any browser and for print.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import rotation, units
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.geodetic_coordinates import radii
from sinssim.earth.gravity import gravity_ned
from sinssim.exhibits import Item, Section, Sentence
from sinssim.experiments.run.error_exhibits import Compared, error_plots, error_tables, failure, singularity_table
from sinssim.experiments.run.filter_exhibits import STYLE as FILTER_STYLE
from sinssim.experiments.run.filter_exhibits import filter_section
from sinssim.experiments.run.flight_map import (
    MAP,
    Track,
    between_text,
    draw_map,
    flight_section,
    map_of,
    motion_plots,
    place_text,
)
from sinssim.experiments.run.flight_map import STYLE as TRACK_STYLE
from sinssim.experiments.run.navigation_scheme import axes_drawing, scheme, scheme_words
from sinssim.experiments.run.parts.recorded_sensors import best_solution
from sinssim.experiments.run.sensor_exhibits import SensorComparison, sensor_comparisons, sensor_errors
from sinssim.formatting import number_text
from sinssim.recording import style
from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.exhibit_page import parts_of
from sinssim.recording.report.page import table, words
from sinssim.recording.report.svg_chart import STYLE as CHART_STYLE
from sinssim.recording.report.svg_plot import Line, Mark
from sinssim.recording.run_directory import flagged_words, processor
from sinssim.recording.style import thinned
from sinssim.scenario.notes import earth_of_the_navigator, height_words
from sinssim.scenario.plan_summary import sensor_words
from sinssim.sensors.imu.grades import grade_name
from sinssim.sensors.sets.sensor_readings import draw_true_errors
from sinssim.simulation.truth_stage import RecordedMotion, Truth
from sinssim.strapdown.navigation_error import NavError
from sinssim.units import LENGTH_SCALE, duration_words, suiting

if TYPE_CHECKING:
    from sinssim.estimation import Estimate
    from sinssim.experiments.run.run_result import Part, Reached, Run
    from sinssim.logs.recorded_log import RecordedLog
    from sinssim.scenario import Scenario
    from sinssim.simulation.navigation_stage import Navigated
    from sinssim.simulation.truth_comparison import Aided


STYLE = f"""{CHART_STYLE}{svg_plot.DIAGRAM_STYLE}{TRACK_STYLE}{FILTER_STYLE}
pre {{ background: var(--head); padding: .8rem 1rem; font-size: .78rem; line-height: 1.45; columns: 3 19rem;
  white-space: pre-wrap; overflow-wrap: anywhere; }}
th.group {{ text-align: center; }} .first {{ border-left: 1px solid var(--line); }}
@media print {{ .errors table, .events table {{ font-size: 7.5pt; }} .errors th, .errors td {{ padding: .1rem .3rem; }}
  pre {{ font-size: 7pt; columns: 2; }} }}
"""


@dataclass(frozen=True)
class Sections:
    """The sections of a report that draw every sample of a run: HTML, empty for a stage that has not run.

    The map in `flight` is missing; `chart` draws it.
    """

    flight: str
    chart: Callable[[Mapping[str, Track]], str] | None
    sensors: str
    parts: str
    errors: str
    axes: str


def draw_sections(run: Reached | Run, kinds: Sequence[SensorComparison] | None = None) -> Sections:
    """Draw the sections that need every sample of a run.

    Args:
        run: the run; one that failed lacks the results of its later stages.
        kinds: its readings by kind of sensor, if they have been compared.

    Returns:
        The sections, for `run_report`. The samples may be freed before the report is put together.
    """
    flight = errors = axes = ""
    chart, scenario, truth, navigated = None, run.scenario, run.truth, run.navigated
    if isinstance(truth, Truth):
        flight = "".join(flight_section(scenario, truth, sections(run, "motion")))
        chart = map_of(scenario, truth, {} if navigated is None else navigated.solutions)
    true = None if run.sensed is None else run.sensed.errors
    if true is None:
        true = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    sensors = "".join(sensor_errors(scenario, true, sensor_comparisons(run.sensed) if kinds is None else kinds))
    parts = "".join(sections(run, "sensors"))
    if isinstance(truth, Truth) and navigated is not None:
        errors = "".join(error_plots(navigated, schuler_period(truth.state, truth.ellipsoid)))
        axes = axes_drawing(scenario, truth.state, navigated.solutions)
    return Sections(flight, chart, sensors, parts, errors, axes)


def sections(run: Reached | Run, place: str) -> Iterator[str]:
    """Yield the sections on what only some runs have.

    Args:
        place: which of them, `Part.place`.
    """
    for part in run.parts.values():
        if part.place == place and (items := list(part.exhibits())):
            yield from parts_of([Section(part.title, items)], 2 if part.title else 1)


def run_report(run: Reached | Run, summary: Mapping[str, Any], drawn: Sections | None = None) -> str:
    """Return the report of a run.

    Args:
        run: the run; one that failed lacks the results of its later stages.
        summary: contents of `summary.json`.
        drawn: result of `draw_sections`, if they have been drawn.
    """
    scenario = run.scenario
    body = [f"<h1>{words(scenario.name)}</h1>", f'<p class="lead">{words(scenario.description)}</p>']
    if summary["status"] != "finished":
        body.append(f'<p class="broken"><strong>The run {ended(summary)}</strong> {words(summary["message"])}</p>')
    body.append("".join(f"<p>{words(sentence)}</p>" for sentence in _in_short(scenario, summary, run.parts)))
    drawn = draw_sections(run) if drawn is None else drawn
    if drawn.flight and drawn.chart is not None:
        aided = {} if run.aided is None else {"aided": run.aided.estimate.solution}
        what = "Track" if scenario.track is not None else "Flight" if scenario.flight is not None else "Motion"
        body.append(f"<h2>{what}</h2>")
        body.append(drawn.flight.replace(MAP, drawn.chart(aided)))
    body += ["<h2>Sensor errors of this run</h2>", drawn.sensors]
    body.append(drawn.parts)
    if "algorithms" in summary and drawn.errors:
        body += ["<h2>Navigation errors</h2>", *map(failure, summary["failures"].items())]
        body += error_tables(summary["algorithms"])
        body.append(drawn.errors)
        body += sections(run, "errors")
        body += ["<h2>Singular attitudes</h2>", singularity_table(summary["singularities"])]
    if run.aided is not None and run.truth is not None and "filter" in summary:
        span = (float(run.truth.time[0]), float(run.truth.time[-1]))
        body += ["<h2>The aided solution</h2>", *filter_section(run.aided, summary, span)]
        body += sections(run, "filter")
    body += ["<h2>How the run was computed</h2>", *made(scenario, summary)]
    body += ["<details><summary>Scheme of the navigation, and its axes</summary>", scheme(scenario)]
    body += [scheme_words(scenario), drawn.axes, "</details>"]
    body += ["<h2>Scenario</h2>", f"<pre>{page.verbatim(scenario.to_toml(run.about_filter).strip())}</pre>"]
    return page.page(f"{scenario.name}: run", body, STYLE)


def sentences(items: Iterable[Item]) -> Iterator[str]:
    """Yield the sentences with which a report begins."""
    yield from (one.text for one in items if isinstance(one, Sentence) and "page" in one.on)


def schuler_period(truth: NavState, ellipsoid: Ellipsoid) -> float:
    """Return the period of the Schuler oscillation at the place of a run.

    Args:
        truth: true states, N rows.

    Returns:
        2π √(R/g) with the mean radius of curvature at the mean latitude and normal gravity at the mean height, s.
    """
    latitude, height = float(truth.latitude.mean()), float(truth.height.mean())
    r1, r2 = radii(latitude, ellipsoid)
    gravity = gravity_ned(latitude, height, "normal", ellipsoid)[2]
    return float(2.0 * np.pi * np.sqrt((np.sqrt(r1 * r2) + height) / gravity))


def ended(summary: Mapping[str, Any]) -> str:
    """Return how a run ended that did not finish."""
    return (
        "was interrupted; this report shows the results up to that time."
        if summary["status"] == "interrupted"
        else "failed."
    )


def _in_short(scenario: Scenario, summary: Mapping[str, Any], parts: Mapping[str, Part]) -> Iterator[str]:
    """Yield the main results in a few sentences."""
    if not summary.get("algorithms"):
        return
    numbers = {name: n for name, n in summary["algorithms"].items() if name not in summary["failures"]}
    duration, navigation = summary["end_s"] - summary["start_s"], scenario.navigation
    yield (
        f"IMU {grade_name(scenario.imu.grade)} ({sensor_words(scenario.imu)}), "
        f"{scenario.imu.rate_hz:g} Hz, seed {scenario.seed}; navigation for "
        f"{duration_words(duration)} in the frame “{navigation.frame}”."
    )
    yield f"Height of the inertial solutions: {height_words(scenario)}."
    yield from earth_of_the_navigator(scenario)
    if flags := flagged_words(summary["flagged_samples"], round(duration * scenario.imu.rate_hz)):
        yield flags
    for part in parts.values():
        yield from sentences(part.brief(numbers))
    if any(part.compares == len(numbers) for part in parts.values()):  # the sentences have the errors of all
        return
    if summary["failures"]:
        yield f"No result from {', '.join(summary['failures'])}; the section on navigation errors gives the reason."
    if not numbers:
        return
    finals = [n["final_horizontal_error_m"] for n in numbers.values()]
    greatest = [n["max_horizontal_error_m"] for n in numbers.values()]
    if len(numbers) == 1:
        end, most = (length_text(v, greatest[0]) for v in (finals[0], greatest[0]))
        yield f"Horizontal error: {end} at the end, {most} at most."
        yield from _with_filter(summary)
        return
    alike = all(max(values) - min(values) < 5e-4 * max(values) for values in (finals, greatest))
    if alike:
        whose = "all algorithms"
        end, most = (length_text(v, greatest[0]) for v in (finals[0], greatest[0]))
    else:
        order = np.argsort(greatest)
        names = list(numbers)
        whose = f"{names[order[0]]} (smallest) to {names[order[-1]]} (largest)"
        end, most = (
            f"{length_text(v[order[0]], max(greatest))} to {length_text(v[order[-1]], max(greatest))}"
            for v in (finals, greatest)
        )
    apart = length_text(max(finals) - min(finals))
    yield (
        f"Horizontal error of {whose}: {end} at the end, {most} at most. The algorithms’ errors at the end differ by "
        f"up to {apart}."
    )
    yield from _with_filter(summary)


def _with_filter(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield the horizontal error of the aided solution."""
    aided = summary.get("filter", {}).get("aided")
    if aided is not None:
        final, largest = (aided[f"{when}_horizontal_error_m"] for when in ("final", "max"))
        end, most = (length_text(v, largest) for v in (final, largest))
        yield f"With the aiding sensors and the filter: {end} at the end, {most} at most."


def length_text(metres: float, largest: float | None = None) -> str:
    """Write a length in the unit that suits it, or the largest of those beside it."""
    if not np.isfinite(metres):
        return "not a number"
    unit, size = suiting(LENGTH_SCALE, np.array([metres if largest is None else largest]))
    return f"{number_text(metres / size, 4)} {unit}"


def made(scenario: Scenario, summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield how a run was computed: times, versions, processor."""
    timing = {name.removesuffix("_s"): seconds for name, seconds in summary["timing"].items()}
    cached = {True: "from the cache", False: "flown now", None: ""}[summary.get("flight_cached")]
    times = [
        (words(name), f"{seconds:.2f}", f'<td class="name">{cached if name == "flight" else ""}</td>')
        for name, seconds in timing.items()
        if seconds or name == "total"
    ]
    versions = {**summary["versions"], "Python": platform.python_version()}
    facts = [
        ("seed", str(scenario.seed)),
        ("IMU rate", f"{scenario.imu.rate_hz:g} Hz"),
        *((name, words(value)) for name, value in versions.items()),
        ("processor", words(processor())),
        *(
            (words(f"own {own['kind']}"), words(f"{own['name']}, SHA-256 {own['sha256'][:12]}…, {own['file']}"))
            for own in summary.get("own_content", ())
        ),
    ]
    yield f'<div class="pair"><div>{table(("stage", "time [s]", ""), times)}</div>'
    yield f"<div>{table(('computed with', ''), [(words(k), v) for k, v in facts], 2)}</div></div>"


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
    body += [f"<p>{words(sentence)}</p>" for sentence in _recorded_in_short(scenario, summary, reached.parts)]
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


def _recorded_in_short(scenario: Scenario, summary: Mapping[str, Any], parts: Mapping[str, Part]) -> Iterator[str]:
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
        yield svg_plot.plot(title, unit, lines, span, marks=marks)


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
    unit, size = suiting(LENGTH_SCALE, error)
    yield "<h3>Difference from the reference, and the uncertainty of both</h3>"
    lines = [
        Line("aided minus reference, horizontal", time, error, style.css(style.COLORS["aided"]), 1.2, "", size),
        Line("1σ of the filter", time, of_filter, style.css(style.COLORS["bound"]), 1.4, "", size),
        Line("1σ that the reference states", time, of_reference, style.css(style.COLORS["truth"]), 1.4, "6 4", size),
    ]
    yield svg_plot.plot(
        "Horizontal", unit, lines, span, marks=_outage_marks(log), width=1140, height=220, from_zero=True
    )


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
        yield svg_plot.plot(title, unit, lines, span, width=_WIDTH, height=_HEIGHT)
    yield "</div>"


def _band(time: Array, values: Array, sigma: Array, color: str, size: float) -> list[Line]:
    one = Line("", time, values + sigma, color, 0.8, "", size, reference=True)
    return [one, replace(one, values=values - sigma)]
