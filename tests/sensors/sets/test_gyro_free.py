"""Six accelerometers in place of gyros: exact kinematics, closed loop, and the law by which errors grow."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import ImuData
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.errors import InputError
from sinssim.sensors import draw
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.single_sensors import (
    AccelerometerSet,
    axes_about,
    cube,
    draw_accelerometers,
    emulate_accelerometers,
    gyro_free_increments,
    position_error,
)
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from sinssim.truth.curve import Curve
from sinssim.truth.motions.mounted_block import velocity_increments
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.slow import slow
from tests.truth.motions import synthetic_flight

UG = 9.80665e-6
LEVEL = (1.0, 0.0, 0.0, 0.0)


def flight(lever_arm: tuple[float, ...] = (0.0, 0.0, 0.0), duration: float = 30.0) -> Curve:
    time = np.arange(0.0, duration + 0.5 / 30.0, 1.0 / 30.0)
    return Curve(time, *synthetic_flight(time), lever_arm)


def felt(trajectory, layout: AccelerometerSet, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    time, force = velocity_increments(trajectory, layout.position, rate_hz)
    return time, layout.feel(force)


def parked(duration: float, ellipsoid: Ellipsoid | None = None) -> Parked:
    at = (0.8, 0.5, 150.0, LEVEL, duration)
    return Parked(*at) if ellipsoid is None else Parked(*at, ellipsoid=ellipsoid)


def test_accelerometers_on_the_curves_own_lever_arms() -> None:
    """The curve moves its block by its analytic angular acceleration; here it comes from increments by parts."""
    layout = cube(3.0)
    time, dvel = felt(flight(), layout, 50.0)
    for i in range(6):
        own = flight(tuple(layout.position[i])).increments(50.0)
        assert np.array_equal(time, own.time)
        assert np.abs(dvel[:, i] - own.dvel @ layout.direction[i]).max() < 3e-13


def test_cube_is_chens_cube() -> None:
    """Products of the rate drop out of the angular acceleration, errors come through with 1/√2 and 1/(√2 ℓ)."""
    layout = cube(0.4)
    rng = np.random.default_rng(1)
    for _ in range(20):
        omega, growth, force = rng.standard_normal((3, 3))
        felt = [
            s @ (force + np.cross(growth, r) + np.cross(omega, np.cross(omega, r)))
            for r, s in zip(layout.position, layout.direction, strict=True)
        ]
        solved = layout.solution @ felt
        assert np.abs(solved[:3] - growth).max() < 1e-14
        rate_terms = 0.4 * np.array([omega[1] * omega[2], omega[2] * omega[0], omega[0] * omega[1]])
        assert np.abs(solved[3:] - force - rate_terms).max() < 1e-14
    assert np.linalg.norm(layout.solution[:3], axis=1) == pytest.approx(1.0 / (np.sqrt(2.0) * 0.4), rel=1e-14)
    assert np.linalg.norm(layout.solution[3:], axis=1) == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-14)


def test_ideal_accelerometers_give_the_ideal_increments() -> None:
    trajectory, layout = flight(), cube(0.5)
    time, dvel = felt(trajectory, layout, 100.0)
    imu, ideal = (
        gyro_free_increments(time, dvel, layout, trajectory.rates(0.0)[0]),
        trajectory.increments(100.0),
    )
    assert np.abs(imu.dtheta - ideal.dtheta).max() < 1e-12
    # half a metre from the centre gravitation differs by up to 1.5e-6 m/s², as it should
    assert np.abs(imu.dvel - ideal.dvel).max() < 0.5 * 3.1e-6 * 0.01
    truth = trajectory.state(time)
    error = navigation_error(truth, navigate(imu, trajectory.state(0.0)), trajectory.ellipsoid)
    assert np.linalg.norm(error.attitude, axis=1).max() < 1e-9
    assert np.abs(error.position_ned).max() < 0.5 * 1.5e-6 * 30.0**2


@pytest.mark.parametrize(("arm", "bias_ug"), list(product([0.3, 1.0, 4.0], [0.1, 1.0, 10.0])))
def test_error_grows_by_the_law(arm: float, bias_ug: float) -> None:
    """Against arm and grade, on the turning Earth, until the tilt is two degrees: within 10 % of the law.

    One draw of the six biases; the law's own linear combination of them, worked out here by hand:
    Δp = ½ δf t² ∓ g δω̇ t⁴/24.
    """
    layout, bias = cube(arm), bias_ug * UG
    duration = min(float(np.sqrt(2.0 * np.radians(2.0) * np.sqrt(2.0) * arm / bias)), 400.0)
    trajectory = parked(duration)
    time, dvel = felt(trajectory, layout, 10.0)
    errors = bias * np.array([1.0, -0.6, 0.8, 1.1, 0.4, -0.9])
    rate = trajectory.rates(0.0)[0]
    imu = gyro_free_increments(time, dvel + np.multiply.outer(np.diff(time), errors), layout, rate)
    solution = navigate(imu, trajectory.state(0.0), gravity=trajectory.gravity)
    error = navigation_error(trajectory.state(time), solution, trajectory.ellipsoid).position_ned
    root8 = 2.0 * np.sqrt(2.0)
    a = errors
    growth = np.array([a[2] - a[3] - a[4] - a[5], -a[0] - a[1] + a[4] - a[5]]) / (root8 * arm)  # about x, y
    push = np.array([a[2] - a[3] + a[4] + a[5], a[0] + a[1] + a[4] - a[5]]) / root8  # along x, y
    t = time[-1]
    north = 0.5 * push[0] * t**2 - 9.81 * growth[1] * t**4 / 24.0
    east = 0.5 * push[1] * t**2 + 9.81 * growth[0] * t**4 / 24.0
    assert error[-1, :2] == pytest.approx([north, east], rel=0.1)
    assert error[len(error) // 2, 0] == pytest.approx(
        0.5 * push[0] * (t / 2) ** 2 - 9.81 * growth[1] * (t / 2) ** 4 / 24.0, rel=0.1
    )


def test_law_with_schulers_pendulum_on_a_ball_at_rest() -> None:
    """An hour and a half with accelerometers of a pico-g: the law at all times, to a thousandth."""
    ball = Ellipsoid("ball", 6371000.0, 1e-12, 9.81 * 6371000.0**2, 1e-15)
    layout, bias = cube(1.0), 1e-6 * UG
    trajectory = Parked(0.6, 0.2, 0.0, LEVEL, 5400.0, gravity="normal", ellipsoid=ball)
    time, dvel = felt(trajectory, layout, 1.0)
    rng = np.random.default_rng(3)
    for errors in bias * rng.standard_normal((2, 6)):
        imu = gyro_free_increments(time, dvel + np.multiply.outer(np.diff(time), errors), layout, np.zeros(3))
        position = integrate_on_ball(imu)
        turn, push = layout.solution[:3] @ errors, layout.solution[3:] @ errors
        w = np.sqrt(9.81 / 6371000.0)
        versine = (1.0 - np.cos(w * time)) / w**2
        expected = push[0] * versine - 6371000.0 * turn[1] * (0.5 * time**2 - versine)
        assert np.abs(position - expected).max() < 1e-3 * np.abs(expected).max()


def integrate_on_ball(imu: ImuData) -> np.ndarray:
    """The chapter's one-component system, in the vertical plane to the north."""
    from sinssim.strapdown.one_component_system import simulate

    up = np.stack([imu.dvel[:, 0], -imu.dvel[:, 2]], axis=1)
    return simulate(imu.time, imu.dtheta[:, 1], up).coordinate * 6371000.0


