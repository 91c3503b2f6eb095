"""Increments of an interval with coning and sculling compensation, and the turns of body and navigation frame.

Attitude and velocity of a body under rate ω and specific force f are one motion of SE(3): Y' = Y (ω, f). Its logarithm
over an interval is given by the sixth-order Magnus series in the commutator-saving form of Blanes, Casas and Ros (BIT
40, 2000, eq. 3.10), with signs for Y' = Y A. The rotation part is the rotation vector φ, whose brackets are coning
(Bortz 1971); the translation part ν contains sculling and rotation compensation, and the velocity increment in the axes
at the interval's start is Δv = J(φ) ν.

A polynomial of the fourth degree is fitted to the increments of five neighbouring intervals (its integral over each is
the increment), centred on the interval as far as the ends of the data allow. The engine needs only the moments over
that interval, so the fit is a set of weights: a₂ = Σ w₂ⱼ Δⱼ and a₃ = Σ w₃ⱼ Δⱼ, where rate × T ≈ a₁ + a₂ s + a₃ s² over
s ∈ [−½, ½] in the sense of the moments of Blanes, Casas and Ros (BIT 40, 2000, sec. 3): a₂ = 12 A₁, a₃ = 180 A₂ − 15
A₀, a₁ = A₀ − a₃/12, with Aᵢ = ∫ sⁱ rate T ds.

A body's turns depend only on the increments and not on each other, so that the processor's vector unit can compute
several intervals in one operation. For this, the loop over a block has no branches, and each quantity is in its own
row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import SERIES, Vector, cross_k, rotation_series_k, small_rotation_series_k
from sinssim.rotation.vectors import simpson

Twist = tuple[float, float, float, float, float, float]

COEFFICIENTS = (
    (0.0, 0.0, 0.0),
    (2 / 3, 0.0, 0.0),  # Ignagni 1990
    (27 / 40, 9 / 20, 0.0),  # Miller 1983
    (214 / 315, 46 / 105, 54 / 105),  # Ignagni 1996: (214, 92, 54)/105 over 3, 2 and 1 pairs
)
"""Classical compensation of n samples by their products (`attitude.rotation_vector`): K_s of a pair of samples at
distance s = 1, 2, 3, one row for each number of samples."""

PREVIOUS_COEFFICIENT = 1 / 12  # Ignagni 1990, Savage 1998: φ = Δθ + Δθ₋₁ × Δθ/12

EDGE = (
    (1.0, 0.0, 0.0, 0.0),
    (3.0, -1.0, 0.0, 0.0),
    (11 / 2, -7 / 2, 1.0, 0.0),
    (25 / 3, -23 / 3, 13 / 3, -1.0),
)
"""Weights of the samples, first to last, that give the update's length times the specific force at its start, from the
polynomial whose integrals over the samples are the increments; in reverse order, at its end."""


@inline
def bracket_k(
    ax: float, ay: float, az: float, au: float, av: float, aw: float,
    bx: float, by: float, bz: float, bu: float, bv: float, bw: float,
) -> Twist:  # fmt: skip
    """Lie bracket of two twists (ω, f): (ω_a × ω_b, ω_a × f_b + f_a × ω_b)."""
    return (
        ay * bz - az * by,
        az * bx - ax * bz,
        ax * by - ay * bx,
        (ay * bw - az * bv) + (av * bz - aw * by),
        (az * bu - ax * bw) + (aw * bx - au * bz),
        (ax * bv - ay * bu) + (au * by - av * bx),
    )


@inline
def logarithm_k(a0: Twist, a2: Twist, a3: Twist) -> Twist:
    """Rotation vector φ and translation part ν of an interval.

    a0 is the pair of measured increments, a2 and a3 the fitted moments of `sinssim.strapdown.coning_sculling`.
    """
    # a1 = a0 − a3/12
    x1, y1, z1 = a0[0] - a3[0] / 12, a0[1] - a3[1] / 12, a0[2] - a3[2] / 12
    u1, v1, w1 = a0[3] - a3[3] / 12, a0[4] - a3[4] / 12, a0[5] - a3[5] / 12
    # C1 = −[a1, a2]
    cx, cy, cz, cu, cv, cw = bracket_k(
        a2[0], a2[1], a2[2], a2[3], a2[4], a2[5], x1, y1, z1, u1, v1, w1
    )  # fmt: skip
    # C2 = [a1, 2 a3 + C1]/60
    dx, dy, dz, du, dv, dw = bracket_k(
        x1, y1, z1, u1, v1, w1,
        2 * a3[0] + cx, 2 * a3[1] + cy, 2 * a3[2] + cz, 2 * a3[3] + cu, 2 * a3[4] + cv, 2 * a3[5] + cw,
    )  # fmt: skip
    # log = a0 + [20 a1 + a3 − C1, a2 + C2]/240
    ex, ey, ez, eu, ev, ew = bracket_k(
        20 * x1 + a3[0] - cx, 20 * y1 + a3[1] - cy, 20 * z1 + a3[2] - cz,
        20 * u1 + a3[3] - cu, 20 * v1 + a3[4] - cv, 20 * w1 + a3[5] - cw,
        a2[0] + dx / 60, a2[1] + dy / 60, a2[2] + dz / 60, a2[3] + du / 60, a2[4] + dv / 60, a2[5] + dw / 60,
    )  # fmt: skip
    s = 1.0 / 240.0
    return a0[0] + s * ex, a0[1] + s * ey, a0[2] + s * ez, a0[3] + s * eu, a0[4] + s * ev, a0[5] + s * ew


@inline
def velocity_increment_k(
    px: float, py: float, pz: float, nx: float, ny: float, nz: float, b: float, c: float
) -> Vector:  # fmt: skip
    """Δv = J(φ) ν = ν + b φ×ν + c φ×(φ×ν) with b = (1 − cos φ)/φ² and c = (φ − sin φ)/φ³."""
    ax, ay, az = cross_k(px, py, pz, nx, ny, nz)
    bx, by, bz = cross_k(px, py, pz, ax, ay, az)
    return nx + b * ax + c * bx, ny + b * ay + c * by, nz + b * az + c * bz


WINDOW = 5
"""Number of neighbouring intervals in a fit."""

UNIFORM = 1e-6
"""Intervals that differ by less than this fraction count as equal."""


def is_uniform(time: Array) -> bool:
    """Return whether all intervals between the edges are equal, to `UNIFORM`."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    deviation = 0.0
    for start in range(0, len(time) - 1, 65536):  # in blocks, to avoid a temporary as long as the data
        block = np.diff(time[start : start + 65537])
        deviation = max(deviation, float(np.max(np.abs(block - step))))
    return bool(deviation <= UNIFORM * step)


