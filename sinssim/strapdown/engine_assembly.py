"""Engines from the template of a frame and the parts of an attitude algorithm; loading and checks of their files.

If a chosen file is missing, cannot be imported or lacks a function, the error gives its path and the reason. Other
algorithms and frames are not affected. An algorithm outside the package is checked before it navigates, and its
failures are explained. `AttitudeFile` gives the contents of an algorithm's file. `fill_turns` computes the turns of a
block of intervals (see `sinssim.strapdown.coning_sculling`), from the file's own `turn_k` or `fitted_turn_k`.
"""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Protocol, cast

from numba.core.errors import NumbaError

from sinssim.data import Array
from sinssim.errors import InputError, RunError, SinssimError, shortened
from sinssim.jit import bind, rebound
from sinssim.rotation.quaternions import dcm_from_quaternion_k
from sinssim.strapdown import coning_sculling
from sinssim.strapdown import coning_sculling as turns
from sinssim.strapdown.attitude import REGISTRY
from sinssim.strapdown.coning_sculling import BodyTurn, FrameTurn
from sinssim.strapdown.frames import FRAME_REGISTRY
from sinssim.strapdown.frames.navigation_problem import Problem
from sinssim.system.extensions import Item, explained, failure, load_module
from sinssim.system.registries import on_change, registered

_QUATERNION = (0.8, 0.2, -0.4, 0.4)
"""A unit quaternion whose matrix and angles are all different."""

_SAME = 1e-6
"""Tolerance of the attitude that the variables stand for; a wrong convention is wrong by about 1."""


