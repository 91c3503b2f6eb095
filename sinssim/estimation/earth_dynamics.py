"""Error dynamics that are regular at the poles: F in Earth-fixed axes, Φ and Q in transported local axes.

The errors in Earth-fixed axes, with r, v and C_eb of the solution less the true ones, φ with C_solution = (I − [φ×])
C_true, and gravity g of the position (Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation
Systems, 2nd ed. 2013, 14.2.3):

    φ̇  = −ω_ie × φ − C_eb δω
    δv̇ = f × φ + C_eb δf − 2ω_ie × δv + (∂g/∂r) δr
    δṙ = δv

The filter's state has them along north, east and down of the solution, and velocity and attitude relative to a local
level that goes along with the position's error: the level turns by θ = (δr_E/(R₂+h), −δr_N/(R₁+h), 0), and not about
the vertical (`sinssim.strapdown.polar`). With C from Earth-fixed axes into north, east, down

    δr_n = C δr_e,   δv_n = C δv_e + v × θ,   φ_n = C φ_e + θ      (1)

The state relative to north at its own place, in which `dynamics` and the measurements are written, turns with north by
ψ = δr_E tan φ/(R₂+h) in addition, k̂ down:

    δv = δv_n + ψ k̂ × v,   φ = φ_n − ψ k̂      (2)
"""

from __future__ import annotations

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.estimation.dynamics import NominalMotion, force_error, rate_error, transition
from sinssim.estimation.model import ErrorModel
from sinssim.sensors.aiding.base.measurement import CORE, PHI, R, V, skew
from sinssim.strapdown.polar import turn_of_north

_STEP = 100.0  # m: step for differences of gravity, accurate to 1e-8 of its gradient


def earth_from_ned(latitude: Array, longitude: Array) -> Array:
    """Return C_en, from north, east, down into Earth-fixed axes, (K, 3, 3).

    Args:
        latitude, longitude: (K,) rad.
    """
    return rotation.dcm_from_quaternion(earth.q_en(latitude, longitude))


def earth_dynamics(
    model: ErrorModel, motion: NominalMotion, longitude: Array, gravity: str, ellipsoid: Ellipsoid
) -> Array:
    """Return F of ẋ = F x + w with position, velocity and attitude in Earth-fixed axes.

    Args:
        motion: the motion at K instants, in north, east, down.
        longitude: there, (K,) rad.
        gravity: name of the engine's gravity model.

    Returns:
        (K, n, n).
    """
    c_en = earth_from_ned(motion.latitude, longitude)
    c_eb = c_en @ motion.c_nb
    place = earth.geodetic_to_ecef(motion.latitude, longitude, motion.height, ellipsoid)
    spin = skew(np.array([0.0, 0.0, ellipsoid.omega]))
    f = np.zeros((len(longitude), model.size, model.size))
    f[:, R, V] = np.eye(3)
    for axis in range(3):
        step = _STEP * np.eye(3)[axis]
        change = earth.gravitation_ecef(place + step, gravity, ellipsoid)
        change -= earth.gravitation_ecef(place - step, gravity, ellipsoid)
        f[:, V, R.start + axis] = change / (2.0 * _STEP)
    f[:, V, R] -= spin @ spin  # the centrifugal acceleration −ω × (ω × r)
    f[:, V, V] = -2.0 * spin
    f[:, V, PHI] = skew(np.einsum("kij,kj->ki", c_en, motion.force_n))
    f[:, PHI, PHI] = -spin
    f[:, PHI, CORE:] = -c_eb @ rate_error(model, motion.rate_b)[:, :, CORE:]
    f[:, V, CORE:] = c_eb @ force_error(model, motion.force_b)[:, :, CORE:]
    own = np.arange(CORE, model.size)
    f[:, own, own] = -model.decay[CORE:]
    return f


def local_from_earth(state: NavState, ellipsoid: Ellipsoid) -> tuple[Array, Array]:
    """Return the matrices of (1), from errors in Earth-fixed axes to those in transported local axes, and back.

    Args:
        state: the solution, K rows.
        ellipsoid: reference ellipsoid.

    Returns:
        The matrix and its inverse, (K, 9, 9) each.
    """
    c_en = earth_from_ned(state.latitude, state.longitude)
    c_ne = c_en.transpose(0, 2, 1)
    r1, r2 = earth.radii(state.latitude, ellipsoid)
    tilt = np.zeros_like(c_en)  # θ of δr, both north, east, down
    tilt[:, 0, 1], tilt[:, 1, 0] = 1.0 / (r2 + state.height), -1.0 / (r1 + state.height)
    across = skew(state.velocity_ned) @ tilt
    to, back = np.zeros((2, len(c_en), CORE, CORE))
    for part in (R, V, PHI):
        to[:, part, part], back[:, part, part] = c_ne, c_en
    to[:, V, R], to[:, PHI, R] = across @ c_ne, tilt @ c_ne
    back[:, V, R], back[:, PHI, R] = -c_en @ across, -c_en @ tilt
    return to, back


def transported_transition(
    f: Array, density: Array, interval: Array, state: NavState, ellipsoid: Ellipsoid
) -> tuple[Array, Array]:
    """Return Φ and Q over intervals, for the state in transported local axes.

    Args:
        f: F of `earth_dynamics` in each interval, (K, n, n).
        density: diagonal of the spectral density, (n,); the same in all axes of a navigation block.
        interval: (K,) s.
        state: the solution at the intervals' ends, K+1 rows.

    Returns:
        Φ and Q, (K, n, n) each.
    """
    phi, q = transition(f, density, interval)
    to, back = local_from_earth(state, ellipsoid)
    end, start = to[1:], back[:-1]
    phi[:, :CORE] = end @ phi[:, :CORE]
    phi[:, :, :CORE] = phi[:, :, :CORE] @ start
    q[:, :CORE] = end @ q[:, :CORE]
    q[:, :, :CORE] = q[:, :, :CORE] @ end.transpose(0, 2, 1)
    return phi, q


def turn_of_axes(before: NavState, after: NavState, size: int) -> Array:
    """Return the matrix that refers a state to the axes of a corrected solution, which are its own north and east.

    Returns:
        (n, n).
    """
    psi = turn_of_north(before.latitude, before.longitude, after.latitude, after.longitude)[0]
    c, s = np.cos(psi), np.sin(psi)
    out = np.eye(size)
    for part in (R, V, PHI):
        out[part, part] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return out


def refer_to_transported(h: Array, state: NavState, ellipsoid: Ellipsoid) -> None:
    """Change H from a state relative to north to one in transported axes, in place, by (2).

    Args:
        h: H, (M, k, n).
        state: the solution at the readings, M rows.
        ellipsoid: reference ellipsoid.
    """
    r2 = earth.radii(state.latitude, ellipsoid)[1]
    turn = np.tan(state.latitude) / (r2 + state.height)  # ψ/δr_E
    north, east, _ = state.velocity_ned.T[:, :, None]
    change = h[:, :, V.start + 1] * north - h[:, :, V.start] * east - h[:, :, PHI.start + 2]
    h[:, :, R.start + 1] += turn[:, None] * change
