"""The sections [aiding] and [filter] of a scenario: the aiding sensors, and the Kalman filter on them.

[aiding] is composed from the registry of aiding sensors (`sinssim.sensors.aiding_registry`).
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar, cast

from pydantic import (
    AfterValidator,
    Field,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    create_model,
    model_serializer,
    model_validator,
)

from sinssim.errors import unknown_name
from sinssim.estimation import GATE, KINDS, LINEAR, SHIPPED
from sinssim.estimation.state_model import GRAVITY
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding_registry import BROKEN, CLASSES, sensor_class
from sinssim.sensors.aiding_sensor import AidingSensor
from sinssim.strapdown.attitude import SCENARIO_ALGORITHMS, TAKEN
from sinssim.system.extensions import Item
from sinssim.system.registries import ensure, registered
from sinssim.toml_section import Factor, NotNegative, Positive, Rules, Section, once

NAVIGATION_STATES = ("position", "velocity", "attitude")
LEAST_IN_MOTION_S = 45.0
"""Shortest alignment in motion: two windows of 20 s with fixes at their ends, and some time until the first fix, s."""

FILTER_STATES: dict[str, str] = {
    "gyro bias": "constant errors of the gyros",
    "accelerometer bias": "constant errors of the accelerometers",
    "gyro scale": "scale-factor errors of the gyros",
    "accelerometer scale": "scale-factor errors of the accelerometers",
    "gyro misalignment": "tilts of the gyros' sensitive axes, six angles",
    "accelerometer misalignment": "tilts of the accelerometers' sensitive axes, six angles",
    "gyro g-sensitivity": "rates of the gyros by specific force, nine",
    "gyro asymmetry": "scale factors of the gyros for positive inputs less those for negative ones",
    "accelerometer asymmetry": "the same of the accelerometers",
    "gyro quadratic": "errors of the gyros by the square of the rate",
    "accelerometer quadratic": "errors of the accelerometers by the square of the specific force",
    "gyro cubic": "errors of the gyros by the cube of the rate",
    "accelerometer cubic": "errors of the accelerometers by the cube of the specific force",
    "accelerometer cross-axis": "errors of the accelerometers by products of specific forces, six",
    "gyro flicker": "flicker noise of the gyros, a sum of Gauss-Markov processes; without it a random walk of the bias",
    "accelerometer flicker": "the same of the accelerometers",
}
OF_THREE_AXES = tuple(name for name in FILTER_STATES if not name.endswith(("bias", "scale", "misalignment", "flicker")))
"""States that a redundant set does not have: the errors of sensors along their own axes are in sum no such error of
three axes."""

BLOCKS_OF_STATES = {
    **FILTER_STATES,
    GRAVITY: "deflections of the vertical and anomaly that the navigator does not know, over the distance",
}


def _known(name: str) -> str:
    if name in NAVIGATION_STATES:
        raise ValueError(f"every filter has the state {name!r}; give only other errors in states")
    if name not in BLOCKS_OF_STATES:
        raise unknown_name("block of states", name, BLOCKS_OF_STATES)
    return name


VibrationNoise = Annotated[float, Field(ge=0.0, le=10.0)]
PositionSigma = Annotated[float, Field(ge=1e-6, le=2e7)]
"""m: from below any sensor's resolution to half the Earth's circumference."""
VelocitySigma = Annotated[float, Field(ge=1e-6, le=1e4)]
"""m/s: from below any sensor's resolution to more than a satellite's velocity."""
AngleSigma = Annotated[float, Field(ge=1e-6, le=10800.0)]
"""arcmin: from below any sensor's resolution to half a turn."""
StateBlock = Annotated[str, AfterValidator(_known)]


def _kind(name: str) -> str:
    ensure("filters", name)
    if name not in KINDS:
        raise unknown_name("filter", name, KINDS)
    return name


Kind = Annotated[str, AfterValidator(_kind)]


class InitialSigmaSection(Section):
    """1σ of the initial state that the filter assumes; default: the values of [navigation.initial_error]."""

    position_m: PositionSigma | None = Field(
        default=None, description="1σ of the position to the north, and to the east"
    )
    height_m: PositionSigma | None = Field(default=None, description="1σ of the height")
    velocity_mps: VelocitySigma | None = Field(default=None, description="1σ of each component of the velocity")
    tilt_arcmin: AngleSigma | None = Field(default=None, description="1σ of the tilt about north, and about east")
    heading_arcmin: AngleSigma | None = Field(default=None, description="1σ of the heading")


