"""A scenario's source of truth is the one it names, and the sensor block sits where it says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import omission, shipped
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly, unknown_field
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight import _in_air
from sinssim.truth.motion import TrueGravity
from sinssim.truth.motions.vibration import band_noise
from sinssim.truth.sampling import Channel, FlightEvent
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
    from sinssim.truth.flight import flight as cache
    from sinssim.truth.flight.flight_log import FlightLog

    time = np.arange(300) / 30.0
    position, q_eb = synthetic_flight(time)
    channels = {"thrust": Channel(time, time, "N")}
    log = FlightLog(time, position, q_eb, channels, (FlightEvent(1.0, "off"),))
    asked = []

    def flown(flight: object, seed: int, progress: object, meanwhile: object, errors: object) -> FlightLog:
        assert errors is None  # the true motion guides it
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


def test_tones_of_a_vibration() -> None:
    """√2 of the root mean square; of an acceleration over −ω²; each table of noise has random numbers of its own."""
    sections = scenario(
        parked={"latitude_deg": 1.0, "duration_s": 9.0},
        vibration=[
            {"coordinate": "roll", "rms_arcsec": 30.0, "low_hz": 7.0, "phase_deg": 40.0},
            {"coordinate": "down", "rms_mm": 2.0, "low_hz": 5.0, "high_hz": 20.0},
            {"coordinate": "forward", "rms_g": 0.1, "low_hz": 50.0},
            {"coordinate": "right", "rms_g": 0.3, "low_hz": 10.0, "high_hz": 30.0},
        ],
    ).vibration
    tones = [tone for number, section in enumerate(sections) for tone in section.tones(11 + number)]
    assert (tones[0].coordinate, tones[0].frequency_hz) == ("roll", 7.0)
    assert tones[0].amplitude == pytest.approx(np.sqrt(2.0) * np.radians(30.0 / 3600.0))
    assert tones[0].phase == pytest.approx(np.radians(40.0))
    assert tuple(tones[1:51]) == band_noise("down", 2e-3, 5.0, 20.0, 12)
    assert (tones[51].coordinate, tones[51].phase) == ("forward", 0.0)
    assert tones[51].amplitude == pytest.approx(-np.sqrt(2.0) * 0.980665 / (100.0 * np.pi) ** 2)
    assert tuple(tones[52:]) == band_noise("right", 0.3 * 9.80665, 10.0, 30.0, 14, of_acceleration=True)


@pytest.mark.parametrize(
    ("table", "rate", "velocity"),
    [
        # a cone of 4° at 3 Hz: about its own axis −(1 − cos 4°) of the rate, and sin 4° of it across
        ({"type": "coning", "half_angle_deg": 4.0, "frequency_hz": 3.0},
         6.0 * np.pi * np.array([np.cos(np.radians(4.0)) - 1.0, 0.0, np.sin(np.radians(4.0))]), (0.0, 0.0, 0.0)),
        ({"type": "sculling", "angle_deg": 2.0, "displacement_mm": 5.0, "frequency_hz": 4.0},
         [np.radians(2.0) * 8.0 * np.pi, 0.0, 0.0], (0.0, 0.005 * 8.0 * np.pi, 0.0)),
        ({"type": "spin-cone", "angle_deg": 10.0, "precession_deg_s": 90.0, "spin_deg_s": 60.0},
         np.radians([60.0 + 90.0 * np.cos(np.radians(10.0)), 0.0, 90.0 * np.sin(np.radians(10.0))]), (0.0, 0.0, 0.0)),
        ({"type": "spin-rock", "axis": [0.0, 3.0, 4.0], "spin_deg_s": 20.0, "angle_deg": 5.0, "frequency_hz": 2.0},
         np.radians(20.0 + 5.0 * 4.0 * np.pi) * np.array([0.0, 0.6, 0.8]), (0.0, 0.0, 0.0)),
    ],
)  # fmt: skip
def test_motions_in_closed_form_begin_as_their_tables_say(table: dict[str, Any], rate: Any, velocity: Any) -> None:
    made = scenario(motion={"latitude_deg": 1.0, "duration_s": 9.0, **table}).motion.motion()
    zero = np.zeros(1)
    np.testing.assert_allclose(made.rate(zero)[0], rate, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(made.place(zero)[1][0], velocity, rtol=1e-12, atol=1e-15)


def test_steps_of_a_rotation_table() -> None:
    """2 s at rest; −90° at 30°/s with ramps of 0.5 s, linear: after a quarter of a second half the rate."""
    steps = [
        {"type": "dwell", "duration_s": 2.0},
        {"type": "turn", "axis": [0.0, 2.0, 0.0], "angle_deg": -90.0, "rate_deg_s": 30.0, "ramp_s": 0.5,
         "profile": "trapezoidal"},
    ]  # fmt: skip
    made = scenario(motion={"type": "rotation-table", "latitude_deg": 1.0, "steps": steps}).motion.motion()
    assert made.duration == pytest.approx(5.5)
    rates = made.rate(np.array([1.0, 2.125, 4.0]))
    np.testing.assert_allclose(np.degrees(rates), [[0.0, 0.0, 0.0], [0.0, -7.5, 0.0], [0.0, -30.0, 0.0]], atol=1e-12)


def test_the_air_along_a_flight() -> None:
    """Pressure altitude, temperature and pressure at the heights of the curve, at the instants of the airspeed."""
    time = np.array([0.0, 2.5, 9.0])
    heights = {0.0: 100.0, 2.5: 900.0, 8.0: 2500.0}
    curve: Any = SimpleNamespace(
        start=0.0, end=8.0, channels={"airspeed_mps": Channel(time, time, "m/s")},
        state=lambda t: SimpleNamespace(height=np.array([heights[one] for one in t.tolist()])),
    )  # fmt: skip
    air: Any = SimpleNamespace(
        pressure_altitude=lambda h: h + 7.0, temperature=lambda h: 300.0 - h / 100.0, pressure=lambda h: 1e5 - 10.0 * h
    )  # fmt: skip
    found = _in_air(curve, air).channels
    assert list(found) == ["airspeed_mps", "pressure_altitude_m", "static_temperature_k", "static_pressure_pa"]
    for name, values, unit in (
        ("pressure_altitude_m", [107.0, 907.0, 2507.0], "m"), ("static_temperature_k", [299.0, 291.0, 275.0], "K"),
        ("static_pressure_pa", [99e3, 91e3, 75e3], "Pa"),
    ):  # fmt: skip
        assert found[name].values.tolist() == values
        assert found[name].unit == unit
        assert found[name].time is time


def test_the_part_of_the_field_that_a_navigator_does_not_know() -> None:
    """All of it without a degree of its own; nothing at the same one; else the degrees above."""
    place = (0.5, 1.4, 3000.0)
    tables = {"parked": {"latitude_deg": 1.0, "duration_s": 9.0}, "gravity": {"model": "egm2008", "degree": 20}}
    whole = DisturbingField(shipped().to_degree(20)).at(*place).gravity_ned
    low = DisturbingField(shipped().to_degree(7)).at(*place).gravity_ned
    found = unknown_field(scenario(**tables))
    assert found is not None
    np.testing.assert_allclose(found.at(*place).gravity_ned, whole, rtol=0, atol=1e-15)
    part = unknown_field(scenario(**tables, navigation={"gravity_degree": 7}))
    assert part is not None
    np.testing.assert_allclose(part.at(*place).gravity_ned, whole - low, rtol=0, atol=1e-15)
    assert np.abs(whole - low).max() > 1e-6
    assert unknown_field(scenario(**tables, navigation={"gravity_degree": 20})) is None
    assert unknown_field(scenario(parked=tables["parked"])) is None


def test_statistics_of_the_remainder_that_a_table_gives() -> None:
    section = TrueGravity.model_validate({"remainder": {
        "order": 3, "xi_sigma_arcsec": 2.0, "eta_sigma_arcsec": 3.0, "anomaly_sigma_mgal": 40.0, "correlation_km": 5.0,
    }})  # fmt: skip
    model = section.remainder_model()
    assert model is not None
    arcsec = np.radians(1.0 / 3600.0)
    assert (model.order, model.distance) == (3, 5000.0)
    assert model.sigma == pytest.approx((2.0 * arcsec, 3.0 * arcsec, 40e-5))
    assert TrueGravity().remainder_model() is None
    # of normal gravity the degrees beyond 2 are missing; at a height they are those there
    left = TrueGravity.model_validate({"remainder": {"altitude_m": 5000.0}}).remainder_model()
    assert left is not None
    whole = omission(2, 5000.0)
    assert left.sigma == (whole.deflection, whole.deflection, whole.anomaly)
    assert left.distance == whole.distance