def compile_words(path: str, error: Exception) -> str:
    """Return numba's error as words, "/my/midpoint.py, line 21: Undecided type …": file, line and reason."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    lines = re.findall(rf'File "[^"]*{re.escape(Path(path).name)}", line (\d+)', text)
    where = f", line {lines[-1]}" if lines else ""
    skipped = ("Failed in nopython", "During:", "File ", "There are", "- Of which", "Overload", "<source", "^")
    reasons = [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith(skipped)]
    reason = " ".join(reasons[: 2 if reasons[:1] and reasons[0].endswith(":") else 1]).rstrip(".")
    return f"{path}{where}: {shortened(reason, 300) or type(error).__name__}"


def _failed(algorithm: str, path: str, error: Exception) -> InputError:
    words = compile_words(path, error) if isinstance(error, NumbaError) else failure(Path(path), error)
    what = "cannot be compiled" if isinstance(error, NumbaError) else "failed"
    return InputError(f"the algorithm {algorithm} {what}: {words}.")


def guarded(algorithm: str, engine: Callable[..., None]) -> Callable[..., None]:
    """Return an engine whose failures are explained with the file of the algorithm in it."""

    @functools.wraps(engine)
    def call(*arguments: Any) -> None:
        try:
            engine(*arguments)
        except SinssimError:
            raise
        except NumbaError as error:
            raise _failed(algorithm, REGISTRY[algorithm].path, error) from error
        except Exception as error:  # raised by the user's functions
            reason = f"{type(error).__name__}: {error}".rstrip(": .")
            raise RunError(
                f"the algorithm {algorithm} ({REGISTRY[algorithm].path}) failed while it navigated: {reason}."
            ) from error

    return call


def check_parts(algorithm: str, path: str, file: ModuleType) -> None:
    """Raise if the functions of an algorithm do not fit each other, or do not mean what the engines take them for."""

    def call(name: str, *arguments: Any) -> Any:
        try:
            return getattr(file, name)(*arguments)
        except Exception as error:  # of the compiler, or raised by the function
            raise _failed(algorithm, path, error) from error

    def wrong(what: str) -> InputError:
        return InputError(f"the algorithm {algorithm} cannot be used: {path}: {what}.")

    def numbers(name: str, value: Any, count: int) -> tuple[float, ...]:
        values = value if isinstance(value, tuple) else (value,)
        if len(values) != count or not all(isinstance(number, int | float) for number in values):
            raise wrong(f"{name} must return a tuple of {count} numbers, and returns {_words(value)}")
        if not all(map(math.isfinite, values)):
            raise wrong(f"{name} returns {_words(value)} for the quaternion {_QUATERNION}: a number is not finite")
        return tuple(map(float, values))

    attitude = call("start_k", *_QUATERNION)
    if not isinstance(attitude, tuple):
        raise wrong(f"start_k must return a tuple of numbers, the attitude variables, and returns {_words(attitude)}")
    matrix = numbers("dcm_k", call("dcm_k", attitude), 9)
    quaternion = numbers("quaternion_k", call("quaternion_k", attitude), 5)[:4]
    true = dcm_from_quaternion_k(*_QUATERNION)
    if max(abs(a - b) for a, b in zip(matrix, true, strict=True)) > _SAME:
        swapped = [matrix[3 * (i % 3) + i // 3] for i in range(9)]
        hint = "; it is the transpose" if max(abs(a - b) for a, b in zip(swapped, true, strict=True)) <= _SAME else ""
        raise wrong(
            f"dcm_k(start_k(q)) is not the matrix C_nb of the unit quaternion q = {_QUATERNION}{hint}. C_nb takes body "
            "coordinates into navigation coordinates, row by row; q has its scalar first"
        )
    sign = math.copysign(1.0, sum(a * b for a, b in zip(quaternion, _QUATERNION, strict=True)))
    if max(abs(sign * a - b) for a, b in zip(quaternion, _QUATERNION, strict=True)) > _SAME:
        raise wrong(f"quaternion_k(start_k(q)) is {_words(quaternion)} and not q = {_QUATERNION}, scalar first")
    later = call("step_k", attitude, BodyTurn(*(0.0,) * len(BodyTurn._fields)), FrameTurn(*(0.0,) * 12))
    if not isinstance(later, tuple) or [type(a) for a in later] != [type(a) for a in attitude]:
        raise wrong(f"step_k must return what start_k returns, {_words(attitude)}, and returns {_words(later)}")
    kept = numbers("quaternion_k", call("quaternion_k", later), 5)[:4]
    if abs(abs(sum(a * b for a, b in zip(kept, _QUATERNION, strict=True))) - 1.0) > _SAME:
        raise wrong(f"step_k without rotation changes the quaternion {_QUATERNION} to {_words(kept)}")


def _words(value: Any) -> str:
    """Return a value for a message."""
    if isinstance(value, tuple):
        return shortened(f"({', '.join(f'{x:.4g}' if isinstance(x, float) else str(x) for x in value)})", 120)
    return shortened(f"{value} ({type(value).__name__})", 120)


class AttitudeFile(Protocol):
    """Functions in the file of an attitude algorithm, all compiled by `sinssim.jit.inline`.

    The attitude variables are a tuple of numbers that the file chooses.
    """

    def start_k(self, q0: float, q1: float, q2: float, q3: float) -> Any:
        """The variables of a unit quaternion q_nb."""

    def dcm_k(self, attitude: Any) -> tuple[float, ...]:
        """The matrix C_nb that resolves forces, row by row: nine numbers."""

    def step_k(self, attitude: Any, body: BodyTurn, frame: FrameTurn) -> Any:
        """The variables one interval later."""

    def quaternion_k(self, attitude: Any) -> tuple[float, float, float, float, float]:
        """The unit quaternion q_nb, and the defect of norm or orthogonality of the variables."""


class OwnTurnFile(AttitudeFile, Protocol):
    """An algorithm that computes its own `BodyTurn` instead of using `coning_sculling.fitted_turn_k`."""

    def turn_k(self, dtheta: Array, dvel: Array, weights: Array, uniform: bool, k: int) -> BodyTurn:
        """The body's turn over interval k."""


