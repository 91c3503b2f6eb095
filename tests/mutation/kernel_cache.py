"""A pytest plugin: kernels run as plain Python, or are compiled anew only if they, or what they call, were mutated.

A few hundred steps of an engine take a tenth of a second in Python, and half a minute to compile.

`sinssim.jit` keys its cache with a digest of all sources, so that one changed character compiles everything anew, which
is right for users and takes minutes for a mutant. Here the key of a kernel is a digest of what numba compiles: its byte
code, its constants, the values of its globals, and the same of every kernel among them. Mutants read the cache that the
unchanged package has left, and leave nothing in it.
"""

from __future__ import annotations

import hashlib
import os
import types
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import config
from numba.core.caching import IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

from sinssim import jit

FOLDER, FILLS = "SINSSIM_MUTATION_KERNELS", "SINSSIM_MUTATION_FILLS"
"""Environment variables: the folder of the cache, none for plain Python, and whether this process may add to it."""

_original = jit._jit
_seen: dict[int, str] = {}


def key(value: Any) -> str:
    """Return a digest of what a kernel, or a value that a kernel refers to, is compiled from."""
    if isinstance(value, Dispatcher):
        if id(value) not in _seen:
            _seen[id(value)] = "itself"  # for a kernel that calls itself
            options = sorted((name, str(option)) for name, option in value.targetoptions.items())
            _seen[id(value)] = _digest("kernel", str(options), str(config.BOUNDSCHECK), key(value.py_func))
        return _seen[id(value)]
    if isinstance(value, types.FunctionType):
        names = sorted(_names(value.__code__))
        found = [(name, value.__globals__[name]) for name in names if name in value.__globals__]
        parts = (f"{name} {_of_module(v, names) if isinstance(v, types.ModuleType) else key(v)}" for name, v in found)
        return _digest("function", _code(value.__code__), repr(value.__defaults__), *parts)
    if isinstance(value, np.ndarray):
        return _digest("array", str(value.dtype), str(value.shape), value.tobytes().hex())
    if isinstance(value, (tuple, list)):
        return _digest("tuple", *(key(item) for item in value))
    if isinstance(value, type):
        return _digest("class", value.__qualname__, repr(getattr(value, "_fields", "")))
    return _digest("value", value.__class__.__name__, repr(value))


def _of_module(module: types.ModuleType, names: list[str]) -> str:
    if module.__name__.split(".")[0] != "sinssim":
        return module.__name__
    found = [name for name in names if hasattr(module, name)]
    return _digest(module.__name__, *(f"{name} {key(getattr(module, name))}" for name in found))


def _code(code: types.CodeType) -> str:
    constants = (_code(c) if isinstance(c, types.CodeType) else f"{type(c).__name__} {c!r}" for c in code.co_consts)
    return _digest(code.co_code.hex(), repr(code.co_names), repr(code.co_varnames), *constants)


def _names(code: types.CodeType) -> set[str]:
    inner = (_names(c) for c in code.co_consts if isinstance(c, types.CodeType))
    return set(code.co_names).union(*inner)


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]


def _keyed(function: Any, **options: Any) -> Any:
    """Compile as `sinssim.jit` does, with the cache looked up under the kernel's own key at its first use."""
    compiled = _original(function, **options)
    kept = compiled._cache
    load, save = kept.load_overload, kept.save_overload

    def look_up() -> None:
        folder = Path(os.environ[FOLDER]) / key(compiled)
        if os.environ.get(FILLS):
            folder.mkdir(parents=True, exist_ok=True)
        kept._cache_file = IndexDataCacheFile(str(folder), kept._impl.filename_base, "of any file")

    def load_overload(*arguments: Any) -> Any:
        look_up()
        return load(*arguments)

    def save_overload(*arguments: Any) -> None:
        if os.environ.get(FILLS):
            look_up()
            save(*arguments)

    kept.load_overload, kept.save_overload = load_overload, save_overload
    return compiled


def _plain(function: Any, **options: Any) -> Any:
    """Leave a kernel as it is written."""
    function.py_func = function
    return function


def pytest_configure() -> None:
    """Replace the compiler, before any module that holds a kernel is imported.

    Only where pytest loads this file as a plugin: a test that merely imports it must leave its own process compiled.
    """
    jit._jit = _keyed if os.environ.get(FOLDER) else _plain
