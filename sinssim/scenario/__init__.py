"""Scenarios: the TOML description of a run, typed and checked, and the lookup of aircraft, scenarios and views."""

from __future__ import annotations

from sinssim.scenario.content import find_content, list_content
from sinssim.scenario.load import load_scenario
from sinssim.scenario.schema import Scenario

__all__ = ["Scenario", "find_content", "list_content", "load_scenario"]
