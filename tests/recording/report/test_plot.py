"""Plots: every extreme is drawn where it belongs, thin or not; ticks are round."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.charts import Axis, Chart, Charts, Dots, Line, Remark, Rule, over
from sinssim.recording import page, svg, svg_chart
from sinssim.recording.style import envelope, tick_label, ticks
from sinssim.recording.svg import pieces
from sinssim.recording.svg_chart import html_of, svg_of
from sinssim.units import DEG, fixed, suiting

SVG = "{http://www.w3.org/2000/svg}"


def plot(*marks: Any, span: tuple[float, float] = (0.0, 100.0), title: str = "x", unit: Any = "m", **y: Any) -> str:
    """Return a plot over time of which 190 px by about 500 px are within the axes."""
    units = fixed(unit) if isinstance(unit, str) else unit
    return svg_of(Chart(key="k", title=title, x=over(span), y=Axis(units=units, **y), marks=marks), 554.0, 276.0)


def line(y: Any, x: Any = None, label: str = "", **more: Any) -> Line:
    y = np.asarray(y, dtype=np.float64)
    return Line(label=label, x=np.arange(float(len(y))) if x is None else np.asarray(x), y=y, color="#123456", **more)


def inner_of(drawn: str) -> Any:
    """Return the element within the axes."""
    return ET.fromstring(drawn).find(f"{SVG}svg")


def lines_of(drawn: str) -> list[np.ndarray]:
    """Return the points of each line, px from the upper left corner of the axes, of 500 px by 190 px."""
    inner = inner_of(drawn)
    corner = np.array([float(inner.get("x")), float(inner.get("y"))])
    size = np.array([float(inner.get("width")), float(inner.get("height"))])
    return [
        (np.array([[float(v) for v in pair.split(",")] for pair in one.get("points").split()]) - corner)
        * [500.0, 190.0] / size
        for one in inner.iter(f"{SVG}polyline")
    ]  # fmt: skip


def texts(drawn: str) -> dict[str, tuple[float, float, str]]:
    found = ET.fromstring(drawn).iter(f"{SVG}text")
    return {
        "".join(t.itertext()): (float(t.get("x", 0)), float(t.get("y", 0)), t.get("text-anchor", "")) for t in found
    }


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


def test_points_lie_where_the_axes_say() -> None:
    drawn = plot(line([0.0, 4.0, 10.0], [0.0, 50.0, 100.0]), title="height", low=0.0, high=10.0)
    (points,) = lines_of(drawn)
    np.testing.assert_allclose(points, [[0.0, 190.0], [250.0, 114.0], [500.0, 0.0]], atol=0.1)
    assert list(texts(drawn))[:7] == ["height [m]", "0", "20", "40", "60", "80", "100"]
    assert {"2", "4", "6", "8", "10"} <= set(texts(drawn))


def test_values_are_drawn_in_the_unit_that_the_axis_names() -> None:
    drawn = plot(line([0.0, 18520.0], [0.0, 100.0]), unit=fixed("nmi", 1852.0), title="distance")
    assert {"distance [nmi]", "0", "2", "4", "6", "8", "10"} <= set(texts(drawn))
    np.testing.assert_allclose(lines_of(drawn)[0][:, 1], [190.0, 0.0], atol=0.1)


def test_a_drawn_line_reaches_every_extreme_and_follows_the_curve() -> None:
    time = np.arange(506_401) / 100.0
    values = 3.0 * np.sin(time / 300.0)
    values[250_000] = 5.0
    (points,) = lines_of(plot(line(values, time), span=(0.0, 5064.0), low=-4.0, high=6.0))
    assert len(points) < 1010
    scale = 190.0 / (6.0 + 4.0)
    y = points[:, 1] / -scale + 6.0
    assert y.max() == pytest.approx(5.0, abs=0.01)
    t = points[:, 0] / 500.0 * 5064.0
    quiet = np.abs(t - 2500.0) > 15.0
    np.testing.assert_allclose(y[quiet], 3.0 * np.sin(t[quiet] / 300.0), rtol=0, atol=1.5 / scale)


def test_an_angle_that_wraps_is_not_drawn_across() -> None:
    time = np.arange(3601.0)
    heading = (350.0 + 0.1 * time) % 360.0 * DEG
    drawn = plot(line(heading, time, turn=2.0 * np.pi), span=(0.0, 3600.0), unit=fixed("deg", DEG), low=0.0,
                 high=2.0 * np.pi, ticks=tuple(np.radians((0.0, 90.0, 180.0, 270.0, 360.0))))  # fmt: skip
    before, after = lines_of(drawn)
    assert before[:, 1].max() < 6.0  # from 350 to 360 of 360 deg
    assert np.ptp(after[:, 1]) == pytest.approx(190.0 * 350.0 / 360.0, abs=0.6)
    assert {"0", "90", "180", "270", "360"} <= set(texts(drawn))


def test_what_is_no_number_is_left_out() -> None:
    drawn = plot(line([0.0, 1.0, np.inf, 2.0, np.nan]), span=(0.0, 4.0))
    assert sum(len(points) for points in lines_of(drawn)) == 3
    assert "nan" not in drawn
    assert lines_of(plot(line([np.nan, np.nan]), span=(0.0, 1.0))) == []


@pytest.mark.parametrize("value", [0.0, 5.0, -1e-9, 6.4e6])
def test_a_constant_lies_inside_its_axes(value: float) -> None:
    (points,) = lines_of(plot(line(np.full(9, value)), span=(0.0, 8.0)))
    assert set(points[:, 1]) == {points[0, 1]}
    assert 0.0 < points[0, 1] < 190.0


def test_rounding_is_not_blown_up_to_fill_a_plot() -> None:
    rng = np.random.default_rng(1)
    drawn = plot(line(1e-14 * rng.standard_normal(9)), span=(0.0, 8.0), least=1e-3)
    assert np.ptp(lines_of(drawn)[0][:, 1]) == 0.0


def test_marks_stay_on_the_paper_and_off_one_another() -> None:
    marks = [Rule(at=at, upright=True, text=text, dash=":")
             for at, text in ((0.0, "begins here"), (1.0, "too near"), (100.0, "T = 84.4 min"))]  # fmt: skip
    drawn = plot(*marks, line([0.0, 1.0], [0.0, 100.0]))
    found = texts(drawn)
    assert "too near" not in found
    assert found["T = 84.4 min"][0] + 5.9 * len("T = 84.4 min") < 554.0
    assert len(inner_of(drawn).findall(f"{SVG}polyline")) == 4


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


def test_the_legend_says_which_lines_coincide() -> None:
    time = np.linspace(0.0, 100.0, 5001)
    lines = [
        line(np.sin(time), time, "first"),
        line(np.sin(time) + 1e-3, time, "second"),  # 0.1 px of 190 px for a range of 2
        line(np.sin(time) + np.where(np.arange(5001) == 2500, 0.1, 0.0), time, "third"),
    ]
    drawn = plot(*lines)
    assert ">second (same as first)<" in drawn
    assert ">third<" in drawn
    assert ">first<" in drawn


def test_lines_of_other_instants_and_angles_coincide() -> None:
    """True airspeed is logged at other instants than the ground speed; roll may turn over, pitch does not."""
    often, seldom = np.linspace(0.0, 100.0, 501), np.linspace(0.0, 100.0, 101)
    ground, air = line(0.2 * often, often, "ground"), line(0.2 * seldom, seldom, "air")
    assert ">air (same as ground)<" in plot(ground, air)
    assert ">half<" in plot(ground, line(0.2 * seldom[:51], seldom[:51], "half"))
    level = np.zeros(501)
    roll, pitch = line(level, often, "roll", turn=360.0), line(level, often, "pitch")
    assert ">pitch (same as roll)<" in plot(roll, pitch, least=1e-3)


def test_a_plot_to_the_pixel() -> None:
    """480 px for 10…34 s, 190 px for −4…6 m: 20 px a second, 19 px a metre, below title and texts of marks."""
    marks = (Rule(at=22.0, upright=True, text="here", dash=":"), Rule(at=28.0, upright=True, color="grid"))
    chart = Chart(key="k", title="name", x=over((10.0, 34.0)), y=Axis(units=fixed("m"), low=-4.0, high=6.0),
                  marks=(*marks, line([-4.0, 6.0, 1.0], [10.0, 16.0, 34.0], weight="bold", dash="--")))  # fmt: skip
    drawn = svg_of(chart, 534.0, 276.0)
    found = texts(drawn)
    left, top, bottom = 40.0, 41.0, 231.0  # the title ends at 22, texts need 11, and there are 8 above the axes
    assert found["name [m]"][:2] == (left, 15.0)
    assert {name: found[name] for name in ("−4", "0", "6")} == {
        "−4": (left - 6.0, bottom + 4.0, "end"), "0": (left - 6.0, bottom - 76.0 + 4.0, "end"),
        "6": (left - 6.0, top + 4.0, "end"),
    }  # fmt: skip
    assert found["12"] == (left + 40.0, bottom + 15.0, "middle")  # every 3 s: at most nine steps
    assert found["33"] == (left + 460.0, bottom + 15.0, "middle")
    assert found["time [s]"] == (left + 480.0, bottom + 34.0, "end")
    assert found["here"][1] == top - 4.0
    assert abs(found["here"][0] + 0.5 * 0.92 * 6.4 * 4 - (left + 240.0)) < 0.1  # in the middle over its line
    inner = inner_of(drawn)
    assert [float(inner.get(k)) for k in ("x", "y", "width", "height")] == [left, top, 480.0, 190.0]
    here, faint, curve = inner.iter(f"{SVG}polyline")
    assert here.get("points") == f"{left + 240.0:g},{bottom:g} {left + 240.0:g},{top:g}"
    assert here.get("stroke-dasharray") == "1.5 3"
    assert faint.get("points") == f"{left + 360.0:g},{bottom:g} {left + 360.0:g},{top:g}"
    assert curve.get("points") == f"40,231 160,{top:g} 520,136"
    assert (curve.get("stroke"), curve.get("stroke-width"), curve.get("stroke-dasharray")) == ("#123456", "2.4", "6 4")
    paths = [(p.get("class"), p.get("d")) for p in ET.fromstring(drawn).findall(f"{SVG}path")]
    assert ("axis", "M40.0 231.0L520.0 231.0M40.0 155.0L520.0 155.0") in paths


def test_discs_of_several_colours_have_half_their_size_as_radius() -> None:
    x, y, colors = np.array([10.0, 30.0]), np.array([20.0, 40.5]), ("#123456", "hollow")
    assert svg.shapes_of(x, y, colors, "o", 9.0) == (
        '<circle cx="10.0" cy="20.0" r="4.5" fill="#123456"/>'
        '<circle cx="30.0" cy="40.5" r="4.5" class="block" fill="#fff"/>'
    )


def test_remarks_stand_above_or_below_their_points() -> None:
    """To the right and above as a rule; a line of words below the point begins 15 px lower."""
    places = (("above", {}), ("under", {"below": True}), ("left", {"left": True}), ("pale", {"soft": True}))
    said = tuple(Remark(x=50.0, y=5.0, text=name, **where) for name, where in places)
    found = texts(plot(line([0.0, 10.0], [0.0, 100.0]), *said, low=0.0, high=10.0))
    x, y, _ = found["above"]
    x, y = x - 7.0, y + 6.0  # the point, px
    assert found["under"] == pytest.approx((x + 7.0, y + 15.0, "start"))
    assert found["left"] == pytest.approx((x - 7.0, y - 6.0, "end"))
    assert found["pale"] == pytest.approx((x + 3.0, y - 3.0, "start"))


def test_a_given_axis_dots_and_zero() -> None:
    dotted = Dots(x=np.array([0.0, 50.0]), y=np.array([1.0, -2.0]), color="#010203", size=3.0)
    drawn = plot(dotted, unit="σ", low=-6.0, high=6.0, ticks=(-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0))
    assert {"−6", "−4", "−2", "0", "2", "4", "6"} <= set(texts(drawn))
    (dots,) = inner_of(drawn).findall(f"{SVG}path")
    assert (dots.get("stroke"), dots.get("stroke-width"), dots.get("stroke-linecap")) == ("#010203", "4", "round")
    assert dots.get("d").count("h0") == 2
    high = plot(line([30.0, 40.0]), span=(0.0, 1.0), low=0.0)
    assert {"0", "10", "20", "30", "40"} <= set(texts(high))
    reference = line([0.0, 900.0], counts=False)
    assert "900" not in texts(plot(reference, line([30.0, 40.0]), span=(0.0, 1.0)))


def test_equal_axes_have_one_scale_and_fit_into_the_drawing() -> None:
    """The longer axis is across, then upright."""
    for east, north, height in ((200.0, 50.0, 900.0), (50.0, 200.0, 400.0)):
        x, y = (Axis(units=fixed("m"), low=0.0, high=end) for end in (east, north))
        inner = inner_of(svg_of(Chart(key="k", x=x, y=y, marks=(line([1.0, 2.0]),), equal=True), 600.0, height))
        assert float(inner.get("width")) * north == pytest.approx(float(inner.get("height")) * east, rel=1e-5)
        assert float(inner.get("height")) <= height


def test_a_legend_breaks_its_lines() -> None:
    """An entry is 44 px and 6.4 px a letter wide."""
    names = [svg_chart.Named(name, "#010203", "line") for name in ("a" * 20, "b" * 10, "c" * 10)]
    drawn, end = svg_chart._legend(names, 40.0, 22.0, 500.0)
    found = texts(f'<svg xmlns="http://www.w3.org/2000/svg">{drawn}</svg>')
    # 40, then + 44 + 128 = 212, then + 44 + 64 = 320, which ends at 428
    assert [found[name][:2] for name in ("a" * 20, "b" * 10, "c" * 10)] == [(71.0, 32.0), (243.0, 32.0), (351.0, 32.0)]
    assert end == 36
    drawn, end = svg_chart._legend(names, 40.0, 22.0, 420.0)
    found = texts(f'<svg xmlns="http://www.w3.org/2000/svg">{drawn}</svg>')
    assert found["c" * 10][:2] == (71.0, 48.0)
    assert end == 52
    assert 'points="40,28 66,28"' in drawn


def test_angles_are_cut_where_they_jump_by_more_than_half_a_turn() -> None:
    values = [170.0, -10.0, 171.0, 179.0, -179.0]
    assert [(t.tolist(), v.tolist()) for t, v in pieces(line(values, turn=360.0))] == [
        ([0.0, 1.0], [170.0, -10.0]), ([2.0, 3.0], [171.0, 179.0]), ([4.0], [-179.0]),
    ]  # fmt: skip


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
    assert whole.endswith("own {}</style></head>\n<body><main>\none\ntwo\n</main></body></html>\n")


def test_charts_that_share_names_stay_beside_each_other_on_a_narrow_page() -> None:
    """Two may stand below each other, three in rows of two; the second of two with common names has none itself."""
    x = np.array([0.0, 1.0])

    def kind(count: int, share: Any = "", **axis: Any) -> str:
        row = tuple(Chart(key=f"{k}", y=Axis(**axis), marks=(line(x, x),)) for k in range(count))
        return re.findall('<div class="(row[^"]*)"', html_of(Charts("k", (row,), (8.0, 2.0), share=share)))[0]

    assert [kind(2), kind(3), kind(2, "x")] == ["row two", "row many", "row two"]
    assert [kind(2, names=("a", "b")), kind(3, "y")] == ["row", "row"]


def test_charts_of_a_row_stand_at_one_height() -> None:
    """Title and label are 39 px high, a title alone 22; 8 px are between them and the axes."""
    x = np.array([0.0, 1.0])
    row = tuple(Chart(key=name, title=name, y=Axis(label=name), marks=(line(x, x),)) for name in ("label", ""))
    found = re.findall(r'<svg x="[^"]*" y="(\d+)"', html_of(Charts("k", (row,), (8.0, 2.0))))
    assert found == ["47", "47"]
    assert re.findall(r'<svg x="[^"]*" y="(\d+)"', svg_of(row[1], 400.0, 200.0)) == ["30"]


def test_a_drawing_to_the_pixel() -> None:
    """A box is 14 px high and 15 px a line; an arrow's head is 9 px long and 7.2 px wide, its line ends before."""
    d = svg.Drawing(200.0, 100.0, "about <it>")
    block = d.box(100.0, 50.0, 80.0, ["one", "two", "x{nb}"], "#010203")
    assert (block.left, block.right, block.top, block.bottom) == (
        (60.0, 50.0), (140.0, 50.0), (100.0, 20.5), (100.0, 79.5),
    )  # fmt: skip
    d.circle(20.0, 30.0, 11.0, "#040506", "+")
    d.line([(10.0, 20.0), (10.0, 60.0), (50.0, 90.0)], "#070809", dashes="5 4", width=2.5)
    d.line([(1.0, 2.0), (3.0, 4.0)], head=False)
    drawn = d.svg()
    assert 'viewBox="0 0 200 100"' in drawn
    assert 'aria-label="about &lt;it&gt;"' in drawn
    assert '<rect x="60.0" y="20.5" width="80.0" height="59.0"' in drawn
    assert [round(y - 4.2, 6) for y in (float(t) for t in re.findall(r'<text x="100.0" y="([\d.]+)"', drawn))] == [
        35.0, 50.0, 65.0,
    ]  # fmt: skip
    assert '<tspan dy="3" font-size="9.5">nb</tspan>' in drawn
    assert '<circle cx="20.0" cy="30.0" r="11.0" class="block" fill="#fff" stroke="#040506"' in drawn
    # along (0.8, 0.6): 6.3 px before the tip; 9 px behind it, 3.6 px aside along (−0.6, 0.8)
    assert '<polyline points="10.0,20.0 10.0,60.0 45.0,86.2" fill="none" stroke="#070809" stroke-width="2.5"' in drawn
    assert '<polygon points="50.0,90.0 40.6,87.5 45.0,81.7" fill="#070809"/>' in drawn
    assert 'stroke-dasharray="5 4"' in drawn
    assert '<polyline points="1.0,2.0 3.0,4.0" fill="none" stroke="#555555"' in drawn
    assert drawn.count("<polygon") == 1


