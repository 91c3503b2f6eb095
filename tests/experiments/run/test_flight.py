"""The section on the true motion: facts, plots, legs and events, from a motion that is written down."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import NavState
from sinssim.earth import WGS84
from sinssim.experiments.run import motion_exhibits as report
from sinssim.recording.track_map import Track
from sinssim.scenario import Scenario
from sinssim.truth.sampling import Channel, FlightEvent
from tests.recording.spies import Plot, cells, html, plots

ORANGE, GREEN, BLUE = "#d55e00", "#009e73", "#56b4e9"
TIME = np.array([10.0, 20.0, 60.0, 70.0])
ROLL, PITCH, HEADING = (np.array(v) for v in ([2.0, -30.0, 45.0, 4.0], [1.5, 10.0, -7.25, 3.0],
                                              [350.0, 5.0, 100.0, 200.0]))  # fmt: skip
VELOCITY = np.array([[3.0, -4.0, 1.0], [5.0, 12.0, -2.0], [-12.0, 5.0, 0.04], [7.0, -24.0, -6.5]])


def motion(roll: Any = ROLL) -> NavState:
    q = Rotation.from_euler("ZYX", np.column_stack((HEADING, PITCH, roll)), degrees=True).as_quat(scalar_first=True)
    latitude, longitude = np.radians([-33.5, -33.4, -33.3, -33.21]), np.radians([151.25, 151.5, 151.75, -179.125])
    return NavState(latitude, longitude, np.array([120.0, 340.0, 90.5, 260.25]), VELOCITY, q)


def test_facts_in_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ground speeds 5, 13, 13 and 25 m/s: 90 + 520 + 190 m; down is positive in the data, up in the table."""
    monkeypatch.setattr(report, "_source", lambda scenario: [("wind", "5 m/s < 6")])
    trajectory = SimpleNamespace(gravity="normal", ellipsoid=WGS84)
    truth: Any = SimpleNamespace(time=TIME, state=motion(), trajectory=trajectory)
    page = html(report.motion_facts(None, truth))  # type: ignore[arg-type]
    assert cells(page) == [
        ["true motion of the sensor block", ""],
        ["duration", "60 s"],
        ["distance over ground (∫ ground speed dt)", "0.800 km"],
        ["start", "33.50000°S 151.25000°E, 120.0\u00a0m"],
        ["end", "33.21000°S 179.12500°W, 260.2\u00a0m"],
        ["height above the ellipsoid", "90.5 … 340.0 m"],
        ["ground speed", "5.0 … 25.0 m/s"],
        ["vertical speed, up", "−1.0 … 6.5 m/s"],
        ["roll", "−30.0 … 45.0°"],
        ["pitch", "−7.2 … 10.0°"],
        ["gravity, ellipsoid", "normal, wgs84"],
        ["wind", "5 m/s &lt; 6"],
    ]
    assert report.between_text(np.array([-0.04, 0.04]), 1, "m") == "0.0 m"
    assert report.between_text(np.array([2.5, 2.5]), 2, "°") == "2.50°"


@pytest.mark.parametrize(
    ("angles", "heading", "turn", "axis"),
    [
        (None, [350.0, 5.0, 100.0, 200.0], 360.0, (0.0, 360.0, 90.0)),
        ("-90..270", [-10.0, 5.0, 100.0, 200.0], 360.0, (-90.0, 270.0, 90.0)),
        ("continuous", [350.0, 365.0, 460.0, 560.0], 0.0, None),
    ],
)
def test_height_speed_and_attitude(angles: Any, heading: Any, turn: float, axis: Any) -> None:
    air = Channel(np.array([10.0, 40.0, 70.0]), np.array([11.0, 17.0, 23.0]), "m/s")
    marks = [report.mark_of_many(20.0, "1")]
    charts = list(report.motion_charts(TIME, motion(), marks, angles, air))
    height, speed, attitude, turning = plots(charts)
    height.shows("Height above the ellipsoid", "m", ("height", GREEN, TIME, [120.0, 340.0, 90.5, 260.25]))
    speed.shows("Speed", "m/s", ("ground speed", GREEN, TIME, [5.0, 13.0, 13.0, 25.0]),
                ("true airspeed", ORANGE, air.time, [11.0, 17.0, 23.0]))  # fmt: skip
    attitude.shows("Roll and pitch", "deg", ("roll", ORANGE, TIME, ROLL), ("pitch", BLUE, TIME, PITCH))
    turning.shows("Heading", "deg", ("heading", GREEN, TIME, heading))
    assert [np.degrees(line.turn) for line in attitude.lines] == [360.0, 0.0]
    y = turning.chart.y
    assert np.degrees(turning.lines[0].turn) == turn
    if axis is None:
        assert (y.low, y.high) == (None, None)
    else:
        low, high, step = axis
        assert np.degrees([y.low, y.high]) == pytest.approx([low, high])
        assert np.diff(np.degrees(y.ticks)) == pytest.approx(np.full(4, step))
    assert (attitude.chart.y.low, attitude.chart.y.high) == (None, None)
    for found in (height, speed, attitude, turning):
        assert found.span == (10.0, 70.0)
        assert found.marks == [(20.0, "1", True)]
    assert [found.chart.y.least for found in (height, speed)] == [1e-3] * 2
    (climb,) = charts[1]
    Plot(climb).shows("Vertical speed, up", "m/s", ("vertical speed", BLUE, TIME, [-1.0, 2.0, -0.04, 6.5]))


