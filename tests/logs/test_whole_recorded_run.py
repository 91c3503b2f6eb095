"""A run directory of recorded sensors, read back: names, order, instants and refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from sinssim.errors import InputError
from sinssim.logs.stored_run import RecordedRun

STATE = ("latitude_rad", "longitude_rad", "height_m", "velocity_n_mps", "velocity_e_mps", "velocity_d_mps", "q_nb_w",
         "q_nb_x", "q_nb_y", "q_nb_z")  # fmt: skip
IMU = ("dtheta_x_rad", "dtheta_y_rad", "dtheta_z_rad", "dvel_x_mps", "dvel_y_mps", "dvel_z_mps")


def write(folder: Path, name: str, time: list[float], columns: tuple[str, ...], first: float) -> None:
    """Write a stream whose columns are first, first + 1, … plus a tenth of the row's number."""
    rows = 0.1 * np.arange(len(time))
    table = {"time_s": np.array(time)} | {column: first + k + rows for k, column in enumerate(columns)}
    (folder / "streams").mkdir(exist_ok=True, parents=True)
    parquet.write_table(pa.table(table), folder / "streams" / f"{name}.parquet")


def recorded(folder: Path, **log: Any) -> RecordedRun:
    """Return a run with the solutions aided, euler and own; the aided one begins later."""
    about = {"reference_file": "ref.csv", "knows": ["position", "velocity", "attitude"], "time_0_gps_s": 5.5, **log}
    write(folder, "nav_aided", [11.0, 12.0, 13.0], STATE, 10.0)
    write(folder, "nav_own", [10.5, 11.0, 12.0], STATE, 30.0)
    write(folder, "nav_euler", [10.25, 11.0, 12.0], STATE, 50.0)
    write(folder, "imu_measured", [11.0, 12.5, 13.0], IMU, 70.0)
    write(folder, "imu_lost", [11.0], IMU, 70.0)
    write(folder, "imu_ideal", [11.0], IMU[1:], 70.0)
    write(folder, "aiding_gnss_position", [11.0, 12.0], (*STATE[:3], "sigma_n_m", "sigma_e_m", "sigma_d_m"), 80.0)
    names = tuple(f"{what}_{axis}_mps" for what in ("velocity", "sigma") for axis in "ned")
    write(folder, "aiding_gnss_velocity", [11.0, 12.0], names, 90.0)
    write(folder, "reference", [10.0, 11.0, 12.0], STATE, 5.0)
    (folder / "summary.json").write_text(json.dumps({"log": about, "algorithms": {"euler": {}}}))
    (folder / "scenario.toml").write_text(
        '[truth]\nellipsoid = "grs80"\n[log.reference]\nfile = "ref.csv"\n[log.gnss]\nlever_arm_m = [0.5, -1.5, 2.5]\n'
    )
    return RecordedRun(folder)


def test_solutions_in_the_order_of_the_summary(tmp_path: Path) -> None:
    """The reference is a solution only if it is whole; the one that the summary does not name is last."""
    run = recorded(tmp_path)
    assert run.of_log
    assert run.solutions == ["reference", "euler", "aided", "own"]
    assert (run.motion, run.start_gps_s, run.ellipsoid) == ("reference", 5.5, "grs80")
    assert run.knows == ["position", "velocity", "attitude"]
    assert run.lever_arm("gnss") == (0.5, -1.5, 2.5)
    part = recorded(tmp_path, knows=["position", "velocity"], time_0_gps_s=None)
    assert part.solutions == ["euler", "aided", "own"]
    assert (part.motion, part.start_gps_s) == ("aided", None)
    assert recorded(tmp_path, reference_file=None).knows == []
    with pytest.raises(InputError, match=r"^unknown solution of .* 'truth'\..*Known: aided, euler, own, reference\.$"):
        recorded(tmp_path).solution("truth")


