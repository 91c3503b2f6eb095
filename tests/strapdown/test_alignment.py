"""Alignment of a platform: the poles and final errors by closed forms, and the loop itself with large angles."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from sinssim.data import Array
from sinssim.earth import OMEGA_IE, surface_gravity
from sinssim.strapdown.platform_theory import AlignmentLoops
from sinssim.units import DEG, DEG_H, UG

LOOPS = AlignmentLoops(50.0 * DEG, 60.0, 0.05)
G, NORTH, DOWN = float(surface_gravity(50.0 * DEG)), OMEGA_IE * np.cos(50.0 * DEG), -OMEGA_IE * np.sin(50.0 * DEG)


def test_poles_are_the_designed_ones() -> None:
    a = LOOPS.dynamics
    assert np.poly(a[:3, :3]) == pytest.approx([1.0, 3.0 / 60.0, 3.0 / 60.0**2, 1.0 / 60.0**3], rel=1e-9)
    assert np.poly(a[3:, 3:]) == pytest.approx([1.0, 2.0 * 0.7 * 0.05, 0.05**2], rel=1e-9)


def test_levelling_has_the_overshoot_and_the_envelope_of_its_damping() -> None:
    a = LOOPS.dynamics[3:, 3:]
    time = np.arange(0.0, 200.0, 0.05)
    tilt = np.array([expm(a * t)[1, 1] for t in time[::20]])  # from a unit tilt about north
    root = np.sqrt(1.0 - 0.7**2)
    # φ̈ + 2ζω₀φ̇ + ω₀²φ = 0 from φ = 1 and φ̇ = l₂v = 0
    closed = np.exp(-0.035 * time[::20]) * (
        np.cos(0.05 * root * time[::20]) + 0.7 / root * np.sin(0.05 * root * time[::20])
    )
    assert tilt == pytest.approx(closed, abs=1e-9)
    assert tilt.min() == pytest.approx(-np.exp(-np.pi * 0.7 / root), abs=2e-4)  # 4.6 %


def test_azimuth_settles_as_a_triple_pole() -> None:
    a = LOOPS.dynamics[:3, :3]
    for t in (60.0, 300.0, 600.0):
        x = t / 60.0
        # of (s³ + …) from a unit azimuth: (s² + k₁s + gk₂)/(s + 1/τ)³, without Ω²: e⁻ˣ (1 + x + x²/2)
        assert expm(a * t)[2, 2] == pytest.approx(np.exp(-x) * (1.0 + x + 0.5 * x * x), abs=1e-4)


def test_final_errors() -> None:
    bias, drift = np.array([50.0, -30.0]) * UG, np.array([0.01, 0.02, -0.01]) * DEG_H
    found = LOOPS.final_errors(bias, drift)
    # −gφ_N + ∇_E = l₁v_E, gφ_E + ∇_N = k₁v_N: the velocities left are of the order of dτ
    assert found[0] == pytest.approx(bias[1] / G, abs=2.0 * 0.7 / 0.05 * 0.03 * DEG_H)
    assert found[1] == pytest.approx(-bias[0] / G, abs=3.0 * 60.0 * 0.02 * DEG_H)
    # 0.02 deg/h over 9.67 deg/h are 7.11′, the tilt of 30 µg times tan φ 0.12′, 3 τ d_D 0.03′
    azimuth = drift[1] / NORTH - np.tan(50.0 * DEG) * bias[1] / G - 3.0 * 60.0 * drift[2]
    assert abs(found[2] - azimuth) < 0.02 / 60.0 * DEG
    assert found[2] / DEG * 60.0 == pytest.approx(7.11 + 0.12, abs=0.05)


def test_the_loop_with_large_angles_ends_as_the_linear_one() -> None:
    bias, drift = np.array([50.0, -30.0]) * UG, np.array([0.01, 0.02, -0.01]) * DEG_H
    a = LOOPS.dynamics
    k1, k2, k3, l1, l2 = -a[0, 0], -a[1, 0], -a[2, 0], -a[3, 3], a[4, 3]
    earth = np.array([NORTH, 0.0, DOWN])

    def slope(t: float, y: Array) -> Array:
        c_np = y[2:].reshape(3, 3)
        force = c_np.T @ [0.0, 0.0, -G]
        torque = earth + np.array([l2 * y[1], -k2 * y[0], -k3 * y[0]]) - drift
        rate = torque - c_np.T @ earth  # of the platform relative to the Earth, in its axes
        x, yy, z = rate
        cross = np.array([[0.0, -z, yy], [z, 0.0, -x], [-yy, x, 0.0]])
        return np.concatenate(
            [[force[0] + bias[0] - k1 * y[0], force[1] + bias[1] - l1 * y[1]], (c_np @ cross).ravel()]
        )

    start = Rotation.from_rotvec([1.0 * DEG, -1.0 * DEG, 5.0 * DEG]).as_matrix()
    y = solve_ivp(slope, (0.0, 1800.0), [0.0, 0.0, *start.ravel()], rtol=1e-10, atol=1e-13, method="LSODA").y[:, -1]
    turned = Rotation.from_matrix(y[2:].reshape(3, 3)).as_rotvec()
    final = LOOPS.final_errors(bias, drift)
    # the angles left are 2e-3 rad, so that products of them are 4e-6 rad; the loops have settled to e⁻³⁰ · 450
    assert turned == pytest.approx(final, abs=1e-7, rel=5e-3)
    # and the linear one on the way, from angles whose products are 1e-3 of the azimuth
    start = Rotation.from_rotvec([0.002 * DEG, -0.002 * DEG, 0.1 * DEG]).as_matrix()
    bias, drift = np.zeros(2), np.zeros(3)
    late = solve_ivp(slope, (0.0, 120.0), [0.0, 0.0, *start.ravel()], rtol=1e-10, atol=1e-13, method="LSODA").y[:, -1]
    linear = expm(a * 120.0) @ (np.array([0.0, -0.002, 0.1, 0.0, 0.002]) * DEG)
    turned = Rotation.from_matrix(late[2:].reshape(3, 3)).as_rotvec()
    assert turned == pytest.approx(linear[[4, 1, 2]], rel=0.01)  # 0.13 % of the azimuth
    assert abs(linear[2]) > 0.2 * DEG


def test_covariance_ends_at_the_final_errors_and_the_noise() -> None:
    time = np.arange(0.0, 1801.0, 10.0)
    silent = LOOPS.sigmas(time, DEG, DEG, (50.0 * UG, 0.01 * DEG_H), (0.0, 0.0))
    one = [LOOPS.final_errors(*np.split(row, [2])) for row in np.diag([50.0 * UG] * 2 + [0.01 * DEG_H] * 3)]
    assert silent[0] == pytest.approx([DEG] * 3)
    assert silent[-1] == pytest.approx(np.sqrt(np.square(one).sum(axis=0)), rel=1e-6)
    # white drift N of the level gyro passes (1/Ω_N)/(1 + τs)³, and ∫h² is 3/(16 τ): as a mean over 16 τ/3 = 320 s
    noisy = LOOPS.sigmas(time, 0.0, 0.0, (0.0, 0.0), (0.0, 1e-7))
    assert noisy[-1, 2] == pytest.approx(1e-7 * np.sqrt(3.0 / (16.0 * 60.0)) / NORTH, rel=1e-3)


def test_comparison_with_a_strapdown_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = Path(__file__).parents[2] / "scenarios" / "platform_alignment.py"
    monkeypatch.setattr(sys, "argv", [script.name, "-o", str(tmp_path)])
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)
    runpy.run_path(str(script), run_name="__main__")
    rows = {line.split("  ")[0].strip(): line.split() for line in capsys.readouterr().out.splitlines()}
    # 0.01 deg/h over 9.67 deg/h are 3.56′; the noise of 0.003 deg/√h adds 1.07′ after an hour, and 3.58′ with τ = 60 s
    assert float(rows["strapdown"][-1]) == pytest.approx(np.hypot(3.56, 1.07), abs=0.01)
    assert float(rows["platform, τ = 60 s"][-1]) == pytest.approx(np.hypot(3.56, 3.58), abs=0.03)
    assert len((tmp_path / "platform_alignment.csv").read_text().splitlines()) == 3602
