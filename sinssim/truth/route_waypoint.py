"""A waypoint of a planned route, and its rounded corner: a plane curve of continuous curvature between straight lines.

The curvature rises from zero along a ramp, stays at 1/R, and falls along a second ramp. The ramps are smooth steps of
degree 7, so that the curve is five times continuously differentiable and joins its tangents without a step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, pi
from typing import Annotated

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import Height, Keys, Latitude, Longitude, Section

_Distance = Annotated[float, Field(gt=0.0, le=1e6)]
_Seconds = Annotated[float, Field(ge=0.0, le=1e9)]


class Waypoint(Section):
    """A waypoint of a planned route; the route turns there with continuous curvature."""

    at_most_one = (Keys(("turn_radius_m", "bank_deg"), "the radius of the turn"),)

    name: str = Field(default="", max_length=60, description="name in events and messages")
    latitude_deg: Latitude = Field(description="latitude")
    longitude_deg: Longitude = Field(description="longitude")
    height_m: Height = Field(
        default=0.0, description="height above the ellipsoid; it changes smoothly from one waypoint to the next"
    )
    speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None, description="ground speed from this waypoint on; default: that of the previous waypoint"
    )
    turn_radius_m: _Distance | None = Field(
        default=None,
        description="smallest radius of the turn at this waypoint; default: from bank_deg, or the usual "
        "radius of the vehicle",
    )
    bank_deg: Annotated[float, Field(gt=0.0, le=80.0)] | None = Field(
        default=None, description="bank angle that determines the radius v²/(g tan(bank))"
    )
    stop_s: _Seconds = Field(
        default=0.0, description="time at rest at this waypoint, after braking and before accelerating"
    )


_RAMP_PANELS, _ARC_PANEL, _POINTS = 24, 0.05, 6
"""Gauss-Legendre quadrature of cos ψ and sin ψ: panels of a ramp, turn in a panel of the arc, points of a panel."""


def integrated_step7(x: Array) -> Array:
    """Return the integral from 0 to x of 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷, which goes from 0 to 1 with three vanishing
    derivatives at both ends: 1/2 at 1, and x − 1/2 beyond."""
    inner = np.clip(x, 0.0, 1.0)
    return np.asarray(inner**5 * (7.0 + inner * (-14.0 + inner * (10.0 - 2.5 * inner))) + np.maximum(x - 1.0, 0.0))


@dataclass(frozen=True)
class Corner:
    """A corner that turns by an angle."""

    angle: float  # turn, right positive, |angle| < π, rad
    radius: float  # least radius, m
    ramp: float  # length of each ramp, m; shorter where the whole turn is

    @cached_property
    def ramp_length(self) -> float:
        """Length of each ramp, m."""
        return min(self.ramp, abs(self.angle) * self.radius)

    @cached_property
    def length(self) -> float:
        """Length of the corner, m: each ramp turns by half of what an arc of its length does."""
        return abs(self.angle) * self.radius + self.ramp_length

    @cached_property
    def tangent(self) -> float:
        """Distance from the corner's ends to the intersection of its tangents, m."""
        x, y = self._end
        # the end lies at (T + T cos α, T sin α) in the axes of the first tangent
        return hypot(x, y) / (2.0 * cos(0.5 * self.angle))

    @cached_property
    def edges(self) -> Array:
        """Distances from the beginning between which the curvature is smooth and changes little, m."""
        ramp = self.ramp_length
        rise = ramp * np.arange(_RAMP_PANELS + 1) / _RAMP_PANELS
        arc = self.length - 2.0 * ramp
        count = int(np.ceil(arc / self.radius / _ARC_PANEL)) if arc > 1e-9 * self.length else 0
        flat = ramp + arc * np.arange(1, count + 1) / max(count, 1)
        return np.concatenate([rise, flat[:-1], self.length - rise[::-1][0 if count else 1 :]])

    @property
    def cut(self) -> float:
        """Distance from the intersection of the tangents to the middle of the corner, m."""
        x, y = self.points(np.array([0.5 * self.length]))[0]
        return hypot(self.tangent - x, y)

    @cached_property
    def _end(self) -> tuple[float, float]:
        x, y = self.points(np.array([self.length]))[0]
        return float(x), float(y)

    def heading(self, along: Array) -> Array:
        """Return the direction relative to the first tangent at distances from its beginning, rad."""
        ramp, sign = self.ramp_length, 1.0 if self.angle > 0.0 else -1.0
        if ramp == 0.0:
            return np.zeros_like(along)
        rising = integrated_step7(along / ramp)
        falling = integrated_step7((along - self.length + ramp) / ramp)
        return np.asarray(sign * ramp / self.radius * (rising - falling))

    def points(self, along: Array) -> Array:
        """Return points at distances from the beginning, ahead and to the right of it, (N, 2) m."""
        edges = self.edges
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)

        def integral(left: Array, right: Array) -> Array:
            half = 0.5 * (right - left)
            psi = self.heading((left + half)[:, None] + half[:, None] * nodes)
            return np.stack([half * (np.cos(psi) @ weights), half * (np.sin(psi) @ weights)], axis=1)

        whole = np.concatenate([np.zeros((1, 2)), np.cumsum(integral(edges[:-1], edges[1:]), axis=0)])
        panel = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, len(edges) - 2)
        return np.asarray(whole[panel] + integral(edges[panel], along))


def turns_back(angle: float) -> bool:
    """Return whether a turn is too sharp to be rounded between straight legs: more than 170°."""
    return abs(angle) > 170.0 / 180.0 * pi
