"""Named choices that several tables of a scenario share: gravity model, ellipsoid, frame, radii, vertical channel."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated

from pydantic import AfterValidator

from sinssim.algorithms import SCENARIO_ALGORITHMS
from sinssim.earth.models import ELLIPSOIDS, GRAVITY_MODELS
from sinssim.errors import unknown_name
from sinssim.frames import (
    CURVATURES,
    FRAMES,
    SLOW_QUANTITIES,
    VERTICALS,
)


def known_name(kind: str, names: Iterable[str]) -> Callable[[str], str]:
    """Return a validator that accepts only the given names and otherwise lists them."""

    def check(value: str) -> str:
        if value not in names:
            raise unknown_name(kind, value, names)
        return value

    return check


Gravity = Annotated[str, AfterValidator(known_name("gravity model", GRAVITY_MODELS))]
EllipsoidName = Annotated[str, AfterValidator(known_name("ellipsoid", ELLIPSOIDS))]
Algorithm = Annotated[str, AfterValidator(known_name("algorithm", SCENARIO_ALGORITHMS))]
Frame = Annotated[str, AfterValidator(known_name("frame", FRAMES))]
Curvature = Annotated[str, AfterValidator(known_name("curvature", CURVATURES))]
Vertical = Annotated[str, AfterValidator(known_name("vertical channel", VERTICALS))]
SlowQuantities = Annotated[str, AfterValidator(known_name("treatment of slow quantities", SLOW_QUANTITIES))]
