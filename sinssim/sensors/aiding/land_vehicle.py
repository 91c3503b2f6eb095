"""A land vehicle's wheels: the speed of an odometer, and the non-holonomic constraint.

By the constraint the rear wheels do not move sideways or up, except for slip, tyres and suspension.

A reading of the constraint is zero with a given 1σ, where the lateral acceleration is one that tyres hold. It is a
statement on the vehicle, not on a sensor: a vehicle that flies, skids or is towed makes it wrong.

Its error has a fast part, by the vibration of the suspension, and a slow part: the body of a car pitches when it brakes
or accelerates, and it drifts sideways on a cambered road or in the wind. The slow part lasts for seconds, so that more
readings per second do not average it. It is a first-order Gauss-Markov process and a state of the filter.

With u = C_bn v + ω × l, the velocity of the point at the lever arm l in the block's axes, and the vehicle's axes in the
block's, turned by the yaw ψ and then by the pitch θ,

    x = (cos ψ cos θ, sin ψ cos θ, −sin θ),  y = (−sin ψ, cos ψ, 0),  z = (cos ψ sin θ, sin ψ sin θ, cos θ),

the predicted quantities are y · u and z · u (Dissanayake, Sukkarieh, Nebot and Durrant-Whyte, IEEE Trans. Robotics and
Automation 17, 2001, 731). A roll between the axes has no effect, because both are zero. Tyres hold sideways only at a
slip angle, which is proportional to the lateral acceleration up to about 4 m/s² (Gillespie, Fundamentals of Vehicle
Dynamics, 1992, chapter 6): a rear axle drifts outwards by y · u = −k (x · u) a, a = (z · ω) (x · u), with its cornering
compliance k.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from sinssim import rotation
from sinssim.arguments import POSITIVE, checked_increments, doubles, number
from sinssim.data import Array, ImuData, Measurements
from sinssim.errors import InputError
from sinssim.sensors.aiding.standstill import windows_of
from sinssim.sensors.aiding_sensor import (
    AidingReadings,
    AidingSensor,
    SensorState,
    Vehicle,
    correlated,
    state_at,
    turn_on,
    turning,
    white,
)
from sinssim.sensors.measurement_kind import PHI, Comparison, MeasurementKind, V, skew
from sinssim.toml_section import CorrelationTime, LeverArm, Noise, Offset, Positive, Rate, Spread
from sinssim.units import DEG, PPM

_LABEL = "land-vehicle"
_PER_G = DEG / 9.80665
"""One degree per g, rad/(m/s²)."""


def _across(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the velocity of the rear axle to the right and down, in the vehicle's axes."""
    angles, arm = value[:, 2:], at.lever_arm
    mounting, arm_states, slip = at.states("mounting"), at.states("lever arm"), at.states("slip")
    if mounting is not None:
        angles = angles + at.known("mounting")
    if arm_states is not None:
        arm = arm + at.known("lever arm")
    c_vb = _axes(angles)  # rows x, y, z
    turn, velocity = at.turning(), at.state.velocity_ned
    u = np.einsum("kij,kj->ki", at.c_bn, velocity) + np.cross(turn, arm)
    forward, right, down = np.einsum("kij,kj->ik", c_vb, u)
    residual = np.stack([right, down], axis=1) - value[:, :2]
    across = c_vb[:, 1:]
    h = -across @ skew(arm) @ at.turning_error()
    h[:, :, V] += across @ at.c_bn
    h[:, :, PHI] -= across @ at.c_bn @ skew(velocity)
    if mounting is not None:  # dy/dψ = −(cos ψ, sin ψ, 0), dz/dψ = sin θ y, dz/dθ = x
        pitch = angles[:, 0]
        h[:, 0, mounting.start + 1] = np.cos(pitch) * forward + np.sin(pitch) * down
        h[:, 1, mounting.start + 1] = -np.sin(pitch) * right
        h[:, 1, mounting.start] = -forward
    if arm_states is not None:
        h[:, :, arm_states] = -across @ skew(turn)
    if slip is not None:
        drift = forward**2 * np.einsum("kj,kj->k", c_vb[:, 2], turn)
        residual[:, 0] += at.known("slip")[0] * drift
        h[:, 0, slip.start] = -drift
    return residual, h


