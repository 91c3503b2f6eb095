"""The base class of the legs of a flight plan: keys, check, dead reckoning and flying.

A leg is one class in its own file under `sinssim/truth/flight/legs/`; `docs/extending/leg.md` adds one.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from sinssim.errors import InputError
from sinssim.section import Section, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning

Bank = Annotated[float, Field(gt=0.0, le=80.0)]
"""Angle of bank, degrees, without sign; the key direction gives the side."""

Altitude = Annotated[float, Field(ge=-430.0, le=20_000.0)]
"""Height above the ellipsoid, m; from the shore of the Dead Sea to above the ceiling of any of these aircraft."""

Airspeed = Annotated[float, Field(ge=40.0, le=800.0)]
"""Calibrated airspeed, kt."""

Direction = Literal["left", "right"]

HALF_STEP = 0.5 * INTERVAL
"""Half of the autopilot's step: an instant of the flight counts as reached this long before it [s]."""


class LegError(Exception):
    """Raised by a leg that cannot be flown.

    Attributes:
        reason: the reason.
        remedy: a change of the plan that would help.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        """Store reason and remedy."""
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


class LegBase(Section):
    """One leg of a flight plan.

    A subclass adds its keys, among them `type: Literal[...]`, by which a scenario selects it.

    Attributes:
        timeout_s: time within which the leg must be flown, s.
        type: the leg's name in a scenario.
        example: keys of a valid leg without `type`, for the reference of the scenario file.
        begins, ends: whether the aircraft is on the runway or in the air at the beginning and the end.
        stands_still: whether the leg may hold the aircraft still (`Autopilot.standing`); its model is then not stepped.
        lands: whether the aircraft needs what a landing takes, see `Performance.approach_kt`.
        holds: what the aircraft has at the end of the leg: "height", "airspeed" and "heading" of the autopilot.
    """

    example: ClassVar[dict[str, Any]] = {}
    begins: ClassVar[Literal["runway", "air"]] = "air"
    ends: ClassVar[Literal["runway", "air"]] = "air"
    stands_still: ClassVar[bool] = False
    lands: ClassVar[bool] = False
    holds: ClassVar[frozenset[str]] = frozenset({"height", "airspeed", "heading"})

    timeout_s: Timeout = Field(default=1800.0, description="the leg fails if it takes longer")
    type: str

    def end_height(self, height: float) -> float:
        """Return the height at the end of the leg, for the check of a plan before flying.

        Args:
            height: height above the ellipsoid at the beginning, m.

        Returns:
            Height above the ellipsoid, m; by default the same.

        Raises:
            ValueError: the leg cannot begin at that height; the message continues "leg 3 (climb) ...".
        """
        return height

    @abstractmethod
    def reckon(self, plan: DeadReckoning) -> float:
        """Advance the dead reckoning of a plan to the end of the leg.

        Args:
            plan: state at the beginning of the leg; updated in place, except for the time.

        Returns:
            Estimated duration, s; infinite if the wind makes the end of the leg unreachable.
        """

    @abstractmethod
    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Fly the leg: set the autopilot's targets, and yield once per step until the leg is flown.

        The caller monitors the time limit, ground contact and stall.

        Args:
            state: the aircraft's state, refreshed between steps.
            performance: usual speeds, limits and settings of the type.

        Yields:
            None, once per step of `INTERVAL`.

        Raises:
            LegError: the leg cannot be flown.
        """


def wait(state: AircraftState, until: float) -> Iterator[None]:
    """Let the autopilot hold its targets until an instant of the flight.

    Args:
        state: the aircraft's state.
        until: time since the start of the flight, s.

    Yields:
        None, once per step.
    """
    until -= HALF_STEP
    while state.time < until:
        yield


def check_landing(legs: Sequence[LegBase], aircraft: str, performance: Performance) -> None:
    """Raise for a landing of an aircraft whose description does not say how it lands.

    Raises:
        InputError: a leg lands, and the aircraft has no approach_kt.
    """
    for number, leg in enumerate(legs, start=1):
        if leg.lands and performance.approach_kt is None:
            raise InputError(
                f"flight.legs.{number} ({leg.type}): the aircraft {aircraft} cannot land, because its aircraft.toml "
                "has no performance.approach_kt; give it, with landing_flaps and standing_height_m."
            )
