"""The parts of pages that the site makes: complete, each in the place of its mark."""

from __future__ import annotations

import importlib

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
