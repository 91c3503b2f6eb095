"""Allan deviation and noise terms of every channel of a log, in datasheet units.

The channels are put on equal intervals first. Order, names, units and digits of the terms are those of tables. The
numbers can be used in a scenario's [imu], so that an identified real sensor can be emulated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.analyses.allan_deviation import AllanDeviation, allan_deviation, confidence_band, degrees_of_freedom
from sinssim.analyses.noise_fit import NoiseFit, fit_noise, is_constant, spike_of
from sinssim.arguments import longest_gap
from sinssim.data import Array
from sinssim.errors import InputError, unknown_name
from sinssim.logs.imu_samples import SUFFIXES, Samples, TriadName, read_samples, slow
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, G0, UG

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


_NOT_THESE = 0.5  # relative misfit of the spectrum above which the sensor was not at rest
_AT_REST = 0.05  # largest relative error of the specific force of a poor sensor at rest


@dataclass(frozen=True)
class ChannelNoise:
    """One channel's noise."""

    channel: LogChannel
    deviation: AllanDeviation  # its Allan deviation
    freedom: Array  # equivalent degrees of freedom of each Allan variance, (M,)
    low: Array
    high: Array  # low, high: 95 % band of the Allan deviation, (M,) rad/s or m/s², or the unit of another quantity
    fit: NoiseFit  # its noise terms
    spike: tuple[float, float] | None
    """Time of the sample with the largest deviation from its neighbours, s, and the deviation in standard deviations;
    None if noise explains it.
    """

    @property
    def name(self) -> str:
        """Name of the channel: for example gyro_x, or the name of the log's column."""
        return self.channel.name

    @property
    def units(self) -> Units:
        """The units of the terms."""
        return self.channel.units

    @property
    def symbols(self) -> list[str]:
        """The fitted terms in the order of the tables."""
        return [symbol for symbol in SYMBOLS if symbol in self.fit.estimates]

    @property
    def described(self) -> bool:
        """Whether the noise terms describe the spectrum of the record."""
        return self.fit.misfit <= _NOT_THESE

    @property
    def lowest(self) -> tuple[float, float]:
        """Lowest Allan deviation, which data sheets call in-run bias stability, rad/s or m/s², and its τ, s.

        It is taken where the upper end of the band is lowest.
        """
        i = int(np.argmin(self.high))
        return float(self.deviation.deviation[i]), float(self.deviation.tau[i])

    def remarks(self) -> Iterator[str]:
        """Yield remarks on the numbers."""
        fit = self.fit
        if fit.exchangeable:
            yield (
                f"{' and '.join(map(symbol_text, fit.exchangeable))} described the record best, but zero is in the "
                "band: an unobserved term could replace it."
            )
        if fit.possible is not None:
            sigma, time = fit.possible
            unit, size = self.units.rate
            yield (
                f"A Gauss-Markov bias of σ_b = {four_digits(sigma / size)} {unit} and τ_b = {time:.3g} s could explain "
                "this, but is not significant. If such a bias is known, give its --correlation-time."
            )
        pulse = math.sqrt(12.0) * fit.likely["Q"]
        inertial = self.channel.triad is not None
        steady = "the sensor stood still" if inertial else "the quantity was steady"
        moves = fit.likely["N"] * math.sqrt(fit.interval)
        # readings of other quantities are rounded themselves instead of their integral, which gives white noise, not Q
        if inertial and moves < 0.5 * pulse and self.described:
            moved = moves / pulse
            by = f"by {moved:.2g} pulses only" if moved > 0.0 else "by less than half a pulse, if at all"
            yield (
                f"Between samples the random walk moves the output {by}. Unless the sensor moves by more (dither "
                "does), rounding errors are correlated and not white: Q, and with it N, is then not "
                "trusted."
            )
        if self.spike is not None:
            time, size = self.spike
            yield (
                f"The sample at {time:.9g} s is {size:.3g} standard deviations off its neighbours: a spike or a jolt. "
                "Its power counts as noise; use a part without it (--from, --to)."
            )
        for low, high in fit.aside:
            yield (
                f"{low:.4g} to {high:.4g} Hz (τ near {0.5 / math.sqrt(low * high):.3g} s) does not fit these terms and "
                "was left out: vibration, a filter or a resonance."
            )
        if not self.described:
            yield (
                "These terms do not describe this record: bands of its spectrum depart from them by "
                f"{100.0 * fit.misfit:.0f} % rms. Use a part in which {steady} (--from, --to)."
            )
        elif fit.misfit > 0.0:
            yield (
                f"These terms describe the spectrum to {100.0 * fit.misfit:.2g} % only; the bands of the terms include "
                f"this. Check that {steady}, at constant temperature."
            )

    def to_json(self) -> dict[str, Any]:
        """Return plain numbers with their units."""
        unit, size = self.units.rate
        named = self.units.named
        terms: dict[str, Any] = {}
        for symbol in self.symbols:
            estimate = self.fit.estimates[symbol]
            term_unit, term_size = self.units.terms[symbol]
            value = None if estimate.value is None else estimate.value / term_size
            terms[symbol] = {
                "name": NAMES[symbol],
                "unit": term_unit,
                "value": value,
                "low": estimate.low / term_size,
                "high": estimate.high / term_size,
            }
        lowest, tau = self.lowest
        return {
            "unit": unit,
            named("mean"): self.fit.mean / size,
            "terms": terms,
            "correlation_time_s": self.fit.correlation_time,
            "correlation_time_band_s": self.fit.correlation_band,
            named("lowest_allan_deviation"): lowest / size,
            "lowest_allan_deviation_tau_s": tau,
            "misfit": self.fit.misfit,
            "left_out_hz": self.fit.aside,
            "remarks": list(self.remarks()),
            "allan": {
                "tau_s": self.deviation.tau.tolist(),
                named("deviation"): (self.deviation.deviation / size).tolist(),
                named("low"): (self.low / size).tolist(),
                named("high"): (self.high / size).tolist(),
                "degrees_of_freedom": [nu if math.isfinite(nu) else None for nu in self.freedom.tolist()],
                named("fit"): (self.fit.allan_deviation(self.deviation.tau) / size).tolist(),
            },
        }


