"""Gravity that a filter does not know: foretold from the plan, named beside the verdict, a bound on the tests."""

from __future__ import annotations

import numpy as np
import pytest

import sinssim
from sinssim import rotation
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import ImuData, NavState
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import shipped
from sinssim.estimation import Block, error_model
from sinssim.estimation.filter_start import at_rest
from sinssim.experiments.run.filter_summary import filter_numbers, sentences
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import filter_model, inertial_sigma, notes
from sinssim.scenario.filter_section import FILTER_STATES
from sinssim.scenario.unknown_gravity import unknown_gravity
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.parked_and_great_circle import Parked

INERTIAL = tuple(FILTER_STATES)


def parked(**tables: object) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "parked",
            "seed": 1,
            "parked": {"latitude_deg": 46.5, "longitude_deg": 7.5, "heading_deg": 40.0, "duration_s": 200.0},
            "imu": {"grade": "laser-navigation", "rate_hz": 10.0},
            "aiding": {"zero_velocity": {"rate_hz": 1.0}},
            "filter": {"alignment_s": 60.0},
            **tables,
        }
    )


def ratio_of(scenario: Scenario) -> float:
    """Return d for the noise that the scenario's filter assumes."""
    return unknown_gravity(scenario).ratio(inertial_sigma(scenario).accel.random_walk)


def test_its_size_is_that_of_the_field_over_the_noise() -> None:
    """At one place: |δg| √T/N, with the noise of the accelerometers of the grade, 10 µg/√Hz."""
    found = unknown_gravity(parked(gravity={"model": "egm2008"}))
    assert found is not None
    place = np.radians([46.5]), np.radians([7.5]), np.zeros(1)
    size = float(np.linalg.norm(DisturbingField(shipped()).at(*place).gravity_ned))
    assert found.rms == pytest.approx(size, rel=1e-9)
    assert found.ratio(10e-6 * 9.80665) == pytest.approx(size * np.sqrt(200.0) / (10e-6 * 9.80665), rel=1e-9)
    assert found.changing < 1e-9 * size


def test_what_is_known_or_too_small_is_not_reported() -> None:
    known = parked(gravity={"model": "egm2008"}, navigation={"gravity_degree": 120})
    assert unknown_gravity(known) is None
    assert unknown_gravity(parked()) is None
    half = parked(gravity={"model": "egm2008"}, navigation={"gravity_degree": 60})
    whole = parked(gravity={"model": "egm2008"})
    assert unknown_gravity(half).rms < 0.9 * unknown_gravity(whole).rms
    assert list(notes(known)) == list(notes(parked())) == []
    coarse = parked(gravity={"model": "egm2008"}, imu={"grade": "consumer", "rate_hz": 10.0}, filter={})
    assert ratio_of(coarse) < 10.0 < ratio_of(whole)


def test_the_remainder_is_constant_for_a_parked_vehicle_and_changes_on_the_way() -> None:
    remainder = {"model": "egm2008", "remainder": {"order": 2}}
    still = unknown_gravity(parked(gravity=remainder, navigation={"gravity_degree": 120}))
    circle = {"latitude_deg": 46.5, "course_deg": 60.0, "speed_mps": 250.0, "duration_s": 200.0}
    moving = parked(
        gravity=remainder, parked=None, great_circle=circle, navigation={"gravity_degree": 120},
        aiding={"gnss": {}}, filter={},
    )  # fmt: skip
    found = unknown_gravity(moving)
    assert still.changing == 0.0
    assert found.changing == pytest.approx(found.rms)


def test_a_run_is_not_consistent_and_names_it_and_no_test_exceeds_the_bound() -> None:
    """The sum of all squared errors exceeds the number of states by at most d², here by a tenth of it or more."""
    scenario = parked(gravity={"model": "egm2008"}, filter={"alignment_s": 60.0, "states": INERTIAL})
    (foretold,) = notes(scenario)
    ratio = ratio_of(scenario)
    assert f"up to {ratio:.0f} times the noise" in foretold
    result = sinssim.run(scenario)
    numbers = filter_numbers(result.aided, result.scenario)
    assert not numbers["consistent"]
    every = numbers["nees"]["all states"]
    assert every["verdict"] == "optimistic"
    assert 0.1 * ratio**2 < (every["value"] - 1.0) * every["states"] < ratio**2
    said = list(sentences(numbers))
    assert foretold in said
    assert any(sentence.startswith("Therefore the filter is not consistent: errors larger") for sentence in said)
    for sound in (sinssim.run(parked()), sinssim.run(parked(gravity={"model": "egm2008"}))):
        assert filter_numbers(sound.aided, sound.scenario)["consistent"]


