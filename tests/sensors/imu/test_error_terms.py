"""Every error of the block against its equation, one at a time and all at once."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.data import DROPPED, FROZEN, SATURATED, ImuData
from sinssim.errors import InputError
from sinssim.jit import strict_kernel
from sinssim.scenario.notes import FLICKER_SAMPLES
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.flicker import DIRECT, RATES, STATIONARY, WEIGHTS
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_errors import Fault, WarmUp
from sinssim.sensors.imu.imu_section import Imu
from sinssim.statistics.random_numbers import mean_step
from tests.oracles.allan import allan_deviation
from tests.oracles.imu_model import KNOWN, output, temperature
from tests.sensors.imu.test_emulate import both, uneven, uniform
from tests.slow import slow

G = 9.80665
DEG_H = 4.84813681109536e-6


def lively(count: int = 400, seed: int = 3) -> ImuData:
    """Return increments of rates of 0.5 rad/s and forces of 10 m/s² on intervals of 1 to 20 ms."""
    rng = np.random.default_rng(seed)
    interval = rng.uniform(0.001, 0.02, count)
    time = np.concatenate([[12.0], 12.0 + np.cumsum(interval)])
    rate, force = rng.normal(0, 0.5, (count, 3)), rng.normal(0, 10.0, (count, 3))
    return ImuData(time, rate * interval[:, None], force * interval[:, None])


def some(shape: tuple[int, ...], size: float, seed: int) -> np.ndarray:
    values = size * np.random.default_rng(seed).normal(0, 1, shape)
    if shape == (3, 3):
        np.fill_diagonal(values, 0.0)
    return values


ROWS = [term for term in TERMS if term.multiplies is not None]


def values(term: ErrorTerm, seed: int) -> np.ndarray:
    """Return different values for all axes, each of which changes the readings of `lively` by about 1e-3 of them."""
    reading, force = (0.5 if term.triad == "gyro" else 10.0), 10.0
    size = 1e-3 * reading / abs(term.multiplies(reading, reading, force, 10.0, 2.0))
    sizes = size * (1.0 + np.random.default_rng(seed).uniform(0.0, 1.0, term.shape)) * (-1.0) ** seed
    return sizes * (1.0 - np.eye(3)) if term.size == 6 else sizes


# Deterministic terms, by triad; every number different, so that no two axes can be mixed up. Gyros, too, can be given
# the coupling of the axes, which no data sheet of theirs has.
VALUES: dict[str, dict[str, np.ndarray]] = {
    triad: {term.field: values(term, n) for n, term in enumerate(ROWS) if term.triad == triad}
    for triad in ("gyro", "accel")
}
VALUES["gyro"]["cross_axis"] = 20.0 * VALUES["accel"]["cross_axis"]
WARM = WarmUp(-5.0, 20.0, 3.0)


def check(errors: ImuErrors) -> np.ndarray:
    """Compare the emulator with the equations; return the relative size of what the errors do, by triad."""
    ideal = lively()
    measured = emulate(ideal, errors)
    interval = np.diff(ideal.time)[:, None]
    middle = 0.5 * (ideal.time[1:] + ideal.time[:-1]) - ideal.time[0]
    warmth = temperature(errors, middle)
    force = ideal.dvel / interval
    effect = []
    for given, true, triad in (
        (measured.dtheta, ideal.dtheta, errors.gyro),
        (measured.dvel, ideal.dvel, errors.accel),
    ):
        expected = output(triad, true / interval, force, warmth, middle) * interval
        largest = np.abs(true).max()
        assert np.abs(given - expected).max() < 2e-15 * largest
        effect.append(np.abs(expected - true).max(axis=0) / largest)
    return np.array(effect)


@pytest.mark.parametrize(
    ("triad", "term"), [(triad, term) for triad, terms in VALUES.items() for term in terms if term in KNOWN]
)
def test_each_deterministic_term_is_its_equation(triad: str, term: str) -> None:
    one = TriadErrors(**{term: VALUES[triad][term]})
    effect = check(ImuErrors(**{triad: one}, warm_up=WARM))
    touched = 0 if triad == "gyro" else 1
    assert np.all(effect[touched] > 1e-6)  # on every axis there is something to compare
    assert np.all(effect[1 - touched] < 1e-15)


def test_all_deterministic_terms_together_in_their_order() -> None:
    gyro, accel = (TriadErrors(**{k: v for k, v in VALUES[one].items() if k in KNOWN}) for one in ("gyro", "accel"))
    check(ImuErrors(gyro, accel, warm_up=WARM))


@pytest.mark.parametrize("term", ROWS, ids=lambda term: term.name)
def test_the_kernel_multiplies_by_what_the_row_says(term: ErrorTerm) -> None:
    """The derivative of the emulator's output to each value is what the row multiplies, whatever the row is."""
    ideal = lively()
    interval, middle = np.diff(ideal.time), 0.5 * (ideal.time[1:] + ideal.time[:-1]) - ideal.time[0]
    rate, force = ideal.dtheta / interval[:, None], ideal.dvel / interval[:, None]
    warmth = temperature(ImuErrors(warm_up=WARM), middle)
    own = rate if term.triad == "gyro" else force
    value = VALUES[term.triad][term.field]
    measured = emulate(ideal, ImuErrors(**{term.triad: TriadErrors(**{term.field: value})}, warm_up=WARM))
    found = (measured.dtheta if term.triad == "gyro" else measured.dvel) / interval[:, None] - own
    expected = np.zeros_like(own)
    for i, j in np.ndindex(3, 3):
        if term.size == 3 and i != j:
            continue
        size = value[i] if term.size == 3 else value[i, j]
        expected[:, i] += size * term.multiplies(own[:, i], own[:, j], force[:, j], warmth, middle)
    assert np.abs(expected).max(axis=0).min() > 1e-5
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * np.abs(own).max())
    in_bulk = term.effect(value, own, force, warmth, middle)
    np.testing.assert_array_equal(expected, np.broadcast_to(in_bulk, expected.shape))


