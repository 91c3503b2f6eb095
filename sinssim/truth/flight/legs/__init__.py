"""The legs of a flight plan: a new leg is a file in this folder and a line here. See `docs/extending/leg.md`."""

from __future__ import annotations

from importlib import import_module

from sinssim.truth.flight.leg import LegBase

_FILES = (
    "takeoff",
    "parked",
    "taxi",
    "land",
    "hold",
    "altitude",
    "turn",
    "waypoint",
    "racetrack",
    "s_turns",
    "speed",
    "doublet",
    "loop",
    "barrel_roll",
)
"""The files of this folder, each with one leg, in the order of the scenario file's reference."""


def _leg_class(file: str) -> type[LegBase]:
    """Return the leg in a file of this folder."""
    module = import_module(f"{__name__}.{file}")
    legs = [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, LegBase) and value.__module__ == module.__name__
    ]
    if len(legs) != 1:
        raise TypeError(
            f"{module.__file__} has {len(legs)} subclasses of LegBase; the file of a leg must have exactly one."
        )
    return legs[0]


LEGS: tuple[type[LegBase], ...] = tuple(_leg_class(file) for file in _FILES)
"""The class of every leg."""
