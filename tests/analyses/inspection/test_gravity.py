"""Phones write acceleration without gravity and gravity apart: the sum is found, and acceleration alone refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from sinssim.analyses.inspection.file_layouts import contains, guess_files, relative_sign
from sinssim.analyses.inspection.inertial_columns import Layout
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.analyses.inspection.text_columns import read_table
from sinssim.errors import InputError
from sinssim.logs.imu_samples import without_gravity
from sinssim.logs.log_files import inertial_stream
from sinssim.logs.log_settings import LogImu
from sinssim.logs.recorded_log import recorded_log
from sinssim.scenario import load_scenario
from sinssim.units import G0
from tests.analyses.inspection import phone, worlds

_THREE = ("Accelerometer.csv", "Gyroscope.csv", "Gravity.csv")


@pytest.mark.parametrize(
    ("gravity_sign", "sign", "unit"), [(1.0, 1.0, 1.0), (-1.0, 1.0, G0), (1.0, -1.0, 1.0)], ids=["up", "down", "mixed"]
)
def test_the_sign_convention_follows_from_the_filter_of_the_phone(
    tmp_path: Path, gravity_sign: float, sign: float, unit: float
) -> None:
    phone.record(tmp_path, gravity_sign, sign, unit)
    guessed = guess_files([read_table(tmp_path / name) for name in _THREE])
    assert guessed.unit is not None
    table, layout = guessed.unit
    assert table.path.name == "Gyroscope.csv"
    assert layout.gravity is not None
    assert layout.accel_unit == layout.gravity[1].accel_unit == ("g" if unit == G0 else "m/s^2")
    assert relative_sign(table, layout) == sign


def test_a_gravity_that_follows_nothing_tells_no_sign(tmp_path: Path) -> None:
    time, gyro, accel, _ = phone.split()
    still = np.tile(G0 * np.array((0.0, 0.6, 0.8)), (len(time), 1)) + 1e-4 * np.sin(np.outer(time, (1.0, 1.1, 1.3)))
    rows = np.column_stack([time, 1e-6 * gyro, accel - accel.mean(axis=0), still])
    path = tmp_path / "log.csv"
    names = "t_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,gravity_x,gravity_y,gravity_z"
    np.savetxt(path, rows, delimiter=",", header=names, comments="", fmt="%.9f")
    guessed = guess_files([read_table(path)])
    assert guessed.unit is not None
    assert guessed.unit[1].gravity is not None
    assert relative_sign(*guessed.unit) == 0


def test_the_sum_is_what_the_accelerometers_measured(tmp_path: Path) -> None:
    """The suggested scenario reads the readings before the phone split them, within the error of interpolation."""
    phone.record(tmp_path, sign=-1.0)
    phone.record_places(tmp_path)
    found = inspect([*(tmp_path / name for name in _THREE), tmp_path / "Location.csv"], tmp_path, land=True)
    assert found.scenario is not None
    own = tomllib.loads(found.scenario)["log"]["imu"]
    assert own["accel"] == {"columns": ["x", "y", "z"], "unit": "m/s^2", "signs": [-1] * 3, "file": "Accelerometer.csv"}
    assert own["gravity"] == {"columns": ["x", "y", "z"], "unit": "m/s^2", "file": "Gravity.csv"}
    assert own["axes"] == ["forward", "left", "up"]
    scenario = tmp_path / "drive.toml"
    scenario.write_text(found.scenario)
    log = load_scenario(str(scenario)).log
    assert log is not None
    stream, _, notes = inertial_stream(log.imu)
    assert "The specific force is the sum" in " ".join(notes)
    true = worlds.readings(phone.RATE_HZ)
    unit_time = stream.time - stream.time[0] + 0.0007 + true.time[1]
    expected = np.stack([np.interp(unit_time, true.time, axis) for axis in true.accel.T], axis=1)
    assert np.abs(stream.accel - expected).max() < 0.01
    # the same file without gravity
    bare = {key: value for key, value in own.items() if key != "gravity"}
    bare["file"], bare["accel"]["file"] = str(tmp_path / own["file"]), str(tmp_path / "Accelerometer.csv")
    for unit in ("g", "m/s^2"):
        bare["accel"]["unit"] = unit
        with pytest.raises(InputError, match="record the accelerometers with gravity"):
            recorded_log(log.model_copy(update={"imu": LogImu.model_validate(bare)}))


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "of_gravity", "named"), [(G0, 1.0, "g"), (1.0, G0, "m/s^2")])
def test_the_fixes_tell_another_unit_of_the_acceleration(
    tmp_path: Path, unit: float, of_gravity: float, named: str
) -> None:
    phone.record(tmp_path, -1.0, 1.0, unit, of_gravity)
    phone.record_places(tmp_path)
    found = inspect([*(tmp_path / name for name in _THREE), tmp_path / "Location.csv"], tmp_path)
    assert found.scenario is not None
    own = tomllib.loads(found.scenario)["log"]["imu"]
    assert (own["accel"]["unit"], own["accel"]["signs"]) == (named, [-1] * 3)
    assert own["gravity"]["signs"] == [-1] * 3


def test_user_acceleration_and_gravity_in_one_file(tmp_path: Path) -> None:
    time, gyro, accel, gravity = phone.split()
    names = (
        "time_s,motionRotationRateX(rad/s),motionRotationRateY(rad/s),motionRotationRateZ(rad/s),"
        "motionUserAccelerationX(G),motionUserAccelerationY(G),motionUserAccelerationZ(G),"
        "motionGravityX(G),motionGravityY(G),motionGravityZ(G)"
    )
    path = tmp_path / "log.csv"
    rows = np.column_stack([time, gyro, -(accel - gravity) / G0, -gravity / G0])
    np.savetxt(path, rows, delimiter=",", header=names, comments="", fmt="%.7f")
    guessed = guess_files([read_table(path)])
    assert guessed.unit is not None
    table, layout = guessed.unit
    keys = layout.description(table)
    assert keys["accel"]["columns"][0] == "motionUserAccelerationX(G)"
    assert keys["gravity"] == {"columns": [f"motionGravity{axis}(G)" for axis in "XYZ"], "unit": "g"}
    assert np.abs(guessed.streams()[0].inertial["imu"].accel + accel).max() < 1e-5
    read = inertial_stream(LogImu.model_validate({"file": str(path), **keys}))[0]
    assert np.abs(read.accel + accel).max() < 1e-5


def test_without_fixes_the_vertical_is_in_doubt(tmp_path: Path) -> None:
    phone.record(tmp_path, -1.0)
    found = inspect([tmp_path / name for name in _THREE], tmp_path).inspection
    said = {f.grade: f.text for f in found.findings if f.subject == "accelerometers" and " sum" in f.text}
    assert "with the same sign" in said["fact"]
    assert "up or down" in said["doubt"]


def test_acceleration_without_gravity_alone_is_refused(tmp_path: Path) -> None:
    phone.record(tmp_path)
    with pytest.raises(InputError, match=r"Accelerometer\.csv: the columns x, y, z .*TotalAcceleration"):
        inspect([tmp_path / "Accelerometer.csv", tmp_path / "Gyroscope.csv"])


@pytest.mark.parametrize(
    ("name", "header"),
    [
        ("Accelerometer.csv", "seconds_elapsed,z,y,x"),
        ("Linear Acceleration.csv", "Time (s),x,y,z"),
        ("log.csv", "time,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z"),
    ],
)
def test_a_lasting_acceleration_is_no_gravity_in_g(tmp_path: Path, name: str, header: str) -> None:
    """A long acceleration of 1 m/s² has the size of gravity in g; the names say that it is none."""
    time = 0.02 * np.arange(3000)
    rows = np.column_stack([time, np.random.default_rng(3).normal((0.0, 0.95, 0.1), 0.1, (3000, 3))])
    np.savetxt(tmp_path / name, rows, delimiter=",", header=header, comments="", fmt="%.5f")
    with pytest.raises(InputError, match="If the recorder has removed gravity"):
        inspect([tmp_path / name])


def test_what_lacks_gravity() -> None:
    """Half a minute at rest has gravity or nothing; a motion of 1 m/s² is no specific force in g."""
    time, _, accel, gravity = phone.split()
    interval = float(time[1] - time[0])
    assert not without_gravity(accel, interval)
    assert without_gravity(accel - gravity, interval)
    rng = np.random.default_rng(2)
    shaken = accel + rng.normal(0.0, 20.0, accel.shape) * (time > 40.0)[:, None]  # a multirotor
    assert not without_gravity(shaken, interval)


def test_gravity_needs_an_acceleration() -> None:
    gyro = {"columns": ["a", "b", "c"], "unit": "rad/s"}
    gravity = {"columns": ["d", "e", "f"], "unit": "m/s^2"}
    for keys, named in (
        ({"kind": "rates", "gyro": gyro, "gravity": gravity}, "needs kind"),
        ({"kind": "rates", "gyro": gyro, "accel": gravity, "gravity": gravity}, "same columns"),
        ({"kind": "rates", "gyro": gyro, "accel": gravity, "gravity": {**gravity, "unit": "gal"}}, "unit of gravity"),
    ):
        with pytest.raises(ValueError, match=named):
            LogImu.model_validate({"file": "log.csv", **keys})


def test_accelerations_that_contain_gravity_lie_along_it_axis_by_axis(tmp_path: Path) -> None:
    """Along (1, 0, 0) is 9 of a norm of 9; in the wrong order it would be 0.3."""
    path = tmp_path / "log.csv"
    rows = [f"{0.1 * k:.1f},9.0,0.2,0.3,9.8,0.0,0.0" for k in range(30)]
    path.write_text("t_s,acc_x,acc_y,acc_z,gravity_x,gravity_y,gravity_z\n" + "\n".join(rows) + "\n")
    table = read_table(path)
    gravity = (table, Layout("rates", 0, "s", None, (4, 5, 6), "rad/s", "m/s^2", True))
    assert contains(table, (1, 2, 3), gravity)
    assert not contains(table, (3, 2, 1), gravity)
