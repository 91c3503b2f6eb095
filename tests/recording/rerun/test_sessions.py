"""Alignments and noise records in the viewer, from samples that are written down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.alignment.axes import Angles
from sinssim.alignment.budget import MOTION
from sinssim.analyses.alignment import alignment_recording as alignment
from sinssim.analyses.noise_identification import noise_recording as noise
from sinssim.data import ImuData
from tests.recording.spies import Drawn, values_of

TIME = np.array([50.0, 52.0, 56.0, 60.0])
EARTH_RATE, GRAVITY = 7.292115e-5, 9.8
HEADINGS, LATITUDES, ROLLS, PITCHES = [350.0, 5.0, 20.0], [40.0, 45.0, 50.0], [2.0, 1.0, 4.0], [-3.0, 6.0, 5.0]
NAMES = ("heading", "roll", "pitch", "latitude")


def session() -> ImuData:
    """Return increments whose means from the start have the angles above: forward, right, down at rest."""
    sums = []
    for heading, latitude, roll, pitch, lasts in zip(
        HEADINGS, LATITUDES, ROLLS, PITCHES, (2.0, 6.0, 10.0), strict=True
    ):
        body = Rotation.from_euler("ZYX", (heading, pitch, roll), degrees=True).inv()
        c, s = np.cos(np.radians(latitude)), np.sin(np.radians(latitude))
        sums.append(
            lasts * np.concatenate((EARTH_RATE * body.apply([c, 0.0, -s]), GRAVITY * body.apply([0.0, 0.0, -1.0])))
        )
    increments = np.diff(np.array([np.zeros(6), *sums]), axis=0)
    return ImuData(TIME, increments[:, :3], increments[:, 3:])


def report(**more: Any) -> Any:
    determination = SimpleNamespace(
        heading=np.radians(-340.0), roll=np.radians(4.0), pitch=np.radians(5.0), latitude=np.radians(50.0), gravity=9.8
    )
    values = {"method": "quiet", "imu": session(), "determination": determination, "sigma": None, "budget": None,
              "truth": None, "residual_velocity": None, "duration": 10.0, "warmed": 7.0}  # fmt: skip
    return SimpleNamespace(**{**values, **more})


def test_angles_so_far() -> None:
    """Without a jump from 360° to 0°, in the range of the determined heading; the true one beside it."""
    drawn: Any = Drawn()
    truth = Angles(*np.radians([25.0, 3.5, 5.5, 49.0]))
    plots = alignment._record_angles(drawn, report(truth=truth))
    expected = {"heading": ([-370.0, -355.0, -340.0], -335.0), "roll": (ROLLS, 3.5), "pitch": (PITCHES, 5.5),
                "latitude": (LATITUDES, 49.0)}  # fmt: skip
    for name, (angles, true) in expected.items():
        drawn.shows(f"session/angles/{name}", ["so far", "true"], TIME[1:], np.column_stack((angles, [true] * 3)))
    assert [plot.name for plot in plots] == [f"{name} from the session so far [deg]" for name in NAMES]
    assert not alignment._record_angles(drawn, report(method="swaying"))


def test_sigma_around_the_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """3 and 4 make 5; with 12 of the base's motion 13; the budget is asked for the length, rate and warm-up."""
    asked: dict[str, Any] = {}

    def budget(attitude: Any, latitude: float, sigma: Any, elapsed: Any, **more: Any) -> dict[str, Angles]:
        asked.update(attitude=attitude, latitude=latitude, sigma=sigma, elapsed=elapsed, **more)
        share = np.array([2.0, 1.0, 0.5])
        return {"a": Angles(*(np.radians(3.0 * k) * share for k in (1, 2, 3, 4))),
                "b": Angles(*(np.radians(4.0 * k) * share for k in (1, 2, 3, 4)))}  # fmt: skip

    monkeypatch.setattr(alignment, "error_budget", budget)
    drawn: Any = Drawn()
    moved = Angles(*np.radians([12.0, 0.0, 36.0, 0.0]))
    alignment._record_angles(drawn, report(sigma="block", budget={MOTION: moved}))
    sigma = {"heading": np.hypot([10.0, 5.0, 2.5], 12.0), "roll": np.array([20.0, 10.0, 5.0]),
             "pitch": np.hypot([30.0, 15.0, 7.5], 36.0), "latitude": np.array([40.0, 20.0, 10.0])}  # fmt: skip
    so_far = {"heading": [-370.0, -355.0, -340.0], "roll": ROLLS, "pitch": PITCHES, "latitude": LATITUDES}
    for name in NAMES:
        angle = np.array(so_far[name])
        lines = np.column_stack((angle, angle + sigma[name], angle - sigma[name]))
        drawn.shows(f"session/angles/{name}", ["so far", "so far + σ", "so far − σ"], TIME[1:], lines)
    np.testing.assert_allclose(np.degrees(asked["attitude"]), [20.0, 4.0, 5.0])
    assert np.degrees(asked["latitude"]) == pytest.approx(50.0)
    np.testing.assert_allclose(asked["elapsed"], [2.0, 6.0, 10.0])
    found = {key: asked[key] for key in ("sigma", "gravity", "start", "rate_hz")}
    assert found == {"sigma": "block", "gravity": 9.8, "start": 7.0, "rate_hz": pytest.approx(0.3)}


