"""Scores of other programs' solutions beside a run.

RUN/scores/NAME with streams and numbers, ranked table, report and recording.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr
from rich import box
from rich.table import Table

from sinssim import units
from sinssim.data import Array, NavState
from sinssim.errors import InputError
from sinssim.experiments.run.error_exhibits import Compared, error_plots, error_tables, error_text
from sinssim.experiments.run.run_report import STYLE, schuler_period
from sinssim.logs.solution_score import Judge, Score
from sinssim.recording import style
from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.page import table, words
from sinssim.recording.rerun.rrd import Recording, whole_recording
from sinssim.recording.rerun.scene import map_zoom, some_rows
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.run_directory import plain, versions
from sinssim.recording.stream_columns import error_stream, nav_stream
from sinssim.recording.stream_tables import write_stream
from sinssim.recording.style import thinned
from sinssim.strapdown.navigation_error import NavError
from sinssim.system.outputs import Draft, publish, write_text, written
from sinssim.units import ANGLE_SCALE, DEG, HEIGHT_SCALE, LENGTH_SCALE, SPEED_SCALE, suiting

if TYPE_CHECKING:
    from rich.console import Console


FOLDER = "scores"
"""Name of the folder of scores in a run directory."""
RECORDING = "recording.rrd"
"""Name of the recording in that folder."""


def known_numbers(error: NavError, span: tuple[float, float]) -> dict[str, float | None]:
    """Return the error statistics within a span, of what is known.

    Args:
        error: errors of a solution; NaN where it has nothing.
        span: first and last time, s.

    Returns:
        As `sinssim.strapdown.navigation_error.error_numbers`, with None for quantities without a value.
    """
    rows = (error.time >= span[0] - 1e-6) & (error.time <= span[1] + 1e-6)
    found: dict[str, float | None] = {}
    for name, values in (
        ("horizontal_error_m", error.horizontal),
        ("height_error_m", error.height),
        ("velocity_error_mps", error.speed),
        ("attitude_error_arcsec", error.angle / units.ARCSEC),
    ):
        part: Array = values[rows]
        part = part[np.isfinite(part)]
        found[f"final_{name}"] = float(part[-1]) if len(part) else None
        found[f"rms_{name}"] = float(np.sqrt(np.mean(part * part))) if len(part) else None
        found[f"max_{name}"] = float(np.abs(part).max()) if len(part) else None
    return found


def ranking(numbers: Mapping[str, Mapping[str, float | None]]) -> list[str]:
    """Return the algorithms from the smallest to the largest rms of the horizontal error.

    Args:
        numbers: results of `known_numbers` by algorithm.

    Returns:
        Their names; those without a number are last.
    """

    def size(name: str) -> float:
        value = numbers[name]["rms_horizontal_error_m"]
        return float("inf") if value is None else value

    return sorted(numbers, key=size)


def check_names(judge: Judge, names: Sequence[str]) -> None:
    """Refuse names that cannot be those of a further algorithm.

    Raises:
        InputError: a name is that of an algorithm of the run, is used twice, or cannot be that of a folder.
    """
    for name in names:
        if not re.fullmatch(r"[\w.+ -]{1,80}", name) or name.startswith(".") or name != name.strip():
            raise InputError(f"--name {name!r}: letters, digits, blanks, . + - and _ are possible, at most 80.")
        if name in judge.run.solutions:
            raise InputError(f"the run has a solution {name!r} already; give another name with --name.")
        if list(names).count(name) > 1:
            raise InputError(f"two solutions have the name {name!r}; give each one with --name.")


def write_scores(
    judge: Judge, scores: Sequence[Score], span: tuple[float, float], report: str, record: Callable[[Path], None]
) -> Path:
    """Write the scores beside the run; the run's own files stay as they are.

    Args:
        span: time over which they are compared, s.

    Raises:
        InputError: nothing can be written there.
    """
    folder = judge.run.path / FOLDER
    try:
        with Draft(judge.run.path, FOLDER) as beside:
            top = beside.path / FOLDER
            for score in scores:
                place = top / score.name
                place.mkdir(parents=True)
                write_stream(nav_stream(score.name, score.solution), place)
                write_stream(error_stream(score.name, score.error.at, score.solution.time), place)
                text = json.dumps(to_json(score, span), indent=2, ensure_ascii=False)
                write_text(place / "score.json", text + "\n")
            write_text(top / "report.html", report)
            record(top / RECORDING)
            new = {path.relative_to(beside.path).as_posix() for path in top.rglob("*")}
            publish(beside, judge.run.path, [name for name in written(judge.run.path) or () if name not in new])
    except OSError as error:
        raise InputError(f"{folder} cannot be written: {error.strerror or error}.") from error
    return folder / "report.html"


def to_json(score: Score, span: tuple[float, float]) -> dict[str, Any]:
    """Return a score as plain numbers.

    Args:
        span: time over which it is compared, s.
    """
    own = (float(score.error.time[0]), float(score.error.time[-1]))
    found = {
        "name": score.name,
        "file": str(score.path),
        "format": score.format,
        "start_s": own[0],
        "end_s": own[1],
        "rows": len(score.error.time),
        "compute_s": score.seconds,
        "errors": known_numbers(score.error, own),
        "compared_from_s": span[0],
        "compared_to_s": span[1],
        "errors_compared": known_numbers(score.error, span),
        "notes": list(score.sentences),
        "versions": versions(),
    }
    return {key: plain(value) for key, value in found.items()}


_FAR = 10.0
"""Factor of the largest rms of a scored solution beyond which an algorithm of the run is not drawn."""


def score_report(
    judge: Judge,
    scores: Sequence[Score],
    compared: Compared,
    numbers: Mapping[str, Mapping[str, float | None]],
) -> str:
    """Return the report.

    Args:
        compared: errors of the run's algorithms and of the scored solutions.
    """
    run = judge.run
    span = float(compared.time[0]), float(compared.time[-1])
    order = ranking(numbers)
    theirs = {score.name for score in scores}
    body = [f"<h1>{words(run.name)}: scored solutions</h1>", "".join(_in_short(numbers, order, theirs, span))]
    ranked = {name: numbers[name] for name in order}
    body += [
        "<h2>Ranking</h2>",
        _ranks(ranked, theirs),
        "<h2>Errors</h2>",
        *error_tables(ranked, "NAME/score.json; all samples: NAME/error_NAME.parquet"),
    ]
    samples = run.solution(run.motion)
    assert samples.velocity_ned is not None
    assert samples.q_nb is not None
    truth = NavState(samples.latitude, samples.longitude, samples.height, samples.velocity_ned, samples.q_nb)
    in_order = Compared(compared.time, {name: compared.errors[name] for name in order}, compared.axes)  # same colours
    drawn, far = near_the_scored(in_order, numbers, theirs)
    body.append("<h2>Errors over time</h2>")
    if far:
        body.append(
            f"<p>Not plotted, because the errors are much larger: {words(', '.join(far))}. The report of the "
            f"run shows them.</p>"
        )
    body += error_plots(drawn, schuler_period(truth, judge.ellipsoid), apart=False)
    body.append("<h2>What was scored</h2>")
    for score in scores:
        body.append(f"<h3>{words(score.name)}</h3><p class='note'>{words(str(score.path))}</p><ul>")
        body += [f"<li>{words(sentence)}</li>" for sentence in score.sentences]
        body.append("</ul>")
    return page.page(f"{run.name}: scores", body, STYLE + svg_plot.STYLE)


def near_the_scored(
    compared: Compared, numbers: Mapping[str, Mapping[str, float | None]], theirs: set[str]
) -> tuple[Compared, list[str]]:
    """Return what is drawn, and the names of the run's algorithms whose errors would hide those of the scored ones.

    Returns:
        The errors to draw; the names of those left out.
    """
    most = max((numbers[name]["rms_horizontal_error_m"] or 0.0 for name in theirs), default=0.0)
    far = [
        name for name, n in numbers.items() if name not in theirs and (n["rms_horizontal_error_m"] or 0.0) > _FAR * most
    ]
    kept = {name: error for name, error in compared.errors.items() if name not in far}
    return Compared(compared.time, kept, compared.axes), far


def _in_short(
    numbers: Mapping[str, Mapping[str, float | None]], order: Sequence[str], theirs: set[str], span: tuple[float, float]
) -> Iterator[str]:
    yield f"<p>Compared from {span[0]:g} s to {span[1]:g} s, which every scored solution covers. "
    best = order[0]
    rms = error_text(numbers[best]["rms_horizontal_error_m"])
    whose = "scored" if best in theirs else "the run’s own"
    yield f"{words(best)} ({whose}) has the smallest rms horizontal error: {rms} m.</p>"


def _ranks(ranked: Mapping[str, Mapping[str, float | None]], theirs: set[str]) -> str:
    """Return the rank of each algorithm by each quantity."""
    kinds = ("horizontal_error_m", "height_error_m", "velocity_error_mps", "attitude_error_arcsec")
    places: dict[str, dict[str, str]] = {name: {} for name in ranked}
    for kind in kinds:
        known = [(value, name) for name, n in ranked.items() if (value := n[f"rms_{kind}"]) is not None]
        for place, (_, name) in enumerate(sorted(known), start=1):
            places[name][kind] = str(place)
    lines = [
        (words(name), "scored" if name in theirs else "run", *(places[name].get(kind, "–") for kind in kinds))
        for name in ranked
    ]
    return table(("algorithm", "from", "horizontal", "height", "velocity", "attitude"), lines, 2) + (
        '<p class="note">Rank by the rms error; 1 is the smallest. – : the solution lacks the quantity.</p>'
    )


_PLOTS = (
    ("position_north", "position"), ("position_east", "position"), ("height", "height"),
    ("velocity_north", "velocity"), ("velocity_east", "velocity"), ("velocity_down", "velocity"),
    ("tilt_north", "attitude"), ("tilt_east", "attitude"), ("azimuth", "attitude"),
)  # fmt: skip
"""Nine components: key of the plot, and what its unit is chosen for."""
_SCALES = {"position": LENGTH_SCALE, "height": HEIGHT_SCALE, "velocity": SPEED_SCALE, "attitude": ANGLE_SCALE}
_WITHIN = 3.0
"""Factor of the σ that is drawn, as in the view of a filter."""
_WIDE, _THIN = 2.7, 1.5
"""Widths of the lines of the run's own algorithms, and of the scored solutions, points."""
_OWN_SIGMA = [f"sigma_{what}" for what in ("position_{}_m", "velocity_{}_mps", "phi_{}_rad")]


