"""What every leg of a flight plan has in common: its keys, its check, its dead reckoning and its flying.

A leg is one class in a file of its own under `sinssim/truth/flight/legs/`; `docs/extending/leg.md` adds one.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from sinssim.section import Section, Timeout
from sinssim.truth.flight.aircraft import Performance
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.dead_reckoning import DeadReckoning

Bank = Annotated[float, Field(gt=0.0, le=80.0)]
"""Angle of bank, degrees, without sign: the direction says which way."""

Altitude = Annotated[float, Field(ge=-430.0, le=20_000.0)]
"""Height above the ellipsoid, m; from the Dead Sea's shore to above any of these aircraft."""

Airspeed = Annotated[float, Field(ge=40.0, le=800.0)]
"""Calibrated airspeed, kt."""

Direction = Literal["left", "right"]

HALF_STEP = 0.5 * INTERVAL
"""Half of the autopilot's step: an instant of the flight counts as reached this much before it [s]."""


class LegError(Exception):
    """A leg that cannot be flown.

    Attributes:
        reason: why not.
        remedy: what would be right.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        """Take reason and remedy."""
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


class LegBase(Section):
    """One leg of a flight plan.

    A subclass adds its keys, among them `type: Literal[...]`, by which a scenario chooses it.

    Attributes:
        timeout_s: the leg fails if it is not flown within this time, s.
        type: the leg's name in a scenario.
        example: keys of a valid leg without `type`, for the reference of the scenario file.
        begins, ends: where the aircraft is at the leg's begin and end.
        stands_still: whether the aircraft stands still all the time, so that its model need not be stepped.
    """

    example: ClassVar[dict[str, Any]] = {}
    begins: ClassVar[Literal["runway", "air"]] = "air"
    ends: ClassVar[Literal["runway", "air"]] = "air"
    stands_still: ClassVar[bool] = False

    timeout_s: Timeout = Field(default=1800.0, description="the leg fails if it takes longer")
    type: str

    def end_height(self, height: float) -> float:
        """Return the height at which the leg ends; part of the check of a plan before it is flown.

        Args:
            height: at which the leg begins, above the ellipsoid, m.

        Returns:
            Height above the ellipsoid, m; the same unless a subclass says otherwise.

        Raises:
            ValueError: the leg cannot begin at that height; the message continues "leg 3 (climb) ...".
        """
        return height

    @abstractmethod
    def reckon(self, plan: DeadReckoning) -> float:
        """Bring the dead reckoning of a plan to the leg's end, without flying.

        Args:
            plan: where the leg begins; updated in place, except for the time.

        Returns:
            Estimated duration, s; infinite if the wind keeps the leg's end out of reach.
        """

    @abstractmethod
    def fly(self, pilot: Autopilot, state: AircraftState, performance: Performance) -> Iterator[None]:
        """Fly the leg: set the autopilot's targets, and yield once for every step until the leg is flown.

        The caller watches the time limit, the ground and the stall.

        Args:
            pilot: the autopilot whose targets are set.
            state: the aircraft's state, refreshed between steps.
            performance: what a pilot of the type flies by.

        Yields:
            Nothing, once for every step of `INTERVAL`.

        Raises:
            LegError: the leg cannot be flown.
        """


def wait(state: AircraftState, until: float) -> Iterator[None]:
    """Let the autopilot hold its targets until an instant of the flight.

    Args:
        state: the aircraft's state.
        until: time since the start of the flight, s.

    Yields:
        Nothing, once for every step.
    """
    until -= HALF_STEP
    while state.time < until:
        yield
