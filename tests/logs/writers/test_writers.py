"""Exports read back: by the libraries of their formats, and by this package's readers, to the format's last digit."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from sinssim import rotation
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import shipped
from sinssim.errors import InputError
from sinssim.logs.formats import WRITERS, read_file, rtklib
from sinssim.logs.formats.export_streams import Exported, export
from sinssim.logs.recorded_streams import SolutionStream
from sinssim.logs.stored_run import RecordedRun
from sinssim.units import DEG
from tests.logs.short_run import short_run

START_OF_WEEK = 345618  # 2026-01-01 00:00:00 UTC is Thursday: 4 days and 18 leap seconds


@pytest.fixture(scope="module")
def run() -> RecordedRun:
    return RecordedRun(short_run())


@pytest.fixture(scope="module")
def truth(run: RecordedRun) -> SolutionStream:
    return run.solution("truth")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    return tmp_path / "made"


def made(run: RecordedRun, to: str, place: Path, **options: object) -> Exported:
    return export(run.path, to, place, **options)  # type: ignore[arg-type]


def same_attitude(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest angle between attitudes, rad."""
    return float(
        np.linalg.norm(
            rotation.rotation_vector_from_quaternion(rotation.multiply(a, rotation.conjugate(b))), axis=1
        ).max()
    )


@pytest.mark.parametrize("to", WRITERS)
def test_every_format_says_what_it_holds(run: RecordedRun, to: str, tmp_path: Path) -> None:
    done = made(run, to, tmp_path / "out")
    assert done.files
    assert all((tmp_path / file).stat().st_size > 100 for file in done.files if file.name != "gps_visibility.csv")
    assert any("2026-01-01T00:00:00Z" in sentence for sentence in done.sentences)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"], "nothing is left beside it"


def test_csv(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "csv", place)
    found = read_file(place / "truth.csv").solutions["solution"]
    assert np.abs(found.latitude - truth.latitude).max() < 1e-15
    assert np.abs(found.longitude - truth.longitude).max() < 1e-15
    assert np.array_equal(found.height, truth.height)
    assert np.array_equal(found.velocity_ned, truth.velocity_ned)
    assert same_attitude(found.q_nb, truth.q_nb) < 1e-15
    imu, own = read_file(place / "imu.csv").inertial["imu"], run.increments("measured")
    assert np.array_equal(imu.gyro, own.gyro)
    assert np.array_equal(imu.accel, own.accel)
    assert imu.kind == "increments"
    fixes, given = read_file(place / "gnss.csv").fixes["gnss"], run.fix("gnss")
    assert np.array_equal(fixes.position_sigma, given.position_sigma)
    assert np.array_equal(fixes.velocity_ned, given.velocity_ned)


