"""The [imu.laser_gyro] table of a scenario: gyros given by their physics instead of by their noise."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from sinssim.scenario.section import NotNegative, Positive, Section
from sinssim.units import ARCSEC, DEG_H

GasFlow = Annotated[float, Field(ge=-10.0, le=10.0)]
Gain = Annotated[float, Field(ge=0.0, le=100.0)]
ThermalSpeed = Annotated[float, Field(ge=100.0, le=1e4)]
Expansion = Annotated[float, Field(ge=-100.0, le=100.0)]
PathControl = Annotated[float, Field(ge=0.0, le=1.0)]


class LaserGyroSection(Section):
    """Gyros by their physics: the ring's pulse is their quantum, the dithered lock-in their random walk."""

    perimeter_mm: Positive = Field(description="length of the ring")
    area_mm2: Positive = Field(description="area that the beams enclose")
    wavelength_nm: Positive = Field(default=632.8, description="of the laser; 632.8 is helium-neon's red")
    lock_in_deg_h: NotNegative = Field(description="half-width of the dead zone without dither, 0 for none")
    dither_amplitude_arcsec: Positive = Field(description="of the mechanical dither, from the middle to a turnaround")
    dither_frequency_hz: Positive = Field(description="of the dither")
    gas_flow_mps: GasFlow = Field(
        default=0.0,
        description="mean flow of the gas along the beams; it feigns a rotation, which changes with the temperature "
        "and which a calibration takes out at its own",
    )
    gain_percent: Gain = Field(default=0.0, description="of the power per round trip, at the centre of the line")
    thermal_speed_mps: ThermalSpeed = Field(
        default=550.0, description="most probable speed of the atoms; 550 is neon's at 367 K"
    )
    expansion_ppm_per_c: Expansion = Field(default=0.02, description="linear expansion of the ring; 0.02 is Zerodur's")
    path_control: PathControl = Field(
        default=0.0, description="part of the path's change that its control takes out, 0 for none"
    )

    @model_validator(mode="after")
    def _can_be_built(self) -> Self:
        largest = self.perimeter_mm**2 / (4.0 * math.pi)
        if self.area_mm2 > largest:
            raise ValueError(
                f"a perimeter_mm of {self.perimeter_mm:g} encloses at most {largest:.4g} mm² (a circle), not an "
                f"area_mm2 of {self.area_mm2:g}"
            )
        rate_deg_h = 2.0 * math.pi * self.dither_frequency_hz * self.dither_amplitude_arcsec * ARCSEC / DEG_H
        if rate_deg_h <= self.lock_in_deg_h:
            raise ValueError(
                f"the dither turns at no more than {rate_deg_h:.4g} deg/h and never leaves lock_in_deg_h = "
                f"{self.lock_in_deg_h:g}; it needs a larger dither_amplitude_arcsec or dither_frequency_hz"
            )
        if bool(self.gas_flow_mps) != bool(self.gain_percent):
            raise ValueError(
                f"gas_flow_mps = {self.gas_flow_mps:g} with gain_percent = {self.gain_percent:g}: a null shift needs "
                "both, and no null shift neither"
            )
        return self
