"""Figure 8.4 of the chapter: how an accelerometer's and a gyro's error act in the one-component system."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.strapdown import one_component
from sinssim.units import DEG, DEG_H, UG

ACCELEROMETER_BIAS = 100.0 * UG
"""Accelerometer error of figure 8.4 a [m/s²]."""

GYRO_DRIFT = 0.01 * DEG_H
"""Gyro error of figure 8.4 b, nose-down positive [rad/s]."""

_DURATION = 8000.0  # s, the figure's time axis
_INTERVAL = 1.0  # s; the Runge-Kutta step leaves 1e-13 of the amplitude


def error_runs() -> tuple[Array, Array, Array]:
    """Run the one-component system at rest, once with each error.

    Returns:
        Time (N+1,) s, the coordinate's error with the accelerometer's error and with the gyro's, (N+1,) rad each.
    """
    time = np.arange(0.0, _DURATION + 0.5 * _INTERVAL, _INTERVAL)
    step = np.diff(time)
    quiet, weight = np.zeros_like(step), one_component.GRAVITY * step
    biased = one_component.simulate(time, quiet, np.stack([ACCELEROMETER_BIAS * step, weight], axis=1))
    drifting = one_component.simulate(time, -GYRO_DRIFT * step, np.stack([quiet, weight], axis=1))
    return time, biased.coordinate, drifting.coordinate


def draw_figure_8_4(folder: Path | str) -> list[Path]:
    """Draw figure 8.4 a and b: the simulation over the closed forms (8.13) and (8.15).

    Args:
        folder: where the pictures go; made if it is not there.

    Returns:
        The files: figure_8_4.svg and figure_8_4.png.
    """
    import matplotlib

    matplotlib.use("Agg", force=False)
    from matplotlib.figure import Figure

    time, by_accelerometer, by_gyro = error_runs()
    panels = (
        (
            "a   accelerometer error, 100 µg",
            by_accelerometer,
            one_component.accelerometer_error(time, ACCELEROMETER_BIAS),
            "Δy = (Δa/g)(1 − cos ω$_s$t)   (8.13)",
        ),
        (
            "b   gyro error, 0.01 °/h",
            by_gyro,
            one_component.gyro_error(time, GYRO_DRIFT),
            "Δy = Δω$_0$(t − sin ω$_s$t / ω$_s$)   (8.15)",
        ),
    )
    figure = Figure(figsize=(7.0, 7.0), layout="constrained")
    period = 2.0 * np.pi / one_component.schuler_rate()
    for axes, (title, simulated, closed, formula) in zip(figure.subplots(2, 1, sharex=True), panels, strict=True):
        axes.plot(time, closed * 60.0 / DEG, color="#e69f00", linewidth=5.0, alpha=0.6, label=formula)
        axes.plot(time, simulated * 60.0 / DEG, color="#0072b2", linewidth=1.4, label="simulation")
        axes.axvline(period, color="0.6", linewidth=0.8, linestyle="--")
        label = f" T$_s$ = {period / 60.0:.1f} min"
        axes.text(period, 0.9, label, transform=axes.get_xaxis_transform(), color="0.4")
        axes.set(title=title, ylabel="error Δy of the coordinate [arcmin]", xlim=(0.0, _DURATION))
        axes.set_ylim(0.0, 1.4 * float(simulated.max()) * 60.0 / DEG)  # room for the legend
        axes.grid(alpha=0.3)
        axes.legend(loc="upper left")
        miles = axes.secondary_yaxis("right", functions=(lambda y: y, lambda y: y))
        miles.set_ylabel("≈ nautical miles")
    figure.axes[-1].set_xlabel("time [s]")
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    files = []
    for suffix in ("svg", "png"):
        path = target / f"figure_8_4.{suffix}"
        beside = path.with_name(f".{path.name}.partial")
        figure.savefig(beside, format=suffix, dpi=120)
        os.replace(beside, path)
        files.append(path)
    return files
