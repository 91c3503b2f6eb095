"""The gravity disturbance along a true motion.

That of a model and a random remainder, and the specific force with it.

The specific force is f = a − g: where gravity is normal gravity plus δg, it is the other motion's less C_bn δg, and
the increments are less ∫C_bn δg dt. δg of the model is a spline in time along the true path, see
`sinssim.earth.gravity_disturbance`; the remainder is a function of the distance travelled. C_bn δg is integrated as a
cubic through neighbouring values with the true attitude, at steps in which the block turns by at most 0.05 rad; the
error, 11/720 of the turn's fourth power, is below 1e-7 of δg.

The remainder is what no model has. Each of ξ, η and the anomaly is a stationary Gauss-Markov process of the second or
third order over the distance d travelled, with the correlation

    2nd order: (1 + βd) e^−βd         3rd order: (1 + βd + β²d²/3) e^−βd

(Kasper, A second-order Markov gravity anomaly model, JGR 76, 1971, 7844-7849; Jordan, Self-consistent statistical
models for the gravity anomaly, vertical deflections, and undulation of the geoid, JGR 77, 1972, 3660-3670). Values
and derivatives are drawn at equal distances, exactly, and joined by cubic Hermite polynomials. The process depends on
the distance alone: over a place that is passed twice, it has two values; a vehicle at rest has constant ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.gravity_disturbance import DisturbanceAlong, DisturbingField, disturbance_along
from sinssim.errors import InputError
from sinssim.jit import inline, kernel
from sinssim.rotation.quaternions import Vector
from sinssim.statistics.random_numbers import normals
from sinssim.truth.sampling import check_instants, in_blocks
from sinssim.truth.trajectory import DerivedMotion, Trajectory
from sinssim.units import ARCSEC, MGAL

AT_1_OVER_E = {2: 2.1461932206205825, 3: 2.904629975029914}
"""βd at which the correlation of the order is 1/e."""
KNOTS_PER_DISTANCE = 40
"""Knots in a correlation distance: Hermite polynomials between them miss 1e-5 of the variance at most."""


@dataclass(frozen=True)
class RemainderModel:
    """Statistics of the remainder."""

    order: int  # 2 or 3
    sigma: tuple[float, float, float]  # 1σ of ξ, rad, η, rad, and the anomaly, m/s²
    distance: float  # distance at which the correlation is 1/e, m

    @property
    def beta(self) -> float:
        """β, 1/m."""
        return AT_1_OVER_E[self.order] / self.distance

    def correlation(self, d: Array) -> Array:
        """Return the correlation at distances, (...) m."""
        x = self.beta * np.abs(d)
        return np.asarray((1.0 + x + (x * x / 3.0 if self.order == 3 else 0.0)) * np.exp(-x))

    def dynamics(self) -> tuple[Array, Array]:
        """Return the process of variance 1 as a linear system over the distance: F of dx/dd = F x + w, (order, order),
        x the value and its derivatives by the distance, and the stationary covariance of x."""
        b = self.beta
        if self.order == 2:
            return np.array([[0.0, 1.0], [-b * b, -2.0 * b]]), np.diag([1.0, b * b])
        third = b * b / 3.0
        f = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-(b**3), -3.0 * b * b, -3.0 * b]])
        return f, np.array([[1.0, 0.0, -third], [0.0, third, 0.0], [-third, 0.0, b**4]])


class Remainder:
    """One realisation of the remainder along a way of some length, m, with random numbers of its own."""

    def __init__(self, model: RemainderModel, distance: float, seed: int) -> None:
        from scipy.linalg import expm

        if model.order not in AT_1_OVER_E:
            raise InputError(f"a remainder of order {model.order} is not known; the orders are 2 and 3.")
        self.model = model
        self.spacing = model.distance / KNOTS_PER_DISTANCE
        count = int(np.ceil(distance / self.spacing)) + 2
        f, stationary = model.dynamics()
        scale = np.sqrt(np.diag(stationary))  # components of about one size, or the Cholesky factor loses digits
        stationary = stationary / np.outer(scale, scale)
        step = expm(f * self.spacing) * scale[None, :] / scale[:, None]
        root_start = np.linalg.cholesky(stationary)
        root_step = _root(stationary - step @ stationary @ step.T)
        self.values, self.slopes = np.empty((count, 3)), np.empty((count, 3))
        for axis, sigma in enumerate(model.sigma):
            noise = np.column_stack(
                [normals(seed, "gravity remainder", 3 * axis + j, count) for j in range(model.order)]
            )
            x = np.empty((count, model.order))
            x[0] = root_start @ noise[0]
            _advance(step, noise @ root_step.T, x)
            self.values[:, axis], self.slopes[:, axis] = sigma * x[:, 0], sigma * scale[1] * x[:, 1]

    def at(self, distance: Array) -> Array:
        """Return ξ and η, rad, and the anomaly, m/s², (N, 3), at distances travelled, (N,) m."""
        out = np.empty((len(distance), 3))
        _hermite_rows(np.ascontiguousarray(distance), self.spacing, self.values, self.slopes, out)
        return out


def _root(covariance: Array) -> Array:
    """Return a matrix whose product with its transpose is a covariance that may be nearly singular."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


@kernel
def _advance(step: Array, fresh: Array, x: Array) -> None:
    """x_k = step x_(k−1) + fresh_k, from the first row on."""
    order = len(step)
    for k in range(1, len(x)):
        for i in range(order):
            total = fresh[k, i]
            for j in range(order):
                total += step[i, j] * x[k - 1, j]
            x[k, i] = total


