"""Own content outside of scenarios: the folders of `SINSSIM_CONTENT`, and installed packages with content.

Neither is looked at before a name is unknown or names are listed, because reading the list of installed packages takes
longer than everything else at start-up.
"""

from __future__ import annotations

import importlib.util
import logging
import os
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

from sinssim.errors import InputError
from sinssim.system.own_content.layout import Item, items_of

logger = logging.getLogger(__name__)

GROUP = "sinssim.content"
"""Group of entry points: the value of each is a package with the folders of a project."""

VARIABLE = "SINSSIM_CONTENT"
"""Environment variable with files and project folders, as absolute paths separated like those of PATH."""


def named_paths() -> list[Path]:
    """Return the files and folders that the environment variable names.

    Returns:
        Absolute paths; one that is not absolute, or does not exist, is left out with a warning.
    """
    found = []
    for name in os.environ.get(VARIABLE, "").split(os.pathsep):
        path = Path(name).expanduser()
        if name and path.is_absolute() and path.exists():
            found.append(path)
        elif name:
            what = "does not exist" if path.is_absolute() else "is not an absolute path"
            warn_once(f"{VARIABLE} names {path}, which {what}: it is ignored.")
    return found


@cache
def warn_once(text: str) -> None:
    """Warn of something once in a process."""
    logger.warning("%s", text)


@cache
def _of_packages() -> tuple[Item, ...]:
    """Return the content of the installed packages; one that cannot be used costs its own content only."""
    from importlib.metadata import entry_points

    found: list[Item] = []
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        package = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.name
        try:
            spec = importlib.util.find_spec(entry.value)
            places = list(spec.submodule_search_locations or ()) if spec else []
            if not places:
                raise InputError(f"there is no package {entry.value}")
            found += [replace(item, package=package) for place in places for item in items_of(Path(place))]
        except Exception as error:  # whatever importing the package's parent raises
            said = str(error).rstrip(".")
            warn_once(
                f"The installed package {package} provides content ({entry.name} = {entry.value!r} in the entry points "
                f"{GROUP}) that cannot be used: {type(error).__name__}: {said}. It is left out."
            )
    return tuple(found)


def _all(packages: bool) -> Iterator[Item]:
    for path in named_paths():
        try:
            yield from items_of(path)
        except InputError as error:
            warn_once(f"{VARIABLE}: {error}. It is left out.")
    if packages:
        yield from _of_packages()


def offered(kind: str, *, packages: bool = True) -> dict[str, Item]:
    """Return the content of one kind from the environment variable and from installed packages.

    Args:
        kind: one of `sinssim.system.own_content.layout.SINGULAR`.

    Returns:
        The items by name. If two have the same name, the first one counts: of the environment variable, then of the
        packages by the name of their entry point; a warning names the other.
    """
    found: dict[str, Item] = {}
    for item in _all(packages):
        if item.kind != kind:
            continue
        first = found.setdefault(item.name, item)
        if first.file != item.file:
            warn_once(f"Two files define the {item.words}: {first.file} is used, {item.file} is ignored.")
    return found
