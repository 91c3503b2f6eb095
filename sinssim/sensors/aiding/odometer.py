"""An odometer: the speed of a wheel along the block's forward axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from sinssim import rotation
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, SensorState, Vehicle, state_at, turn_on, white
from sinssim.sensors.measurement_kind import MeasurementKind, compare_speed
from sinssim.toml_section import LeverArm, Noise, Offset, Spread
from sinssim.units import PPM


class Odometer(AidingSensor):
    """An odometer, which measures the speed of a land vehicle along the forward axis of the sensor block."""

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
