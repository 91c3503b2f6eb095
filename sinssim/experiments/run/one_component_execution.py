"""A run in a vertical plane from end to end: compute, write streams and recording, report."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from sinssim.experiments.run.run_files import about, keep
from sinssim.experiments.run.run_result import PlaneRun
from sinssim.recording.run_directory import RunDirectory
from sinssim.scenario.planned_motion import check_times
from sinssim.simulation.stages import Stages

if TYPE_CHECKING:
    from sinssim.experiments.run.summary_types import RunSummary
    from sinssim.scenario import Scenario


def compute_one_component(scenario: Scenario, folder: RunDirectory | None, stages: Stages) -> PlaneRun:
    """Compute a one-component run and record it.

    Args:
        folder: run directory to write; nothing is written if None.
    """
    assert scenario.one_component is not None  # the caller asks for such a run only
    check_times(scenario)
    with stages("navigate"):
        from sinssim.experiments.run.one_component_exhibits import numbers, one_component_streams, plane_charts
        from sinssim.simulation.one_component_run import compute

        result = compute(scenario.one_component, scenario.seed)
        plane = numbers(result)
    choice = scenario.recording
    if folder is not None and choice.has_streams:
        with stages("record"), folder.writing():
            from sinssim.recording.stream_tables import write_stream

            (folder.path / "streams").mkdir()
            streams = one_component_streams(result)
            for stream in streams:
                write_stream(stream, folder.path / "streams")
            if choice.has_recording:
                from sinssim.experiments.run.one_component_recording import record

                record(folder.path / "recording.rrd", scenario, result, plane, plane_charts(result), streams)
    start, end = float(result.truth.time[0]), float(result.truth.time[-1])
    entries = {**about(scenario, stages, "finished"), "start_s": start, "end_s": end, "one_component": plane}
    summary = cast("RunSummary", entries)
    directory = None
    if folder is not None:
        from sinssim.experiments.run.one_component_exhibits import plane_exhibits
        from sinssim.recording.report.exhibit_page import page_of

        report = page_of(plane_exhibits(scenario, result, summary)) if choice.has_report else None
        directory = keep(folder, scenario, (), summary, report)
    return PlaneRun(scenario, result, entries, directory)
