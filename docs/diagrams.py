"""Draws the block diagrams and axes of docs/questions.md: `python docs/diagrams.py` writes docs/images/NAME.svg."""

from __future__ import annotations

import argparse
from pathlib import Path

from sinssim.recording.figures.canvas import save
from sinssim.recording.figures.diagrams import DIAGRAMS

FOLDER = Path(__file__).with_name("images")


def main() -> None:
    """Draw all diagrams."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=Path, default=FOLDER, help="folder to write")
    parser.add_argument("--format", default="svg", choices=("svg", "png", "pdf"))
    options = parser.parse_args()
    for name, draw in DIAGRAMS.items():
        save(draw(), options.out / f"{name}.{options.format}")


if __name__ == "__main__":
    main()
