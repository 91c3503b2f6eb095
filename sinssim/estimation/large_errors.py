"""Errors of any size: the states that have them, how these states move, and what readings say of them.

The filters that represent a distribution by points or members need no F and no H. Each point is an error e of the
inertial solution, in the axes of the error model; the state that would be true with it is, in Earth-fixed axes and
with δr, δv and φ of e,

    r = r̂ − δr,   v = v̂ − δv,   C_eb = exp([φ×]) Ĉ_eb                                                            (1)

The transformation from the model's axes to Earth-fixed ones is linear at a given solution, (4) and (5) of
`sinssim.estimation.error_dynamics`, so that (1) is inverted exactly. Over an interval T, the solution itself gives what
its sensors read: the turn Δ of the body in inertial space, the specific force's change of velocity s in the axes at the
start, and c, by which the position differs from the mean velocity. A point, whose sensors are wrong by δω and δf, and
whose gravity is stronger by δg, moves

    C⁺ = exp(−[ω_ie×] T) C exp([(Δ − δω T)×])                                                                      (2)
    v⁺ = v + C (s − δf T) + (g(r) + δg − 2 ω_ie × v) T                                                             (3)
    r⁺ = r + (v + v⁺) T/2 + C c                                                                                    (4)

The point without an error moves exactly as the solution.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.estimation.error_dynamics import (
    earth_from_ned,
    local_from_earth,
    rates_of_decay,
    reading_error,
)
from sinssim.estimation.state_model import GRAVITY, ErrorModel
from sinssim.sensors.measurement_kind import CORE, PHI, R, V


@dataclass(frozen=True)
class EarthFixed:
    """States in Earth-fixed axes, K rows."""

    position: Array  # (K, 3) m
    velocity: Array  # (K, 3) m/s
    q_eb: Array  # (K, 4)

    @classmethod
    def of(cls, state: NavState, ellipsoid: Ellipsoid) -> EarthFixed:
        """Return navigation states in Earth-fixed axes."""
        q_en = earth.q_en(state.latitude, state.longitude)
        place = earth.geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid)
        return cls(place, rotation.rotate(q_en, state.velocity_ned), rotation.multiply(q_en, state.q_nb))

    def row(self, k: int) -> EarthFixed:
        """Return a row."""
        return EarthFixed(self.position[k], self.velocity[k], self.q_eb[k])

    def less(self, errors: Array) -> EarthFixed:
        """Return the states that would be true if one had errors, (N, 9) in Earth-fixed axes: (1)."""
        turn = rotation.quaternion_from_rotation_vector(errors[:, PHI])
        q_eb = rotation.multiply(turn, np.broadcast_to(self.q_eb, turn.shape))
        return EarthFixed(self.position - errors[:, R], self.velocity - errors[:, V], q_eb)

    def errors(self, true: EarthFixed) -> Array:
        """Return the errors of a state if another one, N rows, is true, (N, 9) in Earth-fixed axes: (1)."""
        back = rotation.conjugate(np.broadcast_to(self.q_eb, true.q_eb.shape))
        phi = rotation.rotation_vector_from_quaternion(rotation.multiply(true.q_eb, back))
        return np.hstack([self.position - true.position, self.velocity - true.velocity, phi])

    def navigation(self, ellipsoid: Ellipsoid) -> NavState:
        """Return the states in north, east, down."""
        latitude, longitude, height = earth.ecef_to_geodetic(self.position, ellipsoid)
        q_ne = rotation.conjugate(earth.q_en(latitude, longitude))
        velocity = rotation.rotate(q_ne, self.velocity)
        return NavState(latitude, longitude, height, velocity, rotation.multiply(q_ne, self.q_eb))


def _to_earth(state: NavState, ellipsoid: Ellipsoid, axes: str) -> tuple[Array, Array]:
    """Return the matrices, (K, 9, 9), from errors in the model's axes to Earth-fixed ones, and back."""
    to, back = local_from_earth(state, ellipsoid)
    if axes == "transported":
        return back, to
    turn = np.tan(state.latitude) / (earth.radii(state.latitude, ellipsoid)[1] + state.height)  # ψ/δr_E
    north = np.zeros_like(to)
    north[:, V.start, R.start + 1] = -turn * state.velocity_ned[:, 1]  # ψ k̂ × v, k̂ down
    north[:, V.start + 1, R.start + 1] = turn * state.velocity_ned[:, 0]
    north[:, PHI.start + 2, R.start + 1] = -turn
    # δ of the state relative to its own north is (1 + north) times that in transported axes; north² is zero
    return back - back @ north, to + north @ to


