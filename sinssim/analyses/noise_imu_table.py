"""The table [imu] that emulates a unit whose noise was analysed, as TOML text.

A scenario has one value of each noise for the three axes. It is the root mean square over the axes, so that the three
together have the power of the record; an axis on which a term is not observable counts as zero. A term that no axis
shows is switched off, also where the grade has it, so that the emulated unit has the noise of the record and no other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sinssim.analyses.noise_report import NAMES, UNITS, ChannelNoise, NoiseReport, four_digits, symbol_text
from sinssim.errors import InputError
from sinssim.logs.imu_samples import TriadName
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.units import DEG_H, G0, UG

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
