"""docs/glossary.md: every place that it names exists."""

from __future__ import annotations

import importlib
import re

import pytest

import sinssim
from sinssim.cli.app import command_names
from sinssim.scenario.schema import key_tables, toml_lines
from tests.documentation.fences import ROOT

PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
SCENARIO = "\n".join(line for table in key_tables() for line in toml_lines(table))
ROWS = [row.strip("| ").split(" | ") for row in re.findall(r"^\|(?! term|--).*\|$", PAGE, re.MULTILINE)]
PLACES = sorted(
    {name for row in re.findall(r"^\|.*\|$", PAGE, re.M) for name in re.findall(r"`([^`]+)`", row.split("|")[-2])}
)


def _is_object(name: str) -> bool:
    """Whether a name such as "earth.radii" is a module, class or function of the package, or a public name."""
    parts = name.removeprefix("sinssim.").split(".")
    if parts[0] in sinssim.__all__:
        return len(parts) == 1 or hasattr(getattr(sinssim, parts[0]), parts[1])
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(["sinssim", *parts[:count]]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            found = getattr(found, part, None)
        return found is not None
    return False


@pytest.mark.parametrize("name", PLACES)
def test_places_exist(name: str) -> None:
    if name.startswith("tests/"):
        assert (ROOT / name).is_file()
    elif name.startswith("frame = "):
        assert name.split('"')[1] in sinssim.FRAMES
    elif name.startswith("sinssim "):
        assert name.split()[1] in command_names()
    elif re.fullmatch(r"[\w.]+", name) and _is_object(name):
        pass
    elif re.fullmatch(r"\[[\w.]+\](?: \w+)?", name):  # a table of a scenario, with a key
        table, _, key = name.partition(" ")
        assert re.search(rf"^#? ?{re.escape(table)}", SCENARIO, re.MULTILINE)
        assert key in SCENARIO
    else:  # a key, or a key with its value
        key, _, value = name.partition(" = ")
        assert re.search(rf"^#? ?{key} = ", SCENARIO, re.MULTILINE), name
        assert value in SCENARIO


def test_terms_stand_once() -> None:
    terms = [row[0] for row in ROWS]
    assert len(terms) > 70
    assert len(terms) == len(set(terms))
