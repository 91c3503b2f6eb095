"""The emulator against statements that do not come from it: proportionality, χ² bands, Allan slopes, geometry."""

from __future__ import annotations

import contextlib
import io
import os
import platform
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors, draw
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_section import Imu
from tests.oracles.allan import allan_deviation
from tests.slow import slow


def uniform(count: int, rate_hz: float = 100.0, dtheta=(0.0, 0.0, 0.0), dvel=(0.0, 0.0, 0.0)) -> ImuData:
    """Return constant increments on a uniform time base."""
    ones = np.ones((count, 1))
    return ImuData(np.arange(count + 1) / rate_hz, ones * np.array(dtheta), ones * np.array(dvel))


def uneven(count: int) -> ImuData:
    """Return lively increments on intervals of 1 to 20 ms."""
    rng = np.random.default_rng(11)
    time = np.concatenate([[5.0], 5.0 + np.cumsum(rng.uniform(0.001, 0.02, count))])
    return ImuData(time, rng.normal(0, 1e-3, (count, 3)), rng.normal(0, 0.1, (count, 3)))


def both(**errors) -> ImuErrors:
    """Return the same errors for gyros and accelerometers."""
    return ImuErrors(TriadErrors(**errors), TriadErrors(**errors))


# Equation (2), no noise


def test_bias_adds_its_integral_over_uneven_intervals():
    ideal = uneven(500)
    still = ImuData(ideal.time, np.zeros((500, 3)), np.zeros((500, 3)))
    bias = np.array([4.0e-8, -7.0e-8, 1.0e-7])
    measured = emulate(still, both(bias=bias))
    for k in range(500):
        expected = bias * (ideal.time[k + 1] - ideal.time[k])
        assert np.array_equal(measured.dtheta[k], expected)
        assert np.array_equal(measured.dvel[k], expected)


def test_scale_error_is_proportional_to_the_reading():
    ideal = uneven(500)
    scale = np.array([10e-6, -300e-6, 0.01])
    measured = emulate(ideal, both(scale=scale))
    np.testing.assert_allclose(measured.dtheta / ideal.dtheta - 1.0, np.tile(scale, (500, 1)), rtol=0, atol=3e-16)
    np.testing.assert_allclose(measured.dvel / ideal.dvel - 1.0, np.tile(scale, (500, 1)), rtol=0, atol=3e-16)


def test_bias_is_not_scaled_and_misalignment_is():
    # (2) reads (1 + k) ω + ω₀: a scale error does not touch the bias, but does touch whatever the axis senses.
    misalignment = np.zeros((3, 3))
    misalignment[0, 1] = 0.01
    errors = both(scale=np.array([0.5, 0.0, 0.0]), bias=np.array([1.0, 0.0, 0.0]), misalignment=misalignment)
    measured = emulate(uniform(1, 1.0, dtheta=(2.0, 100.0, 0.0)), errors)
    assert measured.dtheta[0, 0] == pytest.approx(1.5 * (2.0 + 0.01 * 100.0) + 1.0, rel=1e-15)


def test_non_linearity_acts_on_the_mean_rate_along_the_tilted_axis():
    # 10 µg/g² and 2 µg/g³ at 3 g: 90 µg and 54 µg, whatever the length of the interval; a scale error takes them along
    k2, k3 = 10e-6 / 9.80665, 2e-6 / 9.80665**2
    misalignment = np.zeros((3, 3))
    misalignment[0, 2] = 0.1
    e = both(quadratic=np.full(3, k2), cubic=np.full(3, k3), misalignment=misalignment, scale=np.array([0.0, 0.5, 0.0]))
    g = 9.80665
    for rate in (1.0, 100.0):
        measured = emulate(uniform(2, rate, dvel=(3 * g / rate, -3 * g / rate, 0.0)), e).dvel[1] * rate / g
        assert measured == pytest.approx([3 + 144e-6, -1.5 * (3 - 36e-6), 0.0], rel=1e-14)
        measured = emulate(uniform(2, rate, dvel=(0.0, 0.0, 2 * g / rate)), e).dvel[1] * rate / g
        assert measured == pytest.approx([0.2 + 0.4e-6 + 0.016e-6, 0.0, 2 + 56e-6], rel=1e-14)


