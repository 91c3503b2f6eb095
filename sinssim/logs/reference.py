"""A recorded solution as the reference of a run: whole, position only, or anything in between.

Positions are interpolated in Earth-fixed axes and velocities in north, east, down by cubic splines, attitudes by the
cubic spline of rotations with continuous angular acceleration (scipy's RotationSpline). Nothing is interpolated over a
gap. If the reference has fewer than three rows a second, an instant counts as known only near one of its rows, because
a spline would miss what happens in between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, NavSolution, NavState
from sinssim.earth.coordinates import ecef_to_geodetic, geodetic_to_ecef
from sinssim.earth.models import WGS84, Ellipsoid
from sinssim.strapdown.nav_error import NavError, navigation_error
from sinssim.system.short_repr import short_repr

_DENSE = 0.34
"""Longest interval of rows between which every instant counts as known, s: a car's jerk changes by 15 m/s⁴, so that the
spline is then in error by h⁴/384 · 15 m/s⁴ = 0.5 mm."""
_NEAR = 0.02
"""How near to a row an instant counts as known otherwise, s."""
_SAME = 1e-6
"""Instants closer together than this are the same, s."""
_GAPS = 3.0
"""Ratio to the usual interval from which a longer one is a gap."""


@short_repr
@dataclass(frozen=True)
class Reference:
    """A solution that others are compared with.

    Attributes:
        name: what it is, for titles: "gnss.pos".
        time: in the run's time, increasing, (M,) s.
        latitude, longitude: (M,) rad.
        height: above the ellipsoid, (M,) m.
        velocity_ned: (M, 3) m/s; None if unknown.
        q_nb: attitude of the sensor block, (M, 4); None if unknown.
        position_sigma: north, east, down, (M, 3) m; None if unknown.
        lever_arm: from the block to the reference's point, block axes, (3,) m.
        gap: longest interval that is interpolated, s.
        velocity_time: instants of the velocities if they differ from `time`, (M,) s.
        ellipsoid: reference ellipsoid.
    """

    name: str
    time: Array
    latitude: Array
    longitude: Array
    height: Array
    velocity_ned: Array | None = None
    q_nb: Array | None = None
    position_sigma: Array | None = None
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gap: float | None = None
    velocity_time: Array | None = None
    ellipsoid: Ellipsoid = WGS84

    @property
    def knows(self) -> tuple[str, ...]:
        """What it has: "position", "velocity", "attitude"."""
        found = ("position", self.time), ("velocity", self.velocity_ned), ("attitude", self.q_nb)
        return tuple(name for name, values in found if values is not None)

    def known(self, time: Array) -> NDArray[np.bool_]:
        """Return at which instants its position is known, (N,)."""
        return _known(self.time, time, self.gap)

    def state_at(self, time: Array) -> NavState | None:
        """Return whole states of the sensor block, N rows; None if one of them is not known or not whole."""
        if not self.known(time).all():
            return None
        state, moving, turned = self._at(time)
        if not (moving.all() and turned.all()):
            return None
        if not any(self.lever_arm):
            return state
        around = np.concatenate([time - 0.05, time, time + 0.05]).clip(self.time[0], self.time[-1])
        order = np.argsort(around, kind="stable")
        wide = self._at(around[order])[0]
        rows = NavSolution(
            around[order] + 1e-9 * np.arange(len(order)), wide.latitude, wide.longitude, wide.height,
            wide.velocity_ned, wide.q_nb, np.zeros(len(order)),
        )  # fmt: skip
        back = _at_point(rows, _turning(rows), -np.array(self.lever_arm), self.ellipsoid)
        own = np.searchsorted(around[order], time)
        return NavState(
            back.latitude[own], back.longitude[own], back.height[own], back.velocity_ned[own], back.q_nb[own]
        )

    def error_of(self, solution: NavSolution) -> NavError:
        """Return what a solution differs by, at each of its rows; NaN where the reference is not known.

        Args:
            solution: N rows.

        Returns:
            Solution minus reference, N rows, at the reference's point if the reference has no attitude.
        """
        count = len(solution.time)
        found = NavError(solution.time, *(np.full((count, 3), np.nan) for _ in range(3)))
        rows = np.flatnonzero(self.known(solution.time))
        if not len(rows):
            return found
        own = _rows(solution, rows)
        if any(self.lever_arm) and self.q_nb is None:
            own = _at_point(own, _turning(solution)[rows], np.array(self.lever_arm), self.ellipsoid)
        there, moving, turned = self._at(own.time)
        if any(self.lever_arm) and self.q_nb is not None:
            # the block's own attitude is known: the reference is taken to the block
            back = NavSolution(
                own.time, there.latitude, there.longitude, there.height, there.velocity_ned, there.q_nb, own.defect
            )
            turns = _turning(back)
            back = _at_point(back, turns, -np.array(self.lever_arm), self.ellipsoid)
            there = NavState(back.latitude, back.longitude, back.height, back.velocity_ned, back.q_nb)
        error = navigation_error(there, own, self.ellipsoid)
        found.position_ned[rows] = error.position_ned
        found.velocity_ned[rows[moving]] = error.velocity_ned[moving]
        found.attitude[rows[turned]] = error.attitude[turned]
        return found

    def _at(self, time: Array) -> tuple[NavState, NDArray[np.bool_], NDArray[np.bool_]]:
        """Return states at known instants, and at which of them velocity and attitude are known."""
        latitude, longitude, height = ecef_to_geodetic(self._place(time), self.ellipsoid)
        none = np.zeros(len(time), dtype=bool)
        velocity, moving = np.zeros((len(time), 3)), none
        if self._speed is not None:
            instants, speed = self._speed
            moving = _known(instants, time, self.gap)
            velocity[moving] = speed(time[moving])
        q_nb, turned = np.tile((1.0, 0.0, 0.0, 0.0), (len(time), 1)), none
        if self._turn is not None:
            instants, turn = self._turn
            turned = _known(instants, time, self.gap)
            q_nb[turned] = turn(time[turned])
        return NavState(latitude, longitude, height, velocity, q_nb), moving, turned

    @cached_property
    def _place(self) -> Callable[[Array], Array]:
        position = geodetic_to_ecef(self.latitude, self.longitude, self.height, self.ellipsoid)
        return _spline(self.time, position, self.gap)

    @cached_property
    def _speed(self) -> tuple[Array, Callable[[Array], Array]] | None:
        if self.velocity_ned is None:
            return None
        rows = np.isfinite(self.velocity_ned).all(axis=1)
        instants = (self.time if self.velocity_time is None else self.velocity_time)[rows]
        return (instants, _spline(instants, self.velocity_ned[rows], self.gap)) if len(instants) > 1 else None

    @cached_property
    def _turn(self) -> tuple[Array, Callable[[Array], Array]] | None:
        if self.q_nb is None:
            return None
        rows = np.isfinite(self.q_nb).all(axis=1)
        instants = self.time[rows]
        return (instants, _rotation_spline(instants, self.q_nb[rows], self.gap)) if len(instants) > 1 else None

    def sigma_at(self, time: Array) -> Array | None:
        """Return its own 1σ of the position north, east, down, (N, 3) m; None if unknown."""
        if self.position_sigma is None:
            return None
        sigma = np.column_stack([np.interp(time, self.time, column) for column in self.position_sigma.T])
        sigma[~self.known(time)] = np.nan
        return sigma


def _known(own: Array, time: Array, gap: float | None) -> NDArray[np.bool_]:
    if len(own) < 2:
        return np.zeros(len(time), dtype=bool)
    usual = float(np.median(np.diff(own)))
    longest = _GAPS * usual if gap is None else gap
    after = np.searchsorted(own, time).clip(1, len(own) - 1)
    near = np.minimum(np.abs(own[after] - time), np.abs(time - own[after - 1])) <= min(_NEAR, 0.5 * usual)
    covered = (time >= own[0] - _SAME) & (time <= own[-1] + _SAME)
    return np.asarray(covered & (near if usual > _DENSE else near | (own[after] - own[after - 1] <= longest)))


def _spline(time: Array, values: Array, gap: float | None) -> Callable[[Array], Array]:
    """Return what interpolates values, by one cubic spline for each part between two gaps."""
    from scipy.interpolate import CubicSpline

    def make(t: Array, rows: Array) -> Callable[[Array], Array]:
        spline = CubicSpline(t, rows, bc_type="not-a-knot" if len(t) > 3 else "natural")
        return lambda at: np.asarray(spline(at))

    return _in_parts(time, values, gap, make)


def _rotation_spline(time: Array, q_nb: Array, gap: float | None) -> Callable[[Array], Array]:
    """Return what interpolates attitudes, by one spline of rotations for each part between two gaps."""
    from scipy.spatial.transform import Rotation, RotationSpline

    def make(t: Array, rows: Array) -> Callable[[Array], Array]:
        spline = RotationSpline(t, Rotation.from_quat(rows, scalar_first=True))
        return lambda at: np.asarray(spline(at.clip(t[0], t[-1])).as_quat(scalar_first=True))

    return _in_parts(time, q_nb, gap, make)


def _in_parts(
    time: Array, values: Array, gap: float | None, make: Callable[[Array, Array], Callable[[Array], Array]]
) -> Callable[[Array], Array]:
    """Return what interpolates rows, by one function for each part between two gaps."""
    longest = _GAPS * float(np.median(np.diff(time))) if gap is None else gap
    cuts = np.flatnonzero(np.diff(time) > longest) + 1
    begins, ends = np.append(0, cuts), np.append(cuts, len(time))
    parts = [make(time[b:e], values[b:e]) if e - b > 1 else None for b, e in zip(begins, ends, strict=True)]

    def at(t: Array) -> Array:
        # an instant in a gap belongs to the nearer part
        which = np.searchsorted(0.5 * (time[cuts - 1] + time[cuts]), t)
        found = np.empty((len(t), values.shape[1]))
        for number, part in enumerate(parts):
            rows = which == number
            if rows.any():
                found[rows] = values[begins[number]] if part is None else part(t[rows])
        return found

    return at


def _rows(solution: NavSolution, rows: NDArray[np.intp]) -> NavSolution:
    s = solution
    return NavSolution(
        s.time[rows], s.latitude[rows], s.longitude[rows], s.height[rows], s.velocity_ned[rows], s.q_nb[rows],
        s.defect[rows], s.algorithm,
    )  # fmt: skip


def _turning(solution: NavSolution) -> Array:
    """Return the rate relative to the Earth in the block's axes from differences of the attitude, (N, 3) rad/s."""
    q, time = solution.q_nb, solution.time
    if len(time) < 3:
        return np.zeros((len(time), 3))
    step = rotation.rotation_vector_from_quaternion(rotation.multiply(rotation.conjugate(q[:-2]), q[2:]))
    rate = step / (time[2:] - time[:-2])[:, None]
    return np.vstack((rate[:1], rate, rate[-1:]))


def _at_point(solution: NavSolution, turning: Array, arm: Array, ellipsoid: Ellipsoid) -> NavSolution:
    """Return a solution for a point at a lever arm."""
    s = solution
    q_en = earth.q_en(s.latitude, s.longitude)
    position = geodetic_to_ecef(s.latitude, s.longitude, s.height, ellipsoid)
    position += rotation.rotate(q_en, rotation.rotate(s.q_nb, np.tile(arm, (len(s.time), 1))))
    latitude, longitude, height = ecef_to_geodetic(position, ellipsoid)
    velocity = s.velocity_ned + rotation.rotate(s.q_nb, np.cross(turning, arm))
    return NavSolution(s.time, latitude, longitude, height, velocity, s.q_nb, s.defect, s.algorithm)
