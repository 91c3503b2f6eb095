"""Writes a run while it is computed: Parquet on one thread, the Rerun recording on another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.models import Ellipsoid, ellipsoid_by_name
from sinssim.earth.transverse import route_pole
from sinssim.exhibits import charts_in
from sinssim.experiments.run.sensor_comparison import SensorComparison
from sinssim.experiments.run.store.coordinate_streams import CoordinateStreams
from sinssim.experiments.run.store.filter_streams import filter_streams
from sinssim.experiments.run.views import log_run as pictures
from sinssim.experiments.run.views.log_coordinates import draw_coordinates
from sinssim.experiments.run.views.log_filter import draw_filter
from sinssim.experiments.run.views.models import PATHS, kind_of
from sinssim.recording import style
from sinssim.recording.rerun.scene import Scene, drifted, map_zoom, some_rows
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.recording.store import parquet
from sinssim.recording.store.streams import (
    channel_streams,
    error_stream,
    imu_stream,
    nav_stream,
    reference_stream,
    set_streams,
    truth_stream,
)
from sinssim.recording.streams import Stream
from sinssim.strapdown.nav_error import NavError
from sinssim.truth.channel import FlightEvent

if TYPE_CHECKING:
    from sinssim.experiments.run.part import Part
    from sinssim.logs.reference import Reference
    from sinssim.logs.stored.error_rule import ErrorRule
    from sinssim.recording.rerun.rrd import Recording
    from sinssim.scenario import Scenario
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.simulation.navigation import Navigated
    from sinssim.simulation.sensed import Sensed
    from sinssim.simulation.truth import Truth

_PATH_WIDTH = 2.0


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
    ) -> None:
        """Open the recording, and start with the motion that it shows.

        Args:
            time: (N+1,) s.
            motion: states at those times: the true ones, or what stands for them on recorded sensors.

        Raises:
            OSError: the recording cannot be written.
        """
        self._streams = folder / "streams"
        self._streams.mkdir()
        self._events, self._time = list(events), time
        self._track, self._recorded = some_rows(motion), scenario.log is not None
        self._scene, kind = Scene.around(motion, ellipsoid), kind_of(scenario)
        self._run = RunInfo(
            scenario.name,
            float(time[0]),
            float(time[-1]),
            scenario.navigation.algorithms,
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
            self._opened = self._to_rerun.submit(_open, folder / "recording.rrd", self._run)
        try:
            toml = f"```toml\n{scenario.to_toml()}\n```"
            self._draw(lambda: self._recording.document("about/scenario", toml))
            self._draw(self._draw_flight, time, motion, events, scenario.output.angles, kind)
            own = ellipsoid_by_name(scenario.navigation.ellipsoid_over(ellipsoid.name))
            self._coordinates = _coordinate_streams(scenario, own, motion, float(time[0]))
        except BaseException:
            self._close()
            raise

    def flown(self, truth: Truth, outages: Sequence[tuple[float, float]]) -> None:
        """Write the true motion of a simulation.

        Args:
            outages: spans without satellites, s.
        """
        self.without_satellites(truth.time, truth.state, outages)
        for stream in (truth_stream(truth.time, truth.state), imu_stream("ideal", truth.ideal)):
            self._stream(stream)
        own = replace(self._coordinates, ellipsoid=truth.ellipsoid)
        for stream in own.of("truth", truth.time, truth.state):
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

    def _show(self, stream: Stream, events: Sequence[float]) -> None:
        self._recording.stream(stream, thin=self._kept.detail == "light", events=events)

    def _stream(self, stream: Stream, metadata: Mapping[str, str] | None = None) -> None:
        self._submit(self._to_parquet, parquet.write_stream, stream, self._streams, metadata)
        self._show_later(stream)

    def _show_later(self, stream: Stream) -> None:
        self._draw(self._show, stream, [event.time for event in self._events])

    def sensed(self, sensed: Sensed, kinds: Sequence[SensorComparison], events: Iterable[FlightEvent] = ()) -> None:
        """Write the sensors' readings.

        Args:
            kinds: the readings by kind of sensor, to be drawn.
        """
        readings = sensed.readings
        self._draw(self._draw_sensors, kinds)
        self._events += events
        for kind, found in (("ideal", sensed.perfect), ("measured", readings)):
            for stream in set_streams(kind, found):
                self._stream(stream)
        self._stream(imu_stream("measured", readings.imu, with_angles=readings.attitude is None))
        if readings.compensated is not None:
            self._stream(imu_stream("compensated", readings.compensated))

    def recorded(self, imu: ImuData, compensated: ImuData | None, reference: Reference | None) -> None:
        """Write recorded sensors and the reference.

        Args:
            compensated: the compensated increments, if there is a calibration.
            reference: the reference solution, if there is one.
        """
        self._draw(self._draw_recorded, imu)
        self._stream(imu_stream("measured", imu))
        if compensated is not None:
            self._stream(imu_stream("compensated", compensated))
        if reference is not None:
            self._stream(reference_stream(reference))

    def without_satellites(self, time: Array, truth: NavState, outages: Sequence[tuple[float, float]]) -> None:
        """Mark the parts of the track without satellites on the map.

        Args:
            time: (N,) s.
            outages: spans, s.
        """
        if outages:
            self._draw(lambda: pictures.draw_outages(self._recording, time, truth, outages))

    def navigated(self, run: Navigated, parts: Mapping[str, Part], rule: ErrorRule | None = None) -> None:
        """Write the solutions of the algorithms and their errors, and what only some runs have.

        Args:
            rule: how the errors follow from truth and solution, so that they are not stored; None if they do not.
        """
        solutions, errors, failed = run.solutions, run.errors, run.failures
        for name, error in failed.items():
            self._events.append(FlightEvent(self._run.end if error.time is None else error.time, f"{name}: {error}"))
        for solution in solutions.values():
            self._events += [FlightEvent(event.start, event.text) for event in solution.events]
        self._draw(self._draw_navigation, solutions, errors)
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
            self._submit(pool, parquet.give_back_memory)

    def parts(self, parts: Mapping[str, Part]) -> None:
        """Write what only some runs have."""
        for part in parts.values():
            for stream in part.streams():
                self._stream(stream)
            self._draw(self._draw_part, part)

    def filtered(self, aided: Aided, about: str) -> None:
        """Write the estimate of a filter and its readings.

        Args:
            about: text on the filter's consistency, Markdown.
        """
        self._draw(lambda: self._recording.document("about/filter", about))
        self._draw(self._draw_filter, aided)
        self._draw(parquet.give_back_memory)
        for stream in filter_streams(aided):
            self._stream(stream)
        for stream in self._coordinates.of("aided", aided.estimate.time, aided.estimate.solution):
            self._stream(stream)
        for pool in (self._to_rerun, self._to_parquet):
            self._submit(pool, parquet.give_back_memory)
        if (end := aided.estimate.divergence) is not None:
            self._events.append(FlightEvent(end.time, f"the filter diverged: {end.reason}"))

    def finish(self, summary: str, progress: Callable[[float], None]) -> None:
        """Write the remaining data, and wait until everything is written.

        Args:
            summary: the summary's table, Markdown.

        Raises:
            OSError: data could not be written.
        """
        self._events.sort(key=lambda event: event.time)
        self._draw(lambda: self._recording.document("about/summary", summary))
        self._draw(self._draw_events)
        self._draw(self._lay_out)
        self._submit(self._to_parquet, parquet.write_events, self._events, self._streams)
        left = set(self._tasks)
        while left:
            done, left = wait(left, timeout=0.1)
            for task in done:
                task.result()
            progress(1.0 - len(left) / len(self._tasks))
        self._close()

    def _draw_flight(
        self, time: Array, truth: NavState, events: Sequence[FlightEvent], angles: str | None, kind: str
    ) -> None:
        pictures.draw_flight(self._recording, time, truth, self._scene, events, angles, kind)
        self._learn({})

    def _draw_sensors(self, kinds: Sequence[SensorComparison]) -> None:
        self._learn(pictures.draw_sensors(self._recording, kinds))

    def _draw_recorded(self, imu: ImuData) -> None:
        self._learn(pictures.draw_recorded_sensors(self._recording, imu))

    def _draw_navigation(self, solutions: dict[str, NavSolution], errors: dict[str, NavError]) -> None:
        labels = pictures.draw_navigation(self._recording, self._scene, solutions, errors)
        # recorded small sensors alone drift so far that the map would show nothing else: it is centred on what it shows
        hidden = drifted(self._track, solutions) if self._recorded else []
        zoom = map_zoom([self._track, *(solution for name, solution in solutions.items() if name not in hidden)])
        self._run = replace(self._run, algorithms=tuple(solutions), map_zoom=zoom)
        self._learn({"not_on_map": " ".join(hidden)})
        first, solution = next(iter(solutions.items()))
        labels |= draw_coordinates(self._recording, self._coordinates.of(first, solution.time, solution))
        self._learn(labels)

    def _draw_filter(self, aided: Aided) -> None:
        labels = draw_filter(self._recording, aided)
        pictures.draw_path(
            self._recording, self._scene, "aided", aided.estimate.solution, style.COLORS["aided"], _PATH_WIDTH
        )
        self._learn(labels)

    def _draw_part(self, part: Part) -> None:
        from sinssim.recording.rerun.exhibits import record_charts

        labels: dict[str, str] = {}
        for charts in charts_in(part.exhibits()):
            labels |= record_charts(self._recording, charts)
        self._learn({**labels, part.name: "yes"} if labels else {})

    def _draw_events(self) -> None:
        self._recording.events(self._events)
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


def _open(file: Path, about: RunInfo) -> Recording:
    """Open a recording; a task of its thread, because Rerun takes a third of a second to load."""
    from sinssim.recording.rerun.rrd import Recording

    return Recording(file, about.application, all_views(about))


def _coordinate_streams(scenario: Scenario, ellipsoid: Ellipsoid, truth: NavState, epoch: float) -> CoordinateStreams:
    """Return what makes the streams in the coordinates that a scenario records, of a motion on an ellipsoid."""
    route = scenario.navigation.route_deg
    start = (float(truth.latitude[0]), float(truth.longitude[0]))
    pole = route_pole(None if route is None else tuple(np.radians(route)), *start, truth.velocity_ned[0])
    begin = start if route is None else (float(np.radians(route[0])), float(np.radians(route[1])))
    return CoordinateStreams(scenario.coordinates, scenario.output.angles, ellipsoid, pole, begin, epoch)
