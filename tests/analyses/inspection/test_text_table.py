"""Text files as they are written: every number in its place, and what their description says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.inertial_columns import Layout, joined, relative
from sinssim.analyses.inspection.inspected_files import _words
from sinssim.analyses.inspection.text_columns import TextTable, read_table
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import Clock
from sinssim.units import DEG, G0


def _read(path: Path, text: str) -> TextTable:
    path.write_text(text, encoding="utf-8")
    return read_table(path)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_numbers_names_and_lines(tmp_path: Path, delimiter: str) -> None:
    """Two lines of another kind, the names, and three rows with an empty field, a word and a blank."""
    lines = ["made by", "a logger", "t_s,a b,c", "1.5,-2,7e-1", "2.5,,8", " 3.5,null, 9"]
    lines += [f"{k}.5,0,1" for k in range(4, 14)]
    found = _read(tmp_path / "log.txt", "\n".join(lines).replace(",", delimiter) + "\n")
    assert (found.delimiter, found.skip_lines, found.names, found.decimal) == (delimiter, 2, ("t_s", "a b", "c"), ".")
    np.testing.assert_array_equal(found.values[:3], [[1.5, -2.0, 0.7], [2.5, np.nan, 8.0], [3.5, np.nan, 9.0]])
    assert found.values.shape == (13, 3)
    expected = {"delimiter": delimiter, "skip_lines": 2}
    assert found.layout() == {key: value for key, value in expected.items() if value != ","}
    assert [found.label(k) for k in range(3)] == ["t_s", "a b", "c"]


@pytest.mark.parametrize("delimiter", [",", ";", " "])
def test_rows_of_another_width(tmp_path: Path, delimiter: str) -> None:
    """Lines 6, 9 and 15 lack a field or have one too many; an empty line is no row, and a cut last row is another."""
    rows = [f"{k},2,3" for k in range(20)]
    rows[3], rows[6], rows[12], rows[15], rows[19] = "3,2", "6,2,3,4", "# restart", "", "19,2"
    found = _read(tmp_path / "log.txt", "\n".join(["a line", "t,x,y", *rows]).replace(",", delimiter) + "\n")
    assert found.uneven == (6, 9, 15)
    assert found.values[:, 0].tolist() == [0, 1, 2, 4, 5, 7, 8, 9, 10, 11, 13, 14, 16, 17, 18]
    assert found.notes == ("log.txt, line 22: the last row was cut short (2 of 3 fields) and is left out.",)
    rows = [f"{k},2,3" for k in range(20)]
    assert _read(tmp_path / "log.txt", "\n".join(rows).replace(",", delimiter) + "\n").uneven == ()


def test_no_names_blanks_and_a_decimal_comma(tmp_path: Path) -> None:
    found = _read(tmp_path / "a.txt", "1 2   3\n4\t5 6\n7 8 9.5\n")
    assert (found.delimiter, found.skip_lines, found.names, found.label(2)) == ("whitespace", 0, None, 3)
    np.testing.assert_array_equal(found.values, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.5]])
    found = _read(tmp_path / "b.txt", "t;x\n1,25;-3,5\n2,5;4e1\n3,75;1e31\n")
    assert found.layout() == {"delimiter": ";", "decimal": ","}
    np.testing.assert_array_equal(found.values, [[1.25, -3.5], [2.5, 40.0], [3.75, np.nan]])  # 1e31 is no measurement


def test_comments_and_units_below(tmp_path: Path) -> None:
    found = _read(tmp_path / "a.csv", "# t, x, y\n1,2,3\n4,5,6\n")
    assert (found.names, found.comment, found.skip_lines) == (("t", "x", "y"), None, 0)
    found = _read(tmp_path / "a.csv", "# a logger\n% t, x, x\n1,2,3\n4,5,6\n")
    assert (found.names, found.words, found.skip_lines) == (None, ("t", "x", "x"), 2)
    found = _read(tmp_path / "a.csv", "! t, x, y\n1,2,3\n4,5,6\n")  # which the reader of a run does not know
    assert (found.names, found.words, found.skip_lines) == (None, ("t", "x", "y"), 1)
    found = _read(tmp_path / "b.csv", "t,x,x\n(s),[m],\n1,2,3\n4,5,6\n")
    assert (found.names, found.words, found.skip_lines) == (None, ("t [s]", "x [m]", "x"), 2)
    found = _read(tmp_path / "c.csv", "t,x,x\n1,2,3\n4,5,6\n")  # names that repeat cannot be given
    assert (found.names, found.words) == (None, ("t", "x", "x"))


def test_dates_count_from_the_first_whole_second(tmp_path: Path) -> None:
    rows = [f"2024-03-01T10:00:{s},{k}" for k, s in enumerate(("07.250", "07.500", "09.000"))]
    found = _read(tmp_path / "a.csv", "\n".join(["when,x", *rows]) + "\n")
    np.testing.assert_allclose(found.values, [[0.25, 0.0], [0.5, 1.0], [2.0, 2.0]])
    assert found.dates == {0: "2024-03-01T10:00:07.250"}
    clock = found.clocks[0]
    assert clock is not None
    # 2024-03-01 is 16126 days after 1980-01-06; the leap seconds depend on the kind of the clock
    assert clock.origin_gps_s is not None
    assert clock.origin_gps_s - (16126 * 86400 + 36007) in (0, 18)


def test_words_that_tell_rows_apart(tmp_path: Path) -> None:
    found = _read(tmp_path / "a.csv", "kind,t,x\n" + "".join(f"{'AB'[k % 2]},{k},{k * k}\n" for k in range(6)))
    assert found.kinds[0].tolist() == ["A", "B"] * 3
    part = found.selected(0, "B", found.kinds[0] == "B")
    assert part.rows == {"kind": "B"}
    assert part.values[:, 1:].tolist() == [[1.0, 1.0], [3.0, 9.0], [5.0, 25.0]]
    assert part.kinds == {}
    assert part.layout() == {"rows": {"kind": "B"}}


def _unit(path: str = "imu.csv", names: str | None = "stamp,wx,wy,wz,fx,fy,fz") -> TextTable:
    rows = np.array([[10.0, 1, 2, 3, 4, 5, 6], [20.0, 2, 3, 4, 5, 6, 7], [40.0, 3, 5, 7, 9, 11, 13]])
    return TextTable(Path(path), ",", 0, None if names is None else tuple(names.split(",")), rows)


_OWN = Layout("rates", 0, "ms", (2, 1, 3), (4, 5, 6), "deg/s", "g", True, (1, -1, 1), (-1, 1, 1))


def test_the_readings_of_a_layout() -> None:
    """Columns y, x, z of the gyros, of which the second has the other sign, in °/s; forces in g; times in ms."""
    stream, clock = _OWN.stream(_unit())
    assert stream.time == pytest.approx([0.01, 0.02, 0.04])
    assert stream.gyro == pytest.approx(DEG * np.array([[2.0, -1.0, 3.0], [3.0, -2.0, 4.0], [5.0, -3.0, 7.0]]))
    assert stream.accel == pytest.approx(G0 * np.array([[-4.0, 5.0, 6.0], [-5.0, 6.0, 7.0], [-9.0, 11.0, 13.0]]))
    assert (stream.kind, clock) == ("rates", Clock("machine", None, "times without a date"))
    assert _OWN.description(_unit()) == {
        "kind": "rates",
        "time": "stamp",
        "time_unit": "ms",
        "gyro": {"columns": ["wy", "wx", "wz"], "unit": "deg/s", "signs": [1, -1, 1]},
        "accel": {"columns": ["fx", "fy", "fz"], "unit": "g", "signs": [-1, 1, 1]},
    }
    assert _words(_unit(), _OWN) == (
        "Columns, by their numbers and names: time stamp [ms], gyros wy, -wx, wz [deg/s], accelerometers -fx, fy, fz "
        "[g], rates."
    )
    assert _words(_unit(names=None), replace(_OWN, kind="increments")) == (
        "Columns, by their numbers: time 1 [ms], gyros 3, -2, 4 [deg/s], accelerometers -5, 6, 7 [g], increments."
    )


def test_unix_times_count_from_the_first_second() -> None:
    """1.7e9 s of Unix time are 1 700 000 000 − 315 964 800 + 18 s of GPS time."""
    table = _unit()
    table.values[:, 0] = 1.7e12 + np.array((250.0, 500.0, 1000.0))
    stream, clock = _OWN.stream(table)
    assert stream.time == pytest.approx([0.25, 0.5, 1.0])
    assert clock == Clock("utc", 1_384_035_218, "Unix time")
    assert _OWN.description(table)["clock"] == "unix"


def test_two_files_and_gravity(tmp_path: Path) -> None:
    """Accelerations and gravity of other files are taken at the times of the gyros, within those of all."""
    other = TextTable(tmp_path / "acc.csv", ",", 0, ("stamp", "ax", "ay", "az"), np.array(
        [[15.0, 1.0, 2.0, 3.0], [25.0, 3.0, 5.0, 7.0], [45.0, 5.0, 7.0, 9.0]]))  # fmt: skip
    gravity = replace(other, path=tmp_path / "grav.csv", values=other.values * (1.0, 10.0, 10.0, 10.0))
    of_other = Layout("rates", 0, "ms", None, (1, 2, 3), "rad/s", "m/s^2", True)
    of_gyros = replace(_OWN, accel=None)
    table, layout = joined([(other, of_other), (_unit(str(tmp_path / "gyro.csv")), of_gyros)])
    assert table.path.name == "gyro.csv"
    assert layout.accel_unit == "m/s^2"
    layout = replace(layout, gravity=(gravity, replace(of_other, accel_unit="g", accel_signs=(1, 1, -1))))
    stream, _ = layout.stream(table)
    assert stream.time == pytest.approx([0.02, 0.04])
    bare = np.array([[2.0, 3.5, 5.0], [4.5, 6.5, 8.5]])
    expected = bare * (-1.0, 1.0, 1.0) + 10.0 * G0 * bare * (1.0, 1.0, -1.0)
    assert stream.accel == pytest.approx(expected)
    keys = layout.description(table, tmp_path)
    assert keys["accel"] == {"columns": ["ax", "ay", "az"], "unit": "m/s^2", "signs": [-1, 1, 1], "file": "acc.csv"}
    assert keys["gravity"] == {"columns": ["ax", "ay", "az"], "unit": "g", "signs": [1, 1, -1], "file": "grav.csv"}
    assert _words(table, layout).endswith(
        f"accelerometers -ax, ay, az of {other.path.name} [m/s^2] plus gravity ax, ay, az of grav.csv [g], rates."
    )
    with pytest.raises(InputError, match=r"2 files contain only gyros and 0 only accelerometers"):
        joined([(table, of_gyros), (table, of_gyros)])
    late = replace(other, names=("time", "ax", "ay", "az"))
    with pytest.raises(InputError, match=r"their times are in the columns 'stamp' and 'time'"):
        joined([(late, of_other), (table, of_gyros)])


def test_stamps_of_packets() -> None:
    """Rows of one stamp that differ come from packets; copies of a row do not."""
    table = _unit()
    assert not _OWN.coarse_stamps(table)
    table.values[1, 0] = 10.0
    assert _OWN.coarse_stamps(table)
    assert _OWN.description(table)["stamps"] == "even"
    table.values[1] = table.values[0]
    assert not _OWN.coarse_stamps(table)


def test_paths(tmp_path: Path) -> None:
    assert relative(tmp_path / "a" / "log.csv", tmp_path) == "a/log.csv"
    assert relative(tmp_path / "log.csv", tmp_path / "a") == (tmp_path / "log.csv").resolve().as_posix()
