"""What only some runs have: one file each, and this list of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.experiments.run.parts.further_solutions import FurtherFilters, Navigators
from sinssim.experiments.run.parts.guided_flight import Guidance, OffPath
from sinssim.experiments.run.parts.imu_mounting import OnPlatform, Rotation
from sinssim.experiments.run.parts.judged_outages import Outages
from sinssim.experiments.run.parts.motion_source import Log, Track, TrueGravity
from sinssim.experiments.run.parts.phases import Phases
from sinssim.experiments.run.parts.redundancy import Redundancy

if TYPE_CHECKING:
    from sinssim.experiments.run.run_result import Part
    from sinssim.simulation.navigation_stage import Navigated

PARTS: tuple[type[Part[object]], ...] = (
    Track, TrueGravity, Guidance, OffPath, Navigators, FurtherFilters, Log, Redundancy, OnPlatform, Rotation, Phases,
    Outages,
)  # fmt: skip
"""The parts in the order of their entries in `summary.json`."""


def parts_of(run: Navigated) -> dict[str, Part[object]]:
    """Return the parts that a run has, by name."""
    return {kind.name: kind(run) for kind in PARTS if kind.belongs_to(run)}
