"""What would explain a filter whose innovations speak against it: the filter runs again under each hypothesis.

A hypothesis is one more state (a lever arm, a delay, an error of the inertial or of another sensor), a start that is
known less, a larger noise of a sensor, or a random walk of the biases. Each run estimates its size; the evidence
compares what the innovations say for it.

The evidence of innovations for one model against another: with a linear model and normal noise the innovations give the
probability density of the readings themselves,

    −2 ln p(z) = Σ (νᵀS⁻¹ν + ln det S) + const                        (Bar-Shalom, Li and Kirubarajan, section 11.2)

A hypothesis with a further state of some prior σ is compared with the filter's own model by the ratio of both, the
Bayes factor. If the own model is right, the expectation of the factor is 1, so that by Markov's inequality it exceeds
n/α for any of n hypotheses with a probability of at most α. Neither a distribution of the estimate nor the number of
readings enters. A size that is fitted instead, such as a factor of σ, is judged by its χ² with one degree of freedom
(Wilks), at α/n as well. Refused readings count with the gate's bound.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.data import Array, NavState
from sinssim.errors import SinssimError
from sinssim.estimation.consistency import FALSE_ALARM, consistency
from sinssim.estimation.filter_result import Diagnosis, Estimate, Hypothesis, Innovations, Kind, Refusals
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.strapdown.navigation_error import navigation_error

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

    The inertial samples are `interval` s apart.
    """
    present = {block.name: block for block in model.blocks}
    candidates = []
    for block in (*_of_satellites(innovations), *_of_inertial(model, interval), *_of_sensors(innovations)):
        there = present.get(block.name)
        if there is None:
            candidates.append(block)
        elif np.max(there.sigma) < _SMALLER * np.max(block.sigma):
            candidates.append(replace(block, random_walk=there.density))  # what drives it is kept
    return candidates


def _of_satellites(innovations: Sequence[Innovations]) -> Iterator[Block]:
    kinds = {sensor.sensor: measurement_kind(sensor.kind) for sensor in innovations if len(sensor.time)}
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
    for sensor in innovations:
        if not len(sensor.time):
            continue
        kind = measurement_kind(sensor.kind)
        for error, sigma in kind.diagnosed.items():
            size = len(kind.own_errors[error][0]) if error in kind.own_errors else kind.errors
            yield Block(f"{sensor.sensor} {error}", (sigma,) * size)


def walks(model: ErrorModel, innovations: Sequence[Innovations], interval: float) -> Iterator[tuple[str, Block, float]]:
    """Yield the constant biases that may walk instead: triad or sensor, block, density of its readings' white noise."""
    present = {block.name: block for block in model.blocks}
    for triad, noise in (("gyro", model.gyro_noise), ("accelerometer", model.accel_noise)):
        name = f"{triad} bias"
        block = present.get(name) or Block(name, noise / math.sqrt(interval))
        if noise > 0.0 and math.isinf(block.correlation_time):
            yield triad, block, noise
    for sensor in innovations:
        bias = present.get(f"{sensor.sensor} bias")
        if bias is not None and math.isinf(bias.correlation_time) and len(sensor.time) > 1:
            apart = float(np.median(np.diff(sensor.time)))
            yield sensor.sensor, bias, float(np.median(sensor.sigma_at(slice(None)))) * math.sqrt(apart)


def with_block(model: ErrorModel, block: Block) -> ErrorModel:
    """Return a model with one more block, or with another in place of that of its name."""
    blocks = [block if present.name == block.name else present for present in model.blocks]
    return replace(model, blocks=tuple(blocks if block.name in model.slices else [*blocks, block]))


def initial_candidates(model: ErrorModel) -> Iterator[tuple[str, ErrorModel]]:
    """Yield the initial states that are tried, with the model that knows little of them."""
    present = {block.name: block for block in model.blocks}
    for name, (block, components, prior) in INITIAL.items():
        sigma = np.array(np.broadcast_to(np.asarray(present[block].sigma, dtype=np.float64), 3))
        if np.max(sigma[components]) < _SMALLER * prior:
            sigma[components] = prior
            yield name, with_block(model, replace(present[block], sigma=sigma))


