"""Data of one interval: rotation and specific force of the body, and rotation of the navigation frame."""

from __future__ import annotations

from typing import NamedTuple

from sinssim.data import Array
from sinssim.jit import inline
from sinssim.rotation.kernels import Vector, cross_k, rotation_series_k
from sinssim.rotation.vectors import simpson
from sinssim.strapdown.increments.coning_sculling import Twist, logarithm_k, velocity_increment_k
from sinssim.strapdown.increments.fit import WINDOW

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
