"""The charts of a recorded drive and its simulated twin."""

from __future__ import annotations

from typing import Any

import numpy as np

from sinssim.charts import Axis, Band, Chart, Charts, Dash, Line, Mark
from sinssim.data import Array
from sinssim.units import DEG_H, UG, Scale, fixed

_COLORS = {"recorded": "measured", "simulated": "aided"}
_DASHES: tuple[Dash, ...] = ("", "--", ":")
_METRES = fixed("m")


def twin_charts(sides: dict[str, Any], length: float) -> Charts:
    """Return outages of a length, s, innovations and Allan deviations of both sides.

    Args:
        sides: "recorded" and "simulated", `Side` of the study.
    """
    innovations = tuple(_innovations(sides, sensor) for sensor in sides["recorded"].innovations)
    gyros = _allan(sides, slice(0, 3), "gyros", fixed("°/h", DEG_H))
    accelerometers = _allan(sides, slice(3, 6), "accelerometers", fixed("µg", UG))
    rows = ((_growth(sides, length), _at_end(sides)), innovations, (gyros, accelerometers))
    return Charts("recorded_and_simulated", rows, (11.0, 10.0))


def _growth(sides: dict[str, Any], length: float) -> Chart:
    at = np.linspace(0.1, length, 60)
    bands, lines = list[Mark](), list[Mark]()
    for name, side in sides.items():
        errors = np.array([np.interp(at, time, error) for time, error in side.growth])
        low, middle, high = np.percentile(errors, [10.0, 50.0, 90.0], axis=0)
        bands.append(Band(x=at, low=low, high=high, color=_COLORS[name]))
        lines.append(Line(label=f"{name}: median, 10–90 %", x=at, y=middle, color=_COLORS[name], weight="bold"))
    x = Axis(label="time without GNSS", units=fixed("s"), low=0.0, high=length)
    y = Axis(label="horizontal error", units=_METRES, low=0.0)
    return Chart(key="growth", title=f"outages of {length:g} s", x=x, y=y, marks=(*bands, *lines))


def _at_end(sides: dict[str, Any]) -> Chart:
    lines = []
    for name, side in sides.items():
        count, label = len(side.at_end), f"{name}, {len(side.at_end)} outages"
        error, below = _stairs(np.sort(np.append(side.at_end, 0.0)), np.arange(count) / count)
        error, below = np.append(error, error[-1]), np.append(below, 1.0)
        lines.append(Line(label=label, x=error, y=below, color=_COLORS[name], weight="bold"))
    x = Axis(label="horizontal error", units=_METRES, low=0.0)
    y = Axis(label="outages below", units=fixed("%", 0.01), low=0.0, high=1.0)
    return Chart(key="at_end", title="errors at the ends", x=x, y=y, marks=tuple(lines))


def _innovations(sides: dict[str, Any], sensor: str) -> Chart:
    edges, fine = np.linspace(-4.0, 4.0, 41), np.linspace(-4.0, 4.0, 161)
    lines = []
    for name, side in sides.items():
        density, _ = np.histogram(side.innovations[sensor], edges, density=True)
        x, y = _stairs(edges, density)
        lines.append(Line(label=name, x=x, y=y, color=_COLORS[name], weight="bold"))
    normal = np.exp(-0.5 * fine**2) / np.sqrt(2.0 * np.pi)
    lines.append(Line(label="normal", x=fine, y=normal, color="soft", weight="thin", dash="--"))
    across, upright = Axis(label="innovation / its 1σ", low=-4.0, high=4.0), Axis(label="density", low=0.0)
    return Chart(key=sensor, title=f"innovations of {sensor}", x=across, y=upright, marks=tuple(lines))


def _stairs(edges: Array, heights: Array) -> tuple[Array, Array]:
    """Return the outline of steps with heights, (N,), between edges, (N+1,)."""
    return np.repeat(edges, 2)[1:-1], np.repeat(heights, 2)


def _allan(sides: dict[str, Any], part: slice, what: str, units: Scale) -> Chart:
    lines = tuple(
        Line(label="" if number else name, x=one.tau, y=one.deviation, color=_COLORS[name], dash=_DASHES[number])
        for name, side in sides.items()
        for number, one in enumerate(side.deviations[part])
    )
    x = Axis(label="averaging time τ", units=fixed("s"), log=True)
    y = Axis(label="Allan deviation", units=units, log=True)
    title = f"errors of the {what} (solid x, dashed y, dotted z)"
    return Chart(key=what, title=title, x=x, y=y, marks=lines)
