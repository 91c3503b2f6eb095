"""Linear theory of a gimballed platform: its errors along any motion by cause, and its alignment at rest.

The platform turns away from the navigator's frame by ψ, which in inertial axes is nothing but the integral of its
drift and of its torquing error:

    ψ̇_i = C_ip (κ ω_commanded − d),     ψ(0) = the error of the attitude at the start

and the horizontal errors of position and velocity in north and east, with the vertical channel held, obey (the ψ form,
Benson, IEEE Transactions on Aerospace and Electronic Systems 11, 1975; Titterton and Weston, 2nd ed., ch. 12)

    δv̇ = −ψ × f + C_np ∇ − (2ω_ie + ω_en)_D × δv − (g/R) δr,     δṙ = δv − (ω_en)_D × δr

∇ is the error of the accelerometers' readings. The equations are linear, so the causes are solved one by one and add up
to the error of the navigator. They know nothing of how the loop is computed.

Alignment at rest, levelling and gyrocompassing of the third order, is a linear system. φ is the rotation of the
platform away from north, east and down. The platform is torqued with the Earth's rate in its own axes and with
corrections from the velocities that its accelerometers' readings add up to:

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

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth import OMEGA_IE, surface_gravity
from sinssim.earth.ellipsoids import Ellipsoid
from sinssim.sensors.sensor_set_readings import PlatformErrors
from sinssim.strapdown.gimballed_platform import Forces, PlatformSolution
from sinssim.strapdown.navigation_error import NavError

GYROS, TORQUERS, ACCELEROMETERS, START = (
    "drift of the gyros",
    "torquing scale factor",
    "accelerometers",
    "initial state",
)
"""The causes."""

_STEP = 1.0  # s


@dataclass(frozen=True)
class ErrorsByCause:
    """Position errors of a platform's solution by cause, from the linear error equations."""

    time: Array  # (M,) s
    position: dict[str, Array]  # north and east by cause, (M, 2) m each

    @property
    def total(self) -> Array:
        """North and east of all causes together, (M, 2) m."""
        return np.asarray(sum(self.position.values()))

    def apart(self, error: NavError) -> float:
        """Return the largest horizontal distance between all causes together and an error, m."""
        rows = np.searchsorted(error.time, self.time)
        return float(np.linalg.norm(error.position_ned[rows, :2] - self.total, axis=1).max())


