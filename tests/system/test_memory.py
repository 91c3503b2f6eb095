"""Memory goes back to the system where its library can do that; the machine's memory is the least of its limits."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sinssim.system import process
from sinssim.system.process import machine_memory, shared

FREED = """
from pathlib import Path
from sinssim.system.process import give_back_memory

def resident() -> int:
    return int(next(line for line in Path("/proc/self/status").read_text().splitlines() if "VmRSS" in line).split()[1])

blocks = [bytearray(2000) for _ in range(50_000)]
pin = bytearray(2000)  # above all others, so that the heap cannot shrink by itself
del blocks
before = resident()
give_back_memory()
print(before - resident())
"""


APART = """
from pathlib import Path
from sinssim.system.process import map_large_arrays

def resident() -> int:
    return int(next(line for line in Path("/proc/self/status").read_text().splitlines() if "VmRSS" in line).split()[1])

del (freed := [bytearray(30_000_000)])[:]  # from here on glibc by itself puts smaller arrays between the small blocks
map_large_arrays()
arrays, pins = [], []
for _ in range(20):
    arrays.append(bytearray(b"x") * 5_000_000)
    pins.append(bytearray(2000))  # above it
before = resident()
arrays.clear()
print(before - resident())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has mallopt")
def test_large_arrays_go_back_to_the_system_as_soon_as_they_are_freed() -> None:
    done = subprocess.run([sys.executable, "-c", APART], capture_output=True, text=True, check=True)
    assert int(done.stdout) > 90_000  # [kB] of 100 MB


def test_equal_arrays_become_one() -> None:
    one, known = np.arange(5.0), []
    assert shared(one, known) is one
    assert shared(np.arange(5.0), known) is one
    others = np.arange(6.0), np.arange(5), np.array([0.0, 1.0, 2.0, 3.0, np.nan])
    assert all(shared(other, known) is other for other in others)
    assert len(known) == 4


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has malloc_trim")
def test_freed_blocks_go_back_to_the_system() -> None:
    done = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, check=True)
    assert int(done.stdout) > 80_000  # [kB] of 100 MB


def test_the_machine_has_memory() -> None:
    assert machine_memory() > 1e8


def test_the_least_limit_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A container with 64 MB on a larger machine, and one without a limit."""
    (tmp_path / "limit").write_text("64000000\n")
    (tmp_path / "none").write_text("max\n")
    monkeypatch.setattr(process, "_CGROUP", (tmp_path / "none", tmp_path / "limit"))
    assert machine_memory() == 64e6
