"""Pages of runs: their sections in order, and which of them a result has."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Dots, Line, Remark
from sinssim.exhibits import Column, Sentence, Table
from sinssim.experiments.run import motion_exhibits, sensor_exhibits
from sinssim.experiments.run import run_report as report
from sinssim.experiments.run.sensor_exhibits import platform_errors
from sinssim.recording import track_map
from sinssim.recording.page import page_of
from sinssim.recording.track_map import Track
from sinssim.scenario import Scenario
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import Redundant
from sinssim.simulation.truth_and_sensors import Truth
from tests.recording.made_monitoring import SECTION
from tests.recording.report.test_whole_pages import body, stand_in_items
from tests.recording.spies import cells, html

ARCSEC, PPM = np.pi / 648_000.0, 1e-6


def run_of(**more: Any) -> Any:
    scenario = SimpleNamespace(name="<s>", description="d", track=None, flight=None, aiding=None,
                               to_toml=lambda about: f"{about} < 2\n", imu=None)  # fmt: skip
    return SimpleNamespace(**{"scenario": scenario, "aided": None, "about_filter": "x", "parts": {},
                              "truth": SimpleNamespace(time=np.array([50.0, 60.0, 350.0])), **more})  # fmt: skip


NONE = report.FirstSections(sensors=[Sentence("sensors")])
TRACK = Track("truth", np.zeros(1), np.zeros(1), np.zeros(1))
EVERY = report.FirstSections(
    [Sentence("flight")], Table((Column("facts"),), []), TRACK, [Track("poisson", *(np.zeros(1) for _ in range(3)))],
    [Sentence("sensors")], [Sentence("parts")], [Sentence("errors")], [Sentence("axes")],
)  # fmt: skip


def part(place: str, title: str = "") -> Any:
    return SimpleNamespace(place=place, title=title, exhibits=lambda: [Sentence(f"Of {place}.")],
                           brief=lambda numbers: [], compares=0)  # fmt: skip


PARTS = {place: part(place, f"After {place}" if place != "motion" else "")
         for place in ("motion", "sensors", "errors", "filter")}  # fmt: skip
LAST = ["<h2>How the run was computed</h2>", "<p>(computed_with)</p>",
        "<details><summary>Scheme of the navigation, and its axes</summary>scheme"
        '<p class="note">words</p><p>axes</p></details>', "<h2>Scenario</h2>", "<pre>x &lt; 2</pre>"]  # fmt: skip
PASSAGES = "<p>No algorithm passed through a singular attitude.</p>"


def page(run: Any, of: Any, first: Any) -> list[str]:
    return [line for line in body(page_of(report.run_exhibits(run, of, first))) if "<table" not in line
            and line not in ("", "</tbody></table></div></div></div>")]  # fmt: skip


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in_items(monkeypatch, report, "error_table", "filter_exhibits", "computed_with", "_remarks")
    monkeypatch.setattr(report, "sentences", lambda numbers: [])
    monkeypatch.setattr(report, "_errors_in_short", lambda *_: [])
    monkeypatch.setattr(report, "note_on_errors", lambda: Sentence("(note)"))
    monkeypatch.setattr(report, "scheme", lambda scenario: "scheme")
    monkeypatch.setattr(report, "scheme_words", lambda scenario: "words")
    monkeypatch.setattr(report, "pieces_of", lambda scenario, truth: [])
    monkeypatch.setattr(report, "motion_map", lambda scenario, ellipsoid, motion, tracks, places, *_: Sentence(
        f"map of {[track.name for track in tracks]} on {ellipsoid}"))  # fmt: skip


def summary(**more: Any) -> Any:
    return {"status": "finished", "failures": {"euler": {"text": "it fell."}}, "algorithms": {"euler": {}},
            "singularities": {}, "timing": {}, **more}  # fmt: skip


def truth() -> Truth:
    return Truth(
        SimpleNamespace(ellipsoid="ellipsoid", start=50.0, end=350.0), None, 1.0, np.array([50.0, 60.0, 350.0])
    )  # type: ignore[arg-type]


@pytest.mark.usefixtures("parts")
def test_a_run_with_everything() -> None:
    places = SimpleNamespace(time=np.zeros(1), latitude=np.zeros(1), longitude=np.zeros(1))
    aided = SimpleNamespace(estimate=SimpleNamespace(solution=places, history=None))
    run = run_of(aided=aided, parts=PARTS, truth=truth())
    assert page(run, summary(filter={"detections": []}), EVERY) == [
        "<h1>&lt;s&gt;</h1>", '<p class="lead">d<br></p>', "<p>(remarks)</p>", "<h2>Motion</h2>",
        "<p>flight</p>",
        "<h2>Sensor errors of this run</h2>", "<p>sensors</p>", "<p>parts</p>", "<h2>Navigation errors</h2>",
        '<p class="broken"><strong>euler has no result.</strong> It fell.</p>', "<p>(error_table)</p>",
        "<p>(note)</p>", "<p>errors</p>", "<h2>After errors</h2>", "<p>Of errors.</p>",
        "<h2>Singular attitudes</h2>", PASSAGES, "<h2>The aided solution</h2>",
        "<p>(filter_exhibits (50.0, 350.0))</p>", "<h2>After filter</h2>", "<p>Of filter.</p>", *LAST,
    ]  # fmt: skip
    whole = page_of(report.run_exhibits(run, summary(filter={"detections": []}), EVERY))
    assert "map of ['poisson', 'aided'] on ellipsoid" in whole.replace("&#x27;", "'")
    assert "<title>&lt;s&gt;: run</title>" in whole
    alone = run_of(truth=truth())
    assert "<h2>After" not in page_of(report.run_exhibits(alone, summary(), EVERY))
    assert "map of ['poisson'] on" in page_of(report.run_exhibits(alone, summary(), EVERY)).replace("&#x27;", "'")
    without = report.run_exhibits(run_of(aided=aided, truth=truth()), summary(), EVERY)
    assert "<h2>The aided solution</h2>" not in page_of(without)
    for what, name in (("track", "Track"), ("flight", "Flight")):
        one = run_of(truth=truth())
        setattr(one.scenario, what, object())
        assert f"<h2>{name}</h2>" in page(one, summary(), EVERY)


@pytest.mark.usefixtures("parts")
def test_a_run_that_failed_early() -> None:
    of = {"status": "failed", "message": "No <fuel>.", "timing": {}}
    assert page(run_of(), of, NONE) == [
        "<h1>&lt;s&gt;</h1>", '<p class="lead">d<br></p>',
        '<p class="broken"><strong>The run failed.</strong> No &lt;fuel&gt;.</p>',
        "<h2>Sensor errors of this run</h2>", "<p>sensors</p>",
        *(line.replace("<p>axes</p>", "") for line in LAST),
    ]  # fmt: skip


def test_sections_that_a_run_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors need the solutions; Schuler's period is that of the true motion; parts are shown at their places."""
    monkeypatch.setattr(report, "error_exhibits", lambda run, period: [Sentence(f"errors of {run.name}{period}")])
    monkeypatch.setattr(report, "motion_exhibits", lambda scenario, truth, parts: [Sentence("flight"), *parts])
    monkeypatch.setattr(report, "motion_facts", lambda scenario, truth: "facts")
    monkeypatch.setattr(report, "solution_tracks", lambda solutions: [f"tracks of {solutions}"])
    monkeypatch.setattr(report, "sensor_errors", lambda scenario, errors, kinds: [Sentence(f"{errors} {kinds}")])
    monkeypatch.setattr(report, "sensor_comparisons", lambda sensed: "compared" if sensed else "nothing")
    monkeypatch.setattr(report, "draw_true_errors", lambda imu, seed, compensation: f"drawn with {seed}")
    monkeypatch.setattr(report, "axes_exhibits", lambda scenario, truth, solutions: [Sentence(f"axes of {solutions}")])
    monkeypatch.setattr(report, "schuler_period", lambda truth, ellipsoid: f" period on {ellipsoid}")
    of = truth()
    vars(of)["state"] = SimpleNamespace(latitude=np.zeros(3), longitude=np.zeros(3))
    navigated: Any = SimpleNamespace(name="run", solutions="solutions")
    sensed = SimpleNamespace(errors="own", readings="readings")
    run = run_of(truth=of, sensed=sensed, navigated=navigated, parts=PARTS)
    run.scenario.imu, run.scenario.seed, run.scenario.compensation = SimpleNamespace(sensor_set=SECTION), 41, None
    found = report.first_sections(run, "kinds")  # type: ignore[arg-type]
    assert html(*found.motion) == "<p>flight</p><p>Of motion.</p>"
    assert (found.facts, found.tracks) == ("facts", ["tracks of solutions"])
    assert found.track is not None
    assert html(*found.sensors) == "<p>own kinds</p>"
    assert html(*found.parts) == "<h3>After sensors</h3><p>Of sensors.</p>"
    assert html(*found.errors) == "<p>errors of run period on ellipsoid</p>"
    assert html(*found.axes) == "<p>axes of solutions</p>"
    run.navigated = None
    early = report.first_sections(run)
    assert html(*early.sensors) == "<p>own compared</p>"
    assert not any((early.errors, early.axes, early.tracks))
    run.truth = run.sensed = None
    run.parts = {}
    before = report.first_sections(run)
    assert html(*before.sensors) == "<p>drawn with 41 nothing</p>"
    assert (before.facts, before.track, list(before.motion), list(before.parts)) == (None, None, [], [])


