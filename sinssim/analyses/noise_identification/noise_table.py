"""The tables of a log's noise: for each channel its terms with their bands, and remarks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sinssim.analyses.noise_identification.report import ChannelNoise, NoiseReport
from sinssim.analyses.noise_identification.units import NAMES, four_digits, symbol_text
from sinssim.units import DEG_H, MPS_SQRT_H

if TYPE_CHECKING:
    from rich.console import Console


def show(report: NoiseReport, console: Console) -> None:
    """Print the report: one table per channel.

    Args:
        report: the identified noise.
        console: the console to print on.
    """
    from rich.table import Table

    rate = 1.0 / report.interval
    console.print(f"{report.source}: {report.duration:g} s, {report.count} samples at {rate:.6g} Hz", markup=False)
    for remark in report.remarks:
        console.print(remark, markup=False)
    for channel in report.channels:
        unit, size = channel.units.rate
        lowest, tau = channel.lowest
        table = Table(
            title=f"{channel.name}: mean {four_digits(channel.fit.mean / size)} {unit}, lowest Allan deviation "
            f"{four_digits(lowest / size)} {unit} at {tau:.3g} s",
            title_justify="left",
        )
        table.add_column("")
        table.add_column("")
        table.add_column("value", justify="right")
        table.add_column("95 % band", justify="right")
        table.add_column("unit")
        table.add_column("equivalent")
        for symbol in channel.symbols:
            table.add_row(*_row(channel, symbol))
        console.print(table)
        for remark in channel.remarks():
            console.print(remark, markup=False)


def _row(channel: ChannelNoise, symbol: str) -> tuple[str, ...]:
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
