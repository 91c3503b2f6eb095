"""The report of one run: a self-contained HTML page with its drawings, for any browser and for print."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import NavState
from sinssim.earth.coordinates import radii
from sinssim.earth.gravity import gravity_ned
from sinssim.earth.models import Ellipsoid
from sinssim.exhibits import Item, Section, Sentence
from sinssim.experiments.run.report.axes import axes_drawing
from sinssim.experiments.run.report.errors import error_plots, error_tables, failure, singularity_table
from sinssim.experiments.run.report.filter import STYLE as FILTER_STYLE
from sinssim.experiments.run.report.filter import filter_section
from sinssim.experiments.run.report.flight import MAP, flight_section, map_of
from sinssim.experiments.run.report.scheme import scheme, scheme_words
from sinssim.experiments.run.report.sensors import sensor_errors
from sinssim.experiments.run.report.track import STYLE as TRACK_STYLE
from sinssim.experiments.run.report.track import Track
from sinssim.experiments.run.sensor_comparison import SensorComparison, sensor_comparisons
from sinssim.formatting import number_text
from sinssim.recording.report import drawing, page
from sinssim.recording.report.chart import STYLE as CHART_STYLE
from sinssim.recording.report.exhibits import parts_of
from sinssim.recording.report.page import table, words
from sinssim.recording.store.summary import flagged_words, processor
from sinssim.scales import LENGTHS, duration_words, suiting
from sinssim.scenario.height import height_words
from sinssim.scenario.notes import earth_of_the_navigator
from sinssim.scenario.summary import sensor_words
from sinssim.sensors.imu.grades import grade_name
from sinssim.sensors.sets.true_errors import draw_true_errors
from sinssim.simulation.truth import Truth

if TYPE_CHECKING:
    from sinssim.experiments.run.part import Part
    from sinssim.experiments.run.result import Reached, Run
    from sinssim.scenario import Scenario

STYLE = f"""{CHART_STYLE}{drawing.STYLE}{TRACK_STYLE}{FILTER_STYLE}
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
    unit, size = suiting(LENGTHS, np.array([metres if largest is None else largest]))
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
