"""The attitude during turns from the gyros, for the Earth's rate that the block feels meanwhile."""

from __future__ import annotations

import math

import numpy as np

from sinssim.data import Array
from sinssim.jit import kernel
from sinssim.rotation.kernels import multiply_k


@kernel
def mean_turning(dtheta: Array, time: Array, first: int, last: int, earth: Array, out: Array) -> None:
    """Integrate C_b0b(t)ᵀ over a turn, b0 the block at its beginning.

    Args:
        dtheta: increments of angle, (N, 3) rad.
        time: edges, (N+1,) s.
        first, last: first sample of the turn, and the first after it.
        earth: the Earth's rate in the block's axes at the beginning, (3,) rad/s.
        out: ∫C_b(t)b0 dt, (3, 3) s, written.
    """
    q0, q1, q2, q3 = 1.0, 0.0, 0.0, 0.0
    out[:, :] = 0.0
    c = np.empty((3, 3))
    for k in range(first, last):
        interval = time[k + 1] - time[k]
        _matrix(q0, q1, q2, q3, c)
        x = dtheta[k, 0] - interval * (c[0, 0] * earth[0] + c[1, 0] * earth[1] + c[2, 0] * earth[2])
        y = dtheta[k, 1] - interval * (c[0, 1] * earth[0] + c[1, 1] * earth[1] + c[2, 1] * earth[2])
        z = dtheta[k, 2] - interval * (c[0, 2] * earth[0] + c[1, 2] * earth[1] + c[2, 2] * earth[2])
        for half in range(2):
            size = 0.5 * math.sqrt(x * x + y * y + z * z)
            s = 0.5 * math.sin(0.5 * size) / (0.5 * size) if size > 1e-12 else 0.5
            q0, q1, q2, q3 = multiply_k(
                q0, q1, q2, q3, math.cos(0.5 * size), 0.5 * s * x, 0.5 * s * y, 0.5 * s * z
            )  # by half the angle
            if half == 0:
                _matrix(q0, q1, q2, q3, c)
                for i in range(3):
                    for j in range(3):
                        out[i, j] += interval * c[j, i]


@kernel
def _matrix(q0: float, q1: float, q2: float, q3: float, c: Array) -> None:
    """Write C of a quaternion."""
    c[0, 0] = 1.0 - 2.0 * (q2 * q2 + q3 * q3)
    c[0, 1] = 2.0 * (q1 * q2 - q0 * q3)
    c[0, 2] = 2.0 * (q1 * q3 + q0 * q2)
    c[1, 0] = 2.0 * (q1 * q2 + q0 * q3)
    c[1, 1] = 1.0 - 2.0 * (q1 * q1 + q3 * q3)
    c[1, 2] = 2.0 * (q2 * q3 - q0 * q1)
    c[2, 0] = 2.0 * (q1 * q3 - q0 * q2)
    c[2, 1] = 2.0 * (q2 * q3 + q0 * q1)
    c[2, 2] = 1.0 - 2.0 * (q1 * q1 + q2 * q2)
