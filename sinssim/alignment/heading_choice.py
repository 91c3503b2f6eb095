"""Headings, or sets of several headings, that minimise the error of an angle.

If a vehicle (or its sensor block on a turntable) is turned between sessions, the errors of the instruments turn with
it. Every instrument error then enters the mean of the determined headings, each minus its known turn, with the mean of
its coefficients. Over two opposite headings the biases cancel, over four at right angles the scale factors, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.alignment_budget import AVERAGED, OF_GYROS, SLOW, mean_warmth, reading_variances
from sinssim.alignment.parked_theory import Angles, Attitude, coefficients, ideal_readings
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp


class BestHeadings(NamedTuple):
    """A set of headings and its standard deviations.

    Attributes:
        headings: headings in [0, 2π), (count,) rad.
        sigma: standard deviations of the mean determination, rad.
        worst: standard deviation of the chosen angle at the worst orientation of the set, rad.
    """

    headings: Array
    sigma: Angles
    worst: float


def set_sigma(
    attitude: Attitude,
    latitude: ArrayLike,
    sigma: ImuErrors,
    duration: ArrayLike,
    *,
    gravity: ArrayLike | None = None,
    rate_hz: float = 100.0,
) -> Angles:
    """Return the standard deviations of a determination averaged over a set of positions.

    The errors of one run (bias, scale factor, misalignment, …, and the slow bias instability and flicker) are the same
    in every position. Ramp, temperature and rate random walk continue from one position to the next, in order and
    without a pause, from when the sensors are switched on. Noise is independent in each position. Roll and pitch are
    those of the positions, with averaged errors.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting, the last axis counting the positions.
        latitude: rad, broadcasting without that axis.
        sigma: standard deviations of the sensor block's errors.
        duration: length of all sessions together, s, split evenly; broadcasting without that axis.
        gravity: g, m/s², broadcasting without that axis; by default normal gravity on the ellipsoid.
        rate_hz: samples per second, for flicker noise.

    Returns:
        Standard deviations of the averaged angles, rad.

    Raises:
        InputError: as for `coefficients`, or the duration is not positive.
    """
    phi = np.asarray(latitude, dtype=np.float64)[..., None]
    g = None if gravity is None else np.asarray(gravity, dtype=np.float64)[..., None]
    attitude = Attitude(*np.broadcast_arrays(*attitude))
    count = np.shape(attitude.heading)[-1]
    c = coefficients(attitude, phi, gravity=g)
    gyro, accel = ideal_readings(*attitude, phi, gravity=g)
    each = np.asarray(duration, dtype=np.float64)[..., None] / count
    noise = reading_variances(sigma, gyro, accel, each, rate_hz=rate_hz)
    turn = _Turn(each, sigma.warm_up, count)
    zero = np.zeros_like(c.m)
    variances = []
    for by_rate, by_force in ((c.m, c.n), (zero, c.q), (zero, c.l), (c.p, c.r)):
        variance = _carried(by_rate, gyro, accel, sigma.gyro, turn)
        variance = variance + _carried(by_force, accel, accel, sigma.accel, turn)
        for source in AVERAGED:
            weight = by_rate if source in OF_GYROS else by_force
            if source in SLOW:  # hardly changes from one position to the next
                variance = variance + (weight.mean(axis=-2) ** 2 * noise[source].mean(axis=-2)).sum(axis=-1)
            else:
                variance = variance + (weight**2 * noise[source]).sum(axis=(-2, -1)) / count**2
        variances.append(variance)
    return Angles(*(np.sqrt(variance) for variance in variances))


class _Turn:
    """Drifts between successive positions of a set.

    Attributes:
        middle: time to the middle of each position, (..., count) s.
        warmth: mean temperature in each position, (..., count) K.
        walk: covariance of the means of a unit random walk in the positions, (..., count, count) s.
    """

    def __init__(self, each: Array, warm_up: WarmUp, count: int) -> None:
        number = np.arange(count)
        self.middle = each * (number + 0.5)
        self.warmth = mean_warmth(warm_up, each, each * number)
        earlier = np.minimum.outer(number, number) + 0.5 - np.eye(count) / 6.0  # within one position T/3
        self.walk = each[..., None] * earlier


def _carried(weight: Array, ideal: Array, force: Array, triad: TriadErrors, turn: _Turn) -> Array:
    """Return the variance by errors that are common to all positions or drift: (mean coefficient)² σ²."""
    walk = np.einsum("...ki,...kl,...li->...", weight, turn.walk, weight) / weight.shape[-2] ** 2
    variance = triad.rate_walk**2 * walk
    for term, sigma in triad.acting:
        inputs, matrix = term.inputs(ideal, force, turn.warmth, turn.middle), len(term.shape) == 2
        mean = (weight[..., None] * inputs).mean(axis=-3) if matrix else (weight * inputs).mean(axis=-2)
        variance = variance + (mean**2 * sigma**2).sum(axis=(-2, -1) if matrix else -1)
    return np.asarray(variance)


def best_headings(
    count: int,
    latitude: float,
    sigma: ImuErrors,
    duration: float,
    *,
    roll: float = 0.0,
    pitch: float = 0.0,
    angle: str = "heading",
) -> BestHeadings:
    """Find the evenly spaced headings that minimise the error of an angle.

    Args:
        count: number of headings: 1, 2, 4 ...
        latitude: rad.
        sigma: standard deviations of the sensor block's errors.
        duration: length of all sessions together, s.
        roll, pitch: the vehicle's tilt, rad.
        angle: the angle whose error is minimised: "heading" or "latitude" (errors of roll and pitch do not depend on
            heading).

    Returns:
        The headings and their standard deviations; of several equally good sets, the one nearest to north.

    Raises:
        InputError: the count is below 1, the angle is neither of the two, or as for `coefficients`.
    """
    if count < 1:
        raise InputError(f"a set of {count} headings: there must be at least one.")
    if angle not in ("heading", "latitude"):
        raise InputError(f"the error of the {angle} does not depend on the heading; choose heading or latitude.")
    spread = 2.0 * np.pi * np.arange(count) / count

    def value(first: Array) -> Array:
        attitude = Attitude(first[..., None] + spread, roll, pitch)
        return np.asarray(getattr(set_sigma(attitude, latitude, sigma, duration), angle))

    def one_value(first: float) -> float:
        return float(value(np.asarray(first)))

    from scipy.optimize import minimize_scalar

    step = np.radians(0.5)
    grid = np.arange(0.0, 2.0 * np.pi / count, step)
    values = value(grid)
    start = float(grid[np.argmax(values <= values.min() * (1.0 + 1e-12))])
    refined = minimize_scalar(one_value, bounds=(start - step, start + step), method="bounded")
    first = float(refined.x) if refined.fun < one_value(start) * (1.0 - 1e-12) else start
    headings = np.mod(first + spread, 2.0 * np.pi)
    sigma_there = set_sigma(Attitude(headings, roll, pitch), latitude, sigma, duration)
    return BestHeadings(headings, sigma_there, float(values.max()))
