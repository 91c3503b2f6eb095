"""The study file: motions, sensors, algorithms and rates to compare, typed and checked like a scenario.

A study has parts. Each part is a full factorial: every motion × every set of sensors × every algorithm × every rate
(or three-rate schedule) × every frame, gravity model and curvature. A motion gives its true trajectory, its duration,
and the numbers that characterise it.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from sinssim import units
from sinssim.data import ImuData
from sinssim.errors import InputError, unknown_name
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.navigation_section import Curvature, Frame, OwnEllipsoid, Schedule, Vertical
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.tables import COORDINATES, AnyClosedForm, Coordinates, Use
from sinssim.sensors.imu.grades import GRADES
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import AttitudeSensor, Gyros, SensorSet, SixAccelerometers
from sinssim.strapdown.attitude import ALGORITHMS, MEASURED_ATTITUDE, whole_ratio
from sinssim.strapdown.attitude import schedule as whole_rates
from sinssim.strapdown.frames import FRAME_REGISTRY, frames_that
from sinssim.strapdown.mechanization import CURVATURES, OF_TRUTH
from sinssim.system.registries import ensure
from sinssim.toml_section import Duration, ExperimentFile, Keys, Rate, Section, known_name
from sinssim.truth.motion import Gravity
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight, ParkedVehicle
from sinssim.truth.motions.vibration import Vibration
from sinssim.truth.trajectory import Trajectory
from sinssim.units import listed


class Wording(NamedTuple):
    """A claim in words: a few for a line of a table, and a sentence."""

    title: str
    sentence: str


CLAIM_WORDS: dict[str, Wording] = {
    "velocity-rate": Wording("10–20 Hz for velocity and position", "10–20 Hz is enough for velocity and position"),
    "attitude-rate": Wording(
        "50–80 Hz and a high order for attitude",
        "attitude needs 50–80 Hz and a high-order algorithm to stay within a few tenths of a minute of arc",
    ),
    "cheapest": Wording("quaternions are the cheapest", "quaternions are the cheapest at equal accuracy"),
    "trigonometric-matrix": Wording(
        "B is dearer by sines than by quaternions",
        "the matrix B costs more by trigonometric functions of the angles than from a quaternion",
    ),
    "orthogonality": Wording(
        "(8.19) guarantees orthogonality", "the two quaternions of (8.19) guarantee orthogonality"
    ),
    "euler-heading": Wording(
        "Euler angles carry heading through turns",
        "integrated Euler angles carry the heading through turns without the limits of the arctangents",
    ),
    "euler-limit": Wording("Euler angles have no ±90° limit", "the integration of Euler angles has no ±90° limit"),
    "simplified-radii": Wording(
        "simplified radii cost as much as a gyro",
        "simplified radii of curvature can cost as much as a high-quality gyro",
    ),
    "latitude-rate": Wording("1100 km/h to the north is 10 deg/h", "1100 km/h to the north is 10 deg/h of latitude"),
    "accelerometer-term": Wording(
        "an accelerometer error costs 2Δa/g",
        "an accelerometer error Δa causes an error of the coordinate of at most 2Δa/g",
    ),
    "gyro-term": Wording(
        "a gyro error costs Δω₀ t", "a gyro error Δω₀ causes an error of the coordinate that grows as Δω₀ t"
    ),
    "computer-errors": Wording(
        "a computer's errors are the sensors'", "the errors of a good computer are those of the sensors"
    ),
    "gyro-free": Wording(
        "without gyros errors grow as t²", "without gyros the position error grows with the square of time"
    ),
    "gravity-series": Wording(
        "gravity series hold to 1e-5, 1e-4, 1e-2",
        "the series of gravity are accurate to the orders 1e-5, 1e-4 and 1e-2",
    ),
    "coning-drift": Wording(
        "drift of n samples under coning",
        "under coning by α at Ω, rotation vectors from n samples at a distance h drift by α²Ω(Ωh)²ⁿ n!/(2ⁿ⁺¹(2n+1)!!), "
        "from one and the one before by α²Ω(Ωh)⁴/60",
    ),
}
"""The claims that a study may decide: those of the textbook chapter, and further laws."""

CLAIMS: dict[str, str] = {name: words.sentence for name, words in CLAIM_WORDS.items()}
"""Their sentences by name."""

COMPUTED = ("trigonometric-matrix", "accelerometer-term", "gyro-term", "gravity-series")
"""Those that need no navigation: a study decides them, not one of its parts."""

VARIANTS: dict[str, str] = {
    "rate-gyros": "three accelerometers and three rate gyros",
    "attitude-sensor": "three accelerometers and a sensor of the attitude in inertial space",
    "six-accelerometers-0.1m": "six accelerometers on the faces of a cube, 0.1 m from its centre, and no gyro",
    "six-accelerometers-1m": "six accelerometers on the faces of a cube, 1 m from its centre, and no gyro",
}
"""The sets of sensors that a study may compare."""

_SETS: dict[str, SensorSet] = {
    "rate-gyros": Gyros(type="gyros"),
    "attitude-sensor": AttitudeSensor(type="attitude-sensor"),
    "six-accelerometers-0.1m": SixAccelerometers(type="accelerometers", arm_m=0.1),
    "six-accelerometers-1m": SixAccelerometers(type="accelerometers", arm_m=1.0),
}


def with_set(section: Imu, variant: str, rate_hz: float) -> Imu:
    """Return a block's [imu] section for one of `VARIANTS`.

    Errors of sensors that the variant lacks have no effect, except that the drift of an attitude sensor follows from
    the gyros' biases.
    """
    return section.model_copy(update={"sensor_set": _SETS[variant], "rate_hz": rate_hz})


class StudyMotion(Section):
    """A true motion: that of a scenario, or one given by the tables of a scenario."""

    exactly_one = (
        Keys(("scenario", "parked", "great_circle", "motion"), "a motion is that of a scenario, or a table"),
    )

    name: str = Field(default="", description="short name for tables and plots; default: the kind of motion")
    scenario: str | None = Field(default=None, description="a scenario's file, or a name from `sinssim list scenarios`")
    set: tuple[str, ...] = Field(default=(), description='overrides of the scenario, each "key.path=value"')
    parked: ParkedVehicle | None = None
    great_circle: GreatCircleFlight | None = None
    motion: AnyClosedForm | None = None
    vibration: tuple[Vibration, ...] = Field(
        default=(), description="vibration of the sensor block, added to the motion"
    )
    duration_s: Duration | None = Field(default=None, description="duration of the first part of the motion to use")

    @model_validator(mode="after")
    def _settings_are_of_a_scenario(self) -> Self:
        if self.set and self.scenario is None:
            raise ValueError("set overrides values of a scenario, but no scenario is given")
        return self

    @property
    def label(self) -> str:
        """The name of the motion, or its kind."""
        if self.name:
            return self.name
        if self.scenario is not None:
            return self.scenario.rsplit("/", 1)[-1].removesuffix(".toml")
        return self.motion.type if self.motion is not None else "parked" if self.parked is not None else "great circle"


Claim = Annotated[str, AfterValidator(known_name("claim", CLAIMS))]
Variant = Annotated[str, AfterValidator(known_name("sensor-set variant", VARIANTS))]


def _once(values: tuple[Any, ...], info: ValidationInfo) -> tuple[Any, ...]:
    for value, count in Counter(values).items():
        if count > 1:
            shown = repr(value) if isinstance(value, str) else f"{value} Hz"
            raise ValueError(f"{info.field_name} contains {shown} {count} times; give it once")
    return values


def _differ(what: str, name: Callable[[Any], str], remedy: str) -> AfterValidator:
    """Return the check that tables of an array have different names; `what` they are and what they have."""

    def check(tables: tuple[Any, ...]) -> tuple[Any, ...]:
        for text, count in Counter(map(name, tables)).items():
            if count > 1:
                raise ValueError(f"{count} {what} {text!r}; {remedy}")
        return tables

    return AfterValidator(check)


def _claims(computed: bool) -> AfterValidator:
    """Return the check that claims are decided by a computation of their own, or by navigations."""
    wrong = (
        "needs navigations: name it in the decides of a part that has them"
        if computed
        else "needs no navigation: name it in the study's decides, before the parts"
    )

    def check(claims: tuple[str, ...]) -> tuple[str, ...]:
        if others := [claim for claim in claims if (claim in COMPUTED) != computed]:
            raise ValueError(f"{listed(others)} {wrong}")
        return claims

    return AfterValidator(check)


def _matching(patterns: tuple[str, ...]) -> tuple[str, ...]:
    """Return the algorithms that patterns stand for."""
    names: list[str] = []
    for pattern in patterns:
        ensure("algorithms", pattern)
        matching = [name for name in ALGORITHMS if fnmatchcase(name, pattern)]
        if pattern == MEASURED_ATTITUDE:
            raise ValueError(f'{pattern} belongs to a sensor set: give variants = ["attitude-sensor"] instead')
        if not matching:
            raise unknown_name("algorithm", pattern, ALGORITHMS)
        names += matching
    return tuple(names)


Once = AfterValidator(_once)


class Part(Section):
    """One comparison: all combinations of its motions, sensors, algorithms, rates and other choices."""

    title: str = Field(description="the question, as a heading")
    text: str = Field(default="", description="a few sentences on the result")
    decides: Annotated[tuple[Claim, ...], Once, _claims(computed=False)] = Field(
        default=(), description="claims that the numbers of this part decide"
    )
    motions: Annotated[
        tuple[StudyMotion, ...],
        _differ("motions have the name", lambda motion: motion.label, "give each its own name with name = …"),
    ] = Field(min_length=1, description="true motions")
    variants: Annotated[tuple[Variant, ...], Once] = Field(
        default=("rate-gyros",), min_length=1, description="sets of sensors (8.1)"
    )
    sensors: Annotated[tuple[str, ...], Once] = Field(
        default=("ideal",), min_length=1, description="grades of sensors, or names of the study's own [blocks]"
    )
    algorithms: Annotated[tuple[str, ...], AfterValidator(_matching), Once] = Field(
        default=("quaternion",),
        min_length=1,
        description='attitude algorithms; "*" stands for any letters, so that "poisson-*" is a family and "*" all',
    )
    rates_hz: Annotated[tuple[Rate, ...], Once] = Field(
        default=(), description="sample rates; each divides the highest"
    )
    schedules_hz: Annotated[tuple[Schedule, ...], Once] = Field(
        default=(),
        description="schedules: fast, medium and slow rate, or those of attitude, and of velocity and position; each "
        "divides the one before",
    )
    slow_quantities: Annotated[tuple[Literal["hold", "extrapolate"], ...], Once] = Field(
        default=("hold",),
        min_length=1,
        description="treatment of a schedule's slow quantities between slow instants",
    )
    frames: Annotated[tuple[Frame, ...], Once] = Field(
        default=("level",), min_length=1, description="navigation frames"
    )
    gravities: Annotated[tuple[Gravity, ...], Once] = Field(
        default=("normal",), min_length=1, description="the engine's gravity model"
    )
    curvatures: Annotated[tuple[Curvature, ...], Once] = Field(
        default=("exact",), min_length=1, description=f"radii of curvature: {', '.join(CURVATURES)}"
    )
    ellipsoids: Annotated[tuple[OwnEllipsoid, ...], Once] = Field(
        default=(OF_TRUTH,), min_length=1, description=f'the engine\'s Earth; "{OF_TRUTH}": that of the motion'
    )
    coordinates: Annotated[tuple[Coordinates, ...], Once] = Field(
        default=(), description=f"further coordinates in which errors are compared: {', '.join(COORDINATES)}"
    )
    vertical: Vertical = Field(default="baro-loop", description="height channel; its reference is the true height")

    @model_validator(mode="after")
    def _rates_divide(self) -> Self:
        if not self.rates_hz and not self.schedules_hz:
            raise ValueError("rates_hz, for example rates_hz = [100.0], or schedules_hz is needed")
        for schedule in self.schedules_hz:
            try:
                whole_rates(schedule, schedule[0])
            except InputError as error:
                raise ValueError(f"schedules_hz: {str(error).removeprefix('rates_hz: ')}") from error
        for rate in (*self.rates_hz, *(schedule[0] for schedule in self.schedules_hz)):
            if whole_ratio(self.highest_hz, rate) is None:
                near = self.highest_hz / max(2, round(self.highest_hz / rate))
                raise ValueError(
                    f"rates_hz: {rate:g} Hz does not divide the highest rate, {self.highest_hz:g} Hz, from whose "
                    f"samples its samples are summed; {near:.9g} Hz does"
                )
        return self

    @model_validator(mode="after")
    def _everything_is_used(self) -> Self:
        """Refuse values that have no effect beside others."""
        flat = next((name for name in self.frames if not FRAME_REGISTRY[name].has_radii), "")
        fixed = next((name for name in self.frames if not FRAME_REGISTRY[name].has_azimuth), "")
        simplified = next((name for name in self.curvatures if name != "exact"), "")
        varied = [name for name in ("algorithms", "frames", "curvatures", "schedules_hz")
                  if getattr(self, name) != type(self).model_fields[name].default]  # fmt: skip
        able = listed(frames_that(lambda entry: entry.has_azimuth), "or")
        rules = (
            (flat and simplified, f'curvatures = ["{simplified}"] would have no effect in frames = ["{flat}"], which '
             f"has no radii of curvature: put the {flat} frame in a separate part"),
            (fixed and "frame" in self.coordinates, f'coordinates = ["frame"] needs frames with an azimuth of their '
             f'own, {able}; here frames = ["{fixed}"]: put that frame into a separate part'),
            ("extrapolate" in self.slow_quantities and not self.schedules_hz, 'slow_quantities = ["extrapolate"] would '
             "have no effect: it belongs to schedules_hz, which is not given"),
            ("attitude-sensor" in self.variants and varied, f"{' and '.join(varied)} would have no effect with "
             'variants = ["attitude-sensor"], whose attitude is measured and navigated in inertial axes: put that '
             "sensor set in a separate part"),
        )  # fmt: skip
        if wrong := [text for applies, text in rules if applies]:
            raise ValueError(wrong[0])
        return self

    @property
    def highest_hz(self) -> float:
        """The rate at which samples are generated; samples of lower rates are sums of them."""
        return max((*self.rates_hz, *(schedule[0] for schedule in self.schedules_hz)))

    @property
    def pace(self) -> tuple[tuple[float, Schedule | None, str], ...]:
        """Every rate, and every schedule with its fast rate and the treatment of its slow quantities."""
        schedules = ((s[0], s, slow) for s in self.schedules_hz for slow in self.slow_quantities)
        return (*((rate, None, "") for rate in self.rates_hz), *schedules)

    @property
    def engines(self) -> tuple[tuple[str, str, str, str, str], ...]:
        """Every combination of algorithm, frame, gravity, curvature and ellipsoid."""
        return tuple(itertools.product(self.algorithms, self.frames, self.gravities, self.curvatures, self.ellipsoids))

    @property
    def cases(self) -> int:
        """Number of navigations on each motion."""
        return len(self.engines) * len(self.pace) * len(self.sensors) * len(self.variants)


class Study(ExperimentFile):
    """A comparison study."""

    seed: int = Field(default=0, ge=0, description="seed of the sensors' errors")
    use: Use = Field(
        default=(),
        description="own content: files (.py) and project folders, relative to this file; see own-content.md",
    )
    decides: Annotated[tuple[Claim, ...], _claims(computed=True)] = Field(
        default=(), description="claims that need no navigation: " + ", ".join(COMPUTED)
    )
    blocks: dict[str, Imu] = Field(default={}, description="the study's own sensor blocks, by name: [imu] sections")
    parts: Annotated[
        tuple[Part, ...], _differ("parts have the title", lambda part: part.title, "give each part a unique title")
    ] = Field(min_length=1)

    @model_validator(mode="after")
    def _known_sensors(self) -> Self:
        for name, block in self.blocks.items():
            if block.rotation is not None:
                raise ValueError(
                    f"blocks.{name}.rotation: a study compares algorithms with an IMU that is fixed to the vehicle; "
                    f"use `sinssim run` for a rotating IMU"
                )
            if block.output != "increments":
                raise ValueError(
                    f"blocks.{name}.output: a study sums increments to its lower rates, which rates do not allow; use "
                    "`sinssim run`"
                )
        for number, part in enumerate(self.parts, start=1):
            for name in part.sensors:
                if name not in self.blocks and name not in GRADES:
                    raise ValueError(
                        f"parts.{number}.sensors: {unknown_name('grade', name, {**GRADES, **self.blocks})}"
                    )
        return self

    def block(self, name: str) -> Imu:
        """Return the sensor block of a name: one of the study's blocks, or that of a grade."""
        return self.blocks.get(name) or Imu(grade=name)


