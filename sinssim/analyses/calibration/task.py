"""The inputs of a calibration: measurements, dwells, the nominal sequence, the place, noise and parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sinssim import earth, rotation
from sinssim.analyses.calibration.least_squares import Solution
from sinssim.analyses.calibration.noise import TriadNoise, noise_of
from sinssim.analyses.calibration.parameters import Parameter, errors_of, parameters
from sinssim.analyses.calibration.spans import Dwells
from sinssim.data import Array, ImuData
from sinssim.earth.models import ELLIPSOIDS
from sinssim.scenario.schema import Scenario
from sinssim.scenario.sections.calibration import CalibrationSection
from sinssim.scenario.true_motion import mounting
from sinssim.sensors.imu.compensation import compensate_checked
from sinssim.truth.turntable.turntable import Turntable
from sinssim.units import ARCSEC, DEG


@dataclass(frozen=True)
class Task:
    """A calibration to compute.

    Attributes:
        imu: the readings, from the beginning of the sequence.
        dwells: samples of the dwells.
        attitude: nominal attitudes q_nb in the positions, (P, 4).
        axis: nominal axes of the turns in the block's axes, unit vectors, (P − 1, 3).
        angle: their angles, (P − 1,) rad.
        force: specific force of a standing block, north-east-down, (3,) m/s².
        earth_rate: the Earth's rate, north-east-down, (3,) rad/s.
        gyro, accel: noise.
        known: the parameters to estimate.
        section: the [calibration] table.
        position_sigma, tilt_sigma: assumed accuracy of the table, rad.
    """

    imu: ImuData
    dwells: Dwells
    attitude: Array
    axis: Array
    angle: Array
    force: Array
    earth_rate: Array
    gyro: TriadNoise
    accel: TriadNoise
    known: tuple[Parameter, ...]
    section: CalibrationSection
    position_sigma: float
    tilt_sigma: float

    @property
    def size(self) -> Array:
        """Sizes of the parameters, (p,) SI."""
        return np.array([one.size for one in self.known])

    def compensated(self, values: Array) -> ImuData:
        """Return the readings compensated by values of the parameters.

        Args:
            values: (p,) SI.
        """
        return compensate_checked(replace(self.imu, flags=None), errors_of(self.known, values))


@dataclass(frozen=True)
class Estimate:
    """What a method finds.

    Attributes:
        values: values of the parameters, (p,) SI.
        solution: the last linear solution: covariance and observability.
        iterations: number of linear solutions.
        residual_gyro: residuals of the gyros by position and by turn, in the order of time, as mean rates, (K, 3)
            rad/s; of the systematic method (0, 3).
        residual_accel: residuals of the accelerometers by position, as mean specific forces, (P, 3) m/s²; of the
            systematic method those of the velocity, m/s.
        normalised: all residuals in units of their 1σ, in the order of time.
        tilt: estimated tilt of the base, (3,) rad; None of the systematic method.
    """

    values: Array
    solution: Solution
    iterations: int
    residual_gyro: Array
    residual_accel: Array
    normalised: Array
    tilt: Array | None = None


def make_task(scenario: Scenario, section: CalibrationSection, imu: ImuData, dwells: Dwells) -> Task:
    """Return the calibration that a scenario describes."""
    table = scenario.turntable
    assert table is not None  # checked by the caller
    attitude, axis, angle = nominal(table, mounting(scenario).q_bs)
    latitude, height = np.radians(table.latitude_deg), table.altitude_m
    ellipsoid = ELLIPSOIDS[scenario.truth.ellipsoid]
    rate = ellipsoid.omega * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    force = -earth.gravity_ned(latitude, height, scenario.truth.gravity, ellipsoid)
    given = bool(np.any(scenario.imu.accel_arms_mm))
    arms = section.method == "systematic" and (given if section.arms is None else section.arms)
    position = table.position_sigma_arcsec if section.position_sigma_arcsec is None else section.position_sigma_arcsec
    tilt = table.tilt_sigma_arcsec if section.tilt_sigma_arcsec is None else section.tilt_sigma_arcsec
    return Task(
        imu,
        dwells,
        attitude,
        axis,
        angle,
        np.asarray(force, dtype=np.float64).reshape(3),
        rate,
        noise_of(scenario.imu, "gyro"),
        noise_of(scenario.imu, "accel"),
        parameters(scenario.imu, section.method, arms),
        section,
        position * ARCSEC,
        tilt * ARCSEC,
    )


def nominal(table: Turntable, q_bs: Array) -> tuple[Array, Array, Array]:
    """Return the nominal sequence of a table.

    Args:
        q_bs: mounting of the sensor block, (4,).

    Returns:
        Attitudes of the sensor block q_ns in the positions, (P, 4); axes of the turns in its axes, (P − 1, 3); angles,
        (P − 1,) rad.
    """
    q = [table.start_attitude]
    axes, angles = [], []
    for turn in table.all_turns:
        unit = np.array(turn.axis) / np.linalg.norm(turn.axis)
        angle = turn.angle_deg * DEG
        q.append(rotation.multiply(q[-1], rotation.quaternion_from_rotation_vector(angle * unit)))
        axes.append(rotation.rotate(rotation.conjugate(q_bs), unit))
        angles.append(angle)
    return rotation.multiply(np.array(q), q_bs), np.array(axes).reshape(-1, 3), np.array(angles)
