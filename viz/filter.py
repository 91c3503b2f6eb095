"""Consistency of the filter: errors inside ±3σ, innovations, decisions of the gate, observed states."""

from __future__ import annotations

import math

import rerun.blueprint as rrb

from sinssim.recording.rerun_views import RunInfo

NEEDS = "filter"


# Long: a layout is one nested expression, read from the outside in.
def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout.
    """

    def plot(
        name: str,
        key: str,
        *,
        legend: float = 0.0,
        axis: tuple[float, float] | None = None,
    ) -> rrb.TimeSeriesView:
        """A plot; `legend` is the width of the legend relative to that of the lines."""
        entities = [e for e in run.ranges if e == f"filter/{key}" or e.startswith(f"filter/{key}/")]
        return rrb.TimeSeriesView(
            origin=f"/filter/{key}",
            name=name,
            axis_x=run.axis_x(legend),
            axis_y=rrb.ScalarAxis(range=axis) if axis is not None else run.axis_y(*entities),
            plot_legend=rrb.PlotLegend(visible=legend > 0.0, corner=rrb.Corner2D.RightTop),
        )

    def band(name: str, key: str, legend: float = 0.0) -> rrb.TimeSeriesView:
        half = max(map(abs, run.range_of(f"filter/{key}"))) or 1.0
        power = 10.0 ** math.floor(math.log10(half))
        # the viewer writes numbers at powers of ten, and not too many of them
        half = 1.05 * (10.0 * power if half > 4.7 * power else half)
        return plot(f"{name} [{run.label(f'filter/{key}', 'm')}]", key, legend=legend, axis=(-half, half))

    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Grid(
                band("North position error", "position_north"),
                band("East position error", "position_east"),
                band("Height error", "height"),
                plot("Innovations [σ], lines at ±3", "innovations", axis=(-6.5, 6.5)),
                band("North velocity error", "velocity_north"),
                band("East velocity error", "velocity_east"),
                band("Down velocity error", "velocity_down"),
                plot("Mean NIS, per component", "squares", axis=(0.0, 2.5), legend=0.5),
                band("Tilt about north, φN", "tilt_north", 0.5),
                band("Tilt about east, φE", "tilt_east"),
                band("Azimuth misalignment, φD", "azimuth"),
                plot("Measurements accepted, rejected", "decisions", legend=0.5),
                grid_columns=4,
            ),
            rrb.Horizontal(
                plot(run.label("filter/gyro title", "Gyros") + " [σ]", "gyro"),
                plot(run.label("filter/accelerometer title", "Accelerometers") + " [σ]", "accelerometer"),
                plot("Largest σ of each block, relative to its start [decades]", "shrinking", legend=0.75),
                rrb.TextDocumentView(origin="/about/filter", name="Consistency"),
                column_shares=[2, 2, 3.5, 3],
            ),
            row_shares=[3, 1],
        ),
        collapse_panels=True,
    )
