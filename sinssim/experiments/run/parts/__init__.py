"""What only some runs have: one file each, and this list of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sinssim.experiments.run.parts.gravity import TrueGravity
from sinssim.experiments.run.parts.log import Log
from sinssim.experiments.run.parts.outages import Outages
from sinssim.experiments.run.parts.phases import Phases
from sinssim.experiments.run.parts.platform import OnPlatform
from sinssim.experiments.run.parts.redundancy import Redundancy
from sinssim.experiments.run.parts.rotation import Rotation
from sinssim.experiments.run.parts.track import Track

if TYPE_CHECKING:
    from sinssim.experiments.run.part import Part
    from sinssim.simulation.navigation import Navigated

PARTS: tuple[type[Part], ...] = (Track, TrueGravity, Log, Redundancy, OnPlatform, Rotation, Phases, Outages)
"""The parts in the order of their entries in `summary.json`."""


def parts_of(run: Navigated) -> dict[str, Part]:
    """Return the parts that a run has, by name."""
    return {kind.name: kind(run) for kind in PARTS if kind.belongs_to(run)}
