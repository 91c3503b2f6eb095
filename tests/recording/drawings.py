"""The words of a drawing: what they are, and whether they are legible."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET

_TEXT = "{http://www.w3.org/2000/svg}text"
_LETTER = 6.4  # px, at most on average, at 12 px


def words_of(svg: str) -> list[str]:
    """Return the words of a drawing, subscripts among them."""
    return ["".join(text.itertext()).replace("\u200b", "") for text in ET.fromstring(svg).iter(_TEXT)]


def extents(svg: str) -> list[tuple[str, float, float, float, float]]:
    """Return the words with left, right, top and bottom, px."""
    boxes = []
    for text in ET.fromstring(svg).iter(_TEXT):
        words = "".join(text.itertext()).replace("\u200b", "")
        small = sum(len(part.text or "") for part in text if part.get("font-size"))
        width = _LETTER * (len(words) - 0.25 * small)
        x, y = float(text.get("x", 0)), float(text.get("y", 0))
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[text.get("text-anchor", "start")] * width
        boxes.append((words, left, left + width, y - 9.0, y + 2.0))
    return boxes


def check_words(svg: str) -> None:
    """Assert that all words lie within a drawing and apart."""
    width, height = (float(v) for v in ET.fromstring(svg).get("viewBox", "").split()[2:])
    boxes = extents(svg)
    for words, left, right, top, bottom in boxes:
        assert left >= 0.0, words
        assert right <= width, words
        assert top >= 0.0, words
        assert bottom <= height, words
    for (a, l1, r1, t1, b1), (b, l2, r2, t2, b2) in itertools.combinations(boxes, 2):
        assert r1 <= l2 or r2 <= l1 or b1 <= t2 or b2 <= t1, (a, b)
