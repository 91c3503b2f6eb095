"""Recorded logs, mangled: each is read or refused in words."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv, parquet

from sinssim.analyses.noise_report import clock
from sinssim.errors import SinssimWarning
from sinssim.logs.imu_samples import SUFFIXES, read_log, read_samples
from tests.fuzz import mangle

NAMES = ["t", "wx", "wy", "wz", "fx", "fy", "fz"]
ROWS = np.column_stack([0.01 * np.arange(1.0, 13.0), np.full((12, 3), 1e-3), np.full((12, 3), 9.8)])
DESCRIPTION = """kind = "rates"
time = "t"
time_unit = "s"
axes = ["forward", "right", "down"]
delimiter = ","
skip_lines = 0
[gyro]
columns = ["wx", "wy", "wz"]
unit = "rad/s"
[accel]
columns = ["fx", "fy", "fz"]
unit = "m/s^2"
"""
KEYS = ("kind", "time", "time_unit", "axes", "delimiter", "skip_lines", "rate_hz", "gyro", "accel", "columns", "unit")


def columns(rng: np.random.Generator) -> dict[str, Any]:
    """Return the columns of a log, one of them often not what it should be."""
    found: dict[str, Any] = dict(zip(NAMES, ROWS.T.copy(), strict=True))
    if rng.integers(3) == 0:
        return found
    name = NAMES[rng.integers(len(NAMES))]
    one = found[name]
    others: tuple[Any, ...] = (
        one[:, None], one[None], one[0], one[:0], one[:5], one.astype(complex), one.astype("M8[s]"), one.astype(bool),
        one.astype(str), one.astype("S"), one.astype(np.float32), (one * 100).astype(np.int8),
        one * np.nan, one * 1e308,
        -one, one * 0.0, np.where(one > one[3], np.inf, one), np.array([None] * 12), np.zeros(12, [("a", float)]),
        np.repeat(one[:, None], 3, 1), np.array(["x"] * 12), one * 1e12,
    )  # fmt: skip
    found[name] = others[rng.integers(len(others))]
    if rng.integers(4) == 0:
        found.pop(NAMES[rng.integers(len(NAMES))])
    return found


def content(rng: np.random.Generator, suffix: str) -> bytes:
    """Return the bytes of a log, mangled on the way or afterwards."""
    file = io.BytesIO()
    try:
        if suffix == ".npz":
            (np.savez, np.savez_compressed)[rng.integers(2)](file, **columns(rng))
        elif suffix == ".parquet":
            parquet.write_table(pa.table(columns(rng)), file)
        else:
            csv.write_csv(pa.table(columns(rng)), file)
    except (pa.ArrowException, ValueError, TypeError):  # what such a file cannot hold
        file = io.BytesIO(mangle.text(rng, ",".join(NAMES) + "\n").encode())
    data = bytearray(file.getvalue())
    deed = int(rng.integers(0, 7))
    if suffix not in (".npz", ".parquet") and deed < 4:
        text = mangle.text(rng, data.decode("latin-1"))
        return text.encode(("utf-8", "utf-8", "latin-1", "utf-16")[rng.integers(4)], "replace")
    if deed == 4:
        return bytes(data[: rng.integers(len(data) + 1)])
    if deed == 5 and data:
        for _ in range(rng.integers(1, 6)):
            data[rng.integers(len(data))] = rng.integers(256)
    if deed == 6:
        return rng.bytes(int(rng.integers(0, 300)))
    return bytes(data)


def described(rng: np.random.Generator) -> str:
    """Return a description, now and then with another value or a wound."""
    if (kind := int(rng.integers(0, 5))) < 2:
        return DESCRIPTION
    if kind == 2:
        return mangle.text(rng, DESCRIPTION)
    lines = DESCRIPTION.split("\n")
    value = mangle.value(rng)
    if isinstance(value, float | int) and not isinstance(value, bool):
        shown = str(value)
    else:
        shown = repr(value) if isinstance(value, str | list) and len(str(value)) < 999 else "true"
    lines.insert(int(rng.integers(len(lines))), f"{KEYS[rng.integers(len(KEYS))]} = {shown}")
    if kind == 4:
        del lines[rng.integers(len(lines))]
    return "\n".join(lines)


def read(log: Path, description: Path) -> None:
    """Read a log as the commands do; a warning that a row is left out is an answer."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SinssimWarning)
        imu, samples = read_log(log, description), read_samples(log, description)
    assert np.isfinite(imu.dtheta).all()
    assert np.isfinite(imu.dvel).all()
    assert (np.diff(imu.time) > 0.0).all()
    clock(samples, str(log))


def logs(count: int, seed: int, folder: Path) -> mangle.Verdict:
    """Mangle logs and their descriptions."""
    verdict, description = mangle.Verdict(), folder / "log.toml"
    for k in range(count):
        rng = np.random.default_rng((seed, k))
        suffix = SUFFIXES[rng.integers(len(SUFFIXES))]
        log = folder / f"log{suffix}"
        with np.errstate(all="ignore"):
            mangle.rewrite(log, content(rng, suffix))
        mangle.rewrite(description, described(rng).encode("utf-8", "replace"))
        verdict.judge(lambda log=log: read(log, description), lambda k=k, s=suffix: f"case {seed, k}, {s}")
    return verdict


def test_mangled_logs(tmp_path: Path) -> None:
    logs(80, 1, tmp_path).must_be_sound()


@pytest.mark.slow
def test_twenty_thousand_mangled_logs(tmp_path: Path) -> None:
    logs(20_000, 2, tmp_path).must_be_sound()
