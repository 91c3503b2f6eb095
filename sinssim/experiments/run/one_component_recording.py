"""A run in a vertical plane from end to end, and its Rerun recording.

The recording has its charts, the Schuler pendulum, and its streams.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from sinssim.experiments.run.one_component_exhibits import (
    EQUATION_COLORS,
    SIMULATION_COLOR,
    error_table,
    numbers,
    one_component_streams,
    plane_charts,
    plane_exhibits,
)
from sinssim.experiments.run.run_files import about, keep
from sinssim.experiments.run.run_result import PlaneRun
from sinssim.recording import style
from sinssim.recording.result import Media, RunDirectory
from sinssim.recording.streams import Stream
from sinssim.recording.style import thinned
from sinssim.scenario.planned_limits import check_times
from sinssim.simulation.truth_and_sensors import Stages
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import RunSummary
    from sinssim.recording.rerun.rrd import Recording, Watching
    from sinssim.scenario import Scenario
    from sinssim.simulation.one_component_run import OneComponentResult

_FRAMES = 2000  # positions of the pendulum
_LARGEST = 35.0 * DEG  # largest angle at which it is drawn


def compute_one_component(
    scenario: Scenario,
    folder: RunDirectory | None,
    stages: Stages,
    media: Media[PlaneRun],
    viewer: Watching | None = None,
) -> PlaneRun:
    """Compute a one-component run; write it to a run directory, if there is a `folder`, and show it in a viewer."""
    assert scenario.one_component is not None  # the caller asks for such a run only
    check_times(scenario)
    with stages("navigate"):
        from sinssim.simulation.one_component_run import compute

        result = compute(scenario.one_component, scenario.seed)
        plane = numbers(result)
    choice = scenario.recording
    if folder is not None and choice.has_streams:
        with stages("record"), folder.writing():
            from sinssim.recording.streams import write_stream

            (folder.path / "streams").mkdir()
            streams = one_component_streams(result)
            for stream in streams:
                write_stream(stream, folder.path / "streams")
            if choice.has_recording:
                record(folder.path / "recording.rrd", scenario, result, streams, viewer)
    start, end = float(result.truth.time[0]), float(result.truth.time[-1])
    entries = {**about(scenario, stages, "finished"), "start_s": start, "end_s": end, "one_component": plane}
    summary = cast("RunSummary", entries)
    directory = None
    if folder is not None:
        from sinssim.recording.page import page_of

        report = page_of(plane_exhibits(scenario, result, summary)) if choice.has_report else None
        directory = keep(folder, scenario, (), summary, report)
    return PlaneRun(scenario, result, entries, directory, media=media)


def record(
    path: Path,
    scenario: Scenario,
    result: OneComponentResult,
    streams: Iterable[Stream],
    viewer: Watching | None = None,
) -> None:
    """Write the recording."""
    from sinssim.recording.rerun.exhibit_recording import markdown_of, record_charts
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.recording.rerun.viewer import RUN_ENTITY
    from sinssim.recording.rerun.views import RunInfo, all_views

    time, variant = result.truth.time, result.section.variant
    span = (float(time[0]), float(time[-1]))
    run = RunInfo(scenario.name, *span, (variant,), labels={"kind": "one-component"}, views=scenario.views)
    with Recording(path, run.application, all_views(run), viewer) as recording:
        labels = {**run.labels, **_draw_pendulum(recording, result)}
        for charts in plane_charts(result):
            labels |= record_charts(recording, charts, "one_component/")
        recording.document("about/scenario", f"```toml\n{scenario.to_toml()}\n```")
        recording.document("about/summary", markdown_of([error_table(numbers(result))]))
        for stream in streams:
            recording.stream(stream, thin=scenario.recording.detail == "light")
        run = replace(run, labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _draw_pendulum(recording: Recording, result: OneComponentResult) -> dict[str, str]:
    """Record the Schuler pendulum that Δy swings like, simulation over closed form; return how much it is enlarged."""
    import rerun as rr

    k = thinned(len(result.truth.time), _FRAMES)
    t = result.truth.time[k]
    lines = ((result.closed.coordinate, "closed", 9.0), (result.error.coordinate, "simulation", 3.0))
    largest = max(float(np.abs(y).max()) for y, _, _ in lines)
    factor = _LARGEST / largest if largest and np.isfinite(largest) else 1.0
    digits = 10.0 ** np.floor(np.log10(factor))
    factor = float(digits * np.floor(factor / digits))  # a round number
    arc = np.linspace(-1.3 * _LARGEST, 1.3 * _LARGEST, 61)
    grey = style.COLORS["ground"]
    rim = np.column_stack((np.sin(arc), np.cos(arc)))
    still = [rim, np.array([[0.0, 0.0], [0.0, 1.08]])]
    recording.static(
        "one_component/pendulum/scale", rr.LineStrips2D(still, radii=rr.Radius.ui_points(0.8), colors=grey)
    )
    colors = (EQUATION_COLORS["closed_form"], SIMULATION_COLOR)
    recording.static(
        "one_component/pendulum/words",
        rr.Points2D(
            [[0.0, 1.14], [-0.42, -0.1], [0.42, -0.1]],
            labels=["Δy = 0: true vertical", "closed form at rest", "simulation"],
            radii=rr.Radius.ui_points(0.1),
            colors=[grey, *colors],
            show_labels=True,
        ),
    )
    for order, ((y, name, size), color) in enumerate(zip(lines, colors, strict=True), start=1):
        angle, entity = factor * y[k], f"one_component/pendulum/{name}"
        bob = np.column_stack((np.sin(angle), np.cos(angle)))
        rods = np.stack((np.zeros_like(bob), bob), axis=1)
        rod = rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(size / 2.0), colors=[color], draw_order=order)
        recording.static(f"{entity}/rod", rod)
        recording.columns(f"{entity}/rod", t, rr.LineStrips2D.columns(strips=list(rods)))
        ball = rr.Points2D.from_fields(radii=rr.Radius.ui_points(3.0 + size), colors=[color], draw_order=order)
        recording.static(f"{entity}/bob", ball)
        recording.columns(f"{entity}/bob", t, rr.Points2D.columns(positions=bob))
    return {"enlarged": f"{factor:g}"}