def test_vibration_rectified_by_cross_coupling() -> None:
    # Vibration A sin ωt at 45° between two axes, in phase on both: ⟨C a_x a_y⟩ = ½ C A_x A_y (vibro-pendulous error).
    time = np.arange(20_001) / 2000.0
    phase = 2 * np.pi * 20.0 * time
    velocity = -np.cos(phase) / (2 * np.pi * 20.0)
    dvel = np.outer(np.diff(velocity), [3.0, 4.0, 0.0])
    coupling = np.zeros((3, 3))
    coupling[0, 1] = 50e-6 / G  # 50 µg/g²
    measured = emulate(ImuData(time, np.zeros_like(dvel), dvel), ImuErrors(accel=TriadErrors(cross_axis=coupling)))
    rectified = (measured.dvel - dvel).sum(axis=0) / 10.0
    assert rectified == pytest.approx([0.5 * 50e-6 / G * 12.0, 0.0, 0.0], rel=2e-3, abs=1e-18)  # sinc² of the interval


def test_warm_up_on_a_long_run() -> None:
    # the recursion over a million steps keeps the exponential
    errors = ImuErrors(gyro=TriadErrors(bias_temperature=np.array([1.0, 0, 0])), warm_up=WarmUp(-30.0, 10.0, 600.0))
    measured = emulate(uniform(1_000_000, 1000.0), errors).dtheta[:, 0] * 1000.0
    middle = (np.arange(1_000_000) + 0.5) / 1000.0
    assert np.abs(measured - (10.0 - 40.0 * np.exp(-middle / 600.0))).max() < 1e-8


# Noises


def autocovariance_of_flicker(count: int) -> np.ndarray:
    """Return the autocovariance of the recursion for B = 1 at distances 0 to count − 1, term by term."""
    d, w = 1.0 - np.array(RATES), np.array(WEIGHTS)
    state = 1.0 / (1.0 - np.outer(d, d))
    reached = w @ state + DIRECT  # covariance of the output with x_m at the same time
    lags = np.arange(float(count))
    tail = sum(share * np.exp(rate * lags) for share, rate in zip(w * reached, np.log(d), strict=True))
    tail[0] = w @ state @ w + 2 * DIRECT * w.sum() + DIRECT**2
    return tail


def test_allan_deviation_of_flicker_is_flat() -> None:
    # closed form from the autocovariance of the recursion: Allan variance = Σ weights · R
    flat = np.sqrt(2 * np.log(2) / np.pi)  # 0.664
    r = autocovariance_of_flicker(40_000)
    for m in (1, 2, 3, 5, 10, 30, 100, 1000, 10_000):
        j = np.arange(1, m)
        own = m * r[0] + 2 * np.sum((m - j) * r[1:m])
        k = np.arange(1, 2 * m)
        between = np.sum((m - np.abs(k - m)) * r[1 : 2 * m])
        assert np.sqrt((own - between) / m**2) == pytest.approx(flat, rel=0.002)


