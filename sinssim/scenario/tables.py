"""The tables of a scenario file: one typed, frozen model each, with the unit of every quantity in its name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    Field,
    GetJsonSchemaHandler,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from sinssim.algorithms import PLATFORM
from sinssim.errors import shortened
from sinssim.logs.log import Log
from sinssim.logs.track.track import Track
from sinssim.mistakes import ONE_OF_SEVERAL
from sinssim.scenario.sections.aiding import AidingSection
from sinssim.scenario.sections.calibration import CalibrationSection
from sinssim.scenario.sections.ensemble import EnsembleSection
from sinssim.scenario.sections.filter import FilterSection
from sinssim.scenario.sections.navigation import NavigationSection
from sinssim.scenario.sections.output import OF_FRAME, OutputSection, RecordingSection
from sinssim.scenario.source import TABLES, TRAVELLING, AnySource, Given
from sinssim.scenario.use import Use
from sinssim.section import Name, Section, Sentence
from sinssim.sensors.imu.compensation import Compensation
from sinssim.sensors.imu.imu import Imu
from sinssim.system.own_content.layout import Item, items_of
from sinssim.system.own_content.registry import registered
from sinssim.truth.flight.flight import Flight
from sinssim.truth.gravity.true_gravity import TrueGravity
from sinssim.truth.motion import TrueEarth
from sinssim.truth.motions.analytic import ClosedFormMotion
from sinssim.truth.motions.closed_forms import AnyClosedForm
from sinssim.truth.motions.great_circle import GreatCircleFlight
from sinssim.truth.motions.isolator import Isolator
from sinssim.truth.motions.parked import ParkedVehicle
from sinssim.truth.motions.vibration import Vibration
from sinssim.truth.turntable.turntable import Turntable
from sinssim.truth.vehicles.drive import Drive
from sinssim.truth.vehicles.voyage import Voyage
from sinssim.truth.vertical_plane import OneComponent

IN_SPACE = (
    "vibration",
    "isolator",
    "truth",
    "gravity",
    "imu",
    "compensation",
    "aiding",
    "navigation",
    "filter",
    "output",
    "ensemble",
)
"""The tables of a run in three dimensions, which a run in a plane does not have."""


def _view(path: str) -> str:
    if not (path.endswith(".py") and os.path.isfile(path)):
        raise ValueError(f"there is no view {shortened(path)!r}; give the path of a Python file, with the ending .py")
    return path


class Tables(Section):
    """The contents of a scenario file."""

    name: Name = Field(description="short name, also the name of the run directory")
    description: Sentence = Field(default="", description="one sentence")
    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of the random numbers")
    use: Use = Field(
        default=(),
        description="own content: files (.py) and project folders, relative to this file; see own-content.md",
    )
    source: AnySource = Field(validation_alias=ONE_OF_SEVERAL)
    sequence: Turntable | None = Field(default=None, validation_alias="turntable")
    """The sequence of a recorded calibration: [turntable] beside [log]."""
    calibration: CalibrationSection | None = None
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
    filter: FilterSection | None = None
    output: OutputSection = Field(default=OutputSection())
    recording: RecordingSection = Field(default=RecordingSection())
    ensemble: EnsembleSection | None = None
    views: tuple[Annotated[str, AfterValidator(_view)], ...] = Field(
        default=(),
        description="files (.py) of your own views, relative to this file, recorded with the run; see views.md",
    )

    @model_validator(mode="before")
    @classmethod
    def _in_one_field(cls, data: Any) -> Any:
        """Gather the tables of which one is the source; [turntable] beside [log] is the sequence of its calibration."""
        if not isinstance(data, dict):
            return data
        rest = {key: value for key, value in data.items() if key not in TABLES or value is not None}
        beside = {"turntable"} if "log" in rest else set()
        given = tuple(Given(name, rest.pop(name)) for name in TABLES if name in rest and name not in beside)
        return {**rest, ONE_OF_SEVERAL: given}

    @model_validator(mode="before")
    @classmethod
    def _depends_on_other_tables(cls, data: Any) -> Any:
        """Fill in the defaults of [navigation]: the baro loop for what moves or has a barometer, and a platform."""
        navigation = data.get("navigation", {}) if isinstance(data, dict) else None
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

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates to record, given or those of the frame."""
        given = self.output.coordinates
        return OF_FRAME.get(self.navigation.frame, ()) if given is None else given

    @classmethod
    def file_keys(cls) -> dict[str, FieldInfo]:
        """Return the keys of a file, in the order in which one is written."""
        fields = dict(cls.model_fields)
        del fields["sequence"]  # which is [turntable]
        beside = {"turntable": {"calibration": fields.pop("calibration")}}
        found: dict[str, FieldInfo] = {}
        for key, field in fields.items():
            for name, table in TABLES.items() if key == "source" else ((key, field),):
                found |= {name: table, **beside.get(name, {})}
        return found

    @model_serializer(mode="wrap")
    def _as_in_a_file(self, dumped: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Give the source and the sequence the names of their tables."""
        found = dumped(self)
        tables = {"turntable": found.pop("sequence", None), self.source.table: found.pop("source", None)}
        found = {**dict.fromkeys(TABLES), **found, **tables}
        return {key: found[key] for key in self.file_keys() if key in found}

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
    def flight(self) -> Flight | None:
        """The table [flight]."""
        return self.source if isinstance(self.source, Flight) else None

    @property
    def parked(self) -> ParkedVehicle | None:
        """The table [parked]."""
        return self.source if isinstance(self.source, ParkedVehicle) else None

    @property
    def great_circle(self) -> GreatCircleFlight | None:
        """The table [great_circle]."""
        return self.source if isinstance(self.source, GreatCircleFlight) else None

    @property
    def motion(self) -> AnyClosedForm | None:
        """The table [motion]."""
        return self.source if isinstance(self.source, ClosedFormMotion) else None

    @property
    def track(self) -> Track | None:
        """The table [track]."""
        return self.source if isinstance(self.source, Track) else None

    @property
    def drive(self) -> Drive | None:
        """The table [drive]."""
        return self.source if isinstance(self.source, Drive) else None

    @property
    def voyage(self) -> Voyage | None:
        """The table [voyage]."""
        return self.source if isinstance(self.source, Voyage) else None

    @property
    def turntable(self) -> Turntable | None:
        """The table [turntable]: the motion, or the sequence of a recorded calibration."""
        return self.source if isinstance(self.source, Turntable) else self.sequence

    @property
    def log(self) -> Log | None:
        """The table [log]."""
        return self.source if isinstance(self.source, Log) else None

    @property
    def one_component(self) -> OneComponent | None:
        """The table [one_component]."""
        return self.source if isinstance(self.source, OneComponent) else None

    def own_items(self) -> list[Item]:
        """Return the content outside the package that the scenario chooses by name, in its order."""
        names: dict[str, Iterable[str]] = {
            "algorithms": self.navigation.algorithms,
            "frames": (self.navigation.frame,),
            "aiding": self.aiding.sensors() if self.aiding else (),
            "formats": [file.format for _, file in self.log.files() if file.format] if self.log else (),
        }
        found = dict.fromkeys(registered(kind, name) for kind, chosen in names.items() for name in chosen)
        return [item for item in found if item is not None]

    def __reduce__(self) -> Any:
        """Return how another process makes the scenario: from its contents if it names own content."""
        return (type(self).model_validate, (self.contents(),)) if self.own_items() else super().__reduce__()

    def contents(self, without: Iterable[str] = ()) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as TOML can hold them.

        Returns:
            Tables, arrays and values by key; `Scenario.model_validate` makes an equal scenario of them.
        """
        found = {key: value for key, value in self.as_written().items() if key not in set(without)}
        return dict(_without_none(found))

    def as_written(self) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as `model_dump`.

        Returns:
            Tables and values by key; without the tables of three dimensions for a run in a plane. `use` also has the
            files of own content that the scenario names and that neither a path nor an installed package brings.
        """
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
