"""Linear error equations of a north-east-down inertial navigator, solved apart from the package.

Nine states: attitude φ with C_solution = (I − [φ×]) C_true, velocity, latitude, longitude, height (Titterton and
Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3.1, equations 12.21 and 12.28):

    φ̇  = −ω_in × φ + δω_in − C_nb δω_ib
    δv̇ = f × φ + C_nb δf − (2ω_ie + ω_en) × δv − (2δω_ie + δω_en) × v + δg

plus the kinematics of position. Nothing is dropped: radii of curvature vary with latitude, gravity with latitude
and height. The Earth's constants are written out here; gravity is Somigliana's at the surface with the second-order
series in height (Heiskanen and Moritz, Physical Geodesy, equation 2-124) and its northward part.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Earth:
    """Equatorial radius, flattening, equatorial gravity, Somigliana's k, rotation rate (WGS-84 unless given), SI."""

    a: float = 6378137.0
    f: float = 1 / 298.257223563
    gravity: float = 9.7803253359
    k: float = 0.00193185265241
    rate: float = 7.292115e-5


@dataclass(frozen=True)
class Nominal:
    """The true motion at one instant: latitude [rad], height [m], velocity NED [m/s], C_nb, ω_ib [rad/s], f [m/s²]."""

    latitude: float
    height: float
    velocity: Array
    c_nb: Array
    rate: Array
    force: Array


@dataclass(frozen=True)
class Sources:
    """What is wrong: instrument biases and error matrices (scale on the diagonal), and the errors at the start.

    `start` holds φ north, east, down [rad], velocity north, east, down [m/s], position north, east [m], height [m];
    `gyro` and `accel` are further errors of the readings at a time and a true motion, rad/s and m/s².
    """

    gyro_bias: Array = field(default_factory=lambda: np.zeros(3))
    accel_bias: Array = field(default_factory=lambda: np.zeros(3))
    gyro_matrix: Array = field(default_factory=lambda: np.zeros((3, 3)))
    accel_matrix: Array = field(default_factory=lambda: np.zeros((3, 3)))
    start: Array = field(default_factory=lambda: np.zeros(9))
    gyro: Callable[[float, Nominal], Array] = lambda t, true: np.zeros(3)
    accel: Callable[[float, Nominal], Array] = lambda t, true: np.zeros(3)


def radii(earth: Earth, latitude: float) -> tuple[float, float]:
    """Return the radii of curvature of the meridian and of the prime vertical, m."""
    e2 = earth.f * (2 - earth.f)
    w = 1 - e2 * np.sin(latitude) ** 2
    return earth.a * (1 - e2) / w**1.5, earth.a / w**0.5


def gravity_down(earth: Earth, latitude: float, height: float) -> float:
    """Return the downward component of normal gravity, m/s²."""
    s2 = np.sin(latitude) ** 2
    m = earth.rate**2 * earth.a * (1 - earth.f) / earth.gravity
    surface = earth.gravity * (1 + earth.k * s2) / np.sqrt(1 - earth.f * (2 - earth.f) * s2)
    x = height / earth.a
    return float(surface * (1 - 2 * (1 + earth.f + m - 2 * earth.f * s2) * x + 3 * x * x))


def _gravity_north(earth: Earth, latitude: float, height: float) -> float:
    # The plumb line bends: g_N = −(h/R) dγ/dφ, with γ_e (k + e²/2) sin²φ the leading part of γ.
    beta = earth.k + earth.f * (2 - earth.f) / 2
    return float(-earth.gravity * beta * (height / earth.a) * np.sin(2 * latitude))


