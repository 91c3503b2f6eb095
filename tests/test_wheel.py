"""The wheel: it carries the content, and works from any folder without the checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from sinssim.content import package_content
from tests.scenario.examples import PARKED

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(CHECKOUT)]
    subprocess.run(command, check=True, capture_output=True)
    (file,) = folder.glob("sinssim-*.whl")
    return file


@pytest.fixture(scope="module")
def commands(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The commands of a new environment with the wheel, and with what it depends on, but not with the checkout."""
    folder = tmp_path_factory.mktemp("environment") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    scheme = {"base": str(folder), "platbase": str(folder)}
    site = Path(sysconfig.get_path("purelib", "venv", vars=scheme))
    install = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install", "--no-deps"]
    subprocess.run([*install, "--no-index", "--disable-pip-version-check", str(wheel)], check=True, capture_output=True)
    # Links, not a .pth file of the whole folder: that would bring the checkout's own .pth file with it.
    for library in {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}:
        for entry in Path(library).iterdir():
            if "sinssim" not in entry.name.lower() and not (site / entry.name).exists():
                (site / entry.name).symlink_to(entry)
    return folder / "bin"


def in_environment(commands: Path, *arguments: str, cwd: Path) -> str:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(
        [str(commands / arguments[0]), *arguments[1:]],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_carries_the_content(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for kind in ("aircraft", "scenarios", "viz"):
        folder = package_content(kind)
        files = [f for f in folder.rglob("*") if f.is_file() and "__pycache__" not in f.parts]
        assert files
        for file in files:
            assert f"sinssim/_content/{kind}/{file.relative_to(folder).as_posix()}" in names
    assert "sinssim/py.typed" in names
    assert not any(name.startswith(("tests", "docs")) or "__pycache__" in name for name in names)


def test_the_files_of_the_wheel_work_from_any_folder(wheel: Path, tmp_path: Path) -> None:
    """Unpacked on the path: the package finds its content."""
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    code = "import sys, sinssim; print(sinssim.__file__); from sinssim.cli.app import main; main(sys.argv[1:])"
    shown = subprocess.run(
        [sys.executable, "-c", code, "check", "first_flight"], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
    ).stdout  # fmt: skip
    assert shown.startswith(str(tmp_path / "site"))
    assert "737" in shown


@pytest.mark.slow
def test_wheel_works_from_any_folder(commands: Path, tmp_path: Path) -> None:
    where = in_environment(commands, "python", "-c", "import sinssim; print(sinssim.__file__)", cwd=tmp_path)
    assert where.startswith(str(commands.parent))
    aircraft = json.loads(in_environment(commands, "sinssim", "list", "aircraft", "--json", cwd=tmp_path))
    assert {"737", "c172x", "f16"} <= set(aircraft)
    assert "737" in in_environment(commands, "sinssim", "check", "first_flight", cwd=tmp_path)
    (tmp_path / "plan.toml").write_text(PARKED)
    summary = json.loads(in_environment(commands, "sinssim", "run", "plan.toml", "--json", cwd=tmp_path))
    assert summary["algorithms"]["quaternion"]["max_horizontal_error_m"] > 0.0
    assert (tmp_path / "runs" / "standing" / "recording.rrd").is_file()
