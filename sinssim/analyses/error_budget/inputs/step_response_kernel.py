"""Compiled kernel: errors of navigation at the end of a step by a unit of each constant sensor error in it.

Within a step, attitude, velocity and position errors that begin at zero follow

    φ̇ = −C u_gyro,   δv̇ = f × φ + C u_accel,   δṙ = δv                                                 (1)

with the factor u that the error multiplies in the readings. They are integrated sample by sample on the true
increments, so that a turn or an acceleration within the step is exact however long the step is. Rotation of the local
level and of the Earth within one step, 1e-4 of the result, is left to the transition between steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.jit import strict_kernel

BIAS, ALONG, FORCE, WARM_BIAS, WARM_SCALE, RAMP, HALF_SIZE, SQUARE, CUBE, COUPLED, SERIES = range(11)
"""What a column multiplies over a sample of length T with the increments x of its own triad and the velocity increments
w: T; x_j; w_j; T Θ; x_i Θ; T t; |x_i|/2; x_i²/T; x_i³/T²; x_i x_j/T; a given series of reading errors."""

Ints = NDArray[np.int64]


@strict_kernel
def step_responses(
    edges: Ints, part: Array, time: Array, dtheta: Array, dvel: Array, q: Array, warmth: Array,
    columns: Ints, series_theta: Array, series_vel: Array, out: Array, means: Array,
) -> None:  # fmt: skip
    """Compute the responses over all steps.

    Args:
        edges: sample that contains each boundary of the steps, (K+1,).
        part: fraction of that sample before the boundary, (K+1,).
        time: edges of the samples, (N+1,) s.
        dtheta, dvel: true increments, (N, 3) rad and m/s.
        q: true attitude at the edges, (N+1, 4).
        warmth: temperature in the middle of the samples, (N,) K.
        columns: triad (0 gyro, 1 accelerometer), input, i, j of each column, (m, 4); for a series its number as i.
        series_theta, series_vel: reading errors of each series, (s, N, 3) rad and m/s.
        out: position, velocity, attitude at the end of each step, (K, 9, m), written.
        means: mean of u over each step in body axes, gyros first, (K, 6, m), written.
    """
    count = columns.shape[0]
    c = np.empty((3, 3))
    for k in range(len(edges) - 1):
        for row in range(9):
            for m in range(count):
                out[k, row, m] = 0.0
        for row in range(6):
            for m in range(count):
                means[k, row, m] = 0.0
        length = 0.0
        for n in range(edges[k], min(edges[k + 1] + 1, len(dtheta))):
            share = 1.0
            if n == edges[k]:
                share -= part[k]
            if n == edges[k + 1]:
                share -= 1.0 - part[k + 1]
            if share <= 0.0:
                continue
            sample = time[n + 1] - time[n]
            t = share * sample
            length += t
            a0, a1, a2, a3 = q[n, 0], q[n, 1], q[n, 2], q[n, 3]
            sign = 1.0 if a0 * q[n + 1, 0] + a1 * q[n + 1, 1] + a2 * q[n + 1, 2] + a3 * q[n + 1, 3] > 0.0 else -1.0
            a0, a1, a2, a3 = (
                a0 + sign * q[n + 1, 0], a1 + sign * q[n + 1, 1], a2 + sign * q[n + 1, 2], a3 + sign * q[n + 1, 3]
            )  # fmt: skip
            s = 2.0 / (a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3)
            c[0, 0], c[0, 1], c[0, 2] = 1.0 - s * (a2 * a2 + a3 * a3), s * (a1 * a2 - a0 * a3), s * (a1 * a3 + a0 * a2)
            c[1, 0], c[1, 1], c[1, 2] = s * (a1 * a2 + a0 * a3), 1.0 - s * (a1 * a1 + a3 * a3), s * (a2 * a3 - a0 * a1)
            c[2, 0], c[2, 1], c[2, 2] = s * (a1 * a3 - a0 * a2), s * (a2 * a3 + a0 * a1), 1.0 - s * (a1 * a1 + a2 * a2)
            wx, wy, wz = share * dvel[n, 0], share * dvel[n, 1], share * dvel[n, 2]
            fx = c[0, 0] * wx + c[0, 1] * wy + c[0, 2] * wz
            fy = c[1, 0] * wx + c[1, 1] * wy + c[1, 2] * wz
            fz = c[2, 0] * wx + c[2, 1] * wy + c[2, 2] * wz
            for m in range(count):
                triad, kind, i, j = columns[m, 0], columns[m, 1], columns[m, 2], columns[m, 3]
                gx = gy = gz = ax = ay = az = 0.0
                if kind == SERIES:
                    gx, gy, gz = (
                        share * series_theta[i, n, 0],
                        share * series_theta[i, n, 1],
                        share * series_theta[i, n, 2],
                    )
                    ax, ay, az = share * series_vel[i, n, 0], share * series_vel[i, n, 1], share * series_vel[i, n, 2]
                    means[k, 0, m] += gx
                    means[k, 1, m] += gy
                    means[k, 2, m] += gz
                    means[k, 3, m] += ax
                    means[k, 4, m] += ay
                    means[k, 5, m] += az
                else:
                    x_i = dtheta[n, i] if triad == 0 else dvel[n, i]
                    x_j = dtheta[n, j] if triad == 0 else dvel[n, j]
                    if kind == BIAS:
                        u = t
                    elif kind == ALONG:
                        u = share * x_j
                    elif kind == FORCE:
                        u = share * dvel[n, j]
                    elif kind == WARM_BIAS:
                        u = t * warmth[n]
                    elif kind == WARM_SCALE:
                        u = share * x_i * warmth[n]
                    elif kind == RAMP:
                        u = t * (0.5 * (time[n] + time[n + 1]) - time[0])
                    elif kind == HALF_SIZE:
                        u = 0.5 * share * abs(x_i)
                    elif kind == SQUARE:
                        u = share * x_i * x_i / sample
                    elif kind == CUBE:
                        u = share * x_i * x_i * x_i / (sample * sample)
                    else:
                        u = share * x_i * x_j / sample
                    means[k, 3 * triad + i, m] += u
                    if triad == 0:
                        gx, gy, gz = (u if i == 0 else 0.0), (u if i == 1 else 0.0), (u if i == 2 else 0.0)
                    else:
                        ax, ay, az = (u if i == 0 else 0.0), (u if i == 1 else 0.0), (u if i == 2 else 0.0)
                px = -(c[0, 0] * gx + c[0, 1] * gy + c[0, 2] * gz)
                py = -(c[1, 0] * gx + c[1, 1] * gy + c[1, 2] * gz)
                pz = -(c[2, 0] * gx + c[2, 1] * gy + c[2, 2] * gz)
                hx, hy, hz = out[k, 6, m] + 0.5 * px, out[k, 7, m] + 0.5 * py, out[k, 8, m] + 0.5 * pz
                vx = fy * hz - fz * hy + c[0, 0] * ax + c[0, 1] * ay + c[0, 2] * az  # (1)
                vy = fz * hx - fx * hz + c[1, 0] * ax + c[1, 1] * ay + c[1, 2] * az
                vz = fx * hy - fy * hx + c[2, 0] * ax + c[2, 1] * ay + c[2, 2] * az
                out[k, 0, m] += t * (out[k, 3, m] + 0.5 * vx)
                out[k, 1, m] += t * (out[k, 4, m] + 0.5 * vy)
                out[k, 2, m] += t * (out[k, 5, m] + 0.5 * vz)
                out[k, 3, m] += vx
                out[k, 4, m] += vy
                out[k, 5, m] += vz
                out[k, 6, m] += px
                out[k, 7, m] += py
                out[k, 8, m] += pz
        if length > 0.0:
            for row in range(6):
                for m in range(count):
                    means[k, row, m] /= length
