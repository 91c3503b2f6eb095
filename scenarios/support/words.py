"""The engine of the level frame with words of finite length, or in single precision, for the study word_length.py."""

from __future__ import annotations
import __future__

import ast
import inspect
import math
import textwrap
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from sinssim.data import Array
from sinssim.earth.gravity import EarthParameters
from sinssim.jit import bind, strict_inline
from sinssim.rotation.quaternions import sincos_k
from sinssim.strapdown.attitude.quaternion import dcm_k, quaternion_k, start_k, step_k
from sinssim.strapdown.coning_sculling import BLOCK, empty_turns_k, fill_single_turns, turn_in_block_k
from sinssim.strapdown.coning_sculling import fill_fitted_turns as fill_turns
from sinssim.strapdown.engine_assembly import parts
from sinssim.strapdown.frames.level import EXACT_EVERY, LevelState, refreshed_k, start_level_k, step_level_k
from sinssim.strapdown.frames.navigation_problem import Models, forces_k
from sinssim.strapdown.frames.vertical_channel import HELD, Loop


@strict_inline
def word_k(x: float, lsb: float, cut: bool) -> float:
    """A variable as a word: a multiple of lsb, or in single precision; unchanged if lsb is 0."""
    if lsb == 0.0:
        return x
    if lsb < 0.0:
        return float(np.float32(x))
    return math.floor(x / lsb + (0.0 if cut else 0.5)) * lsb


@strict_inline
def words_quaternion_k(a: Any, lsb: float, cut: bool) -> Any:
    """The four words of a quaternion."""
    return word_k(a[0], lsb, cut), word_k(a[1], lsb, cut), word_k(a[2], lsb, cut), word_k(a[3], lsb, cut)


@strict_inline
def words_poisson_k(a: Any, lsb: float, cut: bool) -> Any:
    """The nine words of a matrix."""
    return (
        word_k(a[0], lsb, cut), word_k(a[1], lsb, cut), word_k(a[2], lsb, cut),
        word_k(a[3], lsb, cut), word_k(a[4], lsb, cut), word_k(a[5], lsb, cut),
        word_k(a[6], lsb, cut), word_k(a[7], lsb, cut), word_k(a[8], lsb, cut),
    )  # fmt: skip


@strict_inline
def words_euler_k(a: Any, lsb: float, cut: bool) -> Any:
    """The three words of Euler angles, and the sines and cosines of their halves."""
    roll, pitch, heading = word_k(a[0], lsb, cut), word_k(a[1], lsb, cut), word_k(a[2], lsb, cut)
    sr, cr = sincos_k(0.5 * roll)
    sp, cp = sincos_k(0.5 * pitch)
    sh, ch = sincos_k(0.5 * heading)
    return roll, pitch, heading, sr, cr, sp, cp, sh, ch, a[9]


WORDS = {"quaternion": words_quaternion_k, "poisson": words_poisson_k, "euler": words_euler_k}
words_k = words_quaternion_k


# A compiled engine, as that of the level frame: bound to the parts of each algorithm.
def _navigate(
    dtheta: Array, dvel: Array, weights: Array, dt: float, p: EarthParameters, start: Array, lsb: Array, cut: bool,
    every: int, states: Array,
) -> None:  # fmt: skip
    lat0, lon0, h0 = start[0], start[1], start[2]
    attitude = words_k(start_k(start[6], start[7], start[8], start[9]), lsb[0], cut)
    of = Models(p, 0, False)
    x = start_level_k(of, lat0, h0, (start[3], start[4], start[5]), Loop(0.0, 0.0))
    turns, count = empty_turns_k(), dtheta.shape[0]
    for k in range(count):
        if k % BLOCK == 0:
            fill_turns(dtheta, dvel, weights, True, k, min(k + BLOCK, count), turns)
        if k % EXACT_EVERY == 0:
            x = refreshed_k(lat0, x)
        body = turn_in_block_k(turns, k % BLOCK)
        x, frame = step_level_k(of, HELD, (0.0, 0.0, 0.0), dt, lon0, (h0, 0.0), forces_k(dcm_k(attitude), body), x)
        attitude = words_k(step_k(attitude, body, frame), lsb[0], cut)
        north, east = x.north, x.east
        if lsb[2] != 0.0:  # the words hold latitude and longitude
            north, east = word_k(lat0 + north, lsb[2], cut) - lat0, word_k(lon0 + east, lsb[2], cut) - lon0
        v = word_k(x.v[0], lsb[1], cut), word_k(x.v[1], lsb[1], cut), x.v[2]
        x = LevelState(v, x.a, x.h, north, east, x.at, x.loop)
        if (k + 1) % every == 0:
            row = (k + 1) // every
            states[row, 0], states[row, 1], states[row, 2], states[row, 3] = (
                lat0 + x.north,
                lon0 + x.east,
                x.v[0],
                x.v[1],
            )
            states[row, 4], states[row, 5], states[row, 6], states[row, 7], _ = quaternion_k(attitude)


