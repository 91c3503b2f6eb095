"""The reference of a run at any instant: a recorded solution, whole or in parts, or the stored truth.

Positions of a recorded solution are interpolated in Earth-fixed axes and velocities in north, east, down by cubic
splines, attitudes by the cubic spline of rotations with continuous angular acceleration (scipy's RotationSpline).
Nothing is interpolated over a gap. If the reference has fewer than three rows a second, an instant counts as known only
near one of its rows, because a spline would miss what happens in between. The stored truth of a simulated run is
interpolated by a cubic through four samples, in Earth-fixed axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sinssim import earth, rotation
from sinssim.data import Array, NavSolution, NavState, rows_of, short_repr, solution_of
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.earth.geodetic_coordinates import ecef_to_geodetic, geodetic_to_ecef, q_en
from sinssim.errors import InputError
from sinssim.logs.recorded_streams import SolutionStream
from sinssim.logs.stored_run import RecordedRun
from sinssim.strapdown.navigation_error import NavError, navigation_error, unknown_error

_DENSE = 0.34
"""Longest interval of rows between which every instant counts as known, s: a car's jerk changes by 15 m/s⁴, so that the
spline is then in error by h⁴/384 · 15 m/s⁴ = 0.5 mm."""
_NEAR_ROW = 0.02
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
        quantities = ("position", self.time), ("velocity", self.velocity_ned), ("attitude", self.q_nb)
        return tuple(name for name, values in quantities if values is not None)

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
        rows = solution_of(around[order] + 1e-9 * np.arange(len(order)), wide)
        back = _at_point(rows, _turning(rows), -np.array(self.lever_arm), self.ellipsoid)
        return rows_of(back, np.searchsorted(around[order], time))

    def error_of(self, solution: NavSolution) -> NavError:
        """Return solution minus reference at each row of a solution, NaN where the reference is not known; at the
        reference's point if the reference has no attitude."""
        difference = unknown_error(solution.time)
        rows = np.flatnonzero(self.known(solution.time))
        if not len(rows):
            return difference
        solved = solution_of(solution.time[rows], rows_of(solution, rows), solution.algorithm)
        if any(self.lever_arm) and self.q_nb is None:
            solved = _at_point(solved, _turning(solution)[rows], np.array(self.lever_arm), self.ellipsoid)
        there, moving, turned = self._at(solved.time)
        if any(self.lever_arm) and self.q_nb is not None:
            # the block's own attitude is known: the reference is taken to the block
            back = solution_of(solved.time, there)
            there = rows_of(_at_point(back, _turning(back), -np.array(self.lever_arm), self.ellipsoid), slice(None))
        error = navigation_error(there, solved, self.ellipsoid)
        difference.position_ned[rows] = error.position_ned
        difference.velocity_ned[rows[moving]] = error.velocity_ned[moving]
        difference.attitude[rows[turned]] = error.attitude[turned]
        return difference

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


def _known(nodes: Array, time: Array, gap: float | None) -> NDArray[np.bool_]:
    if len(nodes) < 2:
        return np.zeros(len(time), dtype=bool)
    usual = float(np.median(np.diff(nodes)))
    longest = _GAPS * usual if gap is None else gap
    after = np.searchsorted(nodes, time).clip(1, len(nodes) - 1)
    near = np.minimum(np.abs(nodes[after] - time), np.abs(time - nodes[after - 1])) <= min(_NEAR_ROW, 0.5 * usual)
    covered = (time >= nodes[0] - _SAME) & (time <= nodes[-1] + _SAME)
    return np.asarray(covered & (near if usual > _DENSE else near | (nodes[after] - nodes[after - 1] <= longest)))


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
        interpolated = np.empty((len(t), values.shape[1]))
        for number, part in enumerate(parts):
            rows = which == number
            if rows.any():
                interpolated[rows] = values[begins[number]] if part is None else part(t[rows])
        return interpolated

    return at


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


