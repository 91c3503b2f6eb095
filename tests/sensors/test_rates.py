"""A block that gives rates: mean rates are increments, instantaneous rates cost what the trapezoidal rule costs."""

from __future__ import annotations

from math import pi, radians, sin, tan
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.alignment.alignment_budget import expected_errors
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.data import Array
from sinssim.experiments.run.run_result import Run
from sinssim.scenario import Scenario
from sinssim.scenario.plan_summary import plan_lines
from sinssim.strapdown.attitude import rotation_vector
from tests.analyses.error_budget.worlds import ALLOWED, ensemble, standard_errors
from tests.analyses.error_budget.worlds import scenario as turning
from tests.slow import slow

PLACE = {"latitude_deg": 50.0, "longitude_deg": 14.5, "altitude_m": 300.0}


def scenario(output: str, motion: dict[str, Any], imu: dict[str, Any] | None = None, **more: Any) -> Scenario:
    data = {"name": "rates", "motion": {**PLACE, **motion}, **more}
    return Scenario.model_validate(
        {**data, "imu": {"grade": "ideal", "rate_hz": 50.0, "output": output, **(imu or {})}}
    )


CONE = {"type": "coning", "half_angle_deg": 1.0, "frequency_hz": 2.0, "duration_s": 20.0}
OTHER_CONE = {**CONE, "frequency_hz": 3.0**0.5}
"""A cone whose turns are no whole number of samples."""


@pytest.mark.parametrize("imu", [{"grade": "tactical"}, {"grade": "mems-industrial", "gyro_range_deg_s": 5.0}])
def test_mean_rates_times_the_interval_are_the_increments(imu: dict[str, Any]) -> None:
    """Bit for bit: without pulses, a block that divides by the interval gives the same information."""
    none = {"gyro_quantum_arcsec": 0.0, "accel_quantum_mm_s": 0.0}
    one, other = (sinssim.run(scenario(name, CONE, {**imu, **none})) for name in ("increments", "mean-rates"))
    assert np.array_equal(one.sensed.measured.dtheta, other.sensed.measured.dtheta)
    assert np.array_equal(one.sensed.measured.dvel, other.sensed.measured.dvel)
    assert np.array_equal(one.solutions["quaternion"].q_nb, other.solutions["quaternion"].q_nb)


@pytest.mark.parametrize("output", ["mean-rates", "instantaneous-rates"])
def test_each_rate_is_rounded_by_itself(output: str) -> None:
    """Errors of at most half a step, independent of each other: variance Q²/12, whose sum grows with their number."""
    quantum = radians(20.0 / 3600.0)
    run = sinssim.run(scenario(output, OTHER_CONE, {"gyro_quantum_arcsec": 20.0}))
    error = run.sensed.measured.dtheta - run.sensed.perfect.imu.dtheta
    steps = 1.0 if output == "mean-rates" else 2.0  # a trapezoid is the mean of two readings
    assert run.sensed.measured.dtheta * steps / quantum == pytest.approx(
        np.rint(run.sensed.measured.dtheta * steps / quantum), abs=1e-6
    )
    across = error[:, 1:]
    assert np.abs(across).max() <= 0.5 * quantum * (1.0 + 1e-9)
    assert np.var(across) == pytest.approx(quantum**2 / 12.0 / steps, rel=0.15)
    assert np.abs(np.cumsum(across, axis=0)).max() > 3.0 * quantum
    counted = sinssim.run(scenario("increments", OTHER_CONE, {"gyro_quantum_arcsec": 20.0}))
    sums = np.cumsum(counted.sensed.measured.dtheta - counted.truth.ideal.dtheta, axis=0)
    assert np.abs(sums).max() <= 0.5 * quantum * (1.0 + 1e-6)


def _slope(run: Run, name: str, values: str, axis: int, per_turn: int) -> float:
    """Return the growth of an error over whole turns, per second."""
    error = run.errors[name]
    rows: Array = getattr(error, values)[:, axis]
    last = (len(rows) - 1) // (4 * per_turn) * (4 * per_turn)
    return float((rows[last] - rows[0]) / (error.time[last] - error.time[0]))


@pytest.mark.parametrize(("algorithm", "samples"), [("rotation-vector-1", 1), ("rotation-vector-2", 2)])
def test_instantaneous_rates_under_coning(algorithm: str, samples: int) -> None:
    """d' = κ² (½ a²Ω + d) − ½ a²Ω with κ = x/tan x, x = ΩT/2, at three rates; of second order in the interval."""
    alpha, frequency = radians(1.0), 2.0
    drifts = []
    for rate in (25.0, 50.0, 100.0):
        plan = scenario(
            "instantaneous-rates", CONE, {"rate_hz": rate}, navigation={"algorithms": (algorithm,), "vertical": "truth"}
        )
        omega = 2.0 * pi * frequency
        x = 0.5 * omega / rate
        cone, of_algorithm = (
            2.0 * omega * sin(0.5 * alpha) ** 2,
            rotation_vector.drift_under_coning(samples, alpha, omega, 1.0 / rate),
        )
        expected = (x / tan(x)) ** 2 * (cone + of_algorithm) - cone
        found = -_slope(sinssim.run(plan), algorithm, "attitude", 0, round(rate / frequency))
        drifts.append(found)
        assert found == pytest.approx(expected, rel=0.01)
    assert np.log2(drifts[0] / drifts[1]) == pytest.approx(2.0, abs=0.15)
    assert np.log2(drifts[1] / drifts[2]) == pytest.approx(2.0, abs=0.05)


