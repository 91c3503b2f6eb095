"""The files of a run directory.

Streams and recording are written while the run is computed, Parquet on one thread and Rerun on another; scenario, own
content, report and summary at its end.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import Ellipsoid, ellipsoid_by_name
from sinssim.exhibits import Item, charts_in
from sinssim.experiments.run import run_recording as pictures
from sinssim.experiments.run.error_exhibits import error_charts
from sinssim.experiments.run.filter_summary import Moment, places_of
from sinssim.experiments.run.motion_exhibits import motion_charts
from sinssim.experiments.run.run_recording import draw_coordinates
from sinssim.experiments.run.run_result import Part
from sinssim.experiments.run.run_streams import coordinate_streams, filter_streams
from sinssim.experiments.run.sensor_exhibits import SensorComparison, comparison_charts, recorded_readings
from sinssim.experiments.run.summary_types import RunFacts, RunSummary
from sinssim.experiments.run.vehicle_mesh import PATHS, kind_of, shape_of
from sinssim.logs.stored_run import ErrorRule
from sinssim.recording import streams, style
from sinssim.recording.rerun_scene import Scene, drifted, map_zoom, some_rows
from sinssim.recording.rerun_viewer import RUN_ENTITY
from sinssim.recording.rerun_views import RunInfo, all_views
from sinssim.recording.result import RunDirectory, versions
from sinssim.recording.streams import (
    Stream,
    channel_streams,
    error_stream,
    imu_stream,
    nav_stream,
    reference_stream,
    set_streams,
    truth_stream,
)
from sinssim.scenario import Scenario
from sinssim.scenario.load import FOLDER
from sinssim.scenario.plan_summary import own_files
from sinssim.simulation.navigation_stage import Navigated
from sinssim.simulation.truth_and_sensors import Sensed, Stages, Truth
from sinssim.system.files import write_text
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory

if TYPE_CHECKING:
    from sinssim.logs.reference_solution import Reference
    from sinssim.recording.rerun_file import Recording, Watching
    from sinssim.simulation.truth_comparison import Aided


def about(scenario: Scenario, stages: Stages, status: str, message: str = "") -> RunFacts:
    """Return the entries of `summary.json` that do not depend on the success of the run."""
    plane = scenario.one_component
    facts: dict[str, object] = {
        "scenario": scenario.name,
        "status": status,
        **({"message": message} if message else {}),
        "seed": scenario.seed,
        "rate_hz": scenario.imu.rate_hz if plane is None else plane.rate_hz,
        "timing": stages.timing(),
        "versions": versions(),
        **({"own_content": files} if (files := [file.to_json() for file in own_files(scenario)]) else {}),
    }
    return cast("RunFacts", facts)


def keep(
    folder: RunDirectory,
    scenario: Scenario,
    about_filter: Sequence[str],
    summary: RunSummary,
    report: str | None,
    *,
    beside: str = "",
) -> Path:
    """Complete the run directory and move it into its place, `beside` another as for `RunDirectory.keep`."""
    with folder.writing():
        write_text(folder.path / "scenario.toml", scenario.to_toml(about_filter))
        for file in own_files(scenario):  # in the layout of a project folder, from which the run can be repeated
            place = folder.path / FOLDER / file.place
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.contents)
        if report is not None:
            write_text(folder.path / "report.html", report)
        write_text(folder.path / "summary.json", json.dumps(summary, indent=2, allow_nan=False) + "\n")
        return folder.keep(beside=beside)


def write_messages(folder: Path, messages: Mapping[str, str]) -> None:
    """Write the standard error of navigators of others to files of their names."""
    for name, text in messages.items():
        (folder / "navigators").mkdir(exist_ok=True)
        write_text(folder / "navigators" / f"{name}.txt", text)


class RunWriter:
    """Writes `recording.rrd` and `streams/*.parquet`; as a context manager it leaves both valid however it ends."""

    def __init__(
        self,
        folder: Path,
        scenario: Scenario,
        time: Array,
        motion: NavState,
        events: Sequence[FlightEvent],
        ellipsoid: Ellipsoid,
        viewer: Watching | None = None,
    ) -> None:
        """Open the recording, and start with the motion that it shows at (N+1,) s, which may be that of a solution; a
        viewer shows it at once."""
        self._streams = folder / "streams"
        self._streams.mkdir()
        self._events, self._planned, self._time = list(events), tuple(events), time
        self._track, self._recorded = some_rows(motion), scenario.log is not None
        self._scene, kind, shape = Scene.around(motion, ellipsoid), kind_of(scenario), shape_of(scenario)
        self._run = RunInfo(
            scenario.name,
            float(time[0]),
            float(time[-1]),
            scenario.solution_names,
            labels={
                "height_scale": str(self._scene.height_scale),
                "events": "yes" if self._events else "no",
                "path": PATHS[kind],
            },
            eye=(self._scene.eye, self._scene.middle),
            map_zoom=map_zoom([motion]),
            views=scenario.views,
        )
        self._kept = scenario.recording
        self._laid_out = False
        self._to_rerun = ThreadPoolExecutor(1, "rerun")
        self._to_parquet = ThreadPoolExecutor(1, "parquet")
        self._tasks: list[Future[None]] = []
        if self._kept.has_recording:
            self._opened = self._to_rerun.submit(_open, folder / "recording.rrd", self._run, viewer)
        try:
            toml = f"```toml\n{scenario.to_toml()}\n```"
            self._draw(lambda: self._recording.document("about/scenario", toml))
            self._draw(lambda: pictures.draw_flight(self._recording, time, motion, self._scene, events, kind, shape))
            self._draw(lambda: self._recording.events(self._planned))  # early: a browser shows what it has loaded
            self._angles = scenario.output.angles
            navigation_ellipsoid = ellipsoid_by_name(scenario.navigation.ellipsoid_over(ellipsoid.name))
            self._coordinates = coordinate_streams(scenario, navigation_ellipsoid, motion, float(time[0]))
        except BaseException:
            self._close()
            raise

    def flown(self, truth: Truth, outages: Sequence[tuple[float, float]]) -> None:
        """Write the true motion of a simulation, with its spans without satellites, s."""
        self.without_satellites(truth.time, truth.state, outages)
        airspeed = truth.trajectory.channels.get("airspeed_mps")
        self._chart(lambda: motion_charts(truth.time, truth.state, (), self._angles, airspeed))
        for stream in (truth_stream(truth.time, truth.state), imu_stream("ideal", truth.ideal)):
            self._stream(stream)
        coordinates = replace(self._coordinates, ellipsoid=truth.ellipsoid)
        for stream in coordinates.of("truth", truth.time, truth.state):
            self._stream(stream)
        for stream in channel_streams(truth.trajectory.channels):
            self._stream(stream)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    @property
    def _recording(self) -> Recording:
        """The recording, for the tasks of its thread; if it could not be opened, each of them fails with the reason."""
        return self._opened.result()

    def _close(self) -> None:
        for pool in (self._to_rerun, self._to_parquet):
            pool.shutdown(wait=True)
        if self._kept.has_recording:
            with self._recording:
                self._lay_out()

    def _submit(self, pool: ThreadPoolExecutor, work: Callable[..., Any], *arguments: Any) -> None:
        self._tasks.append(pool.submit(work, *arguments))

    def _draw(self, work: Callable[..., Any], *arguments: Any) -> None:
        """Do something to the recording, if there is one."""
        if self._kept.has_recording:
            self._submit(self._to_rerun, work, *arguments)

    def _chart(self, charts: Callable[[], Iterable[Item]]) -> None:
        """Record what some charts show over time."""
        self._draw(self._draw_charts, charts)

    def _draw_charts(self, items: Callable[[], Iterable[Item]]) -> None:
        from sinssim.recording.rerun_exhibits import record_charts

        labels: dict[str, str] = {}
        for charts in charts_in(items()):
            labels |= record_charts(self._recording, charts)
        self._learn(labels)

    def _show(self, stream: Stream, events: Sequence[float]) -> None:
        self._recording.stream(stream, thin=self._kept.detail == "light", events=events)

    def _stream(self, stream: Stream, metadata: Mapping[str, str] | None = None) -> None:
        self._submit(self._to_parquet, streams.write_stream, stream, self._streams, metadata)
        self._show_later(stream)

    def _show_later(self, stream: Stream) -> None:
        self._draw(self._show, stream, [event.time for event in self._events])

    def sensed(self, sensed: Sensed, kinds: Sequence[SensorComparison], events: Iterable[FlightEvent] = ()) -> None:
        """Write the sensors' readings, and those by kind of sensor that are drawn."""
        readings = sensed.readings
        self._chart(lambda: comparison_charts(kinds))
        self._events += events
        for kind, sensor_set in (("ideal", sensed.perfect), ("measured", readings)):
            for stream in set_streams(kind, sensor_set):
                self._stream(stream)
        self._stream(imu_stream("measured", readings.imu, with_angles=readings.attitude is None))
        if readings.compensated is not None:
            self._stream(imu_stream("compensated", readings.compensated))

    def recorded(
        self, motion: NavState, imu: ImuData, compensated: ImuData | None, reference: Reference | None
    ) -> None:
        """Write recorded sensors and the reference, and the motion that they show."""
        self._chart(lambda: motion_charts(self._time, motion, (), self._angles))
        self._chart(lambda: recorded_readings(imu))
        self._stream(imu_stream("measured", imu))
        if compensated is not None:
            self._stream(imu_stream("compensated", compensated))
        if reference is not None:
            self._stream(reference_stream(reference))

    def without_satellites(self, time: Array, truth: NavState, outages: Sequence[tuple[float, float]]) -> None:
        """Mark the spans without satellites, s, on the map of a motion at (N,) s."""
        if outages:
            self._draw(lambda: pictures.draw_outages(self._recording, time, truth, outages))

    def navigated(self, run: Navigated, parts: Mapping[str, Part[object]], rule: ErrorRule | None = None) -> None:
        """Write solutions and their errors, not stored if a rule gives them, and what only some runs have."""
        solutions, errors, failed = run.solutions, run.errors, run.failures
        for name, error in failed.items():
            self._events.append(FlightEvent(self._run.end if error.time is None else error.time, f"{name}: {error}"))
        for solution in solutions.values():
            self._events += [FlightEvent(event.start, event.text) for event in solution.events]
        self._chart(lambda: error_charts(run, (self._run.start, self._run.end)))
        self._draw(self._draw_navigation, solutions)
        for name, solution in solutions.items():
            stream, of_errors = nav_stream(name, solution), error_stream(name, errors[name].at, solution.time)
            if rule is not None and np.array_equal(solution.time, self._time):
                self._stream(stream, rule.metadata())
                self._show_later(of_errors)
            else:
                self._stream(stream)
                self._stream(of_errors)
            for stream in self._coordinates.of(name, solution.time, solution):
                self._stream(stream)
        self.parts(parts)
        for pool in (self._to_rerun, self._to_parquet):
            self._submit(pool, streams.give_back_memory)

    def parts(self, parts: Mapping[str, Part[object]]) -> None:
        """Write what only some runs have, without what waits for the filter."""
        for part in (part for part in parts.values() if part.aided is not None or not part.after_filter):
            for stream in part.streams():
                self._stream(stream)
            self._draw(self._draw_part, part)

    def filtered(self, aided: Aided, items: Sequence[Item], faults: Sequence[Moment], path: Trajectory | None) -> None:
        """Write the estimate of a filter and its readings, what they show, and the faults on the true path."""
        self._draw(self._draw_filter, aided, items)
        self._events += [FlightEvent(at, text) for at, _, text in faults]
        if path is not None and (places := places_of(faults, path)).words:
            self._draw(lambda: pictures.draw_line(self._recording, self._scene, places))
        self._draw(streams.give_back_memory)
        for stream in filter_streams(aided):
            self._stream(stream)
        for stream in self._coordinates.of("aided", aided.estimate.time, aided.estimate.solution):
            self._stream(stream)
        for pool in (self._to_rerun, self._to_parquet):
            self._submit(pool, streams.give_back_memory)
        if (end := aided.estimate.divergence) is not None:
            self._events.append(FlightEvent(end.time, f"the filter diverged: {end.reason}"))

    def finish(self, summary: Sequence[Item], progress: Callable[[float], None]) -> None:
        """Write the remaining data and the table of errors, and wait until everything is written."""
        self._events.sort(key=lambda event: event.time)
        self._draw(self._document, "about/summary", summary)
        self._draw(self._draw_events)
        self._draw(self._lay_out)
        self._submit(self._to_parquet, streams.write_events, self._events, self._streams)
        left = set(self._tasks)
        while left:
            done, left = wait(left, timeout=0.1)
            for task in done:
                task.result()
            progress(1.0 - len(left) / len(self._tasks))
        self._close()

    def _document(self, entity: str, items: Sequence[Item]) -> None:
        from sinssim.recording.rerun_exhibits import markdown_of

        self._recording.document(entity, markdown_of(items))

    def _draw_navigation(self, solutions: Mapping[str, NavSolution]) -> None:
        paint, widths = style.colors(list(solutions)), style.stacked_widths(len(solutions))
        for (name, solution), color, width in zip(solutions.items(), paint, widths, strict=True):
            pictures.draw_path(self._recording, self._scene, name, solution, color, width)
        # recorded small sensors alone drift so far that the map would show nothing else: it is centred on what it shows
        hidden = drifted(self._track, solutions) if self._recorded else []
        zoom = map_zoom([self._track, *(solution for name, solution in solutions.items() if name not in hidden)])
        self._run = replace(self._run, algorithms=tuple(solutions), map_zoom=zoom)
        labels = {"not_on_map": " ".join(hidden)}
        for first, solution in [*solutions.items()][:1]:  # none if all have diverged, and the filter goes on
            labels |= draw_coordinates(self._recording, self._coordinates.of(first, solution.time, solution))
        self._learn(labels)

    def _draw_filter(self, aided: Aided, items: Sequence[Item]) -> None:
        self._document("about/filter", items)
        self._draw_charts(lambda: items)
        pictures.draw_path(self._recording, self._scene, "aided", aided.estimate.solution, style.COLORS["aided"])
        self._learn({"filter": "yes"})

    def _draw_part(self, part: Part[object]) -> None:
        known = len(self._run.labels)
        self._draw_charts(part.exhibits)
        for path in part.paths():
            pictures.draw_line(self._recording, self._scene, path)
        if len(self._run.labels) > known:
            self._learn({part.name: "yes"})

    def _draw_events(self) -> None:
        self._recording.events([event for event in self._events if event not in self._planned])
        if self._events and self._run.label("events") == "no":
            self._learn({"events": "yes"})

    def _learn(self, labels: dict[str, str]) -> None:
        """Keep the units in the views' titles, which follow from the run's numbers, for the layout."""
        self._run = replace(self._run, labels={**self._run.labels, **labels})
        self._laid_out = False

    def _lay_out(self) -> None:
        """Send the views with the units in their titles and the ranges of their axes, if they have changed."""
        if not self._laid_out:
            self._run, self._laid_out = replace(self._run, ranges=dict(self._recording.ranges)), True
            self._recording.blueprint(all_views(self._run))
            self._recording.document(RUN_ENTITY, self._run.to_json())


def _open(file: Path, about: RunInfo, viewer: Watching | None) -> Recording:
    """Open a recording; a task of its thread, because Rerun takes a third of a second to load."""
    from sinssim.recording.rerun_file import Recording

    return Recording(file, about.application, all_views(about), viewer)
