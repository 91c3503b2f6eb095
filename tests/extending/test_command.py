"""A new command is one file."""

from __future__ import annotations

import json
from pathlib import Path

from tests.extending.pages import Copy, read_page


def test_the_command_of_the_page(tmp_path: Path) -> None:
    page, copy = read_page("command"), Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/cli/commands/duration.py"]
    ask = ("duration", "parked", "--set", "parked.duration_s=600")
    every, own, plain, as_json = copy.commands(("--help",), ("duration", "--help"), ask, (*ask, "--json"))
    assert "duration" in every
    assert "sinssim duration first_flight" in own
    assert plain == "600 s\n"
    assert json.loads(as_json) == {"expected_duration_s": 600.0}
