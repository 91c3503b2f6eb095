"""A platform in the viewer: errors beside strapdown, rates and gimbal angles, from numbers that are chosen."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.experiments.run.views.log_platform import compared, draw_platform
from sinssim.strapdown.nav_error import NavError
from tests.recording.made_platform import COMMANDED, FREE, GIMBALS, PLATFORM, RATES, SENSED, STRAPDOWN, TIME, solution
from tests.recording.spies import Drawn

X, Y, Z = (213, 94, 0), (0, 158, 115), (86, 180, 233)


def test_everything_that_is_drawn() -> None:
    drawn: Any = Drawn()
    errors = compared(PLATFORM, ("poisson", STRAPDOWN), FREE)
    names = ["platform", "poisson", "strapdown, no rate-dependent errors"]
    assert list(errors) == names
    assert [errors[name] for name in names] == [PLATFORM, STRAPDOWN, FREE]
    assert list(compared(PLATFORM, None, None)) == ["platform"]
    labels = draw_platform(drawn, solution(), errors, np.radians(SENSED))
    assert labels == {"platform": "yes", "platform_horizontal": "m", "platform_attitude": "arcmin"}
    colors = [(213, 94, 0), (230, 159, 0), (140, 140, 140)]
    horizontal = np.array([[5.0, 10.0, 5.0], [50.0, 500.0, 55.0], [100.0, 1000.0, 110.0], [75.0, 1500.0, 80.0]])
    drawn.shows("platform/horizontal", names, TIME, horizontal, colors)
    angle = 17.0 * np.array([[0.1, 1.0, 0.2], [0.2, 2.0, 0.3], [0.5, 3.0, 0.1], [0.3, 4.0, 0.05]])
    drawn.shows("platform/attitude", names, TIME, angle, colors)
    drawn.shows("platform/sensed", ["x forward", "y right", "z down"], TIME[1:], RATES, [X, Y, Z])
    drawn.shows("platform/commanded", ["x", "y", "z"], TIME[1:], COMMANDED, [X, Y, Z])
    angles = GIMBALS.copy()
    angles[1, 0] = angles[1, 2] = np.nan  # no line across the jump
    drawn.shows("platform/gimbals", ["roll", "pitch", "azimuth"], TIME, angles,
                [(230, 159, 0), (204, 121, 167), (0, 114, 178)])  # fmt: skip


def test_fewer_rows_of_an_algorithm_of_several_samples() -> None:
    """At an instant without a row, that of the next one is taken, the last one at the end."""
    drawn: Any = Drawn()
    rows = np.array([0, 2])
    few = NavError(TIME[rows], STRAPDOWN.position_ned[rows], STRAPDOWN.velocity_ned[rows], STRAPDOWN.attitude[rows])
    draw_platform(drawn, solution(), compared(PLATFORM, ("poisson", few), None), np.radians(SENSED))
    np.testing.assert_allclose(drawn.lines["platform/horizontal"][1][:, 1], [10.0, 1000.0, 1000.0, 1000.0])