def test_words_on_a_line_and_an_arc_to_the_pixel() -> None:
    """Words stand 13 px above a level line, 8 px to the right of an upright one; angles run counter-clockwise."""
    d = svg.Drawing(200.0, 100.0, "about")
    d.line([(10.0, 50.0), (30.0, 50.0), (30.0, 90.0)], "#010203", "level")
    d.line([(60.0, 20.0), (60.0, 80.0)], words="upright")
    d.arc((100.0, 50.0), 40.0, 0.0, np.pi / 2.0, flat=0.5)
    drawn = d.svg()
    words = re.findall(r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="(\w+)"[^>]*>(\w+)', drawn)
    assert words == [("20.0", "41.2", "middle", "level"), ("68.0", "54.2", "start", "upright")]
    assert 'style="fill:#010203">level' in drawn
    x, y = np.array([pair.split(",") for pair in re.findall(r'points="([^"]+)"', drawn)[-1].split()], float).T
    assert (x[0], y[0], x[-1], y[-1]) == (140.0, 50.0, 100.0, 30.0)
    np.testing.assert_allclose(((x - 100.0) / 40.0) ** 2 + ((y - 50.0) / 20.0) ** 2, 1.0, atol=0.006)  # 0.05 px


def test_lines_in_the_colour_of_words_are_legible_on_a_dark_page() -> None:
    """What is drawn in ink or as a hollow mark takes the colours of the page."""
    from sinssim.recording import style
    from sinssim.recording.svg_chart import STYLE

    x = np.array([0.0, 1.0])
    drawn = svg_of(
        Chart(key="k", x=Axis(), y=Axis(), marks=(Line(x=x, y=x, color="ink", marker="s", hollow=True),)), 400.0, 200.0
    )
    assert f'stroke="{style.INK}"' in drawn
    assert 'class="block"' in drawn
    assert f'svg [stroke="{style.INK}"] {{ stroke: var(--ink); }}' in STYLE
    assert "svg .block { fill: var(--paper); }" in STYLE


def test_where_a_curve_hardly_changes_in_a_column_it_has_one_point() -> None:
    """Lowest and highest of 100 columns; those of less than a pixel in one column and a half are their middle."""
    left = np.arange(100.0)
    x = np.column_stack((left, left + 0.5)).ravel()
    low, high = 2.0 * left, 2.0 * left + 0.5
    high[7] += 9.0
    px, py = svg._settled(x, np.column_stack((low, high)).ravel())
    assert px.tolist() == [*left[:8], 7.5, *left[8:], 99.5]
    assert py.tolist() == [*(low[:7] + 0.25), 14.0, 23.5, *(low[8:] + 0.25), low[99] + 0.25]
    few = np.arange(198.0)
    assert svg._settled(few, few)[0] is few


def test_an_area_has_at_most_1200_points_on_each_side() -> None:
    """Along its lower side and back along the upper one, without what is not known."""
    x = np.arange(5000.0)
    text = svg._area(x, x + 1.0, np.where(x == 0.0, np.nan, x + 2.0), "red", 0.25)
    around = re.findall(r"([\d.]+),([\d.]+)", text)
    assert len(around) == 2400
    assert around[0] == ("1", "2")
    assert around[1199:1201] == [("4999", "5000"), ("4999", "5001")]
    assert around[-1] == ("1", "3")
    assert 'fill="red" fill-opacity="0.25"' in text
    assert svg._area(x[:1], x[:1], x[:1], "red", 0.25) == ""


def test_the_legend_of_several_charts_has_their_name() -> None:
    line = Line(label="first", x=np.arange(2.0), y=np.arange(2.0))
    chart = Chart(key="k", x=over((0.0, 1.0)), y=Axis(label="y", units=fixed("m")), marks=(line, line))
    text = svg_chart._common_legend(Charts("g", ((chart,), (chart,)), (6.0, 3.0), named="solution"))
    assert re.findall(r">([^<]+)</text>", text) == ["solution:", "first"]
    assert svg_chart._common_legend(Charts("g", ((replace(chart, marks=()),),), (6.0, 3.0))) == ""
