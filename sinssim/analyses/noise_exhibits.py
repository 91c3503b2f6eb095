"""Exhibits of the noise of a log: the terms with their bands, the Allan deviations, and the samples."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from sinssim.analyses.noise_report import AXES, NAMES, UNITS, ChannelNoise, NoiseReport, four_digits, symbol_text
from sinssim.charts import Axis, Band, Chart, Charts, Line, Mark
from sinssim.data import Array
from sinssim.exhibits import Column, Exhibits, Item, Section, Sentence, Table
from sinssim.logs.imu_samples import TriadName
from sinssim.recording.result import write_directory, write_json, write_shown
from sinssim.units import ARCSEC, DEG_H, MPS_SQRT_H, fixed

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
