"""The figure of a recorded drive and its simulated twin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim.recording import style
from sinssim.recording.figures import new_figure, styled
from sinssim.units import DEG_H, UG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS = {"recorded": style.css(style.COLORS["measured"]), "simulated": style.css(style.COLORS["aided"])}

_BOLD = 1.6 * style.LINE


@styled
def twin_figure(sides: dict[str, Any], length: float) -> Figure:
    """Draw outages, innovations and Allan deviations of both sides.

    Args:
        sides: "recorded" and "simulated", `Side` of the study.
        length: of the outages, s.

    Returns:
        The figure.
    """
    figure = new_figure(11.0, 10.0)
    panels = figure.subplots(3, 2)
    _growth(panels[0, 0], sides, length)
    _at_end(panels[0, 1], sides)
    for panel, sensor in zip(panels[1], sides["recorded"].innovations, strict=False):
        _innovations(panel, sides, sensor)
    for panel in panels[1][len(sides["recorded"].innovations) :]:
        panel.set_axis_off()
    _allan(panels[2, 0], sides, slice(0, 3), "gyros", "°/h", DEG_H)
    _allan(panels[2, 1], sides, slice(3, 6), "accelerometers", "µg", UG)
    return figure


def _growth(panel: Any, sides: dict[str, Any], length: float) -> None:
    at = np.linspace(0.1, length, 60)
    for name, side in sides.items():
        curves = np.array([np.interp(at, time, error) for time, error in side.growth])
        low, middle, high = np.percentile(curves, [10.0, 50.0, 90.0], axis=0)
        panel.fill_between(at, low, high, color=COLORS[name], alpha=0.18, lw=0)
        panel.plot(at, middle, color=COLORS[name], lw=_BOLD, label=f"{name}: median, 10–90 %")
    panel.set(title=f"outages of {length:g} s", xlabel="time without GNSS [s]", ylabel="horizontal error [m]")
    panel.set(xlim=(0.0, length), ylim=(0.0, None))
    panel.legend(loc="upper left")


def _at_end(panel: Any, sides: dict[str, Any]) -> None:
    for name, side in sides.items():
        values = np.sort(side.at_end)
        share = np.arange(1, len(values) + 1) / len(values)
        panel.step(
            np.concatenate([[0.0], values]), 100.0 * np.concatenate([[0.0], share]), where="post", color=COLORS[name],
            lw=_BOLD, label=f"{name}, {len(values)} outages",
        )  # fmt: skip
    panel.set(title="errors at the ends", xlabel="horizontal error [m]", ylabel="outages below [%]")
    panel.set(xlim=(0.0, None), ylim=(0.0, 100.0))
    panel.legend(loc="lower right")


def _innovations(panel: Any, sides: dict[str, Any], sensor: str) -> None:
    edges = np.linspace(-4.0, 4.0, 41)
    for name, side in sides.items():
        values = side.innovations[sensor].ravel()
        panel.hist(values, edges, density=True, histtype="step", color=COLORS[name], lw=_BOLD, label=name)
    x = np.linspace(-4.0, 4.0, 161)
    normal = np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    panel.plot(x, normal, color=style.SOFT, lw=style.THIN, ls="--", label="normal")
    panel.set(title=f"innovations of {sensor}", xlabel="innovation / its 1σ", ylabel="density", xlim=(-4.0, 4.0))
    panel.legend(loc="upper left")


def _allan(panel: Any, sides: dict[str, Any], part: slice, what: str, unit: str, size: float) -> None:
    for name, side in sides.items():
        for number, one in enumerate(side.deviations[part]):
            label = f"{name}: {', '.join('xyz')}" if number == 0 else None
            dashes = ("-", (0, (5, 2)), (0, (1, 1.5)))[number]
            panel.loglog(one.tau, one.deviation / size, color=COLORS[name], ls=dashes, label=label)
    panel.set(title=f"errors of the {what}", xlabel="averaging time τ [s]", ylabel=f"Allan deviation [{unit}]")
    panel.legend(loc="lower left", title="solid x, dashed y, dotted z")