def test_non_linearity_leaves_all_other_draws_alone():
    plain = draw(Imu(grade="tactical"), 5)
    bent = draw(Imu(grade="tactical", gyro_quadratic_sigma_ppm_per_deg_s=1.0, accel_cubic_sigma_ug_per_g3=3.0), 5)
    assert not np.any(plain.gyro.quadratic)
    assert not np.any(plain.accel.cubic)
    assert np.all(bent.gyro.quadratic != 0.0)
    assert np.all(bent.accel.cubic != 0.0)
    for name in ("bias", "scale", "misalignment"):
        assert np.array_equal(getattr(plain.gyro, name), getattr(bent.gyro, name))
        assert np.array_equal(getattr(plain.accel, name), getattr(bent.accel, name))


@pytest.mark.parametrize(
    ("tilted", "towards"), [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)], ids=["xy", "xz", "yx", "yz", "zx", "zy"]
)
def test_rotation_about_one_axis_leaks_into_a_tilted_one(tilted, towards):
    # A gyro tilted by ε towards the axis of rotation senses Ω sin ε, with a plus; the others sense what they did.
    angle = 1e-3
    matrix = np.zeros((3, 3))
    matrix[tilted, towards] = angle
    turn = np.zeros(3)
    turn[towards] = 0.01
    measured = emulate(uniform(10, dtheta=turn, dvel=turn), both(misalignment=matrix))
    expected = turn.copy()
    expected[tilted] = 0.01 * np.sin(angle)
    for data in (measured.dtheta, measured.dvel):
        np.testing.assert_allclose(data, np.tile(expected, (10, 1)), rtol=0, atol=0.01 * angle**3)


def test_the_six_angles_of_a_scenario_are_tilts_towards_the_named_axes():
    section = Imu(grade="ideal", gyro_misalignment_arcsec=(10.0, 20.0, 30.0, 40.0, 50.0, 60.0))
    measured = emulate(uniform(1, 1.0, dtheta=(1.0, 0.0, 0.0)), section)
    arcsec = np.pi / 648000
    np.testing.assert_allclose(measured.dtheta[0], [1.0, 30 * arcsec, 50 * arcsec], rtol=1e-14)


def test_a_triad_turned_as_a_whole():
    # Six angles that are one small rotation δ of the triad give what a block turned by δ senses, to second order.
    delta = np.array([2e-4, -3e-4, 5e-4])
    turned = Rotation.from_rotvec(delta)  # triad axes in block axes
    rigid = -np.array([[0, -delta[2], delta[1]], [delta[2], 0, -delta[0]], [-delta[1], delta[0], 0]])
    ideal = uneven(50)
    measured = emulate(ideal, both(misalignment=rigid))
    second_order = delta @ delta
    assert (
        np.max(np.abs(measured.dtheta - turned.inv().apply(ideal.dtheta)))
        < second_order * np.max(np.abs(ideal.dtheta)) * 2
    )
    assert np.max(np.abs(measured.dtheta - ideal.dtheta)) > 100 * second_order * np.max(np.abs(ideal.dtheta))


# Random walks


def test_variance_of_the_accumulated_angle_and_velocity():
    # Over a time T the sum has variance N²T: 1500 independent 10 s sums against the 99.99 % band of χ².
    count, span, walk = 500_000, 1000, 8.7e-7
    measured = emulate(uniform(count), both(random_walk=walk), seed=3)
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 1500)
    for data in (measured.dtheta, measured.dvel):
        sums = data.reshape(-1, span, 3).sum(axis=1)
        assert low < np.sum(sums**2) / (walk**2 * 10.0) < high


def test_variance_on_uneven_intervals():
    ideal = uneven(200_000)
    interval = np.diff(ideal.time)
    measured = emulate(ideal, both(random_walk=2e-6), seed=5)
    short = interval < 0.005
    for pick in (short, ~short):
        normal = (measured.dtheta - ideal.dtheta)[pick] / np.sqrt(interval[pick, None])
        low, high = chi2.ppf([5e-5, 1 - 5e-5], normal.size)
        assert low < np.sum(normal**2) / 2e-6**2 < high


def test_allan_deviation_gives_the_random_walk_back():
    measured = emulate(uniform(400_000), Imu(grade="ideal", gyro_arw_deg_sqrt_h=0.003), seed=8)
    walk = 8.726646e-7
    for axis in range(3):
        deviations = [allan_deviation(measured.dtheta[:, axis], 0.01, m) for m in (1, 10, 100, 1000)]
        # The relative 1σ of the estimate is about √(m/count): 0.16 % to 5 %; four of them.
        for m, deviation in zip((1, 10, 100, 1000), deviations, strict=True):
            assert deviation == pytest.approx(walk / np.sqrt(m * 0.01), rel=4 * np.sqrt(m / 400_000))
        slope = np.polyfit(np.log([1, 10, 100]), np.log(deviations[:3]), 1)[0]
        assert slope == pytest.approx(-0.5, abs=0.02)