# Long: the forcing of every cause, and the integration of all of them together.
def errors_by_cause(
    truth: NavState,
    forces: Forces,
    solution: PlatformSolution,
    of_platform: PlatformErrors,
    ellipsoid: Ellipsoid,
) -> ErrorsByCause:
    """Return the position errors that each cause gives, in steps of about a second.

    `truth` are the true states at the times of the navigator's solution, whose commanded rates, drift, readings and
    initial state are used.
    """
    time = solution.time
    ratio = max(1, round(_STEP * (len(time) - 1) / float(time[-1] - time[0])))
    edges = np.arange(0, len(time), ratio)
    t, step = time[edges], np.diff(time[edges])[:, np.newaxis]

    def sums(rows: Array) -> Array:
        """Return the sums of rows over the steps, (M-1, k)."""
        return np.add.reduceat(rows[: edges[-1]], edges[:-1], axis=0)

    # in inertial axes: the turns ψ at the edges, and the errors of the readings over the steps
    middle = rotation.normalize(solution.q_ip[1:] + solution.q_ip[:-1])
    dt = np.diff(time)[:, np.newaxis]
    torque = of_platform.torquer_scale * solution.commanded
    reading = rotation.rotate(middle, solution.readings) - forces.push
    q_in = rotation.multiply(forces.q_ib, rotation.conjugate(truth.q_nb))
    azimuth = 0.0 if solution.azimuth is None else float(solution.azimuth[0])
    q_wn = np.array([np.cos(0.5 * azimuth), 0.0, 0.0, -np.sin(0.5 * azimuth)])
    indicated = rotation.multiply(solution.q_ip[0], q_wn)  # north, east and down as the platform has them
    offset = rotation.multiply(indicated, rotation.conjugate(q_in[0]))
    latitude, h = truth.latitude[edges], truth.height[edges]
    r1, r2 = earth.radii(latitude, ellipsoid)
    displaced, drifting, moved = _initial(truth, solution, r1[0] + h[0], r2[0] + h[0])
    wrong = rotation.rotation_vector_from_quaternion(rotation.normalize(offset)) - rotation.rotate(q_in[0], moved)
    turn = {
        GYROS: _summed(sums(rotation.rotate(middle, -solution.drift * dt))),
        TORQUERS: _summed(sums(rotation.rotate(middle, torque * dt))),
        START: np.tile(wrong, (len(t), 1)),
    }
    force, in_middle = sums(forces.push) / step, rotation.normalize(q_in[edges[1:]] + q_in[edges[:-1]])
    pushed = {name: -np.cross(0.5 * (psi[1:] + psi[:-1]), force) for name, psi in turn.items()}
    pushed[ACCELEROMETERS] = sums(reading) / step
    names = (GYROS, TORQUERS, ACCELEROMETERS, START)
    forcing = np.stack([rotation.rotate(rotation.conjugate(in_middle), pushed[name])[:, :2] for name in names], axis=1)

    stiffness = earth.gravity_ned(latitude, h, "normal", ellipsoid)[:, 2, np.newaxis] / np.stack([r1 + h, r2 + h], 1)
    transport = -truth.velocity_ned[edges, 1] * np.tan(latitude) / (r2 + h)
    coriolis = transport - 2.0 * ellipsoid.omega * np.sin(latitude)
    x, v = np.zeros((4, 2)), np.zeros((4, 2))
    x[3], v[3] = displaced, drifting
    position_errors = np.empty((len(t), 4, 2))
    position_errors[0] = x
    across = np.array([[0.0, -1.0], [1.0, 0.0]])  # (a, b) → (b, −a) on the right: −D × of a horizontal vector
    for k in range(len(t) - 1):
        s, w, c, a = step[k, 0], transport[k], coriolis[k], forcing[k]

        def slope(x: Array, v: Array, w: float = w, c: float = c, a: Array = a, k: int = k) -> tuple[Array, Array]:
            return v + w * (x @ across), a + c * (v @ across) - stiffness[k] * x

        dx, dv = slope(x, v)
        dx, dv = slope(x + 0.5 * s * dx, v + 0.5 * s * dv)
        x, v = x + s * dx, v + s * dv
        position_errors[k + 1] = x
    return ErrorsByCause(t, {name: position_errors[:, i] for i, name in enumerate(names)})


def _summed(rows: Array) -> Array:
    """Return the sums from the start to each edge, (M, k)."""
    return np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])


def _initial(truth: NavState, solution: PlatformSolution, r1: float, r2: float) -> tuple[Array, Array, Array]:
    """Return errors of position and velocity at the start, north and east, and the turn of the computed axes."""
    north = (solution.latitude[0] - truth.latitude[0]) * r1
    east = (solution.longitude[0] - truth.longitude[0]) * r2 * np.cos(truth.latitude[0])
    # the computed axes are turned from the true ones by δθ = (δr_E/R, −δr_N/R, −δr_E tan φ/R), which ψ excludes
    turn = np.array([east / r2, -north / r1, -east * np.tan(truth.latitude[0]) / r2])
    velocity = solution.velocity_ned[0] - truth.velocity_ned[0] + np.cross(turn, truth.velocity_ned[0])
    return np.array([north, east]), velocity[:2], turn


STATES = ("velocity north", "tilt east", "azimuth", "velocity east", "tilt north")
"""States of the loops; the azimuth is about down."""


@dataclass(frozen=True)
class AlignmentLoops:
    """The loops of a platform at rest."""

    latitude: float  # rad
    time_constant: float  # τ of the three poles of the north loop, s
    frequency: float  # ω₀ of the east loop, rad/s
    damping: float = 0.7  # ζ of the east loop

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
        """Return tilts north and east and azimuth after the alignment by constant sensor errors, (3,) rad.

        The errors are those of accelerometers north, east, (2,) m/s², and gyros north, east, down, (3,) rad/s.
        """
        x = -np.linalg.solve(self.dynamics, _SENSORS @ np.concatenate([accel_bias, gyro_drift]))
        return x[[4, 1, 2]]

    def sigmas(
        self, time: Array, tilt: float, azimuth: float, bias: tuple[float, float], white: tuple[float, float]
    ) -> Array:
        """Return 1σ of tilts north and east and of azimuth during an alignment, at equal steps from 0 s, (N, 3) rad.

        `tilt` and `azimuth` are 1σ at the start, rad; `bias` those of accelerometers, m/s², and gyros, rad/s; `white`
        the densities of their noise, m/s/√s and rad/√s. They follow from the covariance of states and sensors.
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
