"""`sinssim new`: what it lays out, and what it refuses."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from sinssim.content import new_project, package_content
from sinssim.errors import InputError
from tests.cli.test_cli import call


def test_the_command_lays_out_every_file_of_the_example(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("new", "mine") == 0
    assert capsys.readouterr().out.endswith("Next: cd mine, then sinssim run scenario.toml\n")
    example = package_content("scenarios") / "new_project"
    files = [file.relative_to(example) for file in example.rglob("*") if file.is_file() and file.suffix != ".pyc"]
    assert len(files) == 6
    for file in files:
        assert (tmp_path / "mine" / file).read_bytes() == (example / file).read_bytes()
    monkeypatch.chdir("mine")
    assert call("check", "scenario.toml", "--grade", "tactical") == 0
    out = capsys.readouterr().out
    assert "imu         tactical" in out
    assert f"own         attitude algorithm cayley, {tmp_path}/mine/algorithms/cayley.py" in out
    assert call("new", ".") == 2
    assert "is not empty: it has README.md, algorithms, filters and 3 more" in capsys.readouterr().err


def test_what_is_in_the_way_stays(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        new_project(tmp_path / "file")
    with pytest.raises(InputError, match=r"cannot be made: Not a directory|cannot be made: File exists"):
        new_project(tmp_path / "file" / "below")
    assert (tmp_path / "file").read_text() == "mine"
    (tmp_path / "empty").mkdir()
    assert len(new_project(tmp_path / "empty")) == 6


@pytest.mark.parametrize("exists", [False, True])
def test_a_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exists: bool) -> None:
    copied: list[Path] = []

    def copy(source: Path, place: Path) -> None:
        if len(copied) == 3:
            raise OSError(errno.ENOSPC, "No space left on device", str(source))
        place.write_bytes(source.read_bytes())
        copied.append(place)

    monkeypatch.setattr("sinssim.content.shutil.copyfile", copy)
    folder = tmp_path / "deep" / "mine"
    if exists:
        folder.mkdir(parents=True)
    with pytest.raises(InputError, match=r"project folder .*mine cannot be made: No space left on device\. Name"):
        new_project(folder)
    assert len(copied) == 3
    assert list(tmp_path.rglob("*")) == ([tmp_path / "deep", folder] if exists else [])
