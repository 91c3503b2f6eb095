"""What an alignment shows, from results whose every number is written by hand: rows, bars, curves, the session."""

from __future__ import annotations

import re
from dataclasses import replace
from math import cos, exp, log, nan, pi, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.alignment.alignment_budget import MOTION
from sinssim.alignment.parked_theory import Angles, Attitude
from sinssim.analyses import alignment_result as shown
from sinssim.analyses.alignment_result import AlignmentResult
from sinssim.charts import Bars, Chart, Dots, Line, Remark, Rule
from sinssim.data import ImuData
from sinssim.errors import InputError
from sinssim.recording.console import show
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from tests.recording.by_hand import ARCMIN, printed
from tests.recording.shown import chart_of, marks_of, same

DEG, ARCSEC, DEG_H, UG = pi / 180.0, pi / 648_000.0, pi / 648_000.0, 9.80665e-6
QUIET = ImuData(np.array([50.0, 200.0, 350.0]), np.zeros((2, 3)), np.full((2, 3), 1e3))


def angles(*values: float, size: float = 1.0) -> Angles:
    return Angles(*(np.asarray(value * size) for value in values))


def determined(*values: float, warnings: tuple[str, ...] = ()) -> Any:
    found = angles(*values, size=DEG)
    attitude = Attitude(*found[:3])
    return SimpleNamespace(**found._asdict(), attitude=attitude, warnings=warnings, earth_rate=15.0411 * DEG_H,
                           gravity=np.float64(9.81236))  # fmt: skip


def result(**more: Any) -> AlignmentResult:
    found = {"source": "session", "method": "disturbed", "imu": QUIET,
             "determination": determined(50.05, 1.9, -3.0, 48.123456)} | more  # fmt: skip
    return AlignmentResult(**found)  # type: ignore[arg-type]


def test_the_table_in_a_notebook() -> None:
    """σ of the total 5 arcmin from 3 and 4, 13 from 5 and 12, 25 from 7 and 24, and 2 of the latitude."""
    budget = {"gyro bias": angles(3.0, 5.0, 7.0, 2.0, size=ARCMIN),
              "accelerometer bias": angles(4.0, 12.0, 24.0, 0.0, size=ARCMIN)}  # fmt: skip
    rows = re.findall(r"<tr>(.*?)</tr>", result(budget=budget)._repr_html_(), re.DOTALL)
    heads = [re.findall(r"<th[^>]*>([^<]*)", row) for row in rows]
    assert heads[0] == ["", "determined, deg", "expected error (1σ), arcmin"]
    assert "Alignment of session, 300 s" in result()._repr_html_()
    page = result().exhibits
    assert page.title == page.plain == "session: 300 s, 2 samples, gravity's cone in inertial space"
    cells = [re.findall(r"<td[^>]*>([^<]*)", row) for row in rows]
    assert [row for row in cells if row] == [
        ["heading", "50.05000", "5"], ["roll", "1.90000", "13"], ["pitch", "-3.00000", "25"],
        ["latitude", "48.12346", "2"],
    ]  # fmt: skip


