"""A star tracker knows the Earth but no local level: H against differences of the errors' definition."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sinssim.data import Measurements, NavState
from sinssim.earth import WGS84
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.linearisation import Prediction, observe
from tests.oracles import integrator as oracle

MODEL = ErrorModel(
    (Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0), Block("stars bias", np.ones(3))), 0.0, 0.0
)
NONE = {"stars bias": np.zeros(3)}


def moved(latitude, longitude, height, attitude, error):
    """Return the navigation state with given errors: metres by the oracle's ellipsoid, φ by its definition."""
    m = oracle.geodetic_to_ecef(latitude, longitude, height)
    m = m + oracle.ned_axes(latitude, longitude).T @ error[:3]
    # back to geodetic coordinates by Newton's method on the oracle's own direction
    place = np.array([latitude, longitude, height])
    for _ in range(5):
        off = oracle.ned_axes(place[0], place[1]) @ (m - oracle.geodetic_to_ecef(*place))
        place += [off[0] / 6.38e6, off[1] / (6.38e6 * np.cos(place[0])), -off[2]]
    wrong = Rotation.from_rotvec(-error[6:9]) * attitude  # q_true = q(φ) ∘ q_solution
    q = wrong.as_quat(scalar_first=True)
    return NavState(*(np.array([v]) for v in place), np.zeros((1, 3)), q[None])


def test_observation_matrix_is_the_slope_of_the_residual():
    rng = np.random.default_rng(6)
    for _ in range(20):
        latitude, longitude, height = rng.uniform(-1.3, 1.3), rng.uniform(-3.0, 3.0), rng.uniform(0.0, 2e4)
        attitude = Rotation.random(rng=rng)
        level = Rotation.from_matrix(oracle.ned_axes(latitude, longitude).T)
        true = (level * attitude).as_quat(scalar_first=True)
        m = Measurements("earth-attitude", np.zeros(1), np.zeros(1), true[None], np.ones((1, 3)), name="stars")

        def residual(error, m=m, at=(latitude, longitude, height, attitude)):
            now = Prediction(moved(*at, error), np.zeros((1, 3)), WGS84)
            return [part[0] for part in observe(m, now, MODEL, NONE)]

        start, h = residual(np.zeros(9))
        np.testing.assert_allclose(start, 0.0, rtol=0, atol=1e-14)
        for j, step in ((0, 10.0), (1, 10.0), (2, 10.0), (6, 1e-5), (7, 1e-5), (8, 1e-5)):
            error = np.zeros(9)
            error[j] = step
            slope = (residual(error)[0] - residual(-error)[0]) / (2.0 * step)
            np.testing.assert_allclose(h[:, j], slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max() + 1e-15)
        np.testing.assert_array_equal(h[:, 3:6], 0.0)


def test_bias_is_a_turn_about_the_bodys_axes():
    attitude, bias = Rotation.from_euler("ZYX", [1.0, 0.4, -0.7]), np.array([1e-4, -2e-4, 3e-4])
    level = Rotation.from_matrix(oracle.ned_axes(0.8, 0.3).T)
    read = (level * attitude * Rotation.from_rotvec(bias)).as_quat(scalar_first=True)
    m = Measurements("earth-attitude", np.zeros(1), np.zeros(1), read[None], np.ones((1, 3)), name="stars")
    now = Prediction(moved(0.8, 0.3, 100.0, attitude, np.zeros(9)), np.zeros((1, 3)), WGS84)
    residual, h = observe(m, now, MODEL, NONE)
    np.testing.assert_allclose(residual[0], h[0, :, MODEL.slices["stars bias"]] @ bias, rtol=0, atol=1e-9)
    np.testing.assert_allclose(observe(m, now, MODEL, {"stars bias": bias})[0], 0.0, rtol=0, atol=1e-14)
