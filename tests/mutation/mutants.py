"""The mutants: where cosmic-ray's operators can change the targets, a sample of that, and a change as text."""

from __future__ import annotations

import hashlib
import random
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast_from_path
from cosmic_ray.plugins import get_operator
from cosmic_ray.work_item import MutationSpec

HERE = Path(__file__).parent
ROOT = HERE.parents[1]

_BINARY = (
    "Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Pow_Mul", "FloorDiv_Mul", "Mod_Mul",
    "BitXor_BitOr", "BitOr_BitAnd", "BitAnd_BitOr", "RShift_LShift", "LShift_RShift",
)  # fmt: skip
_COMPARISON = (
    "Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt",
    "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is",
)  # fmt: skip
_OTHERS = (
    "ReplaceUnaryOperator_USub_UAdd", "ReplaceUnaryOperator_Invert_UAdd", "ReplaceUnaryOperator_Delete_Not",
    "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "NumberReplacer", "ZeroIterationForLoop",
)  # fmt: skip
OPERATORS = (
    *(f"core/ReplaceBinaryOperator_{pair}" for pair in _BINARY),
    *(f"core/ReplaceComparisonOperator_{pair}" for pair in _COMPARISON),
    *(f"core/{name}" for name in _OTHERS),
)
"""One plausible slip for each construct. cosmic-ray's other pairs (a sum made a shift of bits) fail whatever the tests
are worth, and would flatter them; a kernel without its decorator is only slow."""


@dataclass(frozen=True)
class Target:
    """A file that is mutated.

    Attributes:
        group: what it belongs to: kernels, filter, error theory.
        file: its path in the checkout.
        tests: what judges it, as pytest takes it, the most telling first.
        plain: whether they run the kernels as plain Python.
    """

    group: str
    file: str
    tests: tuple[str, ...]
    plain: bool = False


@dataclass(frozen=True)
class Mutant:
    """One change of one target.

    Attributes:
        target: the file that is changed.
        operator: cosmic-ray's name of the change.
        occurrence: which of the places in the file where the operator applies.
        start, end: line and column of the place.
    """

    target: Target
    operator: str
    occurrence: int
    start: tuple[int, int]
    end: tuple[int, int]

    @property
    def job(self) -> str:
        """Name of the mutant, which changes with the file's content."""
        text = f"{self.operator} {self.occurrence} {self.target.file} {digest(self.target.file)}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def specification(self, tree: Path | None = None) -> MutationSpec:
        """Return cosmic-ray's description of the mutant of a file in a copy of the checkout."""
        path = Path(self.target.file) if tree is None else tree / self.target.file
        return MutationSpec(path, self.operator, self.occurrence, self.start, self.end)


def digest(file: str) -> str:
    """Return a digest of a file of the checkout."""
    return hashlib.sha256((ROOT / file).read_bytes()).hexdigest()


def targets() -> list[Target]:
    """Return the targets of targets.toml."""
    table = tomllib.loads((HERE / "targets.toml").read_text(encoding="utf-8"))
    plain = tuple(table.pop("plain"))
    return [
        Target(group, file, tuple(tests), file.startswith(plain))
        for group, files in table.items()
        for file, tests in files.items()
    ]


def mutants(target: Target) -> Iterator[Mutant]:
    """Return all mutants of a target, in an order that only its content decides."""
    nodes = list(ast_nodes(get_ast_from_path(ROOT / target.file)))
    for name in OPERATORS:
        operator = get_operator(name)()
        places = [(node, *place) for node in nodes for place in operator.mutation_positions(node)]
        for occurrence, (node, start, end) in enumerate(places):
            if not _is_idle(node):
                yield Mutant(target, name, occurrence, start, end)


def _is_idle(node: object) -> bool:
    """Return whether a node is in an annotation or a decorator, or the star of a signature: they compute nothing."""
    child, parent = node, getattr(node, "parent", None)
    while parent is not None:
        if parent.type in ("tfpdef", "decorator") or (parent.type == "parameters" and child is node):
            return True
        if parent.type == "annassign" and child is parent.children[1]:
            return True
        if parent.type == "funcdef" and child is not parent.children[-1] and child.type != "parameters":
            return True
        child, parent = parent, parent.parent
    return False


def sample(chosen: list[Target], size: int | None, seed: int) -> list[Mutant]:
    """Return mutants of targets, from each as many as its share of all.

    Args:
        chosen: the targets.
        size: how many mutants; None for all. A smaller sample of the same seed is the beginning of a larger one.
        seed: of the draw.

    Returns:
        The mutants.
    """
    placed = []
    for target in chosen:
        draw = random.Random(f"{seed} {target.file}")
        found = list(mutants(target))
        draw.shuffle(found)
        offset = draw.random()
        placed += [((i + offset) / len(found), target.file, mutant) for i, mutant in enumerate(found)]
    placed.sort(key=lambda entry: entry[:2])
    return [mutant for _, _, mutant in placed[:size]]


def change(diff: str) -> tuple[str, str]:
    """Return the changed lines before and after, out of a unified diff, as bare code."""
    lines = [line for line in diff.splitlines() if not line.startswith(("---", "+++", "@@"))]
    before, after = ("\n".join(bare(line[1:]) for line in lines if line.startswith(sign)) for sign in "-+")
    return before, after


def bare(line: str) -> str:
    """Return a line of code without its indentation and the comment at its end."""
    return line.split("  # ")[0].strip()