def _axes(angles: Array) -> Array:
    """Return the matrices into the vehicle's axes from the block's, of pitch and yaw, (M, 3, 3)."""
    (st, sp), (ct, cp) = np.sin(angles).T, np.cos(angles).T
    rows = ((cp * ct, sp * ct, -st), (-sp, cp, np.zeros_like(sp)), (cp * st, sp * st, ct))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


class LandVehicle(AidingSensor):
    """The nonholonomic constraint of a land vehicle, which moves along its own forward axis."""

    table: ClassVar = "land_vehicle"
    kinds: ClassVar = (
        MeasurementKind(  # velocity [m/s], and the assumed pitch and yaw of the vehicle's axes [rad]
            "land-velocity",
            columns=("velocity_right_mps", "velocity_down_mps", "pitch_rad", "yaw_rad"),
            axes=("right", "down"),
            unit="mps",
            compare=_across,
            rounding="accelerometers",
            needs_rate=True,
            own_errors={
                "mounting": (("pitch", "yaw"), "rad"),
                "lever arm": (("forward", "right", "down"), "m"),
                "slip": (("",), "rad_per_mps2"),
            },
            diagnosed={"mounting": 0.3, "lever arm": 3.0},
            velocities=2,
        ),
    )

    rate_hz: Rate = Field(
        default=2.0,
        description="updates per second; the errors of tyres and suspension last some tenths of a second",
    )
    sigma_lateral_mps: Noise = Field(default=0.1, description="1σ of the rear wheels' velocity to the right")
    sigma_vertical_mps: Noise = Field(
        default=0.1, description="1σ of the downward velocity of the rear wheels, in the axes of the vehicle"
    )
    drift_lateral_mps: Spread = Field(
        default=0.0,
        description="1σ of a slowly varying error of the lateral velocity, by camber and wind; about 0.02 for a car",
    )
    drift_vertical_mps: Spread = Field(
        default=0.0,
        description="1σ of a slowly varying error of the vertical velocity, by the pitching of the body on its "
        "suspension; about 0.05 for a car",
    )
    drift_correlation_time_s: CorrelationTime = Field(default=3.0, description="correlation time of both errors")
    mounting_sigma_deg: Spread = Field(
        default=0.0,
        description="1σ of the error of the assumed pitch, and of the assumed yaw, of the sensor block "
        "relative to the vehicle",
    )
    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0),
        description="position of the middle of the rear axle relative to the sensor block: forward, right, down",
    )
    lever_arm_sigma_m: Spread = Field(default=0.0, description="1σ of the error of each assumed component")
    slip_deg_per_g: Offset | None = Field(
        default=None, description="given slip angle of the rear axle per lateral acceleration; 2 to 4 for a car"
    )
    slip_sigma_deg_per_g: Spread = Field(default=0.0, description="1σ of a random slip angle, added to the given one")
    lateral_limit_mps2: Positive = Field(
        default=4.0, description="lateral acceleration above which there is no update, because the tyres slide"
    )

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero velocities across the vehicle's axes, with errors by slip, tyres and suspension.

        The assumed angles and lever arm have the errors that the section gives.
        """
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        wheel = state_at(trajectory, time, s.lever_arm_m)
        ahead, right, down = rotation.dcm_from_quaternion(vehicle.q_bs)  # the vehicle's axes in the block's
        angles = np.array(angles_of(ahead))
        velocity = rotation.rotate(rotation.conjugate(wheel.q_nb), wheel.velocity_ned)
        turn = turning(trajectory, time, trajectory.state(time))
        pushed = (velocity @ ahead) * (turn @ down)
        slip = _PER_G * turn_on(seed, "land vehicle slip", s.slip_deg_per_g, s.slip_sigma_deg_per_g)
        sigma = (s.sigma_lateral_mps, s.sigma_vertical_mps)
        askew = DEG * np.array(
            [turn_on(seed, "land vehicle mounting", None, s.mounting_sigma_deg, k) for k in range(2)]
        )
        off = np.array([turn_on(seed, "land vehicle lever arm", None, s.lever_arm_sigma_m, k) for k in range(3)])
        value = np.zeros((len(time), 4))
        drift = correlated(seed, "land vehicle drift", s._drift, time, s.drift_correlation_time_s)
        value[:, :2] = drift + white(seed, "land vehicle noise", sigma, len(time))
        # in axes that the two angles give, which leave out a roll of the block
        across = np.array([[-np.sin(angles[1]), np.cos(angles[1]), 0.0]])
        across = np.concatenate([across, np.cross(ahead, across[0])[None]])
        value[:, :2] += np.multiply.outer(slip * (velocity @ ahead) * pushed, across @ right)
        value[:, 2:] = angles + askew
        true = {f"{_LABEL} mounting": -askew, f"{_LABEL} lever arm": -off, f"{_LABEL} slip": np.array([slip])}
        true[f"{_LABEL} bias"] = drift
        holds = np.abs(pushed) <= s.lateral_limit_mps2
        arm = np.array(s.lever_arm_m) + off
        return [s.readings(_LABEL, "land-velocity", time, value, sigma, true, lever_arm=arm, valid=holds)]

    @property
    def no_budget(self) -> str:
        return "it is an assumption about the vehicle, whose errors the budget does not model"

    @property
    def of_fixed_block(self) -> str:
        return "has states for the angles between the IMU and the vehicle"

    @property
    def needs_no_truth(self) -> bool:
        return True

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return the readings where the measured lateral specific force is one that tyres hold; see the base."""

        sigma = (self.sigma_lateral_mps, self.sigma_vertical_mps)
        ahead = (1.0, 0.0, 0.0) if q_bs is None else rotation.dcm_from_quaternion(q_bs)[0]
        return [
            land_velocity(
                imu,
                rate_hz=self.rate_hz,
                sigma=sigma,
                angles=angles_of(ahead),
                lever_arm=self.lever_arm_m,
                limit=self.lateral_limit_mps2,
                name=_LABEL,
            )
        ]

    def states(self) -> Iterator[SensorState]:
        """Yield the states of the slow error, of the mounting, of the lever arm and of the slip."""
        yield SensorState(f"{_LABEL} bias", self._drift, self.drift_correlation_time_s)
        slip = math.hypot(self.slip_sigma_deg_per_g, self.slip_deg_per_g or 0.0)
        yield SensorState(f"{_LABEL} mounting", (DEG * self.mounting_sigma_deg,) * 2, key="mounting_sigma_deg")
        yield SensorState(f"{_LABEL} lever arm", (self.lever_arm_sigma_m,) * 3, key="lever_arm_sigma_m")
        yield SensorState(f"{_LABEL} slip", (_PER_G * slip,))

    @property
    def _drift(self) -> tuple[float, float]:
        """1σ of the slow error, to the right and down, m/s."""
        return (self.drift_lateral_mps, self.drift_vertical_mps)


