"""GeoJSON (RFC 7946): one line, cut at the antimeridian, with the times of its points."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np

from sinssim.logs.writers.path_points import path_points
from sinssim.logs.writers.run_export import Content

SUFFIX = ".geojson"
HOLDS = "solution"


def write(content: Content, place: Path) -> list[str]:
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
