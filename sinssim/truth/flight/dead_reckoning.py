"""Dead reckoning over a flight plan: estimated end and duration of each leg, without flying.

Each leg begins at the end of the previous one, on a sphere of the Earth's mean radius, in the plan's steady wind.
Climbs, turns and changes of speed are steady; transients of roll and pitch, which take seconds, are neglected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sinssim.truth.flight.aircraft import Performance

GRAVITY = 9.81
"""Gravity for dead reckoning [m/s²]."""

_EARTH_RADIUS = 6371e3  # m
_SOUND = 340.294  # speed of sound at sea level, m/s
_TROPOPAUSE = 11_000.0  # m


@dataclass
class DeadReckoning:
    """State of the plan at the end of a leg, which is the beginning of the next leg.

    Attributes:
        performance: performance of the aircraft.
        roll_rate: largest roll rate of the autopilot, rad/s.
        airspeed: calibrated, m/s.
        altitude: m.
        heading: clockwise from north, rad.
        latitude, longitude: rad.
        wind: velocity of the air to the north and to the east, m/s.
        elapsed: since the start of the flight, s.
        turning: ∫ω² dt of the manoeuvres so far, rad²/s; changes of pitch are small and neglected.
        engines: whether the engines run.
    """

    performance: Performance
    roll_rate: float
    airspeed: float
    altitude: float
    heading: float
    latitude: float
    longitude: float
    wind: tuple[float, float]
    elapsed: float = 0.0
    turning: float = 0.0
    engines: bool = True

    def true_airspeed(self) -> float:
        """Return the true airspeed, m/s, by compressible flow in the standard atmosphere."""
        warm = max(1.0 - 2.25577e-5 * self.altitude, 0.751865)  # ratio of the temperature to that at sea level
        pressure = math.pow(warm, 5.25588)
        if self.altitude > _TROPOPAUSE:
            pressure *= math.exp(-(self.altitude - _TROPOPAUSE) / 6341.62)
        impact = math.pow(1.0 + 0.2 * (self.airspeed / _SOUND) ** 2, 3.5) - 1.0
        return _SOUND * math.sqrt(5.0 * warm * (math.pow(impact / pressure + 1.0, 2.0 / 7.0) - 1.0))

    def move(self, north: float, east: float) -> None:
        """Move the place by a distance on a constant course, as on a rhumb line.

        Args:
            north, east: components of the way over the ground, m.
        """
        before = self.latitude
        self.latitude = max(-0.5 * math.pi, min(0.5 * math.pi, before + north / _EARTH_RADIUS))
        self.longitude += east / (_EARTH_RADIUS * max(math.cos(0.5 * (before + self.latitude)), 1e-3))

    def ahead(self, way: float) -> None:
        """Move the place straight ahead, for example on the runway.

        Args:
            way: distance over the ground, m.
        """
        self.move(way * math.cos(self.heading), way * math.sin(self.heading))

    def straight(self, seconds: float, share: float = 1.0) -> float:
        """Keep the heading for a time, in the wind.

        Args:
            seconds: duration, s.
            share: mean speed ahead through the air, as a fraction of the true airspeed.

        Returns:
            The duration, s.
        """
        ahead = share * self.true_airspeed() * seconds
        north, east = self.wind
        self.move(ahead * math.cos(self.heading) + north * seconds, ahead * math.sin(self.heading) + east * seconds)
        return seconds

    def climb(self, altitude: float, rate: float) -> float:
        """Climb or descend straight ahead at a steady vertical speed.

        Args:
            altitude: height to reach, m.
            rate: magnitude of the vertical speed, m/s.

        Returns:
            The duration, s.
        """
        seconds = abs(altitude - self.altitude) / rate
        before = self.true_airspeed()
        self.altitude = altitude
        after = self.true_airspeed()
        return self.straight(seconds, 0.5 * (before + after) / after)

    def turn_rate(self, bank_deg: float | None) -> float:
        """Return the rate of a level turn, g tan(bank)/V, rad/s.

        Args:
            bank_deg: angle of bank, degrees; None: the aircraft's usual angle.

        Returns:
            Rate, rad/s.
        """
        return GRAVITY * math.tan(math.radians(bank_deg or self.performance.bank_deg)) / self.true_airspeed()

    def turning_of(self, angle: float, seconds: float, bank_deg: float | None) -> float:
        """Return ∫ω² dt of a turn, including rolling in and out.

        Args:
            angle: angle of the turn, rad.
            seconds: its duration, s.
            bank_deg: angle of bank, degrees; None: the aircraft's usual angle.

        Returns:
            The integral, rad²/s.
        """
        bank = math.radians(bank_deg or self.performance.bank_deg)
        return angle**2 / seconds + 2.0 * bank * self.roll_rate if seconds > 0.0 else 0.0

    def turn(self, angle: float, bank_deg: float | None) -> float:
        """Turn at a steady rate, in the wind.

        Args:
            angle: right positive, rad.
            bank_deg: angle of bank, degrees; None: the aircraft's usual angle.

        Returns:
            The duration, s.
        """
        seconds = abs(angle) / self.turn_rate(bank_deg)
        self.turning += self.turning_of(angle, seconds, bank_deg)
        radius, start, end = self.true_airspeed() / self.turn_rate(bank_deg), self.heading, self.heading + angle
        radius = math.copysign(radius, angle)
        north = radius * (math.sin(end) - math.sin(start)) + self.wind[0] * seconds
        east = radius * (math.cos(start) - math.cos(end)) + self.wind[1] * seconds
        self.move(north, east)
        self.heading = end % (2.0 * math.pi)
        return seconds

    def heading_along(self, track: float) -> float | None:
        """Return the heading that makes good a track in the wind.

        Args:
            track: direction over the ground, rad.

        Returns:
            Heading, rad; None if the wind is too strong.
        """
        across = self.wind[1] * math.cos(track) - self.wind[0] * math.sin(track)
        speed = self.true_airspeed()
        if abs(across) >= speed or self.ground_speed(track) <= 0.0:
            return None
        return (track - math.asin(across / speed)) % (2.0 * math.pi)

    def ground_speed(self, track: float) -> float:
        """Return the speed made good along a track.

        Args:
            track: direction over the ground, rad.

        Returns:
            Ground speed, m/s.
        """
        along = self.wind[0] * math.cos(track) + self.wind[1] * math.sin(track)
        across = self.wind[1] * math.cos(track) - self.wind[0] * math.sin(track)
        return along + math.sqrt(max(self.true_airspeed() ** 2 - across**2, 0.0))


def distance(latitude: float, longitude: float, latitude_to: float, longitude_to: float) -> float:
    """Return the distance between two places on the mean sphere, by the haversine formula.

    Args:
        latitude, longitude: of one place, rad.
        latitude_to, longitude_to: of the other, rad.

    Returns:
        Distance, m.
    """
    sine = math.sin((latitude_to - latitude) / 2.0) ** 2
    sine += math.cos(latitude) * math.cos(latitude_to) * math.sin((longitude_to - longitude) / 2.0) ** 2
    return 2.0 * _EARTH_RADIUS * math.asin(min(1.0, math.sqrt(sine)))


def bearing(latitude: float, longitude: float, latitude_to: float, longitude_to: float) -> float:
    """Return the bearing of the great circle from one place to another, at the first.

    Args:
        latitude, longitude: of the first place, rad.
        latitude_to, longitude_to: of the second, rad.

    Returns:
        Bearing, clockwise from north, rad.
    """
    apart = longitude_to - longitude
    east = math.sin(apart) * math.cos(latitude_to)
    north = math.cos(latitude) * math.sin(latitude_to) - math.sin(latitude) * math.cos(latitude_to) * math.cos(apart)
    return math.atan2(east, north)
