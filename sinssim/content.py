"""Finds content, which is files in folders: aircraft, scenarios, studies, grades of sensors and views.

The lookup is the same for a checkout, an installed package and a user's folder. It tries, in this order, the given
path, the folder KIND below the current folder, the project folders that `SINSSIM_CONTENT` names, installed packages
with the entry point `sinssim.content`, and the content of the package. The list of installed packages is read only if
a name is unknown or names are listed, because that takes longer than everything else at start-up.

Views are code. They are never searched in the current folder, only in the folders that `SINSSIM_VIEWS` and
`SINSSIM_CONTENT` name and in installed packages with content. `new_project` creates a project folder from the
package's example.
"""

from __future__ import annotations

import importlib.util
import logging
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal

import sinssim
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.system.extensions import Item, items_of
from sinssim.system.files import read_text

logger = logging.getLogger(__name__)

GROUP = "sinssim.content"
"""Group of entry points: the value of each is a package with the folders of a project."""

VARIABLE = "SINSSIM_CONTENT"
"""Environment variable with files and project folders, as absolute paths separated like those of PATH."""


def named_paths() -> list[Path]:
    """Return the files and folders that the environment variable names by absolute paths; others are left out with a
    warning."""
    paths = []
    for name in os.environ.get(VARIABLE, "").split(os.pathsep):
        path = Path(name).expanduser()
        if name and path.is_absolute() and path.exists():
            paths.append(path)
        elif name:
            what = "does not exist" if path.is_absolute() else "is not an absolute path"
            warn_once(f"{VARIABLE} names {path}, which {what}: it is ignored.")
    return paths


@cache
def warn_once(text: str) -> None:
    """Warn of something once in a process."""
    logger.warning("%s", text)


@cache
def _of_packages() -> tuple[Item, ...]:
    """Return the content of the installed packages; one that cannot be used costs its own content only."""
    from importlib.metadata import entry_points

    items: list[Item] = []
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        package = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.name
        try:
            spec = importlib.util.find_spec(entry.value)
            places = list(spec.submodule_search_locations or ()) if spec else []
            if not places:
                raise InputError(f"there is no package {entry.value}")
            items += [replace(item, package=package) for place in places for item in items_of(Path(place))]
        except Exception as error:  # whatever importing the package's parent raises
            reason = str(error).rstrip(".")
            warn_once(
                f"The installed package {package} provides content ({entry.name} = {entry.value!r} in the entry points "
                f"{GROUP}) that cannot be used: {type(error).__name__}: {reason}. It is left out."
            )
    return tuple(items)


def _all(packages: bool) -> Iterator[Item]:
    for path in named_paths():
        try:
            yield from items_of(path)
        except InputError as error:
            warn_once(f"{VARIABLE}: {error}. It is left out.")
    if packages:
        yield from _of_packages()


def offered(kind: str, *, packages: bool = True) -> dict[str, Item]:
    """Return the content of one kind, by name, from the environment variable and from installed packages.

    Of two with the same name the first counts, and a warning names the other: the environment variable comes first,
    then the packages in the order of their entry points.
    """
    items: dict[str, Item] = {}
    for item in _all(packages):
        if item.kind != kind:
            continue
        first = items.setdefault(item.name, item)
        if first.file != item.file:
            warn_once(f"Two files define the {item.words}: {first.file} is used, {item.file} is ignored.")
    return items


Kind = Literal["aircraft", "scenarios", "studies", "grades", "viz"]

_FOLDERS: dict[Kind, str] = {
    "aircraft": "aircraft",
    "scenarios": "scenarios",
    "studies": "scenarios/studies",
    "grades": "scenarios/grades",
    "viz": "viz",
}
_SUFFIXES: dict[Kind, str] = {"aircraft": "", "scenarios": ".toml", "studies": ".toml", "grades": ".toml", "viz": ".py"}
_SINGULAR: dict[Kind, str] = {
    "aircraft": "aircraft",
    "scenarios": "scenario",
    "studies": "study",
    "grades": "grade",
    "viz": "view",
}


