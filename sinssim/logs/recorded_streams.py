"""What a file of recorded sensors holds, in SI units and on one clock: the common form of every format.

A reader (`sinssim.logs.formats`) changes units and names, and nothing else: it keeps the axes of the unit, and it keeps
readings that are doubtful. What the data are worth is judged afterwards.

Increments over consecutive intervals from recorded rates or increments of an inertial unit: jitter, gaps.

Stamps that jitter, repeat or go back are replaced by even instants; order and count are those of the samples. A loop
follows the stamps: the next sample is expected one interval after the one before, and a stamp moves the expectation by
a small part of its departure. Samples of one stamp are a packet, which is stamped at its end. If it and those after it
come more than half an interval too late, others are missing before it. Numbers of samples times the interval, plus the
mean departure of the stamps over some seconds, which follows a clock that drifts, are the instants.

Instantaneous rates are integrated by the trapezoidal rule between their stamps. Over an interval h the error is h³/12
of the second derivative, so that an oscillation of angular frequency ω is integrated with (ωh)²/12 too little of its
amplitude: 1 % at 5 Hz and 13 % at 18 Hz for 100 samples per second. A mean rate, or an increment, belongs to the
interval that ends at its stamp.

A gap is an interval of more than `GAP` usual ones. It is divided into usual intervals. Rates are interpolated linearly
between both sides of the gap; increments are those of the mean of the rates on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData
from sinssim.errors import InputError, printable
from sinssim.sensors.vibration_noise import AddedNoise

ClockKind = Literal["gps", "utc", "machine"]
HeightDatum = Literal["ellipsoid", "mean sea level", "unknown"]


@dataclass(frozen=True)
class Clock:
    """The clock of a file's times."""

    # "gps" for GPS time; "utc" for UTC, whose leap seconds the reader has removed, so that its times are GPS time, too;
    # "machine" for a clock of the logger, with an unknown offset
    kind: ClockKind
    # GPS time of the time 0 of the file's streams, whole seconds since 1980-01-06 00:00:00 GPST; None if it is unknown:
    # seconds of a week or of a day without the week or the day, or since a machine's start. A machine's clock that
    # gives dates has one, as good as that clock.
    origin_gps_s: int | None = None
    note: str = ""  # one sentence on what the file gives, for example "seconds of the GPS week 2374"


@dataclass(frozen=True)
class InertialStream:
    """Readings of gyros and accelerometers, in the unit's own axes."""

    time: Array  # stamps, (N,) s
    gyro: Array  # (N, 3), rad/s, or rad for increments
    accel: Array  # specific force, which points up at rest, (N, 3), m/s², or m/s for increments
    # whether the numbers are instantaneous (or averaged) rates, or integrals over an interval
    kind: Literal["rates", "increments"] = "rates"
    # lengths of the integration intervals that end at the stamps, (N, 2) s for gyros and accelerometers; None if the
    # file does not give them
    interval: Array | None = None
    # directions of x, y and z if the format defines them, for example ("forward", "right", "down"); None if it leaves
    # them to the user
    axes: tuple[str, str, str] | None = None

    def __len__(self) -> int:
        return len(self.time)


NO_FIX = ("no fix", "none")
"""Words of formats for codes with which a receiver says that it has no position."""


