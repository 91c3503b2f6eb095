"""Navigation that knows the disturbance of gravity at its own position.

An engine computes with normal gravity. Navigation with a model of the field is the same engine on increments to which
the disturbance is added, ∫C_bn δg dt, with the attitude and at the position of the navigator itself. Position and
disturbance depend on each other, so the path is found by repetition: navigate, evaluate the disturbance along the
solution, add it to the increments, navigate again. A position error δr changes the disturbance by its gradient, some
1e-9 1/s² times δr, and this changes the position within a Schuler period by a thousandth of δr: every pass gains three
digits. No engine is changed, and without a model nothing is computed.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavSolution
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.earth.gravity_disturbance import DisturbingField, disturbance_along
from sinssim.errors import RunError
from sinssim.jit import kernel
from sinssim.rotation.quaternions import multiply_k, quaternion_from_rotation_vector_k, rotate_k

CLOSE = 1e-3
"""Change of the position from pass to pass at which the path is found, m."""
_PASSES = 20
_COMPARED = 4096
"""Largest number of rows whose positions are compared from pass to pass: the change is smooth."""
_LOWEST, _HIGHEST = -20e3, 1000e3
"""Heights between which the field is evaluated, m: that of a diverging height channel is no place."""
_KNOT = 2.0
"""Interval between knots within a segment, s."""


def navigate_in_field(
    imu: ImuData, field: DisturbingField, ellipsoid: Ellipsoid, navigate: Callable[[ImuData], NavSolution]
) -> NavSolution:
    """Navigate with the disturbance of gravity at the navigator's own position, on its ellipsoid."""
    solution = navigate(imu)
    compared = np.unique(np.linspace(0, len(solution.time) - 1, _COMPARED).astype(np.intp))
    before = _positions(solution, ellipsoid, compared)
    for _ in range(_PASSES):
        along = disturbance_along(field, _path(solution, ellipsoid), float(solution.time[0]), float(solution.time[-1]))
        felt = disturbance_in_body(imu, solution, along.panels, along.start, along.step, ellipsoid)
        solution = navigate(ImuData(imu.time, imu.dtheta, imu.dvel + felt))
        now = _positions(solution, ellipsoid, compared)
        moved = float(np.abs(now - before).max())
        if moved < CLOSE:
            return solution
        before = now
    raise RunError(
        f"navigation.gravity_degree: after {_PASSES} passes the position still changes by {moved:.3g} m between them; "
        "the errors of the sensors, or of a free height channel, are too large to compensate gravity: use vertical = "
        '"baro-loop", or no gravity_degree.'
    )


def disturbance_of_segment(
    field: DisturbingField, ellipsoid: Ellipsoid, samples: ImuData, nominal: NavSolution
) -> Array:
    """Return ∫C_bn δg dt over a segment's samples and their neighbours, (N, 3) m/s.

    `nominal` is a solution over the segment, of one row if only the start is known.
    """
    start, end = float(nominal.time[0]), float(nominal.time[-1])
    count = max(1, int(np.ceil((end - start) / _KNOT)))
    panels = np.zeros((count, 4, 3))
    if len(nominal.time) == 1:
        panels[0, 0] = field.potential_and_gradient(_positions(nominal, ellipsoid, np.zeros(1, np.intp)))[1][0]
        step = 1.0
    else:
        knots = np.linspace(start, end, count + 1)
        values = field.potential_and_gradient(_path(nominal, ellipsoid)(knots))[1]
        step = (end - start) / count
        panels[:, 0], panels[:, 1] = values[:-1], np.diff(values, axis=0) / step
    return disturbance_in_body(samples, nominal, panels, start, step, ellipsoid)


def disturbance_in_body(
    imu: ImuData, solution: NavSolution, panels: Array, start: float, step: float, ellipsoid: Ellipsoid
) -> Array:
    """Return ∫C_bn δg dt over N samples, (N, 3) m/s, with the attitude of a solution at some of their edges.

    `panels` are cubics of the disturbance in Earth-fixed axes, see `DisturbanceAlong`, from `start` in intervals of
    `step`, s. Between rows the attitude follows the rotation of the ellipsoid.
    """
    q_eb = rotation.multiply(earth.q_en(solution.latitude, solution.longitude), solution.q_nb)
    if np.array_equal(solution.time, imu.time):
        rows = np.arange(len(imu.time))
    else:
        rows = np.searchsorted(imu.time, solution.time - 1e-9)
    out = np.empty((len(imu.dtheta), 3))
    _felt_rows(
        np.ascontiguousarray(imu.time), np.ascontiguousarray(imu.dtheta), rows, q_eb, panels, start, step,
        ellipsoid.omega, out,
    )  # fmt: skip
    return out


