"""The options of a navigator: algorithm, frame, models of the Earth, rates and vertical channel, with their checks.

Every engine (`navigate`, the filter's segments, a batch of runs, the platform, a measured attitude) takes the same
`Mechanization`. A new option is a field here, its use in the engines, and a key of the scenario's [navigation].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

from sinssim.arguments import POSITIVE, number
from sinssim.earth.ellipsoids import GRAVITY_MODELS, Ellipsoid, ellipsoid_by_name
from sinssim.errors import InputError, check_name
from sinssim.strapdown.attitude import MEASURED_ATTITUDE, PLATFORM, REGISTRY, SCENARIO_ALGORITHMS, schedule, three_rates
from sinssim.strapdown.frames import FRAME_REGISTRY, FRAMES, Frame, check_three_rates, frames_that
from sinssim.system.registries import ensure
from sinssim.units import listed

CURVATURES: dict[str, str] = {
    "exact": "radii of curvature of the ellipsoid",
    "simplified": "to first order in e² and H/a, 1/(R1+H) = (1/a)(1 + e²(1 - 1.5 sin²B) - H/a), error up to 4.5e-5",
    "spherical": "e² neglected: R1 = R2 = a, the equatorial radius, relative error up to 6.7e-3",
    "no-height": "height neglected: R1 and R2 at the surface of the ellipsoid, relative error h/a, 1.7e-3 at 11 km",
    "spherical-no-height": "e² and height neglected: the equatorial radius everywhere",
}
"""Radii of curvature R1 + h of the meridian and R2 + h of the prime vertical."""

OF_TRUTH = "truth"
"""The navigator's ellipsoid if it is that of the truth."""

VERTICALS: dict[str, str] = {
    "free": "pure inertial height, unstable: an error grows 277-fold in an hour",
    "baro-loop": "third-order loop to a height reference (baro-inertial)",
    "truth": "height and vertical velocity held to the height reference",
}

BARO_TIME_CONSTANT = 50.0
"""Default time constant of the baro loop, s."""

SLOW_QUANTITIES: dict[str, str] = {
    "hold": "results of the slow part are held until the next computation",
    "extrapolate": "results of the slow part are extrapolated linearly from the last two values",
}


Route = tuple[float, float, float, float]
"""Latitude and longitude of A and of B, rad."""


class Options(TypedDict, total=False):
    """The fields of `Mechanization` as options by name."""

    algorithm: str
    frame: str
    gravity: str
    ellipsoid: str
    curvature: str
    rates_hz: tuple[float, ...] | None
    slow_quantities: str
    vertical: str
    baro_time_constant: float
    route: Route | None
    azimuth: float