@dataclass(frozen=True)
class FixStream:
    """Fixes of a satellite receiver, at its antenna. A missing number is NaN."""

    time: Array  # instants of validity as the file states them, (M,) s
    # latitude, longitude: (M,) rad
    latitude: Array
    longitude: Array
    height: Array  # (M,) m
    datum: HeightDatum = "unknown"  # what the heights refer to
    position_sigma: Array | None = None  # north, east, down, (M, 3) m; None if not given
    velocity_ned: Array | None = None  # (M, 3) m/s; None if not given
    velocity_sigma: Array | None = None  # (M, 3) m/s; None if not given
    quality: NDArray[np.int64] | None = None  # the receiver's code of quality, (M,); None if not given
    # meaning of each code, for example {1: "fixed", 2: "float"}
    quality_words: dict[int, str] = field(default_factory=dict)
    heading: Array | None = None  # of two antennas, (M,) rad; None if not given
    heading_sigma: Array | None = None  # (M,) rad; None if not given
    covariance: Array | None = None  # whole covariance of north, east, down, (M, 3, 3) m²; None if not given

    def __len__(self) -> int:
        return len(self.time)

    @property
    def has_fix(self) -> NDArray[np.bool_]:
        """Whether the receiver had a fix, by its code of quality, (M,)."""
        without = [code for code, word in self.quality_words.items() if word in NO_FIX]
        return np.ones(len(self), dtype=bool) if self.quality is None else ~np.isin(self.quality, without)

    def rows(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> FixStream:
        """Return some of the fixes, by their numbers or by a mask."""
        arrays: dict[str, Any] = {
            f.name: getattr(self, f.name)[rows] for f in fields(self) if isinstance(getattr(self, f.name), np.ndarray)
        }
        return replace(self, **arrays)

    def as_solution(self) -> SolutionStream:
        """Return the fixes as a solution without attitude."""
        names = {f.name for f in fields(self)} & {f.name for f in fields(SolutionStream)}
        return SolutionStream(**{name: getattr(self, name) for name in names})


@dataclass(frozen=True)
class SolutionStream:
    """A navigation solution of any program: a reference, or a solution to be judged. A missing number is NaN."""

    time: Array  # (M,) s
    # latitude, longitude: (M,) rad
    latitude: Array
    longitude: Array
    height: Array  # (M,) m
    datum: HeightDatum = "unknown"  # what the heights refer to
    velocity_ned: Array | None = None  # (M, 3) m/s; None if not given
    # attitude quaternion, scalar first, v_n = C_nb v_b, body forward-right-down, (M, 4); None if not given
    q_nb: Array | None = None
    position_sigma: Array | None = None  # north, east, down, (M, 3) m; None if not given
    velocity_sigma: Array | None = None  # (M, 3) m/s; None if not given
    attitude_sigma: Array | None = None  # roll, pitch, heading, (M, 3) rad; None if not given
    # position along east, north, up from an origin that the file does not give, (M, 3) m; then latitude, longitude and
    # height are NaN, and velocity and attitude are in the level of that origin. None for a position on the Earth.
    local_enu: Array | None = None

    def __len__(self) -> int:
        return len(self.time)


def geoid_height(stream: FixStream | SolutionStream) -> float | None:
    """Return the height of the geoid above the ellipsoid in the middle of a stream, m; None without a position."""
    from sinssim.earth.gravity_disturbance import geoid_along  # needs the compiler

    known = np.flatnonzero(np.abs(stream.latitude) + 0.0 * stream.longitude <= 0.5 * np.pi)
    if not len(known):
        return None
    k = known[len(known) // 2]
    return float(geoid_along(stream.latitude[k : k + 1], stream.longitude[k : k + 1])[0])


@dataclass(frozen=True)
class OtherStream:
    """Readings of another aiding sensor."""

    name: str  # name in the file, for example "vehicle_air_data"
    kind: str  # kind of measurement of `sinssim.data.Measurements`: "baro-height", "heading", "speed", "airspeed"
    time: Array  # (M,) s
    value: Array  # (M, k), units as in `Measurements`
    sigma: Array | None = None  # (M, k); None if not given

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class Streams:
    """The streams of one file.

    Attributes:
        path: the file.
        format: name of the format, see `sinssim.logs.formats`.
        clock: the clock of all its times.
        inertial: readings of gyros and accelerometers by name; most files have one, named "imu".
        fixes: fixes by name; most files have one, named "gnss".
        solutions: solutions by name; most files have one, named "solution".
        others: readings of other sensors.
        notes: sentences on what the reader found and did, for example rows that it left out.
    """

    path: Path
    format: str
    clock: Clock
    inertial: dict[str, InertialStream] = field(default_factory=dict)
    fixes: dict[str, FixStream] = field(default_factory=dict)
    solutions: dict[str, SolutionStream] = field(default_factory=dict)
    others: tuple[OtherStream, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "notes", tuple(map(printable, self.notes)))


_GAIN = 0.01
"""Part of a departure that the loop takes over: jitter of an interval moves the expectation by a tenth of one."""
_LATE = 0.5
"""Departure in intervals from which a sample is missing."""
_AGREEING = 5
"""Samples or packets that have to be late together, so that jitter of half an interval is taken for a loss once in 1e4
samples."""
_FIRST = 11
"""Samples or packets whose median departure the loop starts from."""
_MEAN_S = 30.0
"""Time over which departures are averaged, s: jitter becomes a fiftieth at 100 samples a second, and the drift of a
quartz is even over it."""
_SHARE = (5.0, 75.0)
"""Percentiles of the times of several samples between which none is missing, unless many are."""


def even_stamps(time: Array) -> tuple[Array, float]:
    """Return even instants of samples: increasing instants, (N,) s, and the interval of the samples, s. `time`: stamps,
    in the order of the samples, (N,) s."""
    interval = _interval(time)
    for _ in range(2):
        number = _numbers(time, interval)
        interval = float(np.polyfit(number, time - time[0], 1)[0])
    departure = time - time[0] - interval * number
    width = 2 * max(int(0.5 * _MEAN_S / interval), 1) + 1
    if len(time) < 2 * width:
        mean = np.full(len(time), departure.mean())
    else:
        from scipy.ndimage import uniform_filter1d

        mean = uniform_filter1d(departure, width, mode="reflect")
    return np.asarray(time[0] + interval * number + mean), interval


def _interval(time: Array) -> float:
    """Return the interval of samples of which some are missing."""
    steps = np.diff(time)
    many = min(10 * math.ceil(1.0 / max(float((steps > 0.0).mean()), 1e-3)), len(steps))
    several = (time[many:] - time[:-many]) / many
    low, high = np.percentile(several, _SHARE)
    interval = float(several[(several >= low) & (several <= high)].mean())
    while (many := 5 * many) < len(steps):  # over more samples, whose number follows from the interval so far
        lasts = time[many:] - time[:-many]
        interval = float(np.median(lasts / np.maximum(np.rint(lasts / interval), 1.0)))
    return interval


def _numbers(time: Array, interval: float) -> Array:
    """Return the numbers of the samples, with those that are missing counted, (N,)."""
    begins = np.flatnonzero(np.append(True, np.diff(time) != 0.0))  # of packets, and of single samples
    sizes = np.diff(np.append(begins, len(time)))
    stamps = ((time[begins] - time[0]) / interval).tolist()
    counted = np.cumsum(sizes).tolist()
    missing = 0
    # by what a stamp exceeds the number of its sample; more than a few at the beginning lack no sample
    shift = float(np.median([a - b for a, b in zip(stamps[:_FIRST], counted[:_FIRST], strict=True)]))
    ends = [counted[0]]
    for k in range(1, len(stamps)):
        departure = stamps[k] - counted[k] - missing - shift
        if departure > _LATE:
            few = range(k, min(k + _AGREEING, len(stamps)))
            mean = sum(stamps[j] - counted[j] for j in few) / len(few) - missing - shift
            if mean > _LATE:
                missing += round(mean)
                departure = stamps[k] - counted[k] - missing - shift
        shift += _GAIN * departure
        ends.append(counted[k] + missing)
    number = np.repeat(np.array(ends) - sizes, sizes) + np.arange(len(time)) - np.repeat(begins, sizes)
    return np.asarray(number - number[0], dtype=np.float64)


GAP = 1.75
"""Ratio to the usual interval from which samples are missing: the middle between one and two and a half, so that jitter
of a whole interval is not a gap and a missing sample is."""


@dataclass(frozen=True)
class Made:
    """Increments made of a recording."""

    imu: ImuData  # the increments
    gaps: Array  # beginning and length of the bridged gaps, (G, 2) s


def made_increments(
    stream: InertialStream,
    *,
    readings: Literal["instantaneous", "mean"] = "instantaneous",
    stamps: Literal["as-given", "even"] = "as-given",
    max_gap: float = 0.1,
    source: str = "the log",
) -> Made:
    """Return the increments of a recorded inertial unit's readings, forward-right-down, SI: of rates that are values at
    the stamps, or means over the intervals that end there. Stamps that are "even" are replaced by even instants, see
    `even_stamps`; `max_gap` is the longest time without samples that is bridged, s."""
    if len(stream) < 2:
        raise InputError(f"{source} has {len(stream)} samples in this span; at least two are needed.")
    if stamps == "even" and len(stream) > 2:
        stream = replace(stream, time=even_stamps(stream.time)[0])
    steps = np.diff(stream.time)
    if not np.min(steps) > 0.0:
        k = int(np.argmax(~(steps > 0.0)))
        raise InputError(
            f"{source}: the time {stream.time[k + 1]:.9g} s of sample {k + 1} is not later than "
            f"{stream.time[k]:.9g} s. Exclude the reset of a clock by from_s and to_s. If the IMU samples "
            'evenly and only its time stamps repeat, set stamps = "even".'
        )
    usual = float(np.median(steps))
    wide = np.flatnonzero(steps > GAP * usual)
    longest = float(steps[wide].max()) - usual if len(wide) else 0.0
    if longest > max_gap:
        k = int(wide[np.argmax(steps[wide])])
        raise InputError(
            f"{source}: no samples for {longest:.6g} s from t = {stream.time[k]:.6f} s on, more than max_gap_s = "
            f"{max_gap:g}. The motion in the gap is unknown: use the part before or after it (from_s, to_s), or "
            "accept a longer bridge."
        )
    gaps = np.column_stack((stream.time[wide], steps[wide] - usual))
    if stream.kind == "rates" and readings == "instantaneous":
        return Made(_trapezoids(stream, usual), gaps)
    return Made(_intervals(stream, usual), gaps)


def _trapezoids(stream: InertialStream, usual: float) -> ImuData:
    """Integrate instantaneous rates between their stamps."""
    time, rates = stream.time, np.hstack((stream.gyro, stream.accel))
    missing = np.maximum(np.round(np.diff(time) / usual) - 1, 0).astype(np.intp)
    if missing.any():
        first = np.repeat(np.arange(len(time) - 1), missing + 1)
        number = np.concatenate([np.arange(m + 1) for m in missing])
        part = number / (missing[first] + 1.0)
        fine = np.append(time[first] + part * np.diff(time)[first], time[-1])
        rates = np.vstack((rates[first] + part[:, None] * np.diff(rates, axis=0)[first], rates[-1:]))
        time = fine
    sums = 0.5 * (rates[1:] + rates[:-1]) * np.diff(time)[:, None]
    return ImuData(time, np.ascontiguousarray(sums[:, :3]), np.ascontiguousarray(sums[:, 3:]))


def _intervals(stream: InertialStream, usual: float) -> ImuData:
    """Lay increments, or mean rates, over the intervals that end at their stamps."""
    count, time = len(stream), stream.time
    steps = np.diff(time, prepend=time[0] - usual)
    if stream.interval is None:
        covered = np.where(steps > GAP * usual, usual, steps)[:, None] * np.ones(2)
    else:
        covered = stream.interval
        steps[0] = covered[0].max()
    # mean rates over the intervals that the numbers cover
    by = np.ones((count, 2)) if stream.kind == "rates" else covered
    rates = np.hstack((stream.gyro / by[:, :1], stream.accel / by[:, 1:]))
    whole = steps <= GAP * usual
    if stream.interval is None and stream.kind == "increments":
        sums = np.hstack((stream.gyro, stream.accel))
    else:
        sums = rates * steps[:, None]
    edges, rows = [np.array([time[0] - steps[0]])], []
    begin = 0
    for k in (*np.flatnonzero(~whole), count):
        edges.append(time[begin:k])
        rows.append(sums[begin:k])
        if k == count:
            break
        length = min(float(covered[k].max()), float(steps[k]))
        more = max(round(float(steps[k] - length) / usual), 1)
        bridge = (steps[k] - length) / more
        edges.append(time[k] - length - bridge * np.arange(more - 1, -1, -1.0))
        rows.append(np.tile(0.5 * (rates[k - 1] + rates[k]) * bridge, (more, 1)))
        edges.append(time[k : k + 1])
        rows.append(rates[k : k + 1] * length)
        begin = k + 1
    values = np.vstack(rows)
    return ImuData(np.concatenate(edges), np.ascontiguousarray(values[:, :3]), np.ascontiguousarray(values[:, 3:]))


def bridge_noise(imu: ImuData, gaps: Array) -> AddedNoise | None:
    """Return the noise of rates, densities that are zero outside of the gaps, that a straight line replaces in gaps of
    given beginning and length, (G, 2) s; None without gaps. Between two known values, rates that change by a mean
    square S within the length T of a gap are a Brownian bridge, whose integral over the gap has the variance S T²/12.
    White noise of the density √(S T/12) has the same."""
    if not len(gaps):
        return None
    steps = np.diff(imu.time)
    usual = float(np.median(steps))
    rates = np.hstack((imu.dtheta, imu.dvel)) / steps[:, None]
    times, density = [imu.time[0]], [np.zeros(6)]
    for begin, length in gaps:
        lag = int(np.clip(round(length / usual), 1, len(rates) - 1))
        change = np.mean((rates[lag:] - rates[:-lag]) ** 2, axis=0)
        times += [begin, begin + length + usual]
        density += [np.sqrt(change * length / 12.0), np.zeros(6)]
    variance = np.array(density)
    return AddedNoise(np.array(times), variance[:, :3], variance[:, 3:])


def gap_words(gaps: Array) -> Sequence[str]:
    """Describe the bridged gaps, (G, 2) s: beginning and length."""
    if not len(gaps):
        return ()
    k = int(np.argmax(gaps[:, 1]))
    return (
        f"The inertial unit lacks samples at {len(gaps)} place{'s' * (len(gaps) != 1)}, {gaps[:, 1].sum():.3g} s in "
        f"all; the longest gap, {gaps[k, 1]:.3g} s, begins at t = {gaps[k, 0]:.3f} s. They are bridged by linear "
        "interpolation, with more noise.",
    )
