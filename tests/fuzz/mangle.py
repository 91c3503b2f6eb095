"""Seeded mutations: what a person, a broken program or a hostile one may put where something sound is expected."""

from __future__ import annotations

import contextlib
import copy
import datetime
import signal
import time
import traceback
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sinssim.errors import SinssimError

NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 3, 0.0, -0.0, 0.5, 1.0, -1.0, 2.5, 1e-3, 1e3, 90.0, -90.0, 1e-9, 1e9, 1e5, 1e16, -1e16, 1e100,
    1e300, -1e300, 1.7976931348623157e308, 2.2250738585072014e-308, 5e-324, float("nan"), float("inf"), float("-inf"),
    2**31, -(2**31) - 1, 2**53 + 1, 2**63, 2**64, 10**400, True, False,
)  # fmt: skip
TEXTS = (
    "", " ", "quaternion", "level", "normal", "laser-standard", "737", "é°µσ", "a" * 300, "b" * 100_000, "\0", "a\nb\t",
    "../..", "~nobody/x", "/dev/null", ".", "%s{0}", "nan", "1e5", "gyros", "\N{PILE OF POO}", "turn", "air", "coning",
    "\x1b[31mred", "\x7f\x85", "\u202eback", "\u200bnothing", "\ufeffmark", "a\u0301" * 40, "\r", "\U000e0001",
    "[" * 5000,
)  # fmt: skip
LONGEST = 10.0  # seconds of a case; the slowest takes about one on a busy machine
MARKS = "[]{}=\".,#\n'\\-+0e\0 \t_é"


def rewrite(path: Path, raw: bytes) -> None:
    """Write a file anew. A file cut to nothing and written again is flushed to the disk by some file systems."""
    path.unlink(missing_ok=True)
    path.write_bytes(raw)


def nested(depth: int) -> list[Any]:
    """Return an array in an array, so many times."""
    inner: list[Any] = []
    for _ in range(depth):
        inner = [inner]
    return inner


def value(rng: np.random.Generator) -> Any:
    """Return anything that a TOML file can hold."""
    kind = int(rng.integers(0, 12))
    if kind < 5:
        return NUMBERS[rng.integers(len(NUMBERS))]
    if kind == 5:
        return float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-12.0, 12.0))
    if kind < 8:
        return TEXTS[rng.integers(len(TEXTS))]
    if kind == 8:
        return [value(rng) for _ in range(rng.integers(0, 7))]
    if kind == 9:
        return [NUMBERS[rng.integers(len(NUMBERS))]] * int(rng.choice([3, 6, 9]))
    if kind == 10:
        return {str(TEXTS[rng.integers(len(TEXTS))]): value(rng) for _ in range(rng.integers(0, 3))}
    rare = (
        datetime.date(2024, 2, 29),
        datetime.datetime(1, 1, 1, tzinfo=datetime.UTC),
        datetime.time(23, 59),
        nested(int(rng.choice([5, 60, 300]))),
        list(range(20_000)) if rng.integers(20) == 0 else list(range(200)),
        ["x"] * 2000 if rng.integers(20) == 0 else ["x"] * 50,
    )
    return copy.copy(rare[rng.integers(len(rare))])


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterable[tuple[Any, ...]]:
    """Yield the path of everything in a structure of tables and arrays."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, inner in items:
        yield (*path, key)
        yield from places(inner, (*path, key))


def at(data: Any, path: tuple[Any, ...]) -> Any:
    """Return what stands at a path."""
    for key in path:
        data = data[key]
    return data


def text(rng: np.random.Generator, original: str) -> str:
    """Return a text with one to four wounds."""
    found = original
    for _ in range(rng.integers(1, 5)):
        i, j = sorted(int(k) for k in rng.integers(0, len(found) + 1, 2))
        lines = found.split("\n")
        line = int(rng.integers(len(lines)))
        wounds: tuple[Callable[[], str], ...] = (
            lambda i=i, f=found: f[:i] + MARKS[rng.integers(len(MARKS))] + f[i:],
            lambda i=i, f=found: f[:i] + f[i + 1 :],
            lambda i=i, j=j, f=found: f[:i] + f[min(j, i + 40) :],
            lambda i=i, f=found: f[:i],
            lambda lines=lines, k=line: "\n".join([*lines[:k], *lines[k + 1 :]]),
            lambda lines=lines, k=line: "\n".join([*lines[: k + 1], *lines[k:]]),
            lambda i=i, f=found: f[:i] + str(NUMBERS[rng.integers(len(NUMBERS))]) + f[i:],
            lambda i=i, f=found: f[:i] + "[" * int(rng.choice([2, 200, 2000])) + f[i:],
            lambda lines=lines, k=line: "\n".join(
                [*lines[:k], "a." * (3000 if rng.integers(20) == 0 else 3) + "a = 1", *lines[k:]]
            ),
        )
        found = wounds[rng.integers(len(wounds))]()
    return found


class _HangError(BaseException):
    """A case takes too long."""


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """Interrupt a case that computes for longer than `LONGEST`, or waits for ten times as long: other programs may have
    the processor."""
    computed, waited = time.process_time() + LONGEST, time.monotonic() + 10.0 * LONGEST

    def stop(*_: object) -> None:
        if time.process_time() > computed or time.monotonic() > waited:
            raise _HangError(f"longer than {LONGEST:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, LONGEST, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class Verdict:
    """What became of the cases: those that were taken, those refused in the project's own words, and the others."""

    def __init__(self) -> None:
        self.taken = self.refused = 0
        self.broken: list[str] = []

    def judge(self, case: Callable[[], object], what: Callable[[], str]) -> None:
        """Run one case.

        Args:
            case: does it.
            what: describes it, for a person to do it again.
        """
        try:
            with _limited():
                case()
        except SinssimError as error:
            self.refused += 1
            said = str(error)
            if not said or len(said) > 6000:
                self.broken.append(f"{what()}: a message of {len(said)} characters: {said[:200]}")
            elif any(unicodedata.category(c)[0] == "C" or c in "\u2028\u2029" for c in said.replace("\n", "")):
                self.broken.append(f"{what()}: a message that cannot be printed: {said[:200]!r}")
        except (Exception, _HangError) as error:
            last = "".join(traceback.format_tb(error.__traceback__)[-2:])
            self.broken.append(f"{what()}: {type(error).__name__}: {str(error)[:300]}\n{last}")
        else:
            self.taken += 1

    def must_be_sound(self) -> None:
        """Fail if there was anything but success and the project's own errors."""
        kinds = {one.split("\n")[-3] if one.count("\n") > 3 else one: one for one in self.broken}
        shown = "\n\n".join(list(kinds.values())[:20])
        assert not self.broken, f"{len(self.broken)} of {self.taken + self.refused + len(self.broken)} cases:\n{shown}"
        assert self.taken > 0, "no case was taken: the mutations are too coarse to reach anything"
        assert self.refused > 0, "no case was refused"
