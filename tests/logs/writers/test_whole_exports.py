"""Every number, name and sentence of each export of a run that was written by hand, against the format's layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.logs.formats.export_streams import export
from tests.logs import hand_run
from tests.logs.formats.samples import nmea_sentence
from tests.logs.formats.whole import attitude
from tests.logs.hand_run import (
    ACCEL,
    ANGLES,
    ARM,
    BESIDE,
    FIX,
    FIX_SIGMA,
    FIX_TIME,
    FIX_VELOCITY,
    FIX_VELOCITY_SIGMA,
    GYRO,
    HEIGHT,
    LATITUDE,
    LONGITUDE,
    SECONDS,
    TIME,
    VELOCITY,
)
from tests.logs.writers.exported import DATES, GEOID, NED_ENU, above_the_geoid, close, made, table


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hand_run.hand_run(tmp_path_factory.mktemp("runs") / "mine")


def test_csv(run: Path, tmp_path: Path) -> None:
    said = made(run, "csv", tmp_path / "out")
    assert said == [
        "truth.csv: truth; latitude, longitude in degrees, height above the ellipsoid, velocity north-east-down, "
        "quaternion (scalar first) and roll, pitch, heading of forward-right-down axes.",
        "imu.csv: measured data, increments over the interval that ends at the time.",
        "gnss.csv: fixes of the antenna, which is at 0.5, -0.25, -1.5 m (forward, right, down) of the IMU.",
        "time_s is the run's own time.",
    ]
    text = (tmp_path / "out" / "truth.csv").read_text()
    place = "time_s,latitude_deg,longitude_deg,height_m,"
    velocity = "velocity_n_mps,velocity_e_mps,velocity_d_mps"
    names = f"{place}{velocity},q_nb_w,q_nb_x,q_nb_y,q_nb_z,roll_deg,pitch_deg,heading_deg\n"
    assert text.startswith(names)
    q = attitude(ANGLES.tolist())
    close(table(tmp_path / "out" / "truth.csv"), TIME, LATITUDE, LONGITUDE, HEIGHT, VELOCITY, q, ANGLES)
    imu = (tmp_path / "out" / "imu.csv").read_text()
    assert imu.startswith("time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dvel_x_mps,dvel_y_mps,dvel_z_mps\n")
    np.testing.assert_array_equal(table(tmp_path / "out" / "imu.csv"), np.column_stack([TIME[1:], GYRO, ACCEL]))
    gnss = (tmp_path / "out" / "gnss.csv").read_text()
    names = f"{place}sigma_n_m,sigma_e_m,sigma_d_m,{velocity},sigma_vn_mps,sigma_ve_mps,sigma_vd_mps\n"
    assert gnss.startswith(names)
    close(table(tmp_path / "out" / "gnss.csv"), FIX_TIME, FIX, FIX_SIGMA, FIX_VELOCITY, FIX_VELOCITY_SIGMA)


def test_csv_of_a_solution_and_ideal_readings(run: Path, tmp_path: Path) -> None:
    """The solution is 0.001° north, 0.002° west and 3 m above the truth; ideal readings are two and three times."""
    said = made(run, "csv", tmp_path / "out", "euler", "ideal")
    assert said[0].startswith("euler.csv: euler; ")
    assert said[1] == "imu.csv: ideal data, increments over the interval that ends at the time."
    q = attitude(BESIDE[4].tolist())
    close(table(tmp_path / "out" / "euler.csv"), TIME, *BESIDE[:4], q, BESIDE[4])
    np.testing.assert_array_equal(
        table(tmp_path / "out" / "imu.csv")[:, 1:], np.column_stack([2.0 * GYRO, 3.0 * ACCEL])
    )


def test_matlab(run: Path, tmp_path: Path) -> None:
    from scipy.io import loadmat

    said = made(run, "mat", tmp_path / "out.mat")
    assert said == [
        "Structures: start, truth, euler, imu, gnss. Angles in rad, heights above the ellipsoid, velocity "
        "north-east-down, quaternions scalar first, body axes forward-right-down.",
        "imu holds the measured data, increments over the interval that ends at time_s.",
        "time_s is the run's own time; its 0 is second 86417 of the GPS week 1930.",
    ]
    found = {key: value for key, value in loadmat(tmp_path / "out.mat", simplify_cells=True).items() if key[0] != "_"}

    def solution(latitude: Array, longitude: Array, height: Array, velocity: Array, angles: Array) -> dict[str, Array]:
        roll, pitch, heading = np.radians(angles).T
        return {
            "time_s": TIME, "latitude_rad": np.radians(latitude), "longitude_rad": np.radians(longitude),
            "height_m": height, "velocity_ned_mps": velocity, "q_nb": attitude(angles.tolist()), "roll_rad": roll,
            "pitch_rad": pitch, "heading_rad": heading,
        }  # fmt: skip

    expected = {
        "start": {"gps_week": 1930.0, "gps_seconds_of_week": 86417.0},
        "truth": solution(LATITUDE, LONGITUDE, HEIGHT, VELOCITY, ANGLES),
        "euler": solution(*BESIDE),
        "imu": {"time_s": TIME[1:], "dtheta_rad": GYRO, "dvel_mps": ACCEL},
        "gnss": {
            "time_s": FIX_TIME, "latitude_rad": np.radians(FIX[:, 0]), "longitude_rad": np.radians(FIX[:, 1]),
            "height_m": FIX[:, 2], "sigma_ned_m": FIX_SIGMA, "velocity_ned_mps": FIX_VELOCITY,
            "velocity_sigma_ned_mps": FIX_VELOCITY_SIGMA, "lever_arm_m": np.array(ARM),
        },
    }  # fmt: skip
    assert list(found) == list(expected)
    for name, part in expected.items():
        assert list(found[name]) == list(part)
        for key, values in part.items():
            np.testing.assert_allclose(found[name][key], values, rtol=1e-13, atol=1e-15, err_msg=f"{name}.{key}")


KF_GINS = """# KF-GINS configuration for a run of sinssim
imupath: "./imu.txt"
gnsspath: "./gnss.txt"
outputpath: "."
imudatalen: 7
imudatarate: 2
starttime: 86417.75   # the first sample
endtime: -1
initpos: [-33.25, 179.875, 82.5]   # deg, deg, m
initvel: [-6.0, 8.0, -1.5]   # north, east, down, m/s
initatt: [-5.5, 15.75, 244.5]   # roll, pitch, heading, deg
initgyrbias: [0, 0, 0]   # deg/h
initaccbias: [0, 0, 0]   # mGal
initgyrscale: [0, 0, 0]   # ppm
initaccscale: [0, 0, 0]   # ppm
initposstd: [1, 1, 1]   # m
initvelstd: [0.1, 0.1, 0.1]   # m/s
initattstd: [0.1, 0.1, 0.5]   # deg
initbgstd: [50, 50, 50]   # deg/h
initbastd: [250, 250, 250]   # mGal
initsgstd: [1000, 1000, 1000]   # ppm
initsastd: [1000, 1000, 1000]   # ppm
imunoise:
  arw: [0.2, 0.2, 0.2]   # deg/sqrt(h)
  vrw: [0.1, 0.1, 0.1]   # m/s/sqrt(h)
  gbstd: [0, 0, 0]   # deg/h; 0 is a constant bias
  abstd: [0, 0, 0]   # mGal
  gsstd: [0, 0, 0]   # ppm
  asstd: [0, 0, 0]   # ppm
  corrtime: 1000.0   # h
