"""What would explain a filter whose innovations speak against it: the filter's recursion under each hypothesis.

A hypothesis is one more state (a lever arm, a delay, an error of the inertial or of another sensor), a start that is
known less, a larger noise of a sensor, or a random walk of the biases. The filter runs once with all states that are
tried, each known to be zero, and without a gate; `linear_replay` gives the innovations of all hypotheses about the
motion of this pass, with their gates. Sizes of noises are those of maximum likelihood, as for `sinssim tune`, and
refused where the data cannot tell them. The filter itself then runs with the best hypotheses, which decides.

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
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from sinssim.data import Array, rows_of, solution_of
from sinssim.errors import SinssimError
from sinssim.estimation.consistency import FALSE_ALARM, consistency
from sinssim.estimation.filter_result import ALIKE, Diagnosis, Estimate, Hypothesis, Innovations, Kind, Refusals
from sinssim.estimation.linear_replay import Assumptions, LinearPass, nis_of
from sinssim.estimation.maximum_likelihood import WIDE, Maximum, information, maximum_without_outliers, sigma_of
from sinssim.estimation.state_model import Block, ErrorModel
from sinssim.progress import Progress, silent
from sinssim.sensors.aiding_registry import measurement_kind
from sinssim.strapdown.navigation_error import navigation_error

if TYPE_CHECKING:
    from sinssim.estimation.filter_loop import Witness

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


class Run(Protocol):
    """Runs the filter with another error model, and with factors of the σ of some sensors."""

    def __call__(
        self, model: ErrorModel, factors: Mapping[str, float], *, smooth: bool = False, witness: Witness | None = None
    ) -> Estimate:
        """Return the estimate, smoothed if asked; with a witness that of an error-state filter without a gate."""
        ...


_SURE = 2.576
"""Half of the 99 % confidence interval of a factor of σ in units of its 1σ; an interval with 1 in it is no advice."""
_DECADES = 6
"""Number of decades in which a noise is searched."""
_MOST = 8
"""Most hypotheses that the filter itself runs with, beside those on the start."""
_FAR = 500.0
"""Largest gain from which an error of the start may be beyond a linear recursion, so far off are the innovations."""
_FINE, _STEP = 0.1, 1e-3
"""Steps of the logarithm of a size, for the top of a parabola, and for its information."""
_FARTHEST = math.log(1e3)
"""Logarithm of the largest factor of a σ that is tried, and of the inverse of the least."""
_WORDS = {"measurement noise": "σ of {}", "bias walk": "random walk of the {} bias"}
"""What is tried, by kind, for the display of the progress."""


@dataclass(frozen=True)
class _Tried:
    """A hypothesis, and the filter that assumes it."""

    hypothesis: Hypothesis
    model: ErrorModel
    factors: Mapping[str, float]


def diagnose(
    run: Run, model: ErrorModel, interval: float, until: float, progress: Progress = silent
) -> Diagnosis | None:
    """Look for the cause of inconsistent innovations until an instant, s; return None if they are consistent."""
    progress("the filter itself", 0.0)
    base = run(model, {})
    judged = consistency(base)
    if judged.consistent:
        return None
    bad = [s.sensor for s in judged.sensors if s.verdict not in ("consistent", "unknown", "outliers")]
    search = _Search(run, model, base, interval, progress)
    tried = [*search.states(), *search.noises(bad)]
    count = max(len(tried), 1)
    fitted = ("measurement noise", "inertial noise", "bias walk")
    tried = [
        replace(of, hypothesis=replace(of.hypothesis, needed=needed_gain(count, of.hypothesis.kind in fitted)))
        for of in tried
    ]
    ranked = _confirmed(run, base, tried, progress)
    ranked[:1] = [_with_size(run, model, base, hypothesis) for hypothesis in ranked[:1]]
    return Diagnosis(
        until,
        tuple(span for sensor in base.innovations for span in refusals(sensor)),
        {sensor.sensor: size_of_innovations(sensor) for sensor in base.innovations},
        tuple(ranked),
    )


def _confirmed(run: Run, base: Estimate, tried: Sequence[_Tried], progress: Progress) -> list[Hypothesis]:
    """Run the filter with the hypotheses that may be the best; return all, the best first.

    The recursion is linear about a motion that the fault has disturbed, so that those of a quarter of the largest gain
    are run, and where the gains are large every start.
    """
    ranked = sorted(tried, key=lambda of: -of.hypothesis.gain)
    most = max((of.hypothesis.gain for of in ranked), default=0.0)
    least = min(0.25 * most, most - ALIKE)
    chosen = [of for of in ranked if of.hypothesis.gain > max(least, of.hypothesis.needed)][:_MOST]
    if most > _FAR:
        chosen += [of for of in ranked if of.hypothesis.kind == "initial state" and of not in chosen]
    done = []
    for k, of in enumerate(chosen):
        progress(_WORDS.get(of.hypothesis.kind, "{}").format(of.hypothesis.name), 0.6 + 0.4 * k / len(chosen))
        done.append(_as_run(run, base, of))
    best = max((of.gain for of in done), default=math.inf)
    done += [replace(of.hypothesis, gain=min(of.hypothesis.gain, best)) for of in ranked if of not in chosen]
    return sorted(done, key=lambda of: -of.gain)


def _as_run(run: Run, base: Estimate, of: _Tried) -> Hypothesis:
    """Return a hypothesis with what the filter itself makes of it; a filter that fails with it speaks against it."""
    hypothesis = replace(of.hypothesis, gain=-math.inf)
    with suppress(SinssimError):
        there = run(of.model, of.factors)
        if len(there.time):
            hypothesis = replace(hypothesis, gain=gain(base.innovations, there.innovations))
            if hypothesis.kind == "state":
                value, sigma = there.parameters[hypothesis.name][-1], there.sigma[-1]
                sigma = sigma[there.model.slices[hypothesis.name]]
                return replace(hypothesis, value=_plain(value), sigma=_plain(sigma))
    return hypothesis


def _plain(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in np.ravel(values))


def _with_size(run: Run, model: ErrorModel, base: Estimate, hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis on the initial state with the error that the smoothed solution shows there."""
    if hypothesis.kind != "initial state":
        return hypothesis
    block, components, _ = INITIAL[hypothesis.name]
    there = run(dict(initial_candidates(model))[hypothesis.name], {}, smooth=True)
    if there.smoothed is None:
        return hypothesis
    solution, best = base.solution, there.smoothed.solution
    start = solution_of(solution.time[:1], rows_of(solution, slice(0, 1)))
    error = navigation_error(rows_of(best, slice(0, 1)), start, axes=model.axes)
    of_block = {"position": error.position_ned, "velocity": error.velocity_ned, "attitude": error.attitude}[block][0]
    sigma = there.smoothed.sigma[0, model.slices[block]]
    sign = -1.0 if hypothesis.name == "initial heading" else 1.0  # φ down is the negative error of heading
    return replace(hypothesis, value=_plain(sign * of_block[components]), sigma=_plain(sigma[components]))


