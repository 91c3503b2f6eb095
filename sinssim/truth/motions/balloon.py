"""A weather balloon: [motion] with type = "balloon", in closed form, from the ground to its burst and back.

It rises with the speed c, bursts at the height h_b, and falls on its parachute with the speed V₀ exp(h/2H), at which
drag balances the weight in air of the density exp(−h/H). With a time θ that begins and ends smoothly, θ̇ = S,

    (1) h = −2H ln E,  E = exp(−h_b/2H) + V₀θ/2H

Balloon and parachute move with the wind w(h), which changes from layer to layer by S of the other vehicles; on the
ground there is none. The place is the integral of Chebyshev polynomials of degree 15 through its velocity, in pieces of
20 s at most, eight at least between two corners.

The payload hangs by a line of the length L and swings as a conical pendulum of the angular frequency √(g/L). The line
pulls along the payload's upward axis, so that g − r̈ gives roll and pitch, as with a multirotor.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from math import comb
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.polynomial import chebyshev
from pydantic import Field

from sinssim.data import Array
from sinssim.toml_section import Heading
from sinssim.truth.motion import Mounting, TrueEarth
from sinssim.truth.motions.analytic import ClosedFormMotion, Leaning, OnEarth
from sinssim.truth.motions.surface_vehicles import rising, s_curve
from sinssim.truth.sampling import FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG, G0

LAUNCH, BURST, LANDING = "launch", "burst", "landing"
"""Beginnings of the texts of its events."""
_SCALE = 14_400.0
"""2H, m: from the ground to 30 km the density falls by e^(60/14.4) = 64, in the Standard Atmosphere 1976 by 67."""
_START, _BURST = 10.0, 2.0
"""Times in which the balloon reaches its speed, and loses it, s."""
_SOFT = 0.4 * G0
"""Largest acceleration as the parachute opens, and on the ground, m/s²."""
_PIECE, _DEGREE = 20.0, 15

Layer = tuple[
    Annotated[float, Field(ge=0.0, le=50e3)], Annotated[float, Field(ge=0.0, le=120.0)], Heading
]  # fmt: skip


def _plateau(t: Array, begin: float, rise: float, end: float, fall: float) -> list[Array]:
    """Return the same of a rise by S at an instant and a fall that ends at another one, each with its duration."""
    return [a - b for a, b in zip(rising(t, begin, rise), rising(t, end - fall, fall), strict=True)]


def _smoothly(t: Array, begin: float, lasting: float) -> list[Array]:
    """Return S(S) of a change that begins at an instant, with its three derivatives, which begin as x⁹, (N,) each."""
    _, u, u1, u2, u3 = rising(t, begin, lasting)
    _, s, s1, s2, s3 = rising(u, 0.0, 1.0)
    return [s, s1 * u1, s2 * u1**2 + s1 * u2, s3 * u1**3 + 3.0 * s2 * u1 * u2 + s1 * u3]


class BalloonFlight(Leaning):
    """The motion of the payload about the place of the launch; see the module's text."""

    def __init__(self, keys: BalloonMotion) -> None:
        super().__init__(keys.latitude_deg)
        self._keys = keys
        self._height, speed, course = np.array(keys.wind or ((0.0, 0.0, 0.0),), dtype=np.float64).T
        self._wind = -speed[:, None] * np.stack([np.cos(course * DEG), np.sin(course * DEG)], axis=1)
        self._swing = np.sqrt(G0 / keys.line_m)
        passed = [t for height in self._height for t in keys.passes(float(height))]
        launch, top, land = keys.instants
        bends = (
            launch,
            launch + _START,
            top - _BURST,
            top,
            top + keys.opening_s,
            land - _START,
            land - keys.landing_s,
            land,
        )
        self.breaks = np.unique([0.0, *bends, *passed, keys.duration_s])
        self.fastest = 8.0 * np.pi / _BURST + 2.0 * self._swing + abs(keys.spin_deg_s) * DEG
        self._begins = np.array(
            [t for a, b in pairwise(self.breaks) for t in np.linspace(a, b, int((b - a) / _PIECE) + 9)[:-1]]
            + [keys.duration_s]
        )
        half = 0.5 * np.diff(self._begins)
        nodes = chebyshev.chebpts1(_DEGREE + 1)
        t = self._begins[:-1, None] + half[:, None] * (nodes + 1.0)
        velocity = self._drift(t.ravel())[0].reshape(len(half), -1, 2)
        fitted = np.linalg.solve(chebyshev.chebvander(nodes, _DEGREE), velocity) * half[:, None, None]
        self._drifted = np.moveaxis(chebyshev.chebint(np.moveaxis(fitted, 1, 0), lbnd=-1), 0, 1)
        self._drifted[1:, 0] += np.cumsum(self._drifted.sum(axis=1), axis=0)[:-1]  # where each piece begins

    def _climb(self, t: Array) -> list[Array]:
        """Return the height with its three derivatives by time, (N,) each."""
        keys, (launch, top, land) = self._keys, self._keys.instants
        up = [keys.rise_mps * of for of in _plateau(t, launch, _START, top, _BURST)[:4]]
        theta, q, q1, q2, _ = _plateau(t, top, keys.opening_s, land, keys.landing_s)
        e = np.exp(-keys.burst_height_m / _SCALE) + keys.fall_mps * theta / _SCALE
        g = keys.fall_mps / e  # ḣ = −gθ̇, ġ = −g²θ̇/2H
        gq = g * q / _SCALE
        down = -_SCALE * np.log(e), -g * q, g * q * gq - g * q1, g * (-2.0 * q * gq**2 + 3.0 * q1 * gq - q2)  # (1)
        return [np.where(t >= top, *both) for both in zip(down, up, strict=True)]

    def _drift(self, t: Array) -> Array:
        """Return the velocity with the wind and its two derivatives, (3, N, 2)."""
        height, rate, growth, _ = self._climb(t)
        k = np.clip(np.searchsorted(self._height, height, side="right") - 1, 0, max(len(self._height) - 2, 0))
        last = np.minimum(k + 1, len(self._height) - 1)
        thick = np.maximum(self._height[last] - self._height[k], 1.0)
        x = np.clip((height - self._height[k]) / thick, 0.0, 1.0)
        s, _, slope = s_curve(x)
        change = self._wind[last] - self._wind[k]
        first = slope / thick * rate
        second = 2.0 * np.pi * np.sin(2.0 * np.pi * x) * (rate / thick) ** 2 + slope / thick * growth
        w = self._wind[k] + change * s[:, None], change * first[:, None], change * second[:, None]
        p = self._aloft(t)
        return np.stack([
            p[0] * w[0], p[1] * w[0] + p[0] * w[1], p[2] * w[0] + 2.0 * p[1] * w[1] + p[0] * w[2],
        ])  # fmt: skip

    def _aloft(self, t: Array) -> list[Array]:
        """Return S(S) between launch and landing with its three derivatives, (N, 1) each."""
        launch, _, land = self._keys.instants
        both = zip(_smoothly(t, launch, _START), _smoothly(t, land - _START, _START), strict=True)
        return [(a - b)[:, None] for a, b in both]

    def _swung(self, t: Array) -> list[Array]:
        """Return the displacement by the swing with its three derivatives, (N, 2) each."""
        w, p = 1j * self._swing, self._aloft(t)
        size = self._keys.line_m * np.tan(self._keys.swing_deg * DEG)
        turned = size * np.exp(w * t)[:, None] * np.array([1.0, -1j])  # cos and sin
        return [
            sum(comb(order, k) * p[k] * w ** (order - k) for k in range(order + 1)) * turned for order in range(4)
        ]  # Leibniz

    def moves(self, t: Array) -> tuple[Array, ...]:
        k = np.clip(np.searchsorted(self._begins, t, side="right") - 1, 0, len(self._begins) - 2)
        x = (2.0 * (t - self._begins[k]) / (self._begins[k + 1] - self._begins[k]) - 1.0)[:, None]
        after, before = np.zeros((len(t), 2)), np.zeros((len(t), 2))
        for number in range(_DEGREE + 1, 0, -1):  # Clenshaw
            after, before = self._drifted[k, number] + 2.0 * x * after - before, after
        drifted = self._drifted[k, 0] + x * after - before, *self._drift(t)
        return tuple(
            np.column_stack([drift + swung.real, -height])
            for drift, swung, height in zip(drifted, self._swung(t), self._climb(t), strict=True)
        )

    def down(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Return the apparent gravity, along which the line hangs; see `Leaning`."""
        _, _, a, j, g, change = self.bent(t)
        launch, _, land = self._keys.instants
        turned, part, *_ = _plateau(t, launch, _START, land, self._keys.landing_s)
        spin = self._keys.spin_deg_s * DEG
        return g - a, change - j, self._keys.heading_deg * DEG + spin * turned, spin * part


class BalloonMotion(ClosedFormMotion):
    """A weather balloon that rises, bursts and falls on its parachute; the sensors are in the payload on its line."""

    travels: ClassVar[bool] = True

    type: Literal["balloon"]
    rise_mps: Annotated[float, Field(ge=1.0, le=10.0)] = Field(default=5.0, description="speed of the ascent")
    burst_height_m: Annotated[float, Field(ge=500.0, le=45e3)] = Field(
        default=30e3, description="height of the burst above the place of the launch"
    )
    fall_mps: Annotated[float, Field(ge=2.0, le=15.0)] = Field(
        default=6.0, description="speed on the parachute at the ground; at 30 km it is eight times as large"
    )
    ground_s: Annotated[float, Field(ge=1.0, le=86_400.0)] = Field(
        default=30.0, description="time at rest before the launch, and after the landing"
    )
    wind: tuple[Layer, ...] = Field(
        default=(),
        description="[height above the launch, speed of the wind, direction that it comes from], m, m/s and degrees; "
        "between the heights it changes smoothly",
    )
    line_m: Annotated[float, Field(ge=1.0, le=200.0)] = Field(default=30.0, description="length of the line")
    swing_deg: Annotated[float, Field(ge=0.0, le=30.0)] = Field(
        default=5.0, description="angle between the swinging line and the vertical"
    )
    spin_deg_s: Annotated[float, Field(ge=-720.0, le=720.0)] = Field(
        default=10.0, description="rate at which the payload turns about the line"
    )

    rules = (
        (lambda s: s.changed("roll_deg", "pitch_deg"),
         "{it} has no meaning for the payload of a balloon, which hangs by its line: remove it"),
        (lambda s: any(high <= low for low, high in pairwise(height for height, *_ in s.wind)),
         "wind: the heights of its layers must increase"),
    )  # fmt: skip

    @property
    def opening_s(self) -> float:
        """Time in which the parachute reaches its speed, s."""
        return 2.0 * self.fall_mps * float(np.exp(self.burst_height_m / _SCALE)) / _SOFT

    @property
    def landing_s(self) -> float:
        """Time in which it comes to rest on the ground, s."""
        return 2.0 * self.fall_mps / _SOFT

    @cached_property
    def instants(self) -> tuple[float, float, float]:
        """Launch, burst and landing, s."""
        launch = self.ground_s
        top = launch + self.burst_height_m / self.rise_mps + 0.5 * (_START + _BURST)
        theta = (1.0 - float(np.exp(-self.burst_height_m / _SCALE))) * _SCALE / self.fall_mps
        return launch, top, top + theta + 0.5 * (self.opening_s + self.landing_s)

    def passes(self, height: float) -> tuple[float, ...]:
        """Return the instants at which a height is passed at full speed, s."""
        launch, top, land = self.instants
        rises = launch + 0.5 * _START + height / self.rise_mps
        theta = float(np.exp(-height / _SCALE) - np.exp(-self.burst_height_m / _SCALE)) * _SCALE / self.fall_mps
        falls = top + theta + 0.5 * self.opening_s
        rising, falling = launch + _START < rises < top - _BURST, top + self.opening_s < falls < land - self.landing_s
        return (*((rises,) if rising else ()), *((falls,) if falling else ()))

    @property
    def duration_s(self) -> float:
        """Duration of the flight, s."""
        return self.instants[2] + self.ground_s

    @property
    def rms_rate(self) -> float:
        return float(np.hypot(self.spin_deg_s, self.swing_deg * np.sqrt(G0 / self.line_m)) * DEG)

    def motion(self) -> BalloonFlight:
        return BalloonFlight(self)

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        level = (1.0, 0.0, 0.0, 0.0)
        vehicle = OnEarth(self.motion(), *self.place, level, self.duration_s, earth.gravity, earth.figure)
        burst = f"{BURST} at {self.burst_height_m / 1e3:.1f} km"
        events = zip(self.instants, (LAUNCH, burst, LANDING), strict=True)
        vehicle.events = tuple(FlightEvent(time, text) for time, text in events)
        return block.of(vehicle)