ARCSEC = np.pi / 648_000.0
STEPS = np.array([[1.0, -2.0, 4.0], [2.0, 6.0, -8.0], [7.0, 1.0, 14.0]])
"""Sums 1, 3, 10; −2, 4, 5; 4, −4, 10. A linear trend has 0.2, 0.6 and 1 of the last."""
DEPARTURES = np.array([[0.0] * 3, [-1.0, -3.0, 2.0], [-3.0, 1.0, -10.0], [0.0] * 3])


def test_departures_from_a_linear_trend() -> None:
    drawn: Any = Drawn()
    imu = ImuData(TIME, STEPS * ARCSEC, 0.003 * STEPS)
    turn, velocity = alignment._record_departures(drawn, report(imu=imu))
    axes = ["forward", "right", "down"]
    drawn.shows("session/turn", axes, TIME, DEPARTURES)
    drawn.shows("session/velocity", axes, TIME, 3.0 * DEPARTURES)
    assert turn.name == "departure of the gyros' angle from a linear trend [arcsec]"
    assert velocity.name == "departure of the accelerometers' velocity from a linear trend [mm/s]"
    rest = np.arange(12.0).reshape(4, 3) * 1e-3
    _, velocity = alignment._record_departures(drawn, report(imu=imu, residual_velocity=rest))
    drawn.shows("session/velocity", axes, TIME, np.arange(12.0).reshape(4, 3))
    assert "gravity's cone in inertial space [mm/s]" in str(velocity.name)
    span = velocity.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]
    assert (span["start"], span["end"]) == (50 * 10**9, 60 * 10**9)


def test_bars_of_the_budget() -> None:
    """One bar for each source, numbered from zero as in the list, in arcmin."""
    drawn: Any = Drawn()
    arcmin = np.pi / 10_800.0
    budget = {"bias": Angles(*(k * arcmin for k in (1.0, 2.0, 3.0, 4.0))),
              "noise <n>": Angles(*(k * arcmin for k in (5.0, 6.0, 7.0, 8.0)))}  # fmt: skip
    bars = alignment._record_budget(drawn, budget)
    for k, name in enumerate(NAMES):
        chart = drawn.fixed[f"session/budget/{name}"]
        np.testing.assert_allclose(_numbers(values_of(chart.values)), [k + 1.0, k + 5.0])
    assert bars[0].name == "σ of the heading by source [arcmin]"
    assert "0. bias\n1. noise <n>\n" in alignment._sources(report(budget=budget))
    assert alignment._sources(report()) == ""


def _numbers(found: Any) -> list[float]:
    """Return the numbers within nested lists and tables."""
    if isinstance(found, int | float):
        return [float(found)]
    if isinstance(found, dict):
        return [v for key, value in found.items() if key == "buffer" for v in _numbers(value)]
    return [v for one in found or () for v in _numbers(one)]


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
