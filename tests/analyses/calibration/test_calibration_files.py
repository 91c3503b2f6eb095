"""The numbers of a calibration in calibration.json, from estimates that are chosen."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim.analyses.calibration_problem import Estimate, Parameter, Solution
from sinssim.analyses.calibration_result import CalibrationResult, to_json

DEG_H, MICRO_G, SECOND = pi / 648_000.0, 9.80665e-6, pi / 648_000.0
SIZES = np.array([DEG_H, MICRO_G, 1e-6, SECOND, 1e-3])
PARAMETERS = (
    Parameter("gyro", "bias", 1, 1, 0.5 * DEG_H), Parameter("accel", "bias", 2, 2, 60.0 * MICRO_G),
    Parameter("gyro", "scale", 0, 0, 11e-6), Parameter("accel", "misalignment", 1, 0, 7.0 * SECOND),
    Parameter("accel", "arm", 2, 1, 0.012),
)  # fmt: skip


def result(method: str = "separate", truth: bool = True) -> CalibrationResult:
    covariance = np.diag(np.square(np.array([0.01, 2.0, 0.5, 0.25, 4.0]) * SIZES))
    covariance[0, 1] = covariance[1, 0] = 0.5 * 0.01 * DEG_H * 2.0 * MICRO_G
    directions = np.eye(5)[:, [1, 2, 0, 4, 3]]
    solution = Solution(
        np.zeros(5), covariance, np.array([9.0, 7.0, 5.0, 3.0, 0.0]), directions, 4,
        np.array([True, True, True, False, True]), 33.5, 31,
    )  # fmt: skip
    values = np.array([0.3, -45.0, 8.0, 0.0, 14.0]) * SIZES
    own = Estimate(
        values, solution, 3, np.array([[1e-9, 2e-9, 3e-9]]), np.array([[4e-6, 5e-6, 6e-6]]), np.zeros(6),
        np.array([2.0, -3.0, 4.0]) * SECOND,
    )  # fmt: skip
    true = np.array([0.28, -43.0, 9.0, 3.0, 2.0]) * SIZES if truth else None
    scenario = SimpleNamespace(name="table", description="twelve positions")
    return CalibrationResult(scenario, method, PARAMETERS, own, np.array([[1.0, 61.0], [70.0, 130.0]]), true, ("n",))


def test_the_parameters_in_their_units() -> None:
    found = to_json(result())
    keys = ("name", "value", "sigma", "unit", "observable", "size_before", "true", "error_over_sigma", "value_si",
            "sigma_si", "unit_si")  # fmt: skip
    wanted = [
        ("gyro bias y", 0.3, 0.01, "deg/h", True, 0.5, 0.28, 2.0, 0.3 * DEG_H, 0.01 * DEG_H, "rad/s"),
        ("accel bias z", -45.0, 2.0, "µg", True, 60.0, -43.0, -1.0, -45.0 * MICRO_G, 2.0 * MICRO_G, "m/s²"),
        ("gyro scale x", 8.0, 0.5, "ppm", True, 11.0, 9.0, -2.0, 8e-6, 0.5e-6, "1"),
        ("accel misalignment yx", 0.0, 0.25, "arcsec", False, 7.0, 3.0, -12.0, 0.0, 0.25 * SECOND, "rad"),
        ("accel arm zy", 14.0, 4.0, "mm", True, 12.0, 2.0, 3.0, 0.014, 0.004, "m"),
    ]
    for one, row in zip(found["parameters"], wanted, strict=True):
        assert list(one) == list(keys)
        for key, value in zip(keys, row, strict=True):
            expected = pytest.approx(value, rel=1e-9) if isinstance(value, float) else value
            assert one[key] == expected, (row[0], key)


def test_the_rest_of_a_calibration() -> None:
    """χ² of the errors: (e₁² − 2 ρ e₁ e₂ + e₂²)/(1 − ρ²) of the correlated pair, 2² + 3² of the others."""
    found = to_json(result())
    assert (found["name"], found["description"], found["method"]) == ("table", "twelve positions", "separate")
    assert found["frame"] == "the axes of the table's positions, in which [turntable] gives attitudes and turns"
    assert found["covariance_si"] == result().covariance.tolist()
    assert found["unobservable"] == ["accel misalignment yx"]
    assert found["singular_values"] == [9.0, 7.0, 5.0, 3.0, 0.0]
    assert found["directions"] == np.eye(5)[[1, 2, 0, 4, 3]].tolist()  # one row each
    assert found["residuals"] == {
        "chi_square": 33.5, "degrees_of_freedom": 31, "gyro_rad_s": [[1e-9, 2e-9, 3e-9]],
        "accel_mps2": [[4e-6, 5e-6, 6e-6]],
    }  # fmt: skip
    pair = (2.0**2 - 2.0 * 0.5 * 2.0 * -1.0 + 1.0) / (1.0 - 0.5**2)
    assert found["errors"] == {"chi_square": pytest.approx(pair + 4.0 + 9.0), "degrees_of_freedom": 4}
    assert found["table_tilt_arcsec"] == pytest.approx([2.0, -3.0, 4.0])
    assert found["dwells_s"] == [[1.0, 61.0], [70.0, 130.0]]
    assert (found["iterations"], found["notes"]) == (3, ["n"])
    log = to_json(result("systematic", truth=False))
    assert log["residuals"]["velocity_over_sigma"] == [[4e-6, 5e-6, 6e-6]]
    assert "accel_mps2" not in log["residuals"]
    assert log["frame"].startswith("the frame of the accelerometers")
    assert log["errors"] is log["parameters"][0]["true"] is log["parameters"][0]["error_over_sigma"] is None
