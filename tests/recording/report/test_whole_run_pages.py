"""Pages of runs: their sections in order, and which of them a result has."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.run import flight_map, sensor_exhibits
from sinssim.experiments.run import run_report as report
from sinssim.experiments.run.sensor_exhibits import platform_errors
from sinssim.scenario import Scenario
from sinssim.sensors.imu.imu import Imu
from sinssim.sensors.sets.sensor_set import Redundant
from sinssim.simulation.truth_stage import Truth
from tests.recording.made_monitoring import SECTION
from tests.recording.report.test_whole_pages import body, stand_ins
from tests.recording.spies import cells

ARCSEC, PPM = np.pi / 648_000.0, 1e-6


def run_of(**more: Any) -> Any:
    scenario = SimpleNamespace(name="<s>", description="d", track=None, flight=None,
                               to_toml=lambda about: f"{about} < 2\n", imu=None)  # fmt: skip
    return SimpleNamespace(**{"scenario": scenario, "aided": None, "about_filter": "x", "parts": {},
                              "truth": SimpleNamespace(time=np.array([50.0, 60.0, 350.0])), **more})  # fmt: skip


NONE = report.Sections("", None, "sensors", "", "", "axes")
EVERY = report.Sections(
    f"flight [{report.MAP}]", lambda tracks: f"map of {dict(tracks)}", "sensors", "parts", "errors", "axes"
)


def part(place: str, title: str = "") -> Any:
    return SimpleNamespace(place=place, title=title, exhibits=lambda: [Sentence(f"Of {place}.")])


PARTS = {place: part(place, f"After {place}" if place != "motion" else "")
         for place in ("motion", "sensors", "errors", "filter")}  # fmt: skip
LAST = ["<h2>How the run was computed</h2>", "(made)",
        "<details><summary>Scheme of the navigation, and its axes</summary>", "scheme", "words", "axes", "</details>",
        "<h2>Scenario</h2>", "<pre>x &lt; 2</pre>"]  # fmt: skip


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_ins(monkeypatch, report, "_in_short", "error_tables", "filter_section", "made")
    monkeypatch.setattr(report, "failure", lambda item: f"({item[0]}: {item[1]})")
    monkeypatch.setattr(report, "singularity_table", lambda events: f"({len(events)} events)")
    monkeypatch.setattr(report, "scheme", lambda scenario: "scheme")
    monkeypatch.setattr(report, "scheme_words", lambda scenario: "words")


def summary(**more: Any) -> dict[str, Any]:
    return {"status": "finished", "failures": {"euler": "It fell."}, "algorithms": {}, "singularities": [1, 2], **more}


@pytest.mark.usefixtures("parts")
def test_a_run_with_everything() -> None:
    aided = SimpleNamespace(estimate=SimpleNamespace(solution="solution"))
    html = report.run_report(run_of(aided=aided, parts=PARTS), summary(filter={}), EVERY)
    assert "<title>&lt;s&gt;: run</title>" in html
    said = [
        "<h1>&lt;s&gt;</h1>", '<p class="lead">d</p>', "<p>(in_short)</p>", "<h2>Motion</h2>",
        "flight [map of {'aided': 'solution'}]", "<h2>Sensor errors of this run</h2>", "sensors",
        "parts", "<h2>Navigation errors</h2>", "(euler: It fell.)", "(error_tables)", "errors",
        "<h2>After errors</h2>", "<p>Of errors.</p>", "<h2>Singular attitudes</h2>", "(2 events)",
        "<h2>The aided solution</h2>", "(filter_section (50.0, 350.0))", "<h2>After filter</h2>", "<p>Of filter.</p>",
        *LAST,
    ]  # fmt: skip
    assert body(html) == said
    assert "<h2>After" not in report.run_report(run_of(), summary(), EVERY)
    assert "<h2>The aided solution</h2>" not in report.run_report(run_of(aided=aided), summary(), EVERY)
    for what, name in (("track", "Track"), ("flight", "Flight")):
        one = run_of()
        setattr(one.scenario, what, object())
        assert f"<h2>{name}</h2>" in body(report.run_report(one, summary(), EVERY))
    assert "flight [map of {}]" in body(report.run_report(run_of(), summary(), EVERY))


@pytest.mark.usefixtures("parts")
def test_a_run_that_failed_early() -> None:
    html = report.run_report(run_of(), summary(status="failed", message="No <fuel>."), NONE)
    assert body(html) == [
        "<h1>&lt;s&gt;</h1>", '<p class="lead">d</p>',
        '<p class="broken"><strong>The run failed.</strong> No &lt;fuel&gt;.</p>', "<p>(in_short)</p>",
        "<h2>Sensor errors of this run</h2>", "sensors", "", *LAST,
    ]  # fmt: skip


def test_sections_that_a_run_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors need the solutions; Schuler's period is that of the true motion; parts are drawn at their places."""
    monkeypatch.setattr(report, "error_plots", lambda run, period: ["error_plots of ", run.name, period])
    monkeypatch.setattr(report, "flight_section", lambda scenario, truth, parts: ["flight ", truth.state, *parts])
    monkeypatch.setattr(report, "map_of", lambda scenario, truth, solutions: f"chart of {truth.state} and {solutions}")
    monkeypatch.setattr(report, "sensor_errors", lambda scenario, errors, kinds: [f"sensors {errors} {kinds}"])
    monkeypatch.setattr(report, "sensor_comparisons", lambda sensed: "compared" if sensed else "nothing")
    monkeypatch.setattr(report, "draw_true_errors", lambda imu, seed, compensation: f"drawn with {seed}")
    monkeypatch.setattr(report, "axes_drawing", lambda scenario, truth, solutions: f"axes of {solutions}")
    monkeypatch.setattr(report, "schuler_period", lambda truth, ellipsoid: f" period of {truth} on {ellipsoid}")
    truth = Truth(SimpleNamespace(ellipsoid="ellipsoid"), None, 1.0, np.zeros(2))  # type: ignore[arg-type]
    vars(truth)["state"] = "truth"
    navigated: Any = SimpleNamespace(name="run", solutions="solutions")
    sensed = SimpleNamespace(errors="own", readings="readings")
    run = run_of(truth=truth, sensed=sensed, navigated=navigated, parts=PARTS)
    run.scenario.imu, run.scenario.seed, run.scenario.compensation = SimpleNamespace(sensor_set=SECTION), 41, None
    found = report.draw_sections(run, "kinds")  # type: ignore[arg-type]
    assert found == report.Sections(
        "flight truth<p>Of motion.</p>", "chart of truth and solutions", "sensors own kinds",
        "<h2>After sensors</h2><p>Of sensors.</p>", "error_plots of run period of truth on ellipsoid",
        "axes of solutions",
    )  # type: ignore[arg-type]  # fmt: skip
    run.navigated = None
    early = report.draw_sections(run)
    assert (early.flight, early.chart) == (found.flight, "chart of truth and {}")
    assert (early.sensors, early.parts) == ("sensors own compared", found.parts)
    assert not any((early.errors, early.axes))
    run.truth = run.sensed = None
    run.parts = {}
    drawn = "sensors drawn with 41 nothing"
    assert report.draw_sections(run) == report.Sections("", None, drawn, "", "", "")


