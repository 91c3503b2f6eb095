"""Scenarios: the TOML description of a run, typed and checked, and the lookup of aircraft, scenarios and views."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.system import on_first_use

if TYPE_CHECKING:
    from sinssim.content import find_content as find_content
    from sinssim.content import list_content as list_content
    from sinssim.scenario.load import load_scenario as load_scenario
    from sinssim.scenario.schema import Scenario as Scenario

__getattr__, __dir__, __all__ = on_first_use(__name__)