def test_kf_gins_as_its_own_loaders_read_it(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    """Its loaders split at blanks: 7 numbers for IMU and GNSS, 11 for a solution, degrees and metres."""
    made(run, "kf-gins", place)
    rows = np.array([line.split() for line in (place / "imu.txt").read_text().splitlines()], dtype=float)
    own = run.increments("measured")
    assert np.allclose(rows[:, 0], START_OF_WEEK + own.time, rtol=0, atol=1e-9)
    assert np.array_equal(rows[:, 1:], np.hstack((own.gyro, own.accel)))
    gnss = np.array([line.split() for line in (place / "gnss.txt").read_text().splitlines()], dtype=float)
    assert gnss.shape == (100, 7)
    assert np.allclose(gnss[:, 1] * DEG, run.fix("gnss").latitude, rtol=0, atol=1e-15)
    nav = np.array([line.split() for line in (place / "truth.nav").read_text().splitlines()], dtype=float)
    assert (nav[:, 0] == 2399).all()
    assert np.allclose(nav[:, 10], rotation.euler_from_quaternion(truth.q_nb)[2] / DEG, rtol=0, atol=1e-12)
    read = read_file(place / "truth.nav").solutions["solution"]
    assert same_attitude(read.q_nb, truth.q_nb) < 1e-14
    text = (place / "kf-gins.yaml").read_text()
    assert "imudatarate: 50" in text
    assert "antlever: [0.5, 0.0, -1.5]" in text
    first = truth.latitude[1] / DEG, truth.longitude[1] / DEG, truth.height[1]
    assert f"starttime: {rows[0, 0]} " in text, "KF-GINS refuses a start before its first reading"
    assert f"initpos: {[float(v) for v in first]} " in text, "the state at the first reading"


def test_kf_gins_has_the_noise_of_the_sensors(run: RecordedRun, place: Path) -> None:
    """mems-industrial: 0.1 °/√h, 25 °/h and 2 °/h with 1 h, 1000 ppm; 0.1 m/s/√h, 2 mg, 1000 ppm."""
    done = made(run, "kf-gins", place)
    assert any("noise of the run's sensors" in sentence for sentence in done.sentences)
    assert any("crosses the antimeridian" in sentence for sentence in done.sentences)
    text = (place / "kf-gins.yaml").read_text()
    given = {
        key.strip(): [float(word) for word in value.partition("]")[0].strip(" [").split(",")]
        for key, _, value in (line.partition(":") for line in text.splitlines())
        if "[" in value
    }
    assert given["initbgstd"] == pytest.approx([np.hypot(25.0, 2.0)] * 3)
    # a Gauss-Markov process of 2 °/h and 1 h has the driving noise of one of σ = 2 √1000 °/h and 1000 h
    assert given["gbstd"] == pytest.approx([2.0 * np.sqrt(1000.0)] * 3)
    assert given["initbastd"] == pytest.approx([2.0 * 980.665] * 3), "1 mg is 980.665 mGal"
    assert given["abstd"] == [0.0] * 3
    assert given["initsgstd"] == given["initsastd"] == [1000.0] * 3
    assert given["arw"] == pytest.approx([0.1] * 3)
    assert given["vrw"] == pytest.approx([0.1] * 3)
    assert given["initattstd"] == [0.1, 0.1, 0.5]


def test_kf_gins_starts_from_a_solution_with_the_filter_s_sigma(run: RecordedRun, place: Path) -> None:
    made(run, "kf-gins", place, solution=["euler"])
    text, own = (place / "kf-gins.yaml").read_text(), run.table("filter")
    s = run.solution("euler")
    assert f"initpos: {[float(v) for v in (s.latitude[1] / DEG, s.longitude[1] / DEG, s.height[1])]} " in text
    row = int(np.searchsorted(own["time_s"], s.time[1] - 1e-9))
    sigma = [own[f"sigma_phi_{axis}_rad"][row] / DEG for axis in "ned"]
    assert "initattstd: [" + ", ".join(f"{v:.9g}" for v in sigma) + "] " in text


def test_kf_gins_without_known_sensors(run: RecordedRun, place: Path, tmp_path: Path) -> None:
    other = tmp_path / "run"
    shutil.copytree(run.path, other)
    scenario = (other / "scenario.toml").read_text()
    (other / "scenario.toml").write_text(scenario.replace('"mems-industrial"', '"a-grade-of-mine-that-is-gone"'))
    done = export(other, "kf-gins", place)
    assert any("set that of your sensors" in sentence for sentence in done.sentences)
    assert "arw: [0.2, 0.2, 0.2] " in (place / "kf-gins.yaml").read_text()


def test_kf_gins_refuses_the_end_of_a_week(run: RecordedRun, place: Path) -> None:
    with pytest.raises(InputError, match="end of the GPS week 2399"):
        made(run, "kf-gins", place, start="2026-01-03T23:59:40Z")
    assert not place.exists()


def test_psins(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    """As imufile.m reads it: counts times scale factors, right-front-up, time from t0 and the interval."""
    made(run, "psins", place)
    lines = [line for line in (place / "imu.imu").read_text().splitlines() if line and not line.startswith("%")]
    head = [list(map(float, line.split())) for line in lines[:3]]
    counts = np.array([line.split() for line in lines[3:]], dtype=np.int64)
    own = run.increments("measured")
    turn = np.cumsum(counts[:, :3], axis=0) * head[2][0] * np.pi / 648000.0
    force = np.cumsum(counts[:, 3:], axis=0) * head[2][3] * 1e-6 * head[1][5]
    sums = np.cumsum(own.gyro, axis=0), np.cumsum(own.accel, axis=0)
    assert np.abs(turn[:, 0] - sums[0][:, 1]).max() < 3e-10  # right is the second axis of forward-right-down
    assert np.abs(turn[:, 1] - sums[0][:, 0]).max() < 3e-10
    assert np.abs(force[:, 2] + sums[1][:, 2]).max() < 6e-9
    assert head[1][4] == 20.0
    read = read_file(place / "imu.imu").inertial["imu"]
    assert np.allclose(read.time, own.time, rtol=0, atol=1e-9)
    assert np.abs(np.cumsum(read.accel, axis=0)[:, 2] + sums[1][:, 2]).max() < 6e-9
    avp = read_file(place / "truth.avp").solutions["solution"]
    assert same_attitude(avp.q_nb, truth.q_nb) < 1e-14
    assert np.abs(avp.velocity_ned - truth.velocity_ned).max() < 1e-12


def test_gnss_ins_sim(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    """numpy reads it as gnss-ins-sim does: genfromtxt with a line of names."""
    made(run, "gnss-ins-sim", place)
    gyro = np.genfromtxt(place / "gyro-0.csv", delimiter=",", skip_header=1)
    own = run.increments("measured")
    assert np.allclose(np.radians(gyro) * 0.02, own.gyro, rtol=1e-12, atol=1e-18)
    assert (place / "gyro-0.csv").read_text().startswith("gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)\n")
    angles = np.genfromtxt(place / "ref_att_euler.csv", delimiter=",", skip_header=1)
    roll, pitch, heading = rotation.euler_from_quaternion(truth.q_nb[:-1])  # a row is the start of its interval
    assert np.allclose(np.radians(angles), np.column_stack((heading, pitch, roll)), rtol=0, atol=1e-14)
    assert np.genfromtxt(place / "gps-0.csv", delimiter=",", skip_header=1).shape == (100, 6)


def test_matlab(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    made(run, "mat", place)
    found = scipy_io.loadmat(place, simplify_cells=True)
    assert np.array_equal(found["truth"]["q_nb"], truth.q_nb)
    assert np.array_equal(found["truth"]["latitude_rad"], truth.latitude)
    assert np.array_equal(found["imu"]["dvel_mps"], run.increments("measured").accel)
    assert set(found) >= {"truth", "quaternion", "euler", "aided", "imu", "gnss", "start"}
    assert found["start"]["gps_seconds_of_week"] == START_OF_WEEK
    assert found["gnss"]["lever_arm_m"].tolist() == [0.5, 0.0, -1.5]


def test_kml(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "kml", place)
    names = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
    root = ElementTree.parse(place).getroot()
    track = root.find(".//gx:Track", names)
    # gx:Track: as many times as coordinates; coordinates are longitude, latitude, altitude
    times = [datetime.fromisoformat(str(one.text)) for one in track.findall("k:when", names)]
    places = np.array([str(one.text).split() for one in track.findall("gx:coord", names)], dtype=float)
    assert len(times) == len(places) == len(truth)
    assert times[0] == datetime(2026, 1, 1, tzinfo=UTC)
    assert (times[-1] - times[0]).total_seconds() == 20.0
    assert np.abs(places[:, 1] - truth.latitude / DEG).max() <= 0.5e-9 + 1e-12
    assert np.abs(np.exp(1j * places[:, 0] * DEG) - np.exp(1j * truth.longitude)).max() < 1e-11
    assert (np.abs(places[:, 0]) <= 180.0).all()
    assert track.find("k:altitudeMode", names).text == "absolute"


def test_gpx(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "gpx", place, rate_hz=10.0)
    names = {"g": "http://www.topografix.com/GPX/1/1"}
    root = ElementTree.parse(place).getroot()
    assert root.attrib["version"] == "1.1"
    points = root.findall("g:trk/g:trkseg/g:trkpt", names)
    assert len(points) == 201
    # the schema orders ele, time, geoidheight, and wants -180 <= lon < 180
    assert [child.tag.rsplit("}")[1] for child in points[0]] == ["ele", "time", "geoidheight"]
    stream = read_file(place).fixes["gnss"]
    assert stream.datum == "ellipsoid"
    assert np.abs(stream.height - truth.height[::5]).max() < 1e-4
    assert all(-180.0 <= float(p.attrib["lon"]) < 180.0 for p in points)
    assert float(points[10].attrib["lat"]) == pytest.approx(truth.latitude[50] / DEG, abs=1e-9)


def test_geojson_is_cut_at_the_antimeridian(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "geojson", place)
    features = json.loads(place.read_text())["features"]
    assert len(features) == 2
    lines = [np.array(f["geometry"]["coordinates"]) for f in features]
    assert sum(map(len, lines)) == len(truth)
    assert (lines[0][:, 0] > 179.9).all()
    assert (lines[1][:, 0] < -179.9).all()
    assert [len(f["properties"]["coordTimes"]) for f in features] == list(map(len, lines))


def test_geojson_is_not_cut_beside_a_pole(run: RecordedRun, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step past a pole changes the longitude by up to 180°; only a larger one crosses the antimeridian."""
    from sinssim.logs.formats import gpx_kml_geojson as geojson
    from sinssim.logs.formats.gpx_kml_geojson import Points

    longitude = np.array([10.0, 150.0, 170.0, -170.0])
    points = Points(np.full(4, 89.9), longitude, np.full(4, 7.0), ["a", "b", "c", "d"], 4)
    monkeypatch.setattr(geojson, "path_points", lambda content: points)
    made(run, "geojson", place)
    lines = [f["geometry"]["coordinates"] for f in json.loads(place.read_text())["features"]]
    assert lines == [[[10.0, 89.9, 7.0], [150.0, 89.9, 7.0], [170.0, 89.9, 7.0]], [[-170.0, 89.9, 7.0]] * 2]


def test_sbet(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "sbet", place)
    rows = np.frombuffer(place.read_bytes(), dtype="<f8").reshape(-1, 17)
    assert np.array_equal(rows[:, 1], truth.latitude)
    assert np.array_equal(rows[:, 4:7], truth.velocity_ned)
    assert rows[0, 0] == START_OF_WEEK
    found = read_file(place).solutions["solution"]
    assert same_attitude(found.q_nb, truth.q_nb) < 1e-14
    assert np.array_equal(found.velocity_ned, truth.velocity_ned)


def test_rtklib_pos(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    made(run, "rtklib-pos", place)
    rows = [line.split() for line in place.read_text().splitlines() if not line.startswith("%")]
    assert rows[1][:2] == ["2026/01/01", "00:00:18.020"]  # GPST is 18 s ahead of UTC
    numbers = np.array([row[2:] for row in rows], dtype=float)
    assert np.abs(numbers[:, 0] - truth.latitude / DEG).max() <= 0.5e-9 + 1e-12
    assert np.abs(numbers[:, 2] - truth.height).max() <= 0.5e-4 + 1e-9
    assert np.abs(numbers[:, 15] + truth.velocity_ned[:, 2]).max() <= 0.5e-5 + 1e-9  # up


def test_rtklib_velocity_is_positive_up(place: Path) -> None:
    """A climb at 2 m/s, 3 m/s to the north and 4 m/s to the east: vn, ve and vu are the last three numbers."""
    one = np.ones(1)
    solution = SolutionStream(one, 0.9 * one, 0.2 * one, 100.0 * one, velocity_ned=np.array([[3.0, 4.0, -2.0]]))
    content = SimpleNamespace(
        solution=solution, solution_name="aided", run=SimpleNamespace(name="climb", fixes=()),
        stamps=lambda time: (np.full(len(time), 1_451_260_818), np.zeros(len(time), dtype=np.int64)),
    )  # fmt: skip
    rtklib.write_rtklib(content, place)  # type: ignore[arg-type]
    (row,) = (line.split() for line in place.read_text().splitlines() if not line.startswith("%"))
    assert [float(number) for number in row[-3:]] == [3.0, 4.0, 2.0]


def test_nmea_by_pynmeagps(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    library = pytest.importorskip("pynmeagps")
    made(run, "nmea", place)
    with place.open("rb") as file:
        found = [message for _, message in library.NMEAReader(file, quitonerror=2, validate=1)]
    assert [m.msgID for m in found[:3]] == ["GGA", "RMC", "HDT"]
    gga = [m for m in found if m.msgID == "GGA"]
    assert len(gga) == 201  # 10 a second
    rows = np.arange(0, 1001, 5)
    assert np.abs(np.array([m.lat for m in gga]) - truth.latitude[rows] / DEG).max() < 1e-7 / 60.0
    geoid = DisturbingField(shipped()).undulation(truth.latitude[rows], truth.longitude[rows])
    assert np.abs(np.array([m.sep for m in gga]) - geoid).max() < 1e-3
    stream = read_file(place).fixes["gnss"]
    assert np.abs(stream.height - truth.height[rows]).max() < 1e-4
    assert np.allclose(stream.time, truth.time[rows], rtol=0, atol=1e-9)
    assert np.abs(stream.velocity_ned[:, :2] - truth.velocity_ned[rows, :2]).max() < 3e-4


def test_mcap_by_rosbags_and_mcap(run: RecordedRun, truth: SolutionStream, place: Path) -> None:
    pytest.importorskip("rosbags")
    reader = pytest.importorskip("mcap.reader")
    place = place.with_suffix(".mcap")
    made(run, "mcap", place)
    with place.open("rb") as file:
        summary = reader.make_reader(file).get_summary()
    topics = {c.topic: summary.statistics.channel_message_counts[i] for i, c in summary.channels.items()}
    assert topics == {"/imu": 1000, "/gnss/fix": 100, "/gnss/velocity": 100, "/truth": 1001}
    streams = read_file(place)
    imu, own = streams.inertial["imu"], run.increments("measured")
    assert np.abs(imu.gyro[:, 0] * 0.02 - own.gyro[:, 0]).max() < 1e-15
    assert np.abs(imu.accel[:, 2] * 0.02 + own.accel[:, 2]).max() < 1e-13  # the intervals are 0.02 s to 1e-14 s
    fix = streams.fixes["gnss"]
    assert np.abs(fix.position_sigma - run.fix("gnss").position_sigma).max() < 1e-15
    assert np.abs(fix.velocity_ned - run.fix("gnss").velocity_ned).max() < 1e-15
    solution = streams.solutions["solution"]
    assert np.allclose(solution.time, truth.time, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("to", "file"), [("tum", ""), ("euroc", "mav0")])
def test_local_axes(run: RecordedRun, truth: SolutionStream, place: Path, to: str, file: str) -> None:
    """Position and attitude against the definition: the chord in the start's level, and the axes of REP 103."""
    made(run, to, place)
    streams = read_file(place / file if file else place)
    found = streams.solutions["solution"]
    # 2 km at course 80°: east is sin 80°, north cos 80°, the Earth falls off by d²/2R; a great circle of the vertical
    # leaves the course by up to 0.2° (flattening), 7 m
    end = found.local_enu[-1]
    assert end[0] == pytest.approx(2000.0 * np.sin(80.0 * DEG), abs=7.0)
    assert end[1] == pytest.approx(2000.0 * np.cos(80.0 * DEG), abs=7.0)
    assert end[2] == pytest.approx(-(2000.0**2) / (2.0 * 6.375e6), abs=2e-3)
    assert np.allclose(found.time, truth.time, rtol=0, atol=1e-9)
    # forward is along the path, in east and north
    forward = rotation.rotate(rotation.multiply([0, 0.5**0.5, 0.5**0.5, 0], found.q_nb), np.array([1.0, 0.0, 0.0]))
    along = np.diff(found.local_enu, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    assert np.abs(forward[1:] - along).max() < 0.005
    if to == "euroc":
        assert np.abs(np.linalg.norm(found.velocity_ned, axis=1) - 100.0).max() < 1e-9
        up = streams.inertial["imu"].accel[:, 2].mean()
        assert up == pytest.approx(9.8, abs=0.1)  # z up: specific force at rest is positive


def test_choice_of_streams(run: RecordedRun, place: Path) -> None:
    made(run, "csv", place, solution=["aided", "ideal"])
    aided = run.solution("aided")
    assert np.array_equal(read_file(place / "aided.csv").solutions["solution"].height, aided.height)
    assert np.array_equal(read_file(place / "imu.csv").inertial["imu"].gyro, run.increments("ideal").gyro)


@pytest.mark.parametrize(
    ("to", "options", "said"),
    [
        ("kmz", {}, "unknown format"),
        ("kml", {"solution": ["turth"]}, "truth"),
        ("kml", {"solution": ["truth", "aided"]}, "both choose"),
        ("kml", {"start": "soon"}, "--start"),
        ("kml", {"rate_hz": -1.0}, "--rate"),
        ("sbet", {"solution": ["gnss"]}, "velocity and attitude"),
        ("tum", {"solution": ["gnss"]}, "attitude"),
    ],
)
def test_bad_input(run: RecordedRun, place: Path, to: str, options: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        made(run, to, place, **options)
    assert not place.exists()


def test_existing_files_stay(run: RecordedRun, place: Path) -> None:
    place.write_text("mine")
    with pytest.raises(InputError, match="--overwrite"):
        made(run, "kml", place)
    assert place.read_text() == "mine"
    made(run, "kml", place, overwrite=True)
    assert place.read_text().startswith("<?xml")


def test_not_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no run"):
        export(tmp_path, "kml")
    with pytest.raises(InputError, match="does not exist"):
        export(tmp_path / "nowhere", "kml")
    (tmp_path / "streams").mkdir()
    truth = tmp_path / "streams" / "truth.parquet"
    truth.write_bytes(b"PAR1 not really")
    with pytest.raises(InputError, match=r"truth\.parquet cannot be read"):
        export(tmp_path, "kml")
    pq = pytest.importorskip("pyarrow.parquet")
    pq.write_table(pytest.importorskip("pyarrow").table({"time_s": [0.0], "coordinate_rad": [0.0]}), truth)
    with pytest.raises(InputError, match="one-component system"):
        export(tmp_path, "kml")


@pytest.mark.parametrize("to", ["kf-gins", "csv", "psins", "rtklib-pos"])
def test_fixes_of_outages_are_withheld(run: RecordedRun, to: str, tmp_path: Path) -> None:
    """Fixes after the beginning and up to the end of an outage are left out, and nothing else changes."""
    time = run.fix("gnss").time
    begin, end = float(time[0]) + 0.2 * float(np.ptp(time)), float(time[0]) + 0.6 * float(np.ptp(time))
    chosen = {"solution": ["gnss"]} if to == "rtklib-pos" else {}
    done = made(run, to, tmp_path / "gaps", outages=[f"{begin}:{end}"], **chosen)
    gone = int(((time > begin) & (time <= end)).sum())
    assert 0 < gone < len(time)
    assert any(f"{gone} of gnss" in sentence for sentence in done.sentences)
    whole = made(run, to, tmp_path / "whole", **chosen)
    name = {"kf-gins": "gnss", "csv": "gnss", "psins": "gnss.avp", "rtklib-pos": ""}[to]
    for one, other in zip(done.files, whole.files, strict=True):
        lines, all_lines = ((tmp_path / file).read_text().splitlines() for file in (one, other))
        missing = len(all_lines) - len(lines)
        assert missing == (gone if name in str(one.name) or to == "rtklib-pos" else 0), one
        assert set(lines) <= set(all_lines) | {line for line in lines if "%" in line or "#" in line}


@pytest.mark.parametrize(
    ("to", "outage", "said"),
    [
        ("euroc", "1:2", "contains no fixes"),
        ("kml", "1:2", "--solution gnss"),
        ("csv", "1e9:2e9", "it is not an outage"),
        ("csv", "9000:9001", "no outage lies within the run"),
        ("csv", "5/10@1,2", "several beginnings"),
        ("csv", "10/5", "must be less than"),
    ],
)
def test_outages_that_cannot_be_are_refused(run: RecordedRun, to: str, outage: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        made(run, to, tmp_path / "out", outages=[outage])


@pytest.mark.parametrize(("ns", "decimals"), [(20_000_000, ".020"), (20_000_500, ".020000500")])
def test_a_pos_file_has_all_decimals_of_the_time(ns: int, decimals: str, tmp_path: Path) -> None:
    solution = SolutionStream(np.zeros(1), np.array([0.8]), np.array([0.2]), np.array([100.0]))
    content: Any = SimpleNamespace(
        solution=solution, solution_name="truth", run=SimpleNamespace(fixes=(), name="run"),
        stamps=lambda time: (np.array([86_400 + 3]), np.array([ns])),
    )  # fmt: skip
    rtklib.write_rtklib(content, tmp_path / "run.pos")
    assert (tmp_path / "run.pos").read_text().splitlines()[-1].startswith(f"1980/01/07 00:00:03{decimals} ")
