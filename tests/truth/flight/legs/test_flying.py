"""What each leg orders of the autopilot, step by step, of an aircraft that does what the test says."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from sinssim.truth.flight.aircraft import Aircraft, load_aircraft
from sinssim.truth.flight.autopilot import (
    BANK,
    HEADING,
    HEIGHT,
    INTERVAL,
    LOAD_FACTOR,
    PITCH,
    ROLL_RATE,
    AircraftState,
    Autopilot,
)
from sinssim.truth.flight.leg import LegBase, LegError
from sinssim.truth.flight.legs.ground import ParkedLeg, Rolling, TakeoffLeg, TaxiLeg, come_to_rest, on_wheels, turn_onto
from sinssim.truth.flight.legs.manoeuvres import BarrelRollLeg, DoubletLeg, LoopLeg
from sinssim.truth.flight.legs.straight import AltitudeLeg, HoldLeg, SpeedLeg
from sinssim.truth.flight.legs.turns import RacetrackLeg, STurnsLeg, TurnLeg

KNOT, G = 1852.0 / 3600.0, 9.80665
TRAINER: Aircraft = load_aircraft("c172x")


class Cockpit:
    """An autopilot and a state at 10 s of the flight; `law` moves the state at each step."""

    def __init__(self, law: Callable[[Autopilot, AircraftState], None] = lambda pilot, state: None) -> None:
        self.pilot, self.state, self.law = Autopilot(TRAINER, INTERVAL), AircraftState(), law
        self.state.time, self.state.tas, self.state.cas = 10.0, 60.0, 55.0
        self.state.height, self.state.ground_speed = 1000.0, 60.0
        self.pilot.height, self.pilot.airspeed = 1000.0, 55.0

    def fly(self, leg: LegBase, *seen: str, most: int = 20_000) -> list[tuple[Any, ...]]:
        """Fly a leg to its end and return some settings of the autopilot, or the time, at each step."""
        rows = []
        for _ in leg.fly(self.pilot, self.state, TRAINER.performance):
            rows.append(tuple(getattr(self.pilot if hasattr(self.pilot, name) else self.state, name) for name in seen))
            self.state.time += INTERVAL
            self.law(self.pilot, self.state)
            assert len(rows) < most
        return rows

    def wait(self, until: float) -> None:
        """Let the aircraft come to rest, to a tenth of a second after an instant at most."""
        for _ in come_to_rest(self.pilot, self.state):
            self.state.time += INTERVAL
            assert self.state.time < until + 0.1


def changes(rows: list[tuple[Any, ...]]) -> list[tuple[Any, int]]:
    """Return the values in turn, each with the number of steps it lasted."""
    found: list[tuple[Any, int]] = []
    for (value,) in rows:
        if found and found[-1][0] == value:
            found[-1] = (value, found[-1][1] + 1)
        else:
            found.append((value, 1))
    return found


def test_a_hold_lasts_to_half_a_step() -> None:
    assert len(Cockpit().fly(HoldLeg(type="hold", duration_s=2.0))) == 60
    assert len(Cockpit().fly(HoldLeg(type="hold", until_s=13.0))) == 90
    with pytest.raises(LegError, match="it must end at 9 s of the flight, but begins later"):
        Cockpit().fly(HoldLeg(type="hold", until_s=9.0))


@pytest.mark.parametrize(("control", "first"), [("elevator", -0.2), ("rudder", -0.2), ("aileron", 0.2)])
def test_a_doublet_moves_its_control_both_ways(control: str, first: float) -> None:
    """Stick back, right pedal and stick right are positive; JSBSim's elevator and rudder are so the other way."""
    cockpit = Cockpit()
    setattr(cockpit.pilot, control, 0.1)
    leg = DoubletLeg(type="doublet", control=control, amplitude=0.2, duration_s=0.5, recovery_s=1.0)
    rows = changes(cockpit.fly(leg, f"fixed_{control}"))
    assert [count for _, count in rows] == [15, 15, 30]
    assert [value for value, _ in rows[:2]] == pytest.approx([0.1 + first, 0.1 - first])
    assert rows[2][0] is None
    assert (cockpit.pilot.lateral, cockpit.pilot.vertical) == (HEADING, HEIGHT)
    step = DoubletLeg(type="doublet", control=control, amplitude=1.0, duration_s=0.5, shape="step", recovery_s=1.0)
    wide = changes(Cockpit().fly(step, f"fixed_{control}"))
    assert wide == [(math.copysign(1.0, first), 15), (None, 30)]