@kernel
def _hermite_rows(distance: Array, spacing: float, values: Array, slopes: Array, out: Array) -> None:
    last = len(values) - 2
    for i in range(len(distance)):
        x = distance[i] / spacing
        k = min(max(int(x), 0), last)
        u = x - k
        v = 1.0 - u
        a, b = v * v * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * v)
        c, d = spacing * v * v * u, spacing * u * u * v
        for j in range(3):
            out[i, j] = a * values[k, j] + b * values[k + 1, j] + c * slopes[k, j] - d * slopes[k + 1, j]


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


class Disturbed(DerivedMotion):
    """A motion in the true gravity field, from one in normal gravity; see the module's text.

    Attributes `along` and `remainder` are the disturbance of the model along the path, and the realisation of the
    remainder.
    """

    def __init__(
        self, base: Trajectory, field: DisturbingField | None, remainder: RemainderModel | None = None, seed: int = 0
    ) -> None:
        super().__init__(base)
        self.field = field
        self._known: tuple[Array, NavState] | None = None
        self.along: DisturbanceAlong | None = None
        if field is not None:
            self.along = disturbance_along(field, self._path, base.start, base.end)
        self.remainder: Remainder | None = None
        if remainder is not None:
            self.remainder = Remainder(remainder, float(self._travelled[1][-1]), seed)

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
        """Return the horizontal distance travelled since the start at instants, (N,) m."""
        return np.interp(t, *self._travelled)

    def disturbance_ned(self, t: ArrayLike, state: NavState | None = None) -> Array:
        """Return δg on the true path at instants, north, east, down, (..., 3) m/s², from the states there if they are
        known."""
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
        if self._known is not None and self._known[0] is t:  # a run asks for those of its samples once
            entries, self._known = self._known[1], None
            return entries
        return self.base.state(t)

    def _in_body(self, time: Array) -> Array:
        """Return C_bn δg, (N, 3) m/s²."""
        out = np.empty((len(time), 3))
        for start in range(0, len(time), _PART):
            part = slice(start, start + _PART)
            s = self.base.state(time[part])
            out[part] = self._rows(time[part], s.latitude, s.longitude, s.height, s.q_nb)
        return out

    def _rates(self, time: Array) -> tuple[Array, Array]:
        omega, force = self.base.rates(time)
        return omega, force - self._in_body(time)

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments less the integral of the disturbance; see `Trajectory.increments`."""
        base = self.base.increments(rate_hz)
        return ImuData(base.time, base.dtheta, base.dvel - self.felt(base.time, base.dtheta))

    def felt(self, edges: Array, dtheta: Array) -> Array:
        """Return the integrals of the disturbance in the block's axes over intervals, (N, 3) m/s, from their edges and
        the increments of angle."""
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


STEP = 1.0
"""Interval between rows, s."""


@dataclass(frozen=True)
class GravityValues:
    """The true field along a motion, model and remainder together."""

    time: Array  # (K,) s
    # deflection of the vertical to the north and to the east, (K,) rad
    xi: Array
    eta: Array
    disturbance: Array  # gravity disturbance, down, (K,) m/s²
    anomaly: Array  # gravity anomaly, (K,) m/s²
    undulation: Array | None  # height of the model's geoid above the ellipsoid, (K,) m; None without a model
    altitude_msl: Array | None  # height above it, (K,) m; None without a model


def gravity_values(motion: Disturbed) -> GravityValues:
    """Return the true field along a motion, once a second."""
    count = max(1, int((motion.end - motion.start) / STEP + 1e-9))
    time: Array = motion.start + STEP * np.arange(count + 1, dtype=np.float64)
    time = time[time <= motion.end]
    s = motion.state(time)
    ned = motion.disturbance_ned(time, s)
    gamma = np.hypot.reduce(earth.gravity_ned(s.latitude, s.height, motion.gravity, motion.ellipsoid), axis=1)
    anomaly: Array = ned[:, 2]
    undulation: Array | None = None
    altitude: Array | None = None
    if motion.field is not None:
        r = earth.geodetic_to_ecef(s.latitude, s.longitude, s.height, motion.ellipsoid)
        potential = motion.field.potential_and_gradient(r)[0]
        anomaly = anomaly - 2.0 * potential / np.linalg.norm(r, axis=1)
        undulation = motion.field.undulation(s.latitude, s.longitude)
        altitude = s.height - undulation
    xi, eta = (np.asarray(-ned[:, k] / gamma, dtype=np.float64) for k in range(2))
    return GravityValues(time, xi, eta, ned[:, 2], anomaly, undulation, altitude)


def gravity_numbers(motion: Disturbed) -> dict[str, str | float]:
    """Return the numbers of the true field for the summary of a run: model and degree, root mean squares and largest
    values along the motion, and the error of the spline."""
    v, along, field = gravity_values(motion), motion.along, motion.field
    entries: dict[str, str | float] = {"model": "normal" if field is None else field.name}
    if field is not None and along is not None:
        entries |= {"degree": field.degree, "evaluations": along.evaluations}
        entries["interpolation_error_mgal"] = along.error / MGAL
    for name, values, unit in (
        ("xi_arcsec", v.xi, ARCSEC), ("eta_arcsec", v.eta, ARCSEC), ("disturbance_mgal", v.disturbance, MGAL),
    ):  # fmt: skip
        entries[f"rms_{name}"] = float(np.sqrt(np.mean(values**2))) / unit
        entries[f"max_{name}"] = float(np.abs(values).max()) / unit
    return entries
