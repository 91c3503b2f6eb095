"""The cache of compiled kernels: damaged, full or missing, it costs time and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

USE = """
from sinssim.jit import inline, kernel

@inline
def double_k(x: float) -> float:
    return 2.0 * x

@kernel
def seven(x: float) -> float:
    return double_k(x) + 1.0

print(seven(3.0))
"""


def used(folder: Path, cache: Path) -> subprocess.CompletedProcess[str]:
    """Compile and call a kernel that lies in a file of the folder, in a process of its own."""
    (folder / "use.py").write_text(USE)
    done = subprocess.run(
        [sys.executable, str(folder / "use.py")],
        env={**os.environ, "SINSSIM_CACHE": str(cache), "NUMBA_DEBUG_CACHE": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "7.0"
    return done


@pytest.mark.parametrize("damage", [b"", b"not a pickle", b"\x80\x04."])
@pytest.mark.parametrize("which", ["*.nbi", "*.nbc"])
def test_a_damaged_file_is_compiled_anew(tmp_path: Path, damage: bytes, which: str) -> None:
    used(tmp_path, tmp_path / "cache")
    files = list((tmp_path / "cache").rglob(which))
    assert files
    for file in files:
        file.write_bytes(damage)
    used(tmp_path, tmp_path / "cache")
    assert "data saved" not in used(tmp_path, tmp_path / "cache").stdout  # and kept again


def test_nowhere_to_keep_kernels_is_a_warning_and_leaves_nothing_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = used(tmp_path, tmp_path / "file")
    assert done.stderr.startswith(f"the compiled kernels cannot be kept in {tmp_path / 'file' / 'kernels'}")
    assert done.stderr.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"file", "use.py"}


def test_a_full_disk_is_a_warning(tmp_path: Path) -> None:
    """Files may not grow beyond a few bytes: what is written breaks off as on a full disk."""
    limited = "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    limited += "resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10))\n"
    (tmp_path / "sitecustomize.py").write_text(limited)
    cache = tmp_path / "cache"
    (tmp_path / "use.py").write_text(USE)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "use.py")],
        env={**os.environ, "SINSSIM_CACHE": str(cache), "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "7.0\n"), done.stderr
    assert done.stderr.count("\n") == 1
    assert "cannot be kept" in done.stderr
    assert not [file for file in cache.rglob("*") if file.is_file()]
