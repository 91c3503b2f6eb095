"""Which algorithm drifts, and how? Position, velocity and attitude errors of all algorithms on shared axes."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.blueprints import RunInfo


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
        return rrb.TimeSeriesView(
            origin="/navigation",
            contents=[f"/navigation/{k}" for k in (key, *further)],
            name=name,
            axis_x=run.axis_x(),
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
        )

    columns = [
        rrb.Vertical(
            plot("position_north", f"North position error [{position}]", legend=True),
            plot("velocity_north", f"North velocity error [{velocity}]"),
            plot("tilt_north", f"Tilt about north φN [{tilt}]"),
            plot("horizontal", f"Horizontal error [{position}]", "one_mile_an_hour", legend=True),
        ),
        rrb.Vertical(
            plot("position_east", f"East position error [{position}]"),
            plot("velocity_east", f"East velocity error [{velocity}]"),
            plot("tilt_east", f"Tilt about east φE [{tilt}]"),
            plot("apart", f"Distance from the {run.algorithms[0]} solution [{run.label('apart', 'm')}]", legend=True)
            if len(run.algorithms) > 1
            else plot("speed", f"Velocity error, magnitude [{velocity}]"),
        ),
        rrb.Vertical(
            plot("height", f"Height error [{run.label('height', 'm')}]"),
            plot("velocity_down", f"Down velocity error [{velocity}]"),
            plot("azimuth", f"Azimuth misalignment φD [{azimuth}]"),
            rrb.TextDocumentView(origin="/about/summary", name="Summary"),
        ),
    ]
    return rrb.Blueprint(rrb.Horizontal(*columns), collapse_panels=True)
