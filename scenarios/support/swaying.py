"""True motion of a parked vehicle that sways (engine, boarding, wind): sums of sinusoids with exact rates.

Roll, pitch and heading are the sums of their means and sinusoids; the position is the sum of its mean and sinusoids
along north, east and down of the mean position. The increments are Gauss-Legendre integrals of the exact rates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sinssim import earth, rotation
from sinssim.arguments import number
from sinssim.data import Array, ImuData, NavState
from sinssim.earth.ellipsoids import WGS84, Ellipsoid
from sinssim.errors import InputError, shortened
from sinssim.truth.motions.analytic import ClosedForm
from sinssim.truth.motions.vibration import Tone
from sinssim.truth.sampling import block_state, check_instants, checked_place, sample_edges

_COORDINATES = ("roll", "pitch", "heading", "north", "east", "down")
_POINTS = 5  # Gauss-Legendre points on each sample interval


class Sway(Tone):
    """One sinusoid of one coordinate: "roll", "pitch", "heading", "north", "east" or "down"; rad, or m."""


class Swaying(ClosedForm):
    """A vehicle that sways about a fixed mean place and attitude.

    Args:
        latitude, longitude: geodetic coordinates of the mean place, rad.
        height: height of the mean place above the ellipsoid, m.
        roll, pitch, heading: mean attitude in the mean place's north-east-down axes, rad.
        duration: s, from time 0.
        sways: the sinusoids; those of one coordinate are added.
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: reference ellipsoid.

    Raises:
        InputError: the place is beyond a pole, the duration is not positive, or a coordinate or the gravity model is
            unknown.
    """

    def __init__(
        self,
        latitude: float,
        longitude: float,
        height: float,
        roll: float,
        pitch: float,
        heading: float,
        duration: float,
        sways: Sequence[Sway],
        gravity: str = "normal",
        ellipsoid: Ellipsoid = WGS84,
    ) -> None:
        latitude, longitude, height = checked_place(latitude, longitude, height)
        roll, pitch, heading = (
            number("roll", roll, "rad"),
            number("pitch", pitch, "rad"),
            number("heading", heading, "rad"),
        )
        super().__init__(duration, gravity, ellipsoid)
        if not isinstance(sways, Sequence) or not all(isinstance(sway, Sway) for sway in sways):
            raise InputError(f"sways = {shortened(repr(sways))} must be a list of Sway(coordinate, …).")
        for sway in sways:
            for name in ("amplitude", "frequency_hz", "phase"):
                number(f"a sway's {name}", getattr(sway, name))
            if sway.coordinate not in _COORDINATES:
                raise InputError(f"unknown coordinate {sway.coordinate!r} of a sway; known: {', '.join(_COORDINATES)}.")
        self._mean = np.array([roll, pitch, heading, 0.0, 0.0, 0.0])
        self._sways = tuple(sways)
        self._q_em = earth.q_en(latitude, longitude)
        self._origin = earth.geodetic_to_ecef(latitude, longitude, height, ellipsoid)

    def _coordinates(self, t: Array) -> tuple[Array, Array, Array]:
        """Return the six coordinates with their first and second derivatives, each (N, 6)."""
        value = np.tile(self._mean, (len(t), 1))
        first, second = np.zeros_like(value), np.zeros_like(value)
        for sway in self._sways:
            column, w = _COORDINATES.index(sway.coordinate), 2.0 * np.pi * sway.frequency_hz
            sine, cosine = np.sin(w * t + sway.phase), np.cos(w * t + sway.phase)
            value[:, column] += sway.amplitude * sine
            first[:, column] += sway.amplitude * w * cosine
            second[:, column] -= sway.amplitude * w * w * sine
        return value, first, second

    def state(self, t: ArrayLike) -> NavState:
        """Return position, velocity and attitude of the sensor block; see `Trajectory.state`."""
        instants = check_instants(t, self.start, self.end)
        value, first, _ = self._coordinates(np.atleast_1d(instants))
        position = self._origin + rotation.rotate(self._q_em, value[:, 3:])
        q_mb = rotation.quaternion_from_euler(value[:, 0], value[:, 1], value[:, 2])
        shape = instants.shape
        return block_state(
            position.reshape(*shape, 3),
            rotation.rotate(self._q_em, first[:, 3:]).reshape(*shape, 3),
            rotation.multiply(self._q_em, q_mb).reshape(*shape, 4),
            self.ellipsoid,
        )

    def rates(self, t: ArrayLike) -> tuple[Array, Array]:
        """Return inertial angular rate and specific force of the sensor block; see `Trajectory.rates`."""
        instants = check_instants(t, self.start, self.end)
        value, first, second = self._coordinates(np.atleast_1d(instants))
        roll, pitch, heading = value[:, 0], value[:, 1], value[:, 2]
        roll_rate, pitch_rate, heading_rate = first[:, 0], first[:, 1], first[:, 2]
        # Rate relative to the mean axes from the rates of the angles, forward-right-down.
        omega_mb = np.stack(
            [
                roll_rate - heading_rate * np.sin(pitch),
                pitch_rate * np.cos(roll) + heading_rate * np.sin(roll) * np.cos(pitch),
                -pitch_rate * np.sin(roll) + heading_rate * np.cos(roll) * np.cos(pitch),
            ],
            axis=-1,
        )
        w = np.array([0.0, 0.0, self.ellipsoid.omega])
        r = self._origin + rotation.rotate(self._q_em, value[:, 3:])
        v = rotation.rotate(self._q_em, first[:, 3:])
        a = rotation.rotate(self._q_em, second[:, 3:])
        force_e = a + 2.0 * np.cross(w, v) + np.cross(w, np.cross(w, r))
        force_e -= earth.gravitation_ecef(r, self.gravity, self.ellipsoid)
        q_be = rotation.conjugate(rotation.multiply(self._q_em, rotation.quaternion_from_euler(roll, pitch, heading)))
        omega, force = omega_mb + rotation.rotate(q_be, w), rotation.rotate(q_be, force_e)
        return omega.reshape(*instants.shape, 3), force.reshape(*instants.shape, 3)

    def increments(self, rate_hz: float) -> ImuData:
        """Return exact increments by Gauss-Legendre quadrature; see `Trajectory.increments`."""
        edges = sample_edges(self.start, self.end, rate_hz)
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
        dtheta, dvel = np.zeros((len(half), 3)), np.zeros((len(half), 3))
        for node, weight in zip(nodes, weights, strict=True):
            omega, force = self.rates(middle + half * node)
            dtheta += (weight * half)[:, None] * omega
            dvel += (weight * half)[:, None] * force
        return ImuData(edges, dtheta, dvel)
