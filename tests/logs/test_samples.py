"""Recorded logs: every format, unit and set of axes, and what is wrong with a file."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv, parquet

from sinssim.errors import InputError, SinssimWarning
from sinssim.logs.imu_samples import read_log, read_samples

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


def test_dates_need_no_unit(tmp_path):
    """A second between two numbers may be a millisecond; between two dates it is a second."""
    (tmp_path / "log.toml").write_text(NUMBERED.format(""))
    dates, numbers = (
        "".join(f"{first}{second}{last},0,0,0,0,0,0.1\n" for second in (7, 8, 9))
        for first, last in (("2025-07-04 17:24:4", "+00:00"), ("", ""))
    )
    (tmp_path / "log.csv").write_text(dates)
    assert np.diff(read_log(tmp_path / "log.csv", tmp_path / "log.toml").time).tolist() == [1.0, 1.0, 1.0]
    (tmp_path / "log.csv").write_text(numbers)
    with pytest.raises(InputError, match="the times in 1 are 1 apart, which in seconds is slow"):
        read_log(tmp_path / "log.csv", tmp_path / "log.toml")


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
        f'kind = "{kind}"\ntime = "t"\ntime_unit = "s"\n'
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
        f'time = "t"\ntime_unit = "s"\naxes = {axes}\n'
        '[gyro]\ncolumns = "x"\nunit = "rad"\n[accel]\ncolumns = "x"\nunit = "m/s"\n'
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
        (NUMBERED.format(""), "only text files without names"),
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
    np.savez(file, **({"time_s": np.frombuffer(numbers)} if numbers else {}))
    return file.getvalue()


def arrays(**columns):
    file = io.BytesIO()
    np.savez(file, **columns)
    return file.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("log.bin", b"", ".parquet or .npz"),
        ("log.csv", b"", "holds no samples: it has no lines"),
        ("log.parquet", b"PAR1 but not really", "cannot be read"),
        ("log.npz", b"PK but not really", "cannot be read"),
        ("log.csv", b"time_s,dtheta_x_rad\n1,2\n", "unknown column"),
        ("log.csv", (",".join(own_table().column_names) + "\n").encode(), "no samples"),
        ("log.csv", (",".join(own_table().column_names) + "\n" + "1,0,0,0,0,0,0\n").encode(), "1 sample;"),
        (
            "log.csv",
            b"a,b\n1,2\n\n3,4,5\n",
            "line 4: it has 3 fields; 2 separated by ',' are needed, as in line 1 (skip_lines = 0)",
        ),
        ("log.csv", b"time_s,dtheta_x_rad\ns,rad\n1,2\n", "holds 'rad', not a number. If it belongs to a heading"),
        ("log.csv", b"a,b\n1,2\n", "Its columns are a, b: describe them in a TOML file (--columns)"),
        ("log.npz", b"", "not an archive of arrays as written by numpy.savez"),
        ("log.npz", archive()[:400], "not an archive of arrays"),
        ("log.npz", archive().replace(b"3" * 20, b"4" * 20), "Bad CRC-32"),
        ("log.npz", archive(b""), "Its columns are none"),
        ("log.csv", "time_s,ω\n1,2\n".encode("utf-16"), "line 1: this is not text in UTF-8; it looks like UTF-16"),
        ("log.csv", b"time_s,\xb0/s\n1,2\n", "line 1: the line of names is not in UTF-8, its byte 8 is 0xb0"),
        ("log.csv", b"\x00\x01\x02", "line 1: this is not text"),
        ("log.csv", b"dtheta_x_rad,dtheta_x_rad\n1,2\n", "has 2 columns 'dtheta_x_rad'; one is needed"),
        (
            "log.npz",
            arrays(dtheta_x_rad=np.float64(3.0)),
            "the column 'dtheta_x_rad' has shape (); one number per sample",
        ),
        ("log.npz", arrays(dtheta_x_rad=np.ones((4, 2))), "shape (4, 2)"),
        ("log.npz", arrays(dtheta_x_rad=np.ones(4, complex)), "holds complex numbers"),
        ("log.npz", arrays(dtheta_x_rad=np.zeros(4, "M8[ms]")), "holds dates or times (datetime64[ms])"),
        ("log.npz", arrays(dtheta_x_rad=np.ones(4, bool)), "holds true and false"),
        ("log.npz", arrays(dtheta_x_rad=np.array([None, 1])), "allow_pickle"),
        ("log.npz", arrays(dtheta_x_rad=np.array(["1", "2", "x"])), "sample 2: the column 'dtheta_x_rad' holds"),
    ],
)
def test_unreadable_files_are_named(tmp_path, name, content, text):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as info:
        read_log(tmp_path / name)
    assert text in str(info.value)
    assert name in str(info.value)


def test_words_in_a_vector_are_named_by_their_sample(tmp_path):
    """The fifth of rows of three numbers lies in the second row, which is sample 1."""
    np.savez(tmp_path / "log.npz", w=[["1", "2", "3"], ["4", "x", "6"], ["7", "8", "9"]], f=np.eye(3))
    (tmp_path / "log.toml").write_text(
        'rate_hz = 100.0\n[gyro]\ncolumns = "w"\nunit = "rad"\n[accel]\ncolumns = "f"\nunit = "m/s"\n'
    )
    with pytest.raises(InputError, match=r"log\.npz, sample 1: the column 'w' holds 'x', not a number"):
        read_log(tmp_path / "log.npz", tmp_path / "log.toml")


def test_a_number_beyond_the_last_column_is_named(tmp_path):
    (tmp_path / "log.csv").write_text("1,2,3\n4,5,6\n")
    (tmp_path / "log.toml").write_text(NUMBERED.format(""))
    with pytest.raises(InputError, match="there is no column 4; it has 3 columns"):
        read_log(tmp_path / "log.csv", tmp_path / "log.toml")


def test_a_missing_file_is_named(tmp_path):
    for suffix in ("csv", "parquet", "npz"):
        with pytest.raises(InputError, match="cannot be read: No such file or directory"):
            read_log(tmp_path / f"nothing.{suffix}")


OWN_NAMES = ",".join(own_table().column_names) + "\n"


@pytest.mark.parametrize(
    ("before", "row", "text"),
    [
        ("", "0.03,1,2,x,4,5,6\n", r"log.csv, sample 2 \(line 4\): the column 'dtheta_z_rad' holds 'x', not a number"),
        ("", "\n0.03,1,2,,4,5,6\n", r"log.csv, sample 2 \(line 5\): the column 'dtheta_z_rad' is empty or not finite"),
        ("rig 7\n", "0.015,1,2,3,4,5,6\n", r"log.csv, sample 2 \(line 5\): the time 0.015 s is not later than 0.02"),
        (
            "rig 7\n",
            "0.03,1,2\n0.04,0,0,0,0,0,0\n",
            r"log.csv, line 5: it has 3 fields; 7 separated by ',' are needed, as",
        ),
        (
            "",
            "0.03,1e4,2,3,4,5,6\n",
            r"sample 2 \(line 4\): the gyros read 1e\+06 rad/s, but no such sensor exceeds 100000",
        ),
    ],
)
def test_what_is_wrong_in_a_text_file_is_named_by_its_line(tmp_path, before, row, text):
    (tmp_path / "log.csv").write_text(before + OWN_NAMES + "0.01,0,0,0,0,0,0\n0.02,0,0,0,0,0,0\n" + row)
    (tmp_path / "log.toml").write_text(f"skip_lines = {before.count(chr(10))}\n")
    with pytest.raises(InputError, match=text):
        read_log(tmp_path / "log.csv", tmp_path / "log.toml")


def test_a_line_of_names_in_latin_1_can_be_skipped(tmp_path):
    (tmp_path / "log.csv").write_bytes(rows(separator=",", names="t,°/s\n").encode("latin-1"))
    (tmp_path / "log.toml").write_text(NUMBERED.format("skip_lines = 1\n"))
    check(read_log(tmp_path / "log.csv", tmp_path / "log.toml"))


def test_more_lines_skipped_than_there_are(tmp_path):
    (tmp_path / "log.csv").write_text(rows(separator=","))
    for lines, text in ((4, "has 3 lines; skip_lines = 4 skips all"), (10**12, "must be at most 1e\\+06")):
        (tmp_path / "log.toml").write_text(NUMBERED.format(f"skip_lines = {lines}\n"))
        with pytest.raises(InputError, match=text):
            read_log(tmp_path / "log.csv", tmp_path / "log.toml")


def test_a_time_column_of_one_column_is_one(tmp_path):
    names = own_table().column_names[1:]
    columns = dict(zip(names, np.hstack([GYRO, ACCEL]).T, strict=True))
    np.savez(tmp_path / "log.npz", time_s=ENDS[:, None], **columns)
    check(read_log(tmp_path / "log.npz"))


RATES = 'kind = "rates"\n[gyro]\ncolumns = "w"\nunit = "deg/s"\n'


@pytest.mark.parametrize(
    ("name", "step", "key", "unit"),
    [
        ("t", 0.01, "", 1.0),
        ("t", 10.0, 'time_unit = "ms"', 1e-3),
        ("t", 10.0, 'time_unit = "s"', 1.0),  # means of ten seconds
        ("t_ms", 10.0, "", 1e-3),
        ("time [us]", 1e4, "", 1e-6),
        ("TimeUS", 1e4, "", 1e-6),
        ("stamp(nsec)", 1e7, "", 1e-9),
        ("gps_s", 10.0, "", 1.0),
        ("gps", 10.0, None, "Give their unit"),
        ("t", 10.0, None, 'Give their unit: time_unit = "ms"'),
        ("t_ms", 10.0, 'time_unit = "s"', "contradicts the name of the column, 't_ms', which gives ms"),
        ("t", 0.01, 'time_unit = "ms"', "1e\\+05 samples per second, but no sensor gives more than 20000"),
    ],
)
def test_the_unit_of_time_is_not_taken_for_granted(tmp_path, name, step, key, unit):
    """Milliseconds that are read as seconds make rates of 10 ms hold for 10 s."""
    np.savez(tmp_path / "log.npz", **{name: step * np.arange(1.0, 4.0), "w": np.ones((3, 3)), "f": np.ones((3, 3))})
    (tmp_path / "log.toml").write_text(f'time = "{name}"\n{key or ""}\n{RATES}[accel]\ncolumns = "f"\nunit = "g"\n')
    if isinstance(unit, str):
        with pytest.raises(InputError, match=unit):
            read_log(tmp_path / "log.npz", tmp_path / "log.toml")
        return
    imu = read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    np.testing.assert_allclose(np.diff(imu.time), step * unit, rtol=1e-12)
    np.testing.assert_allclose(imu.dtheta, np.pi / 180.0 * step * unit, rtol=1e-12)


def test_gyros_alone_need_no_word_on_accelerometers(tmp_path):
    np.savez(tmp_path / "log.npz", t=ENDS, w=np.ones((3, 3)))
    (tmp_path / "log.toml").write_text('time = "t"\n' + RATES)
    samples = read_samples(tmp_path / "log.npz", tmp_path / "log.toml")
    assert list(samples.triads) == ["gyro"]
    np.testing.assert_allclose(samples.triads["gyro"], np.pi / 180.0, rtol=1e-15)
    with pytest.raises(
        InputError, match=r"log.toml does not describe the accelerometers, which are needed: add .* \[accel\]"
    ):
        read_log(tmp_path / "log.npz", tmp_path / "log.toml")
    (tmp_path / "log.toml").write_text('time = "t"\nkind = "rates"\n')
    with pytest.raises(InputError, match=r'kind = "rates" needs a table \[gyro\] or \[accel\]'):
        read_samples(tmp_path / "log.npz", tmp_path / "log.toml")


@pytest.mark.parametrize("suffix", ["npz", "parquet", "csv", "txt"])
def test_what_does_not_fit_into_memory_is_not_read(tmp_path, monkeypatch, suffix):
    """A file of zeros packs a thousand to one; its size on the disk tells nothing."""
    count = 20_000
    columns = {name: np.zeros(count) for name in own_table().column_names}
    columns["time_s"] = 0.01 * np.arange(count)
    log, memory = tmp_path / f"log.{suffix}", 8 * 7 * count  # as much as the numbers alone
    if suffix == "npz":
        np.savez_compressed(log, **columns)
    elif suffix == "parquet":
        parquet.write_table(pa.table(columns), log)
    else:
        csv.write_csv(pa.table(columns), log)
    (tmp_path / "log.toml").write_text('delimiter = "whitespace"\n' if suffix == "txt" else "")
    monkeypatch.setattr("sinssim.logs.column_tables.machine_memory", lambda: memory)
    with pytest.raises(InputError, match=rf"log.{suffix} would need .* GB of memory; this machine has 0.00112"):
        read_log(log, tmp_path / "log.toml")


def test_columns_that_are_not_used_are_not_read(tmp_path, monkeypatch):
    names = own_table().column_names
    columns = {name: own_table()[name].to_numpy() for name in names} | {"huge": np.zeros(1_000_000)}
    np.savez_compressed(tmp_path / "log.npz", **columns)
    monkeypatch.setattr("sinssim.logs.column_tables.machine_memory", lambda: 100_000)
    check(read_log(tmp_path / "log.npz"))


def test_a_header_that_promises_more_than_there_is(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.npz", "w") as archive, archive.open("dtheta_x_rad.npy", "w") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": (4_000_000_000_000,)}
        np.lib.format.write_array_header_1_0(file, header)
        file.write(np.zeros(4).tobytes())
    with pytest.raises(InputError, match=r"the array dtheta_x_rad.npy of shape \(4000000000000,\) is incomplete"):
        read_log(tmp_path / "log.npz")


def test_a_last_line_that_was_cut_off_is_left_out(tmp_path):
    """A recorder that loses its power leaves part of a line; a short line elsewhere is refused."""
    rows = [f"{0.01 * k:.2f},0,0,0,0,0,-0.098" for k in range(20)]
    head = "time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dvel_x_mps,dvel_y_mps,dvel_z_mps"
    path = tmp_path / "log.csv"
    path.write_text("\n".join([head, *rows, "0.20,0,0"]))
    with pytest.warns(SinssimWarning, match="line 22: the last row was cut short"):
        assert len(read_log(path).time) == 21
    path.write_text("\n".join([head, *rows[:5], "0.05,0,0", *rows[6:]]) + "\n")
    with pytest.raises(InputError, match=r"line 7: it has 3 fields"):
        read_log(path)
