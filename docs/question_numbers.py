"""Computes the numbers of docs/questions.md by running the program; `docs/questions.py` writes the page with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.experiments.studies.attitude_cost import count_attitude, matrix_costs
from sinssim.experiments.studies.step_cost import count_operations
from sinssim.sensors.error_propagation import Expectation, expect
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import READY, dilution, not_isolable
from sinssim.sensors.single_sensors import cube, position_error
from sinssim.strapdown import one_component_system
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import NavError, navigation_error
from sinssim.truth.motions.analytic import OnEarth
from sinssim.truth.motions.coning_and_rocking import classical_cone
from sinssim.truth.motions.mounted_block import Vibrating
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from sinssim.truth.motions.turntable import Dwell, RotationTable, Turn
from sinssim.truth.motions.vibration import Tone
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCMIN, ARCSEC, DEG, DEG_H, UG

LATITUDE = 50.0 * DEG
HEIGHT, SPEED, COURSE = 9000.0, 250.0, 60.0 * DEG
GYRO, ACCELEROMETER = 0.01 * DEG_H, 100.0 * UG  # of an airliner's system, and of figure 8.4
HOUR = 3600.0
LEVEL = (1.0, 0.0, 0.0, 0.0)


def errors(truth: Trajectory, imu: ImuData, **options: object) -> NavError:
    """Navigate from the exact initial state and return the errors."""
    solution = navigate(imu, truth.state(truth.start), **options)  # type: ignore[arg-type]
    return navigation_error(truth.state(solution.time), solution)


def table(*steps: Dwell | Turn, duration: float) -> OnEarth:
    """Return a rotation table at 50° of latitude."""
    return OnEarth(RotationTable(steps), LATITUDE, 0.0, 300.0, LEVEL, duration)


# --- 1 to 5: the platform, advantages, difficulties, variants, the usual scheme -----------------------------


class Roll(NamedTuple):
    """Ten full rolls at 300 °/s, with perfect sensors and with a gyro's scale factor error of 10 ppm."""

    seconds: float
    perfect_arcsec: float
    scaled_arcsec: float


@cache
def roll() -> Roll:
    """Return the attitude error after ten rolls; by theory, 10 ppm of 3600° is 129.6″."""
    duration = 15.0
    truth = table(Dwell(1.0), Turn((1.0, 0.0, 0.0), 3600.0 * DEG, 300.0 * DEG), Dwell(2.0), duration=duration)
    ideal = truth.increments(200.0)
    scaled = emulate(ideal, Imu(grade="ideal", gyro_scale_ppm=(10.0, 0.0, 0.0)))
    perfect, wrong = errors(truth, ideal), errors(truth, scaled)
    return Roll(duration, float(perfect.angle.max()) / ARCSEC, float(wrong.angle[-1]) / ARCSEC)


class Redundancy(NamedTuple):
    """Six gyros along the normals of a dodecahedron: noise of an axis, relative to one gyro, and isolation."""

    all_six: float
    four: float
    isolable_after: int


@cache
def redundancy() -> Redundancy:
    """Return the noise of an axis with six gyros and, at worst, with four, and the faults that can be isolated."""
    six = READY["dodecahedron"]
    left = {n: [np.delete(six, lost, axis=0) for lost in combinations(range(6), n)] for n in range(4)}
    isolable = next(n for n, sets in left.items() if any(not_isolable(directions) for directions in sets))
    four = max(dilution(directions) for directions in left[2])
    return Redundancy(float(np.sqrt(dilution(six) / 3.0)), float(np.sqrt(four / 3.0)), isolable)


class Exposure(NamedTuple):
    """What ten rolls at 300 °/s cost by a misalignment of 5″, strapdown, and by 10 ppm on a platform, arcsec."""

    misaligned_arcsec: float
    platform_arcsec: float


@cache
def exposure() -> Exposure:
    """Return the largest attitude error by the misalignment of one gyro, and the angle that a platform turns by."""
    duration = roll().seconds
    truth = table(Dwell(1.0), Turn((1.0, 0.0, 0.0), 3600.0 * DEG, 300.0 * DEG), Dwell(2.0), duration=duration)
    misaligned = Imu(grade="ideal", gyro_misalignment_arcsec=(0.0, 0.0, 5.0, 0.0, 0.0, 0.0))
    wrong = errors(truth, emulate(truth.increments(200.0), misaligned))
    return Exposure(float(wrong.angle.max()) / ARCSEC, 1e-5 * OMEGA_IE * duration / ARCSEC)


