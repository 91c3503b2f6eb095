"""Channels of a log on equal intervals, for Allan deviations and spectra, and the units of their noise terms.

Order, names, units and digits of the terms are those of tables.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sinssim.arguments import longest_gap
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.imu_samples import Samples, TriadName
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, UG

SYMBOLS = ("Q", "N", "B", "K", "R", "sigma_b")
"""Noise terms in the order of display."""
NAMES: dict[str, str] = {
    "Q": "quantisation",
    "N": "random walk",
    "B": "bias instability, flicker",
    "K": "rate random walk",
    "R": "rate ramp",
    "sigma_b": "Gauss-Markov bias, 1σ",
}
"""Names of the noise terms."""
_HOUR = 3600.0


@dataclass(frozen=True)
class Units:
    """The units in which a channel's noise is given."""

    rate: tuple[str, float]  # unit of the reading itself and of its Allan deviation, and its size in SI
    terms: dict[str, tuple[str, float]]  # unit and size of each noise term
    key: str = ""  # ending of the names of numbers in JSON; "" if the unit is given separately

    def named(self, what: str) -> str:
        """Return the name of a number in the unit of the reading for JSON, for example mean_deg_h."""
        return f"{what}_{self.key}" if self.key else what


UNITS: dict[TriadName, Units] = {
    "gyro": Units(
        ("deg/h", DEG_H),
        {
            "Q": ("arcsec", ARCSEC),
            "N": ("deg/√h", DEG_SQRT_H),
            "B": ("deg/h", DEG_H),
            "K": ("deg/h/√h", DEG_H / math.sqrt(_HOUR)),
            "R": ("deg/h/h", DEG_H / _HOUR),
            "sigma_b": ("deg/h", DEG_H),
        },
        "deg_h",
    ),
    "accel": Units(
        ("µg", UG),
        {
            "Q": ("mm/s", 1e-3),
            "N": ("µg/√Hz", UG),
            "B": ("µg", UG),
            "K": ("µg/√h", UG / math.sqrt(_HOUR)),
            "R": ("µg/h", UG / _HOUR),
            "sigma_b": ("µg", UG),
        },
        "ug",
    ),
}
"""Units of gyros and accelerometers: those of data sheets."""

_AT_THE_END = {
    "c": "°C", "degc": "°C", "pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mbar": "mbar", "m": "m", "mm": "mm", "km": "km",
    "ft": "ft", "mps": "m/s", "mps2": "m/s²", "ug": "µg", "deg": "deg", "rad": "rad", "arcsec": "arcsec",
    "arcmin": "arcmin", "mrad": "mrad", "urad": "µrad", "dps": "deg/s", "deg_s": "deg/s", "rad_s": "rad/s",
    "deg_h": "deg/h", "hz": "Hz", "mv": "mV", "nt": "nT", "ut": "µT", "percent": "%",
}  # fmt: skip


def unit_in_name(name: str) -> str | None:
    """Return the known unit at the end of a column's name, for example "Pa" for pressure_pa; None without one."""
    words = name.lower().split("_")
    for count in (2, 1):
        if len(words) > count and (unit := _AT_THE_END.get("_".join(words[-count:]))) is not None:
            return unit
    return None


def units_of(unit: str) -> Units:
    """Return the units of a quantity's noise terms: its own unit, any text, times powers of a second, all of size 1."""
    terms = {"Q": "·s", "N": "/√Hz", "B": "", "K": "/√s", "R": "/s", "sigma_b": ""}
    return Units((unit, 1.0), {symbol: (unit + power, 1.0) for symbol, power in terms.items()})


def four_digits(value: float) -> str:
    """Write a number with four significant digits, without an exponent for moderate sizes, such as "0.1500"."""
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.3e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def symbol_text(symbol: str) -> str:
    """Return the printed symbol of a term."""
    return "σ_b" if symbol == "sigma_b" else symbol


AXES = ("x", "y", "z")
"""Forward, right, down."""
SHORTEST, LONGEST = 1e-9, 1e6
"""Allowed intervals of a log, s."""

_DIRECTIONS = ("forward", "right", "down")
_STEADY = 0.01  # fraction of an interval by which times may be rounded


@dataclass(frozen=True)
class LogChannel:
    """One channel of a log."""

    name: str  # for example gyro_x; for any other quantity the name of its column
    units: Units  # units of its noise
    triad: TriadName | None = None  # "gyro" or "accel"; None for any other quantity
    axis: int = 0  # number of the triad's axis: 0, 1 or 2

    @property
    def title(self) -> str:
        """The name, with the direction of a triad's axis: "gyro_x (forward)"."""
        return self.name if self.triad is None else f"{self.name} ({_DIRECTIONS[self.axis]})"


CHANNELS: tuple[LogChannel, ...] = tuple(
    LogChannel(f"{triad}_{AXES[i]}", units, triad, i) for triad, units in UNITS.items() for i in range(3)
)
"""The channels of gyros and accelerometers, in the order of display."""


