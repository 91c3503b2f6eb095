"""pyins' feedback filter (N. Mayorov, package python-ins, 1.0.1) on increments and fixes, with its covariances.

pyins keeps the covariance of every step to itself, and returns standard deviations; it is caught on the way out.

Its error model lacks a term of first order. Its velocity error is δv − V × φ, with φ the attitude's error and V the
velocity. The derivative of that contains V × (ψ × ω_ie), with ω_ie the Earth's rate, ψ = φ − δθ and δθ the rotation of
the local level that belongs to the position error; pyins' matrix has zeros there. `with_earth_rate` adds it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import ImuData, NavSolution, NavState

Array = NDArray[np.float64]

PVA = ["lat", "lon", "alt", "VN", "VE", "VD", "roll", "pitch", "heading"]
READINGS = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]


@dataclass(frozen=True)
class Filtered:
    """A filtered solution.

    Attributes:
        solution: K rows.
        covariance: of the errors of position north, east, down [m], velocity [m/s], and roll, pitch, heading [rad], (K,
            9, 9).
    """

    solution: NavSolution
    covariance: Array


def pva_rows(state: NavState) -> Array:
    """Return pyins' numbers of a state: degrees, metres, m/s, degrees."""
    angles = np.degrees(np.stack(rotation.euler_from_quaternion(state.q_nb), axis=-1))
    place = np.stack([np.degrees(state.latitude), np.degrees(state.longitude), state.height], axis=-1)
    return np.concatenate([place, state.velocity_ned, angles], axis=-1)


def state_of(rows: Array) -> NavState:
    """Return the states of pyins' numbers."""
    q_nb = rotation.quaternion_from_euler(*np.radians(rows[:, 6:9]).T)
    return NavState(np.radians(rows[:, 0]), np.radians(rows[:, 1]), rows[:, 2], rows[:, 3:6], q_nb)


def same_gravity(imu: ImuData, truth: NavState, gravity: Array) -> ImuData:
    """Return increments under which pyins' gravity acts as another one does.

    pyins has the normal gravity of the surface with a linear decrease. The difference is added to the specific force
    where the vehicle is; an error of the place changes it by 1e-5 of it for every kilometre.

    Args:
        imu: increments, N intervals.
        truth: true states at imu.time, N + 1 rows.
        gravity: the wanted gravity at them, north, east, down, (N + 1, 3) m/s².
    """
    from pyins import earth

    more = earth.gravity_n(np.degrees(truth.latitude), truth.height) - gravity
    body = rotation.rotate(rotation.conjugate(truth.q_nb), -more)
    step = np.diff(imu.time)[:, None]
    return ImuData(imu.time, imu.dtheta, imu.dvel + 0.5 * (body[1:] + body[:-1]) * step)


def increments_of(imu: ImuData) -> Any:
    """Return pyins' increments."""
    import pandas
    from pyins import strapdown

    rows = np.hstack([imu.dtheta, imu.dvel])
    frame = pandas.DataFrame(np.vstack([rows[:1], rows]), index=imu.time, columns=READINGS)
    return strapdown.compute_increments_from_imu(frame, "increment")


@contextmanager
def with_earth_rate() -> Iterator[None]:
    """Add V × (ψ × ω_ie) to pyins' error model."""
    from pyins import earth, util
    from pyins.error_model import InsErrorModel

    incomplete = InsErrorModel.system_matrices

    def complete(model: Any, trajectory: Any) -> Any:
        f, gyro, accel = incomplete(model, trajectory)
        across = util.skew_matrix(trajectory[PVA[3:6]]) @ util.skew_matrix(earth.rate_n(trajectory.lat))
        f[..., 3:6, 6:9] -= across
        f[..., 3:6, 0:3] += across @ earth.curvature_matrix(trajectory.lat, trajectory.alt)
        return f, gyro, accel

    with mock.patch.object(InsErrorModel, "system_matrices", complete):
        yield


def feedback_filter(
    imu: ImuData,
    start: NavState,
    fixes: tuple[Array, Array, Array],
    *,
    sigma: tuple[float, float],
    lever_arm: tuple[float, float, float],
    initial: tuple[float, float, float, float],
    gyro: dict[str, Any],
    accel: dict[str, Any],
    time_step: float,
) -> Filtered:
    """Run pyins' filter.

    Args:
        imu: increments.
        start: state at imu.time[0], scalars.
        fixes: times, positions (latitude, longitude, rad, height, m) and velocities north, east, down.
        sigma: of a fix, m and m/s.
        lever_arm: of the antenna, block axes, m.
        initial: 1σ of position, velocity, roll and pitch, heading; m, m/s, rad.
        gyro, accel: arguments of pyins' `EstimationModel`.
        time_step: of the covariance's propagation, s.
    """
    import pandas
    from pyins import filters, inertial_sensor, measurements
    from pyins.error_model import InsErrorModel

    time, position, velocity = fixes
    places = np.column_stack([np.degrees(position[:, :2]), position[:, 2]])
    caught: dict[str, Any] = {}
    compute = filters._compute_sd

    def catch(covariance: Array, trajectory: Any, *rest: Any) -> Any:
        caught.update(covariance=covariance, trajectory=trajectory)
        return compute(covariance, trajectory, *rest)

    with mock.patch.object(filters, "_compute_sd", catch):
        filters.run_feedback_filter(
            pandas.Series(pva_rows(start), index=PVA, name=float(imu.time[0])),
            initial[0],
            initial[1],
            float(np.degrees(initial[2])),
            float(np.degrees(initial[3])),
            increments_of(imu),
            inertial_sensor.EstimationModel(**gyro),
            inertial_sensor.EstimationModel(**accel),
            [
                measurements.Position(pandas.DataFrame(places, index=time, columns=PVA[:3]), sigma[0], lever_arm),
                measurements.NedVelocity(pandas.DataFrame(velocity, index=time, columns=PVA[3:6]), sigma[1], lever_arm),
            ],
            time_step,
        )
    trajectory = caught["trajectory"]
    output = InsErrorModel().transform_to_output(trajectory)
    size = np.repeat([1.0, np.radians(1.0)], [6, 3])
    covariance = output @ caught["covariance"][:, :9, :9] @ output.transpose(0, 2, 1) * np.outer(size, size)
    at = state_of(trajectory[PVA].to_numpy())
    solution = NavSolution(
        trajectory.index.to_numpy(),
        at.latitude,
        at.longitude,
        at.height,
        at.velocity_ned,
        at.q_nb,
        np.zeros(len(at.height)),
    )
    return Filtered(solution, covariance)
