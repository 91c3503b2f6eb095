"""Gravity that a filter does not know: foretold from the plan, named beside the verdict, a bound on the tests."""

from __future__ import annotations

import numpy as np
import pytest

import sinssim
from sinssim.earth.gravity_disturbance import DisturbingField
from sinssim.earth.harmonic_coefficients import shipped
from sinssim.experiments.run.filter_summary import filter_numbers, sentences
from sinssim.scenario import Scenario
from sinssim.scenario.unknown_gravity import gravity_notes, unknown_gravity


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


def test_its_size_is_that_of_the_field_over_the_noise() -> None:
    """At one place: |δg| √T/N, with the noise of the accelerometers of the grade, 10 µg/√Hz."""
    found = unknown_gravity(parked(gravity={"model": "egm2008"}))
    assert found is not None
    place = np.radians([46.5]), np.radians([7.5]), np.zeros(1)
    size = float(np.linalg.norm(DisturbingField(shipped()).at(*place).gravity_ned))
    assert found.rms == pytest.approx(size, rel=1e-9)
    assert found.ratio == pytest.approx(size * np.sqrt(200.0) / (10e-6 * 9.80665), rel=0.01)
    assert found.changing < 1e-9 * size


def test_what_is_known_or_too_small_is_not_reported() -> None:
    known = parked(gravity={"model": "egm2008"}, navigation={"gravity_degree": 120})
    assert unknown_gravity(known) is None
    assert unknown_gravity(parked()) is None
    half = parked(gravity={"model": "egm2008"}, navigation={"gravity_degree": 60})
    whole = parked(gravity={"model": "egm2008"})
    assert unknown_gravity(half).rms < 0.9 * unknown_gravity(whole).rms
    assert list(gravity_notes(known)) == list(gravity_notes(parked())) == []
    coarse = parked(gravity={"model": "egm2008"}, imu={"grade": "consumer", "rate_hz": 10.0}, filter={})
    assert unknown_gravity(coarse).ratio < 10.0 < unknown_gravity(whole).ratio


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
    scenario = parked(gravity={"model": "egm2008"})
    (foretold,) = gravity_notes(scenario)
    ratio = unknown_gravity(scenario).ratio
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
    sound = sinssim.run(parked())
    assert filter_numbers(sound.aided, sound.scenario)["consistent"]
