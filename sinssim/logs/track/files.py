"""Reads the samples of a track from a file of any registered format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sinssim.data import Array
from sinssim.earth.models import Ellipsoid
from sinssim.errors import InputError, unknown_name
from sinssim.logs.formats.registry import FORMATS
from sinssim.logs.read import candidates, detect, format_module, read_file
from sinssim.logs.streams import FixStream, SolutionStream, Streams
from sinssim.logs.track.source import TrackSource
from sinssim.truth.track.places import verticals
from sinssim.truth.track.samples import TrackSamples, check_numbers
from sinssim.units import DEG

_NOUNS = {"gpx": "point", "kml": "point", "track-csv": "row"}


def track_format(path: Path, name: str | None) -> str:
    """Return the format of a file.

    Args:
        name: the format, if it is given.

    Raises:
        InputError: the file cannot be read, or no format is recognised.
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

    Raises:
        InputError: the file cannot be used; the message says why.
    """
    path = Path(track.file or "")
    kind = track_format(path, track.format)
    if track.speed_mps is not None:
        samples = _travelled(path, kind, track.speed_mps, ellipsoid)
    else:
        samples = _recorded(read_file(path, kind), track)
    return _cut(samples, track.start_s, track.end_s)


def _recorded(streams: Streams, track: TrackSource) -> TrackSamples:
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
    read_path = getattr(format_module(kind), "read_path", None)
    points = None if read_path is None else read_path(path)
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
    up = verticals(points.latitude, points.longitude)
    normal = (1.0 - share)[:, None] * up[at] + share[:, None] * up[at + 1]
    return TrackSamples(
        points.source,
        points.noun,
        seconds[at] + share * (seconds[at + 1] - seconds[at]),
        np.arctan2(normal[:, 2], np.hypot(normal[:, 0], normal[:, 1])),
        np.arctan2(normal[:, 1], normal[:, 0]),
        points.height[at] + share * (points.height[at + 1] - points.height[at]),
        rows=points.rows[at],
    )


def _cut(samples: TrackSamples, start: float | None, end: float | None) -> TrackSamples:
    if start is None and end is None:
        return samples
    since = samples.time - samples.time[0]
    kept = (since >= (start or 0.0)) & (since <= (np.inf if end is None else end))
    if not kept.any():
        raise InputError(
            f"track.start_s = {start or 0.0:g} and track.end_s = {since[-1] if end is None else end:g} leave no "
            f"{samples.noun} of {samples.source}, which lasts {since[-1]:.6g} s."
        )
    return samples.part(kept)
