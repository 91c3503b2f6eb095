"""Tests whether the vehicle stood still in a session, and bounds the effect of undetected motion.

Eq. (1) assumes that the mean rate of the gyros is the Earth's. A base that turns by d between the first and the last
instant adds d/T to that mean, regardless of its motion in between: one second of arc in 300 s causes 1.2′ of heading
error at 50° of latitude. A test and a variance account for this.

**Test.** The observed departures are compared with limits from the noise of the sensors. If a grade is given, that
noise is the grade's and not the record's own, which would include a sway. The departure of the gyros' angle from a
straight line must not exceed that of a Brownian bridge. The specific force of parts of the session must agree with the
mean. Sums over 1, 2, 4 … samples must not vary more than white noise. The net turn d, measured as below, must be zero
within its error. One session in `1/FALSE_ALARM` of a vehicle at rest is refused.

**Variance.** Gyros cannot distinguish a steady turn from the Earth's rotation, but accelerometers can. Over the first
and the last τ seconds they measure the plumb line, which the gyros transfer to the first and to the last instant. The
change between the two is d about the horizontal axes, with the standard deviation

    σ_d² = [2 N_a²/(g² τ) + N_g² (2τ/3 − τ²/T) + pulses and drifts] / (1 − τ/T)²

for white noises N_a and N_g; the τ that minimises it is used. With a flat prior for d, the posterior mean square is d̂²
+ σ_d² for the measured d̂, and (d̂ d̂ᵀ + σ_d²)/T² is added to the covariance of the mean rate. This holds for any
motion, slower or faster than the session. About the vertical only the gyros measure, so that a slow turn is not
detected. The turn about the vertical is assumed to be within the limit for tilts, and the square of the limit, the
largest mean square within it, is added to the covariance. A larger steady turn about the vertical causes an error of
the latitude but not of the heading.

The limits include the largest change of the readings at rest by the drifts of the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sinssim.alignment.alignment_budget import INSTANTS, Expected
from sinssim.alignment.determination import Determination, check_session, determine, mean_readings, pulse, white_level
from sinssim.alignment.parked_theory import Angles, Coefficients
from sinssim.data import Array, ImuData
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.units import ARCSEC, G0


class Drift(NamedTuple):
    """Largest change of readings within a session of a vehicle at rest."""

    rate: float  # known part of the change of a rate, rad/s
    rate_sigma: float  # standard deviation of the unknown part, rad/s
    force: float  # known part of the change of a specific force, m/s²
    force_sigma: float  # standard deviation of the unknown part, m/s²


def largest_drift(expected: Expected, duration: float, start: float = 0.0) -> Drift:
    """Return the largest change of a reading at rest within a session by the drifts of the sensors, over the axes.

    The session lasts `duration` s and begins `start` s after the sensors were switched on.
    """
    ends = np.array([start, start + duration])
    warmth = expected.mean.warm_up.temperature(ends)

    def of_triad(name: str, reading: float) -> tuple[float, float]:
        mean, sigma = getattr(expected.mean, name), getattr(expected.sigma, name)

        def driven(of: TriadErrors) -> Array:  # by temperature and time, each term by itself
            x, force = np.full((2, 3), reading), np.full((2, 3), G0)
            squares = ((np.diff(t.inputs(x, force, warmth, ends), axis=0)[0] * v) ** 2 for t, v in of.acting)
            axes = (square.sum(axis=-1) if square.ndim == 2 else square for square in squares)
            return np.sqrt(sum(axes, np.zeros(3)))

        remembered = np.exp(-duration / sigma.correlation_time)
        wandered = sigma.rate_walk**2 * duration + 2.0 * sigma.instability**2 * (1.0 - remembered)
        # density B²/(πf): the variance between means over a second at a distance T is (2B²/π)(ln T + 3/2)
        wandered += sigma.flicker**2 * 2.0 / np.pi * (np.log(max(duration, 1.0)) + 1.5)
        return float(np.max(driven(mean))), float(np.max(np.sqrt(driven(sigma) ** 2 + wandered)))

    rate, rate_sigma = of_triad("gyro", OMEGA_IE)
    if (shift := expected.mean.null_shift) is not None:
        instants = start + duration * np.linspace(0.0, 1.0, INSTANTS)
        rate += float(np.ptp(shift.bias(expected.mean.warm_up.temperature(instants))))
    return Drift(rate, rate_sigma, *of_triad("accel", G0))


FALSE_ALARM = 1e-3
"""Probability that a session of a vehicle at rest is refused."""

_PARTS = (2, 20)  # number of parts of a session for the comparison of mean specific forces: slow sinking, jolts
_FEWEST_PARTS = 4  # smallest number of sums for a test of variance
_ROUNDING = 0.01 * ARCSEC  # rounding error of an angle by arithmetic and the digits of a log
# Limits without a grade, where the noise is estimated from the record: departures that always pass.
_UNKNOWN_TURN = 5.0 * ARCSEC
_UNKNOWN_TILT = 1.5 * ARCSEC


@dataclass(frozen=True)
class Departure:
    """Departure of a quantity that is constant on a vehicle at rest, and its limit."""

    what: str  # beginning of a sentence that the size completes: "its specific force turns by"
    size: float  # size of the departure, rad
    limit: float  # largest departure that the noise of the sensors explains, rad
    time: float | None = None  # time of the departure, s; None if it has no single time


@dataclass(frozen=True, eq=False)
class Stillness:
    """Observed motion of the vehicle in a session, and its limits."""

    departures: tuple[Departure, ...]  # departures of all tests
    graded: bool  # whether the limits are based on a known grade
    net_turn: Array  # d̂ from the first sample to the last about the horizontal axes, forward-right-down, (3,) rad
    net_turn_sigma: float  # σ_d of each of its two components, rad
    net_turn_limit: float  # the largest |d̂| that noise explains, rad
    duration: float  # T, s
    up: Array  # direction of the mean specific force, (3,)

    @property
    def worst(self) -> Departure:
        """The departure with the largest ratio to its limit."""
        return max(self.departures, key=lambda departure: departure.size / departure.limit)

    @property
    def moved(self) -> bool:
        """Whether a departure exceeds what noise explains."""
        return self.worst.size > self.worst.limit

    @property
    def turn_covariance(self) -> Array:
        """Mean square of the unknown net turn of an accepted session, forward-right-down, (3, 3) rad²."""
        level, vertical = np.eye(3) - np.outer(self.up, self.up), np.outer(self.up, self.up)
        tilted = np.outer(self.net_turn, self.net_turn) + self.net_turn_sigma**2 * level
        return np.asarray(tilted + self.net_turn_limit**2 * vertical)

    def require(self) -> None:
        """Refuse a session whose vehicle moved.

        Raises:
            InputError: the vehicle moved; the message gives the departure, its limit and a remedy.
        """
        if not self.moved:
            return
        worst = self.worst
        when = "" if worst.time is None else f"at {worst.time:.6g} s "
        explains = "the noise of the sensors' grade" if self.graded else "the noise in the record"
        raise InputError(
            f"the vehicle moved during the session: {when}{worst.what} {worst.size / ARCSEC:.4g} arcsec, but "
            f"{explains} explains only {worst.limit / ARCSEC:.3g} arcsec. Align it as a disturbed base (--disturbed, "
            "align_disturbed), or use a part of the session in which the vehicle is stationary."
        )


def motion_errors(c: Coefficients, still: Stillness) -> Angles:
    """Return the standard deviations of the angles of eq. (1) by undetected motion of the base of one vehicle, rad.

    Heading and latitude are those by the mean rate, roll and pitch those by the turn itself. Half of its mean square
    lies between the session's mean and its end for a sway, a quarter for steady sinking.
    """
    turn = still.turn_covariance
    rate = turn / still.duration**2
    tilt = np.sqrt(0.25 * float(np.trace(turn) - still.up @ turn @ still.up))  # mean of the horizontal axes
    heading, latitude = (np.sqrt(float(by @ rate @ by)) for by in (c.m, c.p))
    return Angles(*(np.asarray(value) for value in (heading, tilt, tilt, latitude)))


class _Noise(NamedTuple):
    """Noise of the sensors alone: white noise N, pulse weight, change within the session."""

    white: float
    quantum: float
    known: float
    sigma: float

    @property
    def change(self) -> float:
        """Largest change of a reading within the session."""
        return self.known + 3.0 * self.sigma


def determine_session(imu: ImuData, expected: Expected | None = None) -> Determination:
    """Determine heading, roll, pitch and latitude from a session of a stationary vehicle, eq. (1).

    Args:
        imu: the session's increments; a few hundred seconds reduce the noise by averaging.
        expected: expected errors of the sensor block, if known; see `sinssim.alignment.expected_errors`.

    Returns:
        The determination.

    Raises:
        InputError: the increments are unusable, the vehicle moved during the session, or as for `determine`.
    """
    result = determine(*mean_readings(imu), None if expected is None else expected.instrument_sigmas)
    stillness(imu, expected).require()
    return result


def stillness(imu: ImuData, expected: Expected | None = None, start: float = 0.0) -> Stillness:
    """Compare a session with a vehicle at rest.

    Args:
        imu: the session's increments.
        expected: expected errors of the sensor block; without them the noise is estimated from the record, and there is
            no covariance.
        start: time from when the sensors were switched on to the session's first sample, s.

    Returns:
        Departures and limits, and the net turn.

    Raises:
        InputError: the increments are unusable.
    """
    imu = check_session(imu)
    elapsed = imu.time - imu.time[0]
    duration = float(elapsed[-1])
    accel = imu.dvel.sum(axis=0) / duration
    gravity = float(np.linalg.norm(accel))
    up = accel / gravity
    gyro, tilt = _noises(imu, expected, start, gravity)
    # the direction of the specific force turns opposite to the block; tilt of the block times the time
    level = np.cross(imu.dvel, up) / gravity
    angle = np.concatenate([np.zeros((1, 3)), np.cumsum(imu.dtheta, axis=0)])
    bridge = angle - np.outer(elapsed / duration, angle[-1])
    net, sigma, window = _net_turn(bridge, level, elapsed, up, gyro, tilt)
    count = len(imu)
    octaves = [2**k for k in range(int(np.log2(count / _FEWEST_PARTS)) + 1)] if expected is not None else []
    # the net turn, which alone detects slow motion, has half of the false alarms; the others share the rest
    each = 0.5 * FALSE_ALARM / (3 + sum(_PARTS) + 6 * max(len(octaves), 1))
    # a sway smaller than σ_d adds to the net turn at most the stated σ; without known noise there is no such allowance
    harmless = _ROUNDING if expected is None else sigma + _ROUNDING
    departures = [
        _of_bridge(bridge, imu.time, gyro, duration, harmless, each),
        _of_tilt(level, imu.time, tilt, harmless, each),
    ]
    # the known drift is per axis, the turn is about two; 1 − τ/T as for the net turn
    known = np.sqrt(2.0) * (tilt.known + 0.5 * gyro.known * window) / (1.0 - window / duration)
    largest = float(known) + sigma * float(np.sqrt(-2.0 * np.log(0.5 * FALSE_ALARM)))
    if expected is not None:
        what = "from the first sample to the last the base turns by"
        departures.append(Departure(what, float(np.linalg.norm(net)), largest + _ROUNDING))
        interval = duration / count
        departures += [_of_sums(np.diff(bridge, axis=0), size, interval, gyro, harmless**2, each) for size in octaves]
        for size in octaves:
            # an accepted sway, or its velocity, which the window of the net turn reduces to the same size
            allowed = 0.5 * (harmless * max(size * interval, window)) ** 2
            departures.append(_of_sums(level, size, interval, tilt, allowed, each, parts=True))
    if expected is None:
        departures = [
            Departure(d.what, d.size, float(np.hypot(d.limit, floor)), d.time)
            for d, floor in zip(departures, (_UNKNOWN_TURN, _UNKNOWN_TILT), strict=True)
        ]
    return Stillness(tuple(departures), expected is not None, net, sigma, largest, duration, up)


def _noises(imu: ImuData, expected: Expected | None, start: float, gravity: float) -> tuple[_Noise, _Noise]:
    """Return the noise of the gyros, and that of the accelerometers as tilts."""
    duration = float(imu.time[-1] - imu.time[0])
    if expected is None:
        return (
            _Noise(white_level(imu.dtheta, duration), pulse(imu.dtheta), 0.0, 0.0),
            _Noise(white_level(imu.dvel, duration) / gravity, pulse(imu.dvel) / gravity, 0.0, 0.0),
        )
    drift = largest_drift(expected, duration, start)
    gyro, accel = expected.sigma.gyro, expected.sigma.accel
    return (
        _Noise(gyro.random_walk, gyro.quantum, drift.rate, drift.rate_sigma),
        _Noise(
            accel.random_walk / gravity, accel.quantum / gravity, drift.force / gravity, drift.force_sigma / gravity
        ),
    )


def _net_turn(
    bridge: Array, level: Array, elapsed: Array, up: Array, gyro: _Noise, tilt: _Noise
) -> tuple[Array, float, float]:
    """Return d̂ about the horizontal axes, σ_d of each component, and τ."""
    duration, count = float(elapsed[-1]), len(level)
    sizes = np.unique(np.geomspace(1.0, max(1, count // 2), 60).astype(int))
    tau = elapsed[sizes]
    variance = 2.0 * tilt.white**2 / tau + gyro.white**2 * (2.0 * tau / 3.0 - tau**2 / duration)
    variance += (tilt.quantum / tau) ** 2 / 3.0 + gyro.quantum**2 / 6.0
    variance += tilt.sigma**2 + (0.5 * gyro.sigma * tau) ** 2
    variance /= (1.0 - tau / duration) ** 2
    best = int(np.argmin(variance))
    size = int(sizes[best])
    inside = 0.5 * (bridge[1:] + bridge[:-1]) * np.diff(elapsed)[:, None]

    def plumb(part: slice, at: Array, span: float) -> Array:
        turned = inside[part].sum(axis=0) / span
        return np.asarray(level[part].sum(axis=0) / span - turned + at)

    first = plumb(slice(0, size), bridge[0], float(elapsed[size]))
    last = plumb(slice(count - size, count), bridge[-1], float(elapsed[-1] - elapsed[count - size]))
    net = (last - first) / (1.0 - float(tau[best]) / duration)
    return net - up * (up @ net), float(np.sqrt(variance[best])), float(tau[best])


def _of_bridge(
    bridge: Array, time: Array, gyro: _Noise, duration: float, sigma: float, probability: float
) -> Departure:
    """Compare the gyros' angle with a straight line: a Brownian bridge exceeds x with 2 exp(−2x²/N²T)."""
    noise = gyro.white * np.sqrt(0.5 * np.log(2.0 / probability) * duration)
    k, axis = np.unravel_index(int(np.argmax(np.abs(bridge))), bridge.shape)
    # a rate within a range of width c moves the angle at most cT/4 from its line
    limit = noise + gyro.quantum + 0.25 * gyro.change * duration + sigma
    what = "its gyros' angle departs from a steady turn by"
    return Departure(what, float(np.abs(bridge[k, axis])), float(limit), float(time[k]))


