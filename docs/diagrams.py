"""Draws the diagrams of the documents: `python docs/diagrams.py` writes docs/images/NAME.svg."""

from __future__ import annotations

import argparse
from pathlib import Path

from sinssim.recording.diagrams import ATTITUDE, DIAGRAMS, POSITION, SENSOR, VELOCITY
from sinssim.recording.style import INK, SOFT
from sinssim.recording.svg import Drawing

FOLDER = Path(__file__).with_name("images")


def floors() -> str:
    """Draw the floors of the package: who may import whom, and the three ways of docs/architecture.md."""
    rows = (
        ("cli", "commands, screens", INK),
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
        ("statistics", "circles, requirements, random numbers", SOFT),
        ("earth", "ellipsoids, gravity, coordinates", SOFT),
        ("rotation", "quaternions, matrices, angles", SOFT),
        ("system", "files, processes; with errors, units, data, tables, kernels", SOFT),
    )
    step, top = 34.0, 22.0
    d = Drawing(680.0, step * len(rows) + 10.0, "floors of the package")
    for number, (name, what, color) in enumerate(rows):
        y = top + step * number
        d.box(95.0, y, 140.0, [name], color)
        d.text(175.0, y, what, anchor="start")
    d.line([(605.0, top), (605.0, top + step * (len(rows) - 1))], "", "imports")
    return d.svg()


def main() -> None:
    """Draw all diagrams, on white paper."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=FOLDER, help="folder to write")
    options = parser.parse_args()
    for name, draw in {**DIAGRAMS, "floors": floors}.items():
        drawing = draw().replace(">", '><rect width="100%" height="100%" fill="#fff"/>', 1)
        (options.out / f"{name}.svg").write_text(drawing + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