def test_one_sigma_law() -> None:
    """The closed form against σ of the hand-made combinations: biases, then noise, at short times."""
    t = np.array([10.0, 60.0, 120.0])
    arm, sigma = 0.5, 1e-5
    by_bias = position_error(t, cube(arm), sigma)
    short = sigma / np.sqrt(2.0) * np.sqrt((t**2 / 2) ** 2 + (9.81 * t**4 / (24.0 * arm)) ** 2)
    assert by_bias == pytest.approx(np.stack([short, short], axis=1), rel=2e-3)
    by_noise = position_error(t, cube(arm), 0.0, sigma)
    short = sigma / np.sqrt(2.0) * np.sqrt(t**3 / 3 + (9.81 / arm) ** 2 * t**7 / 252.0)
    assert by_noise == pytest.approx(np.stack([short, short], axis=1), rel=2e-3)
    # after hours the gyro-like part goes on with the square of time, R δω̇ t²/2
    late = position_error(np.array([40000.0]), cube(arm), sigma)[0, 0]
    assert late == pytest.approx(6371000.0 * sigma / (np.sqrt(2.0) * arm) * 40000.0**2 / 2.0, rel=2e-3)


@pytest.mark.parametrize("runs", [40, *slow(200)])
def test_noise_grows_by_the_law(runs: int) -> None:
    """White noise alone: 1σ of the position after a minute, within 10 % over 200 runs."""
    section = Imu(
        grade="laser-standard",
        accel_bias_sigma_ug=0.0,
        accel_scale_sigma_ppm=0.0,
        accel_misalignment_sigma_arcsec=0.0,
        accel_instability_ug=0.0,
        accel_vrw_ug_sqrt_hz=1.0,
    )
    layout = cube(1.0)
    trajectory = parked(60.0)
    time, force = velocity_increments(trajectory, layout.position, 10.0)
    rate, initial = trajectory.rates(0.0)[0], trajectory.state(0.0)
    last = trajectory.state(time)
    errors = []
    for seed in range(runs):
        measured = emulate_accelerometers(time, force, layout.direction, section, seed)
        solution = navigate(gyro_free_increments(time, measured, layout, rate), initial)
        errors.append(navigation_error(last, solution, trajectory.ellipsoid).position_ned[-1, :2])
    sigma = np.sqrt(np.mean(np.square(errors)))  # 2N values, 400: ±3.5 %
    assert sigma == pytest.approx(position_error(60.0, layout, 0.0, 1.0 * UG).mean(), rel=0.1 * np.sqrt(200 / runs))


