"""The error equations of the one-component system against scipy's integrator, and its three variants against them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sinssim.errors import InputError
from sinssim.strapdown.one_component_system import (
    ConstantErrors,
    ErrorSources,
    closed_form,
    error_along_motion,
    error_first_order,
    error_pendulum,
    projections,
    simulate,
    simulate_measured,
    simulate_two_integrals,
)

UG = 9.80665e-6
DEG_H = 4.84813681109536e-6
G, R = 9.81, 6371000.0
TIME = np.arange(0.0, 8000.5, 1.0)
H = np.diff(TIME)


def pitch(t: np.ndarray) -> np.ndarray:
    return 0.3 * np.sin(2e-3 * t) + 0.1


def vertical(t: np.ndarray) -> np.ndarray:
    return G + 0.8 * np.sin(7e-3 * t) - 0.3


def nodes() -> np.ndarray:
    return np.linspace(0.0, 8000.0, 2 * len(H) + 1)


SOURCES = ErrorSources(
    force=np.tile([100.0 * UG, -60.0 * UG], (len(H), 1)),
    rate=0.01 * DEG_H * np.stack([1.0 + 1e-4 * TIME[:-1], 1.0 + 1e-4 * TIME[1:]], axis=1),
    velocity=0.2,
    coordinate=3e-5,
    angle=-2e-5,
)


def solved(push, stiff) -> np.ndarray:
    """Solve Δÿ + (a_η/R)(Δy + Δα_g) = push/R; rows Δy, Δẏ and Δα_g at `TIME`."""

    def derivative(t: float, state: np.ndarray) -> list[float]:
        y, speed, angle = state
        return [speed, (push(t) - stiff(t) * (y + angle)) / R, 0.01 * DEG_H * (1.0 + 1e-4 * t)]

    start = [SOURCES.coordinate, SOURCES.velocity / R, SOURCES.angle]
    found = solve_ivp(derivative, (0.0, 8000.0), start, t_eval=TIME, rtol=1e-12, atol=1e-17, method="DOP853")
    return found.y


def test_equations_8_10_and_8_11_along_a_motion() -> None:
    y, speed, angle = solved(lambda t: 100.0 * UG * np.cos(pitch(t)) + 60.0 * UG * np.sin(pitch(t)), vertical)
    for equation in (error_along_motion, error_pendulum):
        found = equation(TIME, SOURCES, pitch(nodes()), vertical(nodes()), R)
        assert np.abs(found.coordinate - y).max() < 1e-9 * np.abs(y).max()
        assert np.abs(found.velocity - R * speed).max() < 1e-9 * R * np.abs(speed).max()
        assert np.abs(found.pitch - angle - y).max() < 1e-9 * np.abs(y).max()


def test_equation_8_12_is_first_order_in_the_pitch() -> None:
    y = solved(lambda t: 100.0 * UG + 60.0 * UG * pitch(t), lambda t: G)[0]
    found = error_first_order(TIME, SOURCES, pitch(nodes()), G, R)
    assert np.abs(found.coordinate - y).max() < 1e-9 * np.abs(y).max()


def test_equal_accelerometer_errors_act_as_one_less_the_pitch() -> None:
    """The right-hand side of (8.12) for Δa_x = Δa_y = Δa is Δa(1 − α)/R: at a constant α, (8.13) times 1 − α."""
    both = ErrorSources(np.full((len(H), 2), 100.0 * UG), np.zeros((len(H), 2)))
    found = error_first_order(TIME, both, np.full(2 * len(H) + 1, 0.05), G, R)
    expected = 0.95 * 100.0 * UG / G * (1.0 - np.cos(np.sqrt(G / R) * TIME))
    assert np.abs(found.coordinate - expected).max() < 1e-9 * expected.max()
    exact = error_pendulum(TIME, both, np.full(2 * len(H) + 1, 0.05), np.full(2 * len(H) + 1, G), R)
    gap = np.abs(exact.coordinate - found.coordinate).max() / expected.max()  # (cos α − sin α) − (1 − α) ≈ −α²/2
    assert gap == pytest.approx(0.5 * 0.05**2 / 0.95, rel=0.05)


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("force", 1e-3),
        ("rate", 1e-7),
        ("acceleration", 1e-12),
        ("velocity", 0.5),
        ("coordinate", 1e-4),
        ("angle", 1e-4),
    ],
)
def test_closed_form_of_each_constant_error(name: str, size: float) -> None:
    """Against scipy's solution of the pendulum at rest, an error at a time."""
    e = ConstantErrors(**{name: size})

    def derivative(t: float, state: np.ndarray) -> list[float]:
        angle = e.angle + e.rate * t + 0.5 * e.acceleration * t * t
        return [state[1], e.force / R - G / R * (state[0] + angle)]

    start = [e.coordinate, e.velocity / R]
    y, speed = solve_ivp(derivative, (0.0, 8000.0), start, t_eval=TIME, rtol=1e-12, atol=1e-18, method="DOP853").y
    found = closed_form(TIME, e, G, R)
    angle = e.angle + e.rate * TIME + 0.5 * e.acceleration * TIME**2
    assert np.abs(found.coordinate - y).max() < 1e-9 * np.abs(y).max()
    assert np.abs(found.velocity - R * speed).max() < 1e-9 * R * np.abs(speed).max()
    assert np.abs(found.pitch - angle - y).max() < 1e-9 * np.abs(y).max()


