"""Finds content: aircraft, scenarios, studies and views, which are files in folders.

One lookup serves a checkout, an installed package and a folder of the user's own, in this order: a path that was
given, the folder KIND below the current folder, the content that comes with the package.

Views are code: the current folder is never searched for them, only the folders that `SINSSIM_VIEWS` names.
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

logger = logging.getLogger(__name__)

Kind = Literal["aircraft", "scenarios", "studies", "viz"]

_FOLDERS: dict[Kind, str] = {
    "aircraft": "aircraft",
    "scenarios": "scenarios",
    "studies": "scenarios/studies",
    "viz": "viz",
}
_SUFFIXES: dict[Kind, str] = {"aircraft": "", "scenarios": ".toml", "studies": ".toml", "viz": ".py"}
_SINGULAR: dict[Kind, str] = {"aircraft": "aircraft", "scenarios": "scenario", "studies": "study", "viz": "view"}


def package_content(kind: Kind) -> Path:
    """Return the folder of the package's own content: inside a wheel, or beside the package in a checkout.

    Args:
        kind: "aircraft", "scenarios", "studies" or "viz".

    Returns:
        The folder; it exists in every sound installation.
    """
    package = Path(sinssim.__file__).resolve().parent
    installed = package / "_content" / _FOLDERS[kind]
    return installed if installed.is_dir() else package.parent / _FOLDERS[kind]


def _entry(folder: Path, kind: Kind, name: str) -> Path:
    """Return the path that content of this name has in a folder."""
    if kind == "aircraft":
        return folder / name / "aircraft.toml"
    return folder / (name + _SUFFIXES[kind])


def _own_folders(kind: Kind) -> list[Path]:
    """Return the folders of a user's own content, which takes precedence over the package's."""
    if kind != "viz":
        return [Path.cwd() / _FOLDERS[kind]]
    named = [Path(name).expanduser() for name in os.environ.get("SINSSIM_VIEWS", "").split(os.pathsep) if name]
    for folder in named:
        if not (folder.is_absolute() and folder.is_dir()):
            _warn_once(folder)
    return [folder for folder in reversed(named) if folder.is_absolute()]  # the first one named wins


@cache
def _warn_once(folder: Path) -> None:
    what = "does not exist" if folder.is_absolute() else "is no absolute path"
    logger.warning("SINSSIM_VIEWS names the folder %s, which %s: no view is taken from it.", folder, what)


@cache
def warn_of_two(what: str, name: str, used: Path, left_out: Path) -> None:
    """Warn once that two of a user's own files have one name.

    Args:
        what: what they are: "view", for example.
        name: their name.
        used: the file that is used.
        left_out: the other one.
    """
    logger.warning("There are two %ss named %s: %s is used, %s is left out.", what, name, used, left_out)


def list_content(kind: Kind) -> dict[str, Path]:
    """List content by name; a user's own takes precedence over the package's.

    The user's own lies in the current folder; own views, which are code, lie in the folders that the environment
    variable `SINSSIM_VIEWS` names.

    Args:
        kind: "aircraft", "scenarios", "studies" or "viz".

    Returns:
        File by name, sorted by name: a scenario's or study's TOML file, a view's Python file, an aircraft's
        aircraft.toml.
    """
    found: dict[str, Path] = {}
    for folder in (package_content(kind), *_own_folders(kind)):
        pattern = _entry(folder, kind, "*").relative_to(folder).as_posix()
        for file in folder.glob(pattern):
            name = file.parent.name if kind == "aircraft" else file.stem
            if name.startswith(("_", ".")):
                continue
            if name in found and package_content(kind) not in found[name].parents:
                warn_of_two(_SINGULAR[kind], name, file, found[name])
            found[name] = file
    return dict(sorted(found.items()))


def _is_file(path: Path) -> bool:
    """Return whether a file exists; a name that the system refuses does not exist."""
    try:
        return path.is_file()
    except OSError:
        return False


def find_content(kind: Kind, name: str) -> Path:
    """Find one scenario, study, view or aircraft by path or by name.

    Args:
        kind: "aircraft", "scenarios", "studies" or "viz".
        name: a path (of a file, or of an aircraft's folder), or a name as in `sinssim list`; a path such as
            "scenarios/first_flight.toml" that does not exist here also finds what comes with the package.

    Returns:
        The file: a scenario's or study's TOML file, a view's Python file, an aircraft's aircraft.toml.

    Raises:
        InputError: there is no such file or name; the message lists the names that there are.
    """
    suffix = _SUFFIXES[kind]
    given = Path(name)
    with suppress(RuntimeError):  # there is no user of that name
        given = given.expanduser()
    if kind == "aircraft" and _is_file(given / "aircraft.toml"):
        return given / "aircraft.toml"
    if _is_file(given) and (given.suffix == suffix or given.name == "aircraft.toml"):
        return given
    known = list_content(kind)
    plain = given.name if kind == "aircraft" else given.name.removesuffix(suffix)
    if plain in known and str(given.parent) in (".", _FOLDERS[kind]):
        return known[plain]
    if _is_file(given) and suffix:
        raise InputError(f"{name} is no {_SINGULAR[kind]}: the name of a {_SINGULAR[kind]} file ends in {suffix}.")
    if given.parent != Path(".") or (suffix and name.endswith(suffix)):
        raise InputError(
            f"no {_SINGULAR[kind]} file {shortened(name)!r} in {Path.cwd()}; by name there are: {', '.join(known)}."
        )
    raise unknown_name(_SINGULAR[kind], name, known)
