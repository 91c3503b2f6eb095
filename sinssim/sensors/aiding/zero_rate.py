"""Zero angular rate of a vehicle at rest relative to the Earth, with disturbances by wind and engines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from pydantic import Field

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, Measurements
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle, white
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind
from sinssim.sensors.standstill_sensor import Standstill
from sinssim.toml_section import Noise
from sinssim.units import DEG_H

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


def _mean_of_gyros(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the mean rate of the gyros relative to the Earth; residual W x, the error of the rate."""
    return at.turning() - value, at.turning_error()


class ZeroRate(Standstill):
    """Zero-rate updates of a vehicle that does not turn, with vibration by wind and engines."""

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
        """Why the block must not turn."""
        return "compares the mean of the gyro data with zero rotation of the vehicle"

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero rates of the block relative to the Earth where its mean rate over the interval is at most σ/3."""
        time = self.epochs(vehicle.trajectory)
        sigma = (DEG_H * self.sigma_deg_h,) * 3
        value = white(vehicle.seed, "zero rate noise", sigma, len(time))
        interval = 1.0 / self.rate_hz
        stands = self.stood(vehicle, time, interval)
        if stands is None:
            stands = self.stands(time, _mean_rate(vehicle.trajectory, time, interval), sigma[0])
        return [self.readings("zero-rate", "zero-rate", time, value, sigma, {}, valid=stands)]

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero rates at the stops that the readings show, with the larger of both 1σ; see the base."""
        from sinssim.sensors.standstill_detection import standstill

        (given,) = standstill(self.found(imu, velocity), rate_hz=self.rate_hz, velocity=False)
        return [replace(given, sigma=np.maximum(given.sigma, DEG_H * self.sigma_deg_h))]


def _mean_rate(trajectory: Trajectory, time: Array, interval: float) -> Array:
    """Return the magnitude of the mean rate relative to the Earth over the interval before each instant, (M,) rad/s."""

    def to_earth(t: Array) -> Array:
        state = trajectory.state(t)
        return rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)

    # an interval begins at the end of the previous one, the first at the start
    before = to_earth(np.maximum(time - interval, trajectory.start))
    turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before), to_earth(time)))
    return np.asarray(np.linalg.norm(turn, axis=1) / interval)
