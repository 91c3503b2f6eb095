"""Polynomials of a curve between its knots: `sinssim.truth.curve` explains why positions are integrals.

On a panel of length h, with u the time since its first knot, a quintic spline is c₀ + c₁u + … + c₅u⁵. Its second
derivative is a cubic spline; from its values a and its second derivatives s at the knots k and k+1:

    c₂ = a_k/2,  c₃ = [(a_k+1 − a_k)/h − h (2 s_k + s_k+1)/6]/6,  c₄ = s_k/24,  c₅ = (s_k+1 − s_k)/(120 h)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.arguments import numbers
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.jit import inline, strict_kernel

DEGREE = 5
"""Degree of the splines through the knots."""

# Limit of the angle between neighbouring attitudes (cosine of its half), beyond which they do not define a smooth
# curve.
_LEAST_COSINE = np.cos(np.pi / 8)


@inline
def _curved_k(a: Array, s: Array, k: int, j: int, h: float) -> tuple[float, float, float, float]:
    """Return c₂ … c₅ of component j on panel k."""
    third = (a[k + 1, j] - a[k, j]) / h - h / 6.0 * (2.0 * s[k, j] + s[k + 1, j])
    return a[k, j] / 2.0, third / 6.0, s[k, j] / 24.0, (s[k + 1, j] - s[k, j]) / (120.0 * h)


@strict_kernel
def _integrate(time: Array, a: Array, s: Array, first: Array, v0: Array, panels: Array) -> None:
    """Set the panels of position: velocity is the running integral of a, and position that of velocity."""
    for j in range(3):
        panels[0, 0, j], panels[0, 1, j] = first[j], v0[j]
    for k in range(len(time) - 1):
        h = time[k + 1] - time[k]
        for j in range(3):
            r, v = panels[k, 0, j], panels[k, 1, j]
            c2, c3, c4, c5 = _curved_k(a, s, k, j, h)
            panels[k, 2, j], panels[k, 3, j], panels[k, 4, j], panels[k, 5, j] = c2, c3, c4, c5
            panels[k + 1, 0, j] = r + h * (v + h * (c2 + h * (c3 + h * (c4 + h * c5))))
            panels[k + 1, 1, j] = v + h * (2.0 * c2 + h * (3.0 * c3 + h * (4.0 * c4 + h * 5.0 * c5)))


@strict_kernel
def _join(time: Array, q: Array, a: Array, s: Array, panels: Array) -> None:
    """Set the panels of the quaternion, which pass exactly through the knots."""
    for k in range(len(time) - 1):
        h = time[k + 1] - time[k]
        for j in range(4):
            c2, c3, c4, c5 = _curved_k(a, s, k, 3 + j, h)
            panels[k, 0, 3 + j] = q[k, j]
            panels[k, 1, 3 + j] = (q[k + 1, j] - q[k, j]) / h - h * (c2 + h * (c3 + h * (c4 + h * c5)))
            panels[k, 2, 3 + j], panels[k, 3, 3 + j], panels[k, 4, 3 + j], panels[k, 5, 3 + j] = c2, c3, c4, c5


def checked_knots(time: ArrayLike, position_ecef: ArrayLike, q_eb: ArrayLike) -> tuple[Array, Array, Array]:
    """Return the knots of a curve as arrays, with unit quaternions of continuous sign.

    Args:
        time: the knots, increasing, (K,) s.
        position_ecef: positions at the knots, (K, 3) m.
        q_eb: attitude at the knots, v_e = C_eb v_b, (K, 4).

    Raises:
        InputError: the knots do not define a curve; the message names the knot.
    """
    t, r, q = numbers("time", time), numbers("position_ecef", position_ecef), numbers("q_eb", q_eb)
    if t.ndim != 1 or r.shape != (len(t), 3) or q.shape != (len(t), 4):
        raise InputError(
            f"a curve needs K times, (K, 3) positions and (K, 4) quaternions; got arrays of shapes "
            f"{t.shape}, {r.shape} and {q.shape}."
        )
    if len(t) <= DEGREE:
        raise InputError(f"a curve needs at least {DEGREE + 1} knots, got {len(t)}.")
    for name, values in (("time", t), ("position", r), ("quaternion", q)):
        finite = np.isfinite(values.reshape(len(t), -1)).all(axis=1)
        if not finite.all():
            raise InputError(f"knot {int(np.argmin(finite))}: its {name} is not a finite number.")
    if not (np.diff(t) > 0.0).all():
        worst = int(np.argmin(np.diff(t) > 0.0))
        raise InputError(
            f"knot {worst + 1} at {t[worst + 1]!s} s is not later than the previous knot, at {t[worst]!s} s."
        )
    norm = np.linalg.norm(q, axis=1)
    if not (np.abs(norm - 1.0) < 1e-6).all():
        worst = int(np.argmax(np.abs(norm - 1.0)))
        raise InputError(f"knot {worst} at {t[worst]!s} s: its quaternion has norm {norm[worst]:g}, it must be 1.")
    q = q / norm[:, None]
    cosine = np.einsum("ij,ij->i", q[1:], q[:-1])
    if np.abs(cosine).min() < _LEAST_COSINE:
        worst = int(np.argmin(np.abs(cosine)))
        raise InputError(
            f"between the knots at {t[worst]!s} s and {t[worst + 1]!s} s the attitude turns by "
            f"{2.0 * np.degrees(np.arccos(abs(cosine[worst]))):.0f}°; it must turn by less than 45°: "
            "use more closely spaced knots."
        )
    q[1:] *= np.cumprod(np.where(cosine < 0.0, -1.0, 1.0))[:, None]
    return t, r, q


class KnotDerivatives(NamedTuple):
    """Derivatives at the knots, which determine the panels; they take longer to compute than the panels.

    Attributes:
        second: second derivatives of x, y, z, q0, q1, q2, q3, (K, 7).
        fourth: fourth derivatives, (K, 7).
        velocity: first derivative of x, y, z at the first knot, (3,) m/s.
    """

    second: Array
    fourth: Array
    velocity: Array


def knot_derivatives(time: Array, position: Array, q: Array) -> KnotDerivatives:
    """Return the derivatives of the splines through the knots.

    Args:
        time: the knots, (K,) s.
        position: positions at the knots, (K, 3) m.
        q: quaternions at the knots, of continuous sign, (K, 4).
    """
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(time, np.concatenate([position, q], axis=1), k=DEGREE)
    a, s, v0 = spline(time, 2), spline(time, 4), spline(time[0], 1)[:3]
    panels = np.empty((len(time), 6, 7))
    _integrate(time, a, s, position[0], v0, panels)
    rest = make_interp_spline(time, position - panels[:, 0, :3], k=DEGREE)  # what the integrals miss
    a[:, :3] += rest(time, 2)
    s[:, :3] += rest(time, 4)
    return KnotDerivatives(a, s, v0 + rest(time[0], 1))


def panels_through(time: Array, position: Array, q: Array, derivatives: KnotDerivatives) -> Array:
    """Return the polynomials between knots.

    Args:
        time: the knots, (K,) s.
        position: positions at the knots, (K, 3) m.
        q: quaternions at the knots, of continuous sign, (K, 4).

    Returns:
        (K-1, 6, 7) coefficients of x, y, z, q0, q1, q2, q3 by power of the time since the panel's first knot.
    """
    a, s, v0 = derivatives
    panels = np.empty((len(time), 6, 7))  # a row more than panels, for the last knot
    _integrate(time, a, s, position[0], v0, panels)
    _join(time, q, a, s, panels)
    return panels[:-1]