@pytest.mark.parametrize("far", [2.5e5, *slow(2.5e6)])
def test_allan_deviation_of_flicker_is_flat_as_far_as_is_said(far: float) -> None:
    """Within 0.2 % up to 2.5·10⁶ samples, 0.5 % below at 3·10⁶ and 1.5 % at 4·10⁶: the same closed form, by sums."""
    r = autocovariance_of_flicker(round(1.6 * far) * 2)
    lags = np.arange(len(r))
    sums, moments = np.cumsum(r), np.cumsum(lags * r)

    def mean_square(m: int) -> float:  # of the mean of m samples
        return float((r[0] + 2 * (sums[m - 1] - r[0]) - 2 * moments[m - 1] / m) / m)

    def off(m: int) -> float:  # Allan variance: (m₂ − m₁)²/2, and (m₁ + m₂)/2 is the mean of 2m
        return float(np.sqrt(2 * (mean_square(m) - mean_square(2 * m)) / (2 * np.log(2) / np.pi)) - 1)

    assert max(abs(off(m)) for m in np.geomspace(1, far, 400).astype(int)) < 0.0019
    if far == FLICKER_SAMPLES:
        assert off(3_000_000) == pytest.approx(-0.0054, abs=2e-4)
        assert off(4_000_000) == pytest.approx(-0.0146, abs=2e-4)
    assert FLICKER_SAMPLES == 2.5e6


def test_flicker_starts_as_it_goes_on() -> None:
    d = 1.0 - np.array(RATES)
    np.testing.assert_allclose(STATIONARY @ STATIONARY.T, 1.0 / (1.0 - np.outer(d, d)), rtol=1e-9)
    variance = autocovariance_of_flicker(1)[0]
    first = [emulate(uniform(1, 1.0), both(flicker=1e-5), seed=seed).dtheta[0] for seed in range(200)]
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 600)
    assert low < np.sum(np.square(first)) / (1e-10 * variance) < high


@pytest.mark.parametrize("rate_hz", [10.0, *slow(200.0)])
def test_allan_deviation_of_emulated_flicker(rate_hz: float) -> None:
    # six channels of 100 000 samples; the relative 1σ of one estimate is some 1.2 √(m/N) (neighbours are correlated)
    count = 100_000
    measured = emulate(uniform(count, rate_hz), both(flicker=1e-5), seed=4)
    channels = np.hstack([measured.dtheta, measured.dvel])
    for m in (1, 8, 64, 512, 4096):
        found = [allan_deviation(channels[:, i], 1 / rate_hz, m) for i in range(6)]
        assert np.mean(np.square(found)) ** 0.5 == pytest.approx(
            0.6643e-5, rel=0.002 + 4 * 1.2 * np.sqrt(m / count / 6)
        )


@pytest.mark.parametrize("seed", [1, *slow(2)])
def test_allan_deviation_of_the_rate_random_walk(seed: int) -> None:
    # K√(τ/3) from the first sample on: the samples are the means of a random walk, not its values
    walk = 2e-6
    count = 100_000
    measured = emulate(uniform(count), both(rate_walk=walk), seed)
    channels = np.hstack([measured.dtheta, measured.dvel])
    for m in (1, 2, 4, 16, 128, 1024):
        found = [allan_deviation(channels[:, i], 0.01, m) for i in range(6)]
        assert np.mean(np.square(found)) ** 0.5 == pytest.approx(
            walk * np.sqrt(m * 0.01 / 3), rel=4 * 1.2 * np.sqrt(m / count / 6)
        )


def test_rate_random_walk_starts_at_zero_and_spreads() -> None:
    # the n-th mean has the variance K²(n − 1 + a²), a = (1 + 1/√3)/2: where the walk starts, to one interval's step
    walk = 1e-5
    runs = np.array([emulate(uniform(50, 1.0), both(rate_walk=walk), seed).dtheta for seed in range(200)])
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 600)
    for n in (0, 9, 49):
        assert low < np.sum(runs[:, n] ** 2) / (walk**2 * (n + (0.5 + 0.5 / np.sqrt(3)) ** 2)) < high


def test_the_rate_random_walk_has_random_numbers_of_its_own() -> None:
    """Its steps and the white noise of the same samples have no correlation: within 4σ, 1/√N, of zero.

    The two are told apart by linearity: what a block with one of the errors adds does not depend on the other.
    """
    count = 4000
    walked = emulate(uniform(count, 1.0), both(rate_walk=1e-5), seed=9)
    white = emulate(uniform(count, 1.0), both(random_walk=1e-5), seed=9)
    together = emulate(uniform(count, 1.0), both(random_walk=1e-5, rate_walk=1e-5), seed=9)
    for name in ("dtheta", "dvel"):
        slow, fast, sum_ = (getattr(imu, name) for imu in (walked, white, together))
        np.testing.assert_allclose(sum_, slow + fast, rtol=0, atol=1e-15)
        steps = np.diff(slow, axis=0, prepend=0.0)
        for i in range(3):
            for lag in range(-2, 3):  # a step is seen in the means of two samples
                a, b = steps[10:-10, i], fast[10 + lag : count - 10 + lag, i]
                assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(count), (name, i, lag)


