"""Every column of the files of tracks and of solutions in tables, written by hand with all numbers different."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.logs.formats import csv_parquet_matlab, gpx_kml_geojson
from sinssim.logs.formats.rtklib import read_rtklib as read_pos
from tests.logs.formats.whole import only, whole

NAN = float("nan")
DEGREE = np.pi / 180.0

POS_HEAD = (
    "% GPST latitude(deg) longitude(deg) height(m) Q ns sdn sde sdu sdne sdeu sdun age ratio vn ve vu sdvn sdve sdvu"
)


@pytest.mark.parametrize("utc", [False, True])
def test_rtklib(tmp_path: Path, utc: bool) -> None:
    """Dates over the leap second at the end of 2016 in UTC; a σ of 0 is not known."""
    path = tmp_path / "x.pos"
    path.write_text(
        POS_HEAD.replace("GPST", "UTC" if utc else "GPST")
        + "\n2016/12/31 23:59:59.250 -33.5 151.25 81.75 2 9 0.5 0.25 0.75 -0.125 0.375 -0.625 1.0 3.5 1.5 -2.5 "
        "3.5 0.0625 "
        "0.1875 0.3125 7 8 9\n"
        "2017/01/01 00:00:01.500 -33.25 151.5 82.5 5 7 1.5 0.0 1.75 0.5 -0.25 0.875 2.0 4.5 4.5 5.5 -6.5 0.4375 "
        "0.5625 0 "
        "7 8 9\n"
    )
    first = 13509 * 86400 + 86399 + (17 if utc else 0)
    note = "dates in UTC" if utc else "dates or weeks in GPS time"
    fixes = only(read_pos(path), first, "utc" if utc else "gps", note)["gnss"]
    c = [[[0.25, -0.015625, 0.390625], [-0.015625, 0.0625, -0.140625], [0.390625, -0.140625, 0.5625]],
         [[2.25, 0.25, -0.765625], [0.25, 0.0, 0.0625], [-0.765625, 0.0625, 3.0625]]]  # fmt: skip
    whole(
        fixes,
        time=[0.25, 3.5 if utc else 2.5],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        position_sigma=[[0.5, 0.25, 0.75], [1.5, NAN, 1.75]],
        velocity_ned=[[1.5, -2.5, -3.5], [4.5, 5.5, 6.5]],
        velocity_sigma=[[0.0625, 0.1875, 0.3125], [0.4375, 0.5625, NAN]],
        quality=[2, 5],
        quality_words={2: "float", 5: "single"},
        covariance=c,
    )


def test_rtklib_earth_fixed_velocities(tmp_path: Path) -> None:
    """On the equator at 90° east: x is west, y up, z north."""
    path = tmp_path / "x.pos"
    path.write_text(
        "% GPST x-ecef(m) y-ecef(m) z-ecef(m) Q ns sdx sdy sdz sdxy sdyz sdzx age ratio vx vy vz sdvx sdvy sdvz\n"
        "2374 5.250 0.0 6378237.0 0.0 1 9 0.5 0.25 0.75 0.125 -0.375 0.625 1.0 3.5 1.5 -2.5 3.5 0.0625 0.1875 "
        "0.3125 0 0 0\n"
    )
    fixes = only(read_pos(path), 2374 * 604800 + 5, "gps", "dates or weeks in GPS time")["gnss"]
    # north z, east −x, down −y: north-east is −zx, east-down xy, north-down −yz
    c = [[0.5625, -0.390625, 0.140625], [-0.390625, 0.25, 0.015625], [0.140625, 0.015625, 0.0625]]
    whole(
        fixes,
        digits=1e-9,
        time=[0.25],
        latitude=[0.0],
        longitude_deg=[90.0],
        height=[100.0],
        datum="ellipsoid",
        position_sigma=[[0.75, 0.5, 0.25]],
        velocity_ned=[[3.5, -1.5, 2.5]],
        velocity_sigma=[[0.3125, 0.0625, 0.1875]],
        quality=[1],
        quality_words={1: "fixed"},
        covariance=[c],
    )


@pytest.mark.parametrize(("name", "start", "kind", "origin", "note"), [
    ("unix_s", 1767225600, "utc", 1767225600 - 315964800 + 18, "Unix time, the column unix_s"),
    ("gps_s", 1451260818, "gps", 1451260818, "GPS time, the column gps_s"),
    ("time_s", 0, "machine", None, "the column time_s, seconds from an unknown start"),
])  # fmt: skip
def test_columns_of_solutions(tmp_path: Path, name: str, start: int, kind: str, origin: int | None, note: str) -> None:
    """Every known column, quaternions scalar first, with a norm near 1."""
    q = Rotation.from_euler("ZYX", [130.75, -20.25, 10.5], degrees=True).as_quat(scalar_first=True) * 1.001
    names = [name, "longitude_deg", "latitude_rad", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps"]
    names += ["q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z", "sigma_n_m", "sigma_e_m", "sigma_d_m"]
    names += ["sigma_vn_mps", "sigma_ve_mps", "sigma_vd_mps", "comment"]
    names += ["dtheta_x_rad", "dtheta_y_deg", "dtheta_z_rad", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps"]
    row = "151.25\t-0.5\t81.75\t1.5\t-2.5\t3.5\t" + "\t".join(map(repr, q.tolist()))
    row += "\t0.5\t0.25\t0.75\t0.125\t0.375\t0.625\t9\t1e-3\t2.0\t-3e-3\t0.0625\t0.5\t-0.25"
    path = tmp_path / "x.csv"
    path.write_text("\t".join(names) + f"\n{start}.25\t{row}\n{start + 2}.75\t{row}\n")
    assert csv_parquet_matlab.recognises_csv(path, path.read_bytes())
    streams = only(csv_parquet_matlab.read_csv(path), origin, kind, note, notes=["Columns left out: comment."])
    whole(
        streams["imu"],
        digits=1e-7,
        time=[0.25, 2.75],
        gyro=[[1e-3, 2.0 * DEGREE, -3e-3]] * 2,
        accel=[[0.0625, 0.5, -0.25]] * 2,
        kind="increments",
    )
    whole(
        streams["solution"],
        digits=1e-7,
        time=[0.25, 2.75],
        latitude=[-0.5] * 2,
        longitude_deg=[151.25] * 2,
        height=[81.75] * 2,
        datum="ellipsoid",
        velocity_ned=[[1.5, -2.5, 3.5]] * 2,
        attitude_deg=[[10.5, -20.25, 130.75]] * 2,
        position_sigma=[[0.5, 0.25, 0.75]] * 2,
        velocity_sigma=[[0.125, 0.375, 0.625]] * 2,
    )


def test_columns_of_fixes_and_rates(tmp_path: Path) -> None:
    """Positions with σ but without an attitude are fixes; angles are roll, pitch, heading in any order."""
    path = tmp_path / "x.csv"
    fix = "time_s,latitude_deg,longitude_deg,height_m,sigma_n_m,sigma_e_m,sigma_d_m"
    rates = "gyro_x_radps,gyro_y_degps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2"
    row = "-33.5,151.25,81.75,0.5,0.25,0.75,0.01,2,-0.03,1.5,-2.5,-9.5"
    path.write_text(f"{fix},{rates}\n0.25,{row}\n0.75,{row}\n")
    streams = only(
        csv_parquet_matlab.read_csv(path), None, "machine", "the column time_s, seconds from an unknown start"
    )
    imu = {"gyro": [[0.01, 2.0 * DEGREE, -0.03]] * 2, "accel": [[1.5, -2.5, -9.5]] * 2}
    whole(streams["imu"], time=[0.25, 0.75], **imu)
    place = {"latitude_deg": [-33.5] * 2, "longitude_deg": [151.25] * 2, "height": [81.75] * 2, "datum": "ellipsoid"}
    whole(streams["gnss"], time=[0.25, 0.75], position_sigma=[[0.5, 0.25, 0.75]] * 2, **place)
    path.write_text(
        "time_s,latitude_deg,longitude_deg,height_m,heading_rad,roll_deg,pitch_deg\n0.25,-33.5,151.25,81.75,2.5,"
        "10.5,-20.25\n"
    )
    solution = only(
        csv_parquet_matlab.read_csv(path), None, "machine", "the column time_s, seconds from an unknown start"
    )["solution"]
    place = {key: value[:1] if isinstance(value, list) else value for key, value in place.items()}
    whole(solution, time=[0.25], attitude_deg=[[10.5, -20.25, np.degrees(2.5)]], **place)


def test_tracks_of_gpx_and_kml(tmp_path: Path) -> None:
    """Times of two zones, over the leap second at the end of 2016."""
    (tmp_path / "a.gpx").write_text(
        '<gpx xmlns="x"><trk><trkseg><trkpt lat="-33.5" '
        'lon="151.25"><ele>81.75</ele><time>2016-12-31T23:59:59.25Z</time>'
        '</trkpt><trkpt lat="-33.25" lon="151.5"><ele>82.5</ele><time>2017-01-01T05:30:01.5+05:30</time></trkpt>'
        '<trkpt lat="-33.125" lon="151.75"><time>2016-12-31T21:00:04-03</time></trkpt></trkseg></trk></gpx>'
    )
    origin = 13509 * 86400 + 86399 + 17
    place = {
        "time": [0.25, 3.5, 6.0],
        "latitude_deg": [-33.5, -33.25, -33.125],
        "longitude_deg": [151.25, 151.5, 151.75],
        "height": [81.75, 82.5, NAN],
        "datum": "mean sea level",
    }
    whole(only(gpx_kml_geojson.read_gpx(tmp_path / "a.gpx"), origin, "utc", "UTC of GPX")["gnss"], **place)
    np.testing.assert_array_equal(
        gpx_kml_geojson.read_path_gpx(tmp_path / "a.gpx"),
        [[151.25, -33.5, 81.75], [151.5, -33.25, 82.5], [151.75, -33.125, NAN]],
    )
    (tmp_path / "b.gpx").write_text('<gpx><rte><rtept lat="-33.5" lon="151.25"><ele>81.75</ele></rtept></rte></gpx>')
    np.testing.assert_array_equal(gpx_kml_geojson.read_path_gpx(tmp_path / "b.gpx"), [[151.25, -33.5, 81.75]])
    (tmp_path / "c.gpx").write_text("<gpx></gpx>")
    assert gpx_kml_geojson.read_path_gpx(tmp_path / "c.gpx") is None
    (tmp_path / "a.kml").write_text(
        '<kml xmlns="k" xmlns:gx="g"><gx:Track><when>2016-12-31T23:59:59.25Z</when><gx:coord>151.25 -33.5 '
        "81.75</gx:coord>"
        "</gx:Track><gx:Track><when>2017-01-01T05:30:01.5+05:30</when><when>2017-01-01T00:00:04</when>"
        "<gx:coord>151.5 -33.25 82.5</gx:coord><gx:coord>151.75 -33.125</gx:coord></gx:Track></kml>"
    )
    said = "Times without a time zone are taken as UTC."
    whole(
        only(gpx_kml_geojson.read_kml(tmp_path / "a.kml"), origin, "utc", "UTC of KML", notes=[said])["gnss"], **place
    )


def test_track_tables(tmp_path: Path) -> None:
    """Milliseconds, feet, a yaw in radians, velocities and a column that is not read."""
    path = tmp_path / "a.csv"
    path.write_text(
        "t_ms\tLatitude (rad)\tlng\tAltitude [ft]\troll_deg\tpitch_deg\tYaw [rad]\tvn_mps\tve_mps\tvd_mps\tnote\n"
        "250\t-0.5\t151.25\t1000\t10.5\t-20.25\t2.5\t1.5\t-2.5\t3.5\t7\n"
        "1750\t-0.25\t151.5\t\t-5.5\t15.75\t4.5\t4.5\t5.5\t-6.5\t8\n"
    )
    streams = only(
        csv_parquet_matlab.read_track(path),
        None,
        "machine",
        "ms of the column t_ms",
        notes=["Columns that are not read: note."],
    )
    whole(
        streams["track"],
        time=[0.25, 1.75],
        latitude=[-0.5, -0.25],
        longitude_deg=[151.25, 151.5],
        height=[304.8, NAN],
        velocity_ned=[[1.5, -2.5, 3.5], [4.5, 5.5, -6.5]],
        attitude_deg=[[10.5, -20.25, np.degrees(2.5)], [-5.5, 15.75, np.degrees(4.5)]],
    )
    path.write_text(
        "time,lat,lon,height_m,qw,qx,qy,qz\n2016-12-31T23:59:59.25,-33.5,151.25,81.75,0.5,-0.5,0.5,0.5\n"
        "2017-01-01T00:00:01.5,-33.25,151.5,82.5,0.1,0.3,-0.3,0.9\n"
    )
    said = "Times without a time zone are taken as UTC."
    streams = only(
        csv_parquet_matlab.read_track(path), 13509 * 86400 + 86399 + 17, "utc", "UTC of the column time", notes=[said]
    )
    whole(
        streams["track"],
        time=[0.25, 3.5],
        latitude_deg=[-33.5, -33.25],
        longitude_deg=[151.25, 151.5],
        height=[81.75, 82.5],
        datum="ellipsoid",
        q_nb=[[0.5, -0.5, 0.5, 0.5], [0.1, 0.3, -0.3, 0.9]],
    )


@pytest.mark.parametrize(
    ("unit", "size"),
    [("m", 1.0), ("meters", 1.0), ("metre", 1.0), ("km", 1000.0), ("ft", 0.3048), ("feet", 0.3048), ("foot", 0.3048)],
)
def test_units_of_heights_and_angles_of_tracks(tmp_path: Path, unit: str, size: float) -> None:
    path = tmp_path / "a.csv"
    for angle, turn in (("deg", DEGREE), ("degrees", DEGREE), ("rad", 1.0), ("radians", 1.0), ("°", DEGREE)):
        path.write_text(
            f"time_s,Latitude [{angle}],Longitude ({angle}),Height [{unit}]\n0.5,0.25,-1.5,7.5\n", encoding="utf-8"
        )
        track = csv_parquet_matlab.read_track(path).solutions["track"]
        np.testing.assert_allclose([track.latitude[0], track.longitude[0]], [0.25 * turn, -1.5 * turn], rtol=1e-14)
        assert track.height[0] == pytest.approx(7.5 * size, rel=1e-14)