def record_scores(
    judge: Judge,
    scores: Sequence[Score],
    compared: Compared,
    numbers: Mapping[str, Mapping[str, float | None]],
    path: Path,
) -> None:
    """Write the recording.

    Args:
        compared: errors of the run's algorithms and of the scored solutions.

    Raises:
        RunError: it cannot be written.
    """
    order = ranking(numbers)
    colors = dict(zip(order, style.colors(order), strict=True))  # those of the report
    theirs = {score.name: score for score in scores}
    drawn, far = near_the_scored(compared, numbers, set(theirs))
    errors = {name: drawn.errors[name] for name in _drawing_order(numbers, set(theirs)) if name in drawn.errors}
    sigmas = {score.name: (score.error.time, score.sigma) for score in scores if score.sigma is not None}
    if "aided" in errors and (judge.run.path / "streams" / "filter.parquet").is_file():
        sigmas["aided"] = _own_sigma(judge)
    span = float(compared.time[0]), float(compared.time[-1])
    info = RunInfo(f"{judge.run.name} scores", *span, tuple(errors), labels={"kind": "score"})
    with whole_recording(path, info.application) as recording:
        labels = {"kind": "score"} | _draw_errors(recording, errors, colors, set(theirs))
        for name, (time, sigma) in sigmas.items():
            within = (time >= span[0] - 1e-6) & (time <= span[1] + 1e-6)
            _draw_sigma(recording, list(errors).index(name), name, time[within], sigma[within], labels, colors[name])
        zoom = _draw_map(recording, judge, {name: theirs.get(name) for name in errors}, colors)
        recording.document("about/ranking", _ranking_text(judge, numbers, theirs, far, span))
        recording.document("about/scored", _about(scores))
        labels["against"] = judge.against
        info = replace(info, labels=labels, ranges=dict(recording.ranges), map_zoom=zoom)
        recording.document(RUN_ENTITY, info.to_json())
        recording.blueprint(all_views(info))


