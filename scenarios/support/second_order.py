"""Where the first-order theory holds: the size of the second-order terms of eq. (1) for given instruments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.alignment.determination import solve
from sinssim.alignment.parked_theory import Angles, Array, Attitude, InstrumentErrors, error_statistics, ideal_readings


class SecondOrder(NamedTuple):
    """What the second-order terms add, relative to the first-order standard deviation.

    Attributes:
        mean: the mean of the angle errors, which the first order has as zero, over σ.
        spread: the standard deviation of the second-order terms, over σ.
    """

    mean: Angles
    spread: Angles

    def linear(self, draws: int) -> NDArray[np.bool_]:
        """Say where so many draws could not tell eq. (1) from the first-order theory.

        Args:
            draws: number of draws.

        Returns:
            True where, for every angle, the mean is off by less than half its standard error, and the standard
            deviation (which the second order changes by half its squared spread, and the third by as much again)
            by less than half of its own.
        """
        mean, spread = (np.stack(np.broadcast_arrays(*angles)) for angles in self)
        small = (np.abs(mean) < 0.5 / np.sqrt(draws)) & (spread**2 < 0.5 / np.sqrt(2.0 * draws))
        return np.asarray(small.all(axis=0))


def second_order(
    attitude: Attitude, latitude: ArrayLike, sigmas: InstrumentErrors, *, gravity: ArrayLike | None = None
) -> SecondOrder:
    """Return the second-order terms of eq. (1) for zero-mean normal instrument errors.

    With the second derivatives H of an angle by the six readings, whose errors have standard deviations s, the mean
    is ½ Σ H_ii s_i² and the variance of the second-order part ½ Σ (H_ij s_i s_j)².

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        sigmas: standard deviations of the instruments' errors.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        Relative means and spreads.

    Raises:
        InputError: as `error_statistics`.
    """
    first = error_statistics(attitude, latitude, None, sigmas, gravity=gravity).sigma
    sigma = np.stack(np.broadcast_arrays(*first), axis=-1)
    gyro, accel = ideal_readings(*attitude, latitude, gravity=gravity)
    variances = sigmas.squared().reading_errors(gyro**2, accel**2)
    shape = (*sigma.shape[:-1], 3)
    gyro, accel, *sizes = (np.broadcast_to(x, shape) for x in (gyro, accel, *map(np.sqrt, variances)))
    true = np.stack([np.broadcast_to(x, shape[:-1]) for x in (*attitude, latitude)], axis=-1)
    # Steps of a thousandth of what a reading is taken from: second differences then carry 1e-10 of it as rounding.
    reach = 1e-3 * np.cos(true[..., 2]) * np.cos(true[..., 3])
    steps = [reach * np.linalg.norm(gyro, axis=-1)] * 3 + [reach * np.linalg.norm(accel, axis=-1)] * 3

    def angles(moves: dict[int, float]) -> Array:
        moved = [gyro.copy(), accel.copy()]
        for index, sign in moves.items():
            moved[index // 3][..., index % 3] += sign * steps[index]
        found = np.stack(solve(*moved)[0], axis=-1)
        return np.asarray((found - true + np.pi) % (2.0 * np.pi) - np.pi)

    centre = angles({})
    mean, variance = np.zeros_like(centre), np.zeros_like(centre)
    for i in range(6):
        scale_i = (sizes[i // 3][..., i % 3] / steps[i])[..., None]
        diagonal = (angles({i: 1.0}) + angles({i: -1.0}) - 2.0 * centre) * scale_i**2
        mean += 0.5 * diagonal
        variance += 0.5 * diagonal**2
        for j in range(i):
            scale_j = (sizes[j // 3][..., j % 3] / steps[j])[..., None]
            cross = sum(a * b * angles({i: a, j: b}) for a in (1.0, -1.0) for b in (1.0, -1.0)) * scale_i * scale_j / 4
            variance += np.asarray(cross) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):  # an angle on which nothing acts has no terms of any order
        relative = [np.where(sigma > 0.0, value / sigma, 0.0) for value in (mean, np.sqrt(variance))]
    return SecondOrder(*(Angles(*np.moveaxis(value, -1, 0)) for value in relative))
