"""Commands whose work is replaced: what they hand on, and what they print."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sinssim.cli.app import main


class Called:
    """A function that remembers its arguments and returns a given value."""

    def __init__(self, value: Any = None) -> None:
        self.value, self.calls = value, list[tuple[tuple[Any, ...], dict[str, Any]]]()

    def __call__(self, *args: Any, **options: Any) -> Any:
        self.calls.append((args, options))
        return self.value

    @property
    def args(self) -> tuple[Any, ...]:
        return self.calls[-1][0]

    @property
    def options(self) -> dict[str, Any]:
        return self.calls[-1][1]


Put = Callable[..., Called]
Sinssim = Callable[..., str]


@pytest.fixture
def put(monkeypatch: pytest.MonkeyPatch) -> Put:
    """Return a function that puts a `Called` in place of a name, such as "experiments.run.run_execution.run"."""

    def place(name: str, value: Any = None) -> Called:
        module, called = f"sinssim.{name}".rsplit(".", 1)[0], Called(value)
        monkeypatch.setattr(importlib.import_module(module), name.rsplit(".", 1)[1], called)
        return called

    return place


@pytest.fixture
def sinssim(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Sinssim:
    """Return a function that runs the command line in an empty folder, and returns standard output."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("shutil.which", lambda name: f"/bin/{name}")

    def run(*arguments: object, code: int = 0) -> str:
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert end.value.code == code, err
        return out if code in (0, 2) and not err else out + err

    return run