@strict_kernel
def coefficients(x: float) -> tuple[float, float, float, float]:
    return mean_step(x)


@pytest.mark.parametrize("x", [1e-6, 1e-3, 0.019, 0.021, 0.5, 4.0, 60.0])
def test_means_of_a_gauss_markov_process_have_its_covariances(x: float) -> None:
    d, q, e, g = coefficients(x)
    with localcontext() as context:
        context.prec = 60
        exact = Decimal(x)
        decay = (-exact).exp()
        variance, covariance = 2 * (exact - 1 + decay) / exact**2, ((1 - decay) / exact) ** 2
    assert d == pytest.approx(float(decay), rel=1e-14)
    assert d**2 + q**2 == pytest.approx(1.0, rel=1e-15)
    assert e**2 + g**2 == pytest.approx(float(variance), rel=1e-13)
    assert e * (d * e + q * g) == pytest.approx(float(covariance), rel=1e-12)
    # d alone would let the variance of a difference go wrong by far more: V − C is what the Allan deviation sees
    assert e**2 + g**2 - e * (d * e + q * g) == pytest.approx(float(variance - covariance), rel=1e-9, abs=0.0)


@pytest.mark.parametrize("ratio", [0.05, *slow(1.0), 20.0])
def test_variance_of_the_mean_over_one_interval(ratio: float) -> None:
    # Var of the mean over T of a process of correlation time τ: 2σ²(x − 1 + e^−x)/x², x = T/τ, whatever T
    runs = [
        emulate(uniform(1, 1.0), both(instability=1e-5, correlation_time=1.0 / ratio), seed=seed).dtheta[0]
        for seed in range(200)
    ]
    variance = 1e-10 * 2 * (ratio - 1 + np.exp(-ratio)) / ratio**2
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 600)
    assert low < np.sum(np.square(runs)) / variance < high


def test_instability_on_uneven_intervals_is_stationary() -> None:
    ideal = uneven(100_000)
    still = ImuData(ideal.time, 0 * ideal.dtheta, 0 * ideal.dvel)
    sigma, correlation_time = 1e-5, 0.05
    measured = emulate(still, both(instability=sigma, correlation_time=correlation_time), 2)
    interval = np.diff(ideal.time)
    rate = np.hstack([measured.dtheta, measured.dvel]) / interval[:, None]
    # the variance of the mean over T, averaged over the intervals; six channels of 20 000 correlation times: 1σ 0.4 %
    x = interval / correlation_time
    expected = np.mean(2 * (x - 1 + np.exp(-x)) / x**2)
    assert np.mean(rate**2) / sigma**2 == pytest.approx(expected, rel=0.02)


# Draws: switching one term off


NOISES = {"random_walk": 1e-6, "instability": 1e-5, "rate_walk": 1e-6, "flicker": 1e-5}


@pytest.mark.parametrize("off", NOISES)
def test_switching_one_noise_off_leaves_the_random_numbers_of_the_others(off: str) -> None:
    from sinssim.sensors.imu import emulation_kernel as kernel
    from sinssim.sensors.imu.emulation_kernel import pack
    from sinssim.statistics.random_numbers import key

    def numbers(errors: ImuErrors) -> np.ndarray:
        packed = pack([errors], 0.0)
        z = np.zeros((4, 6, 1))
        keys = (np.array([k]) for k in key(9))
        kernel.draw_sample(packed.active, z, 1234, *keys)
        return z

    everything, without = numbers(both(**NOISES)), numbers(both(**{**NOISES, off: 0.0}))
    number = list(NOISES).index(off)
    assert np.all(everything != 0.0)
    for n in range(4):
        assert np.array_equal(without[n], np.zeros((6, 1)) if n == number else everything[n])


@pytest.mark.parametrize("off", NOISES)
def test_what_one_noise_adds_does_not_depend_on_the_others(off: str) -> None:
    ideal = uniform(2000)
    everything, without, alone = (
        emulate(ideal, both(**kept), seed=9) for kept in (NOISES, {**NOISES, off: 0.0}, {off: NOISES[off]})
    )
    for name in ("dtheta", "dvel"):
        difference = getattr(everything, name) - getattr(without, name)
        scale = np.abs(getattr(everything, name)).max()
        np.testing.assert_allclose(difference, getattr(alone, name), rtol=0, atol=4e-16 * scale)


def test_switching_the_noises_of_one_triad_off_leaves_the_other_triads_bits() -> None:
    """Each triad has a correlation time of its own, on all three axes."""
    gyro, accel = (TriadErrors(**NOISES, correlation_time=tau) for tau in (0.7, 3.0))
    all_on = emulate(lively(), ImuErrors(gyro=gyro, accel=accel), seed=3)
    assert np.array_equal(emulate(lively(), ImuErrors(gyro=gyro), seed=3).dtheta, all_on.dtheta)
    assert np.array_equal(emulate(lively(), ImuErrors(accel=accel), seed=3).dvel, all_on.dvel)


