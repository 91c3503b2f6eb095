"""The plan of an ensemble: seeds, varied keys and scenarios of its runs, and what they have in common."""

from __future__ import annotations

import hashlib
import json
import math
import threading
from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sinssim.data import Array, ImuData, short_repr
from sinssim.errors import InputError
from sinssim.estimation import SHIPPED
from sinssim.experiments.ensembles.ensemble_errors import WITHIN
from sinssim.scenario import Scenario
from sinssim.scenario.ensemble_section import Choice, Normal, Uniform
from sinssim.scenario.filter_model import with_first
from sinssim.scenario.plan_summary import own_digests
from sinssim.simulation.foreign_navigator import check_programs
from sinssim.simulation.guided_passes import closed_loop, is_guided
from sinssim.simulation.total_system_error import check_path, path_columns
from sinssim.simulation.truth_and_sensors import Truth, truth_along
from sinssim.statistics.requirements import Requirement
from sinssim.truth.motion import Motion

_SEED_BITS = 53
"""Bits of a run's seed: every JSON reader keeps them, and two of 10⁵ runs share a seed with a probability of 6e-7."""


def run_seed(seed: int, number: int) -> int:
    """Return the seed of a run, counted from 0, of an ensemble with a seed, on which two alone it depends: a whole
    number below 2⁵³, the first bits of the SHA-256 digest of both numbers."""
    digest = hashlib.sha256(f"sinssim ensemble {seed} run {number}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - _SEED_BITS)


@dataclass(frozen=True)
class Member:
    """One run of an ensemble.

    Attributes:
        number: its number, from 0.
        seed: its seed.
        values: values of the varied keys, by key.
        base: the scenario of the ensemble.
    """

    number: int
    seed: int
    values: dict[str, float | int]
    base: Scenario

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario of this run: that of `sinssim run` with `settings`; raises InputError if a varied key's value is
        not allowed."""
        alone = {"seed": self.seed, "ensemble": None}
        if not self.values:
            return self.base.model_copy(update=alone)
        from pydantic import ValidationError

        from sinssim.errors import InputError
        from sinssim.scenario.ensemble_section import with_values
        from sinssim.toml_mistakes import report

        contents = with_values(self.base.contents(without=("ensemble",)), {"seed": self.seed, **self.values})
        try:
            return type(self.base).model_validate(contents)
        except ValidationError as error:
            raise InputError(report(error, type(self.base), {}, (), "a varied key")) from error

    @property
    def settings(self) -> list[str]:
        """Settings "key=value" that make the ensemble's scenario the one of this run, as for --set."""
        return [f"seed={self.seed}", *(f"{key}={value!r}" for key, value in self.values.items())]


def member(scenario: Scenario, number: int) -> Member:
    """Return a run of an ensemble by its number, from 0."""
    seed = run_seed(scenario.seed, number)
    vary = () if scenario.ensemble is None else scenario.ensemble.vary
    return Member(number, seed, {variation.key: _drawn(variation, seed) for variation in vary}, scenario)


def _drawn(variation: Normal | Uniform | Choice, seed: int) -> Any:
    """Return the value of a varied key in the run of a seed."""
    from scipy.special import ndtr

    from sinssim.statistics.random_numbers import normals

    normal = float(normals(seed, f"vary {variation.key}", 0, 1)[0])
    uniform = float(ndtr(normal))
    match variation:
        case Normal():
            return variation.mean + variation.sigma * normal
        case Uniform():
            return variation.low + (variation.high - variation.low) * uniform
        case Choice():
            return variation.values[min(int(uniform * len(variation.values)), len(variation.values) - 1)]


_TABLES = (
    "flight", "parked", "great_circle", "motion", "track", "drive", "voyage", "rocket", "turntable", "drop",
    "vibration", "isolator", "truth", "gravity",
)  # fmt: skip
_OF_BLOCK = ("lever_arm_m", "mounting_deg", "rate_hz", "rotation")
_KEPT = 2
"""True motions kept at a time: that of all runs, or that of a run in progress in each of two threads."""


def truth_key(scenario: Scenario) -> str:
    """Return a text that is equal for scenarios with the same true motion and increments.

    It has the tables and keys that determine them, with the seed if turbulence, gusts, vibration, road, sea, strides,
    gravity's remainder or the errors of a turntable are drawn from it. A flight by its navigator is determined by all
    of them.
    """
    if is_guided(scenario):
        return json.dumps(contents_of(scenario), sort_keys=True)
    flight, table = scenario.flight, scenario.turntable
    drawn = (
        bool(scenario.vibration)
        or (isinstance(scenario.source, Motion) and scenario.source.is_drawn)
        or (flight is not None and bool(flight.turbulence))
        or (table is not None and bool(table.position_sigma_arcsec or table.tilt_sigma_arcsec))
        or has_remainder(scenario)
    )
    contents = scenario.contents()
    return json.dumps(
        [
            {name: contents.get(name) for name in _TABLES},
            {name: contents["imu"].get(name) for name in _OF_BLOCK},
            scenario.seed if drawn else None,
        ],
        sort_keys=True,
    )


class TruthCache:
    """Computes true motions and keeps the last ones; usable from several threads."""

    def __init__(self) -> None:
        """Begin without any."""
        self._kept: OrderedDict[str, Truth] = OrderedDict()
        self._lock = threading.Lock()
        self._each: dict[str, threading.Lock] = {}
        self._unrounded: tuple[Truth, ImuData] | None = None

    def forget(self) -> None:
        """Free all true motions; they are computed again when they are wanted."""
        with self._lock:
            self._kept.clear()
            self._each.clear()
            self._unrounded = None

    def keep(self, scenario: Scenario, truth: Truth) -> None:
        """Keep a true motion that another process has computed."""
        with self._lock:
            self._kept[truth_key(scenario)] = truth
            self._drop_old()

    def of(self, scenario: Scenario) -> Truth:
        """Return the true motion of a scenario, the same bits as those of `sinssim run`."""
        key = truth_key(scenario)
        with self._lock:
            lock = self._each.setdefault(key, threading.Lock())
        with lock:  # threads that want the same motion wait for the first of them
            with self._lock:
                if key in self._kept:
                    self._kept.move_to_end(key)
                    return self._kept[key]
            again = has_remainder(scenario) and scenario.imu.rotation is None and not is_guided(scenario)
            truth = self._in_drawn_gravity(scenario) if again else _truth(scenario)
            with self._lock:
                self._kept[key] = truth
                self._drop_old()
        return truth

    def _drop_old(self) -> None:
        while len(self._kept) > _KEPT:
            old, _ = self._kept.popitem(last=False)
            self._each.pop(old, None)

    def _in_drawn_gravity(self, scenario: Scenario) -> Truth:
        """Return the true motion in a gravity that is drawn in each run; the motion itself is that of all runs."""
        from sinssim.sensors.imu.emulation import digital

        assert scenario.gravity is not None  # asked by the caller
        base = self.of(scenario.model_copy(update={"gravity": None}))
        trajectory = scenario.gravity.felt(base.trajectory, scenario.seed)
        known = self._unrounded
        if known is None or known[0] is not base:
            known = self._unrounded = base, base.block.increments(scenario.imu.rate_hz)
        increments = known[1]
        dvel = increments.dvel - trajectory.felt(increments.time, increments.dtheta)
        ideal = digital(ImuData(increments.time, increments.dtheta, dvel))
        return Truth.along(trajectory, trajectory, base.rate_hz, ideal, base.state)


def has_remainder(scenario: Scenario) -> bool:
    """Return whether a scenario's gravity has a part that is drawn in each run."""
    return scenario.gravity is not None and scenario.gravity.remainder is not None


def _truth(scenario: Scenario) -> Truth:
    from sinssim.scenario.true_motion import true_motion

    if is_guided(scenario):
        path, guided = closed_loop(scenario)
        return truth_along(path, scenario, guided)
    return truth_along(true_motion(scenario), scenario)


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
"""Runs in a file, if each has a filter or a program, and takes as long as tens of others."""
_FLOWN_CHUNK = 2
"""Runs in a file, if each is flown by itself, for ten seconds and more: so few that all cores end together."""
WITHOUT_EFFECT = ("name", "description", "views", "output", "recording")
"""Keys of a scenario that do not change a number of its runs."""


def contents_of(scenario: Scenario, *without: str) -> dict[str, Any]:
    """Return the keys of a scenario on which numbers depend, by key, some left out, with the digests of own content."""
    contents = scenario.contents(without=(*WITHOUT_EFFECT, "use", *without))
    return contents | ({"own_content": files} if (files := own_digests(scenario)) else {})


@short_repr
@dataclass(frozen=True)
class Plan:
    """What the runs of an ensemble have in common.

    Attributes:
        scenario: the scenario, with its seed.
        solution: the solution whose errors are kept: an attitude algorithm, "aided", or one of another name.
        epochs: instants at which errors are kept, (K,) s.
        start: start of the run, s.
        chunk: runs in a file.
        blocks: blocks of the filter's states, and the number of states of each; empty without a filter.
        sensors: aiding sensors whose innovations are kept; empty without a filter.
        flight: digest of the flight or of the track's file, "" for another motion.
        course: direction of the true ground velocity at the end of the run, rad; NaN at rest.
        extra: epochs that requirements add to the others, s; rates and means over the epochs leave them out.
        path: what is kept by the planned path of a flight.
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
    path: tuple[str, ...] = ()

    @property
    def filtered(self) -> bool:
        """Whether the errors of a filter's solution are kept."""
        return _by_filter(self.scenario, self.solution)

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys."""
        return tuple(variation.key for variation in self.scenario.ensemble.vary) if self.scenario.ensemble else ()

    @cached_property
    def regular(self) -> NDArray[np.bool_]:
        """Whether each epoch is one without any requirement, (K,)."""
        return np.asarray(~np.isin(self.epochs, self.extra))

    @property
    def contents(self) -> dict[str, Any]:
        """The keys of the scenario on which the numbers of a run depend, without seed and number of runs."""
        vary = [variation.model_dump() for variation in self.scenario.ensemble.vary] if self.scenario.ensemble else []
        return {
            **contents_of(self.scenario, "seed", "ensemble"),
            "ensemble": {"solution": self.solution, "vary": json.loads(json.dumps(vary))},
        }

    @cached_property
    def digest(self) -> str:
        """SHA-256 over everything that determines the stored numbers, except the versions of the software."""
        text = json.dumps(
            [self.contents, self.scenario.seed, self.epochs.tolist(), self.chunk, self.flight], sort_keys=True
        )
        return hashlib.sha256(text.encode()).hexdigest()


def _by_filter(scenario: Scenario, solution: str) -> bool:
    """Return whether a solution is that of a filter of the package, with states and a covariance."""
    return solution == AIDED or solution in {of.name for of in scenario.filters if of.kind in SHIPPED}


def make_plan(
    scenario: Scenario,
    truths: TruthCache | None = None,
    require: Iterable[Requirement] = (),
    stored: Iterable[float] | None = None,
    times: Iterable[float] = (),
) -> Plan:
    """Plan an ensemble; its flight is flown if it is not in the cache, and its true motion is put into `truths`.

    Times of requirements and further `times`, s, are epochs, too; but requirements of an ensemble that is continued add
    none to those that it has `stored`.
    """
    from sinssim.scenario.planned_limits import check_route, check_times

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
    by_filter = _by_filter(scenario, solution)
    scenario = with_first(scenario, solution) if by_filter else scenario
    check_programs(scenario)
    check_times(scenario)
    require = tuple(require)
    check_path(scenario, require)
    blocks = _blocks(scenario) if by_filter else {}
    check_route(scenario)
    truth = (truths or TruthCache()).of(scenario)
    sensors = _sensors(scenario, truth) if by_filter else ()
    wanted = [
        (requirement.time, f"requirement {requirement.text!r}") for requirement in require if requirement.when == "at"
    ]
    wanted += [(time, "times (times_s, --at)") for time in times]
    epochs, extra = _with_times(truth, _epochs(truth, section.epoch_s if section else None), wanted, stored)
    takes_long = solution not in scenario.navigation.algorithms  # a filter, or a program of somebody else
    chunk = runs_in_a_file(scenario, takes_long)
    north, east, _ = (float(v) for v in truth.state.velocity_ned[-1])
    course = math.atan2(east, north) if math.hypot(north, east) > _MOVES else math.nan
    return Plan(
        scenario, solution, epochs, float(truth.time[0]), chunk, blocks, sensors, flight_digest(scenario), course,
        extra, path_columns(scenario),
    )  # fmt: skip


def with_runs(plan: Plan, runs: int) -> Plan:
    """Return a plan whose scenario names another number of runs; nothing else changes."""
    from sinssim.scenario.ensemble_section import EnsembleSection

    section = plan.scenario.ensemble or EnsembleSection()
    section = section.model_copy(update={"runs": runs})
    return replace(plan, scenario=plan.scenario.model_copy(update={"ensemble": section}))


def runs_in_a_file(scenario: Scenario, takes_long: bool) -> int:
    """Return the number of runs that one task computes, and one file holds."""
    differ = motions_differ(scenario)
    if differ and scenario.flight is not None:
        return _FLOWN_CHUNK
    return LONG_CHUNK if takes_long or differ else _CHUNK


def motions_differ(scenario: Scenario) -> bool:
    """Return whether the runs of an ensemble differ in their true motions."""
    try:
        return len({truth_key(member(scenario, number).scenario) for number in (0, 1)}) > 1
    except InputError:  # a run that draws a value that is not allowed
        return True


def _blocks(scenario: Scenario) -> dict[str, int]:
    """Return the blocks of a filter's states, and the number of states of each."""
    from sinssim.scenario.filter_model import filter_model, with_states
    from sinssim.scenario.planned_limits import expected_duration
    from sinssim.scenario.run_memory import check_memory

    scenario = with_states(scenario)
    check_memory(scenario, recorded=False)
    model = filter_model(scenario, expected_duration(scenario))
    sizes = {name: len(matrix) for name, matrix in model.compared.items()}
    return {ALL: sum(sizes.values()), **sizes}


def _sensors(scenario: Scenario, truth: Truth) -> tuple[str, ...]:
    """Return the names of the measurements that a filter takes."""
    from sinssim.sensors.aiding_sensor import Vehicle
    from sinssim.simulation.aided_run import navigate_beside

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
    truth: Truth, epochs: Array, requested: Iterable[tuple[float, str]], stored: Iterable[float] | None
) -> tuple[Array, tuple[float, ...]]:
    """Return the epochs with times since the start, or those of an ensemble that is continued, and the new ones."""
    edges, start = truth.time, float(truth.time[0])
    wanted = [] if stored is None else [t for t in stored if np.isin(t, edges)]
    lasts = float(edges[-1]) - start
    for time, who in requested:
        if not 0.0 <= time <= lasts + 1e-6:
            raise InputError(f"{who}: {time:g} s lies outside the run, which lasts {lasts:g} s.")
        row = int(np.argmin(np.abs(edges - start - time)))
        if abs(float(edges[row]) - start - time) > WITHIN:
            raise InputError(
                f"{who}: {time:g} s is between two samples of the run, which are {float(edges[1]) - start:g} s apart; "
                f"the nearest one is at {float(edges[row]) - start:.10g} s."
            )
        if stored is None:
            wanted.append(float(edges[row]))
    extra = tuple(sorted({t for t in wanted if not np.isin(t, epochs)}))
    return np.unique(np.append(epochs, extra)), extra


def flight_digest(scenario: Scenario) -> str:
    """Return the digest of a scenario's flight or of the file of its track, "" for another motion."""
    if scenario.track is not None:
        return scenario.track.digest()
    if scenario.flight is None:
        return ""
    from sinssim.truth.flight.flight_cache import flight_key

    return flight_key(scenario.flight, scenario.seed)
