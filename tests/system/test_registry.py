"""Names of own content: registered without running, never confused with those of sinssim or of another file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import sinssim
from sinssim.content import VARIABLE
from sinssim.errors import InputError
from sinssim.strapdown.attitude import ALGORITHMS, REGISTRY
from sinssim.strapdown.engine_assembly import algorithm_file, frame_file
from sinssim.strapdown.frames import FRAME_REGISTRY
from sinssim.system.registries import described, ensure, forget

STOPS = '"""Mine, stops."""\nraise SystemExit\n'


def write(folder: Path, kind: str, name: str, text: str = STOPS) -> Path:
    file = folder / kind / f"{name}.py"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def test_names_are_registered_without_running_a_file(tmp_path: Path) -> None:
    write(tmp_path, "algorithms", "one", f"{STOPS}SAMPLES = 2\ndef turn_k(): ...\n")
    write(tmp_path, "frames", "two", f"{STOPS}HAS_RADII = False\nTAKES_ROUTE = True\nHAS_THREE_RATES = True\n")
    assert sinssim.use(tmp_path) == ["one", "two"]
    assert ALGORITHMS["one"] == "Mine, stops."
    assert REGISTRY["one"].samples == 2
    frame = FRAME_REGISTRY["two"]
    assert (frame.has_radii, frame.takes_route, frame.has_azimuth, frame.has_three_rates) == (False, True, False, False)
    with pytest.raises(InputError, match=r"attitude algorithm one cannot be used: .*one.py, line 2: SystemExit"):
        algorithm_file("one")
    with pytest.raises(InputError, match="navigation frame two cannot be used"):
        frame_file("two")
    forget()
    assert "one" not in ALGORITHMS
    assert "two" not in FRAME_REGISTRY


@pytest.mark.parametrize(("kind", "name"), [("algorithms", "euler"), ("frames", "level"), ("aiding", "gnss")])
def test_names_of_sinssim_are_refused(tmp_path: Path, kind: str, name: str) -> None:
    import sinssim.scenario.schema

    write(tmp_path, kind, name)
    with pytest.raises(InputError, match=f"sinssim itself has the .* {name}, and results of the two"):
        sinssim.use(tmp_path)


def test_one_name_has_one_file(tmp_path: Path) -> None:
    write(tmp_path / "a", "algorithms", "one")
    write(tmp_path / "b", "algorithms", "one")
    sinssim.use(tmp_path / "a")
    sinssim.use(tmp_path / "b")  # a copy
    write(tmp_path / "b", "algorithms", "one", f"{STOPS}# another\n")
    with pytest.raises(InputError, match="the name one stands for two files that differ"):
        sinssim.use(tmp_path / "b")


def test_a_changed_file_is_taken_anew(tmp_path: Path) -> None:
    file = write(tmp_path, "frames", "two", "def solve(problem, frame): ...\n")
    sinssim.use(file)
    with pytest.raises(InputError, match=r"there is no function check\(problem, frame\)"):
        frame_file("two")
    stamp = file.stat()
    file.write_text("def check(problem, frame): ...\n", encoding="utf-8")  # as long, and at the same time
    os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    sinssim.use(file)
    with pytest.raises(InputError, match=r"there is no function solve\(problem, frame\)"):
        frame_file("two")


def test_the_environment_offers_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, "algorithms", "one")
    write(tmp_path, "algorithms", "euler")
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert set(described("algorithms")) == {"one"}
    assert described("algorithms")["one"].startswith("Mine, stops. (/")
    ensure("algorithms", "two")
    assert "one" not in ALGORITHMS
    ensure("algorithms", "o*")
    assert "one" in ALGORITHMS
    assert not REGISTRY["euler"].path


def test_places_that_the_environment_cannot_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(VARIABLE, os.pathsep.join(["mine", str(tmp_path / "nothing"), str(tmp_path)]))
    assert described("frames") == {}
    said = caplog.text
    assert "names mine, which is not an absolute path" in said
    assert "nothing, which does not exist" in said
    assert "has none of the folders" in said
