"""Assumptions about a vehicle whose attitude was not recorded, and the limits of its motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

VehicleName = Literal["aircraft", "land", "sea"]
Pitch = Literal["slope", "flat"]


@dataclass(frozen=True)
class Vehicle:
    """Assumptions about a kind of vehicle.

    Attributes:
        name: name in scenario files.
        pitch: "slope": the nose points along the path in the vertical plane; "flat": it stays level.
        banks: whether it rolls so that the lateral specific force is zero; otherwise it does not roll.
        standstill: ground speed below which the course is no heading, m/s.
        spot_turn: largest rate at which the heading goes over from one held at a standstill to a new course, rad/s.
        knots: largest spacing of the knots of a curve whose attitude follows from its motion, s.
        most_speed: mean speed between two samples that is refused as a jump, m/s.
        odd_acceleration: acceleration of which a person is warned, m/s².
        odd_turn: angular rate of which a person is warned, rad/s.
        odd_pitch: pitch from climb of which a person is warned, rad.
        acceleration: default acceleration along a planned route, m/s².
        ramp: time in which the curvature of a planned route's corner is built up, s.
        lateral: lateral acceleration in a planned route's corner by default, m/s².
    """

    name: VehicleName
    pitch: Pitch
    banks: bool
    standstill: float
    spot_turn: float
    knots: float
    most_speed: float
    odd_acceleration: float
    odd_turn: float
    odd_pitch: float
    acceleration: float
    ramp: float
    lateral: float


VEHICLES: dict[str, Vehicle] = {
    "aircraft": Vehicle("aircraft", "slope", True, 3.0, 0.5, 0.1, 1500.0, 100.0, 4.0, 1.0, 1.0, 5.0, 4.57),
    "land": Vehicle("land", "slope", False, 1.0, 0.8, 0.1, 150.0, 15.0, 2.0, 0.27, 1.0, 1.5, 2.0),
    "sea": Vehicle("sea", "flat", False, 0.5, 0.1, 0.25, 60.0, 5.0, 0.5, 0.35, 0.05, 10.0, 0.2),
}
"""Vehicles by name. An aircraft's lateral acceleration is that of 25° of bank."""
