"""One error at a time through sensors and engine, against closed forms and the linear error equations.

The single-axis closed forms (8.12)…(8.15) are exact for small errors on a sphere that does not turn; there they are
compared as they stand. On the real Earth Schuler, 24-hour and Foucault oscillations mix, and the reference is the
linear error equations of `tests.oracles.error_equations`, solved apart from the package. What is left between the
two is of second order in the errors: a tilt or heading error φ of 1e-4…1e-3 rad changes the rest by its own size.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from sinssim import rotation
from sinssim.data import ImuData, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS, Ellipsoid
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.oracles import error_equations
from tests.oracles.error_equations import Nominal, Sources

SCHULER = 5064.0  # s, 84.4 min
RATE_HZ = 10.0
UG = 9.80665e-6
DEG_H = 4.84813681109536e-6
ARCMIN = 2.908882086657216e-4


@lru_cache(maxsize=4)
def increments_and_truth(trajectory: Parked | GreatCircle, rate_hz: float) -> tuple[ImuData, NavState]:
    """Return ideal increments and the true states at their edges."""
    ideal = trajectory.increments(rate_hz)
    return ideal, trajectory.state(ideal.time)


def simulate(
    trajectory: Parked | GreatCircle,
    errors: ImuErrors,
    start: np.ndarray | None = None,
    *,
    algorithm: str = "quaternion",
    vertical: str = "truth",
    rate_hz: float = RATE_HZ,
) -> NavError:
    """Return the errors of a navigator fed with the trajectory's increments and the given errors."""
    start = np.zeros(9) if start is None else start
    ideal, truth = increments_and_truth(trajectory, rate_hz)
    first = trajectory.state(0.0)
    r1, r2 = (
        float(r) + float(first.height) for r in error_equations.radii(error_equations.Earth(), float(first.latitude))
    )
    initial = NavState(
        first.latitude + start[6] / r1,
        first.longitude + start[7] / (r2 * np.cos(first.latitude)),
        first.height + start[8],
        first.velocity_ned + start[3:6],
        rotation.multiply(rotation.quaternion_from_rotation_vector(-start[:3]), first.q_nb),
    )
    solution = navigate(
        emulate(ideal, errors),
        initial,
        algorithm=algorithm,
        gravity=trajectory.gravity,
        ellipsoid=trajectory.ellipsoid.name,
        vertical=vertical,
        height=None if vertical == "free" else truth.height,
    )
    return navigation_error(truth, solution, trajectory.ellipsoid)


def nominal_of(trajectory: Parked | GreatCircle) -> Callable[[float], Nominal]:
    """Return the true motion in the form that the error equations take."""

    def nominal(t: float) -> Nominal:
        state = trajectory.state(t)
        rate, force = trajectory.rates(t)
        c_nb = rotation.dcm_from_quaternion(state.q_nb)
        return Nominal(float(state.latitude), float(state.height), state.velocity_ned, c_nb, rate, force)

    if isinstance(trajectory, Parked):
        always = nominal(0.0)
        return lambda t: always
    return _along(trajectory)


@lru_cache(maxsize=4)
def _along(flight: GreatCircle) -> Callable[[float], Nominal]:
    """Return the motion of a smooth flight from a spline, 20 times as fast: 5 s are 1e-3 of Schuler's period."""
    time = np.linspace(flight.start, flight.end, round((flight.end - flight.start) / 5.0) + 1)
    state, (rate, force) = flight.state(time), flight.rates(time)
    columns = (state.latitude, state.height, *state.velocity_ned.T, *rate.T, *force.T)
    c_nb = rotation.dcm_from_quaternion(state.q_nb).reshape(-1, 9)
    spline = CubicSpline(time, np.column_stack([*columns, c_nb]))

    def nominal(t: float) -> Nominal:
        row = spline(t)
        return Nominal(row[0], row[1], row[2:5], row[11:].reshape(3, 3), row[5:8], row[8:11])

    return nominal


