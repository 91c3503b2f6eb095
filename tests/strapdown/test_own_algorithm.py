"""Algorithms outside the package are tried before they navigate; what is wrong with them is said with the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

from sinssim.errors import InputError, RunError
from sinssim.rotation.quaternions import dcm_from_quaternion_k
from sinssim.strapdown.attitude import REGISTRY, Algorithm
from sinssim.strapdown.engine_assembly import check_parts, compile_words, guarded

NAN = float("nan")


def parts(**changed: Callable[..., Any]) -> ModuleType:
    """Return the parts of the plainest algorithm, whose step turns by nothing, with some of them changed."""
    module = ModuleType("mine")
    plain: dict[str, Callable[..., Any]] = {
        "start_k": lambda *q: q,
        "dcm_k": lambda a: dcm_from_quaternion_k(*a),
        "step_k": lambda a, body, frame: a,
        "quaternion_k": lambda a: (*a, 0.0),
    }
    for name, function in {**plain, **changed}.items():
        setattr(module, name, function)
    return module


def fails(*_: object) -> None:
    raise ValueError("not today")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"start_k": lambda *q: np.array(q)}, "start_k must return a tuple of numbers"),
        ({"dcm_k": lambda a: a}, "dcm_k must return a tuple of 9 numbers, and returns (0.8, 0.2, -0.4, 0.4)"),
        ({"dcm_k": lambda a: (NAN,) * 9}, "a number is not finite"),
        ({"dcm_k": lambda a: dcm_from_quaternion_k(a[0], -a[1], -a[2], -a[3])}, "it is the transpose"),
        ({"dcm_k": lambda a: dcm_from_quaternion_k(a[3], a[0], a[1], a[2])}, "is not the matrix C_nb of the unit quat"),
        ({"quaternion_k": lambda a: a}, "quaternion_k must return a tuple of 5 numbers"),
        ({"quaternion_k": lambda a: (a[0], -a[1], -a[2], -a[3], 0.0)}, "is (0.8, -0.2, 0.4, -0.4) and not q ="),
        ({"step_k": lambda a, body, frame: a[:3]}, "step_k must return what start_k returns"),
        ({"step_k": lambda a, body, frame: (a[0], -a[1], -a[2], -a[3])}, "step_k without rotation changes"),
        ({"step_k": fails}, "the algorithm mine failed: /my/mine.py: ValueError: not today"),
    ],
)
def test_parts_that_do_not_mean_what_they_should(changed: dict[str, Callable[..., Any]], said: str) -> None:
    with pytest.raises(InputError) as caught:
        check_parts("mine", "/my/mine.py", parts(**changed))
    assert said in str(caught.value)
    assert "/my/mine.py" in str(caught.value)


def test_parts_that_fit() -> None:
    check_parts("mine", "/my/mine.py", parts())
    opposite = parts(quaternion_k=lambda a: (-a[0], -a[1], -a[2], -a[3], 0.0))  # the same turn
    check_parts("mine", "/my/mine.py", opposite)


def test_errors_of_the_compiler_name_the_line() -> None:
    def step(x: float) -> float:
        return x * "x"

    with pytest.raises(numba.core.errors.NumbaError) as caught:
        numba.njit(step)(1.0)
    line = step.__code__.co_firstlineno + 1
    words = compile_words(__file__, caught.value)
    assert words.startswith(f"{Path(__file__)}, line {line}: No implementation of function")
    assert "mul" in words


def test_failures_while_navigating(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(REGISTRY.shipped, "mine", Algorithm("mine", "", "mine", path="/my/mine.py"))
    with pytest.raises(
        RunError, match=r"the algorithm mine \(/my/mine.py\) failed while it navigated: ValueError: not"
    ):
        guarded("mine", fails)()
    own = RunError("of sinssim itself")
    with pytest.raises(RunError) as caught:
        guarded("mine", lambda: (_ for _ in ()).throw(own))()
    assert caught.value is own
