"""H in transported axes is the derivative of the residual, also near a pole, for every kind of measurement."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import Array, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import BLOCKS, Block, ErrorModel
from sinssim.estimation.linearisation import Prediction, _dynamics, motion, observe
from sinssim.sensors.aiding_registry import KINDS, measurement_kind
from tests.oracles import integrator as oracle
from tests.oracles.transported import geodetic, wrong_by
from tests.slow import slow

MODEL = ErrorModel(tuple(Block(name, 1.0) for name in BLOCKS), 0.0, 0.0, axes="transported")
ARM, RATE = np.array([1.5, -0.4, -2.0]), np.array([0.05, -0.3, 0.2])
C_NB = Rotation.from_euler("ZYX", (1.1, 0.2, -0.5))
OMEGA_E = np.array([0.0, 0.0, oracle.OMEGA])
STEP = np.repeat((1.0, 1e-2, 1e-4), 3)


class Truth(NamedTuple):
    """A place and a velocity."""

    place: tuple[float, float, float]
    velocity: Array


def reading(kind: str, truth: Truth) -> Array:
    """Return the reading of a perfect sensor, all in Earth-fixed axes."""
    c_en = oracle.ned_axes(*truth.place[:2]).T
    c_eb = c_en @ C_NB.as_matrix()
    turning = RATE - c_eb.T @ OMEGA_E
    velocity = c_en @ truth.velocity + c_eb @ np.cross(turning, ARM)
    antenna = geodetic(oracle.geodetic_to_ecef(*truth.place) + c_eb @ ARM, truth.place)
    readings = {
        "gnss-position": np.array(antenna),
        "gnss-velocity": c_en.T @ velocity,
        "zero-velocity": truth.velocity,
        "zero-rate": turning,
        "baro-height": np.array([truth.place[2]]),
        "heading": np.array([1.1]),
        "baseline-heading": np.arctan2(*(C_NB.as_matrix() @ ARM)[1::-1])[None],
        "speed": (c_eb.T @ velocity)[:1],
        "airspeed": np.array([np.linalg.norm(velocity)]),
        "attitude": C_NB.as_quat(scalar_first=True),
        "earth-attitude": Rotation.from_matrix(c_eb).as_quat(scalar_first=True),
        "land-velocity": np.array([*(c_eb.T @ velocity)[1:], 0.0, 0.0]),
    }
    return readings[kind]


def residual(kind: str, truth: Truth, x: Array) -> tuple[Array, Array]:
    """Return residual and H where navigation is wrong by x."""
    place, velocity, c_nb = wrong_by(truth.place, truth.velocity, C_NB, x)
    state = NavState(*(np.array([c]) for c in place), velocity[None], c_nb.as_quat(scalar_first=True)[None])
    errors = measurement_kind(kind).errors
    given = Measurements(kind, np.zeros(1), np.zeros(1), reading(kind, truth)[None], np.ones((1, errors)), ARM)
    known = {block.name: np.zeros(block.size) for block in MODEL.blocks[3:]}
    y, h = observe(given, Prediction(state, RATE[None], WGS84), MODEL, known)
    return y[0], h[0]


# 10 m from a pole a metre turns north by 0.1 rad: readings relative to north are not used so near
CASES = [(kind, -np.radians(89.0)) for kind in KINDS]
CASES += slow(*((kind, latitude) for kind in KINDS for latitude in (0.8, np.radians(89.9))))
CASES += [(kind, np.radians(89.9999)) for kind in KINDS if not measurement_kind(kind).of_north]


def test_the_attitude_half_way_is_in_the_axes_of_the_end() -> None:
    """A kilometre from a pole the axes turn by 0.2 rad in 200 m; the Earth is flat there to 3e-5."""
    latitude, longitude = np.full(3, 0.5 * np.pi - 1e3 / 6.4e6), np.array([-2.0, -1.9, -1.8])
    states = [
        NavState(latitude[s], longitude[s], np.zeros(len(latitude[s])), np.full((len(latitude[s]), 3), 5.0),
                 np.tile(C_NB.as_quat(scalar_first=True), (len(latitude[s]), 1)))
        for s in (slice(0, 3, 2), slice(1, 2))
    ]  # fmt: skip
    around = SimpleNamespace(model=MODEL, gravity="normal", ellipsoid=WGS84, density=np.zeros(MODEL.size))
    moving = motion(*states, np.array([20.0]), RATE[None], "normal", WGS84, "transported")
    _, _, c_nb, turn = _dynamics(around, *states, np.array([20.0]), moving)  # type: ignore[arg-type]
    start, middle, end = (oracle.ned_axes(latitude[k], longitude[k]) for k in range(3))
    np.testing.assert_allclose(c_nb[0], end @ middle.T @ C_NB.as_matrix(), rtol=0, atol=1e-4)
    assert turn is not None
    np.testing.assert_allclose(turn[0], start @ end.T, rtol=0, atol=1e-4)


def test_the_specific_force_holds_the_change_of_velocity() -> None:
    """5, 5 and −2 m/s² more than at the mean velocity throughout."""
    place = (np.full(2, 0.8), np.full(2, -2.0), np.full(2, 7000.0))
    q = np.tile(C_NB.as_quat(scalar_first=True), (2, 1))
    middle = NavState(*(part[:1] for part in place), np.array([[125.0, -75.0, 4.0]]), q[:1])
    gathering, steady = (
        motion(NavState(*place, np.array(v), q), middle, np.array([2.0]), RATE[None], "normal", WGS84, "transported")
        for v in ([[120.0, -80.0, 6.0], [130.0, -70.0, 2.0]], [[125.0, -75.0, 4.0]] * 2)
    )
    np.testing.assert_allclose(gathering.force_n - steady.force_n, [[5.0, 5.0, -2.0]], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("kind", "latitude"), CASES)
def test_h_is_the_derivative_of_the_residual(kind: str, latitude: float) -> None:
    moving = 0.0 if kind == "zero-velocity" else 1.0
    truth = Truth((latitude, -2.0, 7000.0), moving * np.array([120.0, -80.0, 6.0]))
    at_truth, h = residual(kind, truth, np.zeros(9))
    np.testing.assert_allclose(at_truth, 0.0, atol=1e-8)  # rounding of positions on the Earth
    for block in (slice(0, 3), slice(3, 6), slice(6, 9)):
        for j in range(block.start, block.stop):
            x = np.zeros(9)
            x[j] = STEP[j]
            slope = (residual(kind, truth, x)[0] - residual(kind, truth, -x)[0]) / (2.0 * STEP[j])
            # a metre over the distance from the pole, to the second power
            curved = (STEP[0] / (6.4e6 * np.cos(latitude))) ** 2 if block.start == 0 else 0.0
            bound = (1e-6 + curved) * np.abs(h[:, block]).max() + 2e-9 / STEP[j]
            assert np.abs(slope - h[:, j]).max() < bound, j


def test_readings_of_a_vehicle_at_rest_do_not_depend_on_north() -> None:
    """Zero velocity at the pole itself, where tan φ would be 1e16."""
    truth = Truth((0.5 * np.pi, 0.3, 100.0), np.zeros(3))
    for kind in ("zero-velocity", "gnss-position", "baro-height"):
        _, h = residual(kind, replace_velocity(truth), np.zeros(9))
        assert np.abs(h[:, :9]).max() <= 10.0


def replace_velocity(truth: Truth) -> Truth:
    """Return a truth with the small velocity of a solution that stands."""
    return truth._replace(velocity=np.array([1e-3, -2e-3, 1e-3]))


def test_relative_to_north_nothing_changes() -> None:
    """With axes "north" `observe` leaves H as the kind made it."""
    truth = Truth((0.8, -2.0, 7000.0), np.array([120.0, -80.0, 6.0]))
    state = NavState(*(np.array([c]) for c in truth.place), truth.velocity[None],
                     C_NB.as_quat(scalar_first=True)[None])  # fmt: skip
    given = Measurements("gnss-velocity", np.zeros(1), np.zeros(1), truth.velocity[None], np.ones((1, 3)), ARM)
    known = {block.name: np.zeros(block.size) for block in MODEL.blocks[3:]}
    at = Prediction(state, RATE[None], WGS84)
    north, level = (observe(given, at, replace(MODEL, axes=axes), known)[1][0] for axes in ("north", "transported"))
    assert not north[:, 1].any()
    swing = C_NB.as_matrix() @ np.cross(RATE - C_NB.as_matrix().T @ oracle.ned_axes(0.8, -2.0) @ OMEGA_E, ARM)
    psi = np.tan(0.8) / (oracle.A / np.sqrt(1.0 - oracle.F * (2.0 - oracle.F) * np.sin(0.8) ** 2) + 7000.0)
    moved = truth.velocity + swing
    np.testing.assert_allclose(level[:, 1], psi * np.array([-moved[1], moved[0], 0.0]), rtol=1e-6, atol=3e-11)