def azimuth_arcmin() -> float:
    """Return the error of the azimuth after alignment by a gyro of 0.01 °/h at 50°, b/(Ω cos B), arcmin."""
    return GYRO / (OMEGA_IE * float(np.cos(LATITUDE))) / ARCMIN


class Steps(NamedTuple):
    """Second-order steps on ten rolls at 100 Hz, arcsec, and what first-order ones lose of orthogonality."""

    matrix_arcsec: float
    quaternion_arcsec: float
    matrix_skew: float
    quaternion_skew: float


@cache
def steps() -> Steps:
    """Return errors of second-order steps of the matrix and the quaternion, and the angles between the axes of B."""
    duration = roll().seconds
    truth = table(Dwell(1.0), Turn((1.0, 0.0, 0.0), 3600.0 * DEG, 300.0 * DEG), Dwell(2.0), duration=duration)
    imu = truth.increments(100.0)
    both = ("poisson-2-ortho", "quaternion-2-norm")
    angles = [float(errors(truth, imu, algorithm=name).angle.max()) / ARCSEC for name in both]
    defect = float(np.abs(navigate(imu, truth.state(0.0), algorithm="poisson-1").defect).max())
    q = navigate(imu, truth.state(0.0), algorithm="quaternion-1").q_nb[-1] * 1.01  # of any norm
    c = rotation.dcm_from_quaternion(q / np.linalg.norm(q)) * np.linalg.norm(q) ** 2
    skew = c @ c.T - np.diag(np.diag(c @ c.T))
    return Steps(*angles, defect, float(np.abs(skew).max()))


class Matrices(NamedTuple):
    """Operations of B, and of the attitude alone with B, by algorithm."""

    by_products: float
    by_functions: float
    quaternion: float
    poisson: float
    euler: float


@cache
def matrices() -> Matrices:
    """Return the operations of B from a quaternion and from angles, and of three algorithms with B."""
    alone = [count_attitude(name)[0].total for name in ("quaternion", "poisson", "euler")]
    by_products, by_functions = matrix_costs()
    return Matrices(by_products.operations.total, by_functions.operations.total, *alone)


class Loop(NamedTuple):
    """A full turn in pitch, at 100 Hz."""

    quaternion_arcsec: float
    euler_arcsec: float


@cache
def loop() -> Loop:
    """Return the attitude errors of two algorithms over a full turn in pitch, which passes ±90°."""
    truth = table(Dwell(1.0), Turn((0.0, 1.0, 0.0), 360.0 * DEG, 30.0 * DEG), Dwell(1.0), duration=14.0)
    imu = truth.increments(100.0)
    angles = [float(errors(truth, imu, algorithm=name).angle.max()) / ARCSEC for name in ("quaternion", "euler")]
    return Loop(*angles)


@cache
def coning(rate_hz: float, algorithm: str = "quaternion-1") -> float:
    """Return the attitude error after a minute on a cone of 1° at 1 Hz, arcsec."""
    truth = OnEarth(classical_cone(1.0 * DEG, 2.0 * np.pi), LATITUDE, 0.0, 300.0, LEVEL, 60.0)
    return float(errors(truth, truth.increments(rate_hz), algorithm=algorithm).angle[-1]) / ARCSEC


def variants(seconds: Sequence[float]) -> dict[str, Array]:
    """Return the position errors of the three sensor sets at rest, m, by name and time.

    The set without gyros has 1 µg in every accelerometer and arms of 1 m, 1σ; the one with gyros a bias of 0.01 °/h;
    the attitude sensor is off by 10″.
    """
    times = np.asarray(seconds)
    grid = np.arange(0.0, times.max() + 0.5)
    rows = np.searchsorted(grid, times)
    still, weight = np.zeros(len(grid) - 1), one_component_system.GRAVITY * np.ones(len(grid) - 1)
    force = np.stack([still, weight], axis=1)
    drifting = one_component_system.simulate(grid, still - GYRO, force)
    tilted = one_component_system.simulate(grid, still, force, pitch=-10.0 * ARCSEC)
    return {
        "accelerometers": position_error(times, cube(1.0), UG)[:, 0],
        "gyros": one_component_system.RADIUS * drifting.coordinate[rows],
        "attitude": one_component_system.RADIUS * tilted.coordinate[rows],
    }