def test_axes_and_triads_have_noises_of_their_own():
    measured = emulate(uniform(50_000), both(random_walk=1e-6), seed=1)
    correlation = np.corrcoef(np.hstack([measured.dtheta, measured.dvel]).T)
    assert np.max(np.abs(correlation - np.eye(6))) < 5 / np.sqrt(50_000)


# Quantisation


def test_quantisation_loses_nothing_and_stays_within_half_a_pulse():
    ideal = uneven(20_000)
    quantum = 5e-4
    measured = emulate(ideal, both(quantum=quantum))
    for given, true in ((measured.dtheta, ideal.dtheta), (measured.dvel, ideal.dvel)):
        pulses = given / quantum
        assert np.max(np.abs(pulses - np.rint(pulses))) < 1e-9 * np.max(np.abs(pulses))
        residue = np.cumsum(given, axis=0) - np.cumsum(true, axis=0)
        assert np.max(np.abs(residue)) <= 0.5 * quantum * (1 + 1e-9)
        assert np.max(np.abs(residue)) > 0.49 * quantum


def test_a_slow_rotation_is_counted_pulse_by_pulse():
    # 0.3 pulses a sample: nothing for two samples out of three, and every pulse arrives in the end.
    measured = emulate(uniform(1000, dtheta=(0.3e-6, 0.0, -0.3e-6)), both(quantum=1e-6))
    assert set(np.rint(measured.dtheta[:, 0] / 1e-6)) == {0.0, 1.0}
    assert measured.dtheta.sum(axis=0) == pytest.approx([300e-6, 0.0, -300e-6], rel=1e-12)


def test_allan_deviation_of_quantisation():
    # White rounding errors of variance S²/12 (S one pulse): √3 Q/τ with Q = S/√12, slope −1.
    quantum = 1e-5
    rng = np.random.default_rng(4)
    time = np.arange(300_001) / 100.0
    ideal = ImuData(time, rng.normal(0, 1e-4, (300_000, 3)), rng.normal(0, 1e-4, (300_000, 3)))
    measured = emulate(ideal, both(quantum=quantum))
    error = measured.dtheta[:, 1] - ideal.dtheta[:, 1]
    for m in (1, 10, 100):
        # Neighbouring averages share no end point, so the estimate is good to about 1 % whatever m.
        assert allan_deviation(error, 0.01, m) == pytest.approx(
            np.sqrt(3) * quantum / np.sqrt(12) / (m * 0.01), rel=0.015
        )


def test_noise_is_quantised_too():
    measured = emulate(uniform(5000), both(random_walk=1e-4, quantum=1e-5, bias=np.array([1e-3, 0, 0])), seed=2)
    pulses = measured.dtheta / 1e-5
    np.testing.assert_allclose(pulses, np.rint(pulses), rtol=0, atol=1e-9)
    assert np.std(pulses) > 0.5


# Bias instability


def test_allan_deviation_of_the_instability():
    # IEEE 952, exponentially correlated (Markov) noise:
    # σ²(τ) = 2σ²(T/τ)[1 − T/(2τ)(3 − 4 exp(−τ/T) + exp(−2τ/T))]
    sigma, correlation_time = 1e-5, 20.0
    errors = both(instability=sigma, correlation_time=correlation_time)
    measured = emulate(uniform(600_000, 10.0), errors, seed=6)
    for axis in range(3):
        for tau, tolerance in ((1.0, 0.05), (5.0, 0.07), (40.0, 0.15)):
            x = tau / correlation_time
            variance = 2 * sigma**2 / x * (1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x))
            given = allan_deviation(measured.dtheta[:, axis], 0.1, round(tau * 10))
            assert given == pytest.approx(np.sqrt(variance), rel=tolerance)


def test_the_instability_starts_stationary():
    one_step = [
        emulate(uniform(1, 1.0), both(instability=1e-5, correlation_time=1e6), seed=seed).dtheta[0]
        for seed in range(200)
    ]
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 600)
    assert low < np.sum(np.square(one_step)) / 1e-5**2 < high


