"""KML 2.2 (OGC 07-147r2) with Google's extension of tracks: a path with heights and time."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

from sinssim.logs.writers.path_points import HEIGHTS, path_points
from sinssim.logs.writers.run_export import Content

SUFFIX = ".kml"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
    """Write the file: a track, which has a slider of time, and the start and the end as points."""
    p = path_points(content)
    name = escape(f"{content.run.name}: {content.solution_name}")
    place_of = [
        f"{longitude:.9f} {latitude:.9f} {height:.4f}"
        for longitude, latitude, height in zip(p.longitude, p.latitude, p.height, strict=True)
    ]
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">',
        f"<Document><name>{name}</name><description>{escape(HEIGHTS)}</description>",
        '<Style id="path"><IconStyle><scale>0.6</scale></IconStyle>'
        "<LineStyle><color>ff739e00</color><width>3</width></LineStyle></Style>",
        *(_point(word, place_of[k], p.dates[k]) for word, k in (("start", 0), ("end", -1))),
        f"<Placemark><name>{name}</name><styleUrl>#path</styleUrl>",
        "<gx:Track><altitudeMode>absolute</altitudeMode>",
        *(f"<when>{date}</when>" for date in p.dates),
        *(f"<gx:coord>{coordinates}</gx:coord>" for coordinates in place_of),
        "</gx:Track></Placemark>",
        "</Document></kml>",
    ]
    place.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [f"The path of {content.solution_name}: {p.sentence}", HEIGHTS, "Times are UTC."]


def _point(word: str, coordinates: str, date: str) -> str:
    return (
        f"<Placemark><name>{word}</name><TimeStamp><when>{date}</when></TimeStamp><styleUrl>#path</styleUrl>"
        f"<Point><altitudeMode>absolute</altitudeMode>"
        f"<coordinates>{coordinates.replace(' ', ',')}</coordinates></Point></Placemark>"
    )
