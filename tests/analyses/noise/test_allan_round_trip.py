"""What the emulator puts in, identification finds: every noise term alone and all together, at every grade."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sinssim.analyses.noise_fit import fit_noise
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.grades import GRADE_TABLE
from sinssim.sensors.imu.imu_section import Imu
from tests.slow import slow

GRADES = [name for name, grade in GRADE_TABLE.items() if grade.gyro.random_walk > 0.0]
FIELDS = {"Q": "quantum", "N": "random_walk", "B": "flicker", "K": "rate_walk", "R": "ramp"}
PULSE = np.sqrt(12.0)  # pulses in a Q


def sizes(random_walk):
    """Return terms that all show in ten hours beside a grade's random walk.

    Quantisation is as large as the random walk at 0.1 s, the flicker at 200 s, the rate random walk as the flicker at
    2000 s, the ramp twice as large at 10 000 s.
    """
    flicker = random_walk / 0.664 / np.sqrt(200.0)
    return {
        "Q": random_walk * np.sqrt(0.1 / 3.0),
        "N": random_walk,
        "B": flicker,
        "K": 0.664 * flicker * np.sqrt(3.0 / 2000.0),
        "R": 2.0 * 0.664 * flicker * np.sqrt(2.0) / 1e4,
    }


def triad(terms):
    """Return the errors of a triad that have these coefficients."""
    values = {FIELDS[symbol]: value for symbol, value in terms.items()}
    if "Q" in terms:
        values["quantum"] = PULSE * terms["Q"]
    if "R" in terms:
        values["ramp"] = np.full(3, terms["R"])
    return TriadErrors(**values)


@cache
def lively(count, rate_hz):
    """Return ideal increments of a block that shakes by many pulses from sample to sample: rounding is then white."""
    rng = np.random.default_rng(1)
    time = np.arange(count + 1) / rate_hz
    return ImuData(time, rng.normal(0.0, 1e-2, (count, 3)), rng.normal(0.0, 1.0, (count, 3)))


def errors_of(ideal, measured):
    """Return what the sensors got wrong: six channels."""
    return np.hstack([measured.dtheta - ideal.dtheta, measured.dvel - ideal.dvel]).T


def emulated(grade, symbols, count, rate_hz, seed):
    """Return the errors of six channels, and the coefficients in each."""
    row = GRADE_TABLE[grade]
    all_terms = [sizes(t.random_walk) for t in (row.gyro, row.accel)]
    terms = [{symbol: t[symbol] for symbol in symbols} for t in all_terms]
    ideal = lively(count, rate_hz)
    measured = emulate(ideal, ImuErrors(triad(terms[0]), triad(terms[1])), seed)
    return errors_of(ideal, measured), [terms[0]] * 3 + [terms[1]] * 3


def near(estimate, truth):
    """Return whether an estimate is within 5 % or two standard errors; if there is none, whether its limit holds."""
    if estimate.value is None:
        return bool(estimate.low <= truth <= estimate.high)
    half = 0.5 * (estimate.high - estimate.low)
    return bool(abs(estimate.value - truth) < max(0.05 * truth, 2.0 / 1.96 * half))


def check_alone(grade, symbol, count, rate_hz, rows):
    channels, truths = emulated(grade, symbol, count, rate_hz, seed=4)
    for row in rows:
        estimate, truth = fit_noise(channels[row], 1.0 / rate_hz).estimates[symbol], truths[row][symbol]
        print(f"{grade}, {symbol} alone, channel {row}: {estimate.value / truth - 1.0:+.2%}")
        assert estimate.value == pytest.approx(truth, rel=0.05)


@pytest.mark.parametrize("symbol", FIELDS)
@pytest.mark.parametrize("grade", [GRADES[0], *slow(GRADES[-1])])
def test_each_term_alone(grade, symbol):
    """At the best and the poorest grade: the others differ from them in scale only."""
    check_alone(grade, symbol, 36_000, 10.0, [0, 5])


@pytest.mark.slow
@pytest.mark.parametrize("symbol", FIELDS)
@pytest.mark.parametrize("grade", GRADES)
def test_each_term_alone_in_ten_hours_at_100_hz(grade, symbol):
    check_alone(grade, symbol, 3_600_000, 100.0, range(6))


def test_all_together():
    """Within 5 % or two standard errors of the fit's own band: of ten bands of 95 %, fewer than seven once in 1000."""
    channels, truths = emulated("mems-tactical", FIELDS, 360_000, 10.0, seed=1)
    held = []
    for channel, truth in zip(channels[[0, 5]], [truths[0], truths[5]], strict=True):
        fit = fit_noise(channel, 0.1)
        held += [near(fit.estimates[symbol], value) for symbol, value in truth.items()]
    assert len(held) == 10
    assert sum(held) >= 7