def test_gauss_markov_decays_exactly_on_any_intervals():
    from sinssim.statistics.random_numbers import gauss_markov

    interval = np.array([0.1, 5.0, 0.01, 30.0])
    white = np.array([2.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(
        gauss_markov(interval, 10.0, white), 2.0 * np.exp(-np.array([0.0, 0.1, 5.1, 5.11, 35.11]) / 10.0), rtol=1e-14
    )
    # A step far longer than τ forgets the past: the fresh number comes through whole.
    assert gauss_markov(np.array([1e4]), 1.0, np.array([5.0, 3.0]))[1] == pytest.approx(3.0, rel=1e-14)


# Draws


@pytest.mark.parametrize(("grade", "count"), [("laser-standard", 200), ("consumer", 200), *slow(("consumer", 700))])
def test_draws_have_the_standard_deviation_of_the_grade(grade, count):
    from tests.sensors.imu.test_grades import DEG_H, TABLE

    bias, _, scale, accel_bias, _, accel_scale, misalignment, _ = TABLE[grade]
    section = Imu(grade=grade)
    runs = [draw(section, seed) for seed in range(count)]
    off = ~np.eye(3, dtype=bool)
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 3 * count)
    for values, sigma in (
        ([e.gyro.bias for e in runs], bias * DEG_H),
        ([e.gyro.scale for e in runs], scale * 1e-6),
        ([e.accel.bias for e in runs], accel_bias * 9.80665e-6),
        ([e.accel.scale for e in runs], accel_scale * 1e-6),
    ):
        assert low < np.sum(np.square(values)) / sigma**2 < high
        assert abs(np.mean(values)) < 4.5 * sigma / np.sqrt(3 * count)
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 6 * count)
    for triad in ("gyro", "accel"):
        angles = np.array([getattr(e, triad).misalignment[off] for e in runs])
        assert low < np.sum(angles**2) / misalignment**2 < high


def test_draws_of_different_terms_and_axes_are_independent():
    section = Imu(grade="tactical")
    off = ~np.eye(3, dtype=bool)
    rows = []
    for seed in range(600):
        errors = draw(section, seed)
        for_triad = (np.concatenate([t.bias, t.scale, t.misalignment[off]]) for t in (errors.gyro, errors.accel))
        rows.append(np.concatenate(list(for_triad)))
    correlation = np.corrcoef(np.array(rows).T)
    assert correlation.shape == (24, 24)
    assert np.max(np.abs(correlation - np.eye(24))) < 4.5 / np.sqrt(600)


def test_sigma_overrides_scale_the_same_draw():
    base = draw(Imu(grade="ideal", gyro_bias_sigma_deg_h=1.0), seed=5).gyro.bias
    assert draw(Imu(grade="laser-standard"), seed=5).gyro.bias == pytest.approx(0.01 * base, rel=1e-14)
    assert draw(Imu(grade="ideal"), seed=5).gyro.bias == pytest.approx(np.zeros(3), abs=0)


SWITCHES = {
    "gyro bias": {"gyro_bias_sigma_deg_h": 0.0},
    "gyro scale": {"gyro_scale_ppm": (0.0, 0.0, 0.0)},
    "gyro misalignment": {"gyro_misalignment_sigma_arcsec": 0.0},
    "accel bias": {"accel_bias_ug": (0.0, 0.0, 0.0)},
    "accel scale": {"accel_scale_sigma_ppm": 0.0},
    "accel misalignment": {"accel_misalignment_arcsec": (0.0,) * 6},
}


@pytest.mark.parametrize("off", SWITCHES)
def test_switching_one_draw_off_leaves_the_others_alone(off):
    everything = draw(Imu(grade="consumer"), seed=42)
    without = draw(Imu(grade="consumer", **SWITCHES[off]), seed=42)
    for term in SWITCHES:
        triad, name = term.split()
        before = getattr(getattr(everything, triad), name)
        after = getattr(getattr(without, triad), name)
        assert np.any(before)
        assert np.array_equal(after, np.zeros_like(before) if term == off else before)


def test_switching_one_noise_off_leaves_the_others_alone():
    still = uniform(2000)

    def gyro(**kept):
        return emulate(still, both(**kept), seed=9).dtheta

    walk = {"random_walk": 1e-6}
    wander = {"instability": 1e-5}
    np.testing.assert_allclose(gyro(**walk, **wander), gyro(**walk) + gyro(**wander), rtol=0, atol=1e-21)
    accel = emulate(still, ImuErrors(TriadErrors(), TriadErrors(**walk)), seed=9)
    assert np.array_equal(accel.dvel, emulate(still, both(**walk), seed=9).dvel)
    assert not np.any(accel.dtheta)


# Sameness


def test_ideal_grade_changes_nothing():
    ideal = uneven(100)
    measured = emulate(ideal, Imu(grade="ideal"), seed=3)
    assert measured.time is ideal.time
    assert measured.dtheta is ideal.dtheta
    assert measured.dvel is ideal.dvel


