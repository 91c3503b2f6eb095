"""Completion by the shell: commands, options, scenarios and choices, as bash asks for them."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from sinssim.cli.app import app


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("sinssim ch", {"check"}),
        ("sinssim run aid", {"aided_airliner"}),
        ("sinssim run --overw", {"--overwrite"}),
        ("sinssim list gr", {"gravity", "grades"}),
        ("sinssim run no-such-scenario", set()),  # bash then completes files
    ],
)
def test_completion(line: str, wanted: set[str]) -> None:
    asked = {
        "_SINSSIM_COMPLETE": "complete_bash",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split()) - 1),
    }
    done = CliRunner().invoke(app, prog_name="sinssim", env=asked)
    assert done.exit_code == 0
    assert set(done.stdout.split()) == wanted
