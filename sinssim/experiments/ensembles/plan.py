"""The plan of an ensemble: everything that its runs have in common, and what is kept of each."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles.members import member
from sinssim.experiments.ensembles.run_errors import WITHIN
from sinssim.experiments.ensembles.truth import TruthCache, truth_key
from sinssim.scenario.own_files import own_digests
from sinssim.system.short_repr import short_repr

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sinssim.scenario import Scenario
    from sinssim.simulation.truth import Truth
    from sinssim.statistics.requirements.requirement import Requirement

AIDED = "aided"
ALL = "all states"
"""Name of the block of all states of a filter."""
_EPOCHS = 500
"""Epochs over a run if the scenario does not give their interval."""
_MOST_EPOCHS = 100_000
_MOVES = 0.5
"""m/s: a slower vehicle has no course."""
_CHUNK = 64
"""Runs in a file: a task of a minute or less."""
LONG_CHUNK = 8
"""Runs in a file, if each has a filter or a flight of its own, and takes as long as tens of others."""
_WITHOUT_EFFECT = ("name", "description", "views", "output", "recording")
"""Keys of a scenario that do not change a number of its runs."""


@short_repr
@dataclass(frozen=True)
class Plan:
    """What the runs of an ensemble have in common.

    Attributes:
        scenario: the scenario, with its seed.
        solution: the solution whose errors are kept: an attitude algorithm, or "aided".
        epochs: instants at which errors are kept, (K,) s.
        start: start of the run, s.
        chunk: runs in a file.
        blocks: blocks of the filter's states, and the number of states of each; empty without a filter.
        sensors: aiding sensors whose innovations are kept; empty without a filter.
        flight: digest of the flight or of the track's file, "" for another motion.
        course: direction of the true ground velocity at the end of the run, rad; NaN at rest.
        extra: epochs that requirements add to the others, s; rates and means over the epochs leave them out.
    """

    scenario: Scenario
    solution: str
    epochs: Array
    start: float
    chunk: int
    blocks: dict[str, int]
    sensors: tuple[str, ...]
    flight: str = ""
    course: float = math.nan
    extra: tuple[float, ...] = ()

    @property
    def filtered(self) -> bool:
        """Whether the errors of a filter's solution are kept."""
        return self.solution == AIDED

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys."""
        return tuple(one.key for one in self.scenario.ensemble.vary) if self.scenario.ensemble else ()

    @cached_property
    def regular(self) -> NDArray[np.bool_]:
        """Whether each epoch is one without any requirement, (K,)."""
        return np.asarray(~np.isin(self.epochs, self.extra))

    @property
    def contents(self) -> dict[str, Any]:
        """The keys of the scenario on which the numbers of a run depend, without seed and number of runs."""
        contents = self.scenario.contents(without=(*_WITHOUT_EFFECT, "seed", "ensemble", "use"))
        if files := own_digests(self.scenario):
            contents["own_content"] = files
        vary = [one.model_dump() for one in self.scenario.ensemble.vary] if self.scenario.ensemble else []
        return {**contents, "ensemble": {"solution": self.solution, "vary": json.loads(json.dumps(vary))}}

    @cached_property
    def digest(self) -> str:
        """SHA-256 over everything that determines the stored numbers, except the versions of the software."""
        text = json.dumps(
            [self.contents, self.scenario.seed, self.epochs.tolist(), self.chunk, self.flight], sort_keys=True
        )
        return hashlib.sha256(text.encode()).hexdigest()


def make_plan(
    scenario: Scenario,
    truths: TruthCache | None = None,
    require: Iterable[Requirement] = (),
    kept: Iterable[float] | None = None,
    times: Iterable[float] = (),
) -> Plan:
    """Plan an ensemble; its flight is flown if it is not in the cache.

    Times of requirements and further `times`, s, are epochs, too; but requirements of an ensemble that is continued add
    none to those that it has `kept`. The true motion for the runs is put into `truths`.

    Raises:
        InputError: the scenario cannot be used for an ensemble, or not be run at all.
        RunError: JSBSim failed.
    """
    from sinssim.scenario.duration import check_times
    from sinssim.scenario.route import check_route

    if scenario.one_component is not None:
        raise InputError(
            f"the scenario {scenario.name} has [one_component]; ensembles are for runs in three dimensions, with "
            "[flight], [parked], [great_circle], [motion] or [track]."
        )
    if scenario.log is not None:
        raise InputError(
            f"the scenario {scenario.name} has [log]; a recording is a single run, but an ensemble has many runs of a "
            "simulation."
        )
    section = scenario.ensemble
    solution = (section.solution if section else None) or (
        AIDED if scenario.filter is not None else scenario.navigation.algorithms[0]
    )
    check_times(scenario)
    blocks = _blocks(scenario) if solution == AIDED else {}
    check_route(scenario)
    truth = (truths or TruthCache()).of(scenario)
    sensors = _sensors(scenario, truth) if solution == AIDED else ()
    wanted = [(one.time, f"requirement {one.text!r}") for one in require if one.when == "at"]
    wanted += [(time, "times (times_s, --at)") for time in times]
    epochs, extra = _with_times(truth, _epochs(truth, section.epoch_s if section else None), wanted, kept)
    chunk = LONG_CHUNK if solution == AIDED or own_motions(scenario) else _CHUNK
    north, east, _ = (float(v) for v in truth.state.velocity_ned[-1])
    course = math.atan2(east, north) if math.hypot(north, east) > _MOVES else math.nan
    return Plan(
        scenario, solution, epochs, float(truth.time[0]), chunk, blocks, sensors, _flight(scenario), course, extra
    )


def with_runs(plan: Plan, runs: int) -> Plan:
    """Return a plan whose scenario names another number of runs; nothing else changes."""
    from sinssim.scenario.sections.ensemble import EnsembleSection

    section = plan.scenario.ensemble or EnsembleSection()
    section = section.model_copy(update={"runs": runs})
    return replace(plan, scenario=plan.scenario.model_copy(update={"ensemble": section}))


def own_motions(scenario: Scenario) -> bool:
    """Return whether the runs of an ensemble differ in their true motions."""
    try:
        return len({truth_key(member(scenario, number).scenario) for number in (0, 1)}) > 1
    except InputError:  # a run that draws a value that is not allowed
        return True


def _blocks(scenario: Scenario) -> dict[str, int]:
    """Return the blocks of a filter's states, and the number of states of each."""
    from sinssim.scenario.duration import expected_duration
    from sinssim.scenario.filter.filter_model import filter_model
    from sinssim.scenario.filter.filter_states import with_states
    from sinssim.scenario.filter.memory import check_memory

    scenario = with_states(scenario)
    check_memory(scenario, recorded=False)
    model = filter_model(scenario, expected_duration(scenario))
    return {ALL: model.size, **{block.name: block.size for block in model.blocks}}


