"""A motion whose sensors feel the true gravity: that of a model, and a random remainder, beside the normal one.

The specific force is f = a − g: where gravity is normal gravity plus δg, it is the other motion's less C_bn δg, and
the increments are less ∫C_bn δg dt. δg of the model is a spline in time along the true path, see
`sinssim.earth.harmonics.along`; the remainder is a function of the distance travelled. C_bn δg is integrated as a cubic
through neighbouring values with the true attitude, at steps in which the block turns by at most 0.05 rad; the error,
11/720 of the turn's fourth power, is below 1e-7 of δg.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.harmonics.along import DisturbanceAlong, disturbance_along
from sinssim.earth.harmonics.field import DisturbingField
from sinssim.earth.models import Ellipsoid
from sinssim.jit import inline, kernel
from sinssim.rotation.kernels import Vector
from sinssim.truth.channel import Channel, FlightEvent
from sinssim.truth.gravity.remainder import Remainder, RemainderModel
from sinssim.truth.sample_times import check_instants, in_blocks
from sinssim.truth.trajectory import Trajectory

_TURN = 0.05
"""Largest turn of the block in a step of the integral, rad."""
_LEAST_STEPS = 3
"""Steps that a cubic needs."""
_DISTANCE_STEP = 0.5
"""Interval of the table of the distance travelled, s."""
_PART = 65536
"""Instants evaluated together."""


@inline
def _spline_k(panels: Array, start: float, step: float, t: float) -> Vector:
    i = min(max(int((t - start) / step), 0), len(panels) - 1)
    u = t - start - i * step
    return (
        panels[i, 0, 0] + u * (panels[i, 1, 0] + u * (panels[i, 2, 0] + u * panels[i, 3, 0])),
        panels[i, 0, 1] + u * (panels[i, 1, 1] + u * (panels[i, 2, 1] + u * panels[i, 3, 1])),
        panels[i, 0, 2] + u * (panels[i, 1, 2] + u * (panels[i, 2, 2] + u * panels[i, 3, 2])),
    )


@inline
def _ned_k(x: float, y: float, z: float, latitude: float, longitude: float) -> Vector:
    s, c, sl, cl = sin(latitude), cos(latitude), sin(longitude), cos(longitude)
    across = cl * x + sl * y
    return c * z - s * across, cl * y - sl * x, -c * across - s * z


@kernel
def _disturbance_rows(
    panels: Array, start: float, step: float, time: Array, latitude: Array, longitude: Array, rest: Array, out: Array,
    q_nb: Array, in_body: bool, first: int, last: int,
) -> None:  # fmt: skip
    """Disturbance of the model (panels) and of the remainder (rest), north, east, down or in the body's axes."""
    for i in range(first, last):
        n = e = d = 0.0
        if len(panels):
            x, y, z = _spline_k(panels, start, step, time[i])
            n, e, d = _ned_k(x, y, z, latitude[i], longitude[i])
        if len(rest):
            n, e, d = n + rest[i, 0], e + rest[i, 1], d + rest[i, 2]
        if in_body:
            n, e, d = rotation.rotate_k(q_nb[i, 0], -q_nb[i, 1], -q_nb[i, 2], -q_nb[i, 3], n, e, d)
        out[i, 0], out[i, 1], out[i, 2] = n, e, d


@kernel
def _mean_rows(values: Array, parts: int, interval: Array, out: Array) -> None:
    """Integrals of cubics through neighbouring values, `parts` steps in an interval, (N·parts + 1, 3) → (N, 3)."""
    last = len(values) - 1
    for i in range(len(out)):
        x = y = z = 0.0
        for k in range(i * parts, (i + 1) * parts):
            # the cubic through four values, integrated between the middle two, or at an end between the outer two
            if k == 0:
                a, b, c, d, w0, w1, w2, w3 = 0, 1, 2, 3, 9.0, 19.0, -5.0, 1.0
            elif k == last - 1:
                a, b, c, d, w0, w1, w2, w3 = k - 2, k - 1, k, k + 1, 1.0, -5.0, 19.0, 9.0
            else:
                a, b, c, d, w0, w1, w2, w3 = k - 1, k, k + 1, k + 2, -1.0, 13.0, 13.0, -1.0
            x += w0 * values[a, 0] + w1 * values[b, 0] + w2 * values[c, 0] + w3 * values[d, 0]
            y += w0 * values[a, 1] + w1 * values[b, 1] + w2 * values[c, 1] + w3 * values[d, 1]
            z += w0 * values[a, 2] + w1 * values[b, 2] + w2 * values[c, 2] + w3 * values[d, 2]
        scale = interval[i] / (24.0 * parts)
        out[i, 0], out[i, 1], out[i, 2] = scale * x, scale * y, scale * z


