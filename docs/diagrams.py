"""Draws the diagrams of the documents: `python docs/diagrams.py` writes docs/images/NAME.svg."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sinssim.recording import style
from sinssim.recording.diagrams import ATTITUDE, DIAGRAMS, POSITION, SENSOR, VELOCITY, Canvas
from sinssim.recording.figures import save, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).with_name("images")


@styled
def floors() -> Figure:
    """Draw the floors of the package: who may import whom, and the three ways of docs/architecture.md."""
    rows = (
        ("cli", "commands, screens", style.INK),
        ("experiments", "runs, ensembles, comparisons, trade studies", POSITION),
        ("analyses", "covariance budget, calibration, noise, inspection", POSITION),
        ("simulation", "stages of a run: truth, sensed, navigated, aided", POSITION),
        ("recording", "the media: tables, pages, figures, Rerun, files", POSITION),
        ("scenario", "reads, checks, builds: below it, nobody knows a scenario", ATTITUDE),
        ("estimation", "error model, Kalman filter, smoother", VELOCITY),
        ("alignment", "attitude and latitude at rest, and their theory", VELOCITY),
        ("logs", "files of recorded sensors and solutions", VELOCITY),
        ("strapdown", "navigation on increments", VELOCITY),
        ("sensors", "inertial and aiding sensors, their errors", SENSOR),
        ("truth", "the motion of the vehicle and of its sensors", SENSOR),
        ("statistics", "circles, requirements, random numbers", style.SOFT),
        ("earth", "ellipsoids, gravity, coordinates", style.SOFT),
        ("rotation", "quaternions, matrices, angles", style.SOFT),
        ("system", "files, processes; with errors, units, data, tables, kernels", style.SOFT),
    )
    step, left, right = 0.34, 1.75, 5.6
    c = Canvas(6.6, step * len(rows) + 0.35)
    for number, (name, what, color) in enumerate(reversed(rows)):
        y = 0.3 + step * number
        c.box(0.95, y, 1.4, 0.27, name, color)
        c.text(left, y, what, ha="left")
    top, bottom = 0.3 + step * (len(rows) - 1), 0.3
    c.path((right + 0.45, top), (right + 0.45, bottom), color=style.SOFT)
    c.text(right + 0.7, 0.5 * (top + bottom), "imports", style.SOFT, rotation=90)
    return c.figure


def main() -> None:
    """Draw all diagrams."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=FOLDER, help="folder to write")
    parser.add_argument("--format", default="svg", choices=("svg", "png", "pdf"))
    options = parser.parse_args()
    for name, draw in {**DIAGRAMS, "floors": floors}.items():
        save(draw(), options.out / f"{name}.{options.format}")


if __name__ == "__main__":
    main()
