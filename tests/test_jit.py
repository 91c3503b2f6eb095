"""The cache of compiled kernels: damaged, full or missing, it costs time and nothing else."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import sinssim
from sinssim import jit
from sinssim.jit import DIGEST_BYTES, content_digest
from sinssim.strapdown.gimballed_platform import _engine
from tests.forked import Forks
from tests.slow import slow

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
MORE = """
@kernel
def eight(x: float) -> float:
    return x + 1.0

print(eight(6.0))
"""

Use = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def forks() -> Iterator[Forks]:
    with Forks() as started:
        yield started


@pytest.fixture(scope="module")
def used(forks: Forks) -> Use:
    """Compiles and calls a kernel that lies in a file of a folder, in a process of its own."""

    def use(folder: Path, cache: Path, code: str = USE) -> subprocess.CompletedProcess[str]:
        (folder / "use.py").write_text(code)
        done = forks.run(folder / "use.py", SINSSIM_CACHE=str(cache), NUMBA_DEBUG_CACHE="1")
        assert done.returncode == 0, done.stderr
        assert done.stdout.splitlines()[-1] == "7.0"
        return done

    return use


@pytest.fixture(scope="module")
def used_once(tmp_path_factory: pytest.TempPathFactory, used: Use) -> Path:
    """A cache with the kernels of `USE`, and the file that has them."""
    folder = tmp_path_factory.mktemp("used")
    used(folder, folder / "cache")
    return folder


@pytest.mark.parametrize("damage", [b"", b"not a pickle", b"\x80\x04."])
@pytest.mark.parametrize("which", ["*.nbi", "*.nbc"])
def test_a_damaged_file_is_compiled_anew(tmp_path: Path, used_once: Path, used: Use, damage: bytes, which: str) -> None:
    shutil.copytree(used_once / "cache", tmp_path / "cache")
    files = list((tmp_path / "cache").rglob(which))
    assert files
    for file in files:
        file.write_bytes(damage)
    used(tmp_path, tmp_path / "cache")
    assert "data saved" not in used(tmp_path, tmp_path / "cache").stdout  # and kept again
    assert {file.name for file in (tmp_path / "cache").rglob(which)} == {file.name for file in files}


@pytest.mark.parametrize(("which", "parts"), [("*.nbc", 1), *slow(("*.nbi", 9), ("*.nbc", 9))])
def test_a_flipped_bit_is_found(tmp_path: Path, used_once: Path, used: Use, which: str, parts: int) -> None:
    """Machine code with a wrong bit would be executed: in most places it crashes, or gives another number."""
    kernel = f"seven-{which}"
    size = next((used_once / "cache" / "kernels").glob(kernel)).stat().st_size
    for place in (0, 20, *range(size // 10, size, size // parts), size - 1):
        shutil.copytree(used_once / "cache", tmp_path / "cache")
        (file,) = (tmp_path / "cache" / "kernels").glob(kernel)
        contents = bytearray(file.read_bytes())
        contents[place] ^= 1 << place % 8
        file.write_bytes(contents)
        done = used(tmp_path, tmp_path / "cache")
        assert done.stderr == f"the compiled kernel in {file} is damaged: it is compiled again.\n"
        assert used(tmp_path, tmp_path / "cache").stderr == ""
        shutil.rmtree(tmp_path / "cache")


def test_code_of_another_signature_is_not_used(tmp_path: Path, used: Use) -> None:
    """Two processes that compile two signatures at once may store their code under one name."""
    both = USE.replace("print(seven(3.0))", "print(seven(3))\nprint(seven(3.0))")
    used(tmp_path, tmp_path / "cache", both)
    kernels = tmp_path / "cache" / "kernels"
    first, second = sorted(kernels.glob("seven-*.nbc"))
    for one, other in ((first, second), (second, first)):
        contents = one.read_bytes()[DIGEST_BYTES:]
        kept = other.read_bytes()
        other.write_bytes(content_digest(str(other), contents) + contents)
        assert used(tmp_path, tmp_path / "cache", both).stderr == ""
        other.write_bytes(kept)


def test_kernels_that_check_their_indices_are_others(
    tmp_path: Path, used: Use, monkeypatch: pytest.MonkeyPatch
) -> None:
    used(tmp_path, tmp_path / "cache")
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    for saved in (True, False):
        assert ("data saved" in used(tmp_path, tmp_path / "cache").stdout) == saved


def test_nowhere_to_keep_kernels_is_a_warning_and_leaves_nothing_elsewhere(tmp_path: Path, used: Use) -> None:
    (tmp_path / "file").touch()
    done = used(tmp_path, tmp_path / "file")
    assert done.stderr.startswith(f"the compiled kernels cannot be stored in {tmp_path / 'file' / 'kernels'}")
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
        env={**os.environ, "SINSSIM_CACHE": str(cache), "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
             "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "7.0\n"), done.stderr
    assert done.stderr.count("\n") == 1
    assert "cannot be stored" in done.stderr
    assert not [file for file in cache.rglob("*") if file.is_file()]


def as_anybody() -> None:
    """Take from the process to come what lets the superuser write where nobody may."""
    drop_bound, override = 24, 1  # PR_CAPBSET_DROP and CAP_DAC_OVERRIDE of linux/prctl.h and linux/capability.h
    ctypes.CDLL(None).prctl(drop_bound, override, 0, 0, 0)


@pytest.mark.skipif(sys.platform != "linux", reason="whether the superuser may write is settled by other means here")
def test_a_read_only_folder_is_read(tmp_path: Path, used: Use) -> None:
    """As in a container's image: the kernels that it holds are loaded, one that it lacks is compiled with a warning."""
    cache = tmp_path / "cache"
    used(tmp_path, cache)
    before = sorted(cache.rglob("*"))
    for place in (cache, *before):
        place.chmod(0o555 if place.is_dir() else 0o444)

    def use(code: str) -> subprocess.CompletedProcess[str]:
        (tmp_path / "use.py").write_text(code)
        done = subprocess.run(
            [sys.executable, str(tmp_path / "use.py")],
            env={**os.environ, "SINSSIM_CACHE": str(cache), "NUMBA_DEBUG_CACHE": "1", "PYTHONDONTWRITEBYTECODE": "1"},
            preexec_fn=as_anybody, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "7.0"), done.stderr
        return done

    try:
        done = use(USE + MORE)
        assert "data loaded" in done.stdout
        assert "data saved" not in done.stdout
        assert done.stderr.count("cannot be stored") == 1
        assert sorted(cache.rglob("*")) == before
    finally:
        for place in (cache, *before):
            place.chmod(0o755)


