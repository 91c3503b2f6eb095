"""Every column and sentence of the score of a file with known errors, against a run that was written by hand."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.spatial.transform import Rotation

from sinssim.errors import InputError
from sinssim.logs.gps_time import match_clock, parse_date
from sinssim.logs.recorded_streams import Clock, SolutionStream
from sinssim.logs.reference_solution import TruthAt, interpolation_error, reference_of
from sinssim.logs.solution_score import Judge, common_span
from sinssim.logs.stored_run import RecordedRun
from tests.logs import hand_run
from tests.logs.formats.whole import attitude, whole
from tests.logs.hand_run import ACCEL, ANGLES, ARM, BESIDE, GYRO, HEIGHT, LATITUDE, LONGITUDE, TIME, VELOCITY

NAN = float("nan")
START = parse_date(hand_run.START, "")
OFF = np.array([[3.0, -4.0, 2.0], [-5.0, 12.0, -1.5], [8.0, 15.0, 0.5], [-7.0, -24.0, 3.5]])
"""North, east, up, m."""
FASTER = np.array([[0.25, -0.5, 0.75], [-0.125, 0.375, 0.625], [1.25, -1.5, 1.75], [2.0, 3.0, -4.0]])
TILT = np.array([[1.0, -2.0, 3.0], [-4.0, 5.0, 6.0], [7.0, -8.0, -9.0], [2.5, 3.5, -1.5]]) * 1e-3
"""φ about north, east, down, rad: true attitude = turn by φ of that of the solution."""


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Judge:
    return Judge(RecordedRun(hand_run.hand_run(tmp_path_factory.mktemp("runs") / "mine")), START)


def radii(a: float, f: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances of a radian of latitude and of longitude at the true places, m (meridian, prime vertical)."""
    e2, sine = f * (2.0 - f), np.sin(np.radians(LATITUDE))
    meridian = a * (1.0 - e2) / (1.0 - e2 * sine**2) ** 1.5
    vertical = a / np.sqrt(1.0 - e2 * sine**2)
    return meridian + HEIGHT, (vertical + HEIGHT) * np.cos(np.radians(LATITUDE))


def solution(a: float = 6378137.0, f: float = 1.0 / 298.257223563) -> tuple[np.ndarray, ...]:
    """Latitude, longitude in degrees, height, velocity, quaternion of a solution that is off by the above."""
    north, east = radii(a, f)
    true = Rotation.from_quat(attitude(ANGLES.tolist()), scalar_first=True)
    own = Rotation.from_rotvec(TILT).inv() * true
    return (
        LATITUDE + np.degrees(OFF[:, 0] / north),
        LONGITUDE + np.degrees(OFF[:, 1] / east),
        HEIGHT + OFF[:, 2],
        VELOCITY + FASTER,
        own.as_quat(scalar_first=True),
    )


def write(path: Path, *, names: str, columns: list[np.ndarray]) -> Path:
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack(columns).tolist())
    path.write_text(f"{names}\n{rows}\n")
    return path


PLACE = "gps_s,latitude_deg,longitude_deg,height_m"
MORE = "velocity_n_mps,velocity_e_mps,velocity_d_mps,q_nb_w,q_nb_x,q_nb_y,q_nb_z"
SIGMA = "sigma_n_m,sigma_e_m,sigma_d_m,sigma_vn_mps,sigma_ve_mps,sigma_vd_mps"


