"""What a figure shows, as numbers and words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from sinssim.exhibits import Exhibits
from sinssim.recording.figures import figure_of


def figure(exhibits: Exhibits, key: str) -> Figure:
    """Return a group of charts of a result as a figure."""
    return figure_of(exhibits.chosen(key))


def check_line(line: Any, label: str, x: Any, y: Any, color: str | None = None, dash: str | None = None) -> None:
    """Compare a line with its label, its points and its look; a label "" stands for none."""
    shown = str(line.get_label())
    assert ("" if shown.startswith("_") else shown) == label
    found = np.asarray(line.get_xdata(orig=True), dtype=float), np.asarray(line.get_ydata(orig=True), dtype=float)
    np.testing.assert_allclose(found[0], np.asarray(x, dtype=float), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[1], np.asarray(y, dtype=float), rtol=1e-9, atol=1e-12)
    if color is not None:
        assert to_hex(line.get_color()) == color
    if dash is not None:
        assert line.get_linestyle() == dash


def check_band(collection: Any, x: Any, low: Any, high: Any) -> None:
    """Compare a band between two lines with its ends."""
    points = np.concatenate([path.vertices for path in collection.get_paths()])
    for at, bottom, top in zip(x, low, high, strict=True):
        y = points[np.isclose(points[:, 0], at, rtol=1e-9, atol=1e-12), 1]
        np.testing.assert_allclose((y.min(), y.max()), (bottom, top), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose((points[:, 0].min(), points[:, 0].max()), (min(x), max(x)), rtol=1e-9, atol=1e-12)


def words(axes: Axes) -> tuple[str, str, str]:
    """Return title, label of the x axis and label of the y axis."""
    return axes.get_title(loc="left") or axes.get_title(), axes.get_xlabel(), axes.get_ylabel()


def limits(axes: Axes) -> tuple[Any, Any]:
    """Return the limits of both axes, to be compared with numbers."""
    return axes.get_xlim(), axes.get_ylim()


def bars(axes: Axes) -> list[tuple[float, float, str]]:
    """Return place, length and colour of horizontal bars."""
    return [
        (round(p.get_y() + 0.5 * p.get_height(), 9), p.get_x() + p.get_width(), to_hex(p.get_facecolor()))
        for p in axes.patches
    ]


def texts(axes: Axes) -> list[str]:
    """Return the words inside the axes."""
    return [text.get_text() for text in axes.texts]


def ticks(axes: Axes, along: str) -> list[tuple[float, str]]:
    """Return place and words of the ticks of an axis, "x" or "y", that were chosen."""
    axis = axes.xaxis if along == "x" else axes.yaxis
    return list(zip(map(float, axis.get_ticklocs()), [t.get_text() for t in axis.get_ticklabels()], strict=True))


def legend(of: Axes | Figure) -> list[str]:
    """Return the words of the legend."""
    box = of.legends[0] if isinstance(of, Figure) else of.get_legend()
    return [text.get_text() for text in box.get_texts()]


def linear(start: float, end: float, count: int) -> Sequence[float]:
    """Return evenly spaced numbers, both ends among them."""
    return [start + (end - start) * k / (count - 1) for k in range(count)]
