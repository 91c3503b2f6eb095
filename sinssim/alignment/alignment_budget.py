"""Error budget of an attitude determination: by instruments, session length and method, and best headings.

The paper's twelve errors do not decrease with the length of a session. The same holds for errors that at rest act as a
bias of an axis with the ideal reading x: misalignment, non-linearity ½κ|x| + K₂x² + K₃x³ + Σ C_ij x_i x_j,
g-sensitivity. Drifts act by their mean over the session, from t to t + T after the sensors were switched on:

    temperature                 β Θ̄ and k′ Θ̄ x,  Θ̄ = Θ∞ + (Θ₀ − Θ∞) (τ/T) e^(−t/τ) (1 − e^(−T/τ))
    ramp R                      R (t + T/2)
    rate random walk K          variance K² (t + T/3)
    bias instability, flicker   variance of the mean of their process
    null shift of laser gyros   its mean, a known bias

A longer session reduces the random walk (variance N²/T of a mean reading) and the quantisation (pulses of weight Q at
both ends cause Q²/6T²).

If a vehicle (or its sensor block on a turntable) is turned between sessions, the errors of the instruments turn with
it. Every instrument error then enters the mean of the determined headings, each minus its known turn, with the mean of
its coefficients. Over two opposite headings the biases cancel, over four at right angles the scale factors, too.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sinssim.alignment.parked_theory import (
    EQUATOR,
    RANDOM_WALK_FACTOR,
    Angles,
    Attitude,
    Coefficients,
    InstrumentErrors,
    check_broadcast,
    coefficients,
    ideal_readings,
    linear,
    local_gravity,
)
from sinssim.arguments import POSITIVE, check_kind, number, numbers
from sinssim.data import Array
from sinssim.earth.ellipsoids import OMEGA_IE
from sinssim.errors import InputError, check_name
from sinssim.sensors import flicker
from sinssim.sensors.imu.emulation import of_output
from sinssim.sensors.imu.error_term_table import of_triad
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp, check_sigmas
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.redundant_set_errors import combined_sigma

Method = Literal["quiet", "disturbed", "disturbed, latitude known"]
"""Eq. (1) on a quiet base, or the inertial fit on a disturbed base with unknown or known latitude."""

_NOISES = ("rate random walk", "bias instability", "flicker")
_AVERAGED = ("random walk", "quantisation")


def _sources(triad: str, name: str, integral: str) -> tuple[str, ...]:
    constant = dict.fromkeys(term.source for term in of_triad(triad) if term.multiplies is not None)
    return (*(f"{name} {source}" for source in (*constant, *_NOISES)), *(f"{integral} {each}" for each in _AVERAGED))


OF_GYROS = _sources("gyro", "gyro", "angle")
"""The sources that act through the rates; the others act through the specific forces."""

SOURCES = (*OF_GYROS, *_sources("accel", "accelerometer", "velocity"))
"""The sources of error, in the order of tables and bars. Faults and ranges are not part of budgets."""

MOTION = "motion of the base"
"""The source that depends on the session itself: undetected motion."""

SLOW = tuple(source for source in SOURCES if source.endswith(("instability", "flicker")))
"""Noises that hardly change within a session of usual length."""

AVERAGED = (*SLOW, *(source for source in SOURCES if source.startswith(("angle", "velocity"))))
"""The sources that a longer session reduces."""

INSTANTS = 10_000  # instants of a session, over which the null shift is averaged
_SHORTEST, _LONGEST = 1e-6, 1e12  # limits of session lengths, s; a crossing beyond them does not count


class Expected(NamedTuple):
    """The known part of a sensor block's errors, and the standard deviations of the unknown part."""

    mean: ImuErrors
    sigma: ImuErrors

    @property
    def instrument_sigmas(self) -> InstrumentErrors:
        """Standard deviations of biases and scale factors, for the paper's theory."""
        gyro, accel = self.sigma.gyro, self.sigma.accel
        return InstrumentErrors(gyro.bias, gyro.scale, accel.bias, accel.scale)


