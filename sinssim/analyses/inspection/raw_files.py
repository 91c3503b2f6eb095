"""From recorded files to a scenario in one step: what `sinssim run imu.csv gnss.pos` runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sinssim.analyses.inspection.files import inspect
from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.logs.read import candidates, read_file

NAME = "suggested.toml"
"""File of the suggested scenario in the run directory."""


@dataclass(frozen=True)
class Suggestion:
    """A scenario for recorded files.

    Attributes:
        text: of the scenario's file; its paths are absolute.
        doubts: sentences on what is doubtful in the files.
    """

    text: str
    doubts: tuple[str, ...] = ()


def are_raw(names: Sequence[str]) -> bool:
    """Return whether the arguments of a run are recorded files, and not a scenario.

    Raises:
        InputError: there are several arguments, and a scenario is among them.
    """
    if len(names) == 1:
        (name,) = names
        if Path(name).suffix not in ("", ".toml") and not Path(name).exists():
            raise InputError(f"{name} does not exist; give a scenario, or recorded files.")
        return not name.endswith(".toml") and Path(name).exists() and name not in list_content("scenarios")
    scenario = next((name for name in names if name.endswith(".toml")), None)
    if scenario is not None:
        raise InputError(
            f"run takes one scenario, or recorded files. {scenario} is a scenario, one of {len(names)} arguments."
        )
    return True


def suggest(paths: Sequence[Path]) -> Suggestion:
    """Return the scenario that recorded files suggest: their navigation, or a simulated unit on their track.

    Args:
        paths: files of an inertial unit and a receiver, or one file of fixes or of a solution.

    Raises:
        InputError: a file cannot be read or understood, the files are worthless, or they are several tracks.
    """
    for path in paths:
        if path.is_dir() and (path / "summary.json").is_file():
            raise InputError(
                f"{path} is a run directory: `sinssim run {path / 'scenario.toml'} -o DIR` repeats the run, and "
                f"`sinssim view {path}` shows it."
            )
        if path.is_dir() and not candidates(path):
            raise InputError(f"{path} is a folder, but of no format that is a folder. Give the recorded files in it.")
    if len(paths) == 1 and candidates(paths[0]):
        streams = read_file(paths[0])
        if not streams.inertial:
            return Suggestion(_track(paths[0], streams.format))
    found = inspect(paths, Path("/nowhere"))
    wrong = [one.sentence for one in found.inspection.findings if one.grade == "wrong"]
    if wrong:
        raise InputError(
            f"the files cannot be used as they are: {' '.join(wrong)} `sinssim inspect {' '.join(map(str, paths))}` "
            "tells all findings."
        )
    if found.scenario is None:
        named = ", ".join(map(str, paths))
        raise InputError(
            f"{named}: there are no inertial data. A single file of fixes or of a solution is run as a track "
            "(sinssim run drive.gpx); a table needs the names time_s, latitude_deg, longitude_deg and height_m."
        )
    return Suggestion(found.scenario, tuple(f.sentence for f in found.inspection.findings if f.grade == "doubt"))


def _track(path: Path, name: str) -> str:
    """Return a scenario with the motion of a track and a simulated unit."""
    stem = "".join(c if c.isalnum() and c.isascii() else "_" for c in path.stem.lower()).strip("_") or "track"
    return "\n".join(
        [
            f"name = {json.dumps(stem)}",
            f"description = {json.dumps(f'Along the track {path.name}', ensure_ascii=False)}",
            "",
            "[track]",
            f"file = {json.dumps(path.resolve().as_posix(), ensure_ascii=False)}",
            f'format = "{name}"',
            'vehicle = "land"  # assumed; "aircraft" or "sea" have other attitudes',
            "",
            "[imu]",
            'grade = "mems-tactical"  # assumed; see `sinssim list grades`',
            "",
        ]
    )
