"""The [imu.laser_gyro] table of a scenario: gyros described by their physics instead of their noise."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from sinssim.section import NotNegative, Positive, Section
from sinssim.sensors.laser_gyro.gas_flow import NullShift
from sinssim.sensors.laser_gyro.ring import LaserGyro
from sinssim.units import ARCSEC, DEG_H, PPM

GasFlow = Annotated[float, Field(ge=-10.0, le=10.0)]
Gain = Annotated[float, Field(ge=0.0, le=100.0)]
ThermalSpeed = Annotated[float, Field(ge=100.0, le=1e4)]
Expansion = Annotated[float, Field(ge=-100.0, le=100.0)]
PathControl = Annotated[float, Field(ge=0.0, le=1.0)]


class LaserGyros(Section):
    """Laser gyros by their physics: the ring determines the pulse weight, dithered lock-in the random walk."""

    perimeter_mm: Annotated[float, Field(gt=0.0, le=1e6)] = Field(description="length of the ring")
    area_mm2: Annotated[float, Field(gt=0.0, le=1e11)] = Field(description="area that is enclosed by the beams")
    wavelength_nm: Positive = Field(
        default=632.8, description="wavelength of the laser; 632.8 nm is the red helium-neon line"
    )
    lock_in_deg_h: NotNegative = Field(description="half-width of the dead zone without dither; 0 for no dead zone")
    dither_amplitude_arcsec: Positive = Field(
        description="amplitude of the mechanical dither (half of the peak-to-peak angle)"
    )
    dither_frequency_hz: Positive = Field(description="frequency of the dither")
    gas_flow_mps: GasFlow = Field(
        default=0.0,
        description="mean flow of the gas along the beams; it causes a bias that changes with temperature; the "
        "calibration removes this bias at the temperature of the calibration",
    )
    gain_percent: Gain = Field(default=0.0, description="power gain per round trip at the centre of the line")
    thermal_speed_mps: ThermalSpeed = Field(
        default=550.0, description="most probable speed of the atoms; that of neon at 367 K is 550 m/s"
    )
    expansion_ppm_per_c: Expansion = Field(
        default=0.02, description="linear expansion of the ring; that of Zerodur is 0.02 ppm/°C"
    )
    path_control: PathControl = Field(
        default=0.0,
        description="fraction of the path-length change that the path-length control removes; 0 for no control",
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
                f"the dither reaches only {rate_deg_h:.4g} deg/h, which is within lock_in_deg_h = "
                f"{self.lock_in_deg_h:g}; increase dither_amplitude_arcsec or dither_frequency_hz"
            )
        if bool(self.gas_flow_mps) != bool(self.gain_percent):
            raise ValueError(
                f"gas_flow_mps = {self.gas_flow_mps:g} with gain_percent = {self.gain_percent:g}: a null shift needs "
                "both; without a null shift give neither"
            )
        return self

    @property
    def ring(self) -> LaserGyro:
        """One of the gyros."""
        return LaserGyro(
            self.perimeter_mm * 1e-3,
            self.area_mm2 * 1e-6,
            self.wavelength_nm * 1e-9,
            self.lock_in_deg_h * DEG_H,
            self.dither_amplitude_arcsec * ARCSEC,
            self.dither_frequency_hz,
        )

    @property
    def null_shift(self) -> NullShift | None:
        """The null shift; None without gas flow."""
        if not self.gas_flow_mps:
            return None
        return NullShift(
            self.ring,
            self.gain_percent * 1e-2,
            self.gas_flow_mps,
            self.thermal_speed_mps,
            self.expansion_ppm_per_c * PPM,
            self.path_control,
        )
