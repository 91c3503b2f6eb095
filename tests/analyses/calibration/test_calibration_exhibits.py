"""What a calibration shows, from results whose every number is written by hand: sentences, rows, bars, dots."""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.analyses import calibration_result as shown
from sinssim.analyses.calibration_problem import OBSERVABLE, Parameter
from sinssim.analyses.calibration_result import CalibrationResult
from sinssim.charts import Bars, Dots, Rule
from sinssim.exhibits import Exhibits, Verbatim
from sinssim.recording.console import show
from sinssim.recording.page import page_of
from sinssim.truth.motions.turntable import SEQUENCES
from tests.recording.by_hand import printed
from tests.recording.shown import chart_of, items_of, marks_of, same, sentences, titles

DEG_H, UG = pi / 648_000.0, 9.80665e-6


@pytest.fixture(autouse=True)
def _no_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "compensation_text", lambda result: "[compensation]\nx = 1 & 2\n")


def calibrated(method: str = "separate", ready: Any = None, **changed: Any) -> CalibrationResult:
    """Return 1σ of 0.02, 1 and 5e-4 of the sizes before, the second not observable; errors of 2, −0.6 and −5 σ.

    The sequence lasts from the begin of its first dwell to the end of its last one: 400 s − 15 s.
    """
    parameters = (Parameter("gyro", "bias", 1, 1, 3.0 * DEG_H), Parameter("accel", "scale", 2, 2, 50e-6),
                  Parameter("accel", "arm", 1, 2, 0.012))  # fmt: skip
    sigma = np.array([0.06 * DEG_H, 50e-6, 6e-6])
    solution = SimpleNamespace(
        covariance=np.diag(sigma**2), observable=np.array([True, False, True]), chi_square=12.34, degrees=11,
        singular=np.array([2000.0, 50.0, 0.5, 1e-9]), transformed=None, directions=np.eye(3),
    )  # fmt: skip
    values = np.array([0.5 * DEG_H, 0.0, -7e-3])
    gyro, accel = np.outer([1.0, -2.0, 3.0, 5.0], [1.0, 10.0, 100.0]), np.outer([7.0, -11.0], [1.0, 10.0, 100.0])
    scale = (DEG_H, UG) if method == "separate" else (1.0, 1.0)
    estimate = SimpleNamespace(values=values, solution=solution, residual_gyro=gyro * scale[0],
                               residual_accel=accel * scale[1])  # fmt: skip
    scenario = SimpleNamespace(name="table <2>", description="Twelve\npositions",
                               turntable=SimpleNamespace(ready=ready))  # fmt: skip
    found = {"truth": values - np.array([2.0, -0.6, -5.0]) * sigma, "notes": ("A note.",)} | changed
    dwells = np.array([[15.0, 75.0], [90.0, 150.0], [170.0, 400.0]])
    return CalibrationResult(scenario, method, parameters, estimate, dwells, **found)


def exhibits(result: CalibrationResult, unobservable: tuple[str, ...] = ()) -> Exhibits:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CalibrationResult, "unobservable", list(unobservable))
        return shown.exhibits_of(result)


def test_the_console() -> None:
    found = exhibits(calibrated(), ("accel scale z",))
    assert printed(lambda console: show(found, console)) == [
        "table <2>: calibration, separate method, 3 positions", "Parameters",
        "parameter estimate 1σ unit before, 1σ true error/σ",
        "gyro bias y 0.5000 0.0600 deg/h 3.00 0.3800 +2.00",
        "accel scale z – 50.0 ppm 50.0 30.0 −0.60 not observable",
        "accel arm yz −7.00000 0.00600 mm 12.0 −6.97000 −5.00",
        "Misalignments refer to the axes of the table's positions, in which [turntable] gives attitudes and turns.",
        "The sequence does not determine the following, which stay 0 in the compensation (factors are in units of "
        "each error's 1σ before): accel scale z.",
        "Residuals: χ² = 12.3 with 11 degrees of freedom.",
        "Errors of the observable parameters: χ² = 29.0 with 2 degrees of freedom.",
        "A note.",
    ]  # fmt: skip
    log = exhibits(calibrated("systematic", truth=None, notes=()))
    lines = printed(lambda console: show(log, console))
    assert lines[2:5] == ["parameter estimate 1σ unit before, 1σ", "gyro bias y 0.5000 0.0600 deg/h 3.00",
                          "accel scale z – 50.0 ppm 50.0 not observable"]  # fmt: skip
    assert lines[-2:] == ["The sequence determines every parameter.",
                          "Residuals: χ² = 12.3 with 11 degrees of freedom."]  # fmt: skip


def test_values_with_the_decimals_of_their_sigma() -> None:
    assert [shown.like(v, 0.00385) for v in (-0.002347, 0.01)] == ["−0.00235", "0.01000"]
    assert shown.like(71.3829, 0.3984) == "71.383"


