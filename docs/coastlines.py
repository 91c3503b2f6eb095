"""Write sinssim/earth/coastlines.npz, the coasts and borders behind the maps, from a file of npm's world-atlas.

`make third-party` does it. The data are those of Natural Earth, in the public domain (naturalearthdata.com).
The file is a topology: arcs of whole steps, which the outlines of countries share. An arc of two countries is a border,
one of a single country a coast.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

FILE = Path(__file__).parents[1] / "sinssim" / "earth" / "coastlines.npz"


def numbers(rings: Any) -> Iterator[int]:
    """Yield the numbers of the arcs of nested rings; an arc in reverse has the complement of its number."""
    for ring in rings:
        if isinstance(ring, int):
            yield ring if ring >= 0 else ~ring
        else:
            yield from numbers(ring)


def main(source: Path) -> None:
    """Convert the arcs of a topology: steps of longitude and latitude, number of points, and whether it is a border."""
    topology = json.loads(source.read_text(encoding="utf-8"))
    countries = topology["objects"]["countries"]["geometries"]
    uses = Counter(number for country in countries for number in set(numbers(country["arcs"])))
    arcs = [np.array(arc, dtype="<i4") for arc in topology["arcs"]]
    transform = topology["transform"]
    np.savez_compressed(
        FILE,
        steps=np.ascontiguousarray(np.concatenate(arcs).T),
        counts=np.array([len(arc) for arc in arcs], dtype="<i4"),
        border=np.array([uses[number] > 1 for number in range(len(arcs))]),
        scale=np.array([*transform["scale"], *transform["translate"]]),  # deg: of a step, and of the first place
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
