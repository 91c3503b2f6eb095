"""Messages: what a file brings into them can be printed."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from sinssim import rotation
from sinssim.analyses.allan_deviation import allan_deviation
from sinssim.analyses.noise_fit import fit_noise
from sinssim.data import NavState
from sinssim.errors import InputError, RunError, printable
from sinssim.experiments.ensembles import batch_navigation
from sinssim.sensors import sensor_set_readings, single_sensors
from sinssim.sensors.imu.imu_section import Imu
from sinssim.truth.true_gravity_disturbance import Remainder


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("altitude_ft: é°µσ\n  - second", "altitude_ft: é°µσ\n  - second"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("a\x00b\r\t", "a\\x00b\\r\\t"),
        ("\u202eback\u200b", "\\u202eback\\u200b"),
        ("file-\udc80", "file-\\udc80"),
        ("5\u00a0m", "5\u00a0m"),
    ],
)
def test_what_a_terminal_does_not_show_is_written_out(text: str, shown: str) -> None:
    assert str(InputError(text)) == str(RunError(text, time=1.0)) == printable(text) == shown
    assert InputError(text).args == (shown,)


REFUSALS: dict[str, Callable[[], object]] = {
    "arrays of the leading shapes (2,), (3,) do not fit together.":
        lambda: rotation.multiply(np.ones((2, 4)), np.ones((3, 4))),
    "a quaternion needs 4 values in its last axis, not the shape (2, 3).": lambda: rotation.normalize(np.ones((2, 3))),
    "a direction cosine matrix needs the shape (3, 3) in its last axes, not (2, 3).":
        lambda: rotation.quaternion_from_dcm(np.ones((2, 3))),
    "increments of shape (1,) must be a row of two or more finite numbers.": lambda: allan_deviation(np.ones(1), 1.0),
    "samples = [3] must be whole numbers from 1 to 2.": lambda: allan_deviation(np.ones(5), 1.0, [3]),
    "increments of one channel must have the shape (N,), not (2, 3).": lambda: fit_noise(np.ones((2, 3)), 1.0),
    "a correlation time of 0.5 s cannot be identified; it must be at least the interval, 2 s, and at most a million "
    "times the record, 5.12e+08 s.": lambda: fit_noise(np.arange(256.0), 2.0, correlation_time=0.5),
    "the number of accelerometers must be a multiple of three, not 4.":
        lambda: single_sensors.draw_accelerometers(Imu(), 4),
    'sensor_set.type = "gyros" has no platform.': lambda: sensor_set_readings.draw_platform(Imu()),
    'sensor_set.type = "gyros" has no attitude sensor.': lambda: sensor_set_readings.draw_attitude_sensor(Imu()),
    "a batch needs one initial state, or one for each of 3 runs; there are 2.":
        lambda: batch_navigation._initial([START, START], 3),
    "a batch needs errors and a seed for each run; there are 0 and 2.":
        lambda: batch_navigation._check_errors([], [1, 2]),
    "a remainder of order 5 is not known; the orders are 2 and 3.":
        lambda: Remainder(SimpleNamespace(order=5), 1e3, 1),  # type: ignore[arg-type]
}  # fmt: skip
START = NavState(0.8, 0.2, 100.0, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("message", REFUSALS)
def test_what_is_refused_is_told_with_its_numbers(message: str) -> None:
    with pytest.raises(InputError) as error:
        REFUSALS[message]()
    assert str(error.value) == message