def test_the_console() -> None:
    """Errors 3 and −6 arcmin; σ of the total 5, 13 and 25 arcmin from 3, 4; 5, 12; 7, 24; latitude by one source."""
    budget = {
        "gyro bias": angles(3.0, 5.0, 7.0, 2.0, size=ARCMIN),
        "nothing": angles(0.0, 0.0, 0.0, 0.0),
        "accelerometer bias": angles(4.0, 12.0, 24.0, 0.0, size=ARCMIN),
        "tiny": angles(1e-6, 0.0, 0.0, 0.0, size=ARCMIN),
    }
    found = result(
        determination=determined(50.05, 1.9, -3.0, 48.123456, warnings=("the base moved.",)),
        mean=angles(0.5, 0.0, -0.25, 0.0, size=ARCMIN), budget=budget,
        truth=angles(50.0, 2.0, nan, 48.1, size=DEG), residual=0.001234, crossing=angles(1234.0, 56.0, 7.5, 890.0),
        mean_angles=angles(49.0, 2.5, -3.5, nan, size=DEG),
    )  # fmt: skip
    assert printed(lambda console: show(found.exhibits, console)) == [
        "session: 300 s, 2 samples, gravity's cone in inertial space",
        "determined σ bias dominates from true error eq. (1) on the same data",
        "° ′ s ° ′ °",
        "heading 50.05000 5.000 1.23e+03 50.00000 3.000 49.00000",
        "roll 1.90000 13.000 56 2.00000 -6.000 2.50000",
        "pitch -3.00000 25.000 7.5 not determined – -3.50000",
        "latitude 48.12346 2.000 890 48.10000 1.407 not determined",
        "Measured: Earth rate 15.0411 deg/h, gravity 9.81236 m/s².",
        "Residual velocity after the fit of the cone (heave, sway, noise): 0.00123 m/s rms.",
        "The base moved.",
        "Expected error by source, 1σ",
        "heading roll pitch latitude", "source ′ ′ ′ ′",
        "gyro bias 3.000 5.000 7.000 2.000",
        "accelerometer bias 4.000 12.000 24.000 –",
        "tiny <0.001 – – –",
        "total 5.000 13.000 25.000 2.000",
        "known mean error 0.500 – -0.250 –",
    ]  # fmt: skip
    quiet = result(method="quiet", source="log")
    assert printed(lambda console: show(quiet.exhibits, console))[:4] == [
        "log: 300 s, 2 samples, eq. (1) on a quiet base", "determined", "°", "heading 50.05000",
    ]  # fmt: skip


def test_the_budget() -> None:
    """σ of 3 and 4 arcmin: 5 in all; of 0.3 and 0.4 arcmin: 30 arcsec; each chart has its unit. Two decimals are those
    of the total: of a two-hundredth of it and less, one digit is shown."""
    sources = {"tiny": angles(0.004, 0.0, 0.0, 0.0, size=ARCMIN),
               "bias": angles(3.0, 0.3, 0.0, 0.003, size=ARCMIN), "none": angles(0.0, 0.0, 0.0, 0.0),
               "noise": angles(4.0, 0.4, 7.0, 0.0, size=ARCMIN)}  # fmt: skip
    values = ([0.004, 3.0, 4.0, sqrt(25.000016)], [0.0, 18.0, 24.0, 30.0], [0.0, 0.0, 7.0, 7.0],
              [0.0, 0.18, 0.0, 0.18])  # fmt: skip
    texts = (("0.004", "3.00", "4.00", "5.00"), ("", "18.00", "24.00", "30.00"), ("", "", "7.00", "7.00"),
             ("", "0.18", "", "0.18"))  # fmt: skip
    charts = shown.bars(sources)
    for chart, name, unit, lengths, said in zip(charts, Angles._fields, ("arcmin", "arcsec", "arcmin", "arcsec"),
                                                values, texts, strict=True):  # fmt: skip
        (bars,) = marks_of(chart, Bars)
        same(bars.values / chart.unit(False)[1], lengths)
        assert bars.color == [name, name, name, "soft"]
        assert (chart.title, chart.heading(False), chart.x.low) == (name, f"σ [{unit}]", 0.0)
        assert (bars.texts, chart.y.names) == (said, ("tiny", "bias", "noise", "total"))


def lines_of(chart: Chart) -> dict[str, Line]:
    return {line.label: line for line in marks_of(chart, Line)}


