"""Single accelerometers at places of their own, and faults of a block and of a set's sensors in SI, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from sinssim.sensors.imu.faults import ImuFault
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.single_sensors import emulate_accelerometers

DEG, ARCSEC, G = np.pi / 180.0, np.pi / 648_000.0, 9.80665
SECTION: TypeAdapter[Any] = TypeAdapter(ImuFault)


def test_an_accelerometer_reads_along_its_axis_what_its_place_feels() -> None:
    """(1 + k)(d + m) · ∫f dt + b Δt, with the lean m to two axes perpendicular to d, each by its own angle."""
    time = np.array([2.0, 2.5, 2.6])
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.8, -0.6], [0.48, 0.6, 0.64], [0.6, 0.0, -0.8],
                     [0.0, -1.0, 0.0]])  # fmt: skip
    force = np.random.default_rng(3).normal(size=(2, 6, 3))
    bias, scale = np.array([[0.1, -0.2, 0.3], [0.4, 0.5, -0.6]]), np.array([[0.01, 0.02, -0.03], [0.04, -0.05, 0.06]])
    lean = np.zeros((2, 3, 3))
    lean[:, ~np.eye(3, dtype=bool)] = 1e-3 * np.arange(1.0, 13.0).reshape(2, 6)
    errors = [TriadErrors(bias=bias[k], scale=scale[k], misalignment=lean[k]) for k in range(2)]
    found = emulate_accelerometers(time, force, axes, Imu(grade="ideal"), 5, errors)
    for i, d in enumerate(axes):
        block, axis = divmod(i, 3)
        first = np.cross(d, np.eye(3)[np.argmin(np.abs(d))])
        first /= np.linalg.norm(first)
        across = {(axis + 1) % 3: first, (axis + 2) % 3: np.cross(d, first)}  # of a right-handed triad
        felt = d + sum(lean[block, axis, other] * vector for other, vector in across.items())
        expected = (1.0 + scale[block, axis]) * (force[:, i] @ felt) + bias[block, axis] * np.diff(time)
        np.testing.assert_allclose(found[:, i], expected, rtol=1e-13, err_msg=str(i))


def described(**keys: Any) -> Any:
    return SECTION.validate_python(keys)


@pytest.mark.parametrize(
    ("keys", "begin", "end", "amount"),
    [
        ({"type": "spike", "at_s": 3.5, "gyro_arcsec": (1.0, -2.0, 3.0), "accel_mm_s": (4.0, 5.0, -6.0)}, 3.5, 3.5,
         [ARCSEC, -2.0 * ARCSEC, 3.0 * ARCSEC, 4e-3, 5e-3, -6e-3]),
        ({"type": "spike", "at_s": 3.5, "accel_mm_s": (4.0, 5.0, -6.0)}, 3.5, 3.5, [0.0, 0.0, 0.0, 4e-3, 5e-3, -6e-3]),
        ({"type": "bias-step", "from_s": 2.0, "to_s": 7.0, "gyro_deg_h": (1.0, -2.0, 3.0), "accel_ug": (4.0, 5.0, 6.0)},
         2.0, 7.0, [DEG / 3600.0, -2.0 * DEG / 3600.0, 3.0 * DEG / 3600.0, 4e-6 * G, 5e-6 * G, 6e-6 * G]),
        ({"type": "bias-step", "from_s": 2.0, "gyro_deg_h": (0.0, 0.0, 9.0)}, 2.0, np.inf,
         [0.0, 0.0, DEG / 400.0, 0.0, 0.0, 0.0]),
        ({"type": "saturation", "from_s": 2.0, "gyro_deg_s": 30.0, "accel_g": 1.5}, 2.0, np.inf,
         [30.0 * DEG] * 3 + [1.5 * G] * 3),
        ({"type": "saturation", "from_s": 2.0, "accel_g": 1.5}, 2.0, np.inf, [0.0] * 3 + [1.5 * G] * 3),
        ({"type": "jitter", "from_s": 2.0, "to_s": 8.0, "sigma_ms": 0.4}, 2.0, 8.0, [4e-4] + [0.0] * 5),
        ({"type": "dropout", "from_s": 2.0, "channels": ("gyro_y", "accel_x")}, 2.0, np.inf,
         [0.0, 1.0, 0.0, 1.0, 0.0, 0.0]),
        ({"type": "freeze", "from_s": 2.0, "to_s": 3.0}, 2.0, 3.0, [1.0] * 6),
    ],
)  # fmt: skip
def test_faults_of_a_block(keys: dict[str, Any], begin: float, end: float, amount: list[float]) -> None:
    found = described(**keys).fault()
    assert (found.kind, found.start, found.end) == (keys["type"], begin, end)
    np.testing.assert_allclose(found.amount, amount, rtol=1e-14)


SIZES = (1.0, -2.0, 3.0, 4.0, 7.0)


@pytest.mark.parametrize(
    ("keys", "begin", "end", "gyro", "accel"),
    [
        ({"type": "spike", "at_s": 3.5, "gyro_arcsec": SIZES, "accel_mm_s": SIZES[::-1]}, 3.5, 3.5, 7.0 * ARCSEC, 1e-3),
        ({"type": "bias-step", "from_s": 2.0, "to_s": 7.0, "gyro_deg_h": SIZES, "accel_ug": SIZES[::-1]}, 2.0, 7.0,
         7.0 * DEG / 3600.0, 1e-6 * G),
        ({"type": "bias-step", "from_s": 2.0, "accel_ug": SIZES}, 2.0, np.inf, 0.0, 7e-6 * G),
        ({"type": "dropout", "from_s": 2.0, "channels": ("gyro_5", "accel_4")}, 2.0, np.inf, 1.0, 0.0),
        ({"type": "freeze", "from_s": 2.0, "to_s": 4.0, "channels": ("gyro_4", "accel_5")}, 2.0, 4.0, 0.0, 1.0),
        ({"type": "freeze", "from_s": 2.0}, 2.0, np.inf, 1.0, 1.0),
    ],
)  # fmt: skip
def test_faults_of_the_fifth_sensor(keys: dict[str, Any], begin: float, end: float, gyro: float, accel: float) -> None:
    """It is the second axis of the second block that emulates it."""
    found = described(**keys).fault(4)
    assert (found.kind, found.start, found.end) == (keys["type"], begin, end)
    np.testing.assert_allclose(found.amount, [0.0, gyro, 0.0, 0.0, accel, 0.0], rtol=1e-14)


def test_a_range_is_that_of_all_sensors() -> None:
    found = described(type="saturation", from_s=2.0, gyro_deg_s=30.0, accel_g=1.5).fault(4)
    np.testing.assert_allclose(found.amount, [30.0 * DEG] * 3 + [1.5 * G] * 3, rtol=1e-14)
