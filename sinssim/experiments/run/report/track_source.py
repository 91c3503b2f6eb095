"""The part of a run's report about a recorded or planned track: the source of the curve, and the quality of the fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.page import table, words
from sinssim.recording.report.plot import Line
from sinssim.truth.track.fit import ANGLE, HORIZONTAL, VERTICAL, fit_lines
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.truth.trajectory import Trajectory


def track_source(scenario: Scenario, trajectory: Trajectory) -> Iterator[str]:
    """Yield the part about the track of a scenario.

    Args:
        scenario: the scenario; one without [track] has no such part.
        trajectory: the true motion, with the distances from the samples among its channels.

    Yields:
        HTML.
    """
    if scenario.track is None:
        return
    fit = scenario.track.prepared(scenario.truth).fit
    planned = bool(scenario.track.waypoints)
    title = "planned route" if planned else "recorded track"
    yield f"<h3>The {title}</h3>"
    yield from (f'<p class="broken">{words(sentence)}</p>' for sentence in fit.warnings)
    facts = [("made from", scenario.track.what), ("vehicle", scenario.track.vehicle), *fit_lines(fit)]
    yield table((title, ""), [(words(name), f'<td class="text">{words(text)}</td>') for name, text in facts])
    yield from (f'<p class="note">{words(sentence)}</p>' for sentence in fit.notes)
    channels = trajectory.channels
    if planned or HORIZONTAL not in channels:
        return
    orange, green, blue = map(style.css, style.colors(("x", "y", "z")))
    span = (trajectory.start, trajectory.end)
    lines = [
        Line("horizontal", channels[HORIZONTAL].time, channels[HORIZONTAL].values, green),
        Line("vertical, up", channels[VERTICAL].time, channels[VERTICAL].values, blue),
    ]
    yield '<div class="pair">'
    yield plot.plot("Distance of the curve from the samples", "m", lines, span, least=1e-3)
    if ANGLE in channels:
        angle = Line("angle", channels[ANGLE].time, channels[ANGLE].values / DEG, orange)
        yield plot.plot("Angle from the recorded attitude", "deg", [angle], span, least=1e-4)
    yield "</div>"
