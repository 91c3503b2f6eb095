"""Makes measurements for the filter of recorded fixes and of the readings of other sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, Measurements
from sinssim.errors import InputError
from sinssim.logs.log_settings import LogGnss, LogOther, LogReference
from sinssim.logs.recorded_streams import FixStream, OtherStream
from sinssim.sensors.aiding_sensor import AidingReadings

Spans = Sequence[tuple[float, float]]
Mask = NDArray[np.bool_]


_NO_FIX = ("no fix", "none")
"""Words of formats for codes with which a receiver says that it has no position."""
_CLAIM = 0.1
"""1σ of a float fix that is doubted if it is smaller, m: wrong ambiguities are of decimetres."""


def quality_factor(fixes: FixStream, keys: LogGnss | LogReference) -> Array:
    """Return the factor of σ of each fix, NaN for one whose quality is refused, (M,).

    Without factors a fix counts as its own σ says, unless its code says that there is none.
    """
    if keys.quality_factors is None:
        factors = np.ones(len(fixes))
        for number, word in fixes.quality_words.items():
            if fixes.quality is not None and word in _NO_FIX:
                factors[fixes.quality == number] = np.nan
        return factors
    if fixes.quality is None:
        raise InputError(
            f"{keys.file} has no codes of quality, but quality_factors are given: describe the column of the codes "
            "(quality), or remove quality_factors."
        )
    factors = np.full(len(fixes), np.nan)
    for code, factor in keys.quality_factors.items():
        factors[fixes.quality == int(code)] = factor
    return factors


def quality_words(fixes: FixStream, keys: LogGnss | LogReference) -> Iterator[str]:
    """Yield a sentence on the codes of quality of recorded fixes."""
    if fixes.quality is None or not len(fixes):
        return
    codes, counts = np.unique(fixes.quality, return_counts=True)
    factors = keys.quality_factors
    parts = []
    for code, count in zip(codes.tolist(), counts.tolist(), strict=True):
        word = fixes.quality_words.get(code)
        what = f"{count} of quality {code}" + (f" ({word})" if word else "")
        if factors is None:
            what += ", refused" if word in _NO_FIX else ""
        else:
            factor = factors.get(str(code))
            what += ", refused" if factor is None else f", σ times {factor:g}" if factor != 1.0 else ""
        parts.append(what)
    yield f"The quality of the fixes: {'; '.join(parts)}."
    sigma = fixes.position_sigma if keys.position_sigma_m is None else None
    floats = [code for code in codes.tolist() if fixes.quality_words.get(code) == "float"]
    if factors is None and floats and sigma is not None:
        claimed = float(np.nanmedian(sigma[np.isin(fixes.quality, floats)][:, :2]))
        if claimed < _CLAIM:
            codes_text = ", ".join(f'"{code}" = 10.0' for code in floats)
            yield (
                f"Float fixes state {claimed:.2g} m (1σ, median), but float ambiguities may be wrong by decimetres. "
                f"The filter uses the stated 1σ; quality_factors = {{ …, {codes_text} }} would increase it."
            )


def gnss_readings(fixes: FixStream, gnss: LogGnss, outages: Spans) -> list[AidingReadings]:
    """Return recorded fixes as measurements.

    Args:
        fixes: fixes in the run's time, within the run.
        outages: injected outages, s: a fix after the beginning and not after the end is withheld.

    Returns:
        Positions and velocities, as far as the table takes them and the file has them.
    """
    factor = quality_factor(fixes, gnss)
    readings = []
    if "position" in gnss.use:
        sigma = _sigma(
            fixes.position_sigma, gnss.position_sigma_m, len(fixes), gnss.file, "position_sigma_m = [2, 2, 4]"
        )
        sigma = np.maximum(sigma * gnss.sigma_factor, max(gnss.least_sigma_m, 1e-9)) * factor[:, None]
        value = np.column_stack((fixes.latitude, fixes.longitude, fixes.height))
        correlation = None if gnss.position_sigma_m is not None else _correlation(fixes.covariance)
        readings.append(_readings("gnss-position", fixes.time, value, sigma, gnss, outages, correlation))
    if "velocity" in gnss.use and fixes.velocity_ned is not None:
        sigma = _sigma(
            fixes.velocity_sigma, gnss.velocity_sigma_mps, len(fixes), gnss.file,
            "velocity_sigma_mps = [0.1, 0.1, 0.2]",
        )  # fmt: skip
        least = max(gnss.least_velocity_sigma_mps, 1e-9)
        sigma = np.maximum(sigma * gnss.velocity_sigma_factor, least) * factor[:, None]
        time, velocity = fixes.time - gnss.velocity_delay_s, fixes.velocity_ned
        level = np.isfinite(velocity[:, :2]).all(axis=1) & ~np.isfinite(velocity[:, 2])
        if level.any():  # speed and course
            velocity = np.where(level[:, None] & ~np.isfinite(velocity), 0.0, velocity)
            sigma = np.where(level[:, None] * np.array((False, False, True)), _UNKNOWN_CLIMB, sigma)
        readings.append(_readings("gnss-velocity", time, velocity, sigma, gnss, outages))
    if not readings:
        raise InputError(f"{gnss.file} has no velocities, and use = {list(gnss.use)} takes nothing else.")
    return readings


def _sigma(of_file: Array | None, given: tuple[float, float, float] | None, count: int, file: str, key: str) -> Array:
    if given is not None:
        return np.tile(given, (count, 1))
    if of_file is None:
        raise InputError(f"{file} gives no 1σ for this: state it, for example {key}.")
    return of_file


_UNKNOWN_CLIMB = 100.0
"""1σ of a vertical velocity that a receiver does not give, m/s: the reading then says nothing of it."""
_MOST = 0.999
"""Largest correlation that is believed: the last digits of a file's numbers make larger ones."""


