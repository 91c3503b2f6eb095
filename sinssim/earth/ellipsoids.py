"""Named models of the Earth: reference ellipsoids with derived constants, and gravity models."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from sinssim.data import Array
from sinssim.errors import check_name

OMEGA_IE = 7.292115e-5  # Earth rotation rate, rad/s (WGS-84, NIMA TR8350.2)
MEAN_RADIUS = 6371000.0  # radius of a spherical Earth, m: the mean radius R₁ of the IUGG, rounded
MEAN_GRAVITY = 9.81  # its gravity, m/s²


@dataclass(frozen=True)
class Ellipsoid:
    """A rotating equipotential reference ellipsoid.

    Four constants define its shape and its normal gravity field: a, f, ω and either GM or the equatorial
    gravity; the other constants follow from the theory of Pizzetti and Somigliana (Heiskanen and Moritz,
    Physical Geodesy, 1967, sec. 2-7 to 2-10).

    Attributes:
        name: its name in scenario files.
        a: equatorial radius, m.
        f: flattening.
        gm: gravitational parameter, m³/s².
        omega: rotation rate, rad/s.
        q: ratio ω²a/γ_e of the chapter's gravity series; None computes it from the other constants. The ellipsoid
            "chapter" has the chapter's printed value, which does not belong to its printed ω.
    """

    name: str
    a: float
    f: float
    gm: float
    omega: float = OMEGA_IE
    q: float | None = None

    @cached_property
    def b(self) -> float:
        """Polar radius, m."""
        return self.a * (1.0 - self.f)

    @cached_property
    def e2(self) -> float:
        """First eccentricity squared."""
        return self.f * (2.0 - self.f)

    @cached_property
    def linear_eccentricity(self) -> float:
        """Distance of a focus from the centre, E = √(a² − b²), m."""
        return self.a * math.sqrt(self.e2)

    @cached_property
    def m(self) -> float:
        """Ratio m = ω²a²b/GM (Heiskanen and Moritz 2-70)."""
        return self.omega**2 * self.a**2 * self.b / self.gm

    @cached_property
    def q0(self) -> float:
        """The function q of the ellipsoidal potential at the surface (Heiskanen and Moritz 2-58)."""
        return _q(self.linear_eccentricity / self.b)

    @cached_property
    def j2(self) -> float:
        """Second zonal harmonic of the normal potential (Heiskanen and Moritz 2-90)."""
        second_eccentricity = self.linear_eccentricity / self.b
        return self.e2 / 3.0 * (1.0 - 2.0 * self.m * second_eccentricity / (15.0 * self.q0))

    @cached_property
    def gamma_e(self) -> float:
        """Normal gravity at the equator, m/s² (Heiskanen and Moritz 2-73)."""
        return self.gm / (self.a * self.b) - self.omega**2 * self.a * (1.0 + _pizzetti(self.a, self.f) / 6.0)

    @cached_property
    def gamma_p(self) -> float:
        """Normal gravity at the poles, m/s² (Heiskanen and Moritz 2-74)."""
        return self.gm / self.a**2 + self.omega**2 * self.b * _pizzetti(self.a, self.f) / 3.0

    @cached_property
    def k(self) -> float:
        """Somigliana's constant k = bγ_p/(aγ_e) − 1."""
        return self.b * self.gamma_p / (self.a * self.gamma_e) - 1.0

    @cached_property
    def beta(self) -> float:
        """The chapter's gravity coefficient β = 5q/2 − e²/2 (section 8.2)."""
        q = self.omega**2 * self.a / self.gamma_e if self.q is None else self.q
        return 2.5 * q - 0.5 * self.e2


def _q(x: float) -> float:
    # q = ½[(1 + 3/x²) atan x − 3/x] as a series in x: the closed form loses ten digits to cancellation.
    terms = (2.0 * (-1.0) ** (n + 1) * n * x ** (2 * n + 1) / ((2 * n + 1) * (2 * n + 3)) for n in range(1, 12))
    return float(sum(terms))


def _pizzetti(a: float, f: float) -> float:
    """Return e' q'₀/q₀, which depends on the shape alone (Heiskanen and Moritz 2-71)."""
    x = a * math.sqrt(f * (2.0 - f)) / (a * (1.0 - f))
    dq_dx = sum(2.0 * (-1) ** (n + 1) * n * x ** (2 * n) / (2 * n + 3) for n in range(1, 12))
    return float(x * (1.0 + x * x) * dq_dx / _q(x))  # q' = (1 + x²) dq/dx


