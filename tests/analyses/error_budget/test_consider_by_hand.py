"""What a reading and a step of the filter do to the errors of every source, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses.error_budget.covariance_propagation import Consider
from sinssim.analyses.error_budget.error_sources import (
    AngleError,
    InertialNoise,
    SensorAngle,
    SensorConstant,
    SensorGiven,
    SensorNoise,
    SensorProcess,
    Source,
)
from sinssim.analyses.error_budget.source_effects import Snapshot, StepEffects
from sinssim.analyses.error_budget.source_propagation import Propagation, RunningProcess, Walk
from sinssim.data import Array, Measurements
from sinssim.estimation.linearisation import Observed

RNG = np.random.default_rng(12)
SLICES = {"position": slice(0, 3), "velocity": slice(3, 6), "attitude": slice(6, 9), "gyro bias": slice(9, 12),
          "gnss bias": slice(12, 15), "gnss scale": slice(15, 17), "baro bias": slice(17, 18)}  # fmt: skip
H, H_TRUE = RNG.normal(size=(2, 11)), RNG.normal(size=(2, 18))
H_TRUE[:, 17] = 0.0  # the reading is none of the barometer
C_NB, MIX = RNG.normal(size=(3, 3)), RNG.normal(size=(3, 3))
MEAN = RNG.normal(size=(6, 9))
PHI_OF = RNG.normal(size=(1, 3, 2))


def source(name: str) -> Source:
    return Source(name, name, "gnss", "random", 1.0, "m")


def angle(name: str, what: Any, *size: float) -> SensorAngle:
    def phi(time: Array) -> Array:
        assert time.tolist() == [7.5]
        return PHI_OF[:, :, : len(size)]

    return SensorAngle(source(name), AngleError(source(name), what, np.array(size), phi))


NOISES = [
    InertialNoise(source("gyro_arw"), 0, "white", 0.3, 0.3, mix=MIX),
    InertialNoise(source("vibration"), 0, "white", 0.7, 0.7, mix=MIX),
    InertialNoise(source("gyro_rrw"), 0, "process", 0.2, process=Walk(), mix=MIX),
    InertialNoise(source("gyro_quantum"), 0, "quantum", 0.5, 0.4, mix=MIX),
    InertialNoise(source("accel_vrw"), 1, "white", 0.9, 0.9, mix=MIX),
    InertialNoise(source("accel_rrw"), 1, "process", 0.8, process=Walk(), mix=MIX),
    InertialNoise(source("accel_quantum"), 1, "quantum", 0.6, 0.2, mix=MIX),
]
SENSORS: list[Any] = [
    SensorConstant(source("gnss_scale"), "gnss scale", np.array([2.0, 3.0])),
    SensorProcess(source("gnss_bias"), "gnss bias", np.ones(3), 100.0),
    SensorProcess(source("baro_bias"), "baro bias", np.ones(1), 100.0),
    SensorNoise(source("gnss_noise"), "gnss", np.array([4.0, 5.0])),
    SensorNoise(source("baro_noise"), "baro", np.ones(1)),
    SensorGiven(source("gnss_given"), "gnss"), SensorGiven(source("baro_given"), "baro"),
    angle("encoder_noise", "noise", 0.1, 0.4), angle("encoder_bias", "constant", 0.3, 0.2),
]  # fmt: skip
RESIDUAL = np.array([0.7, -1.9])


def consider() -> Consider:
    one = Consider.__new__(Consider)
    columns = {"encoder_bias": [12, 13], "gnss_scale": [10, 11], "gnss_given": [9], "baro_given": [13]}
    parts = {name: (places, np.ones(len(places))) for name, places in columns.items()}
    shares: Any = SimpleNamespace(noises=NOISES, sensors=SENSORS, inertial=9, count=14, parts=parts)
    one._shares, one._truth, one._mean_errors = shares, SimpleNamespace(slices=SLICES), MEAN  # type: ignore[assignment]
    one._c_nb = {(1, 2): C_NB}
    one._angles = [each for each in SENSORS if isinstance(each, SensorAngle)]
    return one


def read(interval: float) -> Any:
    time = np.array([1.0, 2.0, 7.5, 9.0])
    data = Measurements("gnss-velocity", time, time, np.zeros((4, 3)), np.ones((4, 3)), name="gnss")
    gain = RNG.normal(size=(11, 2))
    found = consider()._reading(gain, Observed(1, 2, RESIDUAL, H, np.ones(2), interval, np.copy), H_TRUE, data)
    assert found.gain is gain
    return found


def through(rows: Array, matrix: Array) -> Array:
    """Return the variances of two components by three equal and independent errors of unit size."""
    return np.diag(rows @ matrix @ matrix.T @ rows.T)


def test_a_reading_depends_on_the_true_errors_and_on_what_the_filter_takes_off() -> None:
    """z = H_true ε + H_y y − H_p p̂; constants by gyros act as their mean rate since the reading before."""
    found = read(0.0)
    np.testing.assert_array_equal(found.core[:, :9], H_TRUE[:, :9])
    np.testing.assert_array_equal(found.core[:, 9:], -H[:, 9:])
    gyro, attitude = H_TRUE[:, 9:12], H_TRUE[:, 6:9]
    np.testing.assert_allclose(found.constants[:, :9], gyro @ MEAN[:3], rtol=1e-13)
    np.testing.assert_allclose(found.constants[:, 9], RESIDUAL)
    np.testing.assert_allclose(found.constants[:, 10:12], H_TRUE[:, 15:17])
    np.testing.assert_allclose(found.constants[:, 12:], attitude @ PHI_OF[0], rtol=1e-13)
    assert set(found.processes) == {"gyro_rrw", "gnss_bias"}
    np.testing.assert_allclose(found.processes["gyro_rrw"], gyro @ MIX, rtol=1e-13)
    np.testing.assert_array_equal(found.processes["gnss_bias"], H_TRUE[:, 12:15])


def test_noise_of_a_reading_at_an_instant() -> None:
    """Pulses of gyros turn the attitude, those of accelerometers move the velocity, each by Q²/12."""
    noise = read(0.0).noise
    expected = {
        "gyro_quantum": 0.5**2 / 12.0 * through(H_TRUE[:, 6:9], C_NB @ MIX),
        "accel_quantum": 0.6**2 / 12.0 * through(H_TRUE[:, 3:6], C_NB @ MIX),
        "gnss_noise": np.array([16.0, 25.0]),
        "encoder_noise": through(H_TRUE[:, 6:9], PHI_OF[0] * [0.1, 0.4]),
    }
    assert set(noise) == set(expected)
    for name, value in expected.items():
        np.testing.assert_allclose(noise[name], value, rtol=1e-12, err_msg=name)


def test_noise_of_a_mean_over_an_interval() -> None:
    """White noise N over 0.4 s has the mean square N²/T; the first and the last pulse err by Q²/12 each, over T.

    The random walk of the angle is known since the reading before: its integral over T.
    """
    found = read(0.4)
    gyro = H_TRUE[:, 9:12]
    np.testing.assert_allclose(found.processes["gyro_arw"], gyro @ MIX / 0.4, rtol=1e-13)
    assert set(found.processes) == {"gyro_arw", "gyro_rrw", "gnss_bias"}
    np.testing.assert_allclose(found.noise["vibration"], 0.7**2 / 0.4 * through(gyro, MIX), rtol=1e-12)
    each = 2.0 * 0.5**2 / 12.0 / 0.4**2 * np.mean(np.diag(MIX.T @ MIX))
    np.testing.assert_allclose(found.noise["gyro_quantum"], each, rtol=1e-12)
    accel = 0.6**2 / 12.0 * through(H_TRUE[:, 3:6], C_NB @ MIX)
    np.testing.assert_allclose(found.noise["accel_quantum"], accel, rtol=1e-12)
    assert set(found.noise) == {"vibration", "gyro_quantum", "accel_quantum", "gnss_noise", "encoder_noise"}


def test_errors_of_the_angles_turn_the_vehicle_alone() -> None:
    one = consider()
    before = RNG.normal(size=(9, 14))
    seen = Snapshot(before.copy(), {"encoder_noise": np.full((9, 9), 2.0)})
    one._turn_out(seen, 7.5)
    expected = before.copy()
    expected[6:9, 12:14] += PHI_OF[0]
    np.testing.assert_allclose(seen.sensitivity, expected, rtol=1e-14)
    turned = np.full((9, 9), 2.0)
    turned[6:9, 6:9] += PHI_OF[0] @ np.diag([0.01, 0.16]) @ PHI_OF[0].T
    np.testing.assert_allclose(seen.covariances["encoder_noise"], turned, rtol=1e-14)


def test_steps_of_a_segment_are_combined() -> None:
    """Φ₂Φ₁, Φ₂Q₁Φ₂ᵀ + Q₂; the gyros' noise came by −½(Φ + 1) C_nb N² T of each, and is carried on. Steps of no length,
    at the first epoch, are left out."""
    phi, q, c_nb = RNG.normal(size=(4, 11, 11)), RNG.normal(size=(4, 11, 11)), RNG.normal(size=(4, 3, 3))
    line: Any = SimpleNamespace(interval=np.array([0.0, 0.5, 0.25, 2.0]), phi=phi, q=q, c_nb=c_nb)
    one = consider()
    one._filter = SimpleNamespace(model=SimpleNamespace(size=11, gyro_noise=0.3))  # type: ignore[assignment]
    one._begins = {5}
    found = one._combined(line, 0, 3)
    np.testing.assert_allclose(found[0], phi[2] @ phi[1], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found[1], phi[2] @ q[1] @ phi[2].T + q[2], rtol=1e-11, atol=1e-12)
    columns = np.eye(11)[:, 6:9]
    came = [-0.5 * (phi[k][:, 6:9] + columns) @ c_nb[k] * 0.09 * t for k, t in ((1, 0.5), (2, 0.25))]
    np.testing.assert_allclose(found[2], phi[2] @ came[0] + came[1], rtol=1e-11, atol=1e-12)
    one._begins = set()
    assert not one._combined(line, 0, 3)[2].any()
    np.testing.assert_array_equal(one._combined(line, 2, 2)[0], np.eye(11))


def test_a_step_takes_all_along() -> None:
    """ε ← Φ_εε ε − Φ_εp p̂: the filter's estimates act with the opposite sign; its own covariance has Φ as it is."""
    phi, q, came = RNG.normal(size=(11, 11)), np.eye(11), RNG.normal(size=(11, 3))
    bias = RNG.normal(size=(2, 11, 6))
    white = ("gyro_arw", "vibration", "gyro_quantum", "accel_vrw", "accel_quantum")
    noise = {name: RNG.normal(size=(2, 11, 11)) for name in white}
    steps = StepEffects(
        np.array([0.5, 0.25]), np.array([10.0, 30.0]), RNG.normal(size=(2, 11, 14)), bias, noise,
        RNG.normal(size=(2, 6, 9)),
    )  # fmt: skip
    given: list[Any] = []
    covariance, cross = RNG.normal(size=(11, 11)), RNG.normal(size=(11, 3))
    branch: Any = SimpleNamespace(covariance=covariance, cross=cross, propagation=SimpleNamespace(step=given.append))
    one = consider()
    one._advance(phi, q, came, steps, 1, [branch])
    (step,) = given
    expected = phi.copy()
    expected[:9, 9:] = -phi[:9, 9:]
    np.testing.assert_array_equal(step.phi, expected)
    np.testing.assert_array_equal(step.constants, steps.constants[1])
    assert set(step.noise) == set(white)
    np.testing.assert_array_equal(step.noise["accel_vrw"], noise["accel_vrw"][1])
    np.testing.assert_array_equal(step.bias[0], bias[1, :, :3])
    np.testing.assert_array_equal(step.bias[1], bias[1, :, 3:])
    assert (step.interval, step.distance) == (0.25, 30.0)
    assert step.gravity == pytest.approx(0.125 * (expected[:, 3:6] + np.eye(11)[:, 3:6]))
    np.testing.assert_allclose(branch.covariance, phi @ covariance @ phi.T + q, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(branch.cross, phi @ cross + came, rtol=1e-11, atol=1e-12)
    np.testing.assert_array_equal(one._mean_errors, steps.mean[1])


@pytest.mark.parametrize("interval", [0.0, 0.4])
def test_a_correction_is_the_conditional_covariance(interval: float) -> None:
    """Of state x, noise w since the reading before and reading Hx + w̄ + v, jointly normal: P − P_xz S⁻¹ P_zx.

    The mean w̄ = M w/T is in the reading's own variance; with the state it has the covariance cross Mᵀ/T.
    """
    root = RNG.normal(size=(11, 11))
    p, cross, h, variance = (
        root @ root.T,
        0.1 * RNG.normal(size=(11, 3)),
        RNG.normal(size=(3, 11)),
        np.array([1.5, 2.5, 0.5]),
    )
    shared = cross / interval if interval else np.zeros((11, 3))
    with_reading = p @ h.T + shared
    innovation = h @ p @ h.T + h @ shared + shared.T @ h.T + np.diag(variance)
    gain = with_reading @ np.linalg.inv(innovation)
    given: list[Any] = []
    branch: Any = SimpleNamespace(covariance=p, cross=cross, propagation=SimpleNamespace(read=given.append))
    one = consider()
    one._reading = lambda gain, *rest: (gain, *rest)  # type: ignore[assignment,method-assign,return-value]
    observed, data = Observed(1, 2, np.zeros(3), h, variance, interval, np.copy), SimpleNamespace()
    one._correct(branch, observed, H_TRUE, data)  # type: ignore[arg-type]
    np.testing.assert_allclose(branch.covariance, p - gain @ innovation @ gain.T, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(branch.cross, cross - gain @ h @ cross, rtol=1e-9, atol=1e-10)
    signed = gain * np.where(np.arange(11) < 9, -1.0, 1.0)[:, None]
    np.testing.assert_allclose(given[0][0], signed, rtol=1e-9, atol=1e-10)
    assert given[0][1] is observed
    assert given[0][2] is H_TRUE
    assert given[0][3] is data


def test_a_process_that_begins_again_is_independent_of_the_core() -> None:
    """Only that of the name; the covariance of before, which others may keep, stays."""
    shares = SimpleNamespace(sensitivity=np.zeros((2, 1)))
    process: Any = None
    one, other = (RunningProcess(name, process, np.ones(1), 0, np.arange(1.0, 10.0).reshape(3, 3)) for name in "ab")
    before = one.covariance
    shares.processes = [one, other]
    Propagation.reset(shares, "a")  # type: ignore[arg-type]
    assert one.covariance.tolist() == [[1.0, 2.0, 0.0], [4.0, 5.0, 0.0], [0.0, 0.0, 0.0]]
    assert other.covariance.tolist() == before.tolist() == np.arange(1.0, 10.0).reshape(3, 3).tolist()