def expected_errors(imu: Imu) -> Expected:
    """Return means and standard deviations of the errors of a sensor block.

    The mean is the given error, otherwise zero. The standard deviation is the given one; if there is none, it is zero
    beside a given error, otherwise that of the grade.

    Args:
        imu: the sensor block.

    Returns:
        Means and standard deviations, SI; for a redundant set those of the combination of all sensors.

    Raises:
        InputError: the argument is no sensor block.
    """
    check_kind("imu", imu, Imu, "Imu, for example Imu(grade='tactical')")
    return Expected(imu.mean, combined_sigma(of_output(imu.sigma, imu), imu))


def reading_errors(
    errors: ImuErrors, gyro: Array, accel: Array, duration: float, start: float = 0.0
) -> tuple[Array, Array]:
    """Return the errors of mean readings at rest by known sensor errors, to first order, (3,) rad/s and (3,) m/s².

    `gyro` and `accel` are the ideal readings in the same units. The session lasts `duration` s and begins `start` s
    after the sensors were switched on. Noise is neglected.
    """
    warmth = float(mean_warmth(errors.warm_up, duration, start))

    def reading(triad: TriadErrors, x: Array) -> Array:
        middle = start + 0.5 * duration
        return sum((term.effect(value, x, accel, warmth, middle) for term, value in triad.acting), np.zeros(3))

    rates = reading(errors.gyro, gyro)
    if errors.null_shift is not None:
        instants = start + duration * (np.arange(INSTANTS) + 0.5) / INSTANTS
        rates = rates + errors.null_shift.bias(errors.warm_up.temperature(instants)).mean()
    return rates, reading(errors.accel, accel)


def mean_warmth(warm_up: WarmUp, duration: ArrayLike, start: ArrayLike = 0.0) -> Array:
    """Return the mean temperature Θ̄ of a sensor block over a session, K above that of the calibration.

    The session lasts `duration` s and begins `start` s after the sensors were switched on.
    """
    x = np.asarray(duration, dtype=np.float64) / warm_up.time_constant
    begun = np.exp(-np.asarray(start, dtype=np.float64) / warm_up.time_constant)
    return np.asarray(warm_up.steady - (warm_up.start - warm_up.steady) * begun * np.expm1(-x) / x)


def error_budget(
    attitude: Attitude,
    latitude: ArrayLike,
    sigma: ImuErrors,
    duration: ArrayLike,
    *,
    method: Method = "quiet",
    gravity: ArrayLike | None = None,
    start: float = 0.0,
    rate_hz: float = 100.0,
) -> dict[str, Angles]:
    """Return the standard deviation of every angle by every source.

    On a disturbed base, the heading error by angle random walk is larger because of the weights of the fit. The other
    angles, which that method determines at the end of the session, are given as on a quiet base. The latitude follows
    from cosφ in the fit, or is known without error. Drifts act by their plain mean, too.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        sigma: standard deviations of the sensor block's errors.
        duration: length of the session, s, broadcasting.
        method: see `Method`.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.
        start: time from when the sensors were switched on to the session's first sample, s.
        rate_hz: samples per second; the memory of flicker noise is 4·10⁶ samples.

    Returns:
        Standard deviations by source, rad.

    Raises:
        InputError: as for `coefficients` and `reading_variances`.
    """
    check_name("method", method, get_args(Method))
    c = coefficients(attitude, latitude, gravity=gravity)
    gyro, accel = ideal_readings(*attitude, latitude, gravity=gravity)
    if method != "quiet":
        c = cone_coefficients(c, latitude, gravity, known=method != "disturbed")
    squares = Coefficients(*(value**2 for value in c))
    zero = np.zeros(3)
    budget = {}
    check_broadcast({"attitude, latitude and gravity": accel[..., 0], "duration": numbers("duration", duration)})
    variances = reading_variances(sigma, gyro, accel, duration, method, start=start, rate_hz=rate_hz)
    for source, variance in variances.items():
        pair = (variance, zero) if source in OF_GYROS else (zero, variance)
        budget[source] = Angles(*(np.sqrt(value) for value in linear(squares, *pair)))
    return budget


