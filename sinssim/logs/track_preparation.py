"""The curve of the table [track], computed once for all uses: duration, plan, flight, report.

The samples of a recorded track are read from a file of any registered format.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.earth.ellipsoids import Ellipsoid, normal
from sinssim.errors import InputError, unknown_name
from sinssim.logs.formats.registry import FORMATS, candidates, detect, format_of, read_file
from sinssim.logs.recorded_streams import FixStream, SolutionStream, Streams
from sinssim.logs.track_source import TrackSource
from sinssim.truth.curve import Curve
from sinssim.truth.motion import TrueEarth
from sinssim.truth.sampling import Channel, FlightEvent
from sinssim.truth.track.knots import Knots, TrackOptions, knots_of_path
from sinssim.truth.track.planned_route import Route, Timetable
from sinssim.truth.track.track_curve import TrackFit, assess, fitted
from sinssim.truth.track.track_samples import TrackSamples, check_numbers, checked_samples
from sinssim.truth.track.vehicle_attitude import VEHICLES
from sinssim.units import DEG

_NOUNS = {"gpx": "point", "kml": "point", "track-csv": "row"}


def track_format(path: Path, name: str | None) -> str:
    """Return the format of a file.

    Args:
        name: the format, if it is given.
    """
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


def read_samples(track: TrackSource, ellipsoid: Ellipsoid) -> TrackSamples:
    """Return the samples of a track's file, cut as the table says.

    Args:
        ellipsoid: reference ellipsoid, for the distances along a path without times.
    """
    path = Path(track.file or "")
    kind = track_format(path, track.format)
    if track.speed_mps is not None:
        samples = _travelled(path, kind, track.speed_mps, ellipsoid)
    else:
        samples = _samples_of(read_file(path, kind), track)
    return _cut(samples, track.start_s, track.end_s)


def _samples_of(streams: Streams, track: TrackSource) -> TrackSamples:
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


def _about_heights(stream: SolutionStream | FixStream, track: TrackSource) -> tuple[str, ...]:
    if track.height_offset_m or stream.datum == "ellipsoid" or not np.isfinite(stream.height).any():
        return ()
    what = "are above mean sea level" if stream.datum == "mean sea level" else "have an unknown datum"
    return (
        f"The file's heights {what}; they are taken as heights above the ellipsoid. track.height_offset_m adds the "
        "height of the geoid there.",
    )


def _travelled(path: Path, kind: str, speed: float, ellipsoid: Ellipsoid) -> TrackSamples:
    """Return samples a second apart on a path without times, travelled at a constant speed."""
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
    """A track that is ready to be a trajectory.

    Attributes:
        knots: knots of its curve.
        fit: the curve in numbers.
        channels: distances from the samples.
        events: waypoints and stops.
    """

    knots: Knots
    fit: TrackFit
    channels: Mapping[str, Channel]
    events: tuple[FlightEvent, ...] = ()

    @property
    def duration(self) -> float:
        """Duration, s."""
        return float(self.knots.time[-1])


@lru_cache(maxsize=4)
def prepare(track: TrackSource, earth: TrueEarth, digest: str) -> PreparedTrack:
    """Return the curve of a track; see `Track.prepared`.

    Args:
        digest: that of the track's file, so that a changed file is read again.
    """
    del digest  # part of the key only
    return _planned(track, earth) if track.waypoints else _of_recording(track, earth)


def _of_recording(track: TrackSource, earth: TrueEarth) -> PreparedTrack:
    options = _options(track)
    samples = checked_samples(read_samples(track, earth.figure), options.kind, track.max_speed_mps)
    samples = replace(samples, height=samples.height + track.height_offset_m)
    return PreparedTrack(*fitted(samples, options, earth.gravity, earth.figure))


def _options(track: TrackSource) -> TrackOptions:
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


def _planned(track: TrackSource, earth: TrueEarth) -> PreparedTrack:
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
