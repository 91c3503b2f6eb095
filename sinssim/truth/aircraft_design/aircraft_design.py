"""Makes an aircraft from a flight dynamics model: survey, trims, linear models, gains, envelope, acceptance flight."""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.aircraft_design.acceptance_flight import (
    HEIGHTS,
    LegErrors,
    circuit_plan,
    fly_acceptance,
    standing_height,
)
from sinssim.truth.aircraft_design.aircraft_file import aircraft_text
from sinssim.truth.aircraft_design.linear_model import LATERAL, VERTICAL, FlownResponses, LinearModel
from sinssim.truth.aircraft_design.loop_design import DesignPoint, LoopDesign, design_loops, engine_response
from sinssim.truth.aircraft_design.model_survey import Survey, engine_words, find_model, survey
from sinssim.truth.aircraft_design.trimmed_envelope import TrimmedModel, glide_envelope, quick_envelope
from sinssim.truth.atmosphere import Air
from sinssim.truth.flight.aircraft import Aircraft, AutopilotGains, Envelope, Performance, climb_rate, descent_rate
from sinssim.truth.flight.flight_log import FlightRecord
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import quiet
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import not_attained
from sinssim.truth.motion import AT_REFERENCE_POINT
from sinssim.units import KNOT

Report = Callable[[str, float], None]
"""Called with the present work and the fraction done, 0 … 1."""

LONGEST = 600.0
"""Time that a design may take, s."""
_FACTORS = (1.15, 1.25, 1.4, 1.6, 1.8, 2.0, 2.3, 2.7, 3.2, 4.0)  # airspeeds that are tried, over the stall's
_RANGE = 1.15  # least ratio of the fastest to the slowest level flight
_RESPONSES = ((LATERAL, 10.0), (VERTICAL, 12.0))  # and their time [s]: two short periods of a slow aircraft
_MISFIT = 0.2  # of a linear model that is used
_LEAST_THRUST = 0.03  # over the weight: a glide ratio of 33, which no aircraft with engines has
_PACES = (1.0, 0.6, 0.35)  # of the loops, over the fastest with the margins: what is tried until the flight is accepted
_STEEPEST = 30.0  # climb and descent that are looked for before the thrust is known, degrees
_ENVELOPE_TIME = 60.0  # [s]
_TRIMS_PER_POINT = 12  # of the envelope: a climb and a descent at a height and airspeed, and a share of the ends
_APPROACHES = (1.3, 1.45, 1.6, 1.8)  # airspeeds of the approach over the stall's that are flown, from CS-25.125's on
_BRAKES = (0.3, 0.6, 1.0)  # settings of the brakes that are flown
_RUNWAYS = (3000.0, 5000.0)  # lengths of the runway: the usual one, and the longest there are [m]
_RUNS = (4.0, 2.5)  # accelerations of the take-off run: with reheat, it climbs faster than it can level off [m/s²]
_CLIMB_SHARE = 0.7  # of the rate of climb at cruise that is left in the initial climb
_SLOWEST = 40.0  # airspeed that a leg accepts [kt]
_HIGHEST = 18_000.0  # of the envelope: above, the air of the design is another [m]


@dataclass(frozen=True)
class DesignedAircraft:
    """An aircraft that has been designed and flown."""

    name: str
    aircraft: Aircraft
    text: str  # the contents of aircraft.toml
    survey: Survey
    design: LoopDesign
    height: float  # of the design and the acceptance flight, m
    errors: tuple[LegErrors, ...]  # of the acceptance flight
    on_ground: str  # sentence on its take-off and landing
    seconds: float  # processor time of the design


class RefusedError(InputError):
    """A model that cannot be flown, with what was tried."""


