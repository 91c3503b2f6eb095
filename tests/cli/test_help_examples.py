"""The examples in every command's help name commands, options and contents that exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer

from sinssim.cli.app import app
from sinssim.content import list_content

COMMANDS = Path(__file__).parents[2] / "sinssim" / "cli" / "commands"
OF_PROGRAM = typer.main.get_command(app).commands
EXAMPLES = [
    line.strip()
    for file in sorted(COMMANDS.glob("*.py"))
    for block in re.findall(r"Examples:\n\n(.*?)\n    \"\"\"", file.read_text(encoding="utf-8"), re.DOTALL)
    for line in block.splitlines()
    if line.strip().startswith("sinssim ")
]


def test_there_are_examples():
    assert len(EXAMPLES) > 40


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_names_what_exists(example):
    words = shlex.split(example.split(" >> ")[0])
    known = {option for parameter in OF_PROGRAM[words[1]].params for option in parameter.opts}
    for option in (word for word in words if word.startswith("--")):
        assert option in known, f"{example}: there is no option {option}"
    subject = words[2] if len(words) > 2 else "-"
    kind = {"compare": "studies", "run": "scenarios", "budget": "scenarios", "ensemble": "scenarios",
            "check": "scenarios", "calibrate": "scenarios"}.get(words[1])  # fmt: skip
    if kind and not subject.startswith("-") and "." not in subject:
        known = {*list_content(kind), *(list_content("scenarios") if "--vary" in words else ())}
        assert subject in known, f"{example}: there is no {subject} in {kind}"
