"""The Rerun recording of scored solutions: errors beside those of the run's algorithms, σ where given, map, ranking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.data import Array, NavState
from sinssim.experiments.run.report.errors import Compared
from sinssim.experiments.run.report.score_report import near_the_scored
from sinssim.experiments.run.store.score_files import ranking
from sinssim.experiments.run.tables.run_table import error_text
from sinssim.logs.scoring.score import Judge, Score
from sinssim.recording import style
from sinssim.recording.rerun.rrd import Recording, whole_recording
from sinssim.recording.rerun.scene import map_zoom, some_rows
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.scales import thinned
from sinssim.scales import ANGLES, HEIGHTS, LENGTHS, SPEEDS, suiting
from sinssim.strapdown.nav_error import NavError
from sinssim.units import DEG

_PLOTS = (
    ("position_north", "position"), ("position_east", "position"), ("height", "height"),
    ("velocity_north", "velocity"), ("velocity_east", "velocity"), ("velocity_down", "velocity"),
    ("tilt_north", "attitude"), ("tilt_east", "attitude"), ("azimuth", "attitude"),
)  # fmt: skip
"""Nine components: key of the plot, and what its unit is chosen for."""
_SCALES = {"position": LENGTHS, "height": HEIGHTS, "velocity": SPEEDS, "attitude": ANGLES}
_WITHIN = 3.0
"""Factor of the σ that is drawn, as in the view of a filter."""
_WIDE, _THIN = 2.7, 1.5
"""Widths of the lines of the run's own algorithms, and of the scored solutions, points."""
_OWN_SIGMA = [f"sigma_{what}" for what in ("position_{}_m", "velocity_{}_mps", "phi_{}_rad")]


def record(
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
