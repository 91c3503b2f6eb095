"""What would explain a filter whose innovations speak against it: the filter runs again under each hypothesis.

A hypothesis is one more state (a lever arm, a delay, an error of the inertial sensors), a larger noise of a sensor, or
a random walk of the biases. Each run estimates its size; `sinssim.estimation.checks.evidence` compares what the
innovations say for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sinssim.data import Array
from sinssim.errors import SinssimError
from sinssim.estimation.checks.consistency import consistency
from sinssim.estimation.checks.evidence import gain, needed_gain, refusals, size_of_innovations
from sinssim.estimation.explanation import Diagnosis, Hypothesis, Kind
from sinssim.estimation.measurements.kind import measurement_kind
from sinssim.estimation.model import Block, ErrorModel
from sinssim.estimation.result import Estimate, Innovations

Run = Callable[[ErrorModel, Mapping[str, float]], Estimate]
"""Runs the filter with another error model, and with factors of the σ of some sensors."""

_PRIOR = {
    "gnss lever arm": 10.0,  # m: the size of a vehicle
    "gnss time offset": 1.0,  # s: a second's ambiguity is the largest that a receiver leaves
    "gnss-velocity delay": 1.0,
    "gyro scale": 0.01, "accelerometer scale": 0.01,  # the worst data sheets
    "gyro misalignment": 0.02, "accelerometer misalignment": 0.02,  # rad, a block mounted by hand
}  # fmt: skip
"""Prior σ of states, SI: wide, since the gain depends on it by its logarithm only."""

_ROUNDS, _SETTLED = 5, 0.03
"""Most runs that find a factor of σ, and its relative change at which it is found."""
_DECADES, _HALF = 6, math.sqrt(10.0)
"""Number of decades in which a noise is searched, and the finer step around the best one."""


def diagnose(run: Run, model: ErrorModel, interval: float, until: float) -> Diagnosis | None:
    """Look for the cause of inconsistent innovations.

    Args:
        run: runs the filter.
        model: the filter's own.
        interval: of the inertial samples, s.
        until: end of the time that is looked at, s.

    Returns:
        The findings; None for a filter whose innovations are consistent.
    """
    own = run(model, {})
    judged = consistency(own)
    if judged.consistent:
        return None
    bad = [s.sensor for s in judged.sensors if s.verdict not in ("consistent", "unknown", "outliers")]
    tried = [*_states(run, model, own, interval), *_measurement_noise(run, model, own, bad)]
    tried += _inertial_noise(run, model, own, interval)
    count = max(len(tried), 1)
    found = [replace(one, needed=needed_gain(count, not one.sigma)) for one in tried]
    return Diagnosis(
        until,
        tuple(span for one in own.innovations for span in refusals(one)),
        {one.sensor: size_of_innovations(one) for one in own.innovations},
        tuple(sorted(found, key=lambda one: -one.gain)),
    )


def _try(run: Run, model: ErrorModel, factors: Mapping[str, float]) -> Estimate | None:
    """Run the filter; None if it fails, which speaks against the hypothesis."""
    try:
        found = run(model, factors)
    except SinssimError:
        return None
    return found if len(found.time) else None


def _states(run: Run, model: ErrorModel, own: Estimate, interval: float) -> list[Hypothesis]:
    """Try each state that the model lacks, or assumes to be small."""
    found = []
    for block in _candidates(model, own.innovations, interval):
        there = _try(run, _with_block(model, block), {})
        if there is None:
            continue
        where = there.model.slices[block.name]
        value, sigma = there.parameters[block.name][-1], there.sigma[-1, where]
        better = gain(own.innovations, there.innovations)
        found.append(Hypothesis(block.name, "state", _plain(value), _plain(sigma), better, math.inf))
    return found


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in np.ravel(values))


def _with_block(model: ErrorModel, block: Block) -> ErrorModel:
    """Return a model with one more block, or with another in place of that of its name."""
    kept = [block if one.name == block.name else one for one in model.blocks]
    return replace(model, blocks=tuple(kept if block.name in model.slices else [*kept, block]))


def _candidates(model: ErrorModel, innovations: Sequence[Innovations], interval: float) -> list[Block]:
    """Return the blocks that are tried: those of the sensors that there are."""
    kinds = {one.sensor: measurement_kind(one.kind) for one in innovations if len(one.time)}
    found = []
    if any(kind.at_antenna for kind in kinds.values()):
        found.append(Block("gnss lever arm", _PRIOR["gnss lever arm"]))
    if any(kind.on_gnss_clock for kind in kinds.values()):
        found.append(Block("gnss time offset", _PRIOR["gnss time offset"]))
    if len([1 for kind in kinds.values() if kind.on_gnss_clock]) > 1 and "gnss-velocity" in kinds:
        found.append(Block("gnss-velocity delay", [_PRIOR["gnss-velocity delay"]]))
    for triad, noise in (("gyro", model.gyro_noise), ("accelerometer", model.accel_noise)):
        if noise > 0.0:  # a bias as large as the noise of a single sample
            found.append(Block(f"{triad} bias", noise / math.sqrt(interval)))
        found += [Block(f"{triad} {what}", _PRIOR[f"{triad} {what}"]) for what in ("scale", "misalignment")]
    own = {block.name: block for block in model.blocks}
    return [
        replace(block, random_walk=own[block.name].random_walk) if block.name in own else block
        for block in found
        # a state that is there is tried only if it is assumed to be much smaller
        if block.name not in own or np.max(own[block.name].sigma) < 0.1 * np.max(block.sigma)
    ]


def _measurement_noise(run: Run, model: ErrorModel, own: Estimate, sensors: Sequence[str]) -> list[Hypothesis]:
    """Try other σ of each sensor whose innovations are not as assumed, and of all of them together."""
    which = [[sensor] for sensor in sensors] + ([list(sensors)] if len(sensors) > 1 else [])
    found = []
    for together in which:
        factors, there = dict.fromkeys(together, 1.0), own
        for _ in range(_ROUNDS):
            sizes = {i.sensor: size_of_innovations(i) for i in there.innovations if i.sensor in factors}
            if not all(math.isfinite(size) and size > 0.0 for size in sizes.values()):
                break
            factors = {sensor: factors[sensor] * size for sensor, size in sizes.items()}
            again = _try(run, model, factors)
            if again is None:
                break
            there = again
            if all(abs(size - 1.0) < _SETTLED for size in sizes.values()):
                break
        if there is not own:
            better = gain(own.innovations, there.innovations)
            value = tuple(factors[sensor] for sensor in together)
            found.append(Hypothesis(", ".join(together), "measurement noise", value, (), better, math.inf))
    return found


def _inertial_noise(run: Run, model: ErrorModel, own: Estimate, interval: float) -> list[Hypothesis]:
    """Try more white noise of the inertial sensors, and random walks of their biases."""

    def louder(factor: float) -> ErrorModel:
        return replace(model, gyro_noise=factor * model.gyro_noise, accel_noise=factor * model.accel_noise)

    def walking(triad: str, noise: float) -> Callable[[float], ErrorModel]:
        name = f"{triad} bias"
        block = next((one for one in model.blocks if one.name == name), Block(name, noise / math.sqrt(interval)))
        if math.isfinite(block.correlation_time):
            return lambda density: model
        return lambda density: _with_block(model, replace(block, random_walk=density))

    lasts = float(own.time[-1] - own.time[0]) if len(own.time) > 1 else 1.0
    searches = []
    if model.gyro_noise > 0.0 or model.accel_noise > 0.0:
        searches.append(_Search(run, own, "inertial noise", "inertial noise", louder, _HALF))
    for triad, noise in (("gyro", model.gyro_noise), ("accelerometer", model.accel_noise)):
        if noise > 0.0:  # from where the walk is as large as the white noise at the end of the time
            start = math.sqrt(3.0) * noise / lasts
            searches.append(_Search(run, own, triad, "bias walk", walking(triad, noise), start))
    for search in searches:
        search.by_decades()
    if searches:
        max(searches, key=lambda search: search.best[1]).refine()
    return [search.hypothesis for search in searches if math.isfinite(search.best[1])]


@dataclass
class _Search:
    """The search for the size of a noise that explains the innovations best.

    Attributes:
        run: runs the filter.
        own: the filter's estimate.
        name, kind: of the hypothesis.
        model_of: model with a noise of a size.
        start: least size.
        tried: gain by size.
    """

    run: Run
    own: Estimate
    name: str
    kind: Kind
    model_of: Callable[[float], ErrorModel]
    start: float
    tried: dict[float, float] = field(default_factory=dict)

    @property
    def best(self) -> tuple[float, float]:
        """Size with the largest gain, and that gain."""
        return max(self.tried.items(), key=lambda one: one[1])

    @property
    def hypothesis(self) -> Hypothesis:
        """What was found."""
        size, better = self.best
        return Hypothesis(self.name, self.kind, (size,), (), better, math.inf)

    def _judge(self, size: float) -> float:
        there = _try(self.run, self.model_of(size), {})
        self.tried[size] = -math.inf if there is None else gain(self.own.innovations, there.innovations)
        return self.tried[size]

    def by_decades(self) -> None:
        """Try a size in each decade, until the gain has been and falls."""
        gains: list[float] = []
        for step in range(_DECADES):
            gains.append(self._judge(self.start * 10.0**step))
            if step > 1 and max(gains) > 0.0 and gains[-1] < gains[-2] < gains[-3]:
                break

    def refine(self) -> None:
        """Halve the steps twice in the logarithm, then take the vertex of a parabola."""
        for ratio in (_HALF, math.sqrt(_HALF)):
            size = self.best[0]
            for near in (size * ratio, size / ratio):
                self._judge(near)
        order = sorted(self.tried)
        k = order.index(self.best[0])
        if 0 < k < len(order) - 1:
            x = np.log([size / order[k] for size in order[k - 1 : k + 2]])
            y = np.array([self.tried[size] for size in order[k - 1 : k + 2]])
            if np.isfinite(y).all():
                bend, slope, _ = np.polyfit(x, y, 2)
                self._judge(order[k] * math.exp(-0.5 * slope / bend))