@cache
def airliner() -> Expectation:
    """Return the position errors of an airliner's sensors after an hour."""
    return expect(Imu(grade="laser-standard"), LATITUDE, HOUR)


# --- 6 and 7: one component ---------------------------------------------------------------------------------


class OneComponent(NamedTuple):
    """Errors of the one-component system at rest, over four hours: simulation, and its distance from theory."""

    period_min: float
    largest_arcmin: float
    after_period_arcmin: float
    hourly_nmi: float
    apart: float


def _one_component(by_accelerometer: bool) -> tuple[Array, Array, Array]:
    time = np.arange(0.0, 4.0 * HOUR + 0.5)
    still, weight = np.zeros(len(time) - 1), one_component_system.GRAVITY * np.ones(len(time) - 1)
    if by_accelerometer:
        run = one_component_system.simulate(time, still, np.stack([still + ACCELEROMETER, weight], axis=1))
        return time, run.coordinate, one_component_system.accelerometer_error(time, ACCELEROMETER)
    run = one_component_system.simulate(time, still - GYRO, np.stack([still, weight], axis=1))
    return time, run.coordinate, one_component_system.gyro_error(time, GYRO)


@cache
def pendulum(by_accelerometer: bool) -> OneComponent:
    """Return the errors by one instrument, simulated, and how far the simulation is from (8.13) or (8.15)."""
    time, simulated, closed = _one_component(by_accelerometer)
    period = 2.0 * np.pi / one_component_system.schuler_rate()
    slope = (
        float(np.polyfit(time, simulated, 1)[0])
        if by_accelerometer
        else float(np.interp(2.0 * period, time, simulated) / (2.0 * period))
    )
    return OneComponent(
        period / 60.0,
        float(np.abs(simulated).max()) / ARCMIN,
        float(np.interp(period, time, simulated)) / ARCMIN,
        slope * HOUR / ARCMIN,
        float(np.abs(simulated - closed).max() / np.abs(closed).max()),
    )


# --- 8 to 10: specific force, the matrix, its rates ---------------------------------------------------------


def flight(duration: float = 1800.0) -> GreatCircle:
    """Return half an hour of an airliner's cruise."""
    return GreatCircle(LATITUDE, 0.0, HEIGHT, COURSE, SPEED, duration)


class Force(NamedTuple):
    """Parts of the specific force, m/s², and what simplified gravity costs in half an hour, m."""

    gravity: float
    coriolis: float
    transport: float
    order_5_m: float
    order_4_m: float


@cache
def force() -> Force:
    """Return the parts of the specific force of the cruise, and errors of simplified gravity."""
    truth = flight()
    state = truth.state(0.0)
    rate, transport = navigation_rates(state)
    imu = truth.increments(10.0)
    lost = [
        float(errors(truth, imu, gravity=model, vertical="truth", height=truth.state(imu.time).height).horizontal.max())
        for model in ("order-1e-5", "order-1e-4")
    ]
    return Force(
        float(earth.gravity_ned(LATITUDE, HEIGHT)[2]),
        float(np.linalg.norm(np.cross(2.0 * rate, state.velocity_ned))),
        float(np.linalg.norm(np.cross(transport, state.velocity_ned))),
        *lost,
    )


def navigation_rates(state: NavState) -> tuple[Array, Array]:
    """Return the Earth's rate and the transport rate in north-east-down axes, (3,) rad/s each."""
    b, v = float(state.latitude), np.asarray(state.velocity_ned)
    north, east = (float(radius) + float(state.height) for radius in earth.radii(b))
    of_earth = OMEGA_IE * np.array([np.cos(b), 0.0, -np.sin(b)])
    return of_earth, np.array([v[1] / east, -v[0] / north, -v[1] * np.tan(b) / east])