def test_errors_and_sentences(judge: Judge, tmp_path: Path) -> None:
    """Rows before and after the run are left out; a metre in 100 km of curvature leaves some 1e-6 of the errors."""
    latitude, longitude, height, velocity, q = solution()
    rows = [0, 0, 1, 2, 3, 3]
    time = START + np.array([-0.5, 0.25, 0.75, 1.25, 1.75, 2.5])
    sigma = np.arange(36.0).reshape(6, 6) + 0.5
    columns = [time, latitude[rows], longitude[rows], height[rows], velocity[rows], q[rows], sigma]
    path = write(tmp_path / "own.csv", names=f"{PLACE},{MORE},{SIGMA}", columns=columns)
    score = judge.score(path, seconds=12.5)
    assert (score.name, score.path, score.format, score.seconds) == ("own", path, "columns", 12.5)
    assert score.sentences == (
        "Format columns.",
        "Heights are above the ellipsoid.",
        "The attitude is that of forward-right-down axes to north-east-down.",
        "Its clock: GPS time, the column gps_s, with a date.",
        "4 rows, from 0.250 s to 1.750 s; 2 outside the run or without a position are left out.",
        "All rows are at samples of the truth.",
        "It is compared with the truth of the sensor block.",
    )
    e = score.error
    np.testing.assert_allclose(e.time, TIME, atol=1e-6)
    np.testing.assert_allclose(e.position_ned, OFF * [1.0, 1.0, -1.0], atol=3e-4)
    np.testing.assert_allclose(e.height, OFF[:, 2], atol=1e-9)
    np.testing.assert_allclose(e.velocity_ned, FASTER, atol=1e-12)
    np.testing.assert_allclose(e.attitude, TILT, atol=1e-12)
    assert score.solution.algorithm == "own"
    np.testing.assert_allclose(score.solution.latitude, np.radians(latitude), rtol=1e-14)
    np.testing.assert_allclose(score.solution.longitude, np.radians(longitude), rtol=1e-14)
    np.testing.assert_array_equal(score.solution.height, height)
    np.testing.assert_array_equal(score.solution.velocity_ned, velocity)
    np.testing.assert_allclose(score.solution.q_nb, q, atol=1e-15)
    assert score.sigma is not None
    np.testing.assert_array_equal(score.sigma[:, :6], sigma[1:5])
    assert np.isnan(score.sigma[:, 6:]).all()
    other = judge.score(write(tmp_path / "b.csv", names=PLACE, columns=[c[2:4] for c in columns[:4]]))
    assert common_span([score, other]) == (
        pytest.approx(0.75, abs=1e-6), pytest.approx(1.25, abs=1e-6),
    )  # fmt: skip


def test_sigma_of_the_heading(judge: Judge, tmp_path: Path) -> None:
    """KF-GINS gives the angle about down, which is the last of nine columns; those of roll and pitch are left out."""
    week, second = START // 604800, START % 604800
    (tmp_path / "out.nav").write_text(
        "\n".join(
            f"{week} {second + t} {a} {b} {c} 1 2 3 4 5 6"
            for t, a, b, c in zip(TIME, LATITUDE, LONGITUDE, HEIGHT, strict=True)
        )
    )
    (tmp_path / "KF_GINS_STD.txt").write_text(
        "\n".join(f"{second + t} " + " ".join(str(100 * k + i) for i in range(21)) for k, t in enumerate(TIME))
    )
    score = judge.score(tmp_path / "out.nav", name="kf")
    assert score.name == "kf"
    assert score.sigma is not None
    expected = [[100 * k + i for i in range(6)] + [NAN, NAN, np.radians(100 * k + 8)] for k in range(4)]
    np.testing.assert_allclose(score.sigma, expected, rtol=1e-14)


def test_what_is_missing(judge: Judge, tmp_path: Path) -> None:
    """Without a climb the vertical velocity has no error; errors of what is not given at all are NaN."""
    latitude, longitude, height, velocity, _ = solution()
    level = velocity.copy()
    level[:, 2] = NAN
    columns = [START + TIME, latitude, longitude, height, level, *[np.ones(4)] * 3]
    path = write(tmp_path / "a.csv", names=f"{PLACE},{MORE[:44]},sigma_n_m,sigma_e_m,sigma_d_m", columns=columns)
    score = judge.score(path)
    assert score.sentences[4:6] == (
        "All rows are at samples of the truth.",
        "It has no attitude; it is scored by what it has.",
    )
    assert score.sentences[6] == "It has no vertical velocity; its velocity error is the horizontal one."
    np.testing.assert_allclose(score.error.velocity_ned, FASTER * [1.0, 1.0, 0.0], atol=1e-12)
    assert np.isnan(score.error.attitude).all()
    assert np.isnan(score.solution.q_nb).all()
    (tmp_path / "b.gpx").write_text(
        "<gpx><trk><trkseg>"
        + "".join(
            f'<trkpt lat="{a}" lon="{b}"><time>2017-01-01T23:59:59.25Z</time></trkpt>'.replace("59.25Z", stamp)
            for a, b, stamp in zip(latitude, longitude, ("59.25Z", "59.75Z"), strict=False)
        )
        + "</trkseg></trk></gpx>"
    )
    score = judge.score(tmp_path / "b.gpx")
    assert score.sentences[:6] == (
        "Format gpx.",
        "Heights are above mean sea level: the height error contains the geoid's undulation.",
        "Its clock: UTC of GPX.",
        "2 rows, from 0.250 s to 0.750 s.",
        "All rows are at samples of the truth.",
        "It has no height and no velocity and no attitude; it is scored by what it has.",
    )
    np.testing.assert_allclose(score.error.position_ned[:, :2], OFF[:2, :2], atol=3e-4)
    for part in (score.error.position_ned[:, 2], score.error.velocity_ned, score.error.attitude, score.solution.height):
        assert np.isnan(part).all()
    assert score.sigma is None


