"""The null shift of a laser gyro by gas flow, and its dependence on path length and temperature.

The gain medium moves with the discharge (Langmuir flow). For one beam the gain line is shifted up, for the other down,
by v/u line widths, where v is the mean flow along the beams and u the most probable thermal speed. A Doppler-broadened
line of gain G per round trip pulls a mode that lies ξ widths from its centre by −(cG/(2π^(3/2) L)) D(ξ), where D is
Dawson's integral, the imaginary part of the line whose real part is exp(−ξ²). The frequencies of the beams are thus
pulled apart, and the bias is

    (1) Ω₀ = c G λ v / (4 π^(3/2) A u) · (1 − 2ξ D(ξ))

(Aronowitz, The laser gyro, in Ross, ed., Laser Applications 1, 1971, for weak saturation and a line much wider than the
homogeneous one). The mode lies off the centre if the path length is not optimal: a longer ring has lower modes,

    (2) ξ = −(ΔL/λ − [ΔL/λ]) · (c/L) / (u/λ),    [·] the nearest integer

because after half a wavelength the neighbouring mode is nearer to the centre and takes over (a mode hop). Temperature
changes the path by αLΔT; a path-length control removes a part of the change. The scale factor hardly changes: with λ =
L/N the number of pulses per radian is 4AN/L², which a uniform expansion does not change and a mode hop changes by one
part in N.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.laser_gyro.ring import LaserGyro

SPEED_OF_LIGHT = 299792458.0
"""Speed of light, exact by definition of the metre [m/s]."""


def path_change(gyro: LaserGyro, temperature_change: ArrayLike, expansion: float, control: float = 0.0) -> Array:
    """Return the excess of the ring's length over the path that the mode was tuned to.

    Args:
        temperature_change: ΔT since the tuning, (...) K.
        expansion: α, linear expansion of the block, 1/K (Zerodur: some 1e-8).
        control: fraction of the change that the path-length control removes, 0 (none) to 1.

    Returns:
        ΔL, (...) m.

    Raises:
        InputError: control lies outside 0...1.
    """
    if not 0.0 <= control <= 1.0:
        raise InputError(
            f"control = {control!r}, the fraction that path-length control removes, must lie between 0 and 1."
        )
    return np.asarray((1.0 - control) * expansion * gyro.perimeter * np.asarray(temperature_change, dtype=np.float64))


def detuning(gyro: LaserGyro, change: ArrayLike, thermal_speed: float) -> Array:
    """Return the distance (2) of the mode from the centre of the gain line.

    Args:
        gyro: the ring.
        change: ΔL of the path from its best length, (...) m.
        thermal_speed: u, most probable speed of the atoms, m/s.

    Returns:
        ξ in Doppler widths u/λ (half width at 1/e), (...).

    Raises:
        InputError: the speed is not positive.
    """
    if not thermal_speed > 0.0:
        raise InputError(f"thermal_speed = {thermal_speed!r} m/s must be positive.")
    waves = np.asarray(change, dtype=np.float64) / gyro.wavelength
    spacing = SPEED_OF_LIGHT / gyro.perimeter * gyro.wavelength / thermal_speed
    return np.asarray(-(waves - np.rint(waves)) * spacing)


def null_shift(gyro: LaserGyro, change: ArrayLike, gain: float, flow_speed: float, thermal_speed: float) -> Array:
    """Return the bias (1) of a laser gyro by gas flow.

    Args:
        gyro: the ring.
        change: ΔL of the path from its best length, (...) m.
        gain: G, power gain per round trip at the centre of the line.
        flow_speed: v, speed of the gas along the beams, mean over the ring, m/s; two balanced discharges nearly cancel
            it.
        thermal_speed: u, most probable speed of the atoms, m/s.

    Returns:
        Ω₀, (...) rad/s.

    Raises:
        InputError: the thermal speed is not positive.
    """
    from scipy.special import dawsn

    xi = detuning(gyro, change, thermal_speed)
    at_centre = SPEED_OF_LIGHT * gain * gyro.wavelength * flow_speed / (4.0 * np.pi**1.5 * gyro.area * thermal_speed)
    return np.asarray(at_centre * (1.0 - 2.0 * xi * dawsn(xi)))


@dataclass(frozen=True)
class NullShift:
    """The null shift of a block's three equal gyros as a function of temperature.

    Attributes:
        gyro: the ring, tuned to the centre of the gain line at the temperature of its calibration.
        gain: G, power gain per round trip at the centre of the line.
        flow_speed: v, speed of the gas along the beams, mean over the ring, m/s.
        thermal_speed: u, most probable speed of the atoms, m/s.
        expansion: α, linear expansion of the block, 1/K.
        control: fraction of the path's change that the path-length control removes, 0 (none) to 1.
    """

    gyro: LaserGyro
    gain: float
    flow_speed: float
    thermal_speed: float
    expansion: float
    control: float = 0.0

    def bias(self, warmth: ArrayLike) -> Array:
        """Return the null shift minus its calibrated value.

        Args:
            warmth: temperature above that of the calibration, (...) K.

        Returns:
            Ω₀(ΔL) − Ω₀(0), (...) rad/s.
        """
        change = path_change(self.gyro, warmth, self.expansion, self.control)
        now, calibrated = (
            null_shift(self.gyro, path, self.gain, self.flow_speed, self.thermal_speed) for path in (change, 0.0)
        )
        return np.asarray(now - calibrated)