@dataclass(frozen=True)
class MotionFacts:
    """Characteristics of a motion: means of the rates of latitude and of ground, the largest of the others.

    `cone` has the half-angle α, rad, and the rate Ω, rad/s, of pure coning.
    """

    duration_s: float
    distance_m: float
    latitude_rate_deg_h: float
    ground_speed_kmh: float
    max_rate_deg_s: float
    max_pitch_deg: float
    max_latitude_deg: float
    cone: tuple[float, float] | None = None


def scenario_of(motion: StudyMotion) -> Scenario:
    """Return a scenario with the motion; of its other sections only the place of the sensor block is used."""
    if motion.scenario is None:
        return Scenario(
            name="motion",
            parked=motion.parked,
            great_circle=motion.great_circle,
            motion=motion.motion,
            vibration=motion.vibration,
        )
    scenario = load_scenario(motion.scenario, motion.set)
    return scenario.model_copy(update={"vibration": (*scenario.vibration, *motion.vibration)})


def expected_seconds(motion: StudyMotion) -> float:
    """Return the duration of a motion without making it, s: exact except for a flight."""
    whole = expected_duration(scenario_of(motion))
    if motion.scenario is None:
        _check_duration(motion, whole)
    return min(whole, motion.duration_s or whole)


def trajectory_of(motion: StudyMotion) -> Trajectory:
    """Return the true trajectory of a motion; a flight flown before comes from the cache."""
    from sinssim.scenario.true_motion import fly

    trajectory = fly(scenario_of(motion))
    if motion.duration_s is None:
        return trajectory
    _check_duration(motion, trajectory.end - trajectory.start)
    return Beginning(trajectory, motion.duration_s)


