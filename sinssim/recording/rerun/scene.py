"""The flight as a 3D scene: a local plane with east, north and height, and an enlarged aircraft.

Rerun draws in single precision, so positions are metres from the start of the flight. East and north lie in the plane
that touches the ellipsoid at the start. The third axis is height above the ellipsoid instead of height above the plane;
otherwise a long flight would sink below the horizon.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sinssim import rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.coordinates import geodetic_to_ecef
from sinssim.earth.models import WGS84, Ellipsoid

_SCALES = (1, 2, 5, 10, 20, 50)
_MAP_POINTS = 220.0
"""Part of the screen that the tracks on the map fill, points."""


@dataclass(frozen=True)
class Scene:
    """Geometry of the 3D view.

    Attributes:
        latitude, longitude, height: start of the flight, rad, rad, m.
        floor: height drawn as zero, m.
        height_scale: factor by which heights are exaggerated.
        size: diagonal of the flight as drawn, m.
        center: middle of the flight as drawn, (3,) m.
        side: horizontal direction from which the flight looks longest, (2,).
        ellipsoid: reference ellipsoid.
    """

    latitude: float
    longitude: float
    height: float
    floor: float
    height_scale: int
    size: float
    center: Array
    side: Array
    ellipsoid: Ellipsoid

    @classmethod
    def around(cls, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Scene:
        """Return the scene that shows a whole flight.

        Args:
            truth: true states, N rows.
            ellipsoid: reference ellipsoid.

        Returns:
            The scene; heights are exaggerated if the flight is much longer than high.
        """
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
    def aircraft_length(self) -> float:
        """Length of the aircraft as drawn, m."""
        return 0.09 * self.size

    def points(self, latitude: Array, longitude: Array, height: Array) -> Array:
        """Return positions in the scene.

        Args:
            latitude, longitude: (N,) rad.
            height: (N,) m.

        Returns:
            East, north and exaggerated height above the floor, (N, 3) m.
        """
        origin = geodetic_to_ecef(self.latitude, self.longitude, self.height, self.ellipsoid)
        east, north = self._plane()
        difference = geodetic_to_ecef(latitude, longitude, height, self.ellipsoid) - origin
        return np.column_stack((difference @ east, difference @ north, (height - self.floor) * self.height_scale))

    def attitudes(self, latitude: Array, longitude: Array, q_nb: Array) -> Array:
        """Return attitudes in the scene: level attitudes stay level, and north is along the drawn meridian.

        Args:
            latitude, longitude: (N,) rad.
            q_nb: (N, 4).

        Returns:
            Quaternions, scene from body, (N, 4).
        """
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

    Args:
        tracks: with arrays of latitude and longitude, rad.

    Returns:
        The zoom level.
    """
    first = tracks[0].longitude[0]
    limit = np.radians(85.0)  # latitude limit of such maps
    x, y = [], []
    for track in tracks:
        rows = _some_rows(len(track.latitude))
        x.append((track.longitude[rows] - first + np.pi) % (2.0 * np.pi))
        y.append(np.arcsinh(np.tan(np.clip(track.latitude[rows], -limit, limit))))
    turns = max(np.ptp(np.concatenate(x)), np.ptp(np.concatenate(y))) / (2.0 * np.pi)
    return float(np.clip(np.log2(_MAP_POINTS / 256.0 / max(turns, 1e-9)), 1.0, 18.0))


def _across(points: Array) -> Array:
    """Return the horizontal direction across the longest extent of points (N, 2), to the south of them if possible."""
    _, axes = np.linalg.eigh(np.cov(points.T))
    side: Array = axes[:, 0]  # direction of the smallest variance
    return -side if side[1] > 0.0 else side


def aircraft_mesh() -> tuple[Array, NDArray[np.uint32], Array]:
    """Return a simple aircraft of length 1 in body axes, its centre at the origin.

    Returns:
        Vertices (V, 3), triangles (T, 3), brightness of each vertex (V,), 0…1.
    """
    surfaces = [
        _loft([_circle(0.5, 0.004), _circle(0.46, 0.03), _circle(0.38, 0.05), _circle(-0.2, 0.05),
               _circle(-0.5, 0.012, -0.03)], 1.0),
        _loft([_fin(-0.33, -0.47, -0.04, 0.008), _fin(-0.45, -0.51, -0.2, 0.003)], 0.75),
    ]  # fmt: skip
    for side in (1.0, -1.0):
        wing = [_blade(0.14, -0.08, 0.03 * side, 0.02, 0.012), _blade(-0.08, -0.15, 0.48 * side, -0.02, 0.004)]
        tail = [_blade(-0.36, -0.47, 0.01 * side, -0.03, 0.008), _blade(-0.44, -0.49, 0.18 * side, -0.04, 0.003)]
        surfaces += [_loft(wing, 0.85), _loft(tail, 0.85)]
    first = np.cumsum([0, *(len(s[0]) for s in surfaces[:-1])])
    return (
        np.concatenate([vertices for vertices, _, _ in surfaces]),
        np.concatenate([triangles + n for (_, triangles, _), n in zip(surfaces, first, strict=True)]).astype(np.uint32),
        np.concatenate([brightness for _, _, brightness in surfaces]),
    )


_Ring = list[tuple[float, float, float]]


def _circle(x: float, radius: float, z: float = 0.0) -> _Ring:
    """Return a ring of the fuselage."""
    angles = [k * 2.0 * np.pi / 12 for k in range(12)]
    return [(x, radius * float(np.cos(a)), z + radius * float(np.sin(a))) for a in angles]


def _profile(lead: float, trail: float, half: float) -> list[tuple[float, float]]:
    """Return a diamond between leading and trailing edge."""
    middle = 0.6 * lead + 0.4 * trail
    return [(lead, 0.0), (middle, -half), (trail, 0.0), (middle, half)]


def _blade(lead: float, trail: float, y: float, z: float, half: float) -> _Ring:
    """Return a section of a wing."""
    return [(x, y, z + d) for x, d in _profile(lead, trail, half)]


def _fin(lead: float, trail: float, z: float, half: float) -> _Ring:
    """Return a section of the fin."""
    return [(x, d, z) for x, d in _profile(lead, trail, half)]


def _loft(rings: list[_Ring], brightness: float) -> tuple[Array, NDArray[np.int64], Array]:
    """Return the closed surface through rings of equally many points; its lower half is darker."""
    n = len(rings[0])
    vertices = np.array([point for ring in rings for point in ring])
    below = np.concatenate([[p[2] > np.mean([q[2] for q in ring]) + 1e-9 for p in ring] for ring in rings])
    triangles = []
    for a in range(0, len(vertices) - n, n):
        for i in range(n):
            j = (i + 1) % n
            triangles += [(a + i, a + j, a + n + i), (a + j, a + n + j, a + n + i)]
    for end in (0, len(vertices) - n):
        triangles += [(end, end + i, end + i + 1) for i in range(1, n - 1)]
    return vertices, np.array(triangles), np.where(below, 0.55, 1.0) * brightness
