"""Loads what a [log] table describes: increments, measurements for the filter and a reference, all in the run's time.

The run's time is the inertial unit's: 0 is its first row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, ImuData, Measurements
from sinssim.errors import InputError
from sinssim.logs.gps_time import FileClock, Instant, date_of, file_clock, gps_instant, offset
from sinssim.logs.imu_samples import WITHOUT_GRAVITY, without_gravity
from sinssim.logs.log_files import fix_stream, inertial_stream, other_stream, solution_stream
from sinssim.logs.log_settings import Log, LogFile, LogGnss, LogImu, LogOther, LogReference
from sinssim.logs.recorded_streams import (
    NO_FIX,
    Clock,
    FixStream,
    InertialStream,
    OtherStream,
    SolutionStream,
    bridge_noise,
    gap_words,
    geoid_height,
    made_increments,
)
from sinssim.logs.reference_solution import Reference
from sinssim.sensors.aiding_sensor import AidingReadings
from sinssim.sensors.vibration_noise import AddedNoise
from sinssim.toml_section import Vector3
from sinssim.units import G0

Spans = Sequence[tuple[float, float]]
Mask = NDArray[np.bool_]


_CLAIM = 0.1
"""1σ of a float fix that is doubted if it is smaller, m: wrong ambiguities are of decimetres."""


def quality_factor(fixes: FixStream, keys: LogGnss | LogReference) -> Array:
    """Return the factor of σ of each fix, NaN for one whose quality is refused, (M,).

    Without factors a fix counts as its own σ says, unless its code says that there is none.
    """
    if keys.quality_factors is None:
        return np.where(fixes.has_fix, 1.0, np.nan)
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
            what += ", refused" if word in NO_FIX else ""
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
    """Return positions and velocities as measurements, as far as the table takes them and the fixes, in the run's time
    and within the run, have them. A fix after the beginning and not after the end of an injected outage, s, is
    withheld."""
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


Rows = NDArray[np.intp]

_FORCE = (0.7, 1.5)
"""Median of the specific force of any vehicle, in units of gravity."""
_MARGIN = 5.0
"""Rows of a reference that are kept before and after the run, s, so that it is interpolated up to the run's ends."""


@dataclass(frozen=True)
class RecordedLog:
    """Recorded sensors on one clock.

    Attributes:
        imu: increments of the sensor block, forward-right-down.
        rate_hz: its usual samples per second.
        sensed: measurements for the filter.
        fixes: all fixes of the satellites within the run, outages included; None without a receiver.
        reference: what solutions are compared with; None if there is none.
        outages: injected outages, s.
        passes: injected outages of each further pass of the filter, s.
        zero: GPS time of the run's time 0; None if the clocks have no date.
        notes: sentences on what was found and done.
        bridged: noise of the bridged gaps in the inertial data; None without gaps.
        axes: directions of the unit's axes in its file; None if the table [log.imu] says it all.
    """

    imu: ImuData
    rate_hz: float
    sensed: tuple[AidingReadings, ...]
    fixes: FixStream | None
    reference: Reference | None
    outages: tuple[tuple[float, float], ...]
    passes: tuple[tuple[tuple[float, float], ...], ...]
    zero: Instant | None
    notes: tuple[str, ...]
    bridged: AddedNoise | None = None
    axes: tuple[str, str, str] | None = None

    @property
    def rates(self) -> dict[str, float]:
        """Readings per second of each sensor on average, by its name."""
        lasts = float(self.imu.time[-1] - self.imu.time[0])
        return {sensor.measurements.label: len(sensor.time) / lasts for sensor in self.sensed if len(sensor.time)}


