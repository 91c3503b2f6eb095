"""What the parts of the system layer return and say, from small cases whose answer is written down."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim import __version__, jit
from sinssim.data import described, html_lines, html_table, short_repr
from sinssim.errors import InputError
from sinssim.experiments.experiment_directory import Kind, Store, read_manifest, written_files
from sinssim.recording.result import RunDirectory, _beside
from sinssim.system import files, process
from sinssim.system.files import (
    MARK,
    Draft,
    check_inside,
    check_place,
    open_own,
    publish,
    remove,
    write_text,
    written,
)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.array([[3.0, np.nan, -0.5], [7.25, 2.0, np.inf]]), "2 × 3 array, -0.5 … 7.25"),
        (np.arange(5) + 3, "5 array, 3 … 7"),
        (np.array(2.5), "2.5"),
        (np.zeros((2, 0)), "2 × 0 array"),
        (np.array(["a"] * 5), "5 array"),
        (np.array([1, 2, 3, 4]), "[1, 2, 3, 4]"),
        (True, "True"),
        (None, "None"),
        (1234567.89, "1.23457e+06"),
        (12, "12"),
        (np.float32(0.5), "0.5"),
        ("x" * 70, "'" + "x" * 59 + "… (72 characters)"),
        (Path("a/b"), "'a/b'"),
        ({1: 2, "k": 3}, "{1, 'k'}"),
        ([1.0, "a"], "(1, 'a')"),
        (object(), "object(…)"),
        (tuple("abcd"), "('a', 'b', 'c', 'd')"),
    ],
)
def test_values_in_a_few_words(value: Any, words: str) -> None:
    assert described(value) == words


@short_repr
@dataclasses.dataclass
class Two:
    """Two values.

    Attributes:
        first, second: numbers
            of it.
        third: another.
    """

    first: int
    second: float
    third: str = "x"


def test_tables_for_notebooks() -> None:
    left = 'style="text-align: left"'
    assert html_table("A & B", [("1", "<2>")], ("h", "i")) == (
        f"<b>A &amp; B</b><table><tr><th {left}>h</th><th {left}>i</th></tr>"
        f"<tr><td {left}>1</td><td {left}>&lt;2&gt;</td></tr></table>"
    )
    assert html_lines(["a<", "b"]) == "<pre>a&lt;\nb</pre>"
    assert repr(Two(3, 2.5)) == "Two(first=3, second=2.5, third='x')"
    cells = Two(3, 2.5)._repr_html_().replace(f" {left}", "")
    rows = (
        ("first", "3", "numbers of it."),
        ("second", "2.5", "numbers of it."),
        ("third", "&#x27;x&#x27;", "another."),
    )
    assert cells.endswith("".join(f"<tr>{''.join(f'<td>{c}</td>' for c in row)}</tr>" for row in rows) + "</table>")
    wide = dataclasses.make_dataclass("Wide", [f"name_of_field_{k}" for k in range(60)])
    lines = repr(short_repr(wide)(*range(60))).splitlines()
    assert (len(lines), lines[-1], max(map(len, lines)) <= 100) == (10, "    …)", True)


def test_the_mark_of_a_directory_lists_its_files(tmp_path: Path) -> None:
    place = tmp_path / "run"
    with Draft(tmp_path, "new") as source:
        write_text(source.path / "b.txt", "b")
        (source.path / "a").mkdir()
        write_text(source.path / "a/c.txt", "c")
        assert publish(source, place) == ["a/c.txt", "b.txt"]
    assert (
        place / MARK
    ).read_text() == f'{{\n "sinssim": "{__version__}",\n "files": [\n  "a/c.txt",\n  "b.txt"\n ]\n}}\n'
    assert written(place) == ["a/c.txt", "b.txt"]
    (place / "mine.txt").write_text("mine")
    with Draft(tmp_path, "new") as source:
        write_text(source.path / "d.txt", "d")
        assert publish(source, place, staying=["b.txt"]) == ["d.txt"]
    assert written(place) == ["b.txt", "d.txt"]
    assert sorted(p.relative_to(place).as_posix() for p in place.rglob("*")) == [MARK, "b.txt", "d.txt", "mine.txt"]
    with Draft(tmp_path, "new") as source:
        write_text(source.path / "mine.txt", "new")
        with pytest.raises(InputError, match=r"run/mine\.txt was not written by sinssim and stays unchanged\."):
            publish(source, place)
    assert ((place / "mine.txt").read_text(), written(place)) == ("mine", ["b.txt", "d.txt"])
    remove(place, ["b.txt", "missing.txt"])
    assert not (place / "b.txt").exists()
    (place / "deep/er").mkdir(parents=True)
    (place / "deep/er/x").touch()
    remove(place, ["deep/er/x"])
    assert not (place / "deep").exists()


@pytest.mark.parametrize(
    "text",
    ["", "[]", '{"files": 3}', '{"files": ["../x"]}', '{"files": ["/x"]}', '{"files": ["a/../b"]}', '{"files": [""]}'],
)
def test_a_mark_that_cannot_be_one(tmp_path: Path, text: str) -> None:
    (tmp_path / MARK).write_text(text)
    assert written(tmp_path) is None
    kind = Kind("m.json", ("x.csv",), "runs", "many", "an", "ensemble", "run", "runs")
    with pytest.raises(InputError, match="is damaged"):
        written_files(tmp_path, kind)


def test_links_and_folders_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "real/deep").mkdir(parents=True)
    place = tmp_path / "place"
    place.mkdir()
    (place / "link").symlink_to(tmp_path / "real")
    with pytest.raises(InputError) as error:
        check_inside(place, ["link/deep/x"])
    assert str(error.value) == (
        f"{place}/link is a link, but sinssim writes a file through it; {place} stays unchanged. Give another folder "
        "with -o, or remove the link."
    )
    (place / "there").mkdir()
    with pytest.raises(InputError, match="there is a folder, but sinssim writes a file there"):
        check_inside(place, ["there"])
    check_inside(place, ["new", "there/x"])


def test_what_a_growing_directory_holds(tmp_path: Path) -> None:
    kind = Kind("m.json", ("x.csv",), "runs", "many", "an", "ensemble", "run", "runs")
    assert written_files(tmp_path, kind) == ["m.json", "x.csv"]
    (tmp_path / MARK).write_text('{"files": ["x.csv", "report.html"]}')
    assert written_files(tmp_path, kind) == ["m.json", "x.csv", "report.html"]
    (tmp_path / "m.json").write_text('{"kind": "many", "a": 5}')
    assert read_manifest(tmp_path, kind) == {"kind": "many", "a": 5}
    for text in ('{"kind": "one"}', "[]", "", "{}"):
        (tmp_path / "m.json").write_text(text)
        with pytest.raises(InputError, match=r"is not empty and holds no ensemble: it lacks a readable m\.json"):
            read_manifest(tmp_path, kind)
    with pytest.raises(InputError, match="is a file; give the name of a folder"):
        read_manifest(tmp_path / "m.json", kind)


def test_the_place_of_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A failed run beside an existing one: run-failed, then run-failed-2; those with a mark may be replaced."""
    place = tmp_path / "run"
    assert _beside(place, "failed") == tmp_path / "run-failed"
    (tmp_path / "run-failed").mkdir()
    assert _beside(place, "failed") == tmp_path / "run-failed-2"
    (tmp_path / "run-failed-2").touch()
    assert _beside(place, "failed") == tmp_path / "run-failed-3"
    (tmp_path / "run-failed" / MARK).write_text('{"files": []}')
    assert _beside(place, "failed") == tmp_path / "run-failed"
    check_place(place, False)
    place.mkdir()
    check_place(place, False)  # empty
    (place / "recording.rrd").touch()
    with pytest.raises(InputError, match=r"lacks the file \.sinssim\.json.*If it is a run of an older sinssim"):
        check_place(place, True)
    (place / MARK).write_text('{"files": ["recording.rrd"]}')
    with pytest.raises(InputError, match="already contains a run"):
        check_place(place, False)
    check_place(place, True)
    usage = SimpleNamespace(total=9e9, used=8e9, free=234e6)
    monkeypatch.setattr("shutil.disk_usage", lambda path: usage)
    folder = RunDirectory(tmp_path / "new")
    with pytest.raises(InputError) as error, folder.writing():
        raise OSError(28, "No space left on device")
    assert str(error.value) == (
        f"the run directory {tmp_path}/new could not be written: No space left on device (234 MB were free). Nothing "
        "of this run was kept; existing files are unchanged."
    )
    assert not folder.path.exists()


