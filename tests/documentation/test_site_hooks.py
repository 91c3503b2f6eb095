"""The site's reference names every public function and class, at the module that defines it."""

from __future__ import annotations

import importlib

import pytest

from tests.documentation.fences import script

HOOKS = script("site_hooks")


@pytest.mark.parametrize("package", HOOKS.PACKAGES)
def test_every_public_name_is_found_where_it_is_defined(package: str) -> None:
    found = HOOKS.public_names(package)
    assert set(found) == set(importlib.import_module(package).__all__)
    for name, module in found.items():
        assert getattr(importlib.import_module(module), name) is getattr(importlib.import_module(package), name)
