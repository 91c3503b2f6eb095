"""The ring laser gyro: scale, lock-in, dither, random walk, null shift by gas flow; the table [imu.laser_gyro].

The beat of the two beams, in radians of phase ψ (Chow, Gea-Banacloche, Pedrotti, Sanders, Schleich and Scully, The ring
laser gyro, Reviews of Modern Physics 57, 61, 1985; Aronowitz, Fundamentals of the ring laser gyro, RTO-AG-339, 1999):

    (1) ψ̇ = K (Ω + Ω_d) − K Ω_L sin ψ,    K = 8πA/(λL)

for a ring of area A and perimeter L at the wavelength λ. One pulse is a phase of 2π, so that there are 4A/(λL) pulses
per radian and the pulse weight is λL/(4A). Backscatter couples the beams: below the lock-in rate Ω_L there is no beat.

The dither oscillates the ring by ±Θ at the frequency f, with the peak rate Ω_D = 2πfΘ. At its turning points the beat
stops momentarily, and the coupling causes an error. With ψ ≈ ψ_t ± ½ K Ω̇_d t² there, the method of stationary phase
gives the phase −K Ω_L √(2π/(K Ω̇_d)) sin(ψ_t ± π/4), Ω̇_d = 2πf Ω_D. If the phases ψ_t of all turning points are
random, the 2f errors per second add up to a random walk of the angle,

    (2) N = Ω_L / √(K Ω_D)

independent of the frequency. Here K is in radians of phase; with K in pulses per radian the formula is Ω_L/√(2πK Ω_D).
Without randomness the errors of successive turning points add up coherently, and slow rotations are locked in again, at
rates below

    (3) Ω_L |J₀(KΘ)|       with a regular dither: the first-order average of (1), by the Jacobi-Anger expansion
    (4) Ω_L / √(2π KΘ)     with every other turning point random: the error of the others, which is always the same

Null shift: The gain medium moves with the discharge (Langmuir flow). For one beam the gain line is shifted up, for the
other down, by v/u line widths, where v is the mean flow along the beams and u the most probable thermal speed. A
Doppler-broadened line of gain G per round trip pulls a mode that lies ξ widths from its centre by −(cG/(2π^(3/2) L))
D(ξ), where D is Dawson's integral, the imaginary part of the line whose real part is exp(−ξ²). The frequencies of the
beams are thus pulled apart, and the bias is

    (5) Ω₀ = c G λ v / (4 π^(3/2) A u) · (1 − 2ξ D(ξ))

(Aronowitz, The laser gyro, in Ross, ed., Laser Applications 1, 1971, for weak saturation and a line much wider than the
homogeneous one). The mode lies off the centre if the path length is not optimal: a longer ring has lower modes,

    (6) ξ = −(ΔL/λ − [ΔL/λ]) · (c/L) / (u/λ),    [·] the nearest integer

because after half a wavelength the neighbouring mode is nearer to the centre and takes over (a mode hop). Temperature
changes the path by αLΔT; a path-length control removes a part of the change. The scale factor hardly changes: with λ =
L/N the number of pulses per radian is 4AN/L², which a uniform expansion does not change and a mode hop changes by one
part in N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.toml_section import NotNegative, Positive, Section
from sinssim.units import ARCSEC, DEG_H, PPM


@dataclass(frozen=True)
class LaserGyro:
    """A dithered laser gyro.

    Attributes:
        perimeter: L, optical length of the ring, m.
        area: A that the beams enclose, m².
        wavelength: λ, m.
        lock_in: Ω_L, half-width of the dead zone without dither, 0 for none, rad/s.
        dither_amplitude: Θ, from the middle to a turning point, rad.
        dither_frequency: f, Hz.

    Raises:
        InputError: a value is not positive and finite, the perimeter cannot enclose the area, or the dither rate does
            not exceed the lock-in rate.
    """

    perimeter: float
    area: float
    wavelength: float
    lock_in: float
    dither_amplitude: float
    dither_frequency: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (0.0 < value < math.inf or (name == "lock_in" and value == 0.0)):
                raise InputError(f"laser gyro: {name} = {value!r} must be positive and finite.")
        if self.area > self.perimeter**2 / (4.0 * math.pi):
            raise InputError(
                f"laser gyro: a perimeter of {self.perimeter:g} m encloses at most "
                f"{self.perimeter**2 / (4.0 * math.pi):.3g} m², not an area of {self.area:g} m²."
            )
        if self.dither_rate <= self.lock_in:
            raise InputError(
                f"laser gyro: the dither reaches only {self.dither_rate:.3g} rad/s, which is within the "
                f"lock-in of {self.lock_in:.3g} rad/s; increase dither_amplitude or dither_frequency."
            )

    @property
    def scale(self) -> float:
        """K, radians of beat phase per radian of rotation."""
        return 8.0 * math.pi * self.area / (self.wavelength * self.perimeter)

    @property
    def pulse_weight(self) -> float:
        """Rotation per pulse, λL/(4A), rad."""
        return self.wavelength * self.perimeter / (4.0 * self.area)

    @property
    def dither_rate(self) -> float:
        """Ω_D, the dither's largest rate, rad/s."""
        return 2.0 * math.pi * self.dither_frequency * self.dither_amplitude

    @property
    def random_walk(self) -> float:
        """Angle random walk N of (2), rad/√s."""
        return self.lock_in / math.sqrt(self.scale * self.dither_rate)

    @property
    def regular_dead_zone(self) -> float:
        """Half-width (3) of the dead zone with a regular dither, rad/s."""
        from scipy.special import j0

        return self.lock_in * abs(float(j0(self.scale * self.dither_amplitude)))

    @property
    def half_random_dead_zone(self) -> float:
        """Half-width (4) of the dead zone if only every other turning point is random, rad/s."""
        return self.lock_in / math.sqrt(2.0 * math.pi * self.scale * self.dither_amplitude)

    def undithered_rate(self, rate: ArrayLike) -> Array:
        """Return the mean measured rate without dither.

        Args:
            rate: Ω, (...) rad/s.

        Returns:
            sign(Ω) √(Ω² − Ω_L²), zero in the dead zone |Ω| < Ω_L, (...) rad/s.
        """
        omega = np.asarray(rate, dtype=np.float64)
        outside = (np.abs(omega) - self.lock_in) * (np.abs(omega) + self.lock_in)
        return np.asarray(np.sign(omega) * np.sqrt(np.maximum(outside, 0.0)))


