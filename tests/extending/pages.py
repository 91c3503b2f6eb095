"""Applies the code of a page of docs/extending/ to a copy of the package, as a reader would.

A page marks a block of code with a path, behind the language of the fence:

    ```python sinssim/strapdown/attitude/cayley.py     a new file, whole
    ```toml scenarios/turntable.toml                   the same, outside the package
    ```diff sinssim/strapdown/attitude/__init__.py                      a change of an existing file
    ```python                                          a snippet to run; it has no path

A `diff` block holds one change or several, with an empty line between them. A line begins with " " (it is there and
stays), "+" (new) or "-" (removed), as in a unified diff; there are no line numbers. What stays and what is removed must
stand in the file exactly once, in a row.

A test:

    def test_page(tmp_path: Path) -> None:
        page = read_page("gyro-error-term")
        copy = Copy(tmp_path)
        copy.apply(page)
        assert len(copy.touched) <= 4, copy.touched
        assert copy.run(page.snippets[0]) == "..."
"""

from __future__ import annotations

import atexit
import filecmp
import re
import shutil
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.forked import Forks

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "extending"
_FOLDERS = ("sinssim", "aircraft", "scenarios", "viz")
_PACKAGES = (
    "scipy.stats", "scipy.signal", "scipy.spatial.transform", "scipy.optimize", "scipy.interpolate", "filterpy.kalman",
    "pydantic", "typer.testing",
)  # fmt: skip
"""What the package imports and no page changes."""
_STRICT = "import warnings; warnings.simplefilter('error')\n"
_END = "----- the end of a command -----"
_EACH = """
from sinssim.cli.app import main
for words in {commands!r}:
    try:
        main(words)
    except SystemExit as end:
        assert not end.code, words
    print({end!r})
"""
_FENCE = re.compile(r"^```(\w+)(?: +(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """One block of code.

    Attributes:
        language: of the fence, for example "python" or "diff".
        path: of the file that it makes or changes, relative to the checkout; "" for a snippet.
        code: its text.
    """

    language: str
    path: str
    code: str


@dataclass(frozen=True)
class Page:
    """A page of the documentation.

    Attributes:
        name: of the file, without the suffix.
        blocks: all blocks of code, in the order of the page.
    """

    name: str
    blocks: tuple[Block, ...]

    @property
    def snippets(self) -> tuple[str, ...]:
        """The Python blocks without a path: code to run once the page's changes are made."""
        return tuple(block.code for block in self.blocks if block.language == "python" and not block.path)

    @property
    def files(self) -> tuple[Block, ...]:
        """The blocks that make or change a file."""
        return tuple(block for block in self.blocks if block.path)


def read_page(name: str) -> Page:
    """Read a page of docs/extending/.

    Args:
        name: of the file, without the suffix.

    Returns:
        The page.
    """
    text = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    return Page(name, tuple(Block(language, path, code) for language, path, code in _FENCE.findall(text)))


class Copy:
    """A copy of the package and its content folders, to change and to run."""

    def __init__(self, folder: Path) -> None:
        """Copy the checkout.

        Args:
            folder: an empty folder of the test, for example `tmp_path`.
        """
        self.root = folder / "checkout"
        for name in _FOLDERS:
            shutil.copytree(ROOT / name, self.root / name, ignore=shutil.ignore_patterns(".*"))

    def apply(self, page: Page) -> None:
        """Make the files of a page and its changes.

        Args:
            page: the page.

        Raises:
            AssertionError: a new file that is there already, or a change whose lines are not in the file exactly once.
        """
        for block in page.files:
            path = self.root / block.path
            if block.language == "diff":
                path.write_text(changed(path.read_text(encoding="utf-8"), block), encoding="utf-8")
            else:
                assert not path.exists(), f"{page.name}: {block.path} is there already; a diff changes it"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block.code, encoding="utf-8")

    @property
    def touched(self) -> list[str]:
        """Files of the package that are new, changed or gone, relative to the checkout."""
        folders = (ROOT / "sinssim", self.root / "sinssim")
        paths = {path.relative_to(folder) for folder in folders for path in folder.rglob("*.py")}
        own, copied = folders
        return sorted(
            f"sinssim/{path.as_posix()}"
            for path in paths
            if not (own / path).exists()
            or not (copied / path).exists()
            or not filecmp.cmp(own / path, copied / path, shallow=False)
        )

    def run(self, code: str) -> str:
        """Run Python code with the changed package; warnings are errors.

        Args:
            code: for example a snippet of the page and what the test adds to it.

        Returns:
            What it prints.

        Raises:
            AssertionError: the code failed; the message holds what it wrote to stderr.
        """
        ended = _forks().run("-c", _STRICT + code, cwd=self.root, PYTHONPATH=str(self.root))
        assert ended.returncode == 0, f"{code}\n{ended.stdout}\n{ended.stderr}"
        return ended.stdout

    def command(self, *arguments: str) -> str:
        """Run the command line of the changed package.

        Args:
            *arguments: for example "check", "scenarios/turntable.toml".

        Returns:
            What it prints.

        Raises:
            AssertionError: the command failed; the message holds what it wrote to stderr.
        """
        return self.commands(arguments)[0]

    def commands(self, *commands: tuple[str, ...]) -> list[str]:
        """Run several command lines of the changed package in one process.

        Args:
            *commands: the arguments of each.

        Returns:
            What each prints.

        Raises:
            AssertionError: a command failed.
        """
        return self.run(_EACH.format(commands=commands, end=_END)).split(f"{_END}\n")[:-1]


@cache
def _forks() -> Forks:
    """Return what starts the processes of all pages; a process that starts anew takes two seconds."""
    forks = Forks(*_PACKAGES)
    atexit.register(forks.__exit__)
    return forks.__enter__()


def changed(text: str, block: Block) -> str:
    """Return a file's text with the changes of a `diff` block.

    Args:
        text: of the file.
        block: the changes.

    Returns:
        The changed text.

    Raises:
        AssertionError: a line without " ", "+" or "-" before it, or lines that are not in the file exactly once.
    """
    for change in re.split(r"^\n", block.code, flags=re.MULTILINE):
        lines = change.splitlines(keepends=True)
        assert all(line[0] in " +-" for line in lines), f"{block.path}: a line of a change begins with ' ', '+' or '-'"
        before = "".join(line[1:] for line in lines if line[0] != "+")
        after = "".join(line[1:] for line in lines if line[0] != "-")
        count = f"\n{text}".count(f"\n{before}")
        assert before, f"{block.path}: a change needs a line that is in the file:\n{change}"
        assert count == 1, f"{block.path}: these lines are in the file {count} times, not once:\n{before}"
        text = f"\n{text}".replace(f"\n{before}", f"\n{after}", 1)[1:]
    return text