@dataclass(frozen=True)
class NoiseReport:
    """The noise of a log's channels."""

    source: str  # name of the log
    samples: Samples
    interval: float  # T, s
    channels: tuple[ChannelNoise, ...]  # channels in the order of `chosen_channels`
    remarks: tuple[str, ...]  # sentences on the log as a whole

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return float(self.samples.time[-1] - self.samples.time[0])

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.samples.time) - 1

    def to_json(self) -> dict[str, Any]:
        """Return plain numbers with units in the names; unobservable values are None."""
        return {
            "source": self.source,
            "duration_s": self.duration,
            "samples": self.count,
            "interval_s": self.interval,
            "remarks": list(self.remarks),
            "channels": {channel.name: channel.to_json() for channel in self.channels},
        }


def noise_report(
    log: Path,
    *,
    columns: Path | None = None,
    channels: Sequence[str] = (),
    start: float | None = None,
    end: float | None = None,
    correlation_time: float | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> NoiseReport:
    """Identify the noise of a log's channels, of the part from `start` to `end`, in the log's own time, s.

    The log is one of sensors at rest or of other quantities (`sinssim.logs.imu_samples.SUFFIXES`), a run
    directory, whose measured stream is used, or a scenario with [log], whose inertial unit is used. `columns` is a TOML
    file that names a log's columns, units and axes. The channels are those of `chosen_channels`, by default of the
    triads that `columns` describes. A known correlation time, s, is that of `fit_noise`.
    """
    wanted = chosen_channels(channels)
    triads = list(dict.fromkeys(channel.triad for channel in wanted if channel.triad is not None)) if channels else None
    others = [channel.name for channel in wanted if channel.triad is None]

    def tell(what: str, fraction: float) -> None:
        if progress is not None:
            progress(what, fraction)

    tell(f"Reading {log.name}", 0.0)
    samples = part(_samples(log, columns, triads, others), start, end, str(log))
    wanted = [channel for channel in wanted if channel.triad is None or channel.triad in samples.triads]
    timing = clock(samples, str(log))
    remarks = []
    if samples.triads and (doubt := slow(samples.time)) is not None:
        remarks.append(doubt)
    if others and not samples.time_unit_stated:
        remarks.append(
            "The times are assumed to be in seconds: neither the name of their column nor time_unit gives their unit."
        )
    if not timing.even:
        # the log does not give the length of the first interval
        samples = part(samples, float(samples.time[1]), None, str(log))
        timing = clock(samples, str(log))
        remarks.append(
            f"The times are uneven by up to {100.0 * timing.unevenness:.3g} % of an interval. Averages run between the "
            "samples nearest to their ends, and averages over a few samples are unreliable. If only the time stamps "
            "are uneven, not the sampling, give rate_hz instead of the time column."
        )
    remarks += _not_gravity(samples)
    noises = []
    for i, channel in enumerate(wanted):
        name = channel.name
        increments = even_increments(samples, channel, timing)
        tell(f"Noise terms of {name}", (i + 0.2) / len(wanted))
        if is_constant(increments) and not channels:
            remarks.append(f"{name} is left out: it is constant.")
            continue
        try:
            fit = fit_noise(increments, timing.interval, correlation_time)
        except InputError as error:
            raise InputError(f"{log}, {name}: {error}") from error
        tell(f"Allan deviation of {name}", (i + 0.5) / len(wanted))
        deviation = allan_deviation(increments, timing.interval)
        freedom = degrees_of_freedom(deviation.count, deviation.interval, deviation.samples, fit.terms, fit.likely["R"])
        band = confidence_band(deviation.deviation, freedom)
        spike = spike_of(increments, samples.time)
        noises.append(ChannelNoise(channel, deviation, freedom, *band, fit, spike))
    if not noises:
        raise InputError(f"{log}: all channels are constant; there is no noise to identify.")
    tell("", 1.0)
    return NoiseReport(str(log), samples, timing.interval, tuple(noises), (*samples.notes, *remarks))


def _samples(log: Path, columns: Path | None, triads: Sequence[TriadName] | None, others: Sequence[str]) -> Samples:
    """Return the samples of a log, of a run's measured stream, or of the recorded unit of a scenario."""
    if log.suffix == ".toml":
        return _of_scenario(log, columns, others)
    path = log / "streams" / "imu_measured.parquet" if log.is_dir() else log
    if log.is_dir() and not path.is_file():
        raise InputError(
            f"{log} is not a run directory: it has no {path.relative_to(log)}. A log ends in {', '.join(SUFFIXES)}; "
            "a scenario with [log] in .toml."
        )
    return read_samples(path, columns, triads, others)


def _of_scenario(path: Path, columns: Path | None, others: Sequence[str]) -> Samples:
    """Return the increments of the inertial unit that a scenario with [log] describes, in the run's time."""
    from sinssim.logs.recorded_log import recorded_log
    from sinssim.scenario.load import load_scenario

    if columns is not None:
        raise InputError(f"--columns describes a log; {path} is a scenario, which describes its own log: leave it out.")
    if others:
        raise InputError(
            f"{path}: of a scenario gyros and accelerometers are analysed; for the column {others[0]!r} give the file "
            "itself, and its description with --columns."
        )
    scenario = load_scenario(path)
    if scenario.log is None:
        raise InputError(
            f"{path} is a scenario without [log], so it has no recorded sensors; run it, and give its run directory."
        )
    only = scenario.log.model_copy(
        update={"gnss": None, "others": (), "reference": None, "outages": None, "from_s": None, "to_s": None}
    )
    imu = recorded_log(only, scenario.imu.mounting_deg).imu
    return Samples("increments", imu.time, {"gyro": imu.dtheta, "accel": imu.dvel})


def _not_gravity(samples: Samples) -> Iterator[str]:
    """Yield a remark if the accelerometers do not measure gravity, because the description may be wrong."""
    if "accel" not in samples.triads:
        return
    values = samples.triads["accel"]
    mean = values.mean(axis=0)
    if samples.kind == "increments":
        mean = values.sum(axis=0) / (samples.time[-1] - samples.time[0])
    felt = float(np.linalg.norm(mean))
    if abs(felt - G0) > _AT_REST * G0:
        yield (
            f"The mean specific force is {felt:.4g} m/s²; at rest it would be {G0:.4g} m/s². Unless gravity has "
            "been removed, the log's units, times or kind (increments or rates) are wrong."
        )
