"""Named choices that several tables of a scenario share: ellipsoid, frame, radii, vertical channel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from sinssim.algorithms import SCENARIO_ALGORITHMS
from sinssim.earth.models import ELLIPSOIDS
from sinssim.frames import (
    CURVATURES,
    FRAMES,
    OF_TRUTH,
    SLOW_QUANTITIES,
    VERTICALS,
)
from sinssim.section import Rate, known_name
from sinssim.system.own_content.registry import ensure


def _own_too(kind: str) -> Callable[[str], str]:
    """Return a validator that registers own content that a name means, if there is any outside the scenario."""

    def look_up(value: str) -> str:
        ensure(kind, value)
        return value

    return look_up


def _three_of_two(rates: Any) -> Any:
    """Return the three rates of a list of two, in which velocity and position have the same."""
    if not isinstance(rates, list | tuple):
        return rates
    if len(rates) not in (2, 3):
        raise ValueError(
            f"must have three rates, of the fast, medium and slow part, or two, of attitude and of velocity and "
            f"position; it has {len(rates)}"
        )
    return (*rates, rates[1]) if len(rates) == 2 else rates


Schedule = Annotated[tuple[Rate, Rate, Rate], BeforeValidator(_three_of_two)]
"""Fast, medium and slow rate, Hz; two are those of attitude, and of velocity and position."""
OwnEllipsoid = Annotated[str, AfterValidator(known_name("ellipsoid", (OF_TRUTH, *ELLIPSOIDS)))]
"""The navigator's ellipsoid: by name, or that of the truth."""
Algorithm = Annotated[
    str, AfterValidator(_own_too("algorithms")), AfterValidator(known_name("algorithm", SCENARIO_ALGORITHMS))
]
"""An attitude algorithm, of sinssim or of the user."""
Frame = Annotated[str, AfterValidator(_own_too("frames")), AfterValidator(known_name("frame", FRAMES))]
"""A navigation frame, of sinssim or of the user."""
Curvature = Annotated[str, AfterValidator(known_name("curvature", CURVATURES))]
Vertical = Annotated[str, AfterValidator(known_name("vertical channel", VERTICALS))]
SlowQuantities = Annotated[str, AfterValidator(known_name("treatment of slow quantities", SLOW_QUANTITIES))]
