"""Loads and stores the tuples of a run in the rows of its lane."""

from __future__ import annotations

from sinssim.data import Array
from sinssim.experiments.ensembles.batch.layout import LANES as L
from sinssim.jit import inline
from sinssim.rotation.kernels import Matrix, Quaternion
from sinssim.strapdown.frames.level import LevelState, Place
from sinssim.strapdown.frames.vertical import Loop

Eight = tuple[float, float, float, float, float, float, float, float]


@inline
def level_k(x: Array, j: int) -> LevelState:
    """State in the level frame of run j."""
    return LevelState(
        (x[j], x[L + j], x[2 * L + j]),
        (x[3 * L + j], x[4 * L + j], x[5 * L + j]),
        x[6 * L + j], x[7 * L + j], x[8 * L + j],
        Place(x[9 * L + j], x[10 * L + j], x[11 * L + j], x[12 * L + j], x[13 * L + j], x[14 * L + j], x[15 * L + j]),
        Loop(x[16 * L + j], x[17 * L + j]),
    )  # fmt: skip


@inline
def keep_level_k(x: Array, j: int, state: LevelState) -> None:
    """Store the state of run j."""
    x[j], x[L + j], x[2 * L + j] = state.v
    x[3 * L + j], x[4 * L + j], x[5 * L + j] = state.a
    x[6 * L + j], x[7 * L + j], x[8 * L + j] = state.h, state.north, state.east
    (
        x[9 * L + j], x[10 * L + j], x[11 * L + j], x[12 * L + j], x[13 * L + j], x[14 * L + j], x[15 * L + j]
    ) = state.at  # fmt: skip
    x[16 * L + j], x[17 * L + j] = state.loop


@inline
def four_k(x: Array, row: int, j: int) -> Quaternion:
    """Four attitude variables of run j, from a row on."""
    i = row * L + j
    return x[i], x[i + L], x[i + 2 * L], x[i + 3 * L]


@inline
def keep_four_k(x: Array, row: int, j: int, v: Quaternion) -> None:
    """Store four attitude variables of run j."""
    i = row * L + j
    x[i], x[i + L], x[i + 2 * L], x[i + 3 * L] = v


@inline
def eight_k(x: Array, row: int, j: int) -> Eight:
    """Eight attitude variables of run j, from a row on."""
    i = row * L + j
    return x[i], x[i + L], x[i + 2 * L], x[i + 3 * L], x[i + 4 * L], x[i + 5 * L], x[i + 6 * L], x[i + 7 * L]


@inline
def keep_eight_k(x: Array, row: int, j: int, v: Eight) -> None:
    """Store eight attitude variables of run j."""
    i = row * L + j
    x[i], x[i + L], x[i + 2 * L], x[i + 3 * L], x[i + 4 * L], x[i + 5 * L], x[i + 6 * L], x[i + 7 * L] = v


@inline
def nine_k(x: Array, row: int, j: int) -> Matrix:
    """Nine attitude variables of run j, from a row on."""
    i = row * L + j
    return (
        x[i], x[i + L], x[i + 2 * L], x[i + 3 * L], x[i + 4 * L], x[i + 5 * L], x[i + 6 * L], x[i + 7 * L],
        x[i + 8 * L],
    )  # fmt: skip


@inline
def keep_nine_k(x: Array, row: int, j: int, v: Matrix) -> None:
    """Store nine attitude variables of run j."""
    i = row * L + j
    (
        x[i], x[i + L], x[i + 2 * L], x[i + 3 * L], x[i + 4 * L], x[i + 5 * L], x[i + 6 * L], x[i + 7 * L],
        x[i + 8 * L],
    ) = v  # fmt: skip
