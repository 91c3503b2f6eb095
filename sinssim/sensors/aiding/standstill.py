"""Pseudo-measurements of a vehicle or a foot at rest: zero velocity and zero angular rate.

A reading is zero with a given 1σ, with disturbances by wind and engines. By default there are readings only where the
true value is at most σ/3. The true value then adds at most 1/9 to the χ² of the three components, 3.11 instead of 3 on
average, even if the vehicle creeps for long. The σ that the filter assumes is therefore correct.

A vehicle with its engine on shakes; what shaking means rest is learned from a time at which it stands. A window of time
is taken for rest if it passes three tests:

1. the variances s² of its six axes are not larger than at rest, in their geometric mean: Π (s²/s₀²)^(1/6) < ratio.
   Σ ln(s²/s₀²) is the likelihood ratio of Gaussian readings of variance s₀² against any other variance, less terms
   linear in s²/s₀² (detectors of this family: Skog, Händel, Nilsson and Rantakokko, IEEE Trans. Biomedical Engineering
   57, 2010, 2657); a single axis that a cold engine shakes more does not outvote the others;
2. its mean rates are those at rest, which are the gyros' biases, within the 5σ by which they scatter there, and the
   drift of the biases;
3. its mean rates and specific forces change neither from the first half of the window to the second nor from the first
   window of the stop to this one, within 5σ: a vehicle that starts to roll on its idling engine shakes no more than
   before, but it accelerates.

A vehicle that rolls at a constant, small velocity without more shaking cannot be told from one at rest by any inertial
sensor. Fixes of a satellite receiver veto a stop where there are any.

A foot stands for some tenths of a second between two swings of large rates and forces, and windows are so short that
means do not help. A window of W samples f and ω is then taken for rest by the generalised likelihood ratio of Skog et
al. ("SHOE"), here with the gyros' bias b and the magnitude of gravity g as learned at rest, and divided by its mean 6:

    1/(6W) Σ [ |f − g f̄/|f̄||²/σ_f² + |ω − b|²/σ_ω² ] < ratio
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sinssim import earth, rotation
from sinssim.arguments import POSITIVE, checked_increments, number
from sinssim.data import Array, ImuData, Measurements
from sinssim.errors import InputError
from sinssim.sensors.aiding_sensor import AidingReadings, AidingSensor, Mask, Vehicle, white, within
from sinssim.sensors.measurement_kind import Comparison, MeasurementKind, V
from sinssim.toml_section import Noise, Span
from sinssim.units import DEG_H

if TYPE_CHECKING:
    from sinssim.truth.trajectory import Trajectory


@dataclass(frozen=True)
class Windows:
    """Means and variances of rates and specific forces over windows."""

    # of each window, (W,) s
    begin: Array
    end: Array
    mean: Array  # gyros, then accelerometers, (W, 6) rad/s and m/s²
    variance: Array  # of the readings about their mean, (W, 6)
    change: Array  # mean of the second half less that of the first, (W, 6)


def windows_of(imu: ImuData, length_s: float, step_s: float, least: int = 8) -> Windows:
    """Return means and variances over overlapping windows of at least so many samples, with a time from the end of one
    to the end of the next."""
    steps = np.diff(imu.time)
    interval = float(np.mean(steps))
    count, step = round(length_s / interval), max(round(step_s / interval), 1)
    if count < least or count > len(steps):
        raise InputError(
            f"a window of {length_s:g} s needs at least {least} samples and no more than there are: the data have "
            f"{len(steps)} samples of {interval:.3g} s."
        )
    rate = np.concatenate([imu.dtheta, imu.dvel], axis=1) / steps[:, None]
    offset = rate.mean(axis=0)
    rate -= offset
    none = np.zeros((1, 6))
    sums = np.concatenate([none, np.cumsum(rate, axis=0)])
    squares = np.concatenate([none, np.cumsum(rate * rate, axis=0)])
    last = np.arange(count, len(steps) + 1, step)
    mean = (sums[last] - sums[last - count]) / count
    variance = (squares[last] - squares[last - count]) / count - mean * mean
    half = count // 2
    change = (sums[last] - sums[last - half] - (sums[last - count + half] - sums[last - count])) / half
    return Windows(imu.time[last - count], imu.time[last], mean + offset, np.maximum(variance, 0.0), change)


LEAST_S = 5.0
"""Shortest time of rest from which its shaking is learned, s: five windows of a second."""

RATIO = 3.0
"""Largest geometric mean of the variances of a window at rest, in units of those learned."""

SIGMAS = 5.0
"""Largest deviation of the means of a window at rest, in units of their scatter."""

_STEPS = 10  # windows begin a tenth of their length after one another


FOOT_WINDOW_S = 0.05
"""Length of the windows in which the stances of a foot are looked for, s."""


@dataclass(frozen=True)
class Rest:
    """Inertial readings of a vehicle at rest."""

    window_s: float  # length of the windows, s
    variance: Array  # median variance of gyros and accelerometers in a window, (6,) rad²/s² and m²/s⁴
    mean: Array  # median of their means, (6,) rad/s and m/s²
    scatter: Array  # 1σ of the means of windows, (6,)
    seconds: float  # time from which this was learned, s


@dataclass(frozen=True)
class Stops:
    """The stops of a run."""

    spans: Array  # beginning and end of each stop, (S, 2) s
    rest: Rest  # what rest is


def learn_rest(
    imu: ImuData,
    velocity: Measurements | None = None,
    spans: Sequence[tuple[float, float]] | None = None,
    window_s: float = 1.0,
) -> Rest:
    """Learn the readings of a vehicle at rest from spans in which it is known to stand, or else from "gnss-velocity",
    which shows that it stands by components within 3σ of zero."""
    checked_increments(imu)
    window_s = number("window_s", window_s, "s", low=POSITIVE)
    windows = windows_of(imu, window_s, window_s / _STEPS)
    if spans is not None:
        still = np.zeros(len(windows.end), dtype=bool)
        for begin, end in spans:
            still |= (windows.begin >= begin - 1e-6) & (windows.end <= end + 1e-6)
    elif velocity is not None:
        still = _shown_by(velocity, windows, standing=True)
    else:
        raise InputError(
            "to learn the noise at rest, give velocity fixes, or spans in which the vehicle is stationary."
        )
    begins, ends = windows.begin[still], windows.end[still]
    seconds = float(np.sum(ends - np.maximum(begins, np.append(-np.inf, ends)[:-1])))  # windows overlap
    if seconds < LEAST_S - 1e-6:
        raise InputError(
            f"the vehicle stands for {seconds:.3g} s of the data; its vibration at rest is learned from {LEAST_S:g} s "
            "or more. Give spans in which the vehicle is known to be stationary, or the times of its stops."
        )
    variance, mean = np.median(windows.variance[still], axis=0), np.median(windows.mean[still], axis=0)
    # robust: a quarter of the windows may belong to the beginning or the end of a stop
    scatter = np.median(np.abs(np.diff(windows.mean[still][::_STEPS], axis=0)), axis=0) / (0.6745 * np.sqrt(2.0))
    samples = window_s * len(imu) / float(imu.time[-1] - imu.time[0])
    return Rest(window_s, variance, mean, np.maximum(scatter, np.sqrt(variance / samples)), seconds)


def find_stops(
    imu: ImuData,
    rest: Rest,
    *,
    ratio: float = RATIO,
    rate_drift: float = np.radians(0.2),
    velocity: Measurements | None = None,
) -> Stops:
    """Find the stops of a vehicle, in each of which at least one window passed the tests.

    `ratio` is the largest geometric mean of the variances, in units of those at rest; the gyros' biases may drift from
    those learned by `rate_drift`, rad/s. "gnss-velocity" vetoes a stop by a component beyond 5σ of zero within a
    window.
    """
    checked_increments(imu)
    ratio = number("ratio", ratio, low=POSITIVE)
    windows = windows_of(imu, rest.window_s, rest.window_s / _STEPS)
    with np.errstate(divide="ignore"):
        level = np.mean(np.log(windows.variance / rest.variance), axis=1)
    turning = np.abs(windows.mean[:, :3] - rest.mean[:3]) > SIGMAS * rest.scatter[:3] + rate_drift
    # the mean of half a window scatters √2 times as much, the difference of two halves twice as much
    changing = np.abs(windows.change) > SIGMAS * 2.0 * rest.scatter
    still = (level < np.log(ratio)) & ~turning.any(axis=1) & ~changing.any(axis=1)
    if velocity is not None:
        still &= ~_shown_by(velocity, windows, standing=False)
    spans: list[tuple[float, float]] = []
    anchor = None
    for k in np.flatnonzero(still):
        begin, end = float(windows.begin[k]), float(windows.end[k])
        if anchor is None or begin > spans[-1][1]:
            anchor = windows.mean[k]
            spans.append((begin, end))
        elif np.all(np.abs(windows.mean[k] - anchor) <= SIGMAS * np.sqrt(2.0) * rest.scatter):
            spans[-1] = (spans[-1][0], end)
    return Stops(np.array(spans).reshape(-1, 2), rest)


def find_stances(
    imu: ImuData,
    rest: Rest,
    *,
    window_s: float = FOOT_WINDOW_S,
    ratio: float = RATIO,
    velocity: Measurements | None = None,
) -> Stops:
    """Find the stances of a foot by the likelihood ratio of windows that begin at each sample; see the module's text.

    `ratio` is its largest value; "gnss-velocity" vetoes as in `find_stops`.
    """
    checked_increments(imu)
    window_s, ratio = number("window_s", window_s, "s", low=POSITIVE), number("ratio", ratio, low=POSITIVE)
    windows = windows_of(imu, window_s, 0.0, least=3)
    level = np.zeros(len(windows.end))
    gravity = np.linalg.norm(rest.mean[3:])
    off = (
        np.linalg.norm(windows.mean[:, :3] - rest.mean[:3], axis=1),
        np.linalg.norm(windows.mean[:, 3:], axis=1) - gravity,
    )
    for triad, away in zip((slice(0, 3), slice(3, 6)), off, strict=True):
        level += (windows.variance[:, triad].sum(axis=1) + away**2) / (6.0 * rest.variance[triad].mean())
    still = level < ratio
    if velocity is not None:
        still &= ~_shown_by(velocity, windows, standing=False)
    begin, end = windows.begin[still], windows.end[still]
    first = np.flatnonzero(np.append(True, begin[1:] > end[:-1]))[: len(begin)]
    spans = np.column_stack([begin[first], np.append(end[first[1:] - 1], end[-1:])])
    return Stops(spans, rest)


def _shown_by(velocity: Measurements, windows: Windows, *, standing: bool) -> NDArray[np.bool_]:
    """Return the windows in which fixes of velocity show rest, or in which one shows motion, (W,)."""
    size = np.max(np.abs(velocity.value) / velocity.sigma, axis=1)
    size = np.where(np.isfinite(size), size, np.inf if standing else 0.0)
    first = np.searchsorted(velocity.time, windows.begin - 1e-6)
    last = np.searchsorted(velocity.time, windows.end + 1e-6)
    moving = np.concatenate([[0], np.cumsum(size > (3.0 if standing else SIGMAS))])
    any_moving = moving[last] > moving[first]
    return np.asarray(~any_moving & (last > first) if standing else any_moving)


def standstill(
    stops: Stops, *, velocity_sigma: float = 0.02, rate_hz: float = 1.0, velocity: bool = True, rate: bool = True
) -> list[Measurements]:
    """Return the readings "zero-velocity" and "zero-rate" that stops give, valid at the ends of whole intervals within
    a stop. The 1σ of the velocity is that of the shaking, m/s; that of the rates is the scatter of their means at
    rest."""
    velocity_sigma = number("velocity_sigma", velocity_sigma, "m/s", low=POSITIVE)
    interval = 1.0 / number("rate_hz", rate_hz, "measurements per second", low=POSITIVE)
    times = [np.arange(begin + interval, end + 1e-9, interval) for begin, end in stops.spans]
    time = np.concatenate(times) if times else np.zeros(0)
    zero = np.zeros((len(time), 3))
    readings = []
    if velocity:
        sigma = np.broadcast_to(np.full(3, velocity_sigma), (len(time), 3))
        readings.append(Measurements("zero-velocity", time, time, zero, sigma))
    if rate:
        scatter = stops.rest.scatter[:3] * np.sqrt(stops.rest.window_s / interval)
        readings.append(Measurements("zero-rate", time, time, zero, np.broadcast_to(scatter, (len(time), 3))))
    return readings


_AT_REST = 1.0 / 3.0
"""Magnitude of the true velocity or rate, in units of the reading's 1σ, up to which a vehicle counts as at rest."""


