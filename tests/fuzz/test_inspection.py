"""Text logs with mangled columns, given to `sinssim inspect`: each is examined or refused in words, soon."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.inspected_files import inspect
from tests.fuzz import mangle

FIELDS = ("", "x", "1e400", "-", "9" * 400, "1,5", "nan", "0", "1e200", "-1e9", "\0", "2024-02-30T00:00:00Z")
"""What stands in single fields of damaged rows."""


def recorded() -> dict[str, str]:
    """Return a log and its fixes as text: a car that stands, drives and turns a little."""
    rng = np.random.default_rng(4)
    time = 0.02 * np.arange(1, 1500)
    rate, force = 1e-3 * rng.standard_normal((2, len(time), 3))
    rate[:, 2] += 0.2 * np.sin(0.5 * time) * (time > 10.0)
    force += [0.0, 0.0, -9.81]
    force[:, 0] += 0.5 * np.sin(0.3 * time) * (time > 10.0)
    imu = np.column_stack([time, rate, force])
    fixes = np.column_stack([time[::25], 48.0 + 1e-6 * time[::25], 11.5 + 2e-6 * time[::25], 500.0 + 0.0 * time[::25]])
    return {
        "imu.csv": "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z\n"
        + "".join(",".join(f"{v:.9g}" for v in row) + "\n" for row in imu),
        "gnss.csv": "time_s,latitude_deg,longitude_deg,height_m\n"
        + "".join(",".join(f"{v:.9f}" for v in row) + "\n" for row in fixes),
    }


def columns(rng: np.random.Generator, text: str) -> str:
    """Return a table with one to three columns removed, repeated, renamed, replaced, scaled or damaged."""
    lines = [line.split(",") for line in text.splitlines()]
    for _ in range(rng.integers(1, 4)):
        column, deed = int(rng.integers(max(len(lines[0]), 1))), int(rng.integers(7))
        value = str(mangle.NUMBERS[rng.integers(len(mangle.NUMBERS))])
        for row, line in enumerate(lines):
            if column >= len(line):
                continue
            if deed == 0:
                del line[column]
            elif deed == 1:
                line.insert(column, line[column])
            elif deed == 2 and row == 0:
                line[column] = mangle.TEXTS[rng.integers(len(mangle.TEXTS))][:3000]
            elif deed == 3 and row:
                line[column] = value
            elif deed == 4 and row:
                line[column] = f"{line[column]}e200"
            elif deed == 5 and row > rng.integers(len(lines)):
                line[column] = value
            elif deed == 6 and row % 7 == 3:
                line[column] = FIELDS[rng.integers(len(FIELDS))]
    return "\n".join(",".join(line) for line in lines) + "\n"


def inspections(count: int, seed: int, folder: Path) -> mangle.Verdict:
    """Mangle a log and its fixes."""
    verdict, sound = mangle.Verdict(), recorded()
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        for name, text in sound.items():
            deed = int(rng.integers(4))
            mangled = columns(rng, text) if deed < 2 else mangle.text(rng, text) if deed == 2 else text
            mangle.rewrite(folder / name, mangled.encode("utf-8", "replace"))
        files = [folder / name for name in sound][: rng.integers(1, 3)]
        with np.errstate(all="ignore"):
            verdict.judge(lambda files=files: inspect(files, folder), lambda k=k: f"case {seed, k}")
    return verdict


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numpy, on numbers that are none
def test_mangled_inspections(tmp_path: Path) -> None:
    inspections(15, 1, tmp_path).must_be_sound()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_four_thousand_mangled_inspections(tmp_path: Path) -> None:
    inspections(4000, 2, tmp_path).must_be_sound()
