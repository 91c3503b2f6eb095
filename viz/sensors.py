"""Sensors: measured and ideal data, their errors, and accumulated errors."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout: a column for each kind of sensor.
    """

    def plot(key: str, how: str = "") -> rrb.TimeSeriesView:
        entity = f"sensors/{key}"
        return rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=f"{run.label(f'{entity} title')} [{run.label(entity)}]{how}",
            axis_x=run.axis_x(),
            axis_y=run.axis_y(entity),
            plot_legend=rrb.PlotLegend(visible=not how, corner=run.corner(entity)),
        )

    def column(kind: str) -> rrb.Vertical:
        compensated = ", compensated (thin) and measured (wide)" if run.label(f"sensors/{kind}/left") else ""
        simulated = ", measured (thin) and ideal (wide)" if run.label(f"sensors/{kind}/sum") else ""
        hows = {"reading": simulated, "error": compensated, "sum": compensated, "left": ""}
        shown = {part: how for part, how in hows.items() if run.label(f"sensors/{kind}/{part}")}
        return rrb.Vertical(*(plot(f"{kind}/{part}", how) for part, how in shown.items()))

    known = {label.split("/")[1] for label in run.labels if label.startswith("sensors/")}
    keys = [key for key in ("single", "attitude", "gyro", "accel") if key in known]
    return rrb.Blueprint(rrb.Horizontal(*map(column, keys or ["gyro", "accel"])), collapse_panels=True)
