"""The Rerun recording of a trade study: growth of R95 and CEP in the cells, the pictures of the report, the tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr

from sinssim.data import Array
from sinssim.experiments.trades.measure import CellNumbers
from sinssim.experiments.trades.result import CellResult, TradeResult
from sinssim.experiments.trades.summary import markdown, unit_for
from sinssim.experiments.trades.trade_figure import Picture, is_wide, short_name
from sinssim.experiments.trades.trade_grid_figure import choice_colors, family_colors
from sinssim.recording import style
from sinssim.recording.figures.canvas import to_png
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.rerun.viewer import RUN_ENTITY
from sinssim.recording.rerun.views import RunInfo, all_views
from sinssim.statistics.requirements.quantity import Quantity

_LINES = 10
"""Most cells whose growth is recorded, so that their colours can be told apart."""


def record(result: TradeResult, pictures: Sequence[Picture], path: Path) -> None:
    """Write the recording.

    Args:
        result: the study.
        pictures: the pictures of its report.
        path: the file.
    """
    shown = _shown(result)
    ends = [float(numbers.time[-1]) for _, numbers in shown]
    labels = {"kind": "trade", "shown": str(len(shown)), "cells": str(len(result))}
    run = RunInfo(result.study.name, 0.0, max(ends, default=1.0), (), labels=labels)
    with Recording(path, run.application, all_views(run)) as recording:
        labels |= _draw_growth(recording, result, shown)
        drawn = []
        for one in pictures:
            image = rr.EncodedImage(contents=to_png(one.figure), media_type="image/png")
            recording.static(f"trade/figures/{one.name}", image)
            drawn.append((f"trade/figures/{one.name}", one.title))
        labels["pictures"] = json.dumps(drawn)
        recording.document("trade/tables", markdown(result))
        run = RunInfo(run.name, run.start, run.end, (), labels=labels, ranges=dict(recording.ranges))
        recording.document(RUN_ENTITY, run.to_json())
        recording.blueprint(all_views(run))


def _shown(result: TradeResult) -> list[tuple[CellResult, CellNumbers]]:
    """Return the cells whose growth is recorded, in order: all, or some from the least to the largest R95."""
    there = [(one, one.numbers) for one in result.cells if one.numbers is not None and len(one.numbers.time) > 1]
    if len(there) <= _LINES:
        return there
    ranked = sorted(range(len(there)), key=lambda k: (np.nan_to_num(there[k][1].r95[-1], nan=np.inf), k))
    places = np.unique(np.round(np.linspace(0, len(ranked) - 1, _LINES)).astype(int))
    return [there[k] for k in sorted(ranked[place] for place in places)]


def _draw_growth(
    recording: Recording, result: TradeResult, shown: Sequence[tuple[CellResult, CellNumbers]]
) -> dict[str, str]:
    """Record the growth of R95 and CEP, and return their unit and scale.

    Cells may last differently: each is recorded at its own instants, in an entity of its own.
    """
    unit = unit_for(result, Quantity("r95", "end"), Quantity("cep", "end"))
    wide = is_wide(np.array([numbers.r95[-1] for _, numbers in shown]))
    colors = _colors(result, [one.cell.number for one, _ in shown])
    for (one, numbers), color in zip(shown, colors, strict=True):
        for key, values in (("r95", numbers.r95), ("cep", numbers.cep)):
            column: Array = np.where(np.isfinite(values), values, np.nan)[:, None] / unit.size
            if wide:
                column = np.log10(np.where(column > 0.0, column, np.nan))
            entity = f"trade/{key}/{one.cell.number}"
            recording.series(entity, numbers.time, column, [short_name(result, one)], colors=[color])
    return {"circle": f"log₁₀ {unit.name}" if wide else unit.name}


def _colors(result: TradeResult, numbers: Sequence[int]) -> list[style.Rgb]:
    """Return a colour for each cell: shades along a single axis of numbers, else others for each."""
    if len(result.axes) == 1:
        shades = family_colors(result.axes[0])
        return [shades[number - 1] for number in numbers]
    return choice_colors(len(numbers))
