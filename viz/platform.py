"""A gimballed platform and a strapdown system with the same sensors: errors, commanded rates, gimbal angles."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

NEEDS = "platform"


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout: errors above, rates and gimbal angles below.
    """

    def plot(name: str, entity: str) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(
            origin=f"/platform/{entity}",
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(f"platform/{entity}"),
            plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.LeftTop),
        )

    length, angle = run.label("platform/horizontal", "m"), run.label("platform/attitude", "arcsec")
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                plot(f"Horizontal error [{length}]", "horizontal"), plot(f"Attitude error [{angle}]", "attitude")
            ),
            rrb.Horizontal(
                plot("Strapdown: rate measured by the gyros [deg/s]", "sensed"),
                plot("Platform: commanded rate [deg/h]", "commanded"),
                plot("Gimbal angles [deg]", "gimbals"),
            ),
            row_shares=[3, 2],
        ),
        collapse_panels=True,
    )
