"""User extensions, which are files outside the package: what a project folder may hold, and the running of a file.

What a file brings is read from its syntax tree, without executing it. A failure of a file that is run becomes a
sentence with file and line.
"""

from __future__ import annotations

import ast
import difflib
import functools
import hashlib
import importlib.util
import os
import re
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from sinssim.errors import InputError, SinssimError, shortened
from sinssim.system.files import read_bytes
from sinssim.units import listed

SINGULAR: dict[str, str] = {
    "algorithms": "attitude algorithm",
    "frames": "navigation frame",
    "aiding": "aiding sensor",
    "filters": "filter",
    "legs": "leg",
    "formats": "file format",
    "writers": "export format",
    "views": "view",
    "grades": "grade of sensors",
    "aircraft": "aircraft",
}
"""Folders of a project by name, with what one of their files is."""

NAVIGATORS = "navigators"
"""Folder of a project with the programs and libraries of [[navigator]], which are started without asking."""

CODE = ("algorithms", "frames", "aiding", "filters", "legs", "formats", "writers", "views")
"""Folders whose files are Python code, which runs when their content is used."""

_MARKS: dict[str, set[str]] = {
    "formats": {"recognises"},
    "writers": {"HOLDS"},
    "algorithms": {"start_k", "dcm_k", "step_k", "quaternion_k", "engine"},
    "frames": {"solve", "check"},
    "filters": {"Filter"},
    "views": {"blueprint"},
}
"""Names at the top of a file by which its kind is recognised."""

_NAME = re.compile(r"[A-Za-z][\w-]*", re.ASCII)


@dataclass(frozen=True)
class Item:
    """One algorithm, frame, aiding sensor, filter, leg, view, grade or aircraft outside the package."""

    kind: str  # folder of a project that it belongs in, one of `SINGULAR`
    name: str  # its name, that of the file without its ending, or that of an aircraft's folder
    file: Path  # its file; an aircraft's is its aircraft.toml
    package: str = ""  # the installed package that brings it, with its version; "" if no package does

    @property
    def words(self) -> str:
        """What it is, for messages: "attitude algorithm midpoint"."""
        return f"{SINGULAR.get(self.kind, 'navigator')} {self.name}"


@dataclass(frozen=True)
class Outline:
    """What a Python file says of itself without being executed."""

    sentence: str = ""  # first line of its docstring
    # names of functions, classes and values at its top level, imported ones included
    names: frozenset[str] = frozenset()
    bases: frozenset[str] = frozenset()  # names of the base classes of its classes
    constants: tuple[tuple[str, Any], ...] = ()  # numbers, truth values and texts at its top level, by name
    problem: str = ""  # why it cannot be read as Python, "" if it can

    def constant(self, name: str, otherwise: Any) -> Any:
        """Return the value of a constant of the file, or another one if it has none."""
        return dict(self.constants).get(name, otherwise)


def outline(file: Path) -> Outline:
    """Read what a Python file says of itself, without executing it: its outline; of a file that cannot be read, the
    reason."""
    try:
        tree = ast.parse(read_bytes(file), str(file))
    except SyntaxError as error:
        return Outline(problem=syntax_words(error))
    except (RecursionError, MemoryError):  # of the parser
        return Outline(problem="its expressions are nested too deep for Python")
    except (OSError, ValueError) as error:
        return Outline(problem=f"{type(error).__name__}: {error}")
    names, bases, constants = set[str](), set[str](), dict[str, Any]()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            bases |= {base.id if isinstance(base, ast.Name) else getattr(base, "attr", "") for base in node.bases}
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else (node.target,):
                if isinstance(target, ast.Name):
                    names.add(target.id)
                    if isinstance(node.value, ast.Constant):
                        constants[target.id] = node.value.value
    sentence = (ast.get_docstring(tree) or "").split("\n")[0]
    return Outline(sentence, frozenset(names), frozenset(bases), tuple(constants.items()))


def syntax_words(error: SyntaxError) -> str:
    """Return Python's syntax error in words: "syntax error in line 3: invalid syntax, in: x = = 2"."""
    where = f" in line {error.lineno}" if error.lineno else ""
    shown = f", in:  {shortened(error.text.strip())}" if error.text else ""
    return f"syntax error{where}: {error.msg}{shown}"


def items_of(path: Path) -> list[Item]:
    """Return what a file, the folder of an aircraft, or a project folder with some of the folders of `SINGULAR` brings.
    Names that begin with "_" or "." are left out."""
    if os.path.isfile(path):
        return [_item(_kind_of(path), path)]
    if not os.path.isdir(path):
        raise InputError(f"there is no file or folder {shortened(str(path), 200)!r}")
    if (path / "aircraft.toml").is_file():
        return [_item("aircraft", path / "aircraft.toml")]
    items = [item for kind in SINGULAR for item in _in_folder(path / kind, kind)]
    if not items and not (path / NAVIGATORS).is_dir():
        raise InputError(
            f"the folder {shortened(str(path), 200)!r} has none of the folders {listed(SINGULAR, 'or')} with a file in "
            f"it{_misspelt(path)}"
        )
    return items


