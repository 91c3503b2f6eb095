"""The report of a run: its numbers are the summary's, its drawings are valid, and it needs nothing but itself."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from sinssim.data import NavState
from sinssim.earth import WGS84
from sinssim.errors import RunError
from sinssim.exhibits import Sentence
from sinssim.experiments.run import run_report
from sinssim.experiments.run.error_exhibits import schuler_period
from sinssim.experiments.run.motion_exhibits import _source
from sinssim.experiments.run.run_execution import run
from sinssim.experiments.run.run_report import run_exhibits
from sinssim.experiments.run.run_result import Reached
from sinssim.recording import style
from sinssim.recording.page import page_of
from sinssim.scenario import Scenario
from sinssim.sensors.imu.imu_section import draw
from sinssim.sensors.sensor_set_readings import draw_attitude_sensor
from sinssim.sensors.single_sensors import draw_accelerometers
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.units import DEG_H, UG
from tests.recording import fake_run
from tests.recording.shown import still

SVG = "{http://www.w3.org/2000/svg}"
PARKED = {"latitude_deg": 50.0, "longitude_deg": 14.5, "roll_deg": 1.0, "duration_s": 20.0}
POLAR = {"latitude_deg": 89.99, "altitude_m": 9000.0, "course_deg": 5.0, "speed_mps": 250.0, "duration_s": 20.0}


class Tables(HTMLParser):
    """Reads the tables of a page: rows of texts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tables: list[list[list[str]]] = []
        self._cell = False
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, _):
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self._cell = True
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        self._cell = self._cell and tag not in ("td", "th")

    def handle_data(self, data):
        if self._cell:
            self.tables[-1][-1][-1] += data

    def with_heads(self, *heads: str) -> list[list[str]]:
        """Return the rows of the table that has these heads somewhere above."""
        return next(t for t in self.tables if set(heads) <= {cell for row in t[:2] for cell in row})

    def with_errors(self) -> list[list[str]]:
        """Return the rows of the table of the errors, whose units are by size."""
        return next(t for t in self.tables if len(t[0]) == 5 and t[0][1].startswith("horizontal ["))


ERRORS = ("horizontal_error_m", "height_error_m", "velocity_error_mps", "attitude_error_arcsec")
PLOTS = (
    "Horizontal position error", "Height error (positive: too high)", "Velocity error, magnitude",
    "Attitude error, angle",
)  # fmt: skip
SIZES = {"mm": 1e-3, "m": 1.0, "km": 1e3, "mm/s": 1e-3, "m/s": 1.0, "arcsec": 1.0, "arcmin": 60.0, "deg": 3600.0}
"""Of units, in those of `summary.json`."""


def drawings(page: str) -> list[ET.Element]:
    """Return every drawing of a page, each parsed on its own."""
    found, depth, start = [], 0, 0
    for match in re.finditer(r"<svg|</svg>", page):
        if match[0] == "<svg":
            start = match.start() if depth == 0 else start
            depth += 1
        else:
            depth -= 1
            if depth == 0:
                found.append(ET.fromstring(page[start : match.end()]))
    assert depth == 0
    return found


def value(cell: str) -> float:
    return float(cell.replace("−", "-"))


def scenario(**tables) -> Scenario:
    return Scenario.model_validate({"name": "short", "seed": 4, **tables})