def test_a_solution_and_the_reference(tmp_path: Path) -> None:
    """Rows of the reference that are not whole are left out; the others are as they are."""
    run = recorded(tmp_path)
    own = run.solution("euler")
    np.testing.assert_allclose(own.time, [10.25, 11.0, 12.0])
    np.testing.assert_allclose(own.latitude, [50.0, 50.1, 50.2])
    np.testing.assert_allclose(own.longitude, [51.0, 51.1, 51.2])
    np.testing.assert_allclose(own.height, [52.0, 52.1, 52.2])
    assert own.velocity_ned is not None
    assert own.q_nb is not None
    np.testing.assert_allclose(own.velocity_ned[1], [53.1, 54.1, 55.1])
    np.testing.assert_allclose(own.q_nb[2], [56.2, 57.2, 58.2, 59.2])
    table = parquet.read_table(tmp_path / "streams" / "reference.parquet").to_pydict()
    table["velocity_d_mps"][1] = float("nan")
    parquet.write_table(pa.table(table), tmp_path / "streams" / "reference.parquet")
    np.testing.assert_allclose(RecordedRun(tmp_path).solution("reference").time, [10.0, 12.0])


def test_intervals_begin_with_the_earliest_solution(tmp_path: Path) -> None:
    """The first interval begins at 10.25 s, where euler does."""
    run = recorded(tmp_path)
    assert run.inertial == ["measured"]
    found = run.increments("measured")
    np.testing.assert_allclose(found.interval, np.outer([0.75, 1.5, 0.5], [1.0, 1.0]))
    np.testing.assert_allclose(found.gyro, np.array([[70.0, 71.0, 72.0], [70.1, 71.1, 72.1], [70.2, 71.2, 72.2]]))
    np.testing.assert_allclose(found.accel[2], [73.2, 74.2, 75.2])
    with pytest.raises(InputError, match=r"^unknown inertial data of .* 'ideal'\. Did you mean|^unknown inertial data"):
        run.increments("ideal")
    write(tmp_path, "rotation", [1.0], ("angle_rad",), 1.0)
    with pytest.raises(InputError, match=rf"^the sensor block of {re.escape(str(tmp_path))} rotates in the vehicle"):
        run.increments("measured")


def test_fixes_with_velocities_of_the_same_instants(tmp_path: Path) -> None:
    run = recorded(tmp_path)
    assert run.fixes == ["gnss"]
    found = run.fix("gnss")
    np.testing.assert_allclose([found.time, found.latitude, found.longitude, found.height],
                               [[11.0, 12.0], [80.0, 80.1], [81.0, 81.1], [82.0, 82.1]])  # fmt: skip
    assert found.position_sigma is not None
    assert found.velocity_ned is not None
    assert found.velocity_sigma is not None
    np.testing.assert_allclose(found.position_sigma, [[83.0, 84.0, 85.0], [83.1, 84.1, 85.1]])
    np.testing.assert_allclose(found.velocity_ned, [[90.0, 91.0, 92.0], [90.1, 91.1, 92.1]])
    np.testing.assert_allclose(found.velocity_sigma, [[93.0, 94.0, 95.0], [93.1, 94.1, 95.1]])
    names = tuple(f"{what}_{axis}_mps" for what in ("velocity", "sigma") for axis in "ned")
    write(tmp_path, "aiding_gnss_velocity", [11.0, 12.5], names, 90.0)
    assert run.fix("gnss").velocity_ned is None
    with pytest.raises(InputError, match=r"^unknown GNSS receiver of .* 'galileo'.* Known: gnss\.$"):
        run.fix("galileo")


def test_what_is_no_run(tmp_path: Path) -> None:
    gone = re.escape(str(tmp_path / "gone"))
    with pytest.raises(InputError, match=rf"^{gone} does not exist\. Give the directory of a run"):
        RecordedRun(tmp_path / "gone")
    with pytest.raises(InputError, match=r"holds no run: streams/truth\.parquet is missing\. Give the directory"):
        RecordedRun(tmp_path)
    (tmp_path / "summary.json").write_text('{"log": {}}')
    with pytest.raises(InputError, match=r" has no solution: streams/nav_\*\.parquet are missing\.$"):
        RecordedRun(tmp_path)
    (tmp_path / "summary.json").write_text("[1]")
    with pytest.raises(InputError, match=r"summary\.json is not the summary of a run\.$"):
        RecordedRun(tmp_path)
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(InputError, match=r"summary\.json cannot be read: Expecting property name"):
        RecordedRun(tmp_path)
    write(tmp_path, "truth", [1.0], ("coordinate_rad",), 1.0)
    with pytest.raises(InputError, match="is a run of the one-component system, which has no position on the Earth"):
        RecordedRun(tmp_path)
