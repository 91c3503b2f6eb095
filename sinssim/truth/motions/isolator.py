"""Shock mounts between airframe and sensor block: transmission of vibration.

A block y on springs and dampers follows its base x by ÿ + 2ζω_n(ẏ − ẋ) + ω_n²(y − x) = 0, for displacements and for
small rotations. In the steady state a sinusoid of angular frequency ω is transmitted with the absolute transmissibility
(Harris and Piersol, Shock and Vibration Handbook, theory of vibration isolation)

    (1) H = (ω_n² + 2iζω_nω) / (ω_n² − ω² + 2iζω_nω)

The mount transmits slow motion, amplifies frequencies near ω_n by about 1/(2ζ), and attenuates frequencies above √2
ω_n. It is assumed to be balanced: displacements do not rotate the block, and rotations do not displace it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from sinssim.errors import InputError
from sinssim.section import Frequency, Section
from sinssim.truth.motions.vibration import TURNS, Tone


@dataclass(frozen=True)
class Mount:
    """A second-order mount in one kind of motion.

    Attributes:
        natural_hz: ω_n/2π, Hz.
        damping: ζ, fraction of critical damping.

    Raises:
        InputError: the frequency or the damping is not positive and finite.
    """

    natural_hz: float
    damping: float

    def __post_init__(self) -> None:
        if not (0.0 < self.natural_hz < np.inf and 0.0 < self.damping < np.inf):
            raise InputError(
                f"a mount of {self.natural_hz!r} Hz with a damping of {self.damping!r}: both must be positive and "
                "finite."
            )

    def transfer(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return the transmissibility (1).

        Args:
            frequency_hz: (...) Hz.

        Returns:
            H, (...); its absolute value is the gain, its argument the phase lead, rad.
        """
        ratio = np.asarray(frequency_hz, dtype=np.float64) / self.natural_hz
        damper = 2j * self.damping * ratio
        return np.asarray((1.0 + damper) / (1.0 - ratio**2 + damper))  # (1)


Damping = Annotated[float, Field(ge=1e-6, le=1e3)]
"""Limits of the damping ratio: below, resonance grows without bound; above, the mount is rigid."""


class Isolator(Section):
    """Shock mounts, which transmit [[vibration]] as a second-order system; the motion itself is unchanged."""

    linear_hz: Frequency = Field(description="natural frequency in translation")
    linear_damping: Damping = Field(default=0.2, description="damping ratio in translation")
    angular_hz: Frequency = Field(description="natural frequency in rotation")
    angular_damping: Damping = Field(default=0.2, description="damping ratio in rotation")

    def transmitted(self, tones: Iterable[Tone]) -> list[Tone]:
        """Return the vibration of the block."""
        linear, angular = Mount(self.linear_hz, self.linear_damping), Mount(self.angular_hz, self.angular_damping)
        passed = []
        for tone in tones:
            h = complex((angular if tone.coordinate in TURNS else linear).transfer(tone.frequency_hz))
            passed.append(replace(tone, amplitude=tone.amplitude * abs(h), phase=tone.phase + float(np.angle(h))))
        return passed