def test_the_input_is_left_alone():
    ideal = uneven(100)
    before = ideal.time.copy(), ideal.dtheta.copy(), ideal.dvel.copy()
    emulate(ideal, Imu(grade="consumer", gyro_quantum_arcsec=1.0), seed=3)
    assert np.array_equal(ideal.time, before[0])
    assert np.array_equal(ideal.dtheta, before[1])
    assert np.array_equal(ideal.dvel, before[2])


DIGEST = """
import hashlib
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors import GRADES, emulate
from tests.sensors.imu.test_emulate import uneven
from tests.sensors.imu.test_many_runs import SECTIONS
digest = hashlib.sha256()
for name in GRADES:
    measured = emulate(uneven(300), Imu(grade=name, gyro_quantum_arcsec=0.1, accel_quantum_mm_s=0.1), seed=17)
    digest.update(measured.dtheta.tobytes() + measured.dvel.tobytes())
everything = {"accel_arms_mm": ((0.0,) * 3,) * 3, "accel_delay_ms": 0.0, "faults": ()}
measured = emulate(uneven(300), SECTIONS["everything"].model_copy(update=everything), seed=17)
digest.update(measured.dtheta.tobytes() + measured.dvel.tobytes())
print(digest.hexdigest())
"""


def digest_of_another_process(**environment: str) -> str:
    """Return a number of the bits that all grades and all errors make, from a process of its own."""
    other = subprocess.run(
        [sys.executable, "-c", DIGEST],
        env={**os.environ, **environment},
        cwd=os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(__file__)))),
        capture_output=True,
        text=True,
        check=True,
    )
    return other.stdout.strip()


@pytest.mark.slow
def test_the_same_bits_in_every_process():
    """In another one with another order of sets, and in this one, which may have computed much before."""
    here = io.StringIO()
    with contextlib.redirect_stdout(here):
        exec(DIGEST, {})
    first = here.getvalue().strip()
    assert first == digest_of_another_process(PYTHONHASHSEED="12345")
    assert len(first) == 64


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names processors of that family")
@pytest.mark.parametrize("processor", ["x86-64", "haswell"])
def test_the_same_bits_on_lesser_processors(tmp_path, processor):
    """Compiled for two numbers at a time without fused operations, and for four at a time with them."""
    features = {"x86-64": "", "haswell": "+avx2,+fma"}[processor]
    lesser = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features, "SINSSIM_CACHE": str(tmp_path)}
    assert digest_of_another_process(**lesser) == digest_of_another_process()


def test_another_seed_gives_other_numbers():
    section = Imu(grade="laser-standard")
    assert not np.any(emulate(uneven(10), section, 1).dtheta == emulate(uneven(10), section, 2).dtheta)


# Refusals


@pytest.mark.parametrize(
    ("field", "value", "shape"),
    [
        ("time", np.arange(10.0), r"time \(10,\)"),
        ("dtheta", np.zeros((10, 2)), r"dtheta \(10, 2\)"),
        ("dvel", np.zeros((9, 3)), r"dvel \(9, 3\)"),
        ("dvel", np.zeros((10, 3, 1)), r"dvel \(10, 3, 1\)"),
    ],
)
def test_arrays_that_do_not_fit(field, value, shape):
    good = {"time": np.arange(11.0), "dtheta": np.zeros((10, 3)), "dvel": np.zeros((10, 3))}
    with pytest.raises(InputError, match=shape + r".* do not belong together"):
        emulate(ImuData(**{**good, field: value}), Imu())


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("field", ["time", "dtheta", "dvel"])
def test_samples_that_are_not_finite(field, bad):
    ideal = uneven(20)
    getattr(ideal, field)[7] = bad
    with pytest.raises(InputError, match=rf"imu\.{field}\[7\] = .* is not a finite number"):
        emulate(ideal, Imu(grade="ideal"))


@pytest.mark.parametrize("later", [5.0, 3.0])
def test_times_out_of_order(later):
    time = np.array([0.0, 1.0, 5.0, later, 6.0])
    with pytest.raises(InputError, match=r"time\[2\] = 5 s is followed by time\[3\]"):
        emulate(ImuData(time, np.zeros((4, 3)), np.zeros((4, 3))), Imu())


@pytest.mark.parametrize("seed", [-1, 1.5, "7", None, True])
def test_seeds_that_cannot_be(seed):
    with pytest.raises(InputError, match="whole number"):
        emulate(uniform(3), Imu(), seed=seed)
