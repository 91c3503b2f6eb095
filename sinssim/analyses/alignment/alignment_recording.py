"""The Rerun recording of one alignment: angles over the session, departures of the sensors, error budget."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.alignment.axes import Angles, Attitude
from sinssim.alignment.budget import MOTION, error_budget, total
from sinssim.alignment.determination import solve
from sinssim.analyses.alignment.alignment_table import show
from sinssim.analyses.alignment.report import AlignmentResult
from sinssim.data import Array
from sinssim.recording.rerun.rrd import Recording, time_plot, whole_recording
from sinssim.recording.tables.plain_text import plain_text
from sinssim.units import ARCMIN, ARCSEC, DEG

_INSTANTS = 1000  # of a session at which the angles so far are shown
_AXES = ("forward", "right", "down")


def record_alignment(path: Path, report: AlignmentResult) -> None:
    """Write the recording of an alignment.

    Args:
        path: the file, by convention with the suffix .rrd.
        report: the alignment.

    Raises:
        RunError: the file cannot be written.
    """
    with whole_recording(path, "sinssim_alignment") as recording:
        plots = [*_record_angles(recording, report), *_record_departures(recording, report)]
        tabs = [rrb.Grid(*plots, name="Session"), rrb.TextDocumentView(origin="session/summary", name="Summary")]
        if report.budget is not None:
            tabs.append(rrb.Grid(*_record_budget(recording, report.budget), name="Error budget"))
        recording.document("session/summary", f"```\n{plain_text(partial(show, report))}```\n{_sources(report)}")
        recording.blueprint(rrb.Blueprint(rrb.Tabs(*tabs), collapse_panels=True))


def _record_angles(recording: Recording, report: AlignmentResult) -> list[rrb.View]:
    """Record the result of eq. (1) up to each instant of the session with its ±σ; a swaying base has none."""
    if report.method != "quiet":
        return []
    imu = report.imu
    ends = np.unique(np.linspace(max(1, len(imu) // 100), len(imu), _INSTANTS).astype(int))
    elapsed = imu.time[ends] - imu.time[0]
    means = [np.cumsum(x, axis=0)[ends - 1] / elapsed[:, None] for x in (imu.dtheta, imu.dvel)]
    so_far, _, _ = solve(*means)
    budget = None
    if report.sigma is not None and report.budget is not None:
        last = Angles(*(angle[-1] for angle in so_far))  # only the length changes
        gravity = report.determination.gravity
        rate_hz, start = len(imu) / report.duration, report.warmed
        budget = total(
            error_budget(
                Attitude(*last[:3]), last.latitude, report.sigma, elapsed, gravity=gravity, start=start, rate_hz=rate_hz
            )
        )
    plots: list[rrb.View] = []
    for k, name in enumerate(Angles._fields):
        final = so_far[k][-1]
        if np.isfinite(determined := getattr(report.determination, name)):  # in the range of the scenario's headings
            final = determined + (final - determined + np.pi) % (2.0 * np.pi) - np.pi
        angle = final + (so_far[k] - final + np.pi) % (2.0 * np.pi) - np.pi  # no jump from 360° to 0°
        lines = {"so far": angle}
        if budget is not None:
            # the effect of motion is known for the whole session; the same is assumed for a part of it
            moved = float(report.budget[MOTION][k]) if report.budget is not None else 0.0
            sigma = np.hypot(np.broadcast_to(budget[k], angle.shape), moved)
            lines |= {"so far + σ": angle + sigma, "so far − σ": angle - sigma}
        if report.truth is not None:
            true = float(report.truth[k])
            lines["true"] = np.full_like(angle, true + 2.0 * np.pi * np.round((final - true) / (2.0 * np.pi)))
        entity = f"session/angles/{name}"
        recording.series(entity, imu.time[ends], np.column_stack(list(lines.values())) / DEG, list(lines))
        plots.append(time_plot(entity, f"{name} from the session so far [deg]", imu.time))
    return plots


def _record_departures(recording: Recording, report: AlignmentResult) -> list[rrb.View]:
    """Record the departure of the block from rest: its accumulated angle and velocity."""
    imu = report.imu
    share = ((imu.time - imu.time[0]) / report.duration)[:, None]

    def departure(increments: Array) -> Array:
        accumulated = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
        return np.asarray(accumulated - share * accumulated[-1])

    recording.series("session/turn", imu.time, departure(imu.dtheta) / ARCSEC, _AXES)
    velocity = departure(imu.dvel) if report.residual_velocity is None else report.residual_velocity
    recording.series("session/velocity", imu.time, velocity * 1e3, _AXES)
    what = "from a linear trend" if report.residual_velocity is None else "from gravity's cone in inertial space"
    return [
        time_plot("session/turn", "departure of the gyros' angle from a linear trend [arcsec]", imu.time),
        time_plot("session/velocity", f"departure of the accelerometers' velocity {what} [mm/s]", imu.time),
    ]


def _record_budget(recording: Recording, budget: dict[str, Angles]) -> list[rrb.View]:
    bars: list[rrb.View] = []
    for name in Angles._fields:
        entity = f"session/budget/{name}"
        values = [float(getattr(budget[source], name)) / ARCMIN for source in budget]
        recording.static(entity, rr.BarChart(values))
        bars.append(rrb.BarChartView(origin=entity, name=f"σ of the {name} by source [arcmin]"))
    return bars


def _sources(report: AlignmentResult) -> str:
    if report.budget is None:
        return ""
    lines = "\n".join(f"{k}. {source}" for k, source in enumerate(report.budget))
    return f"\n## Bars of the error budget\n\n{lines}\n"