@pytest.mark.parametrize("name", [None, "24-positions"])
def test_the_page(name: str | None) -> None:
    ready = None if name is None else SEQUENCES[name]
    found = exhibits(calibrated(ready=ready))
    given = "given by [[turntable.turns]]." if ready is None else f"“{name}”: {ready.about} ({ready.source})."
    assert sentences(found, "page")[:3] == [
        "Twelve\npositions",
        "Means in known positions and integrals over known turns; the errors of the table are nuisance parameters "
        "with the stated accuracy.",
        f"Sequence: 3 positions in 385 s, {given}",
    ]  # fmt: skip
    assert titles(found) == ["Parameters", "Observability of the sequence", "Residuals", "Compensation"]
    assert items_of(found.items, "page")[-1] == Verbatim("compensation.toml", "[compensation]\nx = 1 & 2\n")
    page = page_of(found)
    assert "<h1>table &lt;2&gt;: calibration</h1>" in page
    assert "<pre>[compensation]\nx = 1 &amp; 2\n</pre>" in page
    assert page.count('<div class="charts">') == 3
    systematic = sentences(exhibits(calibrated("systematic")), "page")
    assert systematic[1].startswith("Navigation errors during the sequence: in ")


def test_what_the_sequence_determines() -> None:
    found = exhibits(calibrated())
    left = chart_of(found, "determined")
    (bars,) = marks_of(left, Bars)
    same(bars.values, [0.02, 1.0, 5e-4])
    assert bars.color == ["aided", "refused", "aided"]
    assert left.title == "What the sequence determines (pink: not observable)"
    assert left.x.label == "1σ after the calibration over 1σ before"
    assert left.y.names == ("gyro bias y", "accel scale z", "accel arm yz")
    assert (left.x.log, left.x.low, left.x.high) == (True, pytest.approx(2.5e-4), 2.0)
    assert [(one.at, one.upright, one.color) for one in marks_of(left, Rule)] == [(1.0, True, "limit")]
    right = chart_of(found, "errors")
    (dots,) = marks_of(right, Dots)
    same((dots.x, dots.y), [[2.0, -0.6, -5.0], [0.0, 1.0, 2.0]])
    assert (right.x.low, right.x.high) == (pytest.approx(-5.5), pytest.approx(5.5))
    assert (right.title, right.x.label) == ("Errors against the truth", "error over 1σ")
    (band,) = marks_of(right, Rule)
    assert (band.low, band.at, band.high) == (-1.0, 0.0, 1.0)
    ((alone,),) = exhibits(calibrated(truth=None)).chosen("parameters").rows
    same(marks_of(alone, Bars)[0].values, bars.values)


def test_the_singular_values() -> None:
    """Those of at least `OBSERVABLE` are observable; the least is drawn at 0.001."""
    chart = chart_of(exhibits(calibrated()), "singular")
    assert 0.5 < OBSERVABLE < 50.0
    seen, lost = marks_of(chart, Dots)
    same((seen.x, seen.y, lost.x, lost.y), [[1.0, 2.0], [2000.0, 50.0], [3.0, 4.0], [0.5, 1e-3]])
    assert [(one.label, one.color) for one in (seen, lost)] == [("observable", "aided"), ("not observable", "refused")]
    assert [(one.label, one.at, one.color) for one in marks_of(chart, Rule)] == [("limit", OBSERVABLE, "limit")]
    assert (chart.title, chart.x.label, chart.y.label) == (
        "Singular values", "direction, by falling information", "1σ before over 1σ after",
    )  # fmt: skip
    assert chart.y.log
    assert (chart.x.low, chart.x.high, chart.y.low) == (0.0, 5.0, 0.7e-3)


def test_the_residuals() -> None:
    gyros, accels = exhibits(calibrated()).chosen("residuals")
    for chart, parts, label, name in ((gyros, (1.0, -2.0, 3.0, 5.0), "gyros [deg/h]", "position or turn"),
                                      (accels, (7.0, -11.0), "accelerometers [µg]", "position")):  # fmt: skip
        assert (chart.heading(False), chart.heading(True)) == (name, label)
        size = chart.unit(True)[1]
        for axis, (word, dots) in enumerate(zip("xyz", marks_of(chart, Dots), strict=True)):
            same((dots.x, dots.y / size), [range(1, len(parts) + 1), np.array(parts) * 10.0**axis])
            assert (dots.label, dots.color) == (word, word)
    (chart,) = exhibits(calibrated("systematic")).chosen("residuals")
    assert (chart.heading(False), chart.heading(True)) == ("observation", "velocity [1σ]")
    dots = marks_of(chart, Dots)[2]
    assert dots.label == "down"
    same((dots.x, dots.y), [[1, 2], [700.0, -1100.0]])