def _drawing_order(numbers: Mapping[str, Mapping[str, float | None]], theirs: set[str]) -> list[str]:
    """Return the algorithms as they are drawn: smaller errors above larger ones, and of two that are alike to about a
    quarter, so that their lines may coincide, the wide line of the run's own below the thin one of the scored."""

    def place(name: str) -> tuple[float, bool]:
        rms = numbers[name]["rms_horizontal_error_m"]
        return -round(10.0 * np.log10(max(rms, 1e-12))) if rms is not None else 0.0, name in theirs

    return sorted(numbers, key=place)


def _own_sigma(judge: Judge) -> tuple[Array, Array]:
    """Return the σ that the run's own filter states: instants, and (N, 9) as of the components of the plots."""
    columns = judge.run.table("filter")
    return columns["time_s"], np.column_stack([columns[stem.format(axis)] for stem in _OWN_SIGMA for axis in "ned"])


def _components(error: NavError) -> Array:
    """Return the errors of the plots, (N, 9) in SI: position with the height upwards, velocity, attitude."""
    found = np.concatenate((error.position_ned, error.velocity_ned, error.attitude), axis=1)
    found[:, 2] = error.height
    return found


def _draw_errors(
    recording: Recording, errors: Mapping[str, NavError], colors: Mapping[str, style.Rgb], theirs: set[str]
) -> dict[str, str]:
    """Record the errors of each solution at its own instants, in entities of its own; return the units."""
    components = {name: _components(error) for name, error in errors.items()}
    units = {}
    for kind, scale in _SCALES.items():
        rows = [
            values[:, i][np.isfinite(values[:, i])]
            for values in components.values()
            for i, (_, own) in enumerate(_PLOTS)
            if own == kind
        ]
        units[kind] = suiting(scale, *(row for row in rows if len(row)))
    for number, name in enumerate(errors):
        rows_shown = thinned(len(errors[name].time))
        time, paint = errors[name].time[rows_shown], [colors[name]]
        lines = [(key, kind, components[name][rows_shown, i]) for i, (key, kind) in enumerate(_PLOTS)]
        lines.append(("horizontal", "position", errors[name].horizontal[rows_shown]))
        for key, kind, column in lines:
            values = column[:, np.newaxis] / units[kind][1]
            recording.series(
                f"score/{key}/{number}", time, values, [name], colors=paint, widths=_THIN if name in theirs else _WIDE
            )
    return {kind: unit for kind, (unit, _) in units.items()}


