"""The map of a page: what its script receives, and what it draws at other scales in a real browser."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sinssim.charts import Axis, Chart, Charts, Dots, Ellipses, Line, Remark, ScaleBar, Sites, over
from sinssim.earth.ellipsoids import WGS84
from sinssim.exhibits import Exhibits, Section
from sinssim.recording.page import page_of
from sinssim.recording.track_map import Spread, Track, airports_about, coasts_about, track_map
from sinssim.units import DEG, fixed
from tests.browser import CHROMIUM, Page, file_address

BAD = "</script><img src=x onerror=alert(1)>"
KM = fixed("km", 1e3)


def the_map() -> Chart:
    """A track of 1 m/s to the east through the middle of 4 km by 4 km, with ellipses of 200 m by 100 m."""
    time = np.linspace(0.0, 3600.0, 721)
    track = Line(label="truth", x=time, y=np.full(721, 2000.0), time=time, color="truth")
    at = np.array([0.0, 3600.0])
    ellipses = Ellipses.about(
        at, np.array([[0.0, 2000.0], [3600.0, 2000.0]]), np.array([[[200.0, 0.0], [0.0, 100.0]]] * 2), np.array([1]),
        label="95 %", color="r95",
    )  # fmt: skip
    bar = ScaleBar(
        x=np.array([2000.0, 2000.0, 3000.0, 3000.0]), y=np.array([3900.0, 3890.0, 3890.0, 3900.0]), unit="km", size=1e3
    )
    words = (Remark(x=2000.0, y=3890.0, text="1 km", left=True), Remark(x=3600.0, y=2000.0, text=BAD))
    # of large airports five in the south-west, of others 36 in the north-east, which are too many
    at = [*([200.0 * k, 300.0] for k in range(1, 6)), *([2500.0 + 30.0 * k, 3000.0] for k in range(36))]
    names, large = tuple(f"A{k:03}" for k in range(41)), np.array(at[:5])
    airports = Sites(x=large[:, 0], y=large[:, 1], color="soft", sites=np.array(at), names=names, large=5)
    marks = (airports, track, ellipses, bar, *words, Dots(x=np.array([1800.0]), y=np.array([2000.0]), color="ink"))
    axis = Axis(label="east", units=KM, low=0.0, high=4000.0)
    return Chart(key="map", x=axis, y=Axis(label="north", units=KM, low=0.0, high=4000.0), marks=marks, equal=True)


def test_an_ellipse_holds_95_percent_of_a_normal_distribution() -> None:
    """σ of 4 m to the north and 3 m to the east, then 5 m along north-east and 1 m across; √(−2 ln 0.05) = 2.4477."""
    along = 0.5 * np.array([[26.0, 24.0], [24.0, 26.0]])
    spread = Spread("aided", np.array([0.0, 10.0]), np.array([[[16.0, 0.0], [0.0, 9.0]], along]))
    drawn = spread.ellipses(np.array([0.0, 100.0]), np.array([50.0, 50.0]), np.array([0.0, 10.0]), np.array([10.0]))
    longest, shortest = np.abs(drawn.axes[0])
    assert longest.tolist() == pytest.approx([0.0, 4.0 * 2.447747], abs=1e-5)
    assert shortest.tolist() == pytest.approx([3.0 * 2.447747, 0.0], abs=1e-5)
    assert np.abs(drawn.axes[1, 0]).tolist() == pytest.approx([5.0 * 2.447747 * np.sqrt(0.5)] * 2, rel=1e-5)
    x, y = drawn.x[:-1] - 100.0, drawn.y[:-1] - 50.0  # only that of 10 s
    squares = np.einsum("ki,ij,kj->k", np.column_stack((y, x)), np.linalg.inv(along), np.column_stack((y, x)))
    np.testing.assert_allclose(squares, -2.0 * np.log(0.05), rtol=1e-9)
    inside = np.random.default_rng(1).multivariate_normal([0.0, 0.0], along, 20_000)
    share = np.mean(np.einsum("ki,ij,kj->k", inside, np.linalg.inv(along), inside) < -2.0 * np.log(0.05))
    assert share == pytest.approx(0.95, abs=0.0062)  # four standard errors: by chance one in 16,000


def test_a_map_has_the_ellipses_of_a_solution_where_it_is() -> None:
    time = np.linspace(0.0, 600.0, 601)
    latitude = 0.8 + 1e-5 * time
    tracks = [
        Track("truth", time, latitude, np.zeros(601), "truth"),
        Track("aided", time, latitude, np.full(601, 1e-4), "aided"),
    ]
    spread = Spread("aided", np.array([0.0, 300.0, 600.0]), np.tile(np.eye(2), (3, 1, 1)))
    (chart,) = track_map(tracks, WGS84, spread=spread)
    (ellipses,) = [mark for mark in chart.marks if isinstance(mark, Ellipses)]
    aided = next(mark for mark in chart.marks if isinstance(mark, Line) and mark.label == "aided")
    assert ellipses.centres[[0, -1]] == pytest.approx(np.column_stack((aided.x[[0, -1]], aided.y[[0, -1]])))
    assert sum(isinstance(mark, Ellipses) for mark in track_map(tracks, WGS84)) == 0


def test_a_map_has_the_ellipses_of_all_runs_and_the_planned_path() -> None:
    """Of a vehicle at rest, 100 m to the south and 200 m to the east of it, with σ of 500 m: the map shows their whole.
    The planned path begins 1 km to the north; at 45°, the radius of the meridian is 6367.4 km."""
    track = Track("true", np.array([0.0, 600.0]), np.full(2, np.pi / 4.0), np.zeros(2), "truth")
    spread = Spread("true", np.array([0.0, 600.0]), np.tile(np.diag([500.0**2] * 2), (2, 1, 1)),
                    np.tile([-100.0, 200.0], (2, 1)), "of all runs")  # fmt: skip
    north = np.pi / 4.0 + np.array([1000.0, 2000.0]) / 6_367_382.0
    chart = next(iter(track_map([track], WGS84, spread=spread, planned=[(north, np.zeros(2))])))
    (ellipses,) = [mark for mark in chart.marks if isinstance(mark, Ellipses)]
    assert ellipses.label == "95 % of all runs"
    assert ellipses.centres.tolist() == pytest.approx(np.array([[200.0, -100.0]] * 2))
    assert np.nanmax(ellipses.x) == pytest.approx(200.0 + 500.0 * 2.447747, abs=0.01)
    assert chart.x.high is not None
    assert chart.y.low is not None
    assert np.nanmax(ellipses.x) < chart.x.high
    assert np.nanmin(ellipses.y) > chart.y.low
    (planned,) = [mark for mark in chart.marks if isinstance(mark, Line) and mark.label == "planned"]
    assert planned.y == pytest.approx([1000.0, 2000.0], rel=1e-3)
    assert next(iter(track_map([track], WGS84))).x.high == pytest.approx(50.0 * 488.0 / 420.0)  # of the place alone


def test_coasts_about_a_track_are_near_it() -> None:
    """Near Dover, 51.12° N 1.32° E, are points of the coast, some km apart; none is beyond the room of 4°."""
    lines = coasts_about(np.array([51.0, 51.2]) * DEG, np.array([1.2, 1.5]) * DEG)
    places = np.concatenate(lines)
    away = np.hypot(places[:, 0] - 51.12, (places[:, 1] - 1.32) * np.cos(51.12 * DEG)) * 111.2
    assert away.min() < 6.0
    assert np.abs(places[:, 0] - 51.1).max() < 4.0
    assert all(len(line) > 1 for line in lines)
    over_the_line = np.concatenate(coasts_about(np.array([-17.0, -16.0]) * DEG, np.array([179.5, -179.5]) * DEG))
    assert (over_the_line[:, 1] > 178.0).any()  # Fiji
    assert (np.abs(over_the_line[:, 1]) > 170.0).all()


def test_airports_about_a_track_are_near_it() -> None:
    """About Prague, 50.10° N 14.26° E, are its airport and those of neighbours; over the Pacific there is none near."""
    places = airports_about(np.array([50.0, 50.2]) * DEG, np.array([14.2, 14.5]) * DEG)
    away = np.hypot(places[:, 0] - 50.1008, (places[:, 1] - 14.26) * np.cos(50.1 * DEG)) * 111.2
    assert away.min() < 2.0
    assert 5 < len(places) < 60
    assert np.abs(places[:, 0] - 50.1).max() < 4.0
    assert len(airports_about(np.array([-48.0]) * DEG, np.array([-123.0]) * DEG)) == 0  # Point Nemo
    assert len(airports_about(np.array([-40.0, 60.0]) * DEG, np.array([-100.0, 100.0]) * DEG)) > 100  # large ones


def test_what_the_script_receives(tmp_path: Path) -> None:
    page = page_of(Exhibits("m", [Section("Map", [Charts("map", ((the_map(),),), (5.0, 5.0))])]))
    (text,) = re.findall(r'data-map="([^"]*)"', page)
    data = json.loads(html.unescape(text))
    assert data["ends"] == [[0.0, 4.0], [0.0, 4.0]]
    assert [line["time"] is not None for line in data["lines"]] == [True, False]  # without the bar
    assert [word["text"] for word in data["words"]] == [BAD]
    assert data["bars"] == [["km", 1.0]]
    assert "1 km" in page  # of the still picture


@pytest.fixture(scope="module")
def browser() -> Iterator[Page]:
    if CHROMIUM is None:
        pytest.skip("there is no Chromium on this machine")
    with Page(size=(1250, 1000)) as page:
        yield page


@pytest.fixture
def page(browser: Page, tmp_path: Path) -> Page:
    time = np.array([0.0, 3600.0])
    curve = Chart(
        key="k",
        x=over((0.0, 3600.0)),
        y=Axis(label="way", units=fixed("m")),
        marks=(Line(label="way", x=time, y=time),),
    )
    items = [Charts("map", ((the_map(),),), (5.0, 5.0)), Charts("g", ((curve,),), (6.0, 3.0))]
    path = tmp_path / "page.html"
    path.write_text(page_of(Exhibits(BAD, items)), encoding="utf-8")
    browser.problems.clear()
    browser.requests.clear()
    browser.open(file_address(path), "live.maps && live.drawn.length === 1")
    browser.drawn()
    return browser


def view(page: Page) -> list[float]:
    page.drawn()
    return list(page.value("live.maps[0].view"))


def on_map(page: Page, east: float, north: float) -> tuple[float, float]:
    """Return where the map shows a place, km, in the window, px."""
    left, top, wide, high = page.value(
        "(() => {const {svg, box: [x, y, w, h]} = live.maps[0], r = svg.getBoundingClientRect(), "
        "k = r.width / svg.viewBox.baseVal.width; return [r.left + k * x, r.top + k * y, k * w, k * h]})()"
    )
    west, right, south, up = view(page)
    return left + wide * (east - west) / (right - west), top + high * (up - north) / (up - south)


def test_the_map_follows_the_buttons_the_keys_the_wheel_and_dragging(page: Page) -> None:
    assert view(page) == [0.0, 4.0, 0.0, 4.0]
    page.value("document.querySelector('.live_map .tools button').click()")
    assert view(page) == [1.0, 3.0, 1.0, 3.0]
    assert page.value(
        "[...document.querySelectorAll('.zoomed .redrawn .soft')].map(t => t.textContent).includes('1.5')"
    )
    page.value("document.querySelector('.live_map').focus()")
    page.key("ArrowRight", "ArrowUp", "+")
    assert view(page) == pytest.approx([1.7, 2.7, 1.6, 2.6])  # about the track, 2 km to the north
    page.key("Escape")
    assert view(page) == [0.0, 4.0, 0.0, 4.0]
    page.value("document.activeElement.blur()")
    at = on_map(page, 1.0, 3.0)
    page.wheel(*at, -277.2589)
    assert view(page) == [0.0, 4.0, 0.0, 4.0]  # the page scrolls
    page.value("scrollTo(0, 0)")
    at = on_map(page, 1.0, 3.0)
    page.mouse(("mouseMoved", *at), ("mousePressed", *at), ("mouseReleased", *at))
    page.wheel(*at, -277.2589)  # exp(−277.2589/400) = 1/2
    assert view(page) == pytest.approx([0.5, 2.5, 1.5, 3.5], abs=0.01)
    begin, end = on_map(page, 1.0, 2.0), on_map(page, 2.0, 2.5)
    page.mouse(("mouseMoved", *begin), ("mousePressed", *begin), ("mouseMoved", *end), ("mouseReleased", *end))
    assert view(page) == pytest.approx([0.0, 2.0, 1.0, 3.0], abs=0.02)
    assert page.problems == []
    assert [address for address in page.requests if not address.startswith("file:")] == []
    assert page.value("document.querySelectorAll('img').length") == 0


def test_an_enlarged_map_has_more_airports(page: Page) -> None:
    """The five large ones at first, a fifth of a kilometre apart; an eighth of the map has ten of the others."""
    codes = "[...document.querySelectorAll('.zoomed .over')].map(t => t.textContent).filter(t => /^A[0-9]/.test(t))"
    assert set(page.value(codes)) == {"A000", "A002", "A004"}  # codes that have room
    at = on_map(page, 2.6, 3.0)
    page.mouse(("mouseMoved", *at), ("mousePressed", *at), ("mouseReleased", *at))
    page.wheel(*at, -831.7766)  # exp(−831.7766/400) = 1/8
    assert view(page)[:2] == pytest.approx([2.275, 2.775], abs=0.01)
    found = page.value(codes)
    assert found[0] == "A005"
    assert 2 < len(found) < 10
    assert set(found) < {f"A{k:03}" for k in range(5, 15)}


def test_the_cursor_has_its_place_and_its_ellipse_on_the_map_and_the_map_its_instant(page: Page) -> None:
    page.value("live.point(1800, null)")
    box = page.value(
        "(r => [r.left, r.right, r.top, r.bottom])(document.querySelector('.here.ellipse').getBoundingClientRect())"
    )
    west, north = on_map(page, 1.6, 2.1)
    east, south = on_map(page, 2.0, 1.9)
    assert box == pytest.approx([west, east, north, south], abs=1.6)
    page.mouse(("mouseMoved", *on_map(page, 2.4, 2.0)))
    page.drawn()
    minutes = page.value("live.drawn[0].plot.posToVal(live.drawn[0].plot.cursor.left, 'x')")
    assert minutes == pytest.approx(40.0, abs=0.2)
    page.allow("clipboardReadWrite")
    page.value("[...document.querySelectorAll('.live_map button')].at(-1).focus()")
    page.key("Enter")
    page.until("document.activeElement.textContent === 'copied'")
    folder = page.requests[-1].removeprefix("file://").rpartition("/")[0]
    assert page.value("navigator.clipboard.readText()") == f"sinssim view '{folder}' --time 2400"
    page.mouse(("mouseMoved", *on_map(page, 2.4, 3.0)))
    page.drawn()
    assert page.value("live.drawn[0].plot.cursor.left") < 0


def test_two_fingers_zoom_the_map_and_one_moves_it(page: Page) -> None:
    """Fingers 0.8 km apart about 2 km, 2 km that are then 1.6 km apart: half as much is seen."""
    here = [on_map(page, *at) for at in ((1.6, 2.0), (2.4, 2.0), (1.2, 2.0), (2.8, 2.0))]
    page.touch((here[0], here[1]), ((here[0][0] - 5.0, here[0][1]), (here[1][0] + 5.0, here[1][1])), (here[2], here[3]))
    assert view(page) == pytest.approx([1.0, 3.0, 1.0, 3.0], abs=0.1)
    west, _, south, _ = view(page)
    begin, end = on_map(page, 1.5, 2.0), on_map(page, 2.0, 2.25)
    page.touch((begin,), (((begin[0] + end[0]) / 2, (begin[1] + end[1]) / 2),), (end,))
    moved = view(page)
    assert (moved[0], moved[2]) == pytest.approx((west - 0.5, south - 0.25), abs=0.02)
    assert page.problems == []


def test_in_print_the_still_map_is_seen(page: Page) -> None:
    page.media("print")
    shown = "['.live_map > svg', '.zoomed'].map(e => getComputedStyle(document.querySelector(e)).display)"
    assert page.value(shown) == ["block", "none"]
    page.media("screen")
    assert page.value(shown) == ["none", "block"]
