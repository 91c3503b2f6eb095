"""The flight as a 3D scene: a local plane with east, north and height, and an enlarged vehicle.

Rerun draws in single precision, so positions are metres from the start of the flight. East and north lie in the plane
that touches the ellipsoid at the start. The third axis is height above the ellipsoid instead of height above the plane;
otherwise a long flight would sink below the horizon.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.geodetic_coordinates import geodetic_to_ecef

_SCALES = (1, 2, 5, 10, 20, 50)
_MAP_POINTS = 220.0
"""Part of the screen that the tracks on the map fill, points."""


@dataclass(frozen=True)
class Scene:
    """Geometry of the 3D view."""

    # latitude, longitude, height: start of the flight, rad, rad, m
    latitude: float
    longitude: float
    height: float
    floor: float  # height drawn as zero, m
    height_scale: int  # factor by which heights are exaggerated
    size: float  # diagonal of the flight as drawn, m
    center: Array  # middle of the flight as drawn, (3,) m
    side: Array  # horizontal direction from which the flight looks longest, (2,)
    ellipsoid: Ellipsoid  # reference ellipsoid

    @classmethod
    def around(cls, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Scene:
        """Return the scene that shows a whole flight; heights are exaggerated if it is much longer than high."""
        rows = _some_rows(len(truth.height))
        start = cls(
            float(truth.latitude[0]),
            float(truth.longitude[0]),
            float(truth.height[0]),
            float(truth.height.min()),
            1,
            0.0,
            np.zeros(3),
            np.zeros(2),
            ellipsoid,
        )
        points = start.points(truth.latitude[rows], truth.longitude[rows], truth.height[rows])
        extent = np.ptp(points, axis=0)
        scale = 1
        if extent[2] > 1.0:
            scale = max(s for s in _SCALES if s == 1 or s * extent[2] <= 0.25 * np.hypot(extent[0], extent[1]))
        low, high = points.min(axis=0), points.max(axis=0)
        low[2] *= scale
        high[2] *= scale
        return cls(
            start.latitude,
            start.longitude,
            start.height,
            start.floor,
            scale,
            max(float(np.linalg.norm(high - low)), 30.0),
            0.5 * (low + high),
            _across(points[:, :2]),
            ellipsoid,
        )

    @property
    def eye(self) -> tuple[float, float, float]:
        """Viewpoint from which the whole flight is visible, m."""
        x, y, z = self.center + self.size * np.array([0.8 * self.side[0], 0.8 * self.side[1], 0.5])
        return float(x), float(y), float(z)

    @property
    def middle(self) -> tuple[float, float, float]:
        """Middle of the flight as drawn, m."""
        x, y, z = self.center
        return float(x), float(y), float(z)

    @property
    def vehicle_length(self) -> float:
        """Length of the vehicle as drawn, m."""
        return 0.09 * self.size

    def points(self, latitude: Array, longitude: Array, height: Array) -> Array:
        """Return positions in the scene: east, north and exaggerated height above the floor, (N, 3) m. `latitude`,
        `longitude`: (N,) rad; `height`: (N,) m."""
        origin = geodetic_to_ecef(self.latitude, self.longitude, self.height, self.ellipsoid)
        east, north = self._plane()
        difference = geodetic_to_ecef(latitude, longitude, height, self.ellipsoid) - origin
        return np.column_stack((difference @ east, difference @ north, (height - self.floor) * self.height_scale))

    def attitudes(self, latitude: Array, longitude: Array, q_nb: Array) -> Array:
        """Return attitudes in the scene, scene from body, (N, 4): level attitudes stay level, and north is along the
        drawn meridian."""
        east, north = self._plane()
        sin_lat, cos_lat = np.sin(latitude), np.cos(latitude)
        local_north = np.column_stack((-sin_lat * np.cos(longitude), -sin_lat * np.sin(longitude), cos_lat))
        convergence = np.arctan2(local_north @ east, local_north @ north)
        half = -0.5 * convergence
        turn = np.column_stack((np.cos(half), np.zeros_like(half), np.zeros_like(half), np.sin(half)))
        # From north, east, down to east, north, up: rotation by π about the bisector of north and east.
        swap = np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0])
        return rotation.multiply(turn, rotation.multiply(swap, q_nb))

    def _plane(self) -> tuple[Array, Array]:
        sin_lat, cos_lat = np.sin(self.latitude), np.cos(self.latitude)
        sin_lon, cos_lon = np.sin(self.longitude), np.cos(self.longitude)
        east = np.array([-sin_lon, cos_lon, 0.0])
        north = np.array([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat])
        return east, north


def _some_rows(count: int) -> NDArray[np.intp]:
    """Return indices of a few thousand rows, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, 4096)).round().astype(np.intp))


def some_rows(track: NavState) -> NavState:
    """Return a few thousand rows of a track, enough for its zoom level."""
    rows = _some_rows(len(track.latitude))
    return NavState(*(np.asarray(values)[rows] for values in vars(track).values()))


def map_zoom(tracks: Sequence[NavState | NavSolution]) -> float:
    """Return the zoom level of a web map (Mercator, 256 points around the equator at level 0) that shows tracks.
    `tracks`: with arrays of latitude and longitude, rad."""
    first = tracks[0].longitude[0]
    limit = np.radians(85.0)  # latitude limit of such maps
    x, y = [], []
    for track in tracks:
        rows = _some_rows(len(track.latitude))
        x.append((track.longitude[rows] - first + np.pi) % (2.0 * np.pi))
        y.append(np.arcsinh(np.tan(np.clip(track.latitude[rows], -limit, limit))))
    turns = max(np.ptp(np.concatenate(x)), np.ptp(np.concatenate(y))) / (2.0 * np.pi)
    return float(np.clip(np.log2(_MAP_POINTS / 256.0 / max(turns, 1e-9)), 1.0, 18.0))


def drifted(track: NavState, solutions: Mapping[str, NavSolution]) -> list[str]:
    """Return the solutions that would more than double the width of a map."""
    zoom = map_zoom([track])
    return [name for name, solution in solutions.items() if map_zoom([track, solution]) < zoom - 1.0]


def _across(points: Array) -> Array:
    """Return the horizontal direction across the longest extent of points (N, 2), to the south of them if possible."""
    _, axes = np.linalg.eigh(np.cov(points.T))
    side: Array = axes[:, 0]  # direction of the smallest variance
    return -side if side[1] > 0.0 else side
