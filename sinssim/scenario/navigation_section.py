"""The tables [navigation] and [[navigator]] of a scenario: sinssim's navigators with their initial errors, and others.

The named choices (ellipsoid, frame, radii, vertical channel) are shared with other tables.
"""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from sinssim import earth, rotation
from sinssim.data import Array, NavState
from sinssim.earth.ellipsoids import ELLIPSOIDS, Ellipsoid
from sinssim.errors import InputError
from sinssim.strapdown.attitude import MEASURED_ATTITUDE, SCENARIO_ALGORITHMS, TAKEN
from sinssim.strapdown.frames import FRAMES
from sinssim.strapdown.mechanization import (
    BARO_TIME_CONSTANT,
    CURVATURES,
    OF_TRUTH,
    SLOW_QUANTITIES,
    VERTICALS,
    Mechanization,
)
from sinssim.system.registries import ensure
from sinssim.toml_section import (
    Keys,
    Latitude,
    Longitude,
    Offset,
    Rate,
    Section,
    Speed,
    Spread,
    Velocity,
    known_name,
    once,
)
from sinssim.truth.motion import Gravity
from sinssim.units import ARCMIN


def _own_too(kind: str) -> Callable[[str], str]:
    """Return a validator that registers own content that a name means, if there is any outside the scenario."""

    def look_up(value: str) -> str:
        ensure(kind, value)
        return value

    return look_up


def _three_of_two(rates: Any) -> Any:
    """Return the three rates of a list of two, in which velocity and position have the same."""
    if not isinstance(rates, list | tuple):
        return rates
    if len(rates) not in (2, 3):
        raise ValueError(
            f"must have three rates, of the fast, medium and slow part, or two, of attitude and of velocity and "
            f"position; it has {len(rates)}"
        )
    return (*rates, rates[1]) if len(rates) == 2 else rates


Schedule = Annotated[tuple[Rate, Rate, Rate], BeforeValidator(_three_of_two)]
"""Fast, medium and slow rate, Hz; two are those of attitude, and of velocity and position."""
OwnEllipsoid = Annotated[str, AfterValidator(known_name("ellipsoid", (OF_TRUTH, *ELLIPSOIDS)))]
"""The navigator's ellipsoid: by name, or that of the truth."""
Algorithm = Annotated[
    str, AfterValidator(_own_too("algorithms")), AfterValidator(known_name("algorithm", SCENARIO_ALGORITHMS))
]
"""An attitude algorithm, of sinssim or of the user."""
Frame = Annotated[str, AfterValidator(_own_too("frames")), AfterValidator(known_name("frame", FRAMES))]
"""A navigation frame, of sinssim or of the user."""
Curvature = Annotated[str, AfterValidator(known_name("curvature", CURVATURES))]
Vertical = Annotated[str, AfterValidator(known_name("vertical channel", VERTICALS))]
SlowQuantities = Annotated[str, AfterValidator(known_name("treatment of slow quantities", SLOW_QUANTITIES))]


_Arcmin = Annotated[float, Field(ge=-10_800.0, le=10_800.0)]
"""Error of an angle, arcmin: at most half a turn, beyond which angles repeat."""
_ArcminSigma = Annotated[float, Field(ge=0.0, le=10_800.0)]

_Degree = Annotated[int, Field(ge=2, le=2190)]
"""Degree of a model of gravity, see `sinssim.earth.harmonic_coefficients.MOST_DEGREE`."""

BaroTimeConstant = Annotated[float, Field(ge=0.1, le=1e6)]
"""Time constant of the baro loop, s: below, the loop is faster than its readings; above, it has no effect in a run."""


