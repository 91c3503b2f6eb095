"""Scores of other programs' solutions beside a run: ranking, report, and the files of RUN/scores with a recording."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.charts import PAIR, Axis, Chart, Charts, Line, over
from sinssim.data import Array, NavState
from sinssim.errors import InputError
from sinssim.exhibits import Column, Exhibits, Item, Medium, Section, Sentence, Table
from sinssim.experiments.run.error_exhibits import (
    Compared,
    error_exhibits,
    error_table,
    error_text,
    known_numbers,
    note_on_errors,
    schuler_period,
)
from sinssim.experiments.run.filter_exhibits import NAVIGATION
from sinssim.experiments.run.summary_types import ErrorNumbers
from sinssim.logs.solution_score import Judge, Score
from sinssim.recording import style
from sinssim.recording.page import page_of
from sinssim.recording.rerun_exhibits import markdown_of, record_charts
from sinssim.recording.rerun_file import Recording, whole_recording
from sinssim.recording.rerun_scene import map_zoom, some_rows
from sinssim.recording.rerun_viewer import RUN_ENTITY
from sinssim.recording.rerun_views import RunInfo, all_views
from sinssim.recording.result import Json, plain, versions, write_json
from sinssim.recording.streams import error_stream, nav_stream, write_stream
from sinssim.recording.style import thinned
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.files import Draft, publish, write_text, written
from sinssim.units import DEG, Scale, fixed, suiting

FOLDER = "scores"
"""Name of the folder of scores in a run directory."""
RECORDING = "recording.rrd"
"""Name of the recording in that folder."""


def ranking(numbers: Mapping[str, ErrorNumbers]) -> list[str]:
    """Return the algorithms from the smallest to the largest rms of the horizontal error; those without it are last."""

    def size(name: str) -> float:
        value = numbers[name]["rms_horizontal_error_m"]
        return float("inf") if value is None else value

    return sorted(numbers, key=size)


def check_names(judge: Judge, names: Sequence[str]) -> None:
    """Refuse names that cannot be those of a further algorithm."""
    for name in names:
        if not re.fullmatch(r"[\w.+ -]{1,80}", name) or name.startswith(".") or name != name.strip():
            raise InputError(f"--name {name!r}: letters, digits, blanks, . + - and _ are possible, at most 80.")
        if name in judge.run.solutions:
            raise InputError(f"the run has a solution {name!r} already; give another name with --name.")
        if list(names).count(name) > 1:
            raise InputError(f"two solutions have the name {name!r}; give each one with --name.")


_FAR = 10.0
"""Factor of the largest rms of a scored solution beyond which an algorithm of the run is not drawn."""


@dataclass(frozen=True)
class Scored:
    """Scored solutions beside the algorithms of the run."""

    judge: Judge  # the run that they are compared with
    scores: Sequence[Score]  # the solutions
    errors: Mapping[str, NavError]  # errors of the run's algorithms and of the scored solutions
    span: tuple[float, float]  # time over which they are compared, s

    @cached_property
    def numbers(self) -> dict[str, ErrorNumbers]:
        """Errors within the span, from the smallest to the largest rms of the horizontal error."""
        numbers = {name: known_numbers(error, self.span) for name, error in self.errors.items()}
        return {name: numbers[name] for name in ranking(numbers)}

    @cached_property
    def theirs(self) -> dict[str, Score]:
        """The scored solutions by name."""
        return {score.name: score for score in self.scores}

    @property
    def far(self) -> list[str]:
        """The run's algorithms whose errors would hide those of the scored solutions."""
        rms = {name: numbers["rms_horizontal_error_m"] or 0.0 for name, numbers in self.numbers.items()}
        most = max((rms[name] for name in self.theirs), default=0.0)
        return [name for name, size in rms.items() if name not in self.theirs and size > _FAR * most]

    @property
    def drawn(self) -> Compared:
        """The errors that are drawn, in the order of the ranking."""
        errors = {name: self.errors[name] for name in self.numbers if name not in self.far}
        return Compared(np.array(self.span), errors, self.judge.axes)

    @cached_property
    def motion(self) -> NavState:
        """The motion that the solutions are compared with."""
        samples = self.judge.run.solution(self.judge.run.motion)
        assert samples.velocity_ned is not None
        assert samples.q_nb is not None
        return NavState(samples.latitude, samples.longitude, samples.height, samples.velocity_ned, samples.q_nb)