@dataclass(frozen=True, kw_only=True)
class Mechanization:
    """How a navigator computes position, velocity and attitude from increments.

    Attributes:
        algorithm: attitude algorithm, one of `ALGORITHMS`; "measured-attitude" and "platform" name navigators without.
        frame: navigation frame, one of `FRAMES`.
        gravity: one of `GRAVITY_MODELS`.
        ellipsoid: name of the reference ellipsoid, one of `ELLIPSOIDS`.
        curvature: radii of curvature, one of `CURVATURES`: "exact", "simplified" (8.16), or with e² or
            the height dropped.
        rates_hz: rates of the fast, medium and slow part, Hz; each divides the previous one, and the first divides
            the data's rate. Two rates are those of attitude, and of velocity and position. None computes everything at
            the data's rate, to a higher order. See `frames.three_rate_schedule`.
        slow_quantities: with rates_hz, treatment of slow quantities between slow updates, one of `SLOW_QUANTITIES`.
        vertical: "free" (pure inertial), "baro-loop" (third order) or "truth" (height held to the reference).
        baro_time_constant: time constant τ of the baro loop, s; k₁ = 3/τ, k₂ = 3/τ² + 2g/R, k₃ = 1/τ³.
        route: for the transverse frame, whose equator is the great circle from A to B; None for the great circle along
            the initial velocity.
        azimuth: for the frames wander and free-azimuth, direction of their x axis at the start, clockwise from north,
            rad.

    Raises:
        InputError: a name is unknown, a number is invalid, or an option has no effect, such as simplified radii in the
            inertial frame; the message names the option and its requirement.
    """

    algorithm: str = "quaternion"
    frame: str = "level"
    gravity: str = "normal"
    ellipsoid: str = "wgs84"
    curvature: str = "exact"
    rates_hz: tuple[float, ...] | None = None
    slow_quantities: str = "hold"
    vertical: str = "free"
    baro_time_constant: float = BARO_TIME_CONSTANT
    route: Route | None = None
    azimuth: float = 0.0

    def __post_init__(self) -> None:
        ensure("algorithms", self.algorithm)
        ensure("frames", self.frame)
        for kind, name, known in (
            ("algorithm", self.algorithm, SCENARIO_ALGORITHMS),
            ("frame", self.frame, FRAMES),
            ("gravity model", self.gravity, GRAVITY_MODELS),
            ("curvature", self.curvature, CURVATURES),
            ("treatment of slow quantities", self.slow_quantities, SLOW_QUANTITIES),
            ("vertical channel", self.vertical, VERTICALS),
        ):
            check_name(kind, name, known)
        _ = self.earth
        numbers = {
            "baro_time_constant": number("baro_time_constant", self.baro_time_constant, "s", low=POSITIVE),
            "azimuth": number("azimuth", self.azimuth, "rad"),
        }
        for name, value in numbers.items():
            object.__setattr__(self, name, value)
        self._check_used()
        if self.rates_hz is not None:
            rates = three_rates(self.rates_hz)
            schedule(rates, rates[0])
            if self.algorithm == MEASURED_ATTITUDE:
                raise InputError("rates_hz: navigation with a measured attitude cannot run at three rates.")
            if self.algorithm == PLATFORM:
                raise InputError("rates_hz: navigation on a platform has no fast part and cannot run at three rates.")
            check_three_rates(self.algorithm, self.frame)
            object.__setattr__(self, "rates_hz", rates)

    def _check_used(self) -> None:
        """Raise for an option that would have no effect with the others."""
        entry = self.in_frame

        def unused(option: str, why: str) -> InputError:
            return InputError(f"{option} would have no effect: {why}")

        if self.azimuth and not entry.takes_azimuth:
            able = listed(frames_that(lambda entry: entry.takes_azimuth))
            raise unused("azimuth", f'it is for the frames {able}; here frame = "{self.frame}".')
        if self.curvature != "exact" and not entry.has_radii:
            able = listed(frames_that(lambda entry: entry.has_radii))
            why = f'frame = "{self.frame}" has no radii of curvature; {able} have them.'
            raise unused(f'curvature = "{self.curvature}"', why)
        if self.route is not None and not entry.takes_route:
            able = listed(frames_that(lambda entry: entry.takes_route))
            raise unused("route", f'it is for frame = "{able}"; here frame = "{self.frame}".')
        if self.slow_quantities != "hold" and self.rates_hz is None:
            why = "it belongs to a schedule, and rates_hz is not given."
            raise unused(f'slow_quantities = "{self.slow_quantities}"', why)
        if self.baro_time_constant != BARO_TIME_CONSTANT and self.vertical != "baro-loop":
            raise unused(
                f"baro_time_constant = {self.baro_time_constant:g}",
                f'it belongs to vertical = "baro-loop"; here vertical = "{self.vertical}".',
            )

    @property
    def earth(self) -> Ellipsoid:
        """The reference ellipsoid."""
        return ellipsoid_by_name(self.ellipsoid)

    @property
    def in_frame(self) -> Frame:
        """The entry of the frame."""
        return FRAME_REGISTRY[self.frame]

    @property
    def samples(self) -> int:
        """Samples of one update of the attitude algorithm."""
        return REGISTRY[self.algorithm].samples


def chosen(mechanization: Mechanization | None, options: Options) -> Mechanization:
    """Return the mechanization of a function that takes one, or its fields by name."""
    if mechanization is None:
        return Mechanization(**options)
    if options:
        raise InputError(f"{', '.join(options)}: give a mechanization, or its options by name, not both.")
    return mechanization
