"""Errors of inertial navigation on a parked vehicle by the classical linear equations, written out by hand.

State: φ_N, φ_E, φ_D (true = q(φ) solution), δv_N, δv_E, δr_N, δr_E; the height is held. For a vehicle at rest

    φ̇ = −ω_in × φ + δω_in − ε,   δv̇ = f × φ + a − (2ω_ie + δω_en) ×-terms of δv,   δṙ = δv

with f = (0, 0, −g), ε the drift of the gyros and a the error of the accelerometers in north, east, down axes
(Britting, Inertial Navigation Systems Analysis, 1971; Titterton and Weston, Strapdown Inertial Navigation Technology,
2nd ed., 2004, ch. 12). With a rotating IMU ε and a are constants plus cos Ωt and sin Ωt, so that the whole system is
linear with constant coefficients and its solution one matrix exponential.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Array = NDArray[np.float64]

PHI, V, R = slice(0, 3), slice(3, 5), slice(5, 7)


def system(latitude: float, gravity: float, meridian: float, normal: float, omega: float) -> Array:
    """Return F, (7, 7), for radii of curvature in the meridian and the prime vertical at the vehicle's height."""
    s, c, t = np.sin(latitude), np.cos(latitude), np.tan(latitude)
    f = np.zeros((7, 7))
    north, down = omega * c, -omega * s
    # −ω × φ with ω = (north, 0, down)
    f[0, 1], f[1, 0], f[1, 2], f[2, 1] = down, -down, north, -north
    # δω_in = δω_ie + δω_en; the solution's latitude is too large by δr_N / R_M
    f[0, 4], f[1, 3], f[2, 4] = 1.0 / normal, -1.0 / meridian, -t / normal
    f[0, 5], f[2, 5] = -omega * s / meridian, -omega * c / meridian
    # f × φ
    f[3, 1], f[4, 0] = gravity, -gravity
    # Coriolis: −2 ω_ie × δv
    f[3, 4], f[4, 3] = 2.0 * down, -2.0 * down
    f[5, 3], f[6, 4] = 1.0, 1.0
    return f


def errors(
    f: Array, x0: Array, constant: Array, cosine: Array, sine: Array, rate: float, step: float, count: int
) -> Array:
    """Return the errors at multiples of a step, (count + 1, 7), by constant + cosine cos Ωt + sine sin Ωt."""
    a = np.zeros((10, 10))
    a[:7, :7], a[:7, 7], a[:7, 8], a[:7, 9] = f, constant, cosine, sine
    a[8, 9], a[9, 8] = -rate, rate
    phi, x = expm(a * step), np.concatenate([x0, [1.0, 1.0, 0.0]])
    found = [x[:7]]
    for _ in range(count):
        x = phi @ x
        found.append(x[:7])
    return np.array(found)
