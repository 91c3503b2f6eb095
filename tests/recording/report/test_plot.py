"""Plots: every extreme is drawn where it belongs, thin or not; ticks are round."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from sinssim.recording.report import plot
from sinssim.recording.report.plot import Line, Mark
from sinssim.recording.scales import envelope, suiting, tick_label, ticks

SVG = "{http://www.w3.org/2000/svg}"


def lines_of(svg: str) -> list[np.ndarray]:
    """Return the points of each line inside the axes."""
    inner = ET.fromstring(svg).find(f"{SVG}svg")
    return [
        np.array([[float(v) for v in pair.split(",")] for pair in line.get("points").split()])
        for line in inner.iter(f"{SVG}polyline")
    ]


def test_a_single_wild_sample_among_half_a_million_is_kept():
    time = np.arange(500_001) / 100.0
    values = np.sin(time / 700.0)
    values[123_457], values[400_001] = 7.0, -9.0
    t, v = envelope(time, values, 0.0, 5000.0, 480)
    assert len(t) <= 960
    assert (np.diff(t) >= 0.0).all()
    assert (v.min(), v.max()) == (-9.0, 7.0)
    assert abs(t[v.argmax()] - 1234.57) < 5000.0 / 480
    assert abs(t[v.argmin()] - 4000.01) < 5000.0 / 480


@pytest.mark.parametrize("count", [1, 2, 7, 960, 961, 5000])
def test_thinning_never_invents_nor_loses_an_extreme(count):
    rng = np.random.default_rng(count)
    time, values = np.cumsum(rng.uniform(0.5, 1.5, count)), rng.standard_normal(count)
    t, v = envelope(time, values, time[0], time[-1], 480)
    assert set(v) <= set(values)
    assert (v.min(), v.max()) == (values.min(), values.max())
    assert t[0] == time[0]
    assert t[-1] == time[-1]


def test_points_lie_where_the_axes_say():
    time = np.array([0.0, 50.0, 100.0])
    svg = plot.plot("height", "m", [Line("h", time, np.array([0.0, 4.0, 10.0]), "#123456")], (0.0, 100.0), width=580)
    (points,) = lines_of(svg)
    assert points.tolist() == [[0.0, 190.0], [250.0, 114.0], [500.0, 0.0]]  # 500 by 190 px inside, 0…10 m
    assert [e.text for e in ET.fromstring(svg).findall(f"{SVG}text")][:7] == [
        "height [m]", "0", "2", "4", "6", "8", "10",
    ]  # fmt: skip


def test_values_are_drawn_in_the_unit_that_the_axis_names():
    time = np.array([0.0, 100.0])
    line = Line("h", time, np.array([0.0, 18520.0]), "#123456", size=1852.0)
    svg = plot.plot("distance", "nmi", [line], (0.0, 100.0))
    assert [e.text for e in ET.fromstring(svg).findall(f"{SVG}text")][1:7] == ["0", "2", "4", "6", "8", "10"]
    assert lines_of(svg)[0][:, 1].tolist() == [190.0, 0.0]


def test_a_drawn_line_reaches_every_extreme_and_follows_the_curve():
    time = np.arange(506_401) / 100.0
    values = 3.0 * np.sin(time / 300.0)
    values[250_000] = 5.0
    (points,) = lines_of(plot.plot("x", "m", [Line("x", time, values, "red")], (0.0, 5064.0), width=580))
    assert len(points) < 1010
    scale = 190.0 / (6.0 + 4.0)  # from -4 to 6 m
    y = points[:, 1] / -scale + 6.0
    assert y.max() == pytest.approx(5.0, abs=0.01)
    t = points[:, 0] / 500.0 * 5064.0
    quiet = np.abs(t - 2500.0) > 15.0
    np.testing.assert_allclose(y[quiet], 3.0 * np.sin(t[quiet] / 300.0), rtol=0, atol=1.5 / scale)


def test_an_angle_that_wraps_is_not_drawn_across():
    time = np.arange(3601.0)
    heading = (350.0 + 0.1 * time) % 360.0
    svg = plot.plot("heading", "deg", [Line("h", time, heading, "red", turn=360.0)], (0.0, 3600.0),
                    axis=(0.0, 360.0, 90.0))  # fmt: skip
    before, after = lines_of(svg)
    assert before[:, 1].max() < 6.0  # from 350 to 360 of 360 deg
    assert np.ptp(after[:, 1]) == pytest.approx(190.0 * 350.0 / 360.0, abs=0.5)  # half a pixel


def test_what_is_no_number_is_left_out():
    values = np.array([0.0, 1.0, np.inf, 2.0, np.nan])
    svg = plot.plot("x", "m", [Line("x", np.arange(5.0), values, "red")], (0.0, 4.0))
    assert len(lines_of(svg)[0]) == 3
    assert "nan" not in svg
    nothing = plot.plot("x", "m", [Line("x", np.arange(2.0), np.full(2, np.nan), "red")], (0.0, 1.0))
    assert lines_of(nothing) == []


@pytest.mark.parametrize("value", [0.0, 5.0, -1e-9, 6.4e6])
def test_a_constant_lies_inside_its_axes(value):
    svg = plot.plot("x", "m", [Line("x", np.arange(9.0), np.full(9, value), "red")], (0.0, 8.0))
    (points,) = lines_of(svg)
    assert set(points[:, 1]) == {points[0, 1]}
    assert 0.0 < points[0, 1] < 190.0


def test_rounding_is_not_blown_up_to_fill_a_plot():
    rng = np.random.default_rng(1)
    svg = plot.plot("roll", "deg", [Line("r", np.arange(9.0), 1e-14 * rng.standard_normal(9), "red")], (0.0, 8.0),
                    least=1e-3)  # fmt: skip
    assert np.ptp(lines_of(svg)[0][:, 1]) == 0.0


def test_marks_stay_on_the_paper_and_off_one_another():
    marks = [Mark(0.0, "begins here"), Mark(1.0, "too near"), Mark(100.0, "T = 84.4 min")]
    svg = plot.plot("x", "m", [Line("x", np.array([0.0, 100.0]), np.array([0.0, 1.0]), "red")], (0.0, 100.0),
                    marks=marks)  # fmt: skip
    texts = {e.text: float(e.get("x")) for e in ET.fromstring(svg).findall(f"{SVG}text")}
    assert "too near" not in texts
    assert texts["T = 84.4 min"] + 5.9 * len("T = 84.4 min") < 560.0
    assert len(re.findall("M[0-9. ]+L", svg)) > 5


@pytest.mark.parametrize(
    ("low", "high", "count", "expected"),
    [
        (0.0, 10.0, 5, [0, 2, 4, 6, 8, 10]),
        (-1.3, 2.1, 5, [-1, 0, 1, 2]),
        (0.0, 84.4, 9, [0, 10, 20, 30, 40, 50, 60, 70, 80]),
        (1e-9, 4.1e-9, 5, [1e-9, 2e-9, 3e-9, 4e-9]),
        (-7e5, -1e5, 3, [-6e5, -4e5, -2e5]),
    ],
)
def test_ticks_are_round(low, high, count, expected):
    at, step = ticks(low, high, count)
    np.testing.assert_allclose(at, expected, rtol=0, atol=1e-9 * step)
    assert step == pytest.approx(expected[1] - expected[0])


@pytest.mark.parametrize(
    ("value", "step", "text"),
    [(0.30000000000000004, 0.1, "0.3"), (-2.0, 1.0, "−2"), (-1e-17, 0.2, "0.0"), (1500.0, 500.0, "1500"),
     (2e-9, 1e-9, "2e−09"), (3e6, 1e6, "3e+06")],
)  # fmt: skip
def test_tick_labels(value, step, text):
    assert tick_label(value, step) == text


def test_what_is_not_finite_has_a_unit_too():
    assert suiting((("mm", 1e-3, 0.5), ("m", 1.0, np.inf)), np.array([np.nan])) == ("m", 1.0)


def test_the_legend_says_which_lines_coincide():
    time = np.linspace(0.0, 100.0, 5001)
    first = plot.Line("first", time, np.sin(time), "#000000")
    lines = [
        first,
        plot.Line("second", time, np.sin(time) + 1e-3, "#111111"),  # 0.1 px of 190 px for a range of 2
        plot.Line("third", time, np.sin(time) + np.where(np.arange(5001) == 2500, 0.1, 0.0), "#222222"),
    ]
    svg = plot.plot("angle", "deg", lines, (0.0, 100.0))
    assert ">second (same as first)<" in svg
    assert ">third<" in svg
    assert ">first<" in svg


def test_lines_of_other_instants_and_angles_coincide():
    """True airspeed is logged at other instants than the ground speed; roll may turn over, pitch does not."""
    often, seldom = np.linspace(0.0, 100.0, 501), np.linspace(0.0, 100.0, 101)
    one, other = plot.Line("ground", often, 0.2 * often, "#000000"), plot.Line("air", seldom, 0.2 * seldom, "#111111")
    assert ">air (same as ground)<" in plot.plot("speed", "m/s", [one, other], (0.0, 100.0))
    half = plot.Line("half", seldom[:51], 0.2 * seldom[:51], "#111111")
    assert ">half<" in plot.plot("speed", "m/s", [one, half], (0.0, 100.0))
    level = np.zeros(501)
    roll, pitch = plot.Line("roll", often, level, "#000000", turn=360.0), plot.Line("pitch", often, level, "#111111")
    assert ">pitch (same as roll)<" in plot.plot("angles", "deg", [roll, pitch], (0.0, 100.0), least=1e-3)
