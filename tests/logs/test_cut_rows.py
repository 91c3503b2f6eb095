"""A first or a last row that was cut short is left out, with a note that names it; the other rows stay as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.text_columns import read_table
from sinssim.errors import InputError, SinssimWarning
from sinssim.logs.formats import read_file
from sinssim.logs.imu_samples import read_log
from sinssim.logs.numeric_columns import cut_rows, read_numbers, text_rows
from tests.logs.formats.samples import FILES

_FORMATS = {"kf-gins-imu": 0, "kf-gins-gnss": 0, "psins-avp": 3, "columns": 1, "inertial-explorer": 5}
"""Formats of rows, and the number of their first row, from 0."""


@pytest.mark.parametrize("name", _FORMATS)
@pytest.mark.parametrize("place", ["first", "last"])
def test_formats(tmp_path: Path, name: str, place: str) -> None:
    make, file = FILES[name]
    path = make(tmp_path / file)
    whole = next(iter({**(read := read_file(path, name)).inertial, **read.fixes, **read.solutions}.values())).time
    lines = path.read_text().splitlines()
    k = _FORMATS[name] if place == "first" else len(lines) - 1
    half = len(lines[k]) // 2
    lines[k] = lines[k][half:] if place == "first" else lines[k][:half]
    path.write_text("\n".join(lines))
    found = read_file(path, name)
    stream = next(iter({**found.inertial, **found.fixes, **found.solutions}.values()))
    expected = whole[1:] if place == "first" else whole[:-1]
    np.testing.assert_allclose(stream.time, expected, atol=1e-9)
    assert any(f"{path.name}, line {k + 1}: the {place} row was cut short" in note for note in found.notes)


@pytest.mark.parametrize(
    ("header", "cut"), [(True, "9.81"), (True, "0,0,9.81"), (False, "0,0,9.81"), (False, ".5,9.8")]
)
def test_columns_of_an_unknown_logger(tmp_path: Path, header: bool, cut: str) -> None:
    """What inspect guesses, and what a run reads by the description, are the same rows."""
    rows = [f"{0.01 * k:.2f},{k},0.1,0.2,0.0,0.1,9.8" for k in range(1, 9)]
    names = ["t_s,a,b,c,d,e,f"] if header else []
    path = tmp_path / "imu.csv"
    path.write_text("\n".join([*names, cut, *rows, "0.09,9,0."]))
    table = read_table(path)
    np.testing.assert_array_equal(table.values[:, 1], np.arange(1, 9))
    assert table.names == (tuple(names[0].split(",")) if header else None)
    first = 2 if header else 1
    assert [f"line {k}:" in note for k, note in zip((first, first + 9), table.notes, strict=True)] == [True, True]
    columns = ('"t_s"', '["a", "b", "c"]', '["d", "e", "f"]') if header else (1, [2, 3, 4], [5, 6, 7])
    (tmp_path / "imu.toml").write_text(
        f"skip_lines = {table.skip_lines}\ntime = {columns[0]}\ntime_unit = 's'\n"
        f"[gyro]\ncolumns = {columns[1]}\nunit = 'rad'\n[accel]\ncolumns = {columns[2]}\nunit = 'm/s'\n"
    )
    with pytest.warns(SinssimWarning, match="cut short") as told:
        imu = read_log(path, tmp_path / "imu.toml")
    assert len(told) == 2
    np.testing.assert_array_equal(imu.dtheta[:, 0], np.arange(1, 9))


def test_a_short_row_in_the_middle_is_still_refused(tmp_path: Path) -> None:
    path = tmp_path / "imu.txt"
    path.write_text("1 2 3 4 5 6 7\n2 2 3 4 5 6 7\n3 2 3\n4 2 3 4 5 6 7\n")
    with pytest.raises(InputError, match="line 3: it has 3 fields; 7 separated by blanks are needed"):
        read_file(path, "kf-gins-imu")


def test_a_last_number_that_is_none(tmp_path: Path) -> None:
    """The row ends within an exponent: it has all fields, and no end of a line."""
    path = tmp_path / "x.txt"
    path.write_text("1,2,3\n4,5,6\n7,8,9\n1,2,3e-")
    cut = cut_rows(path, ",", 0)
    assert (cut.first, cut.last) == (None, 4)
    assert [line for line, _ in text_rows(path, ",", 0, cut)] == [1, 2, 3]
    assert read_numbers(path, (3,), [], delimiter=",").tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    path.write_text("name of a rig\n1,2,3\n4,5,6\n7,8,9\n")  # words are no part of a row
    assert cut_rows(path, ",", 0).notes == ()


def test_a_remark_after_the_last_row(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text("1 2 3 4 5 6 7\n2 2 3 4 5 6 7\n3 2 3 4 5 6 7\nStep: words = more\n")
    found = read_file(path, "kf-gins-imu")
    assert len(found.inertial["imu"].time) == 3
    assert found.notes[0] == "x.txt, line 4: the last line is no row of numbers and is left out."
