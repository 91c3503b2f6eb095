"""Scored solutions: their errors and those of the algorithms of the run on common axes, the map, the ranking."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun.views import RunInfo

KIND = "score"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the scores to show.

    Returns:
        The layout.
    """
    position, height = run.label("position", "m"), run.label("height", "m")
    velocity, angle = run.label("velocity", "m/s"), run.label("attitude", "arcmin")

    def plots(*keys: tuple[str, str]) -> list[rrb.TimeSeriesView]:
        shown = []
        for key, name in keys:
            entities = [entity for entity in run.ranges if entity.startswith(f"score/{key}/")]
            if entities:  # no solution may have an attitude, for example
                title = f"{name}, ±3σ" if any("sigma" in entity for entity in entities) else name
                legend = rrb.PlotLegend(visible=key == "horizontal", corner=run.corner(*entities))
                shown.append(
                    rrb.TimeSeriesView(
                        origin=f"/score/{key}",
                        name=title,
                        axis_x=run.axis_x(),
                        axis_y=run.axis_y(*entities),
                        plot_legend=legend,
                    )
                )
        return shown

    errors = plots(
        ("position_north", f"North position [{position}]"),
        ("position_east", f"East position [{position}]"),
        ("height", f"Height [{height}]"),
        ("velocity_north", f"North velocity [{velocity}]"),
        ("velocity_east", f"East velocity [{velocity}]"),
        ("velocity_down", f"Down velocity [{velocity}]"),
        ("tilt_north", f"Tilt φN [{angle}]"),
        ("tilt_east", f"Tilt φE [{angle}]"),
        ("azimuth", f"Azimuth misalignment φD [{angle}]"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                *plots(("horizontal", f"Horizontal error [{position}]")),
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
