"""The cost of a navigation step, at one rate or by a schedule.

Floating-point operations counted while it runs, processor time measured.

The engine's kernels are plain Python functions that numba compiles. To count, the same functions run uncompiled, on
numbers that count their operations. The count is therefore that of the operations as written, along the branches
actually taken, including the sines of every 128th step. The compiler may eliminate common or constant operations. A
division by a constant counts as a multiplication, to which it is compiled. Comparisons, negations and moves are not
counted.
"""

from __future__ import annotations

import builtins
import math
import operator
import time
import types
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sinssim import units
from sinssim.strapdown.attitude import schedule, three_rates

if TYPE_CHECKING:
    from sinssim.data import ImuData, NavSolution, NavState


KINDS = ("add", "multiply", "divide", "root", "function")

OF_FUNCTION = 24.0
"""Additions and multiplications of a sine to rounding, whose steps a test counts: a function is not one operation."""


@dataclass(frozen=True)
class Operations:
    """Mean number of operations per sample; `add` has subtractions, too, `function` all but square roots."""

    add: float
    multiply: float
    divide: float
    root: float
    function: float

    @property
    def total(self) -> float:
        """The sum; a function counts as the `OF_FUNCTION` operations of which it consists."""
        return self.add + self.multiply + self.divide + self.root + OF_FUNCTION * self.function


class _Number:
    """A float that counts the operations it takes part in, and remembers how it was made if `tracing`."""

    __slots__ = ("kind", "made_of", "times", "value")
    tally: ClassVar[Counter[str]] = Counter()
    tracing: ClassVar[bool] = False

    def __init__(self, value: float, kind: str = "", made_of: tuple[Any, ...] = (), times: int = 1) -> None:
        self.value = value
        self.kind, self.times = kind, times
        self.made_of = made_of if _Number.tracing else ()
        if kind:
            _Number.tally[kind] += times

    def __float__(self) -> float:
        return self.value

    def __neg__(self) -> _Number:
        return _Number(-self.value, "", (self,))

    def __pos__(self) -> _Number:
        return self

    def __abs__(self) -> _Number:
        return _Number(abs(self.value), "", (self,))

    def __bool__(self) -> bool:
        return bool(self.value)

    def __pow__(self, power: int) -> _Number:
        return _Number(self.value**power, "multiply", (self,), power - 1)


def _value(number: Any) -> float:
    return number.value if type(number) is _Number else number


def _counting(kind: str, operation: Callable[[float, float], float]) -> Any:
    def method(left: _Number, right: Any) -> _Number:
        # x / 12.0 is compiled to a multiplication
        made = "multiply" if kind == "divide" and type(right) is not _Number else kind
        return _Number(operation(left.value, _value(right)), made, (left, right))

    return method


def _reflected(kind: str, operation: Callable[[float, float], float]) -> Any:
    def method(right: _Number, left: Any) -> _Number:
        return _Number(operation(left, right.value), kind, (right,))

    return method


def _comparing(operation: Callable[[float, float], bool]) -> Any:
    return lambda left, right: operation(left.value, _value(right))


def _complete() -> None:
    for name, kind in (("add", "add"), ("sub", "add"), ("mul", "multiply"), ("truediv", "divide"), ("mod", "divide")):
        setattr(_Number, f"__{name}__", _counting(kind, getattr(operator, name)))
        setattr(_Number, f"__r{name}__", _reflected(kind, getattr(operator, name)))
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        setattr(_Number, f"__{name}__", _comparing(getattr(operator, name)))


_complete()


def _function(kind: str, plain: Callable[..., float]) -> Callable[..., Any]:
    def counted(*arguments: Any) -> Any:
        if not any(type(a) is _Number for a in arguments):
            return plain(*arguments)
        return _Number(plain(*map(_value, arguments)), kind, arguments)

    return counted


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    **{getattr(math, n): _function("function", getattr(math, n)) for n in ("sin", "cos", "tan", "asin", "acos")},
    **{getattr(math, n): _function("function", getattr(math, n)) for n in ("atan", "atan2", "exp", "log", "hypot")},
    math.sqrt: _function("root", math.sqrt),
    math.copysign: lambda x, y: _Number(math.copysign(_value(x), _value(y)), "", (x, y)),
    math.floor: lambda x: math.floor(_value(x)),
    builtins.round: lambda x: round(_value(x)),
    builtins.float: lambda x: x,
    builtins.int: lambda x: int(_value(x)),
}


class _CountingNumpy:
    """The few functions of numpy that a kernel may use."""

    def __getattr__(self, name: str) -> Any:
        if name in ("empty", "zeros"):
            return lambda shape, *_: np.full(shape, 0.0, dtype=object)
        plain = getattr(np, name)
        counted = getattr(math, {"arctan2": "atan2", "arcsin": "asin", "arccos": "acos"}.get(name, name), None)
        return _FUNCTIONS.get(counted, plain)


def uncompiled(function: Any, _made: dict[int, Any] | None = None) -> Any:
    """Return the plain Python function of a kernel, and of all kernels that it calls, for counting numbers."""
    made = {} if _made is None else _made
    plain = getattr(function, "py_func", function)
    if id(plain) in made:
        return made[id(plain)]
    names: dict[str, Any] = {"float": _FUNCTIONS[float], "int": _FUNCTIONS[int], "round": _FUNCTIONS[round]}
    copy = types.FunctionType(plain.__code__, names, plain.__name__, plain.__defaults__, plain.__closure__)
    made[id(plain)] = copy
    for name, thing in plain.__globals__.items():
        if name in plain.__code__.co_names:
            names[name] = _replaced(thing, made)
    names["__builtins__"] = builtins
    return copy


