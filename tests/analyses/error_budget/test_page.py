"""The page on budgets: its code runs, its links and commands exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from sinssim.scenario import load_scenario
from sinssim.statistics.requirements import QUANTITIES, parse_requirement

PAGE = (Path(__file__).parents[3] / "docs" / "budgets.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_its_code_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, Any] = {}
    exec(code, names)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5
    assert lines[-1].startswith("True (")


def test_its_commands_can_be_given() -> None:
    (commands,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    asked = 0
    for line in commands.splitlines():
        words = shlex.split(line)
        assert words[:2] == ["sinssim", "budget"]
        settings = [words[k + 1] for k, word in enumerate(words) if word == "--set"]
        load_scenario(words[2], settings)
        for k, word in enumerate(words):
            if word == "--require":
                parse_requirement(words[k + 1])
                asked += 1
    assert asked == 3


def test_it_names_every_quantity_and_test() -> None:
    assert all(f"`{name}`" in PAGE for name in QUANTITIES)
    for path in re.findall(r"pytest ([\w/.]+)", PAGE):
        assert (Path(__file__).parents[3] / path).is_file(), path
