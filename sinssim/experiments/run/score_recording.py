"""The files of scored solutions in RUN/scores, and their Rerun recording: errors by component, map, and ranking."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.exhibits import Item, Sentence
from sinssim.experiments.run.run_scores import (
    FOLDER,
    RECORDING,
    Scored,
    ranked_table,
    score_charts,
    score_exhibits,
    to_json,
)
from sinssim.recording import style
from sinssim.recording.report.exhibit_page import page_of
from sinssim.recording.rerun.exhibit_recording import markdown_of, record_charts
from sinssim.recording.rerun.rrd import Recording, whole_recording
from sinssim.recording.rerun.scene import map_zoom, some_rows
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.stream_columns import error_stream, nav_stream
from sinssim.recording.stream_tables import write_stream
from sinssim.recording.style import thinned
from sinssim.system.outputs import Draft, publish, write_text, written
from sinssim.units import DEG


def write_scores(scored: Scored) -> Path:
    """Write the scores beside the run; the run's own files stay as they are.

    Returns:
        The report.
    """
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
                text = json.dumps(to_json(score, scored.span), indent=2, ensure_ascii=False)
                write_text(place / "score.json", text + "\n")
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