def test_rolling_over_has_the_whole_circle() -> None:
    found = plots(report.motion_charts(TIME, motion([2.0, -121.0, 45.0, 4.0]), [], None))
    assert (found[2].chart.y.low, found[2].chart.y.high) == (-np.pi, np.pi)
    assert [line.label for line in found[1].lines] == ["ground speed"]


def test_legs_as_flown_and_other_events() -> None:
    """A leg that did not begin has no row; one that did not end has no end."""
    legs = [
        {"type": "straight", "distance_m": 700.0}, {"type": "turn", "angle_deg": -90.0},
        {"type": "stop", "duration_s": 12.5},
    ]  # fmt: skip
    drive = {"latitude_deg": 50.0, "longitude_deg": 14.0, "legs": legs}
    scenario = Scenario.model_validate({"name": "round", "drive": drive})
    events = (
        FlightEvent(12.34, "leg 1 (straight) begins"), FlightEvent(20.0, "a <bump>"),
        FlightEvent(33.36, "leg 1 (straight) ends"), FlightEvent(33.36, "leg 2 (turn) begins"),
        FlightEvent(70.0, "end"),
    )  # fmt: skip
    trajectory: Any = SimpleNamespace(
        events=events, channels={}, gravity="normal", ellipsoid=WGS84, start=10.0, end=70.0
    )
    truth: Any = SimpleNamespace(time=TIME, state=motion(), trajectory=trajectory)
    found, others = report._legs(scenario, trajectory)
    assert [(name, begin, end) for name, _, begin, end in found] == [("straight", 12.34, 33.36), ("turn", 33.36, None)]
    assert others == [(20.0, "a <bump>"), (70.0, "end")]
    items = list(report.motion_exhibits(scenario, truth))
    page = html(*items)
    rows = cells(page)
    at = rows.index(["leg", "", "", "from, s", "to, s"])
    first, second = rows[at + 1], rows[at + 2]
    assert (first[:2], first[3:]) == (["1", "straight"], ["12.3", "33.4"])
    assert (second[:2], second[3:]) == (["2", "turn"], ["33.4", "–"])
    assert "distance_m = 700" in first[2]
    assert "angle_deg = -90" in second[2]
    assert rows[at + 3 :] == [["time, s", ""], ["20.0", "a &lt;bump&gt;"], ["70.0", "end"]]
    assert "<h3>Legs</h3>" in page
    assert plots(items)[0].marks == [(12.34, "1", True), (33.36, "2", True)]
    (kind, words), *_ = [one for one in report._source(scenario) if one[0] == "drive"]
    assert kind == "drive"
    assert words.startswith("3 legs, see below; ")


def test_the_map_has_every_track(monkeypatch: pytest.MonkeyPatch) -> None:
    """The true track is pale below others, and pure alone."""
    seen: list[Any] = []
    monkeypatch.setattr(report, "track_map", lambda *what, **more: seen.append((what, more)))
    scenario: Any = SimpleNamespace(aiding=SimpleNamespace(outages=((1.0, 2.0),)), flight=None, track=None)
    truth = Track.of("truth", TIME, motion())
    own = Track.of("poisson", TIME[:3], motion().__class__(*(v[:3] for v in vars(motion()).values())), "poisson")
    report.motion_map(scenario, WGS84, truth, [own])
    (tracks, ellipsoid), more = seen[0]
    assert [track.name for track in tracks] == ["truth", "poisson"]
    np.testing.assert_array_equal(tracks[0].latitude, motion().latitude)
    np.testing.assert_array_equal(tracks[1].longitude, motion().longitude[:3])
    assert tracks[0].color == (90, 153, 136)
    assert ellipsoid is WGS84
    assert (more["outages"], more["places"]) == (((1.0, 2.0),), [])
    scenario.aiding = None
    report.motion_map(scenario, WGS84, truth, [])
    assert [track.color for track in seen[1][0][0]] == ["truth"]
    assert seen[1][1]["outages"] == ()


@pytest.mark.parametrize(("highest", "unit"), [(20_000.0, "m"), (20_001.0, "km")])
def test_heights_beyond_20_km_are_in_km(highest: float, unit: str) -> None:
    heights = np.array([0.0, 100.0, highest, 50.0])
    height, *_ = plots(list(report.motion_charts(TIME, replace(motion(), height=heights), [], None)))
    height.shows("Height above the ellipsoid", unit, ("height", GREEN, TIME, heights / {"m": 1.0, "km": 1e3}[unit]))
