"""A run that is shown while it is computed; the viewer has no window, and writes what it receives to a file."""

from __future__ import annotations

import signal
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from rerun.chunk import RrdReader

from sinssim.experiments.run.run_execution import run
from sinssim.recording import rerun_file
from sinssim.recording import rerun_viewer as viewers
from sinssim.recording.rerun_viewer import LiveViewer
from sinssim.scenario import load_scenario
from tests.cli.test_cli import call

pytestmark = pytest.mark.filterwarnings("ignore::rerun.error_utils.RerunWarning")

SHORT = ["parked.duration_s=5", "imu.rate_hz=20", 'navigation.algorithms=["quaternion"]']


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewers, "_SETTLED_SECONDS", 0.05)


@pytest.fixture
def receiver(tmp_path: Path) -> Iterator[LiveViewer]:
    with LiveViewer(["--save", str(tmp_path / "received.rrd")]) as viewer:
        yield viewer


def contents(file: Path) -> Counter[str]:
    """Return the rows of each entity, without those of the layout, whose order a viewer may change."""
    rows: Counter[str] = Counter()
    for chunk in RrdReader(file).stream():
        if not any(part in chunk.entity_path for part in ("viewport", "panel", "/view/", "/container/", "__")):
            rows[chunk.entity_path] += chunk.num_rows
    return rows


def received(file: Path, until: Counter[str]) -> Counter[str]:
    """Return what a viewer has received, once that is all or ten seconds have passed."""
    deadline, rows = time.monotonic() + 10.0, Counter[str]()
    while rows != until and time.monotonic() < deadline:
        time.sleep(0.1)
        rows = contents(file)
    return rows


@pytest.mark.parametrize("name", ["parked", "one_component"])
def test_the_viewer_receives_all_of_the_recording(name: str, receiver: LiveViewer, tmp_path: Path) -> None:
    settings = SHORT if name == "parked" else ["one_component.duration_s=60"]
    result = run(load_scenario(name, settings), tmp_path / "run", viewer=receiver)
    alone = run(load_scenario(name, settings), tmp_path / "alone")
    assert result.directory is not None
    assert alone.directory is not None
    recorded = contents(result.directory / "recording.rrd")
    assert recorded.total() > 100
    assert recorded == contents(alone.directory / "recording.rrd")
    assert received(tmp_path / "received.rrd", recorded) == recorded
    assert not receiver.is_lost


def write(file: Path, viewer: LiveViewer, what: signal.Signals) -> None:
    """Write a recording whose viewer gets a signal in the midst of it."""
    time_s = np.arange(300_000.0)
    with rerun_file.Recording(file, "live", viewer=viewer) as recording:
        for number in range(4):
            if number == 1:
                psutil.Process(viewer._viewer.process.pid).send_signal(what)
            recording.series(f"a/{number}", time_s, time_s[:, np.newaxis], ["a"])
    assert viewer.is_lost


@pytest.mark.parametrize("what", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_is_closed_or_hangs_leaves_a_complete_recording(
    what: signal.Signals, receiver: LiveViewer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rerun_file, "_MOST_SECONDS", 0.5)
    write(tmp_path / "whole.rrd", receiver, what)
    rows = contents(tmp_path / "whole.rrd")
    assert [rows[f"/a/{number}"] for number in range(4)] == [300_001] * 4  # and the look of its line


def test_without_a_screen_nothing_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(viewers, "_SETTLED_SECONDS", 10.0)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    assert call("run", "parked", "--live", "-o", str(tmp_path / "run")) == 1
    assert "found no screen to open its window on" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


class _Closed(LiveViewer):
    """A viewer that receives, and whose window the user closes once the program waits for it."""

    waited = 0

    def __init__(self) -> None:
        super().__init__(["--serve-grpc"])

    def wait(self) -> None:
        type(self).waited += 1


def test_the_program_waits_for_the_window(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(viewers, "LiveViewer", _Closed)
    settings: list[Any] = [word for setting in SHORT for word in ("--set", setting)]
    assert call("run", "parked", "--live", "-o", str(tmp_path / "run"), *settings) == 0
    assert _Closed.waited == 1
    assert "The viewer ends with this program" in capsys.readouterr().err
    assert (tmp_path / "run" / "recording.rrd").is_file()


@pytest.mark.parametrize(
    ("further", "words"),
    [(("--keep", "report"), "--live shows the recording"), (("--view", "navigation"), "give one of them")],
)
def test_what_live_excludes(
    further: tuple[str, ...], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call("run", "parked", "--live", "-o", str(tmp_path / "run"), *further) == 2
    assert words in capsys.readouterr().err
