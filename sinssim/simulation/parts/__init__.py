"""What only some runs have: one file each, and this list of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.simulation.parts.gravity import TrueGravity
from sinssim.simulation.parts.log import Log
from sinssim.simulation.parts.outages import Outages
from sinssim.simulation.parts.phases import Phases
from sinssim.simulation.parts.platform import OnPlatform
from sinssim.simulation.parts.redundancy import Redundancy
from sinssim.simulation.parts.rotation import Rotation
from sinssim.simulation.parts.track import Track

if TYPE_CHECKING:
    from sinssim.simulation.navigation import Navigated
    from sinssim.simulation.part import Part

PARTS: tuple[type[Part], ...] = (Track, TrueGravity, Log, Redundancy, OnPlatform, Rotation, Phases, Outages)
"""The parts in the order of their entries in `summary.json`."""


def parts_of(run: Navigated) -> dict[str, Part]:
    """Return the parts that a run has, by name."""
    return {kind.name: kind(run) for kind in PARTS if kind.belongs_to(run)}
