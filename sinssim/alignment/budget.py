"""What error to expect of a determination and from what: instruments, session length, method.

The paper's twelve errors are those that no session averages. Around them stand misalignment and non-linearity, which at
rest is a bias K₂x² + K₃x³ of every axis whose ideal reading is x, and what a session of length T does average: random
walk (variance N²/T of a mean reading), quantisation (a pulse of weight Q at either end leaves Q²/6T²) and bias
instability (the mean of a first-order Gauss-Markov process).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sinssim.alignment.axes import Angles, Array, Attitude
from sinssim.alignment.determination import ideal_readings, local_gravity
from sinssim.alignment.disturbed import EQUATOR, RANDOM_WALK_FACTOR
from sinssim.alignment.theory import Coefficients, InstrumentErrors, coefficients, linear
from sinssim.earth_models import OMEGA_IE
from sinssim.errors import InputError
from sinssim.scenario.grades import find_grade
from sinssim.scenario.imu import ImuSection
from sinssim.sensors.imu_errors import ImuErrors, TriadErrors
from sinssim.units import ARCSEC, DEG_H, PPM, PPM_PER_DEG2_S2, PPM_PER_DEG_S, UG, UG_PER_G2, UG_PER_G3

Method = Literal["quiet", "disturbed", "disturbed, latitude known"]
"""Eq. (1) on a quiet base, or the inertial fit on a disturbed one, which finds the latitude or is given it."""

SOURCES = (
    "gyro bias",
    "gyro scale factor",
    "gyro misalignment",
    "gyro non-linearity",
    "gyro bias instability",
    "angle random walk",
    "angle quantisation",
    "accelerometer bias",
    "accelerometer scale factor",
    "accelerometer misalignment",
    "accelerometer non-linearity",
    "accelerometer bias instability",
    "velocity random walk",
    "velocity quantisation",
)
"""The sources of error, in the order of tables and bars: those that grades have. Of what else a sensor block may have
(flicker, rate random walk, ramp, temperature, g-sensitivity, non-linearity and faults) no budget here knows."""

OF_GYROS = SOURCES[:7]
"""The sources that act through the rates; the others act through the specific forces."""

AVERAGED = tuple(source for source in SOURCES if source.split()[-1] in ("instability", "walk", "quantisation"))
"""The sources that a longer session makes smaller."""


_SHORTEST, _LONGEST = 1e-6, 1e12  # session lengths beyond which a crossing counts as none, s


class Expected(NamedTuple):
    """The known part of a sensor block's errors, and the standard deviations of the unknown part."""

    mean: ImuErrors
    sigma: ImuErrors

    @property
    def instrument_sigmas(self) -> InstrumentErrors:
        """Standard deviations of biases and scale factors, as the paper's theory takes them."""
        gyro, accel = self.sigma.gyro, self.sigma.accel
        return InstrumentErrors(gyro.bias, gyro.scale, accel.bias, accel.scale)

    @property
    def instrument_means(self) -> InstrumentErrors:
        """Known biases and scale-factor errors."""
        gyro, accel = self.mean.gyro, self.mean.accel
        return InstrumentErrors(gyro.bias, gyro.scale, accel.bias, accel.scale)


def expected_errors(section: ImuSection) -> Expected:
    """Return means and standard deviations of the errors that a sensor section describes.

    What the section fixes is a mean without spread; what it leaves to be drawn has the section's or the grade's
    standard deviation.

    Args:
        section: the [imu] section of a scenario.

    Returns:
        Means and standard deviations, SI.
    """
    from sinssim.sensors import draw

    some_run, grade, s = draw(section, 0), find_grade(section.grade), section
    gyro = _triad(
        some_run.gyro,
        _part(s.gyro_bias_deg_h, s.gyro_bias_sigma_deg_h, DEG_H, grade.gyro.bias),
        _part(s.gyro_scale_ppm, s.gyro_scale_sigma_ppm, PPM, grade.gyro.scale),
        _part(s.gyro_misalignment_arcsec, s.gyro_misalignment_sigma_arcsec, ARCSEC, grade.gyro.misalignment),
        _part(s.gyro_quadratic_ppm_per_deg_s, s.gyro_quadratic_sigma_ppm_per_deg_s, PPM_PER_DEG_S, 0.0),
        _part(s.gyro_cubic_ppm_per_deg2_s2, s.gyro_cubic_sigma_ppm_per_deg2_s2, PPM_PER_DEG2_S2, 0.0),
    )
    accel = _triad(
        some_run.accel,
        _part(s.accel_bias_ug, s.accel_bias_sigma_ug, UG, grade.accel.bias),
        _part(s.accel_scale_ppm, s.accel_scale_sigma_ppm, PPM, grade.accel.scale),
        _part(s.accel_misalignment_arcsec, s.accel_misalignment_sigma_arcsec, ARCSEC, grade.accel.misalignment),
        _part(s.accel_quadratic_ug_per_g2, s.accel_quadratic_sigma_ug_per_g2, UG_PER_G2, 0.0),
        _part(s.accel_cubic_ug_per_g3, s.accel_cubic_sigma_ug_per_g3, UG_PER_G3, 0.0),
    )
    return Expected(ImuErrors(gyro[0], accel[0]), ImuErrors(gyro[1], accel[1]))


