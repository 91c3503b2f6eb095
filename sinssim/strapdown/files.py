"""Loads the file of an attitude algorithm or of a navigation frame, and checks it against its protocol.

If a chosen file is missing, cannot be imported or lacks a function, the error gives its path and the reason. Other
algorithms and frames are not affected.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType, SimpleNamespace
from typing import Any, Protocol, cast

from sinssim.algorithms import REGISTRY
from sinssim.data import Array
from sinssim.errors import InputError, RunError
from sinssim.frames import FRAME_REGISTRY
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.increments.interval import BodyTurn, FrameTurn
from sinssim.strapdown.own_algorithm import check_parts
from sinssim.system.own_content.layout import Item
from sinssim.system.own_content.modules import explained, load_module
from sinssim.system.own_content.registry import on_change, registered


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
    """An algorithm that computes its own `BodyTurn` instead of using `increments.interval.fitted_turn_k`."""

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
    """The function in the file of a frame's three-rate schedule."""

    def solve(
        self, problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
    ) -> None:
        """Fill the rows of the solution after the first, which are the slow instants.

        The increments of the problem are those of the fast part, and the next two arguments are ratios of the rates.
        Results of the slow part are extrapolated or held.
        """


class OwnThreeRateFile(Protocol):
    """The function in the file of a frame outside the package, if it has a three-rate schedule."""

    def solve_three_rates(
        self, problem: Problem, frame: str, fast_per_medium: int, medium_per_slow: int, extrapolate: bool
    ) -> None:
        """As `ThreeRateFile.solve`."""


@cache
def algorithm_file(algorithm: str) -> AttitudeFile | EngineFile:
    """Return the file of an attitude algorithm.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Raises:
        InputError: the file is missing, invalid or incomplete, or the registry has the name twice; the message gives
            the path and the reason.
    """
    entry = REGISTRY[algorithm]
    if entry.problem:
        raise InputError(f"the algorithm {algorithm} cannot be used: {entry.problem}")
    if entry.path:
        module, path = _own("algorithms", algorithm), entry.path
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
    """Return the file of a navigation frame.

    Args:
        frame: one of `sinssim.FRAMES`.

    Raises:
        InputError: the file is missing, invalid or incomplete; the message gives the path and the reason.
    """
    entry = FRAME_REGISTRY[frame]
    if entry.path:
        module, path = _own("frames", frame), entry.path
    else:
        module, path = _loaded(f"frame {frame}", f"sinssim.strapdown.frames.{entry.file}")
    _check(f"frame {frame}", module, path, FrameFile, compiled=False)
    if entry.path:
        item = _item("frames", frame)
        functions = {name: explained(item, getattr(module, name), RunError) for name in ("solve", "check")}
        return cast(FrameFile, SimpleNamespace(**functions))
    return cast(FrameFile, module)


@cache
def three_rate_file(frame: str) -> ThreeRateFile:
    """Return the file of a frame's three-rate schedule.

    Args:
        frame: one of `sinssim.FRAMES` with `has_three_rates`.

    Raises:
        InputError: the file is missing, invalid or incomplete; the message gives the path and the reason.
    """
    what = f"three-rate schedule of the frame {frame}"
    if path := FRAME_REGISTRY[frame].path:
        own = _own("frames", frame)
        _check(what, own, path, OwnThreeRateFile, compiled=False)
        solve = explained(_item("frames", frame), own.solve_three_rates, RunError)
        return cast(ThreeRateFile, SimpleNamespace(solve=solve))
    module, path = _loaded(what, f"sinssim.strapdown.three_rate.{FRAME_REGISTRY[frame].file}")
    _check(what, module, path, ThreeRateFile, compiled=False)
    return cast(ThreeRateFile, module)


def check_own_files(algorithms: Iterable[str], frame: str) -> None:
    """Raise for a file outside the package that cannot be used, before anything is computed.

    Raises:
        InputError: as for `algorithm_file`, `frame_file` and `three_rate_file`.
    """
    for name in algorithms:
        if name in REGISTRY and REGISTRY[name].path:
            algorithm_file(name)
    if FRAME_REGISTRY[frame].path:
        frame_file(frame)
        if FRAME_REGISTRY[frame].has_three_rates:
            three_rate_file(frame)


def _own(kind: str, name: str) -> ModuleType:
    """Run the file of an algorithm or a frame outside the package and return its module."""
    return load_module(_item(kind, name))


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
                own = [parameter.name for parameter in parameters if parameter.default is parameter.empty]
                if len(own) != len(arguments):
                    wrong.append(f"{name} takes ({', '.join(own)}), but must take ({', '.join(arguments)})")
    if wrong:
        raise InputError(f"the {what} cannot be used: {path}: {'; '.join(wrong)}.")


on_change += [algorithm_file.cache_clear, frame_file.cache_clear, three_rate_file.cache_clear]
