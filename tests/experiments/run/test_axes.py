"""The drawing of the axes: angles are those of the run, and the perspective is right-handed."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run.navigation_scheme import axes_exhibits, seen
from sinssim.rotation import quaternion_from_euler
from tests.recording.spies import html

SVG = "{http://www.w3.org/2000/svg}"


def drawn(
    latitude: float, angles: tuple[float, float, float], frame: str = "level", azimuth: Any = None,
    headings: str | None = None,
) -> str:  # fmt: skip
    """Draw the axes for a latitude and roll, pitch and heading in degrees."""
    truth = SimpleNamespace(
        q_nb=np.array([quaternion_from_euler(*np.radians(angles))]),
        latitude=np.radians([latitude]),
        longitude=np.radians([7.0]),
    )
    solution = SimpleNamespace(azimuth=None if azimuth is None else np.radians(azimuth))
    scenario = SimpleNamespace(navigation=SimpleNamespace(frame=frame), output=SimpleNamespace(angles=headings))
    return html(*axes_exhibits(scenario, truth, {"quaternion": solution}))  # type: ignore[arg-type, dict-item]


def labels(page: str) -> dict[str, np.ndarray]:
    svg = page[: page.index("</svg>") + 6]
    return {
        "".join(text.itertext()).replace("\u200b", ""): np.array([float(text.get("x", 0)), float(text.get("y", 0))])
        for text in ET.fromstring(svg).iter(f"{SVG}text")
    }


def test_perspective_looks_down_on_right_handed_axes():
    origin = np.array(seen(np.zeros(3)))
    north, east, down = (np.array(seen(axis)) - origin for axis in np.eye(3))
    # pixels count downwards, so that clockwise is a positive product
    assert north[0] * east[1] - north[1] * east[0] > 0.0
    assert down[0] == 0.0
    assert down[1] > 0.0
    np.testing.assert_allclose(np.array(seen([2.0, -1.0, 0.5])) - origin, 2 * north - east + 0.5 * down, atol=1e-9)
    # a unit sphere is seen as a unit circle: the projection is parallel and its plane is orthogonal to the view
    gram = np.stack([north, east, down]).T
    scale = float(np.sum(gram**2)) / 2.0
    np.testing.assert_allclose(gram @ gram.T, scale * np.eye(2), atol=1e-9 * scale)


@pytest.mark.parametrize(
    ("angles", "ahead"),
    [((0.0, 0.0, 90.0), [0, 1, 0]), ((0.0, 90.0, 0.0), [0, 0, -1]), ((10.0, 0.0, 180.0), [-1, 0, 0])],
)
def test_body_points_where_its_angles_say(angles, ahead):
    at = labels(drawn(45.0, angles))["x"] - np.array(seen(np.zeros(3)))
    wanted = np.array(seen(np.array(ahead, float))) - np.array(seen(np.zeros(3)))
    # within the shift of a label beside an axis below it
    assert at @ wanted / np.linalg.norm(at) / np.linalg.norm(wanted) > np.cos(np.radians(15.0))


def test_sentences_have_the_angles_of_the_run():
    text = drawn(-35.0, (-20.0, 25.0, 45.0))
    assert "latitude −35.000°, longitude 7.000°, heading 45.00°, pitch 25.00°, roll −20.00°" in text
    assert {"ψ", "θ", "φ", "N", "E", "D", "x", "y", "z"} <= set(labels(text))
    assert "heading −60.00°" in drawn(50.0, (0.0, 0.0, 300.0), headings="-90..270")
    level = drawn(0.0, (0.0, 0.0, 0.0))
    assert not {"ψ", "θ", "φ"} & set(labels(level))  # arcs of no angle are left out


def test_azimuth_of_a_frame_of_its_own():
    text = drawn(60.0, (0.0, 0.0, 30.0), "transverse", (80.0, 95.5))
    assert "xw" in labels(text)
    assert re.search(r"x<sub>w</sub> of the frame “transverse” points 80.00° from north.* and 95.50° at the end", text)
    assert "xw" not in labels(drawn(60.0, (0.0, 0.0, 30.0), "wander", (0.0, 95.5)))
    assert "meridian of Greenwich" in drawn(60.0, (0.0, 0.0, 30.0), "inertial")
