"""F in Earth-fixed axes, and what leads from there to the filter's state, against central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavSolution, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS, WGS84
from sinssim.estimation.error_dynamics import (
    NominalMotion,
    dynamics,
    earth_dynamics,
    local_from_earth,
    transition,
    transported_transition,
)
from sinssim.estimation.estimate import estimate
from sinssim.estimation.state_model import error_model
from sinssim.strapdown.motion_coordinates import earth_fixed
from sinssim.strapdown.navigate import navigate
from tests.estimation.test_dynamics import ALL, RATE_HZ, SPAN, STEPS, perturbed
from tests.estimation.worlds import biases_only, one_run, positions, velocities, weaving
from tests.oracles import integrator as oracle
from tests.oracles.transported import wrong_by

NEAR_THE_POLE = np.radians(89.9999)


def moved(start: NavState, x: Array, ellipsoid: str) -> NavState:
    """Return a state that is wrong by position, velocity and attitude in Earth-fixed axes."""
    shape = ELLIPSOIDS[ellipsoid]
    rows = NavState(*(np.asarray(part)[None] for part in vars(start).values()))
    fixed = earth_fixed(rows, shape)
    lat, lon, height = earth.ecef_to_geodetic(fixed.position + x[:3], shape)
    q_ne = rotation.conjugate(earth.q_en(lat, lon))
    q_eb = rotation.multiply(rotation.quaternion_from_rotation_vector(-x[6:9]), fixed.q_eb)
    velocity, q_nb = rotation.rotate(q_ne, fixed.velocity + x[3:6]), rotation.multiply(q_ne, q_eb)
    return NavState(lat[0], lon[0], height[0], velocity[0], q_nb[0])


def errors(true: NavSolution, wrong: NavSolution, ellipsoid: str) -> Array:
    """Return the errors in Earth-fixed axes, (N, 9)."""
    own, other = earth_fixed(true, ELLIPSOIDS[ellipsoid]), earth_fixed(wrong, ELLIPSOIDS[ellipsoid])
    turn = rotation.multiply(own.q_eb, rotation.conjugate(other.q_eb))
    phi = rotation.rotation_vector_from_quaternion(turn)
    return np.hstack([other.position - own.position, other.velocity - own.velocity, phi])


def motion_at(start: NavState, rate: Array, force: Array) -> NominalMotion:
    """Return the motion at a start."""
    c_nb = rotation.dcm_from_quaternion(start.q_nb)
    return NominalMotion(
        start.latitude[None], start.height[None], start.velocity_ned[None], c_nb[None], (c_nb @ force)[None],
        rate[None], force[None],
    )  # fmt: skip


def any_start(rng: np.random.Generator, latitude: float) -> NavState:
    """Return some state at a latitude."""
    place = np.asarray(latitude), np.asarray(rng.uniform(-3.0, 3.0)), np.asarray(rng.uniform(0.0, 12000.0))
    return NavState(*place, rng.uniform(-200.0, 200.0, 3), rotation.normalize(rng.standard_normal(4)))


@pytest.mark.parametrize(
    ("latitude", "gravity", "ellipsoid", "seed"),
    [(0.6, "normal", "wgs84", 0), (NEAR_THE_POLE, "normal", "wgs84", 1), (-1.1, "j2", "krasovsky-1940", 2),
     (-0.5 * np.pi, "normal", "wgs84", 3)],
)  # fmt: skip
def test_f_is_the_engines(latitude: float, gravity: str, ellipsoid: str, seed: int) -> None:
    """By the engine in inertial axes, which has no coordinates of the local level; also 10 m from a pole and at it."""
    rng = np.random.default_rng(seed)
    start = any_start(rng, latitude)
    rate, force = rng.uniform(-0.1, 0.1, 3), rng.uniform(-15.0, 15.0, 3)
    count = round(SPAN * RATE_HZ)
    imu = ImuData(
        np.arange(count + 1) / RATE_HZ, np.tile(rate / RATE_HZ, (count, 1)), np.tile(force / RATE_HZ, (count, 1))
    )
    options = {"frame": "inertial", "gravity": gravity, "ellipsoid": ellipsoid}
    middle = navigate(imu, start, **options)
    powers = imu.time[1:, None] ** np.arange(1, 10)
    f = earth_dynamics(ALL, motion_at(start, rate, force), start.longitude[None], gravity, ELLIPSOIDS[ellipsoid])[0]
    for name, where in ALL.slices.items():
        found = np.empty((9, where.stop - where.start))
        for column in range(where.start, where.stop):
            grown = []
            for sign in (1.0, -1.0):
                x = np.zeros(ALL.size)
                x[column] = sign * STEPS[name]
                state, wrong = perturbed(start, imu, np.where(np.arange(ALL.size) < 9, 0.0, x), ellipsoid)
                state = moved(start, x, ellipsoid) if column < 9 else start
                grown.append(errors(middle, navigate(wrong, state, **options), ellipsoid))
            history = (grown[0] - grown[1]) / (2.0 * STEPS[name])
            found[:, column - where.start] = np.linalg.lstsq(powers, history[1:] - history[0], rcond=None)[0][0]
        for row in ("position", "velocity", "attitude"):
            block, reference = f[ALL.slices[row], where], found[ALL.slices[row]]
            if block.any():
                assert np.abs(reference - block).max() < 1e-6 * np.abs(block).max(), (row, name)
            else:  # of the largest effect that these columns have, or rounding of positions on the Earth
                rounding = 3e-8 / STEPS[name] if row == "position" else 0.0
                assert np.abs(reference).max() < 1e-5 * np.abs(f[:9, where]).max() + rounding, (row, name)


@pytest.mark.parametrize("latitude", [0.7, NEAR_THE_POLE])
def test_the_state_from_errors_in_earth_fixed_axes(latitude: float) -> None:
    """A state that is wrong in transported axes has the errors in Earth-fixed axes that the matrices say."""
    rng = np.random.default_rng(5)
    place = (latitude, 0.4, 9000.0)
    velocity, attitude = rng.uniform(-200.0, 200.0, 3), Rotation.random(random_state=6)
    step = np.repeat((1.0, 1.0, 1e-4), 3)

    def row(p: tuple[float, float, float], v: Array, a: Rotation) -> NavState:
        return NavState(*(np.array([c]) for c in p), v[None], a.as_quat(scalar_first=True)[None])

    def fixed(error: Array) -> Array:
        wrong, true = row(*wrong_by(place, velocity, attitude, error)), row(place, velocity, attitude)
        as_solutions = (NavSolution(np.zeros(1), *vars(s).values(), np.zeros(1), "any") for s in (true, wrong))
        return errors(*as_solutions, "wgs84")[0]

    to, back = local_from_earth(row(place, velocity, attitude), WGS84)
    np.testing.assert_allclose(to[0] @ back[0], np.eye(9), atol=1e-12)
    for column in range(9):
        x = np.zeros(9)
        x[column] = step[column]
        slope = (fixed(x) - fixed(-x)) / (2.0 * step[column])
        # rounding of positions on the Earth, 1e-9 m, over a metre; of the attitude, 1e-16, over its step
        tolerance = np.repeat((2e-8, 2e-9, 1e-12) if column < 6 else (1e-5, 1e-5, 1e-9), 3)
        assert np.all(np.abs(slope - back[0][:, column]) <= tolerance + 1e-6 * np.abs(back[0][:, column])), column


def test_both_forms_of_the_dynamics_are_one() -> None:
    """Φ relative to north is that in transported axes with the turn of north at both ends, block by block."""
    rng = np.random.default_rng(7)
    start = any_start(rng, 0.9)
    rate, force = rng.uniform(-0.01, 0.01, 3), np.array([0.3, -0.2, -9.8])
    step = 0.02
    imu = ImuData(0.5 * step * np.arange(3.0), np.tile(0.5 * step * rate, (2, 1)), np.tile(0.5 * step * force, (2, 1)))
    flown = navigate(imu, start)
    middle = motion_at(NavState(*(getattr(flown, name)[1] for name in vars(start))), rate, force)
    ends = NavState(*(getattr(flown, name)[::2] for name in vars(start)))
    f = earth_dynamics(ALL, middle, flown.longitude[1:2], "normal", WGS84)
    level, _ = transported_transition(f, np.ones(ALL.size), np.array([step]), ends, WGS84)
    north, _ = transition(dynamics(ALL, middle, "normal", WGS84), np.ones(ALL.size), np.array([step]))
    turns = [turn_of_states(NavState(*(part[k] for part in vars(ends).values()))) for k in (0, 1)]
    found = turns[1] @ level[0] @ np.linalg.inv(turns[0]) - np.eye(ALL.size)
    wanted = north[0] - np.eye(ALL.size)
    for row in ("position", "velocity", "attitude"):
        for name, where in ALL.slices.items():
            block = ALL.slices[row], where
            # F changes within the interval: by 1e-2 rad/s times 0.02 s, to the second order
            assert np.abs(found[block] - wanted[block]).max() <= 1e-6 * np.abs(wanted[block]).max(), (row, name)


def turn_of_states(state: NavState, size: int = ALL.size) -> Array:
    """Return the matrix from the state in transported axes to that relative to north."""
    turn = np.eye(size)
    v_n, v_e, _ = state.velocity_ned
    psi = np.tan(state.latitude) / (earth.radii(state.latitude)[1] + state.height)
    turn[3, 1], turn[4, 1], turn[8, 1] = -psi * v_e, psi * v_n, -psi
    return turn


@pytest.mark.parametrize(("loop", "metres"), [("closed", 1e-5), ("open", 1e-3)])
def test_far_from_the_poles_both_give_one_estimate(loop: str, metres: float) -> None:
    """The sensors' parameters have no axes: their estimates and σ agree to rounding of the linearisation. The open loop
    carries its errors for a minute, tens of metres, and their second order with them."""
    trajectory, ideal = weaving(60.0, 20.0)
    sigma = biases_only("tactical")
    model = error_model(sigma, position=5.0, velocity=0.2, attitude=(1e-3, 1e-3, 3e-3))
    run = one_run(trajectory, ideal, model, sigma, 3)
    rng, time = np.random.default_rng(4), ideal.time[20::20]
    place, speed = positions(trajectory, time, rng), velocities(trajectory, time, rng)
    given = [place, replace(speed, lever_arm=np.array([2.0, -1.0, -3.0]))]
    # the start's errors are drawn relative to north: their P₀ in transported axes, by the turn of north
    turn = np.linalg.inv(turn_of_states(run.initial, model.size))
    covariance = turn @ np.diag(model.sigma**2) @ turn.T
    north, level = (
        estimate(run.imu, run.initial, given, model, loop=loop, frame="wander", axes=axes, smooth=True, covariance=p)
        for axes, p in (("north", None), ("transported", covariance))
    )
    assert (north.model.axes, level.model.axes) == ("north", "transported")
    np.testing.assert_allclose(level.sigma[:, 9:], north.sigma[:, 9:], rtol=3e-6)
    for name, estimated in north.parameters.items():
        spread = north.sigma[:, north.model.slices[name]]
        assert np.abs((level.parameters[name] - estimated) / spread).max() < 1e-5
    off = np.hypot(*((getattr(level.solution, n) - getattr(north.solution, n)) for n in ("latitude", "longitude")))
    assert oracle.A * off.max() < metres
    assert north.smoothed is not None
    assert level.smoothed is not None
    np.testing.assert_allclose(level.smoothed.sigma[:, 9:], north.smoothed.sigma[:, 9:], rtol=3e-6)
