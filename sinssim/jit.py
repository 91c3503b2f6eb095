"""Compiles scalar kernels and caches them on disk under a digest of the source of each.

numba's own cache checks only the file of a kernel, not the functions that it calls, so an edited formula in another
file would have no effect. Here the key of a kernel is a digest of its byte code, its options, the values of its
globals, and the keys of the kernels among them. An edit causes compilation of the kernels that depend on it and of no
other, and checkouts with the same kernel share its compiled form. numba executes what a stored file contains, so each
file begins with a digest of its contents, which is verified before.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import pickle
import sys
import time
import types
from collections.abc import Callable, Iterator
from functools import _lru_cache_wrapper, cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import config, event
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
    _cache_log,
)
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

from sinssim.system.process import aside

logger = logging.getLogger(__name__)

_MOST = 2**28
"""Maximum size of the stored kernels, bytes: ten times that of all the kernels of one version."""
FORMAT = "digest before contents"
"""Form of the stored files; another one has other names."""
DIGEST_BYTES = 16


def cache_root() -> Path:
    """Return the folder for data kept between runs (`SINSSIM_CACHE`, or the XDG cache)."""
    explicit = os.environ.get("SINSSIM_CACHE")
    if explicit:
        return Path(explicit)
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "sinssim"


@cache
def kernel_folder() -> Path:
    """Return the folder of compiled kernels."""
    return cache_root() / "kernels"


@cache
def make_room() -> None:
    """Remove the least recently used kernels if the total size is too large; once per process."""
    stored: dict[str, list[tuple[Path, os.stat_result]]] = {}  # files by kernel
    for path in kernel_folder().iterdir():
        with contextlib.suppress(OSError):  # another process removes it
            stat = path.stat()
            stored.setdefault(path.name.split(".")[0], []).append((path, stat))
    total = sum(stat.st_size for files in stored.values() for _, stat in files)
    for files in sorted(stored.values(), key=lambda files: max(stat.st_mtime for _, stat in files)):
        if total <= _MOST:
            break
        for path, stat in files:
            total -= stat.st_size
            with contextlib.suppress(OSError):
                path.unlink()


@cache
def warn_once() -> None:
    """Warn that kernels cannot be stored; once per process."""
    logger.warning(
        "the compiled kernels cannot be stored in %s: every start compiles them anew, which takes many seconds. Set "
        "SINSSIM_CACHE to a writeable folder.",
        kernel_folder(),
    )


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc]
    """The place of the kernels: always our folder, which may be read-only, with our own names.

    numba uses a folder only if it can write there. Otherwise it uses its own places.
    """

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file = py_file
        self._cache_path = str(kernel_folder())

    def get_source_stamp(self) -> str:
        return ""  # the key says it all

    def get_disambiguator(self) -> str:
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator:
        return cls(py_func, py_file)


class Located(CompileResultCacheImpl):  # type: ignore[misc]
    """How kernels are stored: as numba does, at our place."""

    _locator_classes = (_Locator,)


class DamagedKernelError(Exception):
    """A stored kernel is not what was written."""


class CheckedFiles(IndexDataCacheFile):  # type: ignore[misc]
    """The index and the machine code of a kernel in files that begin with a digest, and code that says its signature.

    numba checks neither: it executes damaged code, or that of another signature, whose file two processes wrote at once
    under one name.
    """

    def save(self, key: Any, data: Any) -> None:
        """Store the code of a signature."""
        super().save(key, (key, data))

    def load(self, key: Any) -> Any:
        """Return the code of a signature; None if there is none."""
        entry = super().load(key)
        return entry[1] if entry is not None and entry[0] == key else None

    def _read(self, path: str) -> Any:
        with open(path, "rb") as file:
            digest, content = file.read(DIGEST_BYTES), file.read()
        if digest != content_digest(path, content):
            raise DamagedKernelError(path)
        return pickle.loads(content)

    def _write(self, path: str, value: Any) -> None:
        content = self._dump(value)
        with self._open_for_write(path) as file:
            file.write(content_digest(path, content) + content)

    def _load_index(self) -> dict[Any, str]:
        try:
            return dict(self._read(self._index_path))
        except FileNotFoundError:
            return {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, overloads)

    def _load_data(self, name: str) -> Any:
        data = self._read(self._data_path(name))
        _cache_log("[cache] data loaded from %r", self._data_path(name))
        return data

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)
        _cache_log("[cache] data saved to %r", self._data_path(name))


def content_digest(path: str, content: bytes) -> bytes:
    """Return the digest with which a file begins: `DIGEST_BYTES` bytes."""
    return hashlib.blake2b(content, digest_size=DIGEST_BYTES, key=os.path.basename(path).encode()[-64:]).digest()


F = TypeVar("F", bound=Callable[..., Any])

_DAY = 86_400.0
_ORDERED = {"nnan", "ninf", "nsz", "arcp", "contract"}
"""Liberties of the compiler with finite numbers, except for the order of operations."""
_KNOWN = sys.stdlib_module_names | {"numpy", "scipy", "numba", "llvmlite"}
"""Modules whose contents a kernel's key does not have; a user's own modules may change like those of sinssim."""
_OPTIONS = ("fastmath", "forceinline", "_nrt")
"""Options of compilation that the kernels here differ in."""


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]


def _key(value: Any, above: tuple[int, ...] = ()) -> str:
    """Return a digest of a value that a kernel refers to, from everything that the compiler uses.

    A value whose text differs between processes gives a key that is never met again. `above` are the plain functions
    through which the value was reached.
    """
    if isinstance(value, Dispatcher):
        cached = getattr(value, "_cache", None)
        return cached.key if isinstance(cached, _KernelCache) else _key(value.py_func, above)
    if isinstance(value, _lru_cache_wrapper):  # its text has its address
        value = value.__wrapped__
    if isinstance(value, types.FunctionType):
        if id(value) in above:
            return "recursive"
        above = (*above, id(value))
        code, names = _code(value.__code__), _names(value.__code__)
        used = [(name, value.__globals__[name]) for name in names if name in value.__globals__]
        inside = [cell.cell_contents for cell in value.__closure__ or ()]
        parts = [f"{n} {_of_module(v, names, above) if isinstance(v, types.ModuleType) else _key(v, above)}"
                 for n, v in used]  # fmt: skip
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
    """Return the key of what a function may use of a module; for those of `_KNOWN` numba's version suffices."""
    if module.__name__.split(".")[0] in _KNOWN:
        return module.__name__
    return _digest(module.__name__, *(f"{n} {_key(getattr(module, n), above)}" for n in names if hasattr(module, n)))