def widened(covariance: Array | None, model: ErrorModel, other: ErrorModel) -> Array | None:
    """Return an initial covariance, if there is one, with the larger σ of the initial states of another model."""
    if covariance is None:
        return None
    count = min(len(covariance), 9)
    more = other.sigma[:count] ** 2 - model.sigma[:count] ** 2
    wide = covariance.copy()
    wide[np.arange(count), np.arange(count)] += np.maximum(more, 0.0)
    return wide


FEWEST = 8
"""Fewest readings that are compared."""


def gain(base: Sequence[Innovations], other: Sequence[Innovations]) -> float:
    """Return twice the logarithm of the ratio of two models' evidence, over the readings that both were tested on.

    It is 2 ln (p(z | hypothesis) / p(z | own)), positive if the hypothesis explains the readings better.
    """
    total = 0.0
    for a, b in zip(base, other, strict=True):
        if len(a.nis) != len(b.nis):
            return -math.inf
        both = np.flatnonzero(np.isfinite(a.nis) & np.isfinite(b.nis))
        total += _deviance(a, both) - _deviance(b, both)
    return total


def _deviance(innovations: Innovations, rows: NDArray[np.intp]) -> float:
    """Return Σ (νᵀS⁻¹ν + ln det S) over some readings."""
    total = 0.0
    for part in np.array_split(rows, max(1, len(rows) // 16384)):
        if len(part):
            total += float(np.sum(np.linalg.slogdet(innovations.covariance_at(part))[1]))
    return total + float(np.sum(np.minimum(innovations.nis[rows], innovations.bound)))


def needed_gain(hypotheses: int, fitted: bool) -> float:
    """Return the gain from which a hypothesis is named, whose size is `fitted` to the readings or has a prior σ."""
    return (
        float(scipy.special.chdtri(1, FALSE_ALARM / hypotheses)) if fitted else 2.0 * math.log(hypotheses / FALSE_ALARM)
    )


def size_of_innovations(innovations: Innovations) -> float:
    """Return the factor by which the innovations are larger than the filter assumes, by the median of their NIS.

    It is 1 if the filter is right, and not a number with too few readings. Half of the readings may be outliers.
    """
    nis = innovations.nis[np.isfinite(innovations.nis)]
    if len(nis) < FEWEST:
        return math.nan
    return math.sqrt(float(np.median(nis)) / float(scipy.special.chdtri(innovations.value.shape[1], 0.5)))


def refusals(innovations: Innovations) -> Iterator[Refusals]:
    """Yield the spans in which the gate refused one reading after the other.

    A gate that refuses the share α of correct readings refuses m in a row somewhere among N with a probability of at
    most N αᵐ. Spans of which that is below `FALSE_ALARM` are named.
    """
    tested = np.flatnonzero(np.isfinite(innovations.nis))
    if not len(tested) or not math.isfinite(innovations.bound):
        return
    share = float(scipy.special.chdtrc(innovations.value.shape[1], innovations.bound))
    if not 0.0 < share < 1.0:
        return
    least = max(math.ceil(math.log(FALSE_ALARM / len(tested)) / math.log(share)), 2)
    refused = ~innovations.accepted[tested]
    edges = np.flatnonzero(np.diff(refused.astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if end - begin >= least:
            rows = tested[begin:end]
            off = tuple(float(value) for value in -np.mean(innovations.value[rows], axis=0))
            first, last = innovations.time[rows[[0, -1]]]
            yield Refusals(innovations.sensor, float(first), float(last), end - begin, off)


class LimitReachedError(SinssimError):
    """The search has taken as many runs as it may; what is untried is left out."""


class Run(Protocol):
    """Runs the filter with another error model, and with factors of the σ of some sensors."""

    def __call__(self, model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False) -> Estimate:
        """Return the estimate, smoothed if asked."""
        ...


_ROUNDS, _SETTLED = 5, 0.03
"""Most runs that find a factor of σ, and its relative change at which it is found."""
_SURE = 2.576
"""Half of the 99 % confidence interval of a factor of σ in units of its 1σ; an interval with 1 in it is no advice."""
_COLUMNS = ("time", "latitude", "longitude", "height", "velocity_ned", "q_nb", "defect")
_DECADES, _HALF = 6, math.sqrt(10.0)
"""Number of decades in which a noise is searched, and the finer step around the best one."""


def diagnose(run: Run, model: ErrorModel, interval: float, until: float) -> Diagnosis | None:
    """Look for the cause of inconsistent innovations until an instant, s; return None if they are consistent."""
    base = run(model, {})
    judged = consistency(base)
    if judged.consistent:
        return None
    bad = [s.sensor for s in judged.sensors if s.verdict not in ("consistent", "unknown", "outliers")]
    tried = [*_states(run, model, base, interval), *_initial(run, model, base)]
    tried += _measurement_noise(run, model, base, bad)
    tried += _inertial_noise(run, model, base, interval)
    count = max(len(tried), 1)
    fitted = ("measurement noise", "inertial noise", "bias walk")
    ranked = [replace(hypothesis, needed=needed_gain(count, hypothesis.kind in fitted)) for hypothesis in tried]
    ranked.sort(key=lambda hypothesis: -hypothesis.gain)
    ranked[:1] = [_with_size(run, model, base, hypothesis) for hypothesis in ranked[:1]]
    return Diagnosis(
        until,
        tuple(span for sensor in base.innovations for span in refusals(sensor)),
        {sensor.sensor: size_of_innovations(sensor) for sensor in base.innovations},
        tuple(ranked),
    )


def _try(run: Run, model: ErrorModel, factors: Mapping[str, float]) -> Estimate | None:
    """Run the filter; None if it fails, which speaks against the hypothesis, or if the search is at its limit."""
    try:
        estimate = run(model, factors)
    except SinssimError:
        return None
    return estimate if len(estimate.time) else None


def _states(run: Run, model: ErrorModel, base: Estimate, interval: float) -> list[Hypothesis]:
    """Try each state that the model lacks, or assumes to be small."""
    tried = [_state(run, model, base, block) for block in state_candidates(model, base.innovations, interval)]
    return [hypothesis for hypothesis in tried if hypothesis is not None]


def _state(run: Run, model: ErrorModel, base: Estimate, block: Block) -> Hypothesis | None:
    """Try one block of states; None if the filter fails with it."""
    there = _try(run, with_block(model, block), {})
    if there is None:
        return None
    where = there.model.slices[block.name]
    value, sigma = there.parameters[block.name][-1], there.sigma[-1, where]
    better = gain(base.innovations, there.innovations)
    return Hypothesis(block.name, "state", _plain(value), _plain(sigma), better, math.inf)


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in np.ravel(values))


def _initial(run: Run, model: ErrorModel, base: Estimate) -> list[Hypothesis]:
    """Try a start of which the filter knows little; the sizes are found afterwards, for the best one."""
    hypotheses = []
    for name, wide in initial_candidates(model):
        there = _try(run, wide, {})
        if there is not None:
            hypotheses.append(
                Hypothesis(name, "initial state", (), (), gain(base.innovations, there.innovations), math.inf)
            )
    return hypotheses


def _with_size(run: Run, model: ErrorModel, base: Estimate, hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis on the initial state with the error that the smoothed solution shows there."""
    if hypothesis.kind != "initial state":
        return hypothesis
    block, components, _ = INITIAL[hypothesis.name]
    there = run(dict(initial_candidates(model))[hypothesis.name], {}, smooth=True)
    if there.smoothed is None:
        return hypothesis
    solution, best = base.solution, there.smoothed.solution
    start = replace(solution, **{name: getattr(solution, name)[:1] for name in _COLUMNS}, azimuth=None)
    likely = NavState(*(getattr(best, name)[:1] for name in _COLUMNS[1:-1]))
    error = navigation_error(likely, start, axes=model.axes)
    of_block = {"position": error.position_ned, "velocity": error.velocity_ned, "attitude": error.attitude}[block][0]
    sigma = there.smoothed.sigma[0, model.slices[block]]
    sign = -1.0 if hypothesis.name == "initial heading" else 1.0  # φ down is the negative error of heading
    return replace(hypothesis, value=_plain(sign * of_block[components]), sigma=_plain(sigma[components]))


def _measurement_noise(run: Run, model: ErrorModel, base: Estimate, sensors: Sequence[str]) -> list[Hypothesis]:
    """Try other σ of each sensor whose innovations are not as assumed, and of all of them together."""
    which = [[sensor] for sensor in sensors] + ([list(sensors)] if len(sensors) > 1 else [])
    hypotheses = []
    for group in which:
        factors, there, settled = dict.fromkeys(group, 1.0), base, False
        for _ in range(_ROUNDS):
            sizes = {i.sensor: size_of_innovations(i) for i in there.innovations if i.sensor in factors}
            if not all(math.isfinite(size) and size > 0.0 for size in sizes.values()):
                break
            factors = {sensor: factors[sensor] * size for sensor, size in sizes.items()}
            again = _try(run, model, factors)
            if again is None:
                break
            there = again
            settled = all(abs(size - 1.0) < _SETTLED for size in sizes.values())
            if settled:
                break
        if not settled:  # the readings' own noise does not show in the innovations: no factor follows from them
            continue
        better = gain(base.innovations, there.innovations)
        spread = _spread(run, model, factors, better, base)
        if all(abs(math.log(factor)) > _SURE * spread for factor in factors.values()):
            value = tuple(factors[sensor] for sensor in group)
            sigma = tuple(spread * factor for factor in value)
            hypotheses.append(Hypothesis(", ".join(group), "measurement noise", value, sigma, better, math.inf))
    return hypotheses


def _spread(run: Run, model: ErrorModel, factors: Mapping[str, float], better: float, base: Estimate) -> float:
    """Return the 1σ of the logarithm of factors of σ, from how much the gain falls where they are closer to 1.

    The gain, twice the logarithm of the likelihood, is a parabola about its maximum, g − (ln f/f̂)²/σ². It is infinite
    where the likelihood is flat, so that a factor of 1 cannot be told from the best one.
    """
    closer = {sensor: math.sqrt(factor) for sensor, factor in factors.items()}
    try:
        there = run(model, closer)
    except LimitReachedError:
        return math.inf
    except SinssimError:
        there = None
    fall = better - (-math.inf if there is None else gain(base.innovations, there.innovations))
    step = max(abs(math.log(factor)) for factor in closer.values())
    return 0.0 if math.isinf(fall) else step / math.sqrt(fall) if fall > 0.0 else math.inf


def _inertial_noise(run: Run, model: ErrorModel, base: Estimate, interval: float) -> list[Hypothesis]:
    """Try more white noise of the inertial sensors, and random walks of the biases of all sensors."""

    def louder(factor: float) -> ErrorModel:
        return replace(model, gyro_noise=factor * model.gyro_noise, accel_noise=factor * model.accel_noise)

    lasts = float(base.time[-1] - base.time[0]) if len(base.time) > 1 else 1.0
    searches = []
    if model.gyro_noise > 0.0 or model.accel_noise > 0.0:
        searches.append(_Search(run, base, "inertial noise", "inertial noise", louder, _HALF))
    for name, block, noise in walks(model, base.innovations, interval):
        # from where the walk is as large as the white noise at the end of the time
        searches.append(_Search(run, base, name, "bias walk", _walking(model, block), math.sqrt(3.0) * noise / lasts))
    for search in searches:
        search.by_decades()
    if searches:
        max(searches, key=lambda search: search.best[1]).refine()
    return [search.hypothesis for search in searches if math.isfinite(search.best[1])]


def _walking(model: ErrorModel, block: Block) -> Callable[[float], ErrorModel]:
    """Return the model by the density of the random walk of a bias."""
    return lambda density: with_block(model, replace(block, random_walk=density))


@dataclass
class _Search:
    """The search for the size of a noise that explains the innovations best."""

    run: Run  # runs the filter
    base: Estimate  # the filter's estimate
    name: str
    kind: Kind  # name, kind: of the hypothesis
    model_of: Callable[[float], ErrorModel]  # model with a noise of a size
    start: float  # least size
    tried: dict[float, float] = field(default_factory=dict)  # gain by size

    @property
    def best(self) -> tuple[float, float]:
        """Size with the largest gain, and that gain."""
        return max(self.tried.items(), key=lambda item: item[1])

    @property
    def hypothesis(self) -> Hypothesis:
        """What was found."""
        size, better = self.best
        return Hypothesis(self.name, self.kind, (size,), (), better, math.inf)

    def _judge(self, size: float) -> float:
        there = _try(self.run, self.model_of(size), {})
        self.tried[size] = -math.inf if there is None else gain(self.base.innovations, there.innovations)
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
