"""A filter's pass once more, with other noises at once: the linear recursion about the nominal motion of the pass.

A pass of the filter leaves Φ, H, residuals and feedback of each segment (`sinssim.estimation.filter_loop.Witness`).
They depend on the noises to second order alone, so that estimates and covariances with other noises follow from

    x ← A x + c,   P ← A P Aᵀ + Σ s_j Q_j,   ν = z − H x,   S = H P Hᵀ + R                                           (1)

A, c and Q_j are those from one instant with readings to the next, c from the feedback. The process noise is a sum over
its sources, gyros, accelerometers and each block of states: Q_j of a source is kept for the states that it reaches, and
a set of assumptions has a factor s_j for each. With a density σ² along the column e of an interval T,

    Q = T/6 (Φe eᵀΦᵀ + 4 Me eᵀMᵀ + e eᵀ) σ²,   M = (1 + Φ)/2,                                                        (2)

is exact to the third order (Simpson). Readings count at their instants of validity, whenever they arrive.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.estimation.error_dynamics import driving_noise, noise_at_speed
from sinssim.estimation.linearisation import Linearisation, Surroundings
from sinssim.estimation.state_model import NAVIGATION, ErrorModel
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.sensors.measurement_kind import CORE, PHI, V


class Reading(NamedTuple):
    """A reading, linearised."""

    sensor: int  # number of the sensor
    row: int  # number of the reading among the sensor's
    h: Array  # (k, n)
    z: Array  # residual, (k,)
    r: Array  # R as the pass assumes it, (k, k)


class Event(NamedTuple):
    """An instant with readings, and the way to it from the event before."""

    time: float  # s
    a: Array  # (n, n)
    c: Array  # (n,)
    q: tuple[Array, ...]  # Q_j of each source for the states that it reaches, row by row
    readings: list[Reading]


class Assumptions(NamedTuple):
    """What another filter assumes: noises relative to those of the pass, and what else it knows at the start."""

    process: Array  # s_j of each source, (J,)
    start: Array | float = 1.0  # 1σ of the states at the start, (n,)
    sigma: Mapping[str, Array] = {}  # σ of the readings, by sensor: of each reading, (M, k); 1 where none is given
    more: Array | float = 0.0  # variance of the states at the start in addition, (n,)
    error: Array | float = 0.0  # error that is known at the start beside those of the pass, (n,)


class Series(NamedTuple):
    """Innovations of one sensor with several assumptions."""

    sensor: str
    time: Array  # (M,) s
    row: Array  # number of each reading among the sensor's, (M,)
    value: Array  # ν, (B, M, k)
    covariance: Array  # S, (B, M, k, k)


def sources_of(model: ErrorModel) -> dict[str, list[int]]:
    """Return the sources of process noise by name, with the states that each drives."""
    driven = {"gyro noise": list(range(PHI.start, PHI.stop)), "accelerometer noise": list(range(V.start, V.stop))}
    for block in model.blocks[len(NAVIGATION) :]:
        where = model.slices[block.name]
        if np.any(model.density[where]) or np.any(model.per_metre[where]):
            driven[block.name] = list(range(where.start, where.stop))
    return driven


def densities_of(model: ErrorModel) -> Array:
    """Return the spectral densities of the sources, of blocks the mean over their states, (J,)."""
    driven = model.density**2 + 2.0 * model.sigma**2 * model.per_metre
    of_blocks = [float(np.mean(driven[states])) for states in list(sources_of(model).values())[2:]]
    return np.array([model.gyro_noise**2, model.accel_noise**2, *of_blocks])


@dataclass
class LinearPass:
    """What a pass of the filter leaves for `replay`; a witness of the pass."""

    walking: Sequence[str] = ()  # blocks with one more source of noise, a random walk of 1 unit/√s, after all others
    mean_rates: bool = False  # whether zero-rate readings count, with noise that is independent of that of the gyros
    events: list[Event] = field(default_factory=list)

    def begin(self, around: Surroundings, covariance: Array) -> None:
        """Take the data that stay the same."""
        self.model, self.covariance, self.around = around.model, covariance, around
        self.names = [readings.data.label for readings in around.readings]
        self._unused = {
            k for k, readings in enumerate(around.readings)
            if measurement_kind(readings.data.kind).mean_rate and not self.mean_rates
        }  # their noise is that of the gyros  # fmt: skip
        self._density = driving_noise(around.model)
        core = list(range(CORE))
        self._driven = list(sources_of(around.model).values())
        self._of_model = len(self._driven)
        places = (around.model.slices[name] for name in self.walking)
        self._driven += [list(range(where.start, where.stop)) for where in places]
        self.fed = np.zeros(around.model.size)
        self._reached = [sorted({*core, *states}) for states in self._driven]
        if around.added is not None:  # noise beside that of the model, which no assumption changes
            self._reached.append(core)
        self._restart()

    def _restart(self) -> None:
        n = self.model.size
        self._a, self._c = np.eye(n), np.zeros(n)
        self._q = [np.zeros((len(s), len(s))) for s in self._reached]

    def segment(self, line: Linearisation, count: int, fed: Array, turn: Array | None) -> None:
        """Take a segment."""
        time = self.around.epochs.time
        for k in range(count):
            if line.interval[k]:
                self._step(line, k)
            readings = [
                Reading(o.sensor, o.row, o.h, o.residual, self.around.readings[o.sensor].covariance(o.row, o.variance))
                for o in line.observed.get(line.first + k, ())
                if o.sensor not in self._unused
            ]
            if readings:
                at = float(time[line.first + k])
                self.events.append(Event(at, self._a, self._c, tuple(q.ravel() for q in self._q), readings))
                self._restart()
        self._c, self.fed = self._c - fed, self.fed + fed
        if turn is not None:
            self._a, self._c = turn @ self._a, turn @ self._c
            self._q = [
                turn[np.ix_(s, s)] @ q @ turn[np.ix_(s, s)].T for s, q in zip(self._reached, self._q, strict=True)
            ]

    def _step(self, line: Linearisation, k: int) -> None:
        phi, interval = line.phi[k], float(line.interval[k])
        velocity = line.state.velocity_ned[k : k + 1]
        density = np.broadcast_to(noise_at_speed(self.model, self._density, velocity), (1, len(phi)))[0].copy()
        self._a, self._c = phi @ self._a, phi @ self._c
        rest = line.q[k, :CORE, :CORE] if line.added is not None else None
        for j, (states, driven) in enumerate(zip(self._reached, [*self._driven, []], strict=False)):
            part = phi[np.ix_(states, states)]
            self._q[j] = part @ self._q[j] @ part.T
            if not driven:
                self._q[j] += rest if rest is not None else 0.0
                continue
            e = np.zeros((len(states), len(driven)))
            size = np.sqrt(density[driven]) if j < self._of_model else 1.0
            e[[states.index(s) for s in driven], np.arange(len(driven))] = size
            moved = part @ e
            middle = 0.5 * (e + moved)
            q = interval / 6.0 * (moved @ moved.T + 4.0 * middle @ middle.T + e @ e.T)  # (2)
            self._q[j] += q
            if rest is not None and j < self._of_model:
                rest = rest - q[:CORE, :CORE]

    @property
    def sources(self) -> int:
        """Number of sources of noise that assumptions have a factor for."""
        return len(self._driven)

    def replay(
        self, assumptions: Sequence[Assumptions], dropped: Mapping[str, Array], until: float = math.inf
    ) -> list[Series]:
        """Return the innovations of all sensors until an instant, s, with each of B assumptions; `dropped` says by
        sensor whether a reading is left out, (M,)."""
        return self.replay_whole(assumptions, dropped, until)[0]

    def replay_whole(
        self,
        assumptions: Sequence[Assumptions],
        dropped: Mapping[str, Array],
        until: float = math.inf,
        bounds: Mapping[str, float] | None = None,
    ) -> tuple[list[Series], Array, Array]:
        """Return the innovations of `replay`, and at the end the errors beside those fed back, and their covariances;
        `bounds` is by sensor the NIS beyond which a gate refuses a reading."""
        b, count = len(assumptions), len(self._driven)
        process = np.array([of.process for of in assumptions])
        scale, more, x = (
            np.array([np.broadcast_to(value, self.model.size) for value in values])
            for values in zip(*((of.start, of.more, of.error) for of in assumptions), strict=True)
        )
        p = self.covariance * scale[:, :, None] * scale[:, None, :]
        p[:, np.arange(self.model.size), np.arange(self.model.size)] += more
        used, n, sources = self._used(p, x, process)
        inside = np.ix_(used, used)
        x, p = x[:, used], p[:, used[:, None], used]
        kept: list[list[tuple[int, float, Array, Array]]] = [[] for _ in self.names]
        ratios = [self._ratios(name, assumptions) for name in self.names]
        for event in self.events:
            if event.time > until:
                break
            a = event.a[inside]
            x, p = x @ a.T + event.c[used], _moved(p, a)
            flat = p.reshape(b, n * n)
            for j, places in sources:
                flat[:, places] += process[:, j, None] * event.q[j] if j < count else event.q[j]
            for reading in event.readings:
                name = self.names[reading.sensor]
                if name in dropped and dropped[name][reading.row]:
                    continue
                h, r, ratio = reading.h[:, used], reading.r, ratios[reading.sensor]
                if ratio is not None:
                    r = ratio[:, reading.row, :, None] * r * ratio[:, reading.row, None, :]
                seen = (p.reshape(-1, n) @ h.T).reshape(b, n, -1)
                s = h @ seen + r
                value = reading.z - x @ h.T
                gain = np.linalg.solve(s, seen.transpose(0, 2, 1))
                if bounds is not None:
                    gain[nis_of(value[:, None], s[:, None])[:, 0] > bounds.get(name, math.inf)] = 0.0
                x = x + np.einsum("bkn,bk->bn", gain, value)
                p = p - seen @ gain
                p = 0.5 * (p + p.transpose(0, 2, 1))
                kept[reading.sensor].append((reading.row, event.time, value, s))
        series = [_series(name, rows) for name, rows in zip(self.names, kept, strict=True) if rows]
        end, covariance = np.zeros((b, self.model.size)), np.zeros((b, self.model.size, self.model.size))
        end[:, used], covariance[:, used[:, None], used] = x, p
        return series, end @ self._a.T + self._c, self._a @ covariance @ self._a.T

    def _ratios(self, name: str, assumptions: Sequence[Assumptions]) -> Array | None:
        """Return the σ of a sensor's readings relative to those of the pass, (B, M, k); None where all are the same."""
        given = [of.sigma.get(name) for of in assumptions]
        shape = next((value.shape for value in given if value is not None), None)
        return None if shape is None else np.array([np.ones(shape) if value is None else value for value in given])

    def _used(
        self, p: Array, x: Array, process: Array
    ) -> tuple[NDArray[np.intp], int, list[tuple[int, NDArray[np.intp]]]]:
        """Return the states that are not zero throughout, their number, and the sources with their places in P."""
        acting = [j for j in range(len(self._reached)) if j >= len(self._driven) or np.any(process[:, j])]
        lives = np.any(np.einsum("bii->bi", p), axis=0) | np.any(x, axis=0)
        lives[:CORE] = True
        for j in acting:
            lives[self._reached[j]] = True
        used = np.flatnonzero(lives)
        n, sources = len(used), []
        for j in acting:
            where = np.searchsorted(used, self._reached[j])
            sources.append((j, np.ravel_multi_index(np.ix_(where, where), (n, n)).ravel()))
        return used, n, sources


