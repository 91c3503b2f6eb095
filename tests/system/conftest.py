"""A project folder, and a registry that is empty again after each test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from sinssim import content
from sinssim.content import new_project
from sinssim.system.registries import forget


@pytest.fixture(autouse=True)
def _nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.delenv(content.VARIABLE, raising=False)
    forget()
    yield
    forget()
    content._of_packages.cache_clear()
    content.warn_once.cache_clear()


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The folder that `sinssim new` lays out."""
    new_project(tmp_path / "mine")
    return tmp_path / "mine"
