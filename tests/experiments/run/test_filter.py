"""The section on the filter: bands, tests, innovations, states and marks, from numbers that are chosen."""

from __future__ import annotations

import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.estimation.filter_result import Innovations, Reasons
from sinssim.experiments.run import filter_exhibits as report
from tests.recording.made_filter import aided
from tests.recording.spies import Plot, cells, html, plots

AIDED, SMOOTHED, BACKWARD, BOUND, REFUSED = "#0072b2", "#cc79a7", "#d55e00", "#969696", "#e11e6e"
ARCSEC, ARCMIN = np.pi / 648_000.0, np.pi / 10_800.0


def band(kind: str, label: str, paint: tuple[str, str], time: Any, error: Any, sigma: Any) -> Any:
    """Return the expected curves of one solution."""
    return [(label, paint[0], time, 3.0 * np.array(sigma)), ("", paint[0], time, -3.0 * np.array(sigma)),
            (kind, paint[1], time, np.array(error))]  # fmt: skip


def bands(found: Any, marks: Any = ()) -> list[Plot]:
    return [Plot(chart) for row in report.band_charts(found, (20.0, 420.0), marks) for chart in row]


def test_every_error_lies_in_its_band() -> None:
    """Of the height, up is positive; the axis fits what comes after a twentieth of the run, 20 s."""
    # 3σ after the filter has settled: 30 · 0.002 m/s is more than 0.05 m/s
    sizes = [("m", 2.0), ("m", 3.0), ("m", -5.0), ("m/s", 0.002), ("m/s", 0.003), ("m/s", 0.005),
             ("arcsec", 1e-6 / ARCSEC), ("arcsec", 2e-6 / ARCSEC), ("arcmin", 4e-4 / ARCMIN)]  # fmt: skip
    titles = ["North position error", "East position error", "Height error", "North velocity error",
              "East velocity error", "Down velocity error", "Tilt about north, φN", "Tilt about east, φE",
              "Azimuth misalignment, φD"]  # fmt: skip
    for found, title, (unit, size) in zip(bands(aided()), titles, sizes, strict=True):
        own = abs(size)
        curves = [
            *band("aided", "±3σ, aided", (BOUND, AIDED), [20.0, 30.0, 40.0, 220.0, 420.0],
                  size * np.array([-50.0, 30.0, -12.0, 7.0, 5.0]), own * np.array([100.0, 40.0, 10.0, 6.0, 4.0])),
            *band("smoothed", "±3σ, smoothed", ("#ab8a9c", SMOOTHED), [20.0, 50.0, 420.0],
                  size * np.array([8.0, -3.0, 2.0]), own * np.array([9.0, 2.5, 3.5])),
            *band("backward", "±3σ, backward", ("#af7f5a", BACKWARD), [30.0, 400.0, 410.0],
                  size * np.array([1.0, -4.0, 60.0]), own * np.array([1.5, 5.0, 80.0])),
        ]  # fmt: skip
        found.shows(title, unit, *curves)
        assert found.span == (20.0, 420.0)
        # 3 · 10 of the aided solution at 40 s is the largest that is fitted, with a twentieth of room
        high = found.chart.y.high
        assert high is not None
        assert found.chart.y.low == -high
        assert high / found.chart.unit(True)[1] == pytest.approx(1.05 * 30.0 * own)


def test_the_aided_solution_alone() -> None:
    assert [line.label for line in bands(aided(others=False))[0].lines] == ["±3σ", "", "aided"]


def test_innovations_over_their_sigma() -> None:
    """3/2 and −8/4, 1/2 and 1/5; the rejected −40/4 is drawn at the edge, 10/2 is not; a skipped one is not drawn."""
    (found,) = plots(report.innovation_charts(aided().estimate.innovations, (20.0, 420.0)))
    paint = found.lines[0].color
    found.shows(
        "gnss innovations", "σ",
        ("accepted", paint, [21.0, 23.0], [1.5, 0.5]), ("", paint, [21.0, 23.0], [-2.0, 0.2]),
        ("rejected", REFUSED, [24.0], [-6.0]), ("", REFUSED, [24.0], [5.0]),
    )  # fmt: skip
    assert found.levels == [(3.0, "±3σ"), (-3.0, "")]
    assert found.chart.y.ticks == (-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0)
    assert [line.size for line in found.lines] == [1.2, 1.2, 2.6, 2.6]


