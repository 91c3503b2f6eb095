"""Compiles scalar kernels and caches them on disk under a digest of the package's sources.

numba's own cache looks only at the file that holds a kernel, not at the files of the functions it calls, so an
edited formula in another file would go unnoticed. Here the cache folder carries a digest of every source file
that a kernel could come from: any edit means a new folder, and the second process finds everything compiled.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IPythonCacheLocator, UserProvidedCacheLocator

from sinssim.system.locks import hold, remove_unused
from sinssim.system.signals import aside

logger = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

NO_KERNELS = (
    "_content", "cli", "estimation", "recording", "scenario", "simulation", "studies",
)  # fmt: skip
"""Parts of the package that hold no kernel and nothing that a kernel uses: an edit there compiles nothing anew."""
_VERSIONS = 6
"""How many versions of the kernels are kept, those in use aside."""


def cache_root() -> Path:
    """Return the folder for everything sinssim may keep between runs (`SINSSIM_CACHE`, else the XDG cache)."""
    explicit = os.environ.get("SINSSIM_CACHE")
    if explicit:
        return Path(explicit)
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "sinssim"


@cache
def _kernel_folder() -> str:
    """Return the folder of this version's kernels, marked as in use until the process ends."""
    package = Path(__file__).parent
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        name = source.relative_to(package)
        if name.parts[0] not in NO_KERNELS:
            digest.update(name.as_posix().encode())
            digest.update(source.read_bytes())
    root = cache_root() / "kernels"
    folder = root / digest.hexdigest()[:16]
    with contextlib.suppress(OSError):  # read-only: what is there is used, and nobody can remove it
        hold(folder, shared=True)
        os.utime(folder)
        # Keep a few older versions (several checkouts may be in use), drop the rest.
        for old in sorted(root.iterdir(), key=lambda path: path.stat().st_mtime)[:-_VERSIONS]:
            remove_unused(old)
    return str(folder)


@cache
def _warn_once() -> None:
    logger.warning(
        "the compiled kernels cannot be kept in %s: every start compiles them anew, which takes many seconds. Set "
        "SINSSIM_CACHE to a folder that can be written.",
        cache_root() / "kernels",
    )


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc]
    """Where the kernels of a source file are kept: always in our folder, and it may be read-only.

    numba takes a folder only if it can write there. Else it turns to places of its own, where it looks only at the file
    that holds a kernel, and serves it stale.
    """

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._cache_path = os.path.join(_kernel_folder(), self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator | None:
        return cls(py_func, py_file) if os.path.exists(py_file) else None


class _Located(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator, IPythonCacheLocator)


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """A cache whose damaged files count as none, and which costs a compilation and no error where it cannot be kept."""

    _impl_class = _Located

    def load_overload(self, *arguments: Any) -> Any:
        try:
            return super().load_overload(*arguments)
        except Exception:  # whatever unpickling makes of damaged bytes
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, *arguments: Any) -> None:
        try:
            super().save_overload(*arguments)
        except OSError:
            _warn_once()


def _jit(function: F, **options: Any) -> F:
    compiled = numba.njit(nogil=True, error_model="numpy", **options)(function)
    compiled._cache = _KernelCache(function)
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