def _correlation(covariance: Array | None) -> Array | None:
    """Return the correlations of covariances, (M, 3, 3); those of a fix without a covariance are zero."""
    if covariance is None:
        return None
    variance = np.einsum("mii->mi", covariance)
    known = np.isfinite(covariance).all(axis=(1, 2)) & (variance > 0.0).all(axis=1)
    correlation = np.tile(np.eye(3), (len(covariance), 1, 1))
    sigma = np.sqrt(variance[known])
    known_part = np.clip(covariance[known] / (sigma[:, :, None] * sigma[:, None, :]), -_MOST, _MOST)
    known_part[:, range(3), range(3)] = 1.0
    known_part = 0.5 * (known_part + np.swapaxes(known_part, 1, 2))
    sound = np.linalg.eigvalsh(known_part).min(axis=1) > 1.0 - _MOST if len(known_part) else np.zeros(0, dtype=bool)
    correlation[np.flatnonzero(known)[sound]] = known_part[sound]
    return correlation


def _readings(
    kind: str,
    time: Array,
    value: Array,
    sigma: Array,
    gnss: LogGnss,
    outages: Spans,
    correlation: Array | None = None,
) -> AidingReadings:
    sound = np.isfinite(value).all(axis=1) & np.isfinite(sigma).all(axis=1)
    time, value, sigma = time[sound], value[sound], sigma[sound]
    used = ~withheld(time, outages)
    if correlation is not None:
        correlation = np.ascontiguousarray(correlation[sound][used])
    arrival = time + gnss.latency_s + (gnss.velocity_delay_s if kind == "gnss-velocity" else 0.0)
    arm = np.array(gnss.lever_arm_m)
    given = Measurements(
        kind, time[used], np.maximum(arrival, time)[used], value[used], np.ascontiguousarray(sigma[used]), arm, kind,
        correlation,
    )  # fmt: skip
    return AidingReadings(given, time, {})


def withheld(time: Array, outages: Spans) -> Mask:
    """Return which instants lie in an outage: after its beginning, and not after its end, (M,)."""
    inside = np.zeros(len(time), dtype=bool)
    for begin, end in outages:
        inside |= (time > begin) & (time <= end)
    return inside


def other_readings(stream: OtherStream, sensor: LogOther) -> AidingReadings:
    """Return the readings of another sensor as measurements, in the run's time."""
    assert stream.sigma is not None  # a sensor describes it
    sound = np.isfinite(stream.value).all(axis=1) & np.isfinite(stream.sigma).all(axis=1)
    time = stream.time[sound]
    given = Measurements(
        sensor.kind, time, time, stream.value[sound], stream.sigma[sound], np.array(sensor.lever_arm_m), sensor.name
    )
    return AidingReadings(given, time, {})