def test_charts_of_innovations_keep_no_copy_of_them() -> None:
    """A day of 10 Hz has millions. The number of each one that is drawn takes 4 bytes, a single copy of them 24."""
    count, rng = 200_000, np.random.default_rng(1)
    value, lower = rng.normal(size=(count, 3)), np.tile([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], (count, 1))
    nis = np.sum(value**2, axis=1)
    sensor = Innovations(
        "gnss", "gnss-position", np.arange(float(count)), value, lower, nis, nis < 9.0, Reasons(count, {}), 9.0
    )
    span = (0.0, float(count))
    list(report.innovation_charts([sensor], span))  # loads libraries
    tracemalloc.start()
    charts = list(report.innovation_charts([sensor], span))
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert len(charts) == 2
    assert kept < 8.0 * count


def errors(*values: float | None) -> dict[str, float | None]:
    keys = ("final_horizontal_error_m", "rms_horizontal_error_m", "max_horizontal_error_m", "max_height_error_m",
            "max_velocity_error_mps", "final_attitude_error_arcsec")  # fmt: skip
    return dict(zip(keys, values, strict=True))


def test_solutions_side_by_side() -> None:
    """The attitude error in arcmin; a solution that the run lacks has no row."""
    summary = {
        "filter": {
            "aided": errors(1.5, 2.25, 3.75, 4.5, 0.125, 90.0), "smoothed": errors(0.5, 0.6, 0.7, None, 0.8, 6.0),
        },
        "algorithms": {"poisson": errors(1234.0, 2345.0, 3456.0, 45.6, 5.67, 678.0)},
    }  # fmt: skip
    page = html(report._solutions(summary["filter"], summary["algorithms"]))
    assert cells(page) == [
        ["solution", "horizontal, final, m", "rms", "max", "height, max, m", "velocity, max, m/s",
         "attitude, final, arcmin"],
        ["aided", "1.50", "2.25", "3.75", "4.50", "0.125", "1.50"],
        ["smoothed", "0.500", "0.600", "0.700", "–", "0.800", "0.100"],
        ["inertial, poisson", "1234", "2345", "3456", "45.6", "5.67", "11.3"],
    ]  # fmt: skip
    colors = ["#0072b2", "#cc79a7", "#e69f00"]
    assert [page.index(color) for color in colors] == sorted(page.index(color) for color in colors)


def test_tests_of_the_innovations_and_of_the_errors() -> None:
    inside = {"value": 1.05, "lower_95": 0.9, "upper_95": 1.1}
    above = {"value": 1.234, "lower_95": 0.987, "upper_95": 1.012}
    below = {"value": 0.5, "lower_95": 0.6, "upper_95": 1.4}
    sensor = {
        "verdict": "optimistic", "taken": 118, "refused": 7, "refused_expected": 0.125,
        "tests": {"NIS": above, "slow part, 64 readings": below, "whiteness": inside},
    }  # fmt: skip
    numbers: Any = {"sensors": {"gnss <1>": sensor}}
    page = html(report._tests(numbers))
    assert cells(page) == [
        ["sensor", "verdict", "accepted", "rejected (expected)", "NIS", "whiteness", "sums of 16", "of 64", "of 256"],
        ["gnss &lt;1&gt;", "optimistic", "118", "7 (0.12)", "1.23(0.987 … 1.01)", "1.05(0.900 … 1.10)", "–",
         "0.500(0.600 … 1.40)", "–"],
    ]  # fmt: skip
    assert page.count("<strong>") == 2
    assert "<strong>1.23</strong><br>(0.987" in page
    numbers = {"nees": {"attitude": {**below, "states": 3}}, "noise": {"velocity": inside}}
    page = html(*report._against_truth(numbers))
    assert cells(page) == [
        ["states", "number", "NEES per state"], ["attitude", "3", "0.500 (0.600 … 1.40)"],
        ["noise", "variance / assumed variance"], ["velocity", "1.05 (0.900 … 1.10)"],
    ]  # fmt: skip
    assert report._test({"value": 1.4, "lower_95": 0.6, "upper_95": 1.4}) == "1.40 (0.600 … 1.40)"


def state(start: float, end: float, error: float | None, reduction: float | None, seen: bool) -> dict[str, Any]:
    return {"sigma_start": start, "sigma_end": end, "error_end": error, "estimate_end": 2.0 * (error or 0.0),
            "reduction": reduction, "observable": seen}  # fmt: skip


