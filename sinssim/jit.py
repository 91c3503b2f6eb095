"""Compiles scalar kernels and caches them on disk under a digest of what each is compiled from.

numba's own cache looks only at the file that holds a kernel, not at the functions that it calls, so an edited formula
in another file would go unnoticed. Here the key of a kernel is a digest of its byte code, its options, the values of
its globals, and the keys of the kernels among them. An edit compiles anew the kernels that it reaches and no other, and
checkouts that share a kernel share its compiled form.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import time
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.dispatcher import Dispatcher

from sinssim.system.locks import remove_unused
from sinssim.system.signals import aside

logger = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

_MOST = 2**28
"""Size of the kernels that are kept, bytes: ten times that of all the kernels of one version."""
_DAY = 86_400.0


def cache_root() -> Path:
    """Return the folder for everything sinssim may keep between runs (`SINSSIM_CACHE`, else the XDG cache)."""
    explicit = os.environ.get("SINSSIM_CACHE")
    if explicit:
        return Path(explicit)
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "sinssim"


@cache
def _kernel_folder() -> Path:
    return cache_root() / "kernels"


@cache
def _make_room() -> None:
    """Remove the kernels that were not used for longest, if all together are too large; once in a process."""
    kept: dict[str, list[tuple[Path, os.stat_result]]] = {}  # files by kernel
    for path in _kernel_folder().iterdir():
        with contextlib.suppress(OSError):  # another process removes it
            if path.is_dir():  # a whole version, as kept formerly
                remove_unused(path)
            else:
                kept.setdefault(path.name.split(".")[0], []).append((path, path.stat()))
    total = sum(stat.st_size for files in kept.values() for _, stat in files)
    for files in sorted(kept.values(), key=lambda files: max(stat.st_mtime for _, stat in files)):
        if total <= _MOST:
            break
        for path, stat in files:
            total -= stat.st_size
            with contextlib.suppress(OSError):
                path.unlink()


@cache
def _warn_once() -> None:
    logger.warning(
        "the compiled kernels cannot be kept in %s: every start compiles them anew, which takes many seconds. Set "
        "SINSSIM_CACHE to a folder that can be written.",
        _kernel_folder(),
    )


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]


def _key(value: Any, above: tuple[int, ...] = ()) -> str:
    """Return a digest of a value that a kernel refers to: of everything in it that the compiler reads.

    Args:
        value: a kernel, function, class, array, tuple, number…
        above: the plain functions that the value is reached through.

    Returns:
        The digest. A value whose text differs from process to process makes a key that is never found again.
    """
    if isinstance(value, Dispatcher):
        kept = getattr(value, "_cache", None)
        return kept.key if isinstance(kept, _KernelCache) else _key(value.py_func, above)
    if isinstance(value, types.FunctionType):
        if id(value) in above:
            return "recursive"
        above = (*above, id(value))
        code, names = _code(value.__code__), _names(value.__code__)
        found = [(name, value.__globals__[name]) for name in names if name in value.__globals__]
        inside = [cell.cell_contents for cell in value.__closure__ or ()]
        parts = [f"{n} {_of_module(v, names, above) if isinstance(v, types.ModuleType) else _key(v, above)}"
                 for n, v in found]  # fmt: skip
        return _digest("function", code, _key(value.__defaults__, above), *(_key(v, above) for v in inside), *parts)
    if isinstance(value, np.ndarray):
        return _digest("array", str(value.dtype), str(value.shape), str(value.strides), value.tobytes().hex())
    if isinstance(value, (tuple, list)):
        return _digest(type(value).__qualname__, *(_key(item, above) for item in value))
    if isinstance(value, type):
        return _digest(
            "class", value.__qualname__, *(repr(getattr(value, n, "")) for n in ("_fields", "_field_defaults"))
        )
    return _digest("value", type(value).__qualname__, repr(value))


def _of_module(module: types.ModuleType, names: list[str], above: tuple[int, ...]) -> str:
    """Return the key of what a function may use of a module; numba's version stands for that of numpy's and others'."""
    if module.__name__.split(".")[0] != __name__.split(".")[0]:
        return module.__name__
    return _digest(module.__name__, *(f"{n} {_key(getattr(module, n), above)}" for n in names if hasattr(module, n)))


def _code(code: types.CodeType) -> str:
    constants = [_code(c) if isinstance(c, types.CodeType) else f"{type(c).__qualname__} {c!r}" for c in code.co_consts]
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_argcount
    return _digest(code.co_code.hex(), repr(names), *constants)


def _names(code: types.CodeType) -> list[str]:
    inside = (_names(c) for c in code.co_consts if isinstance(c, types.CodeType))
    return sorted({*code.co_names}.union(*inside))


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc]
    """Where the kernels are kept: always in our folder, which may be read-only, and under names of our own.

    numba takes a folder only if it can write there. Else it turns to places of its own.
    """

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file = py_file
        self._cache_path = str(_kernel_folder())

    def get_source_stamp(self) -> str:
        return ""  # the key says it all

    def get_disambiguator(self) -> str:
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator:
        return cls(py_func, py_file)


