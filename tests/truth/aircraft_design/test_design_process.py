"""A model that hangs or crashes its process is a sentence; the text of an aircraft is that aircraft."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from sinssim.errors import RunError
from sinssim.truth.aircraft_design import design_process
from sinssim.truth.aircraft_design.aircraft_design import RefusedError
from sinssim.truth.aircraft_design.aircraft_file import aircraft_text
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_process import OtherProcess, served


def serve_never() -> None:
    """Report once, and answer nothing more."""
    with served() as answer:
        answer("fraction", ("trimming", 0.5))
        time.sleep(60.0)


def serve_crash() -> None:
    with served():
        os.kill(os.getpid(), signal.SIGSEGV)


def test_a_process_without_an_answer_is_ended() -> None:
    heard: list[tuple[float, object]] = []
    with OtherProcess("kite", "serve_never", __name__, 600.0) as other:

        def hear(word: object) -> None:
            heard.append((time.monotonic(), word))
            other.patience = 1.0  # from here on: a busy machine may take long to start it

        with pytest.raises(RunError, match="flew the kite gave no answer for 1 s and was ended"):
            other.answer(hear)
    (begun, word), *more = heard
    assert (word, more) == (("trimming", 0.5), [])
    assert 1.0 <= time.monotonic() - begun < 30.0


@pytest.mark.parametrize(
    ("function", "longest", "words"),
    [
        ("serve_crash", 600.0, "the model kite cannot be flown: the process that flew the kite ended with SIGSEGV"),
        ("serve_never", 3.0, "the model kite cannot be flown: its design takes longer than 0.05 minutes"),
    ],
)
def test_what_happens_to_the_process_is_the_reason(
    monkeypatch: pytest.MonkeyPatch, function: str, longest: float, words: str
) -> None:
    class Replaced(OtherProcess):
        def __init__(self, name: str, asked: str, module: str, patience: float) -> None:
            assert (asked, module) == ("serve_design", design_process.__name__)
            super().__init__(name, function, __name__, patience)

    monkeypatch.setattr(design_process, "OtherProcess", Replaced)
    monkeypatch.setattr(design_process, "LONGEST", longest)
    with pytest.raises(RefusedError, match=words):
        design_process.design_apart("kite", None, lambda text, part: None)


@pytest.mark.parametrize("name", ["737", "c172x", "f16"])
def test_the_text_of_an_aircraft_is_read_as_that_aircraft(name: str, tmp_path: Path) -> None:
    """Strings with quotes, paths of XML, tables of numbers and switches are those that were written."""
    (tmp_path / "aircraft.toml").write_text(aircraft_text(load_aircraft(name)), encoding="utf-8")
    assert load_aircraft(str(tmp_path)) == load_aircraft(name)
