"""Commands and code of the pages, executed as they are printed, page by page in a folder of its own.

A command with many runs is executed with fewer (`FEWER`). What cannot be executed is in `NOT_HERE` with its reason.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from tests.documentation.fences import OWN_TESTS, PAGES, ROOT, Block, blocks, name

FEWER = {
    "--runs 1000": "--runs 12",
    "--runs 5000": "--runs 16",
    "--runs 50": "--runs 4",
    "runs=500": "runs=4",
    "ensemble rotating_unit": "ensemble rotating_unit --runs 2",
    "ensemble first_flight --sheet": "ensemble first_flight --sheet --runs 4 -o runs/sheet",
    "--until-decided": "--until-decided --runs 40 -o runs/decided",
}
"""Parts of commands that take long, and what is executed in their place."""

NOT_HERE = {
    r"^make ": "set-up and the suite itself",
    r"^pip ": "changes the environment of the tests",
    r"--install-completion": "changes the start-up files of the shell",
    r"^sinssim view ": "opens a window; tests/recording renders the views",
    r"^sinssim workbench ": "serves a page until Ctrl-C; tests/cli/workbench",
    r"FORMAT": "the form of a command, not a command",
    r"KF-GINS kf-gins\.yaml|KF_GINS_Navresult": "a program that is not a part of this project",
    r"^octave-cli |^python navigate_with_gnss|psins_filter|navego_filter|gnss_ins_sim_inertial": (
        "programs that are not a part of this project; tests/logs/test_other_programs.py, where they are"
    ),
    r"^python navigate_with_pyins\.py|pyins_inertial": "tests/logs/test_pyins.py, where pyins is installed",
    r"mine\.csv|solution\.nav": "the output of the reader's own program",
    r"^sinssim inspect (?:imu\.csv gnss\.pos|drive\.toml)": "the reader's files; see tests/analyses/inspection",
    r"--listen": "the reader's navigator answers; tests/experiments/run/test_paced_stream.py",
    r"weather\.csv|log\.(?:csv|npz) --columns": "the reader's logs; see tests/analyses/noise",
    r"^sinssim allan (?:drive\.toml|runs/gyrocompassing)": "the reader's files",
    r"mine\.toml|my_log\.toml": "the reader's files",
    r"^python aircraft/envelope\.py": "minutes of trims; tests/scenario/planned repeats some of them",
    r"recorded_and_simulated": "tests/experiments/studies/test_recorded_and_simulated.py",
    r"^# ": "a remark",
}
"""Commands that are not executed here, each with the reason."""

_PYTHON_ELSEWHERE = {
    "docs/formats.md": "flight.ulg, a log of the reader",
    "docs/comparing.md": "mine.toml, of the reader",
}


def commands(page: Path) -> list[str]:
    """Return the lines of commands of a page that are executed, remarks cut off."""
    lines = [
        re.sub(r"\s+#(?![^'\"]*['\"]).*$", "", part).strip()
        for block in blocks(page)
        if block.language == "sh"
        for line in block.code.replace("\\\n", " ").splitlines()
        for part in line.split(" && ")
    ]
    return [line for line in lines if line and not any(re.search(form, line) for form in NOT_HERE)]


WITH_COMMANDS = [page for page in PAGES if name(page) != "docs/troubleshooting.md" and commands(page)]
WITH_CODE = [
    page
    for page in PAGES
    if name(page) not in OWN_TESTS
    and name(page) not in _PYTHON_ELSEWHERE
    and page.parent.name != "extending"
    and any(block.language == "python" for block in blocks(page))
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files of the tutorials, the content of the checkout and a log at rest."""
    for content in ("scenarios", "aircraft", "viz", "tests"):
        (tmp_path / content).symlink_to(ROOT / content)
    tutorials = ROOT / "docs" / "tutorials"
    flight, unit, tail = (
        next(block.code for block in blocks(tutorials / f"{page}.md") if block.language == "toml")
        for page in ("first-flight", "own-sensor", "filter")
    )
    (tmp_path / "my_flight.toml").write_text(flight, encoding="utf-8")
    (tmp_path / "my_unit.toml").write_text(unit, encoding="utf-8")
    whole = flight.replace('name = "my_flight"', 'name = "my_filter"') + "\n" + tail
    (tmp_path / "my_filter.toml").write_text(whole, encoding="utf-8")
    trade = next(block.code for block in blocks(ROOT / "docs" / "trades.md") if block.language == "toml")
    (tmp_path / "my_trade.toml").write_text(trade, encoding="utf-8")
    for scenario in ("minute", "car"):
        shutil.copy(ROOT / "docs" / "programs" / f"{scenario}.toml", tmp_path)
    return tmp_path