@cache
def tilted_nmi() -> float:
    """Return the largest position error of a parked vehicle whose initial matrix is tilted by 1′, nmi."""
    truth = Parked(LATITUDE, 0.0, 300.0, LEVEL, 5100.0)
    imu, start = truth.increments(10.0), truth.state(0.0)
    tilt = rotation.quaternion_from_euler(0.0, ARCMIN, 0.0)
    wrong = replace(start, q_nb=rotation.multiply(tilt, start.q_nb))
    solution = navigate(imu, wrong, vertical="truth", height=np.full(len(imu.time), 300.0))
    return float(navigation_error(truth.state(solution.time), solution).horizontal.max()) / 1852.0


@cache
def northward() -> tuple[float, float]:
    """Return the gyros' rate about the right axis of a flight to the north at 1100 km/h, and the Earth's, °/h."""
    truth = GreatCircle(LATITUDE, 0.0, HEIGHT, 0.0, 1100.0 / 3.6, 60.0)
    return -float(truth.rates(0.0)[0][1]) / DEG_H, OMEGA_IE / DEG_H


# --- 11 to 14: algorithms, angles, rates --------------------------------------------------------------------


class Way(NamedTuple):
    """One way to the matrix on a minute of coning at 100 Hz."""

    error_arcsec: float
    operations: float
    defect: float


@cache
def way(algorithm: str) -> Way:
    """Return accuracy, operations of a sample, and loss of norm or orthogonality of one algorithm."""
    truth = OnEarth(classical_cone(1.0 * DEG, 2.0 * np.pi), LATITUDE, 0.0, 300.0, LEVEL, 60.0)
    imu = truth.increments(100.0)
    solution = navigate(imu, truth.state(0.0), algorithm=algorithm)
    angle = navigation_error(truth.state(solution.time), solution).angle
    defect = float(np.abs(solution.defect).max())
    return Way(float(angle.max()) / ARCSEC, count_operations(algorithm, "level").total, defect)


class AnglesBack(NamedTuple):
    """Errors of the angles from the matrix (8.17), rad."""

    ordinary: float
    steep: float


@cache
def angles_back() -> AnglesBack:
    """Return the error of the angles over 10 000 attitudes, and of the pitch within 1″ of the vertical."""
    rng = np.random.default_rng(1)
    roll_, heading = rng.uniform(-np.pi, np.pi, (2, 10_000))

    def worst(pitch: Array, which: slice) -> float:
        q = rotation.quaternion_from_euler(roll_, pitch, heading)
        c = rotation.dcm_from_quaternion(q)
        found = np.stack(
            [
                np.arctan2(c[:, 2, 1], c[:, 2, 2]),  # (8.17) in forward-right-down axes
                np.arcsin(np.clip(-c[:, 2, 0], -1.0, 1.0)),
                np.arctan2(c[:, 1, 0], c[:, 0, 0]),
            ]
        )
        gap = found - np.stack([roll_, pitch, heading])
        return float(np.abs((gap + np.pi) % (2.0 * np.pi) - np.pi)[which].max())

    ordinary = worst(rng.uniform(-1.4, 1.4, 10_000), slice(0, 3))
    return AnglesBack(ordinary, worst(0.5 * np.pi - rng.uniform(0.5, 1.0, 10_000) * ARCSEC, slice(1, 2)))


@cache
def _rolling_cruise() -> tuple[Trajectory, ImuData, Array]:
    """Return three minutes of a rolling and heaving cruise, its increments at 200 Hz and its height."""
    tones = [
        Tone("roll", 5.0 * DEG, 0.2),
        Tone("pitch", 1.0 * DEG, 0.5, 1.0),
        Tone("down", 1.0, 0.5),
        Tone("right", 0.5, 0.2, 0.5),
    ]
    truth = Vibrating(flight(180.0), tones)
    imu = truth.increments(200.0)
    return truth, imu, truth.state(imu.time).height


@cache
def levels(rates_hz: tuple[float, float, float]) -> tuple[float, float]:
    """Return the largest position, m, and attitude error, arcsec, of a rolling, heaving cruise at three rates."""
    truth, imu, height = _rolling_cruise()
    error = errors(truth, imu, algorithm="two-quaternions", rates_hz=rates_hz, vertical="truth", height=height)
    return float(error.horizontal.max()), float(error.angle.max()) / ARCSEC
