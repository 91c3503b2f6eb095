"""Single sensors of a redundant set: their calibration and the flags of their estimate, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.data import DROPPED, FROZEN, SATURATED, ImuData
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.redundant_set_errors import combined_sigma
from sinssim.sensors.sensor_set_readings import _combined, _compensated, axis_flags, unmonitored
from sinssim.sensors.single_sensors import SingleSensors, compensate_single_sensors, perfect_readings

TIME = np.array([3.0, 3.5, 3.7])
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.8, -0.6], [0.48, 0.6, 0.64]])
BLOCK = ImuData(
    TIME, np.array([[0.03, -0.05, 0.02], [0.01, 0.04, -0.06]]), np.array([[0.7, 0.3, -4.9], [-0.2, 0.5, -1.9]])
)
BIAS = {"gyro": np.array([1e-3, 2e-3, -3e-3, 5e-3]), "accel": np.array([0.02, -0.03, 0.05, 0.07])}
SCALE = {"gyro": np.array([0.01, -0.02, 0.03, 0.04]), "accel": np.array([-0.03, 0.02, 0.01, -0.05])}


def calibrations(tilt: float = 0.0) -> tuple[ImuErrors, ...]:
    """Return biases and scale factors of four sensors, in threes, and a lean of each to the two axes across it."""

    def triad(name: str, first: int) -> TriadErrors:
        rows = slice(first, first + 3)
        values = {"bias": np.zeros(3), "scale": np.zeros(3)}
        for field, of in (("bias", BIAS), ("scale", SCALE)):
            values[field][: len(of[name][rows])] = of[name][rows]
        lean = tilt * (np.ones((3, 3)) - np.eye(3))
        return TriadErrors(**values, misalignment=lean)

    return tuple(ImuErrors(triad("gyro", k), triad("accel", k)) for k in (0, 3))


def readings(tilted: float = 0.0) -> SingleSensors:
    """Return (1 + k)(d + lean) · x + b Δt of each sensor; it leans to the sum of two axes across its own."""
    steps = np.diff(TIME)[:, None]
    found = {}
    for name, sums in (("gyro", BLOCK.dtheta), ("accel", BLOCK.dvel)):
        rows = []
        for i, d in enumerate(AXES):
            least = np.eye(3)[np.argmin(np.abs(d))]
            across = np.cross(d, least) / np.linalg.norm(np.cross(d, least))
            felt = d + tilted * (across + np.cross(d, across))
            rows.append((1.0 + SCALE[name][i]) * (sums @ felt) + BIAS[name][i] * steps[:, 0])
        found[name] = np.column_stack(rows)
    return SingleSensors(TIME, found["gyro"], found["accel"])


def test_each_sensor_is_freed_of_its_own_errors() -> None:
    perfect = perfect_readings(BLOCK, AXES)
    np.testing.assert_allclose(perfect.dtheta[0], [0.03, -0.014, -0.052, -0.0028], atol=1e-16)
    np.testing.assert_allclose(perfect.dvel[1], [-0.2, -1.22, 1.54, -1.012], atol=1e-15)
    for tilt in (0.0, 2e-3):
        found = compensate_single_sensors(readings(tilt), calibrations(tilt), AXES, BLOCK)
        np.testing.assert_allclose(found.dtheta, perfect.dtheta, rtol=0.0, atol=1e-16)
        np.testing.assert_allclose(found.dvel, perfect.dvel, rtol=0.0, atol=4e-15)
        np.testing.assert_array_equal(found.time, TIME)


def test_the_input_across_an_axis_follows_from_the_estimate_itself() -> None:
    """What the sensors lean to is known by the combination alone; also of three sensors out of four."""
    perfect = perfect_readings(BLOCK, AXES)
    three = np.tile([True, True, False, True], (2, 1))
    for used in ((None, None), (three, three)):
        found = _compensated(readings(2e-3), calibrations(2e-3), AXES, used)
        assert found is not None
        np.testing.assert_allclose(found.dtheta, perfect.dtheta, rtol=0.0, atol=1e-16)
        np.testing.assert_allclose(found.dvel, perfect.dvel, rtol=0.0, atol=1e-14)
        block = _combined(found, AXES, used)
        np.testing.assert_allclose(block.dtheta, BLOCK.dtheta, rtol=0.0, atol=2e-15)
        np.testing.assert_allclose(block.dvel, BLOCK.dvel, rtol=0.0, atol=1e-13)
    assert _compensated(readings(), (), AXES, (None, None)) is None


def test_the_estimate_without_monitoring_is_of_what_is_compensated() -> None:
    """Least squares, (HᵀH)⁻¹Hᵀ of all sensors."""
    read, left = readings(), SingleSensors(TIME, 2.0 * readings().dtheta, 3.0 * readings().dvel)
    inverse = np.linalg.inv(AXES.T @ AXES) @ AXES.T
    for both, single in (((read, None), read), ((read, left), left)):
        given: Any = type("Given", (), {"single": both[0], "single_compensated": both[1]})
        found = unmonitored(given, AXES)
        np.testing.assert_allclose(found.dtheta, single.dtheta @ inverse.T, rtol=0.0, atol=1e-16)
        np.testing.assert_allclose(found.dvel, single.dvel @ inverse.T, rtol=0.0, atol=1e-14)
        np.testing.assert_array_equal(found.time, TIME)


@pytest.mark.parametrize("some", [False, True])
def test_flags_of_the_estimate(some: bool) -> None:
    """Each axis has those of all gyros, or of all accelerometers; without those of sensors that are not used."""
    flags = np.zeros((2, 8), np.uint8)
    flags[0, 1], flags[0, 3], flags[1, 6] = SATURATED, FROZEN, DROPPED
    single = SingleSensors(TIME, BLOCK.dtheta, BLOCK.dvel, flags)
    gyros = np.array([[True, True, True, False], [True, True, True, True]])
    accels = np.array([[True, True, True, True], [True, True, False, True]])
    found = axis_flags(single, (gyros, accels) if some else (None, None))
    first, last = (SATURATED, 0) if some else (SATURATED | FROZEN, DROPPED)
    assert found is not None
    assert found.tolist() == [[first] * 3 + [0] * 3, [0] * 3 + [last] * 3]
    assert axis_flags(SingleSensors(TIME, BLOCK.dtheta, BLOCK.dvel), (None, None)) is None


def test_sigmas_of_a_combination_whose_axes_differ() -> None:
    """P = (HᵀH)⁻¹: errors with a number for each axis by the root of its diagonal, noises by that of its mean."""
    axes = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [0.96, 0.28, 0.0], [0.8, 0.0, 0.6]])
    section = Imu.model_validate(
        {"grade": "ideal", "rate_hz": 10.0, "sensor_set": {"type": "redundant", "directions": axes.tolist()}}
    )
    p = np.linalg.inv(axes.T @ axes)
    root, mean = np.sqrt(np.diag(p)), np.sqrt(np.trace(p) / 3.0)
    assert root.max() > 2.0 * root.min()
    rows = ("bias", "bias_temperature", "ramp", "asymmetry", "quadratic", "cubic")
    noises = ("random_walk", "quantum", "instability", "rate_walk", "flicker")
    own = TriadErrors(
        **{name: np.array([1.0, 2.0, 3.0]) * (k + 1.0) for k, name in enumerate(rows)},
        **{name: k + 0.5 for k, name in enumerate(noises)},
        cross_axis=np.array([[0.0, 1.0, 2.0], [3.0, 0.0, 4.0], [5.0, 6.0, 0.0]]), correlation_time=70.0,
    )  # fmt: skip
    found = combined_sigma(ImuErrors(own, own), section)
    for triad in (found.gyro, found.accel):
        for name in rows:
            np.testing.assert_allclose(getattr(triad, name), root * getattr(own, name), rtol=1e-12, err_msg=name)
        for name in noises:
            assert getattr(triad, name) == pytest.approx(mean * getattr(own, name), rel=1e-12), name
        np.testing.assert_allclose(triad.cross_axis, root[:, None] * own.cross_axis, rtol=1e-12)
        assert triad.correlation_time == 70.0