def test_the_source_of_the_true_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_exhibits, "field_words", lambda scenario: "words of the field")
    level = SimpleNamespace(words=lambda: "from 270°, 20 kt")
    plain: dict[str, Any] = dict.fromkeys(
        (
            "flight",
            "track",
            "parked",
            "great_circle",
            "motion",
            "drive",
            "voyage",
            "rocket",
            "turntable",
            "drop",
            "isolator",
            "gravity",
        )
    )
    flown = SimpleNamespace(aircraft="c172x", wind=level, atmosphere=None, turbulence=None)
    found = list(motion_exhibits._source(SimpleNamespace(**{**plain, "vibration": (), "flight": flown, "gravity": 1})))  # type: ignore[arg-type]
    assert found == [
        ("flown by JSBSim, aircraft", "c172x"), ("wind", "from 270°, 20 kt"), ("turbulence", "none"),
        ("gravity field", "words of the field"),
    ]  # fmt: skip
    flown.atmosphere = SimpleNamespace(words=lambda: "10 K warmer")
    assert ("atmosphere", "10 K warmer") in list(
        motion_exhibits._source(SimpleNamespace(**{**plain, "vibration": (), "flight": flown}))  # type: ignore[arg-type]
    )
    for waypoints, kind in (((1,), "planned route"), ((), "recorded track")):
        own = SimpleNamespace(waypoints=waypoints, what="a.csv")
        scenario: Any = SimpleNamespace(**{**plain, "vibration": (), "track": own})
        assert list(motion_exhibits._source(scenario)) == [(kind, "a.csv")]
    shaken = Scenario.model_validate({
        "name": "s", "parked": {"latitude_deg": 50.5, "duration_s": 20.0},
        "vibration": [{"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0}],
    })  # fmt: skip
    assert list(motion_exhibits._source(shaken)) == [
        ("parked", "latitude_deg = 50.5, duration_s = 20"),
        ("vibration", "coordinate = pitch, rms_arcsec = 20, low_hz = 2, high_hz = 5"),
    ]


def test_names_on_a_map_do_not_meet() -> None:
    """Twenty letters are 160 px: the name at the right edge has no choice, and the one before it gives way."""
    sides = track_map._sides
    assert sides([(20, 250.0, 100.0), (20, 480.0, 102.0)]) == [True, True]
    assert sides([(20, 250.0, 100.0), (20, 480.0, 130.0)]) == [False, True]
    assert sides([(20, 100.0, 100.0), (20, 480.0, 102.0)]) == [False, True]
    assert sides([(20, 200.0, 100.0), (3, 220.0, 100.0), (3, 400.0, 100.0)]) == [False, False, False]  # no side is free


def test_waypoints_on_a_map() -> None:
    """Names to the right of their diamonds, near the right edge to the left; none outside of the map."""
    projection: Any = SimpleNamespace(plane=lambda latitude, longitude: (latitude, longitude))
    frame = track_map._Frame(1.0, 0.0, 420.0)  # 488 px and 420 px from 0, 0
    places = [("ALPHA", 40.0, 60.0), ("BRAVO", 450.0, 200.0), ("CHARLIE", 489.0, 50.0), ("DELTA", 30.0, -1.0),
              ("E", 470.0, 20.0)]  # fmt: skip
    drawn = list(track_map._waypoints(places, projection, frame))
    names = [mark for mark in drawn if isinstance(mark, Remark)]
    assert [(name.text, name.x, name.y, name.left, name.below) for name in names] == [
        ("ALPHA", 40.0, 60.0, False, True), ("BRAVO", 450.0, 200.0, True, True), ("E", 470.0, 20.0, False, True),
    ]  # fmt: skip
    diamonds = [mark for mark in drawn if isinstance(mark, Line)]
    assert [(float(mark.x[0]), float(mark.y[0]), mark.marker, mark.hollow) for mark in diamonds] == [
        (40.0, 60.0, "D", True), (450.0, 200.0, "D", True), (470.0, 20.0, "D", True),
    ]  # fmt: skip


def test_errors_of_torquers_and_pickoffs() -> None:
    """Given errors and their 1σ; in inertial axes nothing is torqued."""
    errors: Any = SimpleNamespace(torquer_scale=np.array([30.0, -45.5, 7.25]) * PPM,
                                  pickoff=np.array([2.0, -3.0, 5.5]) * ARCSEC)  # fmt: skip
    given = Imu(sensor_set={"type": "platform", "torquer_scale_ppm": (30.0, -45.0, 7.0),
                                   "torquer_scale_sigma_ppm": 12.5, "pickoff_arcsec": (2.0, -3.0, 5.5)})  # fmt: skip
    rows = cells(html(*platform_errors(given, errors, "level")))
    assert rows[-2][1:] == ["ppm", "30.00", "−45.50", "7.250", "given ± 12.5"]
    assert rows[-1][1:] == ["arcsec", "2.000", "−3.000", "5.500", "given"]
    drawn = Imu(sensor_set={"type": "platform", "pickoff_sigma_arcsec": 6.5})
    (row,) = cells(html(*platform_errors(drawn, errors, "inertial")))[1:]
    assert row[1:] == ["arcsec", "2.000", "−3.000", "5.500", "6.5"]


def test_residual_errors_of_single_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each sensor's error minus its calibration; gyros first."""
    monkeypatch.setattr(
        sensor_exhibits, "single_errors", lambda blocks, section, kind: Sentence(f"[{kind}: {blocks} of {section}]")
    )
    monkeypatch.setattr(sensor_exhibits, "imperfect_calibration", lambda error, calibration: f"{error}-{calibration}")
    monkeypatch.setattr(sensor_exhibits, "_drawn", lambda *_: ())
    scenario: Any = SimpleNamespace(
        seed=41, compensation=(), imu=Imu(grade="tactical", sensor_set=Redundant(type="redundant")),
        navigation=SimpleNamespace(frame="level"),
    )  # fmt: skip
    true: Any = SimpleNamespace(
        single_sensors=("a", "b"), single_calibrations=("c", "d"), calibration=None, left="left", platform=None,
        imu=SimpleNamespace(gyro=None, accel=None),
    )  # fmt: skip
    found = html(*sensor_exhibits.sensor_errors(scenario, true, ())).replace("&#x27;", "'")
    assert "The error of each sensor was drawn with the seed 41 from a normal distribution" in found
    assert found.endswith(
        "<h3>Residual errors after calibration</h3><p>Errors that the compensation does not remove.</p>"
        "<p>[gyro: ('a-c', 'b-d') of left]</p><p>[accel: ('a-c', 'b-d') of left]</p>"
    )
    ideal: Any = SimpleNamespace(error=np.zeros((2, 3)))
    shown = html(*sensor_exhibits.sensor_errors(scenario, true, [ideal]))
    assert shown.endswith("<p>All sensors are ideal.</p>")


def test_instants_on_a_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dots at the start, each 100 s and the end; a text is to the left within 50 pixels of the right edge."""
    projection: Any = SimpleNamespace(plane=lambda latitude, longitude: (latitude, longitude))
    frame = track_map._Frame(1.0, -100.0, 420.0)  # 488 px and 420 px
    time = np.arange(20.0, 321.0, 10.0)
    track = Track("truth", time, 1.2 * (time - 20.0), np.full(31, 60.0))
    monkeypatch.setattr(track_map, "time_ticks", lambda start, end: (np.array([0.0, 1.0, 2.0, 3.0]), 1.0, "hs", 100.0))
    drawn = list(track_map._instants(track, projection, frame))
    ends, between = (mark for mark in drawn if isinstance(mark, Dots))
    assert (ends.x.tolist(), ends.size) == ([0.0, 360.0], 6.75)
    np.testing.assert_allclose(between.x, [96.0, 216.0, 336.0])
    words = [(mark.text, round(mark.x, 9), mark.left) for mark in drawn if isinstance(mark, Remark)]
    assert words == [
        ("start", 0.0, False), ("end", 360.0, True), ("1 hs", 96.0, False), ("2", 216.0, False),
    ]  # fmt: skip
    still = Track("truth", time, np.linspace(5.0, 20.0, 31), np.full(31, 60.0))
    (dot,) = track_map._instants(still, projection, frame)
    assert isinstance(dot, Dots)
    assert (dot.x.tolist(), dot.size) == ([5.0], 6.75)