def test_a_change_of_speed_ends_within_half_a_metre_a_second() -> None:
    def slower(pilot: Autopilot, state: AircraftState) -> None:
        state.cas -= 0.02

    cockpit = Cockpit(slower)
    cockpit.state.cas = 90.0 * KNOT + 0.5 + 10.5 * 0.02
    assert len(cockpit.fly(SpeedLeg(type="speed", airspeed_kt=90.0))) == 11
    assert cockpit.pilot.airspeed == 90.0 * KNOT


def test_a_climb_slows_down_in_time() -> None:
    """v² = 2 · 0.8 · 0.7 m/s² · left, but no slower than the usual 2.5 m/s and no faster than asked for."""

    def rises(pilot: Autopilot, state: AircraftState) -> None:
        state.height += pilot.climb_limit * INTERVAL

    cockpit = Cockpit(rises)
    leg = AltitudeLeg(type="climb", altitude_m=1400.0, vertical_speed_mps=20.0)
    rows = cockpit.fly(leg, "climb_limit", "descent_limit")
    assert cockpit.pilot.height == 1400.0
    assert rows[0] == (20.0, 20.0)  # √(2 · 0.8 · 0.7 · 400) = 21.2
    height = 1000.0
    for climb, descent in rows:
        assert 1400.0 - height > 3.0
        expected = min(20.0, max(2.5, math.sqrt(1.12 * (1400.0 - height))))
        assert (climb, descent) == pytest.approx((expected, expected))
        height += climb * INTERVAL
    assert 1400.0 - height <= 3.0
    assert (cockpit.pilot.climb_limit, cockpit.pilot.descent_limit) == (2.5, 2.5)


def test_a_turn_banks_until_a_right_angle_is_left() -> None:
    """270° to the left from 20°: bank −30° over 180°, then the heading 110°; done within 0.7° and 2° of roll."""

    def turns(pilot: Autopilot, state: AircraftState) -> None:
        state.psi = (state.psi - math.radians(1.0)) % (2.0 * math.pi)
        state.phi = math.radians(-30.0) if pilot.lateral == BANK else state.phi + math.radians(0.35)

    cockpit = Cockpit(turns)
    cockpit.pilot.heading = cockpit.state.psi = math.radians(20.0)
    leg = TurnLeg(type="turn", angle_deg=270.0, direction="left", bank_deg=30.0)
    rows = cockpit.fly(leg, "lateral", "bank", "bank_limit")
    assert [row[0] for row in rows].index(HEADING) == pytest.approx(180, abs=1)
    assert {row[1] for row in rows[:180]} == {math.radians(-30.0)}
    assert {row[2] for row in rows} == {math.radians(30.0)}
    assert math.degrees(cockpit.pilot.heading) == pytest.approx(110.0)
    assert len(rows) == pytest.approx(270, abs=1)
    assert cockpit.pilot.bank_limit == pytest.approx(math.radians(20.0))  # the usual one again


def test_s_turns_lead_the_roll() -> None:
    """To the left first, 30°: at 60 m/s and 25° of bank the opposite roll begins 2 · g φ/V = 8.2° before."""

    def swings(pilot: Autopilot, state: AircraftState) -> None:
        state.psi += math.copysign(math.radians(0.5), pilot.bank) if pilot.lateral == BANK else -0.5 * state.psi

    cockpit = Cockpit(swings)
    leg = STurnsLeg(type="s_turns", swing_deg=30.0, bank_deg=25.0, turns=3, first="left")
    lead = math.degrees(2.0 * G * math.radians(25.0) / 60.0)
    rows = cockpit.fly(leg, "bank", "psi")
    banks = [value for value, _ in changes([(bank,) for bank, _ in rows])]
    assert [round(math.degrees(bank)) for bank in banks] == [-25, 25, -25]
    reversed_at = [math.degrees(later[1]) for row, later in pairwise(rows) if row[0] != later[0]]
    assert reversed_at == pytest.approx([lead - 30.0, 30.0 - lead], abs=0.51)
    assert cockpit.pilot.heading == 0.0
    assert cockpit.pilot.bank_limit == pytest.approx(math.radians(20.0))
    timed = Cockpit(swings)
    rows = timed.fly(STurnsLeg(type="s_turns", swing_deg=30.0, duration_s=3.0), "lateral", "bank")
    assert [row[0] for row in rows].count(BANK) == 90
    assert rows[0][1] > 0.0