class InitialErrorSection(Section):
    """Errors of the initial state of navigation: fixed errors, and 1σ of random errors that are added to them."""

    north_m: Offset = Field(default=0.0, description="position error to the north")
    east_m: Offset = Field(default=0.0, description="position error to the east")
    height_m: Offset = Field(default=0.0, description="height error, up positive")
    velocity_north_mps: Velocity = Field(default=0.0, description="velocity error to the north")
    velocity_east_mps: Velocity = Field(default=0.0, description="velocity error to the east")
    velocity_down_mps: Velocity = Field(default=0.0, description="velocity error, down positive")
    roll_arcmin: _Arcmin = Field(default=0.0, description="roll error")
    pitch_arcmin: _Arcmin = Field(default=0.0, description="pitch error")
    heading_arcmin: _Arcmin = Field(default=0.0, description="heading error")
    position_sigma_m: Spread = Field(
        default=0.0, description="1σ of the random position error to the north, and to the east"
    )
    height_sigma_m: Spread = Field(default=0.0, description="1σ of the random height error")
    velocity_sigma_mps: Speed = Field(default=0.0, description="1σ of the random error of each velocity component")
    tilt_sigma_arcmin: _ArcminSigma = Field(
        default=0.0, description="1σ of the random tilt about north, and about east"
    )
    heading_sigma_arcmin: _ArcminSigma = Field(default=0.0, description="1σ of the random heading error")


_ANGLES = ("roll_arcmin", "pitch_arcmin", "heading_arcmin", "tilt_sigma_arcmin", "heading_sigma_arcmin")
_KEYS = {"azimuth": "azimuth_deg", "route": "route_deg", "baro_time_constant": "baro_time_constant_s"}


class AlignmentSection(Section):
    """Self-alignment of the inertial solutions at the start of the run, on a vehicle at a known position."""

    method: Literal["quiet", "disturbed"] = Field(
        default="quiet",
        description="quiet: from gravity and the Earth's rate on a vehicle at rest, eq. (1); disturbed: from the fit "
        "of the cone of gravity in inertial space on a vehicle that sways about its position",
    )
    duration_s: float = Field(
        default=300.0, ge=10.0, le=86_400.0, description="duration of the alignment, after which navigation begins"
    )


