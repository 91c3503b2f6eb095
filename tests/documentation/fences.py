"""Blocks of code of the pages.

A comment that the reader does not see may stand above a block:

    <!-- edit FILE: OLD => NEW -->   a change of a file before the command, for docs/troubleshooting.md
    <!-- slow: REASON -->            the block runs in the slow tests
    <!-- not run: REASON -->         no test runs the block
"""

from __future__ import annotations

import importlib.util
import re
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[2]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
"""Every page; CHANGELOG.md has no code."""

_BLOCK = re.compile(
    r"(?P<notes>(?:^<!--(?:(?!-->).)*-->\n\n?)*)^(?P<indent> *)```(?P<info>[^\n`]*)\n(?P<code>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)
_NOTE = re.compile(r"<!-- ([\w ]+?)(?: (\S+))?: (.*?) -->", re.DOTALL)


@dataclass(frozen=True)
class Block:
    """One block of code.

    Attributes:
        language: of the fence; "" for output and diagrams.
        path: of the file that the block makes or changes; "" for none.
        code: its text.
        line: on which the fence begins, from 1.
        notes: contents of the comments above it, each as its first words, the file, and the rest.
    """

    language: str
    path: str
    code: str
    line: int
    notes: tuple[tuple[str, str, str], ...] = ()

    def note(self, kind: str) -> str:
        """Return the text of the first note of a kind; "" for none."""
        return next((text for found, _, text in self.notes if found == kind), "")


def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page in their order.

    Args:
        page: a file.

    Returns:
        The blocks.
    """
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _BLOCK.finditer(text):
        language, _, path = match["info"].strip().partition(" ")
        notes = tuple((kind, file or "", rest) for kind, file, rest in _NOTE.findall(match["notes"]))
        found.append(Block(language, path, match["code"], text.count("\n", 0, match.start("info")) + 1, notes))
    return found


def name(page: Path) -> str:
    """Return the path of a page below the checkout."""
    return page.relative_to(ROOT).as_posix()


OWN_TESTS = {
    "docs/alignment.md": "tests/alignment/test_page.py",
    "docs/allan.md": "tests/analyses/noise/test_report.py",
    "docs/api.md": "tests/test_api_page.py",
    "docs/budgets.md": "tests/analyses/error_budget/test_page.py",
    "docs/ensembles.md": "tests/test_docs.py",
    "docs/tasks.md": "tests/test_tasks.py",
    "docs/estimation.md": "tests/test_docs.py",
    "docs/logs.md": "tests/logs/test_page.py",
    "docs/trades.md": "tests/experiments/studies/test_trade_docs.py",
}
"""Pages whose Python runs in the normal run, by a test that compares what it gives."""

NOT_RUN = {
    ("docs/filter-theory.md", "sinssim check gyrocompassing"): "a part of the output; the command is that of README.md",
    (
        "docs/extending/command.md",
        "sinssim duration",
    ): "tests/extending/test_command.py runs it in a copy of the package",
    ("docs/validation.md", "sinssim inspect imu.csv"): "needs the whole drive of nine minutes, which is not shipped",
}
"""Blocks without a language that begin with a command, with the reason why they are not run as commands."""


def script(file: str) -> ModuleType:
    """Load a script of the folder docs, which is no package."""
    spec = importlib.util.spec_from_file_location(file, ROOT / "docs" / f"{file}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
