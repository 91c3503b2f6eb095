"""Alignment of a gimballed platform at rest: levelling, and gyrocompassing of the third order, as a linear system.

φ is the rotation of the platform away from north, east and down. The platform is torqued with the Earth's rate in its
own axes and with corrections from the velocities that its accelerometers' readings add up to:

    v̇_N = gφ_E + ∇_N − k₁v_N     φ̇_E = Ω_N φ_D − Ω_D φ_N − k₂v_N − d_E     φ̇_D = −Ω_N φ_E − k₃v_N − d_D
    v̇_E = −gφ_N + ∇_E − l₁v_E    φ̇_N = Ω_D φ_E + l₂v_E − d_N

with Ω_N = U cos φ and Ω_D = −U sin φ, errors ∇ of the accelerometers and drifts d of the gyros. An azimuth error tilts
the platform about east at the rate Ω_N φ_D, and the velocity due to this tilt turns it into the meridian. The gains are
those of the characteristic polynomials (s + 1/τ)³ of the north loop and s² + 2ζω₀s + ω₀² of the east loop, without the
coupling of the two by Ω_D:

    k₁ = 3/τ,  k₂ = (3/τ² − Ω_N²)/g,  k₃ = (1/τ³ − k₁Ω_N²)/(gΩ_N),     l₁ = 2ζω₀,  l₂ = ω₀²/g

The final tilts are φ_N = ∇_E/g and φ_E = −∇_N/g, and the final azimuth error is d_E/Ω_N − tan φ ∇_E/g, apart from terms
of the order of dτ (Britting, Inertial Navigation Systems Analysis, 1971, ch. 9; Titterton and Weston, 2nd ed., 2004,
ch. 10). A tilt at the start turns the platform in azimuth, the faster the shorter τ; the platform is therefore levelled
before k₃ acts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.earth import OMEGA_IE, surface_gravity

STATES = ("velocity north", "tilt east", "azimuth", "velocity east", "tilt north")
"""States of the loops; the azimuth is about down."""


@dataclass(frozen=True)
class AlignmentLoops:
    """The loops of a platform at rest.

    Attributes:
        latitude: rad.
        time_constant: τ of the three poles of the north loop, s.
        frequency: ω₀ of the east loop, rad/s.
        damping: ζ of the east loop.
    """

    latitude: float
    time_constant: float
    frequency: float
    damping: float = 0.7

    @property
    def dynamics(self) -> Array:
        """A of ẋ = A x + B e, with x in the order of `STATES`, (5, 5)."""
        g, tau = float(surface_gravity(self.latitude)), self.time_constant
        n, d = OMEGA_IE * np.cos(self.latitude), -OMEGA_IE * np.sin(self.latitude)
        k1 = 3.0 / tau
        k2, k3 = (3.0 / tau**2 - n**2) / g, (1.0 / tau**3 - k1 * n**2) / (g * n)
        l1, l2 = 2.0 * self.damping * self.frequency, self.frequency**2 / g
        return np.array(
            [
                [-k1, g, 0.0, 0.0, 0.0],
                [-k2, 0.0, n, 0.0, -d],
                [-k3, -n, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, -l1, -g],
                [0.0, d, 0.0, l2, 0.0],
            ]
        )

    def final_errors(self, accel_bias: Array, gyro_drift: Array) -> Array:
        """Return the errors of attitude after the alignment by constant errors of the sensors.

        Args:
            accel_bias: north, east, (2,) m/s².
            gyro_drift: north, east, down, (3,) rad/s.

        Returns:
            Tilts about north and east, and azimuth, (3,) rad.
        """
        x = -np.linalg.solve(self.dynamics, _SENSORS @ np.concatenate([accel_bias, gyro_drift]))
        return x[[4, 1, 2]]

    def sigmas(
        self, time: Array, tilt: float, azimuth: float, bias: tuple[float, float], white: tuple[float, float]
    ) -> Array:
        """Return the standard deviations of attitude during an alignment, from the covariance of states and sensors.

        Args:
            time: equal steps from 0, (N,) s.
            tilt, azimuth: standard deviations at the start, rad.
            bias: of the accelerometers, m/s², and the gyros, rad/s.
            white: densities of the noise of the accelerometers, m/s/√s, and the gyros, rad/√s.

        Returns:
            Of the tilts about north and east and of the azimuth, (N, 3) rad.
        """
        from scipy.linalg import expm

        each = np.array([2, 3])  # accelerometers, gyros
        f = np.zeros((10, 10))
        f[:5, :5], f[:5, 5:] = self.dynamics, _SENSORS
        q = np.zeros((10, 10))
        q[:5, :5] = (_SENSORS * np.repeat(np.square(white), each)) @ _SENSORS.T
        step = float(time[1] - time[0])
        # Van Loan, IEEE Transactions on Automatic Control 23, 1978
        whole = expm(np.block([[-f, q], [np.zeros((10, 10)), f.T]]) * step)
        phi = whole[10:, 10:].T
        noise = phi @ whole[:10, 10:]
        p = np.diag(np.square([0.0, tilt, azimuth, 0.0, tilt, *np.repeat(bias, each)]))
        sigma = np.empty((len(time), 3))
        for row in range(len(time)):
            sigma[row] = np.sqrt(np.diag(p)[[4, 1, 2]])
            p = phi @ p @ phi.T + noise
        return sigma


_SENSORS = np.zeros((5, 5))
"""B: ∇_N, ∇_E, d_N, d_E, d_D."""
_SENSORS[0, 0] = _SENSORS[3, 1] = 1.0
_SENSORS[4, 2] = _SENSORS[1, 3] = _SENSORS[2, 4] = -1.0
