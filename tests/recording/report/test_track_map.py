"""The map: distances and directions against spherical trigonometry, poles and date line included."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from math import acos, atan2, cos, pi, radians, sin

import numpy as np
import pytest

from sinssim.data import NavSolution, NavState
from sinssim.earth import WGS84, geodetic_to_ecef
from sinssim.recording import style
from sinssim.recording.svg_chart import html_of
from sinssim.recording.track_map import (
    Projection,
    Track,
    _aerodromes,
    _airports,
    _circle,
    _Frame,
    _frame,
    _outlines,
    _round,
    _scales,
    _shown,
    _sides,
    _waypoints,
    _within,
    degrees,
    track_map,
)

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize(("lat", "lon"), [(0.0, 0.0), (50.0, 14.5), (-33.0, 179.99), (89.999, 20.0), (-90.0, 0.0)])
def test_near_its_middle_the_map_is_the_tangent_plane(lat, lon):
    lat, lon = radians(lat), radians(lon)
    projection = Projection(lat, lon, WGS84)
    origin = geodetic_to_ecef(lat, lon, 0.0)
    east = np.array([-sin(lon), cos(lon), 0.0])
    north = np.array([-sin(lat) * cos(lon), -sin(lat) * sin(lon), cos(lat)])
    for d_lat, d_lon in ((1e-4, 0.0), (0.0, 1e-4), (-1.2e-4, 0.8e-4)):
        there = geodetic_to_ecef(lat + d_lat, lon + d_lon, 0.0) - origin
        e, n = projection.plane(np.array([lat + d_lat]), np.array([lon + d_lon]))
        assert e[0] == pytest.approx(there @ east, abs=0.01)  # of up to 760 m
        assert n[0] == pytest.approx(there @ north, abs=0.01)


@pytest.mark.parametrize(("lat", "lon"), [(70.0, 20.0), (-20.0, -170.0), (88.0, 0.0), (10.0, 100.0)])
def test_far_away_distance_and_azimuth_are_those_of_the_great_circle(lat, lon):
    here = (radians(60.0), radians(170.0))
    there = (radians(lat), radians(lon))
    turn = there[1] - here[1]
    arc = acos(sin(here[0]) * sin(there[0]) + cos(here[0]) * cos(there[0]) * cos(turn))
    azimuth = atan2(sin(turn) * cos(there[0]), cos(here[0]) * sin(there[0]) - sin(here[0]) * cos(there[0]) * cos(turn))
    e, n = Projection(*here, WGS84).plane(np.array([there[0]]), np.array([there[1]]))
    assert np.hypot(e[0], n[0]) == pytest.approx(6388e3 * arc, rel=2e-3)  # radii at 60°: 6383.5 and 6394.2 km
    assert (atan2(e[0], n[0]) - azimuth + pi) % (2 * pi) - pi == pytest.approx(0.0, abs=2e-3)
    lat_back, lon_back = Projection(*here, WGS84).place(e, n)
    assert lat_back[0] == pytest.approx(there[0], abs=1e-12)
    assert (lon_back[0] - there[1] + pi) % (2 * pi) - pi == pytest.approx(0.0, abs=1e-12)


def state(lat, lon):
    count = len(lat)
    return NavState(np.radians(lat), np.radians(lon), np.zeros(count), np.zeros((count, 3)), np.zeros((count, 4)))


def draw_map(time, truth, solutions, colors, ellipsoid, **more) -> str:
    """Return the map of a motion and of solutions as SVG."""
    named = [("truth", time, truth), *((name, s.time, s) for name, s in solutions.items())]
    tracks = [Track.of(*track, color) for track, color in zip(named, colors, strict=True)]
    whole = html_of(track_map(tracks, ellipsoid, **more))
    return whole[whole.index("<svg") : whole.rindex("</svg>") + 6]  # the still picture


def dots(svg: str) -> list[float]:
    """Return the abscissas of the dots, px."""
    return [float(x) for x in re.findall(r"M([\d.]+) [\d.]+h0", svg)]


def names(svg):
    return [e.text for e in ET.fromstring(svg).iter(f"{SVG}text")]


def test_a_track_over_the_date_line_is_one_line_in_the_middle():
    time = np.arange(101.0)
    truth = state(np.full(101, 10.0), (178.0 + 0.04 * time + 180.0) % 360.0 - 180.0)
    svg = draw_map(time, truth, {}, ["#009e73"], WGS84)
    inner = ET.fromstring(svg).find(f"{SVG}svg")
    track = next(p for p in inner.findall(f"{SVG}polyline") if p.get("stroke") == "#009e73")
    x = np.array([float(pair.split(",")[0]) for pair in track.get("points").split()])
    assert (np.diff(x) > 0.0).all()
    left, width = float(inner.get("x")), float(inner.get("width"))
    assert x[0] - left == pytest.approx(width - (x[-1] - left), abs=1.0)
    assert {"180°", "179°E", "179°W", "10°N", "start", "end", "east [km]"} <= set(names(svg))


def test_a_track_over_the_pole_has_meridians_all_round():
    time = np.arange(201.0)
    lat = 90.0 - np.abs(np.linspace(-4.0, 4.0, 201))
    truth = state(lat, np.where(time <= 100.0, 170.0, -10.0))
    svg = draw_map(time, truth, {}, ["#009e73"], WGS84)
    assert {"88°N", "0°", "180°", "90°E", "60°W"} <= set(names(svg))
    places = [(e.get("x"), e.get("y")) for e in ET.fromstring(svg).iter(f"{SVG}text") if e.text.endswith(("E", "W"))]
    assert len(set(places)) == len(places) > 8


def test_a_parked_vehicle_is_a_dot_on_a_map_in_metres():
    time = np.arange(11.0)
    svg = draw_map(time, state(np.full(11, 50.0), np.full(11, 14.5)), {}, ["#009e73"], WGS84)
    assert {"east [m]", "north [m]"} <= set(names(svg))
    assert len(dots(svg)) == 1


def test_round_times_are_where_the_vehicle_was():
    time = np.arange(3601.0)
    truth = state(np.zeros(3601), np.linspace(0.0, 3.6, 3601))
    svg = draw_map(time, truth, {}, ["#009e73"], WGS84)
    at = sorted(dots(svg))
    np.testing.assert_allclose(np.diff(at), (at[-1] - at[0]) / 6.0, rtol=0, atol=0.5)  # 10, 20 … 50 min; half a pixel
    assert {"10 min", "20", "50"} <= set(names(svg))


@pytest.mark.parametrize(
    ("value", "signs", "places", "text"),
    [(49.5, "NS", None, "49°30′N"), (-0.25, "EW", None, "0°15′W"), (0.0, "NS", None, "0°"), (180.0, "EW", None, "180°"),
     (14.5, "EW", 5, "14.50000°E"), (-33.12345678, "NS", 5, "33.12346°S"), (1.0 - 1e-9, "NS", None, "1°N")],
)  # fmt: skip
def test_angles_with_their_sides(value, signs, places, text):
    assert degrees(value, signs, places) == text


@pytest.mark.parametrize(
    ("place", "latitude", "longitude", "border"),
    [("Dover", 51.13, 1.33, False), ("Land's End", 50.07, -5.71, False), ("Cape of Good Hope", -34.36, 18.47, False),
     ("Nordkapp", 71.17, 25.78, False), ("Germany, Poland, Czechia", 50.87, 14.82, True),
     ("Lake Constance by the Rhine", 47.5, 9.55, True)],
)  # fmt: skip
def test_coasts_and_borders_are_where_they_are(place, latitude, longitude, border):
    """To the 1:50 million of the drawing, 0.2 mm of which are 10 km."""
    lat, lon, borders = _outlines()
    lat, lon = lat[borders == border], lon[borders == border]
    away = np.hypot(lat - np.radians(latitude), (lon - np.radians(longitude)) * np.cos(np.radians(latitude)))
    assert 6371.0 * np.nanmin(away) < 10.0


def test_the_map_has_the_world_behind_it_and_scales():
    """A degree along the equator is 111.32 km; the coast of Gabon lies beside it."""
    time = np.arange(101.0)
    svg = draw_map(time, state(np.zeros(101), 8.5 + 0.01 * time), {}, ["#009e73"], WGS84)
    lines = [np.array([pair.split(",") for pair in line.get("points").split()], dtype=float)
             for line in ET.fromstring(svg).find(f"{SVG}svg").findall(f"{SVG}polyline")]  # fmt: skip
    track, *scales = lines[-3:]
    degree = np.ptp(track[:, 0])
    texts = [name for name in names(svg) if name.endswith((" km", "nmi"))]
    for scale, text, km in zip(scales, texts, (1.0, 1.852), strict=True):
        assert np.ptp(scale[:, 0]) / degree == pytest.approx(km * float(text.split()[0]) / 111.32, abs=0.01)
    sea = draw_map(time, state(np.full(101, -45.0), -130.0 + 0.01 * time), {}, ["#009e73"], WGS84)
    coasts = [
        [line for line in ET.fromstring(drawn).find(f"{SVG}svg") if line.get("stroke") == style.SOFT]
        for drawn in (svg, sea)
    ]
    assert (len(coasts[0]) > 0, len(coasts[1])) == (True, 0)


@pytest.mark.parametrize(
    ("code", "latitude", "longitude"),
    [("LKPR", 50 + 6 / 60 + 3 / 3600, 14 + 15 / 60 + 36 / 3600),
     ("EGLL", 51 + 28 / 60 + 39 / 3600, -27 / 60 - 41 / 3600),
     ("YSSY", -33 - 56 / 60 - 46 / 3600, 151 + 10 / 60 + 38 / 3600)],
)  # fmt: skip
def test_airports_are_where_they_are(code, latitude, longitude):
    """Reference points of the aeronautical information publications; a kilometre is 0.009°."""
    at, along, codes, large = _aerodromes()
    k = codes.index(code)
    assert k < large
    assert np.degrees(at[k]) == pytest.approx(latitude, abs=0.009)
    assert np.degrees(along[k]) == pytest.approx(longitude, abs=0.009)
    assert codes[:large] == tuple(sorted(codes[:large]))
    assert len(set(codes)) == len(codes)


def test_a_map_has_few_airports_with_their_codes_and_many_without():
    """About Prague stands one, with its code; about Bohemia all, without; about Central Europe the large ones; of two
    continents none, before the map is enlarged."""

    def drawn(width):
        frame = _Frame(488.0 / width, -0.5 * width, 0.5 * width * 420.0 / 488.0)
        sites, *remarks = _airports(Projection(radians(50.1), radians(14.26), WGS84), frame)
        return sites, [remark.text for remark in remarks]

    few, codes = drawn(40e3)
    assert (few.names, codes, len(few.x)) == (("LKPR",), ["LKPR"], 1)
    assert np.hypot(few.x[0], few.y[0]) < 1000.0
    some, codes = drawn(700e3)
    assert codes == []
    assert 12 < len(some.x) == len(some.sites) == len(some.names) <= 40
    large, codes = drawn(1600e3)
    assert codes == []
    assert 12 < len(large.x) == large.large <= 40 < len(large.sites)
    many, codes = drawn(12e6)
    assert (len(many.x), codes, len(many.sites)) == (0, [], many.large)


def test_the_map_says_whose_track_is_which():
    time = np.arange(101.0)
    truth = state(np.full(101, 10.0), 0.04 * time)
    alone = draw_map(time, truth, {}, ["#009e73"], WGS84)
    assert "truth" not in names(alone)
    solution = NavSolution(time, truth.latitude, truth.longitude, truth.height, truth.velocity_ned, truth.q_nb, time)
    svg = draw_map(time, truth, {"euler": solution, "poisson": solution}, ["#009e73", "#cc79a7", "#e69f00"], WGS84)
    assert [name for name in names(svg) if name in ("truth", "euler", "poisson")] == ["truth", "euler", "poisson"]
    drawing = ET.fromstring(svg)
    beside = drawing.findall(f"{SVG}polyline")
    on_the_map = drawing.find(f"{SVG}svg").findall(f"{SVG}polyline")[-5:-2]  # below the two scales
    for look in ("stroke", "stroke-width", "stroke-dasharray"):
        assert [line.get(look) for line in beside] == [line.get(look) for line in on_the_map]


def test_a_solution_widens_the_map_until_it_is_out_of_all_proportion():
    time = np.arange(101.0)
    truth = state(np.full(101, 50.0), np.full(101, 14.5))
    far = 14.5 + np.linspace(0.0, 1.0, 101) * 300.0 / 71.7  # a degree of longitude is 71.7 km there
    inner = []
    for end in (101, 3):  # 300 km off at the end, and cut where it is 6 km off
        drift = state(np.full(end, 50.0), far[:end])
        solution = NavSolution(
            time[:end], drift.latitude, drift.longitude, drift.height, drift.velocity_ned, drift.q_nb, time[:end]
        )
        svg = ET.fromstring(draw_map(time, truth, {"euler": solution}, ["#009e73", "#cc79a7"], WGS84))
        inner.append(svg.find(f"{SVG}svg"))
    for drawing, shown in zip(inner, (9.0, 6.0), strict=True):
        left, width = float(drawing.get("x")), float(drawing.get("width"))
        line = next(p for p in drawing.findall(f"{SVG}polyline") if p.get("stroke") == "#cc79a7")
        x = np.array([float(pair.split(",")[0]) for pair in line.get("points").split()]) - left
        at = np.interp(shown / 3.0, np.arange(len(x)), x)  # every sample is 3 km further east
        assert x[0] == pytest.approx(width * (1.0 - 1.0 / 1.16) / 2.0, abs=1.0)
        assert at == pytest.approx(width * (1.0 + 1.0 / 1.16) / 2.0, abs=1.0)


def test_an_outage_is_marked_on_the_track_and_named():
    time = np.arange(0.0, 101.0)
    truth = state(np.linspace(50.0, 50.1, 101), np.full(101, 14.5))
    svg = draw_map(time, truth, {}, ["#009e73"], WGS84, outages=[(20.0, 40.0), (500.0, 600.0)])
    marks = re.findall(r'<polyline points="([^"]*)" [^>]*stroke-width="8"', svg)
    on_track = [mark for mark in marks if len(mark.split()) > 2]
    assert "no GNSS" in svg
    whole = re.findall(r'<polyline points="([^"]*)" fill="none" stroke="#009e73"', svg)[-1].split()
    (mark,) = on_track
    north = [float(place.split(",")[1]) for place in (mark.split()[0], mark.split()[-1])]
    ends = [float(place.split(",")[1]) for place in (whole[0], whole[-1])]
    along = [(n - ends[0]) / (ends[1] - ends[0]) for n in north]
    assert along == pytest.approx([0.20, 0.39], abs=0.01)  # rows of 20 s to 39 s: the fix of 40 s is back
    assert "no GNSS" not in draw_map(time, truth, {}, ["#009e73"], WGS84)


def test_the_frame_of_points():
    """400 m east by 1000 m north, with 8 % of margin: 420 px are 1160 m, and 488 px about the middle at 100 m east."""
    frame = _frame(np.array([-100.0, 300.0, 50.0]), np.array([1500.0, 500.0, 700.0]))
    pixel = 1160.0 / 420.0
    assert (frame.width, frame.height) == pytest.approx((488.0 * pixel, 1160.0))
    assert (frame.west, frame.north) == pytest.approx((100.0 - 244.0 * pixel, 1580.0))
    x, y = frame.pixels(np.array([100.0, frame.west]), np.array([500.0, 1580.0]))
    assert (x.tolist(), y.tolist()) == ([pytest.approx(244.0), 0.0], [pytest.approx(1080.0 / pixel), 0.0])
    east = frame.west + np.array([-1.0, 1.0, 1.0, 1.0, frame.width + 1.0])
    assert frame.shows(east, np.array([1000.0, 1000.0, 1581.0, 419.0, 1000.0])).tolist() == [False, True] + [False] * 3
    wide = _frame(np.array([-9760.0, 0.0]), np.array([3.0, 5.0]))
    assert (wide.width, wide.north) == pytest.approx((9760.0 * 1.16, 4.0 + 210.0 * 1.16 * 20.0))
    point = _frame(np.array([7.0]), np.array([-3.0]))  # at least 100 m
    assert (point.height, point.west, point.north) == pytest.approx((100.0, 7.0 - 50.0 * 488.0 / 420.0, 47.0))


def test_how_far_a_solution_widens_the_map():
    """A motion up to 8 km away shows a solution up to 16 km, one of 3 km up to 10 km."""
    line = (np.array([0.0, 3.0, 12.0, 12.0, 9.0]) * 1e3, np.array([0.0, 4.0, 10.0, 11.0, 1.0]) * 1e3)
    for reach, shown in ((8e3, [0.0, 3e3, 12e3, 9e3]), (3e3, [0.0, 3e3, 9e3])):
        east, north = _shown(np.array([0.0, 0.6 * reach]), np.array([0.0, -0.8 * reach]), [line])
        assert east.tolist() == pytest.approx([0.0, 0.6 * reach, *shown])
        assert north[:2].tolist() == pytest.approx([0.0, -0.8 * reach])
        assert len(north) == len(east)


@pytest.mark.parametrize(
    ("low", "high", "angles"),
    [(10.2, 13.4, [11.0, 12.0, 13.0]), (-40.0, 50.0, [-30.0, 0.0, 30.0]), (0.1, 1.7, [0.5, 1.0, 1.5]),
     (-0.02, 0.03, [-1.0 / 60.0, 0.0, 1.0 / 60.0]), (178.5, 184.6, [180.0, 182.0, 184.0])],
)  # fmt: skip
def test_round_angles_of_a_range(low, high, angles):
    """At least three steps are in the range; the least step is a minute of arc."""
    assert _round(low, high) == pytest.approx(angles)


def test_on_which_side_names_stand():
    """To the right; to the left at the right edge of 488 px, and where the right is taken. A letter is 8 px wide, and
    names 14 px apart in height do not meet."""
    assert _sides([(5, 100.0, 50.0), (5, 450.0, 80.0), (5, 439.0, 200.0)]) == [False, True, False]
    assert _sides([(5, 100.0, 50.0), (5, 90.0, 63.0)]) == [False, True]
    assert _sides([(5, 100.0, 50.0), (5, 90.0, 64.0)]) == [False, False]
    assert _sides([(5, 30.0, 50.0), (5, 20.0, 50.0)]) == [False, False]  # there is no room to the left
    assert _sides([(10, 300.0, 50.0), (10, 400.0, 50.0), (5, 290.0, 50.0)]) == [
        True,
        True,
        False,
    ]  # that at the edge has no choice


def test_the_scales_of_a_map():
    """A fifth of 10 km is 2 km, of its 5.4 nmi 1 nmi: bars that end 8 px from the right edge, one below the other."""
    km, _, nmi, _ = marks = list(_scales(_Frame(488.0 / 10_000.0, -3000.0, 4000.0)))
    pixel = 10_000.0 / 488.0
    right = 7000.0 - 8.0 * pixel
    for number, (bar, length) in enumerate(((km, 2000.0), (nmi, 1852.0))):
        assert bar.x.tolist() == pytest.approx([right - length] * 2 + [right] * 2)
        foot = 4000.0 - (14.0 + 16.0 * number) * pixel
        assert bar.y.tolist() == pytest.approx([foot + 4.0 * pixel, foot, foot, foot + 4.0 * pixel])
    assert [(mark.text, mark.left) for mark in marks[1::2]] == [("2 km", True), ("1 nmi", True)]


def test_rows_of_a_track_within_spans():
    """The row at the end of a span is not in it; a span with a single row is left out."""
    track = Track("t", np.array([10.0, 11.0, 12.0, 13.0]), 0.1 * np.arange(4.0), -0.2 * np.arange(4.0))
    ((latitude, longitude),) = _within(track, [(11.0, 13.0), (9.0, 11.0)])
    assert (latitude.tolist(), longitude.tolist()) == ([0.1, 0.2], [-0.2, -0.4])


def test_waypoints_on_the_map():
    """Near 60° N and 180°, a place 1 km north and 2 km east of it; one outside the map is not drawn."""
    middle = Projection(radians(60.0), pi, WGS84)
    frame = _Frame(0.1, -2440.0, 2100.0)
    north, east = 1000.0 / 6383453.857, 2000.0 / (6394209.174 * 0.5)
    places = [("far", radians(61.0), pi), ("A", radians(60.0) + north, east - pi)]
    diamond, name = _waypoints(places, middle, frame)
    assert (diamond.x[0], diamond.y[0]) == pytest.approx((2000.0, 1000.0), abs=1.5)
    assert (diamond.marker, diamond.hollow, name.text, name.left, name.below) == ("D", True, "A", False, True)
    assert (name.x, name.y) == (diamond.x[0], diamond.y[0])


def test_the_names_of_circles():
    """At the lower end of a meridian, 3 px beside it and above its foot; in the right 40 px to its left. One on another
    name is left out, and so is a parallel in the uppermost 14 px."""
    frame, taken = _Frame(1.0, 1000.0, 2000.0), []
    north = np.arange(1500.0, 2100.0)

    def drawn(x, y, name):
        marks = list(_circle(1000.0 + x, 2000.0 - y, frame, name, lambda x, y: int(np.argmax(y)), taken))
        return [mark for mark in marks if hasattr(mark, "text")]

    (name,) = drawn(np.full(600, 100.0), 2000.0 - north, "10°E")
    assert (name.x, name.y, name.text, name.left) == (1100.0, 1581.0, "10°E", False)
    (edge,) = drawn(np.full(600, 460.0), 2000.0 - north, "11°E")
    assert (edge.x, edge.left) == (1460.0, True)
    long = 4 * 5.6
    assert taken == [pytest.approx((103.0, 103.0 + long, 416.0)), pytest.approx((457.0 - long, 457.0, 416.0))]
    assert drawn(np.full(600, 110.0), 2000.0 - north, "12°E") == []
    assert len(drawn(np.arange(5.0, 480.0), np.full(475, 15.0), "60°N")) == 1
    assert drawn(np.arange(5.0, 480.0), np.full(475, 13.0), "61°N") == []