def reference_of(run: RecordedRun) -> Reference:
    """Return what solutions are compared with, with its lever arm, its gaps, the delay of its velocities and its own
    σ."""
    section = run.scenario.get("log", {}).get("reference")
    if section is None or not run.knows:
        raise InputError(
            f"{run.path} is a run on recorded sensors without a reference, so the error of a solution is unknown: "
            f"give the scenario a table [log.reference] and run it again."
        )
    rows = run.table("reference")
    time = rows["time_s"]

    def several(*names: str) -> Array | None:
        return np.stack([rows[name] for name in names], axis=1) if names[0] in rows else None

    knows = run.knows
    delay = float(section.get("velocity_delay_s", 0.0))
    gap = section.get("gap_s")
    north, east, down = section.get("lever_arm_m", (0.0, 0.0, 0.0))
    return Reference(
        str(run.summary["log"]["reference_file"]), time, rows["latitude_rad"], rows["longitude_rad"], rows["height_m"],
        several("velocity_n_mps", "velocity_e_mps", "velocity_d_mps") if "velocity" in knows else None,
        several("q_nb_w", "q_nb_x", "q_nb_y", "q_nb_z") if "attitude" in knows else None,
        several("sigma_north_m", "sigma_east_m", "sigma_down_m"),
        (float(north), float(east), float(down)),
        None if gap is None else float(gap),
        time - delay if delay else None,
    )  # fmt: skip


_SAME_INSTANT = 1e-9  # s: an instant this close to a sample is the sample
_BLOCK = 65536


