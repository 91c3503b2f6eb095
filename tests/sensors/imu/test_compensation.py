"""The compensator against the instrument model written out here, and its residual to first order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.compensation import Compensation, compensate, imperfect_calibration
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.error_term_table import CALIBRATED, TERMS
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.motions.analytic import inertial_increments
from sinssim.truth.motions.coning_and_rocking import SpinRock
from tests.oracles.imu_model import output, temperature
from tests.sensors.imu.test_error_terms import VALUES, WARM


def ideal() -> ImuData:
    rng = np.random.default_rng(5)
    time = np.cumsum(np.concatenate([[0.0], 0.01 * (1.0 + 0.2 * rng.random(500))]))
    dvel = 0.05 * rng.standard_normal((500, 3)) + [0.0, 0.0, -0.098]
    return ImuData(time, 0.01 * rng.standard_normal((500, 3)), dvel)


REACH = 20.0
"""Rate and force at which the non-linear terms are of the size of the scale-factor errors, SI."""


def triad(scale: float, seed: int, bias: float) -> TriadErrors:
    rng = np.random.default_rng(seed)
    misalignment = scale * rng.standard_normal((3, 3))
    np.fill_diagonal(misalignment, 0.0)
    return TriadErrors(
        bias=bias * rng.standard_normal(3),
        scale=scale * rng.standard_normal(3),
        misalignment=misalignment,
        quadratic=scale / REACH * rng.standard_normal(3),
        cubic=scale / REACH**2 * rng.standard_normal(3),
    )


ERRORS = ImuErrors(triad(5e-3, 1, 1e-4), triad(8e-3, 2, 3e-2))


def test_perfect_calibration_restores_the_ideal_increments() -> None:
    """Measured values by the model written out with matrices, not by the emulator."""
    true = ideal()
    h = np.diff(true.time)[:, None]

    def measure(x: np.ndarray, e: TriadErrors) -> np.ndarray:
        rate = x / h @ (np.eye(3) + e.misalignment).T
        return ((1.0 + e.scale) * (rate + e.quadratic * rate**2 + e.cubic * rate**3) + e.bias) * h

    measured = ImuData(true.time, measure(true.dtheta, ERRORS.gyro), measure(true.dvel, ERRORS.accel))
    back = compensate(measured, ERRORS)
    assert np.abs(back.dtheta - true.dtheta).max() < 5e-17 * 3
    assert np.abs(back.dvel - true.dvel).max() < 5e-16


def test_everything_that_a_calibration_knows_is_undone() -> None:
    """Asymmetry, coupling of the axes, g-sensitivity and temperature as well; the readings again not the emulator's."""
    true = ideal()
    h = np.diff(true.time)
    middle = 0.5 * (true.time[1:] + true.time[:-1]) - true.time[0]
    known = [{name: VALUES[triad].get(name) for name in CALIBRATED} for triad in ("gyro", "accel")]
    accel = {name: value for name, value in known[1].items() if value is not None}
    errors = ImuErrors(TriadErrors(**known[0]), TriadErrors(**accel), warm_up=WARM)
    warmth, force = temperature(errors, middle), true.dvel / h[:, None]
    measured = ImuData(
        true.time,
        output(errors.gyro, true.dtheta / h[:, None], force, warmth, middle) * h[:, None],
        output(errors.accel, force, force, warmth, middle) * h[:, None],
    )
    assert np.abs(measured.dtheta - true.dtheta).max() > 1e-5
    back = compensate(measured, errors)
    assert np.abs(back.dtheta - true.dtheta).max() < 1e-15 * np.abs(true.dtheta).max()
    assert np.abs(back.dvel - true.dvel).max() < 2e-15 * np.abs(true.dvel).max()


def test_arms_and_delay_are_undone() -> None:
    motion = SpinRock((1.0, -2.0, 0.7), 1.5, 0.15, 4 * np.pi)
    true = inertial_increments(motion, 100.0, 10.0)
    arms = np.array([[0.05, -0.02, 0.01], [-0.03, 0.04, 0.02], [0.01, 0.03, -0.06]])
    errors = ImuErrors(arms=arms, delay=0.003)
    measured = emulate(true, errors)
    assert np.abs(measured.dvel - true.dvel).max() > 1e-3
    left = np.abs(compensate(measured, errors).dvel - true.dvel)
    assert left[5:-5].max() < 1e-3 * np.abs(measured.dvel - true.dvel).max()


def test_what_no_calibration_knows_passes_through() -> None:
    true = ideal()
    unknown = TriadErrors(ramp=np.full(3, 1e-6), rate_walk=1e-6, flicker=1e-6, random_walk=1e-6, instability=1e-5)
    measured = emulate(true, ImuErrors(unknown, unknown), 3)
    rest = compensate(measured, imperfect_calibration(ImuErrors(unknown, unknown), ImuErrors()))
    assert np.abs(rest.dtheta - measured.dtheta).max() < 1e-17
    assert np.abs(rest.dvel - measured.dvel).max() < 1e-16


