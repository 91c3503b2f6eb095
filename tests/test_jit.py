"""The cache of compiled kernels: damaged, full or missing, it costs time and nothing else."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from sinssim.system.locks import MARK, remove_unused

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


def used(folder: Path, cache: Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Compile and call a kernel that lies in a file of the folder, in a process of its own."""
    (folder / "use.py").write_text(USE)
    done = subprocess.run(
        [sys.executable, str(folder / "use.py")],
        env={**os.environ, "SINSSIM_CACHE": str(cache), "NUMBA_DEBUG_CACHE": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False, **options,
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
    assert not [file for file in cache.rglob("*") if file.is_file() and file.name != MARK]


def as_anybody() -> None:
    """Take from the process to come what lets the superuser write where nobody may."""
    drop_bound, override = 24, 1  # PR_CAPBSET_DROP and CAP_DAC_OVERRIDE of linux/prctl.h and linux/capability.h
    ctypes.CDLL(None).prctl(drop_bound, override, 0, 0, 0)


@pytest.mark.skipif(sys.platform != "linux", reason="whether the superuser may write is settled by other means here")
@pytest.mark.parametrize("marked", [True, False])
def test_a_read_only_folder_is_read(tmp_path: Path, marked: bool) -> None:
    """As in a container's image: the kernels that it holds are loaded, one that it lacks is compiled with a warning."""
    cache = tmp_path / "cache"
    used(tmp_path, cache)
    if not marked:
        next(cache.rglob(MARK)).unlink()
    before = sorted(cache.rglob("*"))
    for place in (cache, *before):
        place.chmod(0o555 if place.is_dir() else 0o444)
    try:
        done = used(tmp_path, cache, preexec_fn=as_anybody)
        assert "data loaded" in done.stdout
        assert done.stderr == ""
        (tmp_path / "other").mkdir()
        done = used(tmp_path / "other", cache, preexec_fn=as_anybody)
        assert "data saved" not in done.stdout
        assert done.stderr.count("cannot be kept") == 1
        assert sorted(cache.rglob("*")) == before
    finally:
        for place in (cache, *before):
            place.chmod(0o755)


def test_old_versions_go_but_not_from_under_a_process(tmp_path: Path) -> None:
    """The one that is used is older than all others, and the next but one process would have removed it."""
    cache = tmp_path / "cache"
    used(tmp_path, cache)
    kernels = cache / "kernels"
    (ours,) = kernels.iterdir()
    in_use, unused = kernels / "in-use", kernels / "unused"
    shutil.copytree(ours, in_use)
    shutil.copytree(ours, unused)
    others = [kernels / str(number) for number in range(6)]
    for age, folder in enumerate((in_use, unused, *others)):
        folder.mkdir(exist_ok=True)
        os.utime(folder, (age, age))
    code = f"""
import sys
from pathlib import Path
from sinssim.system.locks import hold
hold(Path({str(in_use)!r}), shared=True)
print("held", flush=True)
sys.stdin.read()
"""
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdin is not None
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        os.utime(in_use, (0, 0))
        os.utime(unused, (1, 1))
        used(tmp_path, cache)
        other.stdin.close()
    assert in_use.is_dir()
    assert list(in_use.rglob("*.nbc"))
    assert not unused.exists()
    assert {folder.name for folder in kernels.iterdir()} == {"in-use", ours.name, *"12345"}


def test_the_folder_of_this_process_is_marked(tmp_path: Path) -> None:
    """While it runs another process cannot remove it; afterwards it can."""
    text = "import sys\nprint('ready', flush=True)\nsys.stdin.read()\n"
    (tmp_path / "use.py").write_text(USE + text)
    with subprocess.Popen(
        [sys.executable, str(tmp_path / "use.py")],
        env={**os.environ, "SINSSIM_CACHE": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as user:  # fmt: skip
        assert user.stdin is not None
        assert user.stdout is not None
        while b"ready" not in user.stdout.readline():
            assert user.poll() is None
        (folder,) = (tmp_path / "cache" / "kernels").iterdir()
        assert not remove_unused(folder)
        assert folder.is_dir()
        user.stdin.close()
    assert remove_unused(folder)
    assert not folder.exists()


COMPILES = """
import os, signal, threading, time
from numba.core import event
from sinssim.jit import kernel
from sinssim.system.signals import interruptible

@kernel
def seven(x: float) -> float:
    return 2.0 * x + 1.0

class Slow(event.Listener):
    def on_start(self, what):
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        time.sleep(2.0)
    def on_end(self, what):
        os.write(1, b"compiled")

event.register("numba:compile", Slow())
try:
    with interruptible(signal.SIGINT):
        seven(3.0)
except KeyboardInterrupt:
    os.write(1, b"interrupted")
    os._exit(0)
"""


def test_an_interruption_does_not_wait_for_the_compiler(tmp_path: Path) -> None:
    (tmp_path / "use.py").write_text(COMPILES)
    done = subprocess.run(
        [sys.executable, str(tmp_path / "use.py")],
        env={**os.environ, "SINSSIM_CACHE": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("interrupted", "")


TELLS = """
from sinssim.jit import compilation, inline, kernel

@inline
def double_k(x: float) -> float:
    return 2.0 * x

@kernel
def seven(x: float) -> float:
    return double_k(x) + 1.0

@kernel
def eight(x: float) -> float:
    return seven(x) + 1.0

told = []
with compilation(told.append):
    seven(3.0)
    eight(3.0)
seven(3)
print(told)
"""


def test_compilation_is_told_of_once(tmp_path: Path) -> None:
    """Of each kernel that is called, not of those within it, and not when they come from the cache."""
    (tmp_path / "use.py").write_text(TELLS)
    said = [
        subprocess.run(
            [sys.executable, str(tmp_path / "use.py")],
            env={**os.environ, "SINSSIM_CACHE": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True, text=True, check=True,
        ).stdout
        for _ in range(2)
    ]  # fmt: skip
    assert said == ["[True, False, True, False]\n", "[]\n"]
