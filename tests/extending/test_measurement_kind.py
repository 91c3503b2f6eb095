"""The page that adds a kind of measurement: H against differences, a run with it, the files counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page

DIFFERENCES = """
import numpy as np
from scipy.spatial.transform import Rotation
from sinssim.data import Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.linearisation import Prediction, observe

blocks = [Block(name, 1.0) for name in ("position", "velocity", "attitude")] + [Block("beacon bias", np.ones(1))]
model = ErrorModel(tuple(blocks), 0.0, 0.0)
lat, lon, height, arm = 0.87, 0.24, 3000.0, np.array([2.0, -5.0, -1.0])
value = np.array([[20_000.0, 0.873, 0.2405, 100.0]])
reading = Measurements("range", np.zeros(1), np.zeros(1), value, np.ones((1, 1)), arm, "beacon")
w = 1.0 - 0.00669437999014 * np.sin(lat) ** 2
north, east = 6378137.0 * (1.0 - 0.00669437999014) / w**1.5 + height, (6378137.0 / w**0.5 + height) * np.cos(lat)

def residual(x):
    q = (Rotation.from_rotvec(-x[6:9]) * Rotation.from_euler("ZYX", (1.1, 0.2, -0.5))).as_quat(scalar_first=True)
    state = NavState(*(np.array([v]) for v in (lat + x[0] / north, lon + x[1] / east, height - x[2])),
                     x[None, 3:6], q[None])
    known = {"beacon bias": -x[9:10]}  # a parameter's error is its true value less the compensated one
    return [part[0] for part in observe(reading, Prediction(state, np.zeros((1, 3)), WGS84), model, known)]

def slope(j, step):
    x = np.zeros(10)
    x[j] = step
    return (residual(x)[0][0] - residual(-x)[0][0]) / (2.0 * step)

h = residual(np.zeros(10))[1][0]
numeric = np.array([slope(j, 1e-4 if 6 <= j < 9 else 1.0) for j in range(10)])
print(np.abs(numeric - h).max(), np.abs(h[6:9]).max())
inertial = result.aided.estimate
print(float(np.sum((result.aided.error.position_ned[-1] / inertial.sigma[-1, :3]) ** 2)))
a, b = inertial.sigma[[0, -1], :2]
print(a.min(), b.min(), b.max())
"""


@pytest.mark.slow
def test_page(tmp_path: Path) -> None:
    page = read_page("measurement-kind")
    copy = Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/sensors/aiding/beacon.py"]
    lines = copy.run(page.snippets[0] + DIFFERENCES).splitlines()
    assert lines[0] == "120 of 120 readings taken"
    off, of_attitude = map(float, lines[-3].split())
    assert off < 1e-5  # metres per radian for the attitude, 1 at most for the others
    assert of_attitude > 0.1  # the lever arm across the line of sight: not trivially zero
    # three errors, told truly: beyond 21 one time in 10⁴
    assert 0.0 < float(lines[-2]) < 21.1
    first, best, worst = map(float, lines[-1].split())
    assert first > 190.0
    assert best < 30.0  # along the line of sight no better than the transponder's delay, 10 m, across by its turn
    assert worst < 120.0