def _draw_sigma(
    recording: Recording, number: int, name: str, time: Array, sigma: Array, labels: dict[str, str], color: style.Rgb
) -> None:
    """Record ±3σ of one solution, where it is given."""
    rows = thinned(len(time))
    paint = [style.tint(color)] * 2
    for i, (key, kind) in enumerate(_PLOTS):
        size = next(size for unit, size, _ in _SCALES[kind] if unit == labels[kind])
        bound = _WITHIN * sigma[rows, i] / size
        names = [f"{name}, ±3σ", ""]
        recording.series(
            f"score/{key}/{number}_sigma", time[rows], np.stack((bound, -bound), 1), names, colors=paint, widths=0.8
        )


def _draw_map(
    recording: Recording, judge: Judge, shown: Mapping[str, Score | None], colors: Mapping[str, style.Rgb]
) -> float:
    """Record the motion and the solutions on the map; return its zoom."""
    truth = judge.run.solution(judge.run.motion)
    assert truth.velocity_ned is not None
    assert truth.q_nb is not None
    _draw_track(recording, "map/motion", truth.latitude, truth.longitude, style.COLORS["truth"], 2.5)
    tracks = [NavState(truth.latitude, truth.longitude, truth.height, truth.velocity_ned, truth.q_nb)]
    for number, (name, score) in enumerate(shown.items()):
        own = judge.run.solution(name) if score is None else score.solution
        _draw_track(recording, f"map/{number}", own.latitude, own.longitude, colors[name], 1.2)
    return map_zoom([some_rows(track) for track in tracks])


