"""The smoothing spline against its gain, its variational definition, and known noise."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.truth import track_smoothing as knots
from sinssim.truth.track_smoothing import SmoothingSpline, smooth_spline, tau_by_cross_validation, tau_by_distance

TIME = np.arange(0.0, 1200.0)
ONES = np.ones(len(TIME))


@pytest.mark.parametrize("tau", [0.5, 2.0, 5.0])
@pytest.mark.parametrize("omega", [0.05, 0.2, 0.5])
def test_gain_is_that_of_the_page(tau: float, omega: float) -> None:
    """1/(1 + (ωτ)⁶) far from the ends, by least squares on a hundred periods or so."""
    spline = smooth_spline(TIME, np.sin(omega * TIME)[:, None], tau, ONES)
    t = np.linspace(300.0, 900.0, 4001)
    basis = np.column_stack((np.sin(omega * t), np.cos(omega * t)))
    gain, shift = np.linalg.lstsq(basis, spline(t)[:, 0], rcond=None)[0]
    assert gain == pytest.approx(1.0 / (1.0 + (omega * tau) ** 6), abs=2e-4)
    assert shift == pytest.approx(0.0, abs=2e-4)  # no delay


def test_minimises_what_it_says() -> None:
    """The objective, by fine quadrature, is larger for every nearby spline of the same knots."""
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.5, 1.5, 60))
    values, weight, tau = rng.standard_normal((60, 1)), rng.uniform(0.5, 2.0, 60), 1.3
    problem = SmoothingSpline(time, tau, weight)
    spline = problem.spline(values)
    fine = np.linspace(time[0], time[-1], 60_001)

    def objective(coefficients: np.ndarray) -> float:
        curve = type(spline)(spline.t, coefficients, spline.k)
        misfit = np.sum(problem._weight * (values - curve(time))[:, 0] ** 2)
        return float(misfit + tau**6 * np.trapezoid(curve(fine, 3)[:, 0] ** 2, fine))

    best = objective(spline.c)
    for step in rng.standard_normal((20, *spline.c.shape)):
        slope = (objective(spline.c + 1e-4 * step) - objective(spline.c - 1e-4 * step)) / 2e-4
        assert abs(slope) < 1e-3 * best
        assert objective(spline.c + 0.1 * step) > best


def test_a_parabola_is_not_smoothed() -> None:
    """∫|s‴|² = 0 for polynomials of degree 2, whatever τ."""
    values = (3.0 + 0.2 * TIME - 1e-4 * TIME**2)[:, None]
    for tau in (1.0, 30.0):
        assert np.abs(smooth_spline(TIME, values, tau, ONES)(TIME) - values).max() < 1e-6


def test_no_smoothing_goes_through_the_samples() -> None:
    values = np.random.default_rng(2).standard_normal((len(TIME), 3))
    assert np.abs(smooth_spline(TIME, values, 0.0, ONES)(TIME) - values).max() < 1e-10


@pytest.mark.parametrize("sigma", [0.01, 0.3, 3.0])
def test_cross_validation_finds_white_noise(sigma: float) -> None:
    """The curve's rms distance from the samples is their noise; 1200 samples: 2 % (1σ), asked 10 %."""
    rng = np.random.default_rng(3)
    smooth = 100.0 * np.sin(0.05 * TIME)
    values = (smooth + sigma * rng.standard_normal(len(TIME)))[:, None]
    tau = tau_by_cross_validation(TIME, values, ONES)
    spline = smooth_spline(TIME, values, tau, ONES)
    assert np.std(spline(TIME)[:, 0] - values[:, 0]) == pytest.approx(sigma, rel=0.2)
    assert np.std(spline(TIME)[:, 0] - smooth) < 0.7 * sigma  # nearer to the truth than the samples


def test_cross_validation_interpolates_exact_samples() -> None:
    assert tau_by_cross_validation(TIME, 100.0 * np.sin(0.05 * TIME)[:, None], ONES) == 0.0


def test_distance_is_met() -> None:
    rng = np.random.default_rng(4)
    values = (100.0 * np.sin(0.05 * TIME) + rng.standard_normal(len(TIME)))[:, None]
    tau = tau_by_distance(TIME, values, ONES, 1.5)
    rest = smooth_spline(TIME, values, tau, ONES)(TIME) - values
    assert np.sqrt(np.mean(rest**2)) == pytest.approx(1.5, rel=0.01)
    assert tau_by_distance(TIME, values, ONES, 1e-9) == 0.0


def test_thinned_knots_keep_both_ends() -> None:
    time = np.sort(np.random.default_rng(5).uniform(0.0, 100.0, 1000))
    kept = knots._thinned(time, 0.7)
    assert (kept[0], kept[-1]) == (time[0], time[-1])
    assert np.diff(kept).min() >= 0.35
    assert np.diff(kept).max() < 1.6


def test_cross_validation_needs_thirty_samples_and_looks_at_the_middle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise at the ends alone is not seen if only the hundred samples in the middle are looked at."""
    rng = np.random.default_rng(6)
    noisy = rng.standard_normal((40, 1))
    assert tau_by_cross_validation(np.arange(29.0), noisy[:29], np.ones(29)) == 0.0
    assert tau_by_cross_validation(np.arange(40.0), noisy, np.ones(40)) > 0.0
    time = np.arange(300.0)
    values = 100.0 * np.sin(0.05 * time)[:, None] + np.where(np.abs(time - 149.5) < 52.0, 0.0, 1.0)[:, None] * (
        rng.standard_normal((300, 1))
    )
    assert tau_by_cross_validation(time, values, np.ones(300)) > 0.0
    monkeypatch.setattr(knots, "_ROWS", 100)
    assert tau_by_cross_validation(time, values, np.ones(300)) == 0.0