def _from_equatorial_gravity(
    name: str, a: float, f: float, gamma_e: float, omega: float = OMEGA_IE, q: float | None = None
) -> Ellipsoid:
    """Return the ellipsoid with the GM of the given equatorial gravity (Heiskanen and Moritz 2-73, solved for GM)."""
    b = a * (1.0 - f)
    return Ellipsoid(name, a, f, a * b * (gamma_e + omega**2 * a * (1.0 + _pizzetti(a, f) / 6.0)), omega, q)


WGS84 = Ellipsoid("wgs84", 6378137.0, 1.0 / 298.257223563, 3.986004418e14)

# The older ellipsoids have a gravity formula instead of GM: Helmert 1901-1909 (9.78030 m/s² at the equator) for
# Krasovsky's, Cassinis 1930 (9.78049 m/s²) for the International one.
ELLIPSOIDS: dict[str, Ellipsoid] = {
    ellipsoid.name: ellipsoid
    for ellipsoid in (
        WGS84,
        _from_equatorial_gravity("krasovsky-1940", 6378245.0, 1.0 / 298.3, 9.78030),
        _from_equatorial_gravity("international-1924", 6378388.0, 1.0 / 297.0, 9.78049),
        Ellipsoid("pz-90.11", 6378136.0, 1.0 / 298.25784, 3.986004418e14),
        # The International ellipsoid with the chapter's own rounded constants: e² = 6.73e-3, ω = 7.27e-5 rad/s. They
        # disagree: ω²a/g_e with the chapter's ω is 0.0034468, 0.6 % less than its q = 0.00346775, which belongs to
        # ω = 7.292e-5. The series of gravity take q; the Earth's rate and the other gravity models take ω.
        _from_equatorial_gravity("chapter", 6378388.0, 1.0 - math.sqrt(1.0 - 6.73e-3), 9.78049, 7.27e-5, 0.00346775),
    )
}

GRAVITY_MODELS: dict[str, str] = {
    "normal": "closed-form normal gravity at height, north and down components, exact for the ellipsoid",
    "j2": "point mass plus second zonal harmonic plus centrifugal, as in JSBSim",
    "somigliana": "Somigliana's surface gravity times (1 - 2h/a), down only",
    "order-1e-5": "the chapter's series with second-order terms in height, north and down; error 2e-7 of gravity up to "
    "20 km, 1.6e-5 at 100 km",
    "order-1e-4": "the chapter's series g_e (1 + beta sin^2 B - 2H/a), down only; error 3.2e-5 of gravity up to 20 km, "
    "5.5e-4 at 100 km",
    "order-1e-2": "the chapter's g_e (1 - 2H/a), down only; error 5.3e-3 of gravity up to 20 km, 6e-3 at 100 km",
}


def normal(latitude: ArrayLike, longitude: ArrayLike) -> Array:
    """Return the outward normals of an ellipsoid at geodetic places, (...) rad: Earth-fixed unit vectors, (..., 3)."""
    c = np.cos(latitude)
    return np.stack([c * np.cos(longitude), c * np.sin(longitude), np.sin(latitude)], axis=-1)


def describe_ellipsoids() -> dict[str, str]:
    """Return the constants of every ellipsoid in words."""
    return {
        name: f"a = {e.a:.0f} m, 1/f = {1.0 / e.f:.9g}, {e.gamma_e:.7f} m/s² at the equator, {e.omega:.7g} rad/s"
        for name, e in ELLIPSOIDS.items()
    }


def in_reverse_time(name: str) -> str:
    """Return the name by which `ellipsoid_by_name` knows an ellipsoid that rotates the other way.

    Its gravity is the same, because gravity depends on the square of the rate.
    """
    return f"{name} in reverse time"


_REVERSED = {in_reverse_time(name): replace(e, omega=-e.omega) for name, e in ELLIPSOIDS.items()}


def ellipsoid_by_name(name: str) -> Ellipsoid:
    """Return an ellipsoid by its name.

    Args:
        name: one of `ELLIPSOIDS`, or a name of `in_reverse_time`.

    Returns:
        The ellipsoid.

    Raises:
        InputError: the name is unknown; the message lists the known names.
    """
    if isinstance(name, str) and name in _REVERSED:
        return _REVERSED[name]
    check_name("ellipsoid", name, ELLIPSOIDS)
    return ELLIPSOIDS[name]