def test_emulated_accelerometers_have_the_grades_errors() -> None:
    """Bias, scale and the tilts of each sensitive axis, worked out by hand; each accelerometer draws its own."""
    section = Imu(grade="tactical", accel_vrw_ug_sqrt_hz=0.0, accel_instability_ug=0.0)
    layout, time = cube(1.0), np.arange(11.0)
    force = np.tile(np.random.default_rng(2).standard_normal((1, 6, 3)) * 9.81, (10, 1, 1))
    measured = emulate_accelerometers(time, force, layout.direction, section, 4)
    assert np.array_equal(measured, emulate_accelerometers(time, force, layout.direction, section, 4))
    triads = draw_accelerometers(section, 6, 4)
    assert np.array_equal(triads[0].bias, draw(section, 4).accel.bias)
    assert len({float(bias) for triad in triads for bias in triad.bias}) == 6
    for k, direction in enumerate(layout.direction):
        i, errors = k % 3, triads[k // 3]
        ideal = force[0, k] @ direction
        scaled = (measured[0, k] - errors.bias[i]) / (1.0 + errors.scale[i])
        # what is left is the force across the axis, on tilts of 1σ 100" about two axes across it
        tilts = np.delete(errors.misalignment[i], i)
        axes = axes_about(direction, i)
        across = np.delete(axes, i, axis=0) @ force[0, k]
        assert scaled - ideal == pytest.approx(tilts @ across, abs=1e-13)
        assert np.abs(axes @ axes.T - np.eye(3)).max() < 1e-15
        assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-15)
        assert np.array_equal(axes[i], direction)
        assert abs(tilts @ across) > 1e-5


def test_turning_fast() -> None:
    """A tumbling block at 100°/s: the products of the rate are large and fully accounted for."""
    from sinssim.truth.motions.analytic import OnEarth
    from sinssim.truth.motions.coning_and_rocking import SpinCone

    trajectory = OnEarth(SpinCone(0.5, 1.5, 2.0), 0.8, 0.5, 150.0, LEVEL, 10.0)
    layout = cube(0.5)
    ideal = trajectory.increments(100.0)
    time, dvel = felt(trajectory, layout, 100.0)
    imu = gyro_free_increments(time, dvel, layout, trajectory.rates(0.0)[0])
    assert np.abs(imu.dtheta - ideal.dtheta).max() < 1e-11
    assert np.abs(imu.dvel - ideal.dvel).max() < 0.5 * 3.1e-6 * 0.01
    attitude = navigate(imu, trajectory.state(0.0)).q_nb[-1]
    turn = Rotation.from_quat(attitude, scalar_first=True).inv()
    assert (turn * Rotation.from_quat(trajectory.state(10.0).q_nb, scalar_first=True)).magnitude() < 1e-8


def test_bad_input() -> None:
    with pytest.raises(InputError, match="arm = 0"):
        cube(0.0)
    together = AccelerometerSet(np.zeros((6, 3)), cube(1.0).direction)
    with pytest.raises(InputError, match="cannot separate angular"):
        _ = together.solution
    arms = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    axes = np.array([[0, 1, 0], [0, 0, 1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    leaky = AccelerometerSet(arms + 0.3 * np.eye(6)[:, :3], axes)
    unit = np.eye(3)
    sensed = np.array([[[s @ np.cross(j, np.cross(k, r)) for k in unit] for j in unit]
                       for r, s in zip(leaky.position, axes, strict=True)])  # fmt: skip
    both = np.concatenate([np.cross(leaky.position, axes), axes], axis=1)
    factor = np.abs(np.tensordot(np.linalg.inv(both)[:3], sensed, axes=1)).max()
    with pytest.raises(InputError, match=rf"products of the rate affect .*\(factor {factor:.2g}\); use a set in which"):
        _ = leaky.solution
    with pytest.raises(InputError, match="N\\+1 times"):
        gyro_free_increments(np.arange(3.0), np.zeros((3, 6)), cube(1.0), np.zeros(3))
    with pytest.raises(InputError, match="a multiple of three"):
        emulate_accelerometers(np.arange(3.0), np.zeros((2, 4, 3)), np.zeros((4, 3)), Imu(), 0)
    with pytest.raises(InputError, match=r"\(2, 6, 3\) and \(3, 3\)"):
        emulate_accelerometers(np.arange(3.0), np.zeros((2, 6, 3)), np.zeros((3, 3)), Imu(), 0)
    with pytest.raises(InputError, match=r"positions.*\(3,\)"):
        velocity_increments(parked(1.0), np.zeros(3), 10.0)
    with pytest.raises(InputError, match="finite positions"):
        velocity_increments(parked(1.0), np.full((1, 3), np.nan), 10.0)
