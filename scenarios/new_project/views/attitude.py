"""My view: the attitude errors of all algorithms, one above the other."""

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
    tilt, azimuth = run.label("tilt", "arcmin"), run.label("azimuth", "arcmin")
    plots = {
        "azimuth": f"Azimuth misalignment, φD [{azimuth}]",
        "tilt_north": f"Tilt about north, φN [{tilt}]",
        "tilt_east": f"Tilt about east, φE [{tilt}]",
    }
    return rrb.Blueprint(
        rrb.Vertical(
            *(
                rrb.TimeSeriesView(
                    origin=f"/navigation/{key}",
                    name=name,
                    axis_x=run.axis_x(),
                    axis_y=run.axis_y(f"navigation/{key}"),
                    plot_legend=rrb.PlotLegend(visible=key == "azimuth", corner=run.corner(f"navigation/{key}")),
                )
                for key, name in plots.items()
            )
        )
    )
