"""Where navigation on a recording starts, against the truth of a drive in closed form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim import rotation
from sinssim.alignment.initial_conditions import RecordedStart, recorded_start
from sinssim.data import NavState
from sinssim.errors import InputError
from sinssim.logs.log_settings import Log
from sinssim.logs.recorded_log import recorded_log
from sinssim.truth.curve import Curve
from tests.logs.drive import ATTITUDE, FIXES, RATES, REFERENCE, drive, write_rates, write_reference


def start_of(
    folder: Path, truth: Curve, mounting: tuple[float, float, float] | None = None, **more: Any
) -> RecordedStart:
    write_rates(folder / "imu.csv", truth, np.arange(0.0, truth.end - 0.01, 0.01))
    write_reference(folder / "gnss.csv", truth, 5.0)
    log = {
        "imu": {"file": str(folder / "imu.csv"), **RATES},
        "gnss": {"file": str(folder / "gnss.csv"), **FIXES},
        **more,
    }
    section = Log.model_validate(log)
    return recorded_start(recorded_log(section, mounting), section.start, mounting)


def off(found: RecordedStart, true: NavState) -> tuple[float, float]:
    """Return the errors of tilt and heading, deg."""
    phi = rotation.rotation_vector_from_quaternion(rotation.multiply(true.q_nb, rotation.conjugate(found.state.q_nb)))
    return float(np.degrees(np.hypot(phi[0], phi[1]))), float(np.degrees(abs(phi[2])))


def test_from_rest_by_gravity_and_the_course_of_the_first_motion(tmp_path: Path) -> None:
    """What is left: the Earth's rate is taken for bias of the gyros, and 11 s of it is 0.04°."""
    truth = drive(40.0)
    found = start_of(tmp_path, truth)
    tilt, heading = off(found, truth.state(0.0))
    assert tilt < 0.01
    assert heading < 0.1
    assert "at rest" in found.words
    assert float(found.state.latitude) == pytest.approx(float(truth.state(0.0).latitude), abs=1e-9)


def test_from_a_single_sample(tmp_path: Path) -> None:
    """The specific force of one sample of a vehicle at rest gives roll and pitch; the heading is given."""
    roll, pitch = 0.02, -0.03
    force = -rotation.dcm_from_quaternion(rotation.quaternion_from_euler(roll, pitch, 0.0))[2]
    row = f"{{}},0,0,0,{force[0]:.15g},{force[1]:.15g},{force[2]:.15g}\n"
    head = ",".join(("t_s", *RATES["gyro"]["columns"], *RATES["accel"]["columns"]))
    (tmp_path / "imu.csv").write_text(head + "\n" + row.format(0.0) + row.format(0.01))
    place = {"latitude_deg": 45.0, "longitude_deg": 8.0, "height_m": 100.0, "heading_deg": 20.0}
    section = Log.model_validate({"imu": {"file": str(tmp_path / "imu.csv"), **RATES}, "start": place})
    log = recorded_log(section, None)
    assert len(log.imu) == 1
    found = recorded_start(log, section.start)
    true = rotation.quaternion_from_euler(roll, pitch, np.radians(20.0))
    np.testing.assert_allclose(found.state.q_nb, true, atol=1e-9)


def test_in_motion_by_the_satellites_acceleration(tmp_path: Path) -> None:
    truth = drive(60.0)
    found = start_of(tmp_path, truth, from_s=30.0)
    tilt, heading = off(found, truth.state(30.0))
    assert tilt < 0.5
    assert heading < 1.0
    assert "in motion" in found.words
    np.testing.assert_allclose(found.state.velocity_ned, truth.state(30.0).velocity_ned, atol=0.01)


def test_a_mounted_block_is_turned_with_the_vehicle(tmp_path: Path) -> None:
    """The block looks back and down on the left: its attitude is the vehicle's times the mounting."""
    mounting, car = (20.0, -15.0, 150.0), drive(40.0, roll=0.0, pitch=0.0)
    q_vb = rotation.quaternion_from_euler(*np.radians(mounting))
    knots = np.arange(0.0, 39.95, 0.1)
    state = car.state(knots)
    from sinssim import earth

    q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), rotation.multiply(state.q_nb, q_vb))
    block = Curve(knots, earth.geodetic_to_ecef(state.latitude, state.longitude, state.height), q_eb)
    found = start_of(tmp_path, block, mounting)
    tilt, heading = off(found, block.state(0.0))
    assert tilt < 0.02
    assert heading < 0.2


def test_what_is_given_counts_more(tmp_path: Path) -> None:
    truth = drive(30.0)
    start = {"heading_deg": 77.0, "latitude_deg": 41.0, "longitude_deg": -100.0, "height_m": 5.0}
    found = start_of(tmp_path, truth, start=start)
    roll, pitch, heading = rotation.euler_from_quaternion(found.state.q_nb)
    assert np.degrees(heading) == pytest.approx(77.0)
    assert (roll, pitch) == (pytest.approx(0.02, abs=1e-4), pytest.approx(-0.03, abs=1e-4))
    assert np.degrees(found.state.latitude) == pytest.approx(41.0)
    assert found.state.height == 5.0


def test_a_whole_reference_gives_the_state(tmp_path: Path) -> None:
    truth = drive(30.0)
    write_reference(tmp_path / "ref.csv", truth, 20.0)
    found = start_of(tmp_path, truth, reference={"file": str(tmp_path / "ref.csv"), **REFERENCE, **ATTITUDE})
    assert max(off(found, truth.state(0.0))) < 1e-6
    assert "from the reference" in found.words


def test_what_the_data_do_not_tell_is_asked_for(tmp_path: Path) -> None:
    still = drive(12.0)
    with pytest.raises(InputError, match=r"initial heading is unknown.*log\.start\.heading_deg"):
        start_of(tmp_path, still)
    write_rates(tmp_path / "imu.csv", still, np.arange(0.0, 11.9, 0.01))
    section = Log.model_validate({"imu": {"file": str(tmp_path / "imu.csv"), **RATES}})
    with pytest.raises(InputError, match=r"no position to start from: give log\.start\.latitude_deg"):
        recorded_start(recorded_log(section), section.start)


def test_a_first_fix_that_comes_late_is_named(tmp_path: Path) -> None:
    truth = drive(40.0)
    start_of(tmp_path, truth)
    lines = (tmp_path / "gnss.csv").read_text().splitlines()
    (tmp_path / "gnss.csv").write_text("\n".join((lines[0], *lines[40:])))
    log = {"imu": {"file": str(tmp_path / "imu.csv"), **RATES}, "gnss": {"file": str(tmp_path / "gnss.csv"), **FIXES}}
    # both files count from the same instant
    loaded = recorded_log(Log.model_validate(log))
    with pytest.raises(InputError, match=r"first position comes 7\.8 s after the start.*log\.from_s = 7\.8"):
        recorded_start(loaded, Log.model_validate(log).start)
    assert replace(loaded, notes=()).notes == ()
