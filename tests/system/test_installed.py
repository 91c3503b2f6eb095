"""Content of installed packages: found by their entry point, and a broken one costs its own content only."""

from __future__ import annotations

from pathlib import Path

import pytest

from sinssim.content import _of_packages, find_content, list_content, offered
from sinssim.scenario import load_scenario
from sinssim.system.registries import described


def install(site: Path, name: str, value: str) -> Path:
    """Write what pip would write for a package with content; returns the package's folder."""
    info = site / f"{name}-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(f"[sinssim.content]\n{name} = {value}\n")
    return site / value.replace(".", "/")


def test_content_of_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    package = install(tmp_path, "good", "good_content")
    for kind, suffix in (("algorithms", "py"), ("views", "py"), ("grades", "toml")):
        (package / kind).mkdir(parents=True)
        (package / kind / f"theirs.{suffix}").write_text('"""Theirs."""\nraise SystemExit\n')
    (package / "__init__.py").write_text("raise SystemExit\n")  # it is not imported
    install(tmp_path, "bad", "nowhere")
    monkeypatch.syspath_prepend(str(tmp_path))
    _of_packages.cache_clear()
    assert described("algorithms") == {"theirs": "Theirs. (good 1.2)"}
    assert list_content("viz")["theirs"] == package / "views" / "theirs.py"
    assert "theirs" not in list_content("viz", packages=False)
    assert find_content("grades", "theirs") == package / "grades" / "theirs.toml"
    assert offered("algorithms", packages=False) == {}
    assert "The installed package bad 1.2 provides content (bad = 'nowhere'" in caplog.text
    assert "there is no package nowhere. It is left out." in caplog.text


def test_known_names_need_no_list_of_packages() -> None:
    """Reading the list takes longer than everything else at start-up."""
    _of_packages.cache_clear()
    load_scenario("aided_airliner", ["imu.grade=adis16475-1"])
    assert _of_packages.cache_info().misses == 0


def test_the_first_of_two_files_of_a_name_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    files = []
    for place in ("early", "late"):
        (tmp_path / place / "algorithms").mkdir(parents=True)
        files.append(tmp_path / place / "algorithms" / "mine.py")
        files[-1].write_text(f'"""Mine, {place}."""\n')
    monkeypatch.setenv("SINSSIM_CONTENT", f"{tmp_path / 'early'}:{tmp_path / 'late'}")
    assert offered("algorithms", packages=False)["mine"].file == files[0]
    assert f"{files[0]} is used, {files[1]} is ignored." in caplog.text
