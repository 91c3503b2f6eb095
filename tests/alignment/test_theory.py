"""Eqs. (7)-(26): derivatives against differences of eq. (1), the printed special cases, a Monte Carlo run."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.alignment import (
    Attitude,
    InstrumentErrors,
    coefficients,
    determine,
    error_statistics,
    errors,
    ideal_readings,
    paper_axes,
)
from sinssim.alignment.determination import solve
from sinssim.alignment.parked_theory import RANDOM_WALK_FACTOR
from sinssim.earth.ellipsoids import OMEGA_IE as U
from sinssim.errors import InputError
from sinssim.units import ARCMIN, ARCSEC, DEG_H, PPM, UG
from tests.slow import slow

G = 9.81
LASER = InstrumentErrors(0.01 * DEG_H, 10 * PPM, 50 * UG, 50 * PPM)


def random_cases(seed, count, tilt=85.0):
    """Attitudes and latitudes spread evenly in angle, the roll all the way round."""
    rng = np.random.default_rng(seed)
    heading, roll = rng.uniform(-np.pi, np.pi, (2, count))
    pitch, latitude = np.radians(rng.uniform(-tilt, tilt, (2, count)))
    return Attitude(heading, roll, pitch), latitude


def random_errors(rng, count=None):
    """Instrument errors that differ on every axis."""
    shape = (3,) if count is None else (count, 3)
    return InstrumentErrors(
        *(size * rng.uniform(0.2, 1.0, shape) for size in (0.01 * DEG_H, 10 * PPM, 50 * UG, 50 * PPM))
    )


def scaled(instruments, factor):
    """The same errors, all larger or smaller by one factor."""
    return InstrumentErrors(*(factor * np.asarray(value) for value in vars(instruments).values()))


def differences(attitude, latitude):
    """Central differences of eq. (1), twice, so that the error is of fourth order in the step: (6, N, 4)."""
    gyro, accel = ideal_readings(*attitude, latitude, gravity=G)
    rows = []
    for index in range(6):
        # a thousandth of the smallest part that matters: of the horizontal Earth rate, of gravity across the axis
        step = 1e-3 * np.cos(attitude.pitch) * (U * np.cos(latitude) if index < 3 else G * np.cos(latitude))
        d = []
        for factor in (1.0, 2.0):
            vector = np.zeros((len(step), 3))
            vector[:, index % 3] = factor * step
            ends = [
                np.stack(solve(gyro + sign * vector * (index < 3), accel + sign * vector * (index >= 3))[0], axis=-1)
                for sign in (1.0, -1.0)
            ]
            change = (ends[0] - ends[1] + np.pi) % (2 * np.pi) - np.pi
            d.append(change / (2.0 * factor * step[:, None]))
        rows.append((4.0 * d[0] - d[1]) / 3.0)
    return np.array(rows)


def test_coefficients_are_the_derivatives_of_the_determination():
    attitude, latitude = random_cases(3, 10_000)
    c = coefficients(attitude, latitude, gravity=G)
    numeric = differences(attitude, latitude)
    zero = np.zeros_like(c.m)
    for k, (by_rate, by_force) in enumerate([(c.m, c.n), (zero, c.q), (zero, c.l), (c.p, c.r)]):
        for analytic, computed in ((by_rate, numeric[:3, :, k].T), (by_force, numeric[3:, :, k].T)):
            size = np.linalg.norm(analytic, axis=-1)
            relative = np.linalg.norm(computed - analytic, axis=-1) / np.where(size > 0, size, 1.0)
            assert relative.max() < 1e-7


def test_errors_are_the_change_of_the_determination_to_first_order():
    attitude, latitude = random_cases(4, 10_000, tilt=80.0)
    instruments = random_errors(np.random.default_rng(5), 10_000)
    readings = ideal_readings(*attitude, latitude, gravity=G)

    def changes(factor):
        ends = [solve(*scaled(instruments, sign * factor).apply(*readings))[0] for sign in (1.0, -1.0)]
        return (np.subtract(*ends) + np.pi) % (2 * np.pi) - np.pi

    central = (8.0 * changes(0.1) - changes(0.2)) / 1.2  # of fourth order in the size of the errors
    for computed, analytic in zip(central, errors(attitude, latitude, instruments, gravity=G), strict=True):
        np.testing.assert_allclose(computed, analytic, rtol=1e-7, atol=1e-14)


def test_signs_and_orders_of_magnitude():
    """0.01 deg/h on the east axis at 50 deg is 3.6 arcmin of heading; 50 µg are 10 arcsec of tilt."""
    level = Attitude(0.0, 0.0, 0.0)  # facing north: the right axis points east
    heading = errors(level, np.radians(50.0), InstrumentErrors(gyro_bias=[0.0, 0.01 * DEG_H, 0.0])).heading
    assert heading / ARCMIN == pytest.approx(-3.56, abs=0.005)
    pitch = errors(level, 0.8, InstrumentErrors(accel_bias=[50 * UG, 0.0, 0.0])).pitch
    assert pitch / ARCSEC == pytest.approx(10.31, abs=0.02)  # forward force as of a raised nose
    roll = errors(level, 0.8, InstrumentErrors(accel_bias=[0.0, 50 * UG, 0.0])).roll
    assert roll / ARCSEC == pytest.approx(-10.31, abs=0.02)  # force to the right as of a raised right wing
    # a rate up the plumb line shows as more of sin(latitude)
    latitude = errors(level, 0.0, InstrumentErrors(gyro_bias=[0.0, 0.0, -0.01 * DEG_H])).latitude
    assert latitude / ARCMIN == pytest.approx(np.degrees(0.01 / 15.041067) * 60, rel=1e-4)


# --- the printed special cases, in the axes they are printed in: x right, y forward, z up -------------------------


def printed(instruments):
    """Means or sigmas by the names of the printed equations, from forward-right-down."""
    order = np.array([1, 0, 2])
    sign = np.array([1.0, 1.0, -1.0])  # of the means of biases; squares do not see it
    return (
        sign * np.asarray(instruments.gyro_bias)[..., order],
        np.asarray(instruments.gyro_scale)[..., order],
        sign * np.asarray(instruments.accel_bias)[..., order],
        np.asarray(instruments.accel_scale)[..., order],
    )


@pytest.fixture(scope="module")
def level():
    """General statistics of level vehicles, and the names of (13)-(15) and (24)-(26)."""
    rng = np.random.default_rng(6)
    K, phi = rng.uniform(-np.pi, np.pi, 500), np.radians(rng.uniform(-85, 85, 500))
    means, sigmas = random_errors(rng), random_errors(rng)
    return K, phi, means, sigmas, error_statistics(Attitude(K, 0.0, 0.0), phi, means, sigmas, gravity=G)


@pytest.fixture(scope="module")
def tilted():
    """General statistics of tilted vehicles, for (16)-(21)."""
    rng = np.random.default_rng(7)
    attitude, phi = random_cases(8, 500, tilt=80.0)
    means, sigmas = random_errors(rng), random_errors(rng)
    return attitude, means, sigmas, error_statistics(attitude, phi, means, sigmas, gravity=G)


def close(computed, terms):
    """Equal to 1e-12 of the largest term of the printed sum."""
    scale = np.max([np.abs(np.broadcast_to(term, computed.shape)) for term in terms], axis=0)
    assert np.max(np.abs(computed - sum(terms)) / scale) < 1e-12


def test_13_mean_heading_level(level):
    K, phi, means, _, statistics = level
    w0, k, a0, _ = printed(means)
    s, c = np.sin(K), np.cos(K)
    close(
        statistics.mean.heading,
        [
            -w0[0] * c / (U * np.cos(phi)),
            -w0[1] * s / (U * np.cos(phi)),
            0.5 * k[0] * np.sin(2 * K),
            -0.5 * k[1] * np.sin(2 * K),
            np.tan(phi) * a0[0] * c / G,
            np.tan(phi) * a0[1] * s / G,
        ],
    )


def test_14_variance_heading_level(level):
    K, phi, _, sigmas, statistics = level
    w0, k, a0, _ = (v**2 for v in printed(sigmas))
    s2, c2 = np.sin(K) ** 2, np.cos(K) ** 2
    close(
        statistics.sigma.heading**2,
        [
            (w0[0] * c2 + w0[1] * s2) / (U * np.cos(phi)) ** 2,
            0.25 * (k[0] + k[1]) * np.sin(2 * K) ** 2,
            (np.tan(phi) / G) ** 2 * (a0[0] * c2 + a0[1] * s2),
        ],
    )


def test_15_variance_heading_level_identical_instruments(level):
    K, phi, *_ = level
    sigma = error_statistics(Attitude(K, 0.0, 0.0), phi, None, LASER, gravity=G).sigma
    close(
        sigma.heading**2,
        [
            (0.01 * DEG_H / (U * np.cos(phi))) ** 2,
            0.5 * (10 * PPM) ** 2 * np.sin(2 * K) ** 2,
            (50 * UG * np.tan(phi) / G) ** 2,
        ],
    )


def test_16_mean_roll(tilted):
    (_, gamma, theta), means, _, statistics = tilted
    _, _, a0, h = printed(means)
    close(
        statistics.mean.roll,
        [
            -a0[0] * np.cos(gamma) / (G * np.cos(theta)),
            -a0[2] * np.sin(gamma) / (G * np.cos(theta)),
            0.5 * h[0] * np.sin(2 * gamma),
            -0.5 * h[2] * np.sin(2 * gamma),
        ],
    )


def test_17_variance_roll(tilted):
    (_, gamma, theta), _, sigmas, statistics = tilted
    _, _, a0, h = (v**2 for v in printed(sigmas))
    close(
        statistics.sigma.roll**2,
        [
            (a0[0] * np.cos(gamma) ** 2 + a0[2] * np.sin(gamma) ** 2) / (G * np.cos(theta)) ** 2,
            0.25 * (h[0] + h[2]) * np.sin(2 * gamma) ** 2,
        ],
    )


def test_18_variance_roll_identical_instruments(tilted):
    attitude, *_ = tilted
    _, gamma, theta = attitude
    sigma = error_statistics(attitude, 0.5, None, LASER, gravity=G).sigma
    close(
        sigma.roll**2,
        [(50 * UG / (G * np.cos(theta))) ** 2, 0.5 * (50 * PPM) ** 2 * np.sin(2 * gamma) ** 2],
    )


def test_19_mean_pitch(tilted):
    (_, gamma, theta), means, _, statistics = tilted
    _, _, a0, h = printed(means)
    sg, cg, st, ct = np.sin(gamma), np.cos(gamma), np.sin(theta), np.cos(theta)
    s2t = np.sin(2 * theta)
    close(
        statistics.mean.pitch,
        [
            a0[0] * sg * st / G,
            -a0[2] * cg * st / G,
            a0[1] * ct / G,
            0.5 * h[1] * s2t,
            -0.5 * h[0] * sg**2 * s2t,
            -0.5 * h[2] * cg**2 * s2t,
        ],
    )


def test_20_variance_pitch(tilted):
    (_, gamma, theta), _, sigmas, statistics = tilted
    _, _, a0, h = (v**2 for v in printed(sigmas))
    sg, cg, st, ct = np.sin(gamma), np.cos(gamma), np.sin(theta), np.cos(theta)
    close(
        statistics.sigma.pitch**2,
        [
            ((a0[0] * sg**2 + a0[2] * cg**2) * st**2 + a0[1] * ct**2) / G**2,
            0.25 * (h[1] + h[0] * sg**4 + h[2] * cg**4) * np.sin(2 * theta) ** 2,
        ],
    )


def test_21_variance_pitch_identical_instruments(tilted):
    attitude, *_ = tilted
    _, gamma, theta = attitude
    sigma = error_statistics(attitude, 0.5, None, LASER, gravity=G).sigma
    close(
        sigma.pitch**2,
        [
            np.full(500, (50 * UG / G) ** 2),
            0.25 * (50 * PPM) ** 2 * (1 + np.sin(gamma) ** 4 + np.cos(gamma) ** 4) * np.sin(2 * theta) ** 2,
        ],
    )


def readings_in_print(attitude, phi):
    return tuple(paper_axes(v) for v in ideal_readings(*attitude, phi, gravity=G))


def test_11_12_heading_and_22_23_latitude_in_general():
    """The general sums, written out with E, N, H as printed and the scale-factor errors at the ideal readings."""
    (K, gamma, theta), phi = random_cases(9, 500, tilt=80.0)
    rng = np.random.default_rng(10)
    means, sigmas = random_errors(rng), random_errors(rng)
    statistics = error_statistics(Attitude(K, gamma, theta), phi, means, sigmas, gravity=G)
    sK, cK, sg, cg, st, ct = (f(x) for x in (K, gamma, theta) for f in (np.sin, np.cos))
    E = [cK * cg + sK * st * sg, sK * ct, cK * sg - sK * st * cg]
    N = [-sK * cg + cK * st * sg, cK * ct, -sK * sg - cK * st * cg]
    H = [-ct * sg, st, ct * cg]
    m = [-e / (U * np.cos(phi)) for e in E]
    tilt = [cg * np.tan(theta), 0.0, sg * np.tan(theta)]
    n = [(e * np.tan(phi) - t) / G for e, t in zip(E, tilt, strict=True)]
    p = [(np.cos(phi) * up - np.sin(phi) * north) / U for up, north in zip(H, N, strict=True)]
    r = [north / G for north in N]
    omega = [U * (np.cos(phi) * north + np.sin(phi) * up) for up, north in zip(H, N, strict=True)]
    force = [G * up for up in H]
    for mean, sigma, by_rate, by_force in (
        (statistics.mean.heading, statistics.sigma.heading, m, n),
        (statistics.mean.latitude, statistics.sigma.latitude, p, r),
    ):
        w0, k, a0, h = printed(means)
        axes = range(3)
        close(
            mean,
            [by_rate[i] * w0[i] for i in axes]
            + [by_rate[i] * k[i] * omega[i] for i in axes]
            + [by_force[i] * a0[i] for i in axes]
            + [by_force[i] * h[i] * force[i] for i in axes],
        )
        w0, k, a0, h = (v**2 for v in printed(sigmas))
        close(
            sigma**2,
            [by_rate[i] ** 2 * (w0[i] + k[i] * omega[i] ** 2) for i in axes]
            + [by_force[i] ** 2 * (a0[i] + h[i] * force[i] ** 2) for i in axes],
        )


def test_24_mean_latitude_level(level):
    K, phi, means, _, statistics = level
    w0, k, a0, _ = printed(means)
    s, c, s2f = np.sin(K), np.cos(K), np.sin(2 * phi)
    close(
        statistics.mean.latitude,
        [
            w0[0] * s * np.sin(phi) / U,
            -w0[1] * c * np.sin(phi) / U,
            w0[2] * np.cos(phi) / U,
            0.5 * k[2] * s2f,
            -0.5 * k[0] * s**2 * s2f,
            -0.5 * k[1] * c**2 * s2f,
            a0[1] * c / G,
            -a0[0] * s / G,
        ],
    )


def test_25_variance_latitude_level(level):
    K, phi, _, sigmas, statistics = level
    w0, k, a0, _ = (v**2 for v in printed(sigmas))
    s, c = np.sin(K), np.cos(K)
    close(
        statistics.sigma.latitude**2,
        [
            ((w0[0] * s**2 + w0[1] * c**2) * np.sin(phi) ** 2 + w0[2] * np.cos(phi) ** 2) / U**2,
            0.25 * (k[2] + k[0] * s**4 + k[1] * c**4) * np.sin(2 * phi) ** 2,
            (a0[1] * c**2 + a0[0] * s**2) / G**2,
        ],
    )


def test_26_variance_latitude_level_identical_instruments(level):
    K, phi, *_ = level
    sigma = error_statistics(Attitude(K, 0.0, 0.0), phi, None, LASER, gravity=G).sigma
    close(
        sigma.latitude**2,
        [
            np.full(500, (0.01 * DEG_H / U) ** 2),
            0.25 * (10 * PPM) ** 2 * (1 + np.sin(K) ** 4 + np.cos(K) ** 4) * np.sin(2 * phi) ** 2,
            np.full(500, (50 * UG / G) ** 2),
        ],
    )


@pytest.mark.parametrize(
    ("attitude_deg", "latitude_deg", "count"),
    [
        ((217.0, 12.0, -8.0), -35.0, 200_000),
        *slow(((0.0, 0.0, 0.0), 50.0, 1_000_000), ((75.0, -20.0, 30.0), 68.0, 1_000_000)),
    ],
)
def test_many_draws_through_the_determination_have_the_predicted_moments(attitude_deg, latitude_deg, count):
    rng = np.random.default_rng(11)
    attitude, latitude = Attitude(*np.radians(attitude_deg)), np.radians(latitude_deg)
    means, sigmas = random_errors(rng), random_errors(rng)
    pairs = zip(vars(means).values(), vars(sigmas).values(), strict=True)
    drawn = InstrumentErrors(*(mean + sigma * rng.standard_normal((count, 3)) for mean, sigma in pairs))
    result = determine(*drawn.apply(*ideal_readings(*attitude, latitude)))
    theory = error_statistics(attitude, latitude, means, sigmas)
    truth = (*attitude, latitude)
    for found, true, mean, sigma in zip(
        (result.heading, result.roll, result.pitch, result.latitude), truth, *theory, strict=True
    ):
        delta = (found - true + np.pi) % (2 * np.pi) - np.pi
        assert abs(delta.mean() - mean) < 4 * sigma / np.sqrt(count)
        assert abs(delta.std() - sigma) < 4 * sigma / np.sqrt(2 * count)


def test_a_map_is_one_call():
    heading, latitude = np.radians(np.linspace(0, 359, 300)), np.radians(np.linspace(-85, 85, 200))[:, None]
    sigma = error_statistics(Attitude(heading, 0.0, 0.0), latitude, None, LASER).sigma
    assert sigma.heading.shape == sigma.latitude.shape == (200, 300)
    assert np.isfinite(sigma.heading).all()


@pytest.mark.parametrize(
    ("attitude", "latitude", "text"),
    [
        (Attitude(0.0, 0.0, 0.0), np.radians([50.0, 90.0]), "latitude is 90.0000 deg (element [1])"),
        (Attitude(0.0, 0.0, -np.pi / 2), 0.5, "pitch is -90.0000 deg"),
        (Attitude(0.0, np.nan, 0.0), 0.5, "roll is not a finite number"),
    ],
)
def test_where_the_theory_breaks_down_it_says_so(attitude, latitude, text):
    with pytest.raises(InputError) as info:
        error_statistics(attitude, latitude, None, LASER)
    assert text in str(info.value)


@pytest.mark.parametrize(
    ("values", "text"),
    [({"gyro_bias": [1.0, 2.0]}, "shape (2,)"), ({"accel_scale": np.nan}, "NaN")],
)
def test_unusable_instrument_errors_are_refused(values, text):
    with pytest.raises(InputError) as info:
        InstrumentErrors(**values)
    assert text in str(info.value)


def test_negative_standard_deviation_is_refused():
    with pytest.raises(InputError, match="accel_bias is negative"):
        error_statistics(Attitude(0.0, 0.0, 0.0), 0.5, None, InstrumentErrors(accel_bias=[1.0, -1.0, 1.0]))


def test_an_error_that_is_not_named_is_none():
    for name, value in vars(InstrumentErrors()).items():
        np.testing.assert_array_equal(value, np.zeros(3), err_msg=name)


def test_random_walk_of_a_quadratic_fit_to_velocity():
    """A turn at x = s tilts the block, and gravity gathers velocity from there on; the fit to that ramp has 2b."""
    x = (np.arange(500) + 0.5) / 500.0
    ramps = np.maximum(x[:, None] - x, 0.0)
    weight = 2.0 * np.linalg.lstsq(np.stack([np.ones_like(x), x, x * x], axis=1), ramps, rcond=None)[0][2]
    np.testing.assert_allclose(weight, 30.0 * x**2 * (1.0 - x) ** 2, rtol=0, atol=1e-4)
    assert np.mean(weight**2) == pytest.approx(RANDOM_WALK_FACTOR, rel=1e-4)
