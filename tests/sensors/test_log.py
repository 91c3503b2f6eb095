"""Recorded logs: every format, unit and set of axes, and what is wrong with a file."""

from __future__ import annotations

import io

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
    np.testing.assert_allclose(imu.time, [0.0, *ENDS], rtol=0, atol=1e-12)
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


def rows(*, separator, names="", before=""):
    """The package's own columns as text, without names unless given."""
    lines = [separator.join(repr(float(x)) for x in row) for row in np.column_stack([ENDS, GYRO, ACCEL])]
    return before + names + "\n".join(lines) + "\n"


NUMBERED = 'time = 1\n{}[gyro]\ncolumns = [2, 3, 4]\nunit = "rad"\n[accel]\ncolumns = [5, 6, 7]\nunit = "m/s"\n'


@pytest.mark.parametrize(
    ("name", "text", "keys"),
    [
        ("log.csv", rows(separator=","), ""),
        ("log.txt", rows(separator="   ").replace("\n", "\n  "), 'delimiter = "whitespace"\n'),
        ("log.dat", rows(separator=" \t ", before="t w f\ns rad m/s\n"), 'delimiter = "whitespace"\nskip_lines = 2\n'),
        ("log.tsv", rows(separator="\t"), 'delimiter = "\\t"\n'),
        ("log.csv", rows(separator=",").replace("\n", "\r\n"), ""),
    ],
)
def test_text_without_names_has_numbered_columns(tmp_path, name, text, keys):
    (tmp_path / name).write_text(text, newline="")
    (tmp_path / "log.toml").write_text(NUMBERED.format(keys))
    check(read_log(tmp_path / name, tmp_path / "log.toml"))


def test_names_may_stand_below_a_comment_behind_a_mark_and_among_blanks(tmp_path):
    names = "time_s, " + ", ".join(own_table().column_names[1:]) + "\n"
    (tmp_path / "log.csv").write_text("\ufeff" + rows(separator=", ", names=names), encoding="utf-8")
    check(read_log(tmp_path / "log.csv"))
    (tmp_path / "log.csv").write_text(rows(separator=",", names=names, before="# unit 7\n"))
    (tmp_path / "log.toml").write_text("skip_lines = 1\n")
    check(read_log(tmp_path / "log.csv", tmp_path / "log.toml"))
    (tmp_path / "log.txt").write_text(rows(separator="  ", names=names.replace(",", "  ")))
    (tmp_path / "log.toml").write_text('delimiter = "whitespace"\n')
    check(read_log(tmp_path / "log.txt", tmp_path / "log.toml"))


def test_uneven_times_weigh_rates_by_their_own_intervals(tmp_path):
    uneven = np.array([0.01, 0.02, 0.05])
    np.savez(tmp_path / "log.npz", t=uneven, w=GYRO / [[0.01], [0.01], [0.03]], f=ACCEL / [[0.01], [0.01], [0.03]])
    (tmp_path / "log.toml").write_text(
        'kind = "rates"\ntime = "t"\n[gyro]\ncolumns = "w"\nunit = "rad/s"\n[accel]\ncolumns = "f"\nunit = "m/s^2"\n'
    )
    imu = read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    np.testing.assert_allclose(imu.time, [0.0, *uneven], rtol=0, atol=1e-12)
    np.testing.assert_allclose(imu.dtheta, GYRO, rtol=1e-12)
    np.testing.assert_allclose(imu.dvel, ACCEL, rtol=1e-12)


# Of one turn, one gravity: by hand, or from the definition of the unit.
@pytest.mark.parametrize(
    ("triad", "kind", "unit", "value", "si"),
    [
        ("gyro", "increments", "rad", 1.0, 1.0),
        ("gyro", "increments", "mrad", 1000.0, 1.0),
        ("gyro", "increments", "urad", 1e6, 1.0),
        ("gyro", "increments", "deg", 360.0, 2 * np.pi),
        ("gyro", "increments", "arcsec", 1296000.0, 2 * np.pi),
        ("gyro", "rates", "rad/s", 1.0, 1.0),
        ("gyro", "rates", "mrad/s", 1000.0, 1.0),
        ("gyro", "rates", "deg/s", 360.0, 2 * np.pi),
        ("gyro", "rates", "deg/h", 360.0 * 3600.0, 2 * np.pi),
        ("accel", "increments", "m/s", 9.80665, 9.80665),
        ("accel", "increments", "mm/s", 9806.65, 9.80665),
        ("accel", "increments", "ft/s", 1.0, 0.3048),
        ("accel", "increments", "g*s", 1.0, 9.80665),
        ("accel", "rates", "m/s^2", 9.80665, 9.80665),
        ("accel", "rates", "ft/s^2", 1.0, 0.3048),
        ("accel", "rates", "g", 1.0, 9.80665),
        ("accel", "rates", "mg", 1000.0, 9.80665),
    ],
)
def test_every_unit(tmp_path, triad, kind, unit, value, si):
    units = {"gyro": "rad", "accel": "m/s"} if kind == "increments" else {"gyro": "rad/s", "accel": "m/s^2"}
    units[triad] = unit
    np.savez(tmp_path / "log.npz", t=[1.0, 2.0], x=np.full((2, 3), value))
    (tmp_path / "log.toml").write_text(
        f'kind = "{kind}"\ntime = "t"\n'
        + "".join(f'[{name}]\ncolumns = "x"\nunit = "{units[name]}"\n' for name in units)
    )
    imu = read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    np.testing.assert_allclose(imu.dtheta if triad == "gyro" else imu.dvel, si, rtol=1e-14)