def moment_weights(edges: Array, position: NDArray[np.intp]) -> Array:
    """Return the weights of a₂ and a₃ for fits over given windows, (M, 10).

    `edges` are those of each window's n intervals, (M, n+1) s, and `position` is the number of the fitted interval in
    it. w₂ is in columns 0…4 and w₃ in columns 5…9; columns beyond n are zero.
    """
    count, n = len(edges), edges.shape[1] - 1
    rows = np.arange(count)
    left, right = edges[rows, position], edges[rows, position + 1]
    s = (edges - 0.5 * (left + right)[:, None]) / (right - left)[:, None]
    powers = np.arange(1, n + 1)
    raised = s[:, :, None] ** powers / powers  # ∫ s^(m−1) ds = s^m/m
    integrals = np.diff(raised, axis=1)  # (M, interval j, power m)
    # moments of s^m over [−½, ½] with s and s²: ∫ s^(m+i) ds
    moments = np.zeros((n, 2))
    for m in range(n):
        for i in (1, 2):
            if (m + i) % 2 == 0:
                moments[m, i - 1] = 2.0 * 0.5 ** (m + i + 1) / (m + i + 1)
    # increments = integrals @ c, A_i = moments_iᵀ c  ⇒  weights_i solve integralsᵀ w = moments_i
    solved = np.linalg.solve(np.swapaxes(integrals, 1, 2), np.broadcast_to(moments, (count, n, 2)))
    weights = np.zeros((count, 2 * WINDOW))
    weights[:, :n] = 12.0 * solved[:, :, 0]
    weights[:, WINDOW : WINDOW + n] = 180.0 * solved[:, :, 1]
    weights[rows, WINDOW + position] -= 15.0
    return weights


