"""Navigation errors: position, velocity and attitude errors of all algorithms on common axes."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """

    def plot(key: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        entity = f"navigation/{key}"
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=f"{name} [{run.label(entity, 'm')}]",
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=legend, corner=run.corner(entity)),
        )

    return rrb.Blueprint(
        rrb.Grid(
            plot("position_north", "North position error", legend=True),
            plot("position_east", "East position error"),
            plot("height", "Height error"),
            plot("horizontal", "Horizontal error", legend=True),
            plot("velocity_north", "North velocity error"),
            plot("velocity_east", "East velocity error"),
            plot("velocity_down", "Down velocity error"),
            plot("apart", f"Distance from the {run.algorithms[0]} solution", legend=True)
            if len(run.algorithms) > 1
            else plot("speed", "Velocity error, magnitude"),
            plot("tilt_north", "Tilt about north, φN"),
            plot("tilt_east", "Tilt about east, φE"),
            plot("azimuth", "Azimuth misalignment, φD"),
            rrb.TextDocumentView(origin="/about/summary", name="Summary"),
            grid_columns=4,
        ),
        collapse_panels=True,
    )
