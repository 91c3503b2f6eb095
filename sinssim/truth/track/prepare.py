"""From the table [track] to a curve, computed once for all uses: duration, plan, flight, report."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from sinssim.earth.models import ELLIPSOIDS
from sinssim.errors import InputError
from sinssim.system.user_file import open_file
from sinssim.truth.curve import Curve
from sinssim.truth.track.curve import fitted
from sinssim.truth.track.files import read_samples
from sinssim.truth.track.fit import TrackFit, assess
from sinssim.truth.track.knots import Knots, TrackOptions, knots_of_path
from sinssim.truth.track.route import Route
from sinssim.truth.track.samples import TrackSamples, checked_samples
from sinssim.truth.track.section import TrackSection
from sinssim.truth.track.timetable import Timetable
from sinssim.truth.track.vehicles import VEHICLES
from sinssim.truth.trajectory import Channel, FlightEvent
from sinssim.units import DEG

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


def prepared(section: TrackSection, gravity: str, ellipsoid: str) -> PreparedTrack:
    """Return the curve of a track; the last ones are kept.

    Args:
        section: the table [track].
        gravity: one of `sinssim.GRAVITY_MODELS`.
        ellipsoid: name of the ellipsoid.

    Returns:
        The knots of the curve and its numbers.

    Raises:
        InputError: file or route cannot be used; the message names file and row, or the waypoint.
    """
    return _prepared(section, gravity, ellipsoid, file_digest(section))


def file_digest(section: TrackSection) -> str:
    """Return the SHA-256 of a track's file, "" for a planned route.

    Args:
        section: the table [track].

    Returns:
        Hexadecimal digits.

    Raises:
        InputError: the file cannot be read.
    """
    if section.file is None:
        return ""
    try:
        with open_file(Path(section.file)) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(
            f"track.file = {section.file!r} cannot be read: {error.strerror}. Give the path of a recorded track, "
            "relative to the scenario's file."
        ) from error


@lru_cache(maxsize=4)
def _prepared(section: TrackSection, gravity: str, ellipsoid: str, digest: str) -> PreparedTrack:
    del digest  # part of the key: a changed file is read again
    return _planned(section, gravity, ellipsoid) if section.waypoints else _recorded(section, gravity, ellipsoid)


def _recorded(section: TrackSection, gravity: str, ellipsoid: str) -> PreparedTrack:
    earth, options = ELLIPSOIDS[ellipsoid], _options(section)
    samples = checked_samples(read_samples(section, earth), options.kind, section.max_speed_mps)
    samples = replace(samples, height=samples.height + section.height_offset_m)
    return PreparedTrack(*fitted(samples, options, gravity, earth))


def _options(section: TrackSection) -> TrackOptions:
    smoothing, chosen = section.smoothing_s, "as given"
    if smoothing is None and section.speed_mps is not None and section.position_sigma_m is None:
        smoothing, chosen = VEHICLES[section.vehicle].ramp, "to round the corners"
    return TrackOptions(
        section.vehicle,
        chosen,
        smoothing,
        section.height_smoothing_s,
        section.attitude_smoothing_s,
        section.position_sigma_m,
        section.height_sigma_m,
        section.gap_s,
        section.pitch,
        section.standstill_mps,
        (section.heading_deg or 0.0) * DEG,
        section.recorded_point_m,
    )


def _planned(section: TrackSection, gravity: str, ellipsoid: str) -> PreparedTrack:
    earth, vehicle = ELLIPSOIDS[ellipsoid], VEHICLES[section.vehicle]
    route = Route(section.waypoints, vehicle, earth)
    timetable = Timetable(route, section.acceleration_mps2 or vehicle.acceleration)
    count = max(8, int(np.ceil(timetable.duration / vehicle.knots)) + 1)
    if count > _MOST_KNOTS:
        raise InputError(
            f"the planned route takes {timetable.duration:.4g} s and needs {count} knots, more than {_MOST_KNOTS:g}: "
            "give a shorter route, or a higher speed_mps."
        )
    time = np.linspace(0.0, timetable.duration, count)
    options = _options(section)
    knots = knots_of_path(time, route.positions(timetable.distances(time)), options, gravity, earth)
    curve = Curve(knots.time, knots.position, knots.q_eb, gravity=gravity, ellipsoid=earth)
    latitude, longitude, height = (
        np.array([getattr(w, key) for w in section.waypoints]) for key in ("latitude_deg", "longitude_deg", "height_m")
    )
    places = TrackSamples("the plan", "waypoint", timetable.passings, latitude * DEG, longitude * DEG, height)
    fit, channels = assess(curve, knots, places, options, earth, planned=True)
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
