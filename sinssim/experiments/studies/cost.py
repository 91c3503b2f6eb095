"""The cost of a whole navigation step, at one rate or by a schedule: operations counted, processor time measured."""

from __future__ import annotations

import math
import time
import types
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.algorithms import schedule, three_rates
from sinssim.experiments.studies.operations import Operations, count

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution, NavState

_DATA_HZ = 100.0
_TIMED_SAMPLES = 24_000
_REPETITIONS = 9
_COUNTED_SAMPLES = 240
_OUTPUT = ("quaternion_k",)
"""Functions that an engine calls only for a row of the solution: unit quaternion and defect. Navigation does not need
them. From a matrix they take fifty operations, which exceeds the difference of some algorithms."""


@dataclass(frozen=True)
class Cost:
    """Cost of one algorithm in one frame, per sample; for a schedule per step of its fast part.

    Attributes:
        algorithm, frame: of what.
        ns_per_step: processor time of one sample's step on one core, ns: `navigate` as a whole, checks included,
            minimum of several calls.
        operations: floating-point operations of the step, without those for the row of the solution.
        schedule_hz: rates of the schedule, Hz; empty if everything runs at the sample rate.
    """

    algorithm: str
    frame: str
    ns_per_step: float
    operations: Operations
    schedule_hz: tuple[float, ...] = ()

    @property
    def pace(self) -> str:
        """The rates of the schedule as text, "every sample" without one."""
        return "/".join(f"{rate:g}" for rate in self.schedule_hz) or "every sample"


@cache
def _data(samples: int) -> tuple[ImuData, NavState]:
    """Return the increments of a spinning and coning body at 45° of latitude, sampled at 100 Hz."""
    from sinssim.truth.motions.analytic import OnEarth
    from sinssim.truth.motions.coning import SpinCone

    motion = SpinCone(10.0 * units.DEG, 0.3, 0.1)
    trajectory = OnEarth(motion, 45.0 * units.DEG, 0.0, 1000.0, (1.0, 0.0, 0.0, 0.0), (samples + 0.5) / _DATA_HZ)
    return trajectory.increments(_DATA_HZ), trajectory.state(trajectory.start)


def timed_data() -> tuple[ImuData, NavState]:
    """Return the increments and the initial state on which time is measured."""
    return _data(_TIMED_SAMPLES)


def _whole_rows(ratios: tuple[int, ...]) -> int:
    """Return a number of samples to count with that is whole in slow intervals."""
    per_row = math.prod(ratios)
    return per_row * math.ceil(_COUNTED_SAMPLES / per_row)


def measure_cost(algorithm: str, frame: str, schedule_hz: tuple[float, ...] = ()) -> Cost:
    """Count operations and measure time of one sample; a schedule has a fast, medium and slow rate, Hz."""
    ratios = _ratios(schedule_hz)
    time_ns, operations = measure_time(algorithm, frame, ratios=ratios), count_operations(algorithm, frame, ratios)
    return Cost(algorithm, frame, time_ns, operations, schedule_hz)


def _ratios(schedule_hz: tuple[float, ...]) -> tuple[int, ...]:
    """Return the ratios of the fast to the medium and of the medium to the slow rate; empty without a schedule."""
    if not schedule_hz:
        return ()
    fast, medium, slow = three_rates(schedule_hz)
    return schedule((fast, medium, slow), fast)[1:]


def _options(ratios: tuple[int, ...]) -> dict[str, Any]:
    """Return the options of `navigate` for a schedule with these ratios on samples of the timed data's rate.

    The cost of a step depends on the ratios, and not on holding or extrapolating, which are the same arithmetic.
    """
    if not ratios:
        return {}
    return {"rates_hz": (_DATA_HZ, _DATA_HZ / ratios[0], _DATA_HZ / (ratios[0] * ratios[1]))}


def measure_time(
    algorithm: str, frame: str, timed: Callable[[], float] = time.thread_time, ratios: tuple[int, ...] = ()
) -> float:
    """Measure the processor time of one sample's navigation step by a clock `timed`, s; return ns.

    A schedule has the `ratios` of its fast to its medium rate and of that to its slow one.
    """
    from sinssim.strapdown.navigate import navigate

    imu, initial = timed_data()
    options = _options(ratios)
    return least_time(lambda: navigate(imu, initial, algorithm=algorithm, frame=frame, **options), timed) / len(imu)


def least_time(call: Callable[[], Any], timed: Callable[[], float] = time.thread_time) -> float:
    """Return the least time of several calls, ns, by a clock `timed`, s; the first one loads the kernel."""
    least = np.inf
    for _ in range(_REPETITIONS + 1):
        begin = timed()
        call()
        least = min(least, timed() - begin)
    return float(least) * 1e9


@cache
def count_operations(algorithm: str, frame: str, ratios: tuple[int, ...] = ()) -> Operations:
    """Count the floating-point operations of one sample's navigation step; the result is cached."""
    return _counted(algorithm, frame, ratios)[0]


def _counted(algorithm: str, frame: str, ratios: tuple[int, ...] = ()) -> tuple[Operations, NavSolution]:
    """Navigate with counting engines; return the count and the solution, which equals that of the compiled engines."""
    from sinssim.strapdown.assemble import own_engine
    from sinssim.strapdown.files import frame_file, three_rate_file
    from sinssim.strapdown.navigate import navigate

    imu, initial = _data(_whole_rows(ratios))
    found: list[Operations] = []

    def counting(thing: Any) -> Any:
        """Return a counting replacement of a kernel, a module with an engine, or a function that calls kernels."""
        if hasattr(thing, "py_func"):

            def kernel(*arguments: Any) -> Any:
                operations, result = count(thing, arguments, len(imu), apart=_OUTPUT)
                found.append(operations)
                return result

            return kernel
        if thing is three_rate_file:
            return lambda name: types.SimpleNamespace(solve=counting(thing(name).solve))
        if thing is frame_file:
            return lambda name: types.SimpleNamespace(solve=counting(thing(name).solve), check=thing(name).check)
        strapdown = getattr(thing, "__module__", "").startswith("sinssim.strapdown")
        if thing is own_engine or (strapdown and hasattr(thing, "cache_info")):
            return lambda *choice: counting(thing(*choice))  # it returns a kernel or a function that calls one
        if isinstance(thing, types.FunctionType) and strapdown:
            names = {n: counting(g) if n in thing.__code__.co_names else g for n, g in thing.__globals__.items()}
            copy = types.FunctionType(thing.__code__, names, thing.__name__, thing.__defaults__, thing.__closure__)
            copy.__kwdefaults__ = thing.__kwdefaults__
            return copy
        return thing

    solution = counting(navigate)(imu, initial, algorithm=algorithm, frame=frame, **_options(ratios))
    sums = [sum(getattr(one, kind) for one in found) for kind in ("add", "multiply", "divide", "root", "function")]
    return Operations(*sums), solution
