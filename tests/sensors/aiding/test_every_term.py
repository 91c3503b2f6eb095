"""Every aiding sensor and every term of its errors: each is what its parameter says, and leaves the others alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import NavSolution
from sinssim.scenario.filter_section import AidingSection
from sinssim.sensors.aiding_registry import SENSORS
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle
from sinssim.truth.curve import Curve
from sinssim.truth.motions.parked_and_great_circle import Parked
from sinssim.truth.trajectory import Trajectory
from tests.truth.motions import synthetic_flight

STILL, LEVEL = (0.0, 0.0, 0.0), np.array([1.0, 0.0, 0.0, 0.0])
NONE = 1e-12
"""As good as no noise, which must be positive."""


@pytest.fixture(scope="module")
def flight() -> Curve:
    """Twenty seconds with turns, climbs and rolling."""
    time = np.arange(0.0, 20.001, 1.0 / 120.0)
    return Curve(time, *synthetic_flight(time), STILL, LEVEL)


def parked(duration: float) -> Parked:
    return Parked(0.9, 0.2, 400.0, LEVEL, duration, STILL, LEVEL)


def exact(trajectory: Trajectory) -> NavSolution:
    """Return the solution of another inertial system that is exact."""
    time = np.linspace(trajectory.start, trajectory.end, round(20 * (trajectory.end - trajectory.start)) + 1)
    s = trajectory.state(time)
    return NavSolution(
        time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(len(time)), "quaternion"
    )


OWN: dict[str, dict[str, Any]] = {
    "gnss": {"correlated_position_sigma_m": 2.0, "lever_arm_sigma_m": 0.1},
    "magnetometer": {"deviation_sigma_deg": 1.0},
    "odometer": {"lever_arm_m": (1.0, 0.5, 0.2)},
    "zero_velocity": {"during_s": ((0.0, 20.0),)},
    "zero_rate": {"during_s": ((0.0, 20.0),)},
    "attitude": {"bias_sigma_arcmin": 3.0},
    "master": {"attitude": True},
    "land_vehicle": {"lateral_limit_mps2": 1e3, "drift_vertical_mps": 0.3},
}
"""Keys by which a sensor has all of its terms."""


def sense(name: str, trajectory: Trajectory, seed: int = 3, **more: Any) -> list[AidingReadings]:
    """Return everything that a sensor gives."""
    section = AidingSection.model_validate({name: {**OWN.get(name, {}), **more}})
    return section.sensors()[name].read(Vehicle(trajectory, seed, lambda grade, arm: exact(trajectory)))


@pytest.mark.parametrize("name", SENSORS)
def test_rate_latency_and_outages(name: str, flight: Curve) -> None:
    whole = sense(name, flight, rate_hz=4.0)
    late = sense(name, flight, rate_hz=4.0, latency_s=0.7, outages_s=((2.0, 3.0), (5.1, 6.1)))
    for full, part in zip(whole, late, strict=True):
        time = np.arange(1, 81) / 4.0
        np.testing.assert_allclose(full.measurements.time, time, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(full.measurements.arrival, full.measurements.time)
        kept = ~(((time >= 2.0) & (time <= 3.0)) | ((time >= 5.1) & (time <= 6.1)))
        assert np.count_nonzero(~kept) == 5 + 4
        np.testing.assert_array_equal(part.measurements.time, full.measurements.time[kept])
        np.testing.assert_array_equal(part.measurements.value, full.measurements.value[kept])
        np.testing.assert_array_equal(part.measurements.sigma, full.measurements.sigma[kept])
        np.testing.assert_allclose(part.measurements.arrival - part.measurements.time, 0.7, rtol=0, atol=1e-12)
        assert len(part.time) == len(time)


DEG, ARCMIN, ARCSEC = np.pi / 180.0, np.pi / 10_800.0, np.pi / 648_000.0


@pytest.mark.parametrize(
    ("name", "key", "told", "block", "sigma"),
    [
        ("baro", "scale_sigma_ppm", 4000.0, "baro scale", 4e-3),
        ("baro", "bias_sigma_m", 9.0, "baro bias", 9.0),
        ("magnetometer", "bias_sigma_deg", 1.5, "magnetometer bias", 1.5 * DEG),
        ("magnetometer", "deviation_sigma_deg", 2.5, "magnetometer deviation", 2.5 * DEG),
        ("airspeed", "bias_sigma_mps", 3.0, "airspeed bias", 3.0),
        ("airspeed", "scale_sigma_ppm", 7000.0, "airspeed scale", 7e-3),
        ("odometer", "scale_sigma_ppm", 2000.0, "odometer scale", 2e-3),
        ("attitude", "bias_sigma_arcmin", 12.0, "attitude bias", 12.0 * ARCMIN),
        ("star_tracker", "bias_sigma_arcsec", 40.0, "star-tracker bias", 40.0 * ARCSEC),
        ("gnss", "correlated_height_sigma_m", 6.0, "gnss-position bias", 6.0),
        ("gnss", "correlated_velocity_sigma_mps", 0.3, "gnss-velocity bias", 0.3),
        ("gnss", "lever_arm_sigma_m", 0.4, "gnss lever arm", 0.4),
        ("gnss", "time_offset_sigma_s", 0.3, "gnss time offset", 0.3),
        ("gnss", "velocity_delay_sigma_s", 0.2, "gnss-velocity delay", 0.2),
        ("dual_antenna", "bias_sigma_deg", 0.7, "dual-antenna bias", 0.7 * DEG),
        ("land_vehicle", "drift_lateral_mps", 0.3, "land-vehicle bias", 0.3),
        ("land_vehicle", "mounting_sigma_deg", 4.0, "land-vehicle mounting", 4.0 * DEG),
        ("land_vehicle", "lever_arm_sigma_m", 0.5, "land-vehicle lever arm", 0.5),
        ("land_vehicle", "slip_sigma_deg_per_g", 3.0, "land-vehicle slip", 3.0 * DEG / 9.80665),
        ("master", "mounting_sigma_arcmin", 25.0, "master-attitude bias", 25.0 * ARCMIN),
    ],
)
def test_what_is_drawn_has_the_sigma_that_its_parameter_says(
    name: str, key: str, told: float, block: str, sigma: float
) -> None:
    """Over 100 runs; that readings are off by just this is shown sensor by sensor elsewhere."""
    place, found = parked(1.0), []
    for seed in range(100):
        values = next(g.parameters[block] for g in sense(name, place, seed, **{key: told}) if block in g.parameters)
        found.append(values[0] if values.ndim > 1 else values)
    drawn = np.array(found)
    if key == "correlated_height_sigma_m":
        drawn = drawn[:, 2:]
    for column in drawn.T:
        low, high = chi2.ppf([0.5e-5, 1.0 - 0.5e-5], len(column))
        assert low < np.sum((column / sigma) ** 2) < high
        assert abs(np.mean(column)) < 4.5 * sigma / np.sqrt(len(column))
    if drawn.shape[1] > 1:  # axes of their own
        pairs = np.corrcoef(drawn.T)[np.triu_indices(drawn.shape[1], 1)]
        assert np.abs(pairs).max() < 4.5 / np.sqrt(len(drawn))


def test_the_velocity_error_of_a_master_is_its_solution_less_the_truth() -> None:
    place, error = parked(4.0), np.array([0.3, -0.2, 0.1])
    solution = replace(exact(place), velocity_ned=np.tile(error, (81, 1)))
    (given,) = (
        AidingSection.model_validate({"master": {}})
        .sensors()["master"]
        .read(Vehicle(place, 3, lambda grade, arm: solution))
    )
    np.testing.assert_allclose(given.parameters["master-velocity bias"], np.tile(error, (4, 1)), rtol=0, atol=1e-12)


def test_drift_of_an_attitude_reference_decays_with_its_time() -> None:
    tau, n = 20.0, 40_000
    (given,) = sense("attitude", parked(float(n)), 1, bias_sigma_arcmin=5.0, bias_correlation_time_s=tau)
    for axis in given.parameters["attitude bias"].T / ARCMIN:
        # a mean square of correlated numbers spreads as one of N T/τ independent ones (Bendat and Piersol)
        spread = 4.5 * np.sqrt(2.0 * tau / n)
        assert np.mean(axis**2) == pytest.approx(25.0, rel=spread)
        assert np.mean(axis[20:] * axis[:-20]) / 25.0 == pytest.approx(np.exp(-1.0), abs=spread)


TERMS = {
    "baro": {"sigma_m": 1.0, "bias_sigma_m": 8.0, "scale_sigma_ppm": 3000.0},
    "magnetometer": {"sigma_deg": 0.5, "bias_sigma_deg": 1.0, "deviation_sigma_deg": 2.0},
    "airspeed": {"sigma_mps": 0.5, "bias_sigma_mps": 1.0, "scale_sigma_ppm": 5000.0},
    "odometer": {"sigma_mps": 0.1, "scale_sigma_ppm": 3000.0},
    "gnss": {"velocity_sigma_mps": 0.1, "correlated_velocity_sigma_mps": 0.2},
}
"""Terms that add up."""


@pytest.mark.parametrize(("name", "term"), [(name, term) for name, terms in TERMS.items() for term in terms])
def test_a_term_adds_the_same_whatever_else_there_is(name: str, term: str, flight: Curve) -> None:
    """The others draw the same random numbers with it and without, and it draws the same with them and without."""

    def value(on: dict[str, float]) -> np.ndarray:
        off = {key: NONE if key.partition("_")[0] in ("sigma", "velocity") else 0.0 for key in TERMS[name]}
        return sense(name, flight, 5, **{**off, **on})[-1].measurements.value

    terms = TERMS[name]
    others = {key: size for key, size in terms.items() if key != term}
    alone = value({term: terms[term]}) - value({})
    beside = value(terms) - value(others)
    np.testing.assert_allclose(beside, alone, rtol=0, atol=1e-11)
    assert np.abs(alone).max() > 0.2 * terms[term] * (1e-4 if term.endswith("ppm") else DEG if "deg" in term else 0.5)