def report_of(reached: Reached, summary: Any) -> str:
    return page_of(run_exhibits(reached, summary))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recorded run with made-up numbers, three algorithms, events and a singularity, and its page."""
    with pytest.MonkeyPatch.context() as patch:
        fake_run.install(3000, patch.setattr)
        result = run(fake_run.scenario(), tmp_path_factory.mktemp("runs") / "fake")
    return result, (result.directory / "report.html").read_text(encoding="utf-8")


@pytest.fixture(
    scope="module",
    params=[
        {"parked": PARKED, "navigation": {"algorithms": ["quaternion"]}},
        {"parked": PARKED, "imu": {"grade": "ideal"}, "navigation": {"algorithms": ["poisson", "euler"]}},
        {"great_circle": POLAR, "navigation": {"frame": "wander", "vertical": "truth"}},
        {"parked": {**PARKED, "pitch_deg": 90.0}, "navigation": {"algorithms": ["quaternion", "euler"]}},
    ],
    ids=["parked", "ideal", "polar", "singular"],
)
def flown(request, tmp_path_factory):
    """A real run of 20 s, and its page."""
    result = run(scenario(**request.param), tmp_path_factory.mktemp("runs") / "run")
    return result, (result.directory / "report.html").read_text(encoding="utf-8")


def check_page(result, page: str) -> None:
    tables = Tables(page)
    table = tables.with_errors()
    rows = {row[0]: row[1:] for row in table[2:]}
    assert list(rows) == list(result.summary["algorithms"])
    titles = [d.find(f"{SVG}text").text for d in drawings(page) if d.find(f"{SVG}text") is not None]
    groups = []
    for head, key, title in zip(table[0][1:], ERRORS, PLOTS, strict=True):
        unit = head.rpartition("[")[2].removesuffix("]")
        groups.append((key, SIZES[unit]))
        assert f"{title} [{unit}]" in titles  # one unit in table and plot
    for name, cells in rows.items():
        keys = [(kind, key, size) for key, size in groups for kind in ("final", "rms", "max")]
        assert len(cells) == len(keys)
        for cell, (kind, key, size) in zip(cells, keys, strict=True):
            expected = result.summary["algorithms"][name][f"{kind}_{key}"] / size
            assert value(cell) == pytest.approx(expected, rel=5.1e-3 if abs(expected) < 1e-3 else 5.1e-4)
    for drawing in drawings(page):
        assert drawing.get("aria-label")
        for element in drawing.iter():
            for name in ("points", "d", "x", "y"):
                assert "nan" not in element.get(name, "")
    (folded,) = re.findall(r"<details><summary>Scheme of the navigation.*?</details>", page, re.DOTALL)
    assert [drawing.get("aria-label") for drawing in drawings(folded)] == [
        "scheme of the navigation",
        "axes of the local level and of the body at the start",
    ]
    check_self_contained(page)
    assert result.scenario.to_toml().strip() in page.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")


def check_self_contained(page: str) -> None:
    page = still(page)
    assert not re.search(r"<(script|link|img|image|iframe|object|use|base)\b|\b(src|href)=|@import|url\(", page)
    assert set(re.findall(r"https?://[^\"'<> ]+", page)) <= {"http://www.w3.org/2000/svg"}


def test_a_page_of_real_runs(flown):
    check_page(*flown)


def test_a_page_with_everything(recorded):
    result, page = recorded
    check_page(result, page)
    assert "No algorithm passed through" not in page
    (row,) = Tables(page).with_heads("damage, arcmin")[1:]
    assert row[:3] == ["euler", "3.00", "3.50"]
    assert value(row[3]) == pytest.approx(np.degrees(1e-4) * 60.0, rel=1e-3)
    assert row[4] == "pitch went through 90°"
    assert [r for r in Tables(page).with_heads("time, s") if "turns" in r[-1]] == [["12.5", "turns |left|"]]
    timing = {row[0]: row[1] for row in Tables(page).with_heads("stage")[1:]}
    assert value(timing["total"]) == pytest.approx(result.summary["timing"]["total_s"], abs=0.0051)
    made = dict(row for row in Tables(page).with_heads("computed with")[1:])
    assert made["seed"] == "3"
    assert made["numpy"] == np.__version__


def test_the_largest_error_is_seen_in_the_plot(recorded):
    result, page = recorded
    titles = {d.find(f"{SVG}text").text: d for d in drawings(page) if d.find(f"{SVG}text") is not None}
    drawing = next(d for title, d in titles.items() if title.startswith("Horizontal position error"))
    texts = drawing.findall(f"{SVG}text")
    assert {"quaternion", "poisson", "euler"} <= {t.text for t in texts}
    unit = {"mm": 1e-3, "m": 1.0, "km": 1e3}[re.search(r"\[(\w+)\]", texts[0].text)[1]]
    greatest = max(n["max_horizontal_error_m"] for n in result.summary["algorithms"].values()) / unit
    marks = [(float(t.get("y")) - 4.0, float(t.text)) for t in texts
             if t.get("text-anchor") == "end" and t.text[0].isdigit()]  # fmt: skip
    (low, first), (high, last) = max(marks), min(marks)
    inner = drawing.find(f"{SVG}svg")
    points = [pair for line in inner.iter(f"{SVG}polyline") for pair in line.get("points").split()]
    of_a_pixel = (last - first) / (low - high)
    drawn = first + (low - min(float(pair.split(",")[1]) for pair in points)) * of_a_pixel
    assert drawn == pytest.approx(greatest, abs=of_a_pixel)


def test_sensor_errors_stand_in_the_units_that_people_know(tmp_path):
    fixed = {
        "grade": "tactical",
        "gyro_bias_deg_h": [0.5, -0.25, 0.125],
        "gyro_misalignment_arcsec": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        "accel_bias_ug": [10.0, 20.0, -30.0],
        "accel_scale_sigma_ppm": 7.0,
        "gyro_arw_deg_sqrt_h": 0.02,
    }
    told = report_of(
        Reached(scenario(parked=PARKED, imu=fixed)),
        {"status": "failed", "message": "no", "timing": {}, "versions": {}},
    )
    gyros, accelerometers = (t for t in Tables(told).tables if "x (forward)" in t[0])
    assert gyros[1] == ["bias", "deg/h", "0.5000", "−0.2500", "0.1250", "given"]
    # the angles xy, xz, yx, yz, zx, zy: ij is the tilt of sensitive axis i towards the block's axis j
    assert gyros[3] == ["tilt towards x", "arcsec", "", "3.000", "5.000", "given"]
    assert gyros[4] == ["tilt towards y", "arcsec", "1.000", "", "6.000", "given"]
    assert gyros[5] == ["tilt towards z", "arcsec", "2.000", "4.000", "", "given"]
    assert gyros[2][-1] == "150"  # 1σ of the grade, ppm
    assert accelerometers[1] == ["bias", "µg", "10.00", "20.00", "−30.00", "given"]
    both = fixed | {"accel_bias_sigma_ug": 5.0}
    told = report_of(
        Reached(scenario(parked=PARKED, imu=both)), {"status": "failed", "message": "no", "timing": {}, "versions": {}}
    )
    _, accelerometers = (t for t in Tables(told).tables if "x (forward)" in t[0])
    assert accelerometers[1][-1] == "given ± 5"
    assert accelerometers[1][2] != "10.00"
    assert accelerometers[2][-1] == "7"
    assert "Angle random walk 0.02 deg/√h" in told
    assert "Velocity random walk 33.9" in told  # 0.02 m/s/√h = 33.99 µg/√Hz


def test_what_a_calibration_took_away_is_told_and_drawn(tmp_path):
    """Before and after in the same colours, pale and pure; the tables are what this run's seed drew."""
    tables = {
        "parked": PARKED,
        "imu": {"grade": "tactical"},
        "compensation": {"gyro_bias_sigma_deg_h": 0.02, "accel_scale_sigma_ppm": 9.0},
    }
    result = run(scenario(**tables), tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    check_page(result, page)
    before, _, after, accel = (t for t in Tables(page).tables if "x (forward)" in t[0])
    known = result.scenario.compensation.draw(draw(result.scenario.imu, 4), 4)
    true = draw(result.scenario.imu, 4)
    assert [value(c) for c in before[1][2:5]] == pytest.approx(true.gyro.bias / DEG_H, rel=1e-3)
    left = (true.gyro.bias - known.gyro.bias) / DEG_H
    assert [value(c) for c in after[1][2:5]] == pytest.approx(left, rel=1e-3)
    assert after[1][-1] == "0.02"
    assert accel[2][-1] == "9"
    assert [row[2:5] for row in (after[2], accel[1])] == [["0", "0", "0"]] * 2  # those the calibration knows
    titles = {d.find(f"{SVG}text").text: d for d in drawings(page) if d.find(f"{SVG}text") is not None}
    drawing = next(d for t, d in titles.items() if t.startswith("Gyros: error, accumulated"))
    assert {"x measured", "z compensated"} <= {t.text for t in drawing.findall(f"{SVG}text")}
    painted = [line.get("stroke") for line in drawing.find(f"{SVG}svg").iter(f"{SVG}polyline")]
    pure = ["#{:02x}{:02x}{:02x}".format(*c) for c in style.colors(["x", "y", "z"])]
    assert painted[3:] == pure
    assert painted[:3] == ["#{:02x}{:02x}{:02x}".format(*style.tint(c)) for c in style.colors(["x", "y", "z"])]
    assert any(t.startswith("Accelerometers: error after compensation") for t in titles)


def test_errors_that_no_grade_has_are_told_too(tmp_path):
    imu = {
        "grade": "ideal",
        "gyro_asymmetry_sigma_ppm": 20.0,
        "gyro_g_sensitivity_deg_h_per_g": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        "gyro_flicker_deg_h": 0.5,
        "gyro_range_deg_s": 400.0,
        "temperature_start_c": -40.0,
        "laser_gyro": {
            "perimeter_mm": 420.0,
            "area_mm2": 8487.0,
            "lock_in_deg_h": 0.0,
            "dither_amplitude_arcsec": 140.0,
            "dither_frequency_hz": 400.0,
            "gas_flow_mps": 0.05,
            "gain_percent": 0.8,
            "path_control": 0.5,
        },
        "accel_cross_axis_ug_per_g2": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        "accel_rrw_ug_sqrt_h": 7.0,
        "faults": [
            {"type": "dropout", "from_s": 1.0, "to_s": 2.0},
            {"type": "bias-step", "from_s": 3.0, "accel_ug": [9.0, 0.0, 0.0]},
            {"type": "spike", "at_s": 4.0, "gyro_arcsec": [9.0, 0.0, 0.0]},
        ],
    }
    result = run(scenario(parked=PARKED, imu=imu), tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    check_page(result, page)
    gyro, accel = ({row[0]: row[1:] for row in t} for t in Tables(page).tables if "x (forward)" in t[0])
    drawn = draw(result.scenario.imu, 4).gyro.asymmetry * 1e6
    assert gyro["asymmetry"] == ["ppm", *gyro["asymmetry"][1:4], "20"]
    assert [value(cell) for cell in gyro["asymmetry"][1:4]] == pytest.approx(drawn, rel=1e-3)
    assert gyro["g-sensitivity to y"] == ["deg/h/g", "2.000", "5.000", "8.000", "given"]  # of the gyros x, y and z
    assert accel["coupling with z"] == ["µg/g²", "2.000", "4.000", "", "given"]
    assert "K₂" not in accel
    # 40 °C of Zerodur are 0.336 µm, half of which is 0.26549 λ: ξ = 0.21803 and 150.53 deg/h · 2ξD(ξ)
    told = "Flicker B 0.5 deg/h, pulse weight 1.615 arcsec, range ± 400 deg/s, null shift by gas flow, at most "
    assert float(page.partition(told)[2].partition(" deg/h")[0]) == pytest.approx(13.87, rel=2e-3)
    assert "Rate random walk 7 µg/√h." in page
    assert "Faults: dropout from 1 s to 2 s; bias step from 3 s to the end; a spike at 4 s." in page


@pytest.mark.parametrize("kind", ["accelerometers", "attitude-sensor"])
def test_the_other_sets_of_sensors_have_pages_too(tmp_path, kind):
    imu = {"grade": "tactical", "sensor_set": {"type": kind, **({"arm_m": 2.0} if kind == "accelerometers" else {})}}
    by = {"algorithms": ["measured-attitude"], "frame": "inertial"} if kind == "attitude-sensor" else {}
    result = run(scenario(parked=PARKED, imu=imu, navigation=by), tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    check_page(result, page)
    titles = [d.find(f"{SVG}text").text for d in drawings(page) if d.find(f"{SVG}text") is not None]
    if kind == "accelerometers":
        table = Tables(page).with_heads("6", "1σ")
        biases = np.concatenate([triad.bias for triad in draw_accelerometers(result.scenario.imu, 6, 4)]) / UG
        assert [value(c) for c in table[1][2:8]] == pytest.approx(biases, rel=1e-3)
        assert "no gyro" in page
        assert any(t.startswith("Single accelerometers: error, mean over") for t in titles)
        assert any(t.startswith("Angular rate from the accelerometers: error, accumulated") for t in titles)
    else:
        table = Tables(page).with_heads("reference")
        drift = draw_attitude_sensor(result.scenario.imu, 4).drift / DEG_H
        assert [value(c) for c in table[2][2:5]] == pytest.approx(drift, rel=1e-3)
        assert table[2][-1] == "1"
        assert not any(t.startswith("Gyros") for t in titles)
        assert any(t.startswith("Attitude sensor, inertial axes: error of each measurement [") for t in titles)


def test_the_air_is_told_whether_or_not_it_is_the_default():
    """The row of turbulence of the default severity was empty."""
    start = {"on": "air", "latitude_deg": 50.0, "longitude_deg": 14.0, "altitude_m": 3000.0}
    leg = {"type": "hold", "duration_s": 10.0}
    section = {"aircraft": "737", "start": start, "legs": [leg]}
    told = dict(_source(scenario(flight={**section, "turbulence": {}})))
    assert told["turbulence"] == "severity = 3, wind_at_6m_mps = 7.7"
    assert told["wind"] == "none"
    assert dict(_source(scenario(flight=section)))["turbulence"] == "none"
    mounts = {"linear_hz": 20.0, "angular_hz": 30.0}
    tremble = {"coordinate": "roll", "rms_arcsec": 5.0, "low_hz": 20.0}
    told = dict(_source(scenario(parked=PARKED, isolator=mounts, vibration=[tremble])))
    assert told["isolator"] == "linear_hz = 20, linear_damping = 0.2, angular_hz = 30, angular_damping = 0.2"


def test_a_run_that_broke_off_says_so_and_shows_what_there_was():
    told = report_of(
        Reached(scenario(parked=PARKED)),
        {"status": "failed", "message": "the <engine> broke", "timing": {"total_s": 1.0}, "versions": {"numpy": "2"}},
    )
    assert "The run failed." in told
    assert "the &lt;engine&gt; broke" in told
    assert "Navigation errors" not in told
    assert "Sensor errors of this run" in told
    check_self_contained(told)


def test_an_algorithm_that_diverged_does_not_spoil_the_report(tmp_path, monkeypatch):
    fake = fake_run.install(300, monkeypatch.setattr)
    fake.solutions["euler"].latitude[200:] = np.nan
    result = run(fake_run.scenario())
    page = page_of(result.exhibits)
    for drawing in drawings(page):
        assert "nan" not in ET.tostring(drawing, "unicode").lower()
    assert "–" in Tables(page).with_errors()[-1]
    assert "euler has no result.</strong> Its errors are not finite from t = 2.00 s on" in page
    assert "No result from euler" in page


def test_an_algorithm_without_a_solution_leaves_the_others_theirs(tmp_path, monkeypatch):
    """One raises, one's errors overflow: null in the summary, their reasons there, in the events and in the report."""
    fake = fake_run.install(300, monkeypatch.setattr)
    fake.solutions["poisson"].velocity_ned[150:] = 1e200  # finite, its square is not

    def navigate(imu, initial, of, **_):
        if of.algorithm == "quaternion":
            raise RunError("the attitude ran away at t = 1.25 s.", time=1.25)
        return fake.solutions[of.algorithm]

    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate", navigate)
    result = run(fake_run.scenario(), tmp_path / "run")
    assert list(result.solutions) == ["poisson", "euler"]
    text = (tmp_path / "run" / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=lambda constant: pytest.fail(f"{constant} is no JSON"))
    assert summary == json.loads(json.dumps(result.summary))
    assert list(summary["algorithms"]) == list(fake_run.ALGORITHMS)
    assert set(summary["algorithms"]["quaternion"].values()) == {None}
    assert list(summary["algorithms"]["quaternion"]) == list(summary["algorithms"]["euler"])
    poisson = summary["algorithms"]["poisson"]
    assert [poisson[f"{kind}_velocity_error_mps"] for kind in ("final", "rms", "max")] == [None] * 3
    assert poisson["rms_horizontal_error_m"] > 0.0
    assert summary["failures"] == {
        "quaternion": {"time_s": 1.25, "text": "the attitude ran away at t = 1.25 s."},
        "poisson": {"time_s": 1.5, "text": "its errors are not finite from t = 1.50 s on: it diverged."},
    }
    events = pq.read_table(tmp_path / "run" / "streams" / "events.parquet").to_pydict()
    assert (1.25, "quaternion: the attitude ran away at t = 1.25 s.") in zip(
        events["time_s"], events["text"], strict=True
    )
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    check_self_contained(page)
    assert "quaternion has no result.</strong> The attitude ran away" in page
    assert Tables(page).with_errors()[2] == ["quaternion", *["–"] * 12]
    assert value(Tables(page).with_errors()[4][1]) > 0.0


def test_no_solution_at_all_is_a_failure_of_the_run(tmp_path, monkeypatch):
    fake_run.install(300, monkeypatch.setattr)

    def navigate(imu, initial, of, **_):
        raise RunError(f"{of.algorithm} met the pole.", time=1.0)

    monkeypatch.setattr("sinssim.strapdown.measured_attitude.navigate", navigate)
    with pytest.raises(RunError, match="quaternion met the pole"):
        run(fake_run.scenario(), tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["status"] == "failed"
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "The run failed." in page
    assert "Errors of the measurements" in page


@pytest.mark.parametrize(
    ("latitude", "radius_1", "radius_2", "gravity"),
    [(0.0, 6335439.3273, 6378137.0, 9.7803253359), (90.0, 6399593.6258, 6399593.6258, 9.8321849379)],
)
def test_the_schuler_period_of_published_constants(latitude, radius_1, radius_2, gravity):
    """NIMA TR 8350.2, tables 3.3 and 3.6: radii and normal gravity at the equator and at the pole."""
    rows = np.zeros(3)
    truth = NavState(rows + np.radians(latitude), rows, rows, np.zeros((3, 3)), np.zeros((3, 4)))
    expected = 2.0 * np.pi * np.sqrt(np.sqrt(radius_1 * radius_2) / gravity)
    assert schuler_period(truth, WGS84) == pytest.approx(expected, rel=1e-9)
    assert expected / 60.0 == pytest.approx(84.4, abs=0.2)


@pytest.mark.parametrize(
    ("tables", "title"), [({"track": 1}, "Track"), ({"flight": 1}, "Flight"), ({"drive": 1}, "Motion")]
)
def test_the_heading_of_the_motion(tables: dict[str, int], title: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_report, "places_of", lambda *given: SimpleNamespace(named=()))
    monkeypatch.setattr(run_report, "moments", lambda *given: [])
    monkeypatch.setattr(run_report, "pieces_of", lambda scenario, truth: [])
    monkeypatch.setattr(run_report, "motion_map", lambda *given: Sentence("map"))
    truth = object.__new__(Truth)
    vars(truth).update(trajectory=SimpleNamespace(start=0.0, end=1.0, ellipsoid=WGS84), block=None)
    scenario = SimpleNamespace(**{"track": None, "flight": None, **tables})
    run: Any = SimpleNamespace(scenario=scenario, truth=truth, aided=None)
    first: Any = SimpleNamespace(track=1, facts=Sentence("facts"), tracks=(), motion=())
    section: Any = next(iter(run_report._simulated(run, {}, first)))  # type: ignore[arg-type]
    assert section.title == title