def test_a_racetrack_measures_its_straight_legs() -> None:
    """300 m at 60 m/s are 5 s; two laps have four straight legs and four half circles, to the left."""

    def turns(pilot: Autopilot, state: AircraftState) -> None:
        if pilot.lateral == BANK or abs(math.remainder(pilot.heading - state.psi, 2.0 * math.pi)) > 0.01:
            state.psi = (state.psi - math.radians(2.0)) % (2.0 * math.pi)

    cockpit = Cockpit(turns)
    rows = cockpit.fly(RacetrackLeg(type="racetrack", leg_length_m=300.0, direction="left", laps=2), "lateral", "bank")
    assert rows[:150] == [(HEADING, 0.0)] * 150
    assert rows[150][0] == BANK
    assert math.degrees(rows[150][1]) == pytest.approx(-20.0)
    assert len(rows) == pytest.approx(4 * (150 + 90), abs=6)
    assert math.degrees(math.remainder(cockpit.pilot.heading, 2.0 * math.pi)) == pytest.approx(0.0, abs=1e-9)
    timed = Cockpit(turns).fly(RacetrackLeg(type="racetrack", leg_duration_s=4.0, direction="left"), "lateral")
    assert [row[0] for row in timed].index(BANK) == 120


def test_a_barrel_roll_pulls_up_first() -> None:
    """The climb angle reaches gT/2V = 0.65 rad before the roll by 2π less the lead of the bank loop, 2π/T/1."""

    def rolls(pilot: Autopilot, state: AircraftState) -> None:
        if pilot.lateral == ROLL_RATE:
            state.p = pilot.roll_rate
        else:
            state.climb += 0.5

    cockpit = Cockpit(rolls)
    cockpit.pilot.heading = 1.25
    leg = BarrelRollLeg(type="barrel_roll", direction="left", duration_s=8.0, load_factor_g=1.5, recovery_s=2.0)
    rows = cockpit.fly(leg, "lateral", "vertical", "load_factor", "roll_rate")
    pulling = [row for row in rows if row[0] == HEADING and row[1] == LOAD_FACTOR]
    rolling = [row for row in rows if row[0] == ROLL_RATE]
    path = 0.5 * G * 8.0 / 60.0
    assert len(pulling) == math.ceil(60.0 * math.sin(path) / 0.5)
    assert {row[2] for row in pulling} == {2.5}
    rate = 2.0 * math.pi / 8.0
    assert {(row[2], row[3]) for row in rolling} == {(1.5, -rate)}
    assert len(rolling) == math.ceil((2.0 * math.pi - rate / 1.0) / (rate * INTERVAL))
    assert len(rows) == len(pulling) + len(rolling) + 60
    assert (cockpit.pilot.heading, cockpit.pilot.lateral) == (1.25, HEADING)


def test_a_loop_stays_in_its_plane() -> None:
    """Heading 90°: on the way up a wing that is 0.1 rad low is raised; over the top the throttle is free again."""
    cockpit = Cockpit()
    pilot, state = cockpit.pilot, cockpit.state
    state.psi = pilot.heading = 0.5 * math.pi
    flown = LoopLeg(type="loop", load_factor_g=3.0, recovery_s=1.0).fly(pilot, state, TRAINER.performance)
    next(flown)
    assert (pilot.lateral, pilot.vertical, pilot.fixed_throttle, pilot.load_factor) == (
        ROLL_RATE,
        LOAD_FACTOR,
        1.0,
        3.0,
    )
    assert pilot.roll_rate == pytest.approx(0.0, abs=1e-15)
    state.theta, state.phi = 1.0, 0.1
    next(flown)
    assert pilot.roll_rate == pytest.approx(1.5 * -0.1)
    state.theta, state.phi, state.psi = 0.6, math.pi, 1.5 * math.pi  # inverted, nose up, facing back: at 145°
    next(flown)
    assert pilot.fixed_throttle == 1.0
    assert pilot.roll_rate == pytest.approx(0.0, abs=1e-12)
    state.theta = -0.6  # nose down, facing back: at 214°
    next(flown)
    next(flown)
    assert pilot.fixed_throttle is None
    state.theta, state.phi, state.psi = -1.2, 0.0, 0.5 * math.pi
    next(flown)
    state.theta = -0.1  # 354° are 6° before the end
    next(flown)
    assert (pilot.lateral, pilot.vertical, pilot.heading) == (HEADING, HEIGHT, 0.5 * math.pi)
    rest = 1
    for _ in flown:
        state.time += INTERVAL
        rest += 1
    assert rest == pytest.approx(31, abs=1)


