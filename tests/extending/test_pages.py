"""The helper that applies the pages of docs/extending/."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.extending.pages import PAGES, Block, Copy, Page, changed, read_page

FILE = "a = (\n    1,\n    2,\n)\nb = 2\n"


def test_a_change_stands_where_its_lines_stand():
    block = Block("diff", "x.py", "     1,\n+    15,\n     2,\n\n-b = 2\n+b = 3\n+c = 4\n")
    assert changed(FILE, block) == "a = (\n    1,\n    15,\n    2,\n)\nb = 3\nc = 4\n"


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("     3,\n+    4,\n", "0 times"),
        (" 2\n+3\n", "0 times"),  # a part of a line is no line
        ("+4\n", "needs a line"),
        ("b = 2\n", "begins with"),
    ],
)
def test_a_change_that_fits_nowhere(code, said):
    with pytest.raises(AssertionError, match=said):
        changed(FILE, Block("diff", "x.py", code))
    with pytest.raises(AssertionError, match="2 times"):
        changed("a\nb\na\n", Block("diff", "x.py", " a\n+c\n"))


def test_a_page_on_a_copy(tmp_path):
    page = Page(
        "example",
        (
            Block("python", "sinssim/added.py", "NAME = 'added'\n"),
            Block("diff", "sinssim/units.py", " from __future__ import annotations\n+EXTRA = 3.0\n"),
            Block("toml", "scenarios/added.toml", "name = 'added'\n"),
            Block("python", "", "import sinssim.added, sinssim.units\nprint(sinssim.added.NAME, sinssim.units.EXTRA)"),
        ),
    )
    copy = Copy(tmp_path)
    assert copy.touched == []
    copy.apply(page)
    assert copy.touched == ["sinssim/added.py", "sinssim/units.py"]
    assert copy.run(page.snippets[0]) == "added 3.0\n"
    assert "sinssim" in copy.command("--version")
    with pytest.raises(AssertionError, match="there already"):
        copy.apply(Page("again", page.blocks[:1]))
    with pytest.raises(AssertionError, match="ZeroDivisionError"):
        copy.run("1 / 0")


@pytest.mark.parametrize("path", sorted(PAGES.glob("*.md")), ids=lambda path: path.stem)
def test_every_page_is_read_and_run_by_a_test(path):
    assert read_page(path.stem).files, f"{path.name} marks no block of code with the path of a file"
    test = Path(__file__).with_name(f"test_{path.stem.replace('-', '_')}.py")
    assert test.exists(), f"{path.name} has no test {test.name}"
    assert re.search(rf"read_page\(\"{path.stem}\"\)", test.read_text(encoding="utf-8")), test.name
