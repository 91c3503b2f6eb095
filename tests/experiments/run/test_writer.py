"""Everything that a run writes, in order: streams and pictures, by stand-ins that keep what they are given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Axis, Chart, Charts, Line
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import RunError
from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_files
from sinssim.experiments.run.filter_summary import Moment
from sinssim.experiments.run.run_result import Part
from sinssim.strapdown.frames.route_pole import route_pole
from sinssim.truth.sampling import FlightEvent

TIME = np.array([50.0, 50.5, 51.5])
OUTAGES = ((50.25, 50.75),)


class Opened:
    """Stands in for a recording, and for all that is written: keeps the calls in order."""

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.ranges = {"entity": (1.0, 2.0)}

    def __getattr__(self, name: str) -> Any:
        return lambda *given, **more: self.calls.append((name, *given, *more.values()))

    def stream(self, stream: Any, *, thin: bool, events: list[float]) -> None:
        self.calls.append(("shown", stream.name, thin, tuple(events)))

    def events(self, events: list[FlightEvent]) -> None:
        self.calls.append(("events", *((one.time, one.text) for one in events)))

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *error: object) -> None:
        self.calls.append(("closed",))


@dataclass(frozen=True)
class Coordinates:
    """Stands in for the streams in further coordinates."""

    ellipsoid: str = "own"

    def of(self, name: str, time: Any, motion: Any) -> Iterator[Any]:
        yield SimpleNamespace(name=f"coordinates_{name}_{self.ellipsoid}", time=time)


def named(kind: str) -> Any:
    """Return what makes a stream whose name tells what it is made of."""
    return lambda *given, **more: SimpleNamespace(
        name=" ".join([kind, *(one for one in given if isinstance(one, str)), *(f"{k}={v}" for k, v in more.items())])
    )


def chart_of(name: str, opened: Opened) -> Any:
    """Return what notes its arguments and yields a chart with its name, in km."""

    def charts(*given: Any) -> Iterator[Charts]:
        opened.calls.append((name, *given))
        marks = (Line(label="a", x=TIME, y=np.array([0.0, 3e5, 1e5])),)
        y = Axis(units=(("m", 1.0, 1e5), ("km", 1e3, np.inf)))
        yield Charts(name, ((Chart(key=name, y=y, marks=marks),),), (1.0, 1.0))

    return charts


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    found = Opened()
    monkeypatch.setattr(
        run_files, "_open", lambda file, about, viewer: found.calls.append((file.name, about.application)) or found
    )
    monkeypatch.setattr(run_files, "all_views", lambda run: dict(run.labels))
    monkeypatch.setattr(run_files, "kind_of", lambda scenario: "land")
    monkeypatch.setattr(run_files, "shape_of", lambda scenario: "long")
    monkeypatch.setattr(run_files, "some_rows", lambda motion: motion)
    monkeypatch.setattr(run_files, "map_zoom", lambda motions: float(len(motions)))
    monkeypatch.setattr(run_files, "drifted", lambda track, solutions: [name for name in solutions if name == "euler"])
    scene = SimpleNamespace(height_scale=20, eye=(1.0, 2.0, 3.0), middle=(4.0, 5.0, 6.0))
    monkeypatch.setattr(run_files.Scene, "around", lambda truth, ellipsoid: scene)
    monkeypatch.setattr(run_files, "coordinate_streams", lambda scenario, own, truth, epoch: Coordinates())
    for kind in ("truth", "imu", "nav", "reference", "error"):
        monkeypatch.setattr(run_files, f"{kind}_stream", named(kind))
    monkeypatch.setattr(run_files, "channel_streams", lambda channels: [named("channel")(name) for name in channels])
    monkeypatch.setattr(run_files, "set_streams", lambda kind, readings: [named("set")(kind, readings.name)])
    monkeypatch.setattr(run_files, "filter_streams", lambda aided: [named("filter")("estimate")])
    monkeypatch.setattr(run_files, "draw_coordinates",
                        lambda recording, streams: {one.name: "km" for one in streams})  # fmt: skip
    for name in ("draw_flight", "draw_outages", "draw_path"):

        def drawn(recording: Any, *given: Any, own: str = name) -> None:
            recording.calls.append((own, *given))

        monkeypatch.setattr(run_files.pictures, name, drawn)
    for name in ("motion_charts", "comparison_charts", "recorded_readings", "error_charts"):
        monkeypatch.setattr(run_files, name, chart_of(name, found))
    monkeypatch.setattr(run_files.streams, "give_back_memory", lambda: None)
    written = run_files.streams
    monkeypatch.setattr(written, "write_stream", lambda stream, folder, metadata=None: found.calls.append(
        ("written", stream.name, folder.name, metadata)))  # fmt: skip
    monkeypatch.setattr(run_files.streams, "write_events", lambda events, folder: found.calls.append(
        ("events written", *((one.time, one.text) for one in events))))  # fmt: skip
    return found


def scenario(detail: str = "light", has_recording: bool = True, log: object = None) -> Any:
    return SimpleNamespace(
        name="short", solution_names=("poisson", "euler"),
        navigation=SimpleNamespace(ellipsoid_over=lambda name: name),
        views=("own.py",), recording=SimpleNamespace(has_recording=has_recording, detail=detail),
        to_toml=lambda: "seed = 3", output=SimpleNamespace(angles="-90..270"), log=log,
    )  # fmt: skip


EVENTS = (FlightEvent(51.0, "turns"),)
ELLIPSOID: Any = SimpleNamespace(name="krasovsky-1940")
TRUTH: Any = SimpleNamespace(name="truth")


def begun(folder: Path, **more: Any) -> Any:
    """Return a writer that has written a true motion."""
    made = run_files.RunWriter(folder, scenario(**more), TIME, TRUTH, EVENTS, ELLIPSOID)
    trajectory = SimpleNamespace(channels={"airspeed_mps": 1})
    truth: Any = SimpleNamespace(time=TIME, state=TRUTH, ideal="ideal", ellipsoid=ELLIPSOID, trajectory=trajectory)
    made.flown(truth, OUTAGES)
    return made


def of(opened: Opened, *kinds: str) -> list[tuple[Any, ...]]:
    """Return the calls of some kinds, in order."""
    return [call for call in opened.calls if call[0] in kinds]


def test_the_beginning_of_a_run(tmp_path: Path, opened: Opened) -> None:
    """The true motion stands on the Earth's ellipsoid, solutions on the navigator's."""
    with begun(tmp_path) as made:
        pass
    run = made._run
    assert (run.name, run.start, run.end, run.algorithms) == ("short", 50.0, 51.5, ("poisson", "euler"))
    assert dict(run.labels) == {"height_scale": "20", "events": "yes", "path": "Path of the car",
                                "motion_charts": "km"}  # fmt: skip
    assert (run.eye, run.map_zoom, run.views) == (((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), 1.0, ("own.py",))
    assert opened.calls[0] == ("recording.rrd", "sinssim short")
    assert of(opened, "document")[0] == ("document", "about/scenario", "```toml\nseed = 3\n```")
    (flight,) = of(opened, "draw_flight")
    assert flight[2] is TRUTH
    assert flight[4:] == ((FlightEvent(51.0, "turns"),), "land", "long")
    (charts,) = of(opened, "motion_charts")
    assert charts[2:] == (TRUTH, (), "-90..270", 1)
    (outages,) = of(opened, "draw_outages")
    assert outages[2:] == (TRUTH, OUTAGES)
    written = [(name, folder, metadata) for _, name, folder, metadata in of(opened, "written")]
    on_ellipsoid = f"coordinates_truth_{ELLIPSOID}"
    assert [name for name, _, _ in written] == ["truth", "imu ideal ideal", on_ellipsoid, "channel airspeed_mps"]
    assert all(one[1:] == ("streams", None) for one in written)
    assert [call[2:] for call in of(opened, "shown")] == [(True, (51.0,))] * 4
    assert run.ranges["entity"] == (1.0, 2.0)
    assert of(opened, "blueprint") == [("blueprint", dict(run.labels))]
    assert opened.calls[-1] == ("closed",)


def test_recorded_sensors_are_drawn_without_a_truth(tmp_path: Path, opened: Opened) -> None:
    made = run_files.RunWriter(tmp_path, scenario("full", log="log"), TIME, TRUTH, (), ELLIPSOID)
    assert made._run.labels["events"] == "no"
    made.recorded(TRUTH, "imu", None, None)  # type: ignore[arg-type]
    made.recorded(TRUTH, "imu", "compensated", "reference")  # type: ignore[arg-type]
    made.finish([Sentence("text")], lambda share: None)
    assert [call[1] for call in of(opened, "written")] == [
        "imu measured imu", "imu measured imu", "imu compensated compensated", "reference reference",
    ]  # fmt: skip
    assert of(opened, "recorded_readings") == [("recorded_readings", "imu")] * 2
    assert [call[2:] for call in of(opened, "motion_charts")] == [(TRUTH, (), "-90..270")] * 2
    assert not of(opened, "draw_outages")
    assert all(call[2:] == (False, ()) for call in of(opened, "shown"))
    assert made._run.labels["recorded_readings"] == "km"
    assert made._run.labels["events"] == "no"


def test_what_the_sensors_read(tmp_path: Path, opened: Opened) -> None:
    """Events of the sensors are kept; increments of angle are left out where an attitude is measured."""
    imu = SimpleNamespace(time=TIME)
    perfect = SimpleNamespace(name="perfect")
    usual = SimpleNamespace(name="read", monitored=("gyros",), imu=imu, attitude=None, compensated="compensated")
    level = SimpleNamespace(name="read", monitored=(), imu=imu, attitude="q", compensated=None)
    with begun(tmp_path) as made:
        before = len(of(opened, "written"))
        made.sensed(SimpleNamespace(readings=usual, perfect=perfect), ["kind"],
                    [FlightEvent(50.125, "an alarm")])  # fmt: skip
        made.sensed(SimpleNamespace(readings=level, perfect=perfect), [])
        made._to_parquet.submit(int).result()
    names = [call[1] for call in of(opened, "written")][before:]
    assert names[-7:] == [
        "set ideal perfect", "set measured read", "imu measured with_angles=True", "imu compensated compensated",
        "set ideal perfect", "set measured read", "imu measured with_angles=False",
    ]  # fmt: skip
    assert of(opened, "comparison_charts") == [("comparison_charts", ["kind"]), ("comparison_charts", [])]
    assert [call[3] for call in of(opened, "shown")][-1] == (51.0, 50.125)
    assert made._run.labels["comparison_charts"] == "km"


def solution(time: Any = TIME, *events: tuple[float, str]) -> Any:
    return SimpleNamespace(time=time, events=[SimpleNamespace(start=at, text=text) for at, text in events])


def error() -> Any:
    return SimpleNamespace(at=None)


class Further(Part):
    """A part with a stream and a chart."""

    name = "further"

    def streams(self) -> Any:
        yield SimpleNamespace(name="error_without_it")

    def exhibits(self) -> Any:
        marks = (Line(label="a", x=TIME, y=np.array([2e3, 3e5, 1e5]), color="truth"),)
        y = Axis(units=(("m", 1.0, 1e5), ("km", 1e3, np.inf)))
        yield Charts("c", ((Chart(key="further/error", y=y, marks=marks),),), (1.0, 1.0))
        yield Charts("d", ((Chart(key="further/page", y=y, marks=marks),),), (1.0, 1.0), on=("page",))


def test_the_solutions(tmp_path: Path, opened: Opened) -> None:
    """Errors that follow from truth and solution are drawn, and not stored; others, of other times, are both."""
    rule = SimpleNamespace(metadata=lambda: {"rule": "a, f, axes"})
    failures = {"a": RunError("It fell.", time=50.75), "b": RunError("It rose.")}
    solutions = {"poisson": solution(), "euler": solution(TIME[:2], (50.25, "through 90°"))}
    errors = {"poisson": error(), "euler": error()}
    with begun(tmp_path) as made:
        made._to_rerun.submit(int).result()
        made._to_parquet.submit(int).result()
        opened.calls.clear()
        run: Any = SimpleNamespace(solutions=solutions, errors=errors, failures=failures)
        made.navigated(run, {"further": Further(run)}, rule)  # type: ignore[arg-type]
        made._to_rerun.submit(int).result()
        made._to_parquet.submit(int).result()
        assert [(call[1], call[3]) for call in of(opened, "written")] == [
            ("nav poisson", {"rule": "a, f, axes"}), ("coordinates_poisson_own", None), ("nav euler", None),
            ("error euler", None), ("coordinates_euler_own", None), ("error_without_it", None),
        ]  # fmt: skip
        events = (51.0, 50.75, 51.5, 50.25)
        assert [call[1:] for call in of(opened, "shown")] == [
            (name, True, events)
            for name in ("nav poisson", "error poisson", "coordinates_poisson_own", "nav euler", "error euler",
                         "coordinates_euler_own", "error_without_it")
        ]  # fmt: skip
        errors_of, line = of(opened, "series")
        assert (errors_of[1], line[1]) == ("error_charts", "further/error")
        assert of(opened, "error_charts") == [("error_charts", run, (50.0, 51.5))]
        assert [call[2] for call in of(opened, "draw_path")] == ["poisson", "euler"]
        np.testing.assert_array_equal(line[3][:, 0], [2.0, 300.0, 100.0])
        assert (made._run.labels["further"], made._run.labels["further/error"]) == ("yes", "km")
        assert [(one.time, one.text) for one in made._events[1:]] == [
            (50.75, "a: It fell."), (51.5, "b: It rose."), (50.25, "through 90°"),
        ]  # fmt: skip
        shown = made._run
        assert (shown.algorithms, shown.map_zoom) == (("poisson", "euler"), 3.0)  # the track, and both solutions
        assert (shown.labels["error_charts"], shown.labels["not_on_map"]) == ("km", "")
        assert shown.labels["coordinates_poisson_own"] == "km"


def test_the_map_of_recorded_sensors_leaves_out_what_drifts_away(tmp_path: Path, opened: Opened) -> None:
    made = run_files.RunWriter(tmp_path, scenario(log="log"), TIME, TRUTH, EVENTS, ELLIPSOID)
    solutions, errors = {"poisson": solution(), "euler": solution()}, {"poisson": error(), "euler": error()}
    run: Any = SimpleNamespace(solutions=solutions, errors=errors, failures={})
    made.navigated(run, {})
    made.finish([], lambda share: None)
    assert (made._run.map_zoom, made._run.labels["not_on_map"]) == (2.0, "euler")


def test_a_filter_and_the_end(tmp_path: Path, opened: Opened) -> None:
    """Events are in the order of time at the end; the share that is done grows to one."""
    divergence = SimpleNamespace(time=50.125, reason="it is lost")
    estimate = SimpleNamespace(solution="solution", time=TIME, divergence=divergence)
    aided: Any = SimpleNamespace(estimate=estimate)
    shares: list[float] = []
    made = begun(tmp_path)
    shown = [Sentence("About the filter."), *chart_of("filter", opened)()]
    made.filtered(aided, shown, [Moment(50.5, "rejected", "it is seen")], None)
    made.finish([Sentence("The table.")], shares.append)
    assert ("document", "about/filter", "About the filter.\n") in opened.calls
    assert ("document", "about/summary", "The table.\n") in opened.calls
    assert [call[1] for call in of(opened, "written")][4:] == ["filter estimate", "coordinates_aided_own"]
    assert [call[1] for call in of(opened, "series")] == ["motion_charts", "filter"]
    (path,) = of(opened, "draw_path")
    assert path[2:] == ("aided", "solution", run_files.style.COLORS["aided"])
    expected = ((50.125, "the filter diverged: it is lost"), (50.5, "it is seen"), (51.0, "turns"))
    assert of(opened, "events") == [("events", expected[2]), ("events", *expected[:2])]  # those of the motion at once
    assert of(opened, "events written") == [("events written", *expected)]
    assert shares[-1] == 1.0
    assert sorted(shares) == shares
    assert made._run.labels["filter"] == "yes"


def test_streams_without_a_recording(tmp_path: Path, opened: Opened) -> None:
    made = begun(tmp_path, has_recording=False)
    made.finish([], lambda share: None)
    assert [call[0] for call in opened.calls] == [*["written"] * 4, "events written"]


def test_coordinates_of_a_scenario() -> None:
    """Along a given route from A to B, or along the velocity at the start; the epoch is that of the run."""
    truth: Any = SimpleNamespace(latitude=np.array([0.5, 0.6]), longitude=np.array([1.25, 1.5]),
                                 velocity_ned=np.array([[3.0, 4.0, -5.0], [6.0, -7.0, 8.0]]))  # fmt: skip
    ellipsoid = ellipsoid_by_name("krasovsky-1940")

    def plan(route: Any) -> Any:
        return SimpleNamespace(navigation=SimpleNamespace(route_deg=route), coordinates=("ecef",),
                               output=SimpleNamespace(angles="0..360"))  # fmt: skip

    found = run_files.coordinate_streams(plan(None), ellipsoid, truth, 50.5)
    assert (found.names, found.angles, found.ellipsoid, found.epoch) == (("ecef",), "0..360", ellipsoid, 50.5)
    assert found.start == (0.5, 1.25)
    np.testing.assert_allclose(found.pole, route_pole(None, 0.5, 1.25, [3.0, 4.0, -5.0]))
    found = run_files.coordinate_streams(plan((10.0, 20.0, 30.0, 50.0)), ellipsoid, truth, 50.5)
    assert found.start == pytest.approx(np.radians([10.0, 20.0]))
    places = np.radians([[10.0, 20.0], [30.0, 50.0]])
    a, b = (np.array([np.cos(x) * np.cos(y), np.cos(x) * np.sin(y), np.sin(x)]) for x, y in places)
    pole = np.cross(a, b)
    np.testing.assert_allclose(found.pole, pole / np.linalg.norm(pole))
