"""The key `use` of scenarios and studies: files and project folders with own content."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from sinssim.errors import InputError
from sinssim.system.extensions import file_digest, items_of
from sinssim.system.registries import register
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

    The file's contents are changed in place. If the file has the key `views`, the views of a project are added to it.
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
