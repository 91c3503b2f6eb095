"""Commands that the workbench starts: their command lines, progress, cancelling, and that nothing is left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sinssim.cli import workbench_commands
from sinssim.cli.workbench_commands import Child, Children, arguments_of
from sinssim.errors import InputError
from tests.cli.workbench.served import served
from tests.scenario.examples import PARKED


def until(done: Callable[[], Any]) -> None:
    deadline = time.monotonic() + 20.0
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("wanted", "line"),
    [
        ({"command": "run", "paths": ["mine.toml"]}, "run mine.toml"),
        ({"command": "run", "paths": ["-o.toml"]}, "run ./-o.toml"),
        ({"command": "run", "paths": ["a.toml"], "settings": ["seed=3", "--x"], "runs": 7},
         "run a.toml --set=seed=3 --set=--x"),
        ({"command": "ensemble", "paths": ["a.toml"], "runs": 7, "out": "x-1", "overwrite": True},
         "ensemble a.toml --runs=7 --out=runs/x-1 --overwrite"),
        ({"command": "budget", "paths": ["parked"], "require": ["r95(60 s) <= 1 m"], "allow_programs": True},
         "budget parked --require=r95(60 s) <= 1 m --allow-programs"),
        ({"command": "compare", "paths": ["coning"], "settings": ["seed=3"], "require": ["cep(end) <= 1 m"]},
         "compare coning --set=seed=3 --require=cep(end) <= 1 m"),
        ({"command": "align", "paths": ["sub/a b.toml"], "require": ["x"], "allow_programs": True, "overwrite": True},
         "align sub/a b.toml --out=runs/a b-alignment --overwrite"),
        ({"command": "align", "paths": ["parked"], "out": "x"}, "align parked --out=runs/x"),
        ({"command": "calibrate", "paths": ["a.toml"], "runs": 7, "require": ["x"]}, "calibrate a.toml"),
        ({"command": "view", "paths": ["runs/a"], "overwrite": True}, "view runs/a --web"),
        ({"command": "compare-runs", "paths": ["runs/a", "runs/b"]}, "compare-runs runs/a runs/b"),
        ({"command": "check", "paths": ["a.toml"], "settings": ["x=1"]}, "check a.toml"),
    ],
)  # fmt: skip
def test_the_command_line(wanted: dict[str, Any], line: str) -> None:
    assert " ".join(arguments_of(wanted)) == line


@pytest.mark.parametrize(
    "wanted",
    [{}, {"command": "list", "paths": ["a"]}, {"command": ["run"], "paths": ["a"]}, {"command": "run"},
     {"command": "run", "paths": "a.toml"}, {"command": "run", "paths": ["a\0b"]},
     {"command": "compare-runs", "paths": ["a"]},
     {"command": "run", "paths": ["a"], "settings": [1]}, {"command": "ensemble", "paths": ["a"], "runs": 0},
     {"command": "ensemble", "paths": ["a"], "runs": True}, {"command": "ensemble", "paths": ["a"], "runs": "7"},
     *({"command": "run", "paths": ["a"], "out": out} for out in ("../x", "/x", "a/b", "-x", ".x", 3, "x\n"))],
)  # fmt: skip
def test_what_is_no_command(wanted: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        arguments_of(wanted)


STAND_IN = """\
#!/bin/sh
echo 'progress 0.25 Flying' >&2
sleep 60 &
echo $! > grandchild
echo "Open http://127.0.0.1:1234/a"
trap "echo Interrupted.; exit 130" TERM
wait
"""


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program in place of sinssim, which reports progress and waits for the process of its own; its folder."""
    program = tmp_path / "program"
    program.write_text(STAND_IN)
    program.chmod(0o755)
    monkeypatch.setattr(workbench_commands.sys, "executable", str(program))
    return tmp_path


