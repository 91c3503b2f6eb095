"""From the table [track] to a curve, computed once for all uses: duration, plan, flight, report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sinssim.errors import InputError
from sinssim.logs.track.files import read_samples
from sinssim.logs.track.source import TrackSource
from sinssim.truth.channel import Channel, FlightEvent
from sinssim.truth.curve import Curve
from sinssim.truth.motion import TrueEarth
from sinssim.truth.track.curve import fitted
from sinssim.truth.track.fit import TrackFit, assess
from sinssim.truth.track.knots import Knots, TrackOptions, knots_of_path
from sinssim.truth.track.route import Route
from sinssim.truth.track.samples import TrackSamples, checked_samples
from sinssim.truth.track.timetable import Timetable
from sinssim.truth.track.vehicles import VEHICLES
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


@lru_cache(maxsize=4)
def prepare(track: TrackSource, earth: TrueEarth, digest: str) -> PreparedTrack:
    """Return the curve of a track; see `Track.prepared`.

    Args:
        digest: that of the track's file, so that a changed file is read again.
    """
    del digest  # part of the key only
    return _planned(track, earth) if track.waypoints else _recorded(track, earth)


def _recorded(track: TrackSource, earth: TrueEarth) -> PreparedTrack:
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