def at_rest(bias: float) -> np.ndarray:
    return np.stack([bias * H, G * H], axis=1)


def test_measured_pitch_swings_as_8_13_and_8_15() -> None:
    """A constant error of the angle acts as −g Δα of the accelerometer, a drift as a gyro's."""
    w = np.sqrt(G / R)
    for angle, expected in (
        (np.full_like(TIME, -1e-5), 1e-5 * (1.0 - np.cos(w * TIME))),
        (-1e-9 * TIME, 1e-9 * (TIME - np.sin(w * TIME) / w)),
    ):
        found = simulate_measured(TIME, angle, at_rest(0.0))
        assert np.abs(found.coordinate - expected).max() < 1e-6 * expected.max()
        assert np.array_equal(found.pitch, angle + found.coordinate)


def test_two_integrals_grow_with_the_square_of_time() -> None:
    """Δω̇ = Δa/arm: Δy = −Δω̇ (t²/2 − (1 − cos ω_s t)/ω_s²)."""
    w, arm, bias = np.sqrt(G / R), 2.0, 1e-11
    found = simulate_two_integrals(TIME, (G - bias * arm) * H, at_rest(0.0), arm)
    expected = bias * (0.5 * TIME**2 - (1.0 - np.cos(w * TIME)) / w**2)
    assert np.abs(found.coordinate - expected).max() < 1e-4 * expected.max()  # G H − … loses digits
    assert found.rate is not None
    assert found.rate[-1] == pytest.approx(-bias * 8000.0, rel=1e-4)


def test_variants_agree_on_the_same_rotation() -> None:
    """ω = ω₀ + ε t read by a gyro, as an angle and as ω̇: the same solution to the order of the interval."""
    first, more = 2e-6, 1e-9
    angle = 0.1 + first * TIME + 0.5 * more * TIME**2
    dvel = at_rest(1e-3)
    by_gyro = simulate(TIME, np.diff(angle), dvel, velocity=10.0, coordinate=0.2, pitch=0.3)
    by_angle = simulate_measured(TIME, angle, dvel, velocity=10.0, coordinate=0.2)
    by_arm = simulate_two_integrals(
        TIME, dvel[:, 1] + 3.0 * more * H, dvel, 3.0, velocity=10.0, coordinate=0.2, pitch=0.3, rate=first
    )
    for other in (by_angle, by_arm):
        assert np.abs(other.coordinate - by_gyro.coordinate).max() < 1e-8
        assert np.abs(other.pitch - by_gyro.pitch).max() < 1e-8


def test_projections_undo_the_pitch() -> None:
    alpha = np.array([0.0, 0.4, -2.0])
    along, up = projections(np.sin(alpha) * G + np.cos(alpha), np.cos(alpha) * G - np.sin(alpha), alpha)
    assert np.allclose(along, 1.0, atol=1e-14)
    assert np.allclose(up, G, atol=1e-14)


def test_bad_input_of_the_variants() -> None:
    for wrong, said in (
        (lambda: simulate_measured(TIME, TIME[:-1], at_rest(0.0)), r"angle \(8000,\).* N\+1 angles"),
        (lambda: simulate_measured(TIME, np.full_like(TIME, np.nan), at_rest(0.0)), r"angle\[0\] = nan rad"),
        (lambda: simulate_two_integrals(TIME, H, at_rest(0.0), 0.0), "arm = 0 m gives no angular acceleration"),
        (lambda: simulate_two_integrals(TIME, H[:-1], at_rest(0.0), 1.0), r"dvel_arm \(7999,\)"),
        (lambda: simulate_two_integrals(TIME, H, at_rest(0.0), np.inf), "arm = inf must be one finite number, m"),
        (lambda: closed_form(TIME, ConstantErrors(), gravity=0.0), "gravity = 0.0 must be one positive number"),
    ):
        with pytest.raises(InputError, match=said):
            wrong()