class Disturbed:
    """A motion in the true gravity field; see the module's text.

    Args:
        base: the motion in normal gravity.
        field: disturbing potential of a model; None for none.
        remainder: statistics of the remainder; None for none.
        seed: seed of the remainder.

    Attributes:
        base: the motion in normal gravity.
        field: the disturbing field, or None.
        along: its values along the path, or None.
        remainder: the realisation of the remainder, or None.
    """

    def __init__(
        self, base: Trajectory, field: DisturbingField | None, remainder: RemainderModel | None = None, seed: int = 0
    ) -> None:
        self.base, self.field = base, field
        self.start, self.end = base.start, base.end
        self._known: tuple[Array, NavState] | None = None
        self.along: DisturbanceAlong | None = None
        if field is not None:
            self.along = disturbance_along(field, self._path, base.start, base.end)
        self.remainder: Remainder | None = None
        if remainder is not None:
            self.remainder = Remainder(remainder, float(self._travelled[1][-1]), seed)

    @property
    def events(self) -> tuple[FlightEvent, ...]:
        """Events along the motion."""
        return self.base.events

    @property
    def gravity(self) -> str:
        """Name of the gravity model of the motion without the disturbance."""
        return self.base.gravity

    @property
    def ellipsoid(self) -> Ellipsoid:
        """Reference ellipsoid."""
        return self.base.ellipsoid

    @property
    def channels(self) -> Mapping[str, Channel]:
        """Other logged quantities."""
        return self.base.channels

    @property
    def breaks(self) -> Array:
        """Instants at which a derivative of the motion may jump, s."""
        return np.asarray(getattr(self.base, "breaks", ()), dtype=np.float64)

    @property
    def fastest(self) -> float:
        """Fastest oscillation of the motion, rad/s."""
        return float(getattr(self.base, "fastest", 0.0))

    def _path(self, t: Array) -> Array:
        s = self.base.state(t)
        return earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, self.ellipsoid)

    @cached_property
    def _travelled(self) -> tuple[Array, Array]:
        """Instants and horizontal distance travelled until then, (K,) s and m."""
        count = max(2, int(np.ceil((self.end - self.start) / _DISTANCE_STEP)))
        time = np.linspace(self.start, self.end, 2 * count + 1)
        velocity = self.base.state(time).velocity_ned
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        step = (self.end - self.start) / count
        passed = step / 6.0 * (speed[:-2:2] + 4.0 * speed[1:-1:2] + speed[2::2])
        return time[::2], np.concatenate([[0.0], np.cumsum(passed)])

    def distance(self, t: Array) -> Array:
        """Return the horizontal distance travelled since the start.

        Args:
            t: instants, (N,) s.

        Returns:
            Distances, (N,) m.
        """
        return np.interp(t, *self._travelled)

    def disturbance_ned(self, t: ArrayLike, state: NavState | None = None) -> Array:
        """Return the disturbance of gravity on the true path.

        Args:
            t: instants, () or (N,) s.
            state: the states at those instants, if they are known.

        Returns:
            δg, north, east, down, (..., 3) m/s².
        """
        instants = check_instants(t, self.start, self.end)
        time = np.atleast_1d(instants)
        s = self.base.state(time) if state is None else state
        latitude, longitude = np.atleast_1d(s.latitude), np.atleast_1d(s.longitude)
        out = self._rows(time, latitude, longitude, np.atleast_1d(s.height), None)
        return out.reshape(*instants.shape, 3)

    def _rows(self, time: Array, latitude: Array, longitude: Array, height: Array, q_nb: Array | None) -> Array:
        """Return δg, north, east, down, or with attitudes in the block's axes, (N, 3) m/s²."""
        rest = np.empty((0, 3))
        if self.remainder is not None:
            rest = self.remainder.at(self.distance(time))
            normal = earth.gravity_ned(latitude, height, self.gravity, self.ellipsoid)
            rest[:, :2] *= -normal[:, 2:]
        panels, step = (np.empty((0, 4, 3)), 1.0) if self.along is None else (self.along.panels, self.along.step)
        attitude = np.empty((0, 4)) if q_nb is None else np.ascontiguousarray(q_nb)
        latitude, longitude = np.ascontiguousarray(latitude), np.ascontiguousarray(longitude)
        out = np.empty((len(time), 3))
        in_blocks(
            len(time),
            lambda first, last: _disturbance_rows(
                panels, self.start, step, time, latitude, longitude, rest, out, attitude, q_nb is not None, first, last
            ),
        )
        return out

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block; see `Trajectory.state`."""
        if self._known is not None and self._known[0] is t:  # a run asks for those of its samples once
            found, self._known = self._known[1], None
            return found
        return self.base.state(t)

    def _in_body(self, time: Array) -> Array:
        """Return C_bn δg, (N, 3) m/s²."""
        out = np.empty((len(time), 3))
        for start in range(0, len(time), _PART):
            part = slice(start, start + _PART)
            s = self.base.state(time[part])
            out[part] = self._rows(time[part], s.latitude, s.longitude, s.height, s.q_nb)
        return out

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the sensor block; see `Trajectory.rates`."""
        instants = check_instants(t, self.start, self.end)
        omega, force = self.base.rates(instants)
        change = self._in_body(np.atleast_1d(instants))
        return omega, force - change.reshape(*instants.shape, 3)

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments less the integral of the disturbance; see `Trajectory.increments`."""
        own = self.base.increments(rate_hz)
        return ImuData(own.time, own.dtheta, own.dvel - self.felt(own.time, own.dtheta))

    def felt(self, edges: Array, dtheta: Array) -> Array:
        """Return the integrals of the disturbance in the block's axes over intervals.

        Args:
            edges: of the intervals, (N+1,) s.
            dtheta: increments of angle over them, (N, 3) rad.

        Returns:
            ∫C_bn δg dt, (N, 3) m/s.
        """
        interval = np.diff(edges)
        turn = max(float(np.abs(dtheta).sum(axis=1).max()), float(interval.max()) * self.fastest)
        parts = max(1, int(np.ceil(turn / _TURN)), int(np.ceil(_LEAST_STEPS / len(interval))))
        if parts == 1:
            s = self.base.state(edges)
            self._known = edges, s
            values = self._rows(edges, s.latitude, s.longitude, s.height, s.q_nb)
        else:
            fine = np.arange(parts * len(interval) + 1) / parts
            values = self._in_body(np.interp(fine, np.arange(len(edges)), edges))
        out = np.empty((len(interval), 3))
        _mean_rows(values, parts, interval, out)
        return out
