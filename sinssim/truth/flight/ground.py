"""What the legs on the ground share: engines, speed by throttle and brakes, the turn onto a heading, standing still."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, remainder

from sinssim.truth.flight.autopilot import BANK, INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.leg import LegError
from sinssim.units import DEG

STILL_SPEED = 1e-5
"""Speed below which an aircraft with its brakes set is held still [m/s]."""
STILL_RATE = 1e-5
"""Angular rate below which it is held still [rad/s]."""

START_LIMIT_S = 90.0
"""Time within which the engines must start [s]."""
IDLING_S = 10.0
"""Time at idle after the start, until the gear has come to rest [s]."""

_ACCELERATION = 0.5  # change of the reference of the ground speed [m/s²]
_THROTTLE, _INTEGRAL = 0.08, 0.02  # ground-speed error to throttle [s/m], and its integral [1/m]
_MOST_THROTTLE = 0.5
_HOLD = 0.05  # growth of the brakes' setting until the aircraft stops [1/s]
_BRAKE, _SLACK = 0.15, 0.3  # excess of the ground speed to brakes [s/m], beyond a slack [m/s]


def on_wheels(pilot: Autopilot, state: AircraftState) -> None:
    """Set the autopilot for rolling: surfaces neutral, the nose wheel steers to the heading.

    Args:
        state: the aircraft's state.
    """
    pilot.steering = True
    pilot.heading = state.psi
    pilot.lateral, pilot.bank = BANK, 0.0
    pilot.fixed_elevator = pilot.fixed_aileron = 0.0
    pilot.fixed_throttle = 0.0


def _run(state: AircraftState) -> bool:
    return state.engines_running


def start_engines(pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Start the engines if they are off, with the brakes set.

    Args:
        state: the aircraft's state.

    Yields:
        None, once per step.

    Raises:
        LegError: they do not start.
    """
    if _run(state):
        pilot.engines = True
        return
    pilot.engines, pilot.brakes, pilot.standing = True, 1.0, False
    on_wheels(pilot, state)
    limit = state.time + START_LIMIT_S
    while not _run(state):
        if state.time > limit:
            raise LegError(
                f"the engines do not start within {START_LIMIT_S:g} s",
                'an aircraft whose model has engines that start, or engines = "running" at the start',
            )
        yield
    until = state.time + IDLING_S
    while state.time < until:
        yield


class Rolling:
    """Holds a ground speed by throttle and brakes, and measures the way.

    Attributes:
        way: way over the ground, m.
    """

    def __init__(self, pilot: Autopilot, state: AircraftState) -> None:
        """Begin at the present speed.

        Args:
            state: the aircraft's state.
        """
        self._pilot, self._state = pilot, state
        self._reference, self._integral = state.ground_speed, pilot.throttle
        self._held = 0.0
        self.way = 0.0

    def step(self, speed: float) -> None:
        """Set throttle and brakes for the next interval.

        Args:
            speed: ground speed to reach, m/s.
        """
        pilot, state = self._pilot, self._state
        self.way += state.ground_speed * INTERVAL
        most = _ACCELERATION * INTERVAL
        self._reference += max(-most, min(most, speed - self._reference))
        error = self._reference - state.ground_speed
        throttle = self._integral + _THROTTLE * error
        if 0.0 < throttle < _MOST_THROTTLE or (throttle <= 0.0) == (error > 0.0):
            self._integral += _INTEGRAL * error * INTERVAL
        pilot.fixed_throttle = max(0.0, min(_MOST_THROTTLE, throttle))
        self._held = self._held + _HOLD * INTERVAL if self._reference == 0.0 else 0.0  # against the idle thrust
        pilot.brakes = max(0.0, min(1.0, _BRAKE * (-error - _SLACK) + self._held))


def turn_onto(pilot: Autopilot, state: AircraftState, heading: float, radius: float) -> None:
    """Turn the heading to steer towards a heading, as far as a turn of a radius goes in a step.

    Args:
        pilot: the autopilot; its `heading` is turned.
        state: the aircraft's state.
        heading: heading to reach, rad.
        radius: radius of the turn, m.
    """
    left = remainder(heading - pilot.heading, 2.0 * pi)
    most = state.ground_speed / radius * INTERVAL
    pilot.heading += max(-most, min(most, left))


def come_to_rest(pilot: Autopilot, state: AircraftState) -> Iterator[None]:
    """Brake to a standstill, until the gear has come to rest.

    Args:
        state: the aircraft's state.

    Yields:
        None, once per step.

    Raises:
        LegError: the brakes do not hold the aircraft.
    """
    rolling = Rolling(pilot, state)
    limit = state.time + 60.0 + 2.0 * state.ground_speed / _ACCELERATION
    while state.ground_speed > 0.3:
        rolling.step(0.0)
        if state.time > limit:
            raise LegError(
                f"the aircraft does not stop: it still rolls at {state.ground_speed:.2f} m/s",
                "a slower leg before it, or a weaker wind",
            )
        yield
    pilot.fixed_throttle, pilot.brakes = 0.0, 1.0
    pilot.heading = state.psi
    limit = state.time + 120.0
    while state.ground_speed > STILL_SPEED or max(abs(state.p), abs(state.q), abs(state.r)) > STILL_RATE:
        if state.time > limit:
            raise LegError(
                f"the aircraft does not come to rest with its brakes set: it moves at {state.ground_speed:.2g} m/s and "
                f"turns at {max(abs(state.p), abs(state.q), abs(state.r)) / DEG:.2g} °/s",
                "a weaker wind, or no gusts while it is parked",
            )
        yield
