"""One prediction and one update against the textbook's form; the gate's rate of rejection; P symmetric of itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from sinssim import rotation
from sinssim.data import Array, Measurements
from sinssim.estimation import error_model, innovation_gate
from sinssim.estimation.estimate import estimate
from sinssim.estimation.filter_result import Reasons
from sinssim.estimation.innovation_gate import Innovation, InnovationGate, InnovationMonitor
from sinssim.estimation.kalman_filter import ErrorFilter
from sinssim.estimation.measurement_epochs import CheckedMeasurements
from sinssim.sensors import ImuErrors, TriadErrors
from sinssim.truth.motions.parked_and_great_circle import Parked
from tests.estimation.made import reading
from tests.estimation.worlds import biases_only, not_turning, one_run, positions, standing, velocities, weaving
from tests.slow import slow

SIGMA = biases_only("laser-navigation")


def asymmetry(covariance: Array) -> float:
    """Return the largest |Pᵢⱼ − Pⱼᵢ|/(σᵢ σⱼ) of covariances, (..., n, n)."""
    sigma = np.sqrt(np.einsum("...ii->...i", covariance))
    off = np.abs(covariance - covariance.swapaxes(-1, -2))
    return float((off / (sigma[..., :, None] * sigma[..., None, :])).max())


def readings_of(kind: str, components: int, errors: int, count: int) -> CheckedMeasurements:
    """Return readings of a sensor for a gate, which looks at their number and at that of their errors."""
    time = np.arange(1.0, count + 1.0)
    data = Measurements(kind, time, time, np.zeros((count, components)), np.ones((count, errors)))
    return CheckedMeasurements(data, Reasons(count, {}), np.arange(count), np.ones(count))


@pytest.mark.parametrize("probability", [0.2, 0.01])
@pytest.mark.parametrize(
    ("kind", "components", "errors"), [("baro-height", 1, 1), ("gnss-position", 3, 3), ("attitude", 4, 3)]
)
def test_the_gate_rejects_right_readings_as_often_as_it_says(
    kind: str, components: int, errors: int, probability: float
) -> None:
    """νᵀS⁻¹ν of k components is χ² with k degrees of freedom, whatever S; an attitude's quaternion has three."""
    count, n = 4000, 5
    rng = np.random.default_rng([errors, round(1e4 * probability)])
    root = rng.standard_normal((n, n)) * np.array([1e-4, 1.0, 30.0, 1e-2, 1.0])[:, None]
    h = rng.standard_normal((errors, n))
    r = np.diag(rng.uniform(0.5, 2.0, errors) ** 2)
    known = ErrorFilter(root @ root.T)
    gate = InnovationGate(readings_of(kind, components, errors, count), probability)
    errors_of_state = rng.standard_normal((count, n)) @ root.T
    noise = rng.standard_normal((count, errors)) * np.sqrt(r.diagonal())
    residuals = errors_of_state @ h.T + noise
    passed = [gate.passes(row, known.innovation(reading(residuals[row], h), r)) for row in range(count)]
    rejected = count - sum(passed)
    # binomial, seven chances in a million to be outside
    low, high = binom.ppf((3.4e-6, 1.0 - 3.4e-6), count, probability)
    assert low <= rejected <= high
    record = gate.innovations()
    assert (~record.accepted).sum() == rejected
    assert all(("beyond the gate" in why) == (not ok) for why, ok in zip(record.reason, passed, strict=True))


def test_a_filter_rejects_right_vectors_as_often_as_its_gate_says() -> None:
    """Fixes of 1.5 m against a prediction of decimetres: their own noise, of which a tenth goes beyond the gate."""
    flight, ideal = weaving(300.0, 20.0)
    model = error_model(SIGMA, position=1.0, velocity=0.05, attitude=(1e-5, 1e-5, 1e-4))
    time, rejected = np.arange(0.5, 300.1, 0.5), []
    for seed in range(2):
        run, rng = one_run(flight, ideal, model, SIGMA, seed), np.random.default_rng([8, seed])
        given = [positions(flight, time, rng), velocities(flight, time, rng)]
        result = estimate(run.imu, run.initial, given, model, rate_hz=2.0, gate=0.1)
        rejected += [np.count_nonzero(~i.accepted) for i in result.innovations]
    low, high = binom.ppf((1e-4, 1.0 - 1e-4), len(time), 0.1)
    assert low <= min(rejected)
    assert max(rejected) <= high