@pytest.mark.slow
def test_all_together_in_ten_hours_at_100_hz():
    """102 records (17 seeds, six channels) at each of six grades: the bands hold the truth in 90 to 98 % of all.

    A 95 % band is found outside by a chance of 1 in 10 000, one that holds the truth in 87 % inside by 1 in 80. Of one
    grade's records it holds at least 87, but by a chance of 1 in 20 000; 80 % bands do that in one of nine.
    """
    inside, close = ({symbol: np.zeros(len(GRADES), dtype=int) for symbol in FIELDS} for _ in range(2))
    found = {symbol: [] for symbol in FIELDS}
    for row, grade in enumerate(GRADES):
        for seed in range(17):
            channels, truths = emulated(grade, FIELDS, 3_600_000, 100.0, 100 * row + seed)
            for channel, truth in zip(channels, truths, strict=True):
                fit = fit_noise(channel, 0.01)
                for symbol, value in truth.items():
                    estimate = fit.estimates[symbol]
                    inside[symbol][row] += estimate.low <= value <= estimate.high
                    close[symbol][row] += near(estimate, value)
                    found[symbol].append(fit.likely[symbol] / value)
    for symbol in FIELDS:
        relative = np.array(found[symbol])
        print(
            f"{symbol}: in the band {inside[symbol]} of 102 each, {inside[symbol].sum() / 6.12:.1f} %; within 5 % or "
            f"2 σ {close[symbol]}; mean {relative.mean():.4f}, spread {relative.std():.4f} of the truth"
        )
    for symbol in FIELDS:
        assert 0.90 * 612 <= inside[symbol].sum() <= 0.98 * 612, symbol
        assert inside[symbol].min() >= 87, symbol
        assert close[symbol].sum() >= 0.90 * 612, symbol
        if symbol in "QNB":  # K and R have no value in many of the records
            assert abs(np.mean(found[symbol]) - 1.0) < 4.0 * np.std(found[symbol]) / np.sqrt(612.0), symbol


INSTABLE = [name for name, grade in GRADE_TABLE.items() if grade.gyro.instability > 0.0]


@pytest.mark.parametrize("grade", INSTABLE)
@pytest.mark.parametrize("rate_hz", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_the_grades_own_instability_alone(grade, rate_hz):
    """A Gauss-Markov bias of known correlation time, from a scenario's keys, over ten hours."""
    section = Imu.model_validate(
        {"grade": "ideal", "gyro_instability_deg_h": GRADE_TABLE[grade].gyro.instability * 3600.0 * 180.0 / np.pi}
    )
    ideal = lively(int(36_000 * rate_hz), rate_hz)
    channels = errors_of(ideal, emulate(ideal, section, 3))
    for channel in channels[:2]:
        fit = fit_noise(channel, 1.0 / rate_hz, correlation_time=3600.0)
        assert fit.likely["sigma_b"] == pytest.approx(GRADE_TABLE[grade].gyro.instability, rel=0.05)


@pytest.mark.parametrize("rate_hz", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("grade", [*GRADES[:2], *slow(*GRADES[2:])])
def test_every_grade_as_it_is(grade, rate_hz):
    """The noise that a preset has, and none besides, in ten hours on a bench: its constant errors do not matter."""
    row = GRADE_TABLE[grade]
    still = np.ones((int(36_000 * rate_hz), 3))
    ideal = ImuData(np.arange(len(still) + 1) / rate_hz, 5e-5 / rate_hz * still, -5.0 / rate_hz * still)
    measured = emulate(ideal, Imu(grade=grade), 8)
    for sensor, channel in ((row.gyro, measured.dtheta[:, 0]), (row.accel, measured.dvel[:, 2])):
        instable = sensor.instability > 0.0
        fit = fit_noise(channel, 1.0 / rate_hz, correlation_time=3600.0 if instable else None)
        assert fit.likely["N"] == pytest.approx(sensor.random_walk, rel=0.005)
        assert near(fit.estimates["N"], sensor.random_walk)
        if instable:
            assert near(fit.estimates["sigma_b"], sensor.instability)
        assert [symbol for symbol in "QBKR" if fit.likely[symbol] > 0.0] == []


def test_an_ideal_sensor_has_nothing_to_identify():
    still = np.ones((1000, 3))
    ideal = ImuData(np.arange(1001) / 100.0, 5e-7 * still, -0.05 * still)
    measured = emulate(ideal, Imu(grade="ideal"), 8)
    with pytest.raises(InputError, match="a constant channel has no noise"):
        fit_noise(measured.dtheta[:, 0], 0.01)


def test_every_key_of_a_scenario_in_its_unit():
    """Datasheet units in, datasheet units out, for gyros and accelerometers."""
    from sinssim.analyses.noise_report import UNITS

    keys = {
        "gyro_quantum_arcsec": 2.0,
        "gyro_arw_deg_sqrt_h": 0.3,
        "gyro_flicker_deg_h": 30.0,
        "gyro_rrw_deg_h_sqrt_h": 400.0,
        "gyro_ramp_deg_h_per_h": [9000.0] * 3,
        "accel_quantum_mm_s": 0.3,
        "accel_vrw_ug_sqrt_hz": 100.0,
        "accel_flicker_ug": 800.0,
        "accel_rrw_ug_sqrt_h": 10_000.0,
        "accel_ramp_ug_per_h": [300_000.0] * 3,
    }
    ideal = lively(36_000, 10.0)
    for sensor, row in (("gyro", 0), ("accel", 3)):
        for symbol, word in (("Q", "quantum"), ("N", "rw"), ("B", "flicker"), ("K", "rrw"), ("R", "ramp")):
            key, value = next((k, v) for k, v in keys.items() if k.startswith(f"{sensor}_") and _names(k, word))
            section = Imu.model_validate({"grade": "ideal", key: value})
            channel = errors_of(ideal, emulate(ideal, section, 1))[row]
            unit, size = UNITS[sensor].terms[symbol]
            found = fit_noise(channel, 0.1).likely[symbol] / size
            truth = value[0] if isinstance(value, list) else value
            truth = truth / PULSE if symbol == "Q" else truth
            assert found == pytest.approx(truth, rel=0.05), (key, unit)


def _names(key, word):
    """Return whether a key is that of a term: arw and vrw are the random walk, rrw is another."""
    return f"_{word}_" in key or (word == "rw" and ("_arw_" in key or "_vrw_" in key))