def to_json(score: Score, span: tuple[float, float]) -> dict[str, Json]:
    """Return a score for its JSON file; it is compared over a span, s."""
    whole = (float(score.error.time[0]), float(score.error.time[-1]))
    numbers: dict[str, Json] = plain(
        {
            "name": score.name,
            "file": str(score.path),
            "format": score.format,
            "start_s": whole[0],
            "end_s": whole[1],
            "rows": len(score.error.time),
            "compute_s": score.seconds,
            "errors": known_numbers(score.error, whole),
            "compared_from_s": span[0],
            "compared_to_s": span[1],
            "errors_compared": known_numbers(score.error, span),
            "notes": list(score.sentences),
            "versions": versions(),
        }
    )
    return numbers


def score_exhibits(scored: Scored) -> Exhibits:
    """Return what scored solutions have to show."""
    page: tuple[Medium, ...] = ("page",)
    name, (start, end) = scored.judge.run.name, scored.span
    items: list[Item] = [
        Sentence(
            f"Compared from {start:g} s to {end:g} s, which every scored solution covers. {_best(scored)}", on=page
        ),
        Section("Ranking", list(_ranks(scored)), on=page),
        Section("Errors", [ranked_table(scored), note_on_errors(where="NAME/score.json; all samples: "
                                                                "NAME/error_NAME.parquet")]),
        *(Sentence(f"* {score.name} ({score.path}): {' '.join(score.sentences)}", on=("console",))
          for score in scored.scores),
    ]  # fmt: skip
    period = schuler_period(scored.motion, scored.judge.ellipsoid)
    over_time: list[Item] = list(error_exhibits(scored.drawn, period, apart=False))
    if scored.far:
        text = f"Not plotted, because the errors are much larger: {', '.join(scored.far)}. The report of the run "
        over_time.insert(0, Sentence(f"{text}shows them."))
    items.append(Section("Errors over time", over_time, on=page))
    about: list[Item] = [
        Section(score.name, [Sentence(str(score.path), "note"), *map(Sentence, score.sentences)])
        for score in scored.scores
    ]
    items.append(Section("What was scored", about, on=page))
    return Exhibits(f"{name}: scores", items, heading=f"{name}: scored solutions")


def _best(scored: Scored) -> str:
    best = next(iter(scored.numbers))
    whose = "scored" if best in scored.theirs else "the run’s own"
    rms = error_text(scored.numbers[best]["rms_horizontal_error_m"])
    return f"{best} ({whose}) has the smallest rms horizontal error: {rms} m."


def ranked_table(scored: Scored) -> Table:
    """Return the errors of all solutions, ranked; the scored ones have a star."""
    (start, end), judge = scored.span, scored.judge
    title = f"{judge.run.name}: errors against {judge.against}, {start:g} s to {end:g} s, by the rms horizontal error"
    table = error_table(scored.numbers, title)
    rows = []
    for place, (name, *numbers) in enumerate(table.rows, start=1):
        score = scored.theirs.get(str(name))
        seconds = None if score is None else score.seconds
        rows.append([str(place), name if score is None else f"{name} *", *numbers, "" if seconds is None else seconds])
    return replace(table, columns=(Column("rank"), *table.columns, Column("time", fixed("s"))), rows=rows)


def _ranks(scored: Scored) -> Iterator[Item]:
    """Yield the rank of each algorithm by each quantity."""
    kinds = ("horizontal", "height", "velocity", "attitude")
    keys = ("horizontal_error_m", "height_error_m", "velocity_error_mps", "attitude_error_arcsec")
    places: dict[str, dict[str, str]] = {name: {} for name in scored.numbers}
    for key in keys:
        known = [(value, name) for name, n in scored.numbers.items() if (value := n[f"rms_{key}"]) is not None]
        for place, (_, name) in enumerate(sorted(known), start=1):
            places[name][key] = str(place)
    rows = [
        (name, "scored" if name in scored.theirs else "run", *(places[name].get(key, "–") for key in keys))
        for name in scored.numbers
    ]
    heads = (Column("algorithm", words=True), Column("from", words=True), *map(Column, kinds))
    yield Table(heads, rows, note="Rank by the rms error; 1 is the smallest. –: the solution lacks the quantity.")