class Detection(NamedTuple):
    """Detected rest beside the true one, at the instants of the readings."""

    at_rest: int  # instants at which the true motion is at most a third of the 1σ
    missed: int  # those without a reading
    readings: int
    false: int  # readings in motion


class Standstill(AidingSensor):
    """Readings of zero while a vehicle stands."""

    assumed: ClassVar = True

    during_s: tuple[Span, ...] | None = Field(
        default=None,
        description="[from, to] of each assumed stop, which may be wrong; default: the intervals in which the true "
        "value is at most a third of the 1σ below",
    )
    detect: bool = Field(
        default=False, description="whether the stops are detected from the inertial data instead; requires learn_s"
    )
    learn_s: tuple[Span, ...] = Field(
        default=(),
        description="[from, to] of each interval at rest, 5 s or more in total, from which the vibration at rest is "
        "learned",
    )
    detector: Literal["vehicle", "foot"] = Field(
        default="vehicle",
        description="vehicle: windows whose shaking and means are those at rest; foot: short windows whose likelihood "
        "ratio is that at rest, for a block on a shoe",
    )
    window_s: Annotated[float, Field(ge=1e-3, le=60.0)] | None = Field(
        default=None,
        description="length of the windows of the detection; default: 1 s for a vehicle, 0.05 s for a foot",
    )
    threshold: Annotated[float, Field(gt=1.0, le=1e6)] = Field(
        default=3.0,
        description="largest variance of a window at rest (vehicle), or its largest likelihood ratio (foot), in units "
        "of that learned",
    )

    rules = (
        (lambda s: s.detect and not s.learn_s,
         "detect = true needs learn_s, intervals in which the vehicle is known to be stationary, for example "
         "[[0.0, 20.0]]"),
        (lambda s: s.detect and s.during_s is not None,
         "detect = true finds the stops, and during_s gives them: remove one of the two"),
        (lambda s: not s.detect and (s.changed("learn_s", "detector", "window_s", "threshold")),
         "{it} is for detect = true: set it, or remove {it}"),
    )  # fmt: skip

    @property
    def no_budget(self) -> str:
        return "stops are detected from the data of one run (detect = true)" if self.detect else ""

    @property
    def of_fixed_block(self) -> str:
        return "detects stops in the inertial data (detect = true; during_s gives them instead)" if self.detect else ""

    @property
    def needs_no_truth(self) -> bool:
        return self.detect

    def found(self, imu: ImuData, velocity: Measurements | None = None) -> Stops:
        """Return the stops that the inertial readings show; "gnss-velocity" vetoes a stop, if there is any."""
        if self.detector == "foot":
            rest, window_s = learn_rest(imu, spans=self.learn_s), self.window_s or FOOT_WINDOW_S
            return find_stances(imu, rest, window_s=window_s, ratio=self.threshold, velocity=velocity)
        rest = learn_rest(imu, spans=self.learn_s, window_s=self.window_s or 1.0)
        return find_stops(imu, rest, ratio=self.threshold, velocity=velocity)

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        """Return the size of the true motion that a reading takes for zero, (M,)."""
        raise NotImplementedError

    def compared(self, readings: AidingReadings, trajectory: Trajectory) -> Detection:
        """Compare the readings with the true motion."""
        given = np.isin(readings.time, readings.measurements.time)
        sigma = float(readings.measurements.sigma[0, 0]) if given.any() else 0.0
        rest = self.motion(trajectory, readings.time) <= _AT_REST * sigma
        return Detection(*(int(np.count_nonzero(of)) for of in (rest, rest & ~given, given, given & ~rest)))

    def stands(self, time: Array, size: Array, sigma: float) -> Mask:
        """Return the instants at which the vehicle is assumed to be at rest."""
        if self.during_s is not None:
            return within(time, self.during_s)
        return np.asarray(size <= _AT_REST * sigma)

    def zeros(self, label: str, vehicle: Vehicle, sigma: float, lasting: float) -> list[AidingReadings]:
        """Return readings of zero with errors by the shaking of the vehicle: after `lasting` s of a stop that was found
        or, by the size of the true motion, while the vehicle is assumed to be at rest."""
        time = self.epochs(vehicle.trajectory)
        value = white(vehicle.seed, f"{label.replace('-', ' ')} noise", (sigma,) * 3, len(time))
        if self.detect and vehicle.imu is not None:
            valid = np.zeros(len(time), dtype=bool)
            for begin, end in self.found(vehicle.imu).spans:
                valid |= (time >= begin + lasting - 1e-9) & (time <= end + 1e-9)
        else:
            valid = self.stands(time, self.motion(vehicle.trajectory, time), sigma)
        return [self.readings(label, label, time, value, (sigma,) * 3, {}, valid=valid)]