DRAWN = [quantity for quantity in TERMS if quantity.drawn]


@pytest.mark.parametrize("off", DRAWN, ids=lambda quantity: quantity.name)
def test_switching_one_drawn_term_off_leaves_all_the_others_bit_for_bit(off) -> None:
    sigmas = {quantity.sigma_key: 1.0 for quantity in DRAWN}
    everything = draw(Imu(grade="ideal", **sigmas), seed=11)
    without = draw(Imu(grade="ideal", **{**sigmas, off.sigma_key: 0.0}), seed=11)
    for quantity in DRAWN:
        before, after = (getattr(getattr(e, quantity.triad), quantity.field) for e in (everything, without))
        assert np.count_nonzero(before) == quantity.size
        if quantity == off:
            assert not after.any()
        else:
            assert np.array_equal(before, after)


def test_drawn_terms_are_drawn_from_their_sigma_and_differ() -> None:
    sigmas = {quantity.sigma_key: 1.0 for quantity in DRAWN}
    runs = [draw(Imu(grade="ideal", **sigmas), seed) for seed in range(150)]
    rows = []
    for quantity in DRAWN:
        values = np.array([getattr(getattr(run, quantity.triad), quantity.field).ravel() for run in runs])
        values = values[:, values.any(axis=0)] / quantity.unit
        assert values.shape[1] == quantity.size
        low, high = chi2.ppf([5e-6, 1 - 5e-6], values.size)
        assert low < np.sum(values**2) < high
        rows.append(values.T)
    table = np.vstack(rows)
    correlation = np.corrcoef(table) - np.eye(len(table))
    assert np.max(np.abs(correlation)) < 5.5 / np.sqrt(150)


# Quantisation


def test_quantisation_over_a_long_run_never_off_by_more_than_half_a_pulse() -> None:
    # a constant rate of 0.37 pulses a sample for a million samples: no drift of the counter
    count, quantum = 1_000_000, 4.848e-6
    measured = emulate(uniform(count, dtheta=(0.37 * quantum, -1.91 * quantum, 20.5 * quantum)), both(quantum=quantum))
    pulses = np.cumsum(np.rint(measured.dtheta / quantum), axis=0)
    true = np.arange(1, count + 1)[:, None] * np.array([0.37, -1.91, 20.5])
    assert np.abs(pulses - true).max() <= 0.5 + 1e-6


def test_quantisation_noise_of_the_sum_is_a_pulse_over_the_root_of_twelve() -> None:
    ideal = lively(20_000)
    quantum = 1e-3
    measured = emulate(ideal, both(quantum=quantum))
    residue = np.cumsum(measured.dvel - ideal.dvel, axis=0)
    # uniform residues of variance Q²/12: 60 000 of them, to 4 of their 1σ of √(4/5/N)
    assert np.mean(residue**2) == pytest.approx(quantum**2 / 12, rel=4 * np.sqrt(0.8 / 60_000))


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            Imu(grade="ideal", gyro_quantum_arcsec=100.0),
            r"imu\.gyro_quantum_arcsec = 100 exceeds the signal.* beyond 20\.6 .* Allowed: 0 to 20\.6",
        ),
        (
            Imu(grade="ideal", accel_quantum_mm_s=2000.0),
            r"imu\.accel_quantum_mm_s = 2000 .* 0 to 1e\+03",
        ),
    ],
)
def test_a_pulse_that_weighs_more_than_the_signal(section: Imu, message: str) -> None:
    with pytest.raises(InputError, match=message):
        emulate(uniform(1000, dtheta=(1e-7, 0, 0), dvel=(0, 0, -1e-3)), section)


# Saturation


def test_saturation_cuts_and_flags() -> None:
    # 100 Hz, range 2 rad/s and 5 m/s²: increments of at most 0.02 rad and 0.05 m/s
    ideal = uniform(3, dtheta=(0.03, -0.03, 0.0199), dvel=(0.0499, -0.06, 0.0))
    measured = emulate(ideal, ImuErrors(TriadErrors(limit=2.0), TriadErrors(limit=5.0)))
    assert measured.dtheta[1] == pytest.approx([0.02, -0.02, 0.0199], rel=1e-14)
    assert measured.dvel[1] == pytest.approx([0.0499, -0.05, 0.0], rel=1e-14)
    assert measured.flags is not None
    assert measured.flags.tolist() == [[SATURATED, SATURATED, 0, 0, SATURATED, 0]] * 3