def test_a_takeoff_in_its_parts() -> None:
    """Roll to 55 kt, pitch 8°, free of the runway at 12 m, then 80 kt and 150 m."""

    def accelerates(pilot: Autopilot, state: AircraftState) -> None:
        state.cas = state.ground_speed = state.cas + 0.05
        if pilot.vertical == PITCH or pilot.height > 300.0:
            state.height += 0.1

    cockpit = Cockpit(accelerates)
    state, pilot = cockpit.state, cockpit.pilot
    state.height, state.cas, state.ground_speed, state.psi, pilot.height = 200.0, 0.0, 0.0, 0.7, 200.0
    leg = TakeoffLeg(type="take_off", height_m=150.0)
    rows = cockpit.fly(leg, "fixed_throttle", "fixed_elevator", "vertical", "lateral", "steering")
    run = math.ceil(55.0 * KNOT / 0.05)
    assert rows[0] == (1.0, 0.0, HEIGHT, BANK, True)
    assert rows[run - 1] == (1.0, 0.0, HEIGHT, BANK, True)
    assert rows[run] == (1.0, None, PITCH, BANK, True)
    assert math.degrees(pilot.pitch) == pytest.approx(8.0)
    free = [row[3] for row in rows].index(HEADING)
    assert free == pytest.approx(run + 120, abs=1)  # 12 m at 0.1 m a step
    assert rows[free] == (1.0, None, PITCH, HEADING, False)
    resumed = [row[0] for row in rows].index(None)
    assert resumed == math.ceil(80.0 * KNOT / 0.05)  # 80 kt come before 60 m
    assert pilot.heading == pytest.approx(0.7)
    assert (pilot.height, pilot.airspeed, pilot.gear) == (350.0, 80.0 * KNOT, 1.0)
    assert state.height == pytest.approx(347.0, abs=0.11)
    slow = Cockpit(lambda pilot, state: setattr(state, "ground_speed", 4.9))
    slow.state.cas = 0.0
    with pytest.raises(LegError, match=r"after 30 s of take-off thrust it has only 4\.9 m/s"):
        slow.fly(TakeoffLeg(type="take_off"))
    short = Cockpit()
    short.state.cas, short.state.ground_speed = 20.0 * KNOT, 10.0
    with pytest.raises(LegError, match="after runway_m = 100 m it has 20 kt, but its rotation speed is 55 kt"):
        short.fly(TakeoffLeg(type="take_off", runway_m=100.0))


def test_speed_on_the_ground() -> None:
    """The reference changes by 0.5 m/s²; throttle 0.08 s/m of its excess, brakes 0.15 s/m beyond 0.3 m/s."""
    cockpit = Cockpit()
    pilot, state = cockpit.pilot, cockpit.state
    state.ground_speed, pilot.throttle = 4.0, 0.2
    rolling = Rolling(pilot, state)
    rolling.step(5.0)
    assert rolling.way == pytest.approx(4.0 / 30.0)
    assert pilot.fixed_throttle == pytest.approx(0.2 + 0.08 * 0.5 / 30.0)
    assert pilot.brakes == 0.0
    state.ground_speed = 6.0
    rolling.step(5.0)
    error = 4.0 + 1.0 / 30.0 - 6.0
    assert pilot.fixed_throttle == pytest.approx(0.2 + 0.02 * 0.5 / 30.0 / 30.0 + 0.08 * error)
    assert pilot.brakes == pytest.approx(0.15 * (-error - 0.3))
    assert rolling.way == pytest.approx(10.0 / 30.0)
    state.ground_speed = 0.0
    for _ in range(300):
        rolling.step(0.0)
    assert pilot.brakes == pytest.approx(0.05 * (300 - 242) / 30.0 - 0.15 * 0.3, abs=0.002)  # since the reference is 0
    fast = Cockpit()
    fast.state.ground_speed = 0.0
    Rolling(fast.pilot, fast.state).step(20.0)
    assert fast.pilot.fixed_throttle == pytest.approx(0.08 * 0.5 / 30.0)


def test_the_nose_wheel_turns_by_the_way_over_the_radius() -> None:
    cockpit = Cockpit()
    cockpit.state.ground_speed, cockpit.pilot.heading = 6.0, 0.1
    turn_onto(cockpit.pilot, cockpit.state, 2.0 * math.pi - 0.1, 40.0)
    assert cockpit.pilot.heading == pytest.approx(0.1 - 6.0 / 40.0 / 30.0)
    turn_onto(cockpit.pilot, cockpit.state, 0.097, 40.0)
    assert cockpit.pilot.heading == pytest.approx(0.097)
    cockpit.state.psi = 2.5
    on_wheels(cockpit.pilot, cockpit.state)
    pilot = cockpit.pilot
    assert (pilot.steering, pilot.heading, pilot.lateral, pilot.bank) == (True, 2.5, BANK, 0.0)
    assert (pilot.fixed_elevator, pilot.fixed_aileron, pilot.fixed_throttle) == (0.0, 0.0, 0.0)


