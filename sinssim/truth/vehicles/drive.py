"""A land vehicle, the table [drive]: the roughness of the road, and the suspension of the body."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.truth.vehicles.profile import Course
from sinssim.truth.vehicles.response import respond
from sinssim.truth.vehicles.surface_vehicle import Body, SurfaceVehicle
from sinssim.units import DEG

_Damping = Annotated[float, Field(gt=0.0, lt=1.0)]

ROADS = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
"""Classes of roads by ISO 8608: geometric mean of the spectral density of the height at 0.1 cycles/m, m³."""

_FASTEST = 0.35
"""Largest frequency with which the road moves the wheels, in units of the knots' rate."""


class Drive(SurfaceVehicle):
    """A land vehicle: legs on a level road, the roughness of the road, and the suspension of the body. The road has the
    spectral density of ISO 8608, G(n) = G(0.1)·(n/0.1)⁻² for wave numbers n of 0.011 to 2.83 cycles/m. The left and the
    right wheels follow the same profile, so the roughness causes heave and pitch. The body rolls in turns.
    """

    table: ClassVar[str] = "drive"
    knot_rate: ClassVar[float] = 100.0
    height_channel: ClassVar[str] = "road_height_m"

    road: Literal["smooth", "A", "B", "C", "D", "E"] = Field(
        default="B", description="road class of ISO 8608, or smooth"
    )
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.0, description="mean acceleration and braking"
    )
    lateral_mps2: Annotated[float, Field(gt=0.0, le=10.0)] = Field(
        default=1.5, description="lateral acceleration in turns for which no rate is given"
    )
    wheelbase_m: Annotated[float, Field(ge=0.5, le=30.0)] = Field(default=2.7, description="distance between the axles")
    suspension_hz: Annotated[float, Field(ge=0.3, le=10.0)] = Field(
        default=1.3, description="natural frequency of the body on its suspension, heave and pitch"
    )
    suspension_damping: _Damping = Field(default=0.3, description="damping ratio of the suspension")
    roll_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.5, description="outward roll in turns per lateral acceleration"
    )
    pitch_deg_per_mps2: Annotated[float, Field(ge=0.0, le=5.0)] = Field(
        default=0.3, description="pitch per acceleration, nose up positive"
    )

    def body(self, course: Course, time: Array, north: Array, east: Array, seed: int) -> tuple[Body, Array]:
        """Return the motion of the body; see `SurfaceVehicle.body`."""
        step = float(time[1] - time[0])
        f, damping = self.suspension_hz, self.suspension_damping
        lateral = course.speed * course.rate
        roll = respond(-self.roll_deg_per_mps2 * DEG * lateral, step, f, damping, on_carrier=False)
        pitch = respond(self.pitch_deg_per_mps2 * DEG * course.acceleration, step, f, damping, on_carrier=False)
        none = np.zeros(len(course.way))
        if self.road == "smooth":
            return Body(none, none, none, roll, pitch), none
        from scipy.interpolate import CubicSpline

        from sinssim.truth.vehicles import road  # needs the compiler

        highest = min(road.HIGHEST, _FASTEST / step / max(float(course.speed.max()), 1e-9))
        length = float(course.way.max()) + 2.0 * self.wheelbase_m
        heights = road.heights(length, ROADS[self.road], highest, seed)
        surface = CubicSpline(road.STEP * np.arange(len(heights)), heights)
        rear = surface(course.way)
        front = surface(course.way + self.wheelbase_m)
        up = respond(0.5 * (front + rear), step, f, damping, on_carrier=True)
        pitch += respond((front - rear) / self.wheelbase_m, step, f, damping, on_carrier=True)
        return Body(none, none, up, roll, pitch), 0.5 * (front + rear)