def mismatch(given: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest distance between two histories of a vector over the largest length of the expected one."""
    distance = np.linalg.norm(given - expected, axis=1).max()
    return float(distance / np.linalg.norm(expected, axis=1).max())


def compare(
    trajectory: Parked | GreatCircle,
    errors: ImuErrors,
    sources: Sources,
    tolerance: float,
    vertical: str = "truth",
    rate_hz: float = RATE_HZ,
) -> NavError:
    """Check position, velocity and attitude errors of engine and linear equations against each other."""
    error = simulate(trajectory, errors, sources.start, vertical=vertical, rate_hz=rate_hz)
    every = round(60 * rate_hz)
    time = error.time[::every]
    position, velocity, attitude = error_equations.solve(
        nominal_of(trajectory), time, sources, height_held=vertical == "truth"
    )
    columns = slice(0, 3 if vertical == "free" else 2)
    assert mismatch(error.position_ned[::every, columns], position[:, columns]) < tolerance
    assert mismatch(error.velocity_ned[::every, columns], velocity[:, columns]) < tolerance
    assert mismatch(error.attitude[::every], attitude) < tolerance
    return error


# name: (what is wrong, in north-east-down axes)
NED_SOURCES: dict[str, dict[str, tuple[float, float, float]]] = {
    "accelerometer north": {"accel": (50 * UG, 0, 0)},
    "accelerometer east": {"accel": (0, 50 * UG, 0)},
    "gyro north": {"gyro": (0.01 * DEG_H, 0, 0)},
    "gyro east": {"gyro": (0, 0.01 * DEG_H, 0)},
    "gyro down": {"gyro": (0, 0, 0.01 * DEG_H)},
    "tilt about north": {"attitude": (0.2 * ARCMIN, 0, 0)},
    "tilt about east": {"attitude": (0, 0.2 * ARCMIN, 0)},
    "azimuth": {"attitude": (0, 0, 4 * ARCMIN)},
    "velocity north": {"velocity": (0.1, 0, 0)},
    "velocity east": {"velocity": (0, 0.1, 0)},
}


def of_source(name: str, c_nb: np.ndarray) -> tuple[ImuErrors, Sources]:
    """Return one source as instrument errors in the body's axes, and in the form of the error equations."""
    source = {key: np.array(value, dtype=float) for key, value in NED_SOURCES[name].items()}
    none = np.zeros(3)
    gyro, accel = c_nb.T @ source.get("gyro", none), c_nb.T @ source.get("accel", none)
    start = np.concatenate([source.get("attitude", none), source.get("velocity", none), none])
    return (
        ImuErrors(TriadErrors(bias=gyro), TriadErrors(bias=accel)),
        Sources(gyro_bias=gyro, accel_bias=accel, start=start),
    )


@pytest.fixture(scope="module")
def parked() -> Parked:
    attitude = rotation.quaternion_from_euler(*np.radians([-3.0, 2.0, 30.0]))
    return Parked(np.radians(50.0), np.radians(10.0), 100.0, attitude, 1.5 * SCHULER)


@pytest.fixture(scope="module")
def flight() -> GreatCircle:
    return GreatCircle(np.radians(50.0), np.radians(10.0), 9000.0, np.radians(60.0), 230.0, SCHULER)


@pytest.fixture(scope="module")
def short_flight() -> GreatCircle:
    return GreatCircle(np.radians(50.0), np.radians(10.0), 9000.0, np.radians(60.0), 230.0, 0.25 * SCHULER)


@pytest.mark.parametrize("name", NED_SOURCES)
def test_single_source_parked(parked, name):
    c_nb = rotation.dcm_from_quaternion(parked.state(0.0).q_nb)
    compare(parked, *of_source(name, c_nb), tolerance=0.001)


@pytest.mark.parametrize("name", NED_SOURCES)
def test_single_source_in_level_flight(flight, name):
    c_nb = rotation.dcm_from_quaternion(flight.state(0.0).q_nb)
    compare(flight, *of_source(name, c_nb), tolerance=0.001)


@pytest.mark.parametrize("name", ["accelerometer north", "gyro east", "azimuth"])
def test_single_source_with_a_free_vertical(name):
    # Half an hour: later the height error, tens of kilometres, is itself no longer small.
    trajectory = Parked(np.radians(50.0), 0.0, 100.0, np.array([1.0, 0, 0, 0]), 1800.0)
    compare(trajectory, *of_source(name, np.eye(3)), tolerance=0.002, vertical="free")


@pytest.mark.parametrize("triad", ["gyro", "accel"])
@pytest.mark.parametrize("term", ["scale", "misalignment"])
def test_scale_factor_and_misalignment_in_level_flight(short_flight, triad, term):
    matrix = np.zeros((3, 3))
    if term == "scale":
        error = TriadErrors(scale=np.array([100e-6, -200e-6, 150e-6]))
        matrix[np.diag_indices(3)] = error.scale
    else:
        matrix = np.array([[0, 1.0, -2.0], [3.0, 0, 1.5], [-0.5, 2.5, 0]]) * 2e-5
        error = TriadErrors(misalignment=matrix)
    clean = TriadErrors()
    # 50 Hz: with the height held, what the down accelerometer gets wrong lives for one interval, and acts through
    # Coriolis for that long; at 10 Hz this is 0.2 % of what the other two cause (1 cm), and falls with the interval.
    if triad == "gyro":
        compare(short_flight, ImuErrors(error, clean), Sources(gyro_matrix=matrix), tolerance=0.001, rate_hz=50.0)
    else:
        compare(short_flight, ImuErrors(clean, error), Sources(accel_matrix=matrix), tolerance=0.001, rate_hz=50.0)


def test_laser_standard_all_errors_at_once_add_up(flight):
    errors = draw(Imu(grade="laser-standard", gyro_arw_deg_sqrt_h=0.0, accel_vrw_ug_sqrt_hz=0.0), seed=7)
    eye = np.eye(3)
    sources = Sources(
        errors.gyro.bias,
        errors.accel.bias,
        (eye + np.diag(errors.gyro.scale)) @ (eye + errors.gyro.misalignment) - eye,
        (eye + np.diag(errors.accel.scale)) @ (eye + errors.accel.misalignment) - eye,
    )
    error = compare(flight, errors, sources, tolerance=0.001)
    assert error.horizontal.max() > 500.0  # there is something to compare


# Closed forms on a sphere that does not turn

SPHERE_RADIUS = 6371000.0
SPHERE_RATE = np.sqrt(3.986004418e14 / SPHERE_RADIUS**3)  # ω_s = √(g/R), 1/s


# A flattening of 1e-9 is 6 mm: the ellipsoid's formulas divide by its eccentricity.
SPHERE = Ellipsoid("sphere", SPHERE_RADIUS, 1e-9, 3.986004418e14, omega=0.0)


@pytest.fixture(scope="module")
def resting() -> Parked:
    return Parked(np.radians(5.0), 0.0, 0.0, np.array([1.0, 0, 0, 0]), 8000.0, ellipsoid=SPHERE)


@pytest.fixture
def at_rest_on_a_sphere(monkeypatch, resting) -> Parked:
    monkeypatch.setitem(ELLIPSOIDS, SPHERE.name, SPHERE)
    return resting


@pytest.mark.parametrize("axis", [0, 1], ids=["north", "east"])
@pytest.mark.parametrize("algorithm", ["quaternion", "poisson", "euler"])
def test_constant_accelerometer_error(at_rest_on_a_sphere, axis, algorithm):
    bias = 50 * UG * np.eye(3)[axis]
    error = simulate(at_rest_on_a_sphere, ImuErrors(accel=TriadErrors(bias=bias)), algorithm=algorithm)
    gravity = SPHERE_RATE**2 * SPHERE_RADIUS
    y = (50 * UG / gravity) * (1 - np.cos(SPHERE_RATE * error.time))  # (8.13)
    travelled = error.position_ned / SPHERE_RADIUS
    assert np.max(np.abs(travelled[:, axis] - y)) < 1e-6 * np.max(y)
    assert np.max(np.abs(travelled[:, 1 - axis])) < 1e-6 * np.max(y)
    assert np.max(travelled[:, axis]) == pytest.approx(2 * 50e-6 * 9.80665 / gravity, rel=1e-6)


@pytest.mark.parametrize("axis", [0, 1], ids=["north", "east"])
@pytest.mark.parametrize("algorithm", ["quaternion", "poisson", "euler"])
def test_constant_gyro_error(at_rest_on_a_sphere, axis, algorithm):
    # A gyro that feels a turn towards the east (about north, right wing down) moves the solution east; one that
    # feels a turn about east (nose up) moves it south.
    drift = 0.01 * DEG_H
    error = simulate(
        at_rest_on_a_sphere, ImuErrors(gyro=TriadErrors(bias=drift * np.eye(3)[axis])), algorithm=algorithm
    )
    y = drift * (error.time - np.sin(SPHERE_RATE * error.time) / SPHERE_RATE)  # (8.15)
    travelled = error.position_ned / SPHERE_RADIUS
    sign = (1.0, -1.0)[axis]
    assert np.max(np.abs(travelled[:, 1 - axis] - sign * y)) < 1e-6 * np.max(y)
    assert np.max(np.abs(travelled[:, axis])) < 1e-6 * np.max(y)


@pytest.mark.parametrize("axis", [0, 1], ids=["north", "east"])
def test_initial_tilt_drives_the_same_pendulum(at_rest_on_a_sphere, axis):
    # (8.14) with a constant Δα: Δy = Δα (1 − cos ω_s t), and ω_s⁻¹ sin ω_s t for a velocity error at the start.
    tilt = 0.2 * ARCMIN
    start = np.zeros(9)
    start[axis] = tilt
    error = simulate(at_rest_on_a_sphere, ImuErrors(), start)
    y = tilt * (1 - np.cos(SPHERE_RATE * error.time))
    sign = (-1.0, 1.0)[axis]
    assert np.max(np.abs(error.position_ned[:, 1 - axis] / SPHERE_RADIUS - sign * y)) < 1e-6 * np.max(y)


@pytest.mark.parametrize("axis", [0, 1], ids=["north", "east"])
def test_initial_velocity_error(at_rest_on_a_sphere, axis):
    start = np.zeros(9)
    start[3 + axis] = 0.1
    error = simulate(at_rest_on_a_sphere, ImuErrors(), start)
    expected = 0.1 * np.sin(SPHERE_RATE * error.time) / SPHERE_RATE
    assert np.max(np.abs(error.position_ned[:, axis] - expected)) < 1e-6 * np.max(expected)


# The Schuler period and the class of the grade, on the real Earth


def fitted_period(error: NavError, latitude: float) -> float:
    """Return the Schuler period [s] that fits the horizontal velocity error best.

    In axes that turn with Foucault's pendulum (clockwise from above in the north, at ω_ie sin φ) the oscillation is
    a plain one; what else the velocity does (the 24-hour part, the drifts) is a slow polynomial.
    """
    time = error.time[::100]
    foucault = 7.292115e-5 * np.sin(latitude)
    velocity = (error.velocity_ned[::100, 0] + 1j * error.velocity_ned[::100, 1]) * np.exp(-1j * foucault * time)
    x = time / time[-1]

    def residual(period: float) -> float:
        phase = 2 * np.pi * time / period
        columns = np.stack([np.cos(phase), np.sin(phase), *(x**n for n in range(4))], axis=1)
        rest = velocity - columns @ np.linalg.lstsq(columns.astype(complex), velocity, rcond=None)[0]
        return float(np.sum(np.abs(rest) ** 2))

    return float(minimize_scalar(residual, bounds=(4000.0, 6200.0), method="bounded", options={"xatol": 1e-3}).x)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_schuler_period_of_a_laser_standard_unit(seed):
    # The turn-on errors alone: random walks go on kicking the pendulum (0.35 m/s in one period, as much as the
    # biases do), and a period read off a few such swings is off by up to a tenth.
    latitude = np.radians(50.0)
    trajectory = Parked(latitude, 0.0, 0.0, np.array([1.0, 0, 0, 0]), 2 * SCHULER)
    section = Imu(grade="laser-standard", gyro_arw_deg_sqrt_h=0.0, accel_vrw_ug_sqrt_hz=0.0)
    error = simulate(trajectory, draw(section, seed))
    r1, r2 = error_equations.radii(error_equations.Earth(), latitude)
    gravity = error_equations.gravity_down(error_equations.Earth(), latitude, 0.0)
    schuler = 2 * np.pi * np.sqrt(np.sqrt(r1 * r2) / gravity)
    assert schuler / 60 == pytest.approx(84.4, abs=0.1)
    period = fitted_period(error, latitude)
    assert period == pytest.approx(schuler, rel=0.005)
    # Seen in Foucault's axes the pendulum is quicker by the square of their rate: 0.1 % more, which is there.
    foucault = 7.292115e-5 * np.sin(latitude)
    assert period == pytest.approx(2 * np.pi / np.hypot(2 * np.pi / schuler, foucault), rel=0.001)


def test_random_walks_swing_the_pendulum(at_rest_on_a_sphere):
    # Every kick of the gyro's white noise starts an oscillation of its own; summed over the kicks,
    # σ²(v) = gR N² ∫ sin²(ω_s u) du, σ²(R y) = R² N² ∫ (1 − cos ω_s u)² du; of the accelerometer's N² ∫ cos² du
    # and (N/ω_s)² ∫ sin² du.
    w = SPHERE_RATE
    rate_hz, runs = 2.0, 30
    gyro_walk, accel_walk = 8.7e-7, 1e-3
    ideal, truth = increments_and_truth(at_rest_on_a_sphere, rate_hz)
    start = at_rest_on_a_sphere.state(0.0)
    instants = np.array([1200.0, 2532.0, 5064.0, 8000.0])
    rows = np.rint(instants * rate_hz).astype(int)
    t = ideal.time[rows]
    sin2, cos2 = t / 2 - np.sin(2 * w * t) / (4 * w), t / 2 + np.sin(2 * w * t) / (4 * w)
    swing2 = 1.5 * t - 2 * np.sin(w * t) / w + np.sin(2 * w * t) / (4 * w)
    cases = (
        (
            ImuErrors(gyro=TriadErrors(random_walk=gyro_walk)),
            (SPHERE_RADIUS * w * gyro_walk) ** 2 * sin2,
            (SPHERE_RADIUS * gyro_walk) ** 2 * swing2,
        ),
        (ImuErrors(accel=TriadErrors(random_walk=accel_walk)), accel_walk**2 * cos2, (accel_walk / w) ** 2 * sin2),
    )
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 2 * runs)
    for errors, velocity_variance, position_variance in cases:
        velocity, position = np.zeros(len(t)), np.zeros(len(t))
        for seed in range(runs):
            solution = navigate(
                emulate(ideal, errors, seed), start, ellipsoid="sphere", vertical="truth", height=truth.height
            )
            error = navigation_error(truth, solution, at_rest_on_a_sphere.ellipsoid)
            velocity += np.sum(error.velocity_ned[rows, :2] ** 2, axis=1)
            position += error.horizontal[rows] ** 2
        assert np.all((low < velocity / velocity_variance) & (velocity / velocity_variance < high))
        assert np.all((low < position / position_variance) & (position / position_variance < high))


def test_laser_standard_is_of_the_one_mile_an_hour_class():
    trajectory = Parked(np.radians(50.0), 0.0, 0.0, np.array([1.0, 0, 0, 0]), 3600.0)
    ideal, start = trajectory.increments(RATE_HZ), trajectory.state(0.0)
    truth = trajectory.state(ideal.time)
    misses = []
    for seed in range(15):
        measured = emulate(ideal, Imu(grade="laser-standard"), seed)
        solution = navigate(measured, start, vertical="truth", height=truth.height)
        misses.append(navigation_error(truth, solution).horizontal[-1] / 1852.0)
    assert 0.7 < np.median(misses) < 1.5
