"""The stored files of compiled kernels: their folder, its size, and a digest of the contents of each.

numba executes what a file has. A digest of the contents is therefore verified before.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, IndexDataCacheFile, UserProvidedCacheLocator, _cache_log

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
    kept: dict[str, list[tuple[Path, os.stat_result]]] = {}  # files by kernel
    for path in kernel_folder().iterdir():
        with contextlib.suppress(OSError):  # another process removes it
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
        """Return the code of a signature; None if there is none.

        Raises:
            DamagedKernelError: a file is not what was written.
            OSError: the folder cannot be read.
        """
        found = super().load(key)
        return found[1] if found is not None and found[0] == key else None

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
        found = self._read(self._data_path(name))
        _cache_log("[cache] data loaded from %r", self._data_path(name))
        return found

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)
        _cache_log("[cache] data saved to %r", self._data_path(name))


def content_digest(path: str, content: bytes) -> bytes:
    """Return the digest with which a file begins.

    Returns:
        `DIGEST_BYTES` bytes.
    """
    return hashlib.blake2b(content, digest_size=DIGEST_BYTES, key=os.path.basename(path).encode()[-64:]).digest()
