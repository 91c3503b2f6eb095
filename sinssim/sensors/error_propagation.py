"""Position error of an unaided inertial navigator at rest by sensor errors: closed forms of the Schuler loop.

For a level vehicle at rest at latitude φ, with the mean radius R of the Earth, the Schuler frequency ω = √(g/R) and the
Earth's rate U, the horizontal position error after the time t is, for

    an error of the velocity v     v · sin ωt / ω                      (1)
    a tilt ε                       ε · R (1 − cos ωt)                  (2)
    an azimuth error ζ             ζ · R U cos φ (t − sin ωt / ω)      (3)

(Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., 2004, ch. 12; Britting, Inertial Navigation
Systems Analysis, 1971). A constant error of an accelerometer changes the velocity steadily, that of a level gyro the
tilt, and that of the down gyro the azimuth. The response is therefore the integral of (1), (2) or (3), and the response
to a ramp is the integral of that. White noise of density N causes a standard deviation of N times the root of the
integral of the square.

Two effects are neglected. The plane of the Schuler oscillation turns slowly (Foucault's pendulum), which changes the
direction of the error but not its size. An error of attitude stays fixed in inertial space while the Earth rotates by
Ut. After an hour this amounts to up to (Ut)²/2 = 3.4 % for an east tilt, and to 1 % otherwise.
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
        """Return the position error after a unit step of velocity, tilt or azimuth, (1) to (3), m.

        Args:
            kind: kind of error.
            t: times since the step, (...) s.

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
        """Return the position error if velocity, tilt or azimuth changes at a unit rate: the integral of `impulse`.

        Args:
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
        """Return the position error if the rate of change itself grows at a unit rate: the integral of `step`.

        Args:
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
        """Return the standard deviation of the position error by white noise of unit density.

        Args:
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
        """Return the standard deviation of the position error by a random rate of change.

        Args:
            t: time since the start, s.
            covariance: covariance of the rate at two instants, (N,) and (N,) s.

        Returns:
            The root of ∫∫ h(t − u) h(t − v) covariance(u, v) du dv, by quadrature, m.
        """
        u, weight = 0.5 * t * (1.0 + _NODES), 0.5 * t * _WEIGHTS * self.impulse(kind, 0.5 * t * (1.0 - _NODES))
        first, second = np.meshgrid(u, u, indexing="ij")
        return math.sqrt(float(weight @ covariance(first.ravel(), second.ravel()).reshape(_POINTS, _POINTS) @ weight))

    def driven(self, kind: Response, t: float, change: Callable[[Array], Array]) -> float:
        """Return the position error by a given rate of change.

        Args:
            t: time since the start, s.
            change: the rate at instants, (N,) s.

        Returns:
            ∫ h(t − u) change(u) du, by quadrature, m.
        """
        u = 0.5 * t * (1.0 + _NODES)
        return float(0.5 * t * (_WEIGHTS * self.impulse(kind, t - u)) @ change(u))
