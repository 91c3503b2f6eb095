"""Coning, sculling, spin-cone and spin-rock motions in closed form, and the kinds of the table [motion].

Spin-cone: a body spins while its spin axis describes a cone; without net spin it is classical coning.
The body's forward axis makes an angle β with the frame's x axis and precesses about it at the rate Ω; the body spins
about its forward axis at the rate s:

    C_mb = R_x(Ωt) R_y(β) R_x(st),    ω = (s + Ω cos β, Ω sin β sin st, Ω sin β cos st)

This is Savage's SPIN-CONE motion (Strapdown Analytics, 2000, sec. 11.2). With s = −Ω the body has no net rotation. This
is the classical cone of half-angle β (Miller, J. Guidance 6, 1983; Ignagni, J. Guidance 13, 1990, and JGCD 21, 1998;
Savage, JGCD 21, 1998, part 1; Musoff and Murphy, JGCD 18, 1995), whose rotation vector (0, β cos Ωt, β sin Ωt) has a
constant length and which gives a gyro about the cone's axis the mean rate −2Ω sin²(β/2). The integrals of the rates are
elementary.

Sculling: a rotation θ = θ₀ sin Ωt about the x axis and a displacement D sin Ωt along the frame's y axis. The
accelerometers measure a mean specific force of ½ θ₀ D Ω² along z to first order (J₁(θ₀) D Ω² exactly), which is not an
acceleration of the mean motion (Savage, JGCD 21, 1998, part 2; Ignagni, JGCD 21, 1998; Musoff and Murphy, JGCD 18,
1995). The integrals of the specific force are Fourier-Bessel series (Jacobi-Anger), summed to rounding.

Spin-rock: a rotation φ = s t + A sin Ωt about any fixed axis, with the accelerometers on a lever arm from it, as in
Savage's SPIN-ROCK-SIZE motion (Strapdown Analytics, 2000, sec. 11.2). Angle, rate and specific force in body axes, f =
φ̈ u × l + φ̇² u × (u × l), have elementary integrals.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from sinssim import rotation
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.toml_section import Axis, Duration, Frequency, Positive, Turn, TurnRate
from sinssim.truth.motions.analytic import ClosedFormMotion, TurnsOnly
from sinssim.units import DEG


class SpinCone(TurnsOnly):
    """Spinning, s, and coning together: β is the angle between the forward axis and the axis of the cone, Ω the rate of
    precession."""

    def __init__(self, angle: float, precession: float, spin: float) -> None:
        self._angle, self._precession, self._spin = angle, precession, spin
        self.fastest = abs(precession) + abs(spin)
        self.breaks = np.empty(0)

    @property
    def _axial(self) -> float:
        """s + Ω cos β, without cancellation for s = −Ω."""
        return float((self._spin + self._precession) - 2.0 * self._precession * np.sin(0.5 * self._angle) ** 2)

    def attitude(self, t: Array) -> Array:
        c, s = np.cos(0.5 * self._angle), np.sin(0.5 * self._angle)
        plus, minus = 0.5 * (self._precession + self._spin) * t, 0.5 * (self._precession - self._spin) * t
        return np.stack([c * np.cos(plus), c * np.sin(plus), s * np.cos(minus), s * np.sin(minus)], axis=1)

    def rate(self, t: Array) -> Array:
        across = self._precession * np.sin(self._angle)
        phase = self._spin * t
        return np.stack([np.full_like(t, self._axial), across * np.sin(phase), across * np.cos(phase)], axis=1)

    def turn(self, left: Array, right: Array) -> Array:
        step, phase = right - left, 0.5 * self._spin * (left + right)
        # ∫sin st dt = h sinc(sh/2) sin(s t_mid)
        across = self._precession * np.sin(self._angle) * step * np.sinc(0.5 * self._spin * step / np.pi)
        return np.stack([self._axial * step, across * np.sin(phase), across * np.cos(phase)], axis=1)


def classical_cone(half_angle: float, frequency: float) -> SpinCone:
    """Return the classical coning motion of half-angle α, rad, and frequency Ω, rad/s, about the x axis of the frame m;
    its rotation vector from m is (0, α cos Ωt, α sin Ωt)."""
    return SpinCone(half_angle, frequency, -frequency)


class ConingMotion(ClosedFormMotion):
    """Classical coning: the forward axis describes a cone, and the sensor block has no net rotation."""

    type: Literal["coning"]
    half_angle_deg: Positive = Field(le=180.0, description="half-angle of the cone")
    frequency_hz: Frequency = Field(description="frequency of the motion around the cone")
    duration_s: Duration = Field(description="duration")

    def motion(self) -> SpinCone:
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
        return SpinCone(self.angle_deg * DEG, self.precession_deg_s * DEG, self.spin_deg_s * DEG)

    @property
    def rms_rate(self) -> float:
        """The two rates, separated by the cone's angle; see `ClosedFormMotion.rms_rate`."""
        about, along = self.precession_deg_s, self.spin_deg_s
        return math.sqrt(about**2 + along**2 + 2.0 * about * along * math.cos(self.angle_deg * DEG)) * DEG


