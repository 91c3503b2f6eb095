"""The rotation of a sensor block on one or two axes in its vehicle: angles, attitude and rate at any time.

The outer axis a is fixed in the vehicle and wobbles, the inner axis e is fixed in the block. With the angles α and β

    (1) q_vb = q(ν) ∘ q(α a) ∘ q(β e)
    (2) ν = ε [u cos(nα + χ) + w sin(nα + χ)],   u, w, a orthogonal: the wobble, n cycles a turn
    (3) ω_vb^b = C(β e)ᵀ [C(α a)ᵀ ω_ν + α̇ a] + β̇ e,   ω_ν = (sin ε / ε) ν̇ − (1 − cos ε)/ε² ν × ν̇

as |ν| = ε is constant, so that ν̇ is perpendicular to ν (Shuster, A Survey of Attitude Representations, J. Astronaut.
Sci. 41, 1993, eq. 4.97 for the rate of a rotation vector).

The rate changes between two values by 3x² − 2x³ of the fraction x of the time it takes, with continuous angular
acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from sinssim import rotation
from sinssim.data import Array

PART = 2048
"""Instants that are computed at a time, so that what is between stays in the processor's cache."""


Piece = tuple[str, float, float, float]
"""Axis, duration s, rate at the begin and at the end rad/s."""


@dataclass(frozen=True)
class Profile:
    """The angle of one axis over time: pieces in which the rate goes smoothly from one value to another.

    Attributes:
        begin: begin of each piece, increasing, (K,) s.
        lasts: duration of each piece, (K,) s.
        angle: at the begin of each piece, (K,) rad.
        rate: at the begin of each piece, (K,) rad/s.
        gain: change of the rate within each piece, (K,) rad/s.
    """

    begin: Array
    lasts: Array
    angle: Array
    rate: Array
    gain: Array

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return angle and rate.

        Args:
            t: instants, (N,) s.

        Returns:
            (N,) rad and (N,) rad/s.
        """
        k = np.clip(np.searchsorted(self.begin, t, side="right") - 1, 0, len(self.begin) - 1)
        since, lasts = t - self.begin[k], self.lasts[k]
        x = since / lasts
        rate = self.rate[k] + self.gain[k] * x * x * (3.0 - 2.0 * x)
        angle = self.angle[k] + self.rate[k] * since + self.gain[k] * lasts * x * x * x * (1.0 - 0.5 * x)
        return angle, rate

    @classmethod
    def constant(cls, rate: float, start: float, end: float) -> Self:
        """Return the profile of a constant rate, with the angle 0 at the start."""
        one = np.ones(1)
        return cls(start * one, (end - start) * one, 0.0 * one, rate * one, 0.0 * one)

    @classmethod
    def repeated(cls, cycle: Sequence[Piece], axis: str, start: float, end: float) -> Self:
        """Return the profile of one axis along a cycle that is repeated to the end."""
        lasts = np.array([piece[1] for piece in cycle])
        count = int(np.ceil((end - start) / lasts.sum())) + 1
        own = np.array([piece[0] == axis for piece in cycle])
        before, after = (np.where(own, [piece[k] for piece in cycle], 0.0) for k in (2, 3))
        turns = 0.5 * (before + after) * lasts
        number = np.arange(count)[:, None]
        begin = start + number * lasts.sum() + (np.cumsum(lasts) - lasts)
        angle = number * turns.sum() + (np.cumsum(turns) - turns)
        whole = [np.broadcast_to(row, begin.shape).ravel() for row in (lasts, angle, before, after - before)]
        return cls(begin.ravel(), whole[0], whole[1], whole[2], whole[3])


@dataclass(frozen=True)
class Turning:
    """The rotation of a block in its vehicle.

    Attributes:
        outer: unit vector of the outer axis in the vehicle, (3,).
        inner: unit vector of the inner axis in the block, (3,).
        outer_profile, inner_profile: angles of the two axes.
        wobble: ε, rad.
        cycles: n.
        phase: χ, rad.
        breaks: instants at which a derivative of the rates jumps, (K,) s.
        fastest: angular frequency beyond which the attitude has no significant content, rad/s.
    """

    outer: Array
    inner: Array
    outer_profile: Profile
    inner_profile: Profile
    wobble: float
    cycles: int
    phase: float
    breaks: Array
    fastest: float

    @property
    def two_axes(self) -> bool:
        """Whether the inner axis turns at all; otherwise the unit has only the outer one."""
        return bool(np.any(self.inner_profile.rate) or np.any(self.inner_profile.gain))

    def angles(self, t: Array) -> Array:
        """Return the angles α and β, (N, 2) rad, at instants (N,) s."""
        found = np.empty((len(t), 2))
        for first in range(0, len(t), PART):
            part = slice(first, first + PART)
            found[part, 0], found[part, 1] = self.outer_profile.at(t[part])[0], self.inner_profile.at(t[part])[0]
        return found

    def without_wobble(self, angles: Array) -> Array:
        """Return the attitude that angles of the two axes mean, as a navigator takes it from its encoders.

        Args:
            angles: α and β, (N, 2) rad.

        Returns:
            q_vb, (N, 4).
        """
        outer = rotation.quaternion_from_rotation_vector(angles[:, :1] * self.outer)
        return rotation.multiply(outer, rotation.quaternion_from_rotation_vector(angles[:, 1:] * self.inner))

    def _wobble(self, alpha: Array) -> tuple[Array, Array]:
        """Return ν and dν/dα, (N, 3) each."""
        u = np.cross(self.outer, np.eye(3)[np.argmin(np.abs(self.outer))])
        u /= np.linalg.norm(u)
        w, at = np.cross(self.outer, u), (self.cycles * alpha + self.phase)[:, None]
        nu = self.wobble * (u * np.cos(at) + w * np.sin(at))  # (2)
        return nu, self.wobble * self.cycles * (w * np.cos(at) - u * np.sin(at))

    def attitude(self, t: Array) -> Array:
        """Return the true attitude of the block.

        Args:
            t: instants, (N,) s.

        Returns:
            q_vb, v_v = C_vb v_b, (N, 4).
        """
        angles = self.angles(t)
        q_vb = self.without_wobble(angles)
        if not self.wobble:
            return q_vb
        nu = self._wobble(angles[:, 0])[0]
        return rotation.multiply(rotation.quaternion_from_rotation_vector(nu), q_vb)  # (1)

    def rate(self, t: Array) -> Array:
        """Return the rate of the block relative to the vehicle.

        Args:
            t: instants, (N,) s.

        Returns:
            ω_vb in the block's axes, (N, 3) rad/s.
        """
        alpha, alpha_rate = self.outer_profile.at(t)
        beta, beta_rate = self.inner_profile.at(t)
        omega = alpha_rate[:, None] * self.outer
        if self.wobble:
            nu, slope = self._wobble(alpha)
            change, e = slope * alpha_rate[:, None], self.wobble
            tilting = np.sinc(e / np.pi) * change - 0.5 * np.sinc(0.5 * e / np.pi) ** 2 * np.cross(nu, change)
            outer = rotation.quaternion_from_rotation_vector(alpha[:, None] * self.outer)
            omega = omega + rotation.rotate(rotation.conjugate(outer), tilting)
        inner = rotation.quaternion_from_rotation_vector(-beta[:, None] * self.inner)
        return np.asarray(rotation.rotate(inner, omega) + beta_rate[:, None] * self.inner)  # (3)