def test_instantaneous_rates_under_sculling() -> None:
    """(κ² − 1) (½ a A − ¼ g a²): the rotation a and the acceleration A, both integrated with the factor κ.

    A = −bΩ², because rotation and displacement are in phase. The algorithm's own error is 0.7 % of this.
    """
    motion = {"type": "sculling", "angle_deg": 0.5, "displacement_mm": 10.0, "frequency_hz": 2.0, "duration_s": 20.0}
    a, omega, rate = radians(0.5), 4.0 * pi, 50.0
    x, acceleration = 0.5 * omega / rate, -0.01 * omega**2
    expected = ((x / tan(x)) ** 2 - 1.0) * (0.5 * a * acceleration - 0.25 * 9.81 * a**2)
    plan = scenario(
        "instantaneous-rates", motion, {"rate_hz": rate},
        navigation={"algorithms": ("rotation-vector-2",), "vertical": "free"},
    )  # fmt: skip
    found = _slope(sinssim.run(plan), "rotation-vector-2", "velocity_ned", 2, 25)
    assert found == pytest.approx(expected, rel=0.015)


def test_calibration_acts_on_the_readings() -> None:
    """A perfect calibration restores what the trapezoidal rule makes of perfect readings."""
    errors = {"gyro_scale_sigma_ppm": 3000.0, "accel_quadratic_sigma_ug_per_g2": 500.0, "gyro_bias_sigma_deg_h": 50.0}
    run = sinssim.run(scenario("instantaneous-rates", CONE, errors, compensation={}))
    assert run.sensed.imu.dtheta == pytest.approx(run.sensed.perfect.imu.dtheta, abs=1e-14)
    assert run.sensed.imu.dvel == pytest.approx(run.sensed.perfect.imu.dvel, abs=1e-13)


def test_filter_assumes_the_rounding_as_white_noise() -> None:
    plan = scenario("mean-rates", CONE, {"gyro_quantum_arcsec": 20.0, "gyro_arw_deg_sqrt_h": 0.1})
    found = expected_errors(plan.imu).sigma.gyro
    assert found.quantum == 0.0
    assert found.random_walk**2 == pytest.approx(
        radians(0.1 / 60.0) ** 2 + radians(20.0 / 3600.0) ** 2 * 50.0 / 12.0, rel=1e-12
    )


def test_note_on_rates_that_are_too_coarse() -> None:
    coarse = {"gyro_quantum_arcsec": 20.0, "gyro_arw_deg_sqrt_h": 0.1}
    for imu, said in (
        (coarse, r"the gyro rates is 23.6 times the noise"),
        ({**coarse, "gyro_arw_deg_sqrt_h": 1.2}, ""),
    ):
        notes = [line for line in plan_lines(scenario("mean-rates", CONE, imu)) if "imu.output" in line]
        assert len(notes) == bool(said)
        assert said in "".join(notes)


@pytest.mark.parametrize(
    ("output", "runs"), [("instantaneous-rates", 30), *slow(("instantaneous-rates", 100), ("mean-rates", 100))]
)
def test_budget_agrees_with_an_ensemble(output: str, runs: int) -> None:
    """Fails by chance with 0.3 % at most. The integration error of the trapezoids is one of the algorithm.

    The noise of a reading is half a step, so that the rounding is white noise.
    """
    imu = {"output": output, "gyro_quantum_arcsec": 5.0, "accel_quantum_mm_s": 2.0, "gyro_bias_sigma_deg_h": 0.5,
           "gyro_arw_deg_sqrt_h": 0.19, "accel_vrw_ug_sqrt_hz": 460.0}  # fmt: skip
    plan = turning(imu=imu)
    result = budget(plan)
    assert np.abs(standard_errors(ensemble(plan, result, runs), result)).max() < ALLOWED


@pytest.mark.parametrize(
    ("output", "imu", "message"),
    [
        ("mean-rates", {"sensor_set": {"type": "redundant"}}, r'output = "mean-rates" needs a block of three gyros'),
        ("instantaneous-rates", {"accel_delay_ms": 1.0}, r"accel_delay_ms acts on the mean over an interval"),
        (
            "instantaneous-rates",
            {"faults": [{"type": "jitter", "sigma_ms": 0.1, "from_s": 1.0}]},
            r"faults\.1: a jitter of the time stamps is not possible",
        ),
    ],
)
def test_what_is_refused(output: str, imu: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scenario(output, CONE, imu)
