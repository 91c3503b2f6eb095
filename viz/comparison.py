"""A study of algorithms: verdicts, growth of the errors. The report has accuracy as a function of rate and cost."""

from __future__ import annotations

import json

import rerun as rr
import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "study"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the study to show.

    Returns:
        The layout.
    """
    panels = json.loads(run.label("panels", "[]"))

    def growth(entity: str, title: str, end: float, legend: bool) -> rrb.TimeSeriesView:
        start, stop = (rrb.TimeRangeBoundary.absolute(seconds=t) for t in (run.start, end))
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=title,
            axis_x=rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=stop)),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.RightBottom),
        )

    plots = [growth(*panel) for panel in panels]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.TextDocumentView(origin="/comparison/tables", name="Verdicts"),
            rrb.Grid(*plots, grid_columns=1 if len(plots) < 4 else 2, name="Growth of the errors"),
            column_shares=[1, 1],
        ),
        collapse_panels=True,
    )
