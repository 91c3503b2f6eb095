"""Loads a scenario: reads the TOML file, applies overrides, checks it, and reports every mistake."""

from __future__ import annotations

import json
import logging
import os
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sinssim.content import find_content
from sinssim.errors import InputError, shortened
from sinssim.logs.log_settings import Log, files_from
from sinssim.scenario.overrides import override
from sinssim.scenario.schema import Scenario
from sinssim.sensors.imu.grades import SUFFIX, find_grade
from sinssim.system.extensions import file_digest, items_of
from sinssim.system.files import read_text
from sinssim.toml_mistakes import parse_toml, read_toml, validate

if TYPE_CHECKING:
    from sinssim.logs.recorded_log import RecordedLog

Overrides = str | Sequence[str]
"""Settings "key.path=value" that replace values of a scenario."""


def load_scenario(path: str | Path, overrides: Overrides = ()) -> Scenario:
    """Load and check a scenario.

    Args:
        path: path of a TOML file, or the name of a scenario as in `sinssim list scenarios`.
        overrides: settings "key.path=value" that replace values of the file, for example
            "imu.grade=tactical" or "flight.legs.2.altitude_m=9000" (legs are counted from 1); values as in TOML,
            a plain word needs no quotes.

    Returns:
        The scenario.

    Raises:
        InputError: the file cannot be read or has mistakes; the message lists all of them, each with its key, its line
            and the correct form.
    """
    file = find_content("scenarios", str(path))
    text, data = read_toml(file)
    data.setdefault("name", file.stem)
    _files_from(data, file.parent)
    return _overridden(data, text, str(path), overrides, file)


def scenario_of_text(
    text: str, folder: Path, overrides: Overrides = (), *, source: str = "the suggested scenario", name: str = ""
) -> Scenario:
    """Return the checked scenario of a text as in a file of a folder, to which its paths are relative.

    `source` names the text in errors, and `name` is that of the scenario if the text has none.
    """
    data = parse_toml(text, source)
    if name:
        data.setdefault("name", name)
    _files_from(data, folder)
    return _overridden(data, text, source, overrides, None)


def as_scenario(scenario: Scenario | str | Path, overrides: Overrides = ()) -> Scenario:
    """Return a scenario that is given as such, by the path of its TOML file or by its name, with settings as for
    `load_scenario`."""
    if isinstance(scenario, str | Path):
        return load_scenario(scenario, overrides)
    given: object = scenario
    if not isinstance(given, Scenario):
        shown = shortened(repr(given))
        raise InputError(f'scenario = {shown} must be a Scenario, or its file or name, for example "parked".')
    if not overrides:
        return given
    text = given.to_toml()
    return _overridden(tomllib.loads(text), text, given.name, overrides, None)


def _overridden(data: dict[str, Any], text: str, source: str, overrides: Overrides, file: Path | None) -> Scenario:
    """Return the checked scenario of a file's contents and settings."""
    overrides = (overrides,) if isinstance(overrides, str) else overrides  # a str is a sequence of strings itself
    if not isinstance(overrides, Sequence) or not all(isinstance(setting, str) for setting in overrides):
        shown = shortened(repr(overrides))
        raise InputError(f'overrides = {shown} must be a list of settings, for example ["imu.rate_hz=200"].')
    overridden = {override(data, setting) for setting in overrides}
    _files_from(data, Path.cwd())
    if file is not None:
        warn_of_changes(file, data.get("use"))
    _check_grade(data.get("imu"))
    return validate(Scenario, data, text, source, overridden)


def _check_grade(imu: Any) -> None:
    """Read a grade's file first, so that its mistakes are told by its own lines."""
    grade = imu.get("grade") if isinstance(imu, dict) else None
    if isinstance(grade, str) and grade.endswith(SUFFIX):
        find_grade(grade)