def test_a_sensor_without_limits_and_faults_has_no_flags() -> None:
    assert emulate(uniform(3), both(bias=np.ones(3))).flags is None


# Faults


def fault(kind, start, end, amount) -> ImuErrors:
    return ImuErrors(faults=(Fault(kind, start, end, np.array(amount, dtype=float)),))


STEADY = uniform(100, 10.0, dtheta=(0.1, 0.2, 0.3), dvel=(1.0, 2.0, 3.0))  # 10 s


def test_dropout_reads_zero_for_its_time_and_is_flagged() -> None:
    measured = emulate(STEADY, fault("dropout", 3.05, 4.0, [0, 1, 0, 0, 0, 1]))
    gone = np.zeros(100, bool)
    gone[30:40] = True  # every sample that has part in it
    assert np.array_equal(measured.dtheta[:, 1] == 0.0, gone)
    assert np.array_equal(measured.dvel[:, 2] == 0.0, gone)
    assert np.array_equal(measured.flags[:, 1] == DROPPED, gone)
    assert np.array_equal(measured.dtheta[:, [0, 2]], STEADY.dtheta[:, [0, 2]])
    assert not measured.flags[:, [0, 2, 3, 4]].any()


def test_freeze_repeats_the_last_sample() -> None:
    ideal = replace(STEADY, dtheta=np.arange(300.0).reshape(100, 3))
    measured = emulate(ideal, fault("freeze", 2.0, 5.0, [1, 1, 1, 0, 0, 0]))
    assert np.array_equal(measured.dtheta[:20], ideal.dtheta[:20])
    assert np.array_equal(measured.dtheta[20:50], np.tile(ideal.dtheta[19], (30, 1)))
    assert np.array_equal(measured.dtheta[50:], ideal.dtheta[50:])
    assert np.array_equal(np.flatnonzero(measured.flags[:, 0] == FROZEN), np.arange(20, 50))


def test_a_spike_is_in_one_sample() -> None:
    for instant, sample in ((3.0, 29), (3.01, 30), (0.01, 0), (10.0, 99)):
        measured = emulate(STEADY, fault("spike", instant, instant, [0.5, 0, -0.25, 0, 7.0, 0]))
        difference = measured.dtheta - STEADY.dtheta
        assert np.flatnonzero(difference.any(axis=1)).tolist() == [sample]
        assert difference[sample] == pytest.approx([0.5, 0.0, -0.25], rel=1e-14)
        assert measured.dvel[sample] - STEADY.dvel[sample] == pytest.approx([0.0, 7.0, 0.0], rel=1e-14)


def test_a_bias_step_acts_from_its_instant_on() -> None:
    measured = emulate(STEADY, fault("bias-step", 3.04, 6.5, [0.01, 0, 0, 0, 0, -0.2]))
    gained = np.cumsum(measured.dtheta[:, 0] - STEADY.dtheta[:, 0])
    assert gained[29] == 0.0
    assert gained[30] == pytest.approx(0.01 * 0.06, rel=1e-12)  # the part of the sample after 3.04 s
    assert gained[-1] == pytest.approx(0.01 * (6.5 - 3.04), rel=1e-12)
    assert np.sum(measured.dvel[:, 2] - STEADY.dvel[:, 2]) == pytest.approx(-0.2 * 3.46, rel=1e-12)


def test_a_smaller_range_for_a_while() -> None:
    measured = emulate(STEADY, fault("saturation", 2.0, 4.0, [1.5, 1.5, 1.5, 0, 0, 0]))
    cut = np.zeros(100, bool)
    cut[20:40] = True
    assert np.array_equal(measured.dtheta[:, 0], STEADY.dtheta[:, 0])  # 1 rad/s is within 1.5
    assert measured.dtheta[cut, 1:] == pytest.approx(np.full((20, 2), 0.15), rel=1e-14)
    assert np.array_equal(measured.dtheta[~cut], STEADY.dtheta[~cut])
    assert np.array_equal(measured.flags[:, 2] == SATURATED, cut)
    assert np.array_equal(measured.dvel, STEADY.dvel)


def test_jitter_of_the_stamps_alone() -> None:
    ideal = uniform(20_000)
    measured = emulate(ideal, fault("jitter", 50.0, 150.0, [1e-4, 0, 0, 0, 0, 0]), seed=4)
    off = measured.time - ideal.time
    inside = (ideal.time >= 50.0) & (ideal.time <= 150.0)
    assert not off[~inside].any()
    low, high = chi2.ppf([5e-5, 1 - 5e-5], inside.sum())
    assert low < np.sum(off[inside] ** 2) / 1e-8 < high
    assert np.all(np.diff(measured.time) > 0.0)
    assert measured.dtheta is ideal.dtheta
    whole = emulate(ideal, fault("jitter", 0.0, np.inf, [9.9e-4, 0, 0, 0, 0, 0]), seed=4)  # σ a tenth of the interval
    assert whole.time[0] == 0.0
    assert 3.4e-3 < np.abs(whole.time - ideal.time).max() < 4.9e-3  # 4.1σ of 20 000, where nothing is cut


