"""The cost of a whole navigation step: operations counted, processor time measured."""

from __future__ import annotations

import time
import types
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sinssim import units
from sinssim.studies.operations import Operations, count

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution, NavState

_TIMED_SAMPLES = 24_000
_REPETITIONS = 9
_COUNTED_SAMPLES = 240
_OUTPUT = ("quaternion_k",)
"""Functions that an engine calls only for a row of the solution: unit quaternion and defect. Navigation does not need
them. From a matrix they take fifty operations, which exceeds the difference of some algorithms."""


@dataclass(frozen=True)
class Cost:
    """Cost of one algorithm in one frame, per sample.

    Attributes:
        algorithm, frame: of what.
        ns_per_step: processor time of one sample's step on one core, ns: `navigate` as a whole, checks included,
            minimum of several calls.
        operations: floating-point operations of the step, without those for the row of the solution.
    """

    algorithm: str
    frame: str
    ns_per_step: float
    operations: Operations


@cache
def _data(samples: int) -> tuple[ImuData, NavState]:
    """Return the increments of a spinning and coning body at 45° of latitude, sampled at 100 Hz."""
    from sinssim.truth.motions.analytic import OnEarth
    from sinssim.truth.motions.coning import SpinCone

    motion = SpinCone(10.0 * units.DEG, 0.3, 0.1)
    trajectory = OnEarth(motion, 45.0 * units.DEG, 0.0, 1000.0, (1.0, 0.0, 0.0, 0.0), (samples + 0.5) / 100.0)
    return trajectory.increments(100.0), trajectory.state(trajectory.start)


def measure_cost(algorithm: str, frame: str) -> Cost:
    """Count operations and measure time.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.

    Returns:
        The cost of one sample.
    """
    return Cost(algorithm, frame, measure_time(algorithm, frame), count_operations(algorithm, frame))


def measure_time(algorithm: str, frame: str, timed: Callable[[], float] = time.thread_time) -> float:
    """Measure the processor time of one sample's navigation step.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.
        timed: a clock, s.

    Returns:
        ns per sample.
    """
    from sinssim.strapdown.navigate import navigate

    imu, initial = _data(_TIMED_SAMPLES)
    least = np.inf
    for _ in range(_REPETITIONS + 1):  # the first call compiles, or loads the compiled kernel
        begin = timed()
        navigate(imu, initial, algorithm=algorithm, frame=frame)
        least = min(least, timed() - begin)
    return float(least) / len(imu) * 1e9


@cache
def count_operations(algorithm: str, frame: str) -> Operations:
    """Count the floating-point operations of one sample's navigation step; the result is cached.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.

    Returns:
        Mean number of operations per sample.
    """
    return _counted(algorithm, frame)[0]


def _counted(algorithm: str, frame: str) -> tuple[Operations, NavSolution]:
    """Navigate with counting engines; return the count and the solution, which equals that of the compiled engines."""
    from sinssim.strapdown.assemble import engines, own_engine
    from sinssim.strapdown.files import frame_file
    from sinssim.strapdown.navigate import navigate

    imu, initial = _data(_COUNTED_SAMPLES)
    found: list[Operations] = []

    def counting(thing: Any) -> Any:
        """Return a counting replacement of a kernel, a module with an engine, or a function that calls kernels."""
        if hasattr(thing, "py_func"):

            def kernel(*arguments: Any) -> Any:
                operations, result = count(thing, arguments, len(imu), apart=_OUTPUT)
                found.append(operations)
                return result

            return kernel
        if isinstance(thing, types.ModuleType) and hasattr(thing, "solve"):
            return types.SimpleNamespace(**{**vars(thing), "solve": counting(thing.solve)})
        if thing is own_engine or (
            getattr(thing, "__module__", "") == engines.__module__ and hasattr(thing, "cache_info")
        ):
            return lambda *choice: counting(thing(*choice))  # it returns a kernel or a function that calls one
        if thing is frame_file:
            return lambda name: types.SimpleNamespace(solve=counting(thing(name).solve), check=thing(name).check)
        if isinstance(thing, types.FunctionType) and thing.__module__.startswith("sinssim.strapdown"):
            names = {n: counting(g) if n in thing.__code__.co_names else g for n, g in thing.__globals__.items()}
            copy = types.FunctionType(thing.__code__, names, thing.__name__, thing.__defaults__, thing.__closure__)
            copy.__kwdefaults__ = thing.__kwdefaults__
            return copy
        return thing

    solution = counting(navigate)(imu, initial, algorithm=algorithm, frame=frame)
    sums = [sum(getattr(one, kind) for one in found) for kind in ("add", "multiply", "divide", "root", "function")]
    return Operations(*sums), solution
