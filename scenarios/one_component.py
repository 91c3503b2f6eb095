"""Figure 8.4 of the chapter: the effect of an accelerometer error and of a gyro error in the one-component system.

Run it from anywhere:  python scenarios/one_component.py [-o DIR]

It draws the simulation over the closed forms (8.13) and (8.15), with both components of the latter, as figure_8_4.svg
and .png, and prints their difference.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sinssim.charts import Axis, Chart, Charts, Line, Rule
from sinssim.data import Array
from sinssim.recording.figures import figure_of, save
from sinssim.strapdown import one_component_system
from sinssim.strapdown.one_component_system import accelerometer_error, gyro_error
from sinssim.units import ARCMIN, DEG_H, UG, fixed

ACCELEROMETER_BIAS = 100.0 * UG
"""Accelerometer error of figure 8.4 a [m/s²]."""

GYRO_DRIFT = 0.01 * DEG_H
"""Gyro error of figure 8.4 b, nose-down positive [rad/s]."""

_DURATION = 8000.0  # s, the figure's time axis
_INTERVAL = 1.0  # s; the Runge-Kutta step leaves 1e-13 of the amplitude
_TIME = Axis(label="time", units=fixed("s"), low=0.0, high=_DURATION)


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


def figure_8_4() -> Charts:
    """Return figure 8.4 a and b: the simulation over the closed forms (8.13) and (8.15)."""
    time, by_accelerometer, by_gyro = error_runs()
    rate = one_component_system.schuler_rate()
    components = (
        Line(label="Δω₀t", x=time, y=GYRO_DRIFT * time, color="soft", dash="-."),
        Line(label="−Δω₀ sin ωₛt / ωₛ", x=time, y=-GYRO_DRIFT * np.sin(rate * time) / rate, color="soft", dash=":"),
    )
    period = 2.0 * np.pi / rate
    mark = Rule(at=period, upright=True, text=f"Tₛ = {period / 60.0:.1f} min", dash="--")

    def chart(key: str, title: str, formula: str, closed: Array, simulated: Array, *more: Line) -> Chart:
        wide = Line(label=formula, x=time, y=closed, color="poisson", weight="wide")
        over = Line(label="simulation", x=time, y=simulated, color="measured-attitude")
        high = 1.4 * float(simulated.max())  # room for the legend
        low = 1.3 * min((float(line.y.min()) for line in more), default=0.0)
        y = Axis(label="error Δy of the coordinate", units=fixed("arcmin", ARCMIN), low=low, high=high)
        return Chart(key=key, title=f"{key}   {title}", x=_TIME, y=y, marks=(mark, wide, over, *more))

    a = chart("a", "accelerometer error, 100 µg", "Δy = (Δa/g)(1 − cos ωₛt)   (8.13)",
              accelerometer_error(time, ACCELEROMETER_BIAS), by_accelerometer)  # fmt: skip
    b = chart("b", "gyro error, 0.01 °/h", "Δy = Δω₀(t − sin ωₛt / ωₛ)   (8.15)",
              gyro_error(time, GYRO_DRIFT), by_gyro, *components)  # fmt: skip
    note = "An arcminute of the coordinate is about a nautical mile."
    return Charts("figure_8_4", ((a,), (b,)), (7.0, 7.0), note=note, share="x")


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
    figure, files = figure_of(figure_8_4()), [folder / f"figure_8_4.{suffix}" for suffix in ("svg", "png")]
    for file in files:
        save(figure, file)
    print("Figures:", *files)


if __name__ == "__main__":
    main()
