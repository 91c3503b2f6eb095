"""Names of a package that are loaded on first use, so that importing the package is fast."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def from_later_stage(module: str, name: str) -> Any:
    """Return a function of a later stage, for a method that offers it: `result.plot()` draws by the recording.

    Data flows to the later stage, and no module of an earlier one imports it: the name is looked up when it is called.

    Args:
        module: full name of the module.
        name: name of the function.
    """
    return getattr(importlib.import_module(module), name)


def on_first_use(package: str, home: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the `__getattr__` and `__dir__` of a package whose names are in modules below it.

    Args:
        package: full name of the package.
        home: full name of the module of each name.

    Returns:
        The two functions.
    """
    own = vars(sys.modules[package])

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        own[name] = value = getattr(importlib.import_module(home[name]), name)
        return value

    return load, lambda: sorted({*own, *home})