def weight_table(time: Array, uniform: bool) -> Array:
    """Return the weights of `moment_weights` for the engine, of intervals with the given edges.

    For uniform intervals there is one row for each position in the window, (min(N, 5), 10); otherwise one for each
    interval, (N, 10).
    """
    count = len(time) - 1
    n = min(count, WINDOW)
    if uniform:
        return moment_weights(np.broadcast_to(np.arange(n + 1.0), (n, n + 1)), np.arange(n))
    table = np.empty((count, 2 * WINDOW))
    for start in range(0, count, 8192):
        k = np.arange(start, min(start + 8192, count))
        first = np.clip(k - n // 2, 0, count - n)
        table[k] = moment_weights(time[first[:, None] + np.arange(n + 1)], k - first)
    return table


_HALF = WINDOW // 2

Weights = tuple[float, float, float, float, float]


class BodyTurn(NamedTuple):
    """Rotation of the body and its specific force over one interval, in the body axes of the interval's start.

    phi: rotation vector relative to inertial space, compensated for coning, rad.
    dv: velocity increment, compensated for sculling and rotation, m/s.
    fs, fe: specific force at the start and the end, times the interval, m/s.
    a1, a2, a3: the body's own rate times the interval as a1 + a2 s + a3 s² over s ∈ [−½, ½], rad.
    theta: the measured increment without compensation, rad.
    """

    phi_x: float
    phi_y: float
    phi_z: float
    dv_x: float
    dv_y: float
    dv_z: float
    fs_x: float
    fs_y: float
    fs_z: float
    fe_x: float
    fe_y: float
    fe_z: float
    a1_x: float
    a1_y: float
    a1_z: float
    a2_x: float
    a2_y: float
    a2_z: float
    a3_x: float
    a3_y: float
    a3_z: float
    theta_x: float
    theta_y: float
    theta_z: float


class FrameTurn(NamedTuple):
    """Rotation of the navigation frame relative to inertial space over one interval, in its own axes.

    zeta: rotation vector, rad.
    u0, um, u1: rate at the start, the middle and the end, times the interval, rad.
    """

    zeta_x: float
    zeta_y: float
    zeta_z: float
    u0_x: float
    u0_y: float
    u0_z: float
    um_x: float
    um_y: float
    um_z: float
    u1_x: float
    u1_y: float
    u1_z: float


@inline
def frame_turn_k(u0: Vector, um: Vector, u1: Vector) -> FrameTurn:
    """Frame's rotation ζ = ∫ω_in dt by Simpson's rule from the rates at start, middle and end, times the interval."""
    return FrameTurn(*simpson(u0, um, u1), *u0, *um, *u1)


@inline
def turn_of_moments_k(a0: Twist, a2: Twist, a3: Twist, log: Twist, b: float, c: float) -> BodyTurn:
    """The body's turn from the increments, the fitted moments, their logarithm (φ, ν) and the factors b, c of J(φ)."""
    px, py, pz, nx, ny, nz = log
    dvx, dvy, dvz = velocity_increment_k(px, py, pz, nx, ny, nz, b, c)
    # f dt = f1 + f2 s + f3 s² at s = ∓½; the value at the end is rotated to the axes of the start
    fsx = a0[3] - a3[3] / 12.0 - 0.5 * a2[3] + 0.25 * a3[3]
    fsy = a0[4] - a3[4] / 12.0 - 0.5 * a2[4] + 0.25 * a3[4]
    fsz = a0[5] - a3[5] / 12.0 - 0.5 * a2[5] + 0.25 * a3[5]
    fex, fey, fez = fsx + a2[3], fsy + a2[4], fsz + a2[5]
    ax, ay, az = cross_k(px, py, pz, fex, fey, fez)
    bx, by, bz = cross_k(px, py, pz, ax, ay, az)
    return BodyTurn(
        px, py, pz, dvx, dvy, dvz, fsx, fsy, fsz,
        fex + ax + 0.5 * bx, fey + ay + 0.5 * by, fez + az + 0.5 * bz,
        a0[0] - a3[0] / 12.0, a0[1] - a3[1] / 12.0, a0[2] - a3[2] / 12.0, a2[0], a2[1], a2[2], a3[0], a3[1], a3[2],
        a0[0], a0[1], a0[2],
    )  # fmt: skip


@inline
def fitted_k(p: Weights, x0: float, x1: float, x2: float, x3: float, x4: float) -> float:
    """Weighted sum over a window."""
    return p[0] * x0 + p[1] * x1 + p[2] * x2 + p[3] * x3 + p[4] * x4


@inline
def _moment_k(p: Weights, dtheta: Array, dvel: Array, first: int) -> Twist:
    """Moment of the six channels over the window that begins at interval `first`."""
    # with fewer samples than the window the remaining weights are zero
    last = dtheta.shape[0] - 1
    i0, i1, i2, i3, i4 = first, min(first + 1, last), min(first + 2, last), min(first + 3, last), min(first + 4, last)
    return (
        fitted_k(p, dtheta[i0, 0], dtheta[i1, 0], dtheta[i2, 0], dtheta[i3, 0], dtheta[i4, 0]),
        fitted_k(p, dtheta[i0, 1], dtheta[i1, 1], dtheta[i2, 1], dtheta[i3, 1], dtheta[i4, 1]),
        fitted_k(p, dtheta[i0, 2], dtheta[i1, 2], dtheta[i2, 2], dtheta[i3, 2], dtheta[i4, 2]),
        fitted_k(p, dvel[i0, 0], dvel[i1, 0], dvel[i2, 0], dvel[i3, 0], dvel[i4, 0]),
        fitted_k(p, dvel[i0, 1], dvel[i1, 1], dvel[i2, 1], dvel[i3, 1], dvel[i4, 1]),
        fitted_k(p, dvel[i0, 2], dvel[i1, 2], dvel[i2, 2], dvel[i3, 2], dvel[i4, 2]),
    )


@inline
def fitted_turn_k(dtheta: Array, dvel: Array, weights: Array, uniform: bool, k: int) -> BodyTurn:
    """The body's turn in interval k from the fit over its neighbours; sixth order in the interval."""
    count = dtheta.shape[0]
    first = min(max(k - _HALF, 0), count - min(count, WINDOW))
    w = weights[k - first if uniform else k]
    a0 = (dtheta[k, 0], dtheta[k, 1], dtheta[k, 2], dvel[k, 0], dvel[k, 1], dvel[k, 2])
    a2 = _moment_k((w[0], w[1], w[2], w[3], w[4]), dtheta, dvel, first)
    a3 = _moment_k((w[5], w[6], w[7], w[8], w[9]), dtheta, dvel, first)
    log = logarithm_k(a0, a2, a3)
    _, b, c = rotation_series_k(log[0] * log[0] + log[1] * log[1] + log[2] * log[2])
    return turn_of_moments_k(a0, a2, a3, log, b, c)


BLOCK = 120
"""Number of intervals in a block: small enough for the first-level cache, and not a power of two, to avoid
conflicts."""

_FIELDS = len(BodyTurn._fields)
_HALF_OF_BLOCK = WINDOW // 2
_ROW = BLOCK + WINDOW - 1  # samples of a channel used by the fits of a block


@inline
def empty_turns_k() -> Array:
    """Return an array for the turns of a block: BLOCK numbers for each field."""
    return np.empty(_FIELDS * BLOCK)


@inline
def turn_in_block_k(turns: Array, j: int) -> BodyTurn:
    """Turn j of a block."""
    return BodyTurn(
        turns[j], turns[BLOCK + j], turns[2 * BLOCK + j], turns[3 * BLOCK + j], turns[4 * BLOCK + j],
        turns[5 * BLOCK + j], turns[6 * BLOCK + j], turns[7 * BLOCK + j], turns[8 * BLOCK + j], turns[9 * BLOCK + j],
        turns[10 * BLOCK + j], turns[11 * BLOCK + j], turns[12 * BLOCK + j], turns[13 * BLOCK + j],
        turns[14 * BLOCK + j], turns[15 * BLOCK + j], turns[16 * BLOCK + j], turns[17 * BLOCK + j],
        turns[18 * BLOCK + j], turns[19 * BLOCK + j], turns[20 * BLOCK + j], turns[21 * BLOCK + j],
        turns[22 * BLOCK + j], turns[23 * BLOCK + j],
    )  # fmt: skip


@inline
def _keep_k(turn: BodyTurn, turns: Array, j: int) -> None:
    """Store a turn as number j of a block."""
    (
        turns[j], turns[BLOCK + j], turns[2 * BLOCK + j], turns[3 * BLOCK + j], turns[4 * BLOCK + j],
        turns[5 * BLOCK + j], turns[6 * BLOCK + j], turns[7 * BLOCK + j], turns[8 * BLOCK + j], turns[9 * BLOCK + j],
        turns[10 * BLOCK + j], turns[11 * BLOCK + j], turns[12 * BLOCK + j], turns[13 * BLOCK + j],
        turns[14 * BLOCK + j], turns[15 * BLOCK + j], turns[16 * BLOCK + j], turns[17 * BLOCK + j],
        turns[18 * BLOCK + j], turns[19 * BLOCK + j], turns[20 * BLOCK + j], turns[21 * BLOCK + j],
        turns[22 * BLOCK + j], turns[23 * BLOCK + j],
    ) = turn  # fmt: skip


@inline
def _moments_k(x: Array, channel: int, j: int, p: Weights, q: Weights) -> tuple[float, float, float]:
    """Increment, a₂ and a₃ of a channel over interval j."""
    i = channel * _ROW + j
    x0, x1, x2, x3, x4 = x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4]
    return (
        x2,
        fitted_k(p, x0, x1, x2, x3, x4),
        fitted_k(q, x0, x1, x2, x3, x4),
    )