def test_the_curves() -> None:
    """A gyro bias gives the heading b/(U cos φ) at any time; white noise N the same with N/√T; both cross at (N/b)²."""
    bias, walk, latitude = 0.01 * DEG_H, 0.004 * DEG_H * 60.0, 0.8
    sigma = ImuErrors(TriadErrors(bias=np.full(3, bias), random_walk=walk), TriadErrors())
    (chart,) = shown.curves(["heading"], Attitude(0.7, 0.0, 0.0), latitude, {"block": sigma}, "quiet")
    time = np.array([exp(log(2e4) * k / 199.0) for k in range(200)])
    east = 7.292115e-5 * cos(latitude)
    whole, floor = lines_of(chart)["block"], lines_of(chart)[""]
    np.testing.assert_allclose(floor.y, bias / east, rtol=2e-3)
    np.testing.assert_allclose(whole.y, np.hypot(bias, walk / np.sqrt(time)) / east, rtol=2e-3)
    np.testing.assert_allclose(whole.x, time, rtol=1e-9)
    crossing = (walk / bias) ** 2
    assert crossing == pytest.approx(576.0)
    dot = marks_of(chart, Dots)[0]
    assert (float(dot.x[0]), float(dot.y[0])) == (
        pytest.approx(crossing, rel=2e-3), pytest.approx(sqrt(2.0) * bias / east, rel=2e-3),
    )  # fmt: skip
    assert [mark.text for mark in marks_of(chart, Remark)] == ["576 s"]
    assert (chart.title, chart.heading(False), chart.heading(True)) == (
        "heading", "session length T [s]", "σ of the heading [arcmin]",
    )  # fmt: skip
    named = [mark.label for mark in chart.marks if getattr(mark, "label", "")]
    assert named == ["block", "not reduced by averaging", "bias dominates"]
    assert chart.x.log
    assert chart.y.log
    level = ImuErrors(TriadErrors(), TriadErrors(bias=np.full(3, 50.0 * UG)))
    (tilts,) = shown.curves(["roll"], Attitude(0.7, 0.0, 0.0), latitude, {"block": level}, "quiet")
    np.testing.assert_allclose(lines_of(tilts)[""].y, 50e-6, rtol=2e-3)  # b/g
    assert tilts.heading(True) == "σ of the roll [arcsec]"
    low, high = tilts.ends(upright=True)
    assert low is not None
    assert high is not None
    assert high / low >= 4.0  # a flat curve: two numbers on the axis


def test_the_expected_errors_of_a_session() -> None:
    """The bars above the curves; a line at the 300 s of the session; nothing without sensors or angles."""
    sigma = ImuErrors(TriadErrors(bias=np.full(3, 0.01 * DEG_H)), TriadErrors(bias=np.full(3, 50.0 * UG)))
    known = {"sigma": sigma, "budget": {"bias": angles(3.0 * ARCMIN, 1e-4, 2e-4, 5e-4), MOTION: angles(0, 0, 0, 0)}}
    found = result(determination=determined(40.0, 0.0, 0.0, 45.0), **known)
    charts = found.exhibits.chosen("error_budget")
    assert charts.title == "session: expected error of a session of 300 s"
    for name, above, below in zip(Angles._fields, *charts.rows, strict=True):
        assert above.title == name
        unit = {"roll": "arcsec", "pitch": "arcsec"}.get(name, "arcmin")
        assert (below.heading(False), below.heading(True)) == ("session length T [s]", f"σ of the {name} [{unit}]")
        (rule,) = marks_of(below, Rule)
        assert (rule.label, rule.at, rule.upright, rule.dash) == ("duration", 300.0, True, ":")
    figure = found.plot()
    assert figure._suptitle.get_text() == charts.title
    middles = [panel.get_window_extent().y0 for panel in figure.axes]
    assert min(middles[:4]) > max(middles[4:])
    unknown = determined(nan, 0.0, 0.0, 48.0)
    for changed in ({"sigma": None}, {"budget": None}, {"determination": unknown}):
        other = replace(found, **changed)  # type: ignore[arg-type]
        assert not other.exhibits.figure
        with pytest.raises(InputError, match="session: nothing to plot"):
            other.plot()


TIME = np.array([50.0, 52.0, 56.0, 60.0])
EARTH_RATE, GRAVITY = 7.292115e-5, 9.8
HEADINGS, LATITUDES, ROLLS, PITCHES = [350.0, 5.0, 20.0], [40.0, 45.0, 50.0], [2.0, 1.0, 4.0], [-3.0, 6.0, 5.0]
SO_FAR = {"heading": [-370.0, -355.0, -340.0], "roll": ROLLS, "pitch": PITCHES, "latitude": LATITUDES}


def session(**more: Any) -> AlignmentResult:
    """Return an alignment of increments whose means from the start have the angles above: forward, right, down."""
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
    imu = ImuData(TIME, increments[:, :3], increments[:, 3:])
    found = {"method": "quiet", "imu": imu, "determination": determined(-340.0, 4.0, 5.0, 50.0), "warmed": 7.0} | more
    return result(**found)


