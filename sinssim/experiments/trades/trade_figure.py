"""The pictures of a trade study: curves with bands, bars, heat maps; one picture for each quantity."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.experiments.trades.result import CellResult, TradeResult
from sinssim.experiments.trades.schema import Axis
from sinssim.experiments.trades.summary import label_of, unit_for
from sinssim.experiments.trades.trade_grid_figure import (
    GridOf,
    Panel,
    choice_colors,
    families,
    family_colors,
    grid_of,
    layout,
    plain_scale,
)
from sinssim.experiments.trades.trade_map_figure import heat_map
from sinssim.formatting import capital, number_text
from sinssim.recording import style
from sinssim.recording.figures.canvas import new_figure, styled
from sinssim.scales import time_unit
from sinssim.statistics.order_statistics import runs_for_band
from sinssim.statistics.requirements.quantity import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FAR = 3.0
"""A limit is drawn if it is less than this multiple of the largest value, and more than its inverse of the least."""
_WIDE_GROWTH = 30.0
"""Ratio of the largest to the smallest R95 at the end from which its growth is drawn on a logarithmic scale."""
_MOST_GROWN = 10
"""Most cells whose growth is drawn."""


@dataclass(frozen=True)
class Picture:
    """One picture of a study.

    Attributes:
        name: name of its file, without the ending.
        title: what it shows.
        figure: the figure.
    """

    name: str
    title: str
    figure: Figure


def pictures(result: TradeResult) -> list[Picture]:
    """Return the pictures of a trade study.

    Args:
        result: the study.

    Returns:
        For each drawn quantity its curves or bars and, with two axes, its heat map; and the growth of R95.
    """
    found: list[Picture] = []
    if not result.finished:
        return found
    for quantity in result.study.drawn:
        name = re.sub(r"_(m|mps|rad|nmi_h)$", "", quantity.column)
        title = capital(label_of(quantity))
        found.append(Picture(name, title, trade_figure(result, quantity)))
        if len(result.axes) > 1:
            found.append(Picture(f"{name}_map", f"{title}, cell by cell", heat_map(result, quantity)))
    growth = growth_figure(result)
    return [*found, Picture("growth", "Growth of R95 in each cell", growth)] if growth is not None else found


@styled
def trade_figure(result: TradeResult, quantity: Quantity) -> Figure:
    """Draw a quantity over the grid.

    One axis of numbers gives a curve, one of choices bars. Two axes give curves by colour if one of them has numbers,
    else groups of bars. Further axes give panels.

    Args:
        result: the study.
        quantity: the quantity.

    Returns:
        The figure.
    """
    picture = grid_of(result, quantity)
    rows, columns = layout(len(picture.panels))
    legend = _legend_width(picture)
    figure = new_figure(max(4.6 * columns, 6.4) + legend, 3.1 * rows + 0.9)
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True, sharex=True)
    for place, panel in zip(panels.ravel(), picture.panels, strict=False):
        _draw(place, picture, panel)
        if panel.title:
            place.set_title(panel.title)
    for left in panels.ravel()[len(picture.panels) :]:
        left.set_visible(False)
    for number, place in enumerate(panels.ravel()[: len(picture.panels)]):
        if number % columns == 0:
            place.set_ylabel(picture.label if rows == 1 else f"{label_of(quantity)}\n[{picture.unit.name}]")
    if note := _band_note(picture):
        figure.supxlabel(note, fontsize=style.SMALL, color=style.SOFT, x=0.02, ha="left")
    handles, names = panels[0, 0].get_legend_handles_labels()
    order = sorted(range(len(names)), key=lambda k: names[k].startswith(tuple(one.text for one in picture.limits)))
    if names:
        title = picture.axes[families(picture.axes)].heading if len(picture.axes) == 2 else None
        box = figure.legend([handles[k] for k in order], [names[k] for k in order], loc="outside right upper",
                            title=title, alignment="left")  # fmt: skip
        box.get_title().set_fontsize(style.SMALL)
    return figure


def _band_note(picture: GridOf) -> str:
    """Return what the bands are; "" without any."""
    low, high = (np.concatenate([getattr(panel, k).ravel() for panel in picture.panels]) for k in ("low", "high"))
    if not np.isfinite(low).any():
        return ""
    few = f"; no upper end of R95 from fewer than {runs_for_band(0.95)} runs"
    return f"bands: 95 % confidence{few if np.isinf(high[np.isfinite(low)]).any() else ''}"


@styled
def growth_figure(result: TradeResult) -> Figure | None:
    """Draw R95 over time of each cell.

    Args:
        result: the study.

    Returns:
        The figure; None if there are too many cells, or none.
    """
    there = [one for one in result.cells if one.numbers is not None and len(one.numbers.time) > 1]
    if not 0 < len(there) <= _MOST_GROWN:
        return None
    unit = unit_for(result, Quantity("r95", "end"), Quantity("cep", "end"))
    figure = new_figure(10.5, 4.0)
    panel = figure.subplots()
    names = [short_name(result, one) for one in there]
    ends = [float(one.numbers.time[-1]) for one in there if one.numbers is not None]
    word, size = time_unit(max(ends))
    for one, name, color in zip(there, names, choice_colors(len(names)), strict=True):
        assert one.numbers is not None
        panel.plot(one.numbers.time / size, one.numbers.r95 / unit.size, color=style.css(color), label=name)
    panel.set(xlabel=f"time [{word}]", ylabel=f"R95 [{unit.name}]", xlim=(0.0, max(ends) / size))
    last = np.array([one.numbers.r95[-1] / unit.size for one in there if one.numbers is not None])
    if is_wide(last):
        panel.set_yscale("log")
        panel.set_ylim(0.1 * last.min(), None)
        plain_scale(panel.yaxis, *panel.get_ylim())
    else:
        panel.set_ylim(bottom=0.0)
    box = panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title=", ".join(a.title for a in result.axes),
                       alignment="left")  # fmt: skip
    box.get_title().set_fontsize(style.SMALL)
    return figure


def short_name(result: TradeResult, one: CellResult) -> str:
    """Return the values of a cell with their units, without the names of the axes: "tactical, 0.01 deg/h"."""
    pairs = zip(result.axes, one.cell.place, strict=True)
    return ", ".join(f"{axis.name_of(k)} {axis.unit}".rstrip() for axis, k in pairs)


def is_wide(last: Array) -> bool:
    """Return whether the errors at the end of several cells differ so much that their growth needs a logarithm."""
    return bool(len(last) and np.isfinite(last).all() and 0.0 < _WIDE_GROWTH * last.min() < last.max())


def _legend_width(picture: GridOf) -> float:
    """Return the room that the legend needs beside the panels, inches."""
    names = [one.text for one in picture.limits]
    if len(picture.axes) == 2:
        axis = picture.axes[families(picture.axes)]
        names += [axis.heading, *(axis.name_of(k) for k in range(len(axis.values)))]
    return 0.4 + 0.075 * max(map(len, names)) if names else 0.0


def _draw(place: Axes, picture: GridOf, panel: Panel) -> None:
    """Draw one panel."""
    if len(picture.axes) == 1:
        along, names = picture.axes[0], [""]
        rows = [(panel.value, panel.low, panel.high)]
        colors = [style.COLORS["r95" if picture.quantity.quantity != "cep" else "cep"]]
    else:
        family = families(picture.axes)
        along, by = picture.axes[1 - family], picture.axes[family]
        names = [by.name_of(k) for k in range(len(by.values))]
        parts = [np.moveaxis(part, family, 0) for part in (panel.value, panel.low, panel.high)]
        rows = list(zip(*parts, strict=True))
        colors = family_colors(by)
    shown = [style.css(color) for color in colors]
    if along.numeric:
        _curves(place, along, rows, names, shown)
    else:
        _choices(place, along, rows, names, shown, dots=picture.logarithmic)
    if picture.logarithmic:
        place.set_yscale("log")
        _limits(place, picture)
        plain_scale(place.yaxis, *place.get_ylim())
    else:
        place.set_ylim(bottom=0.0)
        _limits(place, picture)
    place.set_xlabel(along.heading)


def _curves(
    place: Axes, along: Axis, rows: Sequence[tuple[Array, Array, Array]], names: Sequence[str], colors: Sequence[str]
) -> None:
    x = np.array(along.values, dtype=np.float64)
    order = np.argsort(x)
    for (value, low, high), name, color in zip(rows, names, colors, strict=True):
        y = np.where(np.isfinite(value), value, np.nan)[order]
        place.plot(x[order], y, color=color, marker="o", ms=4.0, label=name or None)
        if np.isfinite(low).any():
            top = np.where(np.isfinite(high), high, value)  # too few runs for an upper end
            place.fill_between(x[order], low[order], top[order], color=color, alpha=0.18, lw=0.0)
    if along.logarithmic:
        place.set_xscale("log")
    _numeric_ticks(place, along, x[order])


def _numeric_ticks(place: Axes, along: Axis, x: Array) -> None:
    """Put the ticks of an axis at its values where they do not crowd."""
    scaled = np.log(x) if along.logarithmic else x
    if len(x) > 1 and np.diff(scaled).min() > 0.06 * (scaled[-1] - scaled[0]):
        from matplotlib.ticker import NullLocator

        place.set_xticks(x, [f"{v:g}".replace("-", "−") for v in x])
        place.xaxis.set_minor_locator(NullLocator())


def _choices(
    place: Axes, along: Axis, rows: Sequence[tuple[Array, Array, Array]], names: Sequence[str], colors: Sequence[str],
    dots: bool,
) -> None:  # fmt: skip
    """Draw bars, or dots where a logarithmic scale leaves a bar without a foot."""
    count, width = len(rows), 0.8 / len(rows)
    x = np.arange(len(along.values), dtype=np.float64)
    for number, ((value, low, high), name, color) in enumerate(zip(rows, names, colors, strict=True)):
        at = x + (number - 0.5 * (count - 1)) * width
        there = np.isfinite(value)
        if dots:
            place.plot(at[there], value[there], color=color, label=name or None, ls="none", marker="o", ms=7.0)
        else:
            place.bar(at[there], value[there], 0.92 * width, color=color, label=name or None)
        bands = there & np.isfinite(low) & np.isfinite(high)
        if bands.any():
            ends = np.array([value - low, high - value])[:, bands]
            place.errorbar(at[bands], value[bands], np.maximum(ends, 0.0), fmt="none", ecolor=style.INK,
                           elinewidth=style.THIN, capsize=2.5)  # fmt: skip
        if count * len(x) <= 12:
            tops = np.where(np.isfinite(high), high, value)
            for here, top, shown in zip(at[there], tops[there], value[there], strict=True):
                place.annotate(number_text(float(shown)), (here, top), (0.0, 5.0 if dots else 2.0),
                               textcoords="offset points", ha="center", fontsize=style.SMALL)  # fmt: skip
    words = [along.name_of(k) for k in range(len(along.values))]
    turned = max(map(len, words)) * len(words) > 46
    place.set_xticks(x, words, rotation=25 if turned else 0, ha="right" if turned else "center")
    place.set_xlim(-0.6, len(x) - 0.4)
    place.margins(y=0.12)
    place.grid(False, axis="x")


def _limits(place: Axes, picture: GridOf) -> None:
    """Draw the lines of requirements on the quantity; one that is far away is named alone."""
    there = picture.finite
    for one in picture.limits:
        limit = picture.limit(one)
        near = not len(there) or there.min() / _FAR <= limit <= _FAR * there.max()
        color = style.css(style.COLORS["limit"])
        if near:
            place.axhline(limit, color=color, lw=style.THIN, ls="--", label=one.text)
            bottom, top = place.get_ylim()
            place.set_ylim(min(bottom, 0.9 * limit), max(top, 1.05 * limit))
        else:
            where = "above" if limit > there.max() else "below"
            place.plot([], [], color=color, lw=style.THIN, ls="--", label=f"{one.text} ({where} the plot)")
