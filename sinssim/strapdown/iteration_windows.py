"""Windows of samples for functional iteration: Chebyshev tables, integration, and the body's motion in a window.

See `functional_iteration` for the method and its sources.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import (
    Quaternion,
    Vector,
    dcm_from_quaternion_k,
    multiply_k,
    quaternion_from_rotation_vector_k,
    rotate_k,
)
from sinssim.rotation.vectors import column, keep_column, resolved, sub
from sinssim.strapdown.frames.vertical_channel import HELD

Long = NDArray[np.longdouble]

WINDOW = 8
"""Number of samples in a window."""
NODES = 12
"""Number of Chebyshev points of a window, including its ends."""

MOST_ITERATIONS = 60  # convergence is factorial: a rotation by 10 rad in a window needs half of these iterations
_BLOCK = 1024  # number of windows whose tables are made at once for unequal intervals


class Windows(NamedTuple):
    """Windows of samples, and the tables for them; times are scaled to a window's length.

    first, size: first sample and number of samples navigated in the window, (K,) int.
    fit: first sample of its polynomials, (K,) int.
    table: number of its table, of T tables, (K,) int.
    rate: matrix from increments to rate times length at the nodes, (T, NODES, WINDOW).
    edge: matrix from values at the nodes to those at the ends of the samples, (T, WINDOW, NODES).
    height: matrix from references at the edges of the fitted samples to those at the nodes, linear in between, (T,
        NODES, WINDOW+1).
    integral: matrix from values at the nodes to integrals from the window's start, (NODES, NODES).
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
    identity = np.eye(degree + 1, dtype=np.longdouble)
    primitive = np.stack([chebyshev.chebint(row, lbnd=-1) for row in identity], axis=1)
    return np.asarray(0.5 * chebyshev.chebvander(2.0 * x - 1.0, degree + 1) @ primitive)


def _tables(edges: Array, skipped: int) -> tuple[Array, Array, Array]:
    """Return the tables `rate`, `edge` and `height` of K windows.

    edges: times of the edges of the fitted samples, (K, WINDOW+1) s; the first `skipped` samples are only fitted.
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
    """Return the inverse in extended precision, by Newton's iteration from the inverse in double precision.

    The tables are used in every window of a run, so their rounding errors would not average out.
    """
    inverse = np.linalg.inv(matrix.astype(np.float64)).astype(np.longdouble)
    two = 2.0 * np.eye(matrix.shape[-1], dtype=np.longdouble)
    for _ in range(2):
        inverse = inverse @ (two - matrix @ inverse)
    return np.asarray(inverse)


def _distance(x: Long, nodes: Long) -> Long:
    """Return the distances of nodes from edges within samples, (K, NODES, WINDOW+1)."""
    width = np.diff(x, axis=1)
    ahead = (nodes[None, :, None] - x[:, None, :]) / np.concatenate([width, width[:, -1:]], axis=1)[:, None, :]
    behind = (x[:, None, :] - nodes[None, :, None]) / np.concatenate([width[:, :1], width], axis=1)[:, None, :]
    return np.asarray(np.maximum(ahead, behind))


def chebyshev_points() -> Long:
    """Return the Chebyshev points of [0, 1], including its ends, (NODES,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(NODES) / (NODES - 1)), dtype=np.longdouble)


def windows(time: Array, uniform: bool) -> Iterator[Windows]:
    """Yield the windows that cover the data, in order, with their tables; the last may navigate fewer samples."""
    samples = len(time) - 1
    if samples < WINDOW:
        raise InputError(f"functional-iteration needs windows of {WINDOW} samples; the data have only {samples}.")
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
        zero = np.array([0], dtype=np.intp)
        tables = _tables(time[None, fit:], WINDOW - left)
        yield Windows(zero + samples - left, zero + left, zero + fit, zero, *tables, integral)


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


@inline
def interpolate_vector_k(weights: Array, i: int, value: Array, c: int) -> Vector:
    """Values of the rows c … c + 2 at the end of the window's sample i."""
    return (
        interpolate_k(weights, i, value, c),
        interpolate_k(weights, i, value, c + 1),
        interpolate_k(weights, i, value, c + 2),
    )


@inline
def turned_on_k(a: Quaternion, weights: Array, i: int, q: Array) -> Quaternion:
    """Attitude a of the window's start, turned on by the body's rotation until the end of the window's sample i."""
    return multiply_k(
        *a,
        interpolate_k(weights, i, q, 0), interpolate_k(weights, i, q, 1),
        interpolate_k(weights, i, q, 2), interpolate_k(weights, i, q, 3),
    )  # fmt: skip


@inline
def height_at_nodes_k(
    vertical: int, table: Array, fit: int, height_reference: Array, climb_reference: Array, height: Array, climb: Array
) -> None:
    """Fill in the height reference at the nodes, (NODES,), and its rate where the channel is held to both."""
    for j in range(NODES):
        height[j], climb[j] = 0.0, 0.0
        for i in range(WINDOW + 1):
            height[j] += table[j, i] * height_reference[fit + i]
            if vertical == HELD:
                climb[j] += table[j, i] * climb_reference[fit + i]


@inline
def integrate_rows_k(matrix: Array, rate: Array, start: Array, out: Array) -> float:
    """Integrate all rows from their values at the start; return the largest change of the first three at the end."""
    before = column(out, 0, NODES - 1)
    for row in range(rate.shape[0]):
        integrate_k(matrix, rate, row, start[row], out)
    x, y, z = sub(column(out, 0, NODES - 1), before)
    return max(max(abs(x), abs(y)), abs(z))


@inline
def resolve_force_k(q: Quaternion, force: Array) -> None:
    """Turn the specific force at the nodes into the axes in which a quaternion near one of unit norm gives the body."""
    scale = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    c = dcm_from_quaternion_k(scale * q[0], scale * q[1], scale * q[2], scale * q[3])
    for j in range(NODES):
        keep_column(force, 0, j, resolved(c, column(force, 0, j)))


@inline
def unit_k(q: Quaternion) -> tuple[Quaternion, float]:
    """Unit quaternion of one with a norm near one, and how far the norm is from it."""
    excess = 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0)
    scale = 1.0 - excess
    return (scale * q[0], scale * q[1], scale * q[2], scale * q[3]), abs(excess)


class Work(NamedTuple):
    """Arrays of one engine: of the body, see `body_k`; the unknowns y with their rates and values at the start of a
    window; reference and its rate at the nodes, (NODES,)."""

    body_rate: Array
    work: Array
    q: Array
    force: Array
    y: Array
    rate: Array
    start: Array
    reference: Array
    climb: Array


def work_space(rows: int) -> Work:
    """Return the arrays for a number of unknowns."""
    shapes = (6, NODES), (4, NODES), (4, NODES), (3, NODES), (rows, NODES), (rows, NODES), (rows,), (NODES,), (NODES,)
    return Work(*(np.zeros(shape) for shape in shapes))


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
    """Compute the motion of the body in a window, in its axes at the window's start.

    Fills, at the nodes: q, (4, NODES), its attitude; force, (3, NODES), specific force times the window's length.
    `rate` (6, NODES) and `work` (4, NODES) are work space.
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
    for j in range(NODES):  # initial value: the increments as a rotation vector
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
