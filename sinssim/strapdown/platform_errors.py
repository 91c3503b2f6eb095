"""Linear error equations of a platform along any motion: which of its errors moves the solution how far.

The platform turns away from the navigator's frame by ψ, which in inertial axes is nothing but the integral of its
drift and of its torquing error:

    ψ̇_i = C_ip (κ ω_commanded − d),     ψ(0) = the error of the attitude at the start

and the horizontal errors of position and velocity in north and east, with the vertical channel held, obey (the ψ form,
Benson, IEEE Transactions on Aerospace and Electronic Systems 11, 1975; Titterton and Weston, 2nd ed., ch. 12)

    δv̇ = −ψ × f + C_np ∇ − (2ω_ie + ω_en)_D × δv − (g/R) δr,     δṙ = δv − (ω_en)_D × δr

∇ is the error of the accelerometers' readings. The equations are linear, so the causes are solved one by one and add up
to the error of the navigator. They know nothing of how the loop is computed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.sensors.sets.gimballed_sensors import PlatformErrors
from sinssim.strapdown.gimballed_platform import Forces, PlatformSolution
from sinssim.strapdown.navigation_error import NavError

GYROS, TORQUERS, ACCELEROMETERS, START = (
    "drift of the gyros",
    "torquing scale factor",
    "accelerometers",
    "initial state",
)
"""The causes."""

_STEP = 1.0  # s


@dataclass(frozen=True)
class ErrorsByCause:
    """Position errors of a platform's solution by cause, from the linear error equations.

    Attributes:
        time: (M,) s.
        position: north and east by cause, (M, 2) m each.
    """

    time: Array
    position: dict[str, Array]

    @property
    def total(self) -> Array:
        """North and east of all causes together, (M, 2) m."""
        return np.asarray(sum(self.position.values()))

    def apart(self, error: NavError) -> float:
        """Return the largest horizontal distance between all causes together and an error, m."""
        rows = np.searchsorted(error.time, self.time)
        return float(np.linalg.norm(error.position_ned[rows, :2] - self.total, axis=1).max())


# Long: the forcing of every cause, and the integration of all of them together.
def errors_by_cause(
    truth: NavState,
    forces: Forces,
    solution: PlatformSolution,
    of_platform: PlatformErrors,
    ellipsoid: Ellipsoid,
) -> ErrorsByCause:
    """Return the position errors that each cause gives, in steps of about a second.

    Args:
        truth: true states at the solution's times.
        solution: of its navigator, for the commanded rates, the drift, the readings and the initial state.
    """
    time = solution.time
    ratio = max(1, round(_STEP * (len(time) - 1) / float(time[-1] - time[0])))
    edges = np.arange(0, len(time), ratio)
    t, step = time[edges], np.diff(time[edges])[:, np.newaxis]

    def sums(rows: Array) -> Array:
        """Return the sums of rows over the steps, (M-1, k)."""
        return np.add.reduceat(rows[: edges[-1]], edges[:-1], axis=0)

    # in inertial axes: the turns ψ at the edges, and the errors of the readings over the steps
    middle = rotation.normalize(solution.q_ip[1:] + solution.q_ip[:-1])
    dt = np.diff(time)[:, np.newaxis]
    torque = of_platform.torquer_scale * solution.commanded
    reading = rotation.rotate(middle, solution.readings) - forces.push
    q_in = rotation.multiply(forces.q_ib, rotation.conjugate(truth.q_nb))
    azimuth = 0.0 if solution.azimuth is None else float(solution.azimuth[0])
    q_wn = np.array([np.cos(0.5 * azimuth), 0.0, 0.0, -np.sin(0.5 * azimuth)])
    indicated = rotation.multiply(solution.q_ip[0], q_wn)  # north, east and down as the platform has them
    offset = rotation.multiply(indicated, rotation.conjugate(q_in[0]))
    latitude, h = truth.latitude[edges], truth.height[edges]
    r1, r2 = earth.radii(latitude, ellipsoid)
    displaced, drifting, moved = _initial(truth, solution, r1[0] + h[0], r2[0] + h[0])
    wrong = rotation.rotation_vector_from_quaternion(rotation.normalize(offset)) - rotation.rotate(q_in[0], moved)
    turn = {
        GYROS: _summed(sums(rotation.rotate(middle, -solution.drift * dt))),
        TORQUERS: _summed(sums(rotation.rotate(middle, torque * dt))),
        START: np.tile(wrong, (len(t), 1)),
    }
    force, in_middle = sums(forces.push) / step, rotation.normalize(q_in[edges[1:]] + q_in[edges[:-1]])
    pushed = {name: -np.cross(0.5 * (psi[1:] + psi[:-1]), force) for name, psi in turn.items()}
    pushed[ACCELEROMETERS] = sums(reading) / step
    names = (GYROS, TORQUERS, ACCELEROMETERS, START)
    forcing = np.stack([rotation.rotate(rotation.conjugate(in_middle), pushed[name])[:, :2] for name in names], axis=1)

    stiffness = earth.gravity_ned(latitude, h, "normal", ellipsoid)[:, 2, np.newaxis] / np.stack([r1 + h, r2 + h], 1)
    transport = -truth.velocity_ned[edges, 1] * np.tan(latitude) / (r2 + h)
    coriolis = transport - 2.0 * ellipsoid.omega * np.sin(latitude)
    x, v = np.zeros((4, 2)), np.zeros((4, 2))
    x[3], v[3] = displaced, drifting
    position_errors = np.empty((len(t), 4, 2))
    position_errors[0] = x
    across = np.array([[0.0, -1.0], [1.0, 0.0]])  # (a, b) → (b, −a) on the right: −D × of a horizontal vector
    for k in range(len(t) - 1):
        s, w, c, a = step[k, 0], transport[k], coriolis[k], forcing[k]

        def slope(x: Array, v: Array, w: float = w, c: float = c, a: Array = a, k: int = k) -> tuple[Array, Array]:
            return v + w * (x @ across), a + c * (v @ across) - stiffness[k] * x

        dx, dv = slope(x, v)
        dx, dv = slope(x + 0.5 * s * dx, v + 0.5 * s * dv)
        x, v = x + s * dx, v + s * dv
        position_errors[k + 1] = x
    return ErrorsByCause(t, {name: position_errors[:, i] for i, name in enumerate(names)})


def _summed(rows: Array) -> Array:
    """Return the sums from the start to each edge, (M, k)."""
    return np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])


def _initial(truth: NavState, solution: PlatformSolution, r1: float, r2: float) -> tuple[Array, Array, Array]:
    """Return errors of position and velocity at the start, north and east, and the turn of the computed axes."""
    north = (solution.latitude[0] - truth.latitude[0]) * r1
    east = (solution.longitude[0] - truth.longitude[0]) * r2 * np.cos(truth.latitude[0])
    # the computed axes are turned from the true ones by δθ = (δr_E/R, −δr_N/R, −δr_E tan φ/R), which ψ excludes
    turn = np.array([east / r2, -north / r1, -east * np.tan(truth.latitude[0]) / r2])
    velocity = solution.velocity_ned[0] - truth.velocity_ned[0] + np.cross(turn, truth.velocity_ned[0])
    return np.array([north, east]), velocity[:2], turn