def test_one_row_within_the_run_is_too_few(judge: Judge, tmp_path: Path) -> None:
    latitude, longitude, *_ = solution()
    points = "".join(
        f'<trkpt lat="{latitude[k]}" lon="{longitude[k]}"><time>{stamp}</time></trkpt>'
        for k, stamp in enumerate(("2017-01-01T23:59:59.25Z", "2017-01-02T05:00:00Z"))
    )
    (tmp_path / "one.gpx").write_text(f"<gpx><trk><trkseg>{points}</trkseg></trk></gpx>")
    with pytest.raises(InputError, match=r"one\.gpx has 1 rows within the run, .*; 2 are needed"):
        judge.score(tmp_path / "one.gpx")


@pytest.mark.parametrize(
    ("zero", "said"),
    [
        (0.0, "Its times are taken as those of the run."),
        (86417.0, "Its times are taken as seconds of the run's GPS week."),
        (17.0, "Its times are taken as seconds of the run's day, GPS time."),
        (86399.0, "Its times are taken as seconds of the run's day, UTC."),
    ],
)
def test_clocks_without_a_date(zero: float, said: str) -> None:
    """The time 0 is 86 417 s of the GPS week, 17 s of its second day, and 86 399 s of a day in UTC."""
    found = match_clock(Clock("machine"), zero + np.array([0.5, 1.5]), float(START), (0.25, 1.75), "x")
    assert (found.offset, found.sentence) == (-zero, said)


def test_clocks_with_a_date() -> None:
    for kind, note, said in (
        ("gps", "seconds of a week", "Its clock: seconds of a week, with a date."),
        ("gps", "", "Its clock: gps, with a date."),
        ("utc", "dates", "Its clock: dates."),
    ):
        clock = Clock(kind, START - 7, note)  # type: ignore[arg-type]
        found = match_clock(clock, np.array([7.5, 8.5]), START + 0.25, (0.25, 1.75), "x")
        assert (found.offset, found.sentence) == (-7.25, said)
    said = (
        r"x does not overlap the run: it lasts from 2017-01-02T00:00:09Z to 2017-01-02T00:00:14Z; the run from "
        r"2017-01-02T00:00:00Z to 2017-01-02T00:00:01Z \(seconds 1 to 2\.5\)"
    )
    with pytest.raises(InputError, match=said):
        match_clock(Clock("gps", START), np.array([10.0, 15.0]), START, (1.0, 2.5), "x")


