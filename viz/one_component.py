"""One component: the Schuler pendulum, figure 8.4 for the errors of the run, simulation and error equations."""

from __future__ import annotations

import json

import rerun.blueprint as rrb

from sinssim.recording.rerun.views import RunInfo

KIND = "one-component"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """

    def plot(key: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        entity = f"one_component/{key}"
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=legend, corner=run.corner(entity)),
        )

    sources = [plot(key, title) for key, title in json.loads(run.label("sources", "[]"))]
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
                plot("coordinate", "Error Δy of the coordinate [arcmin ≈ nmi]", True),
                *sources,
            ),
            rrb.Vertical(
                plot("difference", f"Δy: equation minus simulation [{run.label('difference', 'arcsec')}]", True),
                plot("velocity_error", f"Velocity error ΔV [{run.label('velocity', 'm/s')}]"),
                plot("pitch_error", f"Pitch error Δα [{run.label('pitch', 'arcmin')}]"),
            ),
            rrb.Vertical(
                plot("velocity", "Velocity V [m/s]"),
                plot("height", "Height H [m]"),
                plot("body_pitch", "Pitch ϑ [°]"),
                plot("force", "Specific force [m/s²]", True),
            ),
            column_shares=[4, 4, 4, 3],
        ),
        collapse_panels=True,
    )
