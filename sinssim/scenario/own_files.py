"""The files outside the package on which the numbers of a scenario depend."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from sinssim.content import find_content, package_content
from sinssim.scenario.tables import Tables
from sinssim.sensors.imu.grades import GRADE_TABLE, grade_file, grade_name
from sinssim.system.own_content.layout import Item
from sinssim.system.own_content.modules import source_of


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


def own_files(scenario: Tables) -> list[OwnFile]:
    """Return the files outside the package on which the numbers of a scenario depend.

    Returns:
        Those of its own algorithms, frame and aiding sensors, of its grades, and of its aircraft.
    """
    items = scenario.own_items()
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


def own_digests(scenario: Tables) -> dict[str, str]:
    """Return the SHA-256 of the files of `own_files` by their place in a project folder.

    Returns:
        The digests; empty if no number depends on own content.
    """
    return {file.place: file.to_json()["sha256"] for file in own_files(scenario)}
