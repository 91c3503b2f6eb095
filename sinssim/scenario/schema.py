"""The scenario file: one typed, frozen model per table, with the unit of every quantity in its name."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, Self

from pydantic import Field, SerializeAsAny, field_validator, model_validator

from sinssim.algorithms import MEASURED_ATTITUDE, PLATFORM, schedule
from sinssim.calibration.section import CalibrationSection
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.frames import BARO_TIME_CONSTANT, check_correctable, listed
from sinssim.lazy import from_later_stage
from sinssim.own_content.in_scenario import Use, WithOwnContent, complete_use
from sinssim.scenario.combinations import check_compensation, check_filter, check_platform, check_rotation
from sinssim.scenario.sections.aiding import AidingSection
from sinssim.scenario.sections.compensation import CompensationSection
from sinssim.scenario.sections.ensemble import EnsembleSection
from sinssim.scenario.sections.filter import FilterSection
from sinssim.scenario.sections.flight import FlightSection
from sinssim.scenario.sections.imu import ImuSection
from sinssim.scenario.sections.isolator import IsolatorSection
from sinssim.scenario.sections.log import LogSection
from sinssim.scenario.sections.motion import MotionSection, VibrationSection
from sinssim.scenario.sections.navigation import NavigationSection, check_alignment
from sinssim.scenario.sections.one_component import OneComponentSection
from sinssim.scenario.sections.output import OF_FRAME, OutputSection, RecordingSection
from sinssim.scenario.sections.truth import GreatCircleSection, ParkedSection, TruthSection
from sinssim.scenario.sections.within_truth.gravity import GravitySection, check_gravity, check_gravity_of_log
from sinssim.scenario.variation import check_variation
from sinssim.section import Name, Sentence
from sinssim.sensors.aiding.gnss import GnssSection
from sinssim.system.short_repr import html_lines
from sinssim.truth.track.section import TrackSection
from sinssim.truth.turntable.section import TurntableSection
from sinssim.truth.vehicles.section import DriveSection, VoyageSection

_SOURCES = (
    "flight", "parked", "great_circle", "motion", "track", "drive", "voyage", "turntable", "log", "one_component",
)  # fmt: skip
"""The tables of which a scenario has exactly one."""

_MOVING = ("flight", "great_circle", "track", "drive", "voyage")
"""Sources of motion whose vehicle travels; their default height channel is the baro loop."""

_NOT_OF_A_LOG = {
    "vibration": "would add a motion to a recorded one",
    "isolator": "would change a recorded motion",
    "ensemble": "makes many runs of a simulation, but a recording is a single run",
}
"""Tables that do not apply to recorded sensors, with the reason."""

_BESIDE_PLATFORM = (PLATFORM, "quaternion")
"""The default algorithms of a scenario with a platform."""

_IN_SPACE = (
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
"""The tables of a run in three dimensions, which a one-component run does not have."""


class Scenario(WithOwnContent):
    """One run: a true motion, the IMU that measures it, and the algorithms that navigate with its measurements.

    Exactly one of `flight`, `parked`, `great_circle`, `motion`, `track`, `drive`, `voyage` and `turntable` gives the
    true motion, or `log` has recorded sensors, or `one_component` describes a run in a vertical plane, with its own
    sensors.
    """

    name: Name = Field(description="short name, also the name of the run directory")
    description: Sentence = Field(default="", description="one sentence")
    seed: int = Field(default=0, ge=0, le=2**63 - 1, description="seed of the random numbers")
    use: Use = Field(
        default=(),
        description="own content: files (.py) and project folders, relative to this file; see own-content.md",
    )
    flight: FlightSection | None = None
    parked: ParkedSection | None = None
    great_circle: GreatCircleSection | None = None
    motion: MotionSection | None = None
    track: TrackSection | None = None
    drive: DriveSection | None = None
    voyage: VoyageSection | None = None
    turntable: TurntableSection | None = None
    calibration: CalibrationSection | None = None
    log: LogSection | None = None
    one_component: OneComponentSection | None = None
    vibration: tuple[VibrationSection, ...] = Field(
        default=(), description="vibration of the sensor block, added to the motion"
    )
    isolator: IsolatorSection | None = None
    truth: TruthSection = Field(default=TruthSection())
    gravity: GravitySection | None = None
    imu: ImuSection = Field(default_factory=ImuSection)
    compensation: CompensationSection | None = None
    aiding: SerializeAsAny[AidingSection] | None = None
    navigation: NavigationSection = Field(default=NavigationSection())
    filter: FilterSection | None = None
    output: OutputSection = Field(default=OutputSection())
    recording: RecordingSection = Field(default=RecordingSection())
    ensemble: EnsembleSection | None = None
    views: tuple[str, ...] = Field(
        default=(),
        description="files (.py) of your own views, relative to this file, recorded with the run; see views.md",
    )

    @field_validator("views")
    @classmethod
    def _views_are_files(cls, views: tuple[str, ...]) -> tuple[str, ...]:
        for view in views:
            if not (view.endswith(".py") and os.path.isfile(view)):
                raise ValueError(
                    f"there is no view {shortened(view)!r}; give the path of a Python file, with the ending .py"
                )
        return views

    @model_validator(mode="before")
    @classmethod
    def _height_is_held(cls, data: Any) -> Any:
        """Fill in the default vertical channel: baro loop for what moves and with a barometer, free otherwise."""
        if not isinstance(data, dict):
            return data
        aiding, navigation = data.get("aiding"), data.get("navigation", {})
        barometer = aiding.get("baro") if isinstance(aiding, dict) else getattr(aiding, "baro", None)
        if barometer is None and all(data.get(name) is None for name in _MOVING):
            return data
        if isinstance(navigation, dict):
            navigation = {"vertical": "baro-loop", **navigation}
        elif isinstance(navigation, NavigationSection) and "vertical" not in navigation.model_fields_set:
            navigation = navigation.model_copy(update={"vertical": "baro-loop"})
        return {**data, "navigation": navigation}

    @model_validator(mode="before")
    @classmethod
    def _platform_is_navigated(cls, data: Any) -> Any:
        """Fill in the default algorithms beside a platform: the platform itself, and strapdown navigation."""
        imu = data.get("imu") if isinstance(data, dict) else None
        own = imu.get("sensor_set") if isinstance(imu, dict) else getattr(imu, "sensor_set", None)
        kind = own.get("type") if isinstance(own, dict) else getattr(own, "type", None)
        navigation = data.get("navigation", {}) if isinstance(data, dict) else None
        if kind != PLATFORM:
            return data
        if isinstance(navigation, dict):
            navigation = {"algorithms": _BESIDE_PLATFORM, **navigation}
        elif isinstance(navigation, NavigationSection) and "algorithms" not in navigation.model_fields_set:
            navigation = navigation.model_copy(update={"algorithms": _BESIDE_PLATFORM})
        return {**data, "navigation": navigation}

    @model_validator(mode="after")
    def _one_source_of_truth(self) -> Self:
        sources = [name for name in _SOURCES if name != "turntable" or self.log is None]  # it describes a log, too
        given = [f"[{name}]" for name in sources if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                "exactly one of [flight], [parked], [great_circle], [motion], [track], [drive], [voyage], [turntable], "
                "[log] and [one_component] must give the motion; here "
                + (f"there are {' and '.join(given)}" if given else "all of them are missing")
            )
        return self

    @model_validator(mode="after")
    def _one_component_has_its_own_sensors(self) -> Self:
        if self.one_component is not None:
            given = [f"[{name}]" for name in _IN_SPACE if name in self.model_fields_set and getattr(self, name)]
            if given:
                does, it = ("does", "it") if len(given) == 1 else ("do", "them")
                raise ValueError(
                    f"{' and '.join(given)} {does} not apply to [one_component], which has its own sensors and states: "
                    f"remove {it}"
                )
        return self

    @model_validator(mode="after")
    def _log_has_what_it_needs(self) -> Self:
        if self.log is None:
            return self
        for name, why in _NOT_OF_A_LOG.items():
            if name in self.model_fields_set and getattr(self, name):
                raise ValueError(f"[{name}] {why} ([log]): remove it")
        check_gravity_of_log(self.gravity, self.navigation)
        if "grade" not in self.imu.model_fields_set:
            raise ValueError(
                "imu.grade: give the grade of the IMU that recorded the log, or the nearest grade (`sinssim list "
                "grades`) and the values of its data sheet that differ; the filter assumes these errors"
            )
        if self.imu.faults:
            raise ValueError("imu.faults would have no effect: the data are recorded ([log]); remove them")
        if self.imu.sensor_set.type != "gyros":
            raise ValueError(
                f"[log] has three gyros and three accelerometers; imu.sensor_set.type = "
                f'"{self.imu.sensor_set.type}" is another set'
            )
        if self.log.outages is not None and self.filter is None:
            raise ValueError("log.outages need a [filter]: without a filter, GNSS is not used")
        return self

    @model_validator(mode="after")
    def _calibration_has_a_table(self) -> Self:
        if self.calibration is not None and self.turntable is None:
            raise ValueError("[calibration] needs the sequence that it works on: add [turntable]")
        if self.turntable is not None and self.log is not None and self.calibration is None:
            raise ValueError(
                "[turntable] with [log] describes the sequence of a calibration: add [calibration], or remove it"
            )
        return self

    @model_validator(mode="after")
    def _filter_has_what_it_needs(self) -> Self:
        plane, aligned = self.one_component, self.navigation.alignment
        others = {"log": self.log, "one_component": plane, "navigation.alignment": aligned}
        check_rotation(self.imu, self.filter, self.aiding, others)
        check_filter(self.filter, self.imu, self.aiding, self.log, self.navigation.vertical)
        return self

    @model_validator(mode="after")
    def _own_alignment_is_possible(self) -> Self:
        check_alignment(self.navigation, self.imu.sensor_set.type, self.log is not None, self.filter is not None)
        return self

    @model_validator(mode="after")
    def _filter_navigates_as_the_section_says(self) -> Self:
        if self.filter is None:
            return self
        try:
            check_correctable(self.navigation.algorithms[0])
        except InputError as error:
            raise ValueError(
                f"navigation.algorithms = {list(self.navigation.algorithms)}: [filter] navigates by the first of them, "
                f"and {str(error).rstrip('.')}: put another first, or remove [filter]"
            ) from error
        return self

    @model_validator(mode="after")
    def _no_sensor_is_faster_than_the_samples(self) -> Self:
        for name, sensor in (self.aiding.sensors() if self.aiding else {}).items():
            if sensor.rate_hz > self.imu.rate_hz:
                raise ValueError(
                    f"aiding.{name}.rate_hz = {sensor.rate_hz:g} must be at most imu.rate_hz = {self.imu.rate_hz:g}"
                )
        return self

    @model_validator(mode="after")
    def _alignment_has_what_it_needs(self) -> Self:
        if self.filter is None or self.filter.alignment_s is None:
            return self
        if self.log is not None:
            if self.filter.alignment == "in-motion" and (self.log.gnss is None or len(self.log.gnss.use) < 2):
                raise ValueError('filter.alignment = "in-motion" needs [log.gnss] with position and velocity')
            return self
        if self.aiding is None:
            return self
        wanted, gnss = self.filter.alignment_s, self.aiding.sensor(GnssSection)
        how = self.filter.alignment
        if how != "at-rest" and (gnss is None or not (gnss.position and gnss.velocity)):
            raise ValueError(f'filter.alignment = "{how}" needs [aiding.gnss] with position and velocity')
        source = self.parked or self.great_circle or self.motion or self.turntable
        if source is not None and wanted >= source.duration_s:
            raise ValueError(
                f"filter.alignment_s = {wanted:g} must be less than duration_s = {source.duration_s:g}: the filter "
                "needs time after the alignment"
            )
        return self

    @model_validator(mode="after")
    def _frame_has_the_coordinates(self) -> Self:
        frame = self.navigation.frame
        for name in self.output.coordinates or ():
            able = [other for other, own in OF_FRAME.items() if name in own]
            if name in ("frame", "conditional") and frame not in able:
                raise ValueError(
                    f'output.coordinates: "{name}" needs the frame {listed(able, "or")}; navigation.frame is "{frame}"'
                )
        return self

    def __repr__(self) -> str:
        there = [name for name in type(self).model_fields if name in self.model_fields_set and name != "name"]
        return f"Scenario({self.name}: {', '.join(there)}; print(scenario.to_toml()) shows all)"

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The coordinates to record, given or those of the frame."""
        given = self.output.coordinates
        return OF_FRAME.get(self.navigation.frame, ()) if given is None else given

    @model_validator(mode="after")
    def _rates_divide_the_samples(self) -> Self:
        if self.navigation.rates_hz is not None:
            try:
                schedule(self.navigation.rates_hz, self.imu.rate_hz)
            except InputError as error:
                raise ValueError(f"navigation.{error}") from error
        return self

    @model_validator(mode="after")
    def _time_constant_has_its_loop(self) -> Self:
        tau, vertical = self.navigation.baro_time_constant_s, self.navigation.vertical
        if tau != BARO_TIME_CONSTANT and vertical != "baro-loop":
            raise ValueError(
                f"navigation.baro_time_constant_s = {tau:g} would have no effect: it is a key of vertical = "
                f'"baro-loop"; here vertical = "{vertical}"'
            )
        return self

    @model_validator(mode="after")
    def _navigated_as_the_sensors_allow(self) -> Self:
        kind = self.imu.sensor_set.type
        if (kind == "attitude-sensor") != (MEASURED_ATTITUDE in self.navigation.algorithms):
            raise ValueError(
                f'imu.sensor_set.type = "attitude-sensor" requires navigation.algorithms = ["{MEASURED_ATTITUDE}"] '
                f'(with navigation.frame = "inertial"), and vice versa; here imu.sensor_set.type = "{kind}" and '
                f"navigation.algorithms = {list(self.navigation.algorithms)}"
            )
        check_platform(self.imu, self.navigation)
        check_gravity(self.gravity, self.navigation, self.truth, kind)
        check_compensation(self.compensation, kind)
        return self

    @model_validator(mode="after")
    def _ensemble_is_possible(self) -> Self:
        if self.ensemble is None:
            return self
        known = [*self.navigation.algorithms, *(["aided"] if self.filter else [])]
        if self.ensemble.solution is not None and self.ensemble.solution not in known:
            raise ValueError(f"ensemble.solution: {unknown_name('solution', self.ensemble.solution, known)}")
        if self.ensemble.vary:
            try:
                check_variation(self, self.ensemble, self.contents(without=("ensemble",)))
            except ValueError as error:
                raise ValueError(f"ensemble.{error}") from error
        return self

    def contents(self, without: Iterable[str] = ()) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as TOML can hold them.

        Args:
            without: tables to leave out.

        Returns:
            Tables, arrays and values by key; `Scenario.model_validate` makes an equal scenario of them.
        """
        found = {key: value for key, value in self.as_written().items() if key not in set(without)}
        return dict(_without_none(found))

    def as_written(self) -> dict[str, Any]:
        """Return the contents of the scenario's file with every default, as `model_dump`.

        Returns:
            Tables and values by key; without the tables of three dimensions for a one-component run.
        """
        found = self.model_dump(exclude=set(_IN_SPACE) if self.one_component is not None else None)
        return {**found, "use": complete_use(self)}

    def _repr_html_(self) -> str:
        """Return the plan for a notebook, as `sinssim check` prints it."""
        return html_lines(from_later_stage("sinssim.scenario.summary", "plan_lines")(self))

    def to_toml(self, about_filter: Iterable[str] = ()) -> str:
        """Return the scenario as a TOML file with every default written out.

        Args:
            about_filter: comment lines for [filter].

        Returns:
            Text that loads back to an equal scenario.
        """
        import tomli_w

        text = tomli_w.dumps(self.contents())
        comment = "".join(f"# {line}\n" for line in about_filter)
        return text.replace("\n[filter]\n", f"\n[filter]\n{comment}")


def _without_none(value: Any) -> Any:
    """Drop missing optional values, which TOML cannot express, and turn tuples into arrays, at any depth."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, tuple) else value
