"""Readers of tracks: GPX, KML, tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import csv_parquet_matlab, format_of, gpx_kml_geojson
from sinssim.logs.recorded_streams import Streams
from sinssim.rotation.quaternions import quaternion_from_euler

GPX = """<?xml version="1.0" encoding="UTF-8"?>
<gpx version="1.1" creator="phone" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>
<trkpt lat="51.5" lon="-0.1"><ele>12.5</ele><time>2024-05-01T14:00:00+02:00</time></trkpt>
<trkpt lat="51.6" lon="-0.2"><time>2024-05-01T12:00:01.5Z</time></trkpt>
</trkseg><trkseg>
<trkpt lat="51.7" lon="-0.3"><ele>14</ele><time>2024-05-01T12:00:03Z</time></trkpt>
</trkseg></trk></gpx>
"""
KML = """<?xml version="1.0"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Placemark><gx:Track>
<when>2024-05-01T12:00:00Z</when><when>2024-05-01T12:00:02Z</when>
<gx:coord>-0.1 51.5 12.5</gx:coord><gx:coord>-0.2 51.6 13</gx:coord>
</gx:Track></Placemark></kml>
"""
LINE = """<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><LineString><coordinates>
-0.1,51.5,10 -0.2,51.6
</coordinates></LineString></Placemark></kml>
"""
CSV = """time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,heading_deg
0,51.5,-0.1,10,1,2,30
1,51.6,-0.2,,1,2,31
"""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refusal(read: Callable[[Path], Streams], path: Path) -> str:
    with pytest.raises(InputError) as error:
        read(path)
    return str(error.value)


def test_gpx(tmp_path: Path) -> None:
    streams = gpx_kml_geojson.read_gpx(written(tmp_path, "a.gpx", GPX))
    fixes = streams.fixes["gnss"]
    assert fixes.time.tolist() == [0.0, 1.5, 3.0]
    assert streams.clock.origin_gps_s == 2312 * 604_800 + 302_418
    assert np.degrees(fixes.latitude) == pytest.approx([51.5, 51.6, 51.7])
    assert np.degrees(fixes.longitude) == pytest.approx([-0.1, -0.2, -0.3])
    assert fixes.height[[0, 2]].tolist() == [12.5, 14.0]
    assert np.isnan(fixes.height[1])
    assert streams.notes == ("2 segments of 2 + 1 points are joined.",)
    assert fixes.datum == "mean sea level"


def test_gpx_without_zone_is_utc(tmp_path: Path) -> None:
    streams = gpx_kml_geojson.read_gpx(written(tmp_path, "a.gpx", GPX.replace("12:00:03Z", "12:00:03")))
    assert "taken as UTC" in streams.notes[-1]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("<time>2024-05-01T12:00:01.5Z</time>", ""), "point 2 of 3: no <time>"),
        (('lat="51.6"', 'lat="north"'), "point 2: <trkpt"),
        (("2024-05-01T12:00:03Z", "noon"), "point 3: 'noon' is not a time"),
        (("</gpx>", ""), "line 8: no element found"),
        (('<?xml version="1.0" encoding="UTF-8"?>', '<!DOCTYPE gpx [<!ENTITY a "b">]>'), "declares XML entities"),
        (("trkpt", "rtept"), "has no track"),
    ],
)
def test_gpx_refusals(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    message = refusal(gpx_kml_geojson.read_gpx, written(tmp_path, "a.gpx", GPX.replace(*change)))
    assert words in message
    assert "a.gpx" in message


def test_kml_track(tmp_path: Path) -> None:
    fixes = gpx_kml_geojson.read_kml(written(tmp_path, "a.kml", KML)).fixes["gnss"]
    assert fixes.time.tolist() == [0.0, 2.0]
    assert np.degrees(fixes.latitude) == pytest.approx([51.5, 51.6])
    assert fixes.height.tolist() == [12.5, 13.0]


def test_kml_line_has_no_times(tmp_path: Path) -> None:
    path = written(tmp_path, "a.kml", LINE)
    message = refusal(gpx_kml_geojson.read_kml, path)
    assert "2 points without times" in message
    assert "track.speed_mps" in message
    points = gpx_kml_geojson.read_path_kml(path)
    assert points is not None
    assert points[0].tolist() == [-0.1, 51.5, 10.0]
    assert np.isnan(points[1, 2])


def test_kml_with_unequal_numbers(tmp_path: Path) -> None:
    text = KML.replace("<when>2024-05-01T12:00:00Z</when>", "")
    assert "1 <when> and 2 <gx:coord>" in refusal(gpx_kml_geojson.read_kml, written(tmp_path, "a.kml", text))


def test_table_with_angles(tmp_path: Path) -> None:
    track = csv_parquet_matlab.read_track(written(tmp_path, "a.csv", CSV)).solutions["track"]
    assert track.time.tolist() == [0.0, 1.0]
    assert np.degrees(track.latitude) == pytest.approx([51.5, 51.6])
    assert np.isnan(track.height[1])
    assert track.q_nb is not None
    assert track.q_nb == pytest.approx(quaternion_from_euler(*np.radians([[1, 1], [2, 2], [30, 31]])))


@pytest.mark.parametrize(
    "names",
    [
        "time_s,latitude_deg,longitude_deg,altitude_ft,roll_deg,pitch_deg,yaw_deg",
        "Time [s],Latitude [deg],Longitude [deg],Altitude [ft],Roll [deg],Pitch [deg],Yaw [deg]",
        "timestamp,lat,lon,elevation_feet,roll (deg),pitch (deg),heading (deg)",
        "t_s,lat,lon,alt_ft,roll,pitch,yaw",
    ],
)
def test_heights_in_feet_and_angles_in_degrees(tmp_path: Path, names: str) -> None:
    """1000 ft are 304.8 m; angles without a unit are degrees if one of them exceeds a turn in radians."""
    path = written(tmp_path, "a.csv", f"{names}\n0,51.5,-0.1,1000,1,2,30\n1,51.5,-0.1,1001,1,2,31\n")
    assert csv_parquet_matlab.recognises_track(path, path.read_bytes())
    streams = csv_parquet_matlab.read_track(path)
    track = streams.solutions["track"]
    assert track.height == pytest.approx([304.8, 305.1048], abs=1e-9)
    assert track.q_nb == pytest.approx(quaternion_from_euler(*np.radians([[1, 1], [2, 2], [30, 31]])))
    assert streams.notes == ()


def test_no_column_is_lost_silently(tmp_path: Path) -> None:
    """What is not read is named; small angles without a unit may be degrees or radians."""
    names = "time_s,lat,lon,altitude_furlongs,battery_v,roll,pitch,yaw,time"
    text = f"{names}\n0,51.5,-0.1,3,12,0.1,0.2,0.3,0\n1,51.5,-0.1,3,12,0.1,0.2,0.3,1\n"
    streams = csv_parquet_matlab.read_track(written(tmp_path, "a.csv", text))
    assert streams.solutions["track"].q_nb is None
    assert "The column roll has no unit, and its numbers may be degrees or radians" in streams.notes[0]
    assert streams.notes[-1] == "Columns that are not read: altitude_furlongs, battery_v, roll, pitch, yaw, time."


def test_stamps_since_1970_in_milliseconds(tmp_path: Path) -> None:
    text = "timestamp,lat,lon,alt\n1700000000000,51.5,-0.1,3\n1700000000500,51.5,-0.1,3\n"
    track = csv_parquet_matlab.read_track(written(tmp_path, "a.csv", text)).solutions["track"]
    assert np.diff(track.time) == pytest.approx([0.5], abs=1e-6)


def test_table_with_times_and_semicolons(tmp_path: Path) -> None:
    text = "# my logger\ntime;lat;lon;alt\n2024-05-01T12:00:00Z;51.5;-0.1;3\n2024-05-01T12:00:00.5Z;51.6;-0.1;4\n"
    streams = csv_parquet_matlab.read_track(written(tmp_path, "a.csv", text))
    assert streams.solutions["track"].time.tolist() == [0.0, 0.5]
    assert streams.clock.kind == "utc"


def test_parquet_as_a_run_writes_it(tmp_path: Path) -> None:
    columns = {"time_s": [0.0, 1.0], "latitude_rad": [0.8, 0.81], "longitude_rad": [0.1, 0.1], "height_m": [1.0, 2.0]}
    columns |= {f"q_nb_{c}": [float(c == "w")] * 2 for c in "wxyz"}
    pq.write_table(pa.table(columns), tmp_path / "truth.parquet")
    track = csv_parquet_matlab.read_track(tmp_path / "truth.parquet").solutions["track"]
    assert track.latitude.tolist() == [0.8, 0.81]
    assert track.q_nb is not None
    assert track.q_nb[:, 0].tolist() == [1.0, 1.0]
    assert track.datum == "ellipsoid"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("latitude_deg", "breite"), "no column latitude_deg"),
        (("time_s", "when"), "no column time_s"),
        (("pitch_deg", "nod"), "has roll_deg and heading_deg but not pitch_deg"),
        (("51.6", "51,6"), "line 3: it has 8 fields; 7 separated by ','"),
        (("51.6", "x"), "line 3): the column 'latitude_deg' holds 'x', not a number."),
        (("roll_deg,pitch_deg,heading_deg", "qw,a,b"), "has qw but not q_nb_x and q_nb_y and q_nb_z"),
        (("roll_deg", "lat"), "latitude_deg and lat"),
    ],
)
def test_table_refusals(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    assert words in refusal(csv_parquet_matlab.read_track, written(tmp_path, "a.csv", CSV.replace(*change)))


def test_each_recognises_its_own(tmp_path: Path) -> None:
    files = {
        "gpx": written(tmp_path, "1", "﻿" + GPX),
        "kml": written(tmp_path, "2", KML),
        "track-csv": written(tmp_path, "3", CSV.replace("height_m", "altitude_m")),
    }
    for own, path in files.items():
        head = path.read_bytes()[:4096]
        assert [name for name in files if format_of(name).recognises(path, head)] == [own]
