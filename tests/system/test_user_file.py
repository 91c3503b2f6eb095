"""A user's file is opened in one place, which refuses pipes and devices: they would wait for ever, or have no end."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.system import files
from tests.sources import tree

_PACKAGE = Path(sinssim.__file__).parent

OWN = {
    "recording": "run directories, and files that are written",
    "experiments/experiment_directory.py": "directories of ensembles and trade studies",
    "experiments/ensembles/ensemble_directory.py": "directories of ensembles",
    "experiments/studies/trade_run.py": "directories of trade studies",
    "experiments/run": "run directories",
    "logs/stored_run.py": "run directories",
    "system": "this function, marks of output directories, caches, limits of the machine",
    "truth/flight/flight_cache.py": "cached flights",
    "earth/harmonic_coefficients.py": "a file of the package",
    "cli/commands/content.py": "views, which the package imports",
    "scenario/schema.py": "the summary of a run directory",
    "__main__.py": "the null device",
    "jit.py": "sources and kernels",
}
"""Modules that open files which sinssim itself wrote or ships."""

_METHODS = {"open", "read_text", "read_bytes"}
_LIBRARIES = {
    "fromfile", "load", "loadtxt", "genfromtxt", "read_csv", "read_schema", "ParquetFile", "ZipFile", "is_zipfile",
    "AnyReader", "memmap",
}  # fmt: skip
_OF_LIBRARIES = {"pq", "parquet", "csv", "arrow_csv", "np", "zipfile", "highlevel"}

_WORDS = re.compile(rf"\b({'|'.join({'open', 'read_table', *_METHODS, *_LIBRARIES})})\(")


def _openings(code: ast.AST) -> list[int]:
    """Return the lines that open a path without `user_file`."""
    found = []
    for node in ast.walk(code):
        if not isinstance(node, ast.Call):
            continue
        function = node.func
        if isinstance(function, ast.Name):
            opens = function.id == "open"
        elif isinstance(function, ast.Attribute) and function.attr in {*_METHODS, *_LIBRARIES, "read_table"}:
            owner, arguments = ast.unparse(function.value), [ast.unparse(argument) for argument in node.args]
            given = " ".join(arguments)
            method = function.attr in _METHODS and "user_file" not in owner and owner not in ("os", "archive")
            method &= arguments[:1] not in (["'w'"], ["'wb'"])
            library = owner in _OF_LIBRARIES and function.attr in {*_LIBRARIES, "read_table"}
            library &= not any(word in given for word in ("user_file(", "py_buffer", "source", "file"))
            opens = method or library
        else:
            opens = False
        if opens:
            found.append(node.lineno)
    return found


def test_no_other_module_opens_a_file_of_a_user() -> None:
    """Every call that opens a path is in a module that opens sinssim's own files, or goes through `user_file`."""
    found = {}
    for file in sorted(_PACKAGE.rglob("*.py")):
        name = file.relative_to(_PACKAGE).as_posix()
        if any(name == own or name.startswith(f"{own}/") for own in OWN):
            continue
        if not _WORDS.search(file.read_text(encoding="utf-8")):
            continue
        lines = _openings(tree(file))
        if lines:
            found[name] = lines
    assert found == {}


def test_the_search_finds_openings() -> None:
    for text in ("path.open('rb')", "open(path)", "Path(x).read_text()", "np.fromfile(path)", "csv.read_csv(path)"):
        assert _WORDS.search(text)
        assert _openings(ast.parse(text)) == [1]
    for text in ("open_file(path)", "user_file(path).open('rb')", "np.fromfile(user_file(path))"):
        assert _openings(ast.parse(text)) == []


_SCRIPT = """
import resource, signal, sys, traceback
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
from sinssim.analyses.alignment_session import align
from sinssim.earth.harmonic_coefficients import read_icgem
from sinssim.errors import InputError
from sinssim.analyses.inspection.inspected_files import inspect
from sinssim.analyses.inspection.inspected_files import suggest
from sinssim.logs.formats import FORMATS
from sinssim.logs.formats import read_file
from sinssim.logs.imu_samples import read_log
from sinssim.analyses.noise_report import noise_report
from sinssim.scenario import load_scenario
from sinssim.scenario.true_motion import fly
from sinssim.logs.recorded_log import recorded_log

def late(*_):
    raise TimeoutError("it waits")
signal.signal(signal.SIGALRM, late)
folder = Path(sys.argv[1])
for place in sys.argv[2:]:
    path = Path(place)
    (folder / "track.toml").write_text(f'[track]\\nfile = "{path}"\\n[imu]\\ngrade = "ideal"\\n')
    for table in ("gravity", "compensation"):
        parked = "[parked]\\nlatitude_deg = 50.0\\nduration_s = 10.0\\n[imu]\\ngrade = 'ideal'\\n"
        (folder / f"{table}.toml").write_text(f'{parked}[{table}]\\nfile = "{path}"\\n')
    (folder / "log.toml").write_text(f'[log.imu]\\nfile = "{path}"\\n[imu]\\ngrade = "ideal"\\n')
    uses = {
        "inspect": lambda: inspect([path]),
        "run": lambda: suggest([path]),
        "align": lambda: align(str(path)),
        "allan": lambda: noise_report(path),
        "icgem": lambda: read_icgem(path),
        "columns": lambda: read_log(folder / "log.csv", path),
        "track": lambda: fly(load_scenario(folder / "track.toml")),
        "gravity": lambda: fly(load_scenario(folder / "gravity.toml")),
        "compensation": lambda: load_scenario(folder / "compensation.toml"),
        "log": lambda: recorded_log(load_scenario(folder / "log.toml").log),
        **{name: (lambda name=name: read_file(path, name)) for name in FORMATS},
    }
    for name, use in uses.items():
        signal.alarm(10)
        try:
            use()
            print("READ", name, place)
        except InputError as error:
            print("refused", name, place, len(str(error)), str(error)[:100].replace(chr(10), " "))
        except BaseException as error:
            print("FAILED", name, place, type(error).__name__, str(error)[:200])
        signal.alarm(0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither pipes of this kind nor /dev/zero")
def test_pipes_and_devices_are_refused_everywhere(tmp_path: Path) -> None:
    """Every place that takes a user's file answers within ten seconds, with a process of 8 GB."""
    os.mkfifo(tmp_path / "pipe")
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "log.csv").write_text("time_s\n0\n")
    (tmp_path / "uses.py").write_text(_SCRIPT)
    places = [tmp_path / "pipe", tmp_path / "pipe.csv", "/dev/zero", "/dev/null"]
    words = [sys.executable, tmp_path / "uses.py", tmp_path, *places]
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    answers = done.stdout.splitlines()
    assert len(answers) > 100
    assert [line for line in answers if not line.startswith("refused ")] == []


def test_a_folder_and_a_missing_file_keep_their_messages(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        files.open_file(tmp_path)
    with pytest.raises(FileNotFoundError):
        files.read_bytes(tmp_path / "nothing")


def test_a_file_larger_than_the_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "large").write_bytes(b"12345")
    monkeypatch.setattr("sinssim.system.process.machine_memory", lambda: 4.0)
    with pytest.raises(InputError, match="large has 5 B, and this machine's memory 4 B"):
        files.read_text(tmp_path / "large")