def _positions(solution: NavSolution, ellipsoid: Ellipsoid, rows: NDArray[np.intp]) -> Array:
    """Return Earth-fixed positions in R of the rows, (R, 3) m."""
    height = np.clip(solution.height[rows], _LOWEST, _HIGHEST)
    return earth.geodetic_to_ecef(solution.latitude[rows], solution.longitude[rows], height, ellipsoid)


def _path(solution: NavSolution, ellipsoid: Ellipsoid) -> Callable[[Array], Array]:
    """Return positions on the straight lines between rows: at a row a second they miss an arc of 1 g by 1 m."""
    time = solution.time

    def at(t: Array) -> Array:
        row = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 2)
        share = ((t - time[row]) / (time[row + 1] - time[row]))[:, None]
        here, there = (_positions(solution, ellipsoid, index) for index in (row, row + 1))
        return np.asarray(here + share * (there - here))

    return at


@kernel
def _felt_rows(
    time: Array, dtheta: Array, rows: NDArray[np.intp], q_eb: Array, panels: Array, start: float, step: float,
    omega: float, out: Array,
) -> None:  # fmt: skip
    """Simpson's rule over each interval, from the attitude at the last row before it turned on by the gyros."""
    row = 0
    q0, q1, q2, q3 = q_eb[0, 0], q_eb[0, 1], q_eb[0, 2], q_eb[0, 3]
    begin = rows[0]
    for k in range(begin - 1, -1, -1):  # the neighbours before the first row: back by their turns
        q0, q1, q2, q3 = multiply_k(
            q0, q1, q2, q3, *quaternion_from_rotation_vector_k(-dtheta[k, 0], -dtheta[k, 1], -dtheta[k, 2])
        )
    for k in range(len(dtheta)):
        if row < len(rows) and rows[row] == k:
            q0, q1, q2, q3 = q_eb[row, 0], q_eb[row, 1], q_eb[row, 2], q_eb[row, 3]
            begin = k
            row += 1
        dt = time[k + 1] - time[k]
        m0, m1, m2, m3 = multiply_k(
            q0, q1, q2, q3,
            *quaternion_from_rotation_vector_k(0.5 * dtheta[k, 0], 0.5 * dtheta[k, 1], 0.5 * dtheta[k, 2]),
        )  # fmt: skip
        e0, e1, e2, e3 = multiply_k(
            q0, q1, q2, q3, *quaternion_from_rotation_vector_k(dtheta[k, 0], dtheta[k, 1], dtheta[k, 2])
        )
        x = y = z = 0.0
        for part in range(3):
            t = time[k] + 0.5 * part * dt
            i = min(max(int((t - start) / step), 0), len(panels) - 1)
            u = t - start - i * step
            gx = panels[i, 0, 0] + u * (panels[i, 1, 0] + u * (panels[i, 2, 0] + u * panels[i, 3, 0]))
            gy = panels[i, 0, 1] + u * (panels[i, 1, 1] + u * (panels[i, 2, 1] + u * panels[i, 3, 1]))
            gz = panels[i, 0, 2] + u * (panels[i, 1, 2] + u * (panels[i, 2, 2] + u * panels[i, 3, 2]))
            # in the inertial axes that coincide with the Earth-fixed ones at the row
            s, c = sin(omega * (t - time[begin])), cos(omega * (t - time[begin]))
            ix, iy = c * gx - s * gy, s * gx + c * gy
            if part == 0:
                a, b, d = rotate_k(q0, -q1, -q2, -q3, ix, iy, gz)
                w = 1.0
            elif part == 1:
                a, b, d = rotate_k(m0, -m1, -m2, -m3, ix, iy, gz)
                w = 4.0
            else:
                a, b, d = rotate_k(e0, -e1, -e2, -e3, ix, iy, gz)
                w = 1.0
            x, y, z = x + w * a, y + w * b, z + w * d
        out[k, 0], out[k, 1], out[k, 2] = dt / 6.0 * x, dt / 6.0 * y, dt / 6.0 * z
        q0, q1, q2, q3 = e0, e1, e2, e3