def test_a_cubic_is_interpolated_exactly() -> None:
    """Heights and velocities that are cubics of the time, and a steady turn, at a place that stays; uneven samples."""
    time = np.array([0.5, 1.0, 2.0, 3.5, 4.0, 6.0])

    def height(t: np.ndarray) -> np.ndarray:
        return 100.0 + 2.0 * t - 0.5 * t**2 + 0.25 * t**3

    def velocity(t: np.ndarray) -> np.ndarray:
        return np.column_stack([1.0 + t**3, 2.0 - t**2, 3.0 * t])

    def q(t: np.ndarray) -> np.ndarray:
        return np.asarray(Rotation.from_rotvec(t[:, None] * np.array([0.1, -0.2, 0.3])).as_quat(scalar_first=True))

    here = np.full(len(time), 0.5), np.full(len(time), -1.5)
    truth = TruthAt(SolutionStream(time, *here, height(time), "ellipsoid", velocity(time), q(time)))
    at = np.array([0.5, 0.75, 1.5, 2.75, 3.75, 5.5, 6.0])
    found = truth.state(at)
    np.testing.assert_allclose(found.latitude, 0.5, rtol=1e-14)
    np.testing.assert_allclose(found.longitude, -1.5, rtol=1e-14)
    np.testing.assert_allclose(found.height, height(at), atol=1e-8)
    np.testing.assert_allclose(found.velocity_ned, velocity(at), atol=1e-11)
    alike = np.sum(found.q_nb * q(at), axis=1, keepdims=True)
    np.testing.assert_allclose(found.q_nb * np.sign(alike), q(at), atol=1e-14)
    assert truth.at_samples(at).tolist() == [True, False, False, False, False, False, True]
    # an antenna of a block that turns at 0.3 rad/s about down, level at a place on the equator: ω × l is −ω l_y, ω l_x
    level = Rotation.from_euler("Z", 0.3 * np.arange(9.0)[:, None]).as_quat(scalar_first=True)
    rest = SolutionStream(
        np.arange(9.0), np.zeros(9), np.full(9, 0.25), np.full(9, 50.0), "ellipsoid", np.zeros((9, 3)), level
    )
    state = TruthAt(rest).antenna(np.array([4.0]), np.array([2.0, -3.0, -1.5]))
    c, s = np.cos(1.2), np.sin(1.2)
    north, east = 2.0 * c + 3.0 * s, 2.0 * s - 3.0 * c
    assert state.latitude[0] * 6335439.327 == pytest.approx(north, rel=2e-5)
    assert (state.longitude[0] - 0.25) * 6378187.0 == pytest.approx(east, rel=2e-5)
    assert state.height[0] == pytest.approx(51.5, abs=1e-5)
    # over half an interval the chord of the turn is shorter by the factor sin(0.075)/0.075
    np.testing.assert_allclose(
        state.velocity_ned[0], np.array([-east, north, 0.0]) * 0.3 * np.sin(0.075) / 0.075, atol=1e-5
    )


def test_a_run_on_recorded_sensors(tmp_path: Path) -> None:
    run = RecordedRun(hand_run.log_run(tmp_path / "a", gap_s=0.75))
    assert run.of_log
    assert run.start_gps_s == START + 0.125
    assert (run.name, run.ellipsoid, run.motion) == ("a", "wgs84", "reference")
    assert run.solutions == ["reference", "euler", "aided"]
    assert run.algorithms == ["euler", "aided"]
    assert (run.inertial, run.fixes) == (["ideal", "measured"], ["gnss"])
    assert run.lever_arm("gnss") == ARM
    assert run.lever_arm("other") == (0.0, 0.0, 0.0)
    whole(
        run.solution("aided"),
        time=TIME,
        latitude_deg=BESIDE[0],
        longitude_deg=BESIDE[1],
        height=BESIDE[2],
        datum="ellipsoid",
        velocity_ned=BESIDE[3],
        attitude_deg=BESIDE[4],
    )
    whole(
        run.increments("measured"),
        time=TIME[1:],
        gyro=GYRO,
        accel=ACCEL,
        kind="increments",
        interval=[[0.5, 0.5]] * 3,
        axes=("forward", "right", "down"),
    )
    found = reference_of(run)
    assert (found.name, found.lever_arm, found.gap, found.velocity_time) == (
        "truth.nav",
        (0.25, 0.5, -0.75),
        0.75,
        None,
    )
    assert found.position_sigma is not None
    np.testing.assert_array_equal(found.position_sigma[1], [1.25, 2.25, 3.25])
    np.testing.assert_allclose(np.degrees(found.latitude), LATITUDE, rtol=1e-14)
    np.testing.assert_allclose(np.degrees(found.longitude), LONGITUDE, rtol=1e-14)
    np.testing.assert_array_equal(found.height, HEIGHT)
    np.testing.assert_array_equal(found.velocity_ned, VELOCITY)
    assert found.q_nb is not None
    np.testing.assert_allclose(found.q_nb, attitude(ANGLES.tolist()), atol=1e-15)


