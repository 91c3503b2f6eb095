"""Redundant sensors: test statistics with their threshold, sensors in use, errors with and without monitoring."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

NEEDS = "redundancy"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout: a column for the gyros and one for the accelerometers, and the errors below.
    """

    def plot(name: str, *entities: str, fixed: bool = False, legend: bool = True) -> rrb.TimeSeriesView:
        axis = rrb.ScalarAxis(range=run.range_of(*entities)) if fixed else run.axis_y(*entities)
        return rrb.TimeSeriesView(
            origin="/redundancy",
            contents=[f"/{entity}/**" for entity in entities],
            name=name,
            axis_x=run.axis_x(),
            axis_y=axis,
            plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
        )

    def column(kind: str, name: str) -> rrb.Vertical:
        of, error = f"redundancy/{kind}", f"sensors/single_{kind}/error"
        return rrb.Vertical(
            plot(f"{name}: test statistic by window, and threshold", f"{of}/statistic", fixed=True),
            plot(f"{name} in use", f"{of}/used", fixed=True, legend=False),
            plot(f"{run.label(f'{error} title')} [{run.label(error)}]", error),
            row_shares=[3, 2, 3],
        )  # fmt: skip

    rows: list[rrb.Horizontal] = [rrb.Horizontal(column("gyro", "Gyros"), column("accel", "Accelerometers"))]
    if length := run.label("redundancy/horizontal"):
        angle = run.label("redundancy/attitude")
        rows.append(
            rrb.Horizontal(
                plot(f"{run.label('redundancy/horizontal title')} [{length}]", "redundancy/horizontal"),
                plot(f"{run.label('redundancy/attitude title')} [{angle}]", "redundancy/attitude"),
            )
        )
    return rrb.Blueprint(rrb.Vertical(*rows, row_shares=[3, 1][: len(rows)]), collapse_panels=True)
