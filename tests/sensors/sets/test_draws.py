"""Errors of special sets as their keys say, in SI, and the random numbers of each sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import Imu, draw
from sinssim.sensors.imu.rotation_encoder import EncoderErrors, Encoders, draw_encoders, read_angles
from sinssim.sensors.redundant_set_errors import noise_variance
from sinssim.sensors.sensor_set_readings import draw_attitude_sensor, draw_platform, torquer_sigma
from sinssim.sensors.sensor_set_section import READY, checked_directions, dilution
from sinssim.sensors.single_sensors import axes_about, emulate_accelerometers

_ARCSEC = np.pi / 648_000.0


def _section(**keys: Any) -> Imu:
    return Imu.model_validate({"grade": "ideal"} | keys)


def test_a_platform() -> None:
    own = {"type": "platform", "torquer_scale_ppm": (30.0, -20.0, 50.0), "pickoff_arcsec": (4.0, -7.0, 9.0)}
    found = draw_platform(_section(sensor_set={**own, "pickoff_noise_arcsec": 2.5}), 4)
    assert found.torquer_scale == pytest.approx([3e-5, -2e-5, 5e-5])
    assert found.pickoff == pytest.approx(_ARCSEC * np.array((4.0, -7.0, 9.0)))
    assert found.pickoff_noise == pytest.approx(2.5 * _ARCSEC)
    assert torquer_sigma(_section(sensor_set=own)) == 0.0
    assert torquer_sigma(_section(sensor_set={**own, "torquer_scale_sigma_ppm": 7.0})) == pytest.approx(7e-6)
    assert torquer_sigma(_section(sensor_set={"type": "platform"}, gyro_scale_sigma_ppm=12.0)) == pytest.approx(1.2e-5)


def test_an_attitude_sensor() -> None:
    own = {"type": "attitude-sensor", "bias_arcsec": (4.0, -7.0, 9.0), "drift_deg_h": (0.3, -0.2, 0.5)}
    found = draw_attitude_sensor(_section(sensor_set={**own, "noise_arcsec": 2.5}), 4)
    assert found.bias == pytest.approx(_ARCSEC * np.array((4.0, -7.0, 9.0)))
    assert found.drift == pytest.approx(np.radians((0.3, -0.2, 0.5)) / 3600.0)
    assert found.noise == pytest.approx(2.5 * _ARCSEC)
    usual = {"grade": "tactical"}  # its drift is by default the bias of the gyros
    gyros = draw_attitude_sensor(_section(**usual, sensor_set={"type": "attitude-sensor"}), 4)
    np.testing.assert_array_equal(gyros.drift, draw(_section(**usual), 4).gyro.bias)


class _Turns:
    """Angles that grow by 0.3 and −0.2 rad/s."""

    def __init__(self, two_axes: bool) -> None:
        self.two_axes = two_axes

    def angles(self, t: np.ndarray) -> np.ndarray:
        return np.column_stack([0.3 * t, 0.1 - 0.2 * t])

    def rate(self, t: np.ndarray) -> np.ndarray:
        """Return a rate for which a mean is easily known."""
        return np.outer(t**2, (1.0, 0.0, -2.0))


def test_encoders() -> None:
    rotation = {
        "type": "continuous", "rate_deg_s": 5.0, "encoder_bias_arcsec": (12.0, -7.0), "encoder_periodic_arcsec": 20.0,
        "encoder_cycles": 3, "encoder_phase_deg": 40.0, "encoder_noise_arcsec": 1.5, "encoder_quantum_arcsec": 0.5,
    }  # fmt: skip
    found = draw_encoders(_section(rotation=rotation), 4)
    assert found is not None
    assert found.bias == pytest.approx(_ARCSEC * np.array((12.0, -7.0)))
    assert (found.periodic, found.cycles) == (pytest.approx(20.0 * _ARCSEC), 3)
    assert found.phase == pytest.approx(np.radians(40.0))
    assert (found.noise, found.quantum) == (pytest.approx(1.5 * _ARCSEC), pytest.approx(0.5 * _ARCSEC))
    assert found.seed == 4
    assert draw_encoders(_section(), 4) is None
    errors = EncoderErrors(np.array((0.01, -0.02)), 0.03, 3, 0.7, quantum=0.004)
    t, edges = np.array((1.1, 2.7)), 0.5 * np.arange(9)
    true = np.array([[0.33, -0.12], [0.81, -0.44]])
    whole = true + np.array((0.01, -0.02)) + 0.03 * np.sin(3.0 * true + 0.7)
    read = read_angles(_Turns(True), errors, edges, t)  # type: ignore[arg-type]
    assert np.abs(read - whole).max() <= 0.002
    assert read / 0.004 == pytest.approx(np.rint(whole / 0.004))
    one = read_angles(_Turns(False), errors, edges, t)  # type: ignore[arg-type]
    assert one[:, 0].tolist() == read[:, 0].tolist()
    assert one[:, 1] == pytest.approx(true[:, 1])
    # the mean of t² from a to b is (a² + ab + b²)/3: from 1 s to 2 s, and at both ends over one sample of 0.5 s
    mean = Encoders(_Turns(True), errors, edges).mean_rate(np.array((1.5, 0.0, 4.0)))  # type: ignore[arg-type]
    assert mean == pytest.approx(np.outer((7.0 / 3.0, 1.0 / 12.0, 42.25 / 3.0), (1.0, 0.0, -2.0)), rel=1e-14)


def test_each_three_accelerometers_have_their_own_random_numbers() -> None:
    """The first three have those of the triad of a usual block; the next three those of a seed 2³² later."""
    section = _section(accel_vrw_ug_sqrt_hz=80.0)
    time = 0.02 * np.arange(41)
    axes = np.concatenate([np.eye(3), np.eye(3)[[1, 2, 0]]])
    found = emulate_accelerometers(time, np.zeros((40, 6, 3)), axes, section, 7)
    still = ImuData(time, np.zeros((40, 3)), np.zeros((40, 3)))
    noise = ImuErrors(accel=TriadErrors(random_walk=80.0 * 9.80665e-6))
    expected = [emulate(still, noise, seed).dvel for seed in (7, 7 + 2**32)]
    np.testing.assert_allclose(found, np.concatenate(expected, axis=1), rtol=1e-12)


def test_axes_about_a_direction() -> None:
    """Row 1 is the direction; the next ones follow in a right-handed triad."""
    direction = np.array((2.0, -3.0, 6.0)) / 7.0
    for axis in range(3):
        found = axes_about(direction, axis)
        assert found[axis] == pytest.approx(direction)
        assert found @ found.T == pytest.approx(np.eye(3), abs=1e-15)
        assert np.linalg.det(found) == pytest.approx(1.0)


def test_the_variance_of_noise_over_windows() -> None:
    """Each term by its definition: over T = n/50 s, and its growth with the time before. All are below 1e-9."""
    keys = {"rate_hz": 50.0, "gyro_correlation_time_s": 0.7}
    counts = np.array([1, 40])
    span = counts / 50.0

    def found(**more: float) -> np.ndarray:
        return noise_variance(_section(**keys, **more), "gyro", counts, 0.0)

    walk = found(gyro_arw_deg_sqrt_h=0.3)
    assert walk[:, 0] == pytest.approx(np.radians(0.3) ** 2 / 3600.0 * span, abs=0.0)
    # two roundings of uniform errors, each of Q²/12
    assert found(gyro_quantum_arcsec=3.0)[:, 0] == pytest.approx(np.full(2, 2.0 * (3.0 * _ARCSEC) ** 2 / 12.0), abs=0.0)
    # ∫∫ exp(−|u − v|/τ) over the window, by a fine sum
    middle = (np.arange(2000) + 0.5) / 2000.0
    apart = np.abs(middle[:, None] - middle)
    double = [s**2 * np.mean(np.exp(-apart * s / 0.7)) for s in span]
    rate = np.radians(2.0) / 3600.0
    assert found(gyro_instability_deg_h=2.0)[:, 0] == pytest.approx(rate**2 * np.array(double), rel=1e-4, abs=0.0)
    # a walk K√t integrated over T from t₀ on: K² (t₀ T² + T³/3)
    k = np.radians(2.0) / 3600.0 / 60.0
    assert found(gyro_rrw_deg_h_sqrt_h=2.0) == pytest.approx(k**2 * np.column_stack([span**3 / 3.0, span**2]), abs=0.0)
    assert walk[:, 1].tolist() == [0.0, 0.0]
    none = noise_variance(_section(**keys), "gyro", counts, 5.0)
    assert none[:, 0] == pytest.approx((1e-12 * 5.0) ** 2 * counts, abs=0.0)


def test_lengths_of_directions() -> None:
    """A length may differ from 1 by 1e-5; the answer says which direction, its length and what would be right."""
    rows = READY["cone-4"].copy()
    assert np.linalg.norm(checked_directions(rows * 1.000009), axis=1) == pytest.approx(np.ones(4), abs=1e-15)
    rows[2] = 1.02 * np.array((2.0, -3.0, 6.0)) / 7.0
    with pytest.raises(
        InputError, match=r"directions\.3 = .* has the length 1\.02 instead of 1: .*0\.2857143, -0\.4285714"
    ):
        checked_directions(rows)
    rows[2] = 1.00002 * np.array((2.0, -3.0, 6.0)) / 7.0
    with pytest.raises(InputError, match=r"length 1\.00002 instead of 1"):
        checked_directions(rows)
    # three axes and the first again: variances of 1/2, 1 and 1
    assert dilution(np.concatenate([np.eye(3), np.eye(3)[:1]])) == pytest.approx(2.5)