def _cosine_integral(k: float, left: Array, right: Array) -> Array:
    """Return ∫cos kt dt = 2/k sin(kh/2) cos(k t_mid), free of cancellation."""
    step = right - left
    return np.asarray(step * np.sinc(0.5 * k * step / np.pi) * np.cos(0.5 * k * (left + right)))


def _sine_integral(k: float, left: Array, right: Array) -> Array:
    """Return ∫sin kt dt = 2/k sin(kh/2) sin(k t_mid), free of cancellation."""
    step = right - left
    return np.asarray(step * np.sinc(0.5 * k * step / np.pi) * np.sin(0.5 * k * (left + right)))


class Sculling:
    """A rotation about x of amplitude θ₀ in phase with an oscillation of amplitude D along y, both of the angular
    frequency Ω."""

    def __init__(self, angle: float, displacement: float, frequency: float) -> None:
        self._angle, self._displacement, self._frequency = angle, displacement, frequency
        self.fastest = abs(frequency) * (2.0 + 2.0 * abs(angle))
        self.breaks = np.empty(0)

    def attitude(self, t: Array) -> Array:
        half = 0.5 * self._angle * np.sin(self._frequency * t)
        return np.stack([np.cos(half), np.sin(half), np.zeros_like(t), np.zeros_like(t)], axis=1)

    def rate(self, t: Array) -> Array:
        turning = np.zeros((len(t), 3))
        turning[:, 0] = self._angle * self._frequency * np.cos(self._frequency * t)
        return turning

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        r, v, a = np.zeros((3, len(t), 3))
        w = self._frequency
        r[:, 1] = self._displacement * np.sin(w * t)
        v[:, 1] = self._displacement * w * np.cos(w * t)
        a[:, 1] = -w * w * r[:, 1]
        return r, v, a

    def turn(self, left: Array, right: Array) -> Array:
        turned = np.zeros((len(left), 3))
        turned[:, 0] = self._angle * self._frequency * _cosine_integral(self._frequency, left, right)
        return turned

    def push(self, left: Array, right: Array) -> Array:
        """Return the integral of the specific force, (N, 3) m/s; see `AnalyticMotion.push`.

        With x = Ωt:  sin x cos(θ₀ sin x) = Σ (J₂ₙ − J₂ₙ₊₂) sin (2n+1)x,
                      sin x sin(θ₀ sin x) = J₁ + Σ (J₂ₙ₊₁ − J₂ₙ₋₁) cos 2nx, n ≥ 1.
        """
        from scipy.special import jv

        w, z = self._frequency, self._angle
        along = (jv(0, z) - jv(2, z)) * _sine_integral(w, left, right)
        across = jv(1, z) * (right - left)
        for n in range(1, 100):
            odd, even = jv(2 * n, z) - jv(2 * n + 2, z), jv(2 * n + 1, z) - jv(2 * n - 1, z)
            along = along + odd * _sine_integral((2 * n + 1) * w, left, right)
            across = across + even * _cosine_integral(2 * n * w, left, right)
            if max(abs(odd), abs(even)) < 1e-20:
                break
        amplitude = -self._displacement * w * w  # of the acceleration; body axes: f_y = a cos θ, f_z = −a sin θ
        return np.stack([np.zeros_like(left), amplitude * along, -amplitude * across], axis=1)