def design_aircraft(model: str, folder: Path | None, report: Report) -> DesignedAircraft:
    """Design an aircraft in this process; `sinssim.truth.aircraft_design.design_process` does so in another one.

    Args:
        model: name of the flight dynamics model.
        folder: where it is; None: JSBSim's package.
        report: called with the present work.

    Raises:
        RefusedError: the model cannot be flown: why.
    """
    begun = time.process_time()
    try:
        place = find_model(model, folder)
        report("surveying the model", 0.0)
        facts = survey(place)
        with Draft() as draft:
            making = _Design(place, facts, draft.path / model, report, copied=folder is not None)
            design, height, errors = making.make()
            on_ground = making.from_the_runway(design.thrust)
            aircraft = making.aircraft
    except InputError as error:
        raise RefusedError(f"the model {model} cannot be flown: {str(error).rstrip('.')}.") from error
    except (KeyError, AttributeError) as error:  # of JSBSim's properties
        raise RefusedError(
            f"the model {model} cannot be flown: it misses a property that flights need: {error}."
        ) from error
    except (ArithmeticError, ValueError) as error:
        raise RefusedError(f"the model {model} cannot be flown: it diverges ({error}).") from error
    text = aircraft_text(aircraft, facts, design, height, errors, on_ground)
    return DesignedAircraft(
        model, aircraft, text, facts, design, height, errors, on_ground, time.process_time() - begun
    )  # fmt: skip


