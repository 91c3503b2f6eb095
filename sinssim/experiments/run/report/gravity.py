"""The part of a run's report about the true gravity field along the motion."""

from __future__ import annotations

from collections.abc import Iterator

from sinssim.recording import style
from sinssim.recording.report import plot
from sinssim.recording.report.plot import Line
from sinssim.truth.gravity.disturbed import Disturbed
from sinssim.truth.gravity.values import gravity_values
from sinssim.truth.trajectory import Trajectory
from sinssim.units import ARCSEC, MGAL


def gravity_plots(trajectory: Trajectory) -> Iterator[str]:
    """Yield deflections and disturbance of gravity over time, of a motion in the true field.

    Args:
        trajectory: the true motion.

    Yields:
        HTML; nothing for a motion in normal gravity.
    """
    if not isinstance(trajectory, Disturbed):
        return
    v = gravity_values(trajectory)
    orange, green, blue = map(style.css, style.colors(("x", "y", "z")))
    span = (float(v.time[0]), float(v.time[-1]))
    deflections = [Line("ξ, north", v.time, v.xi / ARCSEC, orange), Line("η, east", v.time, v.eta / ARCSEC, green)]
    down = [Line("gravity disturbance, down", v.time, v.disturbance / MGAL, blue)]
    yield '<div class="pair">'
    yield plot.plot("Deflection of the vertical", "arcsec", deflections, span, least=1e-3)
    yield plot.plot("Gravity beyond normal gravity", "mGal", down, span, least=1e-3)
    yield "</div>"
