"""Configuration of KF-GINS for an exported run: initial state, noise of the run's sensors, lever arm.

KF-GINS has one first-order Gauss-Markov process for each bias and scale factor, all with one correlation time T, and
initial standard deviations apart from those of the processes. The processes of a run are constants, Gauss-Markov
processes and random walks, side by side. T is much longer than any run, so that constants stay constant; a process
that moves gets the standard deviation σ whose driving noise 2σ²/T is the run's.

It takes the first reading at or after its starttime only as the predecessor of the next one, and the initial state as
that at this reading; a starttime before the first reading is refused. Source: main() and loadConfig() of
src/kf_gins.cpp, insPropagation() of src/kf-gins/gi_engine.cpp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import ellipsoid_by_name
from sinssim.errors import InputError
from sinssim.logs.reference_solution import TruthAt
from sinssim.logs.stored_run import RecordedRun
from sinssim.logs.writers.run_export import Content
from sinssim.units import DEG, DEG_H, DEG_SQRT_H, MGAL, MPS_SQRT_H, PPM

CORRELATION_H = 1000.0
"""Correlation time T in the configuration, h."""
_EDGE = 1e-9  # s: a reading this close to the first state is at it
_AXES = 3
_OWN = tuple(
    tuple(f"sigma_{what}_{axis}_{unit}" for axis in "ned")
    for what, unit in (("position", "m"), ("velocity", "mps"), ("phi", "rad"))
)
TYPICAL_START = np.full(_AXES, 1.0), np.full(_AXES, 0.1), np.array([0.1, 0.1, 0.5]) * DEG
"""1σ of an initial state whose accuracy is not known, as after an alignment with satellites; m, m/s, rad."""


@dataclass(frozen=True)
class Noise:
    """Errors of three gyros or accelerometers in the terms of KF-GINS, SI.

    Attributes:
        white: density of the white noise, one number.
        bias: 1σ of the bias at the beginning, (3,).
        wandering: density of the white noise that drives the bias, one number.
        scale: 1σ of the relative scale-factor errors, (3,).
    """

    white: float
    bias: Array
    wandering: float
    scale: Array


TYPICAL = (
    Noise(0.2 * DEG_SQRT_H, np.full(_AXES, 50.0 * DEG_H), 0.0, np.full(_AXES, 1000.0 * PPM)),
    Noise(0.1 * MPS_SQRT_H, np.full(_AXES, 250.0 * MGAL), 0.0, np.full(_AXES, 1000.0 * PPM)),
)
"""Gyros and accelerometers of a MEMS unit, for a run whose sensors are not known."""


def noise_of(run: RecordedRun) -> tuple[Noise, Noise] | None:
    """Return the noise of a run's gyros and accelerometers, as its [imu] section and its filter's factor give it.

    Returns:
        Gyros and accelerometers; None if the run has no [imu] section, or its grade is not found any more.
    """
    from sinssim.sensors.imu.error_term_table import of_triad
    from sinssim.sensors.imu.imu import Imu

    given = run.scenario.get("imu")
    if given is None:
        return None
    factor = float(run.scenario.get("filter", {}).get("inertial_noise_factor", 1.0))
    try:
        section = Imu.model_validate(given)
        found = []
        for triad in ("gyro", "accel"):
            size: dict[str, Any] = {term.field: np.hypot(*section.stated(term)) for term in of_triad(triad)}
            driven = float(factor * size["instability"]) ** 2 * 2.0 / float(size["correlation_time"])
            walk = math.sqrt(driven + float(size["rate_walk"]) ** 2)
            bias = np.hypot(size["bias"], factor * size["instability"])
            found.append(Noise(factor * float(size["random_walk"]), bias, walk, np.asarray(size["scale"])))
    except (InputError, ValueError):
        return None
    return found[0], found[1]


def start_of(content: Content) -> tuple[float, NavState]:
    """Return the first reading at which the chosen solution has a state, and that state.

    Returns:
        The run's time of the reading, s, and one state.

    Raises:
        InputError: no reading lies within the solution.
    """
    known = content.run.solution(content.solution_name)
    time = content.imu.time
    at = time[(time >= known.time[0] - _EDGE) & (time <= known.time[-1])][:1]
    if not len(at):
        raise InputError(f"{content.solution_name} of {content.run.path} has no state at any inertial sample.")
    return float(at[0]), TruthAt(known, ellipsoid_by_name(content.run.ellipsoid)).state(at)


def initial_sigma(content: Content, time: float) -> tuple[Array, Array, Array]:
    """Return the 1σ of the initial state: of position and velocity, and of the angles about north, east, down.

    KF-GINS calls the angles roll, pitch and heading. It puts their squares into the covariance of the angles about
    north, east and down.

    Args:
        time: of the initial state, the run's s.

    Returns:
        m, m/s, rad, (3,) each: what the run's own filter assumes at this instant; for the truth, or without a filter,
        `TYPICAL_START`.
    """
    if content.solution_name != "truth" and "filter" in content.run.streams(""):
        own = content.run.table("filter")
        row = int(np.searchsorted(own["time_s"], time - _EDGE).clip(max=len(own["time_s"]) - 1))
        found = tuple(np.array([own[name][row] for name in names]) for names in _OWN)
        if all(np.isfinite(part).all() and (part > 0.0).all() for part in found):
            return found[0], found[1], found[2]
    return TYPICAL_START


def configuration(content: Content, start: float) -> str:
    """Return the configuration file.

    Args:
        start: seconds of the week of the run's time 0.
    """
    imu = content.imu
    rate = round((len(imu) - 1) / float(imu.time[-1] - imu.time[0])) if len(imu) > 1 else 1
    time, state = start_of(content)
    angles = np.array(rotation.euler_from_quaternion(state.q_nb)).ravel() / DEG
    place = (state.latitude[0] / DEG, state.longitude[0] / DEG, state.height[0])
    receiver = next(iter(content.fixes), "")
    arm = content.run.lever_arm(receiver) if receiver else (0.0, 0.0, 0.0)
    position, velocity, attitude = initial_sigma(content, time)
    gyro, accel = noise_of(content.run) or TYPICAL
    walk = math.sqrt(CORRELATION_H * 3600.0 / 2.0)  # σ = √(S T/2) of the density S of the driving noise

    def row(values: object, unit: float = 1.0) -> str:
        return "[" + ", ".join(f"{v / unit:.9g}" for v in np.broadcast_to(np.asarray(values), _AXES)) + "]"

    def exact(values: object) -> str:
        return "[" + ", ".join(repr(float(v)) for v in np.asarray(values).tolist()) + "]"

    return "\n".join(
        [
            "# KF-GINS configuration for a run of sinssim",
            'imupath: "./imu.txt"',
            f'gnsspath: "./{receiver or "gnss"}.txt"',
            'outputpath: "."',
            "imudatalen: 7",
            f"imudatarate: {rate}",
            f"starttime: {round(start + time, 9)!r}   # the first sample",
            "endtime: -1",
            f"initpos: {exact(place)}   # deg, deg, m",
            f"initvel: {exact(state.velocity_ned[0])}   # north, east, down, m/s",
            f"initatt: {exact(angles)}   # roll, pitch, heading, deg",
            f"initgyrbias: {row(0.0)}   # deg/h",
            f"initaccbias: {row(0.0)}   # mGal",
            f"initgyrscale: {row(0.0)}   # ppm",
            f"initaccscale: {row(0.0)}   # ppm",
            f"initposstd: {row(position)}   # m",
            f"initvelstd: {row(velocity)}   # m/s",
            f"initattstd: {row(attitude, DEG)}   # deg",
            f"initbgstd: {row(gyro.bias, DEG_H)}   # deg/h",
            f"initbastd: {row(accel.bias, MGAL)}   # mGal",
            f"initsgstd: {row(gyro.scale, PPM)}   # ppm",
            f"initsastd: {row(accel.scale, PPM)}   # ppm",
            "imunoise:",
            f"  arw: {row(gyro.white, DEG_SQRT_H)}   # deg/sqrt(h)",
            f"  vrw: {row(accel.white, MPS_SQRT_H)}   # m/s/sqrt(h)",
            f"  gbstd: {row(gyro.wandering * walk, DEG_H)}   # deg/h; 0 is a constant bias",
            f"  abstd: {row(accel.wandering * walk, MGAL)}   # mGal",
            f"  gsstd: {row(0.0)}   # ppm",
            f"  asstd: {row(0.0)}   # ppm",
            f"  corrtime: {CORRELATION_H!r}   # h",
            f"antlever: {exact(arm)}   # forward, right, down, m",
            "",
        ]
    )
