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

from sinssim.recording.rerun import rrd
from sinssim.recording.rerun.rrd import Recording
from sinssim.recording.streams import Stream, Vector

FULL = Path("/dev/full")  # every write to it fails as on a full disk


def test_times_are_whole_nanoseconds() -> None:
    times = rrd.nanoseconds(np.array([0.0, 1.5e-9 + 1e-12, 3600.25]))
    assert times.astype(np.int64).tolist() == [0, 2, 3_600_250_000_000]


@pytest.mark.parametrize("pipes", [True, False])
def test_the_file_is_whole_however_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pipes: bool) -> None:
    monkeypatch.setattr(rrd, "_PIPES_HAVE_NAMES", pipes)
    with Recording(tmp_path / "run.rrd", "whole") as recording:
        record_much(recording)
    binary = Path(rerun_cli.__file__).parent / "rerun"
    done = subprocess.run([binary, "rrd", "verify", tmp_path / "run.rrd"], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = sum(
        chunk.num_rows for chunk in RrdReader(tmp_path / "run.rrd").stream().filter(content="/streams/noise/xyz")
    )
    assert rows == 20 * 65536 + 20


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