def _check_duration(motion: StudyMotion, lasts: float) -> None:
    if motion.duration_s is not None and motion.duration_s > lasts + 1e-6:
        raise InputError(
            f"the motion {motion.label!r} lasts {lasts:.1f} s, less than its duration_s = {motion.duration_s:g} s; "
            "duration_s can be at most the duration of the motion."
        )


class Beginning:
    """The first part of a trajectory, as a trajectory; its duration is in s."""

    def __init__(self, whole: Trajectory, duration: float) -> None:
        self._whole = whole
        self.start, self.end = whole.start, whole.start + duration
        self.events = tuple(event for event in whole.events if event.time <= self.end)
        self.gravity, self.ellipsoid, self.channels = whole.gravity, whole.ellipsoid, whole.channels
        self.state, self.rates = whole.state, whole.rates
        self.breaks = getattr(whole, "breaks", ())
        self.fastest = getattr(whole, "fastest", 0.0)

    def increments(self, rate_hz: float) -> ImuData:
        """Return the ideal increments; see `Trajectory.increments`."""
        return first_seconds(self._whole.increments(rate_hz), self.end - self.start)


def first_seconds(imu: ImuData, duration: float) -> ImuData:
    """Return the beginning of some increments: the intervals that end within a duration, s."""
    count = int(np.searchsorted(imu.time, imu.time[0] + duration + 1e-9, side="right")) - 1
    return ImuData(imu.time[: count + 1], imu.dtheta[:count], imu.dvel[:count])


