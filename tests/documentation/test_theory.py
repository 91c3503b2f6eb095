"""The tables of docs/theory.md: complete, with functions that exist, numbers beside them, and tests that use them."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.documentation.fences import script

ROOT = Path(__file__).parents[2]


SCRIPT = script("theory_page")
ROWS = SCRIPT.rows_module()
ALL = [*ROWS.PAPER, *ROWS.CHAPTER, *SCRIPT.rows_module("theory_beyond").BEYOND]
CHAPTER, PAPER = SCRIPT._CHAPTER, SCRIPT._PAPER


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _source(function: str) -> tuple[str, str]:
    """Return the text of the module that holds a function, and the function's name."""
    module, _, name = function.rpartition(".")
    path = ROOT / "sinssim" / Path(*module.split("."))
    return _text(path / "__init__.py" if path.is_dir() else path.with_suffix(".py")), name


def test_tables_have_every_row() -> None:
    """The site's page has each formula once, and the index of equations at its end."""
    tables = SCRIPT.tables()
    lines = tables.splitlines()
    for row in ALL:
        assert sum(f"| {row.formula} |" in line for line in lines) == 1, row.formula
    index = tables.split("## Equations in the code")[1]
    assert all(f"| `{module}` |" in index for module in SCRIPT.equations())


@pytest.mark.parametrize("row", ALL, ids=[f"{row.numbers} {row.functions[0]}" for row in ALL])
def test_functions_and_tests_of_a_formula(row) -> None:
    assert row.functions
    assert row.tests
    names = set()
    for function in row.functions:
        text, name = _source(function)
        names |= {name, function.rpartition(".")[0].rpartition(".")[2]}
        assert re.search(rf"^(?:def|class) {name}\b", text, re.MULTILINE), function
    for test in row.tests:
        file, name = test.split("::")
        text = _text(ROOT / "tests" / file)
        assert re.search(rf"^def {name}\(", text, re.MULTILINE), test
    tests = "".join(_text(ROOT / "tests" / test.split("::")[0]) for test in row.tests)
    assert any(re.search(rf"\b{name}\b", tests) for name in names), f"{row.tests} use none of {sorted(names)}"


@pytest.mark.parametrize("row", [row for row in ALL if row.numbers], ids=lambda row: row.numbers)
def test_numbers_stand_in_the_modules(row) -> None:
    pattern = CHAPTER if "8." in row.numbers else PAPER
    wanted = SCRIPT.numbers_in(row.numbers, pattern)
    texts = [_source(function)[0] for function in row.functions]
    find = SCRIPT.cited if pattern is PAPER else lambda text: SCRIPT.numbers_in(text, pattern)
    found = set().union(*(find(text) for text in texts))
    assert wanted <= found, f"{sorted(wanted - found)} of {row.numbers} is in none of {row.functions}"


def test_every_equation_is_on_the_page() -> None:
    """Equations (1) to (26), of which (5) and (6) are definitions, and (8.10) to (8.28)."""
    paper = set().union(*(SCRIPT.numbers_in(row.numbers, PAPER) for row in ROWS.PAPER))
    chapter = set().union(*(SCRIPT.numbers_in(row.numbers, CHAPTER) for row in ROWS.CHAPTER))
    assert paper == set(range(1, 27)) - {5, 6}
    assert chapter == set(range(10, 29))


def test_ranges_are_written_out() -> None:
    assert SCRIPT.numbers_in("(7)-(10), (12)", PAPER) == {7, 8, 9, 10, 12}
    assert SCRIPT.numbers_in("(8.20)-(8.22)", CHAPTER) == {20, 21, 22}
    assert SCRIPT._listed({7, 8, 9, 12}, "") == "(7) to (9), (12)"