class GravityStates(Section):
    """The states "gravity disturbance", Gauss-Markov processes over the distance travelled. Values that are left out
    follow from the true field along the plan, for recorded sensors from the anomaly degree variances of Tscherning and
    Rapp (1974) beyond the degree that the navigator knows."""

    deflection_sigma_arcsec: Annotated[float, Field(gt=0.0, le=200.0)] | None = Field(
        default=None, description="1σ of the deflections to the north and to the east"
    )
    anomaly_sigma_mgal: Annotated[float, Field(gt=0.0, le=2000.0)] | None = Field(
        default=None, description="1σ of the anomaly"
    )
    correlation_km: Annotated[float, Field(ge=0.1, le=5000.0)] | None = Field(
        default=None, description="distance at which the correlation is 1/e"
    )


class _FilterKeys(Section):
    """The keys that every filter may have."""

    states: Annotated[tuple[StateBlock, ...], once("block")] | None = Field(
        default=None,
        description=f"errors of the inertial sensors and of gravity that are states of the filter, any of "
        f"{', '.join(BLOCKS_OF_STATES)}; default: those that are significant for the grade and the planned motion; "
        f"states of aiding sensors are added automatically",
    )
    kind: Kind = Field(
        default="error-state",
        description="error-state: a Kalman filter of the errors, linear in them; invariant: the same on SE₂(3); "
        "unscented, cubature: by points through the nonlinear equations; ensemble: by 200 members that are drawn; in "
        "[[filters]] also one of a project",
    )
    flicker_processes: Annotated[int, Field(ge=2, le=9)] | None = Field(
        default=None,
        description="number of processes in each of the states gyro flicker and accelerometer flicker; default: one "
        "for each decade from where flicker is 5 % of the white noise to the duration of the run, and a slower one",
    )
    loop: Literal["closed", "open"] = Field(
        default="closed",
        description="closed: estimated errors are fed back into the navigation equations and the compensation; open: "
        "they are fed forward",
    )
    rate_hz: float = Field(
        default=10.0,
        ge=1.0,
        description="rate of the covariance prediction; its interval is rounded to whole samples of the IMU",
    )
    gate: float = Field(
        default=GATE,
        ge=0.0,
        lt=1.0,
        description="fraction of correct measurements that the gate may reject; 0 rejects none",
    )
    monitor_s: NotNegative = Field(
        default=0.0,
        description="interval over which the innovations of GNSS are summed; if a sum contradicts the filter, all "
        "fixes are withdrawn for the rest of the run; 0: no monitor",
    )
    alignment: Literal["at-rest", "in-motion", "by-course"] = Field(
        default="at-rest",
        description="coarse alignment: by gravity and the Earth's rate on a vehicle at rest, by GNSS velocities on a "
        "vehicle that turns, or by the course of a land vehicle, from rest or in motion",
    )
    alignment_s: Positive | None = Field(
        default=None,
        description="duration of the coarse alignment; default: no alignment; the filter begins at the end of the "
        "alignment, or in motion at the first fix after it",
    )
    inertial_noise_factor: Factor = Field(
        default=1.0, description="noise of gyros and accelerometers that the filter assumes, relative to the true noise"
    )
    measurement_noise_factor: Factor = Field(
        default=1.0, description="noise of the aiding sensors that the filter assumes, relative to the true noise"
    )
    vibration_noise: VibrationNoise = Field(
        default=0.0,
        description="fraction of the vibration in the inertial data that the filter treats as white noise of each "
        "sample, in addition to the sensor noise; 0 if the noise of the sensors is known, about 0.4 for a log of a "
        "MEMS IMU near an engine",
    )
    initial_sigma: InitialSigmaSection = Field(default=InitialSigmaSection())
    gravity: GravityStates = Field(default=GravityStates())


class FilterSection(_FilterKeys):
    """A Kalman filter that uses the aiding sensors. It assumes the true noise unless a factor changes it."""

    smooth: bool = Field(default=False, description="whether the solution is smoothed afterwards")
    backward: bool = Field(
        default=False,
        description="whether the filter also runs over the data in reverse time, from the end to the start",
    )
    diagnose: bool = Field(
        default=False,
        description="whether the program searches for the cause if the innovations are inconsistent with the filter: "
        "the linear recursion of a run over the first minutes is repeated with a lever arm, a delay, sensor errors, "
        "initial errors and noises, and the filter runs again with the best of them, up to fourteen times",
    )

    rules: ClassVar[Rules] = (
        (lambda s: s.kind not in SHIPPED,
         'kind = "{s.kind}" is the filter of a project; it stands in [[filters]], beside that of [filter]'),
        (lambda s: s.kind == "invariant" and s.loop == "open",
         'kind = "invariant" feeds back after each reading; it needs loop = "closed"'),
        (lambda s: s.kind not in LINEAR and s.smooth,
         'kind = "{s.kind}" has no smoother; smooth needs kind = "error-state" or "invariant"'),
        (lambda s: s.kind != "error-state" and s.backward,
         'kind = "{s.kind}" has no filter in reverse time; backward needs kind = "error-state"'),
        (lambda s: s.alignment == "by-course" and s.alignment_s is None,
         'alignment = "by-course" needs alignment_s: until the vehicle moves, and a little longer'),
        (lambda s: s.alignment == "in-motion" and s.alignment_s is None,
         'alignment = "in-motion" needs alignment_s: a minute or two that include turns'),
        (lambda s: s.alignment == "in-motion" and s.alignment_s < LEAST_IN_MOTION_S,
         f"alignment_s = {{s.alignment_s:g}} must be at least {LEAST_IN_MOTION_S:g} for an alignment in motion"),
    )  # fmt: skip


