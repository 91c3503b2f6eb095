"""What the noise of a log shows, from values that are written by hand: rows, deviations, samples."""

from __future__ import annotations

from math import pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses import noise_exhibits as shown
from sinssim.analyses.noise_fit import TermEstimate
from sinssim.analyses.noise_report import CHANNELS, ChannelNoise, LogChannel, units_of
from sinssim.charts import Band, Charts, Line
from sinssim.recording.console import show
from sinssim.recording.figures import figure_of
from tests.recording.by_hand import printed
from tests.recording.shown import marks_of, same

DEG, DEG_H, ARCSEC, UG = pi / 180.0, pi / 648_000.0, pi / 648_000.0, 9.80665e-6
NOTHING = SimpleNamespace(
    time=np.array([0.0, 1.0]), triads={}, kind="increments", quantities={"p_pa": np.array([1.0])},
)  # fmt: skip


class Fit(SimpleNamespace):
    """A fit that describes its record, whose sum is 2/τ and whose terms are 3 τ, in SI."""

    exchangeable, possible, aside, misfit = (), None, (), 0.0

    def allan_deviation(self, tau: np.ndarray, symbol: str | None = None) -> np.ndarray:
        return 2.0 * DEG_H / tau if symbol is None else 3.0 * DEG_H * tau


def channel(which: LogChannel, estimates: dict[str, TermEstimate], mean: float) -> ChannelNoise:
    """Return noise with the lowest upper end of the band at the second of three averaging times."""
    fit = Fit(estimates=estimates, likely={"Q": 0.0, "N": 1.0}, mean=mean, interval=0.04, correlation_time=123.456,
              correlation_band=(100.4, 150.6))  # fmt: skip
    size = which.units.rate[1]
    deviation = SimpleNamespace(deviation=np.array([5.0, 0.25, 0.2]) * size, tau=np.array([1.0, 30.0, 300.0]))
    return ChannelNoise(which, deviation, np.ones(3), np.zeros(3), np.array([6.0, 0.3, 0.4]) * size, fit, None)


def report(*channels: ChannelNoise, **more: Any) -> Any:
    found = {"source": "rest.csv", "duration": 3600.0, "count": 90_000, "interval": 0.04, "remarks": (),
             "samples": NOTHING, "channels": channels} | more  # fmt: skip
    return SimpleNamespace(**found)


