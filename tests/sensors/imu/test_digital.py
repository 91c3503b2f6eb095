"""The steps of a run's increments, against exact arithmetic with rational numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.emulation import digital, emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_readings import sums

STEPS = {"dtheta": Fraction(1, 2**52), "dvel": Fraction(1, 2**46)}


def increments() -> ImuData:
    """Return a steady rate with a small motion, forward specific force and weight."""
    rng = np.random.default_rng(3)
    steady = np.array([7.3e-7, -2.1e-7, 0.03]), np.array([0.01, 0.0, -0.098])
    noise = rng.normal(0.0, 1e-5, (2, 3000, 3))
    return ImuData(np.arange(3001) / 100.0, steady[0] + noise[0], steady[1] + noise[1])


def exact_sums(rows: np.ndarray, axis: int) -> list[Fraction]:
    """Return the sum of all increments of an axis up to each, without rounding."""
    total, found = Fraction(0), []
    for value in rows[:, axis]:
        total += Fraction(float(value))
        found.append(total)
    return found


@pytest.mark.parametrize("name", STEPS)
def test_increments_are_whole_steps_and_no_sum_is_off_by_more_than_half_of_one(name):
    ideal, step = increments(), STEPS[name]
    given, made = getattr(ideal, name), getattr(digital(ideal), name)
    for axis in range(3):
        assert all((Fraction(float(value)) / step).denominator == 1 for value in made[:, axis])
        # the remainder is carried in doubles, with a relative rounding of 2^-53
        off = [abs(a - b) for a, b in zip(exact_sums(given, axis), exact_sums(made, axis), strict=True)]
        assert max(off) <= step * Fraction(51, 100)
        assert max(off) > step * Fraction(45, 100)


def test_a_second_rounding_changes_nothing():
    once = digital(increments())
    twice = digital(once)
    assert np.array_equal(once.dtheta, twice.dtheta)
    assert np.array_equal(once.dvel, twice.dvel)


def test_sums_to_a_lower_rate_are_exact():
    made = digital(increments())
    for name, rows in (("dtheta", made.dtheta), ("dvel", made.dvel)):
        few = sums(rows, 10)
        for axis in range(3):
            assert exact_sums(few, axis)[-1] == exact_sums(rows, axis)[-1], name


def test_measured_increments_stay_within_half_a_step_of_those_without_steps():
    ideal = digital(increments())
    errors = draw(Imu(grade="tactical"), 7)
    plain, made = emulate(ideal, errors, 7), emulate(ideal, errors, 7, rounded=True)
    for name, step in STEPS.items():
        for axis in range(3):
            off = np.array(exact_sums(getattr(plain, name), axis)) - np.array(exact_sums(getattr(made, name), axis))
            assert 0 < max(abs(off)) <= step * Fraction(51, 100)


def test_pulses_remain_the_steps_of_sensors_that_have_them():
    ideal = digital(increments())
    errors = ImuErrors(TriadErrors(quantum=2e-6, random_walk=1e-6), TriadErrors(random_walk=1e-4))
    plain, made = emulate(ideal, errors, 7), emulate(ideal, errors, 7, rounded=True)
    assert np.array_equal(plain.dtheta, made.dtheta)
    assert not np.array_equal(plain.dvel, made.dvel)


def test_a_block_without_errors_puts_out_the_ideal_increments():
    ideal = digital(increments())
    assert emulate(ideal, ImuErrors(), 7, rounded=True) is ideal
