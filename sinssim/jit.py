"""Compiled scalar kernels: one decorator, and a disk cache that a changed source file can never serve stale.

numba's own cache looks only at the file that holds a kernel, not at the files of the functions it calls, so an
edited formula in another file would go unnoticed. Here the cache folder carries a digest of every source file
that a kernel could come from: any edit means a new folder, and the second process finds everything compiled.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import tempfile
import threading
import types
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

logger = logging.getLogger(__name__)

F = TypeVar("F", bound=Callable[..., Any])

NO_KERNELS = (
    "_content", "aided.py", "cli.py", "estimation", "precompile.py", "recording", "scenario", "simulation.py",
    "studies",
)  # fmt: skip
"""Parts of the package that hold no kernel and nothing that a kernel uses: an edit there compiles nothing anew."""

# numba reads the folder from its global settings while it decorates, and modules are imported by several threads.
_CACHE_DIR_LOCK = threading.Lock()


def cache_root() -> Path:
    """Return the folder for everything sinssim may keep between runs (`SINSSIM_CACHE`, else the XDG cache)."""
    explicit = os.environ.get("SINSSIM_CACHE")
    if explicit:
        return Path(explicit)
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "sinssim"


@cache
def _kernel_folder() -> str:
    package = Path(__file__).parent
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        name = source.relative_to(package)
        if name.parts[0] not in NO_KERNELS:
            digest.update(name.as_posix().encode())
            digest.update(source.read_bytes())
    root = cache_root() / "kernels"
    folder = root / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        # Keep a few older versions (several checkouts may be in use), drop the rest.
        for old in sorted(root.iterdir(), key=lambda path: path.stat().st_mtime)[:-6]:
            shutil.rmtree(old, ignore_errors=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        # numba's own places would do, but there it looks only at the kernel's own file, and serves it stale.
        _warn_once()
        return ""
    return str(folder)


@cache
def _warn_once() -> None:
    logger.warning(
        "the compiled kernels cannot be kept in %s: every start compiles them anew, which takes many seconds. Set "
        "SINSSIM_CACHE to a folder that can be written.",
        cache_root() / "kernels",
    )


def _jit(function: F, **options: Any) -> F:
    folder = _kernel_folder()
    with _CACHE_DIR_LOCK:
        previous = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = folder
        try:
            compiled = numba.njit(cache=bool(folder), nogil=True, error_model="numpy", **options)(function)
        finally:
            numba.config.CACHE_DIR = previous
    if folder:
        _forgive(compiled._cache)
    return compiled  # type: ignore[no-any-return]


def _forgive(kept: Any) -> None:
    """Let a damaged file of numba's cache count as none, and a full disk cost no more than the next compilation."""
    load, save = kept.load_overload, kept.save_overload

    def load_or_none(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # whatever unpickling makes of damaged bytes
            with contextlib.suppress(OSError):
                kept.flush()
            return None

    def save_if_possible(*arguments: Any) -> None:
        try:
            save(*arguments)
        except OSError:
            _warn_once()

    kept.load_overload, kept.save_overload = load_or_none, save_if_possible


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
