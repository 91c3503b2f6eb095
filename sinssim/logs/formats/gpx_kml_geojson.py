"""Tracks of maps: GPX and KML, read and written, and GeoJSON, written.

GPX 1.0 and 1.1: tracks of points with UTC times (https://www.topografix.com/GPX/1/1/). KML 2.2 (OGC 07-147r2): gx:Track
with times; a LineString without times is refused with what to do. Both are read without entities, which could blow up a
small file. GeoJSON (RFC 7946): one line, cut at the antimeridian, with the times of its points. A path is written with
at most `MOST` points.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat
from xml.sax.saxutils import escape

import numpy as np

from sinssim.data import Array
from sinssim.earth.gravity_disturbance import GEOID_WORDS, geoid_along
from sinssim.errors import InputError, shortened
from sinssim.logs.formats import Format
from sinssim.logs.formats.export_streams import Content, Export
from sinssim.logs.gps_time import gps_seconds, unix_from_gps
from sinssim.logs.recorded_streams import Clock, FixStream, HeightDatum, Streams
from sinssim.system.files import open_file
from sinssim.units import DEG


def read_xml(path: Path) -> ElementTree.Element:
    """Return the root of an XML file."""

    def refuse(*_: object) -> None:
        raise InputError(
            f"{path} declares XML entities, which tracks do not need and which may expand without limit: remove its "
            "<!DOCTYPE …>."
        )

    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True
    parser.StartElementHandler = lambda tag, attributes: builder.start(_named(tag), attributes)
    parser.EndElementHandler = lambda tag: builder.end(_named(tag))
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse  # type: ignore[assignment]
    try:
        with open_file(path) as file:
            parser.ParseFile(file)
        return builder.close()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}.") from error
    except expat.ExpatError as error:
        raise InputError(
            f"{path}, line {error.lineno}: {expat.ErrorString(error.code)}; the file is not complete XML."
        ) from error
    except AssertionError as error:
        raise InputError(f"{path} is not complete XML.") from error


def _named(tag: str) -> str:
    """Return an element's name without its namespace, of which the versions of a format differ."""
    return tag.rsplit("}", 1)[-1]


def of_file(path: Path, head: bytes, element: bytes) -> bool:
    """Return whether a file may be XML with a root element."""
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return start.startswith(b"<") and b"<" + element in start


_GPX_HEIGHTS = "ele", "geoidheight"
"""The height above mean sea level, and that of the geoid above the ellipsoid."""


def read_gpx(path: Path) -> Streams:
    """Return the points of all segments of the tracks of a GPX file, in the order of the file, as fixes named "gnss";
    missing elevations are NaN."""
    root = read_xml(path)
    segments = [list(segment.iter("trkpt")) for segment in root.iter("trkseg")]
    points = [point for segment in segments for point in segment]
    if not points:
        others = [name for name in ("rtept", "wpt") if next(root.iter(name), None) is not None]
        has = {"rtept": "a route", "wpt": "waypoints"}
        raise InputError(
            f"{path} has no track (<trk> with <trkpt>)"
            + (f", only {' and '.join(has[name] for name in others)}, which have no times" if others else "")
            + ": record a track, or travel a route with track.speed_mps."
        )
    place = np.array([_gpx_place(path, number, point) for number, point in enumerate(points, start=1)])
    moments = [_gpx_time(path, number, point) for number, point in enumerate(points, start=1)]
    missing = [number for number, moment in enumerate(moments, start=1) if moment is None]
    if missing:
        few = (
            "no point has a time" if len(missing) == len(points) else f"point {missing[0]} of {len(points)}: no <time>"
        )
        raise InputError(
            f"{path}: {few}; a recorded track needs the time of every point. A track without times is "
            "travelled at a constant speed with track.speed_mps."
        )
    time = np.array([moment for moment, _ in filter(None, moments)])
    origin = int(np.floor(time[0]))
    notes = []
    if len(segments) > 1:
        notes.append(f"{len(segments)} segments of {' + '.join(str(len(s)) for s in segments[:8])} points are joined.")
    if not all(zone for _, zone in filter(None, moments)):
        notes.append("Times without a time zone are taken as UTC.")
    height, geoid = (np.array([_gpx_number(point.findtext(name)) for point in points]) for name in _GPX_HEIGHTS)
    complete = np.isfinite(geoid).any() and np.isfinite(geoid[np.isfinite(height)]).all()
    datum: HeightDatum = "ellipsoid" if complete else "mean sea level"
    if datum == "ellipsoid":
        height += geoid
    fixes = FixStream(time - origin, place[:, 0] * DEG, place[:, 1] * DEG, height, datum)
    return Streams(path, "gpx", Clock("utc", origin, "UTC of GPX"), fixes={"gnss": fixes}, notes=tuple(notes))