def test_the_console() -> None:
    hour = 60.0  # √3600 s
    gyro = {
        "Q": TermEstimate(2.0 * DEG / 3600.0, 1.0 * DEG / 3600.0, 3.0 * DEG / 3600.0),
        "N": TermEstimate(0.12 * DEG / hour, 0.11 * DEG / hour, 0.13 * DEG / hour),
        "B": TermEstimate(0.5 * DEG_H, 0.4 * DEG_H, 0.6 * DEG_H),
        "K": TermEstimate(None, -0.3 * DEG_H / hour, 0.2 * DEG_H / hour),
        "R": TermEstimate(-0.7 * DEG_H / 3600.0, -0.8 * DEG_H / 3600.0, -0.6 * DEG_H / 3600.0),
        "sigma_b": TermEstimate(0.9 * DEG_H, 0.8 * DEG_H, 1.1 * DEG_H),
    }
    accel = {
        "N": TermEstimate(30.0 * UG, 20.0 * UG, 40.0 * UG),
        "Q": TermEstimate(5e-3, 4e-3, 6e-3),
        "sigma_b": TermEstimate(None, 0.0, 7.0 * UG),
    }
    found = report(
        channel(CHANNELS[1], gyro, -2.5 * DEG_H), channel(CHANNELS[5], accel, 1000.0 * UG),
        channel(LogChannel("p_pa", units_of("Pa")), {"N": TermEstimate(0.6, 0.5, 0.7)}, 101_325.0),
        remarks=("One remark.",),
    )  # fmt: skip
    tau = "τ_b = 123.5 s (100 … 151)"
    assert printed(lambda console: show(shown.exhibits_of(found), console)) == [
        "rest.csv: 3600 s, 90000 samples at 25 Hz",
        "One remark.",
        "gyro_y: mean -2.500 deg/h, lowest Allan deviation 0.2500 deg/h at 30 s",
        "value 95 % band unit equivalent",
        f"Q quantisation 2.000 1.000 … 3.000 arcsec pulse of {2.0 * sqrt(12.0):.3f} arcsec",
        "N random walk 0.1200 0.1100 … 0.1300 deg/√h 7.200 deg/h/√Hz",
        f"B bias instability, flicker 0.5000 0.4000 … 0.6000 deg/h Allan deviation of {0.5 * 0.66428:.4f} deg/h",
        "K rate random walk not observable < 0.3000 deg/h/√h",
        "R rate ramp -0.7000 -0.8000 … -0.6000 deg/h/h",
        f"σ_b Gauss-Markov bias, 1σ 0.9000 0.8000 … 1.100 deg/h {tau}",
        "accel_z: mean 1000 µg, lowest Allan deviation 0.2500 µg at 30 s",
        "value 95 % band unit equivalent",
        f"Q quantisation 5.000 4.000 … 6.000 mm/s pulse of {5.0 * sqrt(12.0):.2f} mm/s",
        f"N random walk 30.00 20.00 … 40.00 µg/√Hz {30.0 * UG * 60.0:.5f} m/s/√h",
        f"σ_b Gauss-Markov bias, 1σ not observable < 7.000 µg {tau}",
        "p_pa: mean 101325 Pa, lowest Allan deviation 0.2500 Pa at 30 s",
        "value 95 % band unit equivalent",
        "N random walk 0.6000 0.5000 … 0.7000 Pa/√Hz 3.000 Pa (1σ) of a sample",
    ]


