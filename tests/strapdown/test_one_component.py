"""The one-component system against the chapter's closed forms and an independent solution of its error equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim.errors import InputError
from sinssim.strapdown.one_component_system import (
    GRAVITY,
    RADIUS,
    accelerometer_error,
    gyro_error,
    schuler_rate,
    simulate,
)

UG = 9.80665e-6
DEG_H = 4.84813681109536e-6


def at_rest(duration: float, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.arange(0.0, duration + 0.5 * step, step)
    h = np.diff(time)
    return time, np.zeros_like(h), np.stack([np.zeros_like(h), GRAVITY * h], axis=1)


def test_schuler_period_is_84_4_minutes() -> None:
    assert 2.0 * np.pi / schuler_rate() / 60.0 == pytest.approx(84.4, abs=0.05)


@pytest.mark.parametrize("bias_ug", [1.0, 100.0, -1000.0])
def test_accelerometer_error_8_13(bias_ug: float) -> None:
    """To 1e-6 of the amplitude 2Δa/g, over 8000 s as in figure 8.4 a."""
    time, dtheta, dvel = at_rest(8000.0, 1.0)
    dvel[:, 0] += bias_ug * UG
    w = np.sqrt(9.81 / 6371000.0)
    expected = bias_ug * UG / 9.81 * (1.0 - np.cos(w * time))
    got = simulate(time, dtheta, dvel).coordinate
    assert np.abs(got - expected).max() < 1e-6 * 2.0 * abs(bias_ug) * UG / 9.81
    assert np.abs(accelerometer_error(time, bias_ug * UG) - expected).max() < 1e-14 * abs(bias_ug)
    assert np.abs(got).max() == pytest.approx(2.0 * abs(bias_ug) * UG / 9.81, rel=1e-6)  # at most 2Δa/g


@pytest.mark.parametrize("drift_deg_h", [0.01, -1.0])
def test_gyro_error_8_15(drift_deg_h: float) -> None:
    """To 1e-6 of the greatest error, over 8000 s as in figure 8.4 b."""
    time, dtheta, dvel = at_rest(8000.0, 1.0)
    drift = drift_deg_h * DEG_H
    w = np.sqrt(9.81 / 6371000.0)
    expected = drift * (time - np.sin(w * time) / w)
    got = simulate(time, dtheta - drift, dvel).coordinate  # the chapter's Δω₀ counts nose-down
    assert np.abs(got - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(gyro_error(time, drift) - expected).max() < 1e-14


def test_error_equations_8_12_and_8_14_for_errors_that_vary() -> None:
    """Δÿ + ω_s²Δy = Δa(t)/R + ω_s²Δα(t), solved by scipy."""
    time, dtheta, dvel = at_rest(8000.0, 1.0)
    a0, f1, w0, f2 = 50.0 * UG, 2e-3, 0.1 * DEG_H, 1.3e-3
    # Δa = a₀ sin f₁t and Δω₀ = w₀ cos f₂t, as integrals over the intervals
    dvel[:, 0] += a0 / f1 * -np.diff(np.cos(f1 * time))
    dtheta -= w0 / f2 * np.diff(np.sin(f2 * time))
    w2 = GRAVITY / RADIUS

    def pendulum(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -w2 * y[0] + a0 * np.sin(f1 * t) / RADIUS + w2 * w0 / f2 * np.sin(f2 * t)]

    solved = solve_ivp(pendulum, (0.0, 8000.0), [0.0, 0.0], t_eval=time, rtol=1e-11, atol=1e-18, method="DOP853")
    got = simulate(time, dtheta, dvel)
    assert np.abs(got.coordinate - solved.y[0]).max() < 1e-6 * np.abs(solved.y[0]).max()
    assert np.abs(got.velocity - RADIUS * solved.y[1]).max() < 1e-6 * np.abs(RADIUS * solved.y[1]).max()


def flight(step: float) -> tuple[np.ndarray, ...]:
    """A flight round the sphere at changing speed and pitch, its readings by Newton's law, integrated by quadrature."""
    time = np.arange(0.0, 600.0 + 0.5 * step, step)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    t = time[:-1, None] + 0.5 * step * (1.0 + nodes)
    v, v1 = 200.0 + 30.0 * np.sin(0.02 * t), 0.6 * np.cos(0.02 * t)
    alpha, alpha1 = 0.1 * np.sin(0.05 * t + 1.0), 0.005 * np.cos(0.05 * t + 1.0)
    lift = GRAVITY - v * v / RADIUS
    forward = v1 * np.cos(alpha) + lift * np.sin(alpha)
    up = -v1 * np.sin(alpha) + lift * np.cos(alpha)
    integrals = [0.5 * step * x @ weights for x in (alpha1 - v / RADIUS, forward, up)]
    distance = 200.0 * time + 1500.0 * (1.0 - np.cos(0.02 * time))
    return time, integrals[0], np.stack(integrals[1:], axis=1), distance


def test_perfect_instruments_on_a_flight_second_order() -> None:
    worst = []
    for step in (0.2, 0.1, 0.05):
        time, dtheta, dvel, distance = flight(step)
        solution = simulate(time, dtheta, dvel, velocity=200.0, pitch=0.1 * np.sin(1.0))
        worst.append(np.abs(solution.coordinate * RADIUS - distance).max())
        assert np.abs(solution.pitch - 0.1 * np.sin(0.05 * time + 1.0)).max() < 1e-6
    assert worst[2] < 1e-2  # of 120 km
    assert np.log2(worst[0] / worst[1]) == pytest.approx(2.0, abs=0.1)
    assert np.log2(worst[1] / worst[2]) == pytest.approx(2.0, abs=0.1)


def test_bad_input() -> None:
    time, dtheta, dvel = at_rest(10.0, 1.0)
    broken = dtheta.copy()
    broken[3] = np.nan
    late = time.copy()
    late[4] = np.inf
    wrong = [
        ((time[:-1], dtheta, dvel), {}, r"time \(10,\), dtheta \(10,\) and dvel \(10, 2\) do not belong together"),
        ((time, dtheta, dvel[:, 0]), {}, r"dvel \(10,\)"),
        ((time, dtheta[:, None], dvel), {}, r"dtheta \(10, 1\)"),
        (([0.0], [], np.zeros((0, 2))), {}, "N ≥ 1"),
        ((time, [[1.0], [2.0, 3.0]], dvel), {}, "dtheta is not an array of numbers"),
        ((time, broken, dvel), {}, r"dtheta\[3\] = nan rad .* t = 4.000000 s"),
        ((late, dtheta, dvel), {}, r"time\[4\] = inf s"),
        ((np.zeros(11), dtheta, dvel), {}, r"time must increase: time\[0\]"),
        ((time, dtheta, dvel), {"pitch": np.nan}, "pitch = nan must be one finite number, rad"),
        ((time, dtheta, dvel), {"radius": 0.0}, "radius = 0.0 must be one positive number, m"),
    ]
    for arguments, options, said in wrong:
        with pytest.raises(InputError, match=said) as caught:
            simulate(*arguments, **options)
        assert "\n" not in str(caught.value)
