"""Curves that can be zoomed: what the script of a page receives, and what it draws and says in a real browser."""

from __future__ import annotations

import base64
import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.charts import TIME, Axis, Band, Bars, Chart, Charts, Dots, Limit, Line, Remark, Rule, Shares, over
from sinssim.exhibits import Exhibits
from sinssim.recording.interactive.live_chart import can_live
from sinssim.recording.page import page_of
from sinssim.recording.svg_chart import html_of
from sinssim.units import DEG, LENGTH_SCALE, fixed
from tests.browser import CHROMIUM, Page, file_address


def chart(*marks: Any, y: Axis | None = None, end: float = 3600.0, **more: Any) -> Chart:
    return Chart(key="k", x=over((0.0, end)), y=y or Axis(label="error", units=fixed("m")), marks=marks, **more)


def group(*charts: Chart, **more: Any) -> Charts:
    return Charts("g", tuple((one,) for one in charts), (6.0, 3.0), **more)


def data_of(*charts: Chart, **more: Any) -> list[dict[str, Any]]:
    found = re.findall(r'data-chart="([^"]*)"', html_of(group(*charts, **more)))
    return [json.loads(html.unescape(text)) for text in found]


def numbers(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f4").astype(np.float64)


def points(data: dict[str, Any], number: int = 0) -> tuple[np.ndarray, np.ndarray]:
    curve = data["curves"][number]
    return numbers(data["places"][curve["x"]]), numbers(curve["y"])


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
    assert len(x) < 2000
    assert (y.min(), y.max()) == (-8.0, 9.0)
    assert abs(60.0 * x[y.argmax()] - time[77_777]) < 2.0 * 3600.0 / 500.0
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
    np.testing.assert_allclose(numbers(data["bands"][0]["low"]), [-0.005, 1.795, 3.595], rtol=1e-6)
    np.testing.assert_allclose(numbers(data["bands"][0]["high"]), [0.005, 1.805, 3.605], rtol=1e-6)
    assert [(word["x"], word["y"], word["text"]) for word in data["words"]] == [(20.0, 2.5, "d")]
    assert [(rule["at"], rule["upright"], rule["band"], rule["until"]) for rule in data["rules"]] == [
        (30.0, True, [], None), (0.1, False, [0.09, 0.11], None),
        (3.0, False, [], None), (9e6, False, [], None), (3.5, False, [], 10.0),
    ]  # fmt: skip
    assert [rule["name"].endswith(" (above the plot)") for rule in data["rules"][2:]] == [False, True, False]
    shares = Shares(x=time, parts=np.array([[0.2] * 3, [0.8] * 3]), labels=("low", "high"), colors=("cep", "r95"))
    (data,) = data_of(chart(shares))
    assert [band["name"] for band in data["bands"]] == ["high", "low"]
    np.testing.assert_allclose([numbers(band["low"])[1] for band in data["bands"]], [0.2, 0.0], rtol=1e-6)
    np.testing.assert_allclose([numbers(band["high"])[1] for band in data["bands"]], [1.0, 0.2], rtol=1e-6)


def test_which_charts_can_be_zoomed() -> None:
    time = np.array([0.0, 1.0])
    line = Line(x=time, y=time)
    assert can_live(chart(line))
    assert not can_live(chart(line, equal=True))
    assert not can_live(chart(Line(x=time[::-1], y=time)))
    assert not can_live(chart(Dots(x=time, y=time)))
    assert not can_live(chart(line, Bars(places=time, values=time)))
    assert not can_live(Chart(key="k", x=Axis(label="rate", units=fixed("Hz")), y=Axis(), marks=(line,)))
    assert can_live(Chart(key="k", x=TIME, y=Axis(), marks=(line, Dots(x=time, y=time))))


def test_only_a_page_with_curves_has_scripts_and_words_cannot_end_them() -> None:
    time = np.array([0.0, 1.0])
    assert "<script>" not in page_of(Exhibits("t", ()))
    name = '</script><img src=x onerror="alert(1)">'
    text = page_of(Exhibits("t", (group(chart(Line(label=name, x=time, y=time), title=name)),)))
    assert text.count("<script>") == text.count("</script>") == 1
    assert "<img" not in text
    script = text[text.index("<script>") :]
    assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|import\(|\beval\b|new Image|\.src\b|innerHTML", script)
    assert re.findall(r"https?://[^\"' ]+", script) == ["https://github.com/leeoniya/uPlot"]


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")
class TestInBrowser:
    """The page in Chromium: y = t/10 m over an hour, and half of it with few points in a second chart."""

    @pytest.fixture
    def page(self, tmp_path: Path) -> Any:
        time = np.linspace(0.0, 3600.0, 3601)
        one = chart(Line(label="whole", x=time, y=0.1 * time), Line(label="ends", x=time[::3600], y=0.2 * time[::3600]))
        two = chart(Line(label="half", x=time[::100], y=0.05 * time[::100]), y=Axis(label="e", units=LENGTH_SCALE))
        path = tmp_path / "page.html"
        path.write_text(page_of(Exhibits("t", (group(one, two),))), encoding="utf-8")
        with Page(size=(1250, 1000)) as page:
            page.open(file_address(path))
            for _ in range(60):
                page.wait(0.5)
                if page.value("document.querySelectorAll('.drawn').length") == 2:
                    break
            yield page

    @staticmethod
    def place(page: Page, fraction: float) -> tuple[float, float]:
        """Return where the first chart shows a fraction of its time, px."""
        x, y, width = page.value(
            "(() => {const r = document.querySelector('.u-over').getBoundingClientRect(); return [r.left, r.top + 20, "
            "r.width]})()"
        )
        return round(x + fraction * width), y

    @staticmethod
    def readings(page: Page) -> list[float]:
        texts = page.value("[...document.querySelectorAll('.u-value')].map(e => e.textContent)")
        return [float(text.split("\xa0")[0].replace("−", "-")) for text in texts]

    def test_the_cursor_reads_every_curve_of_every_chart(self, page: Page) -> None:
        page.mouse(("mouseMoved", *self.place(page, 0.5)))
        page.wait(0.5)
        minutes, whole, ends, other, half = self.readings(page)
        assert abs(minutes - 30.0) < 0.2
        np.testing.assert_allclose([whole, ends, half], [6.0 * minutes, 12.0 * minutes, 3.0 * minutes], rtol=1e-3)
        assert other == pytest.approx(minutes, abs=0.1)
        assert page.problems == []

    def test_dragging_zooms_all_charts_and_a_double_click_returns(self, page: Page) -> None:
        begin, end = self.place(page, 0.25), self.place(page, 0.5)
        inside = (end[0] - 30.0, end[1])
        page.mouse(("mouseMoved", *begin), ("mousePressed", *begin), ("mouseMoved", *inside), ("mouseMoved", *end),
                   ("mouseReleased", *end))  # fmt: skip
        page.wait(0.5)
        page.mouse(("mouseMoved", *self.place(page, 1.0 / 3.0)))
        page.wait(0.5)
        minutes, whole, _, other, half = self.readings(page)
        assert abs(minutes - 20.0) < 0.2
        np.testing.assert_allclose([whole, half], [6.0 * minutes, 3.0 * minutes], rtol=1e-3)
        assert other == pytest.approx(minutes, abs=0.1)
        at = self.place(page, 0.5)
        for clicks in (1, 2):
            page.mouse(("mousePressed", *at), ("mouseReleased", *at), clicks=clicks)
        page.wait(0.5)
        page.mouse(("mouseMoved", at[0] + 1.0, at[1]), ("mouseMoved", *at))
        page.wait(0.5)
        assert abs(self.readings(page)[0] - 30.0) < 0.2

    def test_curves_without_values_leave_the_others(self, page: Page, tmp_path: Path) -> None:
        time, none = np.linspace(0.0, 3600.0, 61), np.empty(0)
        empty = [Line(label="none", x=none, y=none), Line(label="nan", x=time, y=np.full(61, np.nan))]
        charts = [chart(*empty, Line(label="all", x=time, y=time)), *(chart(line) for line in empty)]
        charts += [chart(Line(label="one", x=time[:1], y=time[:1])), chart(Line(label="same", x=time * 0.0, y=time))]
        path = tmp_path / "empty.html"
        path.write_text(page_of(Exhibits("t", (group(*charts),))), encoding="utf-8")
        page.open(file_address(path))
        for _ in range(60):
            page.wait(0.5)
            if page.value("document.querySelectorAll('.u-over').length") == len(charts):
                break
        assert page.value("document.querySelectorAll('.drawn').length") == len(charts)
        assert page.problems == []

    def test_a_chart_that_cannot_be_drawn_keeps_its_still_picture(self, page: Page, tmp_path: Path) -> None:
        time = np.linspace(0.0, 3600.0, 61)
        text = page_of(Exhibits("t", (group(chart(Line(x=time, y=time))),)))
        path = tmp_path / "broken.html"
        path.write_text(text.replace("&quot;curves&quot;", "&quot;torn&quot;"), encoding="utf-8")
        page.open(file_address(path))
        page.wait(2.0)
        assert page.value("getComputedStyle(document.querySelector('.live > svg')).display") == "block"
        assert page.value("document.querySelectorAll('.curves, .drawn').length") == 0

    def test_in_print_the_still_pictures_are_seen(self, page: Page) -> None:
        shown = "[...document.querySelectorAll('.live > svg, .curves')].map(e => getComputedStyle(e).display)"
        assert page.value(shown) == ["none", "block"] * 2
        page.media("print")
        assert page.value(shown) == ["block", "none"] * 2