def test_the_order_of_solutions_and_uneven_intervals(tmp_path: Path) -> None:
    """Algorithms as in the summary, then the filter's; an interval ends at its stamp, the first begins with the run."""
    run = hand_run.hand_run(tmp_path / "mine")
    streams = run / "streams"
    for name in ("smoothed", "zeta", "backward", "aided", "alpha"):
        (streams / f"nav_{name}.parquet").write_bytes((streams / "nav_euler.parquet").read_bytes())
    (run / "summary.json").write_text(json.dumps({"algorithms": {"zeta": {}, "euler": {}}}))
    columns = parquet.read_table(streams / "imu_measured.parquet").to_pydict()
    parquet.write_table(pa.table({**columns, "time_s": [0.5, 1.25, 1.75]}), streams / "imu_measured.parquet")
    recorded = RecordedRun(run)
    assert recorded.solutions == ["truth", "zeta", "euler", "aided", "backward", "smoothed", "alpha"]
    interval = recorded.increments("measured").interval
    assert interval is not None
    assert interval.tolist() == [[0.25, 0.25], [0.75, 0.75], [0.5, 0.5]]


def test_a_delay_of_the_reference_s_velocities(tmp_path: Path) -> None:
    """They are valid before their stamps, and the reference is then not whole: the filter's solution stands for it."""
    run = RecordedRun(hand_run.log_run(tmp_path / "a", velocity_delay_s=0.125))
    assert (run.motion, run.solutions) == ("aided", ["euler", "aided"])
    found = reference_of(run)
    assert found.gap is None
    assert found.velocity_time is not None
    np.testing.assert_allclose(found.velocity_time, TIME - 0.125)
    judge = Judge(run, START)
    assert judge.against == "the reference truth.nav"
    assert judge.span == (0.25, 1.75)


def test_errors_of_a_run_follow_from_truth_and_solution(tmp_path: Path) -> None:
    """Errors are not stored: their columns come from the files of both, by the ellipsoid in the solution's file."""
    run = hand_run.hand_run(tmp_path / "mine")
    latitude, longitude, height, velocity, q = solution(7e6, 1.0 / 150.0)
    columns = {
        "time_s": TIME, "latitude_rad": np.radians(latitude), "longitude_rad": np.radians(longitude),
        "height_m": height,
        **{f"velocity_{axis}_mps": velocity[:, k] for k, axis in enumerate("ned")},
        **{f"q_nb_{axis}": q[:, k] for k, axis in enumerate("wxyz")},
    }  # fmt: skip
    rule = {"version": 1, "against": "truth", "a_m": 7e6, "f": 1.0 / 150.0, "axes": "north"}
    table = pa.table(columns).replace_schema_metadata({"sinssim.error": json.dumps(rule)})
    parquet.write_table(table, run / "streams" / "nav_mine.parquet")
    recorded = RecordedRun(run)
    found = recorded.errors("mine")
    np.testing.assert_array_equal(found[0], TIME)
    np.testing.assert_allclose(found[1:4].T, OFF * [1.0, 1.0, -1.0], atol=3e-4)
    np.testing.assert_allclose(found[4:7].T, FASTER, atol=1e-12)
    np.testing.assert_allclose(found[7:10].T, TILT, atol=1e-12)
    names = list(recorded.table("error_mine"))
    assert names == [
        "time_s", "position_n_m", "position_e_m", "position_d_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps",
        "phi_n_rad", "phi_e_rad", "phi_d_rad",
    ]  # fmt: skip
    (run / "streams" / "nav_euler.parquet").unlink()
    part = Judge(RecordedRun(run), START).run_errors((0.25, 1.25))["mine"]
    np.testing.assert_array_equal(part.time, TIME[:3])
    np.testing.assert_array_equal(part.position_ned, found[1:4, :3].T)
    np.testing.assert_array_equal(part.velocity_ned, found[4:7, :3].T)
    np.testing.assert_array_equal(part.attitude, found[7:10, :3].T)
    parquet.write_table(table.set_column(0, "time_s", pa.array(TIME + 0.01)), run / "streams" / "nav_mine.parquet")
    with pytest.raises(InputError, match=r"nav_mine\.parquet and .*truth\.parquet have different times"):
        RecordedRun(run).errors("mine")
    other = pa.table(columns).replace_schema_metadata({"sinssim.error": json.dumps({**rule, "version": 7})})
    parquet.write_table(other, run / "streams" / "nav_mine.parquet")
    with pytest.raises(InputError, match="the rule of its errors is 7, and this version computes rule 1"):
        RecordedRun(run).errors("mine")