def recorded_log(log: Log, mounting_deg: Vector3 | None = None) -> RecordedLog:
    """Load increments, measurements and reference of recorded sensors, in the run's time. The mounting is roll, pitch
    and yaw of the block's axes in the vehicle's, to which a reference attitude belongs."""
    stream, clock, notes = inertial_stream(log.imu)
    imu_clock = _clock(log.imu, clock, stream.time)
    zero = float(stream.time[0] + log.imu.time_offset_s)
    stream = replace(stream, time=(stream.time - stream.time[0]) / (1.0 + 1e-6 * log.imu.clock_drift_ppm))
    whole = (0.0, float(stream.time[-1]))
    made = made_increments(
        _between(stream, log.from_s, log.to_s, log.imu.file),
        readings=log.imu.readings,
        stamps=log.imu.stamps,
        max_gap=log.imu.max_gap_s,
        source=log.imu.file,
    )
    imu = made.imu
    if log.imu.check_scale:
        _check_scale(imu, log.imu)
    span = (float(imu.time[0]), float(imu.time[-1]))
    outages = () if log.outages is None else log.outages.spans(*span)
    passes = () if log.outages is None else log.outages.passes(*span)
    words_of_log = [*notes, *gap_words(made.gaps), *_clock_words(imu_clock, zero)]
    sensed: list[AidingReadings] = []
    fixes = reference = None
    if log.gnss is not None:
        fixes, words = _fixes(log.gnss, imu_clock, zero, span, whole)
        sensed += gnss_readings(fixes, log.gnss, outages)
        words_of_log += [*words, *quality_words(fixes, log.gnss)]
    for number, other in enumerate(log.others, start=1):
        readings, other_clock, words = other_stream(other)
        words_of_log += words
        at = _run_time(other, f"log.others.{number}", imu_clock, zero, other_clock, readings.time)
        inside = _within(at, span, whole, other.file, f"log.others.{number}")
        sensed.append(
            other_readings(
                replace(
                    readings,
                    time=at[inside],
                    value=readings.value[inside],
                    sigma=None if readings.sigma is None else readings.sigma[inside],
                ),
                other,
            )
        )
    if log.reference is not None:
        reference, words = _reference(log.reference, imu_clock, zero, span, whole, mounting_deg)
        words_of_log += words
    rate = 1.0 / float(np.median(np.diff(imu.time)))
    start = None if imu_clock.zero is None else Instant(imu_clock.zero.seconds, imu_clock.zero.fraction + zero)
    return RecordedLog(
        imu, rate, tuple(sensed), fixes, reference, outages, passes, start, tuple(words_of_log),
        bridge_noise(imu, made.gaps), stream.axes,
    )  # fmt: skip


def _check_scale(imu: ImuData, unit: LogImu) -> None:
    """Raise for a specific force that is not about gravity: a wrong unit, increments taken for rates, no gravity."""
    step = np.diff(imu.time)[:, None]
    every, interval = imu.dvel / step, float(np.median(step))
    force = float(np.median(np.linalg.norm(every, axis=1)))
    low, high = _FORCE
    if without_gravity(every, interval):
        raise InputError(
            f"{unit.file}: the specific force (log.imu.accel) is {force:.4g} m/s² (median), but much less where it "
            f"changes least, which is not gravity. {WITHOUT_GRAVITY} If they contain gravity, set log.imu.check_scale "
            "= false."
        )
    if not low * G0 <= force <= high * G0:
        raise InputError(
            f"{unit.file}: the specific force is {force:.4g} m/s² (median), but at rest and in any usual motion it "
            f"is about {G0:.4g}: a factor of {force / G0:.4g}. Check accel.unit and kind (rates, or increments over "
            f"{interval:.4g} s), or set log.imu.check_scale = false."
        )


def _clock(source: LogFile, clock: Clock, time: Array) -> FileClock:
    row = None if source.first_row is None else gps_instant(source.first_row, source.clock)
    return file_clock(clock, float(time[0]), row)


def _run_time(source: LogFile, name: str, imu_clock: FileClock, zero: float, clock: Clock, time: Array) -> Array:
    """Return the times of another file in the run's time; `zero` is the unit's first stamp with its offset."""
    theirs = _clock(source, clock, time)
    return time + (offset(imu_clock, theirs, name, float(time[0])) + source.time_offset_s - zero)


def _between(stream: InertialStream, begin: float | None, end: float | None, file: str) -> InertialStream:
    first = 0 if begin is None else int(np.searchsorted(stream.time, begin - 1e-9))
    last = len(stream) if end is None else int(np.searchsorted(stream.time, end + 1e-9))
    if last - first < 2:
        raise InputError(
            f"{file}: from_s = {begin or 0.0:g} and to_s = {stream.time[-1] if end is None else end:g} leave "
            f"{max(last - first, 0)} samples; the file covers 0 to {stream.time[-1]:.3f} s."
        )
    return replace(
        stream,
        time=stream.time[first:last],
        gyro=stream.gyro[first:last],
        accel=stream.accel[first:last],
        interval=None if stream.interval is None else stream.interval[first:last],
    )


