"""The batch serves what it can, and says why not otherwise."""

from __future__ import annotations

import pytest

import sinssim
from sinssim.experiments.ensembles.batch_navigation import why_algorithm_unsupported, why_unsupported


def reason(*changes: str) -> str | None:
    return why_unsupported(sinssim.load_scenario("first_flight", changes))


def test_the_demonstration_is_served_by_its_algorithms_without_euler() -> None:
    assert reason('navigation.algorithms=["quaternion", "poisson"]') is None
    assert reason() == "euler has attitude variables of its own kind"


@pytest.mark.parametrize(
    ("algorithm", "words"),
    [
        ("quaternion", None),
        ("poisson-3", None),
        ("quaternion-2-norm", None),
        ("two-quaternions", None),
        ("poisson-3-ortho", "iterates to the nearest rotation"),
        ("rotation-vector-4", "several samples"),
        ("rotation-vector-1p", "in its own way"),
        ("functional-iteration", "several samples"),
    ],
)
def test_algorithms(algorithm: str, words: str | None) -> None:
    found = why_algorithm_unsupported(algorithm)
    assert found is None if words is None else words in str(found)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("navigation.frame=wander", 'navigation.frame = "wander"'),
        ('imu.faults=[{type="spike", at_s=5.0, gyro_arcsec=[1.0, 0.0, 0.0]}]', "faults"),
        ("navigation.rates_hz=[100.0, 50.0, 10.0]", "three-rate"),
        ("aiding.baro.rate_hz=10.0", "the barometer"),
        ("gravity.remainder.order=2", "the remainder of its gravity is drawn in each run"),
    ],
)
def test_scenarios(change: str, words: str) -> None:
    assert words in str(reason('navigation.algorithms=["quaternion"]', change))


def test_a_true_field_is_served_and_a_navigator_that_knows_it_is_not() -> None:
    algorithms = 'navigation.algorithms=["quaternion"]'
    assert reason(algorithms, "gravity.model=egm2008") is None
    known = reason(algorithms, "gravity.model=egm2008", "navigation.gravity_degree=20")
    assert known == "its navigator compensates the disturbance of gravity along its own path"
