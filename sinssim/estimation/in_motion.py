"""Alignment in motion from nothing: attitude from the velocity that accelerometers and satellites see alike.

In the inertial frame i, Earth-fixed at the first fix, the velocity changes by gravitation γ and by the specific force,
which the gyros carry in the inertial frame b₀, the block at the first sample:

    β(t) = v_i(t) − v_i(0) − ∫γ dt = C_ib₀ α(t),   α(t) = ∫C_b₀b f dt

with β from fixes and α from the increments. The constant C_ib₀ is the rotation that takes the changes of α over windows
of time into those of β best (Wahba's problem), whatever the attitude is: no error needs to be small. The method is
optimisation-based alignment by velocity integration (Wu and Pan, IEEE Trans. AES 49, 2013, 1006), in inertial axes. An
antenna on a lever arm l moves by C_b₀b (ω × l) besides, which goes with α.

What comes out is good to some degrees of heading. The filter that starts from it does the rest. How much of the error
comes from which bias is not handed on: that holds to first order in angles that are not small, and a filter that were
told would soon be surer of the biases than it may.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim import earth, rotation
from sinssim.alignment.disturbed import inertial_curve
from sinssim.checks import checked_increments
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth import Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, RunError
from sinssim.estimation.nominal import Gyros
from sinssim.sensors.compensation import compensate
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors

WINDOW = 20.0
"""Length of the windows, s: long enough for fixes to show a change of velocity, short enough for many of them."""

WORST = np.radians(15.0)
"""Largest 1σ of an angle with which the filter may start, rad."""


@dataclass(frozen=True)
class InMotion:
    """Where the filter can start.

    Attributes:
        state: at the last fix.
        covariance: of its errors: position and velocity north, east, down, attitude φ, (9, 9).
        residual: root mean square of the changes of velocity over a window that the rotation leaves, m/s.
    """

    state: NavState
    covariance: Array
    residual: float


@dataclass(frozen=True)
class _Fixes:
    """Fixes in i.

    Attributes:
        time: (M,) s.
        place, speed: as they were measured, (M, 3).
        beta: (M, 3) m/s.
        arm: of the antenna, (3,) m.
        q_ni: from i into north, east, down at the last fix, (4,).
    """

    time: Array
    place: Array
    speed: Array
    beta: Array
    arm: Array
    q_ni: Array

    @property
    def span(self) -> int:
        """Number of fixes in a window."""
        return max(int(np.searchsorted(self.time - self.time[0], WINDOW)), 1)

    def changes(self, of: Array) -> Array:
        """Return the changes over the windows, (M − span, 3)."""
        return np.asarray(of[self.span :] - of[: -self.span])


def align_in_motion(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    *,
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> InMotion:
    """Find the attitude of a moving vehicle of which nothing is known.

    Args:
        imu: increments from before the first to after the last fix that is to be used; a minute or two.
        position: "gnss-position".
        velocity: "gnss-velocity" at the same instants.
        sigma: standard deviations of the sensor block's errors.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid.

    Returns:
        State and covariance at the last fix.

    Raises:
        InputError: fixes that do not belong together or are too few.
        RunError: the vehicle hardly accelerated, so that some angle stays unknown.
    """
    checked_increments(imu)
    shape = ellipsoid_by_name(ellipsoid)
    fixes = _fixes(imu, position, velocity, gravity, shape)
    q_nb, along, residual = _attitude(imu, fixes)

    c_ni = rotation.dcm_from_quaternion(fixes.q_ni)
    attitude = c_ni @ _noise(fixes, along, float(np.max(velocity.sigma)), sigma) @ c_ni.T
    # and what one standard deviation of each bias does: solved again without it
    bias = np.concatenate([np.broadcast_to(sigma.gyro.bias, 3), np.broadcast_to(sigma.accel.bias, 3)])
    for k in np.flatnonzero(bias):
        one = np.where(np.arange(6) == k, bias, 0.0)
        freed = compensate(imu, ImuErrors(TriadErrors(bias=one[:3]), TriadErrors(bias=one[3:])))
        turned = rotation.multiply(_attitude(freed, fixes)[0], rotation.conjugate(q_nb))
        by_bias = rotation.rotation_vector_from_quaternion(turned)
        attitude += np.outer(by_bias, by_bias)
    worst = float(np.sqrt(np.linalg.eigvalsh(attitude)[-1]))
    if not worst <= WORST:
        raise RunError(
            f"alignment in motion from t = {fixes.time[0]:.6g} s to {fixes.time[-1]:.6g} s: the vehicle accelerated "
            "too little to show its attitude to these sensors; it would be wrong by "
            f"{np.degrees(worst):.3g}° (1σ). Turns or changes of speed are needed, or a longer time with them."
        )
    # What is of second order in an error of this size is not noise, but the filter must not be surer than that.
    attitude += np.eye(3) * worst**4
    covariance = np.zeros((9, 9))
    covariance[range(3), range(3)] = position.sigma[-1] ** 2
    covariance[range(3, 6), range(3, 6)] = velocity.sigma[-1] ** 2
    covariance[6:, 6:] = attitude
    rate = Gyros(imu).at(fixes.time[-1:], ImuErrors())[0]
    return InMotion(_block(fixes, q_nb, rate, shape), covariance, residual)


def _fixes(imu: ImuData, position: Measurements, velocity: Measurements, gravity: str, ellipsoid: Ellipsoid) -> _Fixes:
    for m, kind in ((position, "gnss-position"), (velocity, "gnss-velocity")):
        if m.kind != kind:
            raise InputError(f"alignment in motion needs measurements of kind {kind!r}, not {m.kind!r}.")
    _, first, second = np.intersect1d(position.time, velocity.time, return_indices=True)
    time, place, speed = position.time[first], position.value[first], velocity.value[second]
    used = np.isfinite(place).all(axis=1) & np.isfinite(speed).all(axis=1)
    used &= (time >= imu.time[0]) & (time <= imu.time[-1])
    time, place, speed = time[used], place[used], speed[used]
    if len(time) < 3 or time[-1] - time[0] < 2.0 * WINDOW:
        lasting = float(time[-1] - time[0]) if len(time) else 0.0
        raise InputError(
            f"alignment in motion has {len(time)} instants with position and velocity over {lasting:.6g} s within the "
            f"inertial data; at least {2.0 * WINDOW:g} s of them are needed."
        )
    since = time - time[0]
    r_e = earth.geodetic_to_ecef(place[:, 0], place[:, 1], place[:, 2], ellipsoid)
    v_e = rotation.rotate(earth.q_en(place[:, 0], place[:, 1]), speed)
    v_e += ellipsoid.omega * np.stack([-r_e[:, 1], r_e[:, 0], np.zeros(len(r_e))], axis=1)  # ω_ie × r
    pull = earth.ecef_to_eci(earth.gravitation_ecef(r_e, gravity, ellipsoid), since, ellipsoid)
    fallen = np.zeros_like(pull)
    fallen[1:] = np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(time)[:, None], axis=0)
    q_in = earth.q_en(place[-1, 0], place[-1, 1] + ellipsoid.omega * since[-1])
    arm = np.asarray(velocity.lever_arm, dtype=np.float64)
    beta = earth.ecef_to_eci(v_e, since, ellipsoid) - fallen
    return _Fixes(time, place, speed, beta, arm, rotation.conjugate(q_in))


def _attitude(imu: ImuData, fixes: _Fixes) -> tuple[Array, Array, float]:
    """Return q_nb at the last fix, the windows' changes of β along which it was found, and their rms residual."""
    from scipy.spatial.transform import Rotation

    q_b0b, pushed = inertial_curve(imu)
    alpha = np.stack([np.interp(fixes.time, imu.time, axis) for axis in pushed.T], axis=1)
    edge = np.searchsorted(imu.time, fixes.time - 1e-7)
    if fixes.arm.any():
        alpha += rotation.rotate(q_b0b[edge], np.cross(Gyros(imu).at(fixes.time, ImuErrors()), fixes.arm))
    change = fixes.changes(alpha)
    best, distance = Rotation.align_vectors(fixes.changes(fixes.beta), change)
    q_ib = rotation.multiply(best.as_quat(scalar_first=True), q_b0b[edge[-1]])
    along = np.asarray(best.apply(change))
    return rotation.multiply(fixes.q_ni, q_ib), along, float(distance) / np.sqrt(change.size)


