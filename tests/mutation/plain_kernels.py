"""A pytest plugin: kernels run as plain Python.

A few hundred steps of an engine take a tenth of a second in Python, and half a minute to compile.
"""

from __future__ import annotations

from typing import Any

from sinssim import jit


def _plain(function: Any, **options: Any) -> Any:
    """Leave a kernel as it is written."""
    function.py_func, function.targetoptions = function, options  # what copies of kernels are made from
    return function


def pytest_configure() -> None:
    """Replace the compiler, before any module that holds a kernel is imported.

    Only where pytest loads this file as a plugin: a test that merely imports it must leave its own process compiled.
    """
    jit._jit = _plain
