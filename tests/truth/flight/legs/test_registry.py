"""Every file of a leg has its line in the registry, and every leg is complete."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from sinssim.truth.flight import legs
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.leg import LegBase

FOLDER = Path(legs.__file__).parent
AIR = {"on": "air", "latitude_deg": 50.0, "longitude_deg": 10.0, "altitude_m": 3000.0}
RUNWAY = {"on": "runway", "latitude_deg": 50.0, "longitude_deg": 10.0}


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.py")), ids=lambda file: file.stem)
def test_every_file_is_in_the_registry(file: Path) -> None:
    assert file.stem == "__init__" or file.stem in legs._FILES, f"{file}: its line in {legs.__file__} is missing"


def test_every_type_is_there_once() -> None:
    types = [name for leg in legs.LEGS for name in get_args(leg.model_fields["type"].annotation)]
    assert sorted(types) == sorted(legs.REGISTRY)
    assert len(types) == 17  # several classes have two names


@pytest.mark.parametrize("leg", legs.LEGS, ids=lambda leg: leg.__name__)
def test_the_example_of_every_leg_is_valid(leg: type[LegBase]) -> None:
    for name in get_args(leg.model_fields["type"].annotation):
        start = {**(RUNWAY if leg.begins == "runway" else AIR)}
        example = dict(leg.example)
        if name == "descend":
            example["altitude_m"] = 2000.0
        plan = {"aircraft": "737", "start": start, "legs": [{"type": name, **example}]}
        assert isinstance(FlightPlan.model_validate(plan).legs[0], leg)


def test_a_file_without_a_leg_is_named() -> None:
    import sys
    import types

    empty = types.ModuleType("sinssim.truth.flight.legs.empty")
    empty.__file__ = "/somewhere/legs/empty.py"
    sys.modules[empty.__name__] = empty
    try:
        with pytest.raises(TypeError, match=r"/somewhere/legs/empty\.py has no subclass of LegBase"):
            legs._leg_classes("empty")
    finally:
        del sys.modules[empty.__name__]
