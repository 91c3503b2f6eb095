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

Ints = NDArray[np.int64]


@strict_kernel
def step_responses(
    edges: Ints, part: Array, time: Array, dvel: Array, q: Array, columns: Ints, directions: Array, inputs: Array,
    series_theta: Array, series_vel: Array, out: Array, means: Array,
) -> None:  # fmt: skip
    """Compute the responses over all steps.

    Args:
        edges: sample that contains each boundary of the steps, (K+1,).
        part: fraction of that sample before the boundary, (K+1,).
        time: edges of the samples, (N+1,) s.
        dvel: true velocity increments, (N, 3) m/s.
        q: true attitude at the edges, (N+1, 4).
        columns: triad (0 gyro, 1 accelerometer), series (−1 for none) and row of `inputs` of each column, (m, 3).
        directions: in which a column without a series adds its input to the increments of its triad, (m, 3).
        inputs: integrals of the inputs over the samples from the first boundary on, (r, n).
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
        for n in range(edges[k], min(edges[k + 1] + 1, len(dvel))):
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
                gx = gy = gz = ax = ay = az = 0.0
                i = columns[m, 1]
                if i >= 0:
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
                    u = share * inputs[columns[m, 2], n - edges[0]]
                    ux, uy, uz = u * directions[m, 0], u * directions[m, 1], u * directions[m, 2]
                    if columns[m, 0] == 0:
                        gx, gy, gz = ux, uy, uz
                    else:
                        ax, ay, az = ux, uy, uz
                    first = 3 * columns[m, 0]
                    means[k, first, m] += ux
                    means[k, first + 1, m] += uy
                    means[k, first + 2, m] += uz
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
