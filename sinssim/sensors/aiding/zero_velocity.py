"""Zero velocity of a vehicle at rest, with disturbances by wind and engines."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from sinssim.data import Array, ImuData, Measurements
from sinssim.sensors.aiding_sensor import AidingReadings, Vehicle, white
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, V
from sinssim.sensors.standstill_sensor import Standstill
from sinssim.toml_section import Noise


def _of_block(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the velocity of the block itself; residual δv."""
    h = at.zeros(3)
    h[:, :, V] = np.eye(3)
    return at.state.velocity_ned - value, h


class ZeroVelocity(Standstill):
    """Zero-velocity updates of a vehicle at rest, with vibration by wind and engines."""

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
        time = self.epochs(vehicle.trajectory)
        sigma = (self.sigma_mps,) * 3
        value = white(vehicle.seed, "zero velocity noise", sigma, len(time))
        speed = np.linalg.norm(vehicle.trajectory.state(time).velocity_ned, axis=1)
        stands = self.stood(vehicle, time, 0.0)
        if stands is None:
            stands = self.stands(time, speed, self.sigma_mps)
        return [self.readings("zero-velocity", "zero-velocity", time, value, sigma, {}, valid=stands)]

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero velocities at the stops that the readings show; see the base."""
        from sinssim.sensors.standstill_detection import standstill

        stops = self.found(imu, velocity)
        return standstill(stops, velocity_sigma=self.sigma_mps, rate_hz=self.rate_hz, rate=False)