def _louder(model: ErrorModel, factor: float) -> ErrorModel:
    """Return the model with more noise of the inertial sensors."""
    return replace(model, gyro_noise=factor * model.gyro_noise, accel_noise=factor * model.accel_noise)


def _walking(model: ErrorModel, block: Block, density: float) -> ErrorModel:
    """Return the model with the random walk of a bias."""
    return with_block(model, replace(block, random_walk=density))


class _Search:
    """The hypotheses about one pass of the filter."""

    def __init__(self, run: Run, model: ErrorModel, base: Estimate, interval: float, progress: Progress) -> None:
        self._model, self._base, self._progress = model, base, progress
        self._blocks = state_candidates(model, base.innovations, interval)
        self._walks = list(walks(model, base.innovations, interval))
        wide = model
        for block in (*self._blocks, *(block for _, block, _ in self._walks)):
            if block.name not in wide.slices:
                wide = with_block(wide, replace(block, sigma=0.0 * np.asarray(block.sigma), random_walk=0.0))
        self.line = LinearPass(walking=tuple(block.name for _, block, _ in self._walks), mean_rates=True)
        progress("all errors at once", 0.05)
        with suppress(SinssimError):  # nothing is known beyond
            run(wide, {}, witness=self.line)
        self._bounds = {of.sensor: of.bound for of in base.innovations}
        if self.line.events:
            walking = len(self._walks)
            self._process = np.r_[np.ones(self.line.sources - walking), np.zeros(walking)]
            self._least = float(self._gated([self._assumed()])[0][0])

    def _assumed(self, model: ErrorModel | None = None, **other: Any) -> Assumptions:
        """Return assumptions, of a model that knows less of some states at the start."""
        more = np.zeros(self.line.model.size)
        for block in (model or self._model).blocks:
            where = self.line.model.slices[block.name]
            more[where] = np.square(block.sigma) - self.line.model.sigma[where] ** 2
        return Assumptions(**{"process": self._process, "more": more, **other})

    def _gated(self, assumptions: Sequence[Assumptions]) -> tuple[Array, Array, Array]:
        """Return Σ (νᵀS⁻¹ν + ln det S), (B,), and errors and covariances at the end, with the gate of each."""
        series, x, p = self.line.replay_whole(assumptions, {}, bounds=self._bounds)
        total = np.zeros(len(assumptions))
        for of in series:
            nis = np.minimum(nis_of(of.value, of.covariance), self._bounds[of.sensor])
            total += np.sum(nis + np.linalg.slogdet(of.covariance)[1], axis=1)
        return total, x, p

    def states(self) -> list[_Tried]:
        """Try each state that the model lacks or assumes to be small, and a start of which the filter knows little."""
        if not self.line.events:
            return []
        models = [(block.name, with_block(self._model, block)) for block in self._blocks]
        starts = list(initial_candidates(self._model))
        self._progress("explanations", 0.3)
        total, x, p = self._gated([self._assumed(model) for _, model in (*models, *starts)])
        tried = []
        for k, (name, model) in enumerate((*models, *starts)):
            hypothesis = Hypothesis(name, "initial state", (), (), self._least - float(total[k]), math.inf)
            if k < len(models):
                where = self.line.model.slices[name]
                value, sigma = x[k, where] + self.line.fed[where], np.sqrt(p[k, where, where].diagonal())
                hypothesis = replace(hypothesis, kind="state", value=_plain(value), sigma=_plain(sigma))
            tried.append(_Tried(hypothesis, model, {}))
        return tried

    def noises(self, bad: Sequence[str]) -> Iterator[_Tried]:
        """Fit other σ of each sensor whose innovations are not as assumed, and of all of them together; more noise of
        the inertial sensors; and random walks of the biases of all sensors."""
        if not self.line.events:
            return
        for group in [[sensor] for sensor in bad] + ([list(bad)] if len(bad) > 1 else []):
            yield from self._readings(group)
        model = self._model
        if model.gyro_noise > 0.0 or model.accel_noise > 0.0:
            yield from self._noise("inertial noise", "inertial noise", [0, 1], 1.0, 1.0, partial(_louder, model))
        lasts = self.line.events[-1].time - self.line.events[0].time or 1.0
        first = self.line.sources - len(self._walks)
        for j, (name, block, noise) in enumerate(self._walks):
            # from where the walk is as large as the white noise at the end of the time
            density, least = float(np.max(block.density)), math.sqrt(3.0) * noise / lasts
            model_of = partial(_walking, model, block)
            yield from self._noise(name, "bias walk", [first + j], density, max(least, density), model_of)

    def _fitted(self, assumed: Callable[[Array], Assumptions], start: Array, low: Array, high: Array) -> Maximum:
        """Return the maximum of the likelihood, without outliers; its value is the gain."""
        dropped = {of.sensor: np.zeros(len(of.nis), dtype=bool) for of in self._base.innovations}
        best = maximum_without_outliers(
            lambda sets: self.line.replay([assumed(x) for x in sets], dropped), dropped, start, low, high
        )
        return replace(best, value=self._least - float(self._gated([assumed(best.x)])[0][0]))

    def _readings(self, group: Sequence[str]) -> Iterator[_Tried]:
        """Fit the σ of sensors; nothing if the readings do not determine all of them, or if one may be right."""
        self._progress(_WORDS["measurement noise"].format(", ".join(group)), 0.4)
        count = {of.sensor: len(of.nis) for of in self._base.innovations}

        def assumed(x: Array) -> Assumptions:
            return self._assumed(
                sigma={name: np.full((count[name], 1), math.exp(v)) for name, v in zip(group, x, strict=True)}
            )

        start = np.zeros(len(group))
        best = self._fitted(assumed, start, start - _FARTHEST, start + _FARTHEST)
        if np.all((best.sigma <= WIDE) & (np.abs(best.x) > _SURE * best.sigma)):
            value, sigma = _plain(np.exp(best.x)), _plain(best.sigma * np.exp(best.x))
            hypothesis = Hypothesis(", ".join(group), "measurement noise", value, sigma, best.value, math.inf)
            yield _Tried(hypothesis, self._model, dict(zip(group, value, strict=True)))

    def _noise(
        self, name: str, kind: Kind, sources: Sequence[int], present: float, least: float,
        model_of: Callable[[float], ErrorModel],
    ) -> Iterator[_Tried]:  # fmt: skip
        """Fit the size of a noise from the `least` on; nothing if the readings do not determine it, or the present one
        may be right."""
        self._progress(_WORDS.get(kind, "{}").format(name), 0.5)

        def assumed(x: Array) -> Assumptions:
            process, size = self._process.copy(), math.exp(x[0])
            process[sources] = size**2 - (present**2 if kind == "bias walk" else 0.0)
            return self._assumed(model_of(size), process=process)

        grid: Array = math.log(least) + _DECADES * math.log(10.0) * np.linspace(0.0, 1.0, 6 * _DECADES + 1)[:, None]
        total = self._gated([assumed(x) for x in grid])[0]
        k = int(np.argmin(total))
        if not 0 < k < len(grid) - 1:
            return
        x = grid[k]
        for step in (grid[1, 0] - grid[0, 0], _FINE):
            sides = step * np.array([-1.0, 0.0, 1.0])
            bend, slope, _ = np.polyfit(sides, self._gated([assumed(x + side) for side in sides])[0], 2)
            x = x + np.clip(-0.5 * slope / bend, -step, step)
        sets = [assumed(x), assumed(x + _STEP)]
        sigma = sigma_of(information(self.line.replay_whole(sets, {}, bounds=self._bounds)[0], _STEP))
        if sigma[0] <= WIDE and x[0] > grid[0, 0] + _SURE * sigma[0]:
            better, size = self._least - float(self._gated(sets[:1])[0][0]), math.exp(x[0])
            yield _Tried(Hypothesis(name, kind, (size,), (), better, math.inf), model_of(size), {})
