"""Memory goes back to the system where its library can do that; the machine's memory is the least of its limits."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

from sinssim.system.memory import machine_memory

FREED = """
from pathlib import Path
from sinssim.system.memory import give_back_memory

def resident() -> int:
    return int(next(line for line in Path("/proc/self/status").read_text().splitlines() if "VmRSS" in line).split()[1])

blocks = [bytearray(2000) for _ in range(50_000)]
pin = bytearray(2000)  # above all others, so that the heap cannot shrink by itself
del blocks
before = resident()
give_back_memory()
print(before - resident())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has malloc_trim")
def test_freed_blocks_go_back_to_the_system() -> None:
    done = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, check=True)
    assert int(done.stdout) > 80_000  # [kB] of 100 MB


def test_the_machine_has_memory() -> None:
    assert machine_memory() > 1e8