def drawn(root: Array, count: int, shift: float, rng: np.random.Generator) -> list[Innovation]:
    """Return innovations of the covariance L Lᵀ whose normalised ones have a common mean."""
    white = rng.standard_normal((count, len(root))) + shift
    return [Innovation(root @ z, root @ root.T, float(z @ z)) for z in white]


def test_the_monitor_alarms_as_often_as_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sum over an interval of white innovations is χ² distributed, whatever their covariance."""
    monkeypatch.setattr(innovation_gate, "_FALSE_ALARM", 0.1)
    rng, root, count = np.random.default_rng(6), np.array([[2.0, 0.0], [-1.0, 0.1]]), 1500
    alarms = 0
    for _ in range(count):
        monitor = InnovationMonitor(2, 19.5)
        *_, last = (monitor.alarms(float(k), i) for k, i in enumerate(drawn(root, 20, 0.0, rng)))
        alarms += last
    low, high = binom.ppf((3.4e-6, 1.0 - 3.4e-6), count, 0.1)
    assert low <= alarms <= high


def test_the_monitor_sees_what_the_gate_does_not() -> None:
    """A common mean of half a σ in three components adds ¾ to χ² per reading: 31 is exceeded after about 37."""
    rng, root = np.random.default_rng(7), np.diag([3.0, 1.0, 0.1])
    late = []
    for _ in range(40):
        monitor = InnovationMonitor(3, 60.0)
        readings = [*drawn(root, 100, 0.0, rng), *drawn(root, 100, 0.5, rng)]
        alarms = [monitor.alarms(float(k), i) for k, i in enumerate(readings)]
        late.append(alarms.index(True) - 100)
    assert min(late) >= 0
    # the sixty before hold readings without the mean: n b² (n/60)
    assert np.median(late) == pytest.approx(np.sqrt(60.0 * 28.0 / 0.75), abs=8.0)
    assert not InnovationMonitor(3, 60.0).alarms(0.0, Innovation(100.0 * root[0], root @ root.T, 1e4))  # one reading


@pytest.mark.parametrize("tied", [False, True])
def test_predict_and_update_are_the_textbooks(tied: bool) -> None:
    """Against conditional moments of the joint normal distribution of state and reading, by its inverse."""
    rng = np.random.default_rng(3)
    n, k = 5, 2
    root, phi = rng.standard_normal((n, n)), np.eye(n) + 0.2 * rng.standard_normal((n, n))
    p, q = root @ root.T, np.diag(rng.uniform(0.1, 1.0, n))
    h, r = rng.standard_normal((k, n)), np.diag([0.5, 2.0])
    cross = 0.1 * rng.standard_normal((n, k)) if tied else None
    residual = rng.standard_normal(k)
    f = ErrorFilter(p)
    f.x = rng.standard_normal(n)
    x, p = phi @ f.x, phi @ p @ phi.T + q
    f.predict(phi, q)
    np.testing.assert_allclose(f.x, x)
    np.testing.assert_allclose(f.covariance, p)
    # of (x, z) with z = H x + v, the conditional precision of x is the upper left block of the joint precision
    m = np.zeros((n, k)) if cross is None else cross
    across = p @ h.T + m
    joint = np.block([[p, across], [across.T, h @ across + (h @ m).T + r]])
    precision = np.linalg.inv(joint)
    expected_p = np.linalg.inv(precision[:n, :n])
    innovation = residual - h @ x
    expected_x = x - expected_p @ precision[:n, n:] @ innovation
    found = f.innovation(reading(residual, h), r, cross)
    np.testing.assert_allclose(found.value, innovation)
    np.testing.assert_allclose(found.covariance, joint[n:, n:])
    assert found.nis == pytest.approx(innovation @ np.linalg.inv(joint[n:, n:]) @ innovation)
    f.update(reading(residual, h), r, cross)
    np.testing.assert_allclose(f.x, expected_x)
    np.testing.assert_allclose(f.covariance, expected_p, atol=1e-12)
    np.testing.assert_allclose(f.gain, -expected_p @ precision[:n, n:])


def test_rounding_leaves_the_covariance_symmetric_in_the_hardest_update() -> None:
    """Fixes of a millimetre at a place known to 100 km: P falls by sixteen powers of ten within a second."""
    flight, ideal = weaving(60.0, 10.0)
    near = error_model(SIGMA, position=5.0, velocity=0.1, attitude=(3e-4, 3e-4, 3e-3))
    far = error_model(SIGMA, position=1e5, velocity=100.0, attitude=(0.05, 0.05, 0.5))
    run, time = one_run(flight, ideal, near, SIGMA, 0), np.arange(0.0, 60.5)
    given = [positions(flight, time, np.random.default_rng(0), (1e-3,) * 3)]
    result = estimate(run.imu, run.initial, given, far, rate_hz=1.0, smooth=True)
    assert result.divergence is None
    assert result.smoothed is not None
    assert asymmetry(result.covariance) < 1e-9
    assert asymmetry(result.covariance[-1]) < 1e-11


@pytest.mark.parametrize("duration", [400.0, *slow(1800.0)])
def test_rounding_leaves_the_covariance_symmetric_in_the_long_run(duration: float) -> None:
    """Standing, with zero rates whose noise the state's error shares, and the smoother back: nothing adds up."""
    model = error_model(SIGMA, position=1.0, velocity=0.01, attitude=(1e-4, 1e-4, 1e-3))
    place = Parked(0.9, 0.2, 100.0, rotation.quaternion_from_euler(0.01, 0.02, 1.0), duration)
    errors = ImuErrors(TriadErrors(random_walk=8e-7), TriadErrors(random_walk=1e-4))
    run = one_run(place, place.increments(1.0), model, errors, 0)
    time, rng = np.arange(1.0, duration + 0.5), np.random.default_rng(1)
    given = [standing(time, rng), not_turning(time, rng)]
    result = estimate(run.imu, run.initial, given, model, rate_hz=1.0, gate=None, smooth=True)
    assert result.divergence is None
    assert result.smoothed is not None
    assert len(result.covariance) > duration
    assert asymmetry(result.covariance) < 1e-12
    assert asymmetry(result.smoothed.covariance) < 1e-9