def _code(code: types.CodeType) -> str:
    constants = [_code(c) if isinstance(c, types.CodeType) else f"{type(c).__qualname__} {c!r}" for c in code.co_consts]
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_argcount
    return _digest(code.co_code.hex(), repr(names), *constants)


def _names(code: types.CodeType) -> list[str]:
    inside = (_names(c) for c in code.co_consts if isinstance(c, types.CodeType))
    return sorted({*code.co_names}.union(*inside))


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """A cache that ignores damaged files and, if it cannot be written, compiles instead of raising an error."""

    _impl_class = Located

    def __init__(self, compiled: Dispatcher) -> None:
        super().__init__(compiled.py_func)
        options = compiled.targetoptions.items()  # the order of a set differs between processes
        self._options = _key(sorted((name, repr(sorted(o) if isinstance(o, set) else o)) for name, o in options))
        self._own_key = ""

    @property
    def key(self) -> str:
        """Digest of what the kernel is compiled from, taken when it is first asked for: all globals are set by then."""
        if not self._own_key:
            self._own_key = "recursive"  # for a kernel that calls itself
            checked = str(config.BOUNDSCHECK)  # indices, for all kernels (NUMBA_BOUNDSCHECK)
            self._own_key = _digest(numba.__version__, FORMAT, checked, self._options, _key(self._py_func))
        return self._own_key

    def _look_up(self) -> None:
        name = "".join(c for c in self._py_func.__name__ if c not in "<>.")
        self._cache_file = CheckedFiles(self._cache_path, f"{name}-{self.key}", "")

    def load_overload(self, *arguments: Any) -> Any:
        self._look_up()
        try:
            result = super().load_overload(*arguments)
            index = self._cache_file._index_path
            if result is not None and time.time() - os.path.getmtime(index) > _DAY:
                with contextlib.suppress(OSError):  # read-only
                    os.utime(index)
            return result
        except OSError:
            return None
        except (ModuleNotFoundError, AttributeError):  # stored by a version whose modules or classes have other names
            with contextlib.suppress(OSError):
                self.flush()
            return None
        except Exception as error:  # also whatever unpickling makes of another program's bytes
            file = error if isinstance(error, DamagedKernelError) else self._cache_file._index_path
            logger.warning("the compiled kernel in %s is damaged: it is compiled again.", file)
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, *arguments: Any) -> None:
        self._look_up()
        try:
            super().save_overload(*arguments)
            make_room()
        except (ModuleNotFoundError, AttributeError):  # such a version has stored it again meanwhile
            with contextlib.suppress(OSError):
                self.flush()
        except OSError:
            warn_once()


