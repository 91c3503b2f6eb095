"""docs/architecture.md shows the package as it is."""

from __future__ import annotations

import re
from pathlib import Path

import sinssim
from tests.documentation.fences import script
from tests.test_architecture import LAYERS

ROOT = Path(__file__).parents[1]
PACKAGE = Path(sinssim.__file__).parent
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def test_the_tree_shows_every_folder_with_a_sentence() -> None:
    tree = script("architecture_tree")
    lines = tree.tree().splitlines()
    folders = [file.parent for file in PACKAGE.rglob("__init__.py") if "_content" not in file.parts]
    for folder in folders:
        sentence = tree.first_sentence(folder / "__init__.py")
        assert sentence, f"{folder.relative_to(PACKAGE)}/__init__.py needs a docstring"
        assert (
            any(re.match(rf" *{folder.name}/ +{re.escape(sentence[:20])}", line) for line in lines) or folder == PACKAGE
        )


def test_every_file_that_the_table_names_exists() -> None:
    table = PAGE.split("## To change X, touch Y")[1].split("## ")[0]
    named = {name for name in re.findall(r"`([\w/]+(?:\.py|/))`", table) if not name.startswith(("aircraft", "viz"))}
    assert len(named) > 60
    # a folder without its `__init__.py` may be left over from an earlier checkout
    exists = {
        name: (PACKAGE / name / "__init__.py" if name.endswith("/") else PACKAGE / name).is_file() for name in named
    }
    assert [name for name in sorted(named) if not exists[name]] == []


def test_every_page_of_extensions_is_linked() -> None:
    pages = {page.name for page in (ROOT / "docs" / "extending").glob("*.md")}
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert [name for name in sorted(pages) if f"extending/{name}" not in PAGE] == []
    assert [name for name in sorted(pages) if f"extending/{name}" not in guide] == []


def test_the_picture_shows_the_floors() -> None:
    """From the command line down to the ground, as the test of the imports has them."""
    picture = (ROOT / "docs" / "images" / "floors.svg").read_text(encoding="utf-8")
    words = re.findall(r'<text x="[\d.]+" y="([\d.]+)"[^>]*>([^<]*)<', picture)
    downwards = [word for _, word in sorted((float(y), word) for y, word in words) if word in LAYERS]
    assert downwards == LAYERS[::-1]
    assert "has sixteen rooms" in PAGE
    assert len(LAYERS) == 16