def angles_of(ahead: ArrayLike) -> tuple[float, float]:
    """Return pitch and yaw of the vehicle's forward axis, which is given in the block's axes, rad."""
    x, y, z = np.asarray(ahead, dtype=np.float64)
    return math.atan2(-z, math.hypot(x, y)), math.atan2(y, x)


TYRES_HOLD = 4.0
"""Largest lateral acceleration at which the constraint is used, m/s². Up to there the slip angle of a passenger car's
tyres is proportional to it (Gillespie, Fundamentals of Vehicle Dynamics, 1992, chapter 6), so that a compliance
describes it; beyond, the tyres slide."""

_WINDOW_S = 0.5  # over which the lateral acceleration is averaged: longer than vibration, shorter than a turn


def land_velocity(
    imu: ImuData,
    *,
    rate_hz: float = 2.0,
    sigma: ArrayLike = (0.1, 0.1),
    angles: tuple[float, float] = (0.0, 0.0),
    lever_arm: ArrayLike = (0.0, 0.0, 0.0),
    limit: float = TYRES_HOLD,
    name: str = "",
) -> Measurements:
    """Return the readings of the constraint along a run: "land-velocity", zero.

    Args:
        sigma: 1σ of the velocity to the right, and down, by tyres, suspension and road, m/s.
        angles: assumed pitch and yaw of the vehicle's axes in the block's, rad.
        lever_arm: from the block to the middle of the rear axle, which does not steer, (3,) m.
        limit: lateral specific force beyond which there is no reading, m/s².
    """
    checked_increments(imu)
    step = 1.0 / number("rate_hz", rate_hz, "measurements per second", low=POSITIVE)
    limit = number("limit", limit, "m/s²", low=POSITIVE)
    sigmas = doubles("sigma", sigma)
    if sigmas.shape != (2,):
        raise InputError(f"sigma has the shape {sigmas.shape}; it must be 1σ to the right and 1σ down.")
    windows = windows_of(imu, _WINDOW_S, step)
    pitch, yaw = angles
    right = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    time = windows.end[np.abs(windows.mean[:, 3:] @ right) <= limit]
    value = np.zeros((len(time), 4))
    value[:, 2:] = pitch, yaw
    arm = np.asarray(lever_arm, dtype=np.float64)
    return Measurements("land-velocity", time, time, value, np.broadcast_to(sigmas, (len(time), 2)), arm, name)


