"""The tables of a scenario file: one typed, frozen model each, with the unit of every quantity in its name.

A scenario navigates exactly one of several sources, each of which is a table. [output] and [recording] choose what is
kept of a run, and [calibration] how errors are estimated from a sequence on a turntable.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, NamedTuple, Self, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.errors import InputError, shortened
from sinssim.logs.log_settings import Log
from sinssim.logs.track import Track
from sinssim.scenario.ensemble_section import EnsembleSection
from sinssim.scenario.filter_section import AidingSection, FilterSection, FurtherFilter
from sinssim.scenario.navigation_section import NavigationSection, NavigatorSection
from sinssim.sensors.imu.compensation import Compensation
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.attitude import PLATFORM
from sinssim.system.extensions import Item, items_of
from sinssim.system.registries import register, registered
from sinssim.toml_mistakes import ONE_OF_SEVERAL
from sinssim.toml_section import ExperimentFile, Moment, Section, known_name, once
from sinssim.truth.flight.flight import Flight
from sinssim.truth.motion import TrueEarth, TrueGravity
from sinssim.truth.motions.analytic import ClosedFormMotion
from sinssim.truth.motions.balloon import BalloonMotion
from sinssim.truth.motions.coning_and_rocking import ConingMotion, ScullingMotion, SpinConeMotion, SpinRockMotion
from sinssim.truth.motions.drop import Drop
from sinssim.truth.motions.multirotor import MultirotorMotion
from sinssim.truth.motions.parked_and_great_circle import GreatCircleFlight, ParkedVehicle
from sinssim.truth.motions.rocket import Rocket
from sinssim.truth.motions.surface_vehicles import Drive, Voyage
from sinssim.truth.motions.turntable import RotationTableMotion, Turntable
from sinssim.truth.motions.vibration import Isolator, Vibration
from sinssim.truth.motions.walk import WalkMotion
from sinssim.truth.one_component import OneComponent


def _registered(paths: tuple[str, ...]) -> tuple[str, ...]:
    """Register the content of all paths, so that the tables that follow may name it; returns absolute paths."""
    absolute = [Path(path).expanduser().absolute() for path in paths]
    try:
        for path in absolute:
            register(items_of(path))
    except InputError as error:
        raise ValueError(str(error)) from error
    return tuple(map(str, absolute))


Use = Annotated[tuple[str, ...], AfterValidator(_registered)]
"""Files and project folders, registered when they are checked."""


S = TypeVar("S")


class Given(NamedTuple):
    """A table as it is given, which its contents do not name."""

    table: str
    contents: Any


def _the_only_one(given: tuple[Given, ...]) -> Given:
    if len(given) == 1:
        return given[0]
    names = [f"[{name}]" for name in TABLES]
    raise PydanticCustomError(
        "value_error" if given else "no_table",
        "{error}",
        {
            "tables": [(name,) for name in TABLES],
            "given": [(name,) for name, _ in given],
            "error": f"exactly one of {', '.join(names[:-1])} and {names[-1]} must give the motion; here "
            + (f"there are {' and '.join(f'[{name}]' for name, _ in given)}" if given else "all of them are missing"),
        },
    )


AnyClosedForm = Annotated[
    ConingMotion
    | ScullingMotion
    | SpinConeMotion
    | SpinRockMotion
    | RotationTableMotion
    | WalkMotion
    | MultirotorMotion
    | BalloonMotion,
    Field(discriminator="type"),
]
"""The table [motion], by its key `type`."""

_Contents = BeforeValidator(lambda given: given.contents if isinstance(given, Given) else given)

AnySource = Annotated[
    Annotated[Flight, _Contents, Tag("flight")]
    | Annotated[ParkedVehicle, _Contents, Tag("parked")]
    | Annotated[GreatCircleFlight, _Contents, Tag("great_circle")]
    | Annotated[AnyClosedForm, _Contents, Tag("motion")]
    | Annotated[Track, _Contents, Tag("track")]
    | Annotated[Drive, _Contents, Tag("drive")]
    | Annotated[Voyage, _Contents, Tag("voyage")]
    | Annotated[Rocket, _Contents, Tag("rocket")]
    | Annotated[Turntable, _Contents, Tag("turntable")]
    | Annotated[Log, _Contents, Tag("log")]
    | Annotated[OneComponent, _Contents, Tag("one_component")],
    Discriminator(lambda given: getattr(given, "table", None)),
    BeforeValidator(_the_only_one),
]
"""One of these tables."""

TABLES = {
    option.__metadata__[-1].tag: FieldInfo.from_annotation(option.__origin__ | None)
    for option in get_args(get_args(AnySource)[0])
}
"""The keys of these tables in a file."""

TRAVELLING = [
    option.__metadata__[-1].tag
    for option in get_args(get_args(AnySource)[0])
    if (kind := (get_args(option.__origin__) or (option.__origin__,))[0]).travels and not kind.leaves_air
]
"""Those of vehicles that leave their place and have air for a barometer."""


COORDINATES: dict[str, str] = {
    "earth-fixed": "position, velocity and attitude in Earth-fixed axes",
    "inertial": "position, absolute velocity and attitude in inertial axes, which are the Earth's at the start",
    "frame": "azimuth, velocity and heading along the axes of wander, free-azimuth or transverse",
    "conditional": "conditional latitude and longitude of the transverse frame's route, velocity and heading",
    **{name: f"latitude, longitude and height on the ellipsoid {name}" for name in ELLIPSOIDS},
}
"""Coordinates beside latitude, longitude, height and velocity north-east-down, by name."""

OF_FRAME: dict[str, tuple[str, ...]] = {
    "inertial": ("inertial",),
    "wander": ("frame",),
    "free-azimuth": ("frame",),
    "transverse": ("frame", "conditional"),
}
"""The coordinates in which a frame computes, which are the default; a frame that is not listed has none of its own."""

Coordinates = Annotated[str, AfterValidator(known_name("kind of coordinates", COORDINATES))]


class OutputSection(Section):
    """Streams in addition to those of every run: the true motion and each solution in other coordinates."""

    coordinates: tuple[Coordinates, ...] | None = Field(
        default=None,
        description=f"further coordinates to record: {', '.join(COORDINATES)}; default: those of the navigation frame",
    )
    angles: Literal["0..360", "-180..180", "-90..270", "continuous"] | None = Field(
        default=None,
        description="also record roll, pitch and heading, with the heading in this range in degrees, or as continuous "
        "angles, which count full turns",
    )


Keep = Literal["summary", "report", "streams", "all"]
Detail = Literal["full", "light", "none"]

KEEP: dict[str, str] = {
    "summary": "scenario.toml and summary.json",
    "report": "also report.html",
    "streams": "also every stream in full precision (streams/*.parquet)",
    "all": "also the recording for the viewer (recording.rrd)",
}
"""What is kept of a run, by name; each has what the one before it has."""


class RecordingSection(Section):
    """The files that a run keeps, and the level of detail of its recording."""

    keep: Keep = Field(
        default="all",
        description="contents of the run directory: " + "; ".join(f'"{name}": {what}' for name, what in KEEP.items()),
    )
    detail: Detail = Field(
        default="light",
        description='streams in recording.rrd: "light": the rows that a screen can show, with all extremes, gaps and '
        'the rows around events; "full": every row; "none": no recording. The key applies to keep = "all"; '
        "streams/*.parquet always contains every row",
    )

    @property
    def has_report(self) -> bool:
        """Whether the run directory has a report."""
        return self.keep != "summary"

    @property
    def has_streams(self) -> bool:
        """Whether the run directory has the streams."""
        return self.keep in ("streams", "all")

    @property
    def has_recording(self) -> bool:
        """Whether the run directory has a recording."""
        return self.keep == "all" and self.detail != "none"


_Error = Annotated[float, Field(ge=0.0, le=36_000.0)]


class CalibrationSection(Section):
    """Settings of `sinssim calibrate`, which estimates the sensor errors from the sequence of [turntable]."""

    method: Literal["separate", "systematic"] = Field(
        default="systematic",
        description="separate: from means in known positions and integrals over known turns; systematic: from the "
        "navigation errors during the sequence",
    )
    use: Literal["positions", "positions-and-rates"] = Field(
        default="positions-and-rates",
        description="data of the separate method: only the positions, or also the turns between them",
    )
    arms: bool | None = Field(
        default=None,
        description="whether the systematic method estimates the positions of the accelerometers; default: if "
        "imu.accel_arms_mm is not zero",
    )
    interval_s: float = Field(
        default=1.0, ge=0.01, le=60.0, description="systematic: time between two observations of the velocity"
    )
    velocity_sigma_mm_s: float = Field(
        default=0.01,
        ge=1e-6,
        le=1e3,
        description="systematic: 1σ of the velocity of the stationary IMU, due to the sway of the base",
    )
    attitude_sigma_deg: float = Field(
        default=10.0, ge=1e-3, le=30.0, description="systematic: 1σ of the nominal heading of the first position"
    )
    position_sigma_arcsec: _Error | None = Field(
        default=None, description="separate: assumed accuracy of the table's positions; default: that of [turntable]"
    )
    tilt_sigma_arcsec: _Error | None = Field(
        default=None, description="separate: assumed tilt of the table's base; default: that of [turntable]"
    )
    dwells_s: tuple[tuple[Moment, Moment], ...] = Field(
        default=(),
        description="for a log: start and end of each dwell; default: the intervals in which the gyros sense no "
        "rotation",
    )

    @model_validator(mode="after")
    def _dwells_are_in_order(self) -> Self:
        last = 0.0
        for number, (begin, end) in enumerate(self.dwells_s, start=1):
            if not last <= begin < end:
                raise ValueError(
                    f"dwells_s: dwell {number} from {begin:g} s to {end:g} s must begin after {last:g} s and end after "
                    "its beginning"
                )
            last = end
        return self


IN_SPACE = (
    "drop",
    "vibration",
    "isolator",
    "truth",
    "gravity",
    "imu",
    "compensation",
    "aiding",
    "navigation",
    "navigator",
    "filter",
    "filters",
    "output",
    "ensemble",
)
"""The tables of a run in three dimensions, which a run in a plane does not have."""


def _view(path: str) -> str:
    if not (path.endswith(".py") and os.path.isfile(path)):
        raise ValueError(f"there is no view {shortened(path)!r}; give the path of a Python file, with the ending .py")
    return path


class _SourceOf(Generic[S]):
    """The source of a scenario if it is of a kind, else None."""

    def __init__(self, kind: type[S]) -> None:
        self._kind = kind

    def __get__(self, scenario: Any, owner: Any) -> S | None:
        source = None if scenario is None else scenario.source
        return source if isinstance(source, self._kind) else None


class Tables(ExperimentFile):
    """The contents of a scenario file."""

    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of the random numbers")
    use: Use = Field(
        default=(),
        description="own content: files (.py) and project folders, relative to this file; see own-content.md",
    )
    source: AnySource = Field(validation_alias=ONE_OF_SEVERAL)
    sequence: Turntable | None = Field(default=None, validation_alias="turntable")
    """The sequence of a recorded calibration: [turntable] beside [log]."""
    calibration: CalibrationSection | None = None
    drop: Drop | None = None
    vibration: tuple[Vibration, ...] = Field(
        default=(), description="vibration of the sensor block, added to the motion"
    )
    isolator: Isolator | None = None
    truth: TrueEarth = Field(default=TrueEarth())
    gravity: TrueGravity | None = None
    imu: Imu = Field(default_factory=Imu)
    compensation: Compensation | None = None
    aiding: SerializeAsAny[AidingSection] | None = None
    navigation: NavigationSection = Field(default=NavigationSection())
    navigator: Annotated[tuple[NavigatorSection, ...], once("name", lambda navigator: navigator.name)] = Field(
        default=(),
        description="navigators of others, whose solutions are those of the run, too; see foreign-navigators.md",
    )
    filter: FilterSection | None = None
    filters: Annotated[tuple[FurtherFilter, ...], once("name", lambda filter: filter.name)] = Field(
        default=(), description="further filters on the same readings, whose solutions are those of the run, too"
    )
    output: OutputSection = Field(default=OutputSection())
    recording: RecordingSection = Field(default=RecordingSection())
    ensemble: EnsembleSection | None = None
    views: tuple[Annotated[str, AfterValidator(_view)], ...] = Field(
        default=(),
        description="files (.py) of your own views, relative to this file, recorded with the run; see views.md",
    )

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Gather the tables of which one is the source; [turntable] beside [log] is the sequence of its calibration."""
        data = cls._with_defaults(data)
        rest = {key: value for key, value in data.items() if key not in TABLES or value is not None}
        beside = {"turntable"} if "log" in rest else set()
        given = tuple(Given(name, rest.pop(name)) for name in TABLES if name in rest and name not in beside)
        return {**rest, ONE_OF_SEVERAL: given}

    @classmethod
    def _with_defaults(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Add the defaults of [navigation]: the baro loop for what moves or has a barometer, and a platform."""
        navigation = data.get("navigation", {})
        if isinstance(navigation, NavigationSection):
            navigation = {key: getattr(navigation, key) for key in navigation.model_fields_set}
        if not isinstance(navigation, dict):
            return data
        usual: dict[str, Any] = {"vertical": "free"} if navigation else {}
        if _inner(data, "aiding", "baro") is not None or any(data.get(name) is not None for name in TRAVELLING):
            usual["vertical"] = "baro-loop"
        if _inner(data, "imu", "sensor_set", "type") == PLATFORM:
            usual["algorithms"] = (PLATFORM, "quaternion")  # the platform itself, and strapdown navigation
        return {**data, "navigation": {**usual, **navigation}} if usual else data

    model_config = ConfigDict(ignored_types=(_SourceOf,))

    flight = _SourceOf(Flight)
    parked = _SourceOf(ParkedVehicle)
    great_circle = _SourceOf(GreatCircleFlight)
    motion = _SourceOf(ClosedFormMotion)
    track = _SourceOf(Track)
    drive = _SourceOf(Drive)
    voyage = _SourceOf(Voyage)
    rocket = _SourceOf(Rocket)
    log = _SourceOf(Log)
    one_component = _SourceOf(OneComponent)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates to record, given or those of the frame."""
        given = self.output.coordinates
        return OF_FRAME.get(self.navigation.frame, ()) if given is None else given

    @property
    def solution_names(self) -> tuple[str, ...]:
        """The solutions beside the aided one: of the algorithms, of other navigators, and of further filters."""
        return (*self.navigation.algorithms, *(of.name for of in self.navigator), *(of.name for of in self.filters))

    @classmethod
    def file_keys(cls) -> dict[str, FieldInfo]:
        """Return the keys of a file, in the order in which one is written."""
        fields = dict(cls.model_fields)
        del fields["sequence"]  # which is [turntable]
        beside = {"turntable": {"calibration": fields.pop("calibration")}}
        keys: dict[str, FieldInfo] = {}
        for key, field in fields.items():
            for name, table in TABLES.items() if key == "source" else ((key, field),):
                keys |= {name: table, **beside.get(name, {})}
        return keys

    @model_serializer(mode="wrap")
    def _as_in_a_file(self, dumped: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Give the source and the sequence the names of their tables."""
        contents = dumped(self)
        tables = {"turntable": contents.pop("sequence", None), self.source.table: contents.pop("source", None)}
        contents = {**dict.fromkeys(TABLES), **contents, **tables}
        return {key: contents[key] for key in self.file_keys() if key in contents}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema of a file, in which each of the sources is a key."""
        reference = handler(core)
        schema = handler.resolve_ref_schema(reference)
        properties = schema["properties"]
        sources = zip(TABLES, properties.pop(ONE_OF_SEVERAL)["oneOf"], strict=True)
        properties |= {name: {"anyOf": [kind, {"type": "null"}], "default": None} for name, kind in sources}
        schema["properties"] = {key: properties[key] for key in cls.file_keys()}
        schema["required"].remove(ONE_OF_SEVERAL)
        return reference

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with other values of some keys, of which one may be the table of another source."""
        inner = {"source" if key in TABLES else key: value for key, value in (update or {}).items()}
        return super().model_copy(update=inner, deep=deep)

    @property
    def turntable(self) -> Turntable | None:
        """The table [turntable]: the motion, or the sequence of a recorded calibration."""
        return self.source if isinstance(self.source, Turntable) else self.sequence

    def own_items(self) -> list[Item]:
        """Return the content outside the package that the scenario chooses by name, in its order."""
        names: dict[str, Iterable[str]] = {
            "algorithms": self.navigation.algorithms,
            "frames": (self.navigation.frame,),
            "aiding": self.aiding.sensors() if self.aiding else (),
            "filters": [of.kind for of in self.filters],
            "legs": [leg.type for leg in self.flight.legs] if self.flight else (),
            "formats": [file.format for _, file in self.log.files() if file.format] if self.log else (),
        }
        items = dict.fromkeys(registered(kind, name) for kind, chosen in names.items() for name in chosen)
        return [item for item in items if item is not None]

    def __reduce__(self) -> Any:
        """Return how another process makes the scenario: from its contents if it names own content."""
        return (type(self).model_validate, (self.contents(),)) if self.own_items() else super().__reduce__()

    def contents(self, without: Iterable[str] = ()) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as TOML can hold them: tables, arrays and
        values by key; `Scenario.model_validate` makes an equal scenario of them."""
        contents = {key: value for key, value in self.as_written().items() if key not in set(without)}
        return dict(_without_none(contents))

    def as_written(self) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as `model_dump`: tables and values by key;
        without the tables of three dimensions for a run in a plane. `use` also has the files of own content that the
        scenario names and that neither a path nor an installed package brings."""
        items = [item for item in self.own_items() if not item.package]
        brought = {item.file for path in self.use for item in items_of(Path(path))} if items else set()
        use = (*self.use, *(str(item.file) for item in items if item.file not in brought))
        return {**self.model_dump(exclude=None if self.source.in_space else set(IN_SPACE)), "use": use}

    def to_toml(self, about_filter: Iterable[str] = ()) -> str:
        """Return the scenario as a TOML file with every default written out."""
        import tomli_w

        text = tomli_w.dumps(self.contents())
        comment = "".join(f"# {line}\n" for line in about_filter)
        return text.replace("\n[filter]\n", f"\n[filter]\n{comment}")


def _inner(table: Any, *names: str) -> Any:
    """Return a value within tables, each a dictionary or a section; None if there is none."""
    for name in names:
        table = table.get(name) if isinstance(table, dict) else getattr(table, name, None)
    return table


def _without_none(value: Any) -> Any:
    """Drop missing optional values, which TOML cannot express, and turn tuples into arrays, at any depth."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, tuple) else value
