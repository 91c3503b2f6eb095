"""The Rerun recording of the ground study: σ over heading and latitude, session curves, the disturbed base."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.alignment.parked_theory import Angles
from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.rerun_file import Recording
from sinssim.units import ARCMIN


def record_ground_study(
    path: Path,
    *,
    heading_map: Array,
    session_time: Array,
    session_sigma: dict[str, Angles],
    budget: dict[str, Angles],
    swaying_time: Array,
    swaying_velocity: Array,
    heading_errors: dict[str, Array],
    summary: str,
) -> None:
    """Write the recording.

    Args:
        path: the file, by convention `recording.rrd`.
        heading_map: standard deviation of the heading over latitude and heading, (m, n) rad.
        session_time: session lengths, (k,) s.
        session_sigma: by grade, standard deviations over those lengths, (k,) rad.
        budget: by source, standard deviations of one vehicle, rad.
        swaying_time: (j,) s.
        swaying_velocity: velocity on the disturbed base that gravity's cone does not explain, (j, 3) m/s.
        heading_errors: by method, heading errors of every run on the disturbed base, rad.
        summary: the result tables, Markdown.
    """
    names = list(session_sigma)

    def whole(time: Array) -> rrb.TimeAxis:
        # left to itself, a plot shows ±30 s around the cursor
        start, end = (rrb.TimeRangeBoundary.absolute(seconds=float(t)) for t in (time[0], time[-1]))
        return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))

    plots = []
    layout = rrb.Blueprint(collapse_panels=True)
    beside = path.with_name(path.name + ".part")
    with Recording(beside, "sinssim_ground_study", layout) as recording:
        for angle in Angles._fields:
            values = np.column_stack(
                [np.broadcast_to(getattr(session_sigma[name], angle), session_time.shape) for name in names]
            )
            entity = f"ground/session/{angle}"
            recording.series(entity, session_time, np.log10(values / ARCMIN), names)
            plots.append(
                rrb.TimeSeriesView(
                    origin=entity,
                    name=f"log₁₀ σ of the {angle} (σ in arcmin) over session length",
                    axis_x=whole(session_time),
                )
            )
        recording.series("ground/swaying/velocity", swaying_time, swaying_velocity, ["forward", "right", "down"])
        recording.static("ground/heading_map", rr.Tensor(heading_map / ARCMIN, dim_names=["latitude", "heading"]))
        bars = []
        for angle in Angles._fields:
            entity = f"ground/budget/{angle}"
            recording.static(entity, rr.BarChart([float(getattr(value, angle)) / ARCMIN for value in budget.values()]))
            bars.append(rrb.BarChartView(origin=entity, name=f"σ of the {angle} by source, arcmin"))
        runs = np.arange(max(len(errors) for errors in heading_errors.values()), dtype=np.float64)
        for (method, errors), color in zip(heading_errors.items(), style.colors(list(heading_errors)), strict=True):
            recording.series(
                f"ground/disturbed/{method}", runs[: len(errors)], (errors / ARCMIN)[:, None], [method], colors=[color]
            )
        sources = "\n".join(f"{k}. {source}" for k, source in enumerate(budget))
        recording.document("ground/summary", f"{summary}\n\n## Bars of the error budget\n\n{sources}\n")
        recording.blueprint(
            rrb.Blueprint(
                rrb.Tabs(
                    rrb.TextDocumentView(origin="ground/summary", name="Summary"),
                    rrb.Grid(*plots, name="Session length"),
                    rrb.TensorView(origin="ground/heading_map", name="σ of the heading, arcmin"),
                    rrb.Grid(*bars, name="Error budget"),
                    rrb.Vertical(
                        rrb.TimeSeriesView(
                            origin="ground/swaying",
                            name="Residual velocity of the fit of gravity's cone, m/s",
                            axis_x=whole(swaying_time),
                        ),
                        rrb.TimeSeriesView(
                            origin="ground/disturbed",
                            name="Heading errors by run (one run per second), arcmin",
                            axis_x=whole(runs),
                        ),
                        name="Disturbed base",
                    ),
                ),
                collapse_panels=True,
            )
        )
    os.replace(beside, path)