def _of_tilt(level: Array, time: Array, tilt: _Noise, sigma: float, probability: float) -> Departure:
    """Compare the mean specific forces of segments with that of the whole session."""
    departures = []
    for parts in _PARTS:
        edges = np.linspace(0, len(level), parts + 1).astype(int)
        spans = np.diff(time[edges])
        departure = np.linalg.norm(np.add.reduceat(level, edges[:-1], axis=0) / spans[:, None], axis=1)
        worst = int(np.argmax(departure))
        span = float(spans[worst])
        limit = tilt.white * np.sqrt(-2.0 * np.log(probability) / span) + tilt.quantum / span
        limit += np.sqrt(2.0) * tilt.change + sigma
        middle = float(time[edges[worst]] + 0.5 * span)
        departures.append(Departure("its specific force turns by", float(departure[worst]), float(limit), middle))
    return max(departures, key=lambda departure_: departure_.size / departure_.limit)


def _of_sums(
    increments: Array,
    size: int,
    interval: float,
    noise: _Noise,
    allowed: float,
    probability: float,
    parts: bool = False,
) -> Departure:
    """Compare the variance of sums over `size` samples with that of white noise, pulses and drift.

    The increments are (N, 3) rad, or tilts times the interval, rad s; `parts` reports the sums as mean tilts of the
    parts.
    """
    from scipy.special import chdtri

    count, span = len(increments) // size, size * interval
    sums = increments[: count * size].reshape(count, size, 3).sum(axis=1)
    variance = float(sums.var(axis=0, ddof=1).max())
    white = noise.white**2 * span * float(chdtri(count - 1, probability)) / (count - 1)
    # a reading within a range of width c has a variance of at most c²/4, a sum between pulses an error of at most one
    limit = white + noise.quantum**2 + (0.5 * noise.change * span) ** 2 + allowed
    unit = span if parts else 1.0
    what = (
        f"its specific force, averaged over {span:.3g} s, varies in direction (1σ) by"
        if parts
        else f"its gyros' angle over {span:.3g} s varies (1σ) by"
    )
    return Departure(what, float(np.sqrt(variance)) / unit, float(np.sqrt(limit)) / unit)
