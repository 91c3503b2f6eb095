"""Claims that need no navigation: each against its closed form, and with other durations and sizes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim.data import ImuData
from sinssim.experiments.studies.attitude_cost import matrix_costs
from sinssim.experiments.studies.claims import _COMPUTED, decide, trigonometric_matrix
from sinssim.experiments.studies.position_claims import accelerometer_term, gravity_series, gyro_term
from sinssim.experiments.studies.step_cost import OF_FUNCTION, Operations, count, timed_data
from sinssim.experiments.studies.study_exhibits import StudyMedia
from sinssim.experiments.studies.study_results import LOOKS_AHEAD, StudyResult
from sinssim.experiments.studies.study_schema import COMPUTED, Study
from sinssim.jit import inline, kernel
from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY
from sinssim.strapdown.navigate import navigate
from tests.strapdown.variants import with_slow_variants

_SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(8))
_COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(9))
"""Coefficients of the series up to x¹⁵ and x¹⁶: for |x| ≤ π/4 the next terms are below half a unit of rounding."""
_TO_QUADRANTS, _WHOLE = 2.0 / math.pi, 1.5 * 2.0**52  # adding and subtracting 1.5·2⁵² rounds to a whole number
# π/2 = high + low; whole numbers of quadrants times high are exact
_HIGH = math.floor(0.5 * math.pi * 2.0**32) / 2.0**32
# sin π of the number π is what π/2 lacks beyond its double, twice
_LOW = 0.5 * math.pi - _HIGH + 0.5 * math.sin(math.pi)


@inline
def sine_k(x):
    """Sine to rounding, |x| up to some thousand, as a library computes it: reduction to ±π/4, then a polynomial."""
    quadrant = (x * _TO_QUADRANTS + _WHOLE) - _WHOLE
    y = (x - quadrant * _HIGH) - quadrant * _LOW
    z = y * y
    number = int(quadrant)
    if number % 2 == 0:
        tail = _SINE[4] + z * (_SINE[5] + z * (_SINE[6] + z * _SINE[7]))
        value = y + y * z * (_SINE[1] + z * (_SINE[2] + z * (_SINE[3] + z * tail)))
    else:
        tail = _COSINE[4] + z * (_COSINE[5] + z * (_COSINE[6] + z * (_COSINE[7] + z * _COSINE[8])))
        value = 1.0 + z * (_COSINE[1] + z * (_COSINE[2] + z * (_COSINE[3] + z * tail)))
    return value if number % 4 < 2 else -value


@kernel
def _sines(x, out):
    for k in range(x.shape[0]):
        out[k] = sine_k(x[k])


def test_a_sine_is_not_one_operation():
    """A sine to rounding, in all quadrants, takes 23 or 24 additions and multiplications; sums count it as these."""
    x = np.random.default_rng(1).uniform(-100.0, 100.0, 10_000)
    found = np.empty_like(x)
    _sines(x, found)
    assert np.abs(found - np.sin(x)).max() < 2e-16
    totals = [count(_sines, (np.array([0.3 + k * math.pi / 2]), np.empty(1)), 1)[0].total for k in range(4)]
    assert max(totals) == OF_FUNCTION
    assert min(totals) == OF_FUNCTION - 1.0
    assert Operations(1.0, 0.0, 0.0, 0.0, 2.0).total == 1.0 + 2.0 * OF_FUNCTION


def test_cost_of_b_counted_by_hand():
    by_products, by_functions = matrix_costs()
    assert by_products.operations.total == 45.0
    of_angles = by_functions.operations
    assert (of_angles.add, of_angles.multiply, of_angles.function) == (4.0, 14.0, 6.0)
    assert of_angles.total == 18.0 + 6.0 * OF_FUNCTION
    assert trigonometric_matrix().verdict == "confirmed"


@pytest.mark.parametrize("periods", [1, 3, 6])
def test_terms_of_the_one_component_system(periods):
    """2Δa/g of 100 µg is 0.68731′ with g = 9.81 m/s² (G0/g of the mean Earth); Δω₀ of 0.01 deg/h is 0.6′/h."""
    by_accelerometer, by_gyro = accelerometer_term(periods), gyro_term(periods)
    assert by_accelerometer.verdict == by_gyro.verdict == "confirmed"
    assert by_accelerometer.numbers["100 µg, measured"] == pytest.approx(
        math.degrees(2.0 * 100e-6 * 9.80665 / 9.81) * 60.0, rel=1e-3
    )
    assert by_gyro.numbers["0.01 deg/h, measured"] == pytest.approx(0.6, rel=1e-6)


@pytest.mark.parametrize("ceiling", [5e3, 12e3, 20e3])
def test_gravity_series_hold_to_aircraft_heights(ceiling):
    """The omitted terms of height are 4x³ and 3x², x = H/a; those of the surface are 2.0e-7 (f³) and 2.7e-5 (f²)."""
    found = gravity_series(ceiling)
    assert found.verdict == "confirmed"
    x = ceiling / 6378137.0
    for model, surface, of_height in (("order-1e-5", 2.1e-7, 4.0 * x**3), ("order-1e-4", 2.7e-5, 3.0 * x**2)):
        assert of_height < found.numbers[f"{model}, relative error"] < surface + of_height
    assert found.numbers["order-1e-2, relative error"] == pytest.approx(0.0053, rel=0.02)


def test_gravity_series_at_100_km():
    """Far above, none but the coarsest keeps its order: 1.6e-5 and 5.5e-4."""
    found = gravity_series(100e3)
    assert found.verdict == "partly"
    assert [point.verdict for point in found.points] == ["refuted", "refuted", "confirmed"]


def test_they_are_decided_by_the_study():
    still = {"name": "still", "parked": {"latitude_deg": 0.0, "duration_s": 1.0}}
    study = Study.model_validate(
        {"name": "s", "decides": COMPUTED, "parts": ({"title": "p", "rates_hz": (10.0,), "motions": (still,)},)}
    )
    assert tuple(_COMPUTED) == COMPUTED
    found = decide(StudyResult(study, media=StudyMedia()))
    assert {verdict.claim: verdict.verdict for verdict in found} == dict.fromkeys(COMPUTED, "confirmed")
    assert all(verdict.measured and verdict.expected for verdict in found)
    with pytest.raises(ValueError, match="gyro-term needs no navigation"):
        Study.model_validate({"name": "s", "parts": ({"title": "p", "decides": ("gyro-term",), "rates_hz": (10.0,),
                                                      "motions": (still,)},)})  # fmt: skip
    with pytest.raises(ValueError, match="cheapest needs navigations"):
        Study.model_validate({"name": "s", "decides": ("cheapest",), "parts": study.parts})


@pytest.mark.parametrize("algorithm", with_slow_variants(ALGORITHMS))
def test_algorithms_that_use_later_samples(algorithm):
    """A disturbed sample changes the attitude before it if and only if the algorithm uses later samples."""
    imu, start = timed_data()
    imu = ImuData(imu.time[:121], imu.dtheta[:120].copy(), imu.dvel[:120].copy())
    attitudes = []
    for size in (0.0, 1e-4):
        turned = imu.dtheta.copy()
        turned[60] += size
        solution = navigate(ImuData(imu.time, turned, imu.dvel), start, algorithm=algorithm)
        attitudes.append(solution.q_nb[np.searchsorted(solution.time, imu.time[60] + 1e-6) - 1])
    changed = np.abs(attitudes[1] - attitudes[0]).max() > 1e-9
    assert 60 % REGISTRY[algorithm].samples == 0
    assert changed == (algorithm in LOOKS_AHEAD)
