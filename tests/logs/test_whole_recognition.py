"""Limits within which a file may be of a format, its first numbers, and rows that are refused by their number."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.formats import _check, detect, format_of, library, refused, sbet_inertial_explorer
from sinssim.logs.numeric_columns import check_finite, head_numbers
from sinssim.logs.recorded_streams import Clock, FixStream, InertialStream, SolutionStream, Streams

IMU = [[100.5, 1e-3, -2e-3, 3e-3, 0.5, -0.25, -2.0], [101.0, 1e-3, -2e-3, 3e-3, 0.5, -0.25, -2.0]]
GNSS = [[100.5, 30.5, 114.25, 20.5, 0.5, 0.25, 0.75], [101.5, 30.55, 114.5, 21.5, 0.5, 0.25, 0.75]]
SOLUTION = [
    [2200, 100.5, 30.5, 114.25, 20.5, 1, 2, 3, 10.5, -20.25, 130.75],
    [2200, 101.5, 30.5, 114.25, 20.5, 1, 2, 3, 4, 5, 6],
]
TUM = [[100.5, 1, 2, 3, 0.5, -0.5, 0.5, 0.5], [101.5, 1, 2, 3, 0.6, 0.0, 0.8, 0.0]]
"""Rows of each format; below, one number of the first or second row at a time is put to its limit, and beyond it."""


def recognised(name: str, path: Path, rows: list[list[float]]) -> bool:
    text = "\n".join(" ".join(map(repr, row)) for row in rows) + "\n"
    return format_of(name).recognises(path, text.encode())


@pytest.mark.parametrize(
    ("name", "rows", "row", "column", "inside", "outside"),
    [
        ("kf-gins-imu", IMU, 1, 0, 101.5, 101.6),  # at most a second apart
        ("kf-gins-imu", IMU, 1, 0, 100.6, 100.5),  # in order
        ("kf-gins-imu", IMU, 1, 1, 0.99, 1.01),  # less than a radian
        ("kf-gins-imu", IMU, 1, 3, -0.99, -1.01),
        ("kf-gins-imu", IMU, 1, 6, -0.84, -0.82),  # √(0.5² + 0.25² + x²) over 0.5 s is 2 m/s² at x = 0.829
        ("kf-gins-imu", IMU, 1, 6, -49.9, -50.1),  # and 100 m/s² at x = 49.997
        ("kf-gins-imu", IMU, 0, 0, 100.5, -0.5),
        ("kf-gins-gnss", GNSS, 1, 0, 100.6, 100.5),
        ("kf-gins-gnss", GNSS, 0, 0, 0.0, -0.5),
        ("kf-gins-gnss", GNSS, 1, 0, 604800.0 + 86400.0, 604800.0 + 86401.0),
        ("kf-gins-gnss", GNSS, 1, 1, 30.59, 30.61),  # a tenth of a degree of latitude
        ("kf-gins-gnss", GNSS, 1, 2, 360.0, 360.5),
        ("kf-gins-gnss", GNSS, 1, 2, -360.0, -360.5),
        ("kf-gins-gnss", GNSS, 1, 3, -9e5, -2e6),
        ("kf-gins-gnss", GNSS, 1, 4, 0.1, 0.0),
        ("kf-gins-gnss", GNSS, 1, 6, 0.1, -0.1),
        ("kf-gins-solution", SOLUTION, 0, 0, 0, 2200.5),
        ("kf-gins-solution", SOLUTION, 0, 0, 9999, 10000),
        ("kf-gins-solution", SOLUTION, 0, 0, 1, -1),
        ("kf-gins-solution", SOLUTION, 1, 1, 100.6, 100.5),
        ("kf-gins-solution", SOLUTION, 0, 2, -90.0, -90.5),
        ("kf-gins-solution", SOLUTION, 0, 3, 360.0, 360.5),
        ("kf-gins-solution", SOLUTION, 0, 8, -360.0, -360.5),
        ("kf-gins-solution", SOLUTION, 1, 10, 360.0, 360.5),
        ("tum", TUM, 0, 4, 0.515, 0.525),  # a norm of 1 to a hundredth
        ("tum", TUM, 1, 0, 100.6, 100.5),
    ],
)
def test_limits(
    tmp_path: Path, name: str, rows: list[list[float]], row: int, column: int, inside: float, outside: float
) -> None:
    for value, expected in ((inside, True), (outside, False)):
        given = [list(one) for one in rows]
        given[row][column] = value
        assert recognised(name, tmp_path / "x.txt", given) == expected, value
    assert not recognised(name, tmp_path / "x.txt", [[*one, 1.0, 1.0] for one in rows])
    assert not recognised(name, tmp_path / "x.txt", [one[:-1] for one in rows])


def test_sbet_by_its_first_records(tmp_path: Path) -> None:
    rows = np.zeros((3, 17))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3] = (100.5, 101.0, 101.5), -0.5, 1.5, 20.5
    assert sbet_inertial_explorer.recognises_sbet(tmp_path, rows.tobytes())
    for row, column, inside, outside in (
        (1, 0, 100.6, 100.5), (2, 0, 2.0 * 604800 - 1.0, 2.0 * 604800), (0, 1, -1.57, -1.58), (0, 2, 6.28, 6.29),
        (1, 3, -9e5, -1e6), (2, 5, 9e3, 1.1e4), (1, 10, 6.9, 7.1), (0, 7, -6.9, -7.1), (0, 13, 1e9, np.inf),
    ):  # fmt: skip
        for value, expected in ((inside, True), (outside, False)):
            given = rows.copy()
            given[row, column] = value
            assert sbet_inertial_explorer.recognises_sbet(tmp_path, given.tobytes()) == expected, (row, column, value)
    assert not sbet_inertial_explorer.recognises_sbet(tmp_path, rows.tobytes()[:-1])


def test_the_first_numbers_of_a_file() -> None:
    """Comments are no rows; at most so many; rows that the beginning and the head cut short are left out."""
    found = head_numbers(b"# a\n\n% b\n1 2 3\n4 5 6\n7 8 9\n", rows=2)
    assert found is not None
    assert found.tolist() == [[1, 2, 3], [4, 5, 6]]
    found = head_numbers(b"2 3\n4 5 6\n7 8 9\n")
    assert found is not None
    assert found.tolist() == [[4, 5, 6], [7, 8, 9]]
    assert head_numbers(b"1 2 3\n4 5\n") is None
    assert head_numbers(b"1 2 x\n") is None
    assert head_numbers(b"1 2\0 3\n") is None
    assert head_numbers(b"# a\n") is None
    assert head_numbers(b"1 2 3\n" * 5 + b"4 5", rows=9999) is None  # the whole file: its last row is short
    found = head_numbers(b"1 2 3\n" * 682 + b"4 56", rows=9999)
    assert found is not None, "the head of a longer file, 4096 bytes, ends within a row"
    assert len(found) == 682


def test_rows_are_named_from_one() -> None:
    with pytest.raises(InputError, match=r"x, row 3: the column t is missing or not finite"):
        check_finite(Path("x"), np.array([1.0, 2.0, np.nan, np.inf]), "column t")
    with pytest.raises(InputError, match=r"x, row 2: the number is missing or not finite"):
        check_finite(Path("x"), np.array([[1.0, 2.0], [3.0, np.nan]]), "number")
    with pytest.raises(InputError, match=r"x, row 1: the number is missing or not finite"):
        check_finite(Path("x"), np.array([np.inf, 2.0]), "number")


ONE = np.array([0.5, 1.5, 2.5])


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"latitude": np.array([0.5, np.pi / 2 + 1e-6, 0.5])}, r"x, row 2 of 'gnss': the latitude is beyond ±90°"),
        ({"longitude": np.array([0.5, 0.5, -6.2832])}, r"x, row 3 of 'gnss': the longitude is beyond ±360°"),
        ({"time": np.array([np.nan, 1.0, 2.0])}, r"x, row 1 of 'gnss': the time is not finite"),
        ({"time": ONE[:0], "latitude": ONE[:0], "longitude": ONE[:0]}, r"x: the stream 'gnss' has no rows"),
        (
            {"latitude": np.array([np.pi / 2, -np.pi / 2, np.nan]), "longitude": np.array([6.2831, -6.2831, np.nan])},
            None,
        ),
    ],
)
def test_places_on_the_earth(changes: dict[str, np.ndarray], said: str | None) -> None:
    given = {"time": ONE, "latitude": 0.5 * ONE, "longitude": ONE, "height": ONE, **changes}
    clock = Clock("machine")
    for streams in (
        Streams(Path("x"), "f", clock, fixes={"gnss": FixStream(**given)}),
        Streams(Path("x"), "f", clock, solutions={"gnss": SolutionStream(**given)}),
    ):
        if said is None:
            _check(streams)
        else:
            with pytest.raises(InputError, match=said):
                _check(streams)
    if said is None:
        accel = np.ones((3, 3))
        accel[1, 2] = np.inf
        imu = InertialStream(ONE, np.ones((3, 3)), accel)
        with pytest.raises(InputError, match=r"x, row 2 of 'imu': a reading is not finite\. The file may be damaged"):
            _check(Streams(Path("x"), "f", clock, {"imu": imu}))


def test_messages_of_detection_and_libraries(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("".join(f"{0.5 * k} 0.1 0.1 0.1 3.0 2.0 3.0\n" for k in range(1, 5)))
    with pytest.raises(InputError) as caught:
        detect(tmp_path / "x.txt")
    assert str(caught.value) == (
        f"{tmp_path / 'x.txt'} may be kf-gins-imu or kf-gins-gnss: their numbers look alike. Give the format "
        f"(--format NAME)."
    )
    with pytest.raises(
        InputError,
        match=r"--to x needs the library of-nobody, which is not installed .* with: "
        r"pip install",
    ):
        library("module_of_nobody", "of-nobody", "--to x")
    assert str(refused(Path("a.ulg"), "a PX4 ULog", ValueError("bad\x07 thing. "))) == (
        "a.ulg cannot be read as a PX4 ULog: bad  thing. It may be damaged or incomplete."
    )
    assert str(refused(Path("a.ulg"), "a PX4 ULog", KeyError())).startswith(
        "a.ulg cannot be read as a PX4 ULog: KeyError."
    )
