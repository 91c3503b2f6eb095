"""What did the sensors say, against the truth? Readings, errors of the readings, and what those errors sum up to."""

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

    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                plot(
                    "Inertial angular rate [deg/s], measured (thin) on ideal (wide)",
                    "gyro/ideal",
                    "gyro/measured",
                    legend=False,
                ),
                plot(f"Gyro error, mean over {window} [deg/h]", "gyro/error"),
                plot(f"Gyro error, accumulated [{run.label('gyro_sum', 'arcsec')}]", "gyro/sum"),
            ),
            rrb.Vertical(
                plot(
                    "Specific force [m/s²], measured (thin) on ideal (wide)",
                    "accel/ideal",
                    "accel/measured",
                    legend=False,
                ),
                plot(f"Accelerometer error, mean over {window} [µg]", "accel/error"),
                plot(f"Accelerometer error, accumulated [{run.label('accel_sum', 'm/s')}]", "accel/sum"),
            ),
        ),
        collapse_panels=True,
    )
