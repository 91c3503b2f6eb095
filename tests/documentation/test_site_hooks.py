"""The site's reference names every public function and class, at the module that defines it."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

import pytest

from tests.documentation.fences import ROOT


def hooks() -> Any:
    spec = importlib.util.spec_from_file_location("site_hooks", ROOT / "docs" / "site_hooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


HOOKS = hooks()


@pytest.mark.parametrize("package", HOOKS.PACKAGES)
def test_every_public_name_is_found_where_it_is_defined(package: str) -> None:
    found = HOOKS.public_names(package)
    assert set(found) == set(importlib.import_module(package).__all__)
    for name, module in found.items():
        assert getattr(importlib.import_module(module), name) is getattr(importlib.import_module(package), name)
