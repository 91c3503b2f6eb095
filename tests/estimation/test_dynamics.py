"""F against central differences of the engine itself; Φ and Q against Van Loan's matrix exponential."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.estimation import BLOCKS, Block, ErrorModel
from sinssim.estimation.error_dynamics import NominalMotion, driving_noise, dynamics, noise_at_speed, transition
from sinssim.estimation.state_model import INERTIAL
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.emulation import emulate
from sinssim.strapdown.navigate import disturbance_in_body, navigate
from sinssim.strapdown.navigation_error import navigation_error

ALL = ErrorModel(
    tuple(Block(name, 1.0) for name in BLOCKS if not name.startswith("gnss ") and name[-1] not in "3456789"), 0.0, 0.0
)
RATE_HZ, SPAN = 20.0, 4.0

# how far each block is perturbed: enough to stand out of rounding, little enough that third order is below 1e-7
STEPS = {
    "position": 1000.0,
    "velocity": 10.0,
    "attitude": 2e-4,
    "gyro bias": 1e-3,
    "accelerometer bias": 1e-2,
    **{f"gyro {of}": 1e-3 for of in ("instability", "flicker 1", "flicker 2")},
    **{f"accelerometer {of}": 1e-2 for of in ("instability", "flicker 1", "flicker 2")},
    "gyro scale": 0.02,
    "accelerometer scale": 2e-3,
    "gyro misalignment": 0.02,
    "accelerometer misalignment": 2e-3,
    "gyro asymmetry": 0.04, "accelerometer asymmetry": 4e-3, "gyro quadratic": 1.0, "accelerometer quadratic": 2e-4,
    "gyro cubic": 50.0, "accelerometer cubic": 1e-5, "accelerometer cross-axis": 2e-4, "gyro g-sensitivity": 1e-4,
    "gravity disturbance": 1e-2,
}  # fmt: skip


def perturbed(start: NavState, imu: ImuData, x: Array, ellipsoid: str) -> tuple[NavState, ImuData]:
    """Return start and increments that are wrong by the states x."""
    r1, r2 = earth.radii(start.latitude, ELLIPSOIDS[ellipsoid])
    part = {name: x[where] for name, where in ALL.slices.items()}
    state = NavState(
        start.latitude + part["position"][0] / (r1 + start.height),
        start.longitude + part["position"][1] / ((r2 + start.height) * np.cos(start.latitude)),
        start.height - part["position"][2],
        start.velocity_ned + part["velocity"],
        # C_solution = (I − [φ×]) C_true
        rotation.multiply(rotation.quaternion_from_rotation_vector(-part["attitude"]), start.q_nb),
    )
    of_bias = ("bias", "instability", "flicker 1", "flicker 2")
    part |= {f"{of} bias": sum(part[f"{of} {name}"] for name in of_bias) for of in ("gyro", "accelerometer")}
    gyro, accel = (
        TriadErrors(**{of.field: of.shaped(part[name]) for name, of in INERTIAL.items() if of.triad == triad})
        for triad in ("gyro", "accel")
    )
    wrong = emulate(imu, ImuErrors(gyro, accel))
    unknown = part["gravity disturbance"]
    if unknown.any():  # a navigator that does not know gravity navigates as one with less force
        along = navigate(imu, start, frame="inertial", ellipsoid=ellipsoid)
        constant = np.zeros((1, 4, 3))
        constant[0, 0] = rotation.rotate(earth.q_en(start.latitude, start.longitude), unknown)
        felt = disturbance_in_body(imu, along, constant, 0.0, 2.0 * SPAN, ELLIPSOIDS[ellipsoid])
        wrong = ImuData(imu.time, wrong.dtheta, wrong.dvel - felt)
    return state, wrong


def engine_f(start: NavState, rate: Array, force: Array, gravity: str, ellipsoid: str) -> Array:
    """Return F at a start under constant body rate and specific force, by central differences of `navigate`."""
    count = round(SPAN * RATE_HZ)
    imu = ImuData(
        np.arange(count + 1) / RATE_HZ, np.tile(rate / RATE_HZ, (count, 1)), np.tile(force / RATE_HZ, (count, 1))
    )
    out = np.zeros((ALL.size, ALL.size))
    middle = navigate(imu, start, gravity=gravity, ellipsoid=ellipsoid)
    true = NavState(*(getattr(middle, name) for name in NavState.__dataclass_fields__))
    # x(t) − x(0) is t times a polynomial; its constant term is F x(0)
    powers = imu.time[1:, None] ** np.arange(1, 10)
    for name, where in ALL.slices.items():
        for column in range(where.start, where.stop):
            x = np.zeros(ALL.size)
            x[column] = STEPS[name]
            solutions = []
            for sign in (1.0, -1.0):
                state, wrong = perturbed(start, imu, sign * x, ellipsoid)
                solutions.append(navigate(wrong, state, gravity=gravity, ellipsoid=ellipsoid))
            plus, minus = solutions
            errors = [navigation_error(true, s, ELLIPSOIDS[ellipsoid]) for s in (plus, minus)]
            grown = [np.hstack([e.position_ned, e.velocity_ned, e.attitude]) for e in errors]
            history = (grown[0] - grown[1]) / (2.0 * STEPS[name])
            out[:9, column] = np.linalg.lstsq(powers, history[1:] - history[0], rcond=None)[0][0]
    return out


@pytest.mark.parametrize(
    ("gravity", "ellipsoid", "seed"),
    [("normal", "wgs84", 0), ("normal", "wgs84", 1), ("normal", "krasovsky-1940", 2), ("j2", "wgs84", 3),
     ("somigliana", "wgs84", 4)],
)  # fmt: skip
def test_f_is_the_engines(gravity: str, ellipsoid: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = rotation.normalize(rng.standard_normal(4))
    start = NavState(
        np.asarray(rng.uniform(-1.2, 1.2)),
        np.asarray(rng.uniform(-3.0, 3.0)),
        np.asarray(rng.uniform(0.0, 12000.0)),
        rng.uniform(-200.0, 200.0, 3),
        q,
    )
    rate, force = rng.uniform(-0.1, 0.1, 3), rng.uniform(-15.0, 15.0, 3)
    found = engine_f(start, rate, force, gravity, ellipsoid)
    c_nb = rotation.dcm_from_quaternion(q)
    motion = NominalMotion(
        start.latitude[None], start.height[None], start.velocity_ned[None], c_nb[None], (c_nb @ force)[None],
        rate[None], force[None],
    )  # fmt: skip
    f = dynamics(ALL, motion, gravity, ELLIPSOIDS[ellipsoid])[0]
    for row in ("position", "velocity", "attitude"):
        for column, where in ALL.slices.items():
            block, reference = f[ALL.slices[row], where], found[ALL.slices[row], where]
            if block.any():
                assert np.abs(reference - block).max() < 1e-6 * np.abs(block).max(), (row, column)
            else:  # of the largest effect that this column has
                assert np.abs(reference).max() < 1e-5 * np.abs(f[:9, where]).max(), (row, column)


def test_every_kind_of_gravity_has_its_own_gradient() -> None:
    state = (np.array([0.8]), np.array([9000.0]), np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 3)))
    motion = NominalMotion(*state, rate_b=np.zeros((1, 3)), force_b=np.zeros((1, 3)))
    gradients = {name: dynamics(ALL, motion, name, ELLIPSOIDS["wgs84"])[0, 5, 2] for name in earth.GRAVITY_MODELS}
    # −2g/a of the chapter's simplest series exactly; all others differ from it by some of e² and h/a
    assert gradients["order-1e-2"] == pytest.approx(-(-2.0 * 9.7803253359 / 6378137.0), rel=1e-9)
    values = sorted(gradients.values())
    assert values[-1] / values[0] < 1.01
    assert len({f"{value:.9e}" for value in values}) > 4


MODEL = ErrorModel(
    (
        *(Block(name, 1.0) for name in ("position", "velocity", "attitude")),
        Block("gyro bias", 1e-7, random_walk=1e-10),
        Block("gyro instability", 1e-7, correlation_time=30.0),
        Block("accelerometer bias", 1e-3),
        Block("baro-height bias", 10.0, correlation_time=0.5),
        Block("gravity disturbance", (1e-4, 2e-4, 3e-4), correlation_distance=2000.0),
    ),
    gyro_noise=1e-6,
    accel_noise=1e-4,
)


def flight(count: int) -> NominalMotion:
    rng = np.random.default_rng(9)
    q = rotation.normalize(rng.standard_normal((count, 4)))
    c_nb, force = rotation.dcm_from_quaternion(q), rng.uniform(-30.0, 30.0, (count, 3))
    velocity = rng.uniform(-300.0, 300.0, (count, 3))
    return NominalMotion(
        rng.uniform(-1.2, 1.2, count), rng.uniform(0.0, 12000.0, count), velocity, c_nb,
        np.einsum("kij,kj->ki", c_nb, force), rng.uniform(-1.0, 1.0, (count, 3)), force,
    )  # fmt: skip


def van_loan(f: Array, density: Array, interval: float) -> tuple[Array, Array]:
    """Return Φ and Q from one matrix exponential; an interval that would overflow it is halved."""
    if interval > 0.5:
        phi, q = van_loan(f, density, 0.5 * interval)
        return phi @ phi, q + phi @ q @ phi.T
    n = len(f)
    both = expm(np.block([[-f, np.diag(density)], [np.zeros((n, n)), f.T]]) * interval)
    phi = both[n:, n:].T
    return phi, phi @ both[:n, n:]


def test_phi_and_q_are_van_loans() -> None:
    interval = np.array([1e-3, 0.01, 0.1, 0.3, 1.0, 3.0, 10.0])
    motion = flight(len(interval))
    f = dynamics(MODEL, motion, "normal", ELLIPSOIDS["wgs84"])
    density = noise_at_speed(MODEL, driving_noise(MODEL), motion.velocity)
    for one_by_one in (True, False):
        if one_by_one:
            parts = [transition(f[k : k + 1], density[k], interval[k : k + 1]) for k in range(len(interval))]
            phi, q = np.concatenate([p for p, _ in parts]), np.concatenate([q for _, q in parts])
        else:
            phi, q = transition(f, density, interval)
        for k, t in enumerate(interval):
            phi_k, q_k = van_loan(f[k], density[k], t)
            scale = np.sqrt(np.maximum(q_k.diagonal(), 0.0))  # of a constant, rounding
            assert np.abs(phi[k] - phi_k).max() < 1e-6 * np.abs(f[k] * t).max()
            for rows in MODEL.slices.values():
                for columns in MODEL.slices.values():
                    expected = phi_k[rows, columns] - np.eye(MODEL.size)[rows, columns]
                    found = phi[k][rows, columns] - np.eye(MODEL.size)[rows, columns]
                    assert np.abs(found - expected).max() <= 2e-6 * np.abs(expected).max() + 1e-13  # rounding of expm
            scaled = np.abs(q[k] - q_k) / np.maximum(np.outer(scale, scale), 1e-300)
            assert scaled[np.outer(scale > 1e-15, scale > 1e-15)].max() < 2e-6
            assert np.abs(q[k] - q[k].T).max() <= 1e-15 * q[k].max()


def test_white_noise_is_a_random_walk_of_angle_and_velocity() -> None:
    """N²T of a density N, alike in all axes; within a millisecond the rest of the dynamics adds 1e-6 of it."""
    f = dynamics(MODEL, flight(1), "normal", ELLIPSOIDS["wgs84"])
    _, q = transition(f, driving_noise(MODEL), np.array([1e-3]))
    for name, density in (("attitude", 1e-6), ("velocity", 1e-4)):
        where = MODEL.slices[name]
        np.testing.assert_allclose(q[0][where, where].diagonal(), density**2 * 1e-3, rtol=1e-5)


def test_a_stationary_process_stays_stationary() -> None:
    motion = flight(1)
    f = dynamics(MODEL, motion, "normal", ELLIPSOIDS["wgs84"])
    where = MODEL.slices["baro-height bias"]
    for interval in (0.01, 0.7, 20.0):
        phi, q = transition(f, driving_noise(MODEL), np.array([interval]))
        assert phi[0][where, where].item() == pytest.approx(math.exp(-interval / 0.5), rel=1e-6, abs=0.0)
        assert phi[0][where, where].item() ** 2 * 100.0 + q[0][where, where].item() == pytest.approx(100.0, rel=1e-6)


def test_gravity_over_the_distance_is_stationary_at_any_speed() -> None:
    """Over 700 m of a D of 2 km, at 7, 70 and 280 m/s, up and down, the correlation is exp(−0.35) and σ stays."""
    speed = np.array([7.0, 70.0, 280.0])
    velocity = np.column_stack([0.6 * speed, -0.8 * speed, [300.0, -40.0, 0.0]])
    motion = NominalMotion(**{**vars(flight(3)), "velocity": velocity})
    f = dynamics(MODEL, motion, "normal", ELLIPSOIDS["wgs84"])
    where = MODEL.slices["gravity disturbance"]
    phi, q = transition(f, noise_at_speed(MODEL, driving_noise(MODEL), velocity), 700.0 / speed)
    for k in range(3):
        kept, fresh = phi[k][where, where].diagonal(), q[k][where, where].diagonal()
        np.testing.assert_allclose(kept, math.exp(-0.35), rtol=1e-6)
        np.testing.assert_allclose(kept**2 * np.array([1e-8, 4e-8, 9e-8]) + fresh, [1e-8, 4e-8, 9e-8], rtol=1e-6)
    assert not MODEL.fed_back[where].any()
    with pytest.raises(InputError, match="give correlation_time or correlation_distance, not both"):
        Block("gravity disturbance", 1.0, correlation_time=1.0, correlation_distance=1.0)
    with pytest.raises(InputError, match=r"correlation_distance = 0\.0 m must be positive"):
        Block("gravity disturbance", 1.0, correlation_distance=0.0)
    with pytest.raises(InputError, match="random_walk belongs to a process without either"):
        Block("gravity disturbance", 1.0, 1.0, correlation_distance=1.0)