def exists(process: int) -> bool:
    """Return whether a process runs."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2][0] != "Z"
    except FileNotFoundError:
        return False


def started(folder: Path, children: Children) -> tuple[Child, int]:
    """Return the stand-in once it has printed all, and its own process."""
    child = children.start(["run", "a b.toml"])
    until(lambda: child.page and (folder / "grandchild").read_text().strip())
    return child, int((folder / "grandchild").read_text())


def test_progress_output_and_page(stand_in: Path) -> None:
    with Children(stand_in) as children:
        child, _ = started(stand_in, children)
        shown = child.to_json()
        assert (shown["stage"], shown["fraction"], shown["code"]) == ("Flying", 0.25, None)
        assert shown["command"] == "sinssim run 'a b.toml'"
        assert shown["page"] == "http://127.0.0.1:1234/a"
        assert shown["output"] == "Open http://127.0.0.1:1234/a"
        children.cancel(child.number)
        until(lambda: child.ended)  # though the process of its own has the end of the pipe
        shown = child.to_json()
        assert (shown["code"], shown["cancelled"], shown["page"]) == (130, True, "")
        assert shown["output"].endswith("Interrupted.")
        for number in (child.number, 99):
            with pytest.raises(InputError, match="is not running"):
                children.cancel(number)


def test_the_end_leaves_no_process(stand_in: Path) -> None:
    with Children(stand_in) as children:
        child, grandchild = started(stand_in, children)
        assert exists(grandchild)
    assert child.process.poll() is not None
    until(lambda: not exists(grandchild))


def test_the_end_kills_a_command_that_goes_on(stand_in: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (stand_in / "program").write_text(STAND_IN.replace('"echo Interrupted.; exit 130"', "''"))
    monkeypatch.setattr(workbench_commands, "_PATIENCE", 0.1)
    with Children(stand_in) as children:
        child, grandchild = started(stand_in, children)
    assert child.process.poll() == -signal.SIGKILL
    until(lambda: not exists(grandchild))


def test_the_second_cancelling_kills(stand_in: Path) -> None:
    (stand_in / "program").write_text((stand_in / "program").read_text().replace('"echo Interrupted.; exit 130"', "''"))
    with Children(stand_in) as children:
        child, grandchild = started(stand_in, children)
        children.cancel(child.number)
        assert child.process.poll() is None
        children.cancel(child.number)
        until(lambda: child.ended)
        assert child.code == -signal.SIGKILL
        until(lambda: not exists(grandchild))


def test_not_too_many_at_a_time(stand_in: Path) -> None:
    with Children(stand_in) as children:
        for _ in range(4):
            children.start(["run"])
        with pytest.raises(InputError, match="4 commands are running"):
            children.start(["run"])


def test_a_check_by_the_command(tmp_path: Path) -> None:
    """Through the server, with the program itself: mistakes of the file, at their lines."""
    (tmp_path / "mine.toml").write_text(PARKED.replace("20.0\n\n", "-20.0\n\n"))
    with served(tmp_path) as bench:
        number = bench.ask("start", {"command": "check", "paths": ["mine.toml"]}).json["number"]
        until(lambda: bench.ask("commands").json["commands"][0]["code"] is not None)
        assert bench.ask("commands").json["commands"][0]["code"] == 2
        found = bench.ask("check", {"path": "mine.toml", "text": PARKED, "number": number}).json
    assert found["mistakes"] == [{"line": 5, "text": "parked.duration_s = -20.0 must be greater than 0."}]


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    project, temporary = tmp_path / "project", tmp_path / "temporary"
    for folder in (project, temporary):
        folder.mkdir()
    (project / "mine.toml").write_text(PARKED)
    command = [sys.executable, "-m", "sinssim", "workbench", str(project)]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        address = process.stdout.readline().removeprefix("Open ").strip()
        assert address.startswith("http://127.0.0.1:")
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        assert b"sinssim workbench" in opener.open(address).read()
        process.send_signal(signal.SIGINT)
        assert (process.wait(20.0), process.stdout.read()) == (0, "Stop with Ctrl-C.\n")
    with pytest.raises(OSError, match="refused"):
        opener.open(address)
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["mine.toml", "project", "temporary"]


@pytest.mark.parametrize("given", [["nowhere"], ["--port", "0"], ["--port", "70000"]])
def test_a_folder_and_a_port_that_cannot_be(given: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.cli.app import main

    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["workbench", *given])
    assert stopped.value.code == 2


def test_without_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    from sinssim.cli.app import main

    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["workbench"])
    assert stopped.value.code == 2
    assert "pip install 'sinssim[workbench]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
