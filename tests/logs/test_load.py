"""What a [log] table loads: files beside each other, quality, overlap, mistakes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.log_settings import Log, Outages, outage_settings
from sinssim.logs.recorded_log import recorded_log
from tests.logs.drive import ATTITUDE, FIXES, RATES, REFERENCE, drive, write_csv, write_rates, write_reference

TRUTH = drive(20.0)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_rates(tmp_path / "imu.csv", TRUTH, np.arange(0.0, 19.99, 0.01))
    write_reference(tmp_path / "gnss.csv", TRUTH, 5.0)
    return tmp_path


def section(folder: Path, gnss: dict[str, Any] | None = None, **more: Any) -> Log:
    imu = {"file": str(folder / "imu.csv"), **RATES, **more.pop("imu", {})}
    fixes = {"file": str(folder / "gnss.csv"), **FIXES, **(gnss or {})}
    return Log.model_validate({"imu": imu, "gnss": fixes, **more})


def test_a_part_of_the_files(folder: Path) -> None:
    log = recorded_log(section(folder, from_s=5.0, to_s=15.0))
    assert log.imu.time[[0, -1]] == pytest.approx([5.0, 15.0])
    place, speed = (readings.measurements for readings in log.sensed)
    assert place.time[[0, -1]] == pytest.approx([5.0, 15.0])
    assert len(place) == len(speed) == 51
    np.testing.assert_allclose(place.sigma, np.tile((0.5, 0.5, 1.0), (51, 1)))
    assert log.rates == {"gnss-position": 5.1, "gnss-velocity": 5.1}


def test_a_velocity_is_older_than_its_stamp_and_arrives_with_it(folder: Path) -> None:
    place, speed = (r.measurements for r in recorded_log(section(folder, {"velocity_delay_s": 0.1})).sensed)
    np.testing.assert_allclose(place.time - speed.time, 0.1, atol=1e-12)
    np.testing.assert_allclose(speed.arrival, place.time, atol=1e-12)


def test_a_clock_that_runs_fast_is_slowed_down(folder: Path) -> None:
    """Times of the IMU since its first row are divided by 1 + drift; those of the fixes are unchanged."""
    plain, slower = recorded_log(section(folder)), recorded_log(section(folder, imu={"clock_drift_ppm": 5e4}))
    np.testing.assert_allclose(slower.imu.time, plain.imu.time / 1.05, rtol=1e-12)
    assert slower.fixes is not None
    assert plain.fixes is not None
    np.testing.assert_array_equal(slower.fixes.time, plain.fixes.time[: len(slower.fixes)])


def test_codes_of_quality_become_factors(folder: Path) -> None:
    state = TRUTH.state(np.arange(0.0, 19.9, 1.0))
    codes = np.where(np.arange(20) % 4 == 0, 2.0, np.where(np.arange(20) == 7, 5.0, 1.0))
    columns = np.column_stack((np.arange(20.0), np.degrees(state.latitude), np.degrees(state.longitude), state.height))
    write_csv(folder / "gnss.csv", "t_s,lat,lon,h,Q", np.column_stack((columns, codes)))
    plain = {key: value for key, value in FIXES.items() if key not in ("velocity", "velocity_sigma_mps")}
    given = {**plain, "quality": "Q", "quality_factors": {"1": 1.0, "2": 20.0}}
    imu = {"file": str(folder / "imu.csv"), **RATES}
    log = recorded_log(Log.model_validate({"imu": imu, "gnss": {"file": str(folder / "gnss.csv"), **given}}))
    (place,) = (readings.measurements for readings in log.sensed)
    assert 7.0 not in place.time
    assert len(place) == 19
    np.testing.assert_allclose(place.sigma[::4][:2, 0], [10.0, 10.0])
    assert place.sigma[1, 0] == 0.5
    assert any("5 of quality 2, σ times 20; 1 of quality 5, refused" in note for note in log.notes)
    with pytest.raises(InputError, match="has no codes of quality"):
        recorded_log(section(folder, {"quality_factors": {"1": 1.0}, "velocity": None, "use": ["position"]}))


@pytest.mark.parametrize("stamp", [5.0, 2.0])
def test_a_reference_whose_stamps_repeat_or_go_back(folder: Path, stamp: float) -> None:
    """The first row of an instant counts; times that go back are refused with their row."""
    at = np.arange(0.0, 19.9, 0.5)
    state = TRUTH.state(at)
    stamps = at.copy()
    stamps[11] = stamp  # after 5 s
    columns = (stamps, np.degrees(state.latitude), np.degrees(state.longitude), state.height)
    write_csv(folder / "reference.csv", "time_s,latitude_deg,longitude_deg,height_m", np.column_stack(columns))
    given = section(folder, reference={"file": str(folder / "reference.csv"), "format": "columns"})
    if stamp == 5.0:
        reference = recorded_log(given).reference
        assert reference is not None
        assert len(reference.time) == len(at) - 1
    else:
        with pytest.raises(InputError, match=r"reference\.csv, row 12: the time 2 s goes back"):
            recorded_log(given)


def test_missing_numbers_are_left_out(folder: Path) -> None:
    text = (folder / "gnss.csv").read_text().splitlines()
    text[3] = ",".join(field if i != 1 else "" for i, field in enumerate(text[3].split(",")))
    (folder / "gnss.csv").write_text("\n".join(text))
    place, speed = (r.measurements for r in recorded_log(section(folder)).sensed)
    assert len(speed) - len(place) == 1


def test_files_that_do_not_overlap_name_both_spans(folder: Path) -> None:
    with pytest.raises(InputError, match=r"covers 100\.000 to 119\.800 s, the inertial unit 0\.000 to 19\.980 s"):
        recorded_log(section(folder, {"time_offset_s": 100.0}))


def test_a_date_on_one_side_only_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=r"log\.imu has no date"):
        recorded_log(section(folder, {"first_row": "2025-07-08 19:34:21"}))
    both = recorded_log(
        section(
            folder, {"first_row": "2025-07-08 19:34:22.5"}, imu={"first_row": "2025-07-08 19:34:03.5", "clock": "utc"}
        )
    )
    assert both.sensed[0].measurements.time[0] == pytest.approx(1.0)  # 18 leap seconds


def test_the_offset_of_the_unit_moves_all_other_files(folder: Path) -> None:
    log = recorded_log(section(folder, imu={"time_offset_s": -0.25}))
    assert log.imu.time[0] == 0.0
    assert log.sensed[0].measurements.time[1] == pytest.approx(0.45)


def test_constants_and_radians_and_the_geoid(folder: Path) -> None:
    state = TRUTH.state(np.arange(0.0, 19.9, 1.0))
    write_csv(folder / "ref.csv", "t_s,lat,lon", np.column_stack((np.arange(20.0), state.latitude, state.longitude)))
    reference = {
        "file": str(folder / "ref.csv"), "time": "t_s", "latitude": {"column": "lat", "unit": "rad"},
        "longitude": {"column": "lon", "unit": "rad"}, "height": {"value": 1.55, "unit": "km"}, "geoid_height_m": 50.0,
    }  # fmt: skip
    log = recorded_log(section(folder, reference=reference))
    assert log.reference is not None
    np.testing.assert_allclose(log.reference.height, 1600.0)
    assert log.reference.knows == ("position",)


def test_a_quaternion_and_angles_are_the_same_attitude(folder: Path) -> None:
    write_reference(folder / "ref.csv", TRUTH, 5.0)
    time = np.arange(0.0, 19.9, 0.2)
    s = TRUTH.state(time)
    columns = np.column_stack((time, np.degrees(s.latitude), np.degrees(s.longitude), s.height, s.velocity_ned, s.q_nb))
    write_csv(folder / "quat.csv", "t_s,lat,lon,h,vn,ve,vd,qw,qx,qy,qz", columns)
    angles = {"file": str(folder / "ref.csv"), **REFERENCE, **ATTITUDE}
    quaternion = {"file": str(folder / "quat.csv"), **REFERENCE, "quaternion": ["qw", "qx", "qy", "qz"]}
    first, second = (recorded_log(section(folder, reference=one)).reference for one in (angles, quaternion))
    assert first is not None
    assert second is not None
    assert first.q_nb is not None
    assert second.q_nb is not None
    count = min(len(first.q_nb), len(second.q_nb))
    dots = np.abs(np.sum(first.q_nb[:count] * second.q_nb[:count], axis=1))
    np.testing.assert_allclose(dots, 1.0, atol=1e-12)


def test_other_sensors_are_read(folder: Path) -> None:
    time = np.arange(0.0, 19.0, 0.5)
    write_csv(folder / "baro.csv", "t_ms,ft", np.column_stack((1e3 * time, (1600.0 + 0.0 * time) / 0.3048)))
    baro = {
        "name": "baro", "kind": "baro-height", "file": str(folder / "baro.csv"), "time": "t_ms",
        "reading": {"column": "ft", "unit": "ft"}, "sigma": {"value": 2.0, "unit": "m"},
    }  # fmt: skip
    log = recorded_log(section(folder, others=[baro]))
    readings = log.sensed[-1].measurements
    assert readings.kind == "baro-height"
    np.testing.assert_allclose(readings.value[:, 0], 1600.0)
    np.testing.assert_allclose(readings.time, time)


@pytest.mark.parametrize(
    ("gnss", "message"),
    [
        ({"latitude": None}, "columns of latitude are not described"),
        ({"format": "rtklib"}, "format 'rtklib'"),
        ({"format": "rtklib-pos"}, "no header line"),
        ({"file": "nowhere.csv"}, "cannot be read"),
        ({"position_sigma_m": None}, "gives no 1σ for this: state it"),
        ({"latitude": {"column": "breadth", "unit": "deg"}}, "'breadth'"),
    ],
)
def test_mistakes_are_named(folder: Path, gnss: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        recorded_log(section(folder, gnss))


@pytest.mark.parametrize(
    ("gnss", "message"),
    [
        ({"latitude": {"column": "lat", "unit": "degrees"}}, "degrees"),
        (
            {"latitude": {"column": "lat", "value": 1.0, "unit": "deg"}},
            "column, or a constant value: give exactly one of them",
        ),
        ({"quality_factors": {"fix": 1.0}}, "is not a whole number"),
        ({"first_row": "yesterday"}, "is not a date and time"),
        ({"velocity": {"columns": ["a", "b", "c"], "unit": "m/s", "axes": "up-east-north"}}, "axes"),
    ],
)
def test_mistakes_of_the_description_are_found_before_reading(folder: Path, gnss: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        section(folder, gnss)


def test_regular_outages_lie_within_the_run() -> None:
    regular = Outages(length_s=15.0, every_s=45.0)
    assert regular.spans(0.0, 160.0) == ((45.0, 60.0), (90.0, 105.0), (135.0, 150.0))
    assert regular.spans(0.0, 149.0) == ((45.0, 60.0), (90.0, 105.0))
    assert Outages(length_s=15.0, every_s=45.0, first_s=10.0, at_s=((70.0, 80.0),)).spans(0.0, 75.0) == (
        (10.0, 25.0), (55.0, 70.0), (70.0, 80.0),
    )  # fmt: skip
    with pytest.raises(ValueError, match="must be less than every_s"):
        Outages(length_s=45.0, every_s=45.0)


def test_several_beginnings_are_further_passes() -> None:
    several = Outages(length_s=15.0, every_s=45.0, first_s=(30.0, 45.0))
    assert several.spans(0.0, 100.0) == ()
    assert several.passes(0.0, 100.0) == (((30.0, 45.0), (75.0, 90.0)), ((45.0, 60.0),))
    assert Outages(length_s=15.0, every_s=45.0, first_s=30.0).passes(0.0, 100.0) == ()
    for wrong, message in (
        ({"at_s": ((1.0, 2.0),), "first_s": (30.0, 45.0)}, "give length_s and every_s"),
        ({"length_s": 1.0, "every_s": 9.0, "first_s": (5.0, 5.0)}, "give each beginning once"),
        ({"length_s": 1.0, "every_s": 9.0, "first_s": (5.0, 6.0), "at_s": ((1.0, 2.0),)}, "exclude each other"),
    ):
        with pytest.raises(ValueError, match=message):
            Outages.model_validate(wrong)


def test_outages_as_people_write_them() -> None:
    assert outage_settings(["40:55", "100:110.5", "15/45@60"]) == [
        "log.outages.at_s=[[40.0, 55.0], [100.0, 110.5]]",
        "log.outages.length_s=15.0", "log.outages.every_s=45.0", "log.outages.first_s=60.0",
    ]  # fmt: skip
    assert outage_settings(["15/45@30,45,60.5"])[2:] == ["log.outages.first_s=[30.0, 45.0, 60.5]"]
    for wrong in (["40-55"], ["15/45", "20/60"], ["15/45@30,"]):
        with pytest.raises(InputError, match="Write 40:55"):
            outage_settings(wrong)
