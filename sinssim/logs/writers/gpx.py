"""GPX 1.1 (Topografix): one track of one segment with heights and times."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

from sinssim.logs.writers.path_points import HEIGHTS, path_points
from sinssim.logs.writers.run_export import Content

SUFFIX = ".gpx"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
    """Write the file."""
    p = path_points(content)
    name = escape(f"{content.run.name}: {content.solution_name}")
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.1" creator="sinssim" xmlns="http://www.topografix.com/GPX/1/1">',
        f"<metadata><name>{name}</name><desc>{escape(HEIGHTS)}</desc><time>{p.dates[0]}</time></metadata>",
        f"<trk><name>{name}</name><trkseg>",
        *(
            f'<trkpt lat="{latitude:.9f}" lon="{longitude:.9f}"><ele>{height:.4f}</ele><time>{date}</time></trkpt>'
            for latitude, longitude, height, date in zip(p.latitude, p.longitude, p.height, p.dates, strict=True)
        ),
        "</trkseg></trk></gpx>",
    ]
    place.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [f"The path of {content.solution_name}: {p.sentence}", HEIGHTS, "Times are UTC."]