def read_path_gpx(path: Path) -> Array | None:
    """Return the points of a GPX file's tracks, or of its routes if it has no track, without their times: longitude and
    latitude in degrees and height in m, NaN if missing, (N, 3); None if there are no points."""
    root = read_xml(path)
    points = list(root.iter("trkpt")) or list(root.iter("rtept"))
    if not points:
        return None
    places = [_gpx_place(path, number, point) for number, point in enumerate(points, start=1)]
    return np.array([(b, a, _gpx_number(point.findtext("ele"))) for (a, b), point in zip(places, points, strict=True)])


def _gpx_place(path: Path, number: int, point: Element) -> tuple[float, float]:
    try:
        return float(point.attrib["lat"]), float(point.attrib["lon"])
    except (KeyError, ValueError) as error:
        given = " ".join(f'{key}="{value}"' for key, value in point.attrib.items())
        raise InputError(
            f'{path}, point {number}: <trkpt {shortened(given)}> has no place; lat="51.5" lon="-0.1" would be one.'
        ) from error


def _gpx_time(path: Path, number: int, point: Element) -> tuple[float, bool] | None:
    text = point.findtext("time")
    if text is None or not text.strip():
        return None
    try:
        return gps_seconds(text)
    except InputError as error:
        raise InputError(f"{path}, point {number}: {error}") from error


def _gpx_number(text: str | None) -> float:
    try:
        return float(text) if text is not None else float("nan")
    except ValueError:
        return float("nan")


def read_kml(path: Path) -> Streams:
    """Return the points of the gx:Track elements of a KML file, in the order of the file, as fixes named "gnss"."""
    root = read_xml(path)
    tracks = [track for track in root.iter("Track") if track.find("coord") is not None]
    if not tracks:
        lines = path_of_lines(root)
        if lines is None:
            raise InputError(f"{path} has neither a track (<gx:Track>) nor a path (<LineString>).")
        raise InputError(
            f"{path} has a path of {len(lines)} points without times (<LineString>): give track.speed_mps, with which "
            "it is travelled at that speed, or [[track.waypoints]], or a file with a <gx:Track>."
        )
    moments: list[float] = []
    rows: list[tuple[float, float, float]] = []
    zoned = True
    for track in tracks:
        whens, coords = track.findall("when"), track.findall("coord")
        if len(whens) != len(coords):
            raise InputError(
                f"{path}: a <gx:Track> has {len(whens)} <when> and {len(coords)} <gx:coord>; each point needs both."
            )
        for when, coord in zip(whens, coords, strict=True):
            number = len(rows) + 1
            try:
                moment, zone = gps_seconds(when.text or "")
            except InputError as error:
                raise InputError(f"{path}, point {number}: {error}") from error
            moments.append(moment)
            zoned = zoned and zone
            rows.append(_kml_numbers(path, number, (coord.text or "").split()))
    time, place = np.array(moments), np.array(rows)
    origin = int(np.floor(time[0]))
    notes = () if zoned else ("Times without a time zone are taken as UTC.",)
    fixes = FixStream(time - origin, place[:, 1] * DEG, place[:, 0] * DEG, place[:, 2], "mean sea level")
    return Streams(path, "kml", Clock("utc", origin, "UTC of KML"), fixes={"gnss": fixes}, notes=notes)


