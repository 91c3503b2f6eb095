"""Makes engines from the template of a frame and the parts of an attitude algorithm.

`sinssim.strapdown.files.AttitudeFile` gives the contents of an algorithm's file. `fill_turns` computes the turns of a
block of intervals (see `sinssim.strapdown.increments.block_turns`), from the file's own `turn_k` or the shared
`increments.interval.fitted_turn_k`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from sinssim.algorithms import REGISTRY
from sinssim.jit import bind, rebound
from sinssim.strapdown.files import algorithm_file
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.increments import block_turns as turns
from sinssim.strapdown.increments import interval
from sinssim.strapdown.own_algorithm import guarded
from sinssim.system.own_content.registry import on_change

_NAMES = ("start_k", "dcm_k", "step_k", "quaternion_k", "turn_k")


@cache
def parts(algorithm: str) -> dict[str, Callable[..., Any]]:
    """Return an algorithm's functions by their names in the engines.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        The five functions, and `fill_turns`.
    """
    entry, file = REGISTRY[algorithm], algorithm_file(algorithm)
    functions = {name: getattr(file, name, None) or interval.fitted_turn_k for name in _NAMES}
    suffix = algorithm.replace("-", "_")
    if entry.variant:
        functions = {name: rebound(part, f"{name}_{suffix}", **entry.variant) for name, part in functions.items()}
    if hasattr(file, "turn_k"):
        functions["fill_turns"] = bind(turns.fill_single_turns, f"fill_{suffix}", turn_k=functions["turn_k"])
    else:
        functions["fill_turns"] = turns.fill_fitted_turns
    return functions


def own_engine(algorithm: str, frame: str) -> Callable[[Problem, str], None] | None:
    """Return the engine of an algorithm whose file has a complete engine.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.

    Returns:
        The engine, a function of a problem and a frame; None for an algorithm that consists of parts.

    Raises:
        InputError: the algorithm's file cannot be used, or does not support this frame.
    """
    file = algorithm_file(algorithm)
    return file.engine(frame) if hasattr(file, "engine") else None


def engines(
    template: Callable[..., None], frame: str, forms: Mapping[str, Mapping[str, Any]] | None = None
) -> Callable[..., Callable[..., None]]:
    """Return a function that makes and caches a frame's engines.

    Args:
        template: the frame's engine as a plain function over the parts' names.
        frame: the frame's name in the names of its engines.
        forms: by the name of a form of the engine, values in place of the template's own.

    Returns:
        A function of an algorithm's name, one of `sinssim.ALGORITHMS`, and of a form's (by default "", the template's
        own values), that returns the compiled engine. The engine fills the arrays of the solution, whose first rows
        hold the initial state.
    """

    @cache
    def engine(algorithm: str, form: str = "") -> Callable[..., None]:
        name = "_".join((frame, algorithm, *([form] if form else []))).replace("-", "_")
        made = bind(template, name, **parts(algorithm), **(forms or {}).get(form, {}))
        return guarded(algorithm, made) if REGISTRY[algorithm].path else made

    on_change.append(engine.cache_clear)
    return engine


on_change.append(parts.cache_clear)
