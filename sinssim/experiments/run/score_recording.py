"""The Rerun recording of scored solutions: errors by component, the map, and the ranking."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.data import Array
from sinssim.exhibits import Item, Sentence
from sinssim.experiments.run.run_scores import Scored, ranked_table, score_charts
from sinssim.recording import style
from sinssim.recording.rerun.exhibit_recording import markdown_of, record_charts
from sinssim.recording.rerun.rrd import Recording, whole_recording
from sinssim.recording.rerun.scene import map_zoom, some_rows
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.style import thinned
from sinssim.units import DEG


def record_scores(scored: Scored, path: Path) -> None:
    """Write the recording.

    Raises:
        RunError: it cannot be written.
    """
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