class FurtherFilter(_FilterKeys):
    """A filter beside that of [filter] on the same readings, not smoothed; keys that are left out are as there."""

    name: str = Field(
        pattern=r"^[A-Za-z][\w-]*$", max_length=40, description="name of its solution in tables, plots and files"
    )

    rules = (
        (lambda s: s.name in (*TAKEN, *SCENARIO_ALGORITHMS),
         'name = "{s.name}" is the name of another solution of a run: choose another'),
    )  # fmt: skip

    @model_serializer(mode="wrap")
    def _given(self, dumped: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write the keys that are given, as the others are those of [filter]."""
        return {key: value for key, value in dumped(self).items() if key in self.model_fields_set}

    def beside(self, first: FilterSection) -> FilterSection:
        """Return its section with the keys that are left out from [filter]."""
        given = {key: getattr(self, key) for key in self.model_fields_set if key != "name"}
        return first.model_copy(update={"smooth": False, "backward": False, "diagnose": False, **given})


_Sensor = TypeVar("_Sensor", bound=AidingSensor)


def _own_item(name: str) -> Item | None:
    """Return the aiding sensor outside the package whose table has a name, if there is one."""
    ensure("aiding", name)
    return registered("aiding", name)


@cache
def _with_own(base: type[_Tables], sensors: tuple[tuple[str, type[AidingSensor]], ...]) -> type[_Tables]:
    """Return the tables of [aiding] with those of further sensors."""
    fields: Any = {name: (sensor | None, None) for name, sensor in sensors}
    made: type[_Tables] = create_model("AidingSection", __base__=base, __module__=__name__, **fields)
    return made


class _Tables(Section):
    """The aiding sensors of the filter. Each table switches on one sensor."""

    @model_validator(mode="wrap")
    @classmethod
    def _own_sensors_too(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        sensors = {
            name: sensor_class(item)
            for name in (data if isinstance(data, dict) else ())
            if name not in cls.model_fields and (item := _own_item(name)) is not None
        }
        return cast(Self, _with_own(cls, tuple(sensors.items())).model_validate(data)) if sensors else handler(data)

    rules = ((lambda s: not s.sensors() and ", ".join(type(s).model_fields),
              "it has no sensor; give one or more of the tables {it}"),)  # fmt: skip

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Refuse a sensor of the package whose file cannot be used."""
        for name in data:
            if name in BROKEN:
                raise ValueError(f"[aiding.{name}]: {BROKEN[name]}")
        return data

    @classmethod
    def own_table(cls, name: str) -> type[AidingSensor] | None:
        """Return the class of a table outside the package, for the words of a mistake in it."""
        item = registered("aiding", name)
        return None if item is None or name in cls.model_fields else sensor_class(item)

    def sensors(self) -> dict[str, AidingSensor]:
        """Return the sensors that are switched on, by table."""
        return {name: sensor for name, sensor in self if sensor is not None}

    def sensor(self, kind: type[_Sensor]) -> _Sensor | None:
        """Return the sensor of a class, None if it is not switched on."""
        return next((sensor for sensor in self.sensors().values() if isinstance(sensor, kind)), None)

    @property
    def outages(self) -> tuple[tuple[float, float], ...]:
        """The spans without satellites, s, in order."""
        gnss = self.sensor(Gnss)
        return () if gnss is None else tuple(sorted(gnss.outages_s))


if TYPE_CHECKING:
    AidingSection = _Tables
else:
    AidingSection = create_model(
        "AidingSection",
        __base__=_Tables,
        __module__=__name__,
        __doc__=_Tables.__doc__,
        **{name: (sensor | None, None) for name, sensor in CLASSES.items()},
    )


def describe_sensors() -> dict[str, str]:
    """Return the tables of [aiding] with a description of each: the first line of each sensor's docstring by table; for
    an unusable sensor, the reason."""
    sentences = {name: (sensor.__doc__ or "").split("\n")[0] for name, sensor in CLASSES.items()}
    return sentences | {name: f"(cannot be used: {why})" for name, why in BROKEN.items()}
