"""A scenario's source of truth is the one it names, and the sensor block sits where it says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.scenario import Scenario
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.source import fly
from sinssim.truth.trajectory import Channel, FlightEvent
from tests.oracles import integrator as oracle
from tests.truth.motions import synthetic_flight


def scenario(**tables: Any) -> Scenario:
    return Scenario.model_validate({"name": "test", **tables})


def test_parked() -> None:
    trajectory = fly(
        scenario(
            parked={
                "latitude_deg": -90.0,
                "longitude_deg": 200.0,
                "altitude_m": 3.0,
                "roll_deg": 10.0,
                "pitch_deg": 20.0,
                "heading_deg": 30.0,
                "duration_s": 60.0,
            },
            imu={"mounting_deg": [5.0, 6.0, 7.0]},
        )
    )
    s = trajectory.state(60.0)
    assert float(s.latitude) == -np.pi / 2
    assert float(s.longitude) == pytest.approx(np.radians(-160.0), abs=1e-15)
    assert float(s.height) == 3.0
    c_nb = Rotation.from_euler("ZYX", [30.0, 20.0, 10.0], degrees=True)
    c_bs = Rotation.from_euler("ZYX", [7.0, 6.0, 5.0], degrees=True)
    assert np.abs(oracle.matrix(s.q_nb) - (c_nb * c_bs).as_matrix()).max() < 1e-15
    assert np.linalg.norm(trajectory.rates(0.0)[0]) == pytest.approx(oracle.OMEGA, rel=1e-15)


def test_great_circle() -> None:
    trajectory = fly(
        scenario(
            great_circle={
                "latitude_deg": 10.0,
                "longitude_deg": 20.0,
                "altitude_m": 500.0,
                "course_deg": 90.0,
                "speed_mps": 100.0,
                "duration_s": 100.0,
            },
            truth={"gravity": "j2"},
        )
    )
    s = trajectory.state(0.0)
    assert float(s.latitude) == pytest.approx(np.radians(10.0), abs=1e-15)
    assert np.abs(s.velocity_ned - [0.0, 100.0, 0.0]).max() < 1e-10
    assert (trajectory.gravity, trajectory.ellipsoid.name, trajectory.end) == ("j2", "wgs84", 100.0)


@pytest.mark.parametrize("own", [True, False])
def test_flight_takes_the_mounting_of_the_aircraft_or_of_the_scenario(
    own: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sinssim.truth.flight import cache
    from sinssim.truth.flight.flight_log import FlightLog

    time = np.arange(300) / 30.0
    position, q_eb = synthetic_flight(time)
    channels = {"thrust": Channel(time, time, "N")}
    log = FlightLog(time, position, q_eb, channels, (FlightEvent(1.0, "off"),))
    asked = []

    def flown(flight: object, seed: int, progress: object, meanwhile: object) -> FlightLog:
        asked.append((flight, seed, progress, meanwhile))
        return log

    monkeypatch.setattr(cache, "cached_flight", flown)
    given = scenario(
        seed=5,
        flight={
            "aircraft": "737",
            "start": {"on": "air", "latitude_deg": 50.0, "longitude_deg": 0.0, "altitude_m": 3000.0},
            "legs": [{"type": "hold", "duration_s": 10.0}],
        },
        imu={} if own else {"lever_arm_m": [1.0, 2.0, 3.0], "mounting_deg": [10.0, 0.0, 0.0]},
    )

    def progress(fraction: float) -> None:
        pass

    trajectory = fly(given, progress)
    assert asked == [(given.flight, 5, progress, None)]
    assert trajectory.events == log.events
    assert trajectory.channels == channels

    mounting = load_aircraft("737").mounting
    arm = np.array(mounting.lever_arm_m) if own else np.array([1.0, 2.0, 3.0])
    roll, pitch, yaw = mounting.angles_deg if own else (10.0, 0.0, 0.0)
    c_eb = oracle.matrix(q_eb)
    c_bs = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()
    s = trajectory.state(time)
    there = oracle.geodetic_to_ecef(s.latitude, s.longitude, s.height)
    assert np.abs(there - (position + c_eb @ arm)).max() < 1e-8
    c_ns = oracle.ned_axes(s.latitude, s.longitude) @ c_eb @ c_bs
    assert np.abs(oracle.matrix(s.q_nb) - c_ns).max() < 1e-14