def test_the_least_used_kernels_go_when_there_are_too_many(tmp_path: Path, used: Use) -> None:
    """Of kernels that fill the cache to its limit the one goes that was not used for longest."""
    kernels = tmp_path / "cache" / "kernels"
    kernels.mkdir(parents=True)
    for age, name in enumerate(("newest", "middle", "oldest")):
        for suffix in ("nbi", "1.nbc"):
            with (kernels / f"{name}-0.{suffix}").open("wb") as file:
                file.truncate(2**26 if name != "middle" else 2**24)  # takes no room on the disk
            os.utime(kernels / f"{name}-0.{suffix}", (1e9 - age, 1e9 - age))
    used(tmp_path, tmp_path / "cache")
    names = {path.name.split("-")[0] for path in kernels.iterdir()}
    assert names == {"newest", "middle", "double_k", "seven"}


def test_a_kernel_that_another_process_removes_meanwhile_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A link to nothing is listed, but has no size: as a file that is gone when its size is asked for."""
    (tmp_path / "gone-0.nbi").symlink_to(tmp_path / "nothing")
    (tmp_path / "left-0.nbi").write_bytes(b"12")
    monkeypatch.setattr(jit, "kernel_folder", lambda: tmp_path)
    monkeypatch.setattr(jit, "_MOST", 1)
    jit.make_room.__wrapped__()
    assert [path.name for path in tmp_path.iterdir()] == ["gone-0.nbi"]


def test_use_keeps_a_kernel_young(tmp_path: Path, used: Use) -> None:
    used(tmp_path, tmp_path / "cache")
    files = list((tmp_path / "cache" / "kernels").glob("seven-*.nbi"))
    os.utime(files[0], (1e9, 1e9))
    used(tmp_path, tmp_path / "cache")
    assert len(files) == 1
    assert files[0].stat().st_mtime > 1.7e9


PARTS = """
from math import cos
from typing import NamedTuple
import numpy as np
import sinssim.other as other
from sinssim.jit import inline, kernel, strict_kernel
from sinssim.other import FACTOR, thrice_k

