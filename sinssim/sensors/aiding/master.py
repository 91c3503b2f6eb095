"""A master inertial system on the same vehicle: velocity and attitude for transfer alignment."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import Field

from sinssim import rotation
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, SensorState, Vehicle, state_at, turn_on, white
from sinssim.sensors.imu.grades import GradeName
from sinssim.toml_section import CorrelationTime, LeverArm, Noise, Spread
from sinssim.units import ARCMIN


class Master(AidingSensor):
    """A master inertial system on the same vehicle for transfer alignment; it starts at the same time."""

    rules = (
        (lambda s: not (s.velocity or s.attitude),
         "velocity = false and attitude = false leave no measurement: set one of them to true"),
    )  # fmt: skip

    grade: GradeName = Field(
        default="laser-navigation", description="grade of the sensors of the master, see `sinssim list grades`"
    )
    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0), description="position of the master relative to the sensor block: forward, right, down"
    )
    velocity: bool = Field(default=True, description="whether the velocity of the master is used")
    attitude: bool = Field(default=False, description="whether the attitude of the master is used")
    velocity_sigma_mps: Noise = Field(
        default=0.05, description="1σ of the white noise between the two systems (bending, vibration)"
    )
    velocity_drift_mps: Spread = Field(
        default=0.1, description="limit of the 1σ of the velocity errors of the master in the model of the filter"
    )
    drift_time_s: CorrelationTime = Field(
        default=3600.0, description="correlation time of the velocity errors of the master in the model of the filter"
    )
    attitude_sigma_arcmin: Noise = Field(
        default=1.0, description="1σ of the white noise between the two systems about each axis"
    )
    mounting_sigma_arcmin: Spread = Field(
        default=0.0, description="1σ of the misalignment between the two systems about each axis"
    )

    @property
    def no_budget(self) -> str:
        return "its errors are those of another inertial system, which the budget does not model"

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return the velocities and attitudes that the master passes to the sensor block to be aligned.

        The velocities are those at the lever arm. The attitudes are those of the block with the mounting error.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        if vehicle.navigate is None:
            return []
        solution = vehicle.navigate(s.grade, s.lever_arm_m)
        rows = np.searchsorted(solution.time, s.epochs(trajectory) - 1e-9).clip(max=len(solution.time) - 1)
        time = solution.time[rows]
        readings = []
        if s.velocity:
            sigma = (s.velocity_sigma_mps,) * 3
            value = solution.velocity_ned[rows] + white(seed, "master velocity noise", sigma, len(time))
            drift = solution.velocity_ned[rows] - state_at(trajectory, time, s.lever_arm_m).velocity_ned
            true, arm = {"master-velocity bias": drift}, s.lever_arm_m
            readings.append(s.readings("master-velocity", "gnss-velocity", time, value, sigma, true, lever_arm=arm))
        if s.attitude:
            mounting = ARCMIN * s.mounting_sigma_arcmin
            askew = np.array([turn_on(seed, "master mounting", None, mounting, axis) for axis in range(3)])
            sigma = (ARCMIN * s.attitude_sigma_arcmin,) * 3
            turn = askew + white(seed, "master attitude noise", sigma, len(time))
            value = rotation.multiply(solution.q_nb[rows], rotation.quaternion_from_rotation_vector(turn))
            true = {"master-attitude bias": askew}
            readings.append(s.readings("master-attitude", "attitude", time, value, sigma, true))
        return readings

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the master's own velocity errors and of the mounting error."""
        if self.velocity:
            yield SensorState("master-velocity bias", (self.velocity_drift_mps,) * 3, self.drift_time_s)
        if self.attitude:
            sigma = (ARCMIN * self.mounting_sigma_arcmin,) * 3
            yield SensorState("master-attitude bias", sigma, key="mounting_sigma_arcmin")
