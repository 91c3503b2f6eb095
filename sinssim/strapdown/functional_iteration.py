"""Attitude, velocity and position by functional iteration over windows of samples: the reference of the comparison.

Rate and specific force over a window are the polynomials whose integrals over its samples are the increments. The
unknowns are carried by their values at Chebyshev points; the integral equations

    q = 1 + ½ ∫ q ∘ ω dt                                     body, relative to its axes at the window's start
    v = v₀ + ∫ (C_wb f + g − (2ω_ie + ω_ew) × v) dt           and position, and the turn of the navigation frame

are iterated (Picard) at these points until nothing changes beyond rounding, with integrals by the Chebyshev
integration matrix. What is left is how well the polynomials describe the motion. Quaternion: Wu, Y., "RodFIter:
attitude reconstruction from inertial measurement by functional iteration", IEEE Trans. AES 54 (2018) 2131, and Wu, Y.,
Yan, G., "Attitude reconstruction from inertial measurements: QuatFIter and its comparison with RodFIter", IEEE Trans.
AES 55 (2019) 3629; with velocity and position: Wu, Y., "iNavFIter: next-generation inertial navigation computation
based on functional iteration", IEEE Trans. AES 56 (2020) 2061.

A window takes eight samples, and the solution has a row at the end of every sample. Samples left over at the end are
navigated with a polynomial through the last eight.

The level frame is the transverse frame whose pole is the Earth's own. The inertial frame has a file of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.earth import EarthParameters
from sinssim.errors import InputError
from sinssim.jit import inline, kernel
from sinssim.rotation import (
    dcm_from_quaternion_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
)
from sinssim.strapdown.azimuth import (
    TRANSVERSE,
    coriolis_k,
    earth_k,
    into_w_k,
    third_row_k,
    transport_k,
    turned_k,
)
from sinssim.strapdown.vertical import BARO_LOOP, HELD, loop_gains_k

Long = NDArray[np.longdouble]

WINDOW = 8
"""Samples of a window."""
NODES = 12
"""Chebyshev points of a window, its ends among them."""

MOST_ITERATIONS = 60  # convergence is factorial: a turn by 10 rad in a window is through in half of that
_BLOCK = 1024  # windows whose tables are made at once when intervals are unequal


class Windows(NamedTuple):
    """Windows of samples, and the tables for them; times are scaled to a window's length.

    first, size: first sample and number of samples that the window navigates, (K,) int.
    fit: first sample of its polynomials, (K,) int.
    table: which of the T tables serves it, (K,) int.
    rate: increments to rate times length at the nodes, (T, NODES, WINDOW).
    edge: values at the nodes to those at the ends of the samples, (T, WINDOW, NODES).
    height: reference at the edges of the fitted samples to that at the nodes, linear in between, (T, NODES, WINDOW+1).
    integral: values at the nodes to integrals from the window's start to the nodes, (NODES, NODES).
    """

    first: NDArray[np.intp]
    size: NDArray[np.intp]
    fit: NDArray[np.intp]
    table: NDArray[np.intp]
    rate: Array
    edge: Array
    height: Array
    integral: Array


def _integrals(x: Long, degree: int) -> Long:
    """Return ∫ Tₘ(2x − 1) dx from 0 to x for m = 0…degree, (..., degree+1)."""
    one = np.eye(degree + 1, dtype=np.longdouble)
    primitive = np.stack([chebyshev.chebint(row, lbnd=-1) for row in one], axis=1)
    return np.asarray(0.5 * chebyshev.chebvander(2.0 * x - 1.0, degree + 1) @ primitive)


def _tables(edges: Array, skipped: int) -> tuple[Array, Array, Array]:
    """Return the tables `rate`, `edge` and `height` of K windows.

    edges: times of the fitted samples' edges, (K, WINDOW+1) s; the first `skipped` samples are fitted only.
    """
    start, length = edges[:, skipped, None], edges[:, -1, None] - edges[:, skipped, None]
    x = ((edges - start) / length).astype(np.longdouble)
    nodes = chebyshev_points()
    # increments = ∫ polynomial: rate at the nodes = T(nodes) (∫T)⁻¹ increments
    over_samples = np.diff(_integrals(x, WINDOW - 1), axis=1)
    rate = chebyshev.chebvander(2.0 * nodes - 1.0, WINDOW - 1) @ _inverse(over_samples)
    edge = np.zeros((len(edges), WINDOW, NODES))
    at_edges = chebyshev.chebvander(2.0 * x[:, skipped + 1 :] - 1.0, NODES - 1)
    edge[:, : WINDOW - skipped] = at_edges @ _inverse(chebyshev.chebvander(2.0 * nodes - 1.0, NODES - 1))
    return rate.astype(np.float64), edge, np.maximum(0.0, 1.0 - _distance(x, nodes)).astype(np.float64)


def _inverse(matrix: Long) -> Long:
    """Return the inverse in extended precision, by Newton's iteration from that in double precision.

    The tables serve every window of a run: their rounding would not average out.
    """
    inverse = np.linalg.inv(matrix.astype(np.float64)).astype(np.longdouble)
    two = 2.0 * np.eye(matrix.shape[-1], dtype=np.longdouble)
    for _ in range(2):
        inverse = inverse @ (two - matrix @ inverse)
    return np.asarray(inverse)


def _distance(x: Long, nodes: Long) -> Long:
    """Return how far nodes are from edges, in the sample between them, (K, NODES, WINDOW+1)."""
    width = np.diff(x, axis=1)
    ahead = (nodes[None, :, None] - x[:, None, :]) / np.concatenate([width, width[:, -1:]], axis=1)[:, None, :]
    behind = (x[:, None, :] - nodes[None, :, None]) / np.concatenate([width[:, :1], width], axis=1)[:, None, :]
    return np.asarray(np.maximum(ahead, behind))


def chebyshev_points() -> Long:
    """Return the Chebyshev points of [0, 1], its ends among them, (NODES,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(NODES) / (NODES - 1)), dtype=np.longdouble)


