"""Every link of the pages leads to a file and a heading, the site shows every table and list, and holds every page."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.documentation.fences import PAGES, ROOT, blocks, name

_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


@cache
def _without_code(page: Path) -> str:
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]+`", "", text)


@cache
def _anchors(page: Path) -> set[str]:
    """Return the anchors of the headings, as Git hosts and the site make them."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE):
        words = re.sub(r"[^\w\- ]", "", heading.strip().lower())
        found.add(words.replace(" ", "-"))
    return found


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in _LINK.findall(_without_code(page)):
        if link.startswith("https://"):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.is_file(), f"{name(page)}: {link}"
        assert target.is_relative_to(ROOT), f"{name(page)}: {link}"
        if anchor:
            assert anchor in _anchors(target), f"{name(page)}: {link}"


_BLOCK = re.compile(r"^(?!\||[-#\s]|\d+\. ).+\n(\||- |1\. )", re.MULTILINE)
"""A line of a paragraph, and after it the first line of a table or a list."""


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_tables_and_lists_begin_after_an_empty_line(page: Path) -> None:
    """The site takes them for a part of the paragraph otherwise; Git hosts do not."""
    assert [match[0] for match in _BLOCK.finditer(_without_code(page))] == []


_PATH = re.compile(r"`([\w.-]+(?:/[\w.-]+)*(?:/|\.py|\.md|\.toml))`")
_WRITTEN = ("runs/", "build/", "my_", "aiding/", "aircraft/", "algorithms/", "formats/", "frames/", "views/")
"""Folders that a command makes, and those of a project."""


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_paths_in_the_text_exist(page: Path) -> None:
    """Files of the checkout, or of the package without `sinssim/`; one that the page itself makes in a block, too."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    paths = {path for path in _PATH.findall(text) if "/" in path.rstrip("/") and not path.startswith(_WRITTEN)}
    paths |= {path.rstrip(".") for path in re.findall(r"\btests/[\w./-]+", text)}
    places = (ROOT, ROOT / "sinssim", page.parent)
    missing = sorted(path for path in paths if not any((place / path).exists() for place in places))
    assert [path for path in missing if path not in {block.path for block in blocks(page)}] == []


def test_navigation_names_pages_that_exist() -> None:
    """Each once; two lie above the folder, and the site lists a page that is not named below the how-to pages."""
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    listed = re.findall(r"([\w./-]+\.md)$", navigation, re.MULTILINE)
    assert len(listed) == len(set(listed)) > 40
    assert {page for page in listed if not (ROOT / "docs" / page).is_file()} == {"contributing.md", "changelog.md"}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_no_page_needs_another_server(page: Path) -> None:
    """Pictures, styles and scripts are files of the project."""
    text = _without_code(page)
    assert not re.search(r"!\[[^\]]*\]\(https?:", text)
    assert not re.search(r"<(?:img|script|link|iframe)\b", text)


def test_pictures_are_shown_and_small() -> None:
    shown = {
        (page.parent / link).resolve()
        for page in PAGES
        for link in _LINK.findall(_without_code(page))
        if re.search(r"\.(?:png|svg)$", link)
    }
    answers = (ROOT / "docs" / "questions.py").read_text(encoding="utf-8")
    shown |= {ROOT / "docs" / link for link in _LINK.findall(answers)}
    pictures = {path.resolve() for path in (ROOT / "docs" / "images").rglob("*.*")}
    assert pictures <= shown, sorted(path.name for path in pictures - shown)
    for path in (ROOT / "docs" / "images" / "gallery").iterdir():
        assert path.stat().st_size <= 150_000, path.name


_CITED = re.compile(
    r"[Gg]round[- ]SINS|[Ss]trapdown chapter|[Tt]he chapter\b|[Cc]hapter's|[Cc]hapter 8\b|[Ee]q(?:uation|s?\.) \(\d"
)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_pages_that_cite_a_source_link_to_it(page: Path) -> None:
    """The two documents are introduced on one page, to which the others link."""
    if page.name == "sources.md" or "2004, chapter 8" in page.read_text(encoding="utf-8"):
        return  # another book has a chapter 8, too
    cited = _CITED.findall(_without_code(page))
    assert not cited or "sources.md" in page.read_text(encoding="utf-8"), f"{name(page)} cites {sorted(set(cited))}"
