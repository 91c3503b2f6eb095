"""State and covariance of the filter after a coarse alignment, at rest or in motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sinssim import earth
from sinssim.alignment.alignment_in_motion import align_by_course, align_in_motion
from sinssim.alignment.initial_conditions import STATES, aligned_at_rest, initial_covariance
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.estimation.state_model import FLICKER, GRAVITY, Block, ErrorModel
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.measurement_kind import CORE, PHI


@dataclass(frozen=True)
class Start:
    """Start of a filter."""

    imu: ImuData  # samples from the start on
    state: NavState  # state at the start
    covariance: Array | None  # covariance of the first m states' errors, (m, m); None for that of the error model


def at_rest(
    imu: ImuData,
    initial: NavState,
    model: ErrorModel,
    sigma: ImuErrors,
    count: int,
    grade_sigma: ImuErrors | None = None,
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> Start:
    """Align a vehicle at rest by eq. (1) on the first `count` samples, at the position of `initial`.

    The covariance includes the correlation of the sensors' constant errors, of 1σ `sigma`, and of the gravity
    disturbance with the attitude. A standstill is judged by the noise of `grade_sigma`, or of `sigma` without it.
    """
    session = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    seconds = float(session.time[-1] - session.time[0])
    state, determination, still = aligned_at_rest(
        session, initial, sigma, gravity, earth.ellipsoid_by_name(ellipsoid), grade_sigma
    )
    tied = [name for name in model.states if name in STATES]
    places = [model.states.index(name) for name in tied]
    covariance = model.covariance.copy()
    covariance[np.ix_(places, places)] = initial_covariance(
        determination,
        replace(
            sigma,
            gyro=_as_bias(sigma.gyro, "gyro", model, seconds),
            accel=_as_bias(sigma.accel, "accelerometer", model, seconds),
        ),
        seconds,
        height=float(initial.height),
        latitude=float(initial.latitude),
        position_sigma=model.sigma[:3],
        velocity_sigma=model.sigma[3:6],
        rate_hz=count / seconds,
        states=tied,
        still=still,
    )
    for name in ("gyro", "accelerometer"):
        _share_bias(covariance, model, name, _slow(model, name, seconds))
    if GRAVITY in model.slices:
        _add_plumb_line(covariance, model.slices[GRAVITY], float(initial.latitude), float(initial.height))
    return Start(_from(imu, count), state, covariance)


def _add_plumb_line(covariance: Array, of_gravity: slice, latitude: float, height: float) -> None:
    """Add the attitude's error by a plumb line that is not the normal of the ellipsoid.

    With φ × γ = δg horizontally and φ × ω_ie = 0 to the east, φ = (−δg_E, δg_N, δg_E tan(latitude))/γ.
    """
    gamma = float(earth.gravity_ned(latitude, height)[2])
    tilted = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, np.tan(latitude), 0.0]]) / gamma
    unknown = covariance[of_gravity, of_gravity]
    covariance[PHI, PHI] += tilted @ unknown @ tilted.T
    covariance[PHI, of_gravity] = tilted @ unknown
    covariance[of_gravity, PHI] = unknown @ tilted.T


def _slow(model: ErrorModel, name: str, seconds: float) -> list[Block]:
    """Return the processes of a triad's flicker that an alignment sees as a bias."""
    names = model.sums.get(f"{name} {FLICKER}", ())
    return [block for block in model.blocks if block.name in names and block.correlation_time > seconds]


def _as_bias(triad: TriadErrors, name: str, model: ErrorModel, seconds: float) -> TriadErrors:
    """Return a triad's errors with everything that the model's bias represents as a bias, as it is in the mean.

    Slow processes of flicker are part of it, and the mean of the others, of which Σ 2σ²τ is the density, is noise.
    """
    where = model.slices.get(f"{name} bias")
    if where is None:
        return triad
    none, slow = np.zeros(3), _slow(model, name, seconds)
    fast = [b for b in model.blocks if b.name in model.sums.get(f"{name} {FLICKER}", ()) and b not in slow]
    white = sum(2.0 * float(np.max(b.sigma)) ** 2 * b.correlation_time for b in fast)
    bias = np.sqrt(model.sigma[where] ** 2 + sum(np.square(b.sigma) for b in slow))
    return replace(
        triad,
        bias=bias,
        bias_temperature=none,
        ramp=none,
        flicker=0.0,
        random_walk=np.hypot(triad.random_walk, white**0.5),
    )


def _share_bias(covariance: Array, model: ErrorModel, name: str, slow: list[Block]) -> None:
    """Give each slow process of flicker its share of the covariance with what is determined as one bias."""
    where = model.slices.get(f"{name} bias")
    if where is None or not slow:
        return
    tied = covariance[:CORE, where].copy()
    constant = model.sigma[where] ** 2
    whole = constant + sum(np.square(block.sigma) for block in slow)
    for part, share in ((where, constant), *((model.slices[b.name], np.square(b.sigma)) for b in slow)):
        covariance[:CORE, part] = tied * np.divide(share, whole, out=np.zeros(3), where=whole > 0.0)
        covariance[part, :CORE] = covariance[:CORE, part].T
        covariance[part, part] = np.diag(np.broadcast_to(share, 3))


def in_motion(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    count: int,
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> Start:
    """Align a moving vehicle by `align_in_motion` on the first `count` samples."""
    session = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    aligned = align_in_motion(session, position, velocity, sigma, gravity=gravity, ellipsoid=ellipsoid)
    return Start(_from(imu, aligned.edge), aligned.state, aligned.covariance)


def by_course(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    count: int,
    angles: tuple[float, float] = (0.0, 0.0),
    angles_sigma: float = 0.0,
) -> Start:
    """Align a land vehicle by `align_by_course` on the first `count` samples."""
    session = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    aligned = align_by_course(session, position, velocity, sigma, angles=angles, angles_sigma=angles_sigma)
    return Start(_from(imu, aligned.edge), aligned.state, aligned.covariance)


def _from(imu: ImuData, edge: int) -> ImuData:
    return ImuData(imu.time[edge:], imu.dtheta[edge:], imu.dvel[edge:])
