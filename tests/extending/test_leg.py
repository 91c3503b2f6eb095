"""The page that adds a leg of a flight plan: its code is run, its leg is flown, its files are counted."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page

MEASURE = """
import math
lat, lon, heading = math.radians(50.0), math.radians(14.0), math.radians(40.0)
north = np.array([-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)])
east = np.array([-math.sin(lon), math.cos(lon), 0.0])
to_the_right = (log.position_ecef - log.position_ecef[0]) @ (east * math.cos(heading) - north * math.sin(heading))
print(-to_the_right.min(), to_the_right.max(), to_the_right.argmin() < to_the_right.argmax())
print(np.median(log.channels["load_factor"].values))
"""


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    made = Copy(tmp_path)
    made.apply(read_page("leg"))
    return made


def test_page(copy: Copy) -> None:
    assert copy.touched == ["sinssim/truth/flight/legs/__init__.py", "sinssim/truth/flight/legs/figure_eight.py"]
    said = copy.command("check", "scenarios/figure_eight.toml")
    assert re.search(r"leg 1 +figure_eight +about 1 min 18 s +first = left, bank_deg = 40", said)


@pytest.mark.slow
def test_the_leg_is_flown(copy: Copy) -> None:
    page = read_page("leg")
    lines = copy.run(page.snippets[0] + MEASURE).splitlines()
    estimated, flown = map(float, re.findall(r"[\d.]+(?= s)", lines[0]))
    # two circles of 2πV/(g tan bank) at 95 kt calibrated, 5 % more of true airspeed at 1000 m
    speed = 95.0 * 1852.0 / 3600.0 / math.sqrt(0.9075)  # density over that at sea level, standard atmosphere
    circle = 2.0 * math.pi * speed / (9.80665 * math.tan(math.radians(40.0)))
    assert estimated == pytest.approx(2.0 * circle, rel=5e-3)
    # the last right angle of a circle ends slowly: the heading's error decays with the autopilot's heading_time_s
    assert 2.0 * circle < flown < 2.0 * circle + 2.0 * 15.0
    # a circle to the left, then one to the right, each two radii wide
    left, right, left_first = lines[2].split()
    radius = speed**2 / (9.80665 * math.tan(math.radians(40.0)))
    assert float(left) == pytest.approx(2.0 * radius, rel=0.2)
    assert float(right) == pytest.approx(2.0 * radius, rel=0.2)
    assert left_first == "True"
    assert float(lines[3]) == pytest.approx(1.0 / math.cos(math.radians(40.0)), rel=0.03)  # of a level turn
