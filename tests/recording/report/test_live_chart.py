"""Curves that can be zoomed: what the script of a page receives, and what it draws and says in a real browser."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import re
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from sinssim.charts import TIME, Axis, Band, Bars, Chart, Charts, Dots, Limit, Line, Remark, Rule, Shares, over
from sinssim.exhibits import Column, Exhibits, Sentence, Table
from sinssim.recording.live_chart import _thinned, can_live, policy, with_scripts
from sinssim.recording.page import page_of
from sinssim.recording.svg_chart import html_of
from sinssim.units import DEG, LENGTH_SCALE, fixed
from tests.browser import CHROMIUM, Page, file_address
from tests.recording.shown import curves_of


def chart(*marks: Any, y: Axis | None = None, end: float = 3600.0, **more: Any) -> Chart:
    return Chart(key="k", x=over((0.0, end)), y=y or Axis(label="error", units=fixed("m")), marks=marks, **more)


def group(*charts: Chart, **more: Any) -> Charts:
    return Charts("g", tuple((one,) for one in charts), (6.0, 3.0), **more)


def data_of(*charts: Chart, **more: Any) -> list[dict[str, Any]]:
    return curves_of(html_of(group(*charts, **more)))


def numbers(data: dict[str, Any], number: int) -> np.ndarray:
    """Return an array of a chart, read as the page's script does, one number after another."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(data["numbers"]), wbits=-15), np.uint8).reshape(4, -1)
    steps = (planes.astype(np.int64) << np.array([[0], [8], [16], [24]])).sum(axis=0)
    first = sum(data["counts"][:number])
    bits = np.cumsum([(n >> 1) ^ -(n & 1) for n in steps[first : first + data["counts"][number]].tolist()])
    return (bits % 2**32).astype("<u4").view("<f4").astype(np.float64)


def points(data: dict[str, Any], number: int = 0) -> tuple[np.ndarray, np.ndarray]:
    curve = data["curves"][number]
    return numbers(data, curve["x"]), numbers(data, curve["y"])


def test_values_are_those_of_the_axes_units() -> None:
    time = np.linspace(0.0, 3600.0, 61)
    (data,) = data_of(
        chart(Line(label="a", x=time, y=np.radians(time / 60.0)), y=Axis(label="angle", units=fixed("deg", DEG)))
    )
    x, y = points(data)
    assert (data["x"]["unit"], data["y"]["unit"]) == ("min", "deg")
    np.testing.assert_allclose(x, time / 60.0, rtol=1e-6)
    np.testing.assert_allclose(y, time / 60.0, rtol=1e-6)
    assert data["x"]["ends"] == [0.0, 60.0]
    assert data["y"]["ends"] == pytest.approx([0.0, 60.0])


def test_a_long_curve_keeps_its_extremes() -> None:
    time = np.linspace(0.0, 3600.0, 200_001)
    values = np.sin(time)
    values[77_777], values[150_000] = 9.0, -8.0
    x, y = points(*data_of(chart(Line(label="a", x=time, y=values))))
    assert len(x) == 8192
    assert (y.min(), y.max()) == (-8.0, 9.0)
    assert abs(60.0 * x[y.argmax()] - time[77_777]) < 3600.0 / 4096.0
    assert (np.diff(x) >= 0.0).all()


def test_dots_are_as_many_as_in_the_picture() -> None:
    time = np.linspace(0.0, 3600.0, 100_000)
    (data,) = data_of(chart(Line(x=time[:2], y=time[:2]), Dots(x=time, y=time)))
    x, y = points(data, 1)
    np.testing.assert_allclose(60.0 * x, y, rtol=1e-6)
    np.testing.assert_allclose(y[:2], time[[0, 66]], rtol=1e-6)
    assert len(y) == 1516