def compare_speed(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the velocity along the forward axis of a point at the lever arm, (C_bn v + ω × l)_x, m/s.

    The residual is (C_bn δv − C_bn [v×] φ − [l×] W x)_x.
    """
    forward = at.c_bn[:, :1]
    velocity = at.state.velocity_ned
    residual = np.einsum("kij,kj->ki", forward, velocity) - value
    h = at.zeros(1)
    if at.lever_arm.any():
        residual = residual + np.cross(at.turning(), at.lever_arm)[:, :1]
        h -= (skew(at.lever_arm) @ at.turning_error())[:, :1]
    h[:, :, V] += forward
    h[:, :, PHI] -= forward @ skew(velocity)
    return residual, h


class Odometer(AidingSensor):
    """An odometer, which measures the speed of a land vehicle along the forward axis of the sensor block."""

    table: ClassVar = "odometer"
    kinds: ClassVar = (
        MeasurementKind(
            "speed",
            columns=("speed_mps",),
            unit="mps",
            compare=compare_speed,
            rounding="accelerometers",
            diagnosed={"scale": 0.3},
            velocities=1,
        ),
    )

    sigma_mps: Noise = Field(default=0.05, description="white noise")
    scale_ppm: Offset | None = Field(default=None, description="given relative error of the speed")
    scale_sigma_ppm: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")
    lever_arm_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0), description="position of the wheel relative to the sensor block: forward, right, down"
    )

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return speeds (1 + k) v_x + ν, v_x being the forward velocity of the wheel."""
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        wheel = state_at(trajectory, time, s.lever_arm_m)
        forward = rotation.rotate(rotation.conjugate(wheel.q_nb), wheel.velocity_ned)[:, :1]
        scale = PPM * turn_on(seed, "odometer scale", s.scale_ppm, s.scale_sigma_ppm)
        value = (1.0 + scale) * forward + white(seed, "odometer noise", (s.sigma_mps,), len(time))
        true = {"odometer scale": np.array([scale])}
        return [s.readings("odometer", "speed", time, value, (s.sigma_mps,), true, lever_arm=s.lever_arm_m)]

    def states(self) -> Iterator[SensorState]:
        """Yield the state of the scale-factor error."""
        sigma = PPM * math.hypot(self.scale_sigma_ppm, self.scale_ppm or 0.0)
        yield SensorState("odometer scale", (sigma,), key="scale_sigma_ppm")
