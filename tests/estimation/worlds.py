"""Flights and readings for tests of the filter; the readings are made here, apart from the package's own emulators."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sinssim import rotation
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import ErrorModel, Estimate, Smoothed, state_errors
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth import Trajectory
from sinssim.truth.curve import Curve
from tests.oracles import integrator as oracle
from tests.truth.motions import synthetic_flight

DEG = np.pi / 180.0
DEG_H = DEG / 3600.0
UG = 9.80665e-6


@lru_cache(maxsize=4)
def weaving(duration: float, rate_hz: float) -> tuple[Curve, ImuData]:
    """Return a flight of many turns, climbs and descents, and its increments from time 0 on."""
    knots = np.arange(round(duration * 10.0) + 31) / 10.0
    flight = Curve(knots, *synthetic_flight(knots))
    ideal = flight.increments(rate_hz)
    first = round(-float(ideal.time[0]) * rate_hz)
    last = first + round(duration * rate_hz)
    return flight, ImuData(ideal.time[first : last + 1], ideal.dtheta[first:last], ideal.dvel[first:last])


def biases_only(grade: str) -> ImuErrors:
    """Return the standard deviations of a grade's biases and noise, and of nothing else."""
    sigma = expected_errors(Imu(grade=grade)).sigma
    gyro, accel = (
        TriadErrors(
            bias=t.bias,
            random_walk=t.random_walk,
            instability=t.instability,
            correlation_time=t.correlation_time,
        )
        for t in (sigma.gyro, sigma.accel)
    )
    return ImuErrors(gyro, accel)


@dataclass(frozen=True)
class Run:
    """One run: what the sensors give, where navigation starts, and the truth about both; paths are at imu.time."""

    imu: ImuData
    initial: NavState
    parameters: dict[str, Array]
    paths: dict[str, Array]


def balanced(runs: int, size: int, seed: int) -> Array:
    """Return normal numbers for an ensemble whose mean square is exactly one in every direction, (runs, size)."""
    z = np.random.default_rng([23, seed]).standard_normal((runs, size))
    return np.asarray(z @ np.linalg.inv(np.linalg.cholesky(z.T @ z / runs)).T)


def one_run(
    trajectory: Trajectory,
    ideal: ImuData,
    model: ErrorModel,
    sigma: ImuErrors,
    seed: int,
    constants: Array | None = None,
) -> Run:
    """Draw everything that differs between runs: sensor errors, noise, and the errors of the start, as modelled.

    The errors at the start, constants of the sensors among them, can be given in units of their σ.
    """
    rng = np.random.default_rng([17, seed])
    drawn_now = rng.standard_normal(model.size)
    x = model.sigma * (drawn_now if constants is None else constants)
    drawn = {name: x[where] for name, where in model.slices.items()}

    def triad(name: str, noise: TriadErrors) -> TriadErrors:
        matrix = np.zeros((3, 3))
        matrix[~np.eye(3, dtype=bool)] = drawn.get(f"{name} misalignment", 0.0)
        zero = np.zeros(3)
        return replace(
            noise,
            instability=0.0,
            bias=drawn.get(f"{name} bias", zero),
            scale=drawn.get(f"{name} scale", zero),
            misalignment=matrix,
        )

    errors = ImuErrors(triad("gyro", sigma.gyro), triad("accelerometer", sigma.accel))
    truth = trajectory.state(ideal.time[0])
    north, east = metres(truth)
    initial = NavState(
        truth.latitude + x[0] / north,
        truth.longitude + x[1] / east,
        truth.height - x[2],
        truth.velocity_ned + x[3:6],
        rotation.multiply(rotation.quaternion_from_rotation_vector(-x[6:9]), truth.q_nb),
    )
    imu = emulate(ideal, errors, seed)
    paths = {}
    for name, block in ((b.name, b) for b in model.blocks if b.name.endswith(" instability")):
        path = wandering(drawn.pop(name), np.asarray(block.sigma), block.correlation_time, ideal.time, rng)
        added = 0.5 * (path[1:] + path[:-1]) * np.diff(ideal.time)[:, None]
        of_gyros = name.startswith("gyro")
        imu = ImuData(imu.time, imu.dtheta + (added if of_gyros else 0.0), imu.dvel + (0.0 if of_gyros else added))
        paths[name] = path
    return Run(imu, initial, {k: v for k, v in drawn.items() if " " in k}, paths)


def wandering(start: Array, sigma: Array, correlation_time: float, time: Array, rng: np.random.Generator) -> Array:
    """Return a stationary Gauss-Markov process from its first value on, (N+1, 3)."""
    decay = np.exp(-np.diff(time) / correlation_time)
    fresh = sigma * np.sqrt(1.0 - decay**2)[:, None] * rng.standard_normal((len(time) - 1, 3))
    path = [start]
    for d, w in zip(decay, fresh, strict=True):
        path.append(d * path[-1] + w)
    return np.array(path)


def metres(state: NavState) -> tuple[Array, Array]:
    """Return metres per radian of latitude and of longitude."""
    w = 1.0 - oracle.F * (2.0 - oracle.F) * np.sin(state.latitude) ** 2
    radius = oracle.A / np.sqrt(w)
    meridian = radius * (1.0 - oracle.F) ** 2 / w + state.height
    return meridian, (radius + state.height) * np.cos(state.latitude)


def positions(
    trajectory: Trajectory, time: Array, rng: np.random.Generator, sigma: tuple[float, ...] = (1.5, 1.5, 3.0)
) -> Measurements:
    """Return GNSS positions with white noise."""
    truth = trajectory.state(time)
    error = np.array(sigma) * rng.standard_normal((len(time), 3))
    north, east = metres(truth)
    value = np.column_stack(
        [truth.latitude + error[:, 0] / north, truth.longitude + error[:, 1] / east, truth.height - error[:, 2]]
    )
    return Measurements("gnss-position", time, time, value, np.tile(sigma, (len(time), 1)))


def velocities(trajectory: Trajectory, time: Array, rng: np.random.Generator, sigma: float = 0.05) -> Measurements:
    """Return GNSS velocities with white noise."""
    value = trajectory.state(time).velocity_ned + sigma * rng.standard_normal((len(time), 3))
    return Measurements("gnss-velocity", time, time, value, np.full((len(time), 3), sigma))


def standing(time: Array, rng: np.random.Generator, sigma: float = 0.002) -> Measurements:
    """Return zero velocities of a vehicle that stands."""
    value = sigma * rng.standard_normal((len(time), 3))
    return Measurements("zero-velocity", time, time, value, np.full((len(time), 3), sigma))


def not_turning(time: Array, rng: np.random.Generator, sigma: float = 1e-8) -> Measurements:
    """Return zero rates of a vehicle that stands."""
    value = sigma * rng.standard_normal((len(time), 3))
    return Measurements("zero-rate", time, time, value, np.full((len(time), 3), sigma))


def errors_of(model: ErrorModel, estimate: Estimate | Smoothed, trajectory: Trajectory, run: Run) -> Array:
    """Return the actual errors of an estimate in the filter's states."""
    moving = {
        name: np.stack([np.interp(estimate.time, run.imu.time, axis) for axis in path.T], axis=1)
        for name, path in run.paths.items()
    }
    return state_errors(model, estimate, trajectory.state(estimate.time), {**run.parameters, **moving}, WGS84)
