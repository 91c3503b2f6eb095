"""A body that turns at a fixed place, its attitude a closed form of time; it shares no code with sinssim.

The increments are Gauss-Legendre quadratures of ω_ib = ω_nb + C_bn ω_ie and f = −C_bn g over each sample.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import leggauss

from tests.oracles.s_turn import OMEGA_IE, Array, Flight, somigliana_free_air

NODES, WEIGHTS = leggauss(8)
Motion = Callable[[Array], tuple[Array, Array]]  # t -> q_nb (..., 4), ω_nb in body axes (..., 3)


def cone(angle: float, frequency: float) -> Motion:
    """Return the motion whose body z axis runs round a cone of a half-angle, rad, at a frequency, rad/s."""

    def motion(t: Array) -> tuple[Array, Array]:
        c, s, x = np.cos(angle / 2), np.sin(angle / 2), frequency * t
        one = np.ones_like(x)
        q = np.stack([c * one, s * np.cos(x), s * np.sin(x), 0 * one], axis=-1)
        # 2 q* ∘ q̇
        rate = frequency * np.stack(
            [-np.sin(angle) * np.sin(x), np.sin(angle) * np.cos(x), -(1 - np.cos(angle)) * one], axis=-1
        )
        return q, rate

    return motion


def spin(rate: Array, start: Array) -> Motion:
    """Return a turn at a constant body rate, (3,) rad/s, relative to north, east, down, from q_nb, (4,)."""
    size = float(np.linalg.norm(rate))
    axis = np.asarray(rate) / size

    def motion(t: Array) -> tuple[Array, Array]:
        half = size * t[..., None] / 2
        scalar, vector = np.cos(half), np.sin(half) * axis
        q = np.concatenate(
            [
                start[0] * scalar - np.sum(start[1:] * vector, axis=-1, keepdims=True),
                start[0] * vector + scalar * start[1:] + np.cross(start[1:], vector),
            ],
            axis=-1,
        )
        return q, np.broadcast_to(rate, (*t.shape, 3))

    return motion


def transposed_times(q: Array, v: Array) -> Array:
    """Return C_bn v_n: the conjugate's rotation of vectors, (..., 3), by quaternions q_nb, (..., 4)."""
    cross = 2 * np.cross(-q[..., 1:], v)
    return v + q[..., :1] * cross + np.cross(-q[..., 1:], cross)


def turn(
    motion: Motion,
    duration: float,
    rate_hz: float,
    latitude: float = 0.9,
    longitude: float = 0.5,
    height: float = 200.0,
) -> Flight:
    """Return truth and increments of a motion at a fixed place, gravity by Somigliana with the linear height term.

    Args:
        motion: attitude and its rate as functions of time.
        duration: s, a whole number of samples.
        rate_hz: sampling rate.
        latitude, longitude, height: the place, rad, rad, m.

    Returns:
        Truth and increments.
    """
    count = round(duration * rate_hz)
    time = np.arange(count + 1) / rate_hz
    t = time[:-1, None] + (1 + NODES) * 0.5 / rate_hz
    q, rate = motion(t)
    _, down = somigliana_free_air(np.array(latitude), height)
    earth = OMEGA_IE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    omega = rate + transposed_times(q, np.broadcast_to(earth, rate.shape))
    force = transposed_times(q, np.broadcast_to([0.0, 0.0, -float(down)], rate.shape))
    one = np.ones_like(time)
    return Flight(
        time,
        0.5 / rate_hz * np.einsum("j,njk->nk", WEIGHTS, omega),
        0.5 / rate_hz * np.einsum("j,njk->nk", WEIGHTS, force),
        latitude * one,
        longitude * one,
        height * one,
        np.zeros((count + 1, 3)),
        motion(time)[0],
    )
