"""Rows of a gnss-ins-sim folder: the rates of a row lead from its state to the next one, on a motion in closed form."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.logs.formats import psins_gnss_ins_sim
from sinssim.logs.recorded_streams import InertialStream, SolutionStream
from tests.oracles.s_turn import STurn

STEP = 0.02


def content() -> Any:
    """Two seconds of the S-turn in which it rolls fast; increments and truth share no code with sinssim."""
    flight = STurn(duration=2.0, period=4.0).fly(1.0 / STEP)
    truth = SolutionStream(
        flight.time, flight.latitude, flight.longitude, flight.height,
        velocity_ned=flight.velocity_ned, q_nb=flight.q_nb,
    )  # fmt: skip
    interval = np.full((len(flight.dtheta), 2), STEP)
    imu = InertialStream(flight.time[1:], flight.dtheta, flight.dvel, "increments", interval=interval)
    return SimpleNamespace(imu=imu, motion=truth, imu_name="ideal", run=SimpleNamespace(inertial={}), fixes={})


def test_rates_of_a_row_lead_to_the_next_row(tmp_path: Path) -> None:
    """As FreeIntegration of gnss-ins-sim takes them: state 1 = state 0 and the rates of row 0."""
    psins_gnss_ins_sim.write_gnss_ins_sim(content(), tmp_path)
    time, gyro, angles = (
        np.genfromtxt(tmp_path / f"{name}.csv", delimiter=",", skip_header=1)
        for name in ("time", "gyro-0", "ref_att_euler")
    )
    assert time[0] == 0.0
    assert np.allclose(np.diff(time), STEP, rtol=0, atol=1e-9)
    heading, pitch, roll = np.radians(angles).T
    q_nb = rotation.quaternion_from_euler(roll, pitch, heading)
    turned = rotation.rotation_vector_from_quaternion(
        rotation.multiply(rotation.conjugate(q_nb[:-1]), q_nb[1:])
    )  # relative to the navigation frame, which turns by 1.1e-4 rad/s at most
    same_row = np.abs(turned - np.radians(gyro[:-1]) * STEP).max()
    row_before = np.abs(turned[1:] - np.radians(gyro[:-2]) * STEP).max()
    assert same_row < 1.2e-4 * STEP + 1e-6  # and coning, (rate × angular acceleration) × STEP³ / 12
    assert row_before > 1e-4, "the motion tells the rows apart"
