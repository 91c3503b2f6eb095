"""Channels of a log on equal intervals, for Allan deviations and spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sinssim.analyses.noise_identification.units import UNITS, Units, unit_in_name, units_of
from sinssim.checks import longest_gap
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.text.samples import Samples, TriadName

AXES = ("x", "y", "z")
"""Forward, right, down."""
SHORTEST, LONGEST = 1e-9, 1e6
"""Allowed intervals of a log, s."""

_DIRECTIONS = ("forward", "right", "down")
_STEADY = 0.01  # fraction of an interval by which times may be rounded


@dataclass(frozen=True)
class LogChannel:
    """One channel of a log.

    Attributes:
        name: for example gyro_x; for any other quantity the name of its column.
        units: units of its noise.
        triad: "gyro" or "accel"; None for any other quantity.
        axis: number of the triad's axis: 0, 1 or 2.
    """

    name: str
    units: Units
    triad: TriadName | None = None
    axis: int = 0

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
    """Sample times of a log.

    Attributes:
        interval: mean interval T, s.
        unevenness: largest departure of an interval from T, relative to T.
    """

    interval: float
    unevenness: float

    @property
    def even(self) -> bool:
        """Whether the intervals are equal except for the rounding of times."""
        return self.unevenness <= _STEADY


def chosen_channels(names: Sequence[str]) -> list[LogChannel]:
    """Return the channels of given names.

    Args:
        names: "gyro_x" … "accel_z", "gyro" or "accel" for three of them, or any column of a log with its unit,
            "pressure=hPa"; the unit may be omitted if the column's name ends in it, "pressure_hpa". By default all
            gyros and accelerometers.

    Returns:
        The channels: those of `CHANNELS` in their order, then the others in the given order.

    Raises:
        InputError: there is no such channel, or a column is named with two units.
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
    """Return the part of a log between two times.

    Args:
        start, end: times of the log's clock, s; None for the beginning or end of the log.

    Raises:
        InputError: there are no samples between them.
    """
    time = samples.time
    first = 0 if start is None else int(np.searchsorted(time, start - 1e-9))
    last = len(time) if end is None else int(np.searchsorted(time, end + 1e-9, side="right"))
    if last - first < 2:
        asked = " ".join(f"{word} {limit:.9g} s" for word, limit in (("from", start), ("to", end)) if limit is not None)
        raise InputError(
            f"{source}: there are no samples {asked}; the log runs from {time[0]:.9g} to {time[-1]:.9g} s."
        )
    rows = slice(first, last - 1)
    return replace(
        samples,
        time=time[first:last],
        triads={name: values[rows] for name, values in samples.triads.items()},
        quantities={name: values[rows] for name, values in samples.quantities.items()},
    )


def clock(samples: Samples, source: str) -> Clock:
    """Analyse the sample times of a log.

    Returns:
        Mean interval, and the variation of the intervals.

    Raises:
        InputError: samples are missing.
    """
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
    """Return one channel's increments over equal intervals.

    A reading is assumed to hold over the interval before its time. At uneven times the accumulated readings are taken
    at the sample nearest to each edge. Interpolation would smooth the noise, whereas this keeps white noise white.

    Returns:
        (N,) rad or m/s; for any other quantity, its unit times seconds.
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