TABLE = np.array([1.0, 2.0])
PAIR = (1, 2.0)

class Point(NamedTuple):
    x: float
    y: float = 2.0

@inline
def inner_k(x: float) -> float:
    return thrice_k(x) + TABLE[1] + PAIR[1] + other.OFFSET + 1.0

@kernel
def whole(x: float) -> float:
    p = Point(inner_k(x), FACTOR)
    return p.x + 10.0 * p.y + cos(0.0)

print(whole(3.0))
"""
OTHER = """
from sinssim.jit import inline

FACTOR, OFFSET, UNUSED = 5.0, 7.0, 1.0

@inline
def thrice_k(x: float) -> float:
    return 3.0 * x
"""


class Copy:
    """A package of two modules with `sinssim.jit`, and the kernels that it compiled."""

    def __init__(self, folder: Path, forks: Forks) -> None:
        self._forks = forks
        self.cache, self.package = folder / "cache", folder / "package" / "sinssim"
        own = Path(sinssim.__file__).parent
        shutil.copytree(own / "system", self.package / "system")
        shutil.copy(own / "jit.py", self.package)
        (self.package / "__init__.py").touch()

    def run(self, whole: str, other: str) -> tuple[float, set[str]]:
        """Return what the package prints, and the kernels that were compiled for it."""
        (self.package / "whole.py").write_text(whole)
        (self.package / "other.py").write_text(other)
        done = self._forks.run(
            "-m", "sinssim.whole",
            cwd=self.package.parent, SINSSIM_CACHE=str(self.cache), NUMBA_DEBUG_CACHE="1",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        saved = [line for line in done.stdout.splitlines() if "data saved" in line]
        names = {name for name in ("thrice_k", "inner_k", "whole") if any(f"/{name}-" in line for line in saved)}
        return float(done.stdout.splitlines()[-1]), names


@pytest.fixture(scope="module")
def compiled_once(tmp_path_factory: pytest.TempPathFactory, forks: Forks) -> Path:
    folder = tmp_path_factory.mktemp("compiled")
    assert Copy(folder, forks).run(PARTS, OTHER) == (72.0, {"thrice_k", "inner_k", "whole"})
    return folder / "cache"


@pytest.mark.parametrize(
    ("before", "after", "value", "compiled"),
    [
        ("UNUSED = 5.0, 7.0, 1.0", "UNUSED = 5.0, 7.0, 2.0", 72.0, set()),
        ("FACTOR, OFFSET, UNUSED = 5.0", "FACTOR, OFFSET, UNUSED = 6.0", 82.0, {"whole"}),
        ("5.0, 7.0", "5.0, 8.0", 73.0, {"inner_k", "whole"}),
        ("return 3.0 * x", "return 4.0 * x", 75.0, {"thrice_k", "inner_k", "whole"}),
        ("[1.0, 2.0]", "[1.0, 3.0]", 73.0, {"inner_k", "whole"}),
        ("(1, 2.0)", "(1, 3.0)", 73.0, {"inner_k", "whole"}),
        ("import cos", "import sin as cos", 71.0, {"whole"}),
        ("import cos", "import cos as cos", 72.0, set()),
        ("x: float\n    y: float = 2.0", "y: float\n    x: float = 2.0", 216.0, {"whole"}),
        ("@kernel", "@strict_kernel", 72.0, {"whole"}),
        ("def inner_k", "\n# moved by a line\ndef inner_k", 72.0, set()),
    ],
)
def test_an_edit_compiles_what_it_reaches_and_nothing_else(
    tmp_path: Path, compiled_once: Path, forks: Forks, before: str, after: str, value: float, compiled: set[str]
) -> None:
    """Each kind of thing that a kernel is compiled from, changed after another process has compiled it."""
    shutil.copytree(compiled_once, tmp_path / "cache")
    edited = [text.replace(before, after, 1) for text in (PARTS, OTHER)]
    assert edited != [PARTS, OTHER]
    assert Copy(tmp_path, forks).run(*edited) == (value, compiled)


COMPILES = """
import os, signal, threading, time
from numba.core import event
from sinssim.jit import kernel
from sinssim.system.process import interruptible

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


