"""The legs of a flight plan: one file for each family of legs, or a user's file outside the package.

A new leg is a class in a file of this folder, see `docs/extending/leg.md`.
"""

from __future__ import annotations

from importlib import import_module
from typing import get_args

from sinssim.system.extensions import classes_in
from sinssim.system.registries import Registry
from sinssim.truth.flight.leg import LegBase

_FILES = ("ground", "landing", "straight", "turns", "waypoint", "manoeuvres")
"""The files of this folder, each with one leg or a family of legs, in the order of the scenario file's reference."""


def _leg_classes(file: str) -> list[type[LegBase]]:
    """Return the legs in a file of this folder, in the order of their definition."""
    module = import_module(f"{__name__}.{file}")
    legs: list[type[LegBase]] = classes_in(module, LegBase)
    if not legs:
        raise TypeError(f"{module.__file__} has no subclass of LegBase; the file of a leg must have at least one.")
    return legs


LEGS: tuple[type[LegBase], ...] = tuple(leg for file in _FILES for leg in _leg_classes(file))
"""The class of every leg of the package."""

REGISTRY: Registry[type[LegBase]] = Registry(
    "legs", "leg", {name: leg for leg in LEGS for name in get_args(leg.model_fields["type"].annotation)}
)
"""The legs of the package by `type`."""
