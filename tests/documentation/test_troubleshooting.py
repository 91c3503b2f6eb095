"""docs/troubleshooting.md: the program prints the messages that the page shows."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from sinssim.cli.app import main
from tests.documentation.fences import ROOT, Block, blocks

DOCS = ROOT / "docs"
FLIGHT = next(block.code for block in blocks(DOCS / "tutorials" / "first-flight.md") if block.language == "toml")
LOG = """\
name = "log"
[log.imu]
file = "imu.csv"
kind = "rates"
time = "t_s"
time_unit = "s"
axes = ["forward", "right", "down"]
gyro = { columns = ["gx", "gy", "gz"], unit = "rad/s" }
accel = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
[log.start]
latitude_deg = 50.0
longitude_deg = 14.0
height_m = 300.0
heading_deg = 0.0
"""


def _pairs() -> list[tuple[Block, str]]:
    """Return the commands of the page with the message below each."""
    found = blocks(DOCS / "troubleshooting.md")
    pairs = []
    for commands, message in zip(found[::2], found[1::2], strict=True):
        assert (commands.language, message.language) == ("sh", ""), f"line {commands.line}: a command, then its message"
        pairs.append((commands, message.code))
    return pairs


PAIRS = _pairs()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The files of the page in the current folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_flight.toml").write_text(FLIGHT, encoding="utf-8")
    (tmp_path / "log.toml").write_text(LOG, encoding="utf-8")
    time = np.arange(1, 201)[:, None] * 0.01
    rows = np.hstack([time, np.zeros((200, 3)), np.tile([0.0, 0.0, -9.81], (200, 1))])
    np.savetxt("imu.csv", rows, delimiter=",", header="t_s,gx,gy,gz,ax,ay,az", comments="", fmt="%.10g")
    (tmp_path / "runs").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("commands", "message"),
    [pytest.param(c, m, id=f"line {c.line}", marks=[pytest.mark.slow] if c.note("slow") else []) for c, m in PAIRS],
)
def test_the_program_prints_the_message(
    folder: Path, commands: Block, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for kind, file, text in commands.notes:
        if kind == "edit":
            old, new = text.split(" => ")
            whole = (folder / file).read_text(encoding="utf-8")
            assert whole.count(f"\n{old}") == 1, f"{old!r} begins {whole.count(old)} lines of {file}"
            (folder / file).write_text(whole.replace(f"\n{old}", f"\n{new}"), encoding="utf-8")
    *before, last = commands.code.splitlines()
    for line in before:
        assert _run(line) == 0
    capsys.readouterr()
    assert _run(last) in (1, 2)
    printed = capsys.readouterr().err.replace(f"{folder}/", "")
    assert " ".join(printed.split()) == " ".join(message.split())


def _run(line: str) -> int:
    words = shlex.split(line)
    assert words[0] == "sinssim"
    with pytest.raises(SystemExit) as stopped:
        main(words[1:])
    return int(stopped.value.code or 0)


def test_headings_are_different() -> None:
    lines = (DOCS / "troubleshooting.md").read_text(encoding="utf-8").splitlines()
    headings = [line for line in lines if line.startswith("#")]
    assert len(headings) == len(set(headings))
    assert len(PAIRS) >= 10  # they are found
