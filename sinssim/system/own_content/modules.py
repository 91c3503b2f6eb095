"""Runs the Python file of own content; whatever goes wrong in it becomes a sentence with file and line."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from sinssim.errors import InputError, SinssimError, shortened
from sinssim.system.own_content.layout import Item, syntax_words
from sinssim.system.user_file import read_bytes

PREFIX = "sinssim_own"
"""Package name of the modules of own content, by which compiled kernels on disk find them again."""

_sources: dict[str, bytes] = {}
_lock = threading.RLock()


def file_digest(file: Path) -> str:
    """Return the SHA-256 of a file.

    Returns:
        64 hexadecimal digits.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        return hashlib.sha256(read_bytes(file)).hexdigest()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from error


def _module_name(item: Item) -> str:
    return f"{PREFIX}.{item.kind}.{item.name}"


def load_module(item: Item) -> ModuleType:
    """Run the file of own content, once for each state of it.

    Raises:
        InputError: the file cannot be run; the message has the file, the line and the reason.
    """
    with _lock:
        return _load(item, _module_name(item))


def _load(item: Item, name: str) -> ModuleType:
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, item.file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # pydantic and numba look up a module by its name
    try:
        # not by the loader, which may take compiled code of an earlier file of the same second and size
        source = read_bytes(item.file)
        exec(compile(source, str(item.file), "exec"), module.__dict__)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, Exception | SystemExit):
            raise InputError(f"the {item.words} cannot be used: {failure(item.file, error)}.") from error
        raise
    _sources[name] = source
    return module


def source_of(item: Item) -> bytes:
    """Return the text of own content as it was run, or as the file is now if it has not been run.

    Returns:
        The bytes of the file.
    """
    if (source := _sources.get(_module_name(item))) is not None:
        return source
    return read_bytes(item.file)


def drop_module(item: Item) -> None:
    """Forget the module of own content, so that its file is run again."""
    _sources.pop(_module_name(item), None)
    sys.modules.pop(_module_name(item), None)


def explained(item: Item, function: Callable[..., Any], kind: type[SinssimError] = InputError) -> Callable[..., Any]:
    """Return a function of own content whose failures name the file and the line."""

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except SinssimError:
            raise
        except Exception as error:  # raised by the user's code
            raise kind(f"the {item.words} failed: {failure(item.file, error)}.") from error

    return call


def failure(file: Path, error: BaseException) -> str:
    """Return what went wrong in a file as words, with the line of the file.

    Returns:
        For example "/my/file.py, line 7: ZeroDivisionError: division by zero".
    """
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return f"{file}: {syntax_words(error)}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    where = f", line {lines[-1]}" if lines else ""
    said = " ".join(str(error).split()).rstrip(".")
    return f"{file}{where}: {type(error).__name__}: {shortened(said, 300)}"
