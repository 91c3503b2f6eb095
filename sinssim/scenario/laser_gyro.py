"""The [imu.laser_gyro] table of a scenario: gyros given by their physics instead of by their noise."""

from __future__ import annotations

import math
from typing import Self

from pydantic import Field, model_validator

from sinssim.scenario.section import NotNegative, Positive, Section
from sinssim.units import ARCSEC, DEG_H


class LaserGyroSection(Section):
    """Gyros by their physics: the ring's pulse weight is their quantum, the dithered lock-in their random walk."""

    perimeter_mm: Positive = Field(description="length of the ring")
    area_mm2: Positive = Field(description="area that the beams enclose")
    wavelength_nm: Positive = Field(default=632.8, description="of the laser; 632.8 is helium-neon's red")
    lock_in_deg_h: NotNegative = Field(description="half-width of the dead zone without dither, 0 for none")
    dither_amplitude_arcsec: Positive = Field(description="of the mechanical dither, from the middle to a turnaround")
    dither_frequency_hz: Positive = Field(description="of the dither")

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
        return self
