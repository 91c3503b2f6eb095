"""Progress bars: what they say while kernels are compiled."""

from __future__ import annotations

import io
import os

import numba
import pytest

from sinssim.cli import command_line
from sinssim.cli.command_line import console, has_bars, print_json, program_name
from sinssim.progress import shown
from sinssim.simulation.truth_and_sensors import STAGES


class Terminal(io.StringIO):
    """Standard error on a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("stages", [STAGES, None])
def test_compilation_is_shown(stages, monkeypatch):
    """Only while something is compiled that was not there."""
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with shown(True, stages) as progress:
        progress("flight", 0.5)
        before = terminal.getvalue()
        seven = numba.njit(lambda x: 2.0 * x + 1.0)
        assert seven(3.0) == 7.0
        during = terminal.getvalue()
        assert seven(3.0) == 7.0
        assert terminal.getvalue() == during
    assert "Compiling" not in before
    assert "Compiling, once" in during


@pytest.mark.parametrize("said", [["filter: gyro scale"], ["filter: gyro scale", "filter"]])
def test_the_bar_of_a_stage_tells_its_present_work(said, monkeypatch):
    """The last state of the bar stays on the terminal."""
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with shown(True, STAGES) as progress:
        for text in said:
            progress(text, 0.3)
    last = terminal.getvalue().rpartition("Filtering")[2]
    assert ("gyro scale" in last) == (len(said) == 1)


@pytest.mark.parametrize("quiet", [False, True])
def test_another_program_reads_the_progress(
    quiet: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line at each percent, without a terminal."""
    monkeypatch.setenv("SINSSIM_PROGRESS", "lines")
    with shown(has_bars(quiet), STAGES) as progress:
        for fraction in (0.25, 0.251, 0.26, 1.5):
            progress("flight", fraction)
        progress("filter: gyro scale", 0.0)
    with shown(has_bars(quiet)) as progress:
        progress("run 3 of 4", 0.75)
    lines = capsys.readouterr().err.splitlines()
    texts = [f"{fraction} {STAGES['flight']}" for fraction in ("0.25", "0.26", "1.00")]
    assert lines == ([] if quiet else [f"progress {text}" for text in (
        *texts, f"0.00 {STAGES['filter']} gyro scale", "0.75 run 3 of 4")])  # fmt: skip


def test_the_width_of_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table is as wide as the terminal, but never narrower than it needs."""
    size = os.terminal_size((133, 24))
    monkeypatch.setattr("shutil.get_terminal_size", lambda *_, **__: size)
    assert [console(least).width for least in (120, 133, 150)] == [133, 133, 150]


def test_json_is_readable_where_the_output_can_hold_it(capsys, monkeypatch) -> None:
    print_json({"σ": [1.5, None]})
    assert capsys.readouterr().out == '{\n  "σ": [\n    1.5,\n    null\n  ]\n}\n'
    monkeypatch.setattr(command_line, "holds_everything", lambda stream: False)
    print_json({"σ": 2})
    assert capsys.readouterr().out == '{\n  "\\u03c3": 2\n}\n'


@pytest.mark.parametrize(
    ("found", "called", "name"),
    [
        ("/usr/bin/sinssim", "x", "sinssim"),
        (None, "/opt/bin/sinssim", "/opt/bin/sinssim"),
        (None, "/opt/sinssim/__main__.py", "python3.99 -m sinssim"),
    ],
)
def test_the_name_of_this_program(found, called, name, monkeypatch) -> None:
    monkeypatch.setattr("shutil.which", lambda program: found if program == "sinssim" else None)
    monkeypatch.setattr("sys.argv", [called])
    monkeypatch.setattr("sys.executable", "/opt/python3.99")
    assert program_name() == name


def test_bars_only_on_a_terminal_unless_quiet(monkeypatch, capsys) -> None:
    assert not has_bars(quiet=False)  # captured: no terminal
    monkeypatch.setattr("sys.stderr", Terminal())
    assert has_bars(quiet=False)
    assert not has_bars(quiet=True)


@pytest.mark.parametrize("progress", [None, False])
def test_nothing_is_shown_unless_asked_for(progress, capsys) -> None:
    with shown(progress, STAGES) as report:
        report("flight", 0.5)
    assert capsys.readouterr().err == ""


def test_a_given_function_is_told() -> None:
    told = []
    with shown(lambda text, fraction: told.append((text, fraction)), STAGES) as report:
        report("filter: gyro scale", 0.25)
    assert told == [("filter: gyro scale", 0.25)]


def test_each_stage_has_its_text(monkeypatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with shown(True, STAGES) as progress:
        for k, stage in enumerate(STAGES):
            progress(stage, 0.11 * (k + 1))
    last = terminal.getvalue()
    texts = ["Flying", "Fitting the true motion", "Sensing", "Navigating", "Sources of the phases", "Filtering",
             "Recording"]  # fmt: skip
    places = [last.rindex(text) for text in texts]
    assert places == sorted(places)
    for k, place in enumerate(places):
        assert f" {11 * (k + 1)}%" in last[place : place + 200], texts[k]


def test_what_a_plain_terminal_prints() -> None:
    text = "−5 ± 2 × 10 ÷ 3 √ → ← ≤ ≥ ≈ ≠ ∞ 7° 8′ 9″ µg ∑ m² m³ ‰ … – σ ₂ é"
    assert text.encode("ascii", "sinssim-plain").decode() == (
        "-5 +- 2 x 10 / 3 sqrt -> <- <= >= ~ != inf 7deg 8' 9\" ug sum m^2 m^3 permille ... - sigma 2 e"
    )
