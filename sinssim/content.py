"""Finds content, which is files in folders: aircraft, scenarios, studies, grades of sensors and views.

The lookup is the same for a checkout, an installed package and a user's folder. It tries, in this order, the given
path, the folder KIND below the current folder, project folders and installed packages (`sinssim.system.own_content`),
and the content of the package.

Views are code. They are never searched in the current folder, only in the folders that `SINSSIM_VIEWS` and
`SINSSIM_CONTENT` name and in installed packages with content.
"""

from __future__ import annotations

import logging
import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

import sinssim
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.system.own_content.installed import offered

logger = logging.getLogger(__name__)

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
    """Return the folder of the package's own content: inside a wheel, or beside the package in a checkout.

    Args:
        kind: "aircraft", "scenarios", "studies", "grades" or "viz".

    Returns:
        The folder; it exists in every sound installation.
    """
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
            _warn_once(folder)
    return [folder for folder in reversed(named) if folder.is_absolute()]  # the first folder takes precedence


@cache
def _warn_once(folder: Path) -> None:
    what = "does not exist" if folder.is_absolute() else "is not an absolute path"
    logger.warning("SINSSIM_VIEWS names the folder %s, which %s: the folder is ignored.", folder, what)


@cache
def warn_of_two(what: str, name: str, used: Path, left_out: Path) -> None:
    """Warn once that two of the user's own files have the same name.

    Args:
        what: kind of content, for example "view".
    """
    logger.warning("There are two %ss named %s: %s is used, %s is ignored.", what, name, used, left_out)


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
    found: dict[str, Path] = {}
    offers = offered(_OWN[kind], packages=packages) if kind in _OWN else {}
    for folder in (package_content(kind), *_own_folders(kind)):
        pattern = _entry(folder, kind, "*").relative_to(folder).as_posix()
        for file in folder.glob(pattern):
            name = file.parent.name if kind == "aircraft" else file.stem
            if name.startswith(("_", ".")):
                continue
            if name in found and package_content(kind) not in found[name].parents:
                warn_of_two(_SINGULAR[kind], name, file, found[name])
            found[name] = file
    for name, item in offers.items():
        if name not in found or package_content(kind) in found[name].parents:
            found[name] = item.file
    return dict(sorted(found.items()))


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
