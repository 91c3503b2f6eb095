"""What a run has to show, on simulated or on recorded sensors: for the console, its page and its recording."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sinssim.exhibits import Beside, Column, Exhibits, Item, Medium, Picture, Section, Sentence, Table, Verbatim
from sinssim.experiments.run.error_exhibits import (
    error_exhibits,
    error_table,
    failure_exhibits,
    note_on_errors,
    requirement_sentences,
    schuler_period,
    singularity_exhibits,
    title_of_errors,
)
from sinssim.experiments.run.filter_exhibits import filter_exhibits, spread_of
from sinssim.experiments.run.filter_summary import moments, places_of, sentences
from sinssim.experiments.run.motion_exhibits import motion_exhibits, motion_facts, motion_map, solution_tracks
from sinssim.experiments.run.navigation_scheme import axes_exhibits, scheme, scheme_words
from sinssim.experiments.run.parts.motion_source import after_filter, recorded_errors
from sinssim.experiments.run.run_result import Reached, Run
from sinssim.experiments.run.sensor_exhibits import SensorComparison, sensor_comparisons, sensor_errors
from sinssim.experiments.run.summary_types import ErrorNumbers, RunSummary
from sinssim.recording.result import flagged_words, processor
from sinssim.recording.style import as_seen
from sinssim.recording.track_map import Track
from sinssim.scenario import Scenario
from sinssim.scenario.notes import (
    coarse_rates,
    defaults_taken,
    earth_of_the_navigator,
    height_words,
    keys_without_effect,
    torquer_taken,
)
from sinssim.scenario.plan_summary import sensor_words
from sinssim.sensors.imu.grades import grade_name
from sinssim.sensors.sensor_set_readings import draw_true_errors
from sinssim.simulation.total_system_error import pieces_of
from sinssim.simulation.truth_and_sensors import RecordedMotion, Truth
from sinssim.units import LENGTH_SCALE, duration_words, fixed, number_text, suiting

_PAGE: tuple[Medium, ...] = ("page",)
_CONSOLE: tuple[Medium, ...] = ("console",)


@dataclass(frozen=True)
class FirstSections:
    """The sections of a simulated run that need every sample, with as many points as a page shows."""

    motion: Sequence[Item] = ()  # plots, legs and events of the true motion
    facts: Table | None = None  # its numbers, None for a run that did not fly
    track: Track | None = None  # its track
    tracks: Sequence[Track] = ()  # those of the inertial solutions
    sensors: Sequence[Item] = ()  # the errors of the sensors
    parts: Sequence[Item] = ()  # what only some runs have of their sensors
    errors: Sequence[Item] = ()  # the errors of the inertial solutions
    axes: Sequence[Item] = ()  # the axes at the start


def first_sections(run: Reached | Run, kinds: Sequence[SensorComparison] | None = None) -> FirstSections:
    """Return the sections of a simulated run that need every sample, which may then be freed."""
    scenario, truth, navigated = run.scenario, run.truth, run.navigated
    motion, errors, axes, tracks = list[Item](), list[Item](), list[Item](), list[Track]()
    facts = track = None
    if isinstance(truth, Truth):
        motion = as_seen(motion_exhibits(scenario, truth, of_parts(run, "motion")))
        facts, track = motion_facts(scenario, truth), Track.of("truth", truth.time, truth.state)
        if navigated is not None:
            tracks = solution_tracks(navigated.solutions)
            errors = as_seen(error_exhibits(navigated, schuler_period(truth.state, truth.ellipsoid)))
            axes = list(axes_exhibits(scenario, truth.state, navigated.solutions))
    true = None if run.sensed is None else run.sensed.errors
    if true is None:
        true = draw_true_errors(scenario.imu, scenario.seed, scenario.compensation)
    compared = sensor_comparisons(run.sensed) if kinds is None else kinds
    sensors = as_seen(sensor_errors(scenario, true, compared))
    return FirstSections(motion, facts, track, tracks, sensors, as_seen(of_parts(run, "sensors")), errors, axes)


def of_parts(run: Reached | Run, place: str) -> list[Item]:
    """Return the sections on what only some runs have, of one `Part.place`."""
    shown = [(part.title, list(part.exhibits())) for part in run.parts.values() if part.place == place]
    return [Section(title, items, on=_PAGE) for title, items in shown if items]


def run_exhibits(run: Reached | Run, summary: RunSummary, first: FirstSections | None = None) -> Exhibits:
    """Return what a run has to show; one that failed lacks the results of its later stages."""
    scenario, truth = run.scenario, run.truth
    items = list(brief(run, summary))
    if isinstance(truth, RecordedMotion):
        assert run.navigated is not None  # it is finished
        items += [*of_parts(run, "motion"), *recorded_errors(run.navigated, run.aided, summary)]
    else:
        first = first_sections(run) if first is None else first
        items += _simulated(run, summary, first)
    if run.aided is not None and truth is not None and "filter" in summary:
        span = (float(truth.time[0]), float(truth.time[-1]))
        shown = list(filter_exhibits(run.aided, summary["filter"], summary["algorithms"], span))
        if isinstance(truth, RecordedMotion):
            shown += after_filter(truth, run.aided, span)
        items += [Section("The aided solution", shown, on=_PAGE), *of_parts(run, "filter")]
    items.append(Section("How the run was computed", [computed_with(scenario, summary)], on=_PAGE))
    if first is not None:
        drawn = [Picture(partial(scheme, scenario)), Sentence(scheme_words(scenario), "note"), *first.axes]
        items.append(Section("Scheme of the navigation, and its axes", drawn, on=_PAGE, fold="closed"))
    text = Verbatim("", scenario.to_toml(run.about_filter).strip())
    items.append(Section("Scenario", [text], on=_PAGE))
    return Exhibits(f"{scenario.name}: run", items, name=scenario.name, heading=scenario.name)


def _simulated(run: Reached | Run, summary: RunSummary, first: FirstSections) -> Iterator[Item]:
    """Yield the sections of a run on simulated sensors before the filter."""
    scenario, truth = run.scenario, run.truth
    if isinstance(truth, Truth) and first.track is not None and first.facts is not None:
        title = "Track" if scenario.track is not None else "Flight" if scenario.flight is not None else "Motion"
        tracks = list(first.tracks)
        if run.aided is not None:
            solution = run.aided.estimate.solution
            tracks.append(Track.of("aided", solution.time, solution, "aided"))
        times = summary["filter"]["detections"] if "filter" in summary else []
        path = truth.trajectory
        places = places_of(moments(scenario, times, (path.start, path.end)), path)
        spread = None if run.aided is None else spread_of(run.aided)
        pieces = [] if scenario.flight is None else pieces_of(scenario, truth)
        planned = [(piece.track.latitude, piece.track.longitude) for piece in pieces]
        chart = motion_map(scenario, truth.ellipsoid, first.track, tracks, places.named, spread, planned)
        yield Section(title, [Beside([chart, first.facts]), *first.motion], on=_PAGE)
    yield Section("Sensor errors of this run", first.sensors, on=_PAGE)
    yield from first.parts
    if "algorithms" in summary and first.errors:
        shown = [*failure_exhibits(summary["failures"]), error_table(summary["algorithms"]), note_on_errors()]
        yield Section("Navigation errors", [*shown, *first.errors], on=_PAGE)
        yield from of_parts(run, "errors")
        yield Section("Singular attitudes", list(singularity_exhibits(summary["singularities"])), on=_PAGE)


def brief(run: Reached | Run, summary: RunSummary) -> Iterator[Item]:
    """Yield what the console shows, and the sentences that a page begins with."""
    scenario, log = run.scenario, summary.get("log")
    if scenario.description:
        yield Sentence(f"{scenario.description}\n", "lead")
    if summary["status"] != "finished":
        yield Sentence(f"**The run {ended(summary['status'])}** {summary['message']}", "warning")
    if not summary.get("algorithms"):
        return
    numbers = {name: n for name, n in summary["algorithms"].items() if name not in summary["failures"]}
    filtered = summary.get("filter")
    solutions = dict(summary["algorithms"])
    if filtered is not None:
        further = ((name, filtered.get(name)) for name in ("aided", "backward", "smoothed"))
        solutions |= {name: errors for name, errors in further if errors}  # type: ignore[misc]
    table = error_table(solutions, f"{scenario.name}: {title_of_errors(log)}")
    of_run = [item for part in run.parts.values() for item in part.brief(numbers)]
    tables = [item for item in of_run if isinstance(item, Table)]
    notes = [item for item in of_run if isinstance(item, Sentence) and item.on == _CONSOLE]
    yield Section("", [table, *tables, *notes], on=_CONSOLE)
    yield from _remarks(scenario, summary)
    yield from (item for item in of_run if item not in tables and item not in notes)
    if log is None and not any(part.compares == len(numbers) for part in run.parts.values()):
        yield from _errors_in_short(summary, numbers)
    yield Section("", list(failure_exhibits(summary["failures"])), on=_CONSOLE)
    if summary["singularities"]:
        yield Section("", list(singularity_exhibits(summary["singularities"])), on=_CONSOLE)
    if filtered is not None:
        yield Section("", list(map(Sentence, sentences(filtered))), on=_CONSOLE)
    yield from requirement_sentences(summary.get("requirements", ()))
    timing = ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in _timing(summary) if seconds)
    yield Sentence(f"Time: {timing}", on=_CONSOLE)


def _remarks(scenario: Scenario, summary: RunSummary) -> Iterator[Sentence]:
    """Yield what the run was computed with."""
    duration, rate, frame = summary["end_s"] - summary["start_s"], scenario.imu.rate_hz, scenario.navigation.frame
    simulated = "log" not in summary
    if simulated:
        yield Sentence(
            f"IMU {grade_name(scenario.imu.grade)} ({sensor_words(scenario.imu)}), {rate:g} Hz, seed {scenario.seed}; "
            f"navigation for {duration_words(duration)} in the frame “{frame}”.", on=_PAGE,
        )  # fmt: skip
        yield from (Sentence(text, on=_CONSOLE) for text in summary.get("not_attained", ()))
        yield Sentence(f"Height of the inertial solutions: {height_words(scenario)}.")
    else:
        yield Sentence(
            f"Recorded sensors, {duration_words(duration)} at {rate:g} Hz; the filter assumes the grade "
            f"{grade_name(scenario.imu.grade)} with the changes in [imu]. Navigation in the frame “{frame}”.", on=_PAGE,
        )  # fmt: skip
    yield from map(Sentence, earth_of_the_navigator(scenario))
    further = [*torquer_taken(scenario), *coarse_rates(scenario.imu)]
    if flags := flagged_words(summary["flagged_samples"], round(duration * rate)):
        yield Sentence(flags)
    further += keys_without_effect(scenario.imu, summary["end_s"]) if simulated else []
    yield from (Sentence(text, on=_CONSOLE) for text in (*further, *defaults_taken(scenario.imu, summary["end_s"])))


def ended(status: str) -> str:
    """Return how a run ended that did not finish."""
    interrupted = "was interrupted; this report shows the results up to that time."
    return interrupted if status == "interrupted" else "failed."


def _errors_in_short(summary: RunSummary, numbers: Mapping[str, ErrorNumbers]) -> Iterator[Sentence]:
    """Yield the horizontal errors of the algorithms and of the filter, for the page."""
    if summary["failures"]:
        names = ", ".join(summary["failures"])
        yield Sentence(f"No result from {names}; the section on navigation errors gives the reason.", on=_PAGE)
    if not numbers:
        return
    pairs = {name: _end_and_most(errors) for name, errors in numbers.items()}
    finals, greatest = ([pair[k] for pair in pairs.values()] for k in range(2))
    if len(pairs) == 1:
        yield Sentence(f"Horizontal error: {_pair_text(finals[0], greatest[0])}.", on=_PAGE)
    else:
        least, largest = min(pairs, key=lambda name: pairs[name][1]), max(pairs, key=lambda name: pairs[name][1])
        if all(max(values) - min(values) < 5e-4 * max(values) for values in (finals, greatest)):
            whose, size = "all algorithms", _pair_text(finals[0], greatest[0])
        else:
            whose = f"{least} (smallest) to {largest} (largest)"
            end, most = (
                f"{length_text(pairs[least][k], max(greatest))} to {length_text(pairs[largest][k], max(greatest))}"
                for k in range(2)
            )
            size = f"{end} at the end, {most} at most"
        apart = length_text(max(finals) - min(finals))
        yield Sentence(
            f"Horizontal error of {whose}: {size}. The algorithms’ errors at the end differ by up to {apart}.", on=_PAGE
        )
    if "filter" in summary and (aided := summary["filter"]["aided"]) is not None:
        yield Sentence(f"With the aiding sensors and the filter: {_pair_text(*_end_and_most(aided))}.", on=_PAGE)


def _end_and_most(errors: ErrorNumbers) -> tuple[float, float]:
    """Return the horizontal error at the end, and the largest, m."""
    end, most = (errors[f"{when}_horizontal_error_m"] for when in ("final", "max"))
    return float("nan") if end is None else end, float("nan") if most is None else most


def _pair_text(end: float, most: float) -> str:
    return f"{length_text(end, most)} at the end, {length_text(most, most)} at most"


def length_text(metres: float, largest: float | None = None) -> str:
    """Write a length in the unit that suits it, or the largest of those beside it."""
    if not np.isfinite(metres):
        return "not a number"
    unit, size = suiting(LENGTH_SCALE, np.array([metres if largest is None else largest]))
    return f"{number_text(metres / size, 4)} {unit}"


def _timing(summary: RunSummary) -> list[tuple[str, float]]:
    return [(name.removesuffix("_s"), seconds) for name, seconds in summary["timing"].items()]


def computed_with(scenario: Scenario, summary: RunSummary) -> Item:
    """Return how a run was computed: times, versions, processor."""
    cached = {True: "from the cache", False: "flown now", None: ""}[summary.get("flight_cached")]
    times = [
        (name, f"{seconds:.2f}", cached if name == "flight" else "")
        for name, seconds in _timing(summary)
        if seconds or name == "total"
    ]
    rate = scenario.imu.rate_hz if scenario.one_component is None else scenario.one_component.rate_hz
    facts = [
        ("seed", str(scenario.seed)),
        ("IMU rate", f"{rate:g} Hz"),
        *summary["versions"].items(),
        ("Python", platform.python_version()),
        ("processor", processor()),
        *(
            (f"own {file['kind']}", f"{file['name']}, SHA-256 {file['sha256'][:12]}…, {file['file']}")
            for file in summary.get("own_content", ())
        ),
    ]
    stages = (Column("stage", words=True), Column("time", fixed("s")), Column("", words=True))
    made = (Column("computed with", words=True), Column("", words=True))
    return Beside([Table(stages, times), Table(made, facts)])