class SpinRock:
    """A spin s with superimposed rocking of amplitude A and angular frequency Ω about one axis, fixed in frame and
    body, with the block on a lever arm, body axes, from a point of the axis."""

    def __init__(
        self, axis: ArrayLike, spin: float, angle: float, frequency: float, lever_arm: ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        u = np.asarray(axis, dtype=np.float64)
        if u.shape != (3,) or not np.linalg.norm(u) > 0.0:
            raise InputError(f"axis = {axis!r} of the spin must be three numbers, not all zero.")
        self._axis = u / np.linalg.norm(u)
        self._spin, self._angle, self._frequency = spin, angle, frequency
        self._arm = np.asarray(lever_arm, dtype=np.float64)
        self._tangent = np.cross(self._axis, self._arm)  # u × l
        self._inward = np.cross(self._axis, self._tangent)  # u × (u × l)
        self.fastest = abs(spin) + abs(frequency) * (2.0 + 2.0 * abs(angle))
        self.breaks = np.empty(0)

    def _angle_rate(self, t: Array) -> Array:
        return np.asarray(self._spin + self._angle * self._frequency * np.cos(self._frequency * t))

    def attitude(self, t: Array) -> Array:
        half = 0.5 * (self._spin * t + self._angle * np.sin(self._frequency * t))
        return np.concatenate([np.cos(half)[:, None], np.sin(half)[:, None] * self._axis], axis=1)

    def rate(self, t: Array) -> Array:
        return np.outer(self._angle_rate(t), self._axis)

    def place(self, t: Array) -> tuple[Array, Array, Array]:
        q, rate = self.attitude(t), self._angle_rate(t)
        growth = -self._angle * self._frequency**2 * np.sin(self._frequency * t)
        return (
            rotation.rotate(q, self._arm),
            rotation.rotate(q, np.outer(rate, self._tangent)),
            rotation.rotate(q, np.outer(growth, self._tangent) + np.outer(rate * rate, self._inward)),
        )

    def turn(self, left: Array, right: Array) -> Array:
        rocked = self._angle * self._frequency * _cosine_integral(self._frequency, left, right)
        return np.outer(self._spin * (right - left) + rocked, self._axis)

    def push(self, left: Array, right: Array) -> Array:
        w = self._frequency
        rock = self._angle * w
        gain = -rock * w * _sine_integral(w, left, right)  # ∫φ̈
        # ∫φ̇² = ∫(s² + ½A²Ω² + 2sAΩ cos Ωt + ½A²Ω² cos 2Ωt)
        square = (self._spin**2 + 0.5 * rock * rock) * (right - left)
        square = square + 2.0 * self._spin * rock * _cosine_integral(w, left, right)
        square = square + 0.5 * rock * rock * _cosine_integral(2.0 * w, left, right)
        return np.asarray(np.outer(gain, self._tangent) + np.outer(square, self._inward))


class ScullingMotion(ClosedFormMotion):
    """A rotation about the forward axis in phase with an oscillation to the right."""

    type: Literal["sculling"]
    angle_deg: Turn = Field(description="amplitude of the rotation")
    displacement_mm: Positive = Field(le=1e6, description="amplitude of the oscillation")
    frequency_hz: Frequency = Field(description="frequency of both")
    duration_s: Duration = Field(description="duration")

    def motion(self) -> Sculling:
        return Sculling(self.angle_deg * DEG, self.displacement_mm * 1e-3, self.frequency_hz * (2.0 * np.pi))

    @property
    def rms_rate(self) -> float:
        return math.sqrt(2.0) * math.pi * self.frequency_hz * self.angle_deg * DEG


class SpinRockMotion(ClosedFormMotion):
    """A spin with superimposed rocking about one axis; the sensor block's lever arm is that of [imu]."""

    type: Literal["spin-rock"]
    axis: Axis = Field(description="axis of the spin: forward, right, down")
    spin_deg_s: TurnRate = Field(default=0.0, description="steady rate")
    angle_deg: Turn = Field(description="amplitude of the rocking")
    frequency_hz: Frequency = Field(description="frequency of the rocking")
    duration_s: Duration = Field(description="duration")

    def motion(self) -> SpinRock:
        return SpinRock(self.axis, self.spin_deg_s * DEG, self.angle_deg * DEG, self.frequency_hz * (2.0 * np.pi))

    @property
    def rms_rate(self) -> float:
        """The spin and the sinusoid; see `ClosedFormMotion.rms_rate`."""
        return math.hypot(self.spin_deg_s, math.sqrt(2.0) * math.pi * self.frequency_hz * self.angle_deg) * DEG