_WITHIN = 3.0
"""Factor of the σ that is drawn, as in the view of a filter."""
_OWN_SIGMA = [f"sigma_{what}" for what in ("position_{}_m", "velocity_{}_mps", "phi_{}_rad")]


def score_charts(scored: Scored) -> Charts:
    """Return the errors of each solution by component with ±3σ where it is given, for the recording."""
    colors = dict(zip(scored.numbers, style.colors(list(scored.numbers)), strict=True))  # those of the report
    drawn = scored.drawn.errors
    errors = {name: drawn[name] for name in _drawing_order(scored) if name in drawn}
    rows = {name: thinned(len(error.time)) for name, error in errors.items()}
    sigmas = {name: sigma for name in errors if (sigma := _sigma(scored, name)) is not None}
    components = {name: _components(error)[rows[name]] for name, error in errors.items()}
    charts = []

    def lines(values: Mapping[str, Array]) -> list[Line]:
        return [
            Line(label=name, x=errors[name].time[rows[name]], y=values[name], color=colors[name],
                 weight="line" if name in scored.theirs else "bold")
            for name in errors if np.isfinite(values[name]).any()
        ]  # fmt: skip

    x, units_of = over(scored.span), dict[str, Scale]()
    for number, (block, scale, parts, _) in enumerate(NAVIGATION):
        for i, (key, title) in enumerate(parts):
            column = 3 * number + i
            alike = (
                slice(2, 3) if key == "height" else slice(3 * number, 3 * number + (2 if block == "position" else 3))
            )
            values = (rows_of[:, alike] for rows_of in components.values())
            units_of[key] = fixed(*suiting(scale, *(v[np.isfinite(v)] for v in values)))
            bands = [line for name, sigma in sigmas.items() for line in _band(name, sigma, column, colors[name])]
            curves = lines({name: rows_of[:, column] for name, rows_of in components.items()})
            y, marks = Axis(units=units_of[key]), (*bands, *curves)
            charts += [Chart(key=f"score/{key}", title=title, x=x, y=y, marks=marks)] if curves else []
    horizontal = lines({name: error.horizontal[rows[name]] for name, error in errors.items()})
    y = Axis(units=units_of["position_north"], low=0.0)
    charts.append(Chart(key="score/horizontal", title="Horizontal error", x=x, y=y, marks=tuple(horizontal)))
    return Charts("score", tuple((chart,) for chart in charts), (PAIR[0], len(charts) * PAIR[1]), on=("recording",))


def _band(name: str, sigma: tuple[Array, Array], column: int, color: style.Rgb) -> Iterator[Line]:
    time, values = sigma
    if not np.isfinite(values[:, column]).any():
        return
    for side, label in ((_WITHIN, f"{name}, ±3σ"), (-_WITHIN, "")):
        yield Line(label=label, x=time, y=side * values[:, column], color=style.tint(color), weight="hair")


def _drawing_order(scored: Scored) -> list[str]:
    """Return the algorithms as they are drawn: smaller errors above larger ones, and of two that are alike to about a
    quarter, so that their lines may coincide, the wide line of the run's own below the thin one of the scored."""

    def place(name: str) -> tuple[float, bool]:
        rms = scored.numbers[name]["rms_horizontal_error_m"]
        return -round(10.0 * np.log10(max(rms, 1e-12))) if rms is not None else 0.0, name in scored.theirs

    return sorted(scored.numbers, key=place)