def windows(time: Array, uniform: bool) -> Iterator[Windows]:
    """Yield the windows that cover the data, with their tables, some at a time.

    Args:
        time: edges of the intervals, (N+1,) s.
        uniform: whether all intervals are equal.

    Yields:
        Windows in order; the last may navigate fewer samples.

    Raises:
        InputError: for fewer samples than a window takes.
    """
    samples = len(time) - 1
    if samples < WINDOW:
        raise InputError(f"functional-iteration works on windows of {WINDOW} samples; the data hold {samples}.")
    whole, left = divmod(samples, WINDOW)
    nodes = chebyshev_points()
    to_coefficients = _inverse(chebyshev.chebvander(2.0 * nodes - 1.0, NODES - 1))
    integral = np.ascontiguousarray(_integrals(nodes, NODES - 1) @ to_coefficients, dtype=np.float64)
    step = whole if uniform else _BLOCK
    for begin in range(0, whole, step):
        first = np.arange(begin, min(begin + step, whole)) * WINDOW
        if uniform:
            edges, table = np.arange(WINDOW + 1.0)[None, :], np.zeros(len(first), dtype=np.intp)
        else:
            edges, table = time[first[:, None] + np.arange(WINDOW + 1)], np.arange(len(first))
        yield Windows(first, np.full(len(first), WINDOW), first, table, *_tables(edges, 0), integral)
    if left:
        fit = samples - WINDOW
        one = np.array([0], dtype=np.intp)
        tables = _tables(time[None, fit:], WINDOW - left)
        yield Windows(one + samples - left, one + left, one + fit, one, *tables, integral)


@inline
def integrate_k(matrix: Array, rate: Array, c: int, start: float, out: Array) -> None:
    """Row c of `out` = start + ∫ of row c of `rate`, at all nodes."""
    for j in range(NODES):
        total = 0.0
        for i in range(NODES):
            total += matrix[j, i] * rate[c, i]
        out[c, j] = start + total


