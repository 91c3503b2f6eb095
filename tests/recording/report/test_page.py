"""Drawings on a page have its paper and ink, light or dark."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest

from sinssim.recording.diagrams import ATTITUDE, DIAGRAMS, POSITION, SENSOR, VELOCITY
from sinssim.recording.page import page
from sinssim.recording.svg_chart import STYLE


@pytest.mark.parametrize("name", DIAGRAMS)
def test_every_neutral_colour_of_a_drawing_follows_the_page(name: str) -> None:
    """What has neither the colour of a quantity nor one by a rule of the page would be illegible in the dark."""
    rules, neutral = page("x", [], STYLE), set()
    for part in ET.fromstring(DIAGRAMS[name]()).iter():
        for paint in ("fill", "stroke"):
            color = part.get(paint)
            if color in (None, "none", SENSOR, ATTITUDE, VELOCITY, POSITION):
                continue
            selectors = [f'svg [{paint}="{color}"]', part.tag.partition("}")[2]]
            selectors += [f".{kind}" for kind in part.get("class", "").split()]
            followed = (re.search(rf"{re.escape(s)} \{{ {paint}: var\(--", rules) for s in selectors)
            assert any(followed), (part.tag, part.attrib)
            neutral.add(color)
    assert "#fff" in neutral or name == "one_component_axes"  # which has no block
    assert len(neutral) > 1
