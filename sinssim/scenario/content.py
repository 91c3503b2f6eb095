"""Finding content: aircraft, scenarios, studies and views that lie in folders, not in code.

One lookup serves a checkout, an installed package and a folder of the user's own, in this order: a path that was
given, the folder KIND below the current folder, the content that comes with the package.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import sinssim
from sinssim.errors import InputError, unknown_name

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
    """Return the folder of content that comes with the package: inside a wheel, or beside it in a checkout.

    Args:
        kind: "aircraft", "scenarios", "studies" or "viz".

    Returns:
        The folder; it exists in every sound installation.
    """
    package = Path(sinssim.__file__).resolve().parent
    installed = package / "_content" / _FOLDERS[kind]
    return installed if installed.is_dir() else package.parent / _FOLDERS[kind]


def _entry(folder: Path, kind: Kind, name: str) -> Path:
    """Return where content of this name would lie in a folder."""
    if kind == "aircraft":
        return folder / name / "aircraft.toml"
    return folder / (name + _SUFFIXES[kind])


def list_content(kind: Kind) -> dict[str, Path]:
    """List content by name; what lies in the current folder hides what comes with the package.

    Args:
        kind: "aircraft", "scenarios", "studies" or "viz".

    Returns:
        File by name, sorted by name: a scenario's or study's TOML file, a view's Python file, an aircraft's
        aircraft.toml.
    """
    found: dict[str, Path] = {}
    for folder in (package_content(kind), Path.cwd() / _FOLDERS[kind]):
        pattern = _entry(folder, kind, "*").relative_to(folder).as_posix()
        for file in folder.glob(pattern):
            name = file.parent.name if kind == "aircraft" else file.stem
            if not name.startswith(("_", ".")):
                found[name] = file
    return dict(sorted(found.items()))


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
    given = Path(name).expanduser()
    if kind == "aircraft" and (given / "aircraft.toml").is_file():
        return given / "aircraft.toml"
    if given.is_file() and (given.suffix == suffix or given.name == "aircraft.toml"):
        return given
    known = list_content(kind)
    plain = given.name if kind == "aircraft" else given.name.removesuffix(suffix)
    if plain in known and str(given.parent) in (".", _FOLDERS[kind]):
        return known[plain]
    if given.is_file() and suffix:
        raise InputError(f"{name} is no {_SINGULAR[kind]}: the name of a {_SINGULAR[kind]} file ends in {suffix}.")
    if given.parent != Path(".") or (suffix and name.endswith(suffix)):
        raise InputError(f"no {_SINGULAR[kind]} file {name!r} in {Path.cwd()}; by name there are: {', '.join(known)}.")
    raise unknown_name(_SINGULAR[kind], name, known)
