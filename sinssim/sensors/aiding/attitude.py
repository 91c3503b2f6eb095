"""The attitude of the block: by an attitude reference, a star tracker, or a master system that gives velocity, too.

The attitude relative to the stars is referred to Earth-fixed axes by the time. A star tracker does not sense the local
level: tilts computed from it have the error of the assumed position.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from sinssim import earth, rotation
from sinssim.data import Array
from sinssim.sensors.aiding_sensor import (
    AidingReadings,
    AidingSensor,
    Noise3,
    SensorState,
    Vehicle,
    correlated,
    state_at,
    turn_on,
    white,
)
from sinssim.sensors.imu.grades import GradeName
from sinssim.sensors.measurement_kind import PHI, Comparison, MeasurementKind, R
from sinssim.toml_section import CorrelationTime, LeverArm, Noise, Spread
from sinssim.truth.motions.drop import carried_until
from sinssim.units import ARCMIN, ARCSEC


def compare_attitude(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare attitudes q_nb in the local level; residual −C_bn φ, a rotation vector about the body's axes."""
    off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), at.state.q_nb)
    h = at.zeros(3)
    h[:, :, PHI] = -at.c_bn
    return rotation.rotation_vector_from_quaternion(off), h


def turned_back(value: Array, bias: Array) -> Array:
    """Return attitudes with a bias about the body's axes removed; see `MeasurementKind.less_bias`."""
    return rotation.multiply(value, rotation.quaternion_from_rotation_vector(-bias))


class AttitudeReference(AidingSensor):
    """An attitude reference, which measures the attitude of the sensor block relative to the local level frame."""

    table: ClassVar = "attitude"
    kinds: ClassVar = (
        MeasurementKind(
            "attitude",
            columns=("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z"),
            axes=("x", "y", "z"),
            unit="rad",
            compare=compare_attitude,
            less_bias=turned_back,
            rounding="gyros",
            diagnosed={"bias": 0.5},
            of_north=True,
        ),
    )

    sigma_arcmin: Noise3 = Field(default=(6.0, 6.0, 18.0), description="white noise about forward, right and down")
    bias_sigma_arcmin: Spread = Field(default=0.0, description="1σ of the Gauss-Markov error about each axis")
    bias_correlation_time_s: CorrelationTime = Field(default=600.0, description="correlation time of this error")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return attitudes q_nb ∘ q(ε), ε noise and drift about the block's axes."""
        s, seed = self, vehicle.seed
        time = s.epochs(vehicle.trajectory)
        slow = (ARCMIN * s.bias_sigma_arcmin,) * 3
        bias = correlated(seed, "attitude drift", slow, time, s.bias_correlation_time_s)
        sigma = ARCMIN * np.array(s.sigma_arcmin)
        error = bias + white(seed, "attitude noise", sigma, len(time))
        q_nb = vehicle.trajectory.state(time).q_nb
        value = rotation.multiply(q_nb, rotation.quaternion_from_rotation_vector(error))
        return [s.readings("attitude", "attitude", time, value, sigma, {"attitude bias": bias})]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the drift about the block's axes."""
        sigma = (ARCMIN * self.bias_sigma_arcmin,) * 3
        yield SensorState("attitude bias", sigma, self.bias_correlation_time_s, key="bias_sigma_arcmin")


def _in_earth_axes(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare attitudes relative to the Earth; residual C_bn (θ − φ), a rotation vector about the body's axes.

    θ = (δr_E/(R₂+h), −δr_N/(R₁+h), −δr_E tan φ/(R₂+h)) is the rotation of the local level by an error of position.
    """
    state = at.state
    q_eb = rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)
    off = rotation.multiply(rotation.conjugate(rotation.normalize(value)), q_eb)
    r1, r2 = earth.radii(state.latitude, at.ellipsoid)
    turn = np.zeros((len(r1), 3, 3))
    turn[:, 0, 1] = 1.0 / (r2 + state.height)
    turn[:, 1, 0] = -1.0 / (r1 + state.height)
    turn[:, 2, 1] = -np.tan(state.latitude) / (r2 + state.height)
    h = at.zeros(3)
    h[:, :, PHI] = -at.c_bn
    h[:, :, R] = at.c_bn @ turn
    return rotation.rotation_vector_from_quaternion(off), h


class StarTracker(AidingSensor):
    """A star tracker, which measures the attitude of the sensor block in inertial space."""

    table: ClassVar = "star_tracker"
    kinds: ClassVar = (
        MeasurementKind(
            "earth-attitude",
            columns=("q_eb_w", "q_eb_x", "q_eb_y", "q_eb_z"),
            axes=("x", "y", "z"),
            unit="rad",
            compare=_in_earth_axes,
            less_bias=turned_back,
            rounding="gyros",
            diagnosed={"bias": 0.5},
        ),
    )

    sigma_arcsec: Noise3 = Field(default=(5.0, 5.0, 5.0), description="white noise about forward, right and down")
    bias_sigma_arcsec: Spread = Field(default=0.0, description="1σ of the mounting error about each axis")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return attitudes q_eb ∘ q(ε), ε noise and the mounting's error about the block's axes."""
        s, seed = self, vehicle.seed
        time = s.epochs(vehicle.trajectory)
        mounting = ARCSEC * s.bias_sigma_arcsec
        bias = np.array([turn_on(seed, "star tracker mounting", None, mounting, axis) for axis in range(3)])
        sigma = ARCSEC * np.array(s.sigma_arcsec)
        error = bias + white(seed, "star tracker noise", sigma, len(time))
        state = vehicle.trajectory.state(time)
        q_nb = rotation.multiply(state.q_nb, rotation.quaternion_from_rotation_vector(error))
        value = rotation.multiply(earth.q_en(state.latitude, state.longitude), q_nb)
        return [s.readings("star-tracker", "earth-attitude", time, value, sigma, {"star-tracker bias": bias})]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the mounting error about the block's axes."""
        yield SensorState("star-tracker bias", (ARCSEC * self.bias_sigma_arcsec,) * 3, key="bias_sigma_arcsec")


class Master(AidingSensor):
    """A master inertial system on the same vehicle for transfer alignment; it starts at the same time."""

    table: ClassVar = "master"
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
        epochs = s.epochs(trajectory)
        epochs = epochs[epochs <= carried_until(trajectory)]  # the master stays on the carrier
        rows = np.searchsorted(solution.time, epochs - 1e-9).clip(max=len(solution.time) - 1)
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
