"""Checks an attitude algorithm outside the package before it navigates, and explains its failures."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from numba.core.errors import NumbaError

from sinssim.algorithms import REGISTRY
from sinssim.errors import InputError, RunError, SinssimError, shortened
from sinssim.rotation.kernels import dcm_from_quaternion_k
from sinssim.strapdown.increments.interval import BodyTurn, FrameTurn
from sinssim.system.own_content.modules import failure

_QUATERNION = (0.8, 0.2, -0.4, 0.4)
"""A unit quaternion whose matrix and angles are all different."""

_SAME = 1e-6
"""Tolerance of the attitude that the variables stand for; a wrong convention is wrong by about 1."""


def compile_words(path: str, error: Exception) -> str:
    """Return an error of the compiler as words: the file with its line, and the first reason.

    Args:
        path: the algorithm's file.
        error: numba's error.

    Returns:
        For example "/my/midpoint.py, line 21: Undecided type …".
    """
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    lines = re.findall(rf'File "[^"]*{re.escape(Path(path).name)}", line (\d+)', text)
    where = f", line {lines[-1]}" if lines else ""
    skipped = ("Failed in nopython", "During:", "File ", "There are", "- Of which", "Overload", "<source", "^")
    reasons = [one.strip() for one in text.splitlines() if one.strip() and not one.strip().startswith(skipped)]
    said = " ".join(reasons[: 2 if reasons[:1] and reasons[0].endswith(":") else 1]).rstrip(".")
    return f"{path}{where}: {shortened(said, 300) or type(error).__name__}"


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
            said = f"{type(error).__name__}: {error}".rstrip(": .")
            raise RunError(
                f"the algorithm {algorithm} ({REGISTRY[algorithm].path}) failed while it navigated: {said}."
            ) from error

    return call


def check_parts(algorithm: str, path: str, file: ModuleType) -> None:
    """Raise if the functions of an algorithm do not fit each other, or do not mean what the engines take them for.

    Raises:
        InputError: a function cannot be compiled, fails, or returns something else; the message has the file.
    """

    def call(name: str, *arguments: Any) -> Any:
        try:
            return getattr(file, name)(*arguments)
        except Exception as error:  # of the compiler, or raised by the function
            raise _failed(algorithm, path, error) from error

    def wrong(what: str) -> InputError:
        return InputError(f"the algorithm {algorithm} cannot be used: {path}: {what}.")

    def numbers(name: str, value: Any, count: int) -> tuple[float, ...]:
        found = value if isinstance(value, tuple) else (value,)
        if len(found) != count or not all(isinstance(one, int | float) for one in found):
            raise wrong(f"{name} must return a tuple of {count} numbers, and returns {_words(value)}")
        if not all(map(math.isfinite, found)):
            raise wrong(f"{name} returns {_words(value)} for the quaternion {_QUATERNION}: a number is not finite")
        return tuple(map(float, found))

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
