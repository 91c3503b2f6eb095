"""The physics of a ring laser gyro: scale, lock-in, mechanical dither, and the resulting random walk.

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
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import InputError


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