def read_path_kml(path: Path) -> Array | None:
    """Return the points of the LineStrings of a KML file, which have no times: longitude and latitude in degrees and
    height in m, NaN if missing, (N, 3); None if there is no LineString."""
    return path_of_lines(read_xml(path), path)


def path_of_lines(root: Element, path: Path | None = None) -> Array | None:
    """Return the points of all LineStrings below an element, see `read_path`."""
    words = [word for line in root.iter("LineString") for word in (line.findtext("coordinates") or "").split()]
    if not words:
        return None
    return np.array([_kml_numbers(path, number, word.split(",")) for number, word in enumerate(words, start=1)])


def _kml_numbers(path: Path | None, number: int, words: list[str]) -> tuple[float, float, float]:
    try:
        longitude, latitude, *rest = (float(word) for word in words if word)
        return longitude, latitude, rest[0] if rest else float("nan")
    except ValueError as error:
        raise InputError(
            f"{path or 'the KML file'}, point {number}: {shortened(' '.join(words))!r} is not longitude, latitude and "
            "height."
        ) from error


MOST = 20_000
"""Most points of a map if no rate is given."""


@dataclass(frozen=True)
class Points:
    """Points of a path."""

    # latitude, longitude: (N,) °, longitude within ±180°
    latitude: Array
    longitude: Array
    height: Array  # above the ellipsoid, (N,) m
    dates: list[str]  # UTC, (N,)
    total: int  # number of samples of the stream

    @cached_property
    def geoid(self) -> Array:
        """Height of the geoid above the ellipsoid, (N,) m."""
        return geoid_along(DEG * self.latitude, DEG * self.longitude)

    @cached_property
    def sentence(self) -> str:
        """How many points are written."""
        if len(self.dates) == self.total:
            return f"{self.total} points."
        return f"{len(self.dates)} of {self.total} points; --rate sets how many a second."


def path_points(content: Content) -> Points:
    """Return the points of the chosen solution: the points. `content`: what is written; without a rate at most `MOST`
    points."""
    stream = content.solution
    total = len(replace(content, rate_hz=None).solution)
    every = 1 if content.rate_hz is not None else max(1, -(-len(stream) // MOST))
    rows = np.unique(np.append(np.arange(0, len(stream), every), len(stream) - 1))
    longitude = (stream.longitude[rows] / DEG + 180.0) % 360.0 - 180.0
    return Points(stream.latitude[rows] / DEG, longitude, stream.height[rows], dates(content, stream.time[rows]), total)


def dates(content: Content, time: Array) -> list[str]:
    """Return the dates of times in UTC, to a millisecond: for example "2026-01-01T00:00:00.010Z". `content`: with the
    date of time 0; `time`: the run's own time, (N,) s."""
    unix = unix_from_gps(content.start_gps_s + time)
    start = datetime(1970, 1, 1, tzinfo=UTC)
    ms = np.round(unix * 1e3).astype(np.int64)
    moments = (start + timedelta(milliseconds=value) for value in ms.tolist())
    return [f"{date:%Y-%m-%dT%H:%M:%S}.{date.microsecond // 1000:03d}Z" for date in moments]


HEIGHTS = f"Heights are above mean sea level, as maps take them. {GEOID_WORDS}"


def write_gpx(content: Content, place: Path) -> list[str]:
    """Write the file."""
    p = path_points(content)
    geoid = np.round(p.geoid, 4)
    name = escape(f"{content.run.name}: {content.solution_name}")
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.1" creator="sinssim" xmlns="http://www.topografix.com/GPX/1/1">',
        f"<metadata><name>{name}</name><desc>{escape(HEIGHTS)}</desc><time>{p.dates[0]}</time></metadata>",
        f"<trk><name>{name}</name><trkseg>",
        *(
            f'<trkpt lat="{latitude:.9f}" lon="{longitude:.9f}"><ele>{height:.4f}</ele><time>{date}</time>'
            f"<geoidheight>{undulation:.4f}</geoidheight></trkpt>"
            for latitude, longitude, height, date, undulation in zip(
                p.latitude, p.longitude, p.height - geoid, p.dates, geoid, strict=True
            )
        ),
        "</trkseg></trk></gpx>",
    ]
    place.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [f"The path of {content.solution_name}: {p.sentence}", HEIGHTS, "Times are UTC."]


def write_kml(content: Content, place: Path) -> list[str]:
    """Write the file: a track, which has a slider of time, and the start and the end as points."""
    p = path_points(content)
    name = escape(f"{content.run.name}: {content.solution_name}")
    place_of = [
        f"{longitude:.9f} {latitude:.9f} {height:.4f}"
        for longitude, latitude, height in zip(p.longitude, p.latitude, p.height - p.geoid, strict=True)
    ]
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">',
        f"<Document><name>{name}</name><description>{escape(HEIGHTS)}</description>",
        '<Style id="path"><IconStyle><scale>0.6</scale></IconStyle>'
        "<LineStyle><color>ff739e00</color><width>3</width></LineStyle></Style>",
        *(_kml_point(word, place_of[k], p.dates[k]) for word, k in (("start", 0), ("end", -1))),
        f"<Placemark><name>{name}</name><styleUrl>#path</styleUrl>",
        "<gx:Track><altitudeMode>absolute</altitudeMode>",
        *(f"<when>{date}</when>" for date in p.dates),
        *(f"<gx:coord>{coordinates}</gx:coord>" for coordinates in place_of),
        "</gx:Track></Placemark>",
        "</Document></kml>",
    ]
    place.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [f"The path of {content.solution_name}: {p.sentence}", HEIGHTS, "Times are UTC."]


