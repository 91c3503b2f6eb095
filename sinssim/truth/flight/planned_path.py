"""The planned path of a flight as geometry: the points of a track, and where an aircraft is beside it.

A track is a line of points so near to one another that the straight lines between them are the path to a millimetre:
great circles on the sphere of the latitudes, which the autopilot steers along, lines of constant heading in the wind,
and arcs of turns, whose ways over the ground are laid on the ellipsoid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sinssim.data import Array

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_SPACING = 250.0
"""Longest distance of two points of a track, m; a line of constant heading bends by 2 mm over it at 60° of latitude."""
SAGITTA = 1e-3
"""Largest distance of an arc from the straight lines between its points, m."""
_RADIUS = 6.37e6  # m


def _ecef(latitude: Array, longitude: Array, height: Array) -> Array:
    from sinssim.earth.geodetic_coordinates import geodetic_to_ecef  # needs the compiler

    return geodetic_to_ecef(latitude, longitude, height)


def _radii(latitude: Array) -> tuple[Array, Array]:
    from sinssim.earth.geodetic_coordinates import radii  # needs the compiler

    r1, r2 = radii(latitude)
    return np.asarray(r1), np.asarray(r2)


class Begin(NamedTuple):
    """Where a leg begins: time, s; latitude, longitude, heading, rad; height, m."""

    time: float
    latitude: float
    longitude: float
    height: float
    heading: float


class Beside(NamedTuple):
    """Places by the path: way along it from its beginning, distance to its right and above it, (N,) m each."""

    along: Array
    right: Array
    above: Array


@dataclass(frozen=True, eq=False)
class PlannedTrack:
    """The planned path over the ground of a leg, or to one place of a route, with its heights.

    Attributes:
        latitude, longitude: of its points in order, (K,) rad, at least two.
        height: planned height above the ellipsoid, (K,) m; NaN where none is planned.
        level: height at which lengths along it are measured, m.
        bounded: whether it says nothing of places before its beginning and after its end; else it goes straight on.
    """

    latitude: Array
    longitude: Array
    height: Array
    level: float
    bounded: bool = False

    @cached_property
    def _tree(self) -> cKDTree:
        from scipy.spatial import cKDTree  # takes long to import

        return cKDTree(_ecef(self.latitude, self.longitude, np.zeros_like(self.latitude)))

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """North and east at the points, Earth-fixed, (K, 3) each."""
        s, c = np.sin(self.latitude), np.cos(self.latitude)
        sl, cl = np.sin(self.longitude), np.cos(self.longitude)
        return np.column_stack((-s * cl, -s * sl, c)), np.column_stack((-sl, cl, 0.0 * c))

    @cached_property
    def _directions(self) -> tuple[Array, Array, Array]:
        """Directions north and east of the ways before and after each point, (K, 2), and their sum until it, (K,) m."""
        points = _ecef(self.latitude, self.longitude, np.full(len(self.latitude), self.level))
        way, (north, east) = np.diff(points, axis=0), self._axes
        length = np.linalg.norm(way, axis=1)

        def resolved(at: slice) -> Array:
            parts = np.column_stack((np.sum(way * north[at], axis=1), np.sum(way * east[at], axis=1)))
            return np.asarray(parts / np.hypot(*parts.T)[:, None])

        before, after = resolved(slice(1, None)), resolved(slice(None, -1))
        return np.vstack((after[:1], before)), np.vstack((after, before[-1:])), np.append(0.0, np.cumsum(length))

    @property
    def length(self) -> float:
        """Its length, m."""
        return float(self._directions[2][-1])

    @property
    def right_at_end(self) -> Array:
        """Direction to the right of it at its end, north and east, (2,)."""
        north, east = self._directions[0][-1]
        return np.array([-east, north])

    def beside(self, latitude: Array, longitude: Array, height: Array) -> Beside:
        """Return where places are by the path.

        Args:
            latitude, longitude: (N,) rad.
            height: (N,) m; distances are measured there.

        Returns:
            NaN above the path where no height is planned, and outside a bounded one.
        """
        _, near = self._tree.query(_ecef(latitude, longitude, np.zeros_like(latitude)))
        here = _ecef(self.latitude[near], self.longitude[near], height)
        off = _ecef(latitude, longitude, height) - here
        north, east = (np.sum(off * axis[near], axis=1) for axis in self._axes)
        arc = 1.0 + (north**2 + east**2) / (6.0 * _RADIUS**2)  # from the plane that touches there to the ground
        north, east = north * arc, east * arc
        before, after, way = self._directions
        ahead = north * after[near, 0] + east * after[near, 1] >= 0.0
        course = np.where(ahead[:, None], after[near], before[near])
        along = way[near] + north * course[:, 0] + east * course[:, 1]
        right = east * course[:, 0] - north * course[:, 1]
        above = height - np.interp(along, way, self.height)
        if self.bounded:
            outside = (along < 0.0) | (along > way[-1])
            right, above = np.where(outside, np.nan, right), np.where(outside, np.nan, above)
        return Beside(along, right, above)

    def at(self, along: Array) -> Array:
        """Return latitude and longitude, rad, and height, m, (N, 3), of places along it, (N,) m from its beginning; NaN
        outside a bounded one."""
        way = self._directions[2]
        columns = []
        for values in (self.latitude, self.longitude):
            first, last = ((values[k + 1] - values[k]) / (way[k + 1] - way[k]) for k in (0, len(way) - 2))
            beyond = np.minimum(along, 0.0) * first + np.maximum(along - way[-1], 0.0) * last
            columns.append(np.interp(along, way, values) + beyond)
        places = np.column_stack((*columns, np.interp(along, way, self.height)))
        if self.bounded:
            places[(along < 0.0) | (along > way[-1])] = np.nan
        return places

    def shifted(self, right: float) -> tuple[Array, Array]:
        """Return the points moved to the right, m: latitude and longitude, (K,) rad, for a corridor in a picture."""
        course = self._directions[1]
        r1, r2 = _radii(self.latitude)
        longitude = self.longitude + right * course[:, 0] / ((r2 + self.level) * np.cos(self.latitude))
        return self.latitude - right * course[:, 1] / (r1 + self.level), longitude


def great_circle(begin: tuple[float, float], end: tuple[float, float], spacing: float = 4.0 * _SPACING) -> Array:
    """Return the points of a great circle on the sphere of the latitudes between two places, (K, 2) rad."""
    latitude, longitude = np.array([begin, end]).T
    c = np.cos(latitude)
    first, last = np.column_stack((c * np.cos(longitude), c * np.sin(longitude), np.sin(latitude)))
    angle = math.atan2(float(np.linalg.norm(np.cross(first, last))), float(first @ last))
    share = np.linspace(0.0, 1.0, 2 + int(angle * _RADIUS / spacing))[:, None]
    if angle < 1e-12:
        return np.array([begin, end])
    points = (np.sin((1.0 - share) * angle) * first + np.sin(share * angle) * last) / math.sin(angle)
    turned = np.arctan2(points[:, 1], points[:, 0])
    turned = begin[1] + np.remainder(turned - begin[1] + np.pi, 2.0 * np.pi) - np.pi
    return np.column_stack((np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])), turned))


def over_ground(begin: tuple[float, float], level: float, ways: Sequence[tuple[float, float]]) -> Array:
    """Return the points of ways north and east over the ground, one after another, at a height, m, (K, 2) rad."""
    counts = [max(1, math.ceil(math.hypot(*way) / _SPACING)) for way in ways]
    north, east = np.repeat(np.array(ways) / np.array(counts)[:, None], counts, axis=0).T
    latitude = np.full(len(north) + 1, begin[0])
    for _ in range(4):  # the radius changes by 1 % at most
        middle = 0.5 * (latitude[1:] + latitude[:-1])
        r1, r2 = _radii(middle)
        latitude = begin[0] + np.append(0.0, np.cumsum(north / (r1 + level)))
    return np.column_stack((latitude, begin[1] + np.append(0.0, np.cumsum(east / ((r2 + level) * np.cos(middle))))))
