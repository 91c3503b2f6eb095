"""Plots: every extreme is drawn where it belongs, thin or not; ticks are round."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from sinssim.recording.report import page, svg_plot
from sinssim.recording.report.svg_plot import Line, Mark
from sinssim.recording.style import envelope, tick_label, ticks
from sinssim.units import suiting

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
    svg = svg_plot.plot(
        "height", "m", [Line("h", time, np.array([0.0, 4.0, 10.0]), "#123456")], (0.0, 100.0), width=580
    )
    (points,) = lines_of(svg)
    assert points.tolist() == [[0.0, 190.0], [250.0, 114.0], [500.0, 0.0]]  # 500 by 190 px inside, 0…10 m
    assert [e.text for e in ET.fromstring(svg).findall(f"{SVG}text")][:7] == [
        "height [m]", "0", "2", "4", "6", "8", "10",
    ]  # fmt: skip


def test_values_are_drawn_in_the_unit_that_the_axis_names():
    time = np.array([0.0, 100.0])
    line = Line("h", time, np.array([0.0, 18520.0]), "#123456", size=1852.0)
    svg = svg_plot.plot("distance", "nmi", [line], (0.0, 100.0))
    assert [e.text for e in ET.fromstring(svg).findall(f"{SVG}text")][1:7] == ["0", "2", "4", "6", "8", "10"]
    assert lines_of(svg)[0][:, 1].tolist() == [190.0, 0.0]


def test_a_drawn_line_reaches_every_extreme_and_follows_the_curve():
    time = np.arange(506_401) / 100.0
    values = 3.0 * np.sin(time / 300.0)
    values[250_000] = 5.0
    (points,) = lines_of(svg_plot.plot("x", "m", [Line("x", time, values, "red")], (0.0, 5064.0), width=580))
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
    svg = svg_plot.plot("heading", "deg", [Line("h", time, heading, "red", turn=360.0)], (0.0, 3600.0),
                    axis=(0.0, 360.0, 90.0))  # fmt: skip
    before, after = lines_of(svg)
    assert before[:, 1].max() < 6.0  # from 350 to 360 of 360 deg
    assert np.ptp(after[:, 1]) == pytest.approx(190.0 * 350.0 / 360.0, abs=0.5)  # half a pixel


def test_what_is_no_number_is_left_out():
    values = np.array([0.0, 1.0, np.inf, 2.0, np.nan])
    svg = svg_plot.plot("x", "m", [Line("x", np.arange(5.0), values, "red")], (0.0, 4.0))
    assert len(lines_of(svg)[0]) == 3
    assert "nan" not in svg
    nothing = svg_plot.plot("x", "m", [Line("x", np.arange(2.0), np.full(2, np.nan), "red")], (0.0, 1.0))
    assert lines_of(nothing) == []


@pytest.mark.parametrize("value", [0.0, 5.0, -1e-9, 6.4e6])
def test_a_constant_lies_inside_its_axes(value):
    svg = svg_plot.plot("x", "m", [Line("x", np.arange(9.0), np.full(9, value), "red")], (0.0, 8.0))
    (points,) = lines_of(svg)
    assert set(points[:, 1]) == {points[0, 1]}
    assert 0.0 < points[0, 1] < 190.0


def test_rounding_is_not_blown_up_to_fill_a_plot():
    rng = np.random.default_rng(1)
    svg = svg_plot.plot("roll", "deg", [Line("r", np.arange(9.0), 1e-14 * rng.standard_normal(9), "red")], (0.0, 8.0),
                    least=1e-3)  # fmt: skip
    assert np.ptp(lines_of(svg)[0][:, 1]) == 0.0


def test_marks_stay_on_the_paper_and_off_one_another():
    marks = [Mark(0.0, "begins here"), Mark(1.0, "too near"), Mark(100.0, "T = 84.4 min")]
    svg = svg_plot.plot("x", "m", [Line("x", np.array([0.0, 100.0]), np.array([0.0, 1.0]), "red")], (0.0, 100.0),
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
    first = svg_plot.Line("first", time, np.sin(time), "#000000")
    lines = [
        first,
        svg_plot.Line("second", time, np.sin(time) + 1e-3, "#111111"),  # 0.1 px of 190 px for a range of 2
        svg_plot.Line("third", time, np.sin(time) + np.where(np.arange(5001) == 2500, 0.1, 0.0), "#222222"),
    ]
    svg = svg_plot.plot("angle", "deg", lines, (0.0, 100.0))
    assert ">second (same as first)<" in svg
    assert ">third<" in svg
    assert ">first<" in svg


def test_lines_of_other_instants_and_angles_coincide():
    """True airspeed is logged at other instants than the ground speed; roll may turn over, pitch does not."""
    often, seldom = np.linspace(0.0, 100.0, 501), np.linspace(0.0, 100.0, 101)
    one, other = (
        svg_plot.Line("ground", often, 0.2 * often, "#000000"),
        svg_plot.Line("air", seldom, 0.2 * seldom, "#111111"),
    )
    assert ">air (same as ground)<" in svg_plot.plot("speed", "m/s", [one, other], (0.0, 100.0))
    half = svg_plot.Line("half", seldom[:51], 0.2 * seldom[:51], "#111111")
    assert ">half<" in svg_plot.plot("speed", "m/s", [one, half], (0.0, 100.0))
    level = np.zeros(501)
    roll, pitch = (
        svg_plot.Line("roll", often, level, "#000000", turn=360.0),
        svg_plot.Line("pitch", often, level, "#111111"),
    )
    assert ">pitch (same as roll)<" in svg_plot.plot("angles", "deg", [roll, pitch], (0.0, 100.0), least=1e-3)


def texts(svg: str) -> dict[str, tuple[float, float, str]]:
    found = ET.fromstring(svg).iter(f"{SVG}text")
    return {
        "".join(t.itertext()): (float(t.get("x", 0)), float(t.get("y", 0)), t.get("text-anchor", "")) for t in found
    }


def test_a_plot_to_the_pixel() -> None:
    """480 px for 10…34 s, 190 px for −4…6 m: 20 px a second, 19 px a metre, below title and marks."""
    time, values = np.array([10.0, 16.0, 34.0]), np.array([-4.0, 6.0, 1.0])
    marks = [Mark(22.0, "here"), Mark(28.0, "", faint=True)]
    svg = svg_plot.plot("name", "m", [Line("", time, values, "#010203", 2.0, "4 5")], (10.0, 34.0), marks=marks)
    found = texts(svg)
    assert found["name [m]"][:2] == (64.0, 15.0)
    top, bottom = 38.0, 228.0  # the title ends at 22, named marks need 16
    assert {name: found[name] for name in ("−4", "0", "6")} == {
        "−4": (58.0, bottom + 4.0, "end"), "0": (58.0, bottom - 76.0 + 4.0, "end"), "6": (58.0, top + 4.0, "end"),
    }  # fmt: skip
    assert found["12"] == (104.0, bottom + 15.0, "middle")  # every 3 s: at most nine steps
    assert found["33"] == (524.0, bottom + 15.0, "middle")
    assert found["time [s]"] == (544.0, bottom + 32.0, "end")
    assert found["here"][1] == top - 4.0
    assert abs(found["here"][0] + 0.5 * 0.92 * 6.4 * 4 - 304.0) < 0.1  # in the middle over its line
    root = ET.fromstring(svg)
    assert root.get("viewBox") == "0 0 560 266"
    inner = root.find(f"{SVG}svg")
    assert inner is not None
    assert [inner.get(k) for k in ("x", "y", "width", "height")] == ["64", "38", "480", "190"]
    (line,) = inner.iter(f"{SVG}polyline")
    assert line.get("points") == "0,190 120,0 480,95"
    assert (line.get("stroke"), line.get("stroke-width"), line.get("stroke-dasharray")) == ("#010203", "2", "4 5")
    paths = [(p.get("class"), p.get("d")) for p in root.findall(f"{SVG}path")]
    assert ("mark", "M304.0 38.0L304.0 228.0") in paths
    assert ("grid", "M424.0 38.0L424.0 228.0") in paths
    assert ("axis", "M64.0 228.0L544.0 228.0M64.0 152.0L544.0 152.0") in paths


def test_a_given_axis_dots_and_zero() -> None:
    dotted = Line("", np.array([0.0, 50.0]), np.array([1.0, -2.0]), "#010203", dots=3.0)
    svg = svg_plot.plot("x", "σ", [dotted], (0.0, 100.0), axis=(-6.0, 6.0, 2.0))
    found = texts(svg)
    assert {"−6", "−4", "−2", "0", "2", "4", "6"} <= set(found)
    assert 'd="M0 79h0M240 126.5h0"' in svg
    high = svg_plot.plot(
        "x", "m", [Line("", np.array([0.0, 1.0]), np.array([30.0, 40.0]), "red")], (0.0, 1.0), from_zero=True
    )
    assert {"0", "10", "20", "30", "40"} <= set(texts(high))
    reference = Line("", np.array([0.0, 1.0]), np.array([0.0, 900.0]), "red", reference=True)
    own = Line("", np.array([0.0, 1.0]), np.array([30.0, 40.0]), "red")
    assert "900" not in texts(svg_plot.plot("x", "m", [reference, own], (0.0, 1.0)))


def test_a_legend_breaks_its_lines() -> None:
    """An entry is 56 px and 6.4 px a letter wide; a row ends 16 px before the edge."""
    lines = [Line(name, np.empty(0), np.empty(0), "#010203") for name in ("a" * 20, "b" * 10, "c" * 10)]
    svg, end = svg_plot.legend(lines, 560)
    found = texts(f'<svg xmlns="http://www.w3.org/2000/svg">{svg}</svg>')
    # 64, then + 56 + 128 = 248, then + 56 + 64 = 368, which ends at 488
    assert [found[name][:2] for name in ("a" * 20, "b" * 10, "c" * 10)] == [(104.0, 34.0), (288.0, 34.0), (408.0, 34.0)]
    assert end == 40
    svg, end = svg_plot.legend(lines, 480)
    found = texts(f'<svg xmlns="http://www.w3.org/2000/svg">{svg}</svg>')
    assert found["c" * 10][:2] == (104.0, 50.0)
    assert end == 56
    assert 'points="64,30 98,30"' in svg
    assert svg_plot.legend(lines[:1], 560) == ("", 22)


def test_angles_are_cut_where_they_jump_by_more_than_half_a_turn() -> None:
    time, values = np.arange(5.0), np.array([170.0, -10.0, 171.0, 179.0, -179.0])
    pieces = list(svg_plot._pieces(Line("", time, values, "red", turn=360.0), 0.0, 4.0, 480))
    assert [(t.tolist(), v.tolist()) for t, v in pieces] == [
        ([0.0, 1.0], [170.0, -10.0]), ([2.0, 3.0], [171.0, 179.0]), ([4.0], [-179.0]),
    ]  # fmt: skip


@pytest.mark.parametrize(("count", "patterns"), [(1, [""]), (2, ["", "9 9"]), (3, ["", "9 9", "4 5"]), (4, [""] * 4)])
def test_dashes(count: int, patterns: list[str]) -> None:
    assert svg_plot.dashes(count) == patterns


def test_a_table() -> None:
    """The first columns hold words; complete cells stay as they are."""
    html = page.table(
        ("a", "<th class=x>b</th>", "c"), [("1", '<td class="text">2</td>', "3")], 1, "<tr><th>u</th></tr>"
    )
    assert html == (
        '<div class="wide"><table><thead><tr><th>u</th></tr><tr><th class=name>a</th><th class=x>b</th><th>c</th></tr>'
        '</thead><tbody>\n<tr><td class=name>1</td><td class="text">2</td><td>3</td></tr>\n</tbody></table></div>'
    )
    assert page.words(" a  <b>\n& 'c' ") == "a &lt;b&gt; &amp; &#x27;c&#x27;"
    assert page.verbatim('a  "<b>"\n') == 'a  "&lt;b&gt;"\n'
    assert page.swatch("#123456") == '<span class="swatch" style="background:#123456"></span>'
    whole = page.page("a < b", ["one", "two"], "own {}")
    assert "<title>a &lt; b</title>" in whole
    assert whole.endswith("own {}</style></head>\n<body>\none\ntwo\n</body></html>\n")


def test_a_drawing_to_the_pixel() -> None:
    """A box is 14 px high and 15 px a line; an arrow's head is 9 px long and 7.2 px wide, its line ends before."""
    d = svg_plot.Drawing(200.0, 100.0, "about <it>")
    d.box(100.0, 50.0, 80.0, ["one", "two", "x{nb}"], "#010203")
    d.circle(20.0, 30.0, 11.0, "#040506", "+")
    d.line([(10.0, 20.0), (10.0, 60.0), (50.0, 90.0)], "#070809", dashes="5 4", width=2.5)
    d.line([(1.0, 2.0), (3.0, 4.0)], head=False)
    svg = d.svg()
    assert 'viewBox="0 0 200 100"' in svg
    assert 'aria-label="about &lt;it&gt;"' in svg
    assert '<rect x="60.0" y="20.5" width="80.0" height="59.0"' in svg
    assert [round(y - 4.2, 6) for y in (float(t) for t in re.findall(r'<text x="100.0" y="([\d.]+)"', svg))] == [
        35.0, 50.0, 65.0,
    ]  # fmt: skip
    assert '<tspan dy="3" font-size="9.5">nb</tspan>' in svg
    assert '<circle cx="20.0" cy="30.0" r="11.0" class="block" fill="#fff" stroke="#040506"' in svg
    # along (0.8, 0.6): 6.3 px before the tip; 9 px behind it, 3.6 px aside along (−0.6, 0.8)
    assert '<polyline points="10.0,20.0 10.0,60.0 45.0,86.2" fill="none" stroke="#070809" stroke-width="2.5"' in svg
    assert '<polygon points="50.0,90.0 40.6,87.5 45.0,81.7" fill="#070809"/>' in svg
    assert 'stroke-dasharray="5 4"' in svg
    assert '<polyline points="1.0,2.0 3.0,4.0" fill="none" stroke="#555555"' in svg
    assert svg.count("<polygon") == 1


def test_lines_in_the_colour_of_words_are_legible_on_a_dark_page() -> None:
    """What is drawn in ink or as a hollow mark takes the colours of the page."""
    from sinssim.charts import Axis, Chart, Line
    from sinssim.recording import style
    from sinssim.recording.report.svg_chart import STYLE, svg_of

    x = np.array([0.0, 1.0])
    drawn = svg_of(
        Chart(key="k", x=Axis(), y=Axis(), marks=(Line(x=x, y=x, color="ink", marker="s", hollow=True),)), 400.0, 200.0
    )
    assert f'stroke="{style.INK}"' in drawn
    assert 'class="block"' in drawn
    assert f'svg [stroke="{style.INK}"] {{ stroke: var(--ink); }}' in STYLE
    assert "svg .block { fill: var(--paper); }" in STYLE