def test_a_calibration_is_wrong_by_what_its_section_says_in_every_known_term() -> None:
    quantities = [q for q in TERMS if q.drawn and q.field in CALIBRATED]
    assert {key for q in quantities for key in q.keys} == set(Compensation.model_fields) - {
        "file",
        "accel_arms_mm",
    }
    block = Imu(grade="ideal", **{q.sigma_key: 1.0 for q in quantities})
    section = Compensation.model_validate({q.sigma_key: 0.1 for q in quantities})
    runs = [(draw(block, seed), section.draw(draw(block, seed), seed)) for seed in range(200)]
    for q in quantities:
        values = np.array(
            [getattr(getattr(e, q.triad), q.field) - getattr(getattr(c, q.triad), q.field) for e, c in runs]
        )
        values = values[values != 0.0] / q.unit
        assert values.size == 200 * q.size
        low, high = chi2.ppf([5e-6, 1 - 5e-6], values.size)
        assert low < np.sum(values**2) / 0.1**2 < high


def test_measured_values_are_removed_as_they_are() -> None:
    """Calibration values that equal the block's errors restore the ideal increments; others leave the difference."""
    given = {
        "gyro_bias_deg_h": (5.0, -3.0, 2.0),
        "gyro_misalignment_arcsec": (10.0, 20.0, 30.0, -10.0, -20.0, -30.0),
        "accel_scale_ppm": (300.0, -200.0, 100.0),
    }
    exact = {"gyro_bias_sigma_deg_h": 0.0, "gyro_misalignment_sigma_arcsec": 0.0, "accel_scale_sigma_ppm": 0.0}
    section, true = Compensation(**given, **exact), Imu(grade="ideal", **given)
    start, errors = ideal(), draw(true)
    measured = emulate(start, true)
    restored = compensate(measured, section.draw(errors))
    np.testing.assert_allclose(restored.dtheta, start.dtheta, rtol=0, atol=1e-16)
    np.testing.assert_allclose(restored.dvel, start.dvel, rtol=0, atol=1e-15)
    other = Compensation(**(given | {"gyro_bias_deg_h": (4.0, -3.0, 2.0)}), **exact)
    left = compensate(measured, other.draw(errors)).dtheta - start.dtheta
    per_hour = np.linalg.inv(np.eye(3) + errors.gyro.misalignment) @ [1.0, 0.0, 0.0] * np.radians(1.0) / 3600.0
    np.testing.assert_allclose(left, np.diff(start.time)[:, None] * per_hour, rtol=0, atol=1e-16)


def test_true_errors_scatter_about_measured_values_by_their_uncertainty() -> None:
    """Mean and 1σ of the block equal to value and uncertainty of its calibration: the residual is that uncertainty."""
    keys = {"gyro_bias_deg_h": (0.5, -0.3, 0.2), "gyro_bias_sigma_deg_h": 0.02}
    block, section = Imu(grade="ideal", **keys), Compensation(**keys)
    runs = [(e := draw(block, seed)).gyro.bias - section.draw(e, seed).gyro.bias for seed in range(300)]
    values = np.array(runs) / (np.radians(0.02) / 3600.0)
    low, high = chi2.ppf([5e-6, 1 - 5e-6], values.size)  # 1e-5 by chance
    assert low < np.sum(values**2) < high
    assert abs(values.mean()) < 4.5 / np.sqrt(values.size)  # 7e-6 by chance


def test_a_measured_value_needs_its_uncertainty() -> None:
    with pytest.raises(InputError, match=r"gyro_bias_deg_h .* needs its uncertainty: give gyro_bias_sigma_deg_h"):
        Compensation(gyro_bias_deg_h=(1.0, 0.0, 0.0))
    left = Compensation(gyro_bias_deg_h=(1.0, 0.0, 0.0), gyro_bias_sigma_deg_h=0.1).left(Imu(grade="tactical"))
    assert left.gyro_bias_deg_h is None
    assert (left.gyro_bias_sigma_deg_h, left.accel_scale_sigma_ppm) == (0.1, 0.0)


def test_a_coupling_that_cannot_be_undone_is_refused() -> None:
    wild = np.array([[0.0, 3.0, -2.0], [5.0, 0.0, 4.0], [-3.0, 2.0, 0.0]])
    with pytest.raises(InputError, match=r"gyro calibration: cross_axis = .* must be small against 1"):
        compensate(ideal(), ImuErrors(gyro=TriadErrors(cross_axis=wild)))


