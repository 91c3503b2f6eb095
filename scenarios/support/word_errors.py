"""Closed forms of the errors by words of finite length, for the study word_length.py, which states them."""

from __future__ import annotations

import math

import numpy as np

from sinssim import rotation
from sinssim.data import Array
from sinssim.sensors.error_propagation import Schuler
from sinssim.units import DEG

INCREMENTS = "angle increments"
ALGORITHMS = {"quaternion": "quaternion", "poisson": "matrix (Poisson)", "euler": "Euler angles"}
RANGES = {"quaternion": 2.0, "poisson": 2.0, "euler": 2.0 * np.pi, "velocity": 2048.0, "position": 2.0 * np.pi}
"""Ranges of the variables: ±1, ±180°, ±1024 m/s, ±180° of latitude and longitude."""
FACTORS = {"quaternion": 4.0, "poisson": 0.5, "euler": 1.0, INCREMENTS: 1.0}
"""k of the random walk: the squared turns by a unit error of every variable, summed over variables and axes, over 3."""
CUT = {"quaternion": 2.0, "poisson": 0.75, "euler": 0.5 * math.sqrt(3.0), INCREMENTS: 0.5 * math.sqrt(3.0)}
"""Largest drift by cutting off, δ per step."""
SINGLE = -1.0
"""In place of δ: round to the 24 bits of single precision."""
SCHULER = Schuler.at(50.0 * DEG)
RATE_RANGE = 800.0 * DEG
"""Range of the gyros' increments times the sampling rate, ±400 °/s."""
LATITUDE, SPEED, HEIGHT = 50.0 * DEG, 250.0, 9000.0


def lsb_of(variable: str, bits: int, rate_hz: float) -> float:
    """Return δ of a word: its range over 2ⁿ."""
    span = RATE_RANGE / rate_hz if variable == INCREMENTS else RANGES[variable]
    return float(span * 2.0**-bits)


def random_walk(variable: str, lsb: float, rate_hz: float) -> float:
    """Return the random walk by rounding, rad/√s, for the velocity m/s/√s."""
    return lsb * math.sqrt(FACTORS.get(variable, 1.0) * rate_hz / 12.0)


def single_walk(algorithm: str, reference: Array, rate_hz: float) -> float:
    """Return the random walk of attitude words in single precision, whose δ is that of each variable's size, rad/√s.

    The squared turns by a unit error of one variable are 4 (1 − λ²) for a quaternion's, (1 − b²)/4 for a matrix's and 1
    for an angle.
    """
    q = reference[:, 4:]
    if algorithm == "quaternion":
        values, squares = q, 4.0 * (1.0 - q**2)
    elif algorithm == "poisson":
        values = rotation.dcm_from_quaternion(q).reshape(len(q), 9)
        squares = 0.25 * (1.0 - values**2)
    else:
        values = np.stack(rotation.euler_from_quaternion(q), axis=1)
        squares = np.ones_like(values)
    lsb = np.spacing(np.abs(values).astype(np.float32)).astype(float)
    return math.sqrt(float((lsb**2 * squares).sum(axis=1).mean()) / 36.0 * rate_hz)


def cut_drift(variable: str, lsb: float, rate_hz: float, reference: Array) -> Array:
    """Return the drift by cutting off: turn north, east, down, rad/s; change of velocity, m/s², or position, rad/s."""
    if variable in ("velocity", "position"):
        return np.full(2, -0.5 * lsb * rate_hz)
    q, one = reference[:60, 4:], np.ones(3)
    dcm = rotation.dcm_from_quaternion(q)
    if variable == "quaternion":
        turn = -rotation.multiply(np.ones(4), rotation.conjugate(q))[:, 1:]
    elif variable == "poisson":
        turn = 0.25 * np.cross(one, dcm @ one)
    elif variable == INCREMENTS:
        turn = -0.5 * dcm @ one
    else:
        _, _, heading = rotation.euler_from_quaternion(q)
        zero = np.zeros_like(heading)
        turn = -0.5 * (dcm[:, :, 0] + np.stack([-np.sin(heading), np.cos(heading), zero + 1.0], axis=1))
    return np.asarray(lsb * rate_hz * turn.mean(axis=0))


def grown(variable: str, lsb: float, rate_hz: float, time: float, cut: bool) -> float:
    """Return the horizontal position error after a time, 1σ by rounding or at most by cutting off, m."""
    s, root, bias = SCHULER, math.sqrt(2.0) * random_walk(variable, lsb, rate_hz), lsb * rate_hz / math.sqrt(2.0)
    if variable == "velocity":
        return bias * float(s.step("velocity", np.array(time))) if cut else root * s.white("velocity", time)
    if variable == "position":  # the attitude does not follow, so that the Schuler loop does not act
        return s.radius * (bias * time if cut else root * math.sqrt(time))
    if cut:
        return CUT[variable] * lsb * rate_hz * float(s.step("tilt", np.array(time)))
    return root * math.hypot(s.white("tilt", time), s.white("azimuth", time) / math.sqrt(2.0))


def least_bits(variable: str, rate_hz: float, allowed: float, cut: bool) -> int:
    """Return the shortest word whose position error after an hour is allowed."""
    per_lsb = grown(variable, 1.0, rate_hz, 3600.0, cut)
    return math.ceil(math.log2(lsb_of(variable, 0, rate_hz) * per_lsb / allowed))
