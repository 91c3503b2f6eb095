"""An independent inertial integrator: it shares no code with sinssim.

Everything happens in the Earth-centred inertial frame that coincides with the Earth-fixed one at the first
edge. Rate and specific force inside a sample are the quartics whose integrals reproduce the increments of the
sample and its two neighbours on either side; quaternion, velocity and position are advanced by the classical
fourth-order Runge-Kutta method in several steps a sample. Gravitation is the zonal harmonic series J2...J20 of
the normal field, with coefficients derived from the ellipsoid's defining constants (Hofmann-Wellenhof & Moritz,
Physical Geodesy, eqs. 2-163...2-170), not the closed form that the package uses.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

A = 6378137.0
F = 1 / 298.257223563
GM = 3.986004418e14
OMEGA = 7.292115e-5
STEPS = 4  # Runge-Kutta steps in a sample: with one, Simpson's rule would not even give back the increment
DEGREES = 10  # zonal harmonics of degree 2, 4, ... 2*DEGREES


def _zonal_coefficients() -> Array:
    e2 = F * (2 - F)
    second = math.sqrt(e2 / (1 - e2))  # e'
    m = OMEGA**2 * A**3 * (1 - F) / GM
    # q0 = ((1 + 3/e'^2) atan e' - 3/e') / 2 as its series: the closed form loses ten digits
    q0 = sum((-1) ** (n + 1) * 2 * n / ((2 * n + 1) * (2 * n + 3)) * second ** (2 * n + 1) for n in range(1, 12))
    j2 = e2 / 3 * (1 - 2 / 15 * m * second / q0)
    return np.array(
        [
            (-1) ** (n + 1) * 3 * e2**n / ((2 * n + 1) * (2 * n + 3)) * (1 - n + 5 * n * j2 / e2)
            for n in range(1, DEGREES + 1)
        ]
    )


ZONAL = _zonal_coefficients()


@njit(cache=True)
def gravitation(x: float, y: float, z: float, zonal: Array) -> tuple[float, float, float]:
    """Return the gravitation of the zonal series, m/s², at a Cartesian position, m."""
    r = math.sqrt(x * x + y * y + z * z)
    s = z / r
    # V = GM/r (1 - sum J_n (a/r)^n P_n(s)); radial part and the part along the polar axis
    radial, axial = 1.0, 0.0
    p0, p1 = 1.0, s  # P_{n-2}, P_{n-1}
    d0, d1 = 0.0, 1.0  # their derivatives
    power = A / r
    for n in range(2, 2 * len(zonal) + 1):
        p2 = ((2 * n - 1) * s * p1 - (n - 1) * p0) / n
        d2 = d0 + (2 * n - 1) * p1
        power *= A / r
        if n % 2 == 0:
            j = zonal[n // 2 - 1] * power
            radial -= j * ((n + 1) * p2 + s * d2)
            axial -= j * d2
        p0, p1, d0, d1 = p1, p2, d1, d2
    k = GM / (r * r)
    return -k * radial * x / r, -k * radial * y / r, -k * radial * z / r + k * axial


@njit(cache=True)
def _derivative(s: Array, w: Array, f: Array, zonal: Array, out: Array) -> None:
    a, b, c, d = s[0], s[1], s[2], s[3]
    out[0] = 0.5 * (-b * w[0] - c * w[1] - d * w[2])
    out[1] = 0.5 * (a * w[0] + c * w[2] - d * w[1])
    out[2] = 0.5 * (a * w[1] + d * w[0] - b * w[2])
    out[3] = 0.5 * (a * w[2] + b * w[1] - c * w[0])
    norm2 = a * a + b * b + c * c + d * d
    # f_i = q f q*: f + 2 (v x (v x f) + a v x f), for a quaternion of norm close to one
    tx, ty, tz = c * f[2] - d * f[1], d * f[0] - b * f[2], b * f[1] - c * f[0]
    gx, gy, gz = gravitation(s[7], s[8], s[9], zonal)
    out[4] = f[0] + 2 * (a * tx + c * tz - d * ty) / norm2 + gx
    out[5] = f[1] + 2 * (a * ty + d * tx - b * tz) / norm2 + gy
    out[6] = f[2] + 2 * (a * tz + b * ty - c * tx) / norm2 + gz
    out[7], out[8], out[9] = s[4], s[5], s[6]


@njit(cache=True)
def _run(h: float, dtheta: Array, dvel: Array, fits: Array, start: Array, zonal: Array) -> Array:
    n = len(dtheta)
    rows = np.empty((n + 1, 10))
    rows[0] = start
    state = start.copy()
    k1, k2, k3, k4 = np.empty(10), np.empty(10), np.empty(10), np.empty(10)
    w, f = np.empty((2 * STEPS + 1, 3)), np.empty((2 * STEPS + 1, 3))
    step = h / STEPS
    for k in range(n):
        first = min(max(k - 2, 0), n - 5)
        fit = fits[k - first]  # (instants from start to end of sample k, 5 samples)
        for i in range(len(w)):
            for axis in range(3):
                rate, force = 0.0, 0.0
                for j in range(5):
                    rate += fit[i, j] * dtheta[first + j, axis]
                    force += fit[i, j] * dvel[first + j, axis]
                w[i, axis] = rate / h
                f[i, axis] = force / h
        for i in range(0, 2 * STEPS, 2):
            _derivative(state, w[i], f[i], zonal, k1)
            _derivative(state + 0.5 * step * k1, w[i + 1], f[i + 1], zonal, k2)
            _derivative(state + 0.5 * step * k2, w[i + 1], f[i + 1], zonal, k3)
            _derivative(state + step * k3, w[i + 2], f[i + 2], zonal, k4)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        state[:4] /= math.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2 + state[3] ** 2)
        rows[k + 1] = state
    return rows


def _fits() -> Array:
    """Weights (place of the sample in its window, instant, sample of the window) of the quartic fit, unit step."""
    edges = np.arange(6.0)
    powers = np.arange(1, 6)
    integral = (edges[1:, None] ** powers - edges[:-1, None] ** powers) / powers  # increments from coefficients
    coefficients = np.linalg.inv(integral)
    instants = np.arange(5)[:, None] + np.linspace(0.0, 1.0, 2 * STEPS + 1)
    return np.asarray(instants[..., None] ** np.arange(5) @ coefficients)


def geodetic_to_ecef(latitude: Array, longitude: Array, height: Array) -> Array:
    """Return Earth-fixed positions, (..., 3) m, of points on WGS-84."""
    e2 = F * (2 - F)
    normal = A / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    return np.stack(
        [
            (normal + height) * np.cos(latitude) * np.cos(longitude),
            (normal + height) * np.cos(latitude) * np.sin(longitude),
            (normal * (1 - e2) + height) * np.sin(latitude),
        ],
        axis=-1,
    )


def ned_axes(latitude: Array, longitude: Array) -> Array:
    """Return C_ne, (..., 3, 3): rows north, east and down in Earth-fixed axes."""
    sb, cb, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    zero = np.zeros_like(sb)
    rows = [[-sb * cl, -sb * sl, cb], [-sl, cl, zero], [-cb * cl, -cb * sl, -sb]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def matrix(q: Array) -> Array:
    """Return the direction cosine matrices, (..., 3, 3), of scalar-first quaternions."""
    a, b, c, d = np.moveaxis(q, -1, 0)
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def integrate(
    time: Array, dtheta: Array, dvel: Array, position_ecef: Array, velocity_ecef: Array, q_eb: Array
) -> tuple[Array, Array, Array]:
    """Integrate increments into Earth-fixed position, velocity and attitude.

    Args:
        time: equally spaced edges, (N+1,) s, N >= 5.
        dtheta: angle increments, (N, 3) rad.
        dvel: velocity increments, (N, 3) m/s.
        position_ecef: first position, (3,) m.
        velocity_ecef: first velocity relative to the Earth, (3,) m/s.
        q_eb: first attitude, scalar first, (4,).

    Returns:
        Position (N+1, 3) m, velocity (N+1, 3) m/s and C_eb (N+1, 3, 3), all Earth-fixed.
    """
    spin = np.array([0.0, 0.0, OMEGA])
    start = np.concatenate([q_eb, velocity_ecef + np.cross(spin, position_ecef), position_ecef])
    h = (time[-1] - time[0]) / (len(time) - 1)
    rows = _run(h, np.ascontiguousarray(dtheta), np.ascontiguousarray(dvel), _fits(), start, ZONAL)
    angle = OMEGA * (time - time[0])
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    turn = np.stack(  # C_ei
        [
            np.stack([np.cos(angle), np.sin(angle), zero], axis=-1),
            np.stack([-np.sin(angle), np.cos(angle), zero], axis=-1),
            np.stack([zero, zero, one], axis=-1),
        ],
        axis=-2,
    )
    position = np.einsum("nij,nj->ni", turn, rows[:, 7:])
    velocity = np.einsum("nij,nj->ni", turn, rows[:, 4:7]) - np.cross(spin, position)
    return position, velocity, turn @ matrix(rows[:, :4])
