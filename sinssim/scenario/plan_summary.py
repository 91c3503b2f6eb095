"""Summary of a scenario's plan in a few lines of text, and the files on which its numbers depend.

These are the files outside the package: own algorithms, frames, aiding sensors, grades and aircraft.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from pydantic import BaseModel

from sinssim.content import find_content, package_content
from sinssim.logs.log_settings import Log
from sinssim.logs.track import Track
from sinssim.scenario.notes import (
    barometer_of_the_day,
    coarse_rates,
    defaults_taken,
    earth_of_the_navigator,
    height_words,
    keys_without_effect,
    times_not_reached,
    torquer_taken,
)
from sinssim.scenario.planned_limits import check_route, check_times, expected_duration, limit_notes
from sinssim.scenario.tables import Tables
from sinssim.sensors.imu.grades import GRADE_TABLE, grade_file, grade_name
from sinssim.sensors.imu.imu_section import Imu
from sinssim.sensors.sensor_set_section import AttitudeSensor, Platform, Redundant, SixAccelerometers
from sinssim.system.extensions import Item, source_of
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.guidance import TRUTH
from sinssim.truth.flight.legs.waypoint import WaypointLeg
from sinssim.truth.motion import Motion, TrueEarth
from sinssim.truth.motions.analytic import ClosedFormMotion
from sinssim.truth.motions.surface_vehicles import SurfaceVehicle
from sinssim.truth.one_component import SENSOR_OF, WAYS, OneComponent


@dataclass(frozen=True)
class OwnFile:
    """A file outside the package on which the numbers of a run depend."""

    item: Item  # what it brings
    contents: bytes  # its bytes: of code as it was run, of others as they are

    @property
    def place(self) -> str:
        """Its place in a project folder, for example "algorithms/midpoint.py"."""
        file = f"{self.item.name}/" if self.item.kind in ("aircraft", "navigators") else ""
        return f"{self.item.kind}/{file}{self.item.file.name}"

    def to_json(self) -> dict[str, str]:
        """Return its entry in a summary."""
        item = self.item
        entry = {"kind": item.kind, "name": item.name, "file": str(item.file), "package": item.package}
        return {**entry, "sha256": hashlib.sha256(self.contents).hexdigest()}


def own_files(scenario: Tables) -> list[OwnFile]:
    """Return the files outside the package on which the numbers of a scenario depend: those of its own algorithms,
    frame and aiding sensors, of its grades, and of its aircraft."""
    items = scenario.own_items()
    master = getattr(scenario.aiding, "master", None)
    for grade in (scenario.imu.grade, getattr(master, "grade", None)):
        if grade and grade not in GRADE_TABLE:
            items.append(Item("grades", grade_name(grade), grade_file(grade)))
    if scenario.flight is not None:
        file = find_content("aircraft", scenario.flight.aircraft)
        items.append(Item("aircraft", file.parent.name, file))
    items += [Item("navigators", navigator.name, file) for navigator in scenario.navigator for file in navigator.files]
    shipped = [package_content(kind).resolve() for kind in ("grades", "aircraft")]
    items_outside = [item for item in items if not any(folder in item.file.resolve().parents for folder in shipped)]
    return [OwnFile(item, source_of(item)) for item in dict.fromkeys(items_outside)]


def own_digests(scenario: Tables) -> dict[str, str]:
    """Return the SHA-256 of the files of `own_files` by their place in a project folder: the digests; empty if no
    number depends on own content."""
    return {file.place: file.to_json()["sha256"] for file in own_files(scenario)}


# Long: one line for each table of the scenario, in the order of the console.
def plan_lines(scenario: Tables) -> Iterator[str]:
    """Summarise a scenario."""
    check_times(scenario)
    if isinstance(scenario.source, OneComponent):
        yield from _plane_lines(scenario, scenario.source)
        return
    check_route(scenario)
    duration = expected_duration(scenario)
    samples = duration * scenario.imu.rate_hz
    yield f"{scenario.name}: {scenario.description}".rstrip(": ")
    yield from _source_lines(scenario)
    if scenario.drop is not None:
        yield f"drop        {given(scenario.drop)}"
    for vibration in scenario.vibration:
        yield f"vibration   {vibration.coordinate}, {given(vibration, 'coordinate')}"
    if scenario.isolator is not None:
        yield f"isolator    {values_of(scenario.isolator)}"
    if scenario.gravity is not None:
        yield f"gravity     {field_words(scenario)}"
    navigation = scenario.navigation
    yield f"duration    about {_clock(duration)}, {int(float(f'{samples:.2g}')):,} samples"
    yield f"sensors     {sensor_words(scenario.imu)}"
    deviations = given(scenario.imu, "grade", "sensor_set")
    yield f"imu         {grade_name(scenario.imu.grade)}, {deviations or 'as in the grade'}"
    if scenario.compensation is not None:
        yield f"calibrated  {given(scenario.compensation) or 'perfect'}"
    if scenario.aiding is not None:
        for name, sensor in scenario.aiding.sensors().items():
            yield f"aiding      {name}, {sensor.rate_hz:g} Hz; {given(sensor, 'rate_hz') or 'all by default'}"
    yield f"navigation  {', '.join(navigation.algorithms)}; {given(navigation, 'algorithms') or 'all by default'}"
    for navigator in scenario.navigator:
        started = navigator.library or " ".join(navigator.command or ())
        yield f"navigator   {navigator.name}, {', '.join(navigator.inputs)}; {started}"
    if not scenario.source.recorded:
        yield f"height      {height_words(scenario)}"
    if scenario.filter is not None:
        named = scenario.filter.states
        states = "states by default" if named is None else ", ".join(named) or "no states of the inertial sensors"
        yield f"filter      {states}; {given(scenario.filter, 'states') or 'all by default'}"
    for further in scenario.filters:
        yield f"filter      {further.name}: {given(further, 'name') or 'that of [filter] again'}"
    if scenario.ensemble is not None:
        others = given(scenario.ensemble, "vary", "runs")
        yield f"ensemble    runs = {scenario.ensemble.runs}{', ' if others else ''}{others}"
        for variation in scenario.ensemble.vary:
            yield f"  varied    {variation.key}: {variation.type}, {values_of(variation, 'type', 'key')}"
    yield f"seed        {scenario.seed}"
    for file in own_files(scenario):
        yield f"own         {file.item.words}, {file.item.file}"
    for sentence in (
        *earth_of_the_navigator(scenario),
        *torquer_taken(scenario),
        *coarse_rates(scenario.imu),
        *barometer_of_the_day(scenario),
        *limit_notes(scenario),
        *times_not_reached(scenario, duration),
        *(() if scenario.source.recorded else keys_without_effect(scenario.imu, duration)),
        *defaults_taken(scenario.imu, duration),
    ):
        yield f"note        {sentence}"


def _source_lines(scenario: Tables) -> Iterator[str]:
    """Summarise what is navigated."""
    match scenario.source:
        case FlightPlan() as flight:
            yield from _flight_lines(flight)
        case Track() as track:
            yield from _track_lines(track, scenario.truth)
        case Log() as log:
            for name, file in log.files():
                yield f"log         {name}: {given(file) or file.file}"
            yield f"start       {given(log.start) or 'from the data'}"
            if log.outages is not None:
                yield f"outages     {given(log.outages)}"
        case ClosedFormMotion() as motion:
            yield f"motion      {motion.type}, {given(motion, 'type')}"
        case SurfaceVehicle():  # has no line
            return
        case Motion() as other:
            yield f"{other.table.replace('_', ' ') + ' ':<11} {given(other)}"


def _flight_lines(flight: FlightPlan) -> Iterator[str]:
    """Summarise a flight: its legs and the air."""
    start = flight.start
    place = f"{start.latitude_deg:g}°, {start.longitude_deg:g}°, {start.altitude_m:g} m"
    where = "on the runway" if start.on == "runway" else "in the air"
    yield f"flight      {flight.aircraft}, starts {where} at {place}, heading {start.heading_deg:g}°"
    for number, (leg, seconds) in enumerate(zip(flight.legs, flight.leg_durations(), strict=True), start=1):
        about = f"about {_clock(seconds)}"
        yield f"  leg {number:<3} {leg.type:<12} {about:<16} {leg_words(leg)}".rstrip()
        yield from (f"          to {place}" for place in route_words(leg))
    if flight.guidance.source != TRUTH:
        yield f"guidance    by its navigator, {given(flight.guidance)}"
    yield f"wind        {flight.wind.words()}"
    if flight.atmosphere is not None:
        yield f"atmosphere  {flight.atmosphere.words()}"
    yield f"turbulence  {values_of(flight.turbulence) if flight.turbulence else 'none'}"


def _track_lines(section: Track, earth: TrueEarth) -> Iterator[str]:
    """Summarise a track: how it fits its samples, what is assumed, and what is doubtful."""
    from sinssim.truth.track_curve import fit_lines

    track = section.prepared(earth)
    others = given(section, "file", "waypoints", "vehicle")
    yield f"track       {section.what}, {section.vehicle}{', ' if others else ''}{others}"
    for name, words in fit_lines(track.fit):
        yield f"  {name:<25} {words}"
    for event in track.events:
        yield f"  at {event.time:<22.1f} {event.text}"
    for sentence in (*track.fit.notes, *(f"WARNING: {warning}" for warning in track.fit.warnings)):
        yield f"  note{'':<21} {sentence}"


def _plane_lines(scenario: Tables, section: OneComponent) -> Iterator[str]:
    """Summarise a one-component run."""
    motion = section.motion
    lines = [("one component", WAYS[section.variant])]
    for name, unit, rows in (
        ("velocity", " m/s", motion.velocity_mps),
        ("height", " m", motion.height_m),
        ("pitch", "°", motion.pitch_deg),
    ):
        values = [value for _, value in rows]
        between = f"{values[0]:g}" if len(rows) == 1 else f"{min(values):g} to {max(values):g}"
        lines.append((name, f"{between}{unit}" + (f", {len(rows)} rows" if len(rows) > 1 else "")))
    readings = int(float(f"{section.duration_s * section.rate_hz:.2g}"))
    period = 2.0 * math.pi * math.sqrt(section.radius_m / section.gravity_mps2) / 60.0
    lines.append(
        ("duration", f"{_clock(section.duration_s)}, {readings:,} samples; the Schuler period is {period:.2f} min")
    )
    for name in ("accelerometer_x", "accelerometer_y", SENSOR_OF[section.variant]):
        lines.append((name.replace("_", " "), given(getattr(section, name)) or "no errors"))
    lines.append(("initial error", given(section.initial_error) or "none"))
    if section.altitude_effects:
        lines.append(("altitude", "acts on the motion; the equations of the system neglect it"))
    lines.append(("seed", str(scenario.seed)))
    yield f"{scenario.name}: {scenario.description}".rstrip(": ")
    yield from (f"{name:<18} {text}" for name, text in lines)


def sensor_words(section: Imu) -> str:
    """Describe the sensor set of a block."""
    match section.sensor_set:
        case SixAccelerometers(arm_m=arm):
            return f"six accelerometers on the faces of a cube, {arm:g} m from its centre, and no gyro"
        case AttitudeSensor() as sensor:
            return (
                f"three accelerometers and an attitude sensor, {given(sensor, 'type') or 'with the drift of its grade'}"
            )
        case Redundant() as redundant:
            return f"{redundant_words(redundant)}, {_MONITORING[redundant.mode]}"
        case Platform() as platform:
            errors = given(platform, "type")
            return f"three accelerometers and three gyros on a gimballed platform{', ' if errors else ''}{errors}"
        case _:
            return f"three accelerometers and three gyros{_OUTPUT[section.output]}"


_OUTPUT = {
    "increments": "",
    "mean-rates": ", mean rates",
    "instantaneous-rates": ", instantaneous rates integrated by trapezoids",
}
_MONITORING = {
    "none": "not monitored",
    "detect": "monitored: faults are detected",
    "exclude": "monitored: faulty sensors are excluded",
}
_LAYOUTS = {
    "cone-4": "on a cone",
    "cone-5": "on a cone",
    "dodecahedron": "perpendicular to the faces of a dodecahedron",
    "skewed-triads": "in two triads turned by 60° against each other",
}


def redundant_words(section: Redundant) -> str:
    """Describe the sensors of a redundant set."""
    count = len(section.axes)
    number = {4: "four", 5: "five", 6: "six"}.get(count, str(count))
    where = "along given directions" if section.directions is not None else _LAYOUTS[section.layout or "dodecahedron"]
    return f"{number} single gyros and {number} single accelerometers {where}"


def field_words(scenario: Tables) -> str:
    """Return the true gravity field, and what the navigator knows of it."""
    gravity, known = scenario.gravity, scenario.navigation.gravity_degree
    assert gravity is not None
    model = gravity.coefficients()
    if scenario.source.recorded and model is not None:
        return f"as recorded; the navigator knows {model.name} to degree {known}"
    field = "normal" if model is None else f"{model.name} to degree {model.degree}"
    if gravity.remainder is not None:
        field += f", random remainder of order {gravity.remainder.order}"
    return f"{field}; the navigator knows " + ("normal gravity" if known is None else f"it to degree {known}")


def given(section: BaseModel, *without: str) -> str:
    """Return the values of a table that differ from the defaults: "key = value, …", "" if all are defaults."""
    return _values({key: value for key, value in _other_than_defaults(section).items() if key not in without})


def leg_words(leg: BaseModel) -> str:
    """Return the values of a leg of a flight plan that differ from the defaults, but not the places of a route: "key =
    value, …", "" if all are defaults."""
    return given(leg, "type", "timeout_s", "waypoints")