def _draw_track(
    recording: Recording, entity: str, latitude: Array, longitude: Array, color: style.Rgb, width: float
) -> None:
    rows = thinned(len(latitude), 4096)
    lat_lon = np.column_stack((latitude[rows], longitude[rows])) / DEG
    lat_lon = lat_lon[np.isfinite(lat_lon).all(axis=1)]
    radius = rr.Radius.ui_points(width)
    recording.static(entity, rr.GeoLineStrings(lat_lon=[lat_lon], radii=radius, colors=color))


def _ranking_text(
    judge: Judge,
    numbers: Mapping[str, Mapping[str, float | None]],
    theirs: Mapping[str, Score],
    far: Sequence[str],
    span: tuple[float, float],
) -> str:
    """Return the ranking, Markdown."""
    lines = [
        f"# {judge.run.name}: scored solutions", "",
        f"Errors against {judge.against}, rms from {span[0]:g} s to {span[1]:g} s. Scored solutions are in bold.", "",
        "| | | horizontal, m | height, m | velocity, m/s | attitude, arcmin |", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for place, name in enumerate(ranking(numbers), start=1):
        own, angle = numbers[name], numbers[name]["rms_attitude_error_arcsec"]
        cells = [
            *(
                error_text(own[f"rms_{kind}"])
                for kind in ("horizontal_error_m", "height_error_m", "velocity_error_mps")
            ),
            error_text(None if angle is None else angle / 60.0),
        ]
        called = f"**{name}**" if name in theirs else name
        lines.append(f"| {place} | {called} | " + " | ".join(cells) + " |")
    if far:
        lines += ["", f"Not plotted, because the errors are much larger: {', '.join(far)}."]
    return "\n".join(lines)


def _about(scores: Sequence[Score]) -> str:
    """Return what is known of the scored solutions, Markdown."""
    lines: list[str] = []
    for score in scores:
        lines += [f"# {score.name}", "", f"`{score.path}`", "", *(f"- {sentence}" for sentence in score.sentences), ""]
    return "\n".join(lines)


_HEADINGS = (
    "horizontal\nfinal, m", "\nrms, m", "\nmax, m", "height\nmax, m", "velocity\nmax, m/s", "attitude\nmax, arcmin",
)  # fmt: skip


def show_scores(
    title: str,
    against: str,
    numbers: Mapping[str, Mapping[str, float | None]],
    scores: Sequence[Score],
    span: tuple[float, float],
    console: Console,
) -> None:
    """Print the errors of all solutions, ranked, and what is known of the scored ones.

    Args:
        numbers: results of `known_numbers` by algorithm.
        span: time over which they are compared, s.
    """
    table = Table(
        title=f"{title}: errors against {against}, {span[0]:g} s to {span[1]:g} s, by the rms horizontal error",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", justify="right", no_wrap=True)
    table.add_column("algorithm", no_wrap=True)
    for heading in _HEADINGS:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("time, s", justify="right", no_wrap=True)
    theirs = {score.name: score for score in scores}
    for place, name in enumerate(ranking(numbers), start=1):
        n = numbers[name]
        angle = n["max_attitude_error_arcsec"]
        seconds = theirs[name].seconds if name in theirs else None
        table.add_row(
            str(place),
            f"{name} *" if name in theirs else name,
            *(error_text(n[f"{kind}_horizontal_error_m"]) for kind in ("final", "rms", "max")),
            error_text(n["max_height_error_m"]),
            error_text(n["max_velocity_error_mps"]),
            error_text(None if angle is None else angle / 60.0),
            "" if seconds is None else error_text(seconds),
        )
    console.print(table)
    for score in scores:
        console.print(f"* {score.name} ({score.path}): {' '.join(score.sentences)}", markup=False)
