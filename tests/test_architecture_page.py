"""docs/architecture.md shows the package as it is."""

from __future__ import annotations

import re
from pathlib import Path

import sinssim
from tests.test_architecture import LAYERS

ROOT = Path(__file__).parents[1]
PACKAGE = Path(sinssim.__file__).parent
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def tree() -> set[str]:
    """Return the folders and files of the package that the page's tree shows, relative to it."""
    block = PAGE.split("## The tree")[1].split("```")[1]
    shown: set[str] = set()
    above: list[str] = []
    for line in block.splitlines():
        if not line.strip() or not line.startswith("  "):
            continue  # the package's own line, and the folders beside it
        depth = (len(line) - len(line.lstrip())) // 2
        if depth > 4:
            continue
        names = re.match(r"[\w./ ]+?(?=   |$)", line.strip())
        assert names is not None, line
        for name in names.group().split():
            above[depth - 1 :] = [name.rstrip("/")]
            shown.add("/".join(above[:depth]))
    return shown


def test_every_folder_is_in_the_tree() -> None:
    folders = {
        folder.relative_to(PACKAGE).as_posix()
        for folder in PACKAGE.rglob("*")
        if folder.is_dir() and (folder / "__init__.py").is_file() and "_content" not in folder.parts
    }
    assert folders - tree() == set()


def test_everything_in_the_tree_exists() -> None:
    assert [name for name in tree() if not (PACKAGE / name).exists()] == []


def test_every_file_that_the_table_names_exists() -> None:
    table = PAGE.split("## To change X, touch Y")[1].split("## ")[0]
    named = {name for name in re.findall(r"`([\w/]+(?:\.py|/))`", table) if not name.startswith(("aircraft", "viz"))}
    assert len(named) > 20
    assert [name for name in sorted(named) if not (PACKAGE / name).exists()] == []


def test_every_page_of_extensions_is_linked() -> None:
    pages = {page.name for page in (ROOT / "docs" / "extending").glob("*.md")}
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert [name for name in sorted(pages) if f"extending/{name}" not in PAGE] == []
    assert [name for name in sorted(pages) if f"extending/{name}" not in guide] == []


def test_the_picture_shows_the_floors() -> None:
    """From the command line down to the ground, as the test of the imports has them."""
    picture = (ROOT / "docs" / "images" / "floors.svg").read_text(encoding="utf-8")
    words = re.findall(r"<text[^>]*>([^<]*)<", picture)
    assert [word for word in words if word in LAYERS] == LAYERS
    assert len(re.findall(r"\bsixteen\b", PAGE)) == 1 + (len(LAYERS) == 16)
