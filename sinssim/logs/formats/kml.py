"""KML 2.2: gx:Track with times; a LineString without times is refused with what to do (OGC 07-147r2)."""

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
    """Return whether a file with these first bytes may be KML."""
    return of_file(path, head, b"kml")


def read(path: Path) -> Streams:
    """Return the points of the gx:Track elements of a KML file, in the order of the file.

    Returns:
        One stream of fixes, named "gnss".

    Raises:
        InputError: the file is not KML, has no timed track, or a point cannot be read; the message gives the point.
    """
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
            rows.append(_numbers(path, number, (coord.text or "").split()))
    time, place = np.array(moments), np.array(rows)
    origin = int(np.floor(time[0]))
    notes = () if zoned else ("Times without a time zone are taken as UTC.",)
    fixes = FixStream(time - origin, place[:, 1] * DEG, place[:, 0] * DEG, place[:, 2], "mean sea level")
    return Streams(path, "kml", Clock("utc", origin, "UTC of KML"), fixes={"gnss": fixes}, notes=notes)


def read_path(path: Path) -> Array | None:
    """Return the points of the LineStrings of a KML file, which have no times.

    Returns:
        Longitude and latitude in degrees and height in m, NaN if missing, (N, 3); None if there is no LineString.

    Raises:
        InputError: the file is not KML, or a point cannot be read.
    """
    return path_of_lines(read_xml(path), path)


def path_of_lines(root: Element, path: Path | None = None) -> Array | None:
    """Return the points of all LineStrings below an element, see `read_path`."""
    words = [word for line in root.iter("LineString") for word in (line.findtext("coordinates") or "").split()]
    if not words:
        return None
    return np.array([_numbers(path, number, word.split(",")) for number, word in enumerate(words, start=1)])


def _numbers(path: Path | None, number: int, words: list[str]) -> tuple[float, float, float]:
    try:
        longitude, latitude, *rest = (float(word) for word in words if word)
        return longitude, latitude, rest[0] if rest else float("nan")
    except ValueError as error:
        raise InputError(
            f"{path or 'the KML file'}, point {number}: {shortened(' '.join(words))!r} is not longitude, latitude and "
            "height."
        ) from error