SPEED_OF_LIGHT = 299792458.0
"""Speed of light, exact by definition of the metre [m/s]."""


def path_change(gyro: LaserGyro, temperature_change: ArrayLike, expansion: float, control: float = 0.0) -> Array:
    """Return the excess of the ring's length over the path that the mode was tuned to: δL, (...) m.

    Args:
        temperature_change: ΔT since the tuning, (...) K.
        expansion: α, linear expansion of the block, 1/K (Zerodur: some 1e-8).
        control: fraction of the change that the path-length control removes, 0 (none) to 1.
    """
    if not 0.0 <= control <= 1.0:
        raise InputError(
            f"control = {control!r}, the fraction that path-length control removes, must lie between 0 and 1."
        )
    return np.asarray((1.0 - control) * expansion * gyro.perimeter * np.asarray(temperature_change, dtype=np.float64))


def detuning(gyro: LaserGyro, change: ArrayLike, thermal_speed: float) -> Array:
    """Return the distance (6) of the mode from the centre of the gain line.

    Args:
        gyro: the ring.
        change: ΔL of the path from its best length, (...) m.
        thermal_speed: u, most probable speed of the atoms, m/s.

    Returns:
        ξ in Doppler widths u/λ (half width at 1/e), (...).
    """
    if not thermal_speed > 0.0:
        raise InputError(f"thermal_speed = {thermal_speed!r} m/s must be positive.")
    waves = np.asarray(change, dtype=np.float64) / gyro.wavelength
    spacing = SPEED_OF_LIGHT / gyro.perimeter * gyro.wavelength / thermal_speed
    return np.asarray(-(waves - np.rint(waves)) * spacing)


def null_shift(gyro: LaserGyro, change: ArrayLike, gain: float, flow_speed: float, thermal_speed: float) -> Array:
    """Return the bias (5) of a laser gyro by gas flow: ω₀, (...) rad/s.

    Args:
        gyro: the ring.
        change: ΔL of the path from its best length, (...) m.
        gain: G, power gain per round trip at the centre of the line.
        flow_speed: v, speed of the gas along the beams, mean over the ring, m/s; two balanced discharges nearly cancel
            it.
        thermal_speed: u, most probable speed of the atoms, m/s.
    """
    from scipy.special import dawsn

    xi = detuning(gyro, change, thermal_speed)
    at_centre = SPEED_OF_LIGHT * gain * gyro.wavelength * flow_speed / (4.0 * np.pi**1.5 * gyro.area * thermal_speed)
    return np.asarray(at_centre * (1.0 - 2.0 * xi * dawsn(xi)))


@dataclass(frozen=True)
class NullShift:
    """The null shift of a block's three equal gyros as a function of temperature."""

    gyro: LaserGyro  # the ring, tuned to the centre of the gain line at the temperature of its calibration
    gain: float  # G, power gain per round trip at the centre of the line
    flow_speed: float  # v, speed of the gas along the beams, mean over the ring, m/s
    thermal_speed: float  # u, most probable speed of the atoms, m/s
    expansion: float  # α, linear expansion of the block, 1/K
    control: float = 0.0  # fraction of the path's change that the path-length control removes, 0 (none) to 1

    def bias(self, warmth: ArrayLike) -> Array:
        """Return the null shift minus its calibrated value: ω₀(ΔL) − Ω₀(0), (...) rad/s.

        Args:
            warmth: temperature above that of the calibration, (...) K.
        """
        change = path_change(self.gyro, warmth, self.expansion, self.control)
        now, calibrated = (
            null_shift(self.gyro, path, self.gain, self.flow_speed, self.thermal_speed) for path in (change, 0.0)
        )
        return np.asarray(now - calibrated)


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

    rules = (
        (lambda s: bool(s.gas_flow_mps) != bool(s.gain_percent),
         "gas_flow_mps = {s.gas_flow_mps:g} with gain_percent = {s.gain_percent:g}: a null shift needs both; without a "
         "null shift give neither"),
    )  # fmt: skip

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
