"""Files of further recorders: quoted text, rates about named axes, counts, lost rows, fixes repeated in rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.text_columns import read_table, time_column
from sinssim.errors import InputError
from sinssim.logs.column_names import axis, quantity, triads
from tests.analyses.inspection.test_loggers import _COUNT, _G, _RATE, _place, _read, _rows, _same, _unit


def test_rates_about_named_axes_are_a_triad() -> None:
    assert triads(["rollrate", "pitchrate", "yawrate", "roll", "pitch", "yaw"]) == [(0, 1, 2)]
    assert triads(["gyro_yaw", "gyro_pitch", "gyro_roll"]) == [(2, 1, 0)]
    assert quantity("raw_angular_rate_x_deg_per_s") == "gyro" == quantity("ar_x [rad/s]")
    assert axis("raw_acceleration_y_gs") == ("raw_acceleration_*_gs", 1)


def test_a_quoted_sentence_with_commas_is_one_field(tmp_path: Path) -> None:
    at, place = _place()
    rows: list[list[object]] = [
        [t, "GPS1", *p, "T", '"$GPGGA,180907.000,4220.2340,N,07105.3704,W,1,09,1.2,16.6,M,-33.8,M,,0000*55"']
        for t, p in zip(at, place, strict=True)
    ]
    path = _rows(tmp_path / "gps.csv", rows, ["stamp,frame_id,latitude,longitude,altitude,letter,gpgga_read"])
    time, rate, force = _unit()
    names = "stamp,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
    imu = _rows(tmp_path / "imu.csv", [[t, *f, *w] for t, f, w in zip(time, force, rate, strict=True)], [names])
    _, stream, fixes = _read(imu, path)
    _same(stream)
    assert fixes is not None
    np.testing.assert_allclose(fixes.latitude, np.radians(place[:, 0]), atol=1e-9)


def test_names_with_blanks_between_colons(tmp_path: Path) -> None:
    time, rate, force = _unit()
    rows: list[list[object]] = [["0xcb", *f, *w, t] for t, w, f in zip(time, rate, force / _G, strict=True)]
    names = "Header:  a_x [g]:  a_y [g]:  a_z [g]: ar_x [rad/s]: ar_y [rad/s]: ar_z [rad/s]:  Filtered ts[s]:"
    _, stream, _ = _read(_rows(tmp_path / "data.txt", rows, ["", "Inertial data.", "", names], "  "))
    _same(stream)


@pytest.mark.parametrize("name", ["n_samples", "Packet number", "field.header.seq"])
def test_a_count_is_no_time(tmp_path: Path, name: str) -> None:
    _, rate, force = _unit()
    rows: list[list[object]] = [[k, *w, *f] for k, (w, f) in enumerate(zip(rate, force, strict=True))]
    path = _rows(tmp_path / "imu.csv", rows, [f"{name},gyr_x,gyr_y,gyr_z,acc_x,acc_y,acc_z"])
    with pytest.raises(InputError, match=rf"no column \('{name}' is a count, no time\) increases.*rate_hz"):
        _read(path)


def test_counts_are_named(tmp_path: Path) -> None:
    time, rate, force = _unit()
    counts = np.rint(np.column_stack([force / _G * 16384, np.degrees(rate) * 131])).astype(int)
    rows: list[list[object]] = [[round(1e6 * t), *row] for t, row in zip(time, counts.tolist(), strict=True)]
    with pytest.raises(InputError, match="counts: 16384 of them per g are usual"):
        _read(_rows(tmp_path / "mpu.csv", rows, ["micros,ax,ay,az,gx,gy,gz"]))


def test_rows_of_zeros_and_of_one_triad_are_left_out(tmp_path: Path) -> None:
    """An exporter writes zeros for lost samples; a phone writes a row if one of the sensors has a sample."""
    time, rate, force = _unit()
    rows: list[list[object]] = [[t, *w, *f] for t, w, f in zip(time, rate, force, strict=True)]
    for k in range(20, _COUNT, 57):
        rows[k][1:] = [0.0] * 6
    for k in range(40, _COUNT, 57):
        rows[k][1:4] = ["", "", ""]
    kept = np.array([k for k in range(_COUNT) if (k - 20) % 57 and (k - 40) % 57])
    _, stream, _ = _read(_rows(tmp_path / "imu.csv", rows, ["time_s,gx,gy,gz,ax,ay,az"]))
    assert stream is not None
    np.testing.assert_allclose(stream.time - stream.time[0], time[kept] - time[0], atol=1e-9)
    np.testing.assert_allclose(stream.accel, force[kept], atol=1e-6)


def test_a_spinning_body_keeps_its_accelerometers(tmp_path: Path) -> None:
    """Gravity does not last in the axes of a rocket that spins under its parachute."""
    time, rate, force = _unit()
    angle = 3.0 * (time - time[0])
    turned = np.stack([_G * np.cos(angle), _G * np.sin(angle), 0.3 * force[:, 0]], axis=1)
    rate = rate + np.array([0.0, 0.0, 3.0])
    rows: list[list[object]] = [
        [1e3 * t, *(f / _G), *np.degrees(w)] for t, w, f in zip(time, rate, turned, strict=True)
    ]
    _, stream, _ = _read(_rows(tmp_path / "flight.csv", rows, ["timestamp_ms,ax,ay,az,gx,gy,gz"]))
    assert stream is not None
    np.testing.assert_allclose(stream.accel, turned, atol=1e-4)


def test_fixes_that_rows_of_a_slow_unit_repeat(tmp_path: Path) -> None:
    """A recorder of phones writes every 0.1 s, with the last fix; without names, the longitude comes first."""
    time, rate, force = _unit()
    every, (at, place) = slice(None, None, 5), _place()
    last = np.searchsorted(at, time[every] + 1e-9, side="right") - 1
    last -= last % 5  # a fix per second
    rows: list[list[object]] = [
        [t, *w, *f, *p] for t, w, f, p in zip(time[every], rate[every], force[every], place[last], strict=True)
    ]
    names = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,lat,lon,alt"
    _, _, fixes = _read(_rows(tmp_path / "phone.csv", rows, [names]))
    assert fixes is not None
    assert len(fixes) == len(np.unique(last))
    unnamed: list[list[object]] = [[1e3 * t, *f, *w, 110.0 + p[1], p[0], p[2]] for t, w, f, p in zip(
        time, rate, force, np.repeat(place, 10, axis=0), strict=True)]  # fmt: skip
    _, stream, fixes = _read(_rows(tmp_path / "copter.csv", unnamed, []))
    _same(stream)
    assert fixes is not None
    np.testing.assert_allclose(fixes.latitude, np.radians(place[:, 0]), atol=1e-9)


def test_magnetometer_and_lost_rows_do_not_hide_gravity(tmp_path: Path) -> None:
    """At rest, a constant magnetic field lasts, and so does the bias of the gyros; lost rows are noise of one axis."""
    rng = np.random.default_rng(5)
    force = np.array([0.9, -0.2, 9.76]) + rng.normal(0.0, 0.01, (_COUNT, 3))
    rate = np.array([-0.02, 0.02, 0.04]) + rng.normal(0.0, 0.01, (_COUNT, 3))
    field = np.array([-0.54, 0.22, -0.44]) + rng.normal(0.0, 0.001, (_COUNT, 3))
    values = np.column_stack([force, rate, field])
    values[::57] = 0.0
    rows: list[list[object]] = [[k / _RATE, *row] for k, row in enumerate(values.tolist())]
    found, stream, _ = _read(_rows(tmp_path / "mt.log", rows, [], "\t").rename(tmp_path / "mt.txt"))
    assert found.unit is not None
    assert found.unit[1].kind == "rates"
    assert stream is not None
    np.testing.assert_allclose(np.median(stream.accel, axis=0), [0.9, -0.2, 9.76], atol=0.01)
    np.testing.assert_allclose(np.median(stream.gyro, axis=0), [-0.02, 0.02, 0.04], atol=0.01)


def test_the_stamp_of_the_sensor_and_a_counter_that_looks_like_dates(tmp_path: Path) -> None:
    _, rate, force = _unit()
    stamps = 1279035037 + 2 * np.arange(_COUNT)  # ms since the start of a phone
    rows: list[list[object]] = [[s, *w, *f] for s, w, f in zip(stamps.tolist(), rate, force, strict=True)]
    path = _rows(tmp_path / "phone.csv", rows, ["timestamp,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"])
    assert time_column(read_table(path)) == (0, "ms", pytest.approx(0.002))
    late = 1575033823462017210 + (np.cumsum(np.random.default_rng(1).uniform(0.1, 0.26, _COUNT)) * 1e9).astype(int)
    own = 3131853105000 + 100_000_000 * np.arange(_COUNT)
    rows = [[s, o, *w, *f] for s, o, w, f in zip(late.tolist(), own.tolist(), rate, force, strict=True)]
    names = "%time,field.header.stamp,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
    found = time_column(read_table(_rows(tmp_path / "ros.csv", rows, [names])))
    assert found == (1, "ns", pytest.approx(0.1))
