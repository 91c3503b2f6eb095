"""The Rerun recording of a log's noise: what the sensors gave, their Allan deviations, the noise terms."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.data import Array
from sinssim.errors import RunError
from sinssim.recording.noise_figure import noise_figure
from sinssim.recording.rrd import Recording
from sinssim.sensors.channels import AXES
from sinssim.sensors.log import TriadName
from sinssim.sensors.noise_report import NoiseReport
from sinssim.sensors.noise_table import show
from sinssim.sensors.noise_units import RATE_UNIT
from sinssim.units import ARCSEC

_WINDOWS = 8192
_SUM_UNIT: dict[TriadName, tuple[str, float]] = {"gyro": ("arcsec", ARCSEC), "accel": ("mm/s", 1e-3)}
_WORDS: dict[TriadName, str] = {"gyro": "angular rate", "accel": "specific force"}
_SUM_WORDS: dict[TriadName, str] = {"gyro": "angle", "accel": "velocity"}


def record_noise(path: Path, report: NoiseReport) -> None:
    """Write the recording of a log's noise.

    Args:
        path: the file, by convention with the suffix .rrd.
        report: what was found.

    Raises:
        RunError: the file cannot be written.
    """
    beside = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with Recording(beside, "sinssim_noise") as recording:
            plots = list(_record_streams(recording, report))
            recording.static("noise/allan", rr.EncodedImage(contents=_picture(report), media_type="image/png"))
            recording.document("noise/summary", f"```\n{_text(report)}```\n")
            tabs = rrb.Tabs(
                rrb.Spatial2DView(origin="noise/allan", name="Allan deviation"),
                rrb.TextDocumentView(origin="noise/summary", name="Noise terms"),
                rrb.Grid(*plots, name="Streams"),
            )
            recording.blueprint(rrb.Blueprint(tabs, collapse_panels=True))
        os.replace(beside, path)
    except (OSError, RuntimeError) as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise RunError(f"the recording {path} cannot be written: {error}.") from error


def _record_streams(recording: Recording, report: NoiseReport) -> Iterator[rrb.View]:
    """Record mean rates over windows, and how the accumulated angle or velocity departs from a steady rise."""
    time = report.samples.time
    edges = np.unique(np.linspace(0, len(time) - 1, min(len(time), _WINDOWS + 1)).round().astype(np.intp))
    window = float((time[-1] - time[0]) / (len(edges) - 1))
    for triad in report.samples.triads:
        axes = [channel.axis for channel in report.channels if channel.triad == triad]
        if not axes:
            continue
        names = [AXES[axis] for axis in axes]
        sums = _accumulated(report, triad, axes)[edges]
        rates = np.diff(sums, axis=0) / np.diff(time[edges])[:, None]
        unit, size = RATE_UNIT[triad]
        recording.series(f"noise/{triad}/rate", time[edges[1:]], (rates - rates.mean(axis=0)) / size, names)
        yield _plot(f"noise/{triad}/rate", f"{_WORDS[triad]} less its mean, mean over {window:.3g} s [{unit}]", time)
        share = ((time[edges] - time[0]) / (time[-1] - time[0]))[:, None]
        unit, size = _SUM_UNIT[triad]
        recording.series(f"noise/{triad}/sum", time[edges], (sums - share * sums[-1]) / size, names)
        yield _plot(f"noise/{triad}/sum", f"{_SUM_WORDS[triad]} less a steady rise [{unit}]", time)


def _accumulated(report: NoiseReport, triad: TriadName, axes: list[int]) -> Array:
    """Return the accumulated angle or velocity of some axes at the edges of the intervals, (N+1, k)."""
    samples = report.samples
    values = samples.triads[triad][:, axes]
    increments = values if samples.kind == "increments" else values * np.diff(samples.time)[:, None]
    return np.concatenate([np.zeros((1, len(axes))), np.cumsum(increments, axis=0)])


def _plot(entity: str, name: str, time: Array) -> rrb.View:
    start, end = (rrb.TimeRangeBoundary.absolute(seconds=float(time[k])) for k in (0, -1))
    return rrb.TimeSeriesView(
        origin=entity, name=name, axis_x=rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    )


def _picture(report: NoiseReport) -> bytes:
    picture = io.BytesIO()
    noise_figure(report).savefig(picture, format="png", dpi=150)
    return picture.getvalue()


def _text(report: NoiseReport) -> str:
    from rich.console import Console

    text = io.StringIO()
    show(report, Console(file=text, width=120, highlight=False))
    return text.getvalue()
