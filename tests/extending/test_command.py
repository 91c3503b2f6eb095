"""A new command is one file."""

from __future__ import annotations

import json
from pathlib import Path

from tests.extending.pages import Copy, read_page


def test_the_command_of_the_page(tmp_path: Path) -> None:
    page, copy = read_page("command"), Copy(tmp_path)
    copy.apply(page)
    assert copy.touched == ["sinssim/cli/commands/duration.py"]
    assert "duration" in copy.command("--help")
    assert "sinssim duration first_flight" in copy.command("duration", "--help")
    setting = "parked.duration_s=600"
    assert copy.command("duration", "parked", "--set", setting) == "600 s\n"
    assert json.loads(copy.command("duration", "parked", "--set", setting, "--json")) == {"expected_duration_s": 600.0}
