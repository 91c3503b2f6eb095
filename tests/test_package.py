"""The package's top level: every public name is there, whatever was imported before it, and importing it is light."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys

import pytest

import sinssim


@pytest.mark.parametrize("name", sinssim.__all__)
def test_public_name(name: str) -> None:
    value = getattr(sinssim, name)
    assert value.__doc__
    assert name in dir(sinssim)


@pytest.mark.parametrize("below", ["", ".alignment", ".earth", ".estimation", ".rotation", ".sensors", ".truth"])
def test_no_module_hides_a_public_name(below: str) -> None:
    """Importing a submodule sets an attribute of its name on the package: it must not be that of a function."""
    package = importlib.import_module(f"sinssim{below}")
    modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
    assert not modules & set(package.__all__)


def test_unknown_name() -> None:
    with pytest.raises(AttributeError, match="module 'sinssim' has no attribute 'nonsense'"):
        sinssim.nonsense  # noqa: B018


def test_names_are_those_of_their_homes() -> None:
    assert sinssim.run is importlib.import_module("sinssim.experiments.run.run_execution").run
    assert sinssim.navigate is importlib.import_module("sinssim.strapdown.navigate").navigate
    assert sinssim.fly is importlib.import_module("sinssim.scenario.true_motion").fly


def test_import_is_light() -> None:
    code = "import sys, sinssim; print([m for m in ('numpy', 'numba', 'pydantic', 'rerun') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