@inline
def interpolate_k(weights: Array, i: int, value: Array, c: int) -> float:
    """Value of row c at the end of the window's sample i."""
    total = 0.0
    for j in range(NODES):
        total += weights[i, j] * value[c, j]
    return total


@kernel
def body_k(
    dtheta: Array,
    dvel: Array,
    fit: int,
    table: Array,
    integral: Array,
    rate: Array,
    work: Array,
    q: Array,
    force: Array,
) -> None:
    """Motion of the body in a window, in its axes at the window's start.

    Fills, at the nodes: q, (4, NODES), its attitude; force, (3, NODES), specific force times the window's length.
    `rate` (6, NODES) and `work` (4, NODES) are room for work.
    """
    for j in range(NODES):
        for c in range(3):
            w, f = 0.0, 0.0
            for i in range(WINDOW):
                w += table[j, i] * dtheta[fit + i, c]
                f += table[j, i] * dvel[fit + i, c]
            rate[c, j], rate[3 + c, j] = w, f
    for c in range(3):
        integrate_k(integral, rate, c, 0.0, work)
    for j in range(NODES):  # to begin with, the increments taken for a rotation vector
        q[0, j], q[1, j], q[2, j], q[3, j] = quaternion_from_rotation_vector_k(work[0, j], work[1, j], work[2, j])
    e0, e1, e2, e3 = q[0, NODES - 1], q[1, NODES - 1], q[2, NODES - 1], q[3, NODES - 1]
    for _ in range(MOST_ITERATIONS):
        for j in range(NODES):  # q̇ = ½ q ∘ ω
            work[0, j], work[1, j], work[2, j], work[3, j] = multiply_k(
                q[0, j], q[1, j], q[2, j], q[3, j], 0.0, 0.5 * rate[0, j], 0.5 * rate[1, j], 0.5 * rate[2, j]
            )
        integrate_k(integral, work, 0, 1.0, q)
        integrate_k(integral, work, 1, 0.0, q)
        integrate_k(integral, work, 2, 0.0, q)
        integrate_k(integral, work, 3, 0.0, q)
        last = NODES - 1
        change = max(max(abs(q[0, last] - e0), abs(q[1, last] - e1)), max(abs(q[2, last] - e2), abs(q[3, last] - e3)))
        e0, e1, e2, e3 = q[0, last], q[1, last], q[2, last], q[3, last]
        if change < 1e-15:
            break
    for j in range(NODES):
        force[0, j], force[1, j], force[2, j] = rotate_k(
            q[0, j], q[1, j], q[2, j], q[3, j], rate[3, j], rate[4, j], rate[5, j]
        )