def test_the_source_of_the_true_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flight_map, "field_words", lambda scenario: "words of the field")
    level = SimpleNamespace(words=lambda: "from 270°, 20 kt")
    plain: dict[str, Any] = dict.fromkeys(
        ("flight", "track", "parked", "great_circle", "motion", "drive", "voyage", "turntable", "isolator", "gravity")
    )
    flown = SimpleNamespace(aircraft="c172x", wind=level, atmosphere=None, turbulence=None)
    found = list(flight_map._source(SimpleNamespace(**{**plain, "vibration": (), "flight": flown, "gravity": 1})))  # type: ignore[arg-type]
    assert found == [
        ("flown by JSBSim, aircraft", "c172x"), ("wind", "from 270°, 20 kt"), ("turbulence", "none"),
        ("gravity field", "words of the field"),
    ]  # fmt: skip
    flown.atmosphere = SimpleNamespace(words=lambda: "10 K warmer")
    assert ("atmosphere", "10 K warmer") in list(
        flight_map._source(SimpleNamespace(**{**plain, "vibration": (), "flight": flown}))  # type: ignore[arg-type]
    )
    for waypoints, kind in (((1,), "planned route"), ((), "recorded track")):
        own = SimpleNamespace(waypoints=waypoints, what="a.csv")
        scenario: Any = SimpleNamespace(**{**plain, "vibration": (), "track": own})
        assert list(flight_map._source(scenario)) == [(kind, "a.csv")]
    shaken = Scenario.model_validate({
        "name": "s", "parked": {"latitude_deg": 50.5, "duration_s": 20.0},
        "vibration": [{"coordinate": "pitch", "rms_arcsec": 20.0, "low_hz": 2.0, "high_hz": 5.0}],
    })  # fmt: skip
    assert list(flight_map._source(shaken)) == [
        ("parked", "latitude_deg = 50.5, duration_s = 20"),
        ("vibration", "coordinate = pitch, rms_arcsec = 20, low_hz = 2, high_hz = 5"),
    ]


