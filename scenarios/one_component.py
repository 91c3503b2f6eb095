"""Figure 8.4 of the chapter: the effect of an accelerometer error and of a gyro error in the one-component system.

Run it from anywhere:  python scenarios/one_component.py [-o DIR]

It draws the simulation over the closed forms (8.13) and (8.15), with both components of the latter, as figure_8_4.svg
and .png, and prints their difference.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sinssim.data import Array
from sinssim.recording.figures import new_figure, save, styled
from sinssim.recording.style import COLORS, LINE, SOFT, THIN, css
from sinssim.strapdown import one_component_system
from sinssim.strapdown.one_component_system import accelerometer_error, gyro_error
from sinssim.units import ARCMIN, DEG_H, UG

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
    quiet, weight = np.zeros_like(step), one_component_system.GRAVITY * step
    biased = one_component_system.simulate(time, quiet, np.stack([ACCELEROMETER_BIAS * step, weight], axis=1))
    drifting = one_component_system.simulate(time, -GYRO_DRIFT * step, np.stack([quiet, weight], axis=1))
    return time, biased.coordinate, drifting.coordinate


@styled
def figure_8_4() -> Figure:
    """Draw figure 8.4 a and b: the simulation over the closed forms (8.13) and (8.15).

    Returns:
        The figure.
    """
    time, by_accelerometer, by_gyro = error_runs()
    rate = one_component_system.schuler_rate()
    panels = (
        (
            "a   accelerometer error, 100 µg",
            by_accelerometer,
            one_component_system.accelerometer_error(time, ACCELEROMETER_BIAS),
            "Δy = (Δa/g)(1 − cos ω$_s$t)   (8.13)",
            (),
        ),
        (
            "b   gyro error, 0.01 °/h",
            by_gyro,
            one_component_system.gyro_error(time, GYRO_DRIFT),
            "Δy = Δω$_0$(t − sin ω$_s$t / ω$_s$)   (8.15)",
            (
                ("Δω$_0$t", GYRO_DRIFT * time, "-."),
                ("−Δω$_0$sin ω$_s$t / ω$_s$", -GYRO_DRIFT * np.sin(rate * time) / rate, ":"),
            ),
        ),
    )
    figure = new_figure(7.0, 7.0)
    period = 2.0 * np.pi / rate
    for axes, (title, simulated, closed, formula, components) in zip(
        figure.subplots(2, 1, sharex=True), panels, strict=True
    ):
        axes.plot(time, closed / ARCMIN, color=css(COLORS["poisson"]), linewidth=LINE * 4.0, alpha=0.6, label=formula)
        axes.plot(time, simulated / ARCMIN, color=css(COLORS["measured-attitude"]), label="simulation")
        for words, component, dash in components:
            axes.plot(time, component / ARCMIN, color=SOFT, linewidth=LINE, linestyle=dash, label=words)
        axes.axvline(period, color=SOFT, linewidth=THIN, linestyle="--")
        label = f" T$_s$ = {period / 60.0:.1f} min"
        axes.text(period, 0.9, label, transform=axes.get_xaxis_transform(), color=SOFT)
        axes.set(title=title, ylabel="error Δy of the coordinate [arcmin]", xlim=(0.0, _DURATION))
        lowest = min((float(component.min()) for _, component, _ in components), default=0.0)
        axes.set_ylim(1.3 * lowest / ARCMIN, 1.4 * float(simulated.max()) / ARCMIN)  # room for the legend
        axes.legend(loc="upper left")
        miles = axes.secondary_yaxis("right", functions=(lambda y: y, lambda y: y))
        miles.set_ylabel("≈ nautical miles")
    figure.axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(figure.axes)
    return figure


def main() -> None:
    """Draw and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/figure_8_4"), help="folder to write")
    folder = parser.parse_args().out
    time, by_accelerometer, by_gyro = error_runs()
    for name, simulated, closed in (
        ("accelerometer error, 100 µg, (8.13)", by_accelerometer, accelerometer_error(time, ACCELEROMETER_BIAS)),
        ("gyro error, 0.01 deg/h, (8.15)", by_gyro, gyro_error(time, GYRO_DRIFT)),
    ):
        apart = float(np.abs(simulated - closed).max() / np.abs(closed).max())
        print(f"{name}: simulation and closed form differ by {apart:.1e} of the largest error")
    figure, files = figure_8_4(), [folder / f"figure_8_4.{suffix}" for suffix in ("svg", "png")]
    for file in files:
        save(figure, file)
    print("Figures:", *files)


if __name__ == "__main__":
    main()
