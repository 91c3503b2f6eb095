"""docs/tasks.md: every command and every line of code runs, in the order of the page; the slow test as printed."""

from __future__ import annotations

import importlib.util
import re
import shlex
from pathlib import Path

import pytest

from sinssim.errors import InputError
from sinssim.system.registries import forget
from tests.cli.test_cli import call

PAGE = (Path(__file__).parents[1] / "docs" / "tasks.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)(?: +([^\n]+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "further", [pytest.param((), id="as printed", marks=pytest.mark.slow), pytest.param(("--recording", "none"))]
)
def test_every_task(
    further: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    said = {}
    for language, mark, code in BLOCK.findall(PAGE):
        assert len(code.splitlines()) <= 10
        if language == "toml":
            Path(mark).write_text(code, encoding="utf-8")
        elif language == "python" and mark.startswith("needs ") and not importlib.util.find_spec(mark.split()[1]):
            with pytest.raises(InputError, match=rf"sinssim\[{mark.split()[1]}\]"):
                exec(code, {})
        elif language == "python":
            exec(code, {})
            said[mark] = capsys.readouterr().out
        else:
            for line in code.splitlines():
                program, *arguments = shlex.split(line)
                assert program == "sinssim"
                assert call(*arguments, *(further if arguments[0] == "run" else ())) == 0, line
                said[line] = capsys.readouterr().out
    forget()
    assert len(said) == 11
    assert "position_n_m" in said[""]
    sensors = said["sinssim sensors my_unit.toml"]
    assert "gyro_bias" in sensors
    exported = sorted(path.name for path in (tmp_path / "my_unit").iterdir())
    assert {"truth.csv", "imu.csv"} <= set(exported)
    (path,) = (tmp_path / "runs").glob("my_flight*.kml")
    assert "<kml" in path.read_text(encoding="utf-8")
    overlaid = said["sinssim compare-runs runs/my_unit runs/tactical"]
    assert "my_unit" in overlaid
    assert "tactical" in overlaid


def test_links_of_both_pages() -> None:
    docs = Path(__file__).parents[1] / "docs"
    for name in ("tasks.md", "own-content.md"):
        text = (docs / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([\w./-]+)\)", text):
            assert (docs / link).exists(), link
