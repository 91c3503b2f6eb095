"""Makes `pyshtools_reference.npz`: potential and gradient of EGM2008 to degree 120 by pyshtools, at 1000 points.

    python tests/earth/make_pyshtools_reference.py EGM2008_120.gfc

It needs pyshtools (4.14), which the package does not. At the poles themselves, where pyshtools has no derivatives, the
gradient is the limit in closed form, P'_n(±1) = (±1)^(n−1) n(n + 1)/2, in which only orders 0 and 1 are left.

The points are given by geocentric latitude and longitude, deg, and radius, m; both poles are among them, and points
close to them. The potential leaves out the central term, and the gradient is in the directions of growing radius,
colatitude and longitude.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyshtools as pysh

PLACE = Path(__file__).with_name("pyshtools_reference.npz")
GM, R, DEGREE = 3.986004415e14, 6378136.3, 120


def coefficients(path: str) -> np.ndarray:
    """Return C and S, (2, 121, 121), without the central term."""
    cilm = np.zeros((2, DEGREE + 1, DEGREE + 1))
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        words = line.replace("d", "e").split()
        if words and words[0] == "gfc":
            n, m = int(words[1]), int(words[2])
            cilm[:, n, m] = float(words[3]), float(words[4])
    cilm[:, 0, 0] = 0.0
    return cilm


def points() -> np.ndarray:
    """Return 1000 points: latitude, longitude, radius."""
    rng = np.random.default_rng(20081)
    latitude = np.degrees(np.arcsin(rng.uniform(-1.0, 1.0, 1000)))
    longitude = rng.uniform(-180.0, 180.0, 1000)
    radius = 6371000.0 + rng.uniform(-1e4, 1e5, 1000)
    latitude[:6], longitude[:2] = (90.0, -90.0, 89.9, -89.9, 0.0, 89.0), 0.0
    return np.column_stack([latitude, longitude, radius])


def at_pole(cilm: np.ndarray, latitude: float, longitude: float, radius: float) -> np.ndarray:
    """Return the gradient at a pole, along the meridian of a longitude, (3,)."""
    n = np.arange(1.0, DEGREE + 1.0)
    fall = GM / radius**2 * (R / radius) ** n
    sign = 1.0 if latitude > 0.0 else -1.0
    slope = sign ** (n - 1.0) * n * (n + 1.0) / 2.0 * np.sqrt(2.0 * (2.0 * n + 1.0) / (n * (n + 1.0)))
    c, s, turn = cilm[0, 1:, 1], cilm[1, 1:, 1], np.radians(longitude)
    radial = -np.sum(fall * (n + 1.0) * np.sqrt(2.0 * n + 1.0) * sign**n * cilm[0, 1:, 0])
    along = sign * np.sum(fall * slope * (c * np.cos(turn) + s * np.sin(turn)))
    across = np.sum(fall * slope * (s * np.cos(turn) - c * np.sin(turn)))
    return np.array([radial, along, across])


def reference(cilm: np.ndarray, where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return potential, (N,), and gradient, (N, 3)."""
    potential, gradient = np.empty(len(where)), np.empty((len(where), 3))
    n = np.arange(DEGREE + 1.0)
    for i, (latitude, longitude, radius) in enumerate(where):
        scaled = cilm * ((R / radius) ** n)[None, :, None]
        potential[i] = GM / radius * pysh.expand.MakeGridPoint(scaled, latitude, longitude)
        if abs(latitude) == 90.0:
            gradient[i] = at_pole(cilm, latitude, longitude, radius)
        else:
            gradient[i] = pysh.gravmag.MakeGravGridPoint(cilm, GM, R, radius, latitude, longitude)
    return potential, gradient


if __name__ == "__main__":
    where = points()
    potential, gradient = reference(coefficients(sys.argv[1]), where)
    np.savez_compressed(PLACE, points=where, potential=potential, gradient=gradient)
