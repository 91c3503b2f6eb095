"""What the monitoring of four sensors of each kind found, chosen: tests of four samples with two windows, alarms."""

from __future__ import annotations

import numpy as np

from sinssim.sensors.fault_detection import Alarm, Monitored
from sinssim.sensors.sensor_set_section import Redundant

TIME = np.array([10.0, 10.5, 11.0, 11.5, 12.0])
SECTION = Redundant(
    type="redundant", directions=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8)),
    windows_s=(1.0,), false_alarm_probability=0.02, missed_detection_probability=0.003,
)  # fmt: skip
DEG_H, UG = np.pi / 648_000.0, 9.80665e-6

GYROS = Monitored(
    "gyro", np.array([0.5, 1.0]), np.array([[2.0, 9.0, 31.0, 4.0], [np.nan, 5.0, 45.0, 6.0]]),
    np.array([20.0, 20.0, 20.0, 15.0]),
    np.array([[40.0, 50.0, 60.0, 70.0], [20.0, 20.0, 20.0, 20.0]]) * DEG_H,
    (Alarm(11.0, 1.0, 45.25, 20.5, 11.5, 11.5, 3),), np.array([[1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 0, 1]]),
)  # fmt: skip
ACCELEROMETERS = Monitored(
    "accel", np.array([0.5, 1.0]), np.array([[3.0, 8.0, 2.0, 1.0], [np.nan] * 4]), np.array([12.0, np.nan, 12.0, 12.0]),
    np.array([[400.0, 300.0, 500.0, 450.0], [np.nan] * 4]) * UG,
    (Alarm(10.5, 0.5, 14.0, 12.0, 11.0), Alarm(11.0, 0.5, 33.0, 12.0, 11.0, 11.0, 2)), np.ones((4, 4), int),
)  # fmt: skip
