"""Columns that a scenario describes: units, signs, orders, constants, clocks, and which rows are fixes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.column_names import UNITS_OF
from sinssim.logs.log_files import fix_stream, inertial_stream, other_stream, solution_stream
from sinssim.logs.log_settings import LogGnss, LogImu, LogOther, LogReference
from sinssim.logs.recorded_streams import Clock
from tests.logs.formats.whole import whole

NAN = float("nan")
OWN = Clock("machine", None, "times in a column, without a date")


def write(folder: Path, text: str) -> str:
    (folder / "x.csv").write_text(text)
    return str(folder / "x.csv")


@pytest.mark.parametrize(
    ("axes", "columns", "sigma"),
    [
        ("north-east-down", "1.5,-2.5,3.5", "100,200,300"),
        ("north-east-up", "1.5,-2.5,-3.5", "100,200,300"),
        ("east-north-up", "-2.5,1.5,-3.5", "200,100,300"),
    ],
)
def test_fixes_in_every_order_of_components(tmp_path: Path, axes: str, columns: str, sigma: str) -> None:
    """Units of their own for every quantity; velocities in km/h, σ in mm and cm/s; the height is a constant."""
    kmh = ",".join(repr(float(x) * 3.6) for x in columns.split(","))
    file = write(
        tmp_path,
        f"t_ms,lon,lat,q,a,b,c,d,e,f\n1500,2.5,-2010,4,{kmh},{sigma}\n2750,2.25,-2013,,{kmh},{sigma}\n",
    )
    section = LogGnss.model_validate({
        "file": file, "time": "t_ms", "latitude": {"column": "lat", "unit": "'"},
        "longitude": {"column": "lon", "unit": "rad"}, "height": {"value": 250.0, "unit": "ft"},
        "velocity": {"columns": ["a", "b", "c"], "unit": "km/h", "axes": axes},
        "position_sigma": {"columns": ["d", "e", "f"], "unit": "mm", "axes": axes},
        "velocity_sigma": {"values": [float(x) for x in sigma.split(",")], "unit": "cm/s", "axes": axes},
        "quality": "q",
    })  # fmt: skip
    stream, clock, notes = fix_stream(section)
    assert (clock, notes) == (OWN, ())
    whole(
        stream,
        time=[1.5, 2.75],
        latitude_deg=[-33.5, -33.55],
        longitude=[2.5, 2.25],
        height=[76.2, 76.2],
        position_sigma=[[0.1, 0.2, 0.3]] * 2,
        velocity_ned=[[1.5, -2.5, 3.5]] * 2,
        velocity_sigma=[[1.0, 2.0, 3.0]] * 2,
        quality=[4, -1],
    )


def test_units_by_their_definitions() -> None:
    turn = 2.0 * np.pi
    expected = {
        "angle": {"rad": turn, "mrad": 1000.0 * turn, "deg": 360.0, "°": 360.0, "arcmin": 21600.0, "'": 21600.0,
                  "arcsec": 1296000.0, '"': 1296000.0, "1e-7 deg": 3.6e9},
        "length": {"m": 1852.0, "km": 1.852, "nmi": 1.0, "NM": 1.0, "ft": 1852.0 / 0.3048, "mm": 1852e3,
                   "cm": 185200.0},
        "speed": {"m/s": 0.3048, "km/h": 1.09728, "kt": 1.09728 / 1.852, "nmi/h": 1.09728 / 1.852,
                  "NM/h": 1.09728 / 1.852, "m/h": 1097.28, "ft/s": 1.0, "mm/s": 304.8, "cm/s": 30.48},
    }  # fmt: skip
    one = {"angle": turn, "length": 1852.0, "speed": 0.3048}
    for dimension, units in expected.items():
        assert set(UNITS_OF[dimension]) == set(units)
        for unit, number in units.items():
            assert number * UNITS_OF[dimension][unit] == pytest.approx(one[dimension], rel=1e-12), unit


def test_rows_that_are_fixes(tmp_path: Path) -> None:
    """Not those without a place, at zero before there is one, or written twice; a velocity alone is a fix, too."""
    rows = [
        "1,0,0,0,1,90", "2,30,40,50,2,90", "2,30,40,50,2,90", "3,,,,3,0", "4,,,,,", "5,31,41,51,0,", "6,31,41,51,4,270",
    ]  # fmt: skip
    file = write(tmp_path, "t,lat,lon,h,v,c\n" + "\n".join(rows) + "\n")
    keys = {
        "file": file, "time": "t", "latitude": {"column": "lat", "unit": "deg"},
        "longitude": {"column": "lon", "unit": "deg"},
        "height": {"column": "h", "unit": "m"},
    }  # fmt: skip
    moving = {"speed": {"column": "v", "unit": "m/s"}, "course": {"column": "c", "unit": "deg"}}
    stream, _, _ = fix_stream(LogGnss.model_validate({**keys, **moving}))
    whole(
        stream,
        digits=1e-12,
        time=[2.0, 3.0, 5.0, 6.0],
        latitude_deg=[30.0, NAN, 31.0, 31.0],
        longitude_deg=[40.0, NAN, 41.0, 41.0],
        height=[50.0, NAN, 51.0, 51.0],
        velocity_ned=[
            [2.0 * np.cos(np.pi / 2), 2.0, NAN], [3.0, 0.0, NAN], [0.0, 0.0, NAN],
            [4.0 * np.cos(1.5 * np.pi), -4.0, NAN],
        ],
    )  # fmt: skip
    held, _, _ = fix_stream(LogGnss.model_validate({**keys, "held": True}))
    assert held.time.tolist() == [2.0, 5.0]
    file = write(tmp_path, "t,lat,lon,h\n1,0,0,0\n2,0,0,1\n")  # all at zero: that is their place
    assert len(fix_stream(LogGnss.model_validate(keys))[0]) == 2
    write(tmp_path, "t,lat,lon,h\n3,30,40,1\n2,31,41,1\n")
    with pytest.raises(InputError, match=r"sample 1 \(line 3\): the time 2 s is not later than 3 s"):
        fix_stream(LogGnss.model_validate(keys))
    write(tmp_path, "t,lat,lon,h\n3,,,1\n4,,,2\n")
    with pytest.raises(InputError, match="no row contains a position"):
        fix_stream(LogGnss.model_validate(keys))


@pytest.mark.parametrize("quaternion", [True, False])
def test_a_reference_in_columns(tmp_path: Path, quaternion: bool) -> None:
    """The attitude as a quaternion of norm 2, or as angles in units of their own; the row at zero is left out."""
    q = np.array([0.5, -0.1, 0.7, 0.5]) / np.linalg.norm([0.5, -0.1, 0.7, 0.5])
    rows = [
        "0.5,0,0,0,1,0,0,0,0,0,0",
        "1.25,-33.5,151.25,81.75," + ",".join(repr(2.0 * x) for x in q.tolist()) + ",0.25,-900,5.5",
    ]
    file = write(tmp_path, "t,lat,lon,h,qw,qx,qy,qz,r,p,y\n" + "\n".join(rows) + "\n")
    attitude: dict[str, object] = {"quaternion": ["qw", "qx", "qy", "qz"]}
    if not quaternion:
        attitude = {
            "roll": {"column": "r", "unit": "rad"}, "pitch": {"column": "p", "unit": "arcmin"},
            "heading": {"column": "y", "unit": "rad"},
        }  # fmt: skip
    section = LogReference.model_validate({
        "file": file, "time": "t", "latitude": {"column": "lat", "unit": "deg"},
        "longitude": {"column": "lon", "unit": "deg"}, "height": {"column": "h", "unit": "m"}, **attitude,
        "position_sigma": {"values": [0.5, 0.25, 0.75], "unit": "m"},
        "velocity_sigma": {"values": [0.125, 0.375, 0.625], "unit": "m/s"},
        "attitude_sigma": {"values": [60.0, -120.0, 180.0], "unit": "arcmin"},
    })  # fmt: skip
    stream, clock, _ = solution_stream(section)
    assert clock == OWN
    given = {"q_nb": [q]} if quaternion else {"attitude_deg": [[np.degrees(0.25), -15.0, np.degrees(5.5)]]}
    whole(
        stream,
        time=[1.25],
        latitude_deg=[-33.5],
        longitude_deg=[151.25],
        height=[81.75],
        position_sigma=[[0.5, 0.25, 0.75]],
        velocity_sigma=[[0.125, 0.375, 0.625]],
        attitude_sigma_deg=[[1.0, 2.0, 3.0]],
        **given,
    )


def test_a_heading_alone_is_level(tmp_path: Path) -> None:
    file = write(tmp_path, "t,y\n1.25,200\n2.5,10\n")
    section = LogReference.model_validate({"file": file, "time": "t", "heading": {"column": "y", "unit": "deg"}})
    stream, _, _ = solution_stream(section)
    whole(
        stream,
        time=[1.25, 2.5],
        latitude=[NAN, NAN],
        longitude=[NAN, NAN],
        height=[NAN, NAN],
        attitude_deg=[[0.0, 0.0, 200.0], [0.0, 0.0, 10.0]],
    )


@pytest.mark.parametrize(
    ("clock", "times", "expected"),
    [
        (
            None,
            ("2026-01-01 00:00:10.25", "2026-01-01 00:00:10.5"),
            Clock("gps", 1451260810, "dates without a time scale"),
        ),
        (
            "gps",
            ("2026-01-01 00:00:10.25", "2026-01-01 00:00:10.5"),
            Clock("gps", 1451260810, "dates without a time scale"),
        ),
        (
            "utc",
            ("2026-01-01 00:00:10.25", "2026-01-01 00:00:10.5"),
            Clock("utc", 1451260828, "dates without a time scale"),
        ),
        (None, ("2026-01-01T00:00:10.25Z", "2026-01-01T00:00:10.5Z"), Clock("utc", 1451260828, "dates in UTC")),
        ("unix", ("1767225610.25", "1767225611.75"), Clock("utc", 1451260828, "Unix time")),
        (None, ("1767225610.25", "1767225611.75"), OWN),
    ],
)
def test_clocks_of_columns(tmp_path: Path, clock: str | None, times: tuple[str, str], expected: Clock) -> None:
    """2026-01-01 is 16 797 days after 1980-01-06, and UTC is then 18 s behind GPS time."""
    assert 16797 * 86400 + 10 == 1451260810
    file = write(tmp_path, f"when,lat,lon,h\n{times[0]},30,40,50\n{times[1]},31,41,51\n")
    keys = {
        "file": file, "time": "when", "latitude": {"column": "lat", "unit": "deg"},
        "longitude": {"column": "lon", "unit": "deg"}, "height": {"column": "h", "unit": "m"},
    }  # fmt: skip
    stream, found, _ = fix_stream(LogGnss.model_validate({**keys, **({} if clock is None else {"clock": clock})}))
    assert found == expected
    first = 1767225610.0 if expected == OWN else 0.0
    np.testing.assert_allclose(
        stream.time, [first + 0.25, first + (1.75 if times[1].endswith("1.75") else 0.5)], rtol=0, atol=1e-6
    )


def test_another_sensor(tmp_path: Path) -> None:
    file = write(tmp_path, "t_ms;alt;s\n1500;1000;20\n2750;2000;30\n")
    section = LogOther.model_validate({
        "file": file, "name": "baro", "kind": "baro-height", "time": "t_ms", "delimiter": ";",
        "reading": {"column": "alt", "unit": "ft"}, "sigma": {"column": "s", "unit": "cm"},
    })  # fmt: skip
    stream, clock, _ = other_stream(section)
    assert clock == OWN
    whole(stream, name="baro", kind="baro-height", time=[1.5, 2.75], value=[[304.8], [609.6]], sigma=[[0.2], [0.3]])
    for kind, unit, size in (
        ("heading", "arcmin", np.pi / 10800.0),
        ("speed", "kt", 1852.0 / 3600.0),
        ("airspeed", "ft/s", 0.3048),
    ):
        keys = {"kind": kind, "reading": {"column": "alt", "unit": unit}, "sigma": {"value": 3.0, "unit": unit}}
        stream, _, _ = other_stream(section.model_validate({**section.model_dump(exclude_unset=True), **keys}))
        np.testing.assert_allclose(stream.value, [[1000.0 * size], [2000.0 * size]], rtol=1e-12)
        assert stream.sigma is not None
        np.testing.assert_allclose(stream.sigma, [[3.0 * size]] * 2, rtol=1e-12)


def test_an_inertial_unit_of_a_format_and_in_columns(tmp_path: Path) -> None:
    """Of CHC's axes right, forward, up; of a file whose columns are given as left, backward, up, with signs."""
    rows = [f"{0.25 * k},1.5,-2.5,3.5,4.5,5.5,-6.5" for k in range(3)]
    file = write(tmp_path, "t,a,b,c,d,e,f\n" + "\n".join(rows) + "\n")
    section = LogImu.model_validate({
        "file": file, "time": "t", "time_unit": "s", "kind": "rates", "axes": ["left", "backward", "up"],
        "gyro": {"columns": ["a", "b", "c"], "unit": "mrad/s", "signs": [1, -1, 1]},
        "accel": {"columns": ["d", "e", "f"], "unit": "ft/s^2"},
    })  # fmt: skip
    stream, clock, _ = inertial_stream(section)
    assert clock == OWN
    whole(
        stream,
        time=[0.0, 0.25, 0.5],
        gyro=np.array([[-2.5, -1.5, -3.5]] * 3) * 1e-3,
        accel=np.array([[-5.5, -4.5, 6.5]] * 3) * 0.3048,
    )
    path = tmp_path / "imu.txt"
    path.write_text("100.25 1e-3 2e-3 -3e-3 0.5 -0.25 -4.5\n100.75 4e-3 5e-3 6e-3 0.75 0.125 -4.75\n")
    for axes, gyro, accel in (
        (None, [1e-3, 2e-3, -3e-3], [0.5, -0.25, -4.5]),
        (["right", "down", "forward"], [-3e-3, 1e-3, 2e-3], [-4.5, 0.5, -0.25]),
    ):
        keys = {"file": str(path), "format": "kf-gins-imu"} | ({} if axes is None else {"axes": axes})
        stream, _, _ = inertial_stream(LogImu.model_validate(keys))
        assert stream.axes == (tuple(axes) if axes else ("forward", "right", "down"))
        assert stream.kind == "increments"
        np.testing.assert_allclose([stream.gyro[0], stream.accel[0]], [gyro, accel])
