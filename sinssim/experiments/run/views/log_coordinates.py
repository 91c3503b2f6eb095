"""Draws the streams in further coordinates for the viewer, in the units that people read."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from sinssim import units
from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.scales import Rows, thinned
from sinssim.recording.streams import Stream, Vector, blocks

if TYPE_CHECKING:
    from sinssim.recording.rerun.rrd import Recording

_UNITS = (("_rad", "deg", units.DEG), ("_mps", "m/s", 1.0), ("_m", "km", 1e3))
_FAR = 1e5  # m: farther places are shown in km
_VECTOR = ("x", "y", "z")
_QUATERNION = ("reference", *_VECTOR)


def draw_coordinates(recording: Recording, streams: Iterable[Stream]) -> dict[str, str]:
    """Record the streams of one motion, below `coordinates/`.

    Returns:
        Labels for the view's titles: the unit of each vector, and that there are coordinates.
    """
    labels = {}
    for stream in streams:
        rows = thinned(len(stream.time))
        for vector in stream.vectors:
            values = _some(vector, rows, len(stream.time))
            names, unit, size = _shown(vector.columns, values)
            where = f"coordinates/{stream.name}/{vector.name}"
            parts = _QUATERNION if len(names) == 4 else _VECTOR
            colors = [style.COLORS[part] for part in parts[: len(names)]]
            recording.series(where, stream.time[rows], values / size, names, colors=colors, widths=1.6)
            labels[where] = unit
    return {**labels, "coordinates": "yes"} if labels else {}


def _some(vector: Vector, rows: Rows, count: int) -> Array:
    """Return some rows of a vector, which is computed in blocks."""
    found = []
    for block in blocks(count):
        inside = rows[(rows >= block.start) & (rows < block.stop)] - block.start
        found.append(vector.values[block][inside])
    return np.concatenate(found)


def _shown(columns: tuple[str, ...], values: Array) -> tuple[list[str], str, float]:
    """Return the names, the unit and its size for a plot; metres up to a hundred kilometres."""
    for ending, unit, size in _UNITS:
        if all(column.endswith(ending) for column in columns):
            names = [column.removesuffix(ending).replace("_", " ") for column in columns]
            near = unit == "km" and float(np.nanmax(np.abs(values), initial=0.0)) < _FAR
            return names, "m" if near else unit, 1.0 if near else size
    return [column.replace("_", " ") for column in columns], "", 1.0