@kernel
def _navigate(
    first: NDArray[np.intp],
    size: NDArray[np.intp],
    fit: NDArray[np.intp],
    table: NDArray[np.intp],
    rate_table: Array,
    edge_table: Array,
    height_table: Array,
    integral: Array,
    time: Array,
    dtheta: Array,
    dvel: Array,
    p: EarthParameters,
    gravity: int,
    simplified: bool,
    vertical: int,
    height_reference: Array,
    climb_reference: Array,
    time_constant: float,
    rule: int,
    axis: Array,
    state: Array,
    latitude: Array,
    longitude: Array,
    height: Array,
    velocity: Array,
    q_nb: Array,
    defect: Array,
) -> None:
    omega = p.omega
    body_rate, work, q, force = np.empty((6, NODES)), np.empty((4, NODES)), np.empty((4, NODES)), np.empty((3, NODES))
    # rows of y and its rate: v (0…2), h (3), turn ρ of w relative to the Earth (4…6) and ζ to inertial space (7…9),
    # integral part of the baro loop (10)
    y, rate = np.empty((11, NODES)), np.zeros((11, NODES))
    reference, climb = np.zeros(NODES), np.zeros(NODES)
    e0, e1, e2, e3 = state[0], state[1], state[2], state[3]  # q_ew
    a0, a1, a2, a3 = state[4], state[5], state[6], state[7]  # q_wb
    vx, vy, vz, h = state[8], state[9], state[10], state[11]
    loop_sum = state[12]
    q0, q1, q2, q3 = state[13], state[14], state[15], state[16]
    kx0, ky0, kz0 = third_row_k(e0, e1, e2, e3)
    k2, kappa, along, down = earth_k(p, gravity, simplified, kx0, ky0, kz0, h)
    loop1, loop2, loop3 = loop_gains_k(time_constant, down, k2)

    for n in range(first.shape[0]):
        start, m, t = first[n], size[n], table[n]
        length = time[start + m] - time[start]
        body_k(dtheta, dvel, fit[n], rate_table[t], integral, body_rate, work, q, force)
        scale = 1.5 - 0.5 * (a0 * a0 + a1 * a1 + a2 * a2 + a3 * a3)
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quaternion_k(
            scale * a0, scale * a1, scale * a2, scale * a3
        )
        for j in range(NODES):
            fx, fy, fz = force[0, j], force[1, j], force[2, j]
            force[0, j] = c11 * fx + c12 * fy + c13 * fz
            force[1, j] = c21 * fx + c22 * fy + c23 * fz
            force[2, j] = c31 * fx + c32 * fy + c33 * fz
        if vertical != 0:
            for j in range(NODES):
                reference[j], climb[j] = 0.0, 0.0
                for i in range(WINDOW + 1):
                    reference[j] += height_table[t, j, i] * height_reference[fit[n] + i]
                    if vertical == HELD:
                        climb[j] += height_table[t, j, i] * climb_reference[fit[n] + i]

        # --- to begin with: gravity and Coriolis of the start, position on a straight line
        kx0, ky0, kz0 = third_row_k(e0, e1, e2, e3)
        px0, py0, pz0 = into_w_k(e0, e1, e2, e3, axis[0], axis[1], axis[2])
        k2, kappa, along, down = earth_k(p, gravity, simplified, kx0, ky0, kz0, h)
        tx, ty, tz = transport_k(rule, omega, kx0, ky0, kz0, px0, pz0, k2, kappa, vx, vy)
        gx, gy, gz = coriolis_k(omega, kx0, ky0, kz0, tx, ty, tz, vx, vy, vz)
        for j in range(NODES):
            rate[0, j] = force[0, j] + length * (gx + along * kx0)
            rate[1, j] = force[1, j] + length * (gy + along * ky0)
            rate[2, j] = force[2, j] + length * (gz + down)
            rate[3, j], rate[4, j], rate[5, j], rate[6, j] = -length * vz, length * tx, length * ty, length * tz
            rate[7, j] = length * (omega * kx0 + tx)
            rate[8, j] = length * (omega * ky0 + ty)
            rate[9, j] = length * (omega * kz0 + tz)
        for c in range(11):
            begin = (vx, vy, vz, h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, loop_sum)[c]
            integrate_k(integral, rate, c, begin, y)

        for _ in range(MOST_ITERATIONS):
            for j in range(NODES):
                rx, ry, rz = y[4, j], y[5, j], y[6, j]
                zx, zy, zz = y[7, j], y[8, j], y[9, j]
                kx, ky, kz = turned_k(kx0, ky0, kz0, rx, ry, rz)
                px, _, pz = turned_k(px0, py0, pz0, rx, ry, rz)
                ux, uy, uz, hj = y[0, j], y[1, j], y[2, j], y[3, j]
                if vertical == HELD:
                    uz, hj = climb[j], reference[j]
                k2, kappa, along, down = earth_k(p, gravity, simplified, kx, ky, kz, hj)
                tx, ty, tz = transport_k(rule, omega, kx, ky, kz, px, pz, k2, kappa, ux, uy)
                gx, gy, gz = coriolis_k(omega, kx, ky, kz, tx, ty, tz, ux, uy, uz)
                fx, fy, fz = turned_k(force[0, j], force[1, j], force[2, j], zx, zy, zz)
                rate[0, j] = fx + length * (gx + along * kx)
                rate[1, j] = fy + length * (gy + along * ky)
                rate[2, j] = fz + length * (gz + down)
                rate[3, j] = -length * uz
                # ρ̇ = ω_ew + ½ ρ × ω_ew: what follows is below rounding for turns as small as these
                tx, ty, tz = length * tx, length * ty, length * tz
                rate[4, j] = tx + 0.5 * (ry * tz - rz * ty)
                rate[5, j] = ty + 0.5 * (rz * tx - rx * tz)
                rate[6, j] = tz + 0.5 * (rx * ty - ry * tx)
                tx, ty, tz = tx + length * omega * kx, ty + length * omega * ky, tz + length * omega * kz
                rate[7, j] = tx + 0.5 * (zy * tz - zz * ty)
                rate[8, j] = ty + 0.5 * (zz * tx - zx * tz)
                rate[9, j] = tz + 0.5 * (zx * ty - zy * tx)
                if vertical == BARO_LOOP:
                    e = hj - reference[j]
                    rate[3, j] -= length * loop1 * e
                    rate[2, j] += length * (loop2 * e + y[10, j])
                    rate[10, j] = length * loop3 * e
            endx, endy, endz = y[0, NODES - 1], y[1, NODES - 1], y[2, NODES - 1]
            for c in range(11):
                begin = (vx, vy, vz, h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, loop_sum)[c]
                integrate_k(integral, rate, c, begin, y)
            change = max(max(abs(y[0, NODES - 1] - endx), abs(y[1, NODES - 1] - endy)), abs(y[2, NODES - 1] - endz))
            if change < 1e-10:  # the next one is smaller by the turn of the frame in the window, 1e-5
                break

        # --- output relative to geodetic north at the end of each sample
        for i in range(m):
            k = start + i + 1
            vx, vy, vz = (
                interpolate_k(edge_table[t], i, y, 0),
                interpolate_k(edge_table[t], i, y, 1),
                interpolate_k(edge_table[t], i, y, 2),
            )
            h = interpolate_k(edge_table[t], i, y, 3)
            if vertical == HELD:
                vz, h = climb_reference[k], height_reference[k]
            r0, r1, r2, r3 = quaternion_from_rotation_vector_k(
                interpolate_k(edge_table[t], i, y, 4),
                interpolate_k(edge_table[t], i, y, 5),
                interpolate_k(edge_table[t], i, y, 6),
            )
            f0, f1, f2, f3 = multiply_k(e0, e1, e2, e3, r0, r1, r2, r3)
            b0, b1, b2, b3 = multiply_k(
                a0, a1, a2, a3,
                interpolate_k(edge_table[t], i, q, 0), interpolate_k(edge_table[t], i, q, 1),
                interpolate_k(edge_table[t], i, q, 2), interpolate_k(edge_table[t], i, q, 3),
            )  # fmt: skip
            z0, z1, z2, z3 = quaternion_from_rotation_vector_k(
                -interpolate_k(edge_table[t], i, y, 7),
                -interpolate_k(edge_table[t], i, y, 8),
                -interpolate_k(edge_table[t], i, y, 9),
            )
            b0, b1, b2, b3 = multiply_k(z0, z1, z2, z3, b0, b1, b2, b3)
            kx, ky, kz = third_row_k(f0, f1, f2, f3)
            azimuth = -atan2(ky, kx)
            latitude[k] = atan2(-kz, sqrt(kx * kx + ky * ky))
            longitude[k] = atan2(-2.0 * (f2 * f3 - f0 * f1), -2.0 * (f1 * f3 + f0 * f2))
            height[k] = h
            ca, sa = cos(azimuth), sin(azimuth)
            velocity[k, 0], velocity[k, 1], velocity[k, 2] = ca * vx - sa * vy, sa * vx + ca * vy, vz
            scale = 0.5 * (b0 * b0 + b1 * b1 + b2 * b2 + b3 * b3 - 1.0)
            defect[k] = abs(scale)
            scale = 1.0 - scale
            r0, r1, r2, r3 = multiply_k(
                cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth), scale * b0, scale * b1, scale * b2, scale * b3
            )
            if q0 * r0 + q1 * r1 + q2 * r2 + q3 * r3 < 0.0:  # the sign that makes the stream continuous
                r0, r1, r2, r3 = -r0, -r1, -r2, -r3
            q0, q1, q2, q3 = r0, r1, r2, r3
            q_nb[k, 0], q_nb[k, 1], q_nb[k, 2], q_nb[k, 3] = q0, q1, q2, q3
        # the last sample's end is where the next window starts
        a0, a1, a2, a3 = b0, b1, b2, b3
        scale = 1.5 - 0.5 * (f0 * f0 + f1 * f1 + f2 * f2 + f3 * f3)
        e0, e1, e2, e3 = scale * f0, scale * f1, scale * f2, scale * f3
        loop_sum = y[10, NODES - 1]

    state[0], state[1], state[2], state[3] = e0, e1, e2, e3
    state[4], state[5], state[6], state[7] = a0, a1, a2, a3
    state[8], state[9], state[10], state[11], state[12] = vx, vy, vz, h, loop_sum
    state[13], state[14], state[15], state[16] = q0, q1, q2, q3