def _part(fixed: tuple[float, ...] | None, sigma: float | None, unit: float, of_grade: float) -> tuple[Array, Array]:
    """Return mean and standard deviation of one error that differs from run to run."""
    if fixed is not None:
        return np.array(fixed) * unit, np.zeros(())
    return np.zeros(()), np.asarray(of_grade if sigma is None else sigma * unit)


_MeanAndSigma = tuple[Array, Array]


def _triad(
    some_run: TriadErrors,
    bias: _MeanAndSigma,
    scale: _MeanAndSigma,
    misalignment: _MeanAndSigma,
    quadratic: _MeanAndSigma,
    cubic: _MeanAndSigma,
) -> list[TriadErrors]:
    """Return means and standard deviations of one triad; what is noise is the same in every run."""
    off_diagonal = ~np.eye(3, dtype=bool)
    triads = []
    for k in range(2):
        matrix = np.zeros((3, 3))
        matrix[off_diagonal] = misalignment[k]  # row by row: xy, xz, yx, yz, zx, zy
        triads.append(
            replace(
                some_run,
                bias=np.broadcast_to(bias[k], 3),
                scale=np.broadcast_to(scale[k], 3),
                misalignment=matrix,
                quadratic=np.broadcast_to(quadratic[k], 3),
                cubic=np.broadcast_to(cubic[k], 3),
            )
        )
    return triads


def reading_errors(errors: ImuErrors, gyro: Array, accel: Array) -> tuple[Array, Array]:
    """Return what constant errors of the sensors make of mean readings at rest, to first order in the errors.

    Args:
        errors: of the sensor block; its noise is left out.
        gyro: ideal rates, (3,) rad/s.
        accel: ideal specific forces, (3,) m/s².

    Returns:
        Errors of the rates, (3,) rad/s, and of the specific forces, (3,) m/s².
    """

    def of_triad(triad: TriadErrors, x: Array) -> Array:
        linear = (np.diag(triad.scale) + triad.misalignment) @ x
        return triad.bias + linear + triad.quadratic * x**2 + triad.cubic * x**3

    return of_triad(errors.gyro, gyro), of_triad(errors.accel, accel)


def error_budget(
    attitude: Attitude,
    latitude: ArrayLike,
    sigma: ImuErrors,
    duration: ArrayLike,
    *,
    method: Method = "quiet",
    gravity: ArrayLike | None = None,
) -> dict[str, Angles]:
    """Return the standard deviation of every angle from every source.

    For a disturbed base the heading's part from angle random walk grows as the fit weighs it; the other angles of
    that method, taken at the session's end rather than over it, are given as on a quiet base, except the latitude,
    which the fit finds from cosφ, or which is known and then has no error.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        sigma: standard deviations of the sensor block's errors.
        duration: length of the session, s, broadcasting.
        method: see `Method`.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        By source, standard deviations, rad.

    Raises:
        InputError: as `coefficients`, or a duration that is not positive.
    """
    c = coefficients(attitude, latitude, gravity=gravity)
    gyro, accel = ideal_readings(*attitude, latitude, gravity=gravity)
    if method != "quiet":
        c = cone_coefficients(c, latitude, gravity, known=method != "disturbed")
    squares = Coefficients(*(value**2 for value in c))
    zero = np.zeros(3)
    budget = {}
    for source, variance in reading_variances(sigma, gyro, accel, duration, method).items():
        pair = (variance, zero) if source in OF_GYROS else (zero, variance)
        budget[source] = Angles(*(np.sqrt(value) for value in linear(squares, *pair)))
    return budget


