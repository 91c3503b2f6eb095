"""Mistakes in options and arguments are told like any other mistake."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import Any

import pytest
import typer

from sinssim.cli import main
from sinssim.cli.app import _warnings_as_lines, sentence
from sinssim.cli.command_line import GIVEN, start_option
from sinssim.errors import SinssimWarning


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


def test_every_similar_option_is_named() -> None:
    context = SimpleNamespace(command_path="sinssim run")
    error = SimpleNamespace(message="No such option: --re.", possibilities=["--rest", "--read"], ctx=context)
    assert sentence(error) == "No such option: --re. Did you mean --rest or --read? See `sinssim run --help`."


def test_a_warning_is_printed_once(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Warnings of the program once each, none with --quiet; those of others as usual."""
    monkeypatch.setitem(GIVEN, "quiet", False)
    with warnings.catch_warnings(), _warnings_as_lines():
        for text in ("one", "one", "two"):
            warnings.warn(SinssimWarning(text), stacklevel=1)
    assert capsys.readouterr().err == "WARNING: one\nWARNING: two\n"
    monkeypatch.setitem(GIVEN, "quiet", True)
    with warnings.catch_warnings(), _warnings_as_lines():
        warnings.warn(SinssimWarning("three"), stacklevel=1)
    assert capsys.readouterr().err == ""


def test_the_usual_date_of_time_0_is_told() -> None:
    assert start_option("date").show_default == "2026-01-01T00:00:00Z, or the date of a recorded log"