def engine(frame: str) -> Callable[..., None]:
    """Return the engine of a frame; it brings its own, so no template takes parts from this file.

    Args:
        frame: one of `sinssim.FRAMES`.

    Returns:
        A function of the data, the channel, the azimuth's rule and its pole, and the solution's arrays.
    """
    if frame == "inertial":
        from sinssim.strapdown import functional_inertial

        return functional_inertial.navigate_windows
    return _navigate_windows if frame != "level" else _navigate_north


def _navigate_north(
    time: Array, dtheta: Array, dvel: Array, uniform: bool, p: EarthParameters, gravity: int, simplified: bool,
    vertical: int, height_reference: Array, climb_reference: Array, time_constant: float, rule: int, axis: Array,
    *out: Array,
) -> None:  # fmt: skip
    """Navigate in the north-pointing frame: transverse, its pole the Earth's."""
    _navigate_windows(
        time, dtheta, dvel, uniform, p, gravity, simplified, vertical, height_reference, climb_reference,
        time_constant, TRANSVERSE, np.array([0.0, 0.0, 1.0]), *out,
    )  # fmt: skip


def _navigate_windows(
    time: Array, dtheta: Array, dvel: Array, uniform: bool, p: EarthParameters, gravity: int, simplified: bool,
    vertical: int, height_reference: Array, climb_reference: Array, time_constant: float, rule: int, axis: Array,
    latitude: Array, longitude: Array, height: Array, velocity: Array, q_nb: Array, defect: Array,
) -> None:  # fmt: skip
    """Navigate in a local-level frame; the arrays' first rows hold the initial state."""
    q_en = earth.q_en(latitude[0], longitude[0])
    azimuth = 0.0
    if rule == TRANSVERSE:
        pole = rotation.rotate(rotation.conjugate(q_en), axis)
        azimuth = atan2(float(pole[1]), float(pole[0]))
    q_nw = np.array([cos(0.5 * azimuth), 0.0, 0.0, sin(0.5 * azimuth)])
    state = np.zeros(17)
    state[:4] = rotation.multiply(q_en, q_nw)
    state[4:8] = rotation.multiply(rotation.conjugate(q_nw), q_nb[0])
    state[8:11] = rotation.rotate(rotation.conjugate(q_nw), velocity[0])
    state[11] = height[0]
    state[13:17] = q_nb[0]
    defect[0] = 0.0
    for block in windows(time, uniform):
        _navigate(
            *block, time, dtheta, dvel, p, gravity, simplified, vertical, height_reference, climb_reference,
            time_constant, rule, axis, state, latitude, longitude, height, velocity, q_nb, defect,
        )  # fmt: skip
