"""Hidden folders of temporary output: removed when their process has ended, and nothing else is."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from sinssim.system.files import IN_DRAFT, IN_USE, Draft, draft
from tests.fork import Fork

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no such locks")


def ended() -> int:
    """Return the number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def folder(place: Path, mark: str | None) -> Path:
    place.mkdir()
    (place / "mine").write_text("mine")
    if mark is not None:
        (place / IN_DRAFT).write_text(mark)
    return place


def test_a_folder_that_nobody_got_is_removed_by_its_own_process(tmp_path: Path) -> None:
    """An interruption just after the folder was made: whoever asked for it does not have it yet."""
    kept = Draft(tmp_path, "kept")
    child = os.fork()
    if not child:
        del kept
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    assert kept.path.is_dir()
    path = kept.path
    del kept
    assert not path.exists()


def test_only_folders_of_ended_processes_are_removed(tmp_path: Path) -> None:
    dead, host = ended(), socket.gethostname()
    head = "sinssim draft of process"
    left = folder(tmp_path / ".export-0123", f"{head} {dead} on {host}\n")
    stay = [
        folder(tmp_path / ".alive-1", f"{head} {os.getpid()} on {host}\n"),
        folder(tmp_path / ".elsewhere-1", f"{head} {dead} on another-{host}\n"),
        folder(tmp_path / ".mine-1", None),
        folder(tmp_path / ".mine-2", ""),
        folder(tmp_path / ".mine-3", f"{dead}\n"),
        folder(tmp_path / ".huge-1", f"{head} {'9' * 400} on {host}\n"),
        folder(tmp_path / "shown-1", f"{head} {dead} on {host}\n"),
    ]
    (folder(tmp_path / ".ensemble-1", None) / IN_USE).write_text("")  # a place of the user's choice that was killed
    (tmp_path / "outside").mkdir()
    folder(tmp_path / "outside" / "linked", f"{head} {dead} on {host}\n")
    (tmp_path / ".link-1").symlink_to(tmp_path / "outside" / "linked")
    mark = tmp_path / "outside" / "mark"
    mark.write_text(f"{head} {dead} on {host}\n")
    (folder(tmp_path / ".link-2", None) / IN_DRAFT).symlink_to(mark)
    with Draft(tmp_path, "new") as one:
        assert not left.exists()
        assert one.path.is_dir()
        names = {path.name for path in tmp_path.iterdir()}
        with Draft(tmp_path, "second"):
            assert one.path.is_dir()  # in use
    assert names == {*(path.name for path in stay), ".ensemble-1", "outside", ".link-1", ".link-2", one.path.name}
    assert (tmp_path / "outside" / "linked" / "mine").exists()
    assert not one.path.exists()


def test_a_file_is_whole_or_not_there(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("precious")
    (tmp_path / "out").symlink_to(precious)
    with pytest.raises(FileNotFoundError), draft(tmp_path / "out") as beside:
        beside.with_name("half").write_text("half")
    assert (tmp_path / "out").read_text() == "precious"
    with draft(tmp_path / "out") as beside:
        beside.write_text("whole")
    assert ((tmp_path / "out").read_text(), precious.read_text()) == ("whole", "precious")
    assert {path.name for path in tmp_path.iterdir()} == {"out", "precious"}


def test_what_a_killed_export_left_is_removed_by_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sinssim
    from sinssim.logs.formats import csv_parquet_matlab
    from sinssim.logs.formats.export_streams import Content, export

    settings = ("parked.duration_s=5", "imu.rate_hz=10", "recording.keep=streams")
    sinssim.run(sinssim.load_scenario("parked", settings), tmp_path / "run")
    whole = csv_parquet_matlab.CSV_EXPORT

    def write(content: Content, place: Path) -> None:
        whole.write(content, place)
        os.kill(os.getpid(), signal.SIGKILL)

    with monkeypatch.context() as patch:
        patch.setattr(csv_parquet_matlab, "CSV_EXPORT", replace(whole, write=write))
        assert Fork(lambda: export(tmp_path / "run", "csv", tmp_path / "out")).wait() == -signal.SIGKILL
    (left,) = tmp_path.glob(".out-*")
    assert (left / "imu.csv").exists()
    export(tmp_path / "run", "kml", tmp_path / "other.kml")
    assert {path.name for path in tmp_path.iterdir()} == {"run", "other.kml"}