class EngineFile(Protocol):
    """The file of an algorithm with its own engine instead of parts for the engines."""

    def engine(self, frame: str) -> Callable[[Problem, str], None]:
        """The function that solves a problem in a frame; raises `InputError` for an unknown frame."""


class FrameFile(Protocol):
    """Functions in the file of a navigation frame."""

    def solve(self, problem: Problem, frame: str) -> None:
        """Fill the rows of the solution after the first; `frame` is the name in the registry."""

    def check(self, problem: Problem, frame: str) -> None:
        """Raise `RunError` if the solution left the region in which the frame can be used."""


class ThreeRateFile(Protocol):
    """The function in the file of a frame with a three-rate schedule."""

    def solve_three_rates(
        self, problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
    ) -> None:
        """Fill the rows of the solution after the first, which are the slow instants.

        The increments of the problem are those of the fast part, and the next two arguments are ratios of the rates.
        Results of the slow part are extrapolated or held.
        """


@cache
def algorithm_file(algorithm: str) -> AttitudeFile | EngineFile:
    """Return the file of an attitude algorithm, one of `sinssim.ALGORITHMS`."""
    entry = REGISTRY[algorithm]
    if entry.problem:
        raise InputError(f"the algorithm {algorithm} cannot be used: {entry.problem}")
    if entry.path:
        module, path = load_module(_item("algorithms", algorithm)), entry.path
    else:
        module, path = _loaded(f"algorithm {algorithm}", f"sinssim.strapdown.{entry.module}")
    if entry.windowed:
        _check(f"algorithm {algorithm}", module, path, EngineFile, compiled=False)
        return cast(EngineFile, module)
    protocol = OwnTurnFile if hasattr(module, "turn_k") else AttitudeFile
    _check(f"algorithm {algorithm}", module, path, protocol, compiled=True)
    unknown = [name for name in entry.variant if not hasattr(module, name)]
    if unknown:
        raise InputError(
            f"the algorithm {algorithm} cannot be used: its variant sets {', '.join(unknown)}, which {path} does not "
            "define."
        )
    if entry.path:
        check_parts(algorithm, path, module)
    return cast(AttitudeFile, module)


@cache
def frame_file(frame: str) -> FrameFile:
    """Return the file of a navigation frame, one of `sinssim.FRAMES`."""
    return cast(FrameFile, _frame_functions(f"frame {frame}", frame, FrameFile, "solve", "check"))


@cache
def three_rate_file(frame: str) -> ThreeRateFile:
    """Return the file of a frame with `has_three_rates`; raises as `frame_file`."""
    what = f"three-rate schedule of the frame {frame}"
    return cast(ThreeRateFile, _frame_functions(what, frame, ThreeRateFile, "solve_three_rates"))


def _frame_functions(what: str, frame: str, protocol: type, *names: str) -> Any:
    """Return functions of a frame's file; the errors of one outside the package name its file."""
    entry = FRAME_REGISTRY[frame]
    if not entry.path:
        module, path = _loaded(what, f"sinssim.strapdown.frames.{entry.file}")
        _check(what, module, path, protocol, compiled=False)
        return module
    item = _item("frames", frame)
    module = load_module(item)
    _check(what, module, entry.path, protocol, compiled=False)
    return SimpleNamespace(**{name: explained(item, getattr(module, name), RunError) for name in names})


def check_own_files(algorithms: Iterable[str], frame: str) -> None:
    """Raise for a file outside the package that cannot be used, before anything is computed."""
    for name in algorithms:
        if name in REGISTRY and REGISTRY[name].path:
            algorithm_file(name)
    if FRAME_REGISTRY[frame].path:
        frame_file(frame)
        if FRAME_REGISTRY[frame].has_three_rates:
            three_rate_file(frame)


def _item(kind: str, name: str) -> Item:
    """Return the algorithm or the frame outside the package of a name."""
    item = registered(kind, name)
    assert item is not None
    return item


