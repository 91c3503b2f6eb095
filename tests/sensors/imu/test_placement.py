"""Accelerometers at places of their own and at instants of their own, against motions in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.imu.size_effect import at_the_elements
from sinssim.truth.motions.analytic import inertial_increments
from sinssim.truth.motions.coning_and_rocking import Sculling, SpinRock

ARMS = np.array([[0.05, -0.02, 0.01], [-0.03, 0.04, 0.02], [0.01, 0.03, -0.06]])
AXIS = (1.0, -2.0, 0.7)


def rocking(frequency_hz: float, arm=(0.0, 0.0, 0.0)) -> SpinRock:
    return SpinRock(AXIS, 1.5, 0.3 / frequency_hz, 2 * np.pi * frequency_hz, arm)


@pytest.mark.parametrize(("frequency_hz", "tolerance"), [(0.5, 1e-5), (2.0, 5e-4), (10.0, 5e-3)])
def test_size_effect_of_a_spin_with_rocking(frequency_hz: float, tolerance: float) -> None:
    at_centre = inertial_increments(rocking(frequency_hz), 100.0, 20.0)
    found = at_the_elements(at_centre, ARMS, 0.0)
    for i in range(3):
        exact = inertial_increments(rocking(frequency_hz, ARMS[i]), 100.0, 20.0).dvel[:, i]
        inside = slice(5, -5)  # at the ends a spline knows less
        error = np.abs(found.dvel[inside, i] - exact[inside]).max()
        assert error < tolerance * np.abs(exact).max()
        assert np.abs(found.dvel[:, i] - exact).max() < 30 * tolerance * np.abs(exact).max()
        assert found.dvel[:, i].sum() == pytest.approx(exact.sum(), rel=1e-4)
    assert np.array_equal(found.dtheta, at_centre.dtheta)


def test_rate_that_is_constant_pulls_outwards_at_any_length_of_interval() -> None:
    time = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.6, 1.0])
    interval = np.diff(time)[:, None]
    ideal = ImuData(time, interval * [0.0, 0.0, 2.0], 0.0 * interval * [1.0, 1.0, 1.0])
    found = at_the_elements(ideal, ARMS, 0.0)
    # ω × (ω × r) = −ω² (r_x, r_y, 0)
    expected = interval * [-4.0 * ARMS[0, 0], -4.0 * ARMS[1, 1], 0.0]
    np.testing.assert_allclose(found.dvel, expected, rtol=0, atol=4e-16)


@pytest.mark.parametrize("delay", [0.0035, -0.0035, 0.01])
def test_delayed_accelerometers_integrate_over_shifted_intervals(delay: float) -> None:
    motion = Sculling(0.2, 0.05, 2 * np.pi * 1.5)
    edges = np.arange(1001) * 0.01
    ideal = ImuData(edges, motion.turn(edges[:-1], edges[1:]), motion.push(edges[:-1], edges[1:]))
    found = at_the_elements(ideal, np.zeros((3, 3)), delay)
    exact = motion.push(edges[:-1] - delay, edges[1:] - delay)
    inside = slice(5, -5)
    change = np.abs(exact - ideal.dvel).max()
    assert np.abs(found.dvel[inside] - exact[inside]).max() < 2e-4 * change
    assert np.abs(found.dvel - exact).max() < 2e-2 * change
    assert np.array_equal(found.dtheta, ideal.dtheta)


def test_arms_and_delay_together_are_the_size_effect_delayed() -> None:
    ideal = inertial_increments(rocking(0.5), 100.0, 10.0)
    found = at_the_elements(ideal, ARMS, 0.004)
    edges = ideal.time
    exact = np.stack(
        [rocking(0.5, arm).push(edges[:-1] - 0.004, edges[1:] - 0.004)[:, i] for i, arm in enumerate(ARMS)], axis=1
    )
    assert np.abs(found.dvel - exact)[5:-5].max() < 2e-5 * np.abs(exact).max()


def test_arms_and_delay_of_a_scenario_are_in_front_of_the_other_errors() -> None:
    ideal = inertial_increments(rocking(1.0), 100.0, 5.0)
    section = Imu.model_validate(
        {
            "grade": "ideal",
            "accel_arms_mm": (1e3 * ARMS).tolist(),
            "accel_delay_ms": 2.0,
            "accel_scale_ppm": [1e5, 0.0, 0.0],
        }
    )
    measured = emulate(ideal, section)
    where = at_the_elements(ideal, ARMS, 0.002)
    assert measured.dvel[:, 0] == pytest.approx(1.1 * where.dvel[:, 0], rel=1e-13, abs=1e-17)
    assert measured.dvel[:, 1] == pytest.approx(where.dvel[:, 1], rel=1e-13, abs=1e-17)


def test_without_arms_and_delay_nothing_is_touched() -> None:
    ideal = inertial_increments(rocking(1.0), 100.0, 1.0)
    assert at_the_elements(ideal, np.zeros((3, 3)), 0.0) is ideal


def test_what_cannot_be() -> None:
    ideal = inertial_increments(rocking(1.0), 100.0, 1.0)
    with pytest.raises(InputError, match=r"lag the gyro data by 0\.02 s, more than one interval of 0\.01 s"):
        emulate(ideal, ImuErrors(TriadErrors(), TriadErrors(), delay=0.02))
    few = ImuData(ideal.time[:4], ideal.dtheta[:3], ideal.dvel[:3])
    with pytest.raises(InputError, match=r"at least 4 samples.*here are 3"):
        emulate(few, ImuErrors(arms=ARMS))
