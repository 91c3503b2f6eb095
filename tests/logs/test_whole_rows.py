"""Rows that are left out: instants, readings and messages count the rows of the file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError, SinssimWarning
from sinssim.logs.imu_samples import read_log
from sinssim.logs.log_settings import LogImu

TRIADS = '[gyro]\ncolumns = ["a", "b", "c"]\nunit = "rad"\n[accel]\ncolumns = ["d", "e", "f"]\nunit = "m/s"\n'


def read(folder: Path, description: str, rows: list[str]) -> Any:
    (folder / "log.toml").write_text(description + TRIADS)
    (folder / "log.csv").write_text("t,a,b,c,d,e,f\n" + "\n".join(rows) + "\n")
    return read_log(folder / "log.csv", folder / "log.toml")


def row(time: float, size: float = 1.0) -> str:
    return f"{time},{','.join(str(size * k) for k in (1e-4, -2e-4, 3e-4, 0.5, -0.25, -1.5))}"


@pytest.mark.parametrize("description", ["rate_hz = 50\n", 'time = "t"\n'])
def test_rows_without_readings_keep_their_instants(tmp_path: Path, description: str) -> None:
    """The third of five samples of 20 ms has empty fields: the fourth lasts from 40 to 80 ms."""
    rows = [row(0.02), row(0.04, 2.0), "0.06,,,,,,", row(0.08, 3.0), row(0.10, 4.0)]
    with pytest.warns(SinssimWarning, match=r"^log\.csv: 1 rows lack the readings of a sensor of the IMU"):
        imu = read(tmp_path, description, rows)
    np.testing.assert_allclose(imu.time, [0.0, 0.02, 0.04, 0.08, 0.10], atol=1e-15)
    np.testing.assert_allclose(imu.dtheta, np.outer([1.0, 2.0, 3.0, 4.0], [1e-4, -2e-4, 3e-4]))
    np.testing.assert_allclose(imu.dvel, np.outer([1.0, 2.0, 3.0, 4.0], [0.5, -0.25, -1.5]))


def test_the_line_of_an_impossible_reading(tmp_path: Path) -> None:
    """After two copies and a row without readings, 3e5 rad in 10 ms stand in line 7 of the file."""
    rows = [row(0.01), row(0.01), row(0.01), "0.02,,,,,,", row(0.03), row(0.04, 1e9), row(0.05)]
    said = (
        r"log\.csv, sample 5 \(line 7\): the gyros read 3e\+07 rad/s, but no such sensor exceeds 100000\. Units, times"
    )
    with pytest.raises(InputError, match=said):
        read(tmp_path, 'time = "t"\n', rows)
    with pytest.raises(InputError, match=r"log\.csv has 1 sample; a log needs at least two\.$"):
        read(tmp_path, "rate_hz = 50\n", [row(0.0)])


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["1e16," + row(0)[2:], "1.1e16," + row(0)[2:]], "its times reach 1.1e+16 s, which is impossible for a log."),
        ([row(0.5), row(0.4), row(0.6)], ", sample 1 (line 3): the time 0.4 s is not later than 0.5 s."),
        ([row(0.1), row(0.2), row(0.3), row(0.3, 2.0)], ", sample 3 (line 5): the time 0.3 s is not later than 0.3 s."),
    ],
)
def test_times_that_cannot_be(tmp_path: Path, rows: list[str], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        read(tmp_path, 'time = "t"\n', rows)


def test_columns_of_different_lengths(tmp_path: Path) -> None:
    """An archive of arrays may have them."""
    arrays = {"w": np.ones((4, 3)), "f": np.ones((3, 3)), "t": 0.01 * np.arange(1.0, 5.0)}
    np.savez(tmp_path / "log.npz", **arrays)
    whole = '[gyro]\ncolumns = "w"\nunit = "rad"\n[accel]\ncolumns = "f"\nunit = "m/s"\n'
    said = r"gyro 4, accel 3, time 4 samples\."
    for time in ('time = "t"\n', "rate_hz = 5\n"):
        (tmp_path / "log.toml").write_text(time + whole)
        with pytest.raises(InputError, match=rf"log\.npz: the columns differ in length: {said}$"):
            read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    np.savez(tmp_path / "log.npz", a=np.ones(4), b=np.ones(3), c=np.ones(4), d=np.ones(4), e=np.ones(4), f=np.ones(4),
             t=np.arange(4.0))  # fmt: skip
    (tmp_path / "log.toml").write_text('time = "t"\n' + TRIADS)
    with pytest.raises(InputError, match=r"the columns differ in length: 'a' 4, 'b' 3, 'c' 4 samples\.$"):
        read_log(tmp_path / "log.npz", tmp_path / "log.toml")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"delimiter": "x"}, "delimiter = 'x' cannot separate numbers; use a comma, a semicolon or a tab"),
        ({"delimiter": ",", "decimal": ","}, 'decimal = "," needs another delimiter, for example delimiter = ";"'),
    ],
)
def test_descriptions_that_cannot_be(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        LogImu.model_validate({"file": "a.csv", **changes})