class _Located(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """A cache whose damaged files count as none, and which costs a compilation and no error where it cannot be kept."""

    _impl_class = _Located

    def __init__(self, compiled: Dispatcher) -> None:
        super().__init__(compiled.py_func)
        self._options = _key(sorted((name, repr(option)) for name, option in compiled.targetoptions.items()))
        self._own_key = ""

    @property
    def key(self) -> str:
        """Digest of what the kernel is compiled from, taken when it is first asked for: all globals are set by then."""
        if not self._own_key:
            self._own_key = "recursive"  # for a kernel that calls itself
            self._own_key = _digest(numba.__version__, self._options, _key(self._py_func))
        return self._own_key

    def _look_up(self) -> None:
        name = "".join(c for c in self._py_func.__name__ if c not in "<>.")
        self._cache_file = IndexDataCacheFile(self._cache_path, f"{name}-{self.key}", "")

    def load_overload(self, *arguments: Any) -> Any:
        self._look_up()
        try:
            result = super().load_overload(*arguments)
            index = self._cache_file._index_path
            if result is not None and time.time() - os.path.getmtime(index) > _DAY:
                with contextlib.suppress(OSError):  # read-only
                    os.utime(index)
            return result
        except Exception:  # whatever unpickling makes of damaged bytes
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, *arguments: Any) -> None:
        self._look_up()
        try:
            super().save_overload(*arguments)
            _make_room()
        except OSError:
            _warn_once()


def _jit(function: F, **options: Any) -> F:
    compiled = numba.njit(nogil=True, error_model="numpy", **options)(function)
    compiled._cache = _KernelCache(compiled)
    compile_now = compiled.compile
    compiled.compile = lambda signature: aside(lambda: compile_now(signature))
    return compiled  # type: ignore[no-any-return]


class _Listener(event.Listener):  # type: ignore[misc]
    """Hears of kernels that are compiled, and of those that are compiled within them; one thread at a time compiles."""

    def __init__(self, tell: Callable[[bool], None]) -> None:
        self._tell, self._depth = tell, 0

    def on_start(self, event: Any) -> None:
        self._depth += 1
        if self._depth == 1:
            self._tell(True)

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._tell(False)


@contextlib.contextmanager
def compilation(tell: Callable[[bool], None]) -> Iterator[None]:
    """Tell, inside the block, when kernels are compiled because the cache lacks them.

    Args:
        tell: called with True when a compilation begins, with False when it ends; in any thread.
    """
    with event.install_listener("numba:compile", _Listener(tell)):
        yield


def kernel(function: F) -> F:
    """Compile a scalar kernel: cached on disk, releases the GIL, assumes finite numbers (check them outside)."""
    return _jit(function, fastmath=True)


def strict_kernel(function: F) -> F:
    """Compile a kernel that must see NaN, infinities and the written order of operations."""
    return _jit(function, fastmath=False)


def inline(function: F) -> F:
    """Compile a scalar function that is always inlined into the kernel that calls it."""
    return _jit(function, fastmath=True, forceinline=True)


def strict_inline(function: F) -> F:
    """Like `inline`, but the operations stay in the order in which they are written, whatever kernel calls them.

    It may take arrays, and not make any: numba counts no references in it, which would cost more than its arithmetic.
    """
    return _jit(function, fastmath=False, forceinline=True, _nrt=False)  # unsaid, numba takes over the caller's setting


def with_constants(function: Any, name: str, **constants: int | bool) -> Any:
    """Return a copy of an `inline` function with other values of its file's constants.

    Args:
        function: the compiled function; as it comes if none of the constants occurs in it.
        name: a name unique among the copies.
        **constants: values for global names of the function.

    Returns:
        The compiled copy.
    """
    plain = function.py_func
    if not set(constants) & set(plain.__code__.co_names):
        return function
    copy = types.FunctionType(plain.__code__, {**plain.__globals__, **constants}, name)
    copy.__qualname__ = name
    copy.__module__ = plain.__module__
    return inline(copy)


def bind(template: Callable[..., Any], name: str, **parts: Any) -> Callable[..., Any]:
    """Make a kernel from a plain function by fixing some of its global names to compiled functions.

    numba does not cache functions that close over other compiled functions; globals it does cache. So an engine
    is written once as a plain function over global part names, and every combination of parts is a copy of it
    under a name of its own.

    Args:
        template: the plain (not compiled) function.
        name: a name unique among the copies of this template.
        **parts: the compiled functions for the template's global names.

    Returns:
        The compiled copy.
    """
    copy = types.FunctionType(template.__code__, {**template.__globals__, **parts}, name)
    copy.__qualname__ = name
    copy.__module__ = template.__module__
    return kernel(copy)