def route_words(leg: BaseModel) -> list[str]:
    """Return the places of a route in words: one entry per place; none for a leg without a route."""
    if not isinstance(leg, WaypointLeg) or not leg.waypoints:
        return []
    places = []
    for number, place in enumerate(leg.waypoints):
        more = given(place, "name", "latitude_deg", "longitude_deg")
        where = f"{place.latitude_deg:g}°, {place.longitude_deg:g}°"
        places.append(f"{leg.label(number)} at {where}{', ' if more else ''}{more}")
    return places


def named_places(scenario: Tables) -> list[tuple[str, float, float]]:
    """Return the waypoints of a scenario that have a name: name, latitude and longitude, rad, in the
    order of the plan."""
    waypoints: list[tuple[str | None, float, float]] = []
    for leg in scenario.flight.legs if scenario.flight is not None else ():
        if isinstance(leg, WaypointLeg):
            places = enumerate(leg.places())
            waypoints += [(leg.label(number), place.latitude_deg, place.longitude_deg) for number, place in places]
    if scenario.track is not None:
        waypoints += [(place.name, place.latitude_deg, place.longitude_deg) for place in scenario.track.waypoints]
    return [(name, math.radians(lat), math.radians(lon)) for name, lat, lon in waypoints if name is not None]


def values_of(section: BaseModel, *without: str) -> str:
    """Return all values of a table, defaults included: "key = value, …"."""
    return _values(section.model_dump(exclude=set(without)))


def _other_than_defaults(section: BaseModel) -> dict[str, object]:
    """Return the values that differ from the defaults; pydantic's own way builds a serializer for each table."""
    fields = type(section).model_fields.items()
    values = {key: (getattr(section, key), field.get_default(call_default_factory=True)) for key, field in fields}
    return {key: value for key, (value, default) in values.items() if value != default}


def _values(values: Mapping[str, object]) -> str:
    return ", ".join(f"{key} = {_value(value)}" for key, value in values.items())


def _value(value: object) -> str:
    if isinstance(value, BaseModel):
        value = _other_than_defaults(value)
    if isinstance(value, dict):
        return "{" + _values(value) + "}"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _clock(seconds: float) -> str:
    """Write a duration in hours, minutes and, below ten minutes, seconds."""
    minutes, rest = divmod(round(seconds), 60) if seconds < 600.0 else (round(seconds / 60.0), 0)
    hours, minutes = divmod(minutes, 60)
    parts = [(hours, "h"), (minutes, "min"), (rest, "s")]
    return " ".join(f"{number} {unit}" for number, unit in parts if number) or "0 s"
