"""What the filter assumes about the combination of a redundant set: covariances between axes, and exclusions.

The noises and errors of the combination have covariances proportional to P = (HᵀWH)⁻¹ of the sensors in use, and those
of scale factors and misalignments follow from the single sensors (`sinssim.sensors.sets.combination`). The white noise
of the error model is the same in all directions: that of the smallest eigenvalue of P for all sensors. The remainder,
which is zero for every predefined set, and the increase by an exclusion are added noise. At an exclusion, the errors of
the combination jump: the states get the covariance of the difference. The errors that a faulty sensor causes before it
is excluded are not part of the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.estimation.model import Block, ErrorModel
from sinssim.sensors.from_readings.vibration import AddedNoise, Change
from sinssim.sensors.imu.terms import of_triad
from sinssim.sensors.sets.combination import maps, spread
from sinssim.sensors.sets.sensor_set import Redundant

if TYPE_CHECKING:
    from sinssim.scenario import Scenario
    from sinssim.sensors.sets.monitor import Monitored

_TRIADS = {"gyro": "gyro", "accel": "accelerometer"}
_DIAGONAL = np.eye(3, dtype=bool).ravel()
_MATRIX = {"scale": _DIAGONAL, "misalignment": ~_DIAGONAL}
_ROUNDING = 1e-12


def of_combination(model: ErrorModel, scenario: Scenario) -> ErrorModel:
    """Return an error model with the covariances between the axes of a redundant set.

    Args:
        model: the model, whose standard deviations are those of the combination.

    Returns:
        The model; the same if the set is not redundant.
    """
    section = scenario.imu.sensor_set
    if not isinstance(section, Redundant):
        return model
    p, found = spread(section.axes), []
    for kind, triad in _TRIADS.items():
        for block in _like_bias(model, triad):
            found.append((block.name, block.name, _of_one(block.sigma, p) * p))
        matrix = _of_matrix(scenario, kind, maps(section.axes))
        found += [
            (f"{triad} {row}", f"{triad} {column}", matrix[np.ix_(_MATRIX[row], _MATRIX[column])])
            for row, column in (("scale", "scale"), ("misalignment", "misalignment"), ("scale", "misalignment"))
        ]
    least = float(np.sqrt(np.linalg.eigvalsh(p)[0] / (np.trace(p) / 3.0)))
    return replace(
        model,
        gyro_noise=least * model.gyro_noise,
        accel_noise=least * model.accel_noise,
        correlations=(*model.correlations, *found),
    )


def noise_of_combination(
    model: ErrorModel, scenario: Scenario, monitored: Sequence[Monitored], edges: Array
) -> AddedNoise | None:
    """Return what the directions of a redundant set and its exclusions add to the noise of an error model.

    Args:
        model: the model, as `of_combination` returns it.
        monitored: what the monitoring found; empty without monitoring.
        edges: edges of the samples, (N+1,) s.

    Returns:
        The added noise; None if there is none.
    """
    section = scenario.imu.sensor_set
    if not isinstance(section, Redundant):
        return None
    axes, whole = section.axes, spread(section.axes)
    least, most = np.linalg.eigvalsh(whole)[[0, 2]]
    used = {one.kind: one.used for one in monitored}
    cuts = {kind: np.flatnonzero(np.any(np.diff(rows, axis=0), axis=1)) + 1 for kind, rows in used.items()}
    if most - least < _ROUNDING * most and not any(map(len, cuts.values())):
        return None
    times = np.unique(np.concatenate([[0], *cuts.values()]).astype(np.intp))
    roots: list[Array] = []
    changes: list[Change] = []
    for kind, noise in zip(_TRIADS, (model.gyro_noise, model.accel_noise), strict=True):
        spreads = [spread(axes, used[kind][k] if used else None) for k in times]
        roots.append(noise / np.sqrt(least) * np.array([_root_above(least, one) for one in spreads]))
        for k in cuts.get(kind, ()):
            both = used[kind][k - 1], used[kind][k]
            changes += _changes(model, scenario, kind, both, float(edges[k]), float(edges[k] - edges[0]))
    return AddedNoise(edges[times], roots[0], roots[1], tuple(changes))


def _changes(
    model: ErrorModel, scenario: Scenario, kind: str, used: tuple[Array, Array], time: float, since: float
) -> Iterator[Change]:
    """Yield what an exclusion changes in the errors of the sensors of a kind."""
    section = scenario.imu.sensor_set
    assert isinstance(section, Redundant)
    axes, none = section.axes, np.zeros((1, 1))
    whole, before, after = spread(axes), *(spread(axes, one) for one in used)
    for block in _like_bias(model, _TRIADS[kind]):
        walk = _of_one(block.density, whole)
        gathered = _of_one(block.sigma, whole) + (since * walk if np.isinf(block.correlation_time) else 0.0)
        yield Change(time, block.name, gathered * (after - before), walk * (after - before))
    maps_before, maps_after = (maps(axes, one) for one in used)
    matrix = _of_matrix(scenario, kind, {field: maps_after[field] - maps_before[field] for field in _MATRIX})
    for field, rows in _MATRIX.items():
        yield Change(time, f"{_TRIADS[kind]} {field}", matrix[np.ix_(rows, rows)], none)


def _like_bias(model: ErrorModel, triad: str) -> list[Block]:
    return [block for block in model.blocks if block.name in (f"{triad} bias", f"{triad} instability")]


def _of_one(sizes: ArrayLike, p: Array) -> float:
    """Return the variance of one sensor's error, by the 1σ of the combination."""
    return float(np.mean(np.square(sizes)) / np.mean(p.diagonal()))


def _of_matrix(scenario: Scenario, kind: str, effects: Mapping[str, Array]) -> Array:
    """Return the covariance of scale factors and misalignments, row by row, (9, 9)."""
    imu = scenario.imu if scenario.compensation is None else scenario.compensation.left(scenario.imu)
    sigma = {term.field: float(np.max(imu.stated(term)[1])) for term in of_triad(kind) if term.field in _MATRIX}
    return np.asarray(sum(sigma[field] ** 2 * effects[field] @ effects[field].T for field in _MATRIX))


def _root_above(least: float, matrix: Array) -> Array:
    """Return a root of what a covariance has beyond the least one of all directions, without rounding errors."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(np.where(values - least > _ROUNDING * least, values - least, 0.0)))
