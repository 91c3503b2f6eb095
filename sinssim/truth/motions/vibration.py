"""Vibration of a sensor block, and its transmission by shock mounts between airframe and block.

Vibration is a sum of sinusoids; band-limited noise is a sum of many (Shinozuka and Deodatis, Applied Mechanics Reviews
44, 1991).

A block y on springs and dampers follows its base x by ÿ + 2ζω_n(ẏ − ẋ) + ω_n²(y − x) = 0, for displacements and for
small rotations. In the steady state a sinusoid of angular frequency ω is transmitted with the absolute transmissibility
(Harris and Piersol, Shock and Vibration Handbook, theory of vibration isolation)

    (1) H = (ω_n² + 2iζω_nω) / (ω_n² − ω² + 2iζω_nω)

The mount transmits slow motion, amplifies frequencies near ω_n by about 1/(2ζ), and attenuates frequencies above √2
ω_n. It is assumed to be balanced: displacements do not rotate the block, and rotations do not displace it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.toml_section import Frequency, NotNegative, Section
from sinssim.units import ARCSEC, DEG, G0

COORDINATES = {
    "roll": "rotation about the vehicle's forward axis, rad",
    "pitch": "rotation about its right axis, rad",
    "yaw": "rotation about its down axis, rad",
    "forward": "displacement, m",
    "right": "displacement, m",
    "down": "displacement, m",
}
TURNS = ("roll", "pitch", "yaw")
"""The coordinates that are rotations; the others are displacements."""
COORDINATE_NUMBER = {name: number for number, name in enumerate(COORDINATES)}

# Sizes beyond any vehicle's motion: half a turn, a kilometre, and an acceleration that destroys any instrument.
_MOST_ARCSEC, _MOST_MM, _MOST_G = 648_000.0, 1e6, 1e5


@dataclass(frozen=True)
class Tone:
    """One sinusoid of one coordinate: amplitude · sin(2π frequency t + phase)."""

    coordinate: str  # one of `COORDINATES`; the three rotations are components of one rotation vector
    amplitude: float  # rad or m
    frequency_hz: float
    phase: float = 0.0  # rad


class Shaking(NamedTuple):
    """A vibration that a vehicle has of itself."""

    tones: tuple[Tone, ...]
    part: Callable[[Array], Array]
    """The part of it that acts at instants, (N,) s, with its two derivatives by time, (3, N)."""


def band_noise(
    coordinate: str,
    rms: float,
    low_hz: float,
    high_hz: float,
    seed: int,
    count: int = 50,
    *,
    of_acceleration: bool = False,
) -> tuple[Tone, ...]:
    """Return noise with a flat spectrum between two frequencies, as tones.

    The band is divided into equal pieces with one tone in each, at a random frequency and phase. The sum is nearly
    Gaussian, never repeats, and has exactly the requested power. Each coordinate has random numbers of its own. The
    root mean square is in rad or m; with `of_acceleration`, it and the flat spectrum are those of the second
    derivative.
    """
    if coordinate not in COORDINATE_NUMBER:
        raise unknown_name("coordinate of the vibration", coordinate, COORDINATES)
    if not (0.0 <= low_hz < high_hz and np.isfinite(high_hz) and rms >= 0.0):
        raise InputError(
            f"vibration noise on {coordinate} of {rms!r} between {low_hz!r} Hz and {high_hz!r} Hz: the band must begin "
            "at 0 Hz or above and end above its beginning, and the amplitude must not be negative."
        )
    sequence = np.random.SeedSequence(seed, spawn_key=(COORDINATE_NUMBER[coordinate],))
    generator = np.random.Generator(np.random.SFC64(sequence))
    width = (high_hz - low_hz) / count
    frequency = low_hz + width * (np.arange(count) + generator.random(count))
    phase = 2.0 * np.pi * generator.random(count)
    amplitude = rms * np.sqrt(2.0 / count) / ((2.0 * np.pi * frequency) ** 2 if of_acceleration else 1.0)
    tones = np.broadcast(amplitude, frequency, phase)
    return tuple(Tone(coordinate, float(a), float(f), float(p)) for a, f, p in tones)


def _wrong_size(of: Vibration) -> tuple[str, str] | None:
    """Return the keys that may give the size of a vibration, and the given ones, if these are not one of those."""
    right = ("rms_arcsec",) if of.coordinate in TURNS else ("rms_mm", "rms_g")
    given = [key for key in ("rms_arcsec", "rms_mm", "rms_g") if getattr(of, key) is not None]
    if len(given) == 1 and given[0] in right:
        return None
    return " or ".join(right), " and ".join(given) or "no key"


class Vibration(Section):
    """Vibration of the sensor block, which is added to the motion, in the axes of the sensor block: a sinusoid, or
    band-limited noise."""

    rules = (
        (lambda s: _wrong_size(s),
         "the size of a vibration in {s.coordinate} must be given by {it[0]}; here it is given by {it[1]}"),
        (lambda s: s.high_hz is not None and s.high_hz <= s.low_hz,
         "the band from {s.low_hz:g} Hz to {s.high_hz:g} Hz is empty; increase high_hz"),
    )  # fmt: skip

    coordinate: Literal["roll", "pitch", "yaw", "forward", "right", "down"] = Field(description="vibrating coordinate")
    rms_arcsec: NotNegative | None = Field(
        default=None, le=_MOST_ARCSEC, description="rms of a vibration in roll, pitch or yaw"
    )
    rms_mm: NotNegative | None = Field(
        default=None, le=_MOST_MM, description="rms of a vibration forward, right or down"
    )
    rms_g: NotNegative | None = Field(
        default=None,
        le=_MOST_G,
        description="rms of the acceleration, which then has a flat spectrum, instead of rms_mm",
    )
    low_hz: Frequency = Field(description="lower edge of the band, or the frequency of a sinusoid")
    high_hz: Frequency | None = Field(
        default=None, description="upper edge of the band; without it, the vibration is a sinusoid"
    )
    phase_deg: float = Field(
        default=0.0,
        ge=-36_000.0,
        le=36_000.0,
        description="phase of a sinusoid (with rms_g, of its acceleration) at the start",
    )

    def tones(self, seed: int) -> tuple[Tone, ...]:
        """Return the sinusoids of the vibration; the seed is that of a noise."""
        of_acceleration = self.rms_g is not None
        rms = (self.rms_arcsec or 0.0) * ARCSEC + (self.rms_mm or 0.0) * 1e-3 + (self.rms_g or 0.0) * G0
        if self.high_hz is None:
            omega = 2.0 * np.pi * self.low_hz
            amplitude = 2.0**0.5 * rms / (-(omega**2) if of_acceleration else 1.0)
            return (Tone(self.coordinate, amplitude, self.low_hz, self.phase_deg * DEG),)
        return band_noise(self.coordinate, rms, self.low_hz, self.high_hz, seed, of_acceleration=of_acceleration)


@dataclass(frozen=True)
class Mount:
    """A second-order mount in one kind of motion.

    Raises:
        InputError: the frequency or the damping is not positive and finite.
    """

    natural_hz: float  # ω_n/2π, Hz
    damping: float  # ζ, fraction of critical damping

    def __post_init__(self) -> None:
        if not (0.0 < self.natural_hz < np.inf and 0.0 < self.damping < np.inf):
            raise InputError(
                f"a mount of {self.natural_hz!r} Hz with a damping of {self.damping!r}: both must be positive and "
                "finite."
            )

    def transfer(self, frequency_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return the transmissibility (1): H, (...); its absolute value is the gain, its argument the
        phase lead, rad."""
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