@dataclass(frozen=True)
class Clock:
    """Sample times of a log."""

    interval: float  # mean interval T, s
    unevenness: float  # largest departure of an interval from T, relative to T

    @property
    def even(self) -> bool:
        """Whether the intervals are equal except for the rounding of times."""
        return self.unevenness <= _STEADY


def chosen_channels(names: Sequence[str]) -> list[LogChannel]:
    """Return the channels of given names: those of `CHANNELS` in their order, then the others in the given order.

    A name is "gyro_x" … "accel_z", "gyro" or "accel" for three of them, or any column of a log with its unit,
    "pressure=hPa"; the unit may be omitted if the column's name ends in it, "pressure_hpa". By default they are all
    gyros and accelerometers.
    """
    known = {channel.name: {channel.name} for channel in CHANNELS}
    known |= {triad: {channel.name for channel in CHANNELS if channel.triad == triad} for triad in UNITS}
    wanted: set[str] = set() if names else {channel.name for channel in CHANNELS}
    others: dict[str, LogChannel] = {}
    for name in names:
        if name in known:
            wanted |= known[name]
            continue
        column, stated, unit = name.rpartition("=")
        if not stated:
            column, unit = name, unit_in_name(name) or ""
        if not unit:
            raise InputError(
                f"{unknown_name('channel', column, known)} Give any other column with its unit, {column}=UNIT, for "
                f"example {column}=hPa, or {column}=1 for a plain number."
            )
        first = others.setdefault(column, LogChannel(column, units_of(unit))).units.rate[0]
        if first != unit:
            raise InputError(f"the column {column!r} is given with two units, {first} and {unit}; give one of them.")
    return [*(channel for channel in CHANNELS if channel.name in wanted), *others.values()]


def part(samples: Samples, start: float | None, end: float | None, source: str) -> Samples:
    """Return the part of a log between two times of its clock, s; raise for a part without samples."""
    time = samples.time
    first = 0 if start is None else int(np.searchsorted(time, start - 1e-9))
    last = len(time) if end is None else int(np.searchsorted(time, end + 1e-9, side="right"))
    if last - first < 2:
        limits = " ".join(
            f"{word} {limit:.9g} s" for word, limit in (("from", start), ("to", end)) if limit is not None
        )
        raise InputError(
            f"{source}: there are no samples {limits}; the log runs from {time[0]:.9g} to {time[-1]:.9g} s."
        )
    rows = slice(first, last - 1)
    return replace(
        samples,
        time=time[first:last],
        triads={name: values[rows] for name, values in samples.triads.items()},
        quantities={name: values[rows] for name, values in samples.quantities.items()},
    )


def clock(samples: Samples, source: str) -> Clock:
    """Return the mean interval of a log, and how much its intervals vary."""
    steps = np.diff(samples.time)
    if (gap := longest_gap(samples.time)) is not None:
        worst, typical = gap
        raise InputError(
            f"{source}, sample {worst}: there are no samples for {steps[worst]:.6g} s from {samples.time[worst]:.9g} s "
            f"on; usual intervals are {typical:.6g} s. Use a part without a gap (--from, --to); if samples are lost "
            "but not their increments, resample the log to equal intervals first."
        )
    interval = float((samples.time[-1] - samples.time[0]) / len(steps))
    if not SHORTEST <= interval <= LONGEST:
        raise InputError(
            f"{source}: samples every {interval:.3g} s are impossible for a sensor, whose intervals are {SHORTEST:g} "
            f"to {LONGEST:g} s. Check the unit of the times (time_unit, rate_hz)."
        )
    return Clock(interval, float(np.max(np.abs(steps - interval))) / interval)


def even_increments(samples: Samples, channel: LogChannel, timing: Clock) -> Array:
    """Return one channel's increments over equal intervals, (N,) rad, m/s, or another unit times seconds.

    A reading is assumed to hold over the interval before its time. At uneven times the accumulated readings are taken
    at the sample nearest to each edge. Interpolation would smooth the noise, whereas this keeps white noise white.
    """
    if channel.triad is None:
        summed, values = False, samples.quantities[channel.name]
    else:
        summed = samples.kind == "increments"
        values = np.ascontiguousarray(samples.triads[channel.triad][:, channel.axis])
    if timing.even:
        return values if summed else np.asarray(values * timing.interval)
    steps = np.diff(samples.time)
    mean = float(np.sum(values) / np.sum(steps)) if summed else float(np.mean(values))
    # without the mean rate, from which uneven times would make noise
    departures = values - mean * steps if summed else (values - mean) * steps
    total = np.concatenate([[0.0], np.cumsum(departures)])
    edges = np.linspace(samples.time[0], samples.time[-1], len(samples.time))
    after = np.searchsorted(samples.time, edges).clip(1, len(steps))
    nearest = after - (edges - samples.time[after - 1] < samples.time[after] - edges)
    return np.asarray(np.diff(total[nearest]) + mean * timing.interval)