def test_waypoints_on_a_map() -> None:
    """Names to the right of their diamonds, near the right edge to the left; none outside of the map."""
    frame: Any = SimpleNamespace(width=300.0, height=100.0, scale=2.0, pixels=lambda x, y: (x, y))
    projection: Any = SimpleNamespace(plane=lambda latitude, longitude: (latitude, longitude))
    places = [("ALPHA", 40.0, 60.0), ("BRAVO", 560.0, 200.0), ("CHARLIE", 601.0, 50.0), ("DELTA", 30.0, -1.0),
              ("E", 583.0, 20.0)]  # fmt: skip
    drawn = flight_map._waypoints(places, projection, frame)
    texts = [ET.fromstring(one) for one in drawn[1::2]]
    assert [(one.text, float(one.get("x", "")), float(one.get("y", "")), one.get("text-anchor")) for one in texts] == [
        ("ALPHA", 47.0, 75.0, "start"), ("BRAVO", 553.0, 215.0, "end"), ("E", 590.0, 35.0, "start"),
    ]  # fmt: skip
    corners = ET.fromstring(drawn[0]).get("points", "").split()
    assert [tuple(map(float, one.split(","))) for one in corners] == [
        (40.0, 55.0), (45.0, 60.0), (40.0, 65.0), (35.0, 60.0), (40.0, 55.0),
    ]  # fmt: skip


def test_errors_of_torquers_and_pickoffs() -> None:
    """Given errors and their 1σ; in inertial axes nothing is torqued."""
    errors: Any = SimpleNamespace(torquer_scale=np.array([30.0, -45.5, 7.25]) * PPM,
                                  pickoff=np.array([2.0, -3.0, 5.5]) * ARCSEC)  # fmt: skip
    given = Imu(sensor_set={"type": "platform", "torquer_scale_ppm": (30.0, -45.0, 7.0),
                                   "torquer_scale_sigma_ppm": 12.5, "pickoff_arcsec": (2.0, -3.0, 5.5)})  # fmt: skip
    rows = cells(platform_errors(given, errors, "level"))
    assert rows[-2][1:] == ["ppm", "30.00", "−45.50", "7.250", "given ± 12.5"]
    assert rows[-1][1:] == ["arcsec", "2.000", "−3.000", "5.500", "given"]
    drawn = Imu(sensor_set={"type": "platform", "pickoff_sigma_arcsec": 6.5})
    (row,) = cells(platform_errors(drawn, errors, "inertial"))[1:]
    assert row[1:] == ["arcsec", "2.000", "−3.000", "5.500", "6.5"]