def _kml_point(word: str, coordinates: str, date: str) -> str:
    return (
        f"<Placemark><name>{word}</name><TimeStamp><when>{date}</when></TimeStamp><styleUrl>#path</styleUrl>"
        f"<Point><altitudeMode>absolute</altitudeMode>"
        f"<coordinates>{coordinates.replace(' ', ',')}</coordinates></Point></Placemark>"
    )


def write_geojson(content: Content, place: Path) -> list[str]:
    """Write the file."""
    p = path_points(content)
    points = np.column_stack((np.round(p.longitude, 9), np.round(p.latitude, 9), np.round(p.height, 4))).tolist()
    # RFC 7946, 3.1.9: a line that crosses the antimeridian is cut there
    cuts = [0, *(np.flatnonzero(np.abs(np.diff(p.longitude)) > 180.0) + 1).tolist(), len(points)]
    pieces = [points[a:b] for a, b in pairwise(cuts)]
    times = [p.dates[a:b] for a, b in pairwise(cuts)]
    features = [
        {
            "type": "Feature",
            "properties": {
                "name": f"{content.run.name}: {content.solution_name}",
                "coordTimes": dates if len(piece) > 1 else dates * 2,
            },
            "geometry": {"type": "LineString", "coordinates": piece if len(piece) > 1 else piece * 2},
        }
        for piece, dates in zip(pieces, times, strict=True)
    ]
    text = json.dumps({"type": "FeatureCollection", "features": features}, ensure_ascii=False)
    place.write_text(text + "\n", encoding="utf-8")
    return [
        f"The path of {content.solution_name}: {p.sentence}",
        "Heights are above the ellipsoid WGS-84, as RFC 7946 requires. Times are UTC, in coordTimes.",
    ]


GPX = Format(lambda path, head: of_file(path, head, b"gpx"), read_gpx, read_path=read_path_gpx)
KML = Format(lambda path, head: of_file(path, head, b"kml"), read_kml, read_path=read_path_kml)
GPX_EXPORT = Export(".gpx", "solution", write_gpx)
KML_EXPORT = Export(".kml", "solution", write_kml)
GEOJSON_EXPORT = Export(".geojson", "solution", write_geojson)
