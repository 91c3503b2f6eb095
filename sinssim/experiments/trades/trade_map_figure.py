"""The heat map of a trade study: a quantity over two axes as coloured cells with their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.trade_grid_figure import Panel, grid_of, layout, plain_scale
from sinssim.formatting import number_text
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.statistics.requirements.quantity import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure


@styled
def heat_map(result: TradeResult, quantity: Quantity) -> Figure:
    """Draw a quantity over two axes as coloured cells with their numbers; cells that meet its requirement are framed.

    Args:
        result: the study, with at least two axes.
        quantity: the quantity.

    Returns:
        The figure.
    """
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    picture = grid_of(result, quantity)
    down, across = picture.axes
    rows, columns = layout(len(picture.panels))
    width = max(0.85 * len(across.values) * columns + 2.4, 5.5)
    figure = new_figure(min(width, 14.0), max((0.42 * len(down.values) + 0.75) * rows + 0.8, 2.4))
    places = figure.subplots(rows, columns, squeeze=False, sharey=True, sharex=True)
    shades = LinearSegmentedColormap.from_list("trade", [style.PALE, style.css(style.COLORS["r95"])])
    colors = shades.with_extremes(bad=style.GRID)
    there = picture.finite if len(picture.finite) else np.array([1.0])
    low, high = float(there.min()), float(there.max())
    norm = LogNorm(low, high) if high > 5.0 * low else Normalize(min(low, high * 0.999), high)
    shown = places.ravel()[: len(picture.panels)]
    for place, panel in zip(shown, picture.panels, strict=True):
        image = place.pcolormesh(
            np.ma.masked_invalid(panel.value), cmap=colors, norm=norm, edgecolors="white", linewidth=style.THIN
        )
        _numbers(place, panel, norm)
        place.set(xticks=np.arange(len(across.values)) + 0.5, yticks=np.arange(len(down.values)) + 0.5)
        names = [across.name_of(k) for k in range(len(across.values))]
        turned = max(map(len, names)) > 9
        place.set_xticklabels(names, rotation=30 if turned else 0, ha="right" if turned else "center")
        place.set_yticklabels([down.name_of(k) for k in range(len(down.values))])
        place.grid(False)
        place.set_ylim(len(down.values), 0)
        place.tick_params(length=0)
        place.spines[:].set_visible(False)
        place.set_xlabel(across.heading)
        if panel.title:
            place.set_title(panel.title)
    for left in places.ravel()[len(picture.panels) :]:
        left.set_visible(False)
    for row in places:
        row[0].set_ylabel(down.heading)
    bar = figure.colorbar(image, ax=list(shown), pad=0.02, aspect=30)
    figure.suptitle(picture.label, x=0.02, ha="left")
    if isinstance(norm, LogNorm):
        plain_scale(bar.ax.yaxis, low, high)
    bar.outline.set_visible(False)
    if picture.limits:
        text = " and ".join(one.text for one in picture.limits)
        figure.supxlabel(f"framed: meets {text}", fontsize=style.SMALL, color=style.SOFT, x=0.02, ha="left")
    return figure


def _numbers(place: Axes, panel: Panel, norm: Normalize) -> None:
    """Write the numbers into the cells of a heat map, and frame those that meet the requirements."""
    from matplotlib.patches import Rectangle

    for (i, k), value in np.ndenumerate(panel.value):
        text = number_text(float(value)) if np.isfinite(value) else "∞" if value == np.inf else "–"
        dark = np.isfinite(value) and float(norm(value)) > 0.55
        place.text(k + 0.5, i + 0.5, text, ha="center", va="center", fontsize=style.SMALL,
                   color=style.ON_DARK if dark else style.ON_LIGHT)  # fmt: skip
        if panel.met[i, k]:
            place.add_patch(Rectangle((k + 0.04, i + 0.04), 0.92, 0.92, fill=False, lw=style.FRAME,
                                      ec=style.css(style.COLORS["truth"])))  # fmt: skip
