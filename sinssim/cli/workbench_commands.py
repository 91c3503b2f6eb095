"""Commands of sinssim as child processes: their command lines, progress, output and end."""

from __future__ import annotations

import itertools
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from sinssim.errors import InputError, check_name
from sinssim.progress import VARIABLE

OF_TEXTS = ("check", "run", "ensemble", "budget", "compare", "align", "calibrate")
"""The commands of a scenario or a study."""
KINDS = (*OF_TEXTS, "view", "compare-runs")
"""The commands that the page starts."""
_MOST = 4
"""Commands that run at a time."""
_PATIENCE = 10.0
"""Time for a command to write what it has after it was cancelled, s."""
_KEPT, _ENDED = 400, 50  # lines of a command's output, and commands that have ended, that are kept
_PROGRESS, _PAGE = re.compile(r"progress ([\d.]+) ?(.*)"), re.compile(r"Open (http://127\.0\.0\.1:\S+)")
_FOLDER = re.compile(r"[A-Za-z0-9][\w.-]{0,99}")


def arguments_of(wanted: Mapping[str, Any]) -> list[str]:
    """Return the command line, without the program, that the page asks for: `command`, one of `KINDS`; `paths`, the
    scenario, the study or the finished runs, checked before; for those of `OF_TEXTS` `settings`, `require`, `runs`,
    `out` (a name in the folder `runs`), `overwrite` and `allow_programs`. Raise InputError if something is missing, or
    is not of its kind."""
    command = wanted.get("command")
    check_name("command", command, KINDS)
    assert isinstance(command, str)
    # a name that begins with a hyphen is no option
    paths = [f"./{path}" if path.startswith("-") else path for path in _texts(wanted, "paths")]
    if len(paths) < (2 if command == "compare-runs" else 1):
        raise InputError("choose two runs or more to compare." if command == "compare-runs" else "choose a scenario.")
    if command == "view":
        return [command, *paths[:1], "--web"]
    if command == "check":
        return [command, paths[0]]
    if command == "compare-runs":
        return [command, *paths, *(["--overwrite"] if wanted.get("overwrite") is True else [])]
    options = [f"--set={setting}" for setting in _texts(wanted, "settings")]
    at_rest = command in ("align", "calibrate")
    options += [f"--require={requirement}" for requirement in ([] if at_rest else _texts(wanted, "require"))]
    runs = wanted.get("runs")
    if command == "ensemble" and runs is not None:
        if not isinstance(runs, int) or isinstance(runs, bool) or runs < 1:
            raise InputError(f"the number of runs is {runs!r}; give a whole number from 1.")
        options.append(f"--runs={runs}")
    out = wanted.get("out")
    if command == "align" and not out:  # which writes nothing by itself
        options.append(f"--out=runs/{PurePosixPath(paths[0]).stem}-alignment")
    if out:
        if not isinstance(out, str) or not _FOLDER.fullmatch(out):
            raise InputError(f"the folder {str(out)!r} must be a name of letters, digits, '.', '-' and '_'.")
        options.append(f"--out=runs/{out}")
    switches = ("overwrite",) if at_rest else ("overwrite", "allow_programs")
    options += [f"--{name.replace('_', '-')}" for name in switches if wanted.get(name) is True]
    return [command, paths[0], *options]


def _texts(wanted: Mapping[str, Any], name: str) -> list[str]:
    texts = wanted.get(name, [])
    if not isinstance(texts, list) or not all(isinstance(text, str) and "\0" not in text for text in texts):
        raise InputError(f"{name} must be a list of texts.")
    return texts


@dataclass
class Child:
    """A command that was started."""

    number: int  # counted from 1
    arguments: Sequence[str]  # without the program
    process: subprocess.Popen[str]
    begun: float  # Unix time, s
    ended: float = 0.0  # Unix time, s; 0 while it runs
    stage: str = ""  # what it does
    fraction: float = 0.0  # of the stage, 0…1
    page: str = ""  # address of the page that it serves
    cancelled: bool = False
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=_KEPT))  # the end of its output

    def to_json(self) -> dict[str, Any]:
        """Return what the page shows."""
        return {
            "number": self.number, "command": shlex.join(["sinssim", *self.arguments]), "stage": self.stage,
            "fraction": self.fraction, "page": self.page if not self.ended else "", "cancelled": self.cancelled,
            "seconds": round((self.ended or time.time()) - self.begun, 1), "code": self.code,
            "output": "\n".join(self.lines),
        }  # fmt: skip

    @property
    def code(self) -> int | None:
        """Exit code, None while it runs."""
        return self.process.returncode if self.ended else None


class Children:
    """The commands that were started in a folder; a context manager that ends them."""

    def __init__(self, folder: Path) -> None:
        """Start none."""
        self._folder, self._children, self._numbers = folder, dict[int, Child](), itertools.count(1)
        self._lock = threading.Lock()

    def __enter__(self) -> Children:
        return self

    def __exit__(self, *_: object) -> None:
        running = self._running()
        for child in running:
            self.cancel(child.number)
        until = time.monotonic() + _PATIENCE
        for child in running:
            with suppress(subprocess.TimeoutExpired):
                child.process.wait(max(0.0, until - time.monotonic()))
            _kill(child)

    def __iter__(self) -> Any:
        return reversed(list(self._children.values()))

    def __getitem__(self, number: int) -> Child:
        if number not in self._children:
            raise InputError(f"there is no command {number}.")
        return self._children[number]

    def start(self, arguments: Sequence[str]) -> Child:
        """Start a command; raise InputError while many run."""
        with self._lock:
            if len(self._running()) >= _MOST:
                raise InputError(f"{_MOST} commands are running; wait for one, or cancel one.")
            process = subprocess.Popen(
                [sys.executable, "-m", "sinssim", *arguments],
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                env={**os.environ, VARIABLE: "lines", "PYTHONUNBUFFERED": "1", "COLUMNS": "120"},
                start_new_session=True,  # Ctrl-C reaches the workbench, which then ends it
            )
            child = Child(next(self._numbers), arguments, process, time.time())
            self._children[child.number] = child
            for old in [number for number, child in self._children.items() if child.ended][:-_ENDED]:
                del self._children[old]
        threading.Thread(target=_follow, args=(child,), name=f"command {child.number}", daemon=True).start()
        return child

    def cancel(self, number: int) -> None:
        """Interrupt a command, as Ctrl-C does, and kill it the second time; raise InputError if it does not run."""
        child = self._children.get(number)
        if child is None or child.ended:
            raise InputError(f"the command {number} is not running.")
        if child.cancelled:
            _kill(child)
        child.cancelled = True
        with suppress(ProcessLookupError):
            child.process.send_signal(signal.SIGTERM)

    def _running(self) -> list[Child]:
        return [child for child in self._children.values() if not child.ended]


def _follow(child: Child) -> None:
    """Read what a command prints until it ends; what it has started ends with it."""
    assert child.process.stdout is not None
    threading.Thread(target=_clear, args=(child,), daemon=True).start()
    with child.process.stdout as output:
        for line in output:
            line = line.rstrip("\n")
            if progress := _PROGRESS.match(line):
                child.fraction, child.stage = float(progress[1]), progress[2]
                continue
            if page := _PAGE.match(line):
                child.page = page[1]
            child.lines.append(line)
    child.process.wait()
    child.ended = time.time()


def _clear(child: Child) -> None:
    """Kill what a command has started once it has ended: it would keep the end of the output."""
    child.process.wait()
    _kill(child)


def _kill(child: Child) -> None:
    """Kill what is left of a command's group of processes."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child.process.pid, signal.SIGKILL)
    child.process.wait()
