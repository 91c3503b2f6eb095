"""An ensemble: position errors over time, growth of CEP and R95 with confidence bands, σ by component, consistency."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "ensemble"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the ensemble to show.

    Returns:
        The layout.
    """

    def plot(key: str, name: str) -> rrb.TimeSeriesView:
        entity = f"ensemble/{key}"
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=True, corner=run.corner(entity)),
        )

    unit = run.label("growth", "m")
    sigmas = [
        plot(f"sigma_{key}", f"σ over the runs, {key} [{run.label(f'sigma_{key}', 'SI')}]")
        for key in ("position", "velocity", "attitude")
    ]
    tests = [plot("nees", "ANEES per state"), plot("nis", "NIS per component")] if run.label("filter") else []
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial2DView(
                    origin="/ensemble/cloud", name=f"Position errors of {run.label('runs', 'the')} runs [{unit}]"
                ),
                rrb.TextDocumentView(origin="/ensemble/tables", name="Numbers"),
                row_shares=[3, 2],
            ),
            rrb.Vertical(plot("growth", f"CEP and R95 with 95 % bands [{unit}]"), *tests),
            rrb.Vertical(*sigmas),
            column_shares=[4, 4, 3],
        ),
        collapse_panels=True,
    )
