"""Variances of mean readings by errors on all axes at once, against the sensors' equations error by error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim.alignment.alignment_budget import reading_variances
from sinssim.data import Array
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp
from tests.oracles.imu_model import output, temperature

RATE, FORCE = np.array([0.4, -0.2, 0.5]), np.array([1.5, -2.5, -9.2])
START, LASTING = 40.0, 250.0
WARM = WarmUp(-25.0, 6.0, 180.0)
FIELDS = {
    "bias": "bias", "scale": "scale factor", "misalignment": "misalignment", "quadratic": "non-linearity",
    "cubic": "non-linearity", "asymmetry": "non-linearity", "cross_axis": "non-linearity",
    "bias_temperature": "temperature", "scale_temperature": "temperature", "ramp": "ramp",
    "g_sensitivity": "g-sensitivity",
}  # fmt: skip
"""Source of each error."""


def triad(seed: int, g_sensitivity: bool) -> TriadErrors:
    """Return 1σ that differ from axis to axis."""
    rng, values = np.random.default_rng(seed), {}
    for name in FIELDS:
        square = name in ("misalignment", "cross_axis", "g_sensitivity")
        size = rng.uniform(0.5, 1.5, (3, 3) if square else 3) * 1e-4
        if name in ("misalignment", "cross_axis"):
            np.fill_diagonal(size, 0.0)
        values[name] = size * (g_sensitivity or name != "g_sensitivity")
    return TriadErrors(**values)


SIGMA = ImuErrors(triad(1, True), triad(2, False), warm_up=WARM)


def by_each(errors: TriadErrors, inputs: Array) -> dict[str, Array]:
    """Return the sum of the squares of what the errors do to the mean reading, one after the other, by source."""
    count = 2000
    since = START + LASTING * (np.arange(count) + 0.5) / count
    warmth = temperature(SIGMA, since)
    rows, force = np.tile(inputs, (count, 1)), np.tile(FORCE, (count, 1))
    found: dict[str, Array] = {source: np.zeros(3) for source in FIELDS.values()}
    for name, source in FIELDS.items():
        sigma = getattr(errors, name)
        for place in np.ndindex(sigma.shape):
            alone = np.zeros_like(sigma)
            alone[place] = sigma[place]
            read = output(replace(TriadErrors(), **{name: alone}), rows, force, warmth, since)
            found[source] += (read.mean(axis=0) - inputs) ** 2
    return found


@pytest.mark.parametrize(("name", "inputs"), [("gyro", RATE), ("accelerometer", FORCE)])
def test_each_axis_has_the_squares_of_all_errors(name: str, inputs: Array) -> None:
    found = reading_variances(SIGMA, RATE, FORCE, LASTING, start=START)
    expected = by_each(SIGMA.gyro if name == "gyro" else SIGMA.accel, inputs)
    if name != "gyro":
        assert expected.pop("g-sensitivity").max() < 1e-20  # rounding: they have none
    for source, variance in expected.items():
        # the reading without the ideal one keeps its rounding; the temperature is averaged by midpoints
        np.testing.assert_allclose(found[f"{name} {source}"], variance, rtol=2e-6, atol=1e-20, err_msg=source)
        assert len(set(found[f"{name} {source}"])) == 3


def test_a_session_begins_when_the_sensors_are_switched_on() -> None:
    """The mean of a walk of K² t since then has K² t/3."""
    gyro = TriadErrors(rate_walk=2e-9)
    found = reading_variances(ImuErrors(gyro, TriadErrors()), RATE, FORCE, 3.0)
    np.testing.assert_allclose(found["gyro rate random walk"], 4e-18, rtol=1e-12)


def test_noises_of_each_triad() -> None:
    """White noise N²/T, a walk K²(s + T/3) that begins with the sensors, two pulses' ends of Q²/12 each over T."""
    gyro, accel = (
        TriadErrors(random_walk=2e-4, rate_walk=3e-6, quantum=5e-6),
        TriadErrors(random_walk=7e-3, quantum=2e-2),
    )
    found = reading_variances(ImuErrors(gyro, accel), RATE, FORCE, LASTING, start=START)
    expected = {
        "angle random walk": 4e-8 / 250.0, "gyro rate random walk": 9e-12 * (40.0 + 250.0 / 3.0),
        "angle quantisation": 25e-12 / (6.0 * 250.0**2), "velocity random walk": 49e-6 / 250.0,
        "accelerometer rate random walk": 0.0, "velocity quantisation": 4e-4 / (6.0 * 250.0**2),
    }  # fmt: skip
    for source, variance in expected.items():
        np.testing.assert_allclose(np.broadcast_to(found[source], 3), variance, rtol=1e-12, err_msg=source)


def test_flicker_within_a_sample_is_that_of_one_sample() -> None:
    """Sessions of half a sample, one and two samples at 10 Hz; the mean over more samples varies less."""
    sigma = ImuErrors(TriadErrors(flicker=2e-6), TriadErrors())
    half, one, two = (
        reading_variances(sigma, RATE, FORCE, seconds, rate_hz=10.0)["gyro flicker"] for seconds in (0.05, 0.1, 0.2)
    )
    np.testing.assert_array_equal(half, one)
    assert (two < 0.99 * one).all()