def load_log(source: Scenario | str | Path, overrides: Overrides = ()) -> RecordedLog:
    """Load recorded sensors.

    Args:
        source: a scenario with [log], its TOML file or its name; or the recorded file of an inertial unit in one of the
            formats of `sinssim list formats`, alone.
        overrides: settings "key=value" of a scenario, as for `load_scenario`.

    Returns:
        Increments, measurements and reference, in the run's time.

    Raises:
        InputError: the scenario has no recorded sensors, a file cannot be read, samples are missing, or the files do
            not overlap in time.
    """
    from sinssim.logs.recorded_log import recorded_log

    if isinstance(source, str | Path) and Path(source).is_file() and Path(source).suffix != ".toml":
        if overrides:
            raise InputError(f"{source} is a log; overrides change a scenario, which describes logs.")
        return recorded_log(Log.model_validate({"imu": {"file": str(source)}}))
    scenario = as_scenario(source, overrides)
    if scenario.log is None:
        raise InputError(
            f"the scenario {scenario.name} has no recorded sensors: add the table [log], or give the file of an "
            "inertial unit."
        )
    return recorded_log(scenario.log, scenario.imu.mounting_deg)


def _files_from(data: dict[str, Any], folder: Path) -> None:
    """Replace relative paths of a scenario's own content, track, gravity, log and calibration by absolute paths."""
    files_from(data.get("log"), folder)
    resolved_use(data, folder)
    aiding = data.get("aiding")
    for table in (data.get("imu"), aiding.get("master") if isinstance(aiding, dict) else None):
        grade = table.get("grade") if isinstance(table, dict) else None
        if isinstance(table, dict) and isinstance(grade, str) and grade.endswith(SUFFIX):
            table["grade"] = str(folder.resolve() / Path(grade).expanduser())
    for table in (data.get("track"), data.get("gravity"), data.get("compensation")):
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            table["file"] = str(folder.resolve() / table["file"])
    navigators = data.get("navigator")
    for table in navigators if isinstance(navigators, list) else ():
        if isinstance(table, dict):
            _programs_from(table, folder.resolve())
    flight = data.get("flight")
    if isinstance(flight, dict) and isinstance(flight.get("aircraft"), str):
        beside = str(folder.resolve() / flight["aircraft"])
        if "/" in flight["aircraft"] and os.path.isfile(os.path.join(beside, "aircraft.toml")):
            flight["aircraft"] = beside
    views = data.get("views")
    if isinstance(views, list):
        data["views"] = [str(folder.resolve() / view) if isinstance(view, str) else view for view in views]


def _programs_from(table: dict[str, Any], folder: Path) -> None:
    """Replace the relative paths of a navigator by absolute ones: of what is started, and of arguments that are files
    beside the scenario."""
    if isinstance(table.get("library"), str):
        table["library"] = str(folder / Path(table["library"]).expanduser())
    command = table.get("command")
    if not (isinstance(command, list) and all(isinstance(word, str) for word in command)):
        return
    first = [str(folder / Path(word).expanduser()) if "/" in word else word for word in command[:1]]
    table["command"] = [
        *first,
        *(str(folder / word) if os.path.isfile(folder / word) else word for word in command[1:]),
    ]


logger = logging.getLogger(__name__)


def with_settings(text: str, settings: Sequence[str]) -> str:
    """Return the text of a scenario's file with settings "key.path=value" written into it; its comments stay."""
    import tomlkit

    if not settings:
        return text
    document = tomlkit.parse(text)
    for setting in settings:
        override(document, setting)
    _files_from(document, Path.cwd())
    return tomlkit.dumps(document)


FOLDER = "own_content"
"""Folder of a run directory with copies of own content, in the layout of a project folder."""


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
    """Warn of own content that has changed since a run, whose scenario is loaded again from its directory; nothing
    happens unless the file of the scenario lies beside the copies of a run, and what it uses now is not the copies."""
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
        elif entry["kind"] == "navigators":
            how = f"in its [[navigator]], {copies / 'navigators' / entry['name'] / Path(entry['file']).name}"
        else:
            how = f"--set 'use=[\"{copies}\"]'"
        logger.warning(
            "%s %s the run in %s: the numbers will differ. %s uses the copy of that run.",
            entry["file"], what, scenario_file.parent, how,
        )  # fmt: skip


def _is_same(file: Path, digest: str) -> bool:
    return os.path.isfile(file) and file_digest(file) == digest
