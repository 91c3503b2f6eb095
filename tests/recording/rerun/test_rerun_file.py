"""A recording on a disk that fills up: an error with the system's own words, and never an endless wait."""

from __future__ import annotations

import errno
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from rerun.chunk import RrdReader

from sinssim.recording import rerun_file
from sinssim.recording.rerun_file import Recording
from sinssim.recording.streams import Stream, Vector
from tests.fork import Fork

TASKS = Path("/proc/self/task")
FULL = Path("/dev/full")  # every write to it fails as on a full disk


def test_times_are_whole_nanoseconds() -> None:
    times = rerun_file.nanoseconds(np.array([0.0, 1.5e-9 + 1e-12, 3600.25]))
    assert times.astype(np.int64).tolist() == [0, 2, 3_600_250_000_000]


@pytest.mark.parametrize("pipes", [True, False])
def test_the_file_is_whole_however_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pipes: bool) -> None:
    monkeypatch.setattr(rerun_file, "_PIPES_HAVE_NAMES", pipes)
    with Recording(tmp_path / "run.rrd", "whole") as recording:
        record_much(recording)
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", tmp_path / "run.rrd"], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = sum(
        chunk.num_rows for chunk in RrdReader(tmp_path / "run.rrd").stream().filter(content="/streams/noise/xyz")
    )
    assert rows == 20 * 65536 + 20


@pytest.mark.skipif(not TASKS.exists(), reason="needs /proc")
def test_threads_of_a_recording_end_with_the_next(tmp_path: Path) -> None:
    before = len(list(TASKS.iterdir()))
    for number in range(8):
        with Recording(tmp_path / f"{number}.rrd", "short") as recording:
            recording.stream(Stream("noise", np.arange(3.0), (Vector("xyz", ("x", "y", "z"), np.eye(3)),)))
    assert len(list(TASKS.iterdir())) < before + 8  # those of the last and Rerun's own few, not two for each


def test_a_forked_process_records(tmp_path: Path) -> None:
    def record(name: str) -> None:
        with Recording(tmp_path / name, "short") as recording:
            recording.stream(Stream("noise", np.arange(3.0), (Vector("xyz", ("x", "y", "z"), np.eye(3)),)))

    record("before.rrd")
    other = Fork(lambda: record("forked.rrd"))
    assert other.wait() == 0, other.stderr()
    assert len(list(RrdReader(tmp_path / "forked.rrd").stream())) == len(
        list(RrdReader(tmp_path / "before.rrd").stream())
    )


def record_much(recording: Recording) -> None:
    rows = np.random.default_rng(0).normal(size=(65536, 3))
    stream = Stream("noise", np.arange(65536.0), (Vector("xyz", ("x_m", "y_m", "z_m"), rows),))
    for _ in range(20):
        recording.stream(stream)


@pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_an_error_and_no_endless_wait():
    for _ in range(20):  # Rerun's own writer waited for ever in one case of ten or so
        recording = Recording(FULL, "full disk")
        with pytest.raises(OSError, match="No space left on device") as caught:
            record_much(recording)
        assert caught.value.errno == errno.ENOSPC
        with pytest.raises(OSError, match="No space left on device"):
            recording.close()
    assert not [thread for thread in threading.enumerate() if thread.name == "recording"]
