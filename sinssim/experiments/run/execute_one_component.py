"""Runs a one-component scenario and writes its run directory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.experiments.run.finish import about, keep
from sinssim.experiments.run.result import PlaneRun
from sinssim.scenario.duration import check_times

if TYPE_CHECKING:
    from sinssim.recording.store.directory import RunDirectory
    from sinssim.scenario import Scenario
    from sinssim.simulation.stages import Stages


def compute_one_component(scenario: Scenario, folder: RunDirectory | None, stages: Stages) -> PlaneRun:
    """Compute a one-component run and record it.

    Args:
        folder: run directory to write; nothing is written if None.

    Raises:
        InputError: the scenario or the directory cannot be used.
    """
    assert scenario.one_component is not None  # the caller asks for such a run only
    check_times(scenario)
    with stages("navigate"):
        from sinssim.experiments.run.store.one_component_files import numbers, one_component_streams
        from sinssim.simulation.one_component import compute

        result = compute(scenario.one_component, scenario.seed)
        found = numbers(result)
    kept = scenario.recording
    if folder is not None and kept.has_streams:
        with stages("record"), folder.writing():
            from sinssim.recording.store.parquet import write_stream

            (folder.path / "streams").mkdir()
            streams = one_component_streams(result)
            for stream in streams:
                write_stream(stream, folder.path / "streams")
            if kept.has_recording:
                from sinssim.experiments.run.views.one_component_recording import record

                record(folder.path / "recording.rrd", scenario, result, found, streams)
    summary = {
        **about(scenario, stages, "finished"),
        "start_s": float(result.truth.time[0]),
        "end_s": float(result.truth.time[-1]),
        "one_component": found,
    }
    directory = None
    if folder is not None:
        from sinssim.experiments.run.report.one_component_report import one_component_report

        report = one_component_report(scenario, result, summary) if kept.has_report else None
        directory = keep(folder, scenario, (), summary, report)
    return PlaneRun(scenario, result, summary, directory)
