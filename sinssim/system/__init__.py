"""Files, processes, memory, project folders and their registries; names of packages, loaded on first use."""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def on_first_use(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package whose names are in modules below it.

    The names are those that its `__init__.py` imports under `if TYPE_CHECKING:`, where editors and type checkers see
    them; the form `from module import name as name` offers them to users.
    """
    namespace = vars(sys.modules[package])
    tree = ast.parse(Path(namespace["__file__"]).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    home = {
        alias.name: str(node.module) for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names
    }

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        namespace[name] = value = getattr(importlib.import_module(home[name]), name)
        return value

    return load, lambda: sorted({*namespace, *home}), sorted(home)