@pytest.mark.parametrize(
    ("axes", "of_forward_right_down"),
    [
        (["right", "forward", "up"], [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        (["forward", "left", "up"], [[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
        (["up", "right", "backward"], None),  # left-handed
        (["up", "left", "backward"], [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]),
        (["backward", "left", "down"], [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]),
    ],
)
def test_axes(tmp_path, axes, of_forward_right_down):
    """Three samples, each along one axis of the log, in forward-right-down by hand."""
    np.savez(tmp_path / "log.npz", t=[1.0, 2.0, 3.0], x=np.eye(3))
    (tmp_path / "log.toml").write_text(
        f'time = "t"\naxes = {axes}\n[gyro]\ncolumns = "x"\nunit = "rad"\n[accel]\ncolumns = "x"\nunit = "m/s"\n'
    )
    if of_forward_right_down is None:
        with pytest.raises(InputError, match="right-handed"):
            read_log(tmp_path / "log.npz", tmp_path / "log.toml")
        return
    imu = read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    np.testing.assert_array_equal(imu.dtheta, of_forward_right_down)
    np.testing.assert_array_equal(imu.dvel, of_forward_right_down)


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
        ('time = "t"\n' + TRIADS.replace('"f"', '"text"'), "sample 1: the column 'text' holds 'y', not a number."),
        ('time = "t"\n' + TRIADS.replace('"f"', '"gap"'), "sample 1"),
        ('time = "back"\n' + TRIADS, "sample 2"),
        ("time = 1\n" + TRIADS, "some columns are named and others numbered"),
        ('time = "t"\n' + TRIADS.replace('"c"', "0"), "columns"),
        (NUMBERED.format(""), "numbers are for text files"),
    ],
)
def test_mistakes_are_named(tmp_path, description, text):
    table = pa.table(
        dict.fromkeys("tabcdef", ENDS)
        | {"text": ["1", "y", "z"], "gap": pa.array([1.0, None, 2.0]), "back": [0.01, 0.02, 0.015]}
    )
    parquet.write_table(table, tmp_path / "log.parquet")
    (tmp_path / "log.toml").write_text(description)
    with pytest.raises(InputError) as info:
        read_log(tmp_path / "log.parquet", tmp_path / "log.toml")
    assert text in str(info.value)


def archive(numbers=b"3" * 400):
    """Return an .npz file of one array whose bytes are these, or of none."""
    file = io.BytesIO()
    np.savez(file, **({"a": np.frombuffer(numbers)} if numbers else {}))
    return file.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("log.bin", b"", ".parquet or .npz"),
        ("log.csv", b"", "cannot be read"),
        ("log.parquet", b"PAR1 but not really", "cannot be read"),
        ("log.npz", b"PK but not really", "cannot be read"),
        ("log.csv", b"time_s,dtheta_x_rad\n1,2\n", "unknown column"),
        ("log.csv", (",".join(own_table().column_names) + "\n").encode(), "no samples"),
        ("log.csv", (",".join(own_table().column_names) + "\n" + "1,0,0,0,0,0,0\n").encode(), "1 sample;"),
        ("log.csv", b"a,b\n1,2\n3,4,5\n", "delimiter and skip_lines"),
        ("log.csv", b"time_s,dtheta_x_rad\ns,rad\n1,2\n", "holds 'rad', not a number. If it belongs to a heading"),
        ("log.csv", b"a,b\n1,2\n", "Its own are a, b: say in a TOML file what they hold (--columns)"),
        ("log.npz", b"", "no archive of arrays, as numpy.savez writes one"),
        ("log.npz", archive()[:400], "no archive of arrays"),
        ("log.npz", archive().replace(b"3" * 20, b"4" * 20), "Bad CRC-32"),
        ("log.npz", archive(b""), "Its own are none"),
    ],
)
def test_unreadable_files_are_named(tmp_path, name, content, text):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as info:
        read_log(tmp_path / name)
    assert text in str(info.value)
    assert name in str(info.value)


def test_a_number_beyond_the_last_column_is_named(tmp_path):
    (tmp_path / "log.csv").write_text("1,2,3\n4,5,6\n")
    (tmp_path / "log.toml").write_text(NUMBERED.format(""))
    with pytest.raises(InputError, match="there is no column 4; it has 3 columns"):
        read_log(tmp_path / "log.csv", tmp_path / "log.toml")


def test_a_missing_file_is_named(tmp_path):
    for suffix in ("csv", "parquet", "npz"):
        with pytest.raises(InputError, match="cannot be read: No such file or directory"):
            read_log(tmp_path / f"nothing.{suffix}")
