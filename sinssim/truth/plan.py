"""How each leg of a flight plan is flown: a generator that sets the autopilot's targets and yields at every step.

A generator returns when its leg is flown. Whether it takes too long is its caller's business.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from math import asin, atan2, cos, hypot, pi, remainder, sin

from sinssim.scenario.aircraft import Performance
from sinssim.scenario.legs import (
    AltitudeLeg,
    BarrelRollLeg,
    DoubletLeg,
    HoldLeg,
    LegBase,
    LoopLeg,
    ParkedLeg,
    RacetrackLeg,
    SpeedLeg,
    STurnsLeg,
    TakeoffLeg,
    TurnLeg,
    WaypointLeg,
)
from sinssim.truth.autopilot import BANK, HEADING, LOAD_FACTOR, PITCH, ROLL_RATE, Autopilot, G, Motion
from sinssim.units import DEG, KNOT

INTERVAL = 1.0 / 30.0
"""Time between steps of the autopilot [s]."""

_HALF_STEP = 0.5 * INTERVAL
_MEAN_RADIUS = 6_371_009.0  # for bearings and distances to a waypoint only [m]


@singledispatch
def fly_leg(leg: LegBase, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    """Fly one leg.

    Args:
        leg: the leg.
        pilot: the autopilot whose targets are set.
        motion: the aircraft's state, refreshed between steps.
        performance: what a pilot of the type flies by.

    Yields:
        Nothing, once for every step.
    """
    raise NotImplementedError(type(leg).__name__)


class LegError(Exception):
    """A leg that cannot be flown.

    Attributes:
        reason: why not.
        remedy: what would be right.
    """

    def __init__(self, reason: str, remedy: str) -> None:
        """Take reason and remedy."""
        super().__init__(reason)
        self.reason, self.remedy = reason, remedy


def _wait(motion: Motion, until: float) -> Iterator[None]:
    """Yield until an instant of the flight."""
    until -= _HALF_STEP
    while motion.time < until:
        yield


def _turn_by(angle: float, bank: float, pilot: Autopilot, motion: Motion) -> Iterator[None]:
    """Turn by a signed angle at a bank [rad]; the heading then held is exactly that angle from the one before."""
    side = 1.0 if angle > 0.0 else -1.0
    target = pilot.heading + angle
    remaining = angle + remainder(pilot.heading - motion.psi, 2.0 * pi)
    last = motion.psi
    pilot.bank_limit = bank
    # While more than a right angle is left the bank is held; the last part is the heading loop's, which rolls out.
    while abs(remaining) > 0.5 * pi:
        pilot.lateral, pilot.bank = BANK, side * bank
        yield
        remaining -= remainder(motion.psi - last, 2.0 * pi)
        last = motion.psi
    pilot.lateral, pilot.heading = HEADING, target % (2.0 * pi)
    while abs(remainder(pilot.heading - motion.psi, 2.0 * pi)) > 0.7 * DEG or abs(motion.phi) > 2.0 * DEG:
        yield
    pilot.bank_limit = pilot.usual_bank


@fly_leg.register
def _(leg: ParkedLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    pilot.brakes = 1.0
    yield from _wait(motion, motion.time + leg.duration_s)


@fly_leg.register
def _(leg: TakeoffLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    runway = motion.height
    pilot.brakes, pilot.steering, pilot.flaps = 0.0, True, performance.takeoff_flaps
    pilot.lateral, pilot.bank = BANK, 0.0
    pilot.heading = motion.psi
    pilot.fixed_elevator, pilot.fixed_aileron, pilot.fixed_throttle = 0.0, 0.0, performance.takeoff_throttle
    while motion.cas < performance.takeoff_kt * KNOT:
        yield
    pilot.fixed_elevator = pilot.fixed_aileron = None
    pilot.vertical, pilot.pitch = PITCH, performance.takeoff_pitch_deg * DEG
    while motion.height < runway + 12.0:
        yield
    pilot.steering = False
    pilot.gear = 0.0 if performance.retractable_gear else 1.0
    pilot.vertical = PITCH
    pilot.lateral = HEADING
    while motion.height < runway + min(60.0, 0.5 * leg.height_m) and motion.cas < performance.initial_climb_kt * KNOT:
        yield
    pilot.resume(motion)
    pilot.height, pilot.airspeed = runway + leg.height_m, performance.initial_climb_kt * KNOT
    pilot.flaps = 0.0
    while motion.height < pilot.height - 3.0:
        yield


@fly_leg.register
def _(leg: HoldLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    if leg.until_s is not None:
        if motion.time > leg.until_s + _HALF_STEP:
            raise LegError(
                f"it is to end at {leg.until_s:g} s of the flight, which was over before it began",
                "a later until_s, or shorter legs before it,",
            )
        yield from _wait(motion, leg.until_s)
    elif leg.duration_s is not None:
        yield from _wait(motion, motion.time + leg.duration_s)


@fly_leg.register
def _(leg: AltitudeLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    pilot.height = leg.altitude_m
    pilot.climb_limit = leg.vertical_speed_mps or pilot.usual_climb
    pilot.descent_limit = leg.vertical_speed_mps or pilot.usual_descent
    while abs(motion.height - pilot.height) > 3.0:
        yield
    pilot.climb_limit, pilot.descent_limit = pilot.usual_climb, pilot.usual_descent


@fly_leg.register
def _(leg: TurnLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    bank = pilot.usual_bank if leg.bank_deg is None else leg.bank_deg * DEG
    if leg.angle_deg is not None:
        angle = leg.angle_deg * DEG if leg.direction == "right" else -leg.angle_deg * DEG
    else:
        assert leg.heading_deg is not None  # the model makes sure of one of them
        angle = remainder(leg.heading_deg * DEG - pilot.heading, 2.0 * pi)
        if leg.direction == "right":
            angle %= 2.0 * pi
        elif leg.direction == "left":
            angle = -(-angle % (2.0 * pi))
    yield from _turn_by(angle, bank, pilot, motion)


@fly_leg.register
def _(leg: WaypointLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    pilot.bank_limit = pilot.usual_bank if leg.bank_deg is None else leg.bank_deg * DEG
    latitude, longitude = leg.latitude_deg * DEG, leg.longitude_deg * DEG
    while True:
        # Great-circle bearing and distance on the mean sphere.
        east = sin(longitude - motion.longitude) * cos(latitude)
        north = cos(motion.latitude) * sin(latitude) - sin(motion.latitude) * cos(latitude) * cos(
            longitude - motion.longitude
        )
        along = sin(motion.latitude) * sin(latitude) + cos(motion.latitude) * cos(latitude) * cos(
            longitude - motion.longitude
        )
        if _MEAN_RADIUS * atan2(hypot(north, east), along) < leg.capture_radius_m:
            break
        # The heading that takes the track there is the bearing less the drift.
        pilot.heading = atan2(east, north) - remainder(motion.track - motion.psi, 2.0 * pi)
        yield
    pilot.heading %= 2.0 * pi
    pilot.bank_limit = pilot.usual_bank


@fly_leg.register
def _(leg: RacetrackLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    bank = pilot.usual_bank if leg.bank_deg is None else leg.bank_deg * DEG
    half_circle = pi if leg.direction == "right" else -pi
    for _ in range(2 * leg.laps):
        if leg.leg_duration_s is not None:
            yield from _wait(motion, motion.time + leg.leg_duration_s)
        elif leg.leg_length_m is not None:
            flown = 0.0
            while flown < leg.leg_length_m:
                flown += motion.ground_speed * INTERVAL
                yield
        yield from _turn_by(half_circle, bank, pilot, motion)


@fly_leg.register
def _(leg: STurnsLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    bank = pilot.usual_bank if leg.bank_deg is None else leg.bank_deg * DEG
    middle = pilot.heading
    side = 1.0 if leg.first == "right" else -1.0
    end = motion.time + leg.duration_s if leg.duration_s is not None else None
    turns = 0
    pilot.lateral = BANK
    while turns != leg.turns and (end is None or motion.time < end - _HALF_STEP):
        pilot.bank = side * bank
        # The roll the other way begins early enough for the swing to end near its heading.
        while side * remainder(motion.psi - middle, 2.0 * pi) < leg.swing_deg * DEG - _lead(motion, bank):
            if end is not None and motion.time >= end - _HALF_STEP:
                break
            yield
        side = -side
        turns += 1
    pilot.lateral, pilot.heading, pilot.bank_limit = HEADING, middle, bank
    while abs(remainder(middle - motion.psi, 2.0 * pi)) > 0.7 * DEG or abs(motion.phi) > 2.0 * DEG:
        yield
    pilot.bank_limit = pilot.usual_bank


def _lead(motion: Motion, bank: float) -> float:
    """Return the heading change while a bank is rolled off, roughly: turn rate times two seconds [rad]."""
    return 2.0 * G * bank / max(motion.tas, 20.0)


@fly_leg.register
def _(leg: SpeedLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    pilot.airspeed = leg.airspeed_kt * KNOT
    while abs(motion.cas - pilot.airspeed) > 0.5:
        yield


@fly_leg.register
def _(leg: DoubletLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    name = f"fixed_{leg.control}"
    rest = getattr(pilot, leg.control)
    # JSBSim's elevator is positive nose down and its rudder positive nose left.
    size = leg.amplitude if leg.control == "aileron" else -leg.amplitude
    for part in (size, -size) if leg.shape == "doublet" else (size,):
        setattr(pilot, name, max(-1.0, min(1.0, rest + part)))
        yield from _wait(motion, motion.time + leg.duration_s)
    pilot.resume(motion)
    yield from _wait(motion, motion.time + leg.recovery_s)


@fly_leg.register
def _(leg: LoopLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    heading = pilot.heading
    pilot.lateral, pilot.vertical, pilot.fixed_throttle = ROLL_RATE, LOAD_FACTOR, 1.0
    angle, last = 0.0, motion.theta
    # The loop's plane is vertical and holds the nose at the entry; its normal points right: n0 = (-sinψ, cosψ, 0).
    normal_n, normal_e = -sin(motion.psi), cos(motion.psi)
    ahead_n, ahead_e = cos(motion.psi), sin(motion.psi)
    while angle < 2.0 * pi - 6.0 * DEG:
        cf, sf, st = cos(motion.phi), sin(motion.phi), sin(motion.theta)
        cp, sp = cos(motion.psi), sin(motion.psi)
        # The normal's components on the body's right and down axes say by how much to roll; no angle is singular.
        right = (sf * st * cp - cf * sp) * normal_n + (sf * st * sp + cf * cp) * normal_e
        down = (cf * st * cp + sf * sp) * normal_n + (cf * st * sp - sf * cp) * normal_e
        pilot.roll_rate = 1.5 * atan2(down, right)
        pilot.load_factor = leg.load_factor_g
        if angle > pi:  # over the top full power would only make the loop's second half wider
            pilot.fixed_throttle = None
        yield
        nose = atan2(sin(motion.theta), cos(motion.theta) * (cos(motion.psi) * ahead_n + sin(motion.psi) * ahead_e))
        angle += remainder(nose - last, 2.0 * pi)
        last = nose
    pilot.resume(motion)
    pilot.heading = heading
    yield from _wait(motion, motion.time + leg.recovery_s)


@fly_leg.register
def _(leg: BarrelRollLeg, pilot: Autopilot, motion: Motion, performance: Performance) -> Iterator[None]:
    heading = pilot.heading
    side = 1.0 if leg.direction == "right" else -1.0
    rate = 2.0 * pi / leg.duration_s
    # The lift turns once round and adds up to nothing, so gravity bends the path by gT/V: half of it up before.
    path = 0.5 * G * leg.duration_s / motion.tas
    pilot.vertical = LOAD_FACTOR
    while asin(max(-1.0, min(1.0, motion.climb / max(motion.tas, 20.0)))) < path:
        pilot.load_factor = 1.0 + leg.load_factor_g
        yield
    pilot.lateral, pilot.roll_rate = ROLL_RATE, side * rate
    rolled = 0.0
    while rolled < 2.0 * pi - rate / pilot.bank_rate:
        pilot.load_factor = leg.load_factor_g
        yield
        rolled += side * motion.p * INTERVAL
    pilot.resume(motion)
    pilot.heading = heading
    yield from _wait(motion, motion.time + leg.recovery_s)
