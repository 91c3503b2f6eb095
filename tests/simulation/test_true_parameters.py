"""True parameters along a run: constants less their calibration, and drifts as means before each epoch, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.estimation.state_model import error_model
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors, WarmUp
from sinssim.sensors.sensor_set_readings import TrueErrors
from sinssim.sensors.sensor_set_section import Redundant
from sinssim.sensors.single_sensors import APART
from sinssim.simulation import truth_comparison
from sinssim.simulation.truth_comparison import InertialParameters

EDGES = 5.0 + 0.25 * np.arange(81)  # to 25 s
TILTS = np.array([[0.0, 1.0, 2.0], [3.0, 0.0, 4.0], [5.0, 6.0, 0.0]])


def triad(size: float, **more: object) -> TriadErrors:
    return TriadErrors(
        bias=size * np.array([1.0, -2.0, 3.0]), scale=10.0 * size * np.array([4.0, 5.0, -6.0]),
        misalignment=20.0 * size * TILTS, **more,
    )  # fmt: skip


def test_constants_less_what_the_calibration_knows() -> None:
    errors = TrueErrors(ImuErrors(triad(1e-6), triad(1e-3)), ImuErrors(triad(0.4e-6), triad(0.1e-3)))
    (found,) = InertialParameters(errors, EDGES, 3).at(np.array([6.0, 7.0]))
    pairs = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    for name, size in (("gyro", 0.6e-6), ("accelerometer", 0.9e-3)):
        np.testing.assert_allclose(found[f"{name} bias"], size * np.array([1.0, -2.0, 3.0]))
        np.testing.assert_allclose(found[f"{name} scale"], 10.0 * size * np.array([4.0, 5.0, -6.0]))
        np.testing.assert_allclose(found[f"{name} misalignment"], 20.0 * size * pairs)
        np.testing.assert_array_equal(found[f"{name} instability"], 0.0)
    given = {f"{t} {w}" for t in ("gyro", "accelerometer") for w in ("bias", "scale", "misalignment", "instability")}
    assert given < set(found)
    assert not any(np.any(found[name]) for name in set(found) - given)


def test_ramps_and_temperature_are_means_over_the_last_second() -> None:
    """R (t − ½) after 5 s, and β Θ̄ of a block that cools from 80 K to 20 K by half in 10 s; at 5.5 s over ½ s."""
    ramp, drift = np.array([1e-7, -2e-7, 3e-7]), np.array([4e-8, 5e-8, -6e-8])
    warm = WarmUp(80.0, 20.0, 10.0 / np.log(2.0))
    imu = ImuErrors(
        triad(1e-6, ramp=ramp, bias_temperature=drift), triad(1e-3, ramp=1e3 * ramp, bias_temperature=1e3 * drift),
        warm_up=warm,
    )  # fmt: skip
    known = ImuErrors(TriadErrors(bias_temperature=0.5 * drift), TriadErrors())
    early, late = InertialParameters(TrueErrors(imu, known), EDGES, 3).at(np.array([5.5, 15.0]), np.array([25.0]))

    def mean_temperature(first: float, last: float) -> float:
        """Mean of 20 + 60 · 2^(−t/10) over a span, with t from 5 s on."""
        rate = np.log(2.0) / 10.0
        return 20.0 + 60.0 * (np.exp(-rate * first) - np.exp(-rate * last)) / rate / (last - first)

    for found, row, first, last in ((early, 0, 0.0, 0.5), (early, 1, 9.0, 10.0), (late, 0, 19.0, 20.0)):
        middle, warmth = 0.5 * (first + last), mean_temperature(first, last)
        expected = 1e-6 * np.array([1.0, -2.0, 3.0]) + ramp * middle + 0.5 * drift * warmth
        np.testing.assert_allclose(
            found["gyro bias"][row], expected, rtol=0, atol=5e-11
        )  # the emulator takes samples of Θ
        expected = 1e-3 * np.array([1.0, -2.0, 3.0]) + 1e3 * (ramp * middle + drift * warmth)
        np.testing.assert_allclose(found["accelerometer bias"][row], expected, rtol=0, atol=1e-7)


def test_instability_is_that_of_the_last_sample() -> None:
    """A process of 5e-7 rad/s and 40 s: its steps between samples decay as it says, and it is not in the bias."""
    imu = ImuErrors(triad(1e-6, instability=5e-7, correlation_time=40.0), triad(1e-3))
    every, some = InertialParameters(TrueErrors(imu), EDGES, 7).at(EDGES[1:], np.array([6.1, 12.25]))
    values = every["gyro instability"]
    assert values.shape == (80, 3)
    np.testing.assert_array_equal(some["gyro instability"], values[[4, 28]])  # 6.25 s ends the sample of 6.1 s
    assert np.std(np.diff(values, axis=0)) == pytest.approx(5e-7 * np.sqrt(2.0 * 0.25 / 40.0), rel=0.3)
    np.testing.assert_array_equal(every["gyro bias"], 1e-6 * np.array([1.0, -2.0, 3.0]))
    np.testing.assert_array_equal(every["accelerometer instability"], 0.0)


def test_flicker_is_averaged_as_long_as_the_filter_needs() -> None:
    """B = 0.664⁻¹ · N/√4 s: the mean over 4 s of what a mean over one sample shows."""
    white = 1e-6
    flicker = white / np.sqrt(4.0) / np.sqrt(2.0 * np.log(2.0) / np.pi)
    imu = ImuErrors(TriadErrors(flicker=flicker, random_walk=white), TriadErrors())
    (smooth,) = InertialParameters(TrueErrors(imu), EDGES, 7).at(EDGES[1:])
    imu = ImuErrors(TriadErrors(flicker=flicker), TriadErrors())  # without white noise over a second
    (quick,) = InertialParameters(TrueErrors(imu), EDGES, 7).at(EDGES[1:])
    quick_s, smooth_s = quick["gyro bias"][3::4], smooth["gyro bias"][3::4]
    for k in range(3, 20):
        np.testing.assert_allclose(smooth_s[k], quick_s[k - 3 : k + 1].mean(axis=0), rtol=1e-9)


def test_flicker_of_its_own_states_is_a_mean_around_the_instant() -> None:
    """It stands in the first process, and not in the bias; 2.52 · 0.05 π N²/(2 B²) = 2 s, one before and one after."""
    white = 1e-6
    flicker = white * np.sqrt(0.05 * np.pi / 4.0 * np.exp(1.5 - np.euler_gamma))
    sigma = ImuErrors(TriadErrors(flicker=flicker, random_walk=white), TriadErrors())
    model = error_model(sigma, imu=("gyro bias", "gyro flicker"), duration=20.0)
    (smooth,) = InertialParameters(TrueErrors(sigma), EDGES, 7).at(EDGES[1:], model=model)
    bare = ImuErrors(TriadErrors(flicker=flicker), TriadErrors())  # without white noise over a second
    (quick,) = InertialParameters(TrueErrors(bare), EDGES, 7).at(EDGES[1:])
    (first, *others), quick_s = model.sums["gyro flicker"], quick["gyro bias"][3::4]
    for k in range(1, 19):
        np.testing.assert_allclose(smooth[first][4 * k + 3], quick_s[k : k + 2].mean(axis=0), rtol=1e-9)
    assert others
    assert not any(smooth[name].any() for name in (*others, "gyro bias"))


def test_each_triad_has_a_mean_of_its_own_length() -> None:
    """White noise that flicker falls below after 4 s in the gyros, and after 2 s in the accelerometers."""
    times_s = {"gyro": (1e-6, 4.0), "accel": (1e-4, 2.0)}
    flicker = {k: white / np.sqrt(s) / np.sqrt(2.0 * np.log(2.0) / np.pi) for k, (white, s) in times_s.items()}
    both = {k: TriadErrors(flicker=flicker[k], random_walk=white) for k, (white, _) in times_s.items()}
    (smooth,) = InertialParameters(TrueErrors(ImuErrors(**both)), EDGES, 7).at(EDGES[1:])
    bare = ImuErrors(**{k: TriadErrors(flicker=size) for k, size in flicker.items()})
    (sample,) = InertialParameters(TrueErrors(bare), EDGES, 7).at(EDGES[1:])
    for name, seconds in (("gyro bias", 4), ("accelerometer bias", 2)):
        slow, quick = smooth[name][3::4], sample[name][3::4]  # at whole seconds; the quick ones are means over one
        for k in range(4, 20):
            np.testing.assert_allclose(slow[k], quick[k + 1 - seconds : k + 1].mean(axis=0), rtol=1e-9)


def test_each_block_of_a_redundant_set_has_noises_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Six gyros in two blocks, of which the second has the seed that its readings are made with."""
    seeds: list[int] = []

    def emulated(imu: ImuData, errors: ImuErrors, seed: int) -> ImuData:
        seeds.append(seed)
        return imu

    monkeypatch.setattr(truth_comparison, "emulate", emulated)
    unit = ImuErrors(triad(0.0, rate_walk=1e-9), triad(0.0))
    errors = TrueErrors(unit, single_sensors=(unit, unit))
    InertialParameters(errors, EDGES, 7, Redundant(type="redundant")).at(np.array([10.0]))
    assert seeds == [7, 7 + APART]