def test_faults_that_overlap() -> None:
    """Steps and spikes add up, the smallest range holds, the later of dropout and freeze says what is delivered."""

    def both_of(*kinds: tuple[str, float, float, list[float]]) -> ImuData:
        return emulate(STEADY, ImuErrors(faults=tuple(Fault(k, a, b, np.array(c)) for k, a, b, c in kinds)))  # type: ignore[arg-type]

    rest = [0.0] * 5
    steps = both_of(("bias-step", 1.0, 3.0, [0.5, *rest]), ("bias-step", 2.0, 4.0, [0.25, *rest]))
    assert (steps.dtheta[[5, 15, 25, 35], 0] - 0.1) / 0.1 == pytest.approx([0.0, 0.5, 0.75, 0.25], abs=1e-12)
    spikes = both_of(("spike", 1.05, 1.05, [0.5, *rest]), ("spike", 1.05, 1.05, [0.25, *rest]))
    assert spikes.dtheta[10, 0] == pytest.approx(0.85, rel=1e-14)
    ranges = both_of(("saturation", 1.0, 3.0, [0.5, *rest]), ("saturation", 2.0, 4.0, [0.8, *rest]))
    assert ranges.dtheta[[5, 15, 25, 35], 0] == pytest.approx([0.1, 0.05, 0.05, 0.08], rel=1e-14)
    dropout, freeze = ("dropout", 1.0, 3.0, [1.0, *rest]), ("freeze", 2.0, 4.0, [1.0, *rest])
    frozen = both_of(dropout, freeze)
    assert not frozen.dtheta[10:40, 0].any()  # the last that was delivered was a zero
    assert np.array_equal(frozen.flags[[15, 25, 35], 0], [DROPPED, DROPPED | FROZEN, FROZEN])
    early = both_of(("freeze", 1.0, 3.0, [1.0, *rest]), ("dropout", 2.0, 4.0, [1.0, *rest]))
    assert early.dtheta[[15, 25, 35], 0] == pytest.approx([0.1, 0.0, 0.0])
    late = both_of(("dropout", 2.0, 4.0, [1.0, *rest]), ("freeze", 1.0, 3.0, [1.0, *rest]))
    assert late.dtheta[[15, 25, 35], 0] == pytest.approx([0.1, 0.1, 0.0])


def test_quanta_go_on_being_counted_through_a_dropout() -> None:
    """The counter runs on; what the lost samples held is lost, and nothing else."""
    quantum = 0.07
    errors = replace(fault("dropout", 3.0, 4.0, [1, 1, 1, 1, 1, 1]), gyro=TriadErrors(quantum=quantum))
    whole = emulate(STEADY, ImuErrors(gyro=TriadErrors(quantum=quantum)))
    measured = emulate(STEADY, errors)
    kept = np.r_[0:30, 40:100]
    assert np.array_equal(measured.dtheta[kept], whole.dtheta[kept])
    assert not measured.dtheta[30:40].any()