def test_residual_errors_of_single_sensors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each sensor's error minus its calibration; gyros first."""
    monkeypatch.setattr(
        sensor_exhibits, "single_errors", lambda blocks, section, kind: f"[{kind}: {blocks} of {section}]"
    )
    monkeypatch.setattr(sensor_exhibits, "imperfect_calibration", lambda error, calibration: f"{error}-{calibration}")
    for name in ("_noises", "_table", "_null_shift"):
        monkeypatch.setattr(sensor_exhibits, name, lambda *_: "")
    monkeypatch.setattr(sensor_exhibits, "_of_noise", lambda *_: ())
    scenario: Any = SimpleNamespace(
        seed=41, compensation=object(), imu=Imu(grade="tactical", sensor_set=Redundant(type="redundant"))
    )
    true: Any = SimpleNamespace(
        single_sensors=("a", "b"), single_calibrations=("c", "d"), calibration=None, left="left", platform=None,
        imu=SimpleNamespace(gyro=None, accel=None),
    )  # fmt: skip
    found = list(sensor_exhibits.sensor_errors(scenario, true, ()))
    assert "The error of each sensor was drawn with the seed 41 from a normal distribution" in found[0]
    assert found[-3:] == [
        "<h3>Residual errors after calibration</h3><p>Errors that the compensation does not remove.</p>",
        "[gyro: ('a-c', 'b-d') of left]", "[accel: ('a-c', 'b-d') of left]",
    ]  # fmt: skip
    ideal = SimpleNamespace(error=np.zeros((2, 3)))
    assert list(sensor_exhibits.sensor_errors(scenario, true, [ideal]))[-1] == "<p>All sensors are ideal.</p>"  # type: ignore[list-item]


def test_instants_on_a_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dots at the start, each 100 s and the end; a text is to the left within 50 pixels of the right edge."""
    frame: Any = SimpleNamespace(width=300.0, height=100.0, scale=2.0, pixels=lambda x, y: (x, y))
    projection: Any = SimpleNamespace(plane=lambda latitude, longitude: (latitude, longitude))
    time = np.arange(20.0, 321.0, 10.0)
    truth: Any = SimpleNamespace(latitude=2.0 * (time - 20.0), longitude=np.full(31, 60.0))
    monkeypatch.setattr(flight_map, "time_ticks", lambda start, end: (np.array([0.0, 1.0, 2.0, 3.0]), 1.0, "hs", 100.0))
    drawn = [ET.fromstring(one) for one in flight_map._instants(time, truth, projection, frame)]
    dots = [(float(one.get("cx", "")), one.get("r")) for one in drawn if one.tag == "circle"]
    assert dots == [(0.0, "4.5"), (160.0, "2.6"), (360.0, "2.6"), (560.0, "2.6"), (600.0, "4.5")]
    texts = [(one.text, float(one.get("x", "")), float(one.get("y", "")), one.get("text-anchor"))
             for one in drawn if one.tag == "text"]  # fmt: skip
    assert texts == [
        ("start", 7.0, 54.0, "start"), ("end", 593.0, 54.0, "end"), ("1 hs", 167.0, 54.0, "start"),
        ("2", 367.0, 54.0, "start"), ("3", 553.0, 54.0, "end"),
    ]  # fmt: skip
    still: Any = SimpleNamespace(latitude=np.linspace(5.0, 20.0, 31), longitude=np.full(31, 60.0))
    (dot,) = flight_map._instants(time, still, projection, frame)
    assert (ET.fromstring(dot).get("cx"), ET.fromstring(dot).get("r")) == ("5.0", "4.5")
