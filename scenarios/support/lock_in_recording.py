"""The Rerun recording of the lock-in study: responses over a stepped rate, and the growth of the angle's error."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from sinssim.data import Array
from sinssim.recording.rerun.rrd import Recording
from sinssim.units import ARCSEC, DEG

_KINDS = {"both": "all random", "one": "every other one random", "none": "none random"}


def record_lock_in_study(
    path: Path, *, swept: dict[str, Array], left: dict[str, Array], grown: dict[str, Array], summary: str
) -> None:
    """Write the recording.

    Args:
        path: the file, by convention `recording.rrd`.
        swept: "rate", and the rates measured there "undithered" and "dithered", (m,) rad/s.
        left: "rate", and the measured rates by kind of random turning points, (n,) rad/s.
        grown: "time", (k,) s, and root mean squares of the angle's error by kind, (k,) rad.
        summary: the result tables, Markdown.
    """

    def whole(time: Array) -> rrb.TimeAxis:
        # by default a plot shows ±30 s around the cursor
        start, end = (rrb.TimeRangeBoundary.absolute(seconds=float(t)) for t in (time[0], time[-1]))
        return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))

    beside = path.with_name(path.name + ".part")
    with Recording(beside, "sinssim_lock_in_study", rrb.Blueprint(collapse_panels=True)) as recording:
        steps = np.arange(len(swept["rate"]), dtype=np.float64)
        rates = np.column_stack([swept[name] for name in ("rate", "undithered", "dithered")])
        recording.series("lock_in/response", steps, rates / DEG, ["true", "without dither", "random dither"])
        near = np.arange(len(left["rate"]), dtype=np.float64)
        rates = np.column_stack([left[name] for name in ("rate", *_KINDS)])
        recording.series("lock_in/dead_zones", near, rates / ARCSEC, ["true", *_KINDS.values()])
        errors = np.column_stack([grown[kind] for kind in _KINDS])
        recording.series("lock_in/growth", grown["time"], errors / ARCSEC, list(_KINDS.values()))
        recording.document("lock_in/summary", summary)
        recording.blueprint(
            rrb.Blueprint(
                rrb.Tabs(
                    rrb.TextDocumentView(origin="lock_in/summary", name="Summary"),
                    rrb.Vertical(
                        rrb.TimeSeriesView(
                            origin="lock_in/response",
                            name="Measured rate while the true rate is stepped (one step per second), deg/s",
                            axis_x=whole(steps),
                        ),
                        rrb.TimeSeriesView(
                            origin="lock_in/dead_zones",
                            name="The same near zero, by random turning points, arcsec/s",
                            axis_x=whole(near),
                        ),
                        name="Response",
                    ),
                    rrb.TimeSeriesView(
                        origin="lock_in/growth",
                        name="Angle error, rms over seeds, by random turning points, arcsec",
                        axis_x=whole(grown["time"]),
                    ),
                ),
                collapse_panels=True,
            )
        )
    os.replace(beside, path)
