"""The section of a run's report on an IMU that rotates in the vehicle: its errors with and without the rotation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.formatting import number_text
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line
from sinssim.scales import ANGLES, LENGTHS, suiting

if TYPE_CHECKING:
    from sinssim.experiments.run.parts.rotation import Rotation

_CYCLES_SHOWN = 1200.0
"""Length of the beginning of the run for which the angles are drawn, s."""


def turning_section(part: Rotation) -> Iterator[str]:
    """Yield the section's HTML; nothing for a run without errors.

    Args:
        part: the rotation of a run's IMU.
    """
    run, encoders, without = part.run, part.encoders, part.without_rotation
    if not run.errors:
        return
    time = run.time[run.time <= run.time[0] + _CYCLES_SHOWN]
    turned = np.degrees(encoders.turns.angles(time))
    colors = [style.css(style.COLORS[key]) for key in ("aided", "refused")]
    angles = [Line("outer axis", time, turned[:, 0], colors[0], 2.0)]
    if turned[:, 1].any():
        angles.append(Line("inner axis", time, turned[:, 1], colors[1], 1.5))
    span = (float(time[0]), float(time[-1]))
    yield f"<div>{plot.plot('Rotation angles of the IMU', '°', angles, span)}</div>"
    if without is None:
        return
    name, own = next(iter(run.errors.items()))
    whole = (float(run.time[0]), float(run.time[-1]))

    def both(title: str, unit: str, size: float, values: Sequence[Array]) -> str:
        lines = [
            Line("without rotation", without.time, values[0], colors[1], 2.5, size=size),
            Line("with rotation", own.time, values[1], colors[0], 1.5, size=size),
        ]
        return f"<div>{plot.plot(title, unit, lines, whole)}</div>"

    yield f"<h3>With and without rotation: {words(name)}</h3>"
    length, metre = suiting(LENGTHS, without.horizontal, own.horizontal)
    left = both("Horizontal error", length, metre, (without.horizontal, own.horizontal))
    angle, rad = suiting(ANGLES, without.angle, own.angle)
    yield f'<div class="pair">{left}{both("Attitude error", angle, rad, (without.angle, own.angle))}</div>'
    rows = []
    for label, error in (("without rotation", without), ("with rotation", own)):
        known = ((error.horizontal, metre), (error.angle, rad))
        found = [float(v) / one for values, one in known for v in (values.max(), values[-1])]
        rows.append((label, *(number_text(value, 4) for value in found)))
    titles = (("horizontal error", length), ("attitude error", angle))
    heads = [f"{title}, {when} [{unit}]" for title, unit in titles for when in ("largest", "at the end")]
    yield table(("", *heads), rows)
    yield (
        '<p class="note">Both solutions have the same vehicle motion and the same sensor errors. The attitude of the '
        "vehicle is that of the rotating IMU minus the measured rotation, so it contains the errors of the encoders."
        "</p>"
    )
