"""What a log says about the noise of its sensors: every channel's Allan deviation and noise terms, in datasheet units.

The numbers are those that a scenario's [imu] takes: what is identified from a real sensor can be emulated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.sensors.allan import AllanDeviation, allan_deviation, confidence_band, degrees_of_freedom
from sinssim.sensors.channels import channel_name, chosen_channels, clock, even_increments, part
from sinssim.sensors.log import SUFFIXES, Samples, TriadName, read_samples
from sinssim.sensors.noise_fit import NoiseFit, fit_noise, is_constant
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, MPS_SQRT_H, UG

if TYPE_CHECKING:
    from rich.console import Console

SYMBOLS = ("Q", "N", "B", "K", "R", "sigma_b")
"""Noise terms in the order in which they are shown."""
NAMES: dict[str, str] = {
    "Q": "quantisation",
    "N": "random walk",
    "B": "bias instability, flicker",
    "K": "rate random walk",
    "R": "rate ramp",
    "sigma_b": "Gauss-Markov bias, 1σ",
}
"""Noise terms in words."""
RATE_UNIT: dict[TriadName, tuple[str, float]] = {"gyro": ("deg/h", DEG_H), "accel": ("µg", UG)}
"""Unit of rates, and its size in SI."""

_HOUR = 3600.0
UNITS: dict[TriadName, dict[str, tuple[str, float]]] = {
    "gyro": {
        "Q": ("arcsec", ARCSEC),
        "N": ("deg/√h", DEG_SQRT_H),
        "B": ("deg/h", DEG_H),
        "K": ("deg/h/√h", DEG_H / math.sqrt(_HOUR)),
        "R": ("deg/h/h", DEG_H / _HOUR),
        "sigma_b": ("deg/h", DEG_H),
    },
    "accel": {
        "Q": ("mm/s", 1e-3),
        "N": ("µg/√Hz", UG),
        "B": ("µg", UG),
        "K": ("µg/√h", UG / math.sqrt(_HOUR)),
        "R": ("µg/h", UG / _HOUR),
        "sigma_b": ("µg", UG),
    },
}
"""Unit of each term, and its size in SI."""
_SHORT = {"deg/h": "deg_h", "µg": "ug"}


@dataclass(frozen=True)
class ChannelNoise:
    """One channel's noise.

    Attributes:
        triad: "gyro" or "accel".
        axis: 0, 1 or 2: forward, right, down.
        deviation: its Allan deviation.
        freedom: equivalent degrees of freedom of each Allan variance, (M,).
        low, high: 95 % band of the Allan deviation, (M,) rad/s or m/s².
        fit: its noise terms.
    """

    triad: TriadName
    axis: int
    deviation: AllanDeviation
    freedom: Array
    low: Array
    high: Array
    fit: NoiseFit

    @property
    def name(self) -> str:
        """For example gyro_x."""
        return channel_name(self.triad, self.axis)

    @property
    def lowest(self) -> tuple[float, float]:
        """Lowest Allan deviation, what data sheets call in-run bias stability, rad/s or m/s², and its τ, s.

        The lowest of what is sure: where the band's upper end is lowest.
        """
        i = int(np.argmin(self.high))
        return float(self.deviation.deviation[i]), float(self.deviation.tau[i])

    def remarks(self) -> Iterator[str]:
        """Say what the numbers alone do not."""
        fit = self.fit
        if fit.exchangeable:
            yield (
                f"{_listed(fit.exchangeable)} described the record best, but zero is in the band: another term that "
                "is not seen could stand in."
            )
        if fit.possible is not None:
            sigma, time = fit.possible
            unit, size = RATE_UNIT[self.triad]
            yield (
                f"A Gauss-Markov bias of σ_b = {number(sigma / size)} {unit} and τ_b = {time:.3g} s may be behind "
                "this; the record does not decide. If it is known, give its --correlation-time."
            )
        pulse = math.sqrt(12.0) * fit.likely["Q"]
        if fit.likely["N"] * math.sqrt(fit.interval) < 0.5 * pulse:
            moved = fit.likely["N"] * math.sqrt(fit.interval) / pulse
            yield (
                f"Between samples the random walk moves the output by {moved:.2g} pulses only. Unless the sensor moves "
                "by more (dither does), rounding errors follow one another and are no white noise: Q, and with it N, "
                "is then not to be trusted."
            )
        for low, high in fit.aside:
            yield (
                f"{low:.4g} to {high:.4g} Hz (τ near {0.5 / math.sqrt(low * high):.3g} s) is none of these terms and "
                "was left out: vibration, a filter, a resonance."
            )
        if fit.misfit > 0.5:
            yield (
                "These terms do not describe this record: bands of its spectrum depart from them by "
                f"{100.0 * fit.misfit:.0f} % rms. Take a part in which the sensor stood still (--from, --to)."
            )
        elif fit.misfit > 0.0:
            yield (
                f"These terms describe the spectrum to {100.0 * fit.misfit:.2g} % only; the bands of the terms allow "
                "for that. Did the sensor stand still, at one temperature?"
            )

    def to_json(self) -> dict[str, Any]:
        """Return plain numbers with their units."""
        unit, size = RATE_UNIT[self.triad]
        key = _SHORT[unit]
        terms: dict[str, Any] = {}
        for symbol, estimate in _shown(self.fit):
            term_unit, term_size = UNITS[self.triad][symbol]
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
            f"mean_{key}": self.fit.mean / size,
            "terms": terms,
            "correlation_time_s": self.fit.correlation_time,
            "correlation_time_band_s": self.fit.correlation_band,
            f"lowest_allan_deviation_{key}": lowest / size,
            "lowest_allan_deviation_tau_s": tau,
            "misfit": self.fit.misfit,
            "left_out_hz": self.fit.aside,
            "remarks": list(self.remarks()),
            "allan": {
                "tau_s": self.deviation.tau.tolist(),
                f"deviation_{key}": (self.deviation.deviation / size).tolist(),
                f"low_{key}": (self.low / size).tolist(),
                f"high_{key}": (self.high / size).tolist(),
                "degrees_of_freedom": [nu if math.isfinite(nu) else None for nu in self.freedom.tolist()],
                f"fit_{key}": (self.fit.allan_deviation(self.deviation.tau) / size).tolist(),
            },
        }


@dataclass(frozen=True)
class NoiseReport:
    """The noise of a log's channels.

    Attributes:
        source: what was looked at.
        samples: its samples.
        interval: T, s.
        channels: in the order of `sinssim.sensors.channels.CHANNELS`.
        remarks: sentences on the log as a whole.
    """

    source: str
    samples: Samples
    interval: float
    channels: tuple[ChannelNoise, ...]
    remarks: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return float(self.samples.time[-1] - self.samples.time[0])

    @property
    def count(self) -> int:
        """Number of samples."""
        return len(self.samples.time) - 1

    def to_json(self) -> dict[str, Any]:
        """Return plain numbers with their units in the names; what is not observable is None."""
        return {
            "source": self.source,
            "duration_s": self.duration,
            "samples": self.count,
            "interval_s": self.interval,
            "remarks": list(self.remarks),
            "channels": {channel.name: channel.to_json() for channel in self.channels},
        }

    def show(self, console: Console) -> None:
        """Print the report: one table a channel.

        Args:
            console: where.
        """
        from rich.table import Table

        console.print(
            f"{self.source}: {self.duration:g} s, {self.count} samples at {1.0 / self.interval:.6g} Hz", markup=False
        )
        for remark in self.remarks:
            console.print(remark, markup=False)
        for channel in self.channels:
            unit, size = RATE_UNIT[channel.triad]
            lowest, tau = channel.lowest
            table = Table(
                title=f"{channel.name}: mean {number(channel.fit.mean / size)} {unit}, lowest Allan deviation "
                f"{number(lowest / size)} {unit} at {tau:.3g} s",
                title_justify="left",
            )
            table.add_column("")
            table.add_column("")
            table.add_column("value", justify="right")
            table.add_column("95 % band", justify="right")
            table.add_column("unit")
            table.add_column("that is")
            for symbol, _ in _shown(channel.fit):
                table.add_row(*_row(channel, symbol))
            console.print(table)
            for remark in channel.remarks():
                console.print(remark, markup=False)


def number(value: float) -> str:
    """Write a number with four significant digits, and no exponent where a person can do without.

    Args:
        value: any.

    Returns:
        For example "0.1500", "1234", "2.100e-06".
    """
    if value == 0.0:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.3e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(abs(value))))}f}"


def _shown(fit: NoiseFit) -> list[tuple[str, Any]]:
    return [(symbol, fit.estimates[symbol]) for symbol in SYMBOLS if symbol in fit.estimates]


def _row(channel: ChannelNoise, symbol: str) -> tuple[str, ...]:
    estimate = channel.fit.estimates[symbol]
    unit, size = UNITS[channel.triad][symbol]
    low, high = estimate.low / size, estimate.high / size
    label = "σ_b" if symbol == "sigma_b" else symbol
    if estimate.value is None:
        limit = f"< {number(max(abs(low), abs(high)))}"
        return label, NAMES[symbol], "not observable", limit, unit, _tau_b(channel) if symbol == "sigma_b" else ""
    band = f"{number(low)} … {number(high)}"
    return label, NAMES[symbol], number(estimate.value / size), band, unit, _also(channel, symbol, estimate.value)


def _also(channel: ChannelNoise, symbol: str, value: float) -> str:
    """Return the same in other words that data sheets use."""
    unit, size = UNITS[channel.triad][symbol]
    match symbol:
        case "Q":
            return f"a pulse of {number(math.sqrt(12.0) * value / size)} {unit}"
        case "N" if channel.triad == "gyro":
            return f"{number(value / DEG_H)} deg/h/√Hz"
        case "N":
            return f"{number(value / MPS_SQRT_H)} m/s/√h"
        case "B":
            return f"an Allan deviation of {number(math.sqrt(2.0 * math.log(2.0) / math.pi) * value / size)} {unit}"
        case "sigma_b":
            return _tau_b(channel)
    return ""


def _tau_b(channel: ChannelNoise) -> str:
    band = channel.fit.correlation_band
    known = f" ({band[0]:.3g} … {band[1]:.3g})" if band is not None else ""
    return f"τ_b = {channel.fit.correlation_time:.4g} s{known}"


def _listed(symbols: Sequence[str]) -> str:
    return " and ".join("σ_b" if symbol == "sigma_b" else symbol for symbol in symbols)


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
    """Identify the noise of a log's channels.

    Args:
        log: a log of a sensor block that stood still (`sinssim.sensors.log.SUFFIXES`), or a run directory, whose
            measured stream is taken.
        columns: TOML file that names a log's columns, units and axes.
        channels: as `chosen_channels`.
        start, end: part of the log to use, on its own time, s.
        correlation_time: τ_b, as `fit_noise`, s.
        progress: is told what is done, and how much of the whole is done, 0 to 1.

    Returns:
        The report.

    Raises:
        InputError: a log that cannot be read or has gaps, a channel that there is not, too few samples, or no channel
            that is not constant.
    """
    wanted = chosen_channels(channels)
    triads = list(dict.fromkeys(triad for triad, _ in wanted))
    path = log / "streams" / "imu_measured.parquet" if log.is_dir() else log
    if log.is_dir() and not path.is_file():
        raise InputError(f"{log} is no run directory: it has no {path.relative_to(log)}. Logs: {', '.join(SUFFIXES)}.")

    def tell(what: str, fraction: float) -> None:
        if progress is not None:
            progress(what, fraction)

    tell(f"Reading {path.name}", 0.0)
    samples = part(read_samples(path, columns, triads), start, end, str(log))
    timing = clock(samples, str(log))
    remarks = []
    if not timing.even:
        # how long the first interval was, the log does not say
        samples = part(samples, float(samples.time[1]), None, str(log))
        timing = clock(samples, str(log))
        remarks.append(
            f"The times are uneven by up to {100.0 * timing.unevenness:.3g} % of an interval: averages run between the "
            "samples nearest to their ends, and those over a few samples tell little. If only the time stamps are "
            "uneven, not the sampling, give rate_hz in place of the time column."
        )
    found = []
    for i, (triad, axis) in enumerate(wanted):
        name = channel_name(triad, axis)
        increments = even_increments(samples, triad, axis, timing)
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
        found.append(ChannelNoise(triad, axis, deviation, freedom, *confidence_band(deviation.deviation, freedom), fit))
    if not found:
        raise InputError(f"{log}: all channels are constant; there is no noise to identify.")
    tell("", 1.0)
    return NoiseReport(str(log), samples, timing.interval, tuple(found), tuple(remarks))
