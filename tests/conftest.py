"""What all tests share."""

from __future__ import annotations

import base64
import gc
import os
import shlex
import signal
import sys
from collections.abc import Generator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

_SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><metadata></metadata></svg>\n'
_PNG = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg==")


def _written(_: Any, file: Any, *, format: str = "", **options: Any) -> None:
    """Write an empty picture instead of what a figure shows."""
    data = {"svg": _SVG, "png": _PNG, "pdf": b"%PDF-1.4\n"}[format]
    if hasattr(file, "write"):
        file.write(data)
    elif isinstance(data, str):
        Path(file).write_text(data, encoding="utf-8")
    else:
        Path(file).write_bytes(data)


def pytest_configure() -> None:
    """Let Ctrl-C end the programs that tests start: a job in the background of a shell hands on that it is ignored."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect the tests without looking for garbage meanwhile, nor later in what lives to the end: saves a third.

    What tests keep for each other, such as the syntax trees of all modules, is looked through seldom.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.unfreeze = lambda: None  # a stream at the pace of the clock would let all be looked through again
        gc.set_threshold(2000, 10, 100)
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Print, as the last line, the command that repeats the failed tests; workers of xdist have no reporter."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    reports = reporter.getreports("failed") + reporter.getreports("error") if reporter else []
    if reports:
        python = os.path.relpath(sys.executable)
        command = [sys.executable if python.startswith("..") else python, "-m", "pytest"]
        command += ["-m", ""] if any("slow" in getattr(report, "keywords", ()) for report in reports) else []
        reporter.write_line(f"repeat: {shlex.join([*command, *dict.fromkeys(r.nodeid for r in reports)])}")


@pytest.fixture(autouse=True, scope="module")
def savefig(request: pytest.FixtureRequest) -> Generator[Any]:
    """Make figures in all tests, but let matplotlib render them only where a test looks at pictures.

    Those are the tests of `sinssim.recording` and those with the mark `rendered`. Rendering takes 0.2 s a figure, and a
    report has up to twenty. A module's fixtures do not render either.
    """
    from matplotlib.figure import Figure

    with pytest.MonkeyPatch.context() as patch:
        original = Figure.savefig
        if "recording" not in request.path.parts:
            patch.setattr(Figure, "savefig", _written)
        yield original


@pytest.fixture(autouse=True)
def rendered(request: pytest.FixtureRequest, savefig: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let matplotlib render in tests with the mark `rendered`."""
    if request.node.get_closest_marker("rendered"):
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", savefig)


@pytest.fixture(scope="module")
def hardly_counted(request: pytest.FixtureRequest) -> Generator[None]:
    """Count the operations of a tenth of the samples and time each step twice, but for slow tests.

    For tests of studies that test no costs.
    """
    from sinssim.experiments.studies import attitude_cost, step_cost

    if request.config.getoption("markexpr") != "not slow":
        yield
        return
    caches = (step_cost.count_operations, attitude_cost.count_attitude)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("_COUNTED_SAMPLES", 24), ("_TIMED_SAMPLES", 2400), ("_REPETITIONS", 1)):
            patch.setattr(step_cost, name, value)
        patch.setattr(attitude_cost, "_COUNTED", 24)
        for counted in caches:
            counted.cache_clear()
        yield
    for counted in caches:
        counted.cache_clear()


@pytest.fixture(autouse=True, scope="session")
def _one_command_line() -> Generator[None]:
    """Put the command line together once, not at each call: that takes 50 ms."""
    import typer.main
    import typer.testing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.main, "get_command", cache(typer.main.get_command))
        patch.setattr(typer.testing, "_get_command", typer.main.get_command)
        yield
