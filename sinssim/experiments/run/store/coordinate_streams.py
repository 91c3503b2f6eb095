"""The streams of a motion in further coordinates: Earth-fixed, inertial, along a frame's axes, on another ellipsoid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sinssim import earth, rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.models import Ellipsoid
from sinssim.recording.streams import Computed, Stream, Vector
from sinssim.strapdown import coordinates

Motion = NavState | NavSolution
Parts = Callable[[slice], tuple[Array, ...]]
"""Returns the vectors of a block of rows."""


@dataclass(frozen=True)
class CoordinateStreams:
    """Makes the streams of a run's motions in the coordinates that its scenario records.

    Attributes:
        names: kinds of coordinates, see `sinssim.scenario.sections.output.COORDINATES`.
        angles: range of the heading, or "continuous"; None for no angles.
        ellipsoid: of the geodetic coordinates.
        pole: pole of the route of conditional coordinates, Earth-fixed unit vector, (3,).
        start: latitude and longitude of the start of that route, rad.
        epoch: instant at which the inertial axes are the Earth's, s: the start of the run, for all motions of it.
    """

    names: tuple[str, ...]
    angles: str | None
    ellipsoid: Ellipsoid
    pole: Array
    start: tuple[float, float]
    epoch: float

    def of(self, name: str, time: Array, motion: Motion) -> Iterator[Stream]:
        """Yield the streams of one motion.

        Args:
            name: "truth" or the algorithm; the names of the streams end with it.
            time: (N,) s.
            motion: N rows. Coordinates along a frame's axes need a solution with an azimuth.
        """
        for kind in self.names:
            if kind == "frame" and getattr(motion, "azimuth", None) is None:
                continue  # the azimuth of a frame depends on the path, and only a solution has it
            columns, parts = self._coordinates(kind, time, motion)
            yield _stream(f"{kind.replace('-', '_').replace('.', '_')}_{name}", time, columns, parts)
        if self.angles is not None:
            yield self._angles_of(name, time, motion)

    def _coordinates(self, kind: str, time: Array, motion: Motion) -> tuple[dict[str, tuple[str, ...]], Parts]:
        """Return the columns of each vector, and the function that computes the vectors."""

        def rows_of(rows: slice) -> NavState:
            m = motion
            return NavState(m.latitude[rows], m.longitude[rows], m.height[rows], m.velocity_ned[rows], m.q_nb[rows])

        match kind:
            case "earth-fixed":
                return _cartesian("e"), lambda rows: tuple(coordinates.earth_fixed(rows_of(rows), self.ellipsoid))
            case "inertial":
                return _cartesian("i"), lambda rows: tuple(
                    coordinates.inertial(rows_of(rows), time[rows], self.ellipsoid, self.epoch)
                )
            case "frame":
                of_x = getattr(motion, "azimuth", np.zeros(0))
                return _LEVEL, lambda rows: _columns(*coordinates.level_axes(rows_of(rows), of_x[rows]))
            case "conditional":
                return _CONDITIONAL, self._conditional(rows_of)
            case _:
                return {"position": ("latitude_rad", "longitude_rad", "height_m")}, lambda rows: (
                    self._on(kind, rows_of(rows)),
                )

    def _conditional(self, rows_of: Callable[[slice], NavState]) -> Parts:
        def parts(rows: slice) -> tuple[Array, ...]:
            found = coordinates.conditional(rows_of(rows), self.pole, self.start)
            return np.column_stack((found.latitude, found.longitude)), *_columns(*found.axes)

        return parts

    def _on(self, name: str, motion: NavState) -> Array:
        """Return geodetic coordinates on another ellipsoid, in its datum if both have one, (N, 3)."""
        place = earth.geodetic_to_ecef(motion.latitude, motion.longitude, motion.height, self.ellipsoid)
        if name in earth.DATUMS and self.ellipsoid.name in earth.DATUMS:
            place = earth.change_datum(place, self.ellipsoid.name, name)
        return np.column_stack(earth.ecef_to_geodetic(place, earth.ellipsoid_by_name(name)))

    def _angles_of(self, name: str, time: Array, motion: Motion) -> Stream:
        """Return the stream of the Euler angles; continuous ones depend on all rows before."""
        assert self.angles is not None
        if self.angles == "continuous":
            found = rotation.continuous_angles(motion.q_nb)
        else:
            roll, pitch, heading = rotation.euler_from_quaternion(motion.q_nb)
            found = roll, pitch, rotation.heading_in(self.angles, heading)
        columns = ("roll_rad", "pitch_rad", "heading_rad")
        return Stream(f"angles_{name}", time, (Vector("angles", columns, np.column_stack(found)),))


def _cartesian(axes: str) -> dict[str, tuple[str, ...]]:
    columns = {
        "position": tuple(f"{axis}_{axes}_m" for axis in "xyz"),
        "velocity": tuple(f"v{axis}_{axes}_mps" for axis in "xyz"),
        "attitude": tuple(f"q_{axes}b_{part}" for part in "wxyz"),
    }
    if axes == "i":
        columns["angles"] = ("about_x_i_rad", "about_y_i_rad", "about_z_i_rad")
    return columns


_LEVEL = {
    "azimuth": ("azimuth_of_x_rad",),
    "velocity": ("velocity_x_mps", "velocity_y_mps", "velocity_d_mps"),
    "heading": ("heading_from_x_rad",),
}
_CONDITIONAL = {"position": ("conditional_latitude_rad", "conditional_longitude_rad"), **_LEVEL}


def _columns(*vectors: Array) -> tuple[Array, ...]:
    """Return vectors with one-dimensional ones as columns."""
    return tuple(v if v.ndim > 1 else v[:, np.newaxis] for v in vectors)


def _stream(name: str, time: Array, columns: dict[str, tuple[str, ...]], parts: Parts) -> Stream:
    """Return a stream whose vectors are computed together, block by block."""
    # two threads write the vectors of a block, one after the other
    block = lru_cache(maxsize=2)(lambda start, stop: parts(slice(start, stop)))

    def one(number: int) -> Computed:
        return Computed(lambda rows: block(rows.start, rows.stop)[number])

    return Stream(name, time, tuple(Vector(key, names, one(i)) for i, (key, names) in enumerate(columns.items())))
