"""What an aircraft can do in steady flight: the numbers of [envelope] in an aircraft.toml, by JSBSim's trim.

A point of height and airspeed is trimmed straight ahead at angles of climb γ. The steepest γ that can be trimmed is
that of full throttle, the steepest descent that of idle. The vertical speed of that flight is V sin γ at a constant
true airspeed; at a constant calibrated airspeed V grows with height, and it is V sin γ/(1 + V/g dV/dh).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from typing import Self

from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.aircraft import Envelope, load_aircraft
from sinssim.truth.flight.autopilot import G
from sinssim.truth.flight.jsbsim_model import STEP, loaded_model, quiet, trim_glide, widen_trim
from sinssim.units import DEG, FOOT, KNOT

_ROUNDS = 9  # bisections: 30° to 0.06°
_ABOVE_GROUND = 3000.0  # so that no wheel touches [m]
_FIRST, _NEAR = 1.0, 0.1  # first secant, and the change of the last, degrees
_SECANTS, _LEAST_SLOPE = 9, 2e-3  # of the throttle per degree
_SLOWEST, _FASTEST = 0.7, 1.4  # speeds up to which the ends of level flight are looked for, over those given


def trimmed_envelope(aircraft: str, heights: list[float], speeds: list[float], steepest_deg: float = 30.0) -> Envelope:
    """Compute the envelope of an aircraft from its model at increasing heights above sea level, m, and airspeeds, kt. A
    rate at a speed that cannot be trimmed is that of the nearest speed. The steepest climb and descent are looked for
    up to an angle."""
    with quiet(), TrimmedModel(aircraft, steepest_deg) as model:
        slowest = [model.end_of_level_flight(height, speeds, slow=True) for height in heights]
        fastest = [model.end_of_level_flight(height, speeds, slow=False) for height in heights]
        climbs = [[model.steepest(height, speed, 1.0) for speed in speeds] for height in heights]
        descents = [[model.steepest(height, speed, -1.0) for speed in speeds] for height in heights]
    return Envelope(
        height_m=tuple(heights),
        min_kt=tuple(slowest),
        max_kt=tuple(fastest),
        airspeed_kt=tuple(speeds),
        climb_mps=_filled(climbs, heights),
        descent_mps=_filled(descents, heights),
    )


def quick_envelope(
    aircraft: str, heights: list[float], speeds: list[float], steepest_deg: float, report: Callable[[float], None]
) -> Envelope:
    """Compute the envelope of an aircraft as `trimmed_envelope`, in a fifth of its time, without trims that fail.

    The angle of full or idle throttle is extrapolated from those that need less, and the ends of level flight are known
    to an eighth of the distance between the airspeeds. A height at which JSBSim trims nothing is left out if two others
    remain. `report` is called with the fraction done.
    """
    with quiet(), TrimmedModel(aircraft, steepest_deg) as model:
        ends, climbs, descents = [], list[list[float | None]](), list[list[float | None]]()
        for number, height in enumerate(heights):
            report(number / len(heights))
            ends.append(model.quick_ends(height, speeds))
            climbs.append([model.quick_steepest(height, speed, 1.0) for speed in speeds])
            report((number + 0.5) / len(heights))
            descents.append([model.quick_steepest(height, speed, -1.0) for speed in speeds])
    flown = [n for n, row in enumerate(climbs) if any(value is not None for value in row)]
    if len(flown) >= 2:  # a trim does not see that there is flight below and above
        heights, ends = [heights[n] for n in flown], [ends[n] for n in flown]
        climbs, descents = [climbs[n] for n in flown], [descents[n] for n in flown]
    return Envelope(
        height_m=tuple(heights),
        min_kt=tuple(slow for slow, _ in ends),
        max_kt=tuple(fast for _, fast in ends),
        airspeed_kt=tuple(speeds),
        climb_mps=_filled(climbs, heights),
        descent_mps=_filled(descents, heights),
    )


def glide_envelope(aircraft: str, heights: list[float], speeds: list[float]) -> Envelope:
    """Compute the envelope of a glider at increasing heights, m, and airspeeds, kt: its rate of climb is that of its
    sink, negative, at each airspeed."""
    with quiet(), TrimmedModel(aircraft, 0.0) as model:
        sinks = [[model.sink(height, speed) for speed in speeds] for height in heights]
    ends = [[speed for speed, sink in zip(speeds, row, strict=True) if sink is not None] or [0.0] for row in sinks]
    descents = _filled(sinks, heights)
    return Envelope(
        height_m=tuple(heights),
        min_kt=tuple(flown[0] for flown in ends),
        max_kt=tuple(flown[-1] for flown in ends),
        airspeed_kt=tuple(speeds),
        climb_mps=tuple(tuple(-sink for sink in row) for row in descents),
        descent_mps=descents,
    )


def _filled(rows: list[list[float | None]], heights: list[float]) -> tuple[tuple[float, ...], ...]:
    """Fill in the values that could not be trimmed by the nearest ones of the same height."""
    filled = []
    for height, row in zip(heights, rows, strict=True):
        known = [place for place, value in enumerate(row) if value is not None]
        if not known:
            raise InputError(f"the aircraft cannot be trimmed at {height:g} m: give lower heights.")
        nearest = [min(known, key=lambda other, place=place: abs(other - place)) for place in range(len(row))]  # type: ignore[misc]
        filled.append(tuple(round(row[place] or 0.0, 2) for place in nearest))
    return tuple(filled)


class TrimmedModel:
    """A model that is trimmed at points; it is loaded anew after a trim that spoiled it."""

    def __init__(self, name: str, steepest_deg: float) -> None:
        self._name, self._steepest = name, steepest_deg
        self._aircraft = load_aircraft(name)
        performance = self._aircraft.performance
        self._glides = performance.glider
        self._gear, self._stall = 0.0 if performance.retractable_gear else 1.0, performance.stall_alpha_deg
        self._folders = ExitStack()

    def __enter__(self) -> Self:
        self._load()
        return self

    def __exit__(self, *error: object) -> None:
        self._folders.close()

    def _load(self) -> None:
        self._folders.close()
        folder = str(self._folders.enter_context(Draft()).path)
        self._executive = loaded_model(self._name, self._aircraft, folder)
        widen_trim(self._executive, self._stall)
        self._executive.run_ic()  # computes the fuel
        self._fuel = 0.0 if self._glides else self._executive["propulsion/total-fuel-lbs"]

    def flies(self, height: float, speed_kt: float, angle_deg: float) -> bool:
        """Return whether steady flight at an angle of climb, which a glider does not choose, can be trimmed without
        stall."""
        import jsbsim

        e = self._executive
        self._place(height, speed_kt, angle_deg)
        if self._glides:
            return trim_glide(e, self._stall)
        try:
            e.run_ic()
            e["propulsion/set-running"] = -1
            e["simulation/do_simple_trim"] = 1
            trimmed = bool(e["aero/alpha-deg"] < self._stall)
        except jsbsim.BaseError:
            trimmed = False
        # A failed trim may leave a propeller without a speed (NaN) or empty tanks, and every later trim fails with it.
        thrust = e["propulsion/engine[0]/thrust-lbs"]
        if not (math.isfinite(thrust) and e["propulsion/total-fuel-lbs"] == self._fuel):
            self._load()
            return False
        return trimmed

    def _place(self, height: float, speed_kt: float, angle_deg: float) -> None:
        """Set the initial conditions of steady flight."""
        e = self._executive
        e["gear/gear-cmd-norm"] = e["gear/gear-pos-norm"] = self._gear
        e["ic/lat-geod-deg"], e["ic/long-gc-deg"], e["ic/psi-true-deg"] = 45.0, 0.0, 0.0
        e["ic/terrain-elevation-ft"] = (height - _ABOVE_GROUND) / FOOT
        e["ic/h-sl-ft"], e["ic/vc-kts"], e["ic/gamma-deg"] = height / FOOT, speed_kt, angle_deg

    def full_thrust(self, height: float, speed_kt: float) -> float:
        """Return the thrust of all engines after ten seconds at full throttle, over the weight."""
        e = self._executive
        self._place(height, speed_kt, 0.0)
        e.run_ic()
        e["propulsion/set-running"] = -1
        engines = range(e.get_propulsion().get_num_engines())
        for engine in engines:
            e[f"fcs/throttle-cmd-norm[{engine}]"] = 1.0
        for _ in range(round(10.0 / STEP)):
            e.run()
        return float(sum(e[f"propulsion/engine[{i}]/thrust-lbs"] for i in engines) / e["inertia/weight-lbs"])

    def sink(self, height: float, speed_kt: float) -> float | None:
        """Return the rate of sink of a glide, m/s; None if it cannot be trimmed."""
        if not self.flies(height, speed_kt, 0.0):
            return None
        return -_climb_speed(height, speed_kt, self._executive["ic/gamma-deg"])

    def steepest(self, height: float, speed_kt: float, sign: float) -> float | None:
        """Return the largest vertical speed up (sign 1) or down (−1), m/s, positive in that direction.

        None if no flight at this height and speed can be trimmed.
        """
        known = next((a for a in (0.0, -3.0, -6.0, -10.0, -16.0, 5.0) if self.flies(height, speed_kt, a)), None)
        if known is None:
            return None
        inside, outside = known, sign * self._steepest
        for _ in range(_ROUNDS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self.flies(height, speed_kt, middle) else (inside, middle)
        return sign * _climb_speed(height, speed_kt, inside)

    def quick_steepest(self, height: float, speed_kt: float, sign: float) -> float | None:
        """Return the largest vertical speed as `steepest`, by secants of the throttle over the angle of climb."""
        known = next((a for a in (0.0, -4.0, -8.0) if self.flies(height, speed_kt, a)), None)
        if known is None:
            return None
        goal, inside, throttle, outside = 0.5 * (1.0 + sign), known, self.throttle(), sign * self._steepest
        angle, failed = known + sign * _FIRST, False
        for _ in range(_SECANTS):
            if self.flies(height, speed_kt, angle):
                slope = (self.throttle() - throttle) / (angle - inside)
                inside, throttle = angle, self.throttle()
                angle += (goal - throttle) / max(slope, _LEAST_SLOPE)
            else:
                outside, failed = angle, True
            if failed and sign * (outside - angle) < _NEAR:
                angle = 0.5 * (inside + outside)  # a trim fails where the throttle is not proportional to the angle
            angle = min(angle, outside) if sign > 0.0 else max(angle, outside)
            if abs(angle - inside) < _NEAR:
                break
        return sign * _climb_speed(height, speed_kt, inside)

    def quick_ends(self, height: float, speeds: list[float]) -> tuple[float, float]:
        """Return the slowest and the fastest level flight between the given airspeeds, kt; 0 if there is none."""
        flown = [speed for speed in speeds if self.flies(height, speed, 0.0)]
        if not flown:
            return 0.0, 0.0
        ends = []
        for inside, others in ((flown[0], speeds[: speeds.index(flown[0])][-1:]), (
            flown[-1], speeds[speeds.index(flown[-1]) + 1 :][:1])):  # fmt: skip
            for outside in others:
                for _ in range(3):
                    middle = 0.5 * (inside + outside)
                    inside, outside = (middle, outside) if self.flies(height, middle, 0.0) else (inside, middle)
            ends.append(round(inside, 1))
        return ends[0], ends[1]

    def throttle(self) -> float:
        """Return the throttle of the last trim, as a fraction of full travel."""
        return float(self._executive["fcs/throttle-cmd-norm[0]"])

    def end_of_level_flight(self, height: float, speeds: list[float], *, slow: bool) -> float:
        """Return the slowest or the fastest level flight, kt; 0 if there is none at the height."""
        flown = [speed for speed in speeds if self.flies(height, speed, 0.0)]
        if not flown:
            return 0.0
        inside, outside = (min(flown), _SLOWEST * speeds[0]) if slow else (max(flown), _FASTEST * speeds[-1])
        for _ in range(_ROUNDS + 2):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if self.flies(height, middle, 0.0) else (inside, middle)
        return round(inside, 1)


def _climb_speed(height: float, speed_kt: float, angle_deg: float) -> float:
    """Return the vertical speed at a constant calibrated airspeed, m/s, of an angle of climb at constant true
    airspeed."""
    air = Air()
    speed = air.true_airspeed(speed_kt * KNOT, height)
    growth = (air.true_airspeed(speed_kt * KNOT, height + 50.0) - speed) / 50.0
    return speed * math.sin(angle_deg * DEG) / (1.0 + speed / G * growth)