def _misspelt(path: Path) -> str:
    """Return which folders may be meant by those that there are, as the end of a sentence."""
    there = sorted(entry.name for entry in os.scandir(path) if entry.is_dir())
    near = [(name, near[0]) for name in there if (near := difflib.get_close_matches(name.lower(), SINGULAR, 1))]
    wrong = [f"{name!r} as {kind!r}" for name, kind in near if name != kind]
    return f"; did you mean {listed(wrong)}?" if wrong else ""


def _in_folder(folder: Path, kind: str) -> Iterator[Item]:
    pattern = {"aircraft": "*/aircraft.toml", "grades": "*.toml"}.get(kind, "*.py")
    for file in sorted(folder.glob(pattern)):
        name = file.parent.name if kind == "aircraft" else file.stem
        if not name.startswith(("_", ".")):
            yield _item(kind, file)


def _item(kind: str, file: Path) -> Item:
    name = file.parent.name if kind == "aircraft" else file.stem
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{file}: the {SINGULAR[kind]} would have the name {shortened(repr(name))}; a name begins with a letter "
            "and has letters, digits, _ and - only. Rename the file"
        )
    return Item(kind, name, file)


def _kind_of(file: Path) -> str:
    """Return the kind of a file: by its folder's name, or by what stands in it."""
    if file.name == "aircraft.toml":
        return "aircraft"
    if file.suffix == ".toml":
        return "grades"
    if file.suffix != ".py":
        raise InputError(f"{file} is not a Python file (.py), nor the TOML file of a grade or of an aircraft")
    if file.parent.name in CODE:
        return file.parent.name
    content = outline(file)
    if content.problem:
        raise InputError(f"{file} cannot be read: {content.problem}")
    for base, kind in (("AidingSensor", "aiding"), ("LegBase", "legs")):
        if base in content.bases:
            return kind
    for kind, marks in _MARKS.items():
        if marks & content.names:
            return kind
    raise InputError(
        f"{file} is nothing that sinssim can use: an attitude algorithm has functions start_k, dcm_k, step_k and "
        "quaternion_k, a navigation frame solve and check, a view blueprint, a file format recognises and read, an "
        "export format SUFFIX, HOLDS and write, a filter a class Filter, an aiding sensor a class that derives from "
        "AidingSensor, and a leg one that derives from LegBase"
    )


PREFIX = "sinssim_own"
"""Package name of the modules of own content, by which compiled kernels on disk find them again."""

_sources: dict[str, bytes] = {}
_lock = threading.RLock()


def file_digest(file: Path) -> str:
    """Return the SHA-256 of a file: 64 hexadecimal digits."""
    try:
        return hashlib.sha256(read_bytes(file)).hexdigest()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from error


def _module_name(item: Item) -> str:
    return f"{PREFIX}.{item.kind}.{item.name}"


def load_module(item: Item) -> ModuleType:
    """Run the file of own content, once for each state of it."""
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


def classes_in(module: ModuleType, base: type) -> list[Any]:
    """Return the classes that a module defines and that derive from a base, in the order of their definition."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, base) and value.__module__ == module.__name__
    ]


def class_in(module: ModuleType, base: type, wrong: str) -> Any:
    """Return the only class of a file that derives from a base; an InputError begins with `wrong`."""
    classes = classes_in(module, base)
    if len(classes) != 1:
        names = listed([item.__name__ for item in classes]) if classes else "there is none"
        raise InputError(f"{wrong}: it must have one class that derives from {base.__name__}; {names}.")
    return classes[0]


def source_of(item: Item) -> bytes:
    """Return the text of own content as it was run, or as the file is now if it has not been run."""
    if (source := _sources.get(_module_name(item))) is not None:
        return source
    return read_bytes(item.file)


def drop_module(item: Item) -> None:
    """Forget the module of own content, so that its file is run again."""
    _sources.pop(_module_name(item), None)
    sys.modules.pop(_module_name(item), None)


def explained(
    item: Item,
    function: Callable[..., Any],
    kind: type[SinssimError] = InputError,
    passed: type[Exception] = SinssimError,
) -> Callable[..., Any]:
    """Return a function of own content whose failures name the file and the line, except for errors of `passed`."""

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except (SinssimError, passed):
            raise
        except Exception as error:  # raised by the user's code
            raise kind(f"the {item.words} failed: {failure(item.file, error)}.") from error

    return call


def failure(file: Path, error: BaseException) -> str:
    """Return what went wrong in a file as words, with the line of the file: for example "/my/file.py, line 7:
    ZeroDivisionError: division by zero"."""
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return f"{file}: {syntax_words(error)}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    where = f", line {lines[-1]}" if lines else ""
    text = " ".join(str(error).split()).rstrip(".")
    return f"{file}{where}: {type(error).__name__}: {shortened(text, 300)}"