class NavigationSection(Section):
    """Strapdown navigation, which computes position, velocity and attitude from the measured increments."""

    rules = (
        (lambda s: MEASURED_ATTITUDE in s.algorithms and (len(s.algorithms) > 1 or s.frame != "inertial")
         and list(s.algorithms),
         f'algorithms = ["{MEASURED_ATTITUDE}"] requires frame = "inertial" and no other algorithm; here frame = '
         '"{s.frame}" and algorithms = {it}'),
        (lambda s: MEASURED_ATTITUDE in s.algorithms and s.initial_error.changed(*_ANGLES),
         "initial_error.{it} would have no effect: a measured attitude has no initial value; "
         "imu.sensor_set.bias_arcsec is the error of the sensor at the start"),
    )  # fmt: skip

    algorithms: Annotated[tuple[Algorithm, ...], once("algorithm")] = Field(
        default=("quaternion",),
        min_length=1,
        description="attitude algorithms, each of which gives a solution; a filter uses the first; see `sinssim list "
        'algorithms`; default with a platform: "platform" and "quaternion"',
    )
    frame: Frame = Field(default="level", description="navigation frame, see `sinssim list frames`")
    gravity: Gravity = Field(default="normal", description="gravity model, see `sinssim list gravity`")
    gravity_degree: _Degree | None = Field(
        default=None,
        description="degree to which the navigation algorithm compensates the disturbance of [gravity] at the "
        "computed position, at most that of the truth; default: normal gravity only",
    )
    ellipsoid: OwnEllipsoid = Field(
        default=OF_TRUTH,
        description="ellipsoid, gravity and Earth rate of the navigation algorithm, see `sinssim list ellipsoids`; "
        f'"{OF_TRUTH}": those of [truth]. With another ellipsoid, the algorithm starts with the true values of '
        "latitude, longitude and height, and its error is the difference of these values",
    )
    curvature: Curvature = Field(
        default="exact", description=f"radii of curvature: {', '.join(CURVATURES)}; see `sinssim list curvatures`"
    )
    vertical: Vertical = Field(
        default="free",
        description=f"height channel: {', '.join(VERTICALS)}; default: baro-loop for [flight], [great_circle], "
        "[track], [drive], [voyage] and scenarios with [aiding.baro], else free. The loop uses [aiding.baro], or the "
        "true height without it",
    )
    baro_time_constant_s: BaroTimeConstant = Field(
        default=BARO_TIME_CONSTANT,
        description='time constant of vertical = "baro-loop"; the loop holds the error of a measurement until the next '
        "one arrives, and opens if the next one is overdue",
    )
    rates_hz: Schedule | None = Field(
        default=None,
        description="rates of the fast, medium and slow computations, or of attitude, and of velocity and position; "
        "each rate divides the previous one, and the first divides the rate of the IMU",
    )
    slow_quantities: SlowQuantities = Field(
        default="hold",
        description=f"with rates_hz: slow quantities between their updates: {' or '.join(SLOW_QUANTITIES)}",
    )
    route_deg: tuple[Latitude, Longitude, Latitude, Longitude] | None = Field(
        default=None,
        description="latitude and longitude of the points A and B; the great circle through them is the equator of "
        'frame = "transverse"; default: the great circle along the initial velocity',
    )
    azimuth_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = Field(
        default=0.0,
        description="direction of the x axis of the frames wander and free-azimuth at the start, clockwise from north; "
        "the segments of a filter's engine always begin with x to the north",
    )
    alignment: AlignmentSection | None = None
    initial_error: InitialErrorSection = Field(default=InitialErrorSection())

    def ellipsoid_over(self, true: str) -> str:
        """Return the name of the navigator's ellipsoid for a true Earth of the given name."""
        return true if self.ellipsoid == OF_TRUTH else self.ellipsoid

    def mechanization(self, algorithm: str, true_ellipsoid: str) -> Mechanization:
        """Return the options of the navigator with one of the section's algorithms."""
        route: Any = None if self.route_deg is None else tuple(map(math.radians, self.route_deg))
        return Mechanization(
            algorithm=algorithm,
            frame=self.frame,
            gravity=self.gravity,
            ellipsoid=self.ellipsoid_over(true_ellipsoid),
            curvature=self.curvature,
            rates_hz=self.rates_hz,
            slow_quantities=self.slow_quantities,
            vertical=self.vertical,
            baro_time_constant=self.baro_time_constant_s if self.vertical == "baro-loop" else BARO_TIME_CONSTANT,
            route=route,
            azimuth=math.radians(self.azimuth_deg),
        )

    def in_segments(self, true_ellipsoid: str) -> Mechanization:
        """Return the options of a filter's engine: the first algorithm, a free vertical channel, x to the north."""
        of = self.mechanization(self.algorithms[0], true_ellipsoid)
        return replace(of, vertical="free", baro_time_constant=BARO_TIME_CONSTANT, azimuth=0.0)

    @model_validator(mode="after")
    def _everything_is_used(self) -> Self:
        for algorithm in self.algorithms:
            try:
                options = self.mechanization(algorithm, "wgs84")
                if "vertical" in self.model_fields_set:  # otherwise the scenario may still choose it
                    replace(options, baro_time_constant=self.baro_time_constant_s)
            except InputError as error:  # its options are named like the keys, but for their units
                text = re.sub(r"^(azimuth|route|baro_time_constant)\b", lambda name: _KEYS[name[0]], str(error))
                raise ValueError(text.rstrip(".")) from error
        return self

    @field_validator("route_deg")
    @classmethod
    def _route_is_one(
        cls, route: tuple[float, float, float, float] | None, info: ValidationInfo
    ) -> tuple[float, float, float, float] | None:
        if route is None:
            return route
        lat_a, lon_a, lat_b, lon_b = map(math.radians, route)
        cosine = math.sin(lat_a) * math.sin(lat_b) + math.cos(lat_a) * math.cos(lat_b) * math.cos(lon_b - lon_a)
        if 1.0 - abs(cosine) < 1e-12:
            raise ValueError("A and B of the route coincide or are antipodal, so they do not determine a great circle")
        return route


