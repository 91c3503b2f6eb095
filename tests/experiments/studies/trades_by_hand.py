"""Trade studies whose every number is written by hand."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.experiments.studies.trade_cells import CellNumbers, cells_of
from sinssim.experiments.studies.trade_result import TradeResult
from sinssim.experiments.studies.trade_run import TradeMedia
from sinssim.statistics.requirements import VerdictInUnit
from tests.experiments.studies.trade_examples import ACCEL, BIAS, GRADE, study

SECOND = pi / 648_000.0
RISING = {"key": BIAS, "values": (0.02, 0.01, 0.05)}
"""Not in their order."""
UNITS = {"key": GRADE, "values": ("tactical", "laser-standard"), "labels": ("A", "B"), "label": "unit"}
OTHER = {"key": ACCEL, "values": (10.0, 25.0)}
ASK = ("r95(end) <= 0.3 km", "r95(30 s) <= 100 m", "heading(run) <= 30 arcsec")


def made(folder: Path, axes: tuple[dict[str, Any], ...] = (UNITS, RISING), words: dict[int, str] | None = None,
         **keys: Any) -> TradeResult:  # fmt: skip
    """Return a study whose cell n has an R95 of 100 n m at the end, a third of it at 30 s, CEP half, heading 10 n″.

    Velocities are n mm/s north and 2 n mm/s east, tilts 3 n″ and 4 n″, the rate n/10 nmi/h; bands are 0.8 to 1.5 times.
    """
    plan = study(folder, axes=axes, require=ASK, times_s=(30.0,), **keys)
    cells = []
    for cell in cells_of(plan):
        n = float(cell.number)
        sizes = {"cep": 50.0, "r95": 100.0, "rate": 0.1, "velocity_north": 1e-3, "velocity_east": 2e-3,
                 "velocity_down": 0.3, "tilt_north": 3.0 * SECOND, "tilt_east": 4.0 * SECOND, "heading": 10.0 * SECOND,
                 "position_north": 7.0, "position_east": 8.0, "position_down": 9.0}  # fmt: skip
        values: dict[str, float] = {}
        for one in plan.quantities:
            value = sizes[one.quantity] * n * (1.0 / 3.0 if one.when == "at" else 1.0)
            values |= {one.column: value, f"{one.column}_low": 0.8 * value, f"{one.column}_high": 1.5 * value}
        verdicts = [
            VerdictInUnit(text, "met" if value < 1.001 * limit else "not met", value, limit, unit, at)
            for text, value, limit, unit, at in zip(ASK, (0.1 * n, 100.0 * n / 3.0, 10.0 * n), (0.3, 100.0, 30.0),
                                                    ("km", "m", "arcsec"), (60.0, 30.0, 45.0), strict=True)
        ]  # fmt: skip
        if (word := (words or {}).get(cell.number)) is not None:
            verdicts[0] = VerdictInUnit(ASK[0], word, 0.1 * n, 0.3, "km", 60.0, 10 * cell.number + 200)  # type: ignore[arg-type]
        time = np.array([0.0, 30.0, 60.0])
        r95 = 100.0 * n * time / 60.0
        cells.append(replace(cell, numbers=CellNumbers(values, tuple(verdicts), time, 0.5 * r95, r95)))
    return TradeResult(plan, tuple(cells), seconds=12.3456, computed=4, notes=["A note."], media=TradeMedia())


def without(result: TradeResult, number: int, failure: str = "it fell.") -> TradeResult:
    cells = list(result.cells)
    cells[number - 1] = replace(cells[number - 1], numbers=None, failure=failure)
    return TradeResult(result.study, tuple(cells), result.status, media=TradeMedia())
