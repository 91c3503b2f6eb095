"""The Rerun recording of compared systems: differences with their thresholds, and the share of teams."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.data import Array
from sinssim.recording.rerun.rrd import Recording

_DIFFERENCES = {"effect": "by the fault", "threshold": "threshold", "sigma_of_difference": "1σ of sound systems"}
_SHARES = {"predicted": "predicted for two", "detected": "two detect", "identified": "three identify"}
_UNITS = {"position": "m", "velocity": "m/s"}


def record_comparison(path: Path, time: Array, found: dict[str, dict[str, Any]], summary: str) -> None:
    """Write the recording.

    Args:
        path: the file, by convention `recording.rrd`.
        time: epochs, (E,) s.
        found: the numbers by quantity, with their curves.
        summary: the result tables, Markdown.
    """
    start, end = (rrb.TimeRangeBoundary.absolute(seconds=float(t)) for t in (time[0], time[-1]))
    whole = rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    beside = path.with_name(path.name + ".part")
    views = []
    with Recording(beside, "sinssim_compared_systems", rrb.Blueprint(collapse_panels=True)) as recording:
        for quantity, unit in _UNITS.items():
            curves = found[quantity]["curves"]
            for kind, lines in (("difference", _DIFFERENCES), ("share", _SHARES)):
                values = np.column_stack([curves[name] for name in lines])
                recording.series(f"systems/{quantity}/{kind}", time, values, list(lines.values()))
            names = f"Difference of {quantity}, {unit}", "Share of teams"
            views.append(
                rrb.Vertical(
                    *(
                        rrb.TimeSeriesView(origin=f"systems/{quantity}/{kind}", name=name, axis_x=whole)
                        for kind, name in zip(("difference", "share"), names, strict=True)
                    ),
                    name=quantity.capitalize(),
                )
            )
        recording.document("systems/summary", summary)
        summary_view = rrb.TextDocumentView(origin="systems/summary", name="Summary")
        recording.blueprint(rrb.Blueprint(rrb.Tabs(summary_view, *views), collapse_panels=True))
    os.replace(beside, path)