def test_gaps_and_full_turns_stay_open() -> None:
    time = np.arange(9.0) * 400.0
    values = np.array([1.0, 2.0, np.nan, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    _, y = points(*data_of(chart(Line(label="a", x=time, y=values))))
    np.testing.assert_array_equal(y, values)
    _, y = points(*data_of(chart(Line(label="diverged", x=time[:3], y=np.array([1.0, 1e200, 2.0])))))
    np.testing.assert_array_equal(y, [1.0, np.nan, 2.0])
    angle = np.array([300.0, 350.0, 40.0, 90.0])
    line = Line(label="a", x=time[:4], y=np.radians(angle), turn=2.0 * np.pi)
    (data,) = data_of(chart(line, y=Axis(label="angle", units=fixed("deg", DEG), low=0.0, high=2.0 * np.pi)))
    x, y = points(data)
    np.testing.assert_allclose(y, [300.0, 350.0, np.nan, 40.0, 90.0], rtol=1e-6)
    assert x[2] == x[3] == pytest.approx(800.0 / 60.0)
    assert data["curves"][0]["turns"]


def test_bands_shares_lines_across_limits_and_remarks() -> None:
    """The axes are in km and min."""
    time = np.array([0.0, 1800.0, 3600.0])
    line, band = Line(label="a", x=time, y=time), Band(x=time, low=time - 5.0, high=time + 5.0, color="cep", label="b")
    rules = (Rule(at=1800.0, upright=True, text="half"), Rule(at=100.0, low=90.0, high=110.0, label="c"))
    limits = [
        Limit(text="a", verdict="met", height=height, at=at)
        for height, at in ((3000.0, None), (9e9, None), (3500.0, 600.0))
    ]
    remark, km = Remark(x=1200.0, y=2500.0, text="d"), Axis(label="error", units=fixed("km", 1e3))
    (data,) = data_of(chart(line, band, *rules, *limits, remark, y=km))
    np.testing.assert_allclose(numbers(data, data["bands"][0]["low"]), [-0.005, 1.795, 3.595], rtol=1e-6)
    np.testing.assert_allclose(numbers(data, data["bands"][0]["high"]), [0.005, 1.805, 3.605], rtol=1e-6)
    assert [(word["x"], word["y"], word["text"]) for word in data["words"]] == [(20.0, 2.5, "d")]
    assert [(rule["at"], rule["upright"], rule["band"], rule["until"]) for rule in data["rules"]] == [
        (30.0, True, [], None), (0.1, False, [0.09, 0.11], None),
        (3.0, False, [], None), (9e6, False, [], None), (3.5, False, [], 10.0),
    ]  # fmt: skip
    assert [rule["name"].endswith(" (above the plot)") for rule in data["rules"][2:]] == [False, True, False]
    shares = Shares(x=time, parts=np.array([[0.2] * 3, [0.8] * 3]), labels=("low", "high"), colors=("cep", "r95"))
    (data,) = data_of(chart(shares))
    assert [band["name"] for band in data["bands"]] == ["high", "low"]
    np.testing.assert_allclose([numbers(data, band["low"])[1] for band in data["bands"]], [0.2, 0.0], rtol=1e-6)
    np.testing.assert_allclose([numbers(data, band["high"])[1] for band in data["bands"]], [1.0, 0.2], rtol=1e-6)


def test_gaps_of_a_curve_and_the_width_of_its_columns() -> None:
    """A gap begins the next piece; the width kept is that of the widest column of extremes, s."""
    long = np.linspace(0.0, 3600.0, 400_001)
    values = np.where(np.abs(long - 900.0) < 1.0, np.nan, long)
    line = Line(label="a", x=long, y=values)
    x, y, step = _thinned(line, log=False)
    gap = np.flatnonzero(np.isnan(y))
    assert len(gap) == 1
    assert x[gap[0]] == x[gap[0] + 1] == long[np.flatnonzero(np.isnan(values))[-1] + 1]
    widest = max(899.0 / round(4096.0 * 899.0 / 3600.0), 2699.0 / round(4096.0 * 2699.0 / 3600.0))
    assert step == pytest.approx(widest, rel=1e-4)
    assert _thinned(replace(line, step=9.0), log=False)[2] == 9.0
    assert len(_thinned(line, log=True)[0]) == np.count_nonzero(np.isfinite(values)) + 1


def test_how_marks_are_drawn() -> None:
    """Widths and dots are in pixels, of which a point is 4/3; in minutes and kilometres."""
    at = np.array([0.0, 1800.0, 3600.0])
    marks = (
        Line(label="a", x=at, y=at, color=(1, 2, 3), weight="bold", dash="-."), Line(x=at, y=at, marker="D"),
        Dots(label="b", x=at, y=at, color=(4, 5, 6), size=6.0),
        Rule(at=600.0, upright=True, label="c", color=(7, 8, 9), weight="hair", dash=":"),
        Limit(text="d", verdict="met", height=3000.0, at=1200.0),
        Remark(x=1200.0, y=2500.0, text="e", left=True), Remark(x=0.0, y=0.0, text="f", below=True, soft=True),
    )  # fmt: skip
    (data,) = data_of(chart(*marks, y=Axis(label="error", units=fixed("km", 1e3))))
    assert [(c["name"], c["color"], c["width"], c["dash"], c["dots"], c["turns"]) for c in data["curves"]] == [
        ("a", "#010203", 2.4, [7.0, 3.0, 1.5, 3.0], 0.0, False), ("", data["curves"][1]["color"], 1.5, [], 6.0, False),
        ("b", "#040506", 0.0, [], 8.0, False),
    ]  # fmt: skip
    limit = data["rules"][1]["color"]
    assert data["rules"] == [
        {"name": "c", "color": "#070809", "at": 10.0, "width": 1.0, "dash": [1.5, 3.0], "text": "", "upright": True,
         "band": [], "until": None},
        {"name": "d: met", "color": limit, "at": 3.0, "width": 1.1, "dash": [6.0, 4.0], "text": "", "upright": False,
         "band": [], "until": 20.0},
    ]  # fmt: skip
    assert data["words"] == [
        {"x": 20.0, "y": 2.5, "text": "e", "left": True, "below": False, "soft": False},
        {"x": 0.0, "y": 0.0, "text": "f", "left": False, "below": True, "soft": True},
    ]
    assert data["kept"] == {"step": 0.0, "dots": 1}
    long = np.linspace(0.0, 3600.0, 200_001)
    lines = Line(label="a", x=long, y=long), Line(label="b", x=at, y=at), Dots(x=long[:3000], y=long[:3000])
    (data,) = data_of(chart(*lines))
    assert data["kept"] == {"step": pytest.approx(3600.0 / 4096.0), "dots": 2}


def test_which_charts_can_be_zoomed() -> None:
    time = np.array([0.0, 1.0])
    line = Line(x=time, y=time)
    assert can_live(chart(line))
    assert not can_live(chart(line, equal=True))
    assert not can_live(chart(Line(x=time[::-1], y=time)))
    assert not can_live(chart(line, y=Axis(names=("a", "b"))))
    assert not can_live(chart(line, Dots(x=time, y=time, error=time)))
    assert not can_live(chart(line, Dots(x=time, y=time, color=["x", "y"])))
    assert not can_live(chart(Dots(x=time, y=time)))
    assert not can_live(chart(line, Bars(places=time, values=time)))
    assert not can_live(Chart(key="k", x=Axis(label="rate", units=fixed("Hz")), y=Axis(), marks=(line,)))
    assert can_live(Chart(key="k", x=TIME, y=Axis(), marks=(line, Dots(x=time, y=time))))
    assert can_live(Chart(key="k", x=Axis(label="averaging time", units=fixed("s"), log=True), y=Axis(), marks=(line,)))


def test_only_a_page_with_curves_has_scripts_and_words_cannot_end_them() -> None:
    time = np.array([0.0, 1.0])
    assert "<script>" not in page_of(Exhibits("t", ()))
    name = '</script><img src=x onerror="alert(1)">'
    text = page_of(Exhibits("t", (group(chart(Line(label=name, x=time, y=time), title=name)),)))
    assert text.count("<script>") == text.count("</script>") == 1
    assert "<img" not in text
    script = text[text.index("<script>") :]
    assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|import\(|\beval\b|innerHTML", script)
    assert re.findall(r"\.src\b.{9}", script) == [".src = `data:"]
    assert re.findall(r"https?://[^\"' ]+", script) == ["https://github.com/leeoniya/uPlot"]
    digest = base64.b64encode(hashlib.sha256(script[8 : script.index("</script>")].encode()).digest()).decode()
    rest = "style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
    assert f"default-src 'none'; script-src 'sha256-{digest}'; {rest}" in text
    assert policy(["<p>"]) == f"default-src 'none'; {rest}"


def test_where_the_scripts_of_a_page_are() -> None:
    """A hint above the first chart that can be zoomed, and the scripts at the end; nothing without such a chart."""
    body = ["<h1>", '<figure class="live short">', "<p>", '<figure class="live">', "<i>"]
    found = with_scripts(body)
    assert (found[0], found[2:6]) == ("<h1>", body[1:])
    assert "<script>" in found[6]
    assert "<script>" not in found[1]
    assert len(found) == 7
    assert with_scripts(["<p>"]) == ["<p>"]
    table = '<div class="wide"><table>'
    first, script = with_scripts([table])  # which says when a table is wider than the page
    assert first == table
    assert script.startswith("<script>")
    assert "uPlot" not in script


BAD = '</script><img src=x onerror="window.hit = 1"><b onmouseover=hit()>'
"""A name that means harm."""
EVENTS = (1200.0, 1800.0)


@pytest.fixture(scope="module")
def browser() -> Iterator[Page]:
    """One browser for all tests of this file."""
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with Page(size=(1250, 1000)) as page:
        yield page


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A page: y = t/10 m over an hour at 100 Hz, with a spike, and half of it with few points in a second chart.

    A map has a track that goes 1 m/s to the east.
    """
    time = np.linspace(0.0, 3600.0, 360_001)
    spiky = 0.1 * time
    spiky[200_001] = 400.0
    lines = (Line(label="whole", x=time, y=spiky), Line(label="ends", x=time[::360_000], y=0.2 * time[::360_000]))
    rules = tuple(Rule(at=at, upright=True, text=text) for at, text in zip(EVENTS, ("climb", "turn"), strict=True))
    one = chart(*rules, *lines, title="Error")
    few = time[::10_000]
    two = chart(Line(label=BAD, x=few, y=0.05 * few), y=Axis(label="e", units=LENGTH_SCALE))
    km, some = Axis(units=fixed("km", 1e3), low=0.0, high=4000.0), np.linspace(0.0, 3600.0, 37)
    track = Chart(key="map", x=km, y=km, marks=(Line(x=some, y=np.full(37, 1000.0), time=some),), equal=True)
    items = (Sentence(BAD), Charts("map", ((track,),), (6.0, 3.0)), group(one, two))
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(page_of(Exhibits(BAD, items)), encoding="utf-8")
    return file_address(path)


@pytest.fixture
def page(browser: Page, address: str) -> Page:
    browser.problems.clear()
    browser.requests.clear()
    browser.open(address, "live.drawn.length === 2 && live.drawn.every(chart => chart.seen)")
    browser.drawn()
    return browser


def place(page: Page, fraction: float) -> tuple[float, float]:
    """Return where the first chart shows a fraction of its time, px."""
    x, y, width = page.value(
        "(() => {const r = document.querySelector('.u-over').getBoundingClientRect(); return [r.left, r.top + 20, "
        "r.width]})()"
    )
    return round(x + fraction * width), y


def readings(page: Page) -> list[float]:
    page.drawn()
    texts = page.value("[...document.querySelectorAll('.u-value')].map(e => e.textContent)")
    return [float(text.split("\xa0")[0].replace("−", "-")) for text in texts]


def shown(page: Page) -> list[list[float]]:
    """Return the ends of the time that each chart shows, min."""
    page.drawn()
    return list(page.value("live.drawn.map(({plot}) => [plot.scales.x.min, plot.scales.x.max])"))


def drag(page: Page, begin: float, end: float) -> None:
    """Drag across the first chart between fractions of its width."""
    first, last = place(page, begin), place(page, end)
    page.mouse(("mouseMoved", *first), ("mousePressed", *first), ("mouseMoved", last[0] - 30.0, last[1]),
               ("mouseMoved", *last), ("mouseReleased", *last))  # fmt: skip


def focus(page: Page) -> str:
    """Return what has the focus: its text if it is a button, or its role."""
    return str(
        page.value("(e => e.matches('button, th') ? e.textContent : e.getAttribute('role'))(document.activeElement)")
    )


def test_the_cursor_reads_every_curve_of_every_chart_and_marks_the_map(page: Page) -> None:
    page.mouse(("mouseMoved", *place(page, 0.5)))
    minutes, whole, ends, other, half = readings(page)
    assert abs(minutes - 30.0) < 0.2
    np.testing.assert_allclose([whole, ends, half], [6.0 * minutes, 12.0 * minutes, 3.0 * minutes], rtol=1e-3)
    assert other == pytest.approx(minutes, abs=0.1)
    east = page.value(
        "(() => {const [box, at] = ['.zoomed svg svg', '.here'].map(e => document.querySelector(e)); "
        "return (at.getAttribute('cx') - box.getAttribute('x')) / box.getAttribute('width')})()"
    )
    assert 4000.0 * east == pytest.approx(60.0 * minutes, abs=15.0)
    assert page.problems == []


def test_dragging_zooms_all_charts_and_a_double_click_returns(page: Page) -> None:
    drag(page, 0.25, 0.5)
    for ends in shown(page):
        np.testing.assert_allclose(ends, [15.0, 30.0], atol=0.1)
    page.mouse(("mouseMoved", *place(page, 1.0 / 3.0)))
    minutes, whole, _, other, half = readings(page)
    assert abs(minutes - 20.0) < 0.2
    np.testing.assert_allclose([whole, half], [6.0 * minutes, 3.0 * minutes], rtol=1e-3)
    assert other == pytest.approx(minutes, abs=0.1)
    at = place(page, 0.5)
    for clicks in (1, 2):
        page.mouse(("mousePressed", *at), ("mouseReleased", *at), clicks=clicks)
    assert shown(page) == [[0.0, 60.0]] * 2


def test_the_wheel_zooms_a_chart_only_after_a_click_on_it(page: Page) -> None:
    at = place(page, 0.25)
    page.wheel(*at, -200.0)
    assert shown(page) == [[0.0, 60.0]] * 2
    page.open(page.value("location.href"), "live.drawn.length === 2")
    page.mouse(("mouseMoved", *at), ("mousePressed", *at), ("mouseReleased", *at))
    page.wheel(*at, -200.0)
    (low, high), other = shown(page)
    assert other == [low, high]
    assert high - low == pytest.approx(60.0 * np.exp(-0.5), rel=1e-3)
    assert low + 0.25 * (high - low) == pytest.approx(15.0, abs=0.1)


def test_marks_above_a_chart_show_what_follows_them(page: Page) -> None:
    page.value("document.querySelector('.event').click()")
    for ends in shown(page):
        np.testing.assert_allclose(ends, [20.0, 30.0], rtol=1e-6)
    page.value("document.querySelector('.live').focus()")
    page.key("n")
    np.testing.assert_allclose(shown(page)[0], [30.0, 60.0], rtol=1e-6)
    page.key("p")
    np.testing.assert_allclose(shown(page)[0], [20.0, 30.0], rtol=1e-6)


def test_all_can_be_done_with_keys(page: Page) -> None:
    before = []
    for _ in range(6):
        page.key("Tab")
        before.append(focus(page))
    assert before == ["group", "+", "−", "whole", "3-D", "group"]  # a map, then a chart
    assert page.value("document.activeElement === document.querySelector('.live')")
    assert page.value("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    page.key("Home")
    assert readings(page)[0] == 0.0
    page.key("ArrowRight", shift=True)
    page.key("ArrowRight", "ArrowRight")
    minutes, whole, *_ = readings(page)
    assert minutes == pytest.approx(0.12 * 60.0, abs=0.1)
    assert f"whole: {whole:g}\xa0m" in page.value("document.querySelector('.said').textContent").replace(
        "whole ", "whole: "
    )
    page.key("+", "+")
    low, high = shown(page)[1]
    assert (high - low, low + 0.12 * (high - low)) == pytest.approx((15.0, minutes), abs=0.1)
    page.key("PageDown")
    assert shown(page)[0] == pytest.approx([low + 7.5, high + 7.5])
    page.key("Escape")
    assert shown(page) == [[0.0, 60.0]] * 2
    order = []
    for _ in range(7):
        page.key("Tab")
        order.append(focus(page))
    assert order == ["whole", "ends", "CSV", "PNG", "SVG", "log", "group"]
    page.value("document.querySelector('.live').focus()")
    page.key("Tab", "Enter")
    assert page.value("[live.drawn[0].plot.series[1].show, document.activeElement.getAttribute('aria-pressed')]") == [
        False,
        "false",
    ]


def test_the_scale_of_a_chart_is_linear_or_logarithmic_and_the_address_keeps_it(page: Page) -> None:
    ends = page.value("live.drawn[1].plot.scales.y.max")
    page.value("document.querySelectorAll('.live')[1].querySelector('.log').focus()")
    page.key("Enter")
    page.drawn()
    assert page.value("location.hash.slice(1)") == "log=k"
    assert page.value("document.activeElement.getAttribute('aria-pressed')") == "true"
    places = page.value("[1, 10, 100].map(v => live.drawn.find(chart => chart.figure === "
                        "document.activeElement.closest('.live')).plot.valToPos(v, 'y'))")  # fmt: skip
    assert places[0] - places[1] == pytest.approx(places[1] - places[2], abs=0.01)
    assert places[1] - places[2] > 20.0
    page.key("Enter")
    page.drawn()
    assert page.value("location.hash.slice(1)") == ""
    assert page.value("live.drawn.at(-1).plot.scales.y.max") == ends
    assert page.problems == []


def test_a_scale_is_logarithmic_only_where_values_are_positive(browser: Page, tmp_path: Path) -> None:
    time = np.array([0.0, 1800.0, 3600.0])
    charts = [replace(chart(Line(label="a", x=time, y=np.array(y))), key=key)
              for key, y in (("plus", [0.0, 2.0, 50.0]), ("minus", [-1.0, 2.0, 50.0]))]  # fmt: skip
    path = tmp_path / "page.html"
    path.write_text(page_of(Exhibits("p", (group(*charts),))), encoding="utf-8")
    browser.open(file_address(path) + "#log=plus+minus", "live.drawn.length === 2")
    browser.drawn()
    found = browser.value(
        "live.drawn.map(({key, y, plot, figure}) => [key, y.log, !!figure.querySelector('.log'), plot.scales.y.min])"
    )
    assert sorted(found) == [["minus", False, False, -20.0], ["plus", True, True, 2.0]]


def test_one_finger_moves_the_cursor_and_two_zoom(page: Page) -> None:
    """Fingers at 20 and 40 min that move to 15 and 45 min: two thirds as much is seen."""
    page.touch((place(page, 0.25),), (place(page, 0.3),), (place(page, 0.5),))
    assert readings(page)[0] == pytest.approx(30.0, abs=0.2)
    page.touch((place(page, 1 / 3), place(page, 2 / 3)), (place(page, 0.3), place(page, 0.7)),
               (place(page, 0.25), place(page, 0.75)))  # fmt: skip
    low, high = shown(page)[1]
    assert (high - low, 0.5 * (high + low)) == pytest.approx((40.0, 30.0), abs=0.5)
    assert page.problems == []


def test_zoomed_in_there_are_more_rows_and_no_spike_is_lost(page: Page) -> None:
    drag(page, 0.55, 0.56)
    (low, high), _ = shown(page)
    rows = list(csv.reader(page.value("live.csv(live.drawn[0])").splitlines()))
    assert rows[0] == ["time [min]", "whole [m]", "ends [m]"]
    times, values = np.array([row[:2] for row in rows[1:]], dtype=np.float64).T
    assert (times.min() >= low, times.max() <= high, len(times)) == (
        True,
        True,
        pytest.approx(2.0 * 4096 * (high - low) / 60.0, abs=3),
    )
    assert values.max() == 400.0
    rest = values != 400.0
    np.testing.assert_allclose(values[rest], 6.0 * times[rest], rtol=1e-6)
    assert page.value("live.resolution(live.drawn[0])") == "least and greatest of each 0.88\xa0s"


def test_the_shown_part_goes_to_the_clipboard_and_into_pictures(page: Page) -> None:
    """The table of the clipboard has the very numbers of the page, 4-byte floats; a name needs quotes there."""
    page.allow("clipboardReadWrite")
    page.value("document.querySelectorAll('.live')[1].focus()")
    page.key("Tab", "Tab", "Enter")
    page.drawn()
    rows = list(csv.reader(page.value("navigator.clipboard.readText()").splitlines()))
    few = np.linspace(0.0, 3600.0, 37)
    assert rows[0] == ["time [min]", f"{BAD} [m]"]
    got = np.array(rows[1:], dtype=np.float64).astype(np.float32)
    np.testing.assert_array_equal(got, np.column_stack((few / 60.0, 0.05 * few)).astype(np.float32))
    drawn = ElementTree.fromstring(page.value("live.picture(live.drawn[0])"))
    texts = {e.text for e in drawn.iter() if e.text}
    assert {"Error", "error [m]", "time [min]", "climb", "whole", "ends"} <= texts
    size = [float(drawn.get(name) or 0.0) for name in ("width", "height")]
    lines = [e.get("points", "") for e in drawn.iter() if e.tag.endswith("polyline")]
    assert len(lines) == 2
    assert len(lines[0].split()) // 2 == 8192
    data = page.value(
        "live.png(live.drawn[0]).then(blob => new Promise(done => {const r = new FileReader(); r.onload = () => "
        "done(r.result); r.readAsDataURL(blob)}))"
    )
    image = Image.open(io.BytesIO(base64.b64decode(data.split(",")[1]))).convert("RGB")
    assert image.size == pytest.approx(tuple(2.0 * side for side in size), abs=2)
    assert len(image.getcolors(image.width * image.height) or ()) > 100
    assert page.problems == []


def test_a_name_that_means_harm_stays_text_and_nothing_is_asked_of_the_network(page: Page, address: str) -> None:
    assert page.value("[document.title, document.querySelector('h1').textContent]") == [BAD, BAD]
    assert page.value("[document.querySelectorAll('img, b').length, typeof window.hit]") == [0, "undefined"]
    assert page.requests == [address]
    page.value("document.body.append(Object.assign(document.createElement('script'), {textContent: 'window.hit = 2'}))")
    page.value("document.body.append(Object.assign(document.createElement('img'), {src: 'https://example.org/a.png'}))")
    page.wait(0.2)
    assert page.value("typeof window.hit") == "undefined"
    assert len(page.problems) == 2
    assert all("Content Security Policy" in problem for problem in page.problems)


def test_a_narrow_page_fits(page: Page) -> None:
    page.size(360, 800)
    page.drawn()
    assert page.value("document.documentElement.scrollWidth") <= 360
    page.size(1250, 1000)


def test_the_cursor_reads_surfaces_and_a_wide_table_is_reached_by_keys(browser: Page, tmp_path: Path) -> None:
    """Half-way, the lower surface is 20 m high and the upper one 80 m."""
    time = np.array([0.0, 1800.0, 3600.0])
    shares = Shares(x=time, parts=np.array([[10.0, 20.0, 30.0], [90.0, 80.0, 70.0]]), labels=("low", "high"),
                    colors=("cep", "r95"))  # fmt: skip
    wide = Table(tuple(Column(f"a long head {k}") for k in range(40)), [tuple(range(40))])
    path = tmp_path / "page.html"
    path.write_text(page_of(Exhibits("p", (group(chart(shares)), wide))), encoding="utf-8")
    browser.problems.clear()
    browser.open(file_address(path), "live.drawn.length === 1")
    browser.value("document.querySelector('.live').focus()")
    browser.key("Home", *["ArrowRight"] * 5, shift=True)
    browser.drawn()
    names, values = zip(*(part.split("\xa0")[0].rsplit(" ", 1) for part in browser.value(
        "document.querySelector('.said').textContent").split(", ")), strict=True)  # fmt: skip
    assert names == ("time", "high", "low")
    assert list(map(float, values)) == pytest.approx([30.0, 80.0, 20.0], abs=0.1)
    assert browser.problems == []
    assert browser.value("(t => [t.tabIndex, t.getAttribute('role')])(document.querySelector('.wide'))") == [0, "group"]


def test_curves_without_values_leave_the_others(browser: Page, tmp_path: Path) -> None:
    time, none = np.linspace(0.0, 3600.0, 61), np.empty(0)
    empty = [Line(label="none", x=none, y=none), Line(label="nan", x=time, y=np.full(61, np.nan))]
    charts = [chart(*empty, Line(label="all", x=time, y=time)), *(chart(line) for line in empty)]
    charts += [chart(Line(label="one", x=time[:1], y=time[:1])), chart(Line(label="same", x=time * 0.0, y=time))]
    path = tmp_path / "empty.html"
    path.write_text(page_of(Exhibits("t", (group(*charts),))), encoding="utf-8")
    browser.problems.clear()
    browser.size(1250, 2000)
    browser.open(file_address(path), f"live.drawn.length === {len(charts)}")
    assert browser.value("document.querySelectorAll('.drawn').length") == len(charts)
    assert browser.problems == []
    browser.size(1250, 1000)


def test_a_chart_that_cannot_be_drawn_keeps_its_still_picture(browser: Page, tmp_path: Path) -> None:
    time = np.linspace(0.0, 3600.0, 61)
    text = page_of(Exhibits("t", (group(chart(Line(x=time, y=time))),)))
    path = tmp_path / "broken.html"
    path.write_text(text.replace("&quot;curves&quot;", "&quot;torn&quot;"), encoding="utf-8")
    browser.problems.clear()
    browser.open(file_address(path), "document.querySelector('.live')")
    for _ in range(100):
        if browser.problems:
            break
        browser.wait(0.05)
    assert browser.value("getComputedStyle(document.querySelector('.live > svg')).display") == "block"
    assert browser.value("document.querySelectorAll('.curves, .drawn').length") == 0


def test_in_print_the_still_pictures_are_seen(page: Page) -> None:
    shown = "[...document.querySelectorAll('.live > svg, .curves')].map(e => getComputedStyle(e).display)"
    assert page.value(shown) == ["none", "block"] * 2
    page.media("print")
    assert page.value(shown) == ["block", "none"] * 2
    page.media("screen")
