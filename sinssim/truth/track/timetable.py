"""The timetable of a planned route: distance over time, with smooth changes of speed and stops.

A change of speed is a smooth step of degree 7 in time, so that the distance is four times continuously differentiable.
Its largest acceleration is 35/16 of the mean one. The vehicle accelerates from a waypoint on, and brakes ahead of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.truth.track.corner import integrated_step7
from sinssim.truth.track.route import Route

_PEAK = 35.0 / 16.0


@dataclass(frozen=True)
class _Phase:
    """A time at constant speed, or a change of speed."""

    begin: float
    duration: float
    distance: float  # at its beginning
    before: float
    after: float

    def travelled(self, t: Array) -> Array:
        """Return distances at instants, (N,) m."""
        x = (t - self.begin) / self.duration
        change = (self.after - self.before) * self.duration * integrated_step7(x)
        return np.asarray(self.distance + self.before * (t - self.begin) + change)

    @property
    def covered(self) -> float:
        """Distance covered in it, m."""
        return 0.5 * (self.before + self.after) * self.duration


class Timetable:
    """Distance along a route over time.

    Args:
        route: the route.
        acceleration: largest acceleration along it, m/s².

    Attributes:
        duration: s.
        passings: instant at which each waypoint is passed, or its stop begins, (W,) s.
        stops: beginning and end of each stop, by waypoint.

    Raises:
        InputError: a leg is too short for its changes of speed.
    """

    def __init__(self, route: Route, acceleration: float) -> None:
        self._route, self._acceleration = route, acceleration
        self._phases: list[_Phase] = []
        self._time = self._distance = 0.0
        self.stops: dict[int, tuple[float, float]] = {}
        passings = [0.0]
        last = len(route.waypoints) - 1
        self._stop(0)
        for leg in range(last):
            self._travel(leg)
            passings.append(self._time)
            self._stop(leg + 1)
        self.passings = np.array(passings)
        self.duration = self._time

    def distances(self, time: Array) -> Array:
        """Return distances over ground at instants, (N,) m."""
        begins = np.array([phase.begin for phase in self._phases])
        number = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, len(begins) - 1)
        out = np.empty(len(time))
        for k in np.unique(number):
            rows = number == k
            out[rows] = self._phases[k].travelled(time[rows])
        return out

    def _stop(self, number: int) -> None:
        seconds = self._route.waypoints[number].stop_s
        if seconds > 0.0:
            self.stops[number] = (self._time, self._time + seconds)
            self._add(seconds, 0.0, 0.0)

    def _add(self, duration: float, before: float, after: float) -> None:
        if duration <= 0.0:
            return
        phase = _Phase(self._time, duration, self._distance, before, after)
        self._phases.append(phase)
        self._time += duration
        self._distance += phase.covered

    def _travel(self, leg: int) -> None:
        """Travel from a waypoint to the next one: accelerate, go on at the leg's speed, brake."""
        route = self._route
        whole = float(route.passed[leg + 1] - route.passed[leg])
        speed = float(route.speeds[leg])
        ahead = self._speed_at(leg + 1)
        before = self._speed_at(leg)
        speedup, braking = (
            _PEAK * abs(speed - before) / self._acceleration,
            _PEAK * abs(speed - ahead) / self._acceleration,
        )
        needs = 0.5 * (before + speed) * speedup + 0.5 * (speed + ahead) * braking
        if needs > whole:
            raise InputError(
                f"the leg from {route.named(leg)} to {route.named(leg + 1)} has {whole:.5g} m, but its changes of "
                f"speed, from {before:g} to {speed:g} and to {ahead:g} m/s, need {needs:.5g} m at "
                f"{self._acceleration:g} m/s²: give a lower speed_mps, or a larger track.acceleration_mps2."
            )
        self._add(speedup, before, speed)
        self._add((whole - needs) / speed, speed, speed)
        self._add(braking, speed, ahead)
        self._distance = float(route.passed[leg + 1])  # without the rounding of the sum

    def _speed_at(self, number: int) -> float:
        """Return the speed at a waypoint: 0 at a stop, else the lower one of its two legs."""
        route = self._route
        if route.waypoints[number].stop_s > 0.0:
            return 0.0
        last = len(route.waypoints) - 1
        return float(min(route.speeds[max(number - 1, 0)], route.speeds[min(number, last - 1)]))