def motion_facts(motion: StudyMotion, trajectory: Trajectory) -> MotionFacts:
    """Characterise a motion by numbers, from states and rates at evenly spread instants."""
    from sinssim import rotation
    from sinssim.earth.geodetic_coordinates import geodetic_to_ecef

    duration = trajectory.end - trajectory.start
    time = np.linspace(trajectory.start, trajectory.end, 4001)
    state = trajectory.state(time)
    speed = np.hypot(state.velocity_ned[:, 0], state.velocity_ned[:, 1])
    ground = geodetic_to_ecef(state.latitude, state.longitude, 0.0 * state.height, trajectory.ellipsoid)
    latitude_moved = float(np.abs(np.diff(state.latitude)).sum())
    pitch = rotation.euler_from_quaternion(state.q_nb)[1]
    omega = trajectory.rates(time)[0]
    cone = motion.motion if motion.motion is not None and motion.motion.type == "coning" else None
    return MotionFacts(
        duration_s=duration,
        distance_m=float(np.linalg.norm(np.diff(ground, axis=0), axis=1).sum()),
        latitude_rate_deg_h=latitude_moved / duration / units.DEG_H,
        ground_speed_kmh=float(speed.mean()) * 3.6,
        max_rate_deg_s=float(np.linalg.norm(omega, axis=1).max()) / units.DEG,
        max_pitch_deg=float(np.abs(pitch).max()) / units.DEG,
        max_latitude_deg=float(np.abs(state.latitude).max()) / units.DEG,
        cone=None if cone is None else (cone.half_angle_deg * units.DEG, 2.0 * np.pi * cone.frequency_hz),
    )