# --- single precision throughout


def single_k(x: Any) -> Any:
    """A result in single precision; whole numbers, which count, stay as they are."""
    return x if isinstance(x, int) else float(np.float32(x))


@overload(single_k)  # type: ignore[untyped-decorator]
def _single(x):  # type: ignore[no-untyped-def]  # numba compares the signatures
    return (lambda x: x) if isinstance(x, types.Integer) else (lambda x: np.float64(np.float32(x)))


class _Rounded(ast.NodeTransformer):
    """Puts `single_k` around every result of arithmetic, every constant and every function value."""

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        computed = isinstance(node, ast.BinOp) or (isinstance(node, ast.Constant) and isinstance(node.value, float))
        if computed or (isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("sin", "cos", "sqrt", "floor")):
            return ast.Call(ast.Name("single_k", ast.Load()), [node], [])
        if isinstance(node, ast.AugAssign):  # x += y
            before = ast.parse(ast.unparse(node.target), mode="eval").body
            return ast.Assign(
                [node.target], ast.Call(ast.Name("single_k", ast.Load()), [ast.BinOp(before, node.op, node.value)], [])
            )
        return node


@cache
def single(function: Any) -> Any:
    """Return a kernel with every result rounded to single precision, also in all kernels that it calls.

    A sum, product, quotient or root of two numbers of 24 bits, computed with 53 bits and rounded to 24, is the result
    of single-precision hardware: 53 ≥ 2·24 + 2 (Figueroa, SIGNUM Newsletter 30, 1995).

    Args:
        function: compiled.

    Returns:
        The compiled copy.
    """
    plain = function.py_func
    tree = _Rounded().visit(ast.parse(textwrap.dedent(inspect.getsource(plain))))
    tree.body[0].decorator_list = []
    ast.increment_lineno(tree, plain.__code__.co_firstlineno - 1)  # numba quotes the source from these lines
    scope = {**plain.__globals__, "single_k": single_k}
    for name in plain.__code__.co_names:
        if hasattr(scope.get(name), "py_func"):
            scope[name] = single(scope[name])
    flags = __future__.annotations.compiler_flag
    exec(compile(ast.fix_missing_locations(tree), plain.__code__.co_filename, "exec", flags), scope)
    return strict_inline(scope[tree.body[0].name])


@cache
def engine(algorithm: str, throughout: bool = False) -> Callable[..., None]:
    """Return the loop of an algorithm, with 53 bits or in single precision throughout."""
    name = f"{algorithm}_{'single' if throughout else 'words'}"
    own = parts(algorithm)
    used = {part: own[part] for part in ("start_k", "dcm_k", "step_k", "quaternion_k")}
    used |= {"start_level_k": start_level_k, "step_level_k": step_level_k, "refreshed_k": refreshed_k,
             "forces_k": forces_k}  # fmt: skip
    if throughout:
        used = {part: single(function) for part, function in used.items()}
        used["fill_turns"] = bind(fill_single_turns, f"fill_{name}", turn_k=single(own["turn_k"]))
    return bind(_navigate, f"navigate_{name}", words_k=WORDS[algorithm], **used)