def test_faults_from_a_scenario() -> None:
    section = Imu.model_validate(
        {
            "grade": "ideal",
            "faults": [
                {"type": "dropout", "from_s": 1.0, "to_s": 2.0, "channels": ["accel_y"]},
                {"type": "freeze", "from_s": 3.0, "to_s": 4.0},
                {"type": "spike", "at_s": 5.0, "gyro_arcsec": [0.0, 3600.0, 0.0], "accel_mm_s": [1.0, 0.0, 0.0]},
                {"type": "bias-step", "from_s": 6.0, "gyro_deg_h": [3600.0, 0, 0], "accel_ug": [0, 0, 1e6]},
                {"type": "saturation", "from_s": 7.0, "to_s": 8.0, "gyro_deg_s": 90.0, "accel_g": 2.0},
                {"type": "jitter", "from_s": 9.0, "to_s": 9.5, "sigma_ms": 0.5},
            ],
        }
    )
    degree = np.pi / 180
    amounts = [found.amount.tolist() for found in draw(section).faults]
    assert amounts[0] == [0, 0, 0, 0, 1, 0]
    assert amounts[1] == [1] * 6
    assert amounts[2] == pytest.approx([0, degree, 0, 1e-3, 0, 0])
    assert amounts[3] == pytest.approx([degree, 0, 0, 0, 0, G])
    assert amounts[4] == pytest.approx([np.pi / 2] * 3 + [2 * G] * 3)
    assert amounts[5][0] == pytest.approx(5e-4)
    assert [found.end for found in draw(section).faults][3] == np.inf


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            fault("dropout", 10.0, 11.0, np.ones(6)),
            r"faults\.1: a dropout from 10 s to 11 s lies outside the run, .* 10 s",
        ),
        (fault("spike", 0.0, 0.0, np.ones(6)), r"faults\.1: a spike .* outside the run"),
        (fault("jitter", 0.0, 5.0, [0.02, 0, 0, 0, 0, 0]), r"at most 0\.01 s, a tenth of the interval"),
        (
            fault("jitter", 0.0, 5.0, [-0.01, 0, 0, 0, 0, 0]),
            r"1σ of the time stamps of -0.01 s must be positive",
        ),
        (fault("spyke", 1.0, 1.0, np.ones(6)), r"faults\.1: unknown fault 'spyke'\. Did you mean 'spike'\?"),
        (
            fault("freeze", 2.0, 1.0, np.ones(6)),
            r"faults\.1: the interval of a freeze, from 2 s to 1 s, must end after",
        ),
        (
            fault("dropout", np.nan, 1.0, np.ones(6)),
            r"faults\.1: the interval of a dropout, from nan s to 1 s, must end",
        ),
        (fault("spike", 1.0, 1.0, np.ones(3)), r"faults\.1: amount of the spike = .* of shape \(6,\)"),
        (ImuErrors(arms=np.full((3, 3), np.nan)), r"arms = .* finite numbers of shape \(3, 3\)"),
        (fault("saturation", 0.0, 1.0, -np.ones(6)), r"faults\.1: ranges of .* must be at least 0"),
        (ImuErrors(accel=TriadErrors(g_sensitivity=np.eye(3))), "accelerometer g_sensitivity = .* must be zero"),
        ("tactical", "'tactical' does not describe a sensor block: give an Imu"),
        (ImuErrors(delay=np.nan), r"delay = nan \(SI\) must be one finite number"),
        (ImuErrors(warm_up=WarmUp(np.inf, 0.0, 60.0)), "warm_up's start and steady temperature"),
        (ImuErrors(warm_up=WarmUp(1.0, 0.0, 0.0)), "time constant, 0 s, must be positive"),
    ],
)
def test_faults_that_cannot_be(given: ImuErrors, message: str) -> None:
    with pytest.raises(InputError, match=message):
        emulate(STEADY, given)


# What no sensor has


@pytest.mark.parametrize(
    ("triad", "message"),
    [
        (TriadErrors(random_walk=-1e-6), r"gyro random_walk = -1e-06 \(SI\) must be at least 0"),
        (TriadErrors(instability=np.nan), r"gyro instability = nan \(SI\) must be one finite number"),
        (TriadErrors(flicker=-1.0), "gyro flicker = -1.0"),
        (TriadErrors(quantum=np.inf), "gyro quantum = inf"),
        (TriadErrors(correlation_time=0.0), r"gyro correlation_time = 0.0 s must be greater than 0"),
        (TriadErrors(misalignment=np.full((3, 3), 0.5) - 0.5 * np.eye(3)), "small angles.*at most 0.2 rad"),
        (TriadErrors(misalignment=np.eye(3)), "small angles with a diagonal of zeros"),
        (TriadErrors(correlation_time=np.inf), r"gyro correlation_time = inf \(SI\) must be one finite number"),
        (TriadErrors(misalignment=np.zeros((2, 2))), r"gyro misalignment = .* of shape \(3, 3\)"),
        (TriadErrors(scale=np.array([0.0, -1.0, 0.0])), "gyro scale = .* must be greater than −1"),
        (TriadErrors(cross_axis=np.eye(3)), "gyro cross_axis = .* diagonal of zeros"),
        (
            TriadErrors(bias=np.array([0.0, np.nan, 0.0])),
            r"gyro bias = \[0.0, nan, 0.0\] .* finite numbers",
        ),
        (TriadErrors(scale=np.zeros(2)), r"gyro scale = \[0.0, 0.0\] .* of shape \(3,\)"),
        (TriadErrors(g_sensitivity=np.full((3, 3), np.inf)), r"gyro g_sensitivity = .* of shape \(3, 3\)"),
    ],
)
def test_errors_that_no_sensor_has(triad: TriadErrors, message: str) -> None:
    with pytest.raises(InputError, match=message):
        emulate(STEADY, ImuErrors(gyro=triad))


@pytest.mark.parametrize(("field", "value"), [("random_walk", "much"), ("bias", "0.1")])
def test_text_is_no_error_of_a_sensor(field: str, value: str) -> None:
    with pytest.raises(InputError, match=f"TriadErrors: {field} = '{value}' is not an array of numbers: it holds text"):
        TriadErrors(**{field: value})
