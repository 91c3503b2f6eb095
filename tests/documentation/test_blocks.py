"""Every block of code of the pages is known to the program: commands, scenario files, code.

Commands have existing names, options and scenarios, TOML is accepted, Python compiles. `test_blocks_run.py` executes
the commands and the code in the slow run. The tests named in `OWN_TESTS` execute the code of their page in the normal
run and compare what it gives.
"""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer.main

from sinssim.cli.app import app
from sinssim.errors import SinssimError
from sinssim.experiments.study import load_study
from sinssim.logs.column_description import LogDescription
from sinssim.scenario.load import load_scenario
from sinssim.sensors.imu.grades import read_grade
from tests.documentation.fences import NOT_RUN, OWN_TESTS, PAGES, ROOT, Block, blocks, name

LANGUAGES = {"", "sh", "toml", "python", "diff"}
_PARKED = "[parked]\nlatitude_deg = 50.0\nduration_s = 60.0\n"
_PLANE = '[one_component]\nvariant = "one-integral"\nduration_s = 60.0\n[one_component.gyro]\n'
_FILES = ("drive.gpx", "imu.csv", "gnss.csv", "runs/calibration_table-calibration/compensation.toml")
"""Files that examples name; empty here, because a scenario is loaded before they are read."""

ALL = [(page, block) for page in PAGES for block in blocks(page)]
ALL += [
    (file, Block("toml", "", file.read_text(encoding="utf-8"), 1))
    for file in sorted((ROOT / "docs" / "programs").glob("*.toml"))
]


def _of(*languages: str) -> list[Any]:
    return [
        pytest.param(page, block, id=f"{name(page)}:{block.line}") for page, block in ALL if block.language in languages
    ]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_languages_are_known(page: Path) -> None:
    for block in blocks(page):
        where = f"{name(page)}, line {block.line}"
        assert block.language in LANGUAGES, where
        assert not block.path or name(page).startswith(("docs/extending/", "docs/tasks.md")), (
            f"{where}: no test makes the file {block.path}"
        )
        if not block.language:  # output, paths, diagrams
            excused = any(page_ == name(page) and block.code.startswith(start) for page_, start in NOT_RUN)
            is_command = re.match(r"(?:sinssim|python|make) ", block.code)
            assert excused or not is_command, f"{where}: mark commands with sh, or give a reason in NOT_RUN"


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name == "extending"], ids=name)
def test_pages_on_extending_have_their_tests(page: Path) -> None:
    assert (ROOT / "tests" / "extending" / f"test_{page.stem.replace('-', '_')}.py").is_file()


@pytest.mark.parametrize(("page", "tests"), OWN_TESTS.items())
def test_own_tests_read_their_pages(page: str, tests: str) -> None:
    text = (ROOT / tests).read_text(encoding="utf-8")
    assert Path(page).name in text or f'"{Path(page).stem}"' in text
    assert "python" in text or "```" in text


@pytest.mark.parametrize(("page", "block"), _of("python"))
def test_code_compiles(page: Path, block: Block) -> None:
    compile(block.code, name(page), "exec")


def _words(code: str) -> Iterator[list[str]]:
    """Return the words of every command of a block."""
    for line in code.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        while "&&" in words:
            cut = words.index("&&")
            yield words[:cut]
            words = words[cut + 1 :]
        if words:
            yield words


@pytest.mark.parametrize(("page", "block"), _of("sh"))
def test_commands_can_be_given(page: Path, block: Block) -> None:
    if name(page) == "docs/troubleshooting.md":
        return  # test_troubleshooting.py runs each command and compares its message
    for words in _words(block.code):
        program, *rest = words
        if program == "sinssim":
            _check_sinssim(rest)
        elif program == "make":
            assert re.search(rf"^{rest[0]}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
        elif program == "python" and rest[0] == "-m":
            assert (ROOT / f"{rest[1].replace('.', '/')}.py").is_file()
        elif program == "python":
            assert (ROOT / rest[0]).is_file() or rest[0] in "".join(b.code for b in blocks(page)) + page.read_text(
                "utf-8"
            )
        else:
            assert program in ("cd", "pip", "KF-GINS", "octave-cli"), words


@cache
def _commands() -> dict[str, Any]:
    """Return the commands of the program by their names."""
    group: Any = typer.main.get_command(app)
    return dict(group.commands)


def _check_sinssim(words: list[str]) -> None:
    """Read the options of a command, and load the shipped scenario that it names with its settings."""
    if words[0].startswith("--"):  # an option of the program itself
        assert words[0] in {option for parameter in typer.main.get_command(app).params for option in parameter.opts}
        return
    command = _commands().get(words[0])
    assert command is not None, words[0]
    if "FORMAT" in words:  # the form of the command
        options = {option for parameter in command.params for option in parameter.opts}
        assert {word.strip("[]") for word in words if word.strip("[]").startswith("-")} <= options
        return
    given = command.make_context(words[0], words[1:]).params
    scenario = given.get("scenario")
    if isinstance(scenario, str) and words[0] in ("run", "check", "budget", "ensemble", "calibrate"):
        shipped = (ROOT / "scenarios" / f"{scenario}.toml").is_file() or (ROOT / scenario).is_file()
        assert shipped or scenario.endswith(".toml"), scenario
        if shipped:
            _load(scenario, tuple(given.get("settings") or ()))


@cache
def _load(scenario: str, settings: tuple[str, ...]) -> None:
    load_scenario(scenario, settings)


@pytest.mark.parametrize(("page", "block"), _of("toml"))
def test_toml_is_accepted(page: Path, block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if block.path:
        return  # other tests make the files
    if block.code.startswith("[project"):
        return  # a part of another package's pyproject.toml, which tests/system/own_content makes
    monkeypatch.chdir(tmp_path)
    for file in _FILES:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("[compensation]\n", encoding="utf-8")
    (tmp_path / "my_flight.toml").write_text(_flight(), encoding="utf-8")
    refusals = []
    for text in _completed(page, block):
        for read in _READERS:
            (tmp_path / "page.toml").write_text(text, encoding="utf-8")
            try:
                read(tmp_path / "page.toml")
            except (SinssimError, ValueError, TypeError) as refusal:
                refusals.append(f"{read.__name__}: {refusal}")
            else:
                return
    raise AssertionError("\n".join(refusal.split("\n")[0] for refusal in refusals))


def _flight() -> str:
    page = ROOT / "docs" / "tutorials" / "first-flight.md"
    return next(block.code for block in blocks(page) if block.language == "toml")


def _completed(page: Path, block: Block) -> Iterator[str]:
    """Return what the block may be: a whole file, tables of a scenario, or keys of the table before it."""
    yield block.code
    yield f'name = "page"\n{block.code}'
    yield f'name = "page"\n{_PARKED}{block.code}'
    yield f'name = "page"\n{_PARKED}[imu]\ngrade = "laser-standard"\n{block.code}'
    yield f"{_flight()}\n{block.code}"
    yield f'name = "page"\n{_PLANE}{block.code}'
    yield from (
        f'name = "page"\n{_PARKED}{other.code}{block.code}'
        for other in blocks(page)
        if other.language == "toml" and other.line < block.line
    )


def _description(path: Path) -> object:
    return LogDescription(**tomllib.loads(path.read_text(encoding="utf-8")))


_READERS: tuple[Callable[[Path], object], ...] = (load_scenario, load_study, load_study, read_grade, _description)