def _of_block(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the velocity of the block itself; residual δv."""
    h = at.zeros(3)
    h[:, :, V] = np.eye(3)
    return at.state.velocity_ned - value, h


class ZeroVelocity(Standstill):
    """Zero-velocity updates of a vehicle at rest, with vibration by wind and engines."""

    table: ClassVar = "zero_velocity"
    kinds: ClassVar = (
        MeasurementKind(
            "zero-velocity",
            columns=("velocity_n_mps", "velocity_e_mps", "velocity_d_mps"),
            axes=("n", "e", "d"),
            unit="mps",
            compare=_of_block,
            rounding="accelerometers",
            turns_with_north=False,
            zero=True,
            velocities=3,
        ),
    )

    sigma_mps: Noise = Field(default=0.01, description="1σ of each velocity component due to this vibration")

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        return np.asarray(np.linalg.norm(trajectory.state(time).velocity_ned, axis=1))

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero velocities where the true velocity is at most σ/3, with errors by the shaking of the vehicle."""
        return self.zeros("zero-velocity", vehicle, self.sigma_mps, 0.0)

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero velocities at the stops that the readings show; see the base."""
        stops = self.found(imu, velocity)
        return standstill(stops, velocity_sigma=self.sigma_mps, rate_hz=self.rate_hz, rate=False)


def _mean_of_gyros(at: Comparison, value: Array) -> tuple[Array, Array]:
    """Compare with the mean rate of the gyros relative to the Earth; residual W x, the error of the rate."""
    return at.turning() - value, at.turning_error()


class ZeroRate(Standstill):
    """Zero-rate updates of a vehicle that does not turn, with vibration by wind and engines."""

    table: ClassVar = "zero_rate"
    kinds: ClassVar = (
        MeasurementKind(
            "zero-rate",
            columns=("rate_x_radps", "rate_y_radps", "rate_z_radps"),
            axes=("x", "y", "z"),
            unit="radps",
            compare=_mean_of_gyros,
            mean_rate=True,
            velocities=3,
        ),
    )

    sigma_deg_h: Noise = Field(
        default=0.1,
        description="1σ of the mean rate about each axis over the interval of a measurement, due to this vibration",
    )

    @property
    def of_fixed_block(self) -> str:
        return "compares the mean of the gyro data with zero rotation of the vehicle"

    def motion(self, trajectory: Trajectory, time: Array) -> Array:
        """Return the magnitude of the mean rate relative to the Earth over the interval before each instant, rad/s."""

        def to_earth(t: Array) -> Array:
            state = trajectory.state(t)
            return rotation.multiply(earth.q_en(state.latitude, state.longitude), state.q_nb)

        # an interval begins at the end of the previous one, the first at the start
        interval = 1.0 / self.rate_hz
        before = to_earth(np.maximum(time - interval, trajectory.start))
        turn = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(before), to_earth(time)))
        return np.asarray(np.linalg.norm(turn, axis=1) / interval)

    def read(self, vehicle: Vehicle) -> list[AidingReadings]:
        """Return zero rates of the block relative to the Earth where its mean rate over the interval is at most σ/3."""
        return self.zeros("zero-rate", vehicle, DEG_H * self.sigma_deg_h, 1.0 / self.rate_hz)

    def from_imu(
        self, imu: ImuData, velocity: Measurements | None = None, q_bs: Array | None = None
    ) -> list[Measurements]:
        """Return zero rates at the stops that the readings show, with the larger of both 1σ; see the base."""
        (given,) = standstill(self.found(imu, velocity), rate_hz=self.rate_hz, velocity=False)
        return [replace(given, sigma=np.maximum(given.sigma, DEG_H * self.sigma_deg_h))]