def test_uncertainty_of_the_states_in_the_units_of_people() -> None:
    """4.8481368e-6 rad/s are 1 deg/h; in two tables, the first of which is the longer one."""
    rate = ARCSEC
    numbers: Any = {
        "recorded": False, "nees": {}, "noise": {},
        "states": {
            "gyro_bias_forward_radps": state(3.0 * rate, 1.5 * rate, -0.75 * rate, 2.0, False),
            "accelerometer_bias_down_mps2": state(9.80665e-3, 9.80665e-5, None, 100.0, True),
            "position_north_m": state(4.0, 8.0, 6.0, 0.5, False),
        },
    }  # fmt: skip
    page = html(*report._uncertainty(numbers))
    heads = ["state", "σ, start", "σ, end", "error, end", "σ reduced by"]
    found = [row for row in cells(page) if len(row) == 5]
    assert found[0] == found[3] == heads
    assert [row[0].partition(" [")[0] for row in (found[1], found[2], found[4])] == [
        "gyro bias forward", "accel. bias down", "position north",
    ]  # fmt: skip
    assert found[1][1:] == ["3.00", "1.50", "−0.750", "2.00 ×"]
    assert found[2][1:] == ["1000", "10.0", "–", "100 ×"]
    assert found[4][1:] == ["4.00", "8.00", "6.00", "2.00 × larger"]
    assert page.count("<strong>") == 1
    assert "<strong>100 ×</strong>" in page
    recorded = html(*report._uncertainty({**numbers, "recorded": True}))
    assert "estimate, end" in recorded
    assert "−1.50" in recorded


def sensor(label: str, time: list[float], every: list[float]) -> Any:
    return SimpleNamespace(measurements=SimpleNamespace(time=np.array(time), label=label), time=np.array(every))


def test_marks_of_gaps_and_of_faults() -> None:
    """A gap is long from ten intervals and from a fiftieth of the run on: 10 s of 1 s, 40 s of 2000 s."""
    every = list(np.arange(100.0, 2101.0))
    found = SimpleNamespace(
        sensed=[
            sensor("gnss-position", [100.0, 139.0, 179.5, 230.0], every),
            sensor("gnss-velocity", [100.0, 139.0, 179.5, 230.0], every),
            sensor("baro", [100.0, 109.0, 120.0, 140.0], list(np.arange(100.0, 160.0))),
            sensor("star tracker", [100.0], every),
        ]
    )
    marks: Any = found
    assert [(m.at, m.text, m.color == "grid") for m in report.outage_marks(marks)] == [
        (109.0, "no baro", False), (120.0, "baro again", False), (120.0, "no baro", False),
        (139.0, "no GNSS", False), (140.0, "baro again", False), (179.5, "GNSS again", False),
        (179.5, "no GNSS", False), (230.0, "GNSS again", False),
    ]  # fmt: skip
    faults: Any = {
        "faults": [{"from_s": 30.0, "to_s": 60.5, "kind": "jump"}, {"from_s": 5.0, "to_s": 99.5, "kind": "ramp"}],
        "detections": [{"time_s": 33.0, "by": "gate", "sensors": ["gnss-position"]}],
    }
    assert [(m.at, m.text) for m in report.fault_marks(faults, (0.0, 100.0))] == [
        (5.0, "ramp"), (30.0, "jump, rejected"), (33.0, ""), (60.5, "jump ends"),
    ]  # fmt: skip


@pytest.mark.parametrize(("divergence", "broken"), [(None, False), ({"time_s": 3.0}, True)])
def test_the_first_sentence_is_marked_if_it_diverged(
    monkeypatch: pytest.MonkeyPatch, divergence: Any, broken: bool
) -> None:
    monkeypatch.setattr(report, "sentences", lambda numbers, diagnosed: ["First & best.", "Second."])
    of_filter: Any = {"divergence": divergence, "faults": [], "detections": [], "sensors": {}, "nees": {},
                      "noise": {}, "states": {}, "aided": None, "findings": []}  # fmt: skip
    items = list(report.filter_exhibits(aided(), of_filter, {}, (20.0, 420.0)))
    page = html(*items)
    assert page.startswith(
        f"<p{' class=' + chr(34) + 'broken' + chr(34) if broken else ''}><strong>First &amp; best.</strong></p>"
        "<p>Second.</p>"
    )
    assert len(plots(items)) == 10
    order = [page.index(text) for text in ("Azimuth misalignment", ">Innovations<", "gnss innovations")]
    assert order == sorted(order)
