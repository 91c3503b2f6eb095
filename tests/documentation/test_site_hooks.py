"""The parts of pages that the site makes: complete, each in the place of its mark."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.documentation.fences import ROOT, script

HOOKS = script("site_hooks")


@pytest.mark.parametrize("package", HOOKS.PACKAGES)
def test_every_public_name_is_found_where_it_is_defined(package: str) -> None:
    found = HOOKS.public_names(package)
    assert set(found) == set(importlib.import_module(package).__all__)
    for name, module in found.items():
        assert getattr(importlib.import_module(module), name) is getattr(importlib.import_module(package), name)


@pytest.mark.parametrize("page", HOOKS.MARKS)
def test_every_mark_stands_in_its_page(page: str) -> None:
    mark, _ = HOOKS.MARKS[page]
    assert (ROOT / "docs" / page).read_text(encoding="utf-8").count(mark) == 1


def test_table_of_public_logs() -> None:
    rows = HOOKS.public_logs().splitlines()
    assert {row.count(" | ") for row in rows[2:]} == {4}
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    right = sum("**wrong**" not in row for row in rows[2:])
    assert f"known for {right} of the {len(rows) - 2} logs" in page.replace("\n", " ")


@pytest.mark.parametrize(("name", "weight"), [("estimation.md", None), ("logs.md", 2), ("reference.md", 0.2)])
def test_the_search_finds_a_page_that_explains_before_the_reference(name: str, weight: float | None) -> None:
    """With these weights "datasheet", "sweep", "tune", "my own log" and "requirement" find the page that answers."""
    page = SimpleNamespace(file=SimpleNamespace(src_uri=name), meta={})
    HOOKS.on_page_markdown("# A page", page=page)
    assert page.meta == ({} if weight is None else {"search": {"boost": weight}})


def test_pages_show_live_reports_in_place_of_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Six pages have a report in a frame, nine pictures of the gallery open one; without reports, nothing changes."""
    texts = {name: (ROOT / "docs" / name).read_text(encoding="utf-8") for name in (*HOOKS.SHOWN, "gallery.md")}
    monkeypatch.setattr(HOOKS, "REPORTS", tmp_path)
    assert all(HOOKS.with_reports(text, name) == text for name, text in texts.items())
    reports = script("gallery").REPORTS
    assert {*HOOKS.OPENED.values(), *(report for _, report in HOOKS.SHOWN.values())} == set(reports)
    for name in reports:
        (tmp_path / f"{name}.html").write_text("x" * 1_250_000)
    for name, (picture, report) in HOOKS.SHOWN.items():
        page = HOOKS.with_reports(texts[name], name)
        assert page.count(f'src="reports/{report}.html"') == 1, name
        assert f"]({picture})" not in page
        assert f"(reports/{report}.html), 1.2 MB" in page
    gallery = HOOKS.with_reports(texts["gallery.md"], "gallery.md")
    assert gallery.count("A click opens its report, 1.2 MB.") == len(HOOKS.OPENED) == 9
    assert (
        "[![Errors of perfect sensors over the Himalaya](images/gallery/gravity.png)](reports/gravity_disturbance.html)"
        in gallery
    )