def test_a_standstill_and_its_end() -> None:
    def brakes(pilot: Autopilot, state: AircraftState) -> None:
        state.ground_speed = max(0.0, state.ground_speed - 0.01)

    cockpit = Cockpit(brakes)
    cockpit.state.ground_speed, cockpit.state.psi = 0.8, 1.5
    rows = cockpit.fly(ParkedLeg(type="park", duration_s=3.0), "standing", "brakes")
    stopped = [row[0] for row in rows].index(True)
    assert stopped == 80
    assert rows[79][1] == rows[80][1] == 1.0
    assert len(rows) - stopped == 90
    moving = Cockpit()
    moving.state.ground_speed = 0.4
    with pytest.raises(LegError, match=r"the aircraft does not stop: it still rolls at 0\.40 m/s"):
        moving.wait(10.0 + 60.0 + 4.0 * 0.4)
    shaking = Cockpit()
    shaking.state.ground_speed, shaking.state.q = 0.2, -math.radians(0.5)
    with pytest.raises(LegError, match=r"it moves at 0\.2 m/s and turns at 0\.5 °/s"):
        shaking.wait(10.0 + 120.0)


def test_taxiing_that_takes_too_long_or_ends_askew() -> None:
    stuck = Cockpit()
    stuck.state.ground_speed = 0.5
    with pytest.raises(LegError) as error:
        stuck.fly(TaxiLeg(type="taxi", distance_m=200.0, speed_mps=4.0))
    # 60 s and three times 50 s at 0.5 m/s
    assert error.value.reason == ("after 105 m of distance_m = 200 it has taken three times as long as at 4 m/s")
    askew = Cockpit()
    askew.state.ground_speed, askew.state.psi = 5.0, math.radians(75.0)
    with pytest.raises(LegError, match="the turn is not finished at the end of distance_m = 50: 15° are left"):
        askew.fly(TaxiLeg(type="taxi", distance_m=50.0, heading_deg=90.0))


def test_engines_are_stopped_for_half_a_minute() -> None:
    """They run on for 2 s; 30 s for their thrust, and 3 s of the stop, at rest all the time."""

    def stops(pilot: Autopilot, state: AircraftState) -> None:
        if state.time > 12.0:
            state.engines_running = False

    cockpit = Cockpit(stops)
    cockpit.state.ground_speed = 0.0
    rows = cockpit.fly(ParkedLeg(type="park", duration_s=3.0, engines="off"), "engines", "standing")
    assert {row[0] for row in rows} == {False}
    assert len(rows) == pytest.approx((2.0 + 30.0 + 3.0) * 30.0, abs=3)
    assert [row[1] for row in rows].index(True) == pytest.approx(32.0 * 30.0, abs=2)
    running = Cockpit()
    running.state.ground_speed = 0.0
    with pytest.raises(LegError, match="the engines do not stop"):
        running.fly(ParkedLeg(type="park", duration_s=3.0, engines="off"))
    assert running.state.time == pytest.approx(100.0, abs=0.1)


def test_engines_start_and_idle() -> None:
    """Running after 4 s, 10 s of idling; after 90 s without it is an error."""

    def starts(pilot: Autopilot, state: AircraftState) -> None:
        state.engines_running = pilot.engines and state.time > 14.0

    cockpit = Cockpit(starts)
    cockpit.state.engines_running, cockpit.pilot.engines, cockpit.state.ground_speed = False, False, 0.0
    rows = cockpit.fly(ParkedLeg(type="park", duration_s=1.0, engines="running"), "engines", "brakes")
    assert set(rows) == {(True, 1.0)}
    assert len(rows) == pytest.approx((4.0 + 10.0 + 1.0) * 30.0, abs=4)
    dead = Cockpit()
    dead.state.engines_running, dead.state.ground_speed = False, 0.0
    with pytest.raises(LegError, match="the engines do not start within 90 s"):
        dead.fly(TaxiLeg(type="taxi", distance_m=50.0))
    assert dead.state.time == pytest.approx(100.0, abs=0.1)