def test_the_free_space_is_in_megabytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(total=9e9, used=8e9, free=234e6))
    assert Store.free(SimpleNamespace(path=Path())) == 234.0


def test_the_least_memory_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """3000 pages of 4 kB are less than a container's 64 MB; 5 MB of `ulimit -v` are less than both."""
    import resource

    (tmp_path / "limit").write_text("64000000\n")
    monkeypatch.setattr(process, "_CGROUP", (tmp_path / "limit", tmp_path / "missing"))
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 3000}.__getitem__)
    limits = {"soft": resource.RLIM_INFINITY}
    monkeypatch.setattr(
        resource, "getrlimit", lambda kind: (limits["soft"], 1) if kind == resource.RLIMIT_AS else (7, 7)
    )
    assert process.machine_memory() == 3000 * 4096.0
    limits["soft"] = 5_000_000
    assert process.machine_memory() == 5e6


def test_a_file_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_bytes(b"x" * 2345)
    monkeypatch.setattr("sinssim.system.process.machine_memory", lambda: 1000.0)
    with pytest.raises(InputError) as error:
        files.read_bytes(tmp_path / "a")
    assert str(error.value) == f"{tmp_path}/a has 2.35 kB, and this machine's memory 1 kB. Split it into parts."
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe is a named pipe, not an ordinary file"):
        files.open_file(tmp_path / "pipe")
    with pytest.raises(InputError, match="/dev/null is a device, not an ordinary file"):
        files.open_text(Path("/dev/null"), "utf-8")
    (tmp_path / "t").write_bytes("é\r\n".encode("latin-1"))
    monkeypatch.undo()
    with files.open_text(tmp_path / "t", "latin-1", newline="") as text:
        assert text.read() == "é\r\n"
    assert files.read_text(tmp_path / "t", errors="replace") == "\ufffd\n"