class TruthAt:
    """The truth between the samples of a recorded run.

    Position, velocity and attitude are taken to Earth-fixed axes, where nothing is singular and longitude does not
    wrap. A cubic through the two samples before and the two after an instant interpolates the position, the velocity,
    and the rotation vector from the sample before it. At a sample the result is the sample.

    Args:
        truth: samples in order of time, at least 4.
        ellipsoid: of the coordinates.

    Raises:
        InputError: there are fewer than 4 samples.
    """

    def __init__(self, truth: SolutionStream, ellipsoid: Ellipsoid = WGS84) -> None:
        if len(truth) < 4 or truth.velocity_ned is None or truth.q_nb is None:
            raise InputError(f"the truth has {len(truth)} samples; at least 4 are needed to interpolate it.")
        self.time = truth.time
        self._truth = NavState(truth.latitude, truth.longitude, truth.height, truth.velocity_ned, truth.q_nb)
        self._ellipsoid = ellipsoid

    def state(self, time: Array) -> NavState:
        """Return the true states at instants, (M,) s."""
        parts = [self._block(time[a : a + _BLOCK]) for a in range(0, len(time), _BLOCK)]
        return NavState(
            *(np.concatenate([getattr(part, name) for part in parts])
              for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb"))
        )  # fmt: skip

    def at_samples(self, time: Array) -> NDArray[np.bool_]:
        """Return which instants are samples of the truth, where nothing is interpolated, (M,)."""
        right = np.searchsorted(self.time, time).clip(max=len(self.time) - 1)
        left = (right - 1).clip(min=0)
        return np.asarray(np.minimum(np.abs(self.time[right] - time), np.abs(self.time[left] - time)) <= _SAME_INSTANT)

    def antenna(self, time: Array, lever_arm: Array) -> NavState:
        """Return the true states of an antenna at instants, (M,) s; the lever arm is from the sensor block, forward,
        right, down, (3,) m."""
        block = self.state(time)
        step = 0.25 * float(np.median(np.diff(self.time)))
        after = np.minimum(time + step, self.time[-1])
        before = np.maximum(time - step, self.time[0])

        def arm_at(instants: Array) -> Array:
            s = self.state(instants)
            return rotation.rotate(rotation.multiply(q_en(s.latitude, s.longitude), s.q_nb), lever_arm)

        place = geodetic_to_ecef(block.latitude, block.longitude, block.height, self._ellipsoid) + arm_at(time)
        latitude, longitude, height = ecef_to_geodetic(place, self._ellipsoid)
        moved = (arm_at(after) - arm_at(before)) / (after - before)[:, np.newaxis]
        velocity_e = rotation.rotate(q_en(block.latitude, block.longitude), block.velocity_ned) + moved
        velocity = rotation.rotate(rotation.conjugate(q_en(latitude, longitude)), velocity_e)
        return NavState(latitude, longitude, height, velocity, block.q_nb)

    def _block(self, time: Array) -> NavState:
        """Return the states of a block of instants."""
        count = len(self.time)
        before = (np.searchsorted(self.time, time, side="right") - 1).clip(0, count - 2)
        nodes = (before - 1).clip(0, count - 4)[:, np.newaxis] + np.arange(4)
        weights = _weights(self.time[nodes], time)
        rows, place = np.unique(nodes, return_inverse=True)
        place = place.reshape(nodes.shape)
        t = self._truth
        turn = q_en(t.latitude[rows], t.longitude[rows])
        position = geodetic_to_ecef(t.latitude[rows], t.longitude[rows], t.height[rows], self._ellipsoid)
        velocity = rotation.rotate(turn, t.velocity_ned[rows])
        q_eb = rotation.multiply(turn, t.q_nb[rows])
        base = place[:, 1]  # differences from one node keep the digits of a position of 6.4e6 m
        here = position[base] + np.einsum("mi,mij->mj", weights, position[place] - position[base][:, np.newaxis])
        moving = np.einsum("mi,mij->mj", weights, velocity[place])
        back = rotation.conjugate(q_eb[base])
        turns = np.stack(
            [rotation.rotation_vector_from_quaternion(rotation.multiply(back, q_eb[place[:, i]])) for i in range(4)], 1
        )
        turned = rotation.quaternion_from_rotation_vector(np.einsum("mi,mij->mj", weights, turns))
        latitude, longitude, height = ecef_to_geodetic(here, self._ellipsoid)
        level = rotation.conjugate(q_en(latitude, longitude))
        state = NavState(
            latitude, longitude, height, rotation.rotate(level, moving),
            rotation.multiply(level, rotation.multiply(q_eb[base], turned)),
        )  # fmt: skip
        return self._with_samples(time, state)

    def _with_samples(self, time: Array, state: NavState) -> NavState:
        """Put the samples themselves where an instant is one, bit for bit."""
        nearest = np.searchsorted(self.time, time - _SAME_INSTANT).clip(max=len(self.time) - 1)
        same = np.flatnonzero(np.abs(self.time[nearest] - time) <= _SAME_INSTANT)
        for name in ("latitude", "longitude", "height", "velocity_ned", "q_nb"):
            getattr(state, name)[same] = getattr(self._truth, name)[nearest[same]]
        return state


def _weights(nodes: Array, time: Array) -> Array:
    """Return Lagrange's weights of four nodes, (M, 4)."""
    weights = np.ones_like(nodes)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[:, i] *= (time - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights


def interpolation_error(truth: SolutionStream, ellipsoid: Ellipsoid = WGS84) -> tuple[float, float]:
    """Estimate the largest error of interpolating the truth in position, m, and attitude, rad, by leaving out every
    other sample: a sixteenth of the errors at the samples left out, as the error of a cubic grows with the fourth power
    of the interval. NaN for fewer than 9 samples."""
    count = len(truth) if len(truth) % 2 else len(truth) - 1
    if count < 9 or truth.velocity_ned is None or truth.q_nb is None:
        return float("nan"), float("nan")
    rows = np.arange(0, count, max(2, 2 * (count // 40000)))
    even = slice(0, count, 2)
    half = SolutionStream(
        truth.time[even], truth.latitude[even], truth.longitude[even], truth.height[even], truth.datum,
        truth.velocity_ned[even], truth.q_nb[even],
    )  # fmt: skip
    left_out = rows[rows < count - 1] + 1
    state = TruthAt(half, ellipsoid).state(truth.time[left_out])
    difference = geodetic_to_ecef(state.latitude, state.longitude, state.height, ellipsoid) - geodetic_to_ecef(
        truth.latitude[left_out], truth.longitude[left_out], truth.height[left_out], ellipsoid
    )
    angle = rotation.rotation_vector_from_quaternion(
        rotation.multiply(truth.q_nb[left_out], rotation.conjugate(state.q_nb))
    )
    sizes = np.linalg.norm(difference, axis=1).max(), np.linalg.norm(angle, axis=1).max()
    return float(sizes[0]) / 16.0, float(sizes[1]) / 16.0