def nis_of(value: Array, covariance: Array) -> Array:
    """Return νᵀS⁻¹ν, (B, M), of innovations, (B, M, k), with covariances, (B, M, k, k)."""
    solved = np.linalg.solve(covariance, value[..., None])[..., 0]
    return np.asarray(np.einsum("bmk,bmk->bm", value, solved))


def _series(name: str, rows: list[tuple[int, float, Array, Array]]) -> Series:
    row, time, value, s = zip(*rows, strict=True)
    return Series(name, np.array(time), np.array(row), np.stack(value, axis=1), np.stack(s, axis=1))


def _moved(p: Array, a: Array) -> Array:
    """Return A P Aᵀ, (B, n, n), of which A has only a diagonal below the rows of navigation; P is symmetric."""
    top, diagonal = a[:CORE], a.diagonal()
    half = (p.reshape(-1, len(a)) @ top.T).reshape(len(p), len(a), CORE)  # one product for all: P Aᵀ
    out = p * np.outer(diagonal, diagonal)
    out[:, :CORE, :CORE] = top @ half
    out[:, CORE:, :CORE] = half[:, CORE:] * diagonal[CORE:, None]
    out[:, :CORE, CORE:] = out[:, CORE:, :CORE].transpose(0, 2, 1)
    return out