def test_an_interruption_does_not_wait_for_the_compiler(tmp_path: Path, forks: Forks) -> None:
    (tmp_path / "use.py").write_text(COMPILES)
    done = forks.run(tmp_path / "use.py", SINSSIM_CACHE=str(tmp_path / "cache"))
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


def test_compilation_is_told_of_once(tmp_path: Path, forks: Forks) -> None:
    """Of each kernel that is called, not of those within it, and not when they come from the cache."""
    (tmp_path / "use.py").write_text(TELLS)
    said = [forks.run(tmp_path / "use.py", SINSSIM_CACHE=str(tmp_path / "cache")).stdout for _ in range(2)]
    assert said == ["[True, False, True, False]\n", "[]\n"]


FACTOR = 2.0


@jit.inline
def scaled(x: float) -> float:
    return FACTOR * x


@jit.inline
def shifted(x: float) -> float:
    return scaled(x) + 1.0


@jit.kernel
def outer(x: float) -> float:
    return shifted(x)


def test_a_copy_has_other_values_in_all_that_it_calls_and_the_original_keeps_its_own() -> None:
    assert jit.rebound(outer, "outer_of_five", FACTOR=5.0)(3.0) == 16.0
    assert outer(3.0) == 7.0
    assert jit.rebound(outer, "same", NOT_USED=1.0) is outer


def test_the_key_of_the_platform_is_the_same_in_another_process(forks: Forks) -> None:
    """It had the address of a function that keeps its results: each process compiled the kernel again, for 5 s."""
    code = "from sinssim.strapdown.gimballed_platform import _engine; print(_engine('exact')._cache.key)"
    there = forks.run("-c", code, cwd=Path(sinssim.__file__).parents[1])
    assert there.stdout == f"{_engine('exact')._cache.key}\n"


def test_the_key_of_a_kernel_with_a_set_of_options_does_not_depend_on_the_order_of_the_set() -> None:
    """The order of a set of strings differs between processes."""
    code = "import sinssim.jit as j; f = j.inline(lambda x: x + 1.0); print(f._cache._options)"
    found = {
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, text=True
        ).stdout
        for seed in ("1", "2")
    }
    assert len(found) == 1
    assert found != {""}


@pytest.mark.parametrize(
    "error",
    [ModuleNotFoundError("No module named 'sinssim.former'"), AttributeError("Can't get attribute 'Former'")],
    ids=["module", "class"],
)
def test_a_kernel_of_other_names_is_compiled_again_without_a_word(
    error: Exception, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A version whose modules or classes had other names stored it: nothing is damaged."""
    from numba.core.caching import FunctionCache

    def missing(*arguments: object) -> None:
        raise error

    @jit.kernel
    def twice(x: float) -> float:
        return 2.0 * x

    monkeypatch.setattr(FunctionCache, "load_overload", missing)
    monkeypatch.setattr(FunctionCache, "save_overload", missing)  # that version stores it once more at the same time
    assert twice(1.5) == 3.0
    assert not caplog.records