def test_a_score_against_a_reference(tmp_path: Path) -> None:
    """At the reference's point; its own σ north and east, 0.5 and 1.5 m to 3.75 and 4.75 m, is √(64.25/4) = 4 m rms."""
    run = RecordedRun(hand_run.log_run(tmp_path / "a", lever_arm_m=[0.0, 0.0, 0.0], gap_s=0.75))
    judge = Judge(run, START)
    latitude, longitude, height, velocity, q = solution()
    columns = [START + TIME, latitude, longitude, height, velocity, q]
    score = judge.score(write(tmp_path / "own.csv", names=f"{PLACE},{MORE}", columns=columns))
    # only rows 20 ms from one of the reference's, which has less than three a second, are known: here they are the same
    assert score.sentences[3:] == (
        "Its clock: GPS time, the column gps_s, with a date.",
        "4 rows, from 0.250 s to 1.750 s.",
        "It is compared with the reference truth.nav. The reference is interpolated, and known at 4 of 4 rows.",
        "The reference's own σ is 4 m horizontally (rms); smaller errors are insignificant.",
    )
    np.testing.assert_allclose(score.error.position_ned, OFF * [1.0, 1.0, -1.0], atol=3e-4)
    np.testing.assert_allclose(score.error.velocity_ned, FASTER, atol=1e-9)
    np.testing.assert_allclose(score.error.attitude, TILT, atol=1e-9)


def test_a_lever_arm_of_a_reference(tmp_path: Path) -> None:
    """Of an antenna only if its lever arm is that of the reference; a solution without attitude cannot be turned."""
    latitude, longitude, height, _, _ = solution()
    path = write(tmp_path / "own.csv", names=PLACE, columns=[START + TIME, latitude, longitude, height])
    other = Judge(RecordedRun(hand_run.log_run(tmp_path / "a")), START)
    with pytest.raises(
        InputError,
        match=r"the reference truth\.nav has a lever arm of 0\.935 m, and the "
        r"solution has no",
    ):
        other.score(path)
    with pytest.raises(InputError, match="--antenna gnss: its lever arm is not that of the reference"):
        other.score(path, antenna="gnss")
    with pytest.raises(InputError, match="GNSS receiver"):
        other.score(path, antenna="galileo")
    same = Judge(RecordedRun(hand_run.log_run(tmp_path / "b", lever_arm_m=list(ARM))), START)
    found = same.score(path, antenna="gnss").error
    np.testing.assert_allclose(found.position_ned, OFF * [1.0, 1.0, -1.0], atol=3e-4)


def test_the_error_of_an_interpolation_of_fourth_powers() -> None:
    """Left out samples of c t⁴ in the first interval of 2h are off by 1/2·1/2·3/2·5/2 (2h)⁴ c; a sixteenth is shown."""
    time = 0.5 * np.arange(11)
    turn = Rotation.from_rotvec(np.outer(0.002 * time**4, [2.0, -1.0, 2.0]) / 3.0)
    here = np.full(11, 0.5), np.full(11, -1.5)
    truth = SolutionStream(time, *here, 8.0 * time**4, "ellipsoid", np.zeros((11, 3)), turn.as_quat(scalar_first=True))
    metres, angle = interpolation_error(truth)
    assert metres == pytest.approx(0.9375 * 0.5**4 * 8.0, rel=1e-6)
    assert angle == pytest.approx(0.9375 * 0.5**4 * 0.002, rel=1e-5)
    short = SolutionStream(
        *(values[:8] for values in (time, *here, time)), "ellipsoid", np.zeros((8, 3)), np.zeros((8, 4))
    )
    assert np.isnan(interpolation_error(short)).all()


def test_how_exact_the_truth_is_between_its_samples() -> None:
    """3e-5 rad are 6.2"; one of the three rows used is at a sample, two of five lie outside."""
    judge = SimpleNamespace(
        reference=None, interpolation=(0.02, 3e-5),
        truth=SimpleNamespace(at_samples=lambda time: np.array([True, False, False])),
    )  # fmt: skip
    time = np.array([1.5, 2.25, 3.125])
    assert Judge._about_rows(judge, range(5), np.array([1, 2, 3]), time) == [  # type: ignore[arg-type]
        "3 rows, from 1.500 s to 3.125 s; 2 outside the run or without a position are left out.",
        "1 rows are at samples of the truth; between them it is interpolated, to about 0.02 m and 6 arcsec.",
    ]
