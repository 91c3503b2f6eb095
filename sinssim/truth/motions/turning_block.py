"""The motion of a sensor block that turns in its vehicle, which its sensors measure.

With D = C_bv the block feels ω' = D ω + ω_vb^b and f' = D f at its reference point, which is where its axes cross. Over
a sample, with D₀ in its middle, the increments are

    (1) ∫ω' dt = D₀ ∫ω dt + ∫(D − D₀) ω dt + ∫ω_vb^b dt,   ∫f' dt = D₀ ∫f dt + ∫(D − D₀) f dt

The vehicle's own increments keep their accuracy, and the quadrature (Gauss-Legendre) sees only the product with the
small turn within half a sample.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sinssim import rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.truth.motions.quadrature import integrate_samples
from sinssim.truth.motions.turning import Turning
from sinssim.truth.sample_times import check_instants, part_by_part

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory

_SLOW, _FEW, _MANY = 0.2, 4, 8
"""Phase of the fastest oscillation in a sample, rad, up to which four Gauss-Legendre points have an error of 3e-16 of
its amplitude (Abramowitz and Stegun 25.4.30), and the points below and above it."""


class TurningBlock:
    """A block that turns in its vehicle, as a trajectory.

    Args:
        base: the motion of the vehicle at the block's place, in the axes of the block's mounting.
        turns: the rotation.
    """

    def __init__(self, base: Trajectory, turns: Turning) -> None:
        self.base, self.turns = base, turns
        self.start, self.end = base.start, base.end
        self.events, self.channels = base.events, base.channels
        self.gravity, self.ellipsoid = base.gravity, base.ellipsoid
        self.breaks = np.union1d(np.asarray(getattr(base, "breaks", ()), dtype=np.float64), turns.breaks)
        self.fastest = turns.fastest + float(getattr(base, "fastest", 0.0))

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the rotating IMU; see `Trajectory.state`."""
        return part_by_part(self._state, check_instants(t, self.start, self.end))

    def _state(self, instants: Array) -> NavState:
        s = self.base.state(instants)
        q_vb = self.turns.attitude(np.atleast_1d(instants)).reshape(*instants.shape, 4)
        return NavState(s.latitude, s.longitude, s.height, s.velocity_ned, rotation.multiply(s.q_nb, q_vb))

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the rotating IMU; see `Trajectory.rates`."""
        instants = check_instants(t, self.start, self.end)
        time = np.atleast_1d(instants)
        omega, force = self.base.rates(time)
        q_bv = rotation.conjugate(self.turns.attitude(time))
        omega = rotation.rotate(q_bv, omega) + self.turns.rate(time)
        return omega.reshape(*instants.shape, 3), rotation.rotate(q_bv, force).reshape(*instants.shape, 3)

    def increments(self, rate_hz: float) -> ImuData:
        """Return the increments of the rotating IMU's sensors (1); see `Trajectory.increments`."""
        own = self.base.increments(rate_hz)
        edges = own.time
        middle = 0.5 * (edges[1:] + edges[:-1])
        q_bv = rotation.conjugate(self.turns.attitude(middle))

        def turned(t: Array) -> Array:
            omega, force = self.base.rates(t)
            now = rotation.conjugate(self.turns.attitude(t))
            sample = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(middle) - 1)
            # (D − D₀) v without the cancellation: D = E D₀, (E − 1) v = 2 u × (u × v + s₀ v) for E = (s₀, u)
            turn = rotation.multiply(now, rotation.conjugate(q_bv[sample]))
            u, s0 = turn[:, 1:], turn[:, :1]
            parts = []
            for v in (rotation.rotate(q_bv[sample], omega), rotation.rotate(q_bv[sample], force)):
                parts.append(2.0 * np.cross(u, np.cross(u, v) + s0 * v))
            parts[0] += self.turns.rate(t)
            return np.concatenate(parts, axis=1)

        points = _FEW if self.fastest <= _SLOW * rate_hz else _MANY
        change = integrate_samples(turned, edges, self.fastest, self.breaks, points=points)
        return ImuData(
            edges,
            rotation.rotate(q_bv, own.dtheta) + change[:, :3],
            rotation.rotate(q_bv, own.dvel) + change[:, 3:],
        )