def package_content(kind: Kind) -> Path:
    """Return the existing folder of the package's own content ("aircraft", "scenarios", "studies", "grades" or "viz"):
    inside a wheel, or beside the package in a checkout."""
    package = Path(sinssim.__file__).resolve().parent
    installed = package / "_content" / _FOLDERS[kind]
    return installed if installed.is_dir() else package.parent / _FOLDERS[kind]


def _entry(folder: Path, kind: Kind, name: str) -> Path:
    """Return the path of the content with this name in a folder."""
    if kind == "aircraft":
        return folder / name / "aircraft.toml"
    return folder / (name + _SUFFIXES[kind])


def _own_folders(kind: Kind) -> list[Path]:
    """Return the folders of the user's own content, which takes precedence over the package's."""
    if kind != "viz":
        return [Path.cwd() / _FOLDERS[kind]]
    named = [Path(name).expanduser() for name in os.environ.get("SINSSIM_VIEWS", "").split(os.pathsep) if name]
    for folder in named:
        if not (folder.is_absolute() and folder.is_dir()):
            what = "does not exist" if folder.is_absolute() else "is not an absolute path"
            warn_once(f"SINSSIM_VIEWS names the folder {folder}, which {what}: the folder is ignored.")
    return [folder for folder in reversed(named) if folder.is_absolute()]  # the first folder takes precedence


_OWN: dict[Kind, str] = {"aircraft": "aircraft", "grades": "grades", "viz": "views"}
"""Folder of a project with the same kind of content."""


def list_content(kind: Kind, *, packages: bool = True) -> dict[str, Path]:
    """List content by name; the user's own content takes precedence over the package's.

    The user's content lies in the current folder, in the project folders that the environment variable
    `SINSSIM_CONTENT` names, and in installed packages with content. The user's views, which are code, lie in the
    latter and in the folders that the environment variable `SINSSIM_VIEWS` names.

    Args:
        kind: "aircraft", "scenarios", "studies", "grades" or "viz".
        packages: whether to include that of installed packages, whose list takes a moment to read.

    Returns:
        File by name, sorted by name: a scenario's or study's TOML file, a view's Python file, an aircraft's
        aircraft.toml.
    """
    files: dict[str, Path] = {}
    offers = offered(_OWN[kind], packages=packages) if kind in _OWN else {}
    for folder in (package_content(kind), *_own_folders(kind)):
        pattern = _entry(folder, kind, "*").relative_to(folder).as_posix()
        for file in folder.glob(pattern):
            name = file.parent.name if kind == "aircraft" else file.stem
            if name.startswith(("_", ".")):
                continue
            if name in files and package_content(kind) not in files[name].parents:
                warn_once(f"There are two {_SINGULAR[kind]}s named {name}: {file} is used, {files[name]} is ignored.")
            files[name] = file
    for name, item in offers.items():
        if name not in files or package_content(kind) in files[name].parents:
            files[name] = item.file
    return dict(sorted(files.items()))


def _is_file(path: Path) -> bool:
    """Return whether a file exists; a name that the system refuses counts as missing."""
    try:
        return path.is_file()
    except OSError:
        return False


def find_content(kind: Kind, name: str) -> Path:
    """Find one scenario, study, view or aircraft by path or by name.

    Args:
        kind: "aircraft", "scenarios", "studies", "grades" or "viz".
        name: a path (of a file, or of an aircraft's folder), or a name as in `sinssim list`; a path such as
            "scenarios/first_flight.toml" that does not exist also finds the package's file.

    Returns:
        The file: a scenario's or study's TOML file, a view's Python file, an aircraft's aircraft.toml.

    Raises:
        InputError: there is no such file or name; the message lists the known names.
    """
    suffix = _SUFFIXES[kind]
    given = Path(name)
    with suppress(RuntimeError):  # there is no system user of that name
        given = given.expanduser()
    if kind == "aircraft" and _is_file(given / "aircraft.toml"):
        return given / "aircraft.toml"
    if _is_file(given) and (given.suffix == suffix or given.name == "aircraft.toml"):
        return given
    plain = given.name if kind == "aircraft" else given.name.removesuffix(suffix)
    known = list_content(kind, packages=False)
    if plain not in known:
        known = list_content(kind)
    if plain in known and str(given.parent) in (".", _FOLDERS[kind]):
        return known[plain]
    if _is_file(given) and suffix:
        raise InputError(f"{name} is not a {_SINGULAR[kind]}: the name of a {_SINGULAR[kind]} file ends in {suffix}.")
    if given.parent != Path(".") or (suffix and name.endswith(suffix)):
        raise InputError(
            f"there is no {_SINGULAR[kind]} file {shortened(name)!r} in {Path.cwd()}. Known names: {', '.join(known)}."
        )
    raise unknown_name(_SINGULAR[kind], name, known)


