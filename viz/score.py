"""Scored solutions: their errors and those of the algorithms of the run on common axes, the map, the ranking."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "score"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the scores to show.

    Returns:
        The layout.
    """

    def plots(*keys: str) -> list[rrb.TimeSeriesView]:
        shown = []
        for key in keys:
            entity = f"score/{key}"
            if entity in run.ranges:  # no solution may have an attitude, for example
                legend = rrb.PlotLegend(visible=key == "horizontal", corner=run.corner(entity))
                shown.append(
                    rrb.TimeSeriesView(
                        origin=f"/{entity}",
                        name=f"{run.label(f'{entity} title')} [{run.label(entity)}]",
                        axis_x=run.axis_x(),
                        axis_y=run.axis_y(entity),
                        plot_legend=legend,
                    )
                )
        return shown

    parts = ("north", "east")
    errors = plots(
        *(f"position_{axis}" for axis in parts), "height", *(f"velocity_{axis}" for axis in (*parts, "down")),
        *(f"tilt_{axis}" for axis in parts), "azimuth",
    )  # fmt: skip
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                *plots("horizontal"),
                rrb.Tabs(
                    rrb.TextDocumentView(origin="/about/ranking", name="Ranking"),
                    rrb.TextDocumentView(origin="/about/scored", name="What was scored"),
                ),
                rrb.MapView(origin="/map", name="Map", zoom=run.map_zoom),
            ),
            rrb.Grid(*errors, grid_columns=3),
            column_shares=[2, 3],
        ),
        collapse_panels=True,
    )
