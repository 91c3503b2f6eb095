"""One component: the Schuler pendulum, figure 8.4 for the errors of the run, simulation and error equations."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "one-component"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """

    def plot(key: str, legend: bool = False) -> rrb.TimeSeriesView:
        entity = f"one_component/{key}"
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=f"{run.label(f'{key} title')} [{run.label(key)}]",
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=legend, corner=run.corner(entity)),
        )

    sources = [plot(key) for key in run.labels if key.startswith("source_") and " " not in key]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial2DView(
                    origin="/one_component/pendulum", name=f"Pendulum of Δy, angles × {run.label('enlarged', '1')}"
                ),
                rrb.TextDocumentView(origin="/about/summary", name="Errors"),
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                plot("coordinate", True),
                *sources,
            ),
            rrb.Vertical(
                plot("difference", True),
                plot("velocity_error"),
                plot("pitch_error"),
            ),
            rrb.Vertical(
                plot("velocity"),
                plot("height"),
                plot("body_pitch"),
                plot("force", True),
            ),
            column_shares=[4, 4, 4, 3],
        ),
        collapse_panels=True,
    )
