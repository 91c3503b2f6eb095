"""The motion: its path in 3D and on the map, attitude, heights, speeds and events."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo


# Long: a layout is one nested expression, read from the outside in.
def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """
    scale = run.label("height_scale", "1")
    heights = "" if scale == "1" else f", heights ×{scale}"

    def plot(key: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(
            origin=f"/flight/{key}",
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(f"flight/{key}"),
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
        )

    hidden = run.label("not_on_map").split()
    on_map = rrb.MapView(
        origin="/map",
        contents=["/map/**", *(f"- /map/{name}" for name in hidden)],
        name=f"Map, without the inertial path of {', '.join(hidden)}" if hidden else "Map",
        zoom=run.map_zoom,
    )
    no_grid = rrb.LineGrid3D(visible=False)
    path = rrb.Spatial3DView(
        origin="/world",
        contents=["/world/**", "- /world/nav/**"],
        name=f"{run.label('path', 'Path')}{heights}",
        line_grid=no_grid,
        eye_controls=rrb.EyeControls3D(position=run.eye[0], look_target=run.eye[1], eye_up=(0, 0, 1))
        if run.eye
        else None,
    )
    attitude = rrb.Spatial3DView(
        origin="/attitude",
        name="Attitude",
        line_grid=no_grid,
        eye_controls=rrb.EyeControls3D(position=(0.9, -1.5, 0.9), look_target=(0, 0, 0), eye_up=(0, 0, 1)),
    )
    events = rrb.TextLogView(
        origin="/events",
        name="Events",
        # the viewer's own column of times is too narrow for fractions of a second; the texts begin with them
        columns=rrb.TextLogColumns(
            timeline_columns=[rrb.encodings.TimelineColumn("sim_time", visible=False)], text_log_columns=["Body"]
        ),
    )
    scenario = rrb.TextDocumentView(origin="/about/scenario", name="Scenario")
    words = scenario if run.label("events") == "no" else rrb.Tabs(events, scenario)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                path,
                rrb.Horizontal(on_map, attitude),
                row_shares=[3, 2],
            ),
            rrb.Grid(
                plot("height", "Height above the ellipsoid [m]"),
                plot("roll_pitch", "Roll and pitch [deg]", legend=True),
                plot("speed", "Speed [m/s]", legend=True),
                plot("heading", "Heading [deg]"),
                plot("vertical_speed", "Vertical speed, up [m/s]"),
                words,
                grid_columns=2,
            ),
        ),
        collapse_panels=True,
    )
