"""Makes the tables of docs/theory.md: each formula of the two source documents, its functions and its tests.

`python docs/theory_page.py` prints them.

The formulas are the rows of docs/theory_rows.py and docs/theory_beyond.py. The index at the end of the page is
collected from the code, where the number of an equation stands beside the line that implements it.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]

_CHAPTER = re.compile(r"\(8\.(\d+)\)(?:\s*(?:-|to)\s*\(8\.(\d+)\))?")
_PAPER = re.compile(r"\((\d{1,2})\)(?:\s*(?:-|to)\s*\((\d{1,2})\))?")
_CITED = re.compile(
    r"(?:[Ee]qs?\.|[Ee]quations?|#|\bof|\bin|E741)\s((?:\(\d{1,2}\)(?:-|, | and | to )?)+)|  # .*(\(\d\d?\))$", re.M
)
"""A citation of equations of the paper: after "eq.", or in a comment beside a line."""

_PAPER_TOP = """
## The ground SINS paper

The axes are those of the paper: x right, y forward, z up. K is the heading, γ the roll, θ the pitch and φ the
latitude, U is the rate of the Earth and g gravity. A tilde marks a measured value, and M{·} and σ{·} are mean
and standard deviation. E_i, N_i and H_i are the components of body axis i on east, north and up.
"""

_CHAPTER_TOP = """
## Chapter 8

The axes are those of the chapter: X forward, Y up, Z right; N, H, E for north, up, east. The package computes in
forward-right-down and north-east-down axes, and `tests/test_chapter_axes.py` shows that both are equivalent. B is the
latitude and, in Poisson's equation, the matrix C_nb; H is the height, and ω_з is the rate of the Earth.
"""

_BEYOND_TOP = """
## Beyond the two documents

The docstring of each function gives the source.
"""

_INDEX_TOP = """
## Equations in the code

This table is collected from comments and docstrings. *Paper* is the ground SINS paper.

| module | equations |
|---|---|
"""


def rows_module(name: str = "theory_rows") -> Any:
    """Load docs/theory_rows.py or docs/theory_beyond.py, which imports the former."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def numbers_in(text: str, pattern: re.Pattern[str]) -> set[int]:
    """Return the numbers of equations in a text, ranges written out.

    Args:
        text: for example "(7)-(10)".
        pattern: of one number or a range.

    Returns:
        The numbers.
    """
    found: set[int] = set()
    for first, last in pattern.findall(text):
        found |= set(range(int(first), int(last or first) + 1))
    return found


def cited(text: str) -> set[int]:
    """Return the equations of the paper that a module cites.

    Args:
        text: of the module.

    Returns:
        Their numbers, 1 to 26.
    """
    found = _CITED.findall(text)
    return numbers_in(" ".join(part for parts in found for part in parts), _PAPER) & set(range(1, 27))


def equations() -> dict[str, tuple[set[int], set[int]]]:
    """Return the equations that each module names: those of the paper, and those of chapter 8.

    A plain number counts as one of the paper in `sinssim/alignment` and beside the word "eq." or "equation" of the
    sensors' error model, because other modules number formulas of their own.

    Returns:
        Numbers by module, without "sinssim.".
    """
    found = {}
    for path in sorted((ROOT / "sinssim").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        inside = path.relative_to(ROOT / "sinssim")
        if inside.parts[0] == "alignment":
            paper = cited(text)
        elif inside.parts[0] == "sensors" and inside.parts[1] in ("imu", "__init__.py"):
            paper = set() if re.search(r"^ +\(2\) ", text, re.MULTILINE) else cited(text) & {2}  # one of its own
        else:
            paper = set()
        chapter = numbers_in(text, _CHAPTER) - {1, 2}  # (8.1) and (8.2) are sections
        if paper or chapter:
            found[".".join(inside.with_suffix("").parts).removesuffix(".__init__")] = (paper, chapter)
    return found


def _listed(numbers: set[int], prefix: str) -> str:
    """Return numbers with ranges drawn together, "(7) to (10), (12)"."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    parts = []
    for first, last in runs:
        parts += [f"({prefix}{first})"] if first == last else [f"({prefix}{first}) to ({prefix}{last})"]
    return ", ".join(parts)


def _table(rows: tuple[tuple[str, str, tuple[str, ...], tuple[str, ...]], ...], numbered: bool) -> str:
    lines = ["| eq. | formula | functions | tests |", "|---|---|---|---|"]
    if not numbered:
        lines = ["| formula | functions | tests |", "|---|---|---|"]
    for numbers, formula, functions, tests in rows:
        cells = [numbers.replace(")-(", ") to (")] if numbered else []
        cells.append(formula)
        cells += ["<br>".join(f"`{name}`" for name in names) for names in (functions, tests)]
        lines.append("| " + " | ".join(cells) + " |")
    return '<div class="theory" markdown>\n\n' + "\n".join(lines) + "\n\n</div>\n"


def tables() -> str:
    """Return the sections of the page that stand in place of its mark."""
    rows, beyond = rows_module(), rows_module("theory_beyond")
    parts = []
    for top, table in ((_PAPER_TOP, rows.PAPER), (_CHAPTER_TOP, rows.CHAPTER), (_BEYOND_TOP, beyond.BEYOND)):
        parts += [top, "\n", _table(table, table is not beyond.BEYOND)]
    parts.append(_INDEX_TOP)
    for module, (paper, chapter) in equations().items():
        named = [f"paper {_listed(paper, '')}"] if paper else []
        named += [f"chapter {_listed(chapter, '8.')}"] if chapter else []
        parts.append(f"| `{module}` | {'; '.join(named)} |\n")
    return "".join(parts)


if __name__ == "__main__":
    print(tables())
