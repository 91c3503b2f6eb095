"""Prints the tree of the package for docs/architecture.md, from its docstrings: `python docs/architecture_tree.py`."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "sinssim"
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
    lines += [f"{'  ' * depth + name:<23}{first_sentence(file)}" for file, name, depth in entries]
    return "\n".join(lines) + "\n" + BESIDE


if __name__ == "__main__":
    print(tree())
