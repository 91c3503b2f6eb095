"""The page that adds a navigation frame: its code is run, compared with the level frame, and its files are counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.extending.pages import Copy, read_page

MORE = """
height = np.full(40 * 120 + 1, 1000.0)
print(*(apart(40.0, vertical=v, height=height) for v in ("truth", "baro-loop")))
for options in ({"algorithm": "functional-iteration"}, {"curvature": "simplified"}, {"rates_hz": (20.0, 20.0, 20.0)}):
    try:
        navigate(flight.increments(20.0), flight.state(0.0), frame="earth-fixed", **options)
    except Exception as error:
        print(error)
from sinssim.strapdown.navigate import Segments
imu, state = flight.increments(20.0), flight.state(0.0)
whole, engine = navigate(imu, state, frame="earth-fixed"), Segments(imu, frame="earth-fixed")
for first, last in ((0, 3), (3, 1000), (1000, 2400)):
    part = engine.navigate(first, last, state, engine.samples(first, last)[1])
    state = part.state()
print(6.4e6 * abs(state.latitude - whole.latitude[-1]) + abs(state.velocity_ned - whole.velocity_ned[-1]).max())
"""


@pytest.mark.slow
def test_page(tmp_path: Path) -> None:
    page = read_page("frame")
    copy = Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/strapdown/frames/__init__.py", "sinssim/strapdown/frames/earth_fixed.py"]
    lines = copy.run(page.snippets[0] + MORE).splitlines()
    coarse, fine = map(float, lines[0].split())
    assert coarse < 0.02  # m after 24 km
    assert coarse / fine == pytest.approx(4.0, rel=0.1)  # second order
    held, looped = map(float, lines[1].split())
    assert held < 0.02
    assert looped < 0.02
    assert lines[2].startswith("functional-iteration has its own engine for each frame, but none for earth")
    assert 'frame = "earth-fixed" has no radii of curvature; level, wander' in lines[3]
    assert (
        "the three-rate schedule works in the frames level, wander, free-azimuth, transverse and inertial, not in"
        in lines[4]
    )
    assert float(lines[5]) < 1e-6  # the segments of a filter
    assert "earth-fixed" in copy.command("list", "frames")
