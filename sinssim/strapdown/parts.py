"""The parts of an attitude algorithm, as the engines take them: from its file, in the variant that its name stands for.

An algorithm's file holds four functions of its attitude variables, a tuple of numbers of the file's own choice:

- `start_k(q0, q1, q2, q3)`: the variables of a unit quaternion q_nb;
- `dcm_k(attitude)`: the matrix C_nb that resolves forces, row by row;
- `step_k(attitude, body, frame)`: the variables one interval later, from a `BodyTurn` and a `FrameTurn`;
- `quaternion_k(attitude)`: the unit quaternion q_nb and what the variables lost of their norm or orthogonality.

A fifth, `turn_k(dtheta, dvel, weights, uniform, k)`, makes the `BodyTurn` of interval k from the samples; a file
without it shares `sinssim.strapdown.interval.fitted_turn_k`, as the algorithms do that are to be compared in attitude
alone. From it comes `fill_turns`, which makes those of a block of intervals (see `sinssim.strapdown.turns`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any

from sinssim.algorithms import REGISTRY
from sinssim.jit import bind, with_constants
from sinssim.strapdown import interval, turns

_NAMES = ("start_k", "dcm_k", "step_k", "quaternion_k", "turn_k")


@cache
def parts(algorithm: str) -> dict[str, Callable[..., Any]]:
    """Return an algorithm's functions by the names under which the engines know them.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.

    Returns:
        The five functions, and `fill_turns`.
    """
    entry = REGISTRY[algorithm]
    module = import_module(f"sinssim.strapdown.{entry.module}")
    found = {name: getattr(module, name, None) or interval.fitted_turn_k for name in _NAMES}
    suffix = algorithm.replace("-", "_")
    if entry.variant:
        found = {name: with_constants(part, f"{name}_{suffix}", **entry.variant) for name, part in found.items()}
    if hasattr(module, "turn_k"):
        found["fill_turns"] = bind(turns.fill_single_turns, f"fill_{suffix}", turn_k=found["turn_k"])
    else:
        found["fill_turns"] = turns.fill_fitted_turns
    return found


def own_engine(algorithm: str, frame: str) -> Callable[..., None] | None:
    """Return the engine of an algorithm whose file brings a whole one, a function `engine(frame)`.

    Args:
        algorithm: one of `sinssim.ALGORITHMS`.
        frame: one of `sinssim.FRAMES`.

    Returns:
        The engine; None for an algorithm that is a set of parts.
    """
    module = import_module(f"sinssim.strapdown.{REGISTRY[algorithm].module}")
    return module.engine(frame) if hasattr(module, "engine") else None


def engines(template: Callable[..., None], frame: str) -> Callable[[str], Callable[..., None]]:
    """Return the function that makes a frame's engines, each once.

    Args:
        template: the frame's engine as a plain function over the parts' names.
        frame: the frame's name in the names of its engines.

    Returns:
        A function of an algorithm's name, one of `sinssim.ALGORITHMS`, that returns the compiled engine; the engine
        fills the solution's arrays, whose first rows hold the initial state.
    """

    @cache
    def engine(algorithm: str) -> Callable[..., None]:
        return bind(template, f"{frame}_{algorithm.replace('-', '_')}", **parts(algorithm))

    return engine