class NavigatorSection(Section):
    """A navigator of somebody else, a program or a shared library, whose solution is one of the run's."""

    exactly_one = (Keys(("command", "library"), "command names a program, library a shared library"),)
    rules = (
        (lambda s: s.name in (*TAKEN, *SCENARIO_ALGORITHMS),
         'name = "{s.name}" is the name of another solution of a run: choose another'),
        (lambda s: "imu" not in s.inputs,
         'inputs must have "imu": a solution belongs to the inertial samples; for example ["imu", "gnss"]'),
        (lambda s: s.library is not None and s.form == "text",
         'form = "text" is for programs; a library takes binary blocks: remove it'),
    )  # fmt: skip

    name: str = Field(
        pattern=r"^[A-Za-z][\w-]*$", max_length=40, description="name of its solution in tables, plots and files"
    )
    command: Annotated[tuple[str, ...], Field(min_length=1)] | None = Field(
        default=None,
        description="a program with its arguments, run without a shell; a path with / is relative to this file, a name "
        "without / is looked up in PATH",
    )
    library: str | None = Field(default=None, description="a shared library; its path is relative to this file")
    inputs: Annotated[tuple[str, ...], once("input")] = Field(
        default=("imu",), description='what it gets: "imu", and tables of [aiding], or names of recorded sensors'
    )
    imu_as: Literal["increments", "rates"] = Field(
        default="increments",
        description="samples as increments, or as mean rates and specific forces over the interval",
    )
    form: Literal["binary", "text"] = Field(default="binary", description="form of the messages")
    step: Literal["bulk", "stepwise"] = Field(
        default="bulk",
        description="bulk: it answers when it likes; stepwise: it answers each sample before it gets the next one",
    )
    timeout_s: Annotated[float, Field(gt=0.0, le=86_400.0)] = Field(
        default=60.0, description="longest time in which it neither reads nor answers; then it is ended"
    )

    @property
    def file(self) -> Path | None:
        """The file that is started or loaded; None for a program that is not there."""
        first = self.library or (self.command or ("",))[0]
        if self.library is None and "/" not in first:
            there = shutil.which(first)
            return None if there is None else Path(there)
        return Path(first) if Path(first).is_file() else None

    @property
    def files(self) -> tuple[Path, ...]:
        """Its files that the scenario names by their paths, on which its numbers depend."""
        names = (self.library,) if self.library is not None else self.command or ()
        return tuple(Path(name) for name in names if Path(name).is_absolute() and Path(name).is_file())


def initial_state_with_errors(
    truth: NavState, error: InitialErrorSection, ellipsoid: Ellipsoid, seed: int = 0, axes: str = "north"
) -> NavState:
    """Return the initial state of navigation: the true state with errors added, random ones by the run's seed; bit for
    bit the true state if all are zero. The run's errors are compared in `axes`, see `sinssim.strapdown.frames.AXES`."""
    from sinssim.earth.geodetic_coordinates import radii  # these need the compiler
    from sinssim.statistics.random_numbers import normals
    from sinssim.strapdown.navigation_error import carried

    def draw(term: str, *sigma: float) -> Array:
        return np.array([s * normals(seed, f"initial {term}", i, 1)[0] if s else 0.0 for i, s in enumerate(sigma)])

    position = np.array([error.north_m, error.east_m, error.height_m])
    position += draw("position", error.position_sigma_m, error.position_sigma_m, error.height_sigma_m)
    velocity = np.array([error.velocity_north_mps, error.velocity_east_mps, error.velocity_down_mps])
    velocity += draw("velocity", *[error.velocity_sigma_mps] * 3)
    r1, r2 = radii(truth.latitude, ellipsoid)
    longitude = truth.longitude
    if position[1] and axes == "north":
        longitude = longitude + position[1] / ((r2 + truth.height) * np.cos(truth.latitude))
    q_nb = truth.q_nb
    turn = np.array([error.roll_arcmin, error.pitch_arcmin, error.heading_arcmin]) * ARCMIN
    if turn.any():
        roll, pitch, heading = rotation.euler_from_quaternion(q_nb)
        q_nb = rotation.quaternion_from_euler(roll + turn[0], pitch + turn[1], heading + turn[2])
    phi = ARCMIN * draw("attitude", error.tilt_sigma_arcmin, error.tilt_sigma_arcmin, error.heading_sigma_arcmin)
    if phi.any():
        q_nb = rotation.multiply(rotation.quaternion_from_rotation_vector(-phi), q_nb)  # q_true = q(φ) ⊗ q_solution
    if axes == "transported" and (position.any() or velocity.any() or phi.any()):
        row = NavState(
            truth.latitude[None], truth.longitude[None], truth.height[None],
            (truth.velocity_ned + velocity)[None], q_nb[None],
        )  # fmt: skip
        place = earth.displaced(row.latitude, row.longitude, row.height, position[:1], position[1:2], ellipsoid)
        moved = carried(row, *place, row.height + position[2])
        return NavState(*(part[0] for part in vars(moved).values()))
    return NavState(
        truth.latitude + position[0] / (r1 + truth.height),
        longitude,
        truth.height + position[2],
        truth.velocity_ned + velocity,
        q_nb,
    )
