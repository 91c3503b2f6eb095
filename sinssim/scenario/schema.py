"""The scenario file: one typed, frozen model per table, with the unit of every quantity in its name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from sinssim.earth_models import ELLIPSOIDS, GRAVITY_MODELS
from sinssim.errors import InputError, unknown_name
from sinssim.names import CURVATURES, FRAMES, MEASURED_ATTITUDE, SCENARIO_ALGORITHMS, SLOW_QUANTITIES, VERTICALS
from sinssim.rates import check_parts, schedule
from sinssim.scenario.aiding import AidingSection
from sinssim.scenario.compensation import CompensationSection
from sinssim.scenario.filter import FilterSection
from sinssim.scenario.imu import ImuSection
from sinssim.scenario.isolator import IsolatorSection
from sinssim.scenario.legs import FlightSection
from sinssim.scenario.motion import MotionSection, VibrationSection
from sinssim.scenario.section import Heading, Latitude, Longitude, NotNegative, Positive, Section


def _known(kind: str, names: Iterable[str]) -> Callable[[str], str]:
    """Return a validator that accepts the given names only, and lists them when it refuses."""

    def check(value: str) -> str:
        if value not in names:
            raise unknown_name(kind, value, names)
        return value

    return check


Gravity = Annotated[str, AfterValidator(_known("gravity model", GRAVITY_MODELS))]
EllipsoidName = Annotated[str, AfterValidator(_known("ellipsoid", ELLIPSOIDS))]
Algorithm = Annotated[str, AfterValidator(_known("algorithm", SCENARIO_ALGORITHMS))]
Frame = Annotated[str, AfterValidator(_known("frame", FRAMES))]
Curvature = Annotated[str, AfterValidator(_known("curvature", CURVATURES))]
Vertical = Annotated[str, AfterValidator(_known("vertical channel", VERTICALS))]
SlowQuantities = Annotated[str, AfterValidator(_known("treatment of slow quantities", SLOW_QUANTITIES))]


class ParkedSection(Section):
    """A vehicle that stands still: any place on the Earth, the poles included, any attitude."""

    latitude_deg: Latitude = Field(description="geodetic latitude, north positive")
    longitude_deg: Longitude = Field(default=0.0, description="longitude, east positive")
    altitude_m: float = Field(default=0.0, description="height above the ellipsoid")
    roll_deg: float = Field(default=0.0, ge=-180.0, le=180.0, description="roll, right side down positive")
    pitch_deg: float = Field(default=0.0, ge=-90.0, le=90.0, description="pitch, nose up positive")
    heading_deg: Heading = Field(default=0.0, description="heading, clockwise from north")
    duration_s: Positive = Field(description="how long it stands")


class GreatCircleSection(Section):
    """Level flight at constant height and ground speed along a great circle: truth in closed form."""

    latitude_deg: Latitude = Field(description="latitude at the start")
    longitude_deg: Longitude = Field(default=0.0, description="longitude at the start")
    altitude_m: float = Field(default=0.0, description="height above the ellipsoid")
    course_deg: Heading = Field(description="course at the start, clockwise from north")
    speed_mps: float = Field(ge=0.0, description="ground speed")
    duration_s: Positive = Field(description="how long it flies")


class TruthSection(Section):
    """The Earth that the true specific force is computed for."""

    gravity: Gravity = Field(default="normal", description="gravity model, see `sinssim list gravity`")
    ellipsoid: EllipsoidName = Field(default="wgs84", description=f"one of {', '.join(ELLIPSOIDS)}")


class InitialErrorSection(Section):
    """Errors of the state that navigation starts from, added to the true one: those given, and those drawn."""

    north_m: float = Field(default=0.0, description="position error to the north")
    east_m: float = Field(default=0.0, description="position error to the east")
    height_m: float = Field(default=0.0, description="height error, up positive")
    velocity_north_mps: float = Field(default=0.0, description="velocity error to the north")
    velocity_east_mps: float = Field(default=0.0, description="velocity error to the east")
    velocity_down_mps: float = Field(default=0.0, description="velocity error, down positive")
    roll_arcmin: float = Field(default=0.0, description="roll error")
    pitch_arcmin: float = Field(default=0.0, description="pitch error")
    heading_arcmin: float = Field(default=0.0, description="heading error")
    position_sigma_m: NotNegative = Field(default=0.0, description="1σ of a further error to the north, and east")
    height_sigma_m: NotNegative = Field(default=0.0, description="1σ of a further error of the height")
    velocity_sigma_mps: NotNegative = Field(default=0.0, description="1σ of a further error of each component")
    tilt_sigma_arcmin: NotNegative = Field(default=0.0, description="1σ of a further tilt about north, and east")
    heading_sigma_arcmin: NotNegative = Field(default=0.0, description="1σ of a further turn about the vertical")


class NavigationSection(Section):
    """What turns the measured increments into position, velocity and attitude."""

    algorithms: tuple[Algorithm, ...] = Field(
        default=("quaternion",),
        min_length=1,
        description="attitude algorithms, each navigates on its own; see `sinssim list algorithms`",
    )
    frame: Frame = Field(default="level", description="navigation frame, see `sinssim list frames`")
    gravity: Gravity = Field(default="normal", description="gravity model, see `sinssim list gravity`")
    curvature: Curvature = Field(default="exact", description=f"radii of curvature: {' or '.join(CURVATURES)}")
    vertical: Vertical = Field(
        default="free",
        description=f"height channel: {', '.join(VERTICALS)}; the loop goes by [aiding.baro], without it by the true "
        "height",
    )
    baro_time_constant_s: Positive = Field(default=50.0, description='time constant of vertical = "baro-loop"')
    rates_hz: tuple[Positive, Positive, Positive] | None = Field(
        default=None,
        description="rates of the fast, medium and slow part, each dividing the one before and the fast one the IMU's",
    )
    slow_quantities: SlowQuantities = Field(
        default="hold",
        description=f"with rates_hz, what becomes of them between slow instants: {' or '.join(SLOW_QUANTITIES)}",
    )
    route_deg: tuple[Latitude, Longitude, Latitude, Longitude] | None = Field(
        default=None,
        description='latitude and longitude of A and of B, whose great circle is the equator of frame = "transverse"; '
        "without it the one along the initial velocity",
    )
    initial_error: InitialErrorSection = Field(default=InitialErrorSection())

    @model_validator(mode="after")
    def _algorithms_once(self) -> Self:
        if len(set(self.algorithms)) < len(self.algorithms):
            raise ValueError("algorithms names one algorithm twice; once is enough")
        return self

    @model_validator(mode="after")
    def _attitude_is_measured_or_computed(self) -> Self:
        if MEASURED_ATTITUDE in self.algorithms and (len(self.algorithms) > 1 or self.frame != "inertial"):
            raise ValueError(
                f'algorithms = ["{MEASURED_ATTITUDE}"] goes with frame = "inertial" and with no other algorithm; here '
                f'frame = "{self.frame}" and algorithms = {list(self.algorithms)}'
            )
        return self

    @field_validator("rates_hz")
    @classmethod
    def _rates_can_be_had(
        cls, rates: tuple[float, float, float] | None, info: ValidationInfo
    ) -> tuple[float, float, float] | None:
        if rates is not None:
            try:
                schedule(rates, rates[0])
                if MEASURED_ATTITUDE in info.data.get("algorithms", ()):
                    raise InputError("a measured attitude has no parts that could run at three rates")
                for algorithm in info.data.get("algorithms", ()):
                    check_parts(algorithm, info.data.get("frame", "level"))
            except InputError as error:
                raise ValueError(str(error).removeprefix("rates_hz: ")) from error  # the key is named already
        return rates

    @field_validator("route_deg")
    @classmethod
    def _route_is_one(
        cls, route: tuple[float, float, float, float] | None, info: ValidationInfo
    ) -> tuple[float, float, float, float] | None:
        if route is None:
            return route
        if info.data.get("frame", "transverse") != "transverse":
            raise ValueError(f'a route is for frame = "transverse" only; here frame = "{info.data["frame"]}"')
        lat_a, lon_a, lat_b, lon_b = map(math.radians, route)
        cosine = math.sin(lat_a) * math.sin(lat_b) + math.cos(lat_a) * math.cos(lat_b) * math.cos(lon_b - lon_a)
        if 1.0 - abs(cosine) < 1e-12:
            raise ValueError("A and B of the route coincide or lie opposite, and fix no great circle")
        return route


class Scenario(Section):
    """One run, described: a true motion, an IMU that senses it, the algorithms that navigate on what it sensed.

    Exactly one of `flight`, `parked`, `great_circle` and `motion` says what the true motion is.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][\w.-]*$", description="short name; names the run directory")
    description: str = Field(default="", description="one sentence")
    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of everything random: same seed, same numbers")
    flight: FlightSection | None = None
    parked: ParkedSection | None = None
    great_circle: GreatCircleSection | None = None
    motion: MotionSection | None = None
    vibration: tuple[VibrationSection, ...] = Field(default=(), description="of the sensor block, on top of the motion")
    isolator: IsolatorSection | None = None
    truth: TruthSection = Field(default=TruthSection())
    imu: ImuSection = Field(default_factory=ImuSection)
    compensation: CompensationSection | None = None
    aiding: AidingSection | None = None
    navigation: NavigationSection = Field(default=NavigationSection())
    filter: FilterSection | None = None

    @model_validator(mode="after")
    def _one_source_of_truth(self) -> Self:
        sources = ("flight", "parked", "great_circle", "motion")
        given = [f"[{name}]" for name in sources if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                "exactly one of [flight], [parked], [great_circle] and [motion] says what the true motion is; here "
                + (f"there are {' and '.join(given)}" if given else "there is none of them")
            )
        return self

    @model_validator(mode="after")
    def _filter_has_what_it_needs(self) -> Self:
        if self.filter is not None and self.aiding is None:
            raise ValueError("[filter] has nothing to correct by: name an aiding sensor, for example [aiding.gnss]")
        if self.aiding is not None and self.filter is None:
            sensors = [name for name, sensor in self.aiding if sensor is not None]
            if sensors != ["baro"]:
                raise ValueError("[aiding] has no [filter] that would use it: add [filter], its defaults will do")
            if self.navigation.vertical != "baro-loop":
                raise ValueError(
                    '[aiding.baro] has nothing that would use it: add [filter], or navigation.vertical = "baro-loop"'
                )
        if self.filter is not None and self.imu.sensor_set.type != "gyros":
            raise ValueError(
                f'[filter] corrects a set with gyros; imu.sensor_set.type = "{self.imu.sensor_set.type}" has none'
            )
        return self

    @model_validator(mode="after")
    def _no_sensor_is_faster_than_the_samples(self) -> Self:
        for name, sensor in self.aiding or ():
            if sensor is not None and sensor.rate_hz > self.imu.rate_hz:
                raise ValueError(
                    f"aiding.{name}.rate_hz = {sensor.rate_hz:g} must be at most imu.rate_hz = {self.imu.rate_hz:g}"
                )
        return self

    @model_validator(mode="after")
    def _alignment_has_what_it_needs(self) -> Self:
        if self.filter is None or self.aiding is None or self.filter.alignment_s is None:
            return self
        wanted, gnss = self.filter.alignment_s, self.aiding.gnss
        if self.filter.alignment == "in-motion" and (gnss is None or not (gnss.position and gnss.velocity)):
            raise ValueError('filter.alignment = "in-motion" needs [aiding.gnss] with position and velocity')
        source = self.parked or self.great_circle or self.motion
        if source is not None and wanted >= source.duration_s:
            raise ValueError(
                f"filter.alignment_s = {wanted:g} must be less than duration_s = {source.duration_s:g}: the filter "
                "needs a part of the run after the alignment"
            )
        return self

    @model_validator(mode="after")
    def _rates_divide_the_samples(self) -> Self:
        if self.navigation.rates_hz is not None:
            try:
                schedule(self.navigation.rates_hz, self.imu.rate_hz)
            except InputError as error:
                raise ValueError(f"navigation.{error}") from error
        return self

    @model_validator(mode="after")
    def _navigated_as_the_sensors_allow(self) -> Self:
        kind = self.imu.sensor_set.type
        if (kind == "attitude-sensor") != (MEASURED_ATTITUDE in self.navigation.algorithms):
            raise ValueError(
                f'imu.sensor_set.type = "attitude-sensor" and navigation.algorithms = ["{MEASURED_ATTITUDE}"] (with '
                f'navigation.frame = "inertial") go together; here imu.sensor_set.type = "{kind}" and '
                f"navigation.algorithms = {list(self.navigation.algorithms)}"
            )
        if self.compensation is not None and kind != "gyros":
            raise ValueError(
                f'[compensation] is that of three gyros and three accelerometers; imu.sensor_set.type = "{kind}" has '
                "none"
            )
        return self

    def to_toml(self) -> str:
        """Return the scenario as a TOML file with every default written out.

        Returns:
            Text that loads back to an equal scenario.
        """
        import tomli_w

        return tomli_w.dumps(_without_none(self.model_dump()))


def _without_none(value: Any) -> Any:
    """Drop absent optional values, which TOML cannot write, and turn tuples into arrays, at any depth."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, tuple) else value
