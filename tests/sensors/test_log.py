"""Recorded logs: every format, unit and set of axes, and what is wrong with a file."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv, parquet

from sinssim.errors import InputError
from sinssim.sensors.log import read_log

GYRO = np.array([[1e-6, 2e-6, 3e-6], [4e-6, 5e-6, 6e-6], [7e-6, 8e-6, 9e-6]])  # rad
ACCEL = np.array([[0.01, 0.02, -0.1], [0.03, 0.04, -0.2], [0.05, 0.06, -0.3]])  # m/s
ENDS = np.array([0.01, 0.02, 0.03])


def own_table():
    names = [f"dtheta_{a}_rad" for a in "xyz"] + [f"dvel_{a}_mps" for a in "xyz"]
    return pa.table({"time_s": ENDS, **dict(zip(names, np.hstack([GYRO, ACCEL]).T, strict=True))})


def check(imu, dtheta=GYRO, dvel=ACCEL):
    np.testing.assert_allclose(imu.time, [0.0, *ENDS], atol=1e-12)
    np.testing.assert_allclose(imu.dtheta, dtheta, rtol=1e-12)
    np.testing.assert_allclose(imu.dvel, dvel, rtol=1e-12)


def test_own_streams_need_no_description(tmp_path):
    parquet.write_table(own_table(), tmp_path / "imu.parquet")
    csv.write_csv(own_table(), tmp_path / "imu.csv")
    np.savez(tmp_path / "imu.npz", **{n: own_table()[n].to_numpy() for n in own_table().column_names})
    for name in ("imu.parquet", "imu.csv", "imu.npz"):
        check(read_log(tmp_path / name))


def test_rates_in_their_own_units_and_axes(tmp_path):
    """Right-forward-up, deg/h and mg, milliseconds: by hand from the definition of each unit."""
    degrees_per_hour = np.degrees(GYRO / 0.01) * 3600
    milli_g = ACCEL / 0.01 / 9.80665 * 1000
    (tmp_path / "log.csv").write_text(
        "t;gr;gf;gu;ar;af;au\n"
        + "".join(
            f"{10 * (k + 1)};{g[1]!r};{g[0]!r};{-g[2]!r};{a[1]!r};{a[0]!r};{-a[2]!r}\n"
            for k, (g, a) in enumerate(zip(degrees_per_hour.tolist(), milli_g.tolist(), strict=True))
        )
    )
    (tmp_path / "log.toml").write_text(
        'kind = "rates"\ntime = "t"\ntime_unit = "ms"\naxes = ["right", "forward", "up"]\ndelimiter = ";"\n'
        '[gyro]\ncolumns = ["gr", "gf", "gu"]\nunit = "deg/h"\n[accel]\ncolumns = ["ar", "af", "au"]\nunit = "mg"\n'
    )
    check(read_log(tmp_path / "log.csv", tmp_path / "log.toml"))


def test_whole_arrays_and_a_sampling_rate(tmp_path):
    np.savez(tmp_path / "log.npz", w=GYRO / 1e-6, f=ACCEL / 1e-3)
    (tmp_path / "log.toml").write_text(
        'rate_hz = 100\n[gyro]\ncolumns = "w"\nunit = "urad"\n[accel]\ncolumns = "f"\nunit = "mm/s"\n'
    )
    check(read_log(tmp_path / "log.npz", tmp_path / "log.toml"))


TRIADS = '[gyro]\ncolumns = ["a", "b", "c"]\nunit = "rad"\n[accel]\ncolumns = ["d", "e", "f"]\nunit = "m/s"\n'


@pytest.mark.parametrize(
    ("description", "text"),
    [
        ('time = "t"\naxes = ["forward", "left", "down"]\n' + TRIADS, "right-handed"),
        ('time = "t"\naxes = ["forward", "forward", "down"]\n' + TRIADS, "right-handed"),
        ('time = "t"\n' + TRIADS.replace('"rad"', '"rad/s"'), "rad/s"),
        ('time = "t"\ntime_unit = "min"\n' + TRIADS, "min"),
        ('time = "t"\nrate_hz = 100\n' + TRIADS, "keep one"),
        ('tim = "t"\n' + TRIADS, "tim"),
        ('time = "t\n', "TOML syntax"),
        ('time = "x"\n' + TRIADS, "unknown column 'x'"),
        ('time = "t"\n' + TRIADS.replace('"f"', '"text"'), "does not hold numbers"),
        ('time = "t"\n' + TRIADS.replace('"f"', '"gap"'), "sample 1"),
        ('time = "back"\n' + TRIADS, "sample 2"),
    ],
)
def test_mistakes_are_named(tmp_path, description, text):
    table = pa.table(
        dict.fromkeys("tabcdef", ENDS)
        | {"text": ["x", "y", "z"], "gap": pa.array([1.0, None, 2.0]), "back": [0.01, 0.02, 0.015]}
    )
    parquet.write_table(table, tmp_path / "log.parquet")
    (tmp_path / "log.toml").write_text(description)
    with pytest.raises(InputError) as info:
        read_log(tmp_path / "log.parquet", tmp_path / "log.toml")
    assert text in str(info.value)


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("log.txt", b"", ".csv, .parquet or .npz"),
        ("log.csv", b"", "cannot be read"),
        ("log.parquet", b"PAR1 but not really", "cannot be read"),
        ("log.npz", b"PK but not really", "cannot be read"),
        ("log.csv", b"time_s,dtheta_x_rad\n1,2\n", "unknown column"),
    ],
)
def test_unreadable_files_are_named(tmp_path, name, content, text):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as info:
        read_log(tmp_path / name)
    assert text in str(info.value)
    assert name in str(info.value)


def test_a_missing_file_is_named(tmp_path):
    for suffix in ("csv", "parquet", "npz"):
        with pytest.raises(InputError, match="cannot be read"):
            read_log(tmp_path / f"nothing.{suffix}")