@inline
def small_turn_k(a0: Twist, a2: Twist, a3: Twist) -> tuple[BodyTurn, float]:
    """The body's turn from increments and fitted moments, and its squared angle, which must be below `SERIES`."""
    log = logarithm_k(a0, a2, a3)
    angle2 = log[0] * log[0] + log[1] * log[1] + log[2] * log[2]
    _, b, c = small_rotation_series_k(angle2)
    return turn_of_moments_k(a0, a2, a3, log, b, c), angle2


@kernel
def _centred_turns(dtheta: Array, dvel: Array, weights: Array, start: int, end: int, turns: Array) -> bool:
    """Fill a block with the turns in intervals with centred windows, all with the same weights.

    Returns whether they are valid, that is, no rotation is too large for the series.
    """
    count = end - start
    x = np.empty(6 * _ROW)
    for j in range(count + WINDOW - 1):
        for i in range(3):
            x[i * _ROW + j] = dtheta[start - _HALF_OF_BLOCK + j, i]
            x[(3 + i) * _ROW + j] = dvel[start - _HALF_OF_BLOCK + j, i]
    w = weights[_HALF_OF_BLOCK]
    p, q = (w[0], w[1], w[2], w[3], w[4]), (w[5], w[6], w[7], w[8], w[9])
    large = 0
    for j in range(count):
        x0, x2, x3 = _moments_k(x, 0, j, p, q)
        y0, y2, y3 = _moments_k(x, 1, j, p, q)
        z0, z2, z3 = _moments_k(x, 2, j, p, q)
        u0, u2, u3 = _moments_k(x, 3, j, p, q)
        v0, v2, v3 = _moments_k(x, 4, j, p, q)
        w0, w2, w3 = _moments_k(x, 5, j, p, q)
        a0, a2, a3 = (x0, y0, z0, u0, v0, w0), (x2, y2, z2, u2, v2, w2), (x3, y3, z3, u3, v3, w3)
        turn, angle2 = small_turn_k(a0, a2, a3)
        large += angle2 >= SERIES
        _keep_k(turn, turns, j)
    return large == 0


turn_k = fitted_turn_k
"""The turn in an interval; `fill_single_turns` is bound to an algorithm's own."""


def fill_single_turns(
    dtheta: Array, dvel: Array, weights: Array, uniform: bool, first: int, last: int, turns: Array
) -> None:
    """Fill a block with the turns in the intervals first … last − 1, one by one; a template over `turn_k`."""
    for k in range(first, last):
        _keep_k(turn_k(dtheta, dvel, weights, uniform, k), turns, k - first)


@kernel
def fill_fitted_turns(
    dtheta: Array, dvel: Array, weights: Array, uniform: bool, first: int, last: int, turns: Array
) -> None:
    """Fill a block with the turns in the intervals first … last − 1 by the fits over their neighbours."""
    start, end = (
        max(first, _HALF_OF_BLOCK),
        min(last, dtheta.shape[0] - _HALF_OF_BLOCK),
    )  # intervals with a centred window
    if not uniform or start >= end or not _centred_turns(dtheta, dvel, weights, start, end, turns[start - first :]):
        start, end = last, last
    for k in range(first, last):
        if k < start or k >= end:
            _keep_k(fitted_turn_k(dtheta, dvel, weights, uniform, k), turns, k - first)
