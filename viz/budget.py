"""A covariance budget: circles over time, shares of the sources, standard deviations, tables."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

KIND = "budget"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the budget to show.

    Returns:
        The layout.
    """

    def plot(key: str, name: str, room: float = 0.0, legend: bool = True) -> rrb.TimeSeriesView:
        entity = f"budget/{key}"
        corner = rrb.Corner2D.RightTop if room else rrb.Corner2D.LeftTop
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=name,
            axis_x=run.axis_x(room),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=legend, corner=corner),
        )

    circle = run.label("circles", "m")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Tabs(
                    rrb.Spatial2DView(origin="/budget/figures/growth", name="Growth and shares"),
                    rrb.Spatial2DView(origin="/budget/figures/ranking0", name="What to improve first"),
                ),
                rrb.TextDocumentView(origin="/budget/tables", name="Sources and requirements"),
                row_shares=[1, 1],
            ),
            rrb.Vertical(
                plot("circles", f"CEP and R95 of all sources [{circle}]", 1.2),
                plot("r95_alone", f"R95 from each source alone [{circle}]", 1.2),
                plot("shares", "Share of the horizontal mean square [%]", 1.2, legend=False),
            ),
            rrb.Vertical(
                plot("sigma/position", f"σ of the position [{run.label('sigma/position', 'm')}]"),
                plot("sigma/velocity", f"σ of the velocity [{run.label('sigma/velocity', 'm/s')}]"),
                plot("sigma/attitude", f"σ of the attitude [{run.label('sigma/attitude', 'arcsec')}]"),
            ),
            column_shares=[4, 3, 3],
        ),
        collapse_panels=True,
    )
