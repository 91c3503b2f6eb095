"""Mistakes in options and arguments are told like any other mistake."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import typer

from sinssim.cli import main
from sinssim.cli.app import sentence


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["ensemble", "parked", "--runs", "abc"],
            "--runs = 'abc' must be a whole number. See `sinssim ensemble --help`.",
        ),
        (["ensemble", "parked", "-n", "1.5"], "--runs = '1.5' must be a whole number."),
        (["budget", "parked", "--at=noon"], "--at = 'noon' must be a number. See `sinssim budget --help`."),
        (["ensemble", "parked", "--rnus", "3"], "--rnus. Did you mean --runs? See `sinssim ensemble --help`."),
        (["ensemble"], "SCENARIO is missing. See `sinssim ensemble --help`."),
        (["list"], "Missing argument 'kind'. Choose from: aircraft, scenarios, studies, algorithms, frames, "),
        (["ensembel", "parked"], "Did you mean 'ensemble'? See `sinssim --help`."),
        (["ensemble", "parked", "--runs"], "'--runs' requires an argument. See `sinssim --help`."),
        (["--vers"], "--vers. Did you mean --version? See `sinssim --help`."),
    ],
)
def test_one_sentence_and_where_to_look(arguments: list[str], says: str, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("sinssim: ")
    assert err.count("\n") == 1
    assert err.rstrip().endswith(says) or says in err


def test_a_message_that_quotes_what_was_given() -> None:
    """Older versions of typer name the value in the message alone."""
    runs: Any = SimpleNamespace(opts=["-n", "--runs"])
    error = typer.BadParameter("'1.5' is not a valid integer.", param=runs)
    assert sentence(error) == "--runs = '1.5' must be a whole number. See `sinssim --help`."


def test_nothing_at_all_prints_the_help(capsys) -> None:
    with pytest.raises(SystemExit):
        main([])
    assert "Usage: sinssim" in "".join(capsys.readouterr())
