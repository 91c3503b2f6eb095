"""Spin-cone motion: a body spins while its spin axis describes a cone; without net spin it is classical coning.

The body's forward axis makes an angle β with the frame's x axis and precesses about it at the rate Ω; the body spins
about its forward axis at the rate s:

    C_mb = R_x(Ωt) R_y(β) R_x(st),    ω = (s + Ω cos β, Ω sin β sin st, Ω sin β cos st)

This is Savage's SPIN-CONE motion (Strapdown Analytics, 2000, sec. 11.2). With s = −Ω the body has no net rotation. This
is the classical cone of half-angle β (Miller, J. Guidance 6, 1983; Ignagni, J. Guidance 13, 1990, and JGCD 21, 1998;
Savage, JGCD 21, 1998, part 1; Musoff and Murphy, JGCD 18, 1995), whose rotation vector (0, β cos Ωt, β sin Ωt) has a
constant length and which gives a gyro about the cone's axis the mean rate −2Ω sin²(β/2). The integrals of the rates are
elementary.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field

from sinssim.data import Array
from sinssim.section import Duration, Frequency, Positive, TurnRate
from sinssim.truth.motions.analytic import ClosedFormMotion, no_displacement
from sinssim.units import DEG


class SpinCone:
    """Spinning and coning together.

    Args:
        angle: β between the forward axis and the axis of the cone, rad.
        precession: Ω, rad/s.
        spin: s, rad/s.
    """

    def __init__(self, angle: float, precession: float, spin: float) -> None:
        self._angle, self._precession, self._spin = angle, precession, spin
        self.fastest = abs(precession) + abs(spin)
        self.breaks = np.empty(0)

    @property
    def _axial(self) -> float:
        """s + Ω cos β, without cancellation for s = −Ω."""
        return float((self._spin + self._precession) - 2.0 * self._precession * np.sin(0.5 * self._angle) ** 2)

    def attitude(self, t: Array) -> Array:
        """Return q_mb, (N, 4); see `AnalyticMotion.attitude`."""
        c, s = np.cos(0.5 * self._angle), np.sin(0.5 * self._angle)
        plus, minus = 0.5 * (self._precession + self._spin) * t, 0.5 * (self._precession - self._spin) * t
        return np.stack([c * np.cos(plus), c * np.sin(plus), s * np.cos(minus), s * np.sin(minus)], axis=1)

    def rate(self, t: Array) -> Array:
        """Return the angular rate in body axes, (N, 3) rad/s; see `AnalyticMotion.rate`."""
        across = self._precession * np.sin(self._angle)
        phase = self._spin * t
        return np.stack([np.full_like(t, self._axial), across * np.sin(phase), across * np.cos(phase)], axis=1)

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration, all zero; see `AnalyticMotion.place`."""
        return no_displacement(t)

    def turn(self, left: Array, right: Array) -> Array:
        """Return the integral of the rate, (N, 3) rad; see `AnalyticMotion.turn`."""
        step, phase = right - left, 0.5 * self._spin * (left + right)
        # ∫sin st dt = h sinc(sh/2) sin(s t_mid)
        across = self._precession * np.sin(self._angle) * step * np.sinc(0.5 * self._spin * step / np.pi)
        return np.stack([self._axial * step, across * np.sin(phase), across * np.cos(phase)], axis=1)

    def push(self, left: Array, right: Array) -> Array:
        """Return zero, (N, 3) m/s: the body does not move; see `AnalyticMotion.push`."""
        return np.zeros((len(left), 3))


def classical_cone(half_angle: float, frequency: float) -> SpinCone:
    """Return the classical coning motion about the frame's x axis.

    Args:
        half_angle: half-angle of the cone of the forward axis, rad.
        frequency: Ω, rad/s.

    Returns:
        The motion; its rotation vector from the frame m is (0, α cos Ωt, α sin Ωt).
    """
    return SpinCone(half_angle, frequency, -frequency)


class ConingMotion(ClosedFormMotion):
    """Classical coning: the forward axis describes a cone, and the sensor block has no net rotation."""

    type: Literal["coning"]
    half_angle_deg: Positive = Field(le=180.0, description="half-angle of the cone")
    frequency_hz: Frequency = Field(description="frequency of the motion around the cone")
    duration_s: Duration = Field(description="duration")

    def motion(self) -> SpinCone:
        """Return the motion about the place; see `ClosedFormMotion.motion`."""
        return classical_cone(self.half_angle_deg * DEG, self.frequency_hz * (2.0 * np.pi))

    @property
    def rms_rate(self) -> float:
        """Ω 2 sin(θ/2) of the angular rate; see `ClosedFormMotion.rms_rate`."""
        return 2.0 * math.pi * self.frequency_hz * 2.0 * math.sin(0.5 * self.half_angle_deg * DEG)


class SpinConeMotion(ClosedFormMotion):
    """The sensor block spins about its forward axis while that axis describes a cone."""

    type: Literal["spin-cone"]
    angle_deg: Positive = Field(le=180.0, description="angle between the forward axis and the axis of the cone")
    precession_deg_s: TurnRate = Field(description="rate around the cone")
    spin_deg_s: TurnRate = Field(description="rate about the forward axis")
    duration_s: Duration = Field(description="duration")

    def motion(self) -> SpinCone:
        """Return the motion about the place; see `ClosedFormMotion.motion`."""
        return SpinCone(self.angle_deg * DEG, self.precession_deg_s * DEG, self.spin_deg_s * DEG)

    @property
    def rms_rate(self) -> float:
        """The two rates, separated by the cone's angle; see `ClosedFormMotion.rms_rate`."""
        about, along = self.precession_deg_s, self.spin_deg_s
        return math.sqrt(about**2 + along**2 + 2.0 * about * along * math.cos(self.angle_deg * DEG)) * DEG