def test_innovation_whose_covariance_is_singular_has_no_square() -> None:
    """Two readings of one quantity without noise: S has the rank 1, and the estimate ends there with a sentence."""
    twice = reading(np.array([1.0, 2.0]), np.array([[1.0, 0.0], [1.0, 0.0]]))
    found = ErrorFilter(np.eye(2)).innovation(twice, np.zeros((2, 2)))
    assert np.isnan(found.nis)
    np.testing.assert_array_equal(found.value, [1.0, 2.0])


def test_a_velocity_of_zero_says_nothing_about_the_heading() -> None:
    """A block that moves at 3 m/s by its navigation and stands: if its heading is wrong by ψ, then its velocity too is
    turned by ψ, and zero is zero in any direction.

    By hand: with the velocity's error v × φ and one of 1σ = 2 m/s of its own, a reading of unit variance leaves
    1/(1/4 + 1) m²/s² and the heading unknown as before, and the velocity that is left does not depend on it."""
    v, sigma = np.array([3.0, 0.0, 0.0]), 0.2
    turned = np.eye(9)
    turned[3:6, 6:9] = [[0.0, 0.0, 0.0], [0.0, 0.0, -3.0], [0.0, 3.0, 0.0]]  # v × φ
    own = np.diag([1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 0.0, 0.0, sigma**2])
    h = np.zeros((3, 9))
    h[:, 3:6] = np.eye(3)
    found = ErrorFilter(turned @ own @ turned.T)
    seen = reading(v, h)._replace(still=v)
    np.testing.assert_allclose(found.innovation(seen, np.eye(3)).covariance, 5.0 * np.eye(3), atol=1e-12)
    moved = found.update(seen, np.eye(3))
    assert moved is not None
    p = found.covariance
    assert p[8, 8] == pytest.approx(sigma**2)
    np.testing.assert_allclose(found.x[3:6], 0.8 * v)
    # the heading turns what is left of the velocity, 0.6 m/s
    np.testing.assert_allclose(p[3:6, 8], [0.0, -0.6 * sigma**2, 0.0], atol=1e-12)
    np.testing.assert_allclose(p[3:6, 3:6], 0.8 * np.eye(3) + np.diag([0.0, 0.36 * sigma**2, 0.0]), atol=1e-12)
    naive = ErrorFilter(turned @ own @ turned.T)
    naive.update(reading(v, h), np.eye(3))
    assert naive.covariance[8, 8] < 0.95 * sigma**2
