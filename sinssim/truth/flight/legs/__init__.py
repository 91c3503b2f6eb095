"""The legs of a flight plan: a new leg is a file in this folder and a line here. See `docs/extending/leg.md`."""

from __future__ import annotations

from importlib import import_module

from sinssim.truth.flight.leg import LegBase

_FILES = (
    "ground",
    "landing",
    "straight",
    "turns",
    "waypoint",
    "manoeuvres",
)
"""The files of this folder, each with one leg or a family of legs, in the order of the scenario file's reference."""


def _leg_classes(file: str) -> list[type[LegBase]]:
    """Return the legs in a file of this folder, in the order of their definition."""
    module = import_module(f"{__name__}.{file}")
    legs = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, LegBase) and value.__module__ == module.__name__
    ]
    if not legs:
        raise TypeError(f"{module.__file__} has no subclass of LegBase; the file of a leg must have at least one.")
    return legs


LEGS: tuple[type[LegBase], ...] = tuple(leg for file in _FILES for leg in _leg_classes(file))
"""The class of every leg."""
