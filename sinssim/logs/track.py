"""The table [track] of a scenario: recorded or planned motion, whose curve is computed once for all uses.

The samples of a recorded track are read from a file of any registered format. What computes needs the compiler, and is
loaded for it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid, normal
from sinssim.errors import InputError, shortened, unknown_name
from sinssim.logs.formats import FORMATS, candidates, detect, format_of, read_file
from sinssim.logs.recorded_streams import FixStream, SolutionStream, Streams, geoid_height
from sinssim.system.files import open_file
from sinssim.toml_section import Heading, Keys, LeverArm, Speed
from sinssim.truth.motion import NORMAL_EARTH, Motion, Mounting, TrueEarth
from sinssim.truth.route_waypoint import Waypoint
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.truth.trajectory import Trajectory
from sinssim.units import DEG

if TYPE_CHECKING:
    from sinssim.truth.planned_route import Route, Timetable
    from sinssim.truth.track_curve import TrackFit
    from sinssim.truth.track_samples import TrackSamples
    from sinssim.truth.track_smoothing import Knots, TrackOptions

_Smoothing = Annotated[float, Field(ge=0.0, le=1e4)]
_Distance = Annotated[float, Field(gt=0.0, le=1e6)]
_Seconds = Annotated[float, Field(ge=0.0, le=1e9)]

_OF_FILES = (
    "format", "stream", "attitude", "start_s", "end_s", "height_offset_m", "recorded_point_m", "smoothing_s",
    "height_smoothing_s", "attitude_smoothing_s", "position_sigma_m", "height_sigma_m", "gap_s", "max_speed_mps",
    "speed_mps", "heading_deg",
)  # fmt: skip
_OF_ROUTES = ("acceleration_mps2",)


class Track(Motion):
    """Recorded or planned motion: a file of positions with times, with or without attitude, or waypoints. The program
    computes a smooth curve, along which the ideal sensors are exact; see tracks.md.
    """

    table: ClassVar[str] = "track"
    travels: ClassVar[bool] = True

    at_most_one = (
        Keys(("smoothing_s", "position_sigma_m"), "the smoothing"),
        Keys(("height_smoothing_s", "height_sigma_m"), "the smoothing of the height"),
    )
    rules = (
        (lambda s: (s.file is None) == (not s.waypoints) and (", but not both" if s.waypoints else "."),
         "file (a recorded track) or [[track.waypoints]] (a planned route) is needed{it}"),
        # a scenario that is written out has the defaults, too
        (lambda s: s.waypoints and s.changed(*_OF_FILES), "{it} would have no effect on a planned route: remove it"),
        (lambda s: not s.waypoints and s.changed(*_OF_ROUTES),
         "{it} would have no effect on a recorded track: remove it"),
        (lambda s: s.waypoints and (len(s.waypoints) < 2 or s.waypoints[0].speed_mps is None),
         "a planned route needs at least two waypoints, and waypoints.1.speed_mps"),
    )  # fmt: skip

    file: str | None = Field(default=None, description="recorded track, relative to this file")
    format: str | None = Field(
        default=None, description=f"file format: {', '.join(FORMATS)}; default: recognised from its contents"
    )
    stream: str | None = Field(
        default=None,
        description="stream of a file with several streams; default: the first solution, or else the "
        "first set of fixes",
    )
    vehicle: Literal["aircraft", "land", "sea"] = Field(
        default="land", description="kind of vehicle, which determines the assumed attitude if no attitude was recorded"
    )
    attitude: bool = Field(default=True, description="whether a recorded attitude is used")
    start_s: _Seconds | None = Field(default=None, description="start of the used part, counted from the first sample")
    end_s: _Seconds | None = Field(default=None, description="end of the used part, counted from the first sample")
    height_offset_m: Annotated[float, Field(ge=-1e5, le=1e5)] = Field(
        default=0.0,
        description="value that is added to recorded heights: the height of the geoid if they are above mean sea level",
    )
    recorded_point_m: LeverArm = Field(
        default=(0.0, 0.0, 0.0), description="from the vehicle's reference point to the recorded point, body axes"
    )
    smoothing_s: _Smoothing | None = Field(
        default=None,
        description="smoothing of the position: periods below 2π times this value are removed; with 0 the curve "
        "passes through the samples; default: by cross-validation",
    )
    height_smoothing_s: _Smoothing | None = Field(
        default=None, description="smoothing of the height; default: as smoothing_s"
    )
    attitude_smoothing_s: _Smoothing | None = Field(
        default=None, description="smoothing of a recorded attitude; default: by cross-validation"
    )
    position_sigma_m: _Distance | None = Field(
        default=None, description="instead of smoothing_s: rms horizontal distance of the curve from the samples"
    )
    height_sigma_m: _Distance | None = Field(
        default=None, description="the same for the height; default: as position_sigma_m"
    )
    gap_s: Annotated[float, Field(gt=0.0, le=1e9)] | None = Field(
        default=None,
        description="interval between samples beyond which the gap is bridged at uniform speed; default: 10 s, and at "
        "least 5 median intervals",
    )
    max_speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None,
        description="speed between two samples above which the file is refused; default: 1500 for an aircraft, 150 on "
        "land, 60 at sea",
    )
    speed_mps: Annotated[float, Field(gt=0.0, le=12_000.0)] | None = Field(
        default=None, description="speed along the path of a file without times"
    )
    pitch: Literal["slope", "flat"] | None = Field(
        default=None, description='assumed pitch; default: "slope", along the path; at sea "flat"'
    )
    standstill_mps: Speed | None = Field(
        default=None,
        description="speed above which the heading follows the motion again; the heading is held when the speed falls "
        "below half this value; "
        "default: 3 for an aircraft, 1 on land, 0.5 at sea",
    )
    heading_deg: Heading | None = Field(default=None, description="heading of a vehicle that never moves")
    acceleration_mps2: Annotated[float, Field(gt=0.0, le=1e3)] | None = Field(
        default=None,
        description="largest acceleration along a planned route; default: 1 for an aircraft and on land, 0.05 at sea",
    )
    waypoints: tuple[Waypoint, ...] = Field(default=(), max_length=10_000, description="a planned route")

    @field_validator("format")
    @classmethod
    def _known_format(cls, name: str | None) -> str | None:
        if name is not None:
            FORMATS.check(name)
        return name

    @model_validator(mode="after")
    def _ends_after_its_start(self) -> Self:
        if self.start_s is not None and self.end_s is not None and self.end_s <= self.start_s:
            raise ValueError(f"end_s = {self.end_s:g} must be later than start_s = {self.start_s:g}")
        return self

    @property
    def what(self) -> str:
        """The file's name, or "N waypoints"."""
        return shortened(self.file) if self.file is not None else f"{len(self.waypoints)} waypoints"

    def digest(self) -> str:
        """Return the SHA-256 of the file, in hexadecimal; "" for a planned route."""
        if self.file is None:
            return ""
        try:
            with open_file(Path(self.file)) as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise InputError(
                f"track.file = {self.file!r} cannot be read: {error.strerror}. Give the path of a recorded track, "
                "relative to the scenario's file."
            ) from error

    def prepared(self, earth: TrueEarth) -> PreparedTrack:
        """Return the curve of the track; the last ones are kept. An InputError names the file and row, or the waypoint,
        that cannot be used."""
        return prepare(self, earth, self.digest())

    def duration(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return the duration of the curve; see `Motion.duration`."""
        return self.prepared(earth).duration

    def turning(self, earth: TrueEarth = NORMAL_EARTH) -> float:
        """Return ∫ω² dt of the curve; see `Motion.turning`."""
        return self.prepared(earth).fit.turning

    def block_motion(self, block: Mounting, earth: TrueEarth, seed: int) -> Trajectory:
        """Return the motion of the block; see `Motion.block_motion`."""
        from sinssim.truth.track_curve import track_curve  # needs the compiler

        track = self.prepared(earth)
        return track_curve(
            track.knots,
            track.fit,
            block.lever_arm_m,
            block.q_bs,
            earth.gravity,
            earth.figure,
            track.events,
            track.channels,
        )


_NOUNS = {"gpx": "point", "kml": "point", "track-csv": "row"}


def track_format(path: Path, name: str | None) -> str:
    """Return the format of a file: `name`, if it is given."""
    if not path.exists() or path.is_dir():
        raise InputError(f"track.file = {str(path)!r} cannot be read: there is no such file.")
    if name is not None:
        return name
    if not candidates(path):
        raise InputError(
            f"track.file = {str(path)!r} is in no known format ({', '.join(FORMATS)}). Give track.format, or a CSV "
            "file whose first line names the columns time_s, latitude_deg, longitude_deg and height_m."
        )
    try:
        return detect(path)
    except InputError as error:
        raise InputError(f"track.file: {error}".replace("(--format NAME)", "(track.format)")) from error


def read_samples(track: Track, ellipsoid: Ellipsoid) -> TrackSamples:
    """Return the samples of a track's file, cut as the table says. `ellipsoid`: reference ellipsoid, for the distances
    along a path without times."""
    path = Path(track.file or "")
    kind = track_format(path, track.format)
    if track.speed_mps is not None:
        samples = _travelled(path, kind, track.speed_mps, ellipsoid)
    else:
        samples = _samples_of(read_file(path, kind), track)
    return _cut(samples, track.start_s, track.end_s)


def _samples_of(streams: Streams, track: Track) -> TrackSamples:
    from sinssim.truth.track_samples import TrackSamples

    known: dict[str, SolutionStream | FixStream] = {**streams.fixes, **streams.solutions}
    if not known:
        raise InputError(f"{streams.path} ({streams.format}) has neither fixes nor a solution: it is not a track.")
    name = track.stream or next(iter(streams.solutions or streams.fixes))
    if name not in known:
        raise InputError(f"track.stream: {unknown_name(f'stream of {streams.path.name}', name, known)}")
    stream = known[name]
    q_nb = stream.q_nb if isinstance(stream, SolutionStream) and track.attitude else None
    sigma = stream.position_sigma
    samples = TrackSamples(
        streams.path.name,
        _NOUNS.get(streams.format, "fix" if isinstance(stream, FixStream) else "row"),
        np.asarray(stream.time),
        stream.latitude,
        stream.longitude,
        stream.height,
        q_nb,
        None if sigma is None else np.stack([np.hypot(sigma[:, 0], sigma[:, 1]) / 2.0**0.5, sigma[:, 2]], axis=1),
        notes=(*streams.notes, *_about_heights(stream, track)),
    )
    lost = ~np.isfinite(samples.latitude) & ~np.isfinite(samples.longitude)
    if isinstance(stream, FixStream) and lost.any() and not lost.all():  # a receiver without a position says so
        samples = samples.part(~lost).noting(f"{int(np.count_nonzero(lost))} fixes without a position are left out.")
    return samples


def _about_heights(stream: SolutionStream | FixStream, track: Track) -> tuple[str, ...]:
    if track.height_offset_m or stream.datum == "ellipsoid" or not np.isfinite(stream.height).any():
        return ()
    what = "are above mean sea level" if stream.datum == "mean sea level" else "have an unknown datum"
    return (
        f"The file's heights {what}; they are taken as heights above the ellipsoid. track.height_offset_m adds the "
        f"height of the geoid there, {geoid_height(stream) or 0.0:.1f} m in EGM2008.",
    )


def _travelled(path: Path, kind: str, speed: float, ellipsoid: Ellipsoid) -> TrackSamples:
    """Return samples a second apart on a path without times, travelled at a constant speed."""
    from sinssim.truth.track_samples import TrackSamples, check_numbers

    points = format_of(kind).read_path(path)
    if points is None:
        raise InputError(
            f"track.speed_mps = {speed:g} would have no effect: {path.name} ({kind}) has no path without times. "
            "Remove it."
        )
    height, number = points[:, 2], np.arange(1, len(points) + 1)
    missing = ~np.isfinite(height)
    flat = np.where(missing, 0.0 if missing.all() else np.interp(number, number[~missing], height[~missing]), height)
    given = TrackSamples(path.name, "point", number.astype(np.float64), points[:, 1] * DEG, points[:, 0] * DEG, flat)
    check_numbers(given)
    steps = np.linalg.norm(np.diff(given.ecef(ellipsoid), axis=0), axis=1)
    given = given.part(np.concatenate([[True], steps > 0.0]))
    seconds = np.concatenate([[0.0], np.cumsum(steps[steps > 0.0])]) / speed
    notes = [f"The path has no times: it is travelled at {speed:g} m/s, and the smoothing rounds its corners."]
    if missing.any():
        notes.append(f"{np.count_nonzero(missing)} of {len(points)} points have no height; it is interpolated, or 0 m.")
    if len(given) < len(points):
        notes.append(f"Points equal to the previous point are left out: {len(points) - len(given)}.")
    return _filled(given, seconds).noting(*notes)


def _filled(points: TrackSamples, seconds: Array) -> TrackSamples:
    """Return the points of a path with others between them, at most a second apart, on great circles."""
    from sinssim.truth.track_samples import TrackSamples

    pieces = np.maximum(1, np.ceil(np.diff(seconds))).astype(int)
    at = np.append(np.repeat(np.arange(len(pieces)), pieces), max(len(pieces) - 1, 0))
    first = np.concatenate([[0], np.cumsum(pieces)[:-1]])
    share = np.append((np.arange(pieces.sum()) - np.repeat(first, pieces)) / np.repeat(pieces, pieces), 1.0)
    if not len(pieces):
        return replace(points, time=seconds)
    up = normal(points.latitude, points.longitude)
    along = (1.0 - share)[:, None] * up[at] + share[:, None] * up[at + 1]
    return TrackSamples(
        points.source,
        points.noun,
        seconds[at] + share * (seconds[at + 1] - seconds[at]),
        np.arctan2(along[:, 2], np.hypot(along[:, 0], along[:, 1])),
        np.arctan2(along[:, 1], along[:, 0]),
        points.height[at] + share * (points.height[at + 1] - points.height[at]),
        rows=points.rows[at],
    )


def _cut(samples: TrackSamples, start: float | None, end: float | None) -> TrackSamples:
    if start is None and end is None:
        return samples
    since = samples.time - samples.time[0]
    inside = (since >= (start or 0.0)) & (since <= (np.inf if end is None else end))
    if not inside.any():
        raise InputError(
            f"track.start_s = {start or 0.0:g} and track.end_s = {since[-1] if end is None else end:g} leave no "
            f"{samples.noun} of {samples.source}, which lasts {since[-1]:.6g} s."
        )
    return samples.part(inside)


_MOST_KNOTS = 5_000_000


@dataclass(frozen=True)
class PreparedTrack:
    """A track that is ready to be a trajectory."""

    knots: Knots  # knots of its curve
    fit: TrackFit  # the curve in numbers
    channels: Mapping[str, Channel]  # distances from the samples
    events: tuple[FlightEvent, ...] = ()  # waypoints and stops

    @property
    def duration(self) -> float:
        """Duration, s."""
        return float(self.knots.time[-1])


@lru_cache(maxsize=4)
def prepare(track: Track, earth: TrueEarth, digest: str) -> PreparedTrack:
    """Return the curve of a track; see `Track.prepared`. `digest`: that of the track's file, so that a changed file is
    read again."""
    del digest  # part of the key only
    return _planned(track, earth) if track.waypoints else _of_recording(track, earth)


def _of_recording(track: Track, earth: TrueEarth) -> PreparedTrack:
    from sinssim.truth.track_curve import fitted
    from sinssim.truth.track_samples import checked_samples

    options = _options(track)
    samples = checked_samples(read_samples(track, earth.figure), options.kind, track.max_speed_mps)
    samples = replace(samples, height=samples.height + track.height_offset_m)
    return PreparedTrack(*fitted(samples, options, earth.gravity, earth.figure))


def _options(track: Track) -> TrackOptions:
    from sinssim.truth.track_smoothing import TrackOptions
    from sinssim.truth.vehicle_attitude import VEHICLES

    smoothing, chosen = track.smoothing_s, "as given"
    if smoothing is None and track.speed_mps is not None and track.position_sigma_m is None:
        smoothing, chosen = VEHICLES[track.vehicle].ramp, "to round the corners"
    return TrackOptions(
        track.vehicle,
        chosen,
        smoothing,
        track.height_smoothing_s,
        track.attitude_smoothing_s,
        track.position_sigma_m,
        track.height_sigma_m,
        track.gap_s,
        track.pitch,
        track.standstill_mps,
        (track.heading_deg or 0.0) * DEG,
        track.recorded_point_m,
    )


def _planned(track: Track, earth: TrueEarth) -> PreparedTrack:
    from sinssim.truth.curve import Curve
    from sinssim.truth.planned_route import Route, Timetable
    from sinssim.truth.track_curve import assess
    from sinssim.truth.track_samples import TrackSamples
    from sinssim.truth.track_smoothing import knots_of_path
    from sinssim.truth.vehicle_attitude import VEHICLES

    vehicle = VEHICLES[track.vehicle]
    route = Route(track.waypoints, vehicle, earth.figure)
    timetable = Timetable(route, track.acceleration_mps2 or vehicle.acceleration)
    count = max(8, int(np.ceil(timetable.duration / vehicle.knots)) + 1)
    if count > _MOST_KNOTS:
        raise InputError(
            f"the planned route takes {timetable.duration:.4g} s and needs {count} knots, more than {_MOST_KNOTS:g}: "
            "give a shorter route, or a higher speed_mps."
        )
    time = np.linspace(0.0, timetable.duration, count)
    options = _options(track)
    knots = knots_of_path(time, route.positions(timetable.distances(time)), options, earth.gravity, earth.figure)
    curve = Curve(knots.time, knots.position, knots.q_eb, gravity=earth.gravity, ellipsoid=earth.figure)
    latitude, longitude, height = (
        np.array([getattr(w, key) for w in track.waypoints]) for key in ("latitude_deg", "longitude_deg", "height_m")
    )
    places = TrackSamples("the plan", "waypoint", timetable.passings, latitude * DEG, longitude * DEG, height)
    fit, channels = assess(curve, knots, places, options, earth.figure, planned=True)
    widest = max(((c.cut, i) for i, c in enumerate(route.corners) if c), default=None)
    if widest is not None:
        cut, number = widest
        fit = replace(
            fit, notes=(*fit.notes, f"Corners pass their waypoints at up to {cut:.4g} m, {route.named(number)}.")
        )
    return PreparedTrack(knots, fit, channels, tuple(_events(route, timetable)))


def _events(route: Route, timetable: Timetable) -> list[FlightEvent]:
    events = []
    for number, (waypoint, at) in enumerate(zip(route.waypoints, timetable.passings, strict=True)):
        name = waypoint.name or f"waypoint {number + 1}"
        if number in timetable.stops:
            begin, end = timetable.stops[number]
            events.append(FlightEvent(begin, f"{name}: at rest for {end - begin:g} s"))
        else:
            events.append(FlightEvent(float(at), name))
    return events