def reading_variances(
    sigma: ImuErrors,
    gyro: Array,
    accel: Array,
    duration: ArrayLike,
    method: Method = "quiet",
    *,
    start: float = 0.0,
    rate_hz: float = 100.0,
) -> dict[str, Array]:
    """Return the variance of every axis's mean reading over a session by source, (..., 3) (rad/s)² or (m/s²)².

    `gyro` and `accel` are the ideal readings, (..., 3) rad/s and m/s². The session lasts `duration` s, broadcasting
    with their leading shape, and begins `start` s after the sensors were switched on.
    """
    check_sigmas(sigma)
    check_name("method", method, get_args(Method))
    start, rate_hz = number("start", start, "s", low=0.0), number("rate_hz", rate_hz, "Hz", low=POSITIVE)
    time = numbers("duration", duration)
    if not (np.all(time > 0.0) and np.all(time < np.inf)):
        raise InputError(f"a session of {np.min(time):g} s: its length must be positive and finite.")
    warmth, middle = mean_warmth(sigma.warm_up, time, start), start + 0.5 * time
    time = time[..., None]
    flickering = flicker.variance_of_mean(np.maximum(time * rate_hz, 1.0))
    variances: dict[str, Array] = {}
    for triad, ideal, sensor, integral in (
        (sigma.gyro, gyro, "gyro", "angle"), (sigma.accel, accel, "accelerometer", "velocity"),
    ):  # fmt: skip
        variances |= {source: np.zeros_like(ideal) for source in SOURCES if source.startswith(sensor)}
        for term, value in triad.acting:
            known = (value * term.inputs(ideal, accel, warmth, middle)) ** 2
            source = f"{sensor} {term.source}"
            variances[source] = variances[source] + (known.sum(axis=-1) if term.size > 3 else known)
        fit = RANDOM_WALK_FACTOR if method != "quiet" and triad is sigma.gyro else 1.0
        variances |= {
            f"{sensor} rate random walk": triad.rate_walk**2 * (start + time / 3.0),
            f"{sensor} bias instability": _averaged_instability(triad, time),
            f"{sensor} flicker": triad.flicker**2 * flickering,
            f"{integral} random walk": fit * triad.random_walk**2 / time,
            f"{integral} quantisation": triad.quantum**2 / (6.0 * time**2),
        }
    return {source: variances[source] for source in SOURCES}


def cone_coefficients(c: Coefficients, latitude: ArrayLike, gravity: ArrayLike | None, known: bool) -> Coefficients:
    """Return the coefficients of the fit on a disturbed base, with cosφ = (horizontal rate)/U from the cone's opening.

    The latitude is in rad, g in m/s² or None for normal gravity; `known` says whether the fit is given the latitude.
    """
    if known:
        return c._replace(p=np.zeros_like(c.p), r=np.zeros_like(c.r))
    phi = np.asarray(latitude, dtype=np.float64)[..., None]
    if np.any(np.abs(phi) < EQUATOR):
        raise InputError(
            f"the latitude is within {np.degrees(EQUATOR):g} deg of the equator, where gravity's cone does "
            "not determine it."
        )
    g = local_gravity(np.asarray(latitude, dtype=np.float64), gravity)[..., None]
    # N = g r on the body axes. A rate error along north opens the cone: δφ = −δω_N / (U sinφ). A tilt acts as in (10).
    return c._replace(p=-c.r * g / (OMEGA_IE * np.sin(phi)))


def _averaged_instability(triad: TriadErrors, time: Array) -> Array:
    """Return the variance of the mean of a first-order Gauss-Markov process over the session."""
    x = time / triad.correlation_time
    # 2 (x − 1 + e^−x)/x², as a series where it would lose digits
    shape = np.where(x < 1e-3, 1.0 - x / 3.0, 2.0 * (x + np.expm1(-x)) / x**2)
    return np.asarray(triad.instability**2 * shape)