def test_the_process_has_the_size_and_the_changes_of_the_field_along_the_plan() -> None:
    """Along a parallel, from the field itself at other points: rms, and γ = 2σ²(1 − exp(−l/D)) over a tenth of it."""
    way = {"latitude_deg": 0.0, "longitude_deg": 80.0, "course_deg": 90.0, "speed_mps": 250.0, "duration_s": 4000.0}
    scenario = parked(gravity={"model": "egm2008"}, parked=None, great_circle=way, aiding={"gnss": {}}, filter={})
    found = unknown_gravity(scenario)
    east = np.radians(80.0) + np.linspace(0.0, 1e6, 3001) / 6378137.0
    field = DisturbingField(shipped()).at(np.zeros(3001), east, np.zeros(3001)).gravity_ned
    square = np.mean(field**2, axis=0)
    square[:2] = np.mean(square[:2])
    np.testing.assert_allclose(found.sigma, np.sqrt(square), rtol=0.03)
    changes = np.mean((field[300:] - field[:-300]) ** 2, axis=0)
    lost = max(np.mean(changes[:2]) / square[0], changes[2] / square[2]) / 2.0
    assert found.distance == pytest.approx(-1e5 / np.log(1.0 - lost), rel=0.05)
    (block,) = (b for b in filter_model(scenario).blocks if b.name == "gravity disturbance")
    assert (block.correlation_distance, tuple(block.sigma)) == (found.distance, tuple(found.sigma))


def test_states_given_by_keys_and_of_recorded_sensors() -> None:
    """Without a true field the degree variances give 1σ and D; keys replace each."""
    from sinssim.earth.harmonic_coefficients import omission

    keys = {"deflection_sigma_arcsec": 3.0, "correlation_km": 40.0}
    plain = {"alignment_s": 60.0, "states": ("gravity disturbance",)}
    left = omission(2)
    (block,) = filter_model(parked(filter=plain)).blocks[3:]
    assert block.correlation_distance == left.distance
    np.testing.assert_allclose(block.sigma, [*2 * [9.80665 * left.deflection], left.anomaly])
    (block,) = filter_model(parked(filter={**plain, "gravity": keys})).blocks[3:]
    assert block.correlation_distance == 40e3
    np.testing.assert_allclose(block.sigma, [*2 * [9.80665 * np.radians(3.0 / 3600.0)], left.anomaly])
    (block,) = filter_model(parked(filter={**plain, "gravity": {"anomaly_sigma_mgal": 7.0}})).blocks[3:]
    assert block.sigma[2] == pytest.approx(7e-5)
    with pytest.raises(ValueError, match="correlation_km"):
        parked(filter={**plain, "gravity": {"correlation_km": 0.0}})


def test_the_error_of_the_states_is_that_of_the_disturbance() -> None:
    """The true value is that of the field at the place, less what the navigator knows."""
    for known in (None, 60):
        navigation = {} if known is None else {"navigation": {"gravity_degree": known}}
        aided = sinssim.run(parked(gravity={"model": "egm2008"}, **navigation)).aided
        place = np.radians(46.5), np.radians(7.5), 0.0
        there = DisturbingField(shipped()).at(*place).gravity_ned
        if known is not None:
            there = there - DisturbingField(shipped().to_degree(known)).at(*place).gravity_ned
        estimate = aided.estimate.parameters["gravity disturbance"]
        found = aided.block_error("gravity disturbance") + estimate
        np.testing.assert_allclose(found, np.tile(there, (len(found), 1)), atol=1e-8)


def test_levelling_by_a_plumb_line_that_leans() -> None:
    """The attitude that eq. (1) finds with a force that is wrong by δg, by differences, against the covariance."""
    start = NavState(np.asarray(0.8), np.asarray(0.1), np.asarray(0.0), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    place = Parked(0.8, 0.1, 0.0, start.q_nb, 20.0)
    ideal = place.increments(10.0)
    sigma = expected_errors(Imu(grade="laser-navigation")).sigma
    model = error_model(sigma, extra=[Block("gravity disturbance", (1e-4, 2e-4, 3e-4))])
    without = at_rest(ideal, start, error_model(sigma), sigma, 150)
    found = at_rest(ideal, start, model, sigma, 150)
    slope = np.zeros((3, 3))
    for axis in range(3):
        felt = np.zeros(3)
        felt[axis] = 1e-4 * 0.1
        leaning = at_rest(ImuData(ideal.time, ideal.dtheta, ideal.dvel - felt), start, model, sigma, 150).state
        turn = rotation.multiply(leaning.q_nb, rotation.conjugate(without.state.q_nb))
        slope[:, axis] = -rotation.rotation_vector_from_quaternion(turn) / 1e-4
    phi, gravity = slice(6, 9), model.slices["gravity disturbance"]
    size = np.diag(np.square([1e-4, 2e-4, 3e-4]))
    np.testing.assert_allclose(found.covariance[phi, gravity], slope @ size, atol=1e-3 * 2e-4**2 / 9.8)
    added = found.covariance[phi, phi] - without.covariance[phi, phi]
    np.testing.assert_allclose(added, slope @ size @ slope.T, atol=1e-3 * (2e-4 / 9.8) ** 2)
    assert np.linalg.eigvalsh(found.covariance / np.sqrt(np.outer(*2 * [found.covariance.diagonal()]))).min() > -1e-9