def test_remarks_on_a_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ChannelNoise, "remarks", lambda self: [f"A remark on {self.name}."])
    one = channel(CHANNELS[0], {"N": TermEstimate(0.1 * DEG / 60.0, 0.0, 1.0)}, 0.0)
    lines = printed(lambda console: show(shown.exhibits_of(report(one, one)), console))
    assert [k for k, line in enumerate(lines) if line == "A remark on gyro_x."] == [len(lines) // 2, len(lines) - 1]


TAU = np.array([0.5, 5.0, 50.0])


def noise(which: LogChannel = CHANNELS[2], **estimates: TermEstimate) -> ChannelNoise:
    deviation = SimpleNamespace(tau=TAU, deviation=np.array([9.0, 4.0, 700.0]) * DEG_H)
    low, high = np.array([8.0, 3.0, 600.0]) * DEG_H, np.array([10.0, 6.0, 900.0]) * DEG_H
    return ChannelNoise(which, deviation, np.ones(3), low, high, Fit(estimates=estimates), None)


def test_the_allan_deviations() -> None:
    one = noise(N=TermEstimate(0.12 * DEG_H * 60.0, 0.0, 1.0), B=TermEstimate(None, 0.0, 1.0),
                sigma_b=TermEstimate(0.5 * DEG_H, 0.0, 1.0))  # fmt: skip
    charts = shown.deviations(report(one, one, duration=3600.5, interval=0.02))
    chart, _ = charts
    (band,) = marks_of(chart, Band)
    same((band.x, band.low / DEG_H, band.high / DEG_H), [TAU, [8.0, 3.0, 600.0], [10.0, 6.0, 900.0]])
    lines = marks_of(chart, Line)
    assert [(line.label, line.color) for line in lines] == [
        ("measured", "measured"), ("sum of terms", "fit"), ("N = 0.1200 deg/√h", "N"),
        ("σ_b = 0.5000 deg/h", "sigma_b"),
    ]  # fmt: skip
    for line, values in zip(lines, ([9.0, 4.0, 700.0], 2.0 / TAU, 3.0 * TAU, 3.0 * TAU), strict=True):
        same((line.x, line.y / DEG_H), (TAU, values))
    assert (chart.title, chart.heading(False), chart.heading(True)) == (
        "gyro_z (down)", "averaging time τ [s]", "Allan deviation [deg/h]",
    )  # fmt: skip
    assert chart.x.log
    assert chart.y.log
    assert (chart.x.low, chart.x.high) == (0.5, 50.0)
    assert chart.ends(upright=True) == (pytest.approx(1.2 * DEG_H), pytest.approx(1750.0 * DEG_H))
    assert charts.title == "rest.csv: overlapping Allan deviation, 3600.5 s at 50 Hz"


def test_charts_of_four_channels() -> None:
    """Three in a row; the rest of the second row is empty."""
    charts = shown.deviations(report(*(noise(one) for one in CHANNELS[:4])))
    assert charts.size == (pytest.approx(16.2), pytest.approx(9.2))
    assert [[chart.title[:6] for chart in row] for row in charts.rows] == [["gyro_x", "gyro_y", "gyro_z"], ["accel_"]]
    figure = figure_of(charts)
    places = [(spec.rowspan.start, spec.colspan.start) for panel in figure.axes if (spec := panel.get_subplotspec())]
    assert places == [(0, 0), (0, 1), (0, 2), (1, 0)]


def test_the_samples() -> None:
    """Rates of the intervals minus their mean; sums minus a linear trend; a quantity without a triad by number."""
    steps = np.array([[1.0, -2.0, 4.0], [2.0, 6.0, -8.0], [7.0, 1.0, 14.0]])
    departures = np.array([[0.0] * 3, [-1.0, -3.0, 2.0], [-3.0, 1.0, -10.0], [0.0] * 3])
    time = np.array([50.0, 52.0, 56.0, 60.0])
    channels = [SimpleNamespace(channel=SimpleNamespace(triad="gyro", axis=axis, name=f"g{axis}")) for axis in (0, 2)]
    other = SimpleNamespace(triad=None, name="a <b>", units=SimpleNamespace(rate=("V", 1.0)))
    samples = SimpleNamespace(
        time=time, triads={"gyro": steps * ARCSEC, "accel": steps}, kind="increments",
        quantities={"a <b>": np.array([3.0, 9.0, 12.0])},
    )  # fmt: skip
    found: Any = SimpleNamespace(samples=samples, channels=(*channels, SimpleNamespace(channel=other)))
    charts: Charts = shown.streams(found)
    rates = np.array([[0.5, 2.0], [0.5, -2.0], [1.75, 3.5]])
    expected = (
        ("gyro/rate", "angular rate minus its mean, mean over 3.33 s", "deg/h", time[1:], rates - rates.mean(axis=0)),
        ("gyro/sum", "angle minus a linear trend", "arcsec", time, departures[:, [0, 2]]),
        ("quantity_1", "a <b> minus its mean, mean over 3.33 s", "V", time[1:], np.array([[-5.0], [1.0], [4.0]])),
    )
    for chart, (key, title, unit, at, values) in zip(charts, expected, strict=True):
        lines, size = marks_of(chart, Line), chart.unit(True)[1]
        assert (chart.key, chart.title, chart.unit(True)[0]) == (key, title, unit)
        assert [line.label for line in lines] == (["a <b>"] if unit == "V" else ["x", "z"])
        same(np.column_stack([line.y for line in lines]) / size, values)
        same(lines[0].x, at - 50.0)
    samples.kind = "rates"  # times their intervals of 2, 4 and 4 s
    sums = shown._accumulated(found, "gyro", [0, 2]) / ARCSEC
    np.testing.assert_allclose(sums, [[0.0, 0.0], [2.0, 8.0], [10.0, -24.0], [38.0, 32.0]])