def _loaded(what: str, name: str) -> tuple[ModuleType, str]:
    """Import a module and return it with its path."""
    try:
        spec = find_spec(name)
    except ImportError:
        spec = None
    if spec is None or spec.origin is None:
        raise InputError(f"the {what} cannot be used: there is no {name.replace('.', '/')}.py.")
    try:
        return import_module(name), spec.origin
    except Exception as error:  # any error of the file
        raise InputError(f"the {what} cannot be used: {spec.origin}: {type(error).__name__}: {error}.") from error


def _check(what: str, module: ModuleType, path: str, protocol: type, *, compiled: bool) -> None:
    """Raise if a module lacks a function of a protocol, or a function has other arguments or is not compiled."""
    wrong = []
    for base in reversed(protocol.__mro__):
        for name, wanted in vars(base).items():
            if name.startswith("_") or not inspect.isfunction(wanted):
                continue
            arguments = list(inspect.signature(wanted).parameters)[1:]  # without self
            there = getattr(module, name, None)
            if there is None:
                wrong.append(f"there is no function {name}({', '.join(arguments)})")
            elif compiled and not hasattr(there, "py_func"):
                wrong.append(f"{name} is not compiled: it needs the decorator `inline` of sinssim.jit")
            else:
                parameters = inspect.signature(getattr(there, "py_func", there)).parameters.values()
                required_names = [parameter.name for parameter in parameters if parameter.default is parameter.empty]
                if len(required_names) != len(arguments):
                    wrong.append(f"{name} takes ({', '.join(required_names)}), but must take ({', '.join(arguments)})")
    if wrong:
        raise InputError(f"the {what} cannot be used: {path}: {'; '.join(wrong)}.")


on_change += [algorithm_file.cache_clear, frame_file.cache_clear, three_rate_file.cache_clear]


_NAMES = ("start_k", "dcm_k", "step_k", "quaternion_k", "turn_k")


@cache
def parts(algorithm: str) -> dict[str, Callable[..., Any]]:
    """Return an algorithm's functions by their names in the engines: the five functions, and `fill_turns`."""
    entry, file = REGISTRY[algorithm], algorithm_file(algorithm)
    functions = {name: getattr(file, name, None) or coning_sculling.fitted_turn_k for name in _NAMES}
    suffix = algorithm.replace("-", "_")
    if entry.variant:
        functions = {name: rebound(part, f"{name}_{suffix}", **entry.variant) for name, part in functions.items()}
    if hasattr(file, "turn_k"):
        functions["fill_turns"] = bind(turns.fill_single_turns, f"fill_{suffix}", turn_k=functions["turn_k"])
    else:
        functions["fill_turns"] = turns.fill_fitted_turns
    return functions


def own_engine(algorithm: str, frame: str) -> Callable[[Problem, str], None] | None:
    """Return the engine of an algorithm whose file has a complete one; None for an algorithm that consists of parts."""
    file = algorithm_file(algorithm)
    return file.engine(frame) if hasattr(file, "engine") else None


def engines(
    template: Callable[..., None], frame: str, forms: Mapping[str, Mapping[str, Any]] | None = None
) -> Callable[..., Callable[..., None]]:
    """Return a function that makes and caches a frame's engines, by algorithm and form.

    `template` is the frame's engine as a plain function over the parts' names; `frame` becomes part of the names of its
    engines; `forms` are values in place of the template's own by form ("" for its own). An engine fills the arrays of
    the solution, whose first rows hold the initial state.
    """

    @cache
    def engine(algorithm: str, form: str = "") -> Callable[..., None]:
        name = "_".join((frame, algorithm, *([form] if form else []))).replace("-", "_")
        made = bind(template, name, **parts(algorithm), **(forms or {}).get(form, {}))
        return guarded(algorithm, made) if REGISTRY[algorithm].path else made

    on_change.append(engine.cache_clear)
    return engine


on_change.append(parts.cache_clear)