def _within(
    time: Array, span: tuple[float, float], whole: tuple[float, float], file: str, name: str, margin: float = 0.0
) -> Rows:
    """Return the rows within the run, and within a margin before and after it; raise if there are none."""
    rows = np.flatnonzero((time >= span[0] - margin) & (time <= span[1] + margin))
    if not len(rows):
        raise InputError(
            f"{name}: {file} has no row during the run. In the run's time it covers {time[0]:.3f} to {time[-1]:.3f} s, "
            f"the inertial unit {whole[0]:.3f} to {whole[1]:.3f} s and the run {span[0]:.3f} to {span[1]:.3f} s. Check "
            "clock, first_row and time_offset_s of both files."
        )
    return rows


def _fixes(
    gnss: LogGnss, imu_clock: FileClock, zero: float, span: tuple[float, float], whole: tuple[float, float]
) -> tuple[FixStream, tuple[str, ...]]:
    stream, clock, notes = fix_stream(gnss)
    at = _run_time(gnss, "log.gnss", imu_clock, zero, clock, stream.time)
    rows = _within(at, span, whole, gnss.file, "log.gnss")
    words = list(notes)
    if stream.datum == "mean sea level" and not gnss.geoid_height_m:
        words.append(
            f"{gnss.file} has heights above mean sea level, and geoid_height_m is 0: they are taken for heights "
            f"above the ellipsoid. The geoid of EGM2008 is {geoid_height(stream) or 0.0:.1f} m above it there."
        )
    picked = stream.rows(rows)
    return replace(picked, time=at[rows], height=picked.height + gnss.geoid_height_m), tuple(words)


def _reference(
    source: LogReference,
    imu_clock: FileClock,
    zero: float,
    span: tuple[float, float],
    whole: tuple[float, float],
    mounting_deg: Vector3 | None,
) -> tuple[Reference, tuple[str, ...]]:
    stream, clock, notes = solution_stream(source)
    at = _run_time(source, "log.reference", imu_clock, zero, clock, stream.time)
    rows = _within(at, span, whole, source.file, "log.reference", _MARGIN)
    sound = np.isfinite(stream.latitude) & np.isfinite(stream.longitude) & np.isfinite(stream.height)
    if isinstance(stream, FixStream):
        sound &= np.isfinite(quality_factor(stream, source))
    rows = rows[sound[rows]]
    if not sound.any():
        raise InputError(
            f"log.reference: {source.file} has no positions; attitude alone is only for `sinssim inspect`: "
            "describe latitude, longitude and height, or remove the table."
        )
    rows = rows[np.append(True, np.diff(at[rows]) != 0.0)] if len(rows) else rows  # the first row of each instant
    back = np.diff(at[rows]) < 0.0
    if back.any():
        k = int(rows[int(np.argmax(back)) + 1])
        raise InputError(
            f"log.reference: {source.file}, row {k + 1}: the time {stream.time[k]:.9g} s goes back. Sort the rows, or "
            "remove them."
        )
    if len(rows) < 2:
        raise InputError(f"log.reference: {source.file} has {len(rows)} usable rows during the run; two are needed.")
    q_nb = None
    if isinstance(stream, SolutionStream) and stream.q_nb is not None:
        q_nb = stream.q_nb[rows]
        if mounting_deg is not None:
            q_nb = rotation.multiply(q_nb, rotation.quaternion_from_euler(*np.radians(mounting_deg)))
    sigma = None if stream.position_sigma is None else stream.position_sigma[rows]
    if source.position_sigma_m is not None:
        sigma = np.tile(source.position_sigma_m, (len(rows), 1))
    velocity = None if stream.velocity_ned is None else stream.velocity_ned[rows]
    reference = Reference(
        Path(source.file).name, at[rows], stream.latitude[rows], stream.longitude[rows],
        stream.height[rows] + source.geoid_height_m, velocity, q_nb, sigma, source.lever_arm_m, source.gap_s,
        at[rows] - source.velocity_delay_s if source.velocity_delay_s else None,
    )  # fmt: skip
    return reference, notes


def _clock_words(imu_clock: FileClock, first: float) -> Iterator[str]:
    if imu_clock.zero is not None:
        at = date_of(Instant(imu_clock.zero.seconds, imu_clock.zero.fraction + first))
        yield f"The run's time 0 is {at}, the instant of the inertial unit's first row."
