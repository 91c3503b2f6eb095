"""A satellite receiver with two antennas: the heading of the line from one to the other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field, field_validator

from sinssim import rotation
from sinssim.data import Array
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, SensorState, Vehicle, turn_on, white
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, compare_heading
from sinssim.toml_section import LeverArm, Noise, Offset, Spread
from sinssim.units import DEG


def _of_baseline(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare the heading of the line from the first antenna to the second, whose vector is the lever arm."""
    return compare_heading(at, value, at.lever_arm)


class DualAntenna(AidingSensor):
    """A GNSS receiver with two antennas, which measures the heading of the baseline between them."""

    kinds: ClassVar = (
        MeasurementKind(
            "baseline-heading",
            columns=("heading_rad",),
            unit="rad",
            compare=_of_baseline,
            rounding="gyros",
            on_gnss_clock=True,
            diagnosed={"bias": 1.0},
            of_north=True,
        ),
    )

    baseline_m: LeverArm = Field(
        default=(1.0, 0.0, 0.0), description="from the first antenna to the second: forward, right, down"
    )
    sigma_deg: Noise = Field(
        default=0.2,
        description="1σ of the white noise; about 0.2 deg for a baseline of 1 m, in inverse proportion to its length",
    )
    bias_deg: Offset | None = Field(default=None, description="given error of the baseline's direction on the vehicle")
    bias_sigma_deg: Spread = Field(default=0.0, description="1σ of a random error, added to the given one")

    @field_validator("baseline_m")
    @classmethod
    def _has_a_heading(cls, value: LeverArm) -> LeverArm:
        if math.hypot(value[0], value[1]) < 0.01:
            raise ValueError(
                f"the antennas are {math.hypot(*value):g} m apart, but less than 0.01 m forward and right: their line "
                "has no heading"
            )
        return value

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return headings of the baseline, ψ + b + ν."""
        s, trajectory, seed = self, vehicle.trajectory, vehicle.seed
        time = s.epochs(trajectory)
        line = rotation.rotate(trajectory.state(time).q_nb, np.array(s.baseline_m))
        bias = turn_on(seed, "dual antenna bias", s.bias_deg, s.bias_sigma_deg)
        error = DEG * (bias + white(seed, "dual antenna noise", (s.sigma_deg,), len(time)))
        value: Array = np.mod(np.arctan2(line[:, 1], line[:, 0])[:, np.newaxis] + error, 2.0 * np.pi)
        true = {"dual-antenna bias": DEG * np.array([bias])}
        sigma = (DEG * s.sigma_deg,)
        return [s.readings("dual-antenna", "baseline-heading", time, value, sigma, true, lever_arm=s.baseline_m)]

    def states(self) -> Iterator[SensorState]:
        """Yield the state of the constant error."""
        sigma = DEG * math.hypot(self.bias_sigma_deg, self.bias_deg or 0.0)
        yield SensorState("dual-antenna bias", (sigma,), key="bias_sigma_deg")