def total(budget: dict[str, Angles], sources: tuple[str, ...] | None = None) -> Angles:
    """Return the root of the sum of squares over sources.

    Args:
        budget: standard deviations by source.
        sources: sources to sum; all by default.

    Returns:
        Standard deviations.
    """
    return Angles(
        *(
            np.sqrt(sum((budget[source][k] ** 2 for source in sources or budget), np.zeros(())))
            for k in range(len(Angles._fields))
        )
    )


def bias_takes_over(
    attitude: Attitude,
    latitude: ArrayLike,
    sigma: ImuErrors,
    *,
    method: Method = "quiet",
    gravity: ArrayLike | None = None,
    start: float = 0.0,
    rate_hz: float = 100.0,
) -> Angles:
    """Return the session length at which the errors reduced by averaging equal the others.

    A longer session gains at most a factor √2 in the standard deviation.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        sigma: standard deviations of the sensor block's errors.
        method: see `Method`.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.
        start, rate_hz: as for `error_budget`.

    Returns:
        Session lengths by angle, s; infinite if all errors are averaged, 0 if none are.

    Raises:
        InputError: as for `error_budget`.
    """
    from scipy.optimize.elementwise import find_root

    place = (*attitude, latitude, local_gravity(np.asarray(latitude, float), gravity))
    places = np.broadcast_arrays(*(np.asarray(value, float) for value in place))
    steady = tuple(source for source in SOURCES if source not in AVERAGED)
    tiny = np.finfo(float).tiny

    def ratio(log_time: Array, angle: NDArray[np.intp], *place: Array) -> Array:
        """Return the logarithm of the averaged errors over the others, of one angle at each place."""
        budget = error_budget(
            Attitude(*place[:3]), place[3], sigma, np.exp(log_time), method=method, gravity=place[4], start=start,
            rate_hz=rate_hz,
        )  # fmt: skip
        averaged, lasting = (
            np.choose(angle, [np.broadcast_to(value, angle.shape) for value in total(budget, sources)])
            for sources in (AVERAGED, steady)
        )
        # where nothing acts, it is negative
        return np.asarray(np.log(np.maximum(averaged, tiny)) - np.log(np.maximum(lasting, 2.0 * tiny)))

    rows = np.arange(len(Angles._fields)).reshape(-1, *(1,) * places[0].ndim)
    ends = np.log(_SHORTEST), np.log(_LONGEST)
    root = find_root(ratio, ends, args=(rows, *places))
    return Angles(*np.where(root.success, np.exp(root.x), np.where(root.f_bracket[1] > 0.0, np.inf, 0.0)))


class BestHeadings(NamedTuple):
    """A set of headings and its standard deviations."""

    headings: Array  # headings in [0, 2π), (count,) rad
    sigma: Angles  # standard deviations of the mean determination, rad
    worst: float  # standard deviation of the chosen angle at the worst orientation of the set, rad


def set_sigma(
    attitude: Attitude,
    latitude: ArrayLike,
    sigma: ImuErrors,
    duration: ArrayLike,
) -> Angles:
    """Return the standard deviations of a determination averaged over a set of positions, rad.

    The last axis of `attitude`, rad, counts the positions; latitude, rad, `duration` of all sessions together, s, split
    evenly, and gravity, m/s², broadcast without it. The errors of one run (bias, scale factor, misalignment, …, and the
    slow bias instability and flicker) are the same in every position. Ramp, temperature and rate random walk continue
    from one position to the next, in order and without a pause, from when the sensors are switched on. Noise is
    independent in each position. Roll and pitch are those of the positions, with averaged errors.
    """
    phi = np.asarray(latitude, dtype=np.float64)[..., None]
    attitude = Attitude(*np.broadcast_arrays(*attitude))
    count = np.shape(attitude.heading)[-1]
    c = coefficients(attitude, phi)
    gyro, accel = ideal_readings(*attitude, phi)
    each = np.asarray(duration, dtype=np.float64)[..., None] / count
    noise = reading_variances(sigma, gyro, accel, each)
    position = np.arange(count)
    earlier = np.minimum.outer(position, position) + 0.5 - np.eye(count) / 6.0  # within one position T/3
    drift = _Drift(
        each * (position + 0.5), mean_warmth(sigma.warm_up, each, each * position), each[..., None] * earlier
    )
    zero = np.zeros_like(c.m)
    variances = []
    for by_rate, by_force in ((c.m, c.n), (zero, c.q), (zero, c.l), (c.p, c.r)):
        variance = _carried(by_rate, gyro, accel, sigma.gyro, drift)
        variance = variance + _carried(by_force, accel, accel, sigma.accel, drift)
        for source in AVERAGED:
            weight = by_rate if source in OF_GYROS else by_force
            if source in SLOW:  # hardly changes from one position to the next
                variance = variance + (weight.mean(axis=-2) ** 2 * noise[source].mean(axis=-2)).sum(axis=-1)
            else:
                variance = variance + (weight**2 * noise[source]).sum(axis=(-2, -1)) / count**2
        variances.append(variance)
    return Angles(*(np.sqrt(variance) for variance in variances))


