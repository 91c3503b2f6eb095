"""Position error of an unaided inertial navigator at rest by sensor errors: closed forms of the Schuler loop.

On a vehicle that stands level at latitude φ, with R the mean radius of the Earth, ω = √(g/R) Schuler's frequency and U
the Earth's rate, the horizontal position error after t of

    an error of the velocity v     v · sin ωt / ω                      (1)
    a tilt ε                       ε · R (1 − cos ωt)                  (2)
    an azimuth error ζ             ζ · R U cos φ (t − sin ωt / ω)      (3)

(Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 12; Britting, Inertial Navigation
Systems Analysis, 1971). A constant error of the accelerometers changes the velocity all the time, one of the
level gyros the tilt, one of the down gyro the azimuth: its response is the integral of (1), (2) or (3), and that of a
ramp the integral of that. White noise of density N leaves a standard deviation of N times the root of the integral of
the square.

What is left out: the slow turn of Schuler's oscillation with the Earth (Foucault's pendulum), which changes the
direction but not the size, and that an error of attitude stays in inertial space while the Earth turns by Ut. After an
hour that is up to (Ut)²/2 = 3.4 % for a tilt to the east, and 1 % for all else.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sinssim import earth
from sinssim.data import Array
from sinssim.earth.models import OMEGA_IE

Response = Literal["velocity", "tilt", "azimuth"]

_POINTS = 96
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)


@dataclass(frozen=True)
class Schuler:
    """A vehicle at rest on the ellipsoid.

    Attributes:
        radius: R, geometric mean of the two radii of curvature, m.
        gravity: g, m/s².
        north_rate: U cos φ, rad/s.
        down_rate: −U sin φ, rad/s.
    """

    radius: float
    gravity: float
    north_rate: float
    down_rate: float

    @classmethod
    def at(cls, latitude: float) -> Schuler:
        """Return the vehicle at a latitude.

        Args:
            latitude: φ, rad.

        Returns:
            The vehicle.
        """
        r1, r2 = earth.radii(latitude)
        gravity = float(earth.surface_gravity(latitude))
        return cls(
            math.sqrt(float(r1) * float(r2)),
            gravity,
            OMEGA_IE * math.cos(latitude),
            -OMEGA_IE * math.sin(latitude),
        )

    @property
    def frequency(self) -> float:
        """ω, rad/s."""
        return math.sqrt(self.gravity / self.radius)

    def impulse(self, kind: Response, t: Array) -> Array:
        """Return the position error after a unit of velocity, tilt or azimuth, (1) to (3), m.

        Args:
            kind: which.
            t: times since, (...) s.

        Returns:
            (...) m per m/s or per rad.
        """
        w = self.frequency
        if kind == "velocity":
            return np.asarray(np.sin(w * t) / w)  # (1)
        if kind == "tilt":
            return np.asarray(self.radius * 2.0 * np.sin(0.5 * w * t) ** 2)  # (2)
        return np.asarray(self.radius * self.north_rate * (t - np.sin(w * t) / w))  # (3)

    def step(self, kind: Response, t: Array) -> Array:
        """Return the position error while velocity, tilt or azimuth change at a unit rate: the integral of `impulse`.

        Args:
            kind: which.
            t: times since the start, (...) s.

        Returns:
            (...) m per m/s² or per rad/s.
        """
        w = self.frequency
        turned = 2.0 * np.sin(0.5 * w * t) ** 2 / w**2
        if kind == "velocity":
            return np.asarray(turned)
        if kind == "tilt":
            return np.asarray(self.radius * (t - np.sin(w * t) / w))
        return np.asarray(self.radius * self.north_rate * (0.5 * t**2 - turned))

    def ramp(self, kind: Response, t: float) -> float:
        """Return the position error of a rate of change that itself grows at a unit rate: the integral of `step`.

        Args:
            kind: which.
            t: time since the start, s.

        Returns:
            m per m/s³ or per rad/s².
        """
        w = self.frequency
        late = (t - math.sin(w * t) / w) / w**2
        if kind == "velocity":
            return late
        if kind == "tilt":
            return self.radius * (0.5 * t**2 - 2.0 * math.sin(0.5 * w * t) ** 2 / w**2)
        return self.radius * self.north_rate * (t**3 / 6.0 - late)

    def white(self, kind: Response, t: float) -> float:
        """Return the standard deviation of the position error that white noise of unit density makes.

        Args:
            kind: what the noise changes.
            t: time since the start, s.

        Returns:
            m per m/s/√s or per rad/√s.
        """
        w = self.frequency
        s1, s2, c1 = math.sin(w * t) / w, math.sin(2.0 * w * t) / (4.0 * w), math.cos(w * t)
        if kind == "velocity":
            return math.sqrt((0.5 * t - s2) / w**2)
        if kind == "tilt":
            return self.radius * math.sqrt(1.5 * t - 2.0 * s1 + s2)
        cross = 2.0 * (s1 - t * c1) / w**2
        return self.radius * self.north_rate * math.sqrt(t**3 / 3.0 - cross + (0.5 * t - s2) / w**2)

    def correlated(self, kind: Response, t: float, covariance: Callable[[Array, Array], Array]) -> float:
        """Return the standard deviation of the position error that a random rate of change makes.

        Args:
            kind: what it changes.
            t: time since the start, s.
            covariance: of its values at two instants, (N,) and (N,) s.

        Returns:
            The root of ∫∫ h(t − u) h(t − v) covariance(u, v) du dv, by quadrature, m.
        """
        u, weight = 0.5 * t * (1.0 + _NODES), 0.5 * t * _WEIGHTS * self.impulse(kind, 0.5 * t * (1.0 - _NODES))
        first, second = np.meshgrid(u, u, indexing="ij")
        return math.sqrt(float(weight @ covariance(first.ravel(), second.ravel()).reshape(_POINTS, _POINTS) @ weight))

    def driven(self, kind: Response, t: float, change: Callable[[Array], Array]) -> float:
        """Return the position error of a rate of change that is known over time.

        Args:
            kind: what it changes.
            t: time since the start, s.
            change: its values at instants, (N,) s.

        Returns:
            ∫ h(t − u) change(u) du, by quadrature, m.
        """
        u = 0.5 * t * (1.0 + _NODES)
        return float(0.5 * t * (_WEIGHTS * self.impulse(kind, t - u)) @ change(u))
