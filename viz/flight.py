"""Where did it go? The flight in 3D and on the map, its attitude, heights and speeds, and what happened on the way."""

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
    scale = run.label("height_scale", "1")
    heights = "" if scale == "1" else f", heights ×{scale}"

    def plot(key: str, name: str, legend: bool = False) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(
            origin=f"/flight/{key}",
            name=name,
            axis_x=run.axis_x(),
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
        )

    eye = rrb.EyeControls3D(position=run.eye[0], look_target=run.eye[1], eye_up=(0, 0, 1)) if run.eye else None
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(
                    origin="/world",
                    name=f"Flight path{heights}",
                    line_grid=rrb.LineGrid3D(visible=False),
                    eye_controls=eye,
                ),
                rrb.Horizontal(
                    rrb.MapView(origin="/map", name="Map", zoom=run.map_zoom),
                    rrb.Spatial3DView(
                        origin="/attitude",
                        name="Attitude",
                        line_grid=rrb.LineGrid3D(visible=False),
                        eye_controls=rrb.EyeControls3D(
                            position=(0.9, -1.5, 0.9), look_target=(0, 0, 0), eye_up=(0, 0, 1)
                        ),
                    ),
                    column_shares=[3, 2],
                ),
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                plot("roll_pitch", "Roll and pitch [deg]", legend=True),
                plot("heading", "Heading [deg]"),
                plot("height", "Height above the ellipsoid [m]"),
                plot("ground_speed", "Ground speed [m/s]"),
                plot("vertical_speed", "Vertical speed, up [m/s]"),
            ),
            rrb.Vertical(
                rrb.TextLogView(
                    origin="/events",
                    name="Events",
                    columns=rrb.TextLogColumns(timeline_columns=["sim_time"], text_log_columns=["Body"]),
                ),
                rrb.TextDocumentView(origin="/about/scenario", name="Scenario"),
            ),
            column_shares=[5, 3, 2],
        ),
        collapse_panels=True,
    )