class _Drift(NamedTuple):
    """Drifts between successive positions of a set."""

    middle: Array  # time to the middle of each position, (..., count) s
    warmth: Array  # mean temperature in each position, (..., count) K
    walk: Array  # covariance of the means of a unit random walk in the positions, (..., count, count) s


def _carried(weight: Array, ideal: Array, force: Array, triad: TriadErrors, drift: _Drift) -> Array:
    """Return the variance by errors that are common to all positions or drift: (mean coefficient)² σ²."""
    walk = np.einsum("...ki,...kl,...li->...", weight, drift.walk, weight) / weight.shape[-2] ** 2
    variance = triad.rate_walk**2 * walk
    for term, sigma in triad.acting:
        inputs, matrix = term.inputs(ideal, force, drift.warmth, drift.middle), len(term.shape) == 2
        mean = (weight[..., None] * inputs).mean(axis=-3) if matrix else (weight * inputs).mean(axis=-2)
        variance = variance + (mean**2 * sigma**2).sum(axis=(-2, -1) if matrix else -1)
    return np.asarray(variance)


def best_headings(
    count: int,
    latitude: float,
    sigma: ImuErrors,
    duration: float,
    *,
    roll: float = 0.0,
    pitch: float = 0.0,
    angle: str = "heading",
) -> BestHeadings:
    """Find the evenly spaced headings that minimise the error of an angle.

    Args:
        count: number of headings: 1, 2, 4 ...
        latitude: rad.
        sigma: standard deviations of the sensor block's errors.
        duration: length of all sessions together, s.
        roll, pitch: the vehicle's tilt, rad.
        angle: the angle whose error is minimised: "heading" or "latitude" (errors of roll and pitch do not depend on
            heading).

    Returns:
        The headings and their standard deviations; of several equally good sets, the one nearest to north.

    Raises:
        InputError: the count is below 1, the angle is neither of the two, or as for `coefficients`.
    """
    if count < 1:
        raise InputError(f"a set of {count} headings: there must be at least one.")
    if angle not in ("heading", "latitude"):
        raise InputError(f"the error of the {angle} does not depend on the heading; choose heading or latitude.")
    spread = 2.0 * np.pi * np.arange(count) / count

    def value(first: Array) -> Array:
        attitude = Attitude(first[..., None] + spread, roll, pitch)
        return np.asarray(getattr(set_sigma(attitude, latitude, sigma, duration), angle))

    def one_value(first: float) -> float:
        return float(value(np.asarray(first)))

    from scipy.optimize import minimize_scalar

    step = np.radians(0.5)
    grid = np.arange(0.0, 2.0 * np.pi / count, step)
    values = value(grid)
    start = float(grid[np.argmax(values <= values.min() * (1.0 + 1e-12))])
    refined = minimize_scalar(one_value, bounds=(start - step, start + step), method="bounded")
    first = float(refined.x) if refined.fun < one_value(start) * (1.0 - 1e-12) else start
    headings = np.mod(first + spread, 2.0 * np.pi)
    sigma_there = set_sigma(Attitude(headings, roll, pitch), latitude, sigma, duration)
    return BestHeadings(headings, sigma_there, float(values.max()))
