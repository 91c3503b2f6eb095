"""Columns of text: names with units, dates, rows that count, triads of other files; all outputs worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.column_description import LogDescription
from sinssim.logs.column_names import TIME_UNITS, epoch_unit, unit_in_name
from sinssim.logs.gps_time import date_seconds
from sinssim.logs.imu_samples import joined, read_samples, slow, with_gravity, with_readings, without_gravity
from sinssim.logs.log_settings import LogImu
from sinssim.logs.numeric_columns import CutRows, cut_rows, read_numbers, read_rows, selected_text, text_rows
from sinssim.logs.recorded_streams import Clock, even_stamps

NAN = float("nan")


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("t_ms", "ms"), ("time [s]", "s"), ("TimeUS", "us"), ("TimeMS", "ms"), ("stamp(nsec)", "ns"), ("time_µs", "us"),
        ("time μs", "us"), ("gps_s", "s"), ("t.sec", "s"), ("Timestamps", None), ("times", None), ("speed_m_s", None),
        ("gyro_deg_s", None), ("rate [deg/s]", None), ("v (m/s)", None), ("a_mg_s", None), ("counts_per_s", None),
        ("gyro_mrad_s", None), ("v_km_s", None), ("x [kg s]", None), ("m", None), (3, None), (None, None),
    ],
)  # fmt: skip
def test_units_of_time_at_the_ends_of_names(name: str | int | None, unit: str | None) -> None:
    assert unit_in_name(name) == unit


def test_units_of_time() -> None:
    assert TIME_UNITS == {"s": 1.0, "ms": 0.001, "100us": 0.0001, "us": 0.000001, "ns": 0.000000001}
    assert LogDescription(time="t_ms").stated_time_unit == "ms"
    assert LogDescription(time="t", time_unit="us").stated_time_unit == "us"
    assert LogDescription(time="t").stated_time_unit is None


@pytest.mark.parametrize(
    ("first", "last", "interval", "unit"),
    [
        (1.7e9, 1.7e9 + 60.0, 0.01, "s"), (1.7e12, 1.7e12 + 6e4, 10.0, "ms"), (1.7e15, 1.7e15 + 6e7, 1e4, "us"),
        (1.7e18, 1.7e18 + 6e10, 1e7, "ns"), (0.99e9, 1.7e9, 0.01, None), (1.7e9, 2.3e9, 0.01, None),
        (1.7e9, 1.7e9 + 60.0, 0.9e-5, None), (1.7e9, 1.7e9 + 60.0, 1.1e-5, "s"), (1.7e9, 1.7e9 + 6e4, 999.0, "s"),
        (1.7e9, 1.7e9 + 6e4, 1001.0, None), (1e3, 2e3, 0.01, None),
    ],
)  # fmt: skip
def test_stamps_that_are_dates(first: float, last: float, interval: float, unit: str | None) -> None:
    """Of the years 2001 to 2039, 10 µs to 1000 s apart; both ends count."""
    assert epoch_unit(np.array([first, 0.5 * (first + last), last]), interval) == unit


def test_dates_of_zones() -> None:
    """08:30:30.25 three and a half hours behind UTC is 12:00:30.25 UTC; the first known one gives the origin."""
    texts = [None, '"2025-07-08 08:30:30,25 -03:30"', "2025/7/8 12:01:00Z", "what", "2025-07-09T01:30:00+0130"]
    time, clock = date_seconds(texts)
    # 16 620 days from 1980-01-06 to 2025-07-08
    assert clock == Clock("utc", 16620 * 86400 + 43230 + 18, "dates in UTC")
    np.testing.assert_allclose(time, [NAN, 0.25, 30.0, NAN, 43170.0])
    time, clock = date_seconds(["2025-07-08 08:30:30.25", "2025-07-08 08:30:31.5"])
    assert clock == Clock("machine", 16620 * 86400 + 30630, "dates without a time scale")
    np.testing.assert_allclose(time, [0.25, 1.5])
    time, clock = date_seconds(["23:59:58.5", None, "00:00:01.25", "23:59:59", "0:00:03"])
    assert clock is None
    np.testing.assert_allclose(time, [86398.5, NAN, 86401.25, 172799.0, 172803.0])
    time, clock = date_seconds([None, "x"])
    assert (np.isnan(time).all(), clock) == (True, None)


def test_samples_of_a_table(tmp_path: Path) -> None:
    """Copies and rows without the readings of a sensor are left out; the first interval is as long as the second."""
    rows = [
        "250,1.5,-2.5,3.5,4.5,5.5,-6.5,20.5",
        "250,1.5,-2.5,3.5,4.5,5.5,-6.5,20.5",
        "300,,,,,,,21.5",
        "350,7.5,8.5,-9.5,10.5,-11.5,12.5,22.5",
        "500,0.5,0.25,0.125,1.25,2.25,3.25,23.5",
    ]
    (tmp_path / "x.csv").write_text("t,a,b,c,d,e,f,warm\n" + "\n".join(rows) + "\n")
    layout = LogDescription.model_validate({
        "kind": "rates", "time": "t", "time_unit": "ms", "axes": ["right", "down", "forward"],
        "gyro": {"columns": ["a", "b", "c"], "unit": "mrad/s", "signs": [1, 1, -1]},
        "accel": {"columns": ["d", "e", "f"], "unit": "ft/s^2"},
    })  # fmt: skip
    found = read_samples(tmp_path / "x.csv", layout, quantities=["warm"])
    assert (found.kind, found.time_unit_stated, found.clock) == ("rates", True, None)
    np.testing.assert_allclose(found.time, [0.15, 0.25, 0.35, 0.5], rtol=1e-14)
    gyro = np.array([[-3.5, 1.5, -2.5], [9.5, 7.5, 8.5], [-0.125, 0.5, 0.25]]) * 1e-3
    accel = np.array([[-6.5, 4.5, 5.5], [12.5, 10.5, -11.5], [3.25, 1.25, 2.25]]) * 0.3048
    np.testing.assert_allclose(found.triads["gyro"], gyro, rtol=1e-14)
    np.testing.assert_allclose(found.triads["accel"], accel, rtol=1e-14)
    assert found.quantities["warm"].tolist() == [20.5, 22.5, 23.5]
    assert found.notes == (
        "x.csv: 1 copies of the preceding row are skipped.",
        "x.csv: 1 rows lack the readings of a sensor of the IMU and are skipped.",
    )
    (tmp_path / "x.csv").write_text((tmp_path / "x.csv").read_text().replace("500,", "340,"))
    with pytest.raises(InputError, match=r"x\.csv, sample 4 \(line 6\): the time 0\.34 s is not later than 0\.35 s"):
        read_samples(tmp_path / "x.csv", layout)


@pytest.mark.parametrize(
    ("names", "delimiter"), [("#t_s,x,y,z", ","), ("%  t_s, x,y , z", ","), ("# t_s x y z", "whitespace")]
)
def test_names_in_a_line_that_begins_with_a_sign(names: str, delimiter: str, tmp_path: Path) -> None:
    """Spreadsheets and numpy write names so; a comment above them is skipped."""
    path = tmp_path / "log.csv"
    rows = ["0.0,1,2,9.8", "0.1,1,2,9.8", "0.2,1,2,9.8"]
    text = "\n".join(["# made by a logger", names, *rows])
    path.write_text(text if delimiter == "," else text.replace(",", " "))
    layout = LogImu(file="log.csv", time="t_s", delimiter=delimiter, skip_lines=1)
    (first, found), *others = read_rows(path, layout)
    assert (first, found, len(others)) == (2, ["t_s", "x", "y", "z"], 3)


def test_lost_samples_are_zeros_of_all_sensors() -> None:
    """One row of eleven is all zeros, which noise never gives; of an ideal sensor in free fall more are."""
    gyro, accel = np.ones((11, 3)), np.ones((11, 3))
    gyro[4] = accel[4] = 0.0
    gyro[6] = 0.0
    assert np.flatnonzero(~with_readings(gyro, accel)).tolist() == [4]
    assert with_readings(gyro).all()
    gyro[8] = accel[8] = 0.0
    assert with_readings(gyro, accel).all()
    gyro[1], accel[2, :2] = NAN, NAN
    assert np.flatnonzero(~with_readings(gyro, accel)).tolist() == [1]


def test_slow_samples_are_told() -> None:
    assert slow(np.array([0.0, 1.0, 2.0, 9.0])) is None
    said = slow(np.array([0.0, 2.5, 5.0, 7.0]))
    assert said is not None
    assert said.startswith("The samples are 2.5 s apart, which is usual only for averages.")


def test_rows_by_their_texts(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text('rig 7\n"kind",id, v\ngyro,0,1\ngyro,1,2\naccel,0,3\ngyro,0 ,4\n', encoding="utf-8")
    layout = LogDescription.model_validate({"skip_lines": 1, "time": "kind", "rows": {"kind": "gyro", "id": "0"}})
    assert list(read_rows(path, layout)) == [
        (2, ["kind", "id", "v"]), (3, ["gyro", "0", "1"]), (6, ["gyro", "0", "4"]),
    ]  # fmt: skip
    assert selected_text(path, layout) == b"gyro,0,1\ngyro,0,4\n"
    numbered = {"columns": [3, 3, 3], "unit": "rad"}
    layout = LogDescription.model_validate({"skip_lines": 2, "time": 2, "gyro": numbered, "rows": {"1": "accel"}})
    assert list(read_rows(path, layout)) == [(5, ["accel", "0", "3"])]
    for rows, said in (({"0": "x"}, "'0' is no number of a column"), ({"a": "x"}, "'a' is no number of a column")):
        with pytest.raises(InputError, match=said):
            list(read_rows(path, layout.model_copy(update={"rows": rows})))
    with pytest.raises(InputError, match=r"x\.csv has no row with 1 = mag"):
        selected_text(path, layout.model_copy(update={"rows": {"1": "mag"}}))


def unit(folder: Path, **keys: object) -> LogImu:
    return LogImu.model_validate({
        "file": str(folder / "gyro.csv"), "time": "t", "time_unit": "s", "kind": "rates",
        "gyro": {"columns": ["a", "b", "c"], "unit": "rad/s"},
        "accel": {"columns": ["a", "b", "c"], "unit": "g", "file": str(folder / "accel.csv")}, **keys,
    })  # fmt: skip


def test_a_triad_of_another_file(tmp_path: Path) -> None:
    """Its dates are 1 s later than those of the main file; the first and the last gyro reading are outside."""
    gyro = [(0.25, 1.0), (1.25, 2.0), (1.75, 3.0), (2.25, 4.0), (3.5, 5.0)]
    rows = "".join(f"2025-07-08 12:00:0{t},{v},{2 * v},{3 * v}\n" for t, v in gyro)
    (tmp_path / "gyro.csv").write_text("t,a,b,c\n" + rows)
    accel = [(1.0, 0.5), (1.5, 1.5), (2.5, -0.5)]
    rows = "".join(f"2025-07-08 12:00:0{t},{v},{2 * v},{3 * v}\n" for t, v in accel)
    (tmp_path / "accel.csv").write_text("t,a,b,c\n" + rows)
    section = unit(tmp_path, max_gap_s=1.0)
    samples = read_samples(tmp_path / "gyro.csv", section, ["gyro"])
    time, triads, notes = joined(section, samples, "accel")
    np.testing.assert_allclose(time, [1.25, 1.75, 2.25])
    np.testing.assert_allclose(triads["gyro"], np.outer([2.0, 3.0, 4.0], [1.0, 2.0, 3.0]))
    np.testing.assert_allclose(triads["accel"], np.outer([1.0, 1.0, 0.0], [1.0, 2.0, 3.0]) * 9.80665)
    assert notes == ("The data of accel.csv are interpolated linearly to the times of the gyros.",)
    with pytest.raises(InputError, match=r"accel\.csv: no samples for 1 s from 1\.5 s on, more than max_gap_s = 0\.9"):
        joined(unit(tmp_path, max_gap_s=0.9), samples, "accel")
    with pytest.raises(InputError, match="do not overlap"):
        joined(section, read_samples(tmp_path / "gyro.csv", section, ["gyro"]).__class__(
            "rates", np.array([6.0, 7.0, 8.0]), {"gyro": np.ones((2, 3))}, clock=samples.clock), "accel")  # fmt: skip
    (tmp_path / "gravity.csv").write_text((tmp_path / "accel.csv").read_text())
    gravity = {"columns": ["a", "b", "c"], "unit": "g", "file": str(tmp_path / "gravity.csv")}
    section = unit(tmp_path, gravity=gravity, max_gap_s=1.0)
    at, both = np.array([1.25, 2.0, 2.25]), {"gyro": np.ones((3, 3)), "accel": np.full((3, 3), 5.0)}
    time, triads, notes = with_gravity(section, at, both, Clock("machine", samples.clock.origin_gps_s))  # type: ignore[arg-type, union-attr]
    np.testing.assert_allclose(time, at)
    np.testing.assert_allclose(triads["accel"] - 5.0, np.outer([1.0, 0.5, 0.0], [1.0, 2.0, 3.0]) * 9.80665, atol=1e-12)
    assert notes == ("The specific force is the sum of the accelerations and the gravity of gravity.csv (a, b, c).",)


def test_rows_of_a_triad_in_one_file(tmp_path: Path) -> None:
    rows = ["g,0.25,1,2,3", "a,0.25,0.5,1.0,1.5", "g,0.5,4,5,6", "a,0.75,1.0,1.5,2.0"]
    (tmp_path / "gyro.csv").write_text("kind,t,a,b,c\n" + "\n".join(rows) + "\n")
    accel = {"columns": ["a", "b", "c"], "unit": "g", "rows": {"kind": "a"}}
    section = unit(tmp_path, accel=accel, rows={"kind": "g"}, max_gap_s=1.0)
    samples = read_samples(tmp_path / "gyro.csv", section, ["gyro"])
    time, triads, notes = joined(section, samples, "accel")
    np.testing.assert_allclose(time, [0.25, 0.5])
    np.testing.assert_allclose(triads["accel"], np.array([[0.5, 1.0, 1.5], [0.75, 1.25, 1.75]]) * 9.80665)
    assert notes == ("The data of gyro.csv with kind = a are interpolated linearly to the times of the gyros.",)


@pytest.mark.parametrize(("calm", "expected"), [(0.4, True), (0.6, False)])
def test_accelerations_without_gravity(calm: float, expected: bool) -> None:
    """Twenty blocks of a second: the four that change least have 0.4 or 0.6 of the usual mean; 0.5 is the limit."""
    values = np.zeros((20, 10, 3))
    values[:, :, 2] = 3.0
    values[:, 1::2, 0] = 0.5
    values[[2, 5, 11, 17], :, :] = 0.0
    values[[2, 5, 11, 17], :, 1] = 3.0 * calm
    flat = values.reshape(-1, 3)
    assert without_gravity(flat, 0.1) == expected
    assert not without_gravity(flat[:99], 0.1)


def test_rows_that_were_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text("names of two lines\n\n5,6\n# said\n1,2,3\n4,5,6\n7,8,9\n7,8")
    found = cut_rows(path, ",", 1)
    assert found == CutRows(
        path.stat().st_size - 3, 3, 8,
        (
            "x.txt, line 3: the first row was cut short (2 of 3 fields) and is left out.",
            "x.txt, line 8: the last row was cut short (2 of 3 fields) and is left out.",
        ),
    )  # fmt: skip
    rows = [["1", "2", "3"], ["4", "5", "6"], ["7", "8", "9"]]
    assert [fields for _, fields in text_rows(path, ",", 1, found)] == rows
    assert read_numbers(path, (3,), [], delimiter=",", skip=1).tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    path.write_text("1 2 3\n4 5 6\n7 8 9\n")
    assert cut_rows(path, "whitespace", 0) == CutRows(path.stat().st_size)
    assert cut_rows(path, "whitespace", 0, 4) == CutRows(path.stat().st_size)


def test_even_instants_of_stamps_that_are_even() -> None:
    """One of 101 samples is missing: order and count stay, and the interval is 0.25 s."""
    number = np.delete(np.arange(101.0), 20)
    time, interval = even_stamps(7.5 + 0.25 * number)
    assert interval == pytest.approx(0.25, rel=1e-9)
    np.testing.assert_allclose(time, 7.5 + 0.25 * number, atol=1e-9)


def test_even_instants_lie_in_the_middle_of_stamps_that_jitter() -> None:
    """Every other stamp is 20 ms late, the others 20 ms early, beginning with a late one."""
    true = 7.5 + 0.25 * np.arange(200.0)
    time, interval = even_stamps(true + np.tile([0.02, -0.02], 100))
    assert interval == pytest.approx(0.25, abs=4e-6)  # of 200 instants the jitter tilts the line by 6 · 0.02/200² s
    np.testing.assert_allclose(time, true, atol=4e-4)