_FILES = {
    "README.md": "what everything is, and what to type",
    "scenario.toml": "what to simulate",
    "grades/my_unit.toml": "your own sensors",
    "algorithms/cayley.py": "your own attitude algorithm",
    "filters/complementary.py": "your own filter",
    "views/attitude.py": "your own view",
}
"""Files of the example, with what they are."""


LANGUAGES: dict[str, tuple[str, str, str]] = {
    "c": ("my_navigator.c", "cc -O2 -shared -fPIC -o libmy_navigator.so my_navigator.c -lm",
          'library = "navigators/libmy_navigator.so"'),
    "c++": ("my_navigator.cpp", "c++ -O2 -shared -fPIC -o libmy_navigator.so my_navigator.cpp",
            'library = "navigators/libmy_navigator.so"'),
    "python": ("my_navigator.py", "", 'command = ["./navigators/my_navigator.py"]'),
    "octave": ("my_navigator.m", "", 'command = ["./navigators/my_navigator.m"]\nform = "text"'),
    "rust": ("my_navigator.rs", "rustc --edition 2021 -O my_navigator.rs", 'command = ["./navigators/my_navigator"]'),
}  # fmt: skip
"""Languages of the navigators that are written as examples: file, how it is compiled, and its keys in a scenario."""


def new_navigator(folder: Path, language: str) -> tuple[list[tuple[str, str]], str]:
    """Lay out a project folder with a navigator in a language; return what each file is, by its path, and how it is
    compiled in the folder `navigators`."""
    file, build, keys = LANGUAGES[language]
    names = {"scenario.toml": "what to simulate", f"navigators/{file}": "your navigator"}
    if language in ("c", "c++"):
        names["navigators/sinssim_navigator.h"] = "the messages, as structures"
    example = package_content("scenarios") / "new_navigator"
    sources = {path.name: path for path in example.rglob("*") if path.is_file()}
    _lay_out({name: sources[Path(name).name] for name in names}, folder)
    text = read_text(sources["scenario.toml"]) + f'[[navigator]]\nname = "mine"\n{keys}\ninputs = ["imu"]\n'
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    if not build:
        (folder / "navigators" / file).chmod(0o755)
    return list(names.items()), build


def new_project(folder: Path) -> list[tuple[str, str]]:
    """Lay out a project folder, which is made if it does not exist; return what each file is, by its path."""
    example = package_content("scenarios") / "new_project"
    _lay_out({name: example / name for name in _FILES}, folder)
    return list(_FILES.items())


def _lay_out(sources: Mapping[str, Path], folder: Path) -> None:
    """Copy files to their places in a folder, which is made if it does not exist."""
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    begun = False
    try:
        if folder.is_dir():
            there = sorted(path.name for path in folder.iterdir())
            if there:
                shown = ", ".join(there[:3]) + (f" and {len(there) - 3} more" if len(there) > 3 else "")
                raise InputError(f"the folder {folder} is not empty: it has {shown}. Name a new folder.")
        elif folder.exists():
            raise InputError(f"{folder} is a file. Name a new folder.")
        begun = True
        for name, source in sources.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, folder / name)
    except OSError as error:
        if begun:
            _remove(sources, folder, made)
        raise InputError(
            f"the project folder {folder} cannot be made: {error.strerror}. Name another folder."
        ) from error


def _remove(names: Iterable[str], folder: Path, made: Iterable[Path]) -> None:
    """Remove the files of an example from a folder that was empty, and the folders that were made."""
    for name in names:
        with suppress(OSError):
            (folder / name).unlink()
    for place in (*sorted({(folder / name).parent for name in names} - {folder}), *made):
        with suppress(OSError):  # it may not exist
            place.rmdir()
