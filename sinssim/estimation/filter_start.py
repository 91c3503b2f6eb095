"""State and covariance of the filter after a coarse alignment, at rest or in motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sinssim import earth, rotation
from sinssim.alignment.alignment_budget import Expected
from sinssim.alignment.base_motion import stillness
from sinssim.alignment.determination import determine, mean_readings
from sinssim.alignment.initial_conditions import STATES, initial_covariance, initial_state
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.estimation.alignment_in_motion import align_by_course, align_in_motion
from sinssim.estimation.state_model import ErrorModel
from sinssim.sensors.imu.fields import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors


@dataclass(frozen=True)
class Start:
    """Start of a filter.

    Attributes:
        imu: samples from the start on.
        state: state at the start.
        covariance: covariance of the first m states' errors, (m, m); None for that of the error model.
    """

    imu: ImuData
    state: NavState
    covariance: Array | None


# Long: most of it says what it takes.
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
    """Align a vehicle at rest by eq. (1), gravity and the Earth's rate.

    Eq. (1) takes the direction of gravity for the vertical. Above the ellipsoid it differs from the normal, to which
    attitudes refer, by up to 0.17″ per km of height; the result is corrected for that.

    Args:
        imu: all increments.
        initial: position of the vehicle; the attitude is not used.
        model: the error model.
        sigma: standard deviations of the sensor block's errors.
        count: number of samples that the alignment takes.
        grade_sigma: standard deviations of the sensors' grade, by whose noise a standstill is judged; by default
            `sigma`.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid.

    Returns:
        The start at the end of these samples; the covariance includes the correlation of the sensors' constant errors
        with the attitude.

    Raises:
        InputError: the vehicle moved.
    """
    session = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    expected = Expected(ImuErrors(warm_up=sigma.warm_up), sigma)
    seconds = float(session.time[-1] - session.time[0])
    determination = determine(*mean_readings(session), expected.instrument_sigmas)
    own = sigma if grade_sigma is None else grade_sigma
    still = stillness(session, Expected(ImuErrors(warm_up=own.warm_up), own))
    still.require()
    latitude, height = float(initial.latitude), float(initial.height)
    start = initial_state(determination, float(initial.longitude), height, latitude)
    north, _, down = earth.gravity_ned(latitude, height, gravity, earth.ellipsoid_by_name(ellipsoid))
    to_normal = rotation.quaternion_from_rotation_vector((0.0, np.arctan2(north, down), 0.0))
    start = replace(start, q_nb=rotation.multiply(to_normal, start.q_nb))
    tied = [state for state in model.states if state in STATES]
    places = [model.states.index(state) for state in tied]
    covariance = model.covariance.copy()
    covariance[np.ix_(places, places)] = initial_covariance(
        determination,
        replace(sigma, gyro=_held(sigma.gyro, "gyro", model), accel=_held(sigma.accel, "accelerometer", model)),
        seconds,
        height=height,
        latitude=latitude,
        position_sigma=model.sigma[:3],
        velocity_sigma=model.sigma[3:6],
        rate_hz=count / seconds,
        states=tied,
        still=still,
    )
    return Start(_from(imu, count), start, covariance)


def _held(triad: TriadErrors, name: str, model: ErrorModel) -> TriadErrors:
    """Return a triad's errors with everything that the model's bias represents as a bias, as it is in the mean."""
    where = model.slices.get(f"{name} bias")
    if where is None:
        return triad
    none = np.zeros(3)
    return replace(triad, bias=model.sigma[where], bias_temperature=none, ramp=none, flicker=0.0)


def in_motion(
    imu: ImuData,
    position: Measurements,
    velocity: Measurements,
    sigma: ImuErrors,
    count: int,
    gravity: str = "normal",
    ellipsoid: str = "wgs84",
) -> Start:
    """Align a moving vehicle by velocity changes from the accelerometers and from satellites.

    Args:
        position: "gnss-position".
        velocity: "gnss-velocity" at the same instants.
        sigma: standard deviations of the sensor block's errors.
        gravity: one of `sinssim.GRAVITY_MODELS`.

    Raises:
        InputError: too few fixes.
        RunError: the vehicle hardly accelerated.
    """
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
    """Align a land vehicle by its course.

    Args:
        position: "gnss-position".
        velocity: "gnss-velocity".
        sigma: standard deviations of the sensor block's errors.
        angles: pitch and yaw of the vehicle's axes in the block's, rad.
        angles_sigma: 1σ of each of them, rad.

    Returns:
        The start, at the beginning of the data if the vehicle stands there, else at the first clear course.

    Raises:
        InputError: no fixes.
        RunError: the vehicle does not move.
    """
    session = ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])
    aligned = align_by_course(session, position, velocity, sigma, angles=angles, angles_sigma=angles_sigma)
    return Start(_from(imu, aligned.edge), aligned.state, aligned.covariance)


def _from(imu: ImuData, edge: int) -> ImuData:
    return ImuData(imu.time[edge:], imu.dtheta[edge:], imu.dvel[edge:])