def _noise(fixes: _Fixes, along: Array, velocity_sigma: float, sigma: ImuErrors) -> Array:
    """Return the covariance of the attitude in i from the noise of fixes and sensors, (3, 3).

    A small turn δ moves the change c of a window by δ × c. The fit is δ = U Σ c × e of the windows' errors e, with
    U⁻¹ = Σ |c|² I − c cᵀ, and every fix's error is in two windows, at the end of one and at the beginning of another.
    """
    span = fixes.span
    u = np.linalg.inv(np.sum(along * along) * np.eye(3) - along.T @ along + 1e-9 * np.eye(3))
    weight = np.zeros((len(fixes.time), 3))
    weight[span:] += along
    weight[:-span] -= along
    of_fixes = np.sum(weight * weight) * np.eye(3) - weight.T @ weight
    lasting = float(fixes.time[-1] - fixes.time[0])
    fix = velocity_sigma**2 + sigma.accel.random_walk**2 * lasting / len(fixes.time)
    return np.asarray(fix * u @ of_fixes @ u + sigma.gyro.random_walk**2 * lasting * np.eye(3))


def _block(fixes: _Fixes, q_nb: Array, rate_b: Array, ellipsoid: Ellipsoid) -> NavState:
    """Return the state of the block at the last fix; its antenna is on a lever arm."""
    place, speed = fixes.place[-1], fixes.speed[-1]
    q_eb = rotation.multiply(earth.q_en(place[0], place[1]), q_nb)
    antenna = earth.geodetic_to_ecef(place[0], place[1], place[2], ellipsoid)
    lat, lon, height = earth.ecef_to_geodetic(antenna - rotation.rotate(q_eb, fixes.arm), ellipsoid)
    turning = rate_b - rotation.rotate(rotation.conjugate(q_eb), np.array([0.0, 0.0, ellipsoid.omega]))
    return NavState(lat, lon, height, speed - rotation.rotate(q_nb, np.cross(turning, fixes.arm)), q_nb)