def test_angles_so_far() -> None:
    """Without a jump from 360° to 0°, in the range of the determined heading; the true one beside it."""
    found = session(truth=Angles(*np.radians([25.0, 3.5, 5.5, 49.0]))).exhibits
    for name, true in zip(Angles._fields, (-335.0, 3.5, 5.5, 49.0), strict=True):
        chart = chart_of(found, f"angles/{name}")
        lines = lines_of(chart)
        assert list(lines) == ["so far", "true"]
        same(np.degrees(lines["so far"].y), SO_FAR[name])
        same(np.degrees(lines["true"].y), [true] * 3)
        same(lines["so far"].x, [2.0, 6.0, 10.0])
        assert (chart.title, chart.unit(True)[0]) == (f"{name} from the session so far", "deg")
    assert (found.root, found.span) == ("session", (50.0, 60.0))
    swaying = session(method="swaying").exhibits.chosen("session")
    assert [chart.key for chart in swaying] == ["turn", "velocity"]


def test_sigma_around_the_angles(monkeypatch: pytest.MonkeyPatch) -> None:
    """3 and 4 make 5; with 12 of the base's motion 13; the budget is asked for the length, rate and warm-up."""
    asked: dict[str, Any] = {}

    def budget(attitude: Any, latitude: float, sigma: Any, elapsed: Any, **more: Any) -> dict[str, Angles]:
        asked.update(attitude=attitude, latitude=latitude, sigma=sigma, elapsed=elapsed, **more)
        share = np.array([2.0, 1.0, 0.5])
        return {"a": Angles(*(np.radians(3.0 * k) * share for k in (1, 2, 3, 4))),
                "b": Angles(*(np.radians(4.0 * k) * share for k in (1, 2, 3, 4)))}  # fmt: skip

    monkeypatch.setattr(shown, "error_budget", budget)
    moved = Angles(*np.radians([12.0, 0.0, 36.0, 0.0]))
    charts = shown._so_far(session(sigma="block", budget={MOTION: moved}))
    sigma = {"heading": np.hypot([10.0, 5.0, 2.5], 12.0), "roll": np.array([20.0, 10.0, 5.0]),
             "pitch": np.hypot([30.0, 15.0, 7.5], 36.0), "latitude": np.array([40.0, 20.0, 10.0])}  # fmt: skip
    for name, chart in zip(Angles._fields, charts, strict=True):
        angle, lines = np.array(SO_FAR[name]), lines_of(chart)
        assert list(lines) == ["so far", "so far + σ", "so far − σ"]
        same(np.degrees([line.y for line in lines.values()]), [angle, angle + sigma[name], angle - sigma[name]])
    np.testing.assert_allclose(np.degrees(asked["attitude"]), [20.0, 4.0, 5.0])
    assert np.degrees(asked["latitude"]) == pytest.approx(50.0)
    np.testing.assert_allclose(asked["elapsed"], [2.0, 6.0, 10.0])
    found = {key: asked[key] for key in ("sigma", "gravity", "start", "rate_hz")}
    assert found == {"sigma": "block", "gravity": pytest.approx(9.81236), "start": 7.0, "rate_hz": pytest.approx(0.3)}


STEPS = np.array([[1.0, -2.0, 4.0], [2.0, 6.0, -8.0], [7.0, 1.0, 14.0]])
"""Sums 1, 3, 10; −2, 4, 5; 4, −4, 10. A linear trend has 0.2, 0.6 and 1 of the last."""
DEPARTURES = np.array([[0.0] * 3, [-1.0, -3.0, 2.0], [-3.0, 1.0, -10.0], [0.0] * 3])


def test_departures_from_a_linear_trend() -> None:
    imu = ImuData(TIME, STEPS * ARCSEC, 0.003 * STEPS)
    found = session(imu=imu, method="swaying").exhibits
    for key, title, unit, values in (
        ("turn", "departure of the gyros' angle from a linear trend", "arcsec", DEPARTURES),
        ("velocity", "departure of the accelerometers' velocity from a linear trend", "mm/s", 3.0 * DEPARTURES),
    ):
        chart = chart_of(found, key)
        lines = lines_of(chart)
        assert list(lines) == ["forward", "right", "down"]
        same(np.column_stack([line.y for line in lines.values()]) / chart.unit(True)[1], values)
        same(lines["down"].x, TIME - 50.0)
        assert (chart.title, chart.unit(True)[0]) == (title, unit)
    rest = np.arange(12.0).reshape(4, 3) * 1e-3
    chart = chart_of(session(imu=imu, method="swaying", residual_velocity=rest).exhibits, "velocity")
    same(np.column_stack([line.y for line in marks_of(chart, Line)]), rest)
    assert chart.title == "departure of the accelerometers' velocity from gravity's cone in inertial space"
