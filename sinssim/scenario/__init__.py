"""Scenarios: the TOML description of a run, typed and checked, and the lookup of aircraft, scenarios and views."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.lazy import on_first_use

if TYPE_CHECKING:
    from sinssim.scenario.content import find_content, list_content
    from sinssim.scenario.load import load_scenario
    from sinssim.scenario.schema import Scenario

__all__ = ["Scenario", "find_content", "list_content", "load_scenario"]

__getattr__, __dir__ = on_first_use(
    __name__,
    {
        "Scenario": "sinssim.scenario.schema",
        "find_content": "sinssim.scenario.content",
        "list_content": "sinssim.scenario.content",
        "load_scenario": "sinssim.scenario.load",
    },
)
