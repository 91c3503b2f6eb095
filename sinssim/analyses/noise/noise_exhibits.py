"""Exhibits of the noise of a log, and the table [imu] that emulates the unit, as TOML text.

They show the terms with their bands, the Allan deviations, and the samples.

A scenario has one value of each noise for the three axes. It is the root mean square over the axes, so that the three
together have the power of the record; an axis on which a term is not observable counts as zero. A term that no axis
shows is switched off, also where the grade has it, so that the emulated unit has the noise of the record and no other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sinssim.analyses.noise.noise_report import AXES, NAMES, UNITS, ChannelNoise, NoiseReport, four_digits, symbol_text
from sinssim.charts import Axis, Band, Chart, Charts, Line, Mark
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table
from sinssim.logs.imu_samples import TriadName
from sinssim.recording.result import write_directory, write_json, write_shown
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.units import ARCSEC, DEG_H, G0, MPS_SQRT_H, UG, fixed

_WINDOWS = 8192
_SUM_UNIT: dict[TriadName, tuple[str, float]] = {"gyro": ("arcsec", ARCSEC), "accel": ("mm/s", 1e-3)}
_WORDS: dict[TriadName, str] = {"gyro": "angular rate", "accel": "specific force"}
_SUM_WORDS: dict[TriadName, str] = {"gyro": "angle", "accel": "velocity"}
_COLUMNS = (Column("", words=True), Column("", words=True), Column("value"), Column("95 % band"),
            Column("unit", words=True), Column("equivalent", words=True))  # fmt: skip


def exhibits_of(report: NoiseReport) -> Exhibits:
    """Return what the noise of a log, of at least one channel, has to show."""
    title = f"{report.source}: {report.duration:g} s, {report.count} samples at {1.0 / report.interval:.6g} Hz"
    items: list[Item] = [Sentence(remark) for remark in report.remarks]
    for channel in report.channels:
        unit, size = channel.units.rate
        lowest, tau = channel.lowest
        above = (
            f"{channel.name}: mean {four_digits(channel.fit.mean / size)} {unit}, lowest Allan deviation "
            f"{four_digits(lowest / size)} {unit} at {tau:.3g} s"
        )
        items.append(Table(_COLUMNS, [_row(channel, symbol) for symbol in channel.symbols], above))
        items += [Sentence(remark) for remark in channel.remarks()]
    heading = f"{report.source}: noise at rest"
    items += [Section("Allan deviation", [deviations(report)], on=("page", "recording")),
              Section("The record", [streams(report)], on=("page", "recording"))]  # fmt: skip
    span = (float(report.samples.time[0]), float(report.samples.time[-1]))
    return Exhibits(title, [Sentence(f"{title}.", "lead", on=("page",)), Section("", items)], title, heading, "noise",
                    root="noise", span=span, figure="allan_deviation", pictures=("allan_deviation",))  # fmt: skip


def save_report(report: NoiseReport, exhibits: Exhibits, directory: Path, *, overwrite: bool) -> Path:
    """Write what the noise of a log has to show, and its numbers, noise.json; return the directory."""

    def write(folder: Path) -> None:
        write_json(folder / "noise.json", report.to_json())
        write_shown(exhibits, folder)

    return write_directory(directory, write, overwrite=overwrite)


def deviations(report: NoiseReport) -> Charts:
    """Return the Allan deviations of a log, a chart for each channel."""
    count = len(report.channels)
    columns = min(count, 3)
    charts = [_deviation(channel) for channel in report.channels]
    rows = tuple(tuple(charts[first : first + columns]) for first in range(0, count, columns))
    size = (8.0, 5.6) if count == 1 else (5.4 * columns, 4.6 * len(rows))
    rate = 1.0 / report.interval
    title = f"{report.source}: overlapping Allan deviation, {report.duration:g} s at {rate:.6g} Hz"
    return Charts("allan_deviation", rows, size, title)


def _deviation(channel: ChannelNoise) -> Chart:
    """Return the measured deviations with their band, the fitted sum, and each term."""
    tau, deviation = channel.deviation.tau, channel.deviation.deviation
    marks: list[Mark] = [
        Band(label="95 % band", x=tau, low=channel.low, high=channel.high, color="measured"),
        Line(label="measured", x=tau, y=deviation, color="measured", marker="o"),
        Line(label="sum of terms", x=tau, y=channel.fit.allan_deviation(tau), color="fit", dash="--", counts=False),
    ]
    for symbol in channel.symbols:
        value = channel.fit.estimates[symbol].value
        if value is None:
            continue
        unit, size = channel.units.terms[symbol]
        label = f"{'σ_b' if symbol == 'sigma_b' else symbol} = {four_digits(value / size)} {unit}"
        part = channel.fit.allan_deviation(tau, symbol)
        marks.append(Line(label=label, x=tau, y=part, color=symbol, weight="thin", dash=":", counts=False))
    x = Axis(label="averaging time τ", units=fixed("s"), log=True, low=float(tau[0]), high=float(tau[-1]))
    y = Axis(label="Allan deviation", units=fixed(*channel.units.rate), log=True,
             low=0.4 * float(np.min(channel.low)), high=2.5 * float(np.max(deviation)))  # fmt: skip
    return Chart(key=channel.name, title=channel.channel.title, x=x, y=y, marks=tuple(marks))


def streams(report: NoiseReport) -> Charts:
    """Return means over windows, and the departure of the accumulated angle or velocity from a linear trend."""
    time = report.samples.time
    edges = np.unique(np.linspace(0, len(time) - 1, min(len(time), _WINDOWS + 1)).round().astype(np.intp))
    at, ends = time[edges] - time[0], time[edges[1:]] - time[0]
    minus = f"minus its mean, mean over {float((time[-1] - time[0]) / (len(edges) - 1)):.3g} s"
    charts: list[Chart] = []

    def chart(key: str, title: str, unit: tuple[str, float], x: Array, values: Array, names: list[str]) -> None:
        lines = tuple(Line(label=name, x=x, y=values[:, k]) for k, name in enumerate(names))
        charts.append(Chart(key=key, title=title, y=Axis(units=fixed(*unit)), marks=lines))

    for triad in report.samples.triads:
        axes = [channel_.channel.axis for channel_ in report.channels if channel_.channel.triad == triad]
        if not axes:
            continue
        names = [AXES[axis] for axis in axes]
        sums = _accumulated(report, triad, axes)[edges]
        rates = np.diff(sums, axis=0) / np.diff(time[edges])[:, None]
        chart(f"{triad}/rate", f"{_WORDS[triad]} {minus}", UNITS[triad].rate, ends, rates - rates.mean(axis=0), names)
        trend = (at / at[-1])[:, None] * sums[-1]
        chart(f"{triad}/sum", f"{_SUM_WORDS[triad]} minus a linear trend", _SUM_UNIT[triad], at, sums - trend, names)
    others = [channel_.channel for channel_ in report.channels if channel_.channel.triad is None]
    # entities are numbered, because the name of a column may be invalid as the name of an entity
    for k, channel in enumerate(others, start=1):
        means = np.add.reduceat(report.samples.quantities[channel.name], edges[:-1]) / np.diff(edges)
        values = (means - means.mean())[:, None]
        chart(f"quantity_{k}", f"{channel.name} {minus}", (channel.units.rate[0], 1.0), ends, values, [channel.name])
    rows = tuple((row,) for row in charts)
    return Charts("streams", rows, (11.0, 2.5 * len(rows)))


def _accumulated(report: NoiseReport, triad: TriadName, axes: list[int]) -> Array:
    """Return the accumulated angle or velocity of some axes at the edges of the intervals, (N+1, k)."""
    samples = report.samples
    values = samples.triads[triad][:, axes]
    increments = values if samples.kind == "increments" else values * np.diff(samples.time)[:, None]
    return np.concatenate([np.zeros((1, len(axes))), np.cumsum(increments, axis=0)])


def _row(channel: ChannelNoise, symbol: str) -> tuple[str, ...]:
    """Return the cells of a term: name, value, band, unit, the value in another form."""
    estimate = channel.fit.estimates[symbol]
    unit, size = channel.units.terms[symbol]
    if estimate.value is None:
        limit = four_digits(max(abs(estimate.low), abs(estimate.high)) / size)
        value, band, also = "not observable", f"< {limit}", _tau_b(channel) if symbol == "sigma_b" else ""
    else:
        value, band = (
            four_digits(estimate.value / size),
            f"{four_digits(estimate.low / size)} … {four_digits(estimate.high / size)}",
        )
        also = _also(channel, symbol, estimate.value)
    return symbol_text(symbol), NAMES[symbol], value, band, unit, also


def _also(channel: ChannelNoise, symbol: str, value: float) -> str:
    """Return the value in another form that data sheets use."""
    unit, size = channel.units.terms[symbol]
    triad = channel.channel.triad
    match symbol:
        case "Q" if triad is not None:
            return f"pulse of {four_digits(math.sqrt(12.0) * value / size)} {unit}"
        case "N" if triad == "gyro":
            return f"{four_digits(value / DEG_H)} deg/h/√Hz"
        case "N" if triad is None:
            return f"{four_digits(value / math.sqrt(channel.fit.interval))} {channel.units.rate[0]} (1σ) of a sample"
        case "N":
            return f"{four_digits(value / MPS_SQRT_H)} m/s/√h"
        case "B":
            return f"Allan deviation of {four_digits(math.sqrt(2.0 * math.log(2.0) / math.pi) * value / size)} {unit}"
        case "sigma_b":
            return _tau_b(channel)
    return ""


def _tau_b(channel: ChannelNoise) -> str:
    band = channel.fit.correlation_band
    known = f" ({band[0]:.3g} … {band[1]:.3g})" if band is not None else ""
    return f"τ_b = {channel.fit.correlation_time:.4g} s{known}"


_KEYS: dict[TriadName, dict[str, str]] = {
    "gyro": {
        "Q": "gyro_quantum_arcsec",
        "N": "gyro_arw_deg_sqrt_h",
        "B": "gyro_flicker_deg_h",
        "K": "gyro_rrw_deg_h_sqrt_h",
        "sigma_b": "gyro_instability_deg_h",
    },
    "accel": {
        "Q": "accel_quantum_mm_s",
        "N": "accel_vrw_ug_sqrt_hz",
        "B": "accel_flicker_ug",
        "K": "accel_rrw_ug_sqrt_h",
        "sigma_b": "accel_instability_ug",
    },
}
_RAMP: dict[TriadName, str] = {"gyro": "gyro_ramp_deg_h_per_h", "accel": "accel_ramp_ug_per_h"}
_PULSE = math.sqrt(12.0)  # width of a pulse over the standard deviation Q of its rounding
_EARTH_RATE = 15.041 * DEG_H
_CLEAR = 3.0  # a mean rate is taken for a bias if it exceeds the Earth's by this factor


@dataclass(frozen=True)
class ImuLine:
    """One line of the table."""

    key: str  # of the scenario
    value: float | str | tuple[float, ...]  # a number, a text, or one number for each axis
    why: str  # where it comes from

    def __str__(self) -> str:
        """Return the line of the file."""
        value = self.value
        if isinstance(value, str):
            text = f'"{value}"'
        elif isinstance(value, tuple):
            text = f"[{', '.join(f'{v:.4g}' for v in value)}]"
        else:
            text = f"{value:.4g}"
        return f"{self.key} = {text}" + (f"  # {self.why}" if self.why else "")


def imu_block(report: NoiseReport) -> tuple[ImuLine, ...]:
    """Return the lines of [imu] that emulate the unit of a record: grade, rate, and every noise term of its triads."""
    by_triad: dict[TriadName, list[ChannelNoise]] = {}
    for channel in report.channels:
        if channel.channel.triad is not None:
            by_triad.setdefault(channel.channel.triad, []).append(channel)
    if not by_triad:
        raise InputError(f"{report.source}: no gyro or accelerometer was analysed, so there is nothing for [imu].")
    lines = [
        ImuLine("grade", _grade(by_triad), "nearest in noise; scale factors and misalignments are the grade's"),
        ImuLine("rate_hz", float(f"{1.0 / report.interval:.6g}"), ""),
    ]
    for triad, channels in by_triad.items():
        lines += [*_bias(triad, channels), *_noise(triad, channels)]
    return tuple(lines)


def block_text(report: NoiseReport) -> str:
    """Return the table [imu] of `imu_block` as text of a scenario file."""
    lines = [
        "[imu]",
        f"# noise of {report.source}: {report.duration:.4g} s at {1.0 / report.interval:.4g} Hz; the root mean square "
        "of the axes",
        *map(str, imu_block(report)),
    ]
    for channel in report.channels:
        if channel.channel.triad is None:
            continue
        for low, high in channel.fit.aside:
            lines.append(f"# not included: {channel.name} from {low:.3g} to {high:.3g} Hz, vibration or a resonance")
        if not channel.described:
            lines.append(
                f"# doubtful: these terms do not describe {channel.name} (its spectrum departs by "
                f"{100.0 * channel.fit.misfit:.0f} % rms): the unit moved or shook"
            )
    return "\n".join(lines) + "\n"


def _grade(by_triad: dict[TriadName, list[ChannelNoise]]) -> str:
    """Return the grade with the nearest random walk of the gyros, or of the accelerometers without gyros."""
    triad: TriadName = "gyro" if "gyro" in by_triad else "accel"
    noise = max(_rms([c.fit.likely["N"] for c in by_triad[triad]]), 1e-15)
    walks = {name: getattr(grade, triad).random_walk for name, grade in GRADE_TABLE.items()}
    able = {name: walk for name, walk in walks.items() if walk > 0.0}
    return min(able, key=lambda name: abs(math.log(able[name] / noise)))


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _bias(triad: TriadName, channels: list[ChannelNoise]) -> Iterator[ImuLine]:
    """Yield the 1σ of the constant biases, where the means at rest show them."""
    if len(channels) < 3:
        return
    mean = np.array([channel.fit.mean for channel in channels])
    size = float(np.linalg.norm(mean))
    if triad == "gyro":
        if size > _CLEAR * _EARTH_RATE:
            yield ImuLine(
                "gyro_bias_sigma_deg_h",
                size / math.sqrt(3.0) / DEG_H,
                f"the means {', '.join(f'{m / DEG_H:.4g}' for m in mean)} deg/h exceed the Earth's rate of 15.04",
            )
        return
    departs = abs(size - G0)
    if 0.004 * G0 < departs < 0.05 * G0:  # gravity itself differs from G0 by up to 0.3 %
        yield ImuLine(
            "accel_bias_sigma_ug", departs / UG, f"the magnitude of the means, {size:.5g} m/s², is not gravity's"
        )


def _noise(triad: TriadName, channels: list[ChannelNoise]) -> Iterator[ImuLine]:
    """Yield the lines of the noise terms of one triad."""
    for symbol, key in _KEYS[triad].items():
        fitted = [channel for channel in channels if symbol in channel.fit.estimates]
        size = UNITS[triad].terms[symbol][1] / (_PULSE if symbol == "Q" else 1.0)
        values = [
            0.0 if symbol not in channel.fit.estimates else (channel.fit.estimates[symbol].value or 0.0) / size
            for channel in channels
        ]
        if not any(values):
            if fitted or symbol == "sigma_b":
                yield ImuLine(key, 0.0, _unseen(symbol, fitted, size))
            continue
        each = ", ".join(
            f"{channel.name[-1]} {four_digits(value)}" if value else f"{channel.name[-1]} not observable"
            for channel, value in zip(channels, values, strict=True)
        )
        yield ImuLine(key, _rms(values), f"{symbol_text(symbol)}, {NAMES[symbol]}: {each}")
        if symbol == "sigma_b":
            largest = max(fitted, key=lambda c: c.fit.estimates["sigma_b"].value or 0.0)
            yield ImuLine(
                f"{triad}_correlation_time_s", float(largest.fit.correlation_time or 0.0), f"τ_b of {largest.name}"
            )
    yield from _ramp(triad, channels)


def _unseen(symbol: str, channels: list[ChannelNoise], size: float) -> str:
    """Return why a term is switched off."""
    what = f"{symbol_text(symbol)}, {NAMES[symbol]}: not observable"
    if not channels:
        return what
    most = max(max(abs(c.fit.estimates[symbol].low), abs(c.fit.estimates[symbol].high)) for c in channels)
    return f"{what}; below {four_digits(most / size)}"


def _ramp(triad: TriadName, channels: list[ChannelNoise]) -> Iterator[ImuLine]:
    """Yield the ramps of the three axes, if one of them is observable."""
    size = UNITS[triad].terms["R"][1]
    ramps = [0.0, 0.0, 0.0]
    for channel in channels:
        ramps[channel.channel.axis] = (channel.fit.estimates["R"].value or 0.0) / size
    if any(ramps):
        yield ImuLine(_RAMP[triad], tuple(ramps), f"R, {NAMES['R']}, of x, y, z; 0 where it is not observable")
