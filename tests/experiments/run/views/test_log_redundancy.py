"""The monitoring in the viewer: statistics, thresholds, sensors in use, events, errors with and without."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run.views import log_redundancy as view
from sinssim.strapdown.nav_error import NavError
from tests.recording.made_monitoring import ACCELEROMETERS, GYROS, TIME
from tests.recording.spies import Drawn

PINK, AIDED = (225, 30, 110), (0, 114, 178)
NONE = np.nan


def test_statistics_thresholds_and_sensors_in_use() -> None:
    drawn: Any = Drawn()
    labels = view.draw_monitoring(drawn, TIME, [GYROS, ACCELEROMETERS])
    assert labels == {"redundancy": "yes", "redundancy_gyro_threshold": "20", "redundancy_accel_threshold": "12"}
    at = TIME[1:]
    statistic = np.array([[2.0, NONE], [9.0, 5.0], [31.0, 45.0], [4.0, 6.0]])
    drawn.shows("redundancy/gyro/statistic", ["sample", "1 s"], at, statistic)
    drawn.shows("redundancy/gyro/threshold", ["threshold"], at, [[20.0], [20.0], [20.0], [15.0]], [PINK])
    drawn.shows("redundancy/accel/threshold", ["threshold"], at, [[12.0], [NONE], [12.0], [12.0]], [PINK])
    used = [[1.0, 2.0, 3.0, 4.0]] * 3 + [[1.0, 2.0, NONE, 4.0]]
    drawn.shows("redundancy/gyro/used", ["1", "2", "3", "4"], at, used)
    drawn.shows("redundancy/accel/used", ["1", "2", "3", "4"], at, [[1.0, 2.0, 3.0, 4.0]] * 4)


def test_a_thinned_statistic_keeps_its_peaks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rows for four samples: the larger of each pair, so that an alarm is never hidden."""
    monkeypatch.setattr(view, "thinned", lambda count: np.array([0, 2]))
    drawn: Any = Drawn()
    view.draw_monitoring(drawn, TIME, [GYROS])
    drawn.shows("redundancy/gyro/statistic", ["sample", "1 s"], TIME[[1, 3]], [[9.0, 5.0], [31.0, 45.0]])
    drawn.shows("redundancy/gyro/threshold", ["threshold"], TIME[[1, 3]], [[20.0], [20.0]], [PINK])


def test_events_of_the_monitoring() -> None:
    """A fault that is isolated later than detected has two events, one that is isolated at once has one."""
    assert [(event.time, event.text) for event in view.alarm_events([GYROS, ACCELEROMETERS])] == [
        (11.0, "fault of the gyros detected"), (11.5, "gyro 3 excluded"),
        (10.5, "fault of the accelerometers detected, not isolated"), (11.0, "accelerometer 2 excluded"),
    ]  # fmt: skip


def test_errors_with_and_without() -> None:
    place, tilt = np.array([[3.0, 4.0, 9.0], [-6.0, 8.0, 9.0], [5.0, -12.0, 9.0]]), np.array([[2.0, 3.0, 6.0]] * 3)
    time, arcsec = np.array([5.0, 6.0, 8.0]), np.pi / 648_000.0
    own = NavError(time, 0.5 * place, np.zeros((3, 3)), tilt * arcsec * [[1.0], [2.0], [3.0]])
    without = NavError(time, 100.0 * place, np.zeros((3, 3)), 5.0 * tilt * arcsec)
    drawn: Any = Drawn()
    labels = view.draw_with_and_without(drawn, ("poisson", own), without)
    assert labels == {
        "redundancy_algorithm": "poisson", "redundancy_horizontal": "m", "redundancy_attitude": "arcsec",
    }  # fmt: skip
    names, colors = ["without monitoring", "with monitoring"], [PINK, AIDED]
    horizontal = [[500.0, 2.5], [1000.0, 5.0], [1300.0, 6.5]]
    drawn.shows("redundancy/horizontal", names, time, horizontal, colors)
    drawn.shows("redundancy/attitude", names, time, [[35.0, 7.0], [35.0, 14.0], [35.0, 21.0]], colors)
    assert drawn.lines["redundancy/horizontal"][4] == [3.0, 1.5]
