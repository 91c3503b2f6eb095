"""The command line: the commands in `commands/`, the terminal, and the process around both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.__main__ import program as program
    from sinssim.cli.app import main as main

__getattr__, __dir__, __all__ = on_first_use(__name__)
