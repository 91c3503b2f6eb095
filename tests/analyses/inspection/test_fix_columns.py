"""Fixes in text: the whole description of columns, by names and by numbers, with the units written down here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.inspection import file_layouts
from sinssim.analyses.inspection.file_layouts import _fixes_beside, fix_words
from sinssim.analyses.inspection.fix_columns import FixLayout, guess_fixes
from sinssim.analyses.inspection.inertial_columns import Layout
from sinssim.analyses.inspection.text_columns import TextTable
from sinssim.data import Array

_COUNT = 60
_TIME = 400.0 + 0.5 * np.arange(_COUNT)
_NORTH = 40.0 * np.sin(0.2 * (_TIME - 400.0))  # m
_EAST = 55.0 * np.cos(0.13 * (_TIME - 400.0))
_HEIGHT = 300.0 + 9.0 * np.sin(0.3 * (_TIME - 400.0))
_R = 6.371e6
_LATITUDE = 48.1 + np.degrees(_NORTH / _R)
_LONGITUDE = 11.5 + np.degrees(_EAST / (_R * np.cos(np.radians(48.1))))
_V_NORTH = 8.0 * np.cos(0.2 * (_TIME - 400.0))
_V_EAST = -7.15 * np.sin(0.13 * (_TIME - 400.0))
_V_UP = 2.7 * np.cos(0.3 * (_TIME - 400.0))
_SPEED, _COURSE = np.hypot(_V_NORTH, _V_EAST), np.degrees(np.arctan2(_V_EAST, _V_NORTH)) % 360.0


def _table(names: str | None, columns: Sequence[Array | float]) -> TextTable:
    values = np.column_stack([np.broadcast_to(column, (_COUNT,)) for column in columns]).astype(float)
    return TextTable(Path("gnss.csv"), ",", 0, None if names is None else tuple(names.split(",")), values)


def _guess(names: str | None, *columns: Array | float, near: Any = None) -> FixLayout:
    found = guess_fixes(_table(names, columns), near)
    assert found is not None
    return found


def _one(column: int, unit: str) -> dict[str, Any]:
    return {"column": column, "unit": unit}


def test_all_roles_by_names() -> None:
    """Each column has its role, whatever its place; σ and quality too."""
    table = _table(
        "fix_type,alt,vd,ve,vn,lon,lat,sd_u,sd_e,sd_n,s_acc,time_s",
        [3.0, _HEIGHT, -_V_UP, _V_EAST, _V_NORTH, _LONGITUDE, _LATITUDE, 0.7, 0.5, 0.4, 0.06, _TIME],
    )
    found = guess_fixes(table)
    assert found == FixLayout(
        11,
        "s",
        "gps",
        {
            "quality": 0,
            "latitude": _one(6, "deg"),
            "longitude": _one(5, "deg"),
            "height": _one(1, "m"),
            "velocity": {"columns": [4, 3, 2], "unit": "m/s", "axes": "north-east-down"},
            "position_sigma": {"columns": [9, 8, 7], "unit": "m"},
            "velocity_sigma": {"columns": [10, 10, 10], "unit": "m/s"},
        },
        False,
    )
    assert fix_words(table, found) == (
        "time time_s [s]; quality fix_type; latitude lat [deg]; longitude lon [deg]; height alt [m]; velocity vn, ve, "
        "vd [m/s, north-east-down]; position σ sd_n, sd_e, sd_u [m]; velocity σ s_acc, s_acc, s_acc [m/s]"
    )
    assert found.description(table) == {
        "time": "time_s",
        "quality": "fix_type",
        "latitude": {"column": "lat", "unit": "deg"},
        "longitude": {"column": "lon", "unit": "deg"},
        "height": {"column": "alt", "unit": "m"},
        "velocity": {"columns": ["vn", "ve", "vd"], "unit": "m/s", "axes": "north-east-down"},
        "position_sigma": {"columns": ["sd_n", "sd_e", "sd_u"], "unit": "m"},
        "velocity_sigma": {"columns": ["s_acc", "s_acc", "s_acc"], "unit": "m/s"},
    }


def test_numbers_of_columns_and_keys_of_the_file() -> None:
    unix = _TIME + 1_700_000_000.0
    table = replace(_table("sod,lat,lon,h,hacc,vacc", [unix, _LATITUDE, _LONGITUDE, _HEIGHT, 2.5, 4.0]), names=None)
    table = replace(table, delimiter=";", skip_lines=2, comment=("sod", "lat", "lon", "h", "hacc", "vacc"))
    found = guess_fixes(table)
    assert found is not None
    assert found.description(table) == {
        "time": 1,
        "time_unit": "s",
        "delimiter": ";",
        "skip_lines": 2,
        "clock": "unix",
        "latitude": {"column": 2, "unit": "deg"},
        "longitude": {"column": 3, "unit": "deg"},
        "height": {"column": 4, "unit": "m"},
        "position_sigma": {"columns": [5, 5, 6], "unit": "m"},
    }
    assert fix_words(table, replace(found, held=True)).endswith(
        "position σ 5, 5, 6 [m]; rows repeat a fix until there is a new one"
    )


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [
        ("spd", 3.6, "km/h"), ("spd", 3600.0 / 1852.0, "kt"), ("spd", 100.0, "cm/s"), ("spd", 1000.0, "mm/s"),
        ("spd", 1.0 / 0.3048, "ft/s"), ("spd", 1.0, "m/s"), ("speed [kph]", 1.0, "km/h"), ("speed_knots", 3.6, "kt"),
    ],
)  # fmt: skip
def test_the_unit_of_a_speed(name: str, factor: float, unit: str) -> None:
    """The positions give it, unless its name does."""
    found = _guess(f"t_s,lat,lon,alt,{name},course", _TIME, _LATITUDE, _LONGITUDE, _HEIGHT, factor * _SPEED, _COURSE)
    assert found.quantities["speed"] == _one(4, unit)
    assert found.quantities["course"] == _one(5, "deg")


def test_the_unit_of_a_course() -> None:
    for course, unit in ((np.radians(_COURSE), "rad"), (np.minimum(_COURSE, 6.2), "rad"), (_COURSE * 0.02, "deg")):
        found = _guess("t_s,lat,lon,alt,spd,heading", _TIME, _LATITUDE, _LONGITUDE, _HEIGHT, _SPEED, course)
        assert found.quantities["course"] == _one(5, unit)


@pytest.mark.parametrize(
    ("names", "scale", "unit"),
    [
        ("t_s,lat,lon,alt", 1.0, "deg"), ("t_s,lat,lon,alt", np.pi / 180.0, "rad"),
        ("t_s,lat,lon,alt", 1e7, "1e-7 deg"),
        ("t_s,lat [rad],lon [rad],alt", 0.01, "rad"), ("t_s,lat [deg],lon [deg],alt", 0.01, "deg"),
    ],
)  # fmt: skip
def test_the_unit_of_angles(names: str, scale: float, unit: str) -> None:
    found = _guess(names, _TIME, scale * _LATITUDE, scale * _LONGITUDE, _HEIGHT)
    assert (found.quantities["latitude"], found.quantities["longitude"]) == (_one(1, unit), _one(2, unit))


def test_angles_near_latitude_0() -> None:
    """A way of 0.01 is 64 km in rad and 1.1 km in degrees; one of 0.1 in rad would be 637 km."""
    small = 0.001 * np.linspace(1.0, 11.0, _COUNT)
    assert _guess("t_s,lat,lon,alt", _TIME, small, 0.4 + small, _HEIGHT).quantities["latitude"]["unit"] == "rad"
    large = 0.01 * np.linspace(1.0, 11.0, _COUNT)
    assert _guess("t_s,lat,lon,alt", _TIME, large, 0.4 + large, _HEIGHT).quantities["latitude"]["unit"] == "deg"


@pytest.mark.parametrize(
    ("name", "scale", "unit", "sigma"),
    [
        ("height", 1.0, "m", "m"), ("height", 1000.0, "mm", "mm"), ("alt [ft]", 3.28, "ft", "m"),
        ("height (cm)", 100.0, "cm", "m"),
    ],
)  # fmt: skip
def test_the_unit_of_heights_and_of_their_sigma(name: str, scale: float, unit: str, sigma: str) -> None:
    found = _guess(f"t_s,lat,lon,{name},hAcc", _TIME, _LATITUDE, _LONGITUDE, scale * _HEIGHT, 7.0)
    assert found.quantities["height"] == _one(3, unit)
    assert found.quantities["position_sigma"] == {"columns": [4, 4, 4], "unit": sigma}


def test_heights_of_the_receiver_count() -> None:
    """Of a barometer, of the geoid and above the mean sea level there are others."""
    columns = [_TIME, 0.9 * _HEIGHT, _LATITUDE, _LONGITUDE, 46.0, _HEIGHT - 46.0, _HEIGHT]
    found = _guess("t_s,baro_alt,lat,lon,geoid_height,alt_msl,height_ellipsoid", *columns)
    assert found.quantities["height"] == _one(6, "m")
    found = _guess("t_s,alt,lat,lon,altitude_gps,geoid_height,v_acc", *columns[:4], _HEIGHT, 46.0, 3.0)
    assert found.quantities["height"] == _one(4, "m")


@pytest.mark.parametrize(("third", "axes"), [(-_V_UP, "north-east-down"), (_V_UP, "north-east-up")], ids=["down", "up"])
def test_velocities_without_names(third: Array, axes: str) -> None:
    """Columns that agree with the differences of the positions; longitude before latitude is seen by its size."""
    found = _guess(None, _TIME, _LATITUDE, _LONGITUDE, _HEIGHT, 3.6 * _V_NORTH, 3.6 * _V_EAST, 3.6 * third)
    assert found.quantities == {
        "latitude": _one(1, "deg"),
        "longitude": _one(2, "deg"),
        "height": _one(3, "m"),
        "velocity": {"columns": [4, 5, 6], "unit": "km/h", "axes": axes},
    }
    swapped = _guess(None, _V_EAST, _V_NORTH, _V_UP, 100.0 + _LONGITUDE, _LATITUDE, _HEIGHT, _TIME)
    assert swapped.time == 6
    assert swapped.quantities["latitude"] == _one(4, "deg")
    assert swapped.quantities["longitude"] == _one(3, "deg")
    assert swapped.quantities["velocity"] == {"columns": [0, 1, 2], "unit": "m/s", "axes": "east-north-up"}


@pytest.mark.parametrize(("course", "unit"), [(_COURSE, "deg"), (np.radians(_COURSE), "rad")])
def test_speed_and_course_without_names(course: Array, unit: str) -> None:
    """They agree with the differences of the positions; a height and a constant beside them do not."""
    place = [_TIME, _LATITUDE, _LONGITUDE, _HEIGHT]
    found = _guess(None, *place, _HEIGHT - 290.0, _SPEED * 3600.0 / 1852.0, course, 7.0)
    assert (found.quantities["speed"], found.quantities["course"]) == (_one(5, "kt"), _one(6, unit))
    other = _guess(None, *place, _HEIGHT - 290.0, _SPEED, course[::-1], 7.0)
    assert not {"speed", "course", "velocity"} & other.quantities.keys()


def test_north_and_up_by_names() -> None:
    columns = [_TIME, _LATITUDE, _LONGITUDE, _HEIGHT, 100.0 * _V_UP, 100.0 * _V_EAST, 100.0 * _V_NORTH, 0.0]
    found = _guess("t_s,lat,lon,alt,vel_up,vel_east,vel_north,sAcc", *columns)
    assert found.quantities["velocity"] == {"columns": [6, 5, 4], "unit": "cm/s", "axes": "north-east-up"}
    assert "velocity_sigma" not in found.quantities  # all 0


def test_the_time_that_overlaps_with_the_unit() -> None:
    """Two clocks in a file: that of the unit's times is taken, in its unit."""
    columns = [_TIME + 230_000.0, 1e3 * (_TIME - 350.0), _LATITUDE, _LONGITUDE, _HEIGHT]
    names = "tow_s,millis,lat,lon,alt"
    assert (_guess(names, *columns).time, _guess(names, *columns).time_unit) == (0, "s")
    found = _guess(names, *columns, near=("millis", "ms", 45.0, 85.0))
    assert (found.time, found.time_unit, found.clock) == (1, "ms", "gps")