def _sigma(scored: Scored, name: str) -> tuple[Array, Array] | None:
    """Return the σ that a solution states, or the run's own filter: instants within the span, and (N, 9)."""
    score, run = scored.theirs.get(name), scored.judge.run
    if score is not None and score.sigma is not None:
        time, sigma = score.error.time, score.sigma
    elif name == "aided" and (run.path / "streams" / "filter.parquet").is_file():
        columns = run.table("filter")
        time = columns["time_s"]
        sigma = np.column_stack([columns[stem.format(axis)] for stem in _OWN_SIGMA for axis in "ned"])
    else:
        return None
    within = np.flatnonzero((time >= scored.span[0] - 1e-6) & (time <= scored.span[1] + 1e-6))
    within = within[thinned(len(within))] if len(within) else within
    return time[within], sigma[within]


def _components(error: NavError) -> Array:
    """Return the errors of the plots, (N, 9) in SI: position with the height upwards, velocity, attitude."""
    components = np.concatenate((error.position_ned, error.velocity_ned, error.attitude), axis=1)
    components[:, 2] = error.height
    return components


def write_scores(scored: Scored) -> Path:
    """Write the scores beside the run, whose own files stay as they are, and return their report."""
    run = scored.judge.run
    folder = run.path / FOLDER
    try:
        with Draft(run.path, FOLDER) as beside:
            top = beside.path / FOLDER
            for score in scored.scores:
                place = top / score.name
                place.mkdir(parents=True)
                write_stream(nav_stream(score.name, score.solution), place)
                write_stream(error_stream(score.name, score.error.at, score.solution.time), place)
                write_json(place / "score.json", to_json(score, scored.span))
            write_text(top / "report.html", page_of(score_exhibits(scored)))
            record_scores(scored, top / RECORDING)
            new = {path.relative_to(beside.path).as_posix() for path in top.rglob("*")}
            publish(beside, run.path, [name for name in written(run.path) or () if name not in new])
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror or error}.") from error
    return folder / "report.html"


def record_scores(scored: Scored, path: Path) -> None:
    """Write the recording."""
    labels = {"kind": "score", "against": scored.judge.against}
    info = RunInfo(f"{scored.judge.run.name} scores", *scored.span, tuple(scored.drawn.errors), labels=labels)
    ranking: list[Item] = [ranked_table(scored), Sentence("Scored solutions have a star.")]
    if scored.far:
        ranking.append(Sentence(f"Not plotted, because the errors are much larger: {', '.join(scored.far)}."))
    about = [
        line
        for score in scored.scores
        for line in (f"# {score.name}", "", f"`{score.path}`", "", *(f"- {text}" for text in score.sentences), "")
    ]
    with whole_recording(path, info.application) as recording:
        labels = {**labels, **record_charts(recording, score_charts(scored))}
        zoom = _draw_map(recording, scored)
        recording.document("about/ranking", markdown_of(ranking))
        recording.document("about/scored", "\n".join(about))
        info = replace(info, labels=labels, ranges=dict(recording.ranges), map_zoom=zoom)
        recording.document(RUN_ENTITY, info.to_json())
        recording.blueprint(all_views(info))


def _draw_map(recording: Recording, scored: Scored) -> float:
    """Record the motion and the solutions on the map; return its zoom."""
    motion, colors = scored.motion, dict(zip(scored.numbers, style.colors(list(scored.numbers)), strict=True))
    _draw_track(recording, "map/motion", motion.latitude, motion.longitude, style.COLORS["truth"], 2.5)
    for number, name in enumerate(scored.drawn.errors):
        score = scored.theirs.get(name)
        solution = scored.judge.run.solution(name) if score is None else score.solution
        _draw_track(recording, f"map/{number}", solution.latitude, solution.longitude, colors[name], 1.2)
    return map_zoom([some_rows(motion)])


def _draw_track(
    recording: Recording, entity: str, latitude: Array, longitude: Array, color: style.Rgb, width: float
) -> None:
    rows = thinned(len(latitude), 4096)
    lat_lon = np.column_stack((latitude[rows], longitude[rows])) / DEG
    lat_lon = lat_lon[np.isfinite(lat_lon).all(axis=1)]
    radius = rr.Radius.ui_points(width)
    recording.static(entity, rr.GeoLineStrings(lat_lon=[lat_lon], radii=radius, colors=color))
