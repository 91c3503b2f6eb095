"""The Rerun recording of a log's noise: its samples, their Allan deviations, the noise terms."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.analyses.noise_identification.channels import AXES
from sinssim.analyses.noise_identification.noise_figure import noise_figure
from sinssim.analyses.noise_identification.noise_table import show
from sinssim.analyses.noise_identification.report import NoiseReport
from sinssim.analyses.noise_identification.units import UNITS
from sinssim.data import Array
from sinssim.logs.text.samples import TriadName
from sinssim.recording.figures.canvas import to_png
from sinssim.recording.rerun.rrd import Recording, time_plot, whole_recording
from sinssim.recording.tables.plain_text import plain_text
from sinssim.units import ARCSEC

_WINDOWS = 8192
_SUM_UNIT: dict[TriadName, tuple[str, float]] = {"gyro": ("arcsec", ARCSEC), "accel": ("mm/s", 1e-3)}
_WORDS: dict[TriadName, str] = {"gyro": "angular rate", "accel": "specific force"}
_SUM_WORDS: dict[TriadName, str] = {"gyro": "angle", "accel": "velocity"}


def record_noise(path: Path, report: NoiseReport) -> None:
    """Write the recording of a log's noise.

    Args:
        path: the file, by convention with the suffix .rrd.
        report: the identified noise.

    Raises:
        RunError: the file cannot be written.
    """
    with whole_recording(path, "sinssim_noise") as recording:
        plots = list(_record_streams(recording, report))
        recording.static("noise/allan", rr.EncodedImage(contents=to_png(noise_figure(report)), media_type="image/png"))
        recording.document("noise/summary", f"```\n{plain_text(partial(show, report))}```\n")
        tabs = rrb.Tabs(
            rrb.Spatial2DView(origin="noise/allan", name="Allan deviation"),
            rrb.TextDocumentView(origin="noise/summary", name="Noise terms"),
            rrb.Grid(*plots, name="Streams"),
        )
        recording.blueprint(rrb.Blueprint(tabs, collapse_panels=True))


def _record_streams(recording: Recording, report: NoiseReport) -> Iterator[rrb.View]:
    """Record means over windows, and the departure of the accumulated angle or velocity from a linear trend."""
    time = report.samples.time
    edges = np.unique(np.linspace(0, len(time) - 1, min(len(time), _WINDOWS + 1)).round().astype(np.intp))
    window = float((time[-1] - time[0]) / (len(edges) - 1))
    for triad in report.samples.triads:
        axes = [one.channel.axis for one in report.channels if one.channel.triad == triad]
        if not axes:
            continue
        names = [AXES[axis] for axis in axes]
        sums = _accumulated(report, triad, axes)[edges]
        rates = np.diff(sums, axis=0) / np.diff(time[edges])[:, None]
        unit, size = UNITS[triad].rate
        recording.series(f"noise/{triad}/rate", time[edges[1:]], (rates - rates.mean(axis=0)) / size, names)
        yield time_plot(
            f"noise/{triad}/rate", f"{_WORDS[triad]} minus its mean, mean over {window:.3g} s [{unit}]", time
        )
        share = ((time[edges] - time[0]) / (time[-1] - time[0]))[:, None]
        unit, size = _SUM_UNIT[triad]
        recording.series(f"noise/{triad}/sum", time[edges], (sums - share * sums[-1]) / size, names)
        yield time_plot(f"noise/{triad}/sum", f"{_SUM_WORDS[triad]} minus a linear trend [{unit}]", time)
    others = [one.channel for one in report.channels if one.channel.triad is None]
    # entities are numbered, because the name of a column may be invalid as the name of an entity
    for k, channel in enumerate(others, start=1):
        values = report.samples.quantities[channel.name]
        means = np.add.reduceat(values, edges[:-1]) / np.diff(edges)
        entity, unit = f"noise/quantity_{k}", channel.units.rate[0]
        recording.series(entity, time[edges[1:]], (means - means.mean())[:, None], [channel.name])
        yield time_plot(entity, f"{channel.name} minus its mean, mean over {window:.3g} s [{unit}]", time)


def _accumulated(report: NoiseReport, triad: TriadName, axes: list[int]) -> Array:
    """Return the accumulated angle or velocity of some axes at the edges of the intervals, (N+1, k)."""
    samples = report.samples
    values = samples.triads[triad][:, axes]
    increments = values if samples.kind == "increments" else values * np.diff(samples.time)[:, None]
    return np.concatenate([np.zeros((1, len(axes))), np.cumsum(increments, axis=0)])
