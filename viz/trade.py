"""A trade study: figures over the grid, tables of the cells, growth of the errors in the cells."""

from __future__ import annotations

import json

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "trade"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the study to show.

    Returns:
        The layout.
    """
    pictures = json.loads(run.label("pictures", "[]"))
    shown, cells, unit = run.label("shown"), run.label("cells"), run.label("r95", "m")
    which = f"{shown} of {cells} cells, from the best to the worst" if shown != cells else "each cell"

    def growth(key: str, name: str, legend: bool) -> rrb.TimeSeriesView:
        entities = [entity for entity in run.ranges if entity.startswith(f"trade/{key}")]
        return rrb.TimeSeriesView(
            origin=f"/trade/{key}",
            name=f"{name} [{unit}] of {which}",
            axis_x=run.axis_x(0.8),  # room for the legend
            axis_y=run.axis_y(*entities),
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.RightTop),
        )

    images = [rrb.Spatial2DView(origin=f"/{entity}", name=title) for entity, title in pictures]
    tables = rrb.TextDocumentView(origin="/trade/tables", name="Cells, requirements, commands")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(rrb.Tabs(*images), tables, row_shares=[3, 2]) if images else tables,
            rrb.Vertical(growth("r95", "R95", legend=True), growth("cep", "CEP", legend=False)),
            column_shares=[3, 2],
        ),
        collapse_panels=True,
    )
