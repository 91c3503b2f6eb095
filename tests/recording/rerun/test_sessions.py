"""Noise records in the viewer, from samples that are written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sinssim.analyses.noise_identification import noise_recording as noise
from tests.recording.spies import Drawn

ARCSEC = np.pi / 648_000.0
STEPS = np.array([[1.0, -2.0, 4.0], [2.0, 6.0, -8.0], [7.0, 1.0, 14.0]])
"""Sums 1, 3, 10; −2, 4, 5; 4, −4, 10. A linear trend has 0.2, 0.6 and 1 of the last."""
DEPARTURES = np.array([[0.0] * 3, [-1.0, -3.0, 2.0], [-3.0, 1.0, -10.0], [0.0] * 3])


def test_a_record_of_noise() -> None:
    """Rates of the intervals minus their mean; sums minus a linear trend; a quantity without a triad by number."""
    time = np.array([50.0, 52.0, 56.0, 60.0])
    channels = [
        SimpleNamespace(channel=SimpleNamespace(triad="gyro", axis=axis, name=f"g{axis}")) for axis in (0, 2)
    ]  # fmt: skip
    other = SimpleNamespace(triad=None, name="a <b>", units=SimpleNamespace(rate=("V", 1.0)))
    samples = SimpleNamespace(
        time=time, triads={"gyro": STEPS * ARCSEC, "accel": STEPS}, kind="increments",
        quantities={"a <b>": np.array([3.0, 9.0, 12.0])},
    )  # fmt: skip
    found: Any = SimpleNamespace(samples=samples, channels=(*channels, SimpleNamespace(channel=other)))
    drawn: Any = Drawn()
    views = list(noise._record_streams(drawn, found))
    rates = np.array([[0.5, 2.0], [0.5, -2.0], [1.75, 3.5]])
    drawn.shows("noise/gyro/rate", ["x", "z"], time[1:], rates - rates.mean(axis=0))
    drawn.shows("noise/gyro/sum", ["x", "z"], time, DEPARTURES[:, [0, 2]])
    drawn.shows("noise/quantity_1", ["a <b>"], time[1:], [[-5.0], [1.0], [4.0]])
    assert "noise/accel/rate" not in drawn.lines
    assert [view.name for view in views] == [
        "angular rate minus its mean, mean over 3.33 s [deg/h]", "angle minus a linear trend [arcsec]",
        "a <b> minus its mean, mean over 3.33 s [V]",
    ]  # fmt: skip
    samples.kind = "rates"  # times their intervals of 2, 4 and 4 s
    sums = noise._accumulated(found, "gyro", [0, 2]) / ARCSEC
    np.testing.assert_allclose(sums, [[0.0, 0.0], [2.0, 8.0], [10.0, -24.0], [38.0, 32.0]])
