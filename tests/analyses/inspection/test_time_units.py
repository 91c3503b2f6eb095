"""The unit of stamps by evidence: names, dates since 1970, rates, fractions, duration of the fixes; or a question."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.file_layouts import guess_files
from sinssim.analyses.inspection.text_columns import read_table, time_column
from sinssim.errors import InputError

_G = 9.80665
_EPOCH = 1_700_000_000.0
_LATE = 1.005  # a logger of nominally 5 Hz, whose interval is a little longer


def _imu(path: Path, stamps: np.ndarray, name: str = "stamp", more: dict[str, np.ndarray] | None = None) -> Path:
    """Write a unit that turns and stands by turns; stamps are printed as given, whole or not."""
    rng = np.random.default_rng(3)
    count, t = len(stamps), np.arange(len(stamps))
    rate = 0.2 * np.stack([np.sin(0.3 * t), np.cos(0.2 * t), np.sin(0.1 * t)], axis=1)
    force = np.stack([np.sin(0.05 * t), np.cos(0.04 * t), np.full(count, -_G)], axis=1)
    columns = [
        *(more or {}).values(),
        *(rate + rng.normal(0.0, 1e-3, (count, 3))).T,
        *(force + rng.normal(0.0, 0.01, (count, 3))).T,
    ]
    names = [name, *(more or {}), "gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"]
    rows = [
        ",".join([f"{s:.15g}", *(f"{x:.6f}" for x in row)])
        for s, row in zip(stamps, np.column_stack(columns), strict=True)
    ]
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    return path


def _found(path: Path) -> tuple[str | int, str, float]:
    column, unit, interval = time_column(read_table(path))
    return read_table(path).label(column), unit, 1.0 / interval


def test_a_millisecond_epoch_at_5_hz(tmp_path: Path) -> None:
    """201 ms between dates in milliseconds are 4.975 samples a second, and not 4975 as in microseconds."""
    stamps = np.rint(1e3 * _EPOCH + 1e3 * 0.2 * _LATE * np.arange(600))
    assert _found(_imu(tmp_path / "imu.csv", stamps)) == ("stamp", "ms", pytest.approx(1.0 / (0.2 * _LATE), rel=1e-3))


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("interval", [0.0005, 0.01, 0.9])
def test_dates_since_1970_have_one_unit(tmp_path: Path, unit: str, scale: float, interval: float) -> None:
    stamps = scale * (_EPOCH + interval * np.arange(200))
    stamps = stamps if unit == "s" else np.rint(stamps)
    label, found, rate = _found(_imu(tmp_path / "imu.csv", stamps))
    assert (label, found) == ("stamp", unit)
    assert rate == pytest.approx(1.0 / interval, rel=0.01)


def test_a_counter_that_looks_like_dates(tmp_path: Path) -> None:
    """1.5e9 µs since the start of a computer, 100 a second, would be dates 3 hours apart in seconds."""
    assert _found(_imu(tmp_path / "imu.csv", 1.5e9 + 1e4 * np.arange(300)))[1] == "us"


@pytest.mark.parametrize("interval", [0.2, 0.2 * _LATE, 0.5])
def test_seconds_at_5_hz(tmp_path: Path, interval: float) -> None:
    """Stamps with fractions are seconds: loggers count whole milliseconds."""
    label, unit, rate = _found(_imu(tmp_path / "imu.csv", 3.0 + interval * np.arange(600)))
    assert (label, unit) == ("stamp", "s")
    assert rate == pytest.approx(1.0 / interval, rel=1e-3)


@pytest.mark.parametrize(("step", "unit"), [(1.0, "ms"), (5.0, "ms"), (20.0, "ms"), (2500.0, "us"), (1000.0, "us")])
def test_usual_rates_need_no_question(tmp_path: Path, step: float, unit: str) -> None:
    assert _found(_imu(tmp_path / "imu.csv", 700.0 + step * np.arange(600)))[1] == unit


def test_a_question_where_two_units_are_possible(tmp_path: Path) -> None:
    """201 between whole numbers: 4.975 a second in ms, 4975 in µs. A name decides, and so do fixes beside them."""
    stamps = 52_000.0 + 201.0 * np.arange(600)
    path = _imu(tmp_path / "imu.csv", stamps)
    with pytest.raises(
        InputError, match=r"not certain: in us there are 4975 .* or in ms there are 4.975 .* over 120.6"
    ):
        guess_files([read_table(path)])
    assert _found(_imu(tmp_path / "named.csv", stamps, "stamp_ms"))[1] == "ms"
    t = np.arange(0.0, 120.0)
    rows = [f"{x:.1f},{48.0 + 1e-5 * x:.7f},{11.0 + 1e-5 * np.sin(x):.7f},500.0" for x in t]
    (tmp_path / "gps.csv").write_text("\n".join(["time_s,lat,lon,alt", *rows]) + "\n")
    found = guess_files([read_table(path), read_table(tmp_path / "gps.csv")])
    assert found.unit is not None
    assert found.unit[1].time_unit == "ms"


@pytest.mark.parametrize("name", ["speed_of_sound_m_s", "speed of sound (m/sec)", "SoundSpeed_mps", "c_sound [m/s]"])
def test_the_speed_of_sound_is_no_time(tmp_path: Path, name: str) -> None:
    """A column that rises slowly beside stamps without a name that says time."""
    sound = {name: 340.0 + 0.01 * np.arange(600)}
    label, unit, rate = _found(_imu(tmp_path / "imu.csv", 3.0 + 0.01 * np.arange(600), "when", sound))
    assert (label, unit) == ("when", "s")
    assert rate == pytest.approx(100.0)