def _sensors(scenario: Scenario, truth: Truth) -> tuple[str, ...]:
    """Return the names of the measurements that a filter takes."""
    from sinssim.sensors.aiding.base.sensor import Vehicle
    from sinssim.simulation.aided.aided_run import navigate_beside

    assert scenario.aiding is not None  # a scenario with a filter has aiding sensors
    vehicle = Vehicle(truth.trajectory, scenario.seed, partial(navigate_beside, scenario, truth.trajectory))
    sensed = (readings for sensor in scenario.aiding.sensors().values() for readings in sensor.read(vehicle))
    return tuple(readings.measurements.label for readings in sensed)


def _epochs(truth: Truth, step: float | None) -> Array:
    """Return the epochs: multiples of the interval from the start, at samples, and the end."""
    time = truth.time
    start, end, sample = float(time[0]), float(time[-1]), float(time[1] - time[0])
    lasts = end - start
    if step is None:
        step = lasts / _EPOCHS
        # whole seconds, at which filters and sensors have their instants, or whole samples in a short run
        step = float(math.floor(step)) if step >= 1.0 else max(math.floor(step / sample), 1) * sample
    elif step < sample - 1e-9 or step > lasts + 1e-9:
        raise InputError(
            f"ensemble.epoch_s = {step:g} must be from one sample, {sample:g} s, to the length of the run, {lasts:g} s."
        )
    if lasts / step > _MOST_EPOCHS:
        raise InputError(
            f"ensemble.epoch_s = {step:g} gives {lasts / step:.0f} epochs over {lasts:g} s; at most {_MOST_EPOCHS} are "
            f"kept: at least {lasts / _MOST_EPOCHS:.2g} s would do."
        )
    wanted = start + step * np.arange(math.floor(lasts / step + 1e-9) + 1)
    rows = np.unique(np.append(np.searchsorted(time, wanted - 0.5 * sample), len(time) - 1))
    return np.asarray(time[np.minimum(rows, len(time) - 1)], dtype=np.float64)


def _with_times(
    truth: Truth, epochs: Array, asked: Iterable[tuple[float, str]], kept: Iterable[float] | None
) -> tuple[Array, tuple[float, ...]]:
    """Return the epochs with times since the start, or those of an ensemble that is continued, and the new ones."""
    edges, start = truth.time, float(truth.time[0])
    wanted = [] if kept is None else [t for t in kept if np.isin(t, edges)]
    lasts = float(edges[-1]) - start
    for time, who in asked:
        if not 0.0 <= time <= lasts + 1e-6:
            raise InputError(f"{who}: {time:g} s lies outside the run, which lasts {lasts:g} s.")
        row = int(np.argmin(np.abs(edges - start - time)))
        if abs(float(edges[row]) - start - time) > WITHIN:
            raise InputError(
                f"{who}: {time:g} s is between two samples of the run, which are {float(edges[1]) - start:g} s apart; "
                f"the nearest one is at {float(edges[row]) - start:.10g} s."
            )
        if kept is None:
            wanted.append(float(edges[row]))
    extra = tuple(sorted({t for t in wanted if not np.isin(t, epochs)}))
    return np.unique(np.append(epochs, extra)), extra


def _flight(scenario: Scenario) -> str:
    if scenario.track is not None:
        return scenario.track.digest()
    if scenario.flight is None:
        return ""
    from sinssim.truth.flight.cache import flight_key

    return flight_key(scenario.flight, scenario.seed)
