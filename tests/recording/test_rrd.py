"""A recording on a disk that fills up: an error with the system's own words, and never an endless wait."""

from __future__ import annotations

import errno
import threading
from pathlib import Path

import numpy as np
import pytest

from sinssim.recording.rrd import Recording
from sinssim.recording.streams import Stream, Vector

FULL = Path("/dev/full")  # every write to it fails as on a full disk


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
