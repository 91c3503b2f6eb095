"""The states that a diagnosis tries: of the satellite receiver, the inertial sensors, other sensors and the start."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from sinssim.data import Array
from sinssim.estimation.model import Block, ErrorModel
from sinssim.estimation.result import Innovations
from sinssim.sensors.aiding.registry import measurement_kind

_PRIOR = {
    "gnss lever arm": 10.0,  # m: the size of a vehicle
    "gnss time offset": 1.0,  # s: a second's ambiguity is the largest that a receiver leaves
    "gnss-velocity delay": 1.0,
    "gyro scale": 0.01, "accelerometer scale": 0.01,  # the worst data sheets
    "gyro misalignment": 0.02, "accelerometer misalignment": 0.02,  # rad, a block mounted by hand
}  # fmt: skip
"""Prior σ of states, SI: wide, since the gain depends on it by its logarithm only."""

INITIAL: dict[str, tuple[str, slice, float]] = {
    "initial position": ("position", slice(0, 3), 1000.0),  # m: another runway
    "initial velocity": ("velocity", slice(0, 3), 30.0),  # m/s: taken for standing
    "initial tilt": ("attitude", slice(0, 2), 0.1),  # rad: a slope, or a coarse alignment in motion
    "initial heading": ("attitude", slice(2, 3), 1.0),  # rad: as wide as a linear filter can be told
}
"""Block, components and prior σ of the initial states that are tried."""

_SMALLER = 0.1
"""Ratio of σ to the prior below which a state that is there is tried with the prior."""


def state_candidates(model: ErrorModel, innovations: Sequence[Innovations], interval: float) -> list[Block]:
    """Return the blocks that are tried: those that the model lacks, or assumes to be much smaller.

    Args:
        model: the filter's own.
        interval: of the inertial samples, s.
    """
    own = {block.name: block for block in model.blocks}
    found = []
    for block in (*_of_satellites(innovations), *_of_inertial(model, interval), *_of_sensors(innovations)):
        there = own.get(block.name)
        if there is None:
            found.append(block)
        elif np.max(there.sigma) < _SMALLER * np.max(block.sigma):
            found.append(replace(block, random_walk=there.density))  # what drives it is kept
    return found


def _of_satellites(innovations: Sequence[Innovations]) -> Iterator[Block]:
    kinds = {one.sensor: measurement_kind(one.kind) for one in innovations if len(one.time)}
    if any(kind.at_antenna for kind in kinds.values()):
        yield Block("gnss lever arm", _PRIOR["gnss lever arm"])
    if any(kind.on_gnss_clock for kind in kinds.values()):
        yield Block("gnss time offset", _PRIOR["gnss time offset"])
    if len([1 for kind in kinds.values() if kind.on_gnss_clock]) > 1 and "gnss-velocity" in kinds:
        yield Block("gnss-velocity delay", [_PRIOR["gnss-velocity delay"]])


def _of_inertial(model: ErrorModel, interval: float) -> Iterator[Block]:
    for triad, noise in (("gyro", model.gyro_noise), ("accelerometer", model.accel_noise)):
        if noise > 0.0:  # a bias as large as the noise of a single sample
            yield Block(f"{triad} bias", noise / math.sqrt(interval))
        for what in ("scale", "misalignment"):
            yield Block(f"{triad} {what}", _PRIOR[f"{triad} {what}"])


def _of_sensors(innovations: Sequence[Innovations]) -> Iterator[Block]:
    for one in innovations:
        if not len(one.time):
            continue
        kind = measurement_kind(one.kind)
        for error, sigma in kind.diagnosed.items():
            size = len(kind.own_errors[error][0]) if error in kind.own_errors else kind.errors
            yield Block(f"{one.sensor} {error}", (sigma,) * size)


def walks(model: ErrorModel, innovations: Sequence[Innovations], interval: float) -> Iterator[tuple[str, Block, float]]:
    """Yield the constant biases that may walk randomly instead.

    Args:
        model: the filter's own.
        interval: of the inertial samples, s.

    Yields:
        Name of the triad or sensor, block of its bias, density of the white noise of its readings.
    """
    own = {block.name: block for block in model.blocks}
    for triad, noise in (("gyro", model.gyro_noise), ("accelerometer", model.accel_noise)):
        name = f"{triad} bias"
        block = own.get(name) or Block(name, noise / math.sqrt(interval))
        if noise > 0.0 and math.isinf(block.correlation_time):
            yield triad, block, noise
    for one in innovations:
        bias = own.get(f"{one.sensor} bias")
        if bias is not None and math.isinf(bias.correlation_time) and len(one.time) > 1:
            apart = float(np.median(np.diff(one.time)))
            yield one.sensor, bias, float(np.median(one.sigma_at(slice(None)))) * math.sqrt(apart)


def with_block(model: ErrorModel, block: Block) -> ErrorModel:
    """Return a model with one more block, or with another in place of that of its name."""
    kept = [block if one.name == block.name else one for one in model.blocks]
    return replace(model, blocks=tuple(kept if block.name in model.slices else [*kept, block]))


def initial_candidates(model: ErrorModel) -> Iterator[tuple[str, ErrorModel]]:
    """Yield the initial states that are tried, with the model that knows little of them.

    Args:
        model: the filter's own.
    """
    own = {block.name: block for block in model.blocks}
    for name, (block, components, prior) in INITIAL.items():
        sigma = np.array(np.broadcast_to(np.asarray(own[block].sigma, dtype=np.float64), 3))
        if np.max(sigma[components]) < _SMALLER * prior:
            sigma[components] = prior
            yield name, with_block(model, replace(own[block], sigma=sigma))


def widened(covariance: Array | None, own: ErrorModel, other: ErrorModel) -> Array | None:
    """Return an initial covariance with the larger σ of the initial states of another model.

    Args:
        covariance: P₀ of the first states, (m, m); None if the model's σ are used.
        other: one of `initial_candidates`.
    """
    if covariance is None:
        return None
    count = min(len(covariance), 9)
    more = other.sigma[:count] ** 2 - own.sigma[:count] ** 2
    wide = covariance.copy()
    wide[np.arange(count), np.arange(count)] += np.maximum(more, 0.0)
    return wide
