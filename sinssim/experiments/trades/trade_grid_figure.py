"""What the pictures of a trade study have in common: a quantity over the grid in its unit, colours, scales."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.experiments.trades.result import TradeResult
from sinssim.experiments.trades.schema import Axis
from sinssim.experiments.trades.summary import Unit, label_of, unit_for
from sinssim.formatting import capital
from sinssim.recording import style
from sinssim.statistics.requirements.quantity import Quantity
from sinssim.statistics.requirements.requirement import Requirement

if TYPE_CHECKING:
    from matplotlib.axis import Axis as MatplotlibAxis

MOST_PANELS = 12
"""Most panels of a picture, one for each place on the axes beyond the second."""
_ACROSS = 3
_WIDE, _WIDE_ALONG = 30.0, 5.0
"""Ratio of the largest to the smallest value from which a logarithmic scale is used, and beside a logarithmic axis."""


@dataclass(frozen=True)
class Panel:
    """What one panel shows: a quantity over one or two axes.

    Attributes:
        title: the place on the other axes; "" without any.
        value, low, high: (n,) or (m, n), in the unit of the picture.
        met: whether each cell meets the requirements on the quantity, of the same shape.
    """

    title: str
    value: Array
    low: Array
    high: Array
    met: NDArray[np.bool_]


@dataclass(frozen=True)
class GridOf:
    """A quantity of a study, ready to be drawn."""

    result: TradeResult
    quantity: Quantity
    unit: Unit
    axes: tuple[Axis, ...]
    panels: tuple[Panel, ...]
    limits: tuple[Requirement, ...]

    @property
    def label(self) -> str:
        """The quantity with its unit."""
        return f"{capital(label_of(self.quantity))} [{self.unit.name}]"

    def limit(self, requirement: Requirement) -> float:
        """Return a limit in the unit of the picture."""
        size = self.unit.size if self.quantity.quantity != "rate" else 1852.0 / 3600.0
        return requirement.limit / size

    @property
    def finite(self) -> Array:
        """All finite positive values."""
        values = np.concatenate([panel.value.ravel() for panel in self.panels])
        return np.asarray(values[np.isfinite(values) & (values > 0.0)])

    @property
    def logarithmic(self) -> bool:
        """Whether a logarithmic scale suits the values."""
        along = self.axes[0] if len(self.axes) == 1 else self.axes[1 - families(self.axes)]
        ratio = _WIDE_ALONG if along.logarithmic else _WIDE
        return bool(len(self.finite) and self.finite.max() > ratio * self.finite.min())


def grid_of(result: TradeResult, quantity: Quantity) -> GridOf:
    """Return a quantity of a study, ready to be drawn.

    Args:
        result: the study.
        quantity: the quantity.

    Returns:
        Its values over the last two axes, a panel for each place on the others.
    """
    study, unit = result.study, unit_for(result, quantity)
    kept = min(len(study.axes), 2)
    value = result.values(quantity) / unit.size
    low, high = (end / unit.size for end in result.band(quantity))
    limits = tuple(
        one for one in study.requirements
        if (one.quantity, one.when) == (quantity.quantity, quantity.when)
        and (one.when != "at" or one.time == quantity.time)
    )  # fmt: skip
    met = np.full(study.shape, bool(limits))
    for one in limits:
        met &= result.verdicts(one.text) == "met"
    panels = []
    for place in itertools.product(*map(range, study.shape[:-kept])):
        title = ", ".join(f"{axis.title} {axis.name_of(k)} {axis.unit}".rstrip()
                          for axis, k in zip(study.axes, place, strict=False))  # fmt: skip
        panels.append(Panel(title, value[place], low[place], high[place], met[place]))
    return GridOf(result, quantity, unit, study.axes[-kept:], tuple(panels[:MOST_PANELS]), limits)


def layout(count: int) -> tuple[int, int]:
    """Return the rows and the columns of a number of panels."""
    columns = min(count, _ACROSS)
    return -(-count // columns), columns


def families(axes: Sequence[Axis]) -> int:
    """Return which of two axes gives a curve, or a colour of bars, each."""
    if axes[0].numeric != axes[1].numeric:
        return 1 if axes[0].numeric else 0
    if len(axes[0].values) != len(axes[1].values):
        return 0 if len(axes[0].values) < len(axes[1].values) else 1
    return 0


def family_colors(axis: Axis) -> list[style.Rgb]:
    """Return a colour for each value of an axis: shades of one in the order of numbers, others for choices."""
    count = len(axis.values)
    if not axis.numeric or count <= 2:
        return choice_colors(count)
    light, dark = np.array([150.0, 200.0, 235.0]), np.array([10.0, 45.0, 95.0])
    order = np.argsort(np.argsort(np.array(axis.values, dtype=np.float64)))
    shades = [light + (dark - light) * place / (count - 1) for place in order]
    return [(round(r), round(g), round(b)) for r, g, b in shades]


def choice_colors(count: int) -> list[style.Rgb]:
    """Return colours for choices, without that of the limits."""
    more = style.colors([f"choice {k}" for k in range(2 * count + 8)])
    return [color for color in more if color != style.COLORS["limit"]][:count]


def plain_scale(axis: MatplotlibAxis, low: float, high: float) -> None:
    """Put a few plain numbers on a logarithmic axis."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
    steps = (1.0, 2.0, 3.0, 5.0, 7.0) if high < 10.0 * low else (1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)
    at = [d * step for d in decades for step in steps if low * 0.999 <= d * step <= high * 1.001]
    if len(at) > 1:
        axis.set_major_locator(FixedLocator(at))
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}" if 1e-4 <= value < 1e6 else f"{value:.0e}"))
