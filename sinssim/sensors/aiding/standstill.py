"""Pseudo-measurements of a vehicle at rest: zero velocity and zero angular rate.

A reading is zero with a given 1σ, with disturbances by wind and engines. By default there are readings only where the
true value is at most σ/3. The true value then adds at most 1/9 to the χ² of the three components, 3.11 instead of 3 on
average, even if the vehicle creeps for long. The σ that the filter assumes is therefore correct.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, Measurements
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, Mask, Vehicle, white, within
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, V
from sinssim.toml_section import Noise, Span
from sinssim.units import DEG_H

if TYPE_CHECKING:
    from sinssim.sensors.standstill_detection import Stops
    from sinssim.truth.trajectory import Trajectory


_AT_REST = 1.0 / 3.0
"""Magnitude of the true velocity or rate, in units of the reading's 1σ, up to which a vehicle counts as at rest."""


class Standstill(AidingSensor):
    """Readings of zero while a vehicle stands."""

    assumed: ClassVar = True

    during_s: tuple[Span, ...] | None = Field(
        default=None,
        description="[from, to] of each assumed stop, which may be wrong; default: the intervals in which the true "
        "value is at most a third of the 1σ below",
    )
    detect: bool = Field(
        default=False, description="whether the stops are detected from the inertial data instead; requires learn_s"
    )
    learn_s: tuple[Span, ...] = Field(
        default=(),
        description="[from, to] of each interval at rest, 5 s or more in total, from which the vibration at rest is "
        "learned",
    )

    rules = (
        (lambda s: s.detect and not s.learn_s,
         "detect = true needs learn_s, intervals in which the vehicle is known to be stationary, for example "
         "[[0.0, 20.0]]"),
        (lambda s: s.detect and s.during_s is not None,
         "detect = true finds the stops, and during_s gives them: remove one of the two"),
        (lambda s: s.learn_s and not s.detect, "learn_s is for detect = true: set it, or remove learn_s"),
    )  # fmt: skip

    @property
    def no_budget(self) -> str:
        return "stops are detected from the data of one run (detect = true)" if self.detect else ""

    @property
    def of_fixed_block(self) -> str:
        return "detects stops in the inertial data (detect = true; during_s gives them instead)" if self.detect else ""

    @property
    def needs_no_truth(self) -> bool:
        return self.detect

    def found(self, imu: ImuData, velocity: Measurements | None = None) -> Stops:
        """Return the stops that the inertial readings show; "gnss-velocity" vetoes a stop, if there is any."""
        from sinssim.sensors.standstill_detection import find_stops, learn_rest

        return find_stops(imu, learn_rest(imu, spans=self.learn_s), velocity=velocity)

    def stands(self, time: Array, size: Array, sigma: float) -> Mask:
        """Return the instants at which the vehicle is assumed to be at rest."""
        if self.during_s is not None:
            return within(time, self.during_s)
        return np.asarray(size <= _AT_REST * sigma)

    def zeros(
        self, label: str, vehicle: Vehicle, sigma: float, lasting: float, size: Callable[[Array], Array]
    ) -> list[AidingReadings]:
        """Return readings of zero with errors by the shaking of the vehicle: after `lasting` s of a stop that was found
        or, by the size of the true motion at instants, while the vehicle is assumed to be at rest."""
        time = self.epochs(vehicle.trajectory)
        value = white(vehicle.seed, f"{label.replace('-', ' ')} noise", (sigma,) * 3, len(time))
        if self.detect and vehicle.imu is not None:
            valid = np.zeros(len(time), dtype=bool)
            for begin, end in self.found(vehicle.imu).spans:
                valid |= (time >= begin + lasting - 1e-9) & (time <= end + 1e-9)
        else:
            valid = self.stands(time, size(time), sigma)
        return [self.readings(label, label, time, value, (sigma,) * 3, {}, valid=valid)]


def _of_block(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the velocity of the block itself; residual δv."""
    h = at.zeros(3)
    h[:, :, V] = np.eye(3)
    return at.state.velocity_ned - value, h


class ZeroVelocity(Standstill):
    """Zero-velocity updates of a vehicle at rest, with vibration by wind and engines."""

    table: ClassVar = "zero_velocity"
    kinds: ClassVar = (
        MeasurementKind(
            "zero-velocity",
            columns=("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"),
            axes=("n", "e", "d"),
            unit="mps",
            compare=_of_block,
            rounding="accelerometers",
            turns_with_north=False,
            velocities=3,
        ),
    )

    sigma_mps: Noise = Field(default=0.01, description="1σ of each velocity component due to this vibration")

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero velocities where the true velocity is at most σ/3, with errors by the shaking of the vehicle."""

        def speed(time: Array) -> Array:
            return np.asarray(np.linalg.norm(vehicle.trajectory.state(time).velocity_ned, axis=1))

        return self.zeros("zero-velocity", vehicle, self.sigma_mps, 0.0, speed)

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero velocities at the stops that the readings show; see the base."""
        from sinssim.sensors.standstill_detection import standstill

        stops = self.found(imu, velocity)
        return standstill(stops, velocity_sigma=self.sigma_mps, rate_hz=self.rate_hz, rate=False)


def _mean_of_gyros(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the mean rate of the gyros relative to the Earth; residual W x, the error of the rate."""
    return at.turning() - value, at.turning_error()


class ZeroRate(Standstill):
    """Zero-rate updates of a vehicle that does not turn, with vibration by wind and engines."""

    table: ClassVar = "zero_rate"
    kinds: ClassVar = (
        MeasurementKind(
            "zero-rate",
            columns=("rate_x_radps", "rate_y_radps", "rate_z_radps"),
            axes=("x", "y", "z"),
            unit="radps",
            compare=_mean_of_gyros,
            mean_rate=True,
            velocities=3,
        ),
    )

    sigma_deg_h: Noise = Field(
        default=0.1,
        description="1σ of the mean rate about each axis over the interval of a measurement, due to this vibration",
    )

    @property
    def of_fixed_block(self) -> str:
        return "compares the mean of the gyro data with zero rotation of the vehicle"

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero rates of the block relative to the Earth where its mean rate over the interval is at most σ/3."""
        interval = 1.0 / self.rate_hz
        size = partial(_mean_rate, vehicle.trajectory, interval)
        return self.zeros("zero-rate", vehicle, DEG_H * self.sigma_deg_h, interval, size)

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero rates at the stops that the readings show, with the larger of both 1σ; see the base."""
        from sinssim.sensors.standstill_detection import standstill

        (given,) = standstill(self.found(imu, velocity), rate_hz=self.rate_hz, velocity=False)
        return [replace(given, sigma=np.maximum(given.sigma, DEG_H * self.sigma_deg_h))]


def _mean_rate(trajectory: Trajectory, interval: float, time: Array) -> Array:
    """Return the magnitude of the mean rate relative to the Earth over the interval before each instant, (M,) rad/s."""

    def to_earth(t: Array) -> Array:
        state = trajectory.state(t)
        return rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)

    # an interval begins at the end of the previous one, the first at the start
    before = to_earth(np.maximum(time - interval, trajectory.start))
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before), to_earth(time)))
    return np.asarray(np.linalg.norm(turn, axis=1) / interval)