def _execute(arguments: list[str], folder: Path, shell: str = "") -> str:
    own = {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}
    ended = subprocess.run(
        shell or arguments, shell=bool(shell), env={**os.environ, **own}, cwd=folder, capture_output=True, text=True
    )
    assert ended.returncode == 0, f"{shell or arguments}\n{ended.stdout[-2000:]}\n{ended.stderr[-2000:]}"
    return ended.stdout


def test_the_first_steps_make_or_ship_every_file_that_they_name() -> None:
    """A file that a command reads is in the checkout, or an earlier command writes it or its folder."""
    made: list[str] = []
    for block in (*blocks(ROOT / "README.md"), *blocks(ROOT / "docs" / "first-steps.md")):
        for line in block.code.splitlines() if block.language == "sh" else ():
            for part in line.split("&&"):
                words = shlex.split(part, comments=True)
                if words[:1] != ["sinssim"]:
                    continue
                outputs = [there for key, there in pairwise(words) if key in ("-o", "--out", "--plot", "--record")]
                for word in words[2:]:
                    if word not in outputs and re.search(r"/|\.[a-z]+$", word) and "=" not in word:
                        assert (ROOT / word).exists() or any(Path(word).is_relative_to(one) for one in made), part
                for word in words[2:3]:
                    ending = words[words.index("--to") + 1] if words[1] == "export" else ""
                    made += [f"{word}-{ending}"] if ending else [f"runs/{word}", f"runs/{word}-{words[1]}", word]
                made += outputs


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_COMMANDS, ids=name)
def test_commands_run(page: Path, folder: Path) -> None:
    before: dict[str, list[str]] = {
        "docs/allan.md": ["sinssim run parked"],
        "docs/logs.md": ["sinssim run parked"],
        "docs/tutorials/own-sensor.md": ["sinssim run my_flight.toml -o runs/my_flight"],
    }
    program = f"{sys.executable} -m sinssim "
    for line in [*before.get(name(page), []), *dict.fromkeys(commands(page))]:
        for long, short in FEWER.items():
            line = line.replace(long, short)
        line = re.sub("^sinssim ", program, re.sub("^python ", f"{sys.executable} ", line))
        try:
            _execute([], folder, line)
        except AssertionError as refusal:  # the line of a list of alternatives, which write the same folder
            if "--overwrite" not in str(refusal):
                raise
            _execute([], folder, f"{line} --overwrite")


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_CODE, ids=name)
def test_code_runs(page: Path, folder: Path) -> None:
    for block in blocks(page):
        if block.language == "python":
            _execute([sys.executable, "-c", block.code], folder)


@pytest.mark.slow
def test_tutorials_print_their_numbers(folder: Path) -> None:
    """The rows of the tables of the tutorials, as the program prints them."""
    printed: dict[str, str] = {}
    for page in ("first-flight", "own-sensor", "filter"):
        found = blocks(ROOT / "docs" / "tutorials" / f"{page}.md")
        for command, output in _with_output(found):
            if command not in printed:
                printed[command] = _execute([], folder, re.sub("^sinssim ", f"{sys.executable} -m sinssim ", command))
            rows = {" ".join(line.split()) for line in printed[command].splitlines()}
            for line in output.code.splitlines():
                if re.search(r"\w", line):
                    assert " ".join(line.split()) in rows, f"{page}: {line}"


def _with_output(found: list[Block]) -> list[tuple[str, Block]]:
    """Return the last command before each block of output."""
    pairs, command = [], ""
    for block in found:
        if block.language == "sh":
            command = block.code.splitlines()[-1].split("  #")[0]
        elif not block.language:
            pairs.append((command, block))
    return pairs


def test_reasons_belong_to_commands() -> None:
    """No reason is left over from a command that a page no longer has."""
    lines = [
        line for page in PAGES for block in blocks(page) if block.language == "sh" for line in block.code.splitlines()
    ]
    parts = [part.strip() for line in lines for part in line.split("&&")]
    for form in NOT_HERE:
        assert any(re.search(form, part) for part in parts), form
    for long in FEWER:
        assert any(long in part for part in parts), long
