"""Pseudo-measurements of a vehicle or a foot at rest: zero velocity and zero angular rate.

A reading is zero with a given 1σ, with disturbances by wind and engines. By default there are readings only where the
true value is at most σ/3. The true value then adds at most 1/9 to the χ² of the three components, 3.11 instead of 3 on
average, even if the vehicle creeps for long. The σ that the filter assumes is therefore correct.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple

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


class Detection(NamedTuple):
    """Detected rest beside the true one, at the instants of the readings."""

    at_rest: int  # instants at which the true motion is at most a third of the 1σ
    missed: int  # those without a reading
    readings: int
    false: int  # readings in motion


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
    detector: Literal["vehicle", "foot"] = Field(
        default="vehicle",
        description="vehicle: windows whose shaking and means are those at rest; foot: short windows whose likelihood "
        "ratio is that at rest, for a block on a shoe",
    )
    window_s: Annotated[float, Field(ge=1e-3, le=60.0)] | None = Field(
        default=None,
        description="length of the windows of the detection; default: 1 s for a vehicle, 0.05 s for a foot",
    )
    threshold: Annotated[float, Field(gt=1.0, le=1e6)] = Field(
        default=3.0,
        description="largest variance of a window at rest (vehicle), or its largest likelihood ratio (foot), in units "
        "of that learned",
    )

    rules = (
        (lambda s: s.detect and not s.learn_s,
         "detect = true needs learn_s, intervals in which the vehicle is known to be stationary, for example "
         "[[0.0, 20.0]]"),
        (lambda s: s.detect and s.during_s is not None,
         "detect = true finds the stops, and during_s gives them: remove one of the two"),
        (lambda s: not s.detect and (s.changed("learn_s", "detector", "window_s", "threshold")),
         "{it} is for detect = true: set it, or remove {it}"),
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
        from sinssim.sensors.standstill_detection import FOOT_WINDOW_S, find_stances, find_stops, learn_rest

        if self.detector == "foot":
            rest, window_s = learn_rest(imu, spans=self.learn_s), self.window_s or FOOT_WINDOW_S
            return find_stances(imu, rest, window_s=window_s, ratio=self.threshold, velocity=velocity)
        rest = learn_rest(imu, spans=self.learn_s, window_s=self.window_s or 1.0)
        return find_stops(imu, rest, ratio=self.threshold, velocity=velocity)

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        """Return the size of the true motion that a reading takes for zero, (M,)."""
        raise NotImplementedError

    def compared(self, readings: AidingReadings, trajectory: Trajectory) -> Detection:
        """Compare the readings with the true motion."""
        given = np.isin(readings.time, readings.measurements.time)
        sigma = float(readings.measurements.sigma[0, 0]) if given.any() else 0.0
        rest = self.motion(trajectory, readings.time) <= _AT_REST * sigma
        return Detection(*(int(np.count_nonzero(of)) for of in (rest, rest & ~given, given, given & ~rest)))

    def stands(self, time: Array, size: Array, sigma: float) -> Mask:
        """Return the instants at which the vehicle is assumed to be at rest."""
        if self.during_s is not None:
            return within(time, self.during_s)
        return np.asarray(size <= _AT_REST * sigma)

    def zeros(self, label: str, vehicle: Vehicle, sigma: float, lasting: float) -> list[AidingReadings]:
        """Return readings of zero with errors by the shaking of the vehicle: after `lasting` s of a stop that was found
        or, by the size of the true motion, while the vehicle is assumed to be at rest."""
        time = self.epochs(vehicle.trajectory)
        value = white(vehicle.seed, f"{label.replace('-', ' ')} noise", (sigma,) * 3, len(time))
        if self.detect and vehicle.imu is not None:
            valid = np.zeros(len(time), dtype=bool)
            for begin, end in self.found(vehicle.imu).spans:
                valid |= (time >= begin + lasting - 1e-9) & (time <= end + 1e-9)
        else:
            valid = self.stands(time, self.motion(vehicle.trajectory, time), sigma)
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

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        return np.asarray(np.linalg.norm(trajectory.state(time).velocity_ned, axis=1))

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero velocities where the true velocity is at most σ/3, with errors by the shaking of the vehicle."""
        return self.zeros("zero-velocity", vehicle, self.sigma_mps, 0.0)

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

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        """Return the magnitude of the mean rate relative to the Earth over the interval before each instant, rad/s."""

        def to_earth(t: Array) -> Array:
            state = trajectory.state(t)
            return rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)

        # an interval begins at the end of the previous one, the first at the start
        interval = 1.0 / self.rate_hz
        before = to_earth(np.maximum(time - interval, trajectory.start))
        turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before), to_earth(time)))
        return np.asarray(np.linalg.norm(turn, axis=1) / interval)

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero rates of the block relative to the Earth where its mean rate over the interval is at most σ/3."""
        return self.zeros("zero-rate", vehicle, DEG_H * self.sigma_deg_h, 1.0 / self.rate_hz)

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero rates at the stops that the readings show, with the larger of both 1σ; see the base."""
        from sinssim.sensors.standstill_detection import standstill

        (given,) = standstill(self.found(imu, velocity), rate_hz=self.rate_hz, velocity=False)
        return [replace(given, sigma=np.maximum(given.sigma, DEG_H * self.sigma_deg_h))]
