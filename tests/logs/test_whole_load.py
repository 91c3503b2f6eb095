"""What a table [log] loads, file by file and number by number, in the run's time."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.earth.geodetic_coordinates import (
    enu_about,
    flipped,
    geodetic_about,
    level_turn,
    q_enu_flu,
    q_nb_from_enu_flu,
    swapped,
)
from sinssim.errors import InputError
from sinssim.logs import recorded_log as recorded
from sinssim.logs.gps_time import (
    FileClock,
    Instant,
    date_from_gps,
    date_of,
    file_clock,
    gps_from_unix,
    gps_instant,
    gps_seconds,
    leap_seconds,
    offset,
    unix_from_gps,
    week_and_seconds,
)
from sinssim.logs.log_settings import Log
from sinssim.logs.recorded_log import recorded_log
from sinssim.logs.recorded_streams import Clock, FixStream
from tests.logs.formats.whole import attitude

START = 1451260818
"""GPS time of 2026-01-01 00:00:00 UTC."""


def write(folder: Path, name: str, heads: str, rows: list[tuple[float, ...]]) -> str:
    (folder / name).write_text(heads + "\n" + "\n".join(",".join(map(repr, row)) for row in rows) + "\n")
    return str(folder / name)


def files(folder: Path) -> dict[str, Any]:
    """A unit of 8 samples from 10 s on, with a clock that runs fast by 4096 ppm; fixes, a reference and a barometer."""
    imu = [
        (START + 10.0 + 0.5 * k, 0.1 * k, -0.2 * k, 0.3 * k, 0.5 + k / 8.0, -0.25, -9.75) for k in range(8)
    ]  # fmt: skip
    gyro, accel = "gyro_x_radps,gyro_y_radps,gyro_z_radps", "accel_x_mps2,accel_y_mps2,accel_z_mps2"
    place = "latitude_rad,longitude_rad,height_m"
    fixes = [(START + 9.0 + k, 0.5 + 0.01 * k, -1.5 - 0.01 * k, 100.0 + k, 0.5, 0.75, 1.25 + k) for k in range(6)]
    angles = (10.5, -20.25, 130.75)
    q = attitude([angles])[0].tolist()
    rows = [(START + 4.5 + k, 0.6, -1.25, 200.0 + k, 1.5, -2.5, 3.5, *q) for k in range(16)]
    velocity = "velocity_n_mps,velocity_e_mps,velocity_d_mps"
    return {
        "imu": {
            "file": write(folder, "imu.csv", f"gps_s,{gyro},{accel}", imu), "time_offset_s": 0.25,
            "clock_drift_ppm": 4096.0, "max_gap_s": 2.0,
        },
        "gnss": {
            "file": write(folder, "gnss.csv", f"gps_s,{place},sigma_n_m,sigma_e_m,sigma_d_m", fixes),
            "time_offset_s": -0.125, "geoid_height_m": 45.5, "lever_arm_m": [0.5, -0.25, -1.5],
        },
        "reference": {
            "file": write(folder, "ref.csv", f"gps_s,{place},{velocity},q_nb_w,q_nb_x,q_nb_y,q_nb_z", rows),
            "time_offset_s": 0.5, "geoid_height_m": -4.5, "lever_arm_m": [0.25, 0.5, -0.75], "gap_s": 2.5,
            "velocity_delay_s": 0.125, "position_sigma_m": [0.5, 0.25, 0.75],
        },
        "others": [{
            "file": write(folder, "baro.csv", "gps_s,alt", [(START + 8.5 + 1.25 * k, 1000.0 + k) for k in range(6)]),
            "name": "baro", "kind": "baro-height", "time": "gps_s", "clock": "utc",
            "first_row": "2026-01-01 00:00:08.5",
            "reading": {"column": "alt", "unit": "ft"}, "sigma": {"value": 2.0, "unit": "ft"}, "time_offset_s": 0.0625,
        }],
    }  # fmt: skip


def test_every_stream_in_the_run_s_time(tmp_path: Path) -> None:
    """The time 0 is the unit's first stamp and its offset, 10.25 s: fixes at 9 − 0.125 + k s are then at −1.375 + k s.

    The unit's own times are divided by 1.004096; the run lasts 3.5/1.004096 = 3.4857 s. Of the fixes the second to
    the fifth are within, of the reference those up to 5 s before and after, at −5.25 + k s.
    """
    section = Log.model_validate({**files(tmp_path), "outages": {"at_s": [[1.0, 2.0]]}})
    log = recorded_log(section, (5.0, -6.0, 30.0))
    slow = 1.004096
    np.testing.assert_allclose(log.imu.time, 0.5 * np.arange(8) / slow, rtol=1e-12)
    middle = (np.arange(7) + 0.5)[:, None] * 0.5 / slow
    np.testing.assert_allclose(log.imu.dtheta, middle * np.array([0.1, -0.2, 0.3]), rtol=1e-12)
    force = np.column_stack([0.5 + (np.arange(7) + 0.5) / 8.0, np.full(7, -0.25), np.full(7, -9.75)])
    np.testing.assert_allclose(log.imu.dvel, force * 0.5 / slow, rtol=1e-12)
    assert log.rate_hz == pytest.approx(2.0 * slow, rel=1e-12)
    assert log.zero == Instant(START + 10, 0.25)
    assert log.notes == (
        "The run's time 0 is 2026-01-01 00:00:28.250 GPST, the instant of the inertial unit's first row.",
    )
    assert (log.outages, log.passes, log.bridged, log.axes) == (((1.0, 2.0),), (), None, ("forward", "right", "down"))
    k = np.arange(2, 5)
    assert log.fixes is not None
    np.testing.assert_allclose(log.fixes.time, -1.375 + k, atol=1e-9)
    np.testing.assert_allclose(log.fixes.height, 145.5 + k)
    np.testing.assert_allclose(log.fixes.latitude, 0.5 + 0.01 * k)
    place, baro = (one.measurements for one in log.sensed)
    np.testing.assert_allclose(place.time, [0.625, 2.625], atol=1e-9)  # that at 1.625 s is withheld
    np.testing.assert_allclose(place.value, [[0.52, -1.52, 147.5], [0.54, -1.54, 149.5]])
    np.testing.assert_allclose(place.sigma, [[0.5, 0.75, 3.25], [0.5, 0.75, 5.25]])
    assert place.lever_arm.tolist() == [0.5, -0.25, -1.5]
    # its first row is 8.5 s after the new year in UTC: −1.75 + 0.0625 + 1.25 k s in the run
    np.testing.assert_allclose(baro.time, [0.8125, 2.0625, 3.3125], atol=1e-9)
    np.testing.assert_allclose(baro.value[:, 0], np.array([1002.0, 1003.0, 1004.0]) * 0.3048)
    np.testing.assert_allclose(baro.sigma[:, 0], 0.6096)
    lasts = 3.5 / slow
    assert log.rates == {"gnss-position": pytest.approx(3.0 / lasts), "baro": pytest.approx(3.0 / lasts)}
    r = log.reference
    assert r is not None
    assert (r.name, r.lever_arm, r.gap, r.knows) == (
        "ref.csv",
        (0.25, 0.5, -0.75),
        2.5,
        ("position", "velocity", "attitude"),
    )
    k = np.arange(1, 14)
    np.testing.assert_allclose(r.time, -5.25 + k, atol=1e-9)
    np.testing.assert_allclose(r.height, 195.5 + k)
    assert r.velocity_time is not None
    np.testing.assert_allclose(r.velocity_time, -5.375 + k, atol=1e-9)
    np.testing.assert_array_equal(r.velocity_ned, [[1.5, -2.5, 3.5]] * 13)
    np.testing.assert_array_equal(r.position_sigma, [[0.5, 0.25, 0.75]] * 13)
    block = Rotation.from_euler("ZYX", [130.75, -20.25, 10.5], degrees=True) * Rotation.from_euler(
        "ZYX", [30.0, -6.0, 5.0], degrees=True
    )
    assert r.q_nb is not None
    found = Rotation.from_quat(r.q_nb[0], scalar_first=True)
    np.testing.assert_allclose(found.as_matrix(), block.as_matrix(), atol=1e-12)


def test_a_part_of_a_run_and_a_wrong_scale(tmp_path: Path) -> None:
    tables = files(tmp_path)
    section = Log.model_validate({"imu": {**tables["imu"], "clock_drift_ppm": 0.0}, "from_s": 0.5, "to_s": 2.75})
    np.testing.assert_allclose(recorded_log(section).imu.time, [0.5, 1.0, 1.5, 2.0, 2.5])
    with pytest.raises(
        InputError,
        match=r"from_s = 3\.25 and to_s = 3\.5 leave 1 samples; the file covers 0 to "
        r"3\.500 s",
    ):
        recorded_log(section.model_copy(update={"from_s": 3.25, "to_s": 3.5}))
    text = (tmp_path / "imu.csv").read_text()
    (tmp_path / "imu.csv").write_text(text.replace(repr(START + 11.0), repr(START + 11.125)))
    log = recorded_log(section)
    np.testing.assert_allclose(log.imu.time, [0.5, 1.125, 1.5, 2.0, 2.5])
    assert log.rate_hz == pytest.approx(2.0), "by the usual interval"
    for force, fits in ((14.6, True), (14.8, False), (6.9, True), (6.8, False)):
        (tmp_path / "imu.csv").write_text(text.replace("-9.75", repr(-force)))
        if fits:
            recorded_log(section)
        else:
            with pytest.raises(InputError, match=r"the specific force is (14\.8|6\.8)\d* m/s² \(median\)"):
                recorded_log(section)


def test_gps_time_by_hand() -> None:
    """Seconds from 1980-01-06: the first leap second of all, the last one, and weeks that are not rounded."""
    assert gps_from_unix(315964800.0 + 100.0) == 100.0
    assert gps_from_unix(np.array([362793599.5, 362793600.5])).tolist() == [46828799.5, 46828801.5]  # 1981-07-01
    assert unix_from_gps(np.array([46828799.5, 46828800.5, 46828801.5])).tolist() == [
        362793599.5, 362793600.5, 362793600.5,
    ]  # fmt: skip
    assert leap_seconds(np.array([0.0, 1483228799.9, 1483228800.0])).tolist() == [0.0, 17.0, 18.0]
    assert week_and_seconds(2399 * 604800 + 12.3456789) == (2399, pytest.approx(12.345679, abs=1e-9))
    assert week_and_seconds(604799) == (0, 604799)
    assert str(date_from_gps(START + 0.25)) == "2026-01-01 00:00:00.250000+00:00"


@pytest.mark.parametrize(
    ("text", "seconds", "zone"),
    [
        ("2026-01-01T00:00:10.25Z", START + 10.25, True),
        ("2026-01-01 05:30:10,5 +05:30", START + 10.5, True),
        ("2025-12-31T20:29:50-0330", START - 10.0, True),
        ("2025-12-31T21:00-03", START, True),
        ("2026-01-01T00:00:10", START + 10.0, False),
        ("2016-12-31T23:59:60.5Z", 13510 * 86400 + 17.5, True),
    ],
)
def test_times_of_iso_8601(text: str, seconds: float, zone: bool) -> None:
    """The leap second of 2016 is the one before GPS time 13 510 days and 18 s."""
    assert gps_seconds(text) == (pytest.approx(seconds, abs=1e-6), zone)


def test_clocks_with_fractions_of_a_second() -> None:
    """Offsets of dates with fractions; a first row of 7.25 s at 12.5 s of a date is a zero of 5.25 s."""
    first = gps_instant("2026-01-01 00:00:30.5")
    assert first == Instant(START + 12, 0.5)
    own = file_clock(Clock("machine"), 7.25, first)
    assert own.zero == Instant(START + 12, -6.75)
    dated = file_clock(Clock("gps", START + 3), 99.0, None)
    assert dated.zero == Instant(START + 3, 0.0)
    assert offset(own, dated, "x", 1.0) == pytest.approx(-9.0 + 6.75)
    assert offset(dated, own, "x", 1.0) == pytest.approx(9.0 - 6.75)
    assert file_clock(Clock("gps"), 1.0, None).zero is None
    # seconds of the week near its end, when the other clock's zero is early in the next one
    week = FileClock(Clock("gps"), None)
    late = FileClock(Clock("gps"), Instant(2400 * 604800 + 10, 0.25))
    assert offset(late, week, "x", 604795.0) == pytest.approx(-604800.0 - 10.25)
    assert offset(late, week, "x", 20.0) == pytest.approx(-10.25)
    assert date_of(Instant(START, 0.9994)) == "2026-01-01 00:00:18.999 GPST"
    assert gps_instant("2026-01-01T00:00:12.75", "utc") == Instant(START + 12, 0.75)


def test_axes_of_other_programs() -> None:
    """By rotation matrices of another library; a metre east, north and up of a place on the equator."""
    v = np.array([[1.0, -2.0, 3.0], [4.0, 5.0, -6.0]])
    assert swapped(v).tolist() == [[-2.0, 1.0, -3.0], [5.0, 4.0, 6.0]]
    assert flipped(v).tolist() == [[1.0, 2.0, -3.0], [4.0, -5.0, 6.0]]
    angles = [[10.5, -20.25, 130.75], [-170.5, 35.5, 290.25]]
    enu_ned, frd_flu = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.diag([1.0, -1.0, -1.0])
    c_nb = Rotation.from_quat(attitude(angles), scalar_first=True).as_matrix()
    ros = Rotation.from_matrix(enu_ned @ c_nb @ frd_flu)
    found = Rotation.from_quat(q_enu_flu(attitude(angles)), scalar_first=True)
    np.testing.assert_allclose(found.as_matrix(), ros.as_matrix(), atol=1e-14)
    back = Rotation.from_quat(q_nb_from_enu_flu(ros.as_quat(scalar_first=True)), scalar_first=True)
    np.testing.assert_allclose(back.as_matrix(), c_nb, atol=1e-14)
    origin = (0.0, 0.5, 100.0)
    a, e2 = 6378137.0, 0.0066943799901413165
    # 3 m along the equator, a latitude of 4 m by the meridian's radius, and 5 m up
    latitude, longitude = np.array([4.0 / (a * (1.0 - e2) + 105.0)]), np.array([0.5 + 3.0 / (a + 105.0)])
    enu = enu_about(origin, latitude, longitude, np.array([105.0]))
    np.testing.assert_allclose(enu, [[3.0, 4.0, 5.0]], atol=3e-6)
    found = geodetic_about(origin, np.array([[3.0, 4.0, 5.0]]))
    np.testing.assert_allclose([found[0][0], found[1][0] - 0.5], [latitude[0], longitude[0] - 0.5], atol=1e-12)
    assert found[2][0] == pytest.approx(105.0, abs=3e-6)
    # 90° east along the equator: east there is −up here, up there is east here, north stays
    turn = level_turn((0.0, 0.25, 0.0), np.array([0.0]), np.array([0.25 + np.pi / 2.0]))
    matrix = Rotation.from_quat(turn[0], scalar_first=True).as_matrix()
    np.testing.assert_allclose(matrix, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]], atol=1e-14)


def test_heights_above_mean_sea_level_are_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    """If no height of the geoid is given; a given one is added."""
    at = np.array([0.0, 1.0, 2.0])
    stream = FixStream(at, at, at, np.array([100.0, 101.0, 102.0]), "mean sea level")
    monkeypatch.setattr(recorded, "fix_stream", lambda gnss: (stream, None, ("a note",)))
    monkeypatch.setattr(recorded, "_run_time", lambda *given: given[-1] + 0.5)
    noted = "f.pos has heights above mean sea level, and geoid_height_m is 0: they are taken for heights above the "
    noted += "ellipsoid. The geoid of EGM2008 is -4.4 m above it there."
    for geoid, words in ((0.0, ("a note", noted)), (45.5, ("a note",))):
        gnss: Any = SimpleNamespace(file="f.pos", geoid_height_m=geoid)
        clock: Any = None
        fixes, said = recorded._fixes(gnss, clock, 0.0, (0.0, 2.0), (0.0, 2.0))
        assert (said, fixes.height.tolist(), fixes.time.tolist()) == (words, [100.0 + geoid, 101.0 + geoid], [0.5, 1.5])