def test_folders_of_stored_kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SINSSIM_CACHE goes before XDG_CACHE_HOME, and that before ~/.cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/x")
    monkeypatch.setenv("SINSSIM_CACHE", "/own")
    assert jit.cache_root() == Path("/own")
    monkeypatch.delenv("SINSSIM_CACHE")
    assert jit.cache_root() == Path("/x/sinssim")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", "/home/me")
    assert jit.cache_root() == Path("/home/me/.cache/sinssim")
    wanted = hashlib.blake2b(b"abc", digest_size=16, key=b"k.nbi").digest()
    assert jit.content_digest("/some/where/k.nbi", b"abc") == wanted


def test_the_least_recently_used_kernels_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels of 300, 500 and 400 bytes, of which the second was used last and the third first; 900 may stay."""
    for name, size, used in (
        ("a.nbi", 100, 50),
        ("a.1.nbc", 200, 20),
        ("b.nbi", 500, 90),
        ("c.nbi", 150, 30),
        ("c.1.nbc", 250, 40),
    ):
        (tmp_path / name).write_bytes(b"x" * size)
        os.utime(tmp_path / name, (used, used))
    monkeypatch.setattr(jit, "kernel_folder", lambda: tmp_path)
    monkeypatch.setattr(jit, "_MOST", 900)
    jit.make_room.__wrapped__()
    assert {path.name for path in tmp_path.iterdir()} == {"a.nbi", "a.1.nbc", "b.nbi"}
    jit.make_room.__wrapped__()
    assert len(list(tmp_path.iterdir())) == 3


def test_a_link_is_no_file_of_this_program(tmp_path: Path) -> None:
    (tmp_path / "target").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with pytest.raises(OSError, match="link"):
        open_own(tmp_path / "link")
    with pytest.raises(FileNotFoundError):
        open_own(tmp_path / "none", make=False)
    with pytest.raises(OSError, match=r"directory|not a file"):
        open_own(tmp_path, make=False)


def test_drafts_of_the_system_are_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    with Draft() as one, Draft(tmp_path, "name") as two:
        assert one.path.stat().st_mode & 0o777 == 0o700
        assert two.path.stat().st_mode & 0o777 == 0o777 & ~_mask()
        assert (one.path.parent, one.path.name[:9], two.path.name[:6]) == (tmp_path, ".sinssim-", ".name-")
        two.move_to(tmp_path / "final")
        assert list((tmp_path / "final").iterdir()) == []
    assert {path.name for path in tmp_path.iterdir()} == {"final"}


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