def _jit(function: F, **options: Any) -> F:
    compiled = numba.njit(nogil=True, error_model="numpy", **options)(function)
    compiled._cache = _KernelCache(compiled)
    compile_now = compiled.compile
    compiled.compile = lambda signature: aside(lambda: compile_now(signature))
    return compiled  # type: ignore[no-any-return]


class _Listener(event.Listener):  # type: ignore[misc]
    """Is notified of compilations and of nested ones; only one thread compiles at a time."""

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


@intrinsic  # type: ignore[untyped-decorator]
def wide_vectors(typing_context: Any) -> Any:
    """Let the compiler use the widest vector registers in the kernel that calls it.

    LLVM takes half of them on processors that once slowed down under wide ones; a loop of hundreds of operations
    without branches over many runs gains a quarter by wide ones.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # llvmlite's own `add` knows the attributes without a value only
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return numba.types.none(), generate


@intrinsic  # type: ignore[untyped-decorator]
def fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c of floats, rounded once, on every machine alike; one operation where the processor has it."""
    return a(a, a, a), lambda context, builder, signature, arguments: builder.fma(*arguments)


@contextlib.contextmanager
def compilation(tell: Callable[[bool], None]) -> Iterator[None]:
    """Report compilations of kernels that are missing in the cache, inside the block.

    `tell` is called with True when one begins and with False when it ends, in any thread.
    """
    with event.install_listener("numba:compile", _Listener(tell)):
        yield


def kernel(function: F) -> F:
    """Compile a scalar kernel, cached on disk, that releases the GIL and assumes finite numbers (check them before)."""
    return _jit(function, fastmath=True)


def strict_kernel(function: F) -> F:
    """Compile a kernel that must handle NaN and infinities and keep the written order of operations."""
    return _jit(function, fastmath=False)


def inline(function: F) -> F:
    """Compile a scalar function that is always inlined into the kernel that calls it; it assumes finite numbers.

    Sums and products keep their written order: reordered ones took 5 % longer. Which products are fused with sums is up
    to the compiler.
    """
    return _jit(function, fastmath=_ORDERED, forceinline=True)


def strict_inline(function: F) -> F:
    """Like `inline`, but with the written order of operations in any kernel that calls it.

    It may take arrays but not make any: numba does not count references in it, which would take longer than the
    arithmetic.
    """
    # by default numba would use the caller's setting
    return _jit(function, fastmath=False, forceinline=True, _nrt=False)


def _options(compiled: Any) -> dict[str, Any]:
    """Return the options of a compiled function for a copy of it."""
    return {key: value for key, value in compiled.targetoptions.items() if key in _OPTIONS}


def _is_compiled(value: Any) -> bool:
    """Return whether a value is a compiled function, or takes the place of one."""
    return hasattr(value, "py_func")


def rebound(function: Any, name: str, **parts: Any) -> Any:
    """Return a copy of a function with other values at global names, its own and those of all that it calls.

    A plain function gives a plain copy, a compiled one a compiled copy with the same options. A compiled function that
    neither uses the names nor calls what does is returned itself.
    """
    compiled = _is_compiled(function)
    plain = function.py_func if compiled else function
    new = {}
    for used in _names(plain.__code__):
        value = plain.__globals__.get(used)
        if used in parts:
            new[used] = parts[used]
        elif _is_compiled(value):
            made = rebound(value, f"{used}_{name}", **parts)
            if made is not value:
                new[used] = made
    if compiled and not new:
        return function
    copy = types.FunctionType(plain.__code__, {**plain.__globals__, **new}, name, plain.__defaults__)
    copy.__qualname__ = name
    copy.__module__ = plain.__module__
    return _jit(copy, **_options(function)) if compiled else copy


def bind(template: Callable[..., Any], name: str, **parts: Any) -> Callable[..., Any]:
    """Make a kernel from a plain function by fixing some of its global names to compiled functions or numbers (a name
    unique among the copies of this template).

    numba does not cache closures over other compiled functions, but caches functions of globals. An engine is therefore
    written once as a plain function with global names for its parts, and every combination of parts is a copy of it
    with its own name. All functions that it calls get the parts as well.
    """
    made: Callable[..., Any] = rebound(template, name, **parts)
    return kernel(made)