def _replaced(thing: Any, made: dict[int, Any]) -> Any:
    if hasattr(thing, "py_func"):
        return uncompiled(thing, made)
    if thing is np:
        return _CountingNumpy()
    if thing is math:
        return types.SimpleNamespace(**{n: _FUNCTIONS.get(f, f) for n, f in vars(math).items() if n[0] != "_"})
    try:
        return _FUNCTIONS.get(thing, thing)
    except TypeError:  # not hashable, therefore not a function
        return thing


def _uncounted(function: Callable[..., Any]) -> Callable[..., Any]:
    def quiet(*arguments: Any) -> Any:
        before, _Number.tally = _Number.tally, Counter()
        try:
            return function(*arguments)
        finally:
            _Number.tally = before

    return quiet


def _needed(results: Iterable[Any]) -> Counter[str]:
    """Return the operations on which numbers depend, each once, by kind."""
    tally: Counter[str] = Counter()
    seen: set[int] = set()
    open_ = [number for number in results if type(number) is _Number]
    while open_:
        number = open_.pop()
        if id(number) not in seen:
            seen.add(id(number))
            if number.kind:
                tally[number.kind] += number.times
            open_ += [part for part in number.made_of if type(part) is _Number]
    return tally


def count(
    kernel: Any, arguments: tuple[Any, ...], samples: int, apart: tuple[str, ...] = (), needed: bool = False
) -> tuple[Operations, Any]:
    """Run a kernel uncompiled; return its operations per sample, and its value.

    Float arrays among the arguments receive its results as from the compiled kernel. Calls of the functions whose names
    are `apart` are not counted. With `needed`, only those operations count on which the arrays depend in the end; the
    compiler drops the others.
    """
    arrays: list[tuple[Any, Any]] = []

    def counting(argument: Any) -> Any:
        if isinstance(argument, tuple) and hasattr(argument, "_fields"):  # a structure of arrays
            return type(argument)(*map(counting, argument))
        if not (isinstance(argument, np.ndarray) and argument.dtype == np.float64):
            return argument
        numbers = np.empty(argument.shape, dtype=object)
        numbers.ravel()[:] = [_Number(float(x)) for x in argument.ravel()]
        arrays.append((argument, numbers))
        return numbers

    counted = [counting(argument) for argument in arguments]
    _Number.tally = Counter()
    plain = uncompiled(kernel)
    for name in apart:
        if name in plain.__globals__:
            plain.__globals__[name] = _uncounted(plain.__globals__[name])
    _Number.tracing = needed
    try:
        result = plain(*counted)
    finally:
        _Number.tracing = False
    if needed:
        _Number.tally = _needed(number for _, numbers in arrays for number in numbers.ravel())
    for array, numbers in arrays:
        array[...] = np.array([_value(x) for x in numbers.ravel()], dtype=np.float64).reshape(array.shape)
    operations = Operations(**{kind: _Number.tally[kind] / samples for kind in KINDS})
    return operations, tuple(map(_value, result)) if isinstance(result, tuple) else _value(result)


DATA_HZ = 100.0
_TIMED_SAMPLES = 24_000
_REPETITIONS = 9
_COUNTED_SAMPLES = 240
_OUTPUT = ("quaternion_k",)
"""Functions that an engine calls only for a row of the solution: unit quaternion and defect. Navigation does not need
them. From a matrix they take fifty operations, which exceeds the difference of some algorithms."""


@dataclass(frozen=True)
class Cost:
    """Cost of one algorithm in one frame, per sample; for a schedule per step of its fast part.

    Time on one core, the minimum of several calls, is that of `navigate` with its checks. The operations are without
    those for the row of the solution.
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
    from sinssim.truth.motions.coning_and_rocking import SpinCone

    motion = SpinCone(10.0 * units.DEG, 0.3, 0.1)
    trajectory = OnEarth(motion, 45.0 * units.DEG, 0.0, 1000.0, (1.0, 0.0, 0.0, 0.0), (samples + 0.5) / DATA_HZ)
    return trajectory.increments(DATA_HZ), trajectory.state(trajectory.start)


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
    return {"rates_hz": (DATA_HZ, DATA_HZ / ratios[0], DATA_HZ / (ratios[0] * ratios[1]))}


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
    from sinssim.strapdown.engine_assembly import frame_file, own_engine, three_rate_file
    from sinssim.strapdown.navigate import navigate

    imu, initial = _data(_whole_rows(ratios))
    counts: list[Operations] = []

    def counting(thing: Any) -> Any:
        """Return a counting replacement of a kernel, a module with an engine, or a function that calls kernels."""
        if hasattr(thing, "py_func"):

            def kernel(*arguments: Any) -> Any:
                operations, result = count(thing, arguments, len(imu), apart=_OUTPUT)
                counts.append(operations)
                return result

            return kernel
        if thing is three_rate_file:
            return lambda name: types.SimpleNamespace(solve_three_rates=counting(thing(name).solve_three_rates))
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
    return Operations(*(sum(getattr(operations, kind) for operations in counts) for kind in KINDS)), solution