class _Design:
    """The design in progress, with its aircraft in a folder of its own."""

    def __init__(self, place: Path, facts: Survey, folder: Path, report: Report, *, copied: bool) -> None:
        self._facts, self._folder, self._report = facts, folder, report
        self._begun = time.process_time()
        folder.mkdir()
        if copied:
            shutil.copytree(place, folder / place.name)
        self.aircraft = Aircraft(
            description=f"{facts.title}, {facts.mass_kg / 1e3:.3g} t, {engine_words(len(facts.engines))}",
            jsbsim_model=place.name,
            model_changes=facts.model_changes,
            mounting=AT_REFERENCE_POINT,
            performance=_first_performance(facts),
            autopilot=_first_gains(facts),
        )

    def make(self) -> tuple[LoopDesign, float, tuple[LegErrors, ...]]:
        """Return the design of the aircraft, the height of its design and the errors of its flight."""
        height, speeds = self._level_flight()
        slow, fast = speeds[0], speeds[-1]
        if self._facts.engines:
            cruise = _rounded(max(1.3 * slow, min(1.8 * slow, 0.85 * fast)))
        else:
            cruise = _rounded(max(1.15 * slow, self._best_glide(height, speeds), _SLOWEST / 0.9))
        if 0.9 * fast < _SLOWEST:
            raise InputError(f"it flies at {fast:.0f} kt at most, too slowly for legs of {_SLOWEST:.0f} kt and more")
        cruise = cruise if cruise < fast else _rounded(0.5 * (slow + fast))
        self._change(performance=self.aircraft.performance.model_copy(update={"cruise_kt": cruise}))
        points = design_points(
            str(self._folder), height, cruise, max(slow, _SLOWEST), fast,
            lambda text, part: self._report(text, 0.12 + 0.33 * part),
        )  # fmt: skip
        if not self._facts.engines:
            speeds, heights = sorted({*speeds, cruise}), [0.0, 0.5 * height, height]
            self._change(envelope=glide_envelope(str(self._folder), heights, speeds))
        else:
            self._envelope(height, slow, fast, _steepest(points[0]))
        self._change(performance=self._performance(height))
        refusals = list[InputError]()
        for number, pace in enumerate(_PACES):
            try:
                climb = max(self.aircraft.performance.climb_mps, self.aircraft.performance.descent_mps)
                design = design_loops(points, climb, pace=pace)
                self._change(autopilot=design.gains)
                self._report("flying the acceptance plan", 0.8 + 0.06 * number)
                errors = self._acceptance(height)
            except InputError as error:
                refusals.append(error)
                continue
            return design, height, errors
        raise refusals[0]

    def from_the_runway(self, thrust: float) -> str:
        """Find the airspeeds with which it takes off and lands, by flying a circuit; return a sentence on both.

        `thrust` is the acceleration by the whole travel of the throttle, m/s².
        """
        self._report("flying a circuit", 0.95)
        known = self.aircraft.performance
        if known.glider:
            return "A glider starts in the air."
        known = known.model_copy(update={"initial_climb_kt": self._initial_climb(known)})
        refusals, standing = list[InputError](), None
        for run in _RUNS:
            tried = known.model_copy(update={"takeoff_throttle": _rounded(min(1.0, run / thrust))})
            try:
                record = self._circuit(tried, _RUNWAYS[-1])
            except InputError as error:
                refusals.append(error)
                continue
            flown, standing = tried, round(standing_height(record), 2)
            if not not_attained(record.events):
                break
        if standing is None:
            self._change(performance=known.model_copy(update={"takes_off": False}))
            return f"It does not take off: {_reason(refusals[0])}."
        flown, refusals = flown.model_copy(update={"standing_height_m": standing}), []
        for runway, factor, brakes in product(_RUNWAYS, _APPROACHES, _BRAKES):
            approach = _rounded(factor * self._facts.stall_kt)
            try:
                self._circuit(flown.model_copy(update={"approach_kt": approach, "braking": brakes}), runway)
            except InputError as error:
                refusals.append(error)
            else:
                approach_words = f"its approach is at {factor:g} of the stall's airspeed"
                return f"It takes off and lands in calm air on {runway:.0f} m; {approach_words}."
        self._change(performance=flown)
        return f"It takes off, but does not land: {_reason(refusals[0])}."

    def _circuit(self, performance: Performance, runway: float) -> FlightRecord:
        """Fly a circuit from a runway of a length, m, with a performance, which the aircraft then has."""
        self._change(performance=performance)
        try:
            return fly_plan(circuit_plan(str(self._folder), performance, runway))
        except (ArithmeticError, ValueError) as error:
            raise InputError(f"the model diverges ({error})") from error

    def _initial_climb(self, known: Performance) -> float:
        """Return the slowest airspeed, at least 1.4 of the stall's, that leaves a share of the climb at cruise."""
        envelope, slow, cruise = self.aircraft.envelope, 1.4 * self._facts.stall_kt, known.cruise_kt
        assert envelope is not None
        enough = _CLIMB_SHARE * climb_rate(envelope, 0.0, cruise)
        tried = (slow + (cruise - slow) * part / 20.0 for part in range(20))
        return _rounded(next((speed for speed in tried if climb_rate(envelope, 0.0, speed) >= enough), cruise))

    def _acceptance(self, height: float) -> tuple[LegErrors, ...]:
        """Return the errors of the acceptance flight; raise if it fails or does not hold the limits."""
        try:
            errors = fly_acceptance(str(self._folder), self.aircraft.performance, height)
        except InputError as error:
            raise InputError(f"the acceptance flight fails: {_plainly(str(error), self._folder)}") from error
        if excess := [words for leg_errors in errors if (words := leg_errors.excess())]:
            raise InputError(f"the loops do not hold it in the acceptance flight: {'; '.join(excess[:2])}")
        return errors

    def _change(self, **new: object) -> None:
        """Change the aircraft and its file."""
        self.aircraft = self.aircraft.model_copy(update=new)
        (self._folder / "aircraft.toml").write_text(aircraft_text(self.aircraft), encoding="utf-8")

    def _level_flight(self) -> tuple[float, list[float]]:
        """Return the height of the design and the airspeeds of level flight there, kt."""
        self._change()
        tried = [round(factor * self._facts.stall_kt, 1) for factor in _FACTORS]
        with TrimmedModel(str(self._folder), _STEEPEST) as model:
            for number, height in enumerate(HEIGHTS):
                self._report(f"trimming at {height:.0f} m", 0.02 + 0.03 * number)
                begun = time.process_time()
                flown = [speed for speed in tried if model.flies(height, speed, 0.0)]
                self._trim_time = (time.process_time() - begun) / len(tried)
                if flown and max(flown) >= _RANGE * min(flown):
                    return height, flown
            if not self._facts.engines:
                raise InputError(
                    f"it has no engine, and no steady glide between {tried[0]:.0f} and {tried[-1]:.0f} kt at heights "
                    f"of {HEIGHTS[-1]:.0f} to {HEIGHTS[0]:.0f} m"
                )
            thrust = max(0.0, model.full_thrust(HEIGHTS[-1], tried[len(tried) // 2]))  # 0 of no number, too
        if thrust < _LEAST_THRUST:
            raise InputError(f"its engines give only {100.0 * thrust:.1f} % of its weight as thrust at full throttle")
        raise InputError(
            f"JSBSim trims no level flight between {tried[0]:.0f} and {tried[-1]:.0f} kt at heights of "
            f"{HEIGHTS[-1]:.0f} to {HEIGHTS[0]:.0f} m with its engines running"
        )

    def _best_glide(self, height: float, speeds: list[float]) -> float:
        """Return the airspeed with the least loss of height over way, kt."""
        with quiet(), TrimmedModel(str(self._folder), _STEEPEST) as model:
            sinks = {speed: sink for speed in speeds if (sink := model.sink(height, speed)) is not None}
        return min(sinks, key=lambda speed: sinks[speed] / speed)

    def _envelope(self, height: float, slow: float, fast: float, steepest: float) -> None:
        """Measure the envelope on a grid as fine as the time allows."""

        def report(part: float) -> None:
            self._report("measuring the envelope", 0.45 + 0.3 * part)

        report(0.0)
        with TrimmedModel(str(self._folder), _STEEPEST) as model:
            middle, top = math.sqrt(slow * fast), height
            while top < _HIGHEST and any(model.flies(top + 1500.0, speed, 0.0) for speed in (middle, slow)):
                top += 1500.0
        points = _ENVELOPE_TIME / max(self._trim_time, 1e-3) / _TRIMS_PER_POINT
        columns = 3 if points < 24.0 else 5
        rows = int(max(3, min(1 + top // 1500.0, points / columns, 7)))
        heights = [_rounded(top * row / (rows - 1), 5) for row in range(rows)]
        speeds = [_rounded(slow + (fast - slow) * column / (columns - 1)) for column in range(columns)]
        self._change(envelope=quick_envelope(str(self._folder), heights, speeds, steepest, report))

    def _performance(self, height: float) -> Performance:
        """Return usual speeds, rates and limits by the envelope: shares of the largest that leave room for control."""
        known, envelope = self.aircraft.performance, self.aircraft.envelope
        assert envelope is not None
        cruise = known.cruise_kt
        climb, descent = climb_rate(envelope, height, cruise), descent_rate(envelope, height, cruise)
        if known.glider:  # its usual vertical speed is its sink, and half as much again as that accelerates it
            climb = descent
        if not known.glider and (climb < 0.5 or descent < 0.5):
            raise InputError(
                f"it cannot climb and descend at its cruise of {cruise:.0f} kt and {height:.0f} m: {climb:.1f} m/s up "
                f"and {descent:.1f} m/s down are its largest rates"
            )
        tas = Air().true_airspeed(cruise * KNOT, height)
        acceleration = 9.80665 * min(climb, descent) / tas
        lift = self._facts.lift_max * 0.5 * 1.225 * (cruise * KNOT) ** 2 * self._facts.wing_m2
        load = lift / (self._facts.mass_kg * 9.80665)
        return known.model_copy(
            update={
                "climb_mps": _rounded(min(20.0, 0.4 * climb)),
                "descent_mps": _rounded(descent if known.glider else min(20.0, 0.5 * descent)),
                "acceleration_mps2": _rounded(min(1.0, max(0.1, 0.5 * acceleration))),
                "max_load_factor_g": _rounded(min(2.5, max(1.3, 0.7 * load))),
                "bank_deg": 25.0 if load > 1.5 else 15.0,
            }
        )


def design_points(
    aircraft: str, height: float, cruise: float, slow: float, fast: float, report: Report
) -> list[DesignPoint]:
    """Return the linear models of an aircraft at cruise, towards both ends of level flight, and higher up.

    Args:
        aircraft: its name, or the path of its folder; its gains have no effect.
        height: height of the design, m.
        cruise: calibrated airspeed of the reference, kt, which is the first point.
        slow: slowest level flight, kt.
        fast: fastest level flight, kt.
        report: called with the present work.

    Raises:
        InputError: it is not trimmed at cruise, or its responses there are not linear.
    """
    wanted = [
        (height, cruise), (height, max(slow, 0.7 * cruise)), (height, min(0.95 * fast, 1.3 * cruise)),
        (height + 1500.0, cruise),
    ]  # fmt: skip
    points = list[DesignPoint]()
    for number, (at, speed) in enumerate(wanted):
        report(f"flying responses at {speed:.0f} kt and {at:.0f} m", number / len(wanted))
        start = {"on": "air", "latitude_deg": 45.0, "longitude_deg": 0.0, "altitude_m": at, "airspeed_kt": speed}
        hold = {"type": "hold", "duration_s": 1.0}
        flown = FlownResponses(FlightPlan.model_validate({"aircraft": aircraft, "start": start, "legs": [hold]}))
        try:
            lateral, vertical = (_linear(flown, motion, time) for motion, time in _RESPONSES)
        except InputError as error:
            if points:  # an end of the range may be too near to the stall or the ceiling
                continue
            raise InputError(f"it does not fly on from its trim at {speed:.0f} kt and {at:.0f} m: {error}") from error
        misfit = max(lateral.misfit, vertical.misfit)
        if misfit <= _MISFIT:
            points.append(DesignPoint(flown.trim, at, lateral, vertical))
        elif not points:
            share = f"{100.0 * min(1.0, misfit):.0f} %"
            raise InputError(f"its responses to small steps at cruise are not linear: a linear model misses {share}")
    return points


def _linear(flown: FlownResponses, motion: tuple[tuple[str, ...], tuple[str, ...]], seconds: float) -> LinearModel:
    """Return a linear model of the longest responses that are linear: those of an unstable aircraft soon are not."""
    for part in (1.0, 0.5, 0.3):
        model = flown.linear(motion, part * seconds)
        if model.misfit <= _MISFIT:
            break
    return model


def _steepest(point: DesignPoint) -> float:
    """Return the angle up to which climbs and descents are looked for, degrees: half as much again as full or idle
    thrust changes the weight's share along the path, and 5° for the change of the drag with airspeed."""
    _, thrust = engine_response(point.vertical) or (0.0, 0.0)
    throttle = point.trim.throttle
    share = min(0.8, max(throttle, 1.0 - throttle) * thrust / 9.80665)
    return min(60.0, 1.5 * math.degrees(math.asin(share)) + 5.0)


def _reason(error: InputError) -> str:
    """Return why a leg failed, without the state of the aircraft."""
    return str(error).split(" of the flight: ")[-1].split(". The ")[0].rstrip(".")


def _rounded(value: float, digits: int = 3) -> float:
    return float(f"{value:.{digits}g}")


def _plainly(text: str, folder: Path) -> str:
    """Return a sentence about the flight without the path of its draft."""
    return text.replace(f"The {folder}", "The aircraft").replace(str(folder), "aircraft").rstrip(".")


def _first_performance(facts: Survey) -> Performance:
    """Return what the survey gives: speeds by the stall's, the rest until the envelope is known."""
    return Performance(
        cruise_kt=_rounded(2.0 * facts.stall_kt),
        glider=not facts.engines,
        stall_alpha_deg=facts.stall_alpha_deg,
        bank_deg=25.0,
        max_load_factor_g=2.5,  # of transport aircraft, CS-25.337
        min_load_factor_g=0.3,
        climb_mps=2.0,
        descent_mps=2.0,
        acceleration_mps2=0.3,
        takes_off=bool(facts.engines),
        takeoff_kt=_rounded(1.15 * facts.stall_kt),
        takeoff_pitch_deg=8.0,
        initial_climb_kt=_rounded(1.4 * facts.stall_kt),
        takeoff_flaps=0.0,
        retractable_gear=facts.retractable,
        engine_start_s=30.0 if any("turbine" in engine for engine in facts.engines) else 5.0,
        standing_height_m=facts.standing_height_m,
    )


def _first_gains(facts: Survey) -> AutopilotGains:
    """Return gains that no flight uses: a file of an aircraft needs some."""
    return AutopilotGains(
        reference_kt=_rounded(2.0 * facts.stall_kt), airspeed_scheduled=True, roll_rate_max_deg_s=5.0,
        roll_acceleration_max_deg_s2=5.0, bank_rate=0.5, bank_gain=1.0, roll_feedforward=0.0, roll_gain=0.0,
        roll_integral=0.0, heading_time_s=9.0, height_rate=0.05, path_gain=0.25, vertical_acceleration_mps2=0.7,
        load_time_s=1.0, lift_time_s=0.0, pitch_feedforward=0.0, pitch_gain=0.0, pitch_integral=0.0, speed_gain=0.01,
        speed_integral=0.0, climb_throttle=0.0, throttle_rate=0.1, yaw_feedforward=0.0, yaw_gain=0.0,
        sideslip_gain=0.0, sideslip_integral=0.0, steering_gain=1.0,
    )  # fmt: skip


__all__ = ["DesignedAircraft", "Envelope", "RefusedError", "design_aircraft"]
