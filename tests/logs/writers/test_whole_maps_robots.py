"""Every number and sentence of the exports to maps and robots of a run that was written by hand."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from tests.logs import hand_run
from tests.logs.formats.whole import attitude
from tests.logs.hand_run import ACCEL, ANGLES, FIX, FIX_SIGMA, FIX_VELOCITY, GYRO, HEIGHT, LATITUDE, LONGITUDE, VELOCITY
from tests.logs.writers.exported import DATES, GEOID, NED_ENU, above_the_geoid, close, made, table

HEIGHTS = f"Heights are above mean sea level, as maps take them. {GEOID}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hand_run.hand_run(tmp_path_factory.mktemp("runs") / "mine")


def test_kml(run: Path, tmp_path: Path) -> None:
    said = made(run, "kml", tmp_path / "out.kml")
    assert said == [
        "The path of truth: 4 points.",
        HEIGHTS,
        "Times are UTC.",
    ]
    names = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}
    document = ElementTree.parse(tmp_path / "out.kml").getroot()[0]
    assert document.findtext("k:name", "", names) == "mine: truth"
    assert document.findtext("k:description", "", names) == HEIGHTS
    places = ["179.750000000 -33.500000000", "179.875000000 -33.250000000", "-179.875000000 -33.125000000",
              "-179.750000000 -32.750000000"]  # fmt: skip
    heights = above_the_geoid(HEIGHT, LATITUDE, LONGITUDE)
    coordinates = [f"{where} {height}" for where, (height, _) in zip(places, heights, strict=True)]
    start, end, path = document.findall("k:Placemark", names)
    for mark, word, k in ((start, "start", 0), (end, "end", 3)):
        assert mark.findtext("k:name", "", names) == word
        assert mark.findtext("k:TimeStamp/k:when", "", names) == DATES[k]
        assert mark.findtext("k:Point/k:altitudeMode", "", names) == "absolute"
        assert mark.findtext("k:Point/k:coordinates", "", names) == coordinates[k].replace(" ", ",")
    assert path.findtext("k:name", "", names) == "mine: truth"
    assert [one.text for one in path.findall("gx:Track/k:when", names)] == DATES
    assert [one.text for one in path.findall("gx:Track/gx:coord", names)] == coordinates
    assert path.findtext("gx:Track/k:altitudeMode", "", names) == "absolute"


def test_gpx(run: Path, tmp_path: Path) -> None:
    said = made(run, "gpx", tmp_path / "out.gpx")
    assert said == [
        "The path of truth: 4 points.",
        HEIGHTS,
        "Times are UTC.",
    ]
    points = [("-33.500000000", "179.750000000"), ("-33.250000000", "179.875000000"),
              ("-33.125000000", "-179.875000000"), ("-32.750000000", "-179.750000000")]  # fmt: skip
    heights = above_the_geoid(HEIGHT, LATITUDE, LONGITUDE)
    assert (tmp_path / "out.gpx").read_text() == (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<gpx version="1.1" creator="sinssim" xmlns="http://www.topografix.com/GPX/1/1">\n'
        f"<metadata><name>mine: truth</name><desc>{HEIGHTS}</desc>"
        f"<time>{DATES[0]}</time></metadata>\n<trk><name>mine: truth</name><trkseg>\n"
        + "".join(
            f'<trkpt lat="{latitude}" lon="{longitude}"><ele>{height}</ele><time>{date}</time>'
            f"<geoidheight>{geoid}</geoidheight></trkpt>\n"
            for (latitude, longitude), (height, geoid), date in zip(points, heights, DATES, strict=True)
        )
        + "</trkseg></trk></gpx>\n"
    )


def test_geojson(run: Path, tmp_path: Path) -> None:
    said = made(run, "geojson", tmp_path / "out.geojson")
    assert said == [
        "The path of truth: 4 points.",
        "Heights are above the ellipsoid WGS-84, as RFC 7946 requires. Times are UTC, in coordTimes.",
    ]
    lines = [[[179.75, -33.5, 81.75], [179.875, -33.25, 82.5]], [[-179.875, -33.125, -12.25], [-179.75, -32.75, 90.5]]]
    assert json.loads((tmp_path / "out.geojson").read_text()) == {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "properties": {"name": "mine: truth", "coordTimes": DATES[2 * k : 2 * k + 2]},
                "geometry": {"type": "LineString", "coordinates": line},
            }
            for k, line in enumerate(lines)
        ],
    }


def local() -> tuple[Array, Array, Array]:
    """Position and velocity east, north, up of the first place, and the rotation of forward-left-up to these axes."""
    a, e2 = 6378137.0, 0.0066943799901413165
    phi, lam = np.radians(LATITUDE), np.radians(LONGITUDE)
    n = a / np.sqrt(1.0 - e2 * np.sin(phi) ** 2)
    x = (n + HEIGHT) * np.cos(phi)
    ecef = np.column_stack([x * np.cos(lam), x * np.sin(lam), (n * (1.0 - e2) + HEIGHT) * np.sin(phi)])
    # turn by longitude about z, then by −latitude − 90° about east: from north-east-down to Earth-fixed axes
    level = Rotation.from_euler("ZY", np.column_stack([LONGITUDE, -LATITUDE - 90.0]), degrees=True).as_matrix()
    to_first = NED_ENU @ level[0].T
    c_nb = Rotation.from_quat(attitude(ANGLES.tolist()), scalar_first=True).as_matrix()
    velocity = np.einsum("ij,njk,nk->ni", to_first, level, VELOCITY)
    turned = np.einsum("ij,njk,nkl,lm->nim", to_first, level, c_nb, np.diag([1.0, -1.0, -1.0]))
    return (ecef - ecef[0]) @ to_first.T, velocity, turned


LOCAL = (
    "Positions are east, north, up in the plane axes of the run's true start; attitudes from forward-left-up to these "
    "axes (REP 103)."
)
ORIGIN = "Origin: latitude -33.500000000 deg, longitude 179.750000000 deg, height 81.7500 m."
UNIX = 1483315199
"""Unix time of the date of the time 0: 17 167 days and 86 399 s."""


def same_turn(q: Array, turned: Array) -> None:
    """Quaternions x, y, z, w are the rotations."""
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), turned, atol=1e-12)


def test_tum(run: Path, tmp_path: Path) -> None:
    assert made(run, "tum", tmp_path / "out.tum") == ["truth: Unix time, position, quaternion.", LOCAL, ORIGIN]
    lines = (tmp_path / "out.tum").read_text().splitlines()
    assert lines[:2] == ["# timestamp tx ty tz qx qy qz qw", f"# {ORIGIN}"]
    words = [line.split() for line in lines[2:]]
    assert [row[0] for row in words] == [
        f"{UNIX}.250000000", f"{UNIX}.750000000", f"{UNIX + 1}.250000000", f"{UNIX + 1}.750000000",
    ]  # fmt: skip
    position, _, turned = local()
    rows = np.array([[float(word) for word in row[1:]] for row in words])
    np.testing.assert_allclose(rows[:, :3], position, atol=1e-7)
    same_turn(rows[:, 3:], turned)


def test_euroc(run: Path, tmp_path: Path) -> None:
    said = made(run, "euroc", tmp_path / "out")
    assert said == [
        "mav0/imu0/data.csv: measured data, mean rates over the interval that ends at the time stamp, axes "
        "forward-left-up.",
        "mav0/state_groundtruth_estimate0/data.csv: truth, with velocity; the biases are 0.",
        LOCAL,
        ORIGIN,
        "Stamps are nanoseconds of Unix time.",
    ]
    imu = tmp_path / "out" / "mav0" / "imu0" / "data.csv"
    assert imu.read_text().splitlines()[0] == (
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
        "a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
    )
    assert [line.split(",")[0] for line in imu.read_text().splitlines()[1:]] == [
        f"{UNIX}750000000", f"{UNIX + 1}250000000", f"{UNIX + 1}750000000",
    ]  # fmt: skip
    flu = np.array([1.0, -1.0, -1.0])
    close(table(imu)[:, 1:], 2.0 * GYRO * flu, 2.0 * ACCEL * flu)
    truth = tmp_path / "out" / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    assert [name.split()[0] for name in truth.read_text().splitlines()[0].split(",")] == (
        [
            "#timestamp",
            "p_RS_R_x",
            "p_RS_R_y",
            "p_RS_R_z",
            "q_RS_w",
            "q_RS_x",
            "q_RS_y",
            "q_RS_z",
            "v_RS_R_x",
            "v_RS_R_y",
            "v_RS_R_z",
            "b_w_RS_S_x",
            "b_w_RS_S_y",
            "b_w_RS_S_z",
            "b_a_RS_S_x",
            "b_a_RS_S_y",
            "b_a_RS_S_z",
        ]
    )
    assert truth.read_text().splitlines()[1].startswith(f"{UNIX}250000000,")
    position, velocity, turned = local()
    rows = table(truth)[:, 1:]
    np.testing.assert_allclose(rows[:, :3], position, atol=1e-7)
    same_turn(rows[:, [4, 5, 6, 3]], turned)
    np.testing.assert_allclose(rows[:, 7:10], velocity, atol=1e-11)
    np.testing.assert_array_equal(rows[:, 10:], np.zeros((4, 6)))


def test_mcap(run: Path, tmp_path: Path) -> None:
    """Every message as rosbags decodes it; the twist of Odometry is along its own axes, that of fixes east-north-up."""
    highlevel = pytest.importorskip("rosbags.highlevel")
    said = made(run, "mcap", tmp_path / "out.mcap")
    assert said == [
        "/imu, sensor_msgs/Imu: measured data, mean rates over the last interval, forward-left-up.",
        "/gnss/fix, sensor_msgs/NavSatFix, and /gnss/velocity, TwistStamped east-north-up: the antenna.",
        f"/truth, nav_msgs/Odometry. {LOCAL} {ORIGIN}",
        "Stamps are Unix time.",
    ]
    found: dict[str, list[object]] = {}
    with highlevel.AnyReader([tmp_path / "out.mcap"]) as reader:
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert stamp == message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            found.setdefault(connection.topic, []).append((stamp - UNIX * 10**9, message.header.frame_id, message))

    def xyz(v: object) -> list[float]:
        return [v.x, v.y, v.z]  # type: ignore[attr-defined]

    assert [(name, [(t, frame) for t, frame, _ in rows]) for name, rows in sorted(found.items())] == [  # type: ignore[misc]
        ("/gnss/fix", [(750_000_000, "gnss"), (1_750_000_000, "gnss")]),
        ("/gnss/velocity", [(750_000_000, "gnss"), (1_750_000_000, "gnss")]),
        ("/imu", [(k, "base_link") for k in (750_000_000, 1_250_000_000, 1_750_000_000)]),
        ("/truth", [(k, "map") for k in (250_000_000, 750_000_000, 1_250_000_000, 1_750_000_000)]),
    ]
    topics = "/imu", "/gnss/fix", "/gnss/velocity", "/truth"
    imu, fixes, speeds, poses = ([m for _, _, m in found[topic]] for topic in topics)  # type: ignore[misc]
    flu = np.array([1.0, -1.0, -1.0])
    close(
        np.array([xyz(m.angular_velocity) + xyz(m.linear_acceleration) for m in imu]),
        2.0 * GYRO * flu,
        2.0 * ACCEL * flu,
    )
    assert all(m.orientation_covariance.tolist() == [-1.0] + [0.0] * 8 for m in imu)
    close(np.array([[m.latitude, m.longitude, m.altitude] for m in fixes]), FIX)
    east_north_up = FIX_SIGMA[:, [1, 0, 2]] ** 2
    np.testing.assert_allclose(
        [m.position_covariance.reshape(3, 3) for m in fixes], [np.diag(row) for row in east_north_up], rtol=1e-14
    )
    assert [(m.status.status, m.status.service, m.position_covariance_type) for m in fixes] == [(0, 1, 2)] * 2
    close(np.array([xyz(m.twist.linear) for m in speeds]), FIX_VELOCITY @ NED_ENU.T)
    position, velocity, turned = local()
    np.testing.assert_allclose([xyz(m.pose.pose.position) for m in poses], position, atol=1e-7)
    same_turn(np.array([[*xyz(m.pose.pose.orientation), m.pose.pose.orientation.w] for m in poses]), turned)
    body = np.einsum("nji,nj->ni", turned, velocity)
    np.testing.assert_allclose([xyz(m.twist.twist.linear) for m in poses], body, atol=1e-11)
    assert [m.child_frame_id for m in poses] == ["base_link"] * 4
