"""A platform's forces, causes and loops where the answer follows from one line of mechanics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from sinssim import NavState, rotation
from sinssim.earth import OMEGA_IE, surface_gravity
from sinssim.earth.ellipsoids import WGS84
from sinssim.errors import InputError, RunError
from sinssim.strapdown.gimballed_platform import Forces, _check, _checked, inertial_forces, navigate_platform
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.strapdown.platform_theory import START, STATES, AlignmentLoops, ErrorsByCause, errors_by_cause
from tests.oracles.s_turn import STurn
from tests.strapdown.test_navigate import on_a_parallel


def parked(time: np.ndarray) -> NavState:
    one = np.ones(len(time))
    q_nb = np.tile(rotation.quaternion_from_euler(0.1, -0.2, 0.7), (len(time), 1))
    return NavState(0.8 * one, -0.4 * one, 600.0 * one, np.zeros((len(time), 3)), q_nb)


def test_what_holds_a_vehicle_at_rest_and_what_a_disturbance_takes_from_it() -> None:
    """Gravity upwards, turning with the Earth; a disturbance of gravity is no specific force."""
    time = np.arange(0.0, 600.5, 2.0) + 100.0
    truth, disturbance = parked(time), np.outer(np.ones(301), [3e-4, -2e-4, 5e-4])
    plain, other = (inertial_forces(time, truth, "somigliana", WGS84, given) for given in (None, disturbance))
    middle = 0.5 * (time[1:] + time[:-1])
    c_in = [
        Rotation.from_euler("ZY", [-0.4 + OMEGA_IE * t, -0.8 - np.pi / 2]).as_matrix() for t in middle
    ]  # inertial from north, east, down
    # Somigliana's gravity of 0.8 rad less 3.086e-6 per metre
    gravity = float(surface_gravity(0.8)) - 3.0877e-6 * 600.0
    up = [-2.0 * c @ [0.0, 0.0, gravity] for c in c_in]
    np.testing.assert_allclose(plain.push, up, rtol=0, atol=3e-5)
    taken = [-2.0 * c @ disturbance[0] for c in c_in]
    np.testing.assert_allclose(other.push - plain.push, taken, rtol=0, atol=1e-9)
    first = Rotation.from_euler("ZY", [-0.4 + OMEGA_IE * 100.0, -0.8 - np.pi / 2])
    q_ib = first * Rotation.from_euler("ZYX", [0.7, -0.2, 0.1])
    assert (Rotation.from_quat(plain.q_ib[0], scalar_first=True) * q_ib.inv()).magnitude() < 1e-12


@pytest.mark.parametrize(
    ("frame", "azimuth", "off"),
    [
        ("wander", 0.9, {"east": 400.0}),
        ("level", 0.0, {"velocity": (0.2, -0.3)}),
        ("wander", 0.9, {"tilt": (3e-4, -2e-4)}),
        ("wander", -2.0, {"east": -300.0, "velocity": (0.1, 0.2), "tilt": (1e-4, 2e-4)}),
    ],
)
def test_errors_of_the_start_in_a_wander_frame(frame: str, azimuth: float, off: dict[str, Any]) -> None:
    turns = STurn(duration=900.0, period=120.0).fly(10)
    truth = NavState(turns.latitude, turns.longitude, turns.height, turns.velocity_ned, turns.q_nb)
    forces = inertial_forces(turns.time, truth, "normal", WGS84)
    tilt = rotation.quaternion_from_rotation_vector([*off.get("tilt", (0.0, 0.0)), 0.0])
    first = NavState(
        truth.latitude[0], truth.longitude[0] + off.get("east", 0.0) / (6.39e6 * np.cos(truth.latitude[0])),
        truth.height[0], truth.velocity_ned[0] + [*off.get("velocity", (0.0, 0.0)), 0.0],
        rotation.multiply(tilt, truth.q_nb[0]),
    )  # fmt: skip
    options: dict[str, Any] = {"frame": frame, "azimuth": azimuth, "vertical": "truth", "height": truth.height}
    solution = navigate_platform(turns.time, forces, first, **options)
    found = errors_by_cause(truth, forces, solution, _none(), WGS84)
    error = navigation_error(truth, solution)
    own = error.position_ned[np.searchsorted(turns.time, found.time), :2]
    largest = np.abs(own).max()
    assert largest > 50.0
    assert np.abs(found.position[START] - own).max() < 0.01 * largest
    assert found.apart(error) < 0.015 * largest
    assert found.apart(error) == pytest.approx(np.linalg.norm(found.total - own, axis=1).max(), rel=1e-9)


def test_an_error_of_the_start_turns_with_north_at_high_latitude() -> None:
    """At 75° north, eastwards at 220 m/s, north turns by 7.4° in 1000 s: a part of 500 m to the north is then east."""
    time, truth, forces = on_a_parallel(np.radians(75.0), 220.0, 1000.0, 5.0)
    first = NavState(
        truth.latitude[0] + 500.0 / 6.4e6, truth.longitude[0], truth.height[0], truth.velocity_ned[0], truth.q_nb[0]
    )
    solution = navigate_platform(time, forces, first, vertical="truth", height=truth.height)
    found = errors_by_cause(truth, forces, solution, _none(), WGS84)
    own = navigation_error(truth, solution).position_ned[np.searchsorted(time, found.time), :2]
    assert np.abs(own[:, 1]).max() > 40.0
    assert np.abs(found.total - own).max() < 0.01 * np.abs(own).max()


def _none() -> Any:
    from sinssim.sensors.sensor_set_readings import PlatformErrors

    return PlatformErrors()


def test_all_causes_together_and_how_far_apart() -> None:
    time = np.array([1.0, 3.0])
    found = ErrorsByCause(time, {"a": np.array([[1.0, 2.0], [3.0, 4.0]]), "b": np.array([[10.0, 20.0], [30.0, 40.0]])})
    np.testing.assert_array_equal(found.total, [[11.0, 22.0], [33.0, 44.0]])
    position = np.zeros((4, 3))
    position[1], position[3] = [8.0, 26.0, 99.0], [33.0, 46.0, 99.0]
    assert found.apart(NavError(np.arange(4.0), position, position, position)) == pytest.approx(5.0)


LOOPS = AlignmentLoops(0.9, 40.0, 0.06, 0.8)


def test_the_dynamics_are_the_equations_of_the_module() -> None:
    g, n, d = float(surface_gravity(0.9)), OMEGA_IE * np.cos(0.9), -OMEGA_IE * np.sin(0.9)
    v_n, tilt_e, turn, v_e, tilt_n = 0.3, 2e-3, 5e-3, -0.2, 1e-3
    k1, k2 = 3.0 / 40.0, (3.0 / 1600.0 - n**2) / g
    k3 = (1.0 / 64000.0 - k1 * n**2) / (g * n)
    l1, l2 = 2.0 * 0.8 * 0.06, 0.06**2 / g
    expected = [
        g * tilt_e - k1 * v_n,
        n * turn - d * tilt_n - k2 * v_n,
        -n * tilt_e - k3 * v_n,
        -g * tilt_n - l1 * v_e,
        d * tilt_e + l2 * v_e,
    ]
    np.testing.assert_allclose(LOOPS.dynamics @ [v_n, tilt_e, turn, v_e, tilt_n], expected, rtol=1e-12)
    assert STATES == ("velocity north", "tilt east", "azimuth", "velocity east", "tilt north")
    assert AlignmentLoops(0.9, 40.0, 0.06) == AlignmentLoops(0.9, 40.0, 0.06, 0.7)


def test_the_spread_during_an_alignment_by_the_differential_equation() -> None:
    """Ṗ = A P + P Aᵀ + B S Bᵀ of states and constant errors of the sensors, all different."""
    bias, white = (60e-5, 5e-8), (2e-4, 3e-7)
    b = np.zeros((5, 5))  # accelerometers north and east; gyros north, east and down
    b[0, 0] = b[3, 1] = 1.0
    b[4, 2] = b[1, 3] = b[2, 4] = -1.0
    a = np.zeros((10, 10))
    a[:5, :5], a[:5, 5:] = LOOPS.dynamics, b
    s = np.zeros((10, 10))
    s[:5, :5] = b @ np.diag([white[0] ** 2] * 2 + [white[1] ** 2] * 3) @ b.T
    p = np.diag([0.0, 4e-6, 9e-4, 0.0, 4e-6, bias[0] ** 2, bias[0] ** 2, *[bias[1] ** 2] * 3])
    time = np.arange(0.0, 121.0, 30.0)
    found = LOOPS.sigmas(time, 2e-3, 3e-2, bias, white)
    np.testing.assert_allclose(found[0], [2e-3, 2e-3, 3e-2])

    def slope(_: float, flat: np.ndarray) -> np.ndarray:
        own = flat.reshape(10, 10)
        return (a @ own + own @ a.T + s).ravel()

    solved = solve_ivp(slope, (0.0, 120.0), p.ravel(), t_eval=time, rtol=1e-10, atol=1e-20, method="LSODA")
    expected = np.sqrt([np.diag(row.reshape(10, 10))[[4, 1, 2]] for row in solved.y.T])
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    # and the errors after it are those that constant sensors lead to
    errors = np.array([3e-4, -5e-4, 1e-8, 2e-8, -3e-8])
    x = np.zeros(10)
    x[5:] = errors
    late = expm(a * 40.0 * 60.0) @ x
    np.testing.assert_allclose(LOOPS.final_errors(errors[:2], errors[2:]), late[[4, 1, 2]], rtol=1e-6)


def test_what_is_said_of_a_platform_that_cannot_point_north_or_diverged() -> None:
    time, zeros = np.array([5.0, 6.0, 7.0]), np.zeros(3)
    latitude = np.radians([89.0, 89.95, 89.99])
    velocity, q = np.ones((3, 3)), np.ones((3, 4))
    with pytest.raises(RunError) as info:
        _check("level", zeros, time, latitude, zeros, zeros, velocity, q)
    assert str(info.value) == (
        "a platform that points north cannot be turned fast enough within 0.1° of a pole: latitude 89.9500° at t = "
        "6.00 s. The frames wander, free-azimuth, transverse and inertial pass the poles."
    )
    assert info.value.time == 6.0
    _check("wander", zeros, time, latitude, zeros, zeros, velocity, q)
    velocity[2, 1] = np.nan
    with pytest.raises(
        RunError, match=r"the velocity of the platform's navigation diverged .* at t = 7\.00 s\."
    ) as info:
        _check("wander", zeros, time, latitude, zeros, zeros, velocity, q)
    assert info.value.time == 7.0


def test_forces_of_a_platform_that_are_no_numbers() -> None:
    time, q = np.array([5.0, 5.5, 6.0, 6.5]), np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    push = np.zeros((3, 3))
    np.testing.assert_array_equal(_checked(time, Forces(push, q)), time)
    push[1, 2] = np.nan
    with pytest.raises(InputError, match=r"^the specific force in the interval from t = 5\.500000 s is not a finite"):
        _checked(time, Forces(push, q))
    with pytest.raises(InputError, match=r"N ≥ 1; got \(4,\), \(3, 4\) and \(3, 3\)\.$"):
        _checked(time, Forces(push, q[1:]))