antlever: [0.5, -0.25, -1.5]   # forward, right, down, m
"""


def test_kf_gins(run: Path, tmp_path: Path) -> None:
    said = made(run, "kf-gins", tmp_path / "out")
    assert said == [
        "imu.txt: measured increments; seconds of week, Δθ [rad], Δv [m/s], forward-right-down.",
        "gnss.txt: fixes of the antenna; seconds of week, latitude, longitude [°], height [m], σ [m].",
        "truth.nav: week, seconds, latitude, longitude [°], height [m], velocity, roll, pitch, heading [°].",
        "The run crosses the antimeridian, where KF-GINS fails because it subtracts longitudes.",
        "kf-gins.yaml: initial state of truth, lever arm of the antenna, and the noise of a MEMS IMU; set that of your "
        "sensors.",
        "Times are seconds of the GPS week 1930; the time 0 of the run is 86417.",
    ]
    folder = tmp_path / "out"
    close(table(folder / "imu.txt", None, 0), SECONDS + TIME[1:], GYRO, ACCEL)
    close(table(folder / "gnss.txt", None, 0), SECONDS + FIX_TIME, FIX, FIX_SIGMA)
    close(
        table(folder / "truth.nav", None, 0),
        np.full(4, 1930),
        SECONDS + TIME,
        LATITUDE,
        LONGITUDE,
        HEIGHT,
        VELOCITY,
        ANGLES,
    )

    def rounded(text: str) -> list[object]:
        """Words, and numbers to 11 digits: those of a state went through radians."""
        words = text.replace("[", " ").replace("]", " ").replace(",", " ").replace("\n", " \n ").split(" ")
        return [round(float(word), 11) if word.replace(".", "").lstrip("-").isdigit() else word for word in words]

    assert rounded((folder / "kf-gins.yaml").read_text()) == rounded(KF_GINS)


def test_psins(run: Path, tmp_path: Path) -> None:
    """Sums of the counts, right-front-up, are the rounded sums of the readings: 10.4, 21.8, 9.4 are 10, 22 and 9."""
    said = made(run, "psins", tmp_path / "out")
    assert said == [
        "imu.imu: measured data in counts of 0.0001 arcsec and 0.001 µg s, right-front-up. The sums of the counts are "
        "those of the readings, less than one count off.",
        "truth.avp: pitch, roll, yaw (counter-clockwise from north) [°], velocity east, north, up, latitude, longitude "
        "[°], height [m], time [s].",
        "gnss.avp: fixes of the antenna.",
        "Times are the run's own.",
    ]
    assert (tmp_path / "out" / "imu.imu").read_text() == (
        "% PSINS-format SIMU log file. (DO NOT MODIFY!)\n"
        "% 1st line of data: pitch0, roll0, yaw0 (deg), VE0, VN0, VU0 (m/s)\n"
        "% 2nd line: latitude0, longitude0 (deg), height0 (m), t0 (s), sampling interval (ms), g (m/s^2)\n"
        "% 3rd line: scale factors of the gyros (arcsec) and accelerometers (ug*s)\n"
        "% then g_x, g_y, g_z, a_x, a_y, a_z; x right, y front, z up\n"
        "\n"
        "-20.250000 10.500000 -130.750000 -4.000000 3.000000 -0.500000\n"
        "-33.50000000 179.75000000 81.750 0.25000000 500.00000000 9.806650\n"
        "0.000100 0.000100 0.000100 0.001 0.001 0.001\n"
        "\n"
        "-20 10 -30 -200 100 -300\n"
        "20 12 5 220 111 50\n"
        "8 -13 -12 70 -121 -120\n"
    )
    text = (tmp_path / "out" / "truth.avp").read_text().splitlines()
    assert text[:3] == [
        "% PSINS-format AVP/GPS log file. (DO NOT MODIFY!)",
        "% pitch(deg),roll(deg),yaw(deg),VE(m/s),VN(m/s),VU(m/s),lat(deg),lon(deg),height(m),time(s)",
        "",
    ]
    yaw = np.array([-130.75, 115.5, -10.25, 9.5])
    up = VELOCITY @ NED_ENU.T
    close(
        table(tmp_path / "out" / "truth.avp", None, 3),
        ANGLES[:, 1],
        ANGLES[:, 0],
        yaw,
        up,
        LATITUDE,
        LONGITUDE,
        HEIGHT,
        TIME,
    )
    fixes = tmp_path / "out" / "gnss.avp"
    assert fixes.read_text().splitlines()[1] == "% VE(m/s),VN(m/s),VU(m/s),lat(deg),lon(deg),height(m),time(s)"
    close(table(fixes, None, 3), FIX_VELOCITY @ NED_ENU.T, FIX, FIX_TIME)


def test_gnss_ins_sim(run: Path, tmp_path: Path) -> None:
    """Rows are the starts of intervals of half a second; ideal readings are two and three times the measured ones."""
    said = made(run, "gnss-ins-sim", tmp_path / "out")
    assert said == [
        "gyro-0.csv, accel-0.csv: measured data as mean rates over the interval that begins at time.csv.",
        "ref_pos.csv, ref_vel.csv (north-east-down), ref_att_euler.csv (yaw, pitch, roll): the truth at time.csv.",
        "gps-0.csv, gps_time.csv: fixes of gnss, of its antenna.",
        "Body axes forward-right-down, as its default frame. Times are the run's own.",
    ]
    rates = np.degrees(GYRO) * 2.0
    expected = {
        "time": ("time (sec)", TIME[:3]),
        "gyro-0": ("gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)", rates),
        "accel-0": ("accel_x (m/s^2),accel_y (m/s^2),accel_z (m/s^2)", 2.0 * ACCEL),
        "ref_gyro": ("ref_gyro_x (deg/s),ref_gyro_y (deg/s),ref_gyro_z (deg/s)", 2.0 * rates),
        "ref_accel": ("ref_accel_x (m/s^2),ref_accel_y (m/s^2),ref_accel_z (m/s^2)", 6.0 * ACCEL),
        "ref_pos": ("ref_pos_lat (deg),ref_pos_lon (deg),ref_pos_alt (m)",
                    np.column_stack([LATITUDE, LONGITUDE, HEIGHT])[:3]),
        "ref_vel": ("ref_vel_x (m/s),ref_vel_y (m/s),ref_vel_z (m/s)", VELOCITY[:3]),
        "ref_att_euler": ("ref_Yaw (deg),ref_Pitch (deg),ref_Roll (deg)", ANGLES[:3, ::-1]),
        "gps_time": ("gps_time (sec)", FIX_TIME),
        "gps-0": ("gps_lat (deg),gps_lon (deg),gps_alt (m),gps_vN (m/s),gps_vE (m/s),gps_vD (m/s)",
                  np.column_stack([FIX, FIX_VELOCITY])),
        "gps_visibility": ("gps_visibility", np.ones(2)),
    }  # fmt: skip
    assert {file.stem for file in (tmp_path / "out").glob("*.csv")} == set(expected)
    for name, (heads, values) in expected.items():
        file = tmp_path / "out" / f"{name}.csv"
        assert file.read_text().partition("\n")[0] == heads
        close(table(file), values)


def test_sbet(run: Path, tmp_path: Path) -> None:
    """The last columns are those of the interval that ends at the record; the first record has those of the next."""
    said = made(run, "sbet", tmp_path / "out.sbet")
    assert said == [
        "truth: latitude, longitude [rad], height above the ellipsoid, velocity north, east, down (wander angle 0), "
        "roll, pitch, heading [rad] of forward-right-down axes.",
        "Specific force and inertial rate are the measured data, means over the last interval.",
        "Times are seconds of the GPS week 1930; the run's time 0 is 86417.",
    ]
    rows = np.frombuffer((tmp_path / "out.sbet").read_bytes(), dtype="<f8").reshape(-1, 17)
    at = [0, 0, 1, 2]
    place = SECONDS + TIME, np.radians(LATITUDE), np.radians(LONGITUDE), HEIGHT, VELOCITY, np.radians(ANGLES)
    close(rows, *place, np.zeros(4), 2.0 * ACCEL[at], 2.0 * GYRO[at])


def test_rtklib(run: Path, tmp_path: Path) -> None:
    """GPST is 18 s ahead of UTC; fixes are single, with σ; a truth has none and counts as fixed."""
    said = made(run, "rtklib-pos", tmp_path / "out.pos", "gnss")
    assert said == [
        "gnss: latitude, longitude [°], height above the ellipsoid, σ north, east, up, velocity north, east, "
        "up; quality "
        "5 (single).",
        "Times are GPST as dates.",
    ]
    head = (
        "% program   : sinssim\n% inp file  : mine, {}\n"
        "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
        "%  GPST                      latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   "
        "sdu(m)  sdne(m)  "
        "sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)\n"
    )
    no = "0.0000   0.0000   0.0000   0.00    0.0"
    assert (tmp_path / "out.pos").read_text() == head.format("gnss") + (
        "2017/01/02 00:00:17.750  -33.260000000  179.880000000    83.5000   5   0   0.5000   0.2500   0.7500   "
        f"{no}   -6.50000    8.50000    1.25000\n"
        "2017/01/02 00:00:18.750  -32.760000000 -179.760000000    91.5000   5   0   1.5000   1.2500   1.7500   "
        f"{no}    8.50000  -15.50000    3.75000\n"
    )
    said = made(run, "rtklib-pos", tmp_path / "truth.pos")
    assert said[0].endswith("quality 1 (fix).")
    assert (tmp_path / "truth.pos").read_text().splitlines()[5] == (
        "2017/01/02 00:00:17.750  -33.250000000  179.875000000    82.5000   1   0   0.0000   0.0000   0.0000   "
        f"{no}   -6.00000    8.00000    1.50000"
    )


def test_nmea(run: Path, tmp_path: Path) -> None:
    """5, 10, 13 and 17 m/s; courses 306.8699°, 126.8699°, 67.3801° and 298.0725°; minutes of the angles."""
    said = made(run, "nmea", tmp_path / "out.nmea")
    assert said == [
        "truth: GGA and RMC and HDT, 4 instants.",
        f"Heights are above mean sea level, with the geoid's separation beside them. {GEOID}",
        "Times are UTC.",
    ]
    place = [
        "3330.0000000,S,17945.0000000,E", "3315.0000000,S,17952.5000000,E", "3307.5000000,S,17952.5000000,W",
        "3245.0000000,S,17945.0000000,W",
    ]  # fmt: skip
    moments = [("235959.250", "010117"), ("235959.750", "010117"), ("000000.250", "020117"), ("000000.750", "020117")]
    motion = ["9.7192,306.8699", "19.4384,126.8699", "25.2700,67.3801", "33.0454,298.0725"]
    heights = above_the_geoid([81.75, 82.5, -12.25, 90.5], [-33.5, -33.25, -33.125, -32.75], hand_run.LONGITUDE)
    headings = ["130.7500", "244.5000", "10.2500", "350.5000"]
    expected = ""
    for (clock, date), where, height, moved, heading in zip(moments, place, heights, motion, headings, strict=True):
        expected += nmea_sentence(f"GNGGA,{clock},{where},8,00,,{height[0]},M,{height[1]},M,,")
        expected += nmea_sentence(f"GNRMC,{clock},A,{where},{moved},{date},,,S,V")
        expected += nmea_sentence(f"GNHDT,{heading},T")
    assert (tmp_path / "out.nmea").read_bytes().decode() == expected
    made(run, "nmea", tmp_path / "gnss.nmea", "gnss")
    lines = (tmp_path / "gnss.nmea").read_text().splitlines()
    ((high, geoid),) = above_the_geoid([83.5], [-33.26], [179.88])
    assert lines[0][:-3] == f"$GNGGA,235959.750,3315.6000000,S,17952.8000000,E,1,00,,{high},M,{geoid},M,,"
    assert lines[1][:-3] == "$GNRMC,235959.750,A,3315.6000000,S,17952.8000000,E,20.8000,127.4054,010117,,,A,V"
    assert len(lines) == 4


def test_a_rate_leaves_out_samples(run: Path, tmp_path: Path) -> None:
    """Every third sample at 0.7 Hz: the first and the fourth; every second one at 1 Hz. Readings stay whole."""
    done = export(run, "gpx", tmp_path / "out.gpx", start=hand_run.START, rate_hz=0.7)
    assert done.sentences[0] == "The path of truth: 2 of 4 points; --rate sets how many a second."
    text = (tmp_path / "out.gpx").read_text()
    assert [date for date in DATES if f"<time>{date}</time>" in text.partition("<trk>")[2]] == [DATES[0], DATES[3]]
    done = export(run, "csv", tmp_path / "half", start=hand_run.START, rate_hz=1.0)
    close(table(tmp_path / "half" / "truth.csv")[:, :1], TIME[::2])
    assert len(table(tmp_path / "half" / "imu.csv")) == 3


def test_parquet(run: Path, tmp_path: Path) -> None:
    """Stored streams are copied; without a rule in the file of the solution its errors are not computed."""
    made(run, "parquet", tmp_path / "out")
    for file in (run / "streams").iterdir():
        assert (tmp_path / "out" / file.name).read_bytes() == file.read_bytes()
    assert len(list((tmp_path / "out").glob("*.parquet"))) == 6


def test_psins_refuses_uneven_intervals(run: Path, tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    other = hand_run.hand_run(tmp_path / "uneven")
    file = other / "streams" / "imu_measured.parquet"
    columns = dict(parquet.read_table(file).to_pydict())
    columns["time_s"] = [0.75, 1.5, 1.75]
    parquet.write_table(pa.table(columns), file)
    # intervals of 0.5, 0.75 and 0.25 s; their mean is 0.5 s
    with pytest.raises(InputError, match=r"the sampling interval varies by 0\.25 s; PSINS needs a constant one"):
        export(other, "psins", tmp_path / "out")