def test_rows_that_hold_a_fix() -> None:
    """Unnamed rows at 20 Hz repeat each fix ten times, and the velocities are those of the fixes that are new."""
    time = 400.0 + 0.05 * np.arange(600)
    each = np.column_stack([_LATITUDE, _LONGITUDE, _HEIGHT, _V_NORTH, _V_EAST, -_V_UP])
    table = TextTable(Path("log.csv"), ",", 0, None, np.column_stack([time, np.repeat(each, 10, axis=0)]))
    found = guess_fixes(table)
    assert found is not None
    assert found.held
    assert found.quantities["velocity"] == {"columns": [4, 5, 6], "unit": "m/s", "axes": "north-east-down"}
    assert found.description(table)["held"] is True
    named = replace(table, names=("t_s", "lat", "lon", "alt", "vn", "ve", "vd"))
    found = guess_fixes(named)
    assert found is not None
    assert found.held  # 0.05 s is faster than receivers


def test_what_is_no_fix() -> None:
    assert guess_fixes(_table("t_s,a,b,c", [_TIME, _LATITUDE * 7.0, _V_NORTH, _HEIGHT])) is None
    few = _LATITUDE.copy()
    few[2:] = np.nan
    assert guess_fixes(_table("t_s,lat,lon,alt", [_TIME, few, _LONGITUDE, _HEIGHT])) is None
    assert guess_fixes(_table("a,lat,lon,alt", [3.0, _LATITUDE, _LONGITUDE, _HEIGHT])) is None


def test_the_clock_of_the_unit_beside_fixes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its column, unit, first and last time, s; dates are seconds. The fixes of its own file have its time."""
    layout = Layout("rates", 1, "ms", (2, 3, 4), (5, 6, 7), "rad/s", "m/s²", True)
    values = np.array([[0.5, 4000.0], [1.5, 9000.0]])
    unit = TextTable(Path("log.csv"), ",", 0, ("a", "millis"), values)
    dated = replace(unit, dates={1: "2024-05-01 10:00:00"})
    fixes = FixLayout(0, "s", "gps", {}, held=False)
    asked: list[Any] = []
    monkeypatch.setattr(file_layouts, "guess_fixes", lambda table, near: asked.append(near) or fixes)
    assert _fixes_beside((unit, layout), [unit]) == [(unit, replace(fixes, time=1, time_unit="ms"))]
    assert _fixes_beside((dated, layout), [unit]) == [(unit, fixes)]
    assert _fixes_beside(None, [unit]) == [(unit, fixes)]
    assert asked == [("millis", "ms", 4.0, 9.0), ("millis", "ms", 4000.0, 9000.0), None]
