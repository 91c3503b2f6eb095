"""The directory of a trade study: what it holds, and what it refuses by name."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.studies.trade_cells import CellNumbers
from sinssim.experiments.studies.trade_run import MANIFEST, TradeDirectory, _contents, _numbers
from sinssim.statistics.requirements import VerdictInUnit
from tests.experiments.studies.trade_examples import study

NUMBERS = CellNumbers(
    {"r95_end_m": 0.1 + 0.2, "nothing": float("nan"), "tiny": 5e-324},
    (VerdictInUnit("r95 <= 1 m", "undecided", float("nan"), 1.0, "m", 3.0, None),),
    np.array([0.0, 1.0]),
    np.array([0.0, 1.0 / 3.0]),
    np.array([np.nan, 2.0 / 3.0]),
    ("A remark.",),
)
DIGEST = "0123456789abcdef" * 4


def begin(folder: Path, place: Path, resume: bool = False, overwrite: bool = False, **keys: Any) -> TradeDirectory:
    """Begin or continue the directory of a study."""
    return TradeDirectory(place, study(folder, **keys), resume=resume, overwrite=overwrite)


def test_numbers_keep_every_bit(tmp_path: Path) -> None:
    there = begin(tmp_path, tmp_path / "out")
    there.write_part(DIGEST, _contents(NUMBERS))
    kept = there.read_part(DIGEST, pytest.fail)
    assert kept is not None
    found = _numbers(kept)
    assert repr(found.values) == repr(NUMBERS.values)
    assert repr(found.verdicts) == repr(NUMBERS.verdicts)
    assert found.notes == NUMBERS.notes
    for name in ("time", "cep", "r95"):
        np.testing.assert_array_equal(getattr(found, name), getattr(NUMBERS, name))
    assert there.read_part("f" * 64, pytest.fail) is None
    there.close()


@pytest.mark.parametrize("exists", [False, True])
def test_a_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exists: bool) -> None:
    def fail(path: Path, text: str) -> None:
        path.with_name(path.name + ".part").write_text("")
        raise OSError(errno.ENOSPC, "No space left on device")

    place = tmp_path / "deep" / "out"
    if exists:
        place.mkdir(parents=True)
    monkeypatch.setattr("sinssim.experiments.experiment_directory.write_text", fail)
    with pytest.raises(InputError, match=r"out cannot be made: No space left on device\. Give a folder"):
        begin(tmp_path, place)
    left = [path for path in tmp_path.rglob("*") if path.name != "standing.toml"]
    assert left == ([tmp_path / "deep", place] if exists else [])


def test_a_file_of_another_cell(tmp_path: Path) -> None:
    """A file that was renamed is not taken for another cell."""
    there = begin(tmp_path, tmp_path / "out")
    there.write_part(DIGEST, _contents(NUMBERS))
    there.part(DIGEST).with_suffix(".json").rename(there.part("f" * 64).with_suffix(".json"))
    said: list[str] = []
    assert there.read_part("f" * 64, said.append) is None
    there.close()
    assert "is damaged" in said[0]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"name": "other"}, "it is the study small, not other"),
        ({"cell": "ensemble"}, "it has budget cells, not ensemble cells"),
        ({"set": ("imu.rate_hz=20.0",)}, "it is of another scenario: imu.rate_hz was 2.0, now 20.0"),
    ],
)
def test_another_study_is_refused(tmp_path: Path, keys: dict[str, Any], said: str) -> None:
    place = tmp_path / "out"
    begin(tmp_path, place).close()
    with pytest.raises(InputError, match=said):
        begin(tmp_path, place, resume=True, **keys)
    begin(tmp_path, place, overwrite=True, **keys).close()


def test_another_version_is_refused(tmp_path: Path) -> None:
    place = tmp_path / "out"
    begin(tmp_path, place).close()
    found = json.loads((place / MANIFEST).read_text(encoding="utf-8"))
    found["versions"]["numpy"] = "0.9"
    (place / MANIFEST).write_text(json.dumps(found), encoding="utf-8")
    with pytest.raises(InputError, match=r"was computed by numpy 0\.9 instead of"):
        begin(tmp_path, place, resume=True)


def test_other_folders_are_refused(tmp_path: Path) -> None:
    place = tmp_path / "out"
    place.mkdir()
    (place / "mine.txt").write_text("mine", encoding="utf-8")
    for option in ({}, {"resume": True}, {"overwrite": True}):
        with pytest.raises(InputError, match="holds no trade study"):
            begin(tmp_path, place, **option)
    with pytest.raises(InputError, match="is a file"):
        begin(tmp_path, place / "mine.txt")
    assert (place / "mine.txt").read_text(encoding="utf-8") == "mine"


def test_overwriting_leaves_other_files(tmp_path: Path) -> None:
    place = tmp_path / "out"
    there = begin(tmp_path, place)
    there.write_part(DIGEST, _contents(NUMBERS))
    there.keep(lambda folder: (folder / "summary.md").write_text("old", encoding="utf-8"))
    there.close()
    (place / "mine.txt").write_text("mine", encoding="utf-8")
    again = begin(tmp_path, place, overwrite=True)
    assert sorted(p.name for p in place.iterdir() if not p.name.startswith(".")) == ["cells", "mine.txt", MANIFEST]
    assert list(again.folder.iterdir()) == []
    again.close()


def test_pictures_of_before_are_removed(tmp_path: Path) -> None:
    place = tmp_path / "out"
    there = begin(tmp_path, place)
    for names in (("r95_end.png", "heading_end.png"), ("heading_end.png",)):
        there.keep(lambda folder, names=names: [(folder / name).write_text("") for name in names])
    there.close()
    assert not (place / "r95_end.png").exists()
    assert (place / "heading_end.png").exists()


def test_one_process_at_a_time(tmp_path: Path) -> None:
    place = tmp_path / "out"
    there = begin(tmp_path, place)
    with pytest.raises(InputError, match="another process"):
        begin(tmp_path, place, resume=True)
    there.close()
    begin(tmp_path, place, resume=True).close()
