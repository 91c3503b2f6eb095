"""Further coordinates: the first algorithm's motion in Earth-fixed, inertial or a frame's axes, on other ellipsoids."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

NEEDS = "coordinates"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout: a row for each kind of coordinates, a plot for each vector.
    """

    def plot(entity: str) -> rrb.TimeSeriesView:
        _, stream, vector = entity.split("/")
        unit = run.label(entity)
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=f"{stream.replace('_', ' ')}: {vector}" + (f" [{unit}]" if unit else ""),
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=True, corner=run.corner(entity)),
        )

    kinds: dict[str, list[str]] = {}
    for entity in run.ranges:
        if entity.startswith("coordinates/"):
            kinds.setdefault(entity.split("/")[1], []).append(entity)
    rows = [rrb.Horizontal(*map(plot, entities)) for entities in kinds.values()]
    return rrb.Blueprint(rrb.Vertical(*rows), collapse_panels=True)
