"""Content is found by path, in the current folder, and in the package, in this order."""

from __future__ import annotations

from pathlib import Path

import pytest

import sinssim
from sinssim.content import find_content, list_content, package_content
from sinssim.errors import InputError
from tests.scenario.examples import PARKED


def add(folder: Path, path: str, text: str = "") -> Path:
    file = folder / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def test_package_content_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_content("aircraft", "737") == package_content("aircraft") / "737" / "aircraft.toml"
    assert {"737", "c172x", "f16"} <= set(list_content("aircraft"))
    assert {"flight", "navigation", "sensors"} <= set(list_content("viz"))


def test_current_folder_hides_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mine = add(tmp_path, "aircraft/737/aircraft.toml")
    other = add(tmp_path, "scenarios/other.toml", PARKED)
    assert find_content("aircraft", "737").resolve() == mine
    assert list_content("aircraft")["737"].resolve() == mine
    assert find_content("scenarios", "other").resolve() == other
    assert find_content("scenarios", "scenarios/other.toml").resolve() == other


def test_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    plane = add(tmp_path, "hangar/glider/aircraft.toml")
    assert find_content("aircraft", str(tmp_path / "hangar" / "glider")) == plane
    assert find_content("aircraft", "hangar/glider").resolve() == plane
    assert find_content("aircraft", str(plane)) == plane
    view = add(tmp_path, "my_view.py")
    assert find_content("viz", str(view)) == view


def test_folders_without_content_and_hidden_files_are_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "aircraft" / "empty").mkdir(parents=True)
    add(tmp_path, "viz/_shared.py")
    assert "empty" not in list_content("aircraft")
    assert "_shared" not in list_content("viz")


def test_installed_content_comes_before_the_folder_beside_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "site" / "sinssim"
    monkeypatch.setattr(sinssim, "__file__", str(package / "__init__.py"))
    assert package_content("viz") == tmp_path / "site" / "viz"
    (package / "_content" / "viz").mkdir(parents=True)
    assert package_content("viz") == package / "_content" / "viz"


def test_unknown_names_come_with_the_list() -> None:
    with pytest.raises(InputError, match=r"unknown aircraft 'f17'\. Did you mean 'f16'\? Known: .*737.*c172x.*f16"):
        find_content("aircraft", "f17")
    with pytest.raises(InputError, match=r"unknown view 'navigatoin'\. Did you mean 'navigation'\?"):
        find_content("viz", "navigatoin")
    with pytest.raises(InputError, match=f"no aircraft file 'hangar/f17' in {Path.cwd()}[.] Known names: 737, "):
        find_content("aircraft", "hangar/f17")


def test_a_file_with_another_ending_is_refused_for_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    add(tmp_path, "plan.txt", PARKED)
    with pytest.raises(InputError, match=r"plan\.txt is not a scenario: the name of a scenario file ends in \.toml"):
        find_content("scenarios", "plan.txt")
    add(tmp_path, "parked")  # anything that happens to have a scenario's name does not hide it
    assert find_content("scenarios", "parked") == package_content("scenarios") / "parked.toml"
