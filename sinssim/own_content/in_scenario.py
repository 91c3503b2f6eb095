"""The key `use` of scenarios and studies: files and project folders with own content."""

from __future__ import annotations

import hashlib
import json
import logging
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from sinssim.content import find_content, package_content
from sinssim.errors import InputError
from sinssim.own_content.layout import Item, items_of
from sinssim.own_content.modules import file_digest, source_of
from sinssim.own_content.registry import NAMED, register, registered
from sinssim.section import Section
from sinssim.sensors.imu.grades import GRADE_TABLE, grade_file, grade_name
from sinssim.system.user_file import read_text

logger = logging.getLogger(__name__)

FOLDER = "own_content"
"""Folder of a run directory with copies of own content, in the layout of a project folder."""


def _registered(paths: tuple[str, ...]) -> tuple[str, ...]:
    """Register the content of all paths, so that the tables that follow may name it; returns absolute paths."""
    absolute = [Path(path).expanduser().absolute() for path in paths]
    try:
        for path in absolute:
            register(items_of(path))
    except InputError as error:
        raise ValueError(str(error)) from error
    return tuple(map(str, absolute))


Use = Annotated[tuple[str, ...], AfterValidator(_registered)]
"""Files and project folders, registered when they are checked."""


def resolved_use(data: dict[str, Any], folder: Path, *, views: bool = True) -> None:
    """Replace relative paths of `use` by absolute ones, and names of a project's grades and aircraft by their files.

    Args:
        data: contents of a scenario's file, changed in place.
        folder: the folder that relative paths begin in.
        views: whether the file has the key `views`, which the views of a project are added to.
    """
    paths = data.get("use")
    if not (isinstance(paths, list) and all(isinstance(path, str) for path in paths)):
        return
    data["use"] = paths = [str(folder.resolve() / Path(path).expanduser()) for path in paths]
    items = []
    for path in paths:
        try:
            items += items_of(Path(path))
        except InputError:
            return  # the check of the key reports it
    flight, aiding = data.get("flight"), data.get("aiding")
    master = aiding.get("master") if isinstance(aiding, dict) else None
    for table, key, kind in ((data.get("imu"), "grade", "grades"), (master, "grade", "grades"),
                             (flight, "aircraft", "aircraft")):  # fmt: skip
        for item in items:
            if isinstance(table, dict) and item.kind == kind and table.get(key) == item.name:
                table[key] = str(item.file.parent if kind == "aircraft" else item.file)
    own_views = [str(item.file) for item in items if item.kind == "views"]
    if views and own_views and isinstance(data.get("views", []), list):
        data["views"] = list(dict.fromkeys([*data.get("views", []), *own_views]))


def own_items(scenario: Any) -> list[Item]:
    """Return the algorithms, frame and aiding sensors outside the package that a scenario names.

    Args:
        scenario: a `sinssim.Scenario`.

    Returns:
        The items, in the order of the scenario.
    """
    aiding = scenario.aiding.sensors() if scenario.aiding else ()
    names: dict[str, Iterable[str]] = {
        "algorithms": scenario.navigation.algorithms, "frames": (scenario.navigation.frame,), "aiding": aiding,
    }  # fmt: skip
    found = (registered(kind, name) for kind in NAMED for name in names[kind])
    return [item for item in found if item is not None]


def complete_use(scenario: Any) -> tuple[str, ...]:
    """Return what a file of the scenario must use in another process: also what was registered in another way.

    Args:
        scenario: a `sinssim.Scenario`.

    Returns:
        Its paths, and the files of own content that it names and that neither a path nor an installed package brings.
    """
    items = [item for item in own_items(scenario) if not item.package]
    brought = {item.file for path in scenario.use for item in items_of(Path(path))} if items else set()
    return (*scenario.use, *(str(item.file) for item in items if item.file not in brought))


