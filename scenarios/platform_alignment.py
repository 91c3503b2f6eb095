"""Alignment of a gimballed platform beside that of a strapdown system with the same sensors, at rest at 50° north.

Run it from anywhere:  python scenarios/platform_alignment.py [-o DIR] [--grade GRADE]

The platform is levelled to 1′ and its azimuth known to 2° at the start; its loops of several time constants τ align it
(`sinssim.strapdown.platform_theory`). The strapdown system averages its readings (eq. (1) of the ground SINS paper,
`sinssim.alignment`). Biases and noise are those of the grade. The final azimuth error of both is that of the level
gyro, d_E/(U cos φ); the times until σ is 1.5 and 1.1 times as large are printed. It writes platform_alignment.svg, .png
and .csv.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from sinssim.alignment.alignment_budget import error_budget, expected_errors, total
from sinssim.alignment.parked_theory import Attitude
from sinssim.charts import Axis, Chart, Charts, Line, Mark, Rule
from sinssim.data import Array
from sinssim.earth import OMEGA_IE
from sinssim.recording.figures import figure_of, save
from sinssim.sensors.imu.grades import GRADES
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.platform_theory import AlignmentLoops
from sinssim.units import ARCMIN, DEG, fixed

LATITUDE = 50.0 * DEG
TIME_CONSTANTS = (30.0, 60.0, 120.0, 240.0)
SOURCES = ("gyro bias", "accelerometer bias", "angle random walk", "velocity random walk")


def curves(grade: str, time: Array) -> tuple[dict[str, Array], float]:
    """Return σ of tilt about north, tilt about east and azimuth by system, (N, 3) rad, and d_E/(U cos φ), rad."""
    sigma = expected_errors(Imu(grade=grade)).sigma
    bias = float(sigma.accel.bias.max()), float(sigma.gyro.bias.max())
    white = float(np.max(sigma.accel.random_walk)), float(np.max(sigma.gyro.random_walk))
    found = {}
    for tau in TIME_CONSTANTS:
        loops = AlignmentLoops(LATITUDE, tau, 2.0 / tau)
        found[f"platform, τ = {tau:g} s"] = loops.sigmas(time, ARCMIN, 2.0 * DEG, bias, white)
    angles = total(error_budget(Attitude(0.0, 0.0, 0.0), LATITUDE, sigma, time[1:]), SOURCES)
    strapdown = np.stack([angles.roll, angles.pitch, angles.heading], axis=1)  # it faces north
    found["strapdown"] = np.vstack([np.full(3, np.nan), strapdown])
    return found, bias[1] / (OMEGA_IE * math.cos(LATITUDE))


def until(time: Array, sigma: Array, limit: float) -> float | None:
    """Return the time from which σ stays within a limit, s; None if it does not."""
    beyond = np.flatnonzero(~(sigma <= limit))
    if len(beyond) and beyond[-1] == len(time) - 1:
        return None
    return float(time[beyond[-1] + 1]) if len(beyond) else 0.0


def charts(time: Array, found: dict[str, Array], final: float, grade: str) -> Charts:
    """Return azimuth and tilt over time."""
    rows = []
    for name, column in (("azimuth", 2), ("tilt about east", 1)):
        angle = Axis(label=f"{name}, 1σ", units=fixed("arcmin", ARCMIN), log=True)
        marks: list[Mark] = [
            Line(label=label, x=time[1:], y=sigma[1:, column], weight="bold" if label == "strapdown" else "line")
            for label, sigma in found.items()
        ]
        marks += [Rule(at=final, label="d_E/(U cos φ)", dash="--")] if name == "azimuth" else []
        seconds = Axis(label="time", units=fixed("s"), log=True)
        rows.append((Chart(key=name, x=seconds, y=angle, marks=tuple(marks)),))
    return Charts(
        "platform_alignment", tuple(rows), (8.0, 6.5), f"Alignment at rest, {grade}", legend="below", share="x"
    )


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=Path("runs/platform_alignment"), help="folder to write")
    parser.add_argument("--grade", default="laser-standard", choices=list(GRADES), help="grade of the sensors")
    options = parser.parse_args()
    time = np.arange(0.0, 3601.0, 1.0)
    found, final = curves(options.grade, time)
    if final == 0.0:
        parser.error(f"{options.grade} has no gyro bias, so that there is no final error to align to.")
    rows = []
    for name, sigma in found.items():
        times = [until(time, sigma[:, 2], factor * final) for factor in (1.5, 1.1)]
        rows.append([name, *times, *(sigma[-1] / ARCMIN)])
    heads = ["system", "to 1.5 d/(U cos φ), s", "to 1.1, s", "tilt north, ′", "tilt east, ′", "azimuth, ′"]
    table = Table(
        title=f"Alignment, {options.grade}, final azimuth error d/(U cos φ) = {final / ARCMIN:.3g}′; σ after an hour",
        title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
    for i, head in enumerate(heads):
        table.add_column(head, justify="left" if i == 0 else "right", no_wrap=True)
    for name, *values in rows:
        table.add_row(name, *("not in an hour" if v is None else f"{v:.4g}" for v in values))
    console = Console(width=120)
    options.out.mkdir(parents=True, exist_ok=True)
    console.print(table)
    for suffix in ("svg", "png"):
        save(figure_of(charts(time, found, final, options.grade)), options.out / f"platform_alignment.{suffix}")
    with (options.out / "platform_alignment.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            [
                "time_s",
                *(f"{name} {angle} [arcmin]" for name in found for angle in ("tilt north", "tilt east", "azimuth")),
            ]
        )
        writer.writerows(np.column_stack([time, *(sigma / ARCMIN for sigma in found.values())]).tolist())
    console.print(f"Figure and curves (CSV) are in {options.out}.", soft_wrap=True)


if __name__ == "__main__":
    main()
