"""Output directories of every kind: no link in them leads sinssim to delete, write or open anything outside."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import sinssim
from sinssim.cli import app as cli
from sinssim.system.files import IN_USE, MARK
from tests.slow import slow

pytestmark = pytest.mark.usefixtures("hardly_counted")

SCENARIO = """\
name = "mine"
seed = 5
[parked]
latitude_deg = 50.0
duration_s = 20.0
[imu]
grade = "laser-standard"
rate_hz = 10.0
[ensemble]
runs = 3
"""
TABLE = """\
name = "table"
turntable = { latitude_deg = 50.0, sequence = "six-positions-and-rates", dwell_s = 30.0 }
imu = { rate_hz = 20.0 }
calibration = { method = "separate" }
"""
STUDY = """\
[[parts]]
title = "one"
algorithms = ["quaternion"]
rates_hz = [50.0, 100.0]
[[parts.motions]]
parked = { latitude_deg = 50.0, duration_s = 5.0 }
"""
TRADE = """\
scenario = "mine.toml"
runs = 2
cell = "CELL"
[[axes]]
key = "imu.gyro_bias_sigma_deg_h"
values = [0.001, 0.01]
"""

KINDS: dict[str, tuple[str, ...]] = {
    "run": ("run", "mine.toml", "--keep", "streams"),
    "budget": ("budget", "mine.toml"),
    "calibration": ("calibrate", "table.toml"),
    "study": ("compare", "study.toml"),
    "comparison": ("compare-runs", "made/run", "made/run2"),
    "ensemble": ("ensemble", "mine.toml", "--runs", "3"),
    "trade of budgets": ("compare", "budgets.toml"),
    "trade of ensembles": ("compare", "ensembles.toml"),
    "csv": ("export", "made/run", "--to", "csv"),
    "euroc": ("export", "made/run", "--to", "euroc"),
    "kml": ("export", "made/run", "--to", "kml"),
    "inspection": ("inspect", "made/csv/imu.csv"),
}
SINGLE = {"kml": "out.kml", "inspection": "out.toml"}
"""Kinds whose output is a file."""


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        cli.main(arguments)
    return stopped.value.code if isinstance(stopped.value.code, int) else 0


def write(kind: str, place: str, *options: str) -> int:
    """Write an output of a kind; return the exit code."""
    return call(*KINDS[kind], "--out" if kind == "inspection" else "-o", place, *options)


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory, hardly_counted: None) -> Path:
    """A folder with an output of each kind, by its name."""
    folder = tmp_path_factory.mktemp("outputs")
    for name, text in (("mine", SCENARIO), ("table", TABLE), ("study", STUDY),
                       ("budgets", TRADE.replace("CELL", "budget").replace("runs = 2\n", "")),
                       ("ensembles", TRADE.replace("CELL", "ensemble"))):  # fmt: skip
        (folder / f"{name}.toml").write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for kind in KINDS:
            assert write(kind, f"made/{SINGLE.get(kind, kind)}") == 0, kind
            if kind == "run":
                shutil.copytree("made/run", "made/run2")
    return folder


class _Opened:
    """Names of the files that Python code opens for writing, removes or renames; links are followed as it does."""

    def __init__(self) -> None:
        self.names: list[str] | None = None
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.names is None:
            return
        if event == "open" and isinstance(arguments[0], str | bytes):
            name, _mode, flags = arguments
            if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC) and not flags & os.O_NOFOLLOW:
                self.names.append(os.path.realpath(os.fsdecode(name)))
        elif event in ("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.truncate"):
            for name in arguments[: 2 if event == "os.rename" else 1]:
                if isinstance(name, str | bytes):
                    head, tail = os.path.split(os.fsdecode(name))
                    self.names.append(os.path.join(os.path.realpath(head), tail))


OPENED = _Opened()


@pytest.fixture
def opened() -> Iterator[list[str]]:
    OPENED.names = []
    yield OPENED.names
    OPENED.names = None


def seen(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Return what lies in a folder, with the time of its last change."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_mtime_ns, path.read_bytes() if path.is_file() else b"")
        for path in (folder, *folder.rglob("*"))
    }


Plant = Callable[[Path, Path], None]


def moved_out(name: str) -> Plant:
    """Return what moves a file or folder out of an output, and leaves a link to it."""

    def plant(output: Path, outside: Path) -> None:
        here, there = output / name if name else output, outside / "moved"
        shutil.move(here, there)
        here.symlink_to(there)

    return plant


def link_at(name: str, to: str) -> Plant:
    """Return what puts a link where nothing is, or instead of what is there."""

    def plant(output: Path, outside: Path) -> None:
        here = output / name
        if here.is_dir() and not here.is_symlink():
            shutil.rmtree(here)
        here.unlink(missing_ok=True)
        here.parent.mkdir(parents=True, exist_ok=True)
        here.symlink_to(outside / to)

    return plant


def named(*names: str) -> Plant:
    """Return what adds names to the mark; the folder `link` in the output leads outside."""

    def plant(output: Path, outside: Path) -> None:
        (output / "link").symlink_to(outside)
        mark = output / MARK
        if mark.exists():
            contents = json.loads(mark.read_text())
            contents["files"] += [name.format(outside=outside) for name in names]
            mark.write_text(json.dumps(contents))

    return plant


def together(*all_of_them: Plant) -> Plant:
    """Return what does several things, of which none hinders sinssim: they are tried at once."""

    def plant(output: Path, outside: Path) -> None:
        for one in all_of_them:
            one(output, outside)

    return plant


def beside_a_file(output: Path, outside: Path) -> None:
    """Put links at names that temporary files could have."""
    for name in (f"{output.name}.part", f".{output.name}.part", f".{output.name}.partial"):
        (output.parent / name).symlink_to(outside / "precious.txt")


def plants(output: Path) -> dict[str, Plant]:
    """Return everything that is planted in an output."""
    if output.is_file():
        return {"the file": moved_out(""), "beside": beside_a_file}
    found: dict[str, Plant] = {"the directory": moved_out("")}
    beside: list[Plant] = []
    alike: set[tuple[Path, str]] = set()
    for path in sorted(output.rglob("*")):
        name = path.relative_to(output).as_posix()
        if (path.parent, path.suffix) not in alike or not path.suffix:  # one stream stands for all
            found[f"moved {name}"] = moved_out(name)
        alike.add((path.parent, path.suffix))
        if path.is_dir():
            found[f"empty {name}"] = link_at(name, "empty")
            beside.append(link_at(f"{name}/mine", "precious.txt"))
        else:
            beside += [link_at(f"{name}.part", "new"), link_at(f"{path.parent.name}.{path.name}.part", "precious.txt")]
    for number, name in enumerate(("streams", "runs", "cells", "scores", "mav0", ".sinssim-draft")):
        if not (output / name).exists():
            beside.append(link_at(name, ("new", "empty", "precious.txt")[number % 3]))
    found["beside the files"] = together(*beside)
    found["lock"] = link_at(IN_USE, "precious.txt")
    found["dangling lock"] = link_at(IN_USE, "new")
    found["named through a link"] = named("link/precious.txt")
    found["named above"] = named("../outside/precious.txt")
    found["named absolutely"] = named("{outside}/precious.txt")
    found["named oddly"] = named("link/../../outside/precious.txt", "\0", "")
    return found


ALIKE = ("trade of ensembles", "budget", "euroc")
"""Kinds in the same kind of directory as a trade of budgets, a calibration and CSV files."""


@pytest.mark.parametrize("kind", [*slow(*ALIKE), *(kind for kind in KINDS if kind not in ALIKE)])
def test_no_link_leads_outside(
    kind: str, outputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, opened: list[str]
) -> None:
    """A link to a directory is followed, but only what sinssim wrote there is replaced; no other link is followed."""
    monkeypatch.chdir(outputs)
    output = outputs / "made" / SINGLE.get(kind, kind)
    for number, (what, plant) in enumerate(plants(output).items()):
        outside, place = tmp_path / str(number) / "outside", tmp_path / str(number) / output.name
        (outside / "empty").mkdir(parents=True)
        (outside / "precious.txt").write_text("precious")
        (shutil.copy2 if output.is_file() else shutil.copytree)(output, place)
        plant(place, outside)
        before, length = seen(outside), len(opened)
        code = write(kind, str(place), "--overwrite")
        if what == "the directory":
            shutil.rmtree(outside / "moved")
            assert [path.name for path in sorted(outside.iterdir())] == ["empty", "precious.txt"]
            continue
        assert seen(outside) == before, what
        assert [name for name in opened[length:] if Path(name).is_relative_to(outside)] == [], what
        assert code == (2 if what.startswith(("moved", "empty", "named")) else code), what


def test_an_ensemble_is_not_continued_through_a_link(
    outputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(outputs)
    for kind, folder in (("ensemble", "runs"), ("trade of budgets", "cells")):
        place, outside = tmp_path / kind, tmp_path / f"{kind} outside"
        shutil.copytree(outputs / "made" / kind, place)
        outside.mkdir()
        moved_out(folder)(place, outside)
        before = seen(outside)
        assert write(kind, str(place), "--resume") == 2
        assert f"{folder} is a link" in " ".join(capsys.readouterr().err.split())
        assert seen(outside) == before


def test_an_incomplete_run_does_not_follow_a_link_beside_its_place(tmp_path: Path) -> None:
    from sinssim.recording.result import RunDirectory

    for name in ("run", "elsewhere"):
        (tmp_path / name).mkdir()
        (tmp_path / name / MARK).write_text('{"files": []}')
    (tmp_path / "run-failed").symlink_to(tmp_path / "elsewhere")
    folder = RunDirectory(tmp_path / "run", overwrite=True)
    (folder.path / "summary.json").write_text("{}")
    assert folder.keep(beside="failed").name == "run-failed-2"
    assert [path.name for path in (tmp_path / "elsewhere").iterdir()] == [MARK]


def test_a_score_does_not_follow_a_link(
    outputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(outputs)
    outside, place = tmp_path / "outside", tmp_path / "run"
    outside.mkdir()
    shutil.copytree("made/run", place)
    (place / "scores").symlink_to(outside)
    assert call("export", "made/run", "--to", "tum", "-o", str(tmp_path / "other.tum"), "--overwrite") == 0
    assert call("score", str(place), str(tmp_path / "other.tum")) != 0
    assert "scores is a link" in " ".join(capsys.readouterr().err.split())
    assert list(outside.iterdir()) == []


def test_a_directory_that_was_killed_while_it_was_replaced_can_be_replaced(tmp_path: Path) -> None:
    """Whatever moment the replacement ends at, every file in the directory is in its mark."""
    from sinssim.recording.result import RunDirectory

    def write_run(names: tuple[str, ...]) -> None:
        folder = RunDirectory(tmp_path / "run", overwrite=True)
        try:
            for name in names:
                (folder.path / name).write_text(name)
            folder.keep()
        finally:
            if folder.path.exists():
                folder.discard()

    write_run(("a", "b", "c"))
    moves, rename = 0, os.replace
    for last in range(1, 12):

        def until(here: Any, there: Any, last: int = last) -> None:
            nonlocal moves
            moves += 1
            if moves > last:
                raise _KilledError
            rename(here, there)

        moves = 0
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "replace", until)
            with contextlib.suppress(_KilledError):
                write_run(("b", "c", "d"))
        present = {path.name for path in (tmp_path / "run").iterdir()} - {MARK}
        assert present <= set(json.loads((tmp_path / "run" / MARK).read_text())["files"])
    write_run(("e",))
    assert {path.name for path in (tmp_path / "run").iterdir()} == {MARK, "e"}


class _KilledError(BaseException):
    """The process is killed: nothing is moved any more, neither forwards nor back."""


def test_results_replace_no_file_of_ones_own(
    outputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(outputs)
    place = tmp_path / "e"
    scenario = sinssim.load_scenario("mine.toml")
    sinssim.ensemble(scenario, 3, place)
    (place / "report.html").unlink()
    marked = json.loads((place / MARK).read_text())
    marked["files"].remove("report.html")
    (place / MARK).write_text(json.dumps(marked))
    (place / "report.html").write_text("mine")
    assert write("ensemble", str(place), "--resume") == 2
    assert "report.html was not written by sinssim" in " ".join(capsys.readouterr().err.split())
    assert (place / "report.html").read_text() == "mine"
