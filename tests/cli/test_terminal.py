"""Progress bars: what they say while kernels are compiled."""

from __future__ import annotations

import io

import numba
import pytest

from sinssim.cli.terminal import one_bar, stage_bars


class Terminal(io.StringIO):
    """Standard error on a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("bars", [stage_bars, one_bar])
def test_compilation_is_shown(bars, monkeypatch):
    """Only while something is compiled that was not there."""
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with bars(show=True) as progress:
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
    with stage_bars(show=True) as progress:
        for text in said:
            progress(text, 0.3)
    shown = terminal.getvalue().rpartition("Filtering")[2]
    assert ("gyro scale" in shown) == (len(said) == 1)
