"""GPX 1.0 and 1.1: tracks of points with UTC times (https://www.topografix.com/GPX/1/1/)."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError, shortened
from sinssim.logs.formats.xml_file import of_file, read_xml
from sinssim.logs.gps_time import gps_seconds
from sinssim.logs.recorded_streams import Clock, FixStream, Streams
from sinssim.units import DEG


def recognises(path: Path, head: bytes) -> bool:
    """Return whether a file with these first bytes may be GPX."""
    return of_file(path, head, b"gpx")


def read(path: Path) -> Streams:
    """Return the points of all segments of the tracks of a GPX file, in the order of the file.

    Returns:
        One stream of fixes, named "gnss"; missing elevations are NaN.

    Raises:
        InputError: the file is not GPX, has no track, or a point has no place or no time; the message gives the point.
    """
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
    place = np.array([_place(path, number, point) for number, point in enumerate(points, start=1)])
    found = [_time(path, number, point) for number, point in enumerate(points, start=1)]
    missing = [number for number, moment in enumerate(found, start=1) if moment is None]
    if missing:
        few = (
            "no point has a time" if len(missing) == len(points) else f"point {missing[0]} of {len(points)}: no <time>"
        )
        raise InputError(
            f"{path}: {few}; a recorded track needs the time of every point. A track without times is "
            "travelled at a constant speed with track.speed_mps."
        )
    time = np.array([moment for moment, _ in filter(None, found)])
    origin = int(np.floor(time[0]))
    notes = []
    if len(segments) > 1:
        notes.append(f"{len(segments)} segments of {' + '.join(str(len(s)) for s in segments[:8])} points are joined.")
    if not all(zone for _, zone in filter(None, found)):
        notes.append("Times without a time zone are taken as UTC.")
    height = np.array([_number(point.findtext("ele")) for point in points])
    fixes = FixStream(time - origin, place[:, 0] * DEG, place[:, 1] * DEG, height, "mean sea level")
    return Streams(path, "gpx", Clock("utc", origin, "UTC of GPX"), fixes={"gnss": fixes}, notes=tuple(notes))


def read_path(path: Path) -> Array | None:
    """Return the points of a GPX file's tracks, or of its routes if it has no track, without their times.

    Returns:
        Longitude and latitude in degrees and height in m, NaN if missing, (N, 3); None if there are no points.

    Raises:
        InputError: the file is not GPX, or a point has no place.
    """
    root = read_xml(path)
    points = list(root.iter("trkpt")) or list(root.iter("rtept"))
    if not points:
        return None
    places = [_place(path, number, point) for number, point in enumerate(points, start=1)]
    return np.array([(b, a, _number(point.findtext("ele"))) for (a, b), point in zip(places, points, strict=True)])


def _place(path: Path, number: int, point: Element) -> tuple[float, float]:
    try:
        return float(point.attrib["lat"]), float(point.attrib["lon"])
    except (KeyError, ValueError) as error:
        given = " ".join(f'{key}="{value}"' for key, value in point.attrib.items())
        raise InputError(
            f'{path}, point {number}: <trkpt {shortened(given)}> has no place; lat="51.5" lon="-0.1" would be one.'
        ) from error


def _time(path: Path, number: int, point: Element) -> tuple[float, bool] | None:
    text = point.findtext("time")
    if text is None or not text.strip():
        return None
    try:
        return gps_seconds(text)
    except InputError as error:
        raise InputError(f"{path}, point {number}: {error}") from error


def _number(text: str | None) -> float:
    try:
        return float(text) if text is not None else float("nan")
    except ValueError:
        return float("nan")