@dataclass(frozen=True)
class PointMotion:
    """What moves states with errors of any size over the intervals of a segment of K epochs."""

    axes: str  # of the model's errors
    ellipsoid: Ellipsoid
    gravity: str  # name of the engine's gravity model
    interval: Array  # (K,) s
    solution: EarthFixed  # at the beginning and at the epochs, K+1 rows
    to_earth: Array  # from errors in the model's axes, (K+1, 9, 9)
    from_earth: Array  # the way back, (K+1, 9, 9)
    turn: Array  # Δ, (K, 3) rad
    pushed: Array  # s, (K, 3) m/s
    bent: Array  # c, (K, 3) m
    gyro: Array  # matrix of δω, (K, 3, n)
    accel: Array  # matrix of δf, (K, 3, n)
    unknown: Array  # matrix of δg, (K, 3, n)
    decay: Array  # factor of the parameters' states, (K, n − 9)

    @classmethod
    def along(
        cls, model: ErrorModel, state: NavState, interval: Array, readings: tuple[Array, Array], gravity: str,
        ellipsoid: Ellipsoid,
    ) -> PointMotion:  # fmt: skip
        """Return the motion along a solution at the beginning and at the epochs, K+1 rows, an interval, (K,) s, apart,
        from the mean inertial rate and specific force in body axes, (K, 3) each, and the name of the engine's gravity
        model."""
        fixed, t = EarthFixed.of(state, ellipsoid), interval[:, None]
        to_earth, from_earth = _to_earth(state, ellipsoid, model.axes)
        back = rotation.conjugate(fixed.q_eb[:-1])
        spin = rotation.quaternion_from_rotation_vector(t * (0.0, 0.0, ellipsoid.omega))
        turn = rotation.multiply(back, rotation.multiply(spin, fixed.q_eb[1:]))  # (2) without errors
        pull = _pull(fixed.position[:-1], fixed.velocity[:-1], gravity, ellipsoid)
        pushed = np.diff(fixed.velocity, axis=0) - t * pull
        bent = np.diff(fixed.position, axis=0) - 0.5 * t * (fixed.velocity[1:] + fixed.velocity[:-1])
        rate, force = readings
        unknown = np.zeros((len(interval), 3, model.size))
        if GRAVITY in model.slices:
            unknown[:, :, model.slices[GRAVITY]] = earth_from_ned(state.latitude, state.longitude)[:-1]
        return cls(
            model.axes, ellipsoid, gravity, interval, fixed, to_earth, from_earth,
            rotation.rotation_vector_from_quaternion(turn), rotation.rotate(back, pushed), rotation.rotate(back, bent),
            reading_error(model, "gyro", rate, force), reading_error(model, "accelerometer", force, force), unknown,
            np.exp(-t * rates_of_decay(model, 0.5 * (state.velocity_ned[1:] + state.velocity_ned[:-1]))),
        )  # fmt: skip

    def moved(self, k: int, errors: Array) -> Array:
        """Return errors, (N, n), after the interval before the epoch `k`, from those before it: (2) to (4)."""
        t = float(self.interval[k])
        point = self.solution.row(k).less(errors[:, :CORE] @ self.to_earth[k].T)
        turn = rotation.quaternion_from_rotation_vector(self.turn[k] - t * (errors @ self.gyro[k].T))
        spin = rotation.quaternion_from_rotation_vector(np.array([[0.0, 0.0, -t * self.ellipsoid.omega]]))
        q_eb = rotation.multiply(np.broadcast_to(spin, turn.shape), rotation.multiply(point.q_eb, turn))
        velocity = point.velocity + t * _pull(point.position, point.velocity, self.gravity, self.ellipsoid)
        velocity += rotation.rotate(point.q_eb, self.pushed[k] - t * (errors @ self.accel[k].T))
        velocity += t * (errors @ self.unknown[k].T)
        position = point.position + 0.5 * t * (point.velocity + velocity)
        position += rotation.rotate(point.q_eb, np.broadcast_to(self.bent[k], position.shape))
        after = self.solution.row(k + 1).errors(EarthFixed(position, velocity, q_eb))
        return np.hstack([after @ self.from_earth[k + 1].T, errors[:, CORE:] * self.decay[k]])

    def states(self, k: int, errors: Array) -> NavState:
        """Return the states that would be true at the epoch `k` with errors, (N, n)."""
        return self.solution.row(k + 1).less(errors[:, :CORE] @ self.to_earth[k + 1].T).navigation(self.ellipsoid)

    def referred(self, k: int, errors: Array, *, fed: Array, after: NavState, within: Array | None = None) -> Array:
        """Return errors at the epoch `k`, (N, n), relative to the solution after errors, (n,), were fed back, one row.

        They are in that solution's own axes. `within` is the matrix of `calibrated`.
        """
        true = self.solution.row(k + 1).less(errors[:, :CORE] @ self.to_earth[k + 1].T)
        there = EarthFixed.of(after, self.ellipsoid).row(0).errors(true)
        from_earth = _to_earth(after, self.ellipsoid, self.axes)[1][0]
        parameters = errors[:, CORE:] - fed[CORE:]
        if within is not None:
            parameters = parameters @ within[CORE:, CORE:].T
        return np.hstack([there @ from_earth.T, parameters])


def _pull(position: Array, velocity: Array, gravity: str, ellipsoid: Ellipsoid) -> Array:
    """Return gravity and the Coriolis acceleration in Earth-fixed axes, (K, 3) m/s²."""
    out = earth.gravitation_ecef(position, gravity, ellipsoid)
    w = ellipsoid.omega
    out[:, 0] += w * w * position[:, 0] + 2.0 * w * velocity[:, 1]
    out[:, 1] += w * w * position[:, 1] - 2.0 * w * velocity[:, 0]
    return out
