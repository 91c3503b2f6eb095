"""Shock mounts between airframe and sensor block: the vibration that they transmit.

A block on springs and dampers follows its base x by ÿ + 2ζω_n(ẏ − ẋ) + ω_n²(y − x) = 0, for a displacement as for a
small turn, so that in the steady state a sinusoid of angular frequency ω comes through with the absolute
transmissibility (Harris and Piersol, Shock and Vibration Handbook, theory of vibration isolation)

    (1) H = (ω_n² + 2iζω_nω) / (ω_n² − ω² + 2iζω_nω)

It passes slow motion on, amplifies what is near ω_n by about 1/(2ζ), and weakens what is above √2 ω_n. The mount is
taken to be balanced: displacements do not turn the block, turns do not move it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.errors import InputError
from sinssim.truth.motions.vibration import TURNS, Tone


@dataclass(frozen=True)
class Mount:
    """A second-order mount in one kind of motion.

    Attributes:
        natural_hz: ω_n/2π, Hz.
        damping: ζ, part of the critical damping.

    Raises:
        InputError: a frequency or a damping that is not positive and finite.
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
            H, (...); its absolute value is the gain, its argument the lead of the phase, rad.
        """
        ratio = np.asarray(frequency_hz, dtype=np.float64) / self.natural_hz
        damper = 2j * self.damping * ratio
        return np.asarray((1.0 + damper) / (1.0 - ratio**2 + damper))  # (1)


def isolated(tones: Iterable[Tone], linear: Mount, angular: Mount) -> list[Tone]:
    """Return the vibration of a block on shock mounts.

    Args:
        tones: the vibration of the airframe.
        linear: the mount's behaviour in displacements.
        angular: the mount's behaviour in turns.

    Returns:
        The vibration of the block, tone by tone.
    """
    passed = []
    for tone in tones:
        h = complex((angular if tone.coordinate in TURNS else linear).transfer(tone.frequency_hz))
        passed.append(replace(tone, amplitude=tone.amplitude * abs(h), phase=tone.phase + float(np.angle(h))))
    return passed
