"""The section of a run's report on a block that turns in the vehicle: its errors beside those of a block at rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sinssim.data import Array
from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line
from sinssim.recording.scales import ANGLES, LENGTHS, suiting
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.simulation.result import Run

_CYCLES_SHOWN = 1200.0
"""Length of the beginning of the run for which the angles are drawn, s."""


def turning_section(run: Run) -> Iterator[str]:
    """Yield the section's HTML; nothing for a block that does not turn.

    Args:
        run: the run, with its errors.
    """
    encoders, without = run.encoders, run.without_rotation
    if encoders is None or not run.errors:
        return
    time = run.time[run.time <= run.time[0] + _CYCLES_SHOWN]
    turned = np.degrees(encoders.turns.angles(time))
    colors = [style.css(style.COLORS[key]) for key in ("aided", "refused")]
    angles = [Line("outer axis", time, turned[:, 0], colors[0], 2.0)]
    if turned[:, 1].any():
        angles.append(Line("inner axis", time, turned[:, 1], colors[1], 1.5))
    span = (float(time[0]), float(time[-1]))
    yield f"<div>{plot.plot('Angles of the block', '°', angles, span)}</div>"
    if without is None:
        return
    name, own = next(iter(run.errors.items()))
    whole = (float(run.time[0]), float(run.time[-1]))

    def both(title: str, unit: str, size: float, values: Sequence[Array]) -> str:
        lines = [
            Line("block at rest", without.time, values[0], colors[1], 2.5, size=size),
            Line("turning block", own.time, values[1], colors[0], 1.5, size=size),
        ]
        return f"<div>{plot.plot(title, unit, lines, whole)}</div>"

    yield f"<h3>Turning and at rest: {words(name)}</h3>"
    unit, size = suiting(LENGTHS, without.horizontal, own.horizontal)
    left = both("Horizontal error", unit, size, (without.horizontal, own.horizontal))
    unit, size = suiting(ANGLES, without.angle, own.angle)
    yield f'<div class="pair">{left}{both("Attitude error", unit, size, (without.angle, own.angle))}</div>'
    rows = []
    for label, error in (("block at rest", without), ("turning block", own)):
        attitude = np.abs(error.attitude[-1]) / (DEG / 60.0)
        rows.append((label, f"{error.horizontal.max():.4g}", f"{error.horizontal[-1]:.4g}", f"{attitude.max():.3g}"))
    heads = ("", "largest horizontal error [m]", "at the end [m]", "largest attitude error at the end [arcmin]")
    yield table(heads, rows)
    yield (
        '<p class="note">The same vehicle and the same errors of the same sensors, once in a block that turns and once '
        "in a block at rest. The attitude of the turning block is turned back by the angles of its encoders, whose "
        "errors it contains.</p>"
    )