def test_non_linearity_is_undone_as_the_roots_of_its_cubic_say() -> None:
    """The compensator's Newton against the companion matrix's eigenvalues."""
    e = TriadErrors(quadratic=np.array([0.02, -0.01, 0.0]), cubic=np.array([1e-3, 0.0, -2e-3]))
    readings = np.array([[3.0, -2.0, 1.5], [-4.0, 9.0, -0.3], [0.0, 1e-9, 2.0]])
    time = np.arange(4) * 0.01
    found = compensate(ImuData(time, readings * 0.01, readings * 0.01), ImuErrors(e, e)).dvel / 0.01
    for i in range(3):
        for reading, x in zip(readings[:, i], found[:, i], strict=True):
            roots = np.roots([e.cubic[i], e.quadratic[i], 1.0, -reading])
            real = roots[np.abs(roots.imag) < 1e-9].real
            assert x == pytest.approx(real[np.argmin(np.abs(real - reading))], rel=1e-14, abs=1e-14)


def test_it_is_the_inverse_of_the_emulator_for_every_grade() -> None:
    true = ideal()
    for grade in ("laser-standard", "tactical", "mems-industrial", "consumer"):
        quiet = Imu(
            grade=grade,
            gyro_arw_deg_sqrt_h=0.0,
            accel_vrw_ug_sqrt_hz=0.0,
            gyro_instability_deg_h=0.0,
            accel_instability_ug=0.0,
        )
        errors = draw(quiet, seed=3)
        measured = emulate(true, errors)
        assert np.abs(measured.dvel - true.dvel).max() > 1e-7
        back = compensate(measured, errors)
        assert np.abs(back.dtheta - true.dtheta).max() < 2e-16
        assert np.abs(back.dvel - true.dvel).max() < 1e-15


@pytest.mark.parametrize("size", [1e-3, 5e-4])
def test_imperfect_calibration_leaves_its_own_errors(size: float) -> None:
    """The residual is that of an instrument with the calibration's errors, but for products of two errors."""
    true = ideal()
    left = ImuErrors(triad(size, 11, 1e-6), triad(size, 12, 1e-3))
    rest = compensate(emulate(true, ERRORS), imperfect_calibration(ERRORS, left))
    h = np.diff(true.time)[:, None]
    for name, e in (("dtheta", left.gyro), ("dvel", left.accel)):
        x = getattr(true, name)
        predicted = first_order(x, e, h)
        residual = getattr(rest, name) - x
        # products of the residual with the block's own errors: of 0.5…0.8 %, and three standard deviations of them
        assert np.abs(residual - predicted).max() < 0.03 * np.abs(predicted).max()
        assert np.abs(predicted).max() > 0.5 * size * np.abs(x).max()


def first_order(x: np.ndarray, e: TriadErrors, h: np.ndarray) -> np.ndarray:
    rate = x / h
    return x * e.scale + x @ e.misalignment.T + (e.quadratic * rate**2 + e.cubic * rate**3 + e.bias) * h


def test_the_first_order_residual_is_exact_in_the_limit() -> None:
    """With all errors scaled down tenfold, what the prediction leaves out falls a hundredfold."""
    true = ideal()
    h = np.diff(true.time)[:, None]

    def remainder(factor: float) -> float:
        def scaled(e: TriadErrors) -> TriadErrors:
            return TriadErrors(
                **{name: factor * getattr(e, name) for name in ("bias", "scale", "misalignment", "quadratic", "cubic")}
            )

        errors = ImuErrors(scaled(ERRORS.gyro), scaled(ERRORS.accel))
        left = ImuErrors(scaled(triad(1e-3, 11, 1e-6)), scaled(triad(1e-3, 12, 1e-3)))
        rest = compensate(emulate(true, errors), imperfect_calibration(errors, left))
        return float(np.abs(rest.dvel - true.dvel - first_order(true.dvel, left.accel, h)).max())

    assert remainder(1.0) / remainder(0.1) == pytest.approx(100.0, rel=0.05)


def test_impossible_calibration_is_refused() -> None:
    with pytest.raises(InputError, match="gyro calibration"):
        compensate(ideal(), ImuErrors(gyro=TriadErrors(scale=np.array([0.0, -1.0, 0.0]))))
    with pytest.raises(InputError, match=r"gyro calibration: quadratic = .* cannot be inverted at readings"):
        compensate(ideal(), ImuErrors(gyro=TriadErrors(quadratic=np.full(3, -2.0))))
    flat = np.zeros((3, 3))
    flat[0, 1] = flat[1, 0] = 1.0
    with pytest.raises(InputError, match="accelerometer calibration"):
        compensate(ideal(), ImuErrors(accel=TriadErrors(misalignment=flat)))