def _skew(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rates(earth: Earth, latitude: float, height: float, velocity: Array) -> tuple[Array, Array]:
    """Return the Earth rate and the transport rate in north-east-down axes, rad/s."""
    r1, r2 = radii(earth, latitude)
    n, e = velocity[0], velocity[1]
    earth_rate = earth.rate * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    transport = np.array([e / (r2 + height), -n / (r1 + height), -e * np.tan(latitude) / (r2 + height)])
    return earth_rate, transport


def _matrix(earth: Earth, nominal: Nominal) -> Array:
    """Return F of ẋ = F x for x = φ, δv, δlatitude, δlongitude, δheight."""
    lat, h, v = nominal.latitude, nominal.height, nominal.velocity
    n, e = v[0], v[1]
    s, c, t = np.sin(lat), np.cos(lat), np.tan(lat)
    r1, r2 = radii(earth, lat)
    e2 = earth.f * (2 - earth.f)
    w = 1 - e2 * s * s
    dr1, dr2 = 3 * r1 * e2 * s * c / w, r2 * e2 * s * c / w  # with respect to latitude
    p, q = r1 + h, r2 + h
    earth_rate, transport = rates(earth, lat, h, v)

    d_earth = np.zeros((3, 3))  # δω_ie over δ(latitude, longitude, height)
    d_earth[:, 0] = -earth.rate * np.array([s, 0.0, c])
    d_transport = np.zeros((3, 3))  # δω_en over the same
    d_transport[:, 0] = [-e * dr2 / q**2, n * dr1 / p**2, -e / (c * c) / q + e * t * dr2 / q**2]
    d_transport[:, 2] = [-e / q**2, n / p**2, e * t / q**2]
    over_velocity = np.array([[0, 1 / q, 0], [-1 / p, 0, 0], [0, -t / q, 0]])  # δω_en over δv

    step = 1e-4
    d_gravity = np.zeros((3, 3))
    for row, gravity in ((0, _gravity_north), (2, gravity_down)):
        d_gravity[row, 0] = (gravity(earth, lat + step, h) - gravity(earth, lat - step, h)) / (2 * step)
        d_gravity[row, 2] = (gravity(earth, lat, h + 100) - gravity(earth, lat, h - 100)) / 200

    f = np.zeros((9, 9))
    f[0:3, 0:3] = -_skew(earth_rate + transport)
    f[0:3, 3:6] = over_velocity
    f[0:3, 6:9] = d_earth + d_transport
    f[3:6, 0:3] = _skew(nominal.c_nb @ nominal.force)
    f[3:6, 3:6] = -_skew(2 * earth_rate + transport) + _skew(v) @ over_velocity  # −δω × v = v × δω
    f[3:6, 6:9] = _skew(v) @ (2 * d_earth + d_transport) + d_gravity
    f[6, 3], f[6, 6], f[6, 8] = 1 / p, -n * dr1 / p**2, -n / p**2
    f[7, 4], f[7, 6], f[7, 8] = 1 / (q * c), e / (q * c) * (t - dr2 / q), -e / (q**2 * c)
    f[8, 5] = -1.0
    return f


def solve(
    nominal: Callable[[float], Nominal],
    time: Array,
    sources: Sources,
    *,
    height_held: bool = False,
    earth: Earth | None = None,
) -> tuple[Array, Array, Array]:
    """Return the errors, solution minus truth, that the sources cause.

    Args:
        nominal: the true motion as a function of time.
        time: where the errors are wanted, the first being the start, (N,) s.
        sources: what is wrong.
        height_held: height and vertical velocity are the true ones.
        earth: the Earth's constants.

    Returns:
        Position north, east, down (N, 3) m; velocity (N, 3) m/s; attitude φ (N, 3) rad.
    """
    earth = earth or Earth()
    start = sources.start.copy()
    first = nominal(float(time[0]))
    r1, r2 = radii(earth, first.latitude)
    start[6] /= r1 + first.height
    start[7] /= (r2 + first.height) * np.cos(first.latitude)

    def slope(t: float, x: Array) -> Array:
        true = nominal(t)
        out = _matrix(earth, true) @ x
        out[0:3] -= true.c_nb @ (sources.gyro_bias + sources.gyro_matrix @ true.rate + sources.gyro(t, true))
        out[3:6] += true.c_nb @ (sources.accel_bias + sources.accel_matrix @ true.force + sources.accel(t, true))
        if height_held:
            out[5] = out[8] = 0.0
        return out

    scale = np.array([1e-6] * 3 + [1e-3] * 3 + [1e-7, 1e-7, 1.0])
    solution = solve_ivp(
        slope, (time[0], time[-1]), start, method="DOP853", t_eval=time, rtol=1e-9, atol=1e-8 * scale, max_step=300.0
    )
    x = solution.y.T
    position = np.empty((len(time), 3))
    for k, t in enumerate(time):
        true = nominal(float(t))
        r1, r2 = radii(earth, true.latitude)
        position[k] = (
            x[k, 6] * (r1 + true.height),
            x[k, 7] * (r2 + true.height) * np.cos(true.latitude),
            -x[k, 8],
        )
    return position, x[:, 3:6], x[:, 0:3]
