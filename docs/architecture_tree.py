"""Writes the tree of docs/architecture.md from the docstrings of the package: `python docs/architecture_tree.py`."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "sinssim"
PAGE = Path(__file__).with_name("architecture.md")
WIDTH = 118
BESIDE = """\
aircraft/  scenarios/  viz/      content: files to copy and change; no code of the package depends on them
docs/extending/                  a page for each kind of extension; a test runs its code
benchmarks/                      speed and accuracy, measured
tests/                           the folders of sinssim/; tests/oracles/ holds independent references
"""


def first_sentence(file: Path) -> str:
    """Return the first line of a module's docstring; "" for none."""
    docstring = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return docstring.partition("\n")[0].rstrip(".")


def tree(package: Path = PACKAGE) -> str:
    """Return the files of the top level and all folders, each with the sentence of its docstring."""
    entries = [(file, file.name, 1) for file in sorted(package.glob("*.py")) if not file.name.startswith("_")]
    for file in sorted(package.rglob("__init__.py"), key=lambda file: file.parent.parts):
        depth = len(file.relative_to(package).parts) - 1
        if depth and "_content" not in file.parts:
            entries.append((file, f"{file.parent.name}/", depth))
    lines = [f"{package.name}/"]
    for file, name, depth in entries:
        line = f"{'  ' * depth + name:<23}{first_sentence(file)}"
        # a long sentence ends at the last comma, colon or semicolon that fits
        lines.append(line if len(line) <= WIDTH else re.sub(r"[,;:] [^,;:]*$", "", line[:WIDTH]))
    return "\n".join(lines) + "\n" + BESIDE


def with_tree(page: str) -> str:
    """Return the text of the page with the tree in its place."""
    before, title, rest = page.partition("## The tree\n\n```\n")
    _, end, after = rest.partition("```\n")
    return before + title + tree() + end + after


if __name__ == "__main__":
    PAGE.write_text(with_tree(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