def reading_variances(
    sigma: ImuErrors, gyro: Array, accel: Array, duration: ArrayLike, method: Method = "quiet"
) -> dict[str, Array]:
    """Return by source the variance of every axis's mean reading over a session.

    Args:
        sigma: standard deviations of the sensor block's errors.
        gyro: ideal rates, (..., 3) rad/s.
        accel: ideal specific forces, (..., 3) m/s².
        duration: length of the session, s, broadcasting with the readings' leading shape.
        method: see `Method`.

    Returns:
        By source, (..., 3) (rad/s)² or (m/s²)².

    Raises:
        InputError: a duration that is not positive.
    """
    time = np.asarray(duration, dtype=np.float64)
    if not np.all(time > 0.0):
        raise InputError(f"a session of {np.min(time):g} s: its length must be positive.")
    variances: dict[str, Array] = {}
    for name, noise, triad, ideal in (
        ("gyro", "angle", sigma.gyro, gyro),
        ("accelerometer", "velocity", sigma.accel, accel),
    ):
        factor = RANDOM_WALK_FACTOR if method != "quiet" and name == "gyro" else 1.0
        variances |= {
            f"{name} bias": triad.bias**2,
            f"{name} scale factor": (triad.scale * ideal) ** 2,
            f"{name} misalignment": ideal**2 @ (triad.misalignment**2).T,
            f"{name} non-linearity": (triad.quadratic * ideal**2) ** 2 + (triad.cubic * ideal**3) ** 2,
            f"{name} bias instability": _averaged_instability(triad, time)[..., None],
            f"{noise} random walk": factor * (triad.random_walk**2 / time)[..., None],
            f"{noise} quantisation": (triad.quantum**2 / (6.0 * time**2))[..., None],
        }
    return variances


def cone_coefficients(c: Coefficients, latitude: ArrayLike, gravity: ArrayLike | None, known: bool) -> Coefficients:
    """Return the coefficients with the latitude's taken from the cone's opening, cosφ = (horizontal rate)/U.

    Args:
        c: coefficients of eq. (1).
        latitude: rad.
        gravity: g, m/s², or None for normal gravity.
        known: whether the fit is given the latitude.

    Returns:
        Coefficients of the fit on a disturbed base.

    Raises:
        InputError: a latitude at which the cone's opening hardly depends on it.
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


def total(budget: dict[str, Angles], sources: tuple[str, ...] = SOURCES) -> Angles:
    """Return the root of the sum of squares over sources.

    Args:
        budget: by source, standard deviations.
        sources: which sources to sum.

    Returns:
        Standard deviations.
    """
    return Angles(
        *(
            np.sqrt(sum((budget[source][k] ** 2 for source in sources), np.zeros(())))
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
) -> Angles:
    """Return the session length at which what a session averages has fallen to what it does not average.

    A longer session gains at most a factor √2 in the standard deviation.

    Args:
        attitude: heading, roll, pitch, rad, broadcasting.
        latitude: rad, broadcasting.
        sigma: standard deviations of the sensor block's errors.
        method: see `Method`.
        gravity: g, m/s², broadcasting; by default normal gravity on the ellipsoid at the latitude.

    Returns:
        Session lengths by angle, s; infinite where nothing but averaged errors acts, 0 where nothing is averaged.

    Raises:
        InputError: as `error_budget`.
    """
    shape = np.broadcast_shapes(*(np.shape(value) for value in (*attitude, latitude, gravity) if value is not None))
    count = len(Angles._fields)
    low, high = np.full((count, *shape), _SHORTEST), np.full((count, *shape), _LONGEST)  # an angle a row
    steady = tuple(source for source in SOURCES if source not in AVERAGED)
    for _ in range(80):  # bisection of the logarithm
        middle = np.sqrt(low * high)
        budget = error_budget(attitude, latitude, sigma, middle, method=method, gravity=gravity)
        averaged, lasting = (
            np.stack([np.broadcast_to(value, middle.shape)[k] for k, value in enumerate(total(budget, sources))])
            for sources in (AVERAGED, steady)
        )
        noisy = averaged > lasting
        low, high = np.where(noisy, middle, low), np.where(noisy, high, middle)
    return Angles(*np.where(low > 0.99 * _LONGEST, np.inf, np.where(high < 1.01 * _SHORTEST, 0.0, high)))
