"""Sensors: measured and ideal data, their errors, and accumulated errors."""

from __future__ import annotations

import rerun.blueprint as rrb

from sinssim.recording.rerun.views import RunInfo

READINGS = {
    "single": "Specific force along each axis [m/s²]",
    "gyro": "Inertial angular rate [deg/s]",
    "accel": "Specific force [m/s²]",
}


def blueprint(run: RunInfo) -> rrb.Blueprint:
    """Return the view.

    Args:
        run: the run to show.

    Returns:
        The layout: a column for each kind of sensor.
    """
    window = run.label("sensor_window", "1 s")

    def plot(name: str, *keys: str, legend: bool = True) -> rrb.TimeSeriesView:
        entities = [f"sensors/{key}" for key in keys]
        return rrb.TimeSeriesView(
            origin="/sensors",
            contents=[f"/{entity}" for entity in entities],
            name=name,
            axis_x=run.axis_x(),
            axis_y=run.axis_y(*entities),
            plot_legend=rrb.PlotLegend(visible=legend, corner=run.corner(*entities)),
        )

    def column(key: str) -> rrb.Vertical:
        title, total = run.label(f"{key}_title"), run.label(f"{key}_sum")
        unit = "deg/h" if key == "gyro" else "µg"
        if run.label("sensors") == "recorded":
            return rrb.Vertical(plot(f"{READINGS[key]}, recorded", f"{key}/measured"))
        plots = []
        if key in READINGS:
            name = f"{READINGS[key]}, measured (thin) and ideal (wide)"
            plots.append(plot(name, f"{key}/ideal", f"{key}/measured", legend=False))
        if key == "attitude":
            plots.append(plot(f"{title}: error of each measurement [{total}]", f"{key}/sum"))
            plots.append(plot(f"{title}: error, mean over {window} [{total}]", f"{key}/error"))
        elif left := run.label(f"{key}_left"):
            how = "compensated (thin) and measured (wide)"
            name = f"{title}: error, mean over {window} [{unit}], {how}"
            plots.append(plot(name, f"{key}/error", f"{key}/error_compensated", legend=False))
            name = f"{title}: error, accumulated [{total}], {how}"
            plots.append(plot(name, f"{key}/sum", f"{key}/sum_compensated", legend=False))
            plots.append(plot(f"{title}: error after compensation, accumulated [{left}]", f"{key}/left"))
        else:
            plots.append(plot(f"{title}: error, mean over {window} [{unit}]", f"{key}/error"))
            plots.append(plot(f"{title}: error, accumulated [{total}]", f"{key}/sum"))
        return rrb.Vertical(*plots)

    keys = [key for key in ("single", "attitude", "gyro", "accel") if run.label(f"{key}_title")]
    return rrb.Blueprint(rrb.Horizontal(*map(column, keys or ["gyro", "accel"])), collapse_panels=True)
