"""Navigation errors: position, velocity and attitude errors of all algorithms on common axes."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun.views import RunInfo


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """
    position, velocity = run.label("position", "m"), run.label("velocity", "m/s")
    tilt, azimuth = run.label("tilt", "arcmin"), run.label("azimuth", "arcmin")

    def plot(key: str, name: str, *further: str, legend: bool = False) -> rrb.TimeSeriesView:
        entities = [f"navigation/{k}" for k in (key, *further)]
        return rrb.TimeSeriesView(
            origin="/navigation",
            contents=[f"/{entity}" for entity in entities],
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(*entities),
            plot_legend=rrb.PlotLegend(visible=legend, corner=run.corner(*entities)),
        )

    return rrb.Blueprint(
        rrb.Grid(
            plot("position_north", f"North position error [{position}]", legend=True),
            plot("position_east", f"East position error [{position}]"),
            plot("height", f"Height error [{run.label('height', 'm')}]"),
            plot("horizontal", f"Horizontal error [{position}]", "one_mile_an_hour", legend=True),
            plot("velocity_north", f"North velocity error [{velocity}]"),
            plot("velocity_east", f"East velocity error [{velocity}]"),
            plot("velocity_down", f"Down velocity error [{velocity}]"),
            plot("apart", f"Distance from the {run.algorithms[0]} solution [{run.label('apart', 'm')}]", legend=True)
            if len(run.algorithms) > 1
            else plot("speed", f"Velocity error, magnitude [{velocity}]"),
            plot("tilt_north", f"Tilt about north, φN [{tilt}]"),
            plot("tilt_east", f"Tilt about east, φE [{tilt}]"),
            plot("azimuth", f"Azimuth misalignment, φD [{azimuth}]"),
            rrb.TextDocumentView(origin="/about/summary", name="Summary"),
            grid_columns=4,
        ),
        collapse_panels=True,
    )