@dataclass(frozen=True)
class OwnFile:
    """A file outside the package on which the numbers of a run depend.

    Attributes:
        item: what it brings.
        contents: its bytes: of code as it was run, of others as they are.
    """

    item: Item
    contents: bytes

    @property
    def place(self) -> str:
        """Its place in a project folder, for example "algorithms/midpoint.py"."""
        own = f"{self.item.name}/" if self.item.kind == "aircraft" else ""
        return f"{self.item.kind}/{own}{self.item.file.name}"

    def to_json(self) -> dict[str, str]:
        """Return its entry in a summary."""
        item = self.item
        entry = {"kind": item.kind, "name": item.name, "file": str(item.file), "package": item.package}
        return {**entry, "sha256": hashlib.sha256(self.contents).hexdigest()}


def own_files(scenario: Any) -> list[OwnFile]:
    """Return the files outside the package on which the numbers of a scenario depend.

    Args:
        scenario: a `sinssim.Scenario`.

    Returns:
        Those of its own algorithms, frame and aiding sensors, of its grades, and of its aircraft.
    """
    items = own_items(scenario)
    master = getattr(scenario.aiding, "master", None)
    for grade in (scenario.imu.grade, getattr(master, "grade", None)):
        if grade and grade not in GRADE_TABLE:
            items.append(Item("grades", grade_name(grade), grade_file(grade)))
    if scenario.flight is not None:
        file = find_content("aircraft", scenario.flight.aircraft)
        items.append(Item("aircraft", file.parent.name, file))
    shipped = [package_content(kind).resolve() for kind in ("grades", "aircraft")]
    own = [item for item in items if not any(folder in item.file.resolve().parents for folder in shipped)]
    return [OwnFile(item, source_of(item)) for item in dict.fromkeys(own)]


def own_digests(scenario: Any) -> dict[str, str]:
    """Return the SHA-256 of the files of `own_files` by their place in a project folder.

    Args:
        scenario: a `sinssim.Scenario`.

    Returns:
        The digests; empty if no number depends on own content.
    """
    return {file.place: file.to_json()["sha256"] for file in own_files(scenario)}


def warn_of_changes(scenario_file: Path, use: Any) -> None:
    """Warn of own content that has changed since a run, whose scenario is loaded again from its directory.

    Args:
        scenario_file: the file of the scenario; nothing happens unless it lies beside the copies of a run.
        use: what the scenario uses now; nothing happens if that is the copies.
    """
    copies = scenario_file.parent / FOLDER
    if scenario_file.name != "scenario.toml" or not copies.is_dir():
        return
    if isinstance(use, list) and str(copies.resolve()) in use:
        return
    try:
        entries = json.loads(read_text(scenario_file.parent / "summary.json", encoding="utf-8"))["own_content"]
        changed = [entry for entry in entries if not _is_same(Path(entry["file"]), entry["sha256"])]
    except (OSError, ValueError, KeyError, TypeError):
        return
    for entry in changed:
        what = "has changed since" if os.path.isfile(entry["file"]) else "no longer exists since"
        if entry["kind"] == "grades":
            how = f"--grade {copies / 'grades' / Path(entry['file']).name}"
        elif entry["kind"] == "aircraft":
            how = f"--set flight.aircraft={copies / 'aircraft' / entry['name']}"
        else:
            how = f"--set 'use=[\"{copies}\"]'"
        logger.warning(
            "%s %s the run in %s: the numbers will differ. %s uses the copy of that run.",
            entry["file"], what, scenario_file.parent, how,
        )  # fmt: skip


def _is_same(file: Path, digest: str) -> bool:
    return os.path.isfile(file) and file_digest(file) == digest


class WithOwnContent(Section):
    """A scenario that may name own content: in another process, it is registered again before the scenario is read."""

    def __reduce__(self) -> Any:
        """Return how another process makes the scenario: from its contents if it names own content."""
        scenario: Any = self
        if not own_items(scenario):
            return super().__reduce__()
        return type(self).model_validate, (scenario.contents(),)
