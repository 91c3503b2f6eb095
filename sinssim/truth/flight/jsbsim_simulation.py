"""Flies JSBSim's aircraft along a flight plan by the autopilot.

JSBSim steps at 120 Hz; the autopilot, the legs and the knots of the logged motion run at 30 Hz, on every fourth step;
the other channels are logged at 10 Hz.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any

from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.flight.aircraft import Aircraft, load_aircraft
from sinssim.truth.flight.autopilot import INTERVAL, AircraftState, Autopilot
from sinssim.truth.flight.flight_log import CHANNELS, FlightRecord
from sinssim.truth.flight.flight_plan import AirStart, FlightPlan, Gust, RunwayStart, Turbulence
from sinssim.truth.flight.guidance import ENDED, Navigator, SolutionErrors
from sinssim.truth.flight.jsbsim_model import (
    WITHOUT_ENGINE,
    Engines,
    Monitor,
    best_attitude_integrators,
    bring_to_start,
    default_attitude_integrators,
    loaded_model,
    quiet,
)
from sinssim.truth.flight.leg import LegBase, LegError, check_landing, shortfall
from sinssim.truth.motion import Progress
from sinssim.truth.sampling import FlightEvent
from sinssim.units import DEG, FOOT, KNOT

_NEAR_GROUND = 500.0  # height below which the gear may touch before the next slow update [m]
_STANDING = 5.0  # height above the ground below which an aircraft in the air may touch it [m]
_LEAST_DURATION = 1.0  # least duration for a smooth curve [s]


class _Link:
    """The autopilot's connection to a running model: cached property nodes, log (`FlightRecord`) and monitoring."""

    def __init__(
        self, executive: Any, flight: FlightPlan, pilot: Autopilot, motion: AircraftState, navigator: Navigator | None
    ) -> None:
        self._navigator = navigator
        self.poses, self.channels = array("d"), array("d")
        self._executive, self._pilot, self._motion = executive, pilot, motion
        manager = executive.get_property_manager()

        def read(name: str) -> Callable[[], float]:
            if not manager.hasNode(name) and name in WITHOUT_ENGINE:
                return float  # 0.0
            return manager.get_node(name).get_double_value  # type: ignore[no-any-return]

        def write(name: str) -> Callable[[float], Any]:
            return manager.get_node(name).set_double_value  # type: ignore[no-any-return]

        engines = range(executive.get_propulsion().get_num_engines())
        self._x, self._y, self._z = (read(f"position/ecef-{axis}-ft") for axis in "xyz")
        self._phi, self._theta, self._psi = (read(f"attitude/{name}-rad") for name in ("phi", "theta", "psi"))
        self._p, self._q, self._r = (read(f"velocities/{axis}-rad_sec") for axis in "pqr")
        self._cas, self._tas = read("velocities/vc-fps"), read("velocities/vtrue-fps")
        self._climb, self._height = read("velocities/h-dot-fps"), read("position/geod-alt-ft")
        self._alpha, self._beta = read("aero/alpha-rad"), read("aero/beta-rad")
        self._latitude, self._longitude = read("position/lat-geod-rad"), read("position/long-gc-rad")
        self._track, self._ground_speed = read("flight-path/psi-gt-rad"), read("velocities/vg-fps")
        self._above_ground, self._wow = read("position/h-agl-ft"), read("gear/wow")
        self._logged = tuple(read(name) for _, name, _, _ in CHANNELS) + tuple(
            read(f"propulsion/engine[{number}]/thrust-lbs") for number in engines
        )
        self._elevator, self._aileron = write("fcs/elevator-cmd-norm"), write("fcs/aileron-cmd-norm")
        self._rudder, self._steer = write("fcs/rudder-cmd-norm"), write("fcs/steer-cmd-norm")
        self._throttles = tuple(write(f"fcs/throttle-cmd-norm[{number}]") for number in engines)
        self._brakes = tuple(write(f"fcs/{side}-brake-cmd-norm") for side in ("left", "right", "center"))
        self._gear, self._flaps = write("gear/gear-cmd-norm"), write("fcs/flap-cmd-norm")
        self._set: tuple[float, ...] = ()
        self._gusts = sorted(flight.wind.gusts, key=lambda gust: gust.start_s)
        self._air = flight.air()
        self._wind = tuple(write(f"atmosphere/wind-{axis}-fps") for axis in ("north", "east", "down"))
        self._ground_reactions = write("simulation/models/FGGroundReactions/enabled")
        self._near_ground = True
        self._engines = Engines(executive)
        self._runway_height: float | None = None

    def sense(self) -> None:
        """Refresh the autopilot's fast inputs, and log the knot."""
        m = self._motion
        m.phi = phi = self._phi()
        m.theta = theta = self._theta()
        m.psi = psi = self._psi()
        m.p, m.q, m.r = self._p(), self._q(), self._r()
        m.cas, m.tas = FOOT * self._cas(), FOOT * self._tas()
        m.climb, m.height = FOOT * self._climb(), FOOT * self._height()
        m.beta = self._beta()
        self.poses.extend((self._x(), self._y(), self._z(), phi, theta, psi))
        if self._navigator is not None:
            self._navigator.fast(m, self._latitude(), self._longitude(), self._track(), FOOT * self._ground_speed())

    def sense_slowly(self) -> None:
        """Refresh the rest of the state and log the channels."""
        m = self._motion
        m.alpha = self._alpha()
        m.latitude, m.longitude = self._latitude(), self._longitude()
        m.track, m.ground_speed = self._track(), FOOT * self._ground_speed()
        if self._navigator is not None:
            self._navigator.slow(m)
        m.height_above_ground = FOOT * self._above_ground()
        m.on_wheels = self._wow() > 0.0
        if self._pilot.glides:
            m.engines_running = self._pilot.engines
        elif self._pilot.engines:
            m.engines_running = self._engines.running
        else:
            m.engines_running = not self._engines.stopped
        # Far from the ground its reactions are zero, but their computation takes a tenth of the run time.
        if self._near_ground != (m.height_above_ground < _NEAR_GROUND):
            self._near_ground = not self._near_ground
            self._ground_reactions(float(self._near_ground))
        self.channels.extend([channel() for channel in self._logged])

    def stand(self) -> None:
        """Log another knot of an aircraft at rest."""
        self.poses.extend(self.poses[-6:])

    def steps(self) -> Callable[[], Any]:
        """Return what makes a step of the model; in a wind that changes with height it first sets the wind."""
        run, height, wind_at = self._executive.run, self._height, self._air.wind
        north, east, down = self._wind

        def run_in_wind() -> None:
            wind = wind_at(FOOT * height())
            north(wind[0] / FOOT)
            east(wind[1] / FOOT)
            down(wind[2] / FOOT)
            run()

        return run_in_wind if self._air.varies else run

    def command(self) -> None:
        """Pass the autopilot's commands to the model."""
        pilot = self._pilot
        self._elevator(pilot.elevator)
        self._aileron(pilot.aileron)
        self._rudder(pilot.rudder)
        for throttle in self._throttles:
            throttle(pilot.throttle)

    def command_slowly(self) -> None:
        """Pass the settings that change rarely, and start the gusts that are due."""
        pilot = self._pilot
        settings = (pilot.steer, pilot.brakes, pilot.gear, pilot.flaps)
        if settings != self._set:
            self._set = settings
            self._steer(pilot.steer)
            for brake in self._brakes:
                brake(pilot.brakes)
            self._gear(pilot.gear)
            self._flaps(pilot.flaps)
        if pilot.engines != self._motion.engines_running:
            self._engines.switch(pilot.engines)
        if pilot.runway_height != self._runway_height and pilot.runway_height is not None:
            self._runway_height = pilot.runway_height
            ground = FOOT * (self._height() - self._above_ground())  # as JSBSim has it now
            self._executive["position/terrain-elevation-asl-ft"] += (pilot.runway_height - ground) / FOOT
        if self._gusts and self._motion.time >= self._gusts[0].start_s:
            _blow(self._executive, self._gusts.pop(0))


def _blow(executive: Any, gust: Gust) -> None:
    """Start one of JSBSim's (1 - cos) gusts."""
    prefix = "atmosphere/cosine-gust"
    executive[f"{prefix}/startup-duration-sec"] = gust.rise_s
    executive[f"{prefix}/steady-duration-sec"] = gust.steady_s
    executive[f"{prefix}/end-duration-sec"] = gust.fall_s
    north, east, down = gust.velocity_ned_mps
    executive[f"{prefix}/magnitude-ft_sec"] = math.hypot(north, east, down) / FOOT
    executive[f"{prefix}/frame"] = 3  # local: north, east, down
    executive[f"{prefix}/X-velocity-ft_sec"] = north / FOOT
    executive[f"{prefix}/Y-velocity-ft_sec"] = east / FOOT
    executive[f"{prefix}/Z-velocity-ft_sec"] = down / FOOT
    executive[f"{prefix}/start"] = 1


Pause = Callable[[FlightRecord, bool], tuple[float, SolutionErrors] | None]
"""Called with what has been flown and whether that is all, returns until when to fly on, s, and with which errors of
the navigator; None leaves it at that."""


def fly_plan(
    flight: FlightPlan,
    seed: int = 0,
    progress: Progress | None = None,
    errors: SolutionErrors | None = None,
    pause: Pause | None = None,
) -> FlightRecord:
    """Fly a flight plan in JSBSim; return the recording, for `flight_log`. From time to time the progress is called
    with the fraction flown, 0 … 1. With `errors`, the autopilot sees the true motion with those of a navigator, which
    `pause` exchanges, first at the start."""
    import jsbsim

    if progress is not None:
        progress(0.0)
    aircraft = load_aircraft(flight.aircraft)
    check_landing(flight.legs, flight.aircraft, aircraft.performance)
    with quiet() as messages, Draft() as own_folder:
        try:
            executive = loaded_model(flight.aircraft, aircraft, str(own_folder.path), flight.start.fuel_kg)
            bring_to_start(executive, flight, aircraft, seed)
        except jsbsim.BaseError as error:
            output = " ".join(" ".join(messages[1:]).split())
            output = "" if output in " ".join(str(error).split()) else output
            raise InputError(
                f"JSBSim cannot trim the {flight.aircraft} at the start of the flight ({_start_words(flight)}): "
                f"{' '.join(str(error).split())}{'; its output: ' + output if output else ''}. {_start_remedy(flight)}"
            ) from error
        return _Flight(executive, flight, aircraft, progress, errors, pause).fly()


def _start_words(flight: FlightPlan) -> str:
    """Describe the start of a flight for a message."""
    start = flight.start
    values = ", ".join(
        f"{key} = {value}" if isinstance(value, str) else f"{key} = {value:g}"
        for key, value in start.model_dump(exclude={"on"}, exclude_none=True).items()
    )
    return f"{'on the runway' if start.on == 'runway' else 'in the air'}, {values}"


def _start_remedy(flight: FlightPlan) -> str:
    """Return what to change in a flight whose start cannot be trimmed; in the air, the trim is in calm air."""
    if isinstance(flight.start, AirStart):
        if flight.start.altitude_m < _STANDING:
            return "The ground below a start in the air is at a height of 0 m: give a greater altitude_m."
        return "Give an airspeed and a height at which it can fly."
    if wind := _wind_words(flight):
        return f"{wind} Give a weaker wind, or start in the air."
    return "Choose another aircraft, or start in the air."


def _wind_words(flight: FlightPlan) -> str:
    """Name the steady wind as the likely cause of a failure on the ground; "" without wind."""
    north, east, down = flight.air().wind(flight.start.altitude_m)
    if not (north or east or down):
        return ""
    return (
        f"The likely cause is the wind of {_plain(north)} m/s towards north and {_plain(east)} m/s towards east, "
        f"which may be too strong for the {flight.aircraft} on the ground."
    )


def _plain(speed: float) -> str:
    """Write a speed to a hundredth, without a negative zero."""
    return f"{round(speed, 2) + 0.0:g}"


class _Flight:
    """A flight in progress: the model, its pilot, the instant, and what is recorded."""

    def __init__(
        self, executive: Any, flight: FlightPlan, aircraft: Aircraft, progress: Progress | None,
        errors: SolutionErrors | None, pause: Pause | None,
    ) -> None:  # fmt: skip
        self._executive, self._flight, self._aircraft, self._progress = executive, flight, aircraft, progress
        self._motion = AircraftState()
        self._motion.air = flight.air()
        self._pilot = Autopilot(aircraft, INTERVAL)
        self._guided = errors is not None
        self._navigator = None if errors is None else Navigator(errors, INTERVAL)
        self._pause, self._until = pause, math.inf if pause is None else 0.0
        self._link = _Link(executive, flight, self._pilot, self._motion, self._navigator)
        self._watch = Monitor(executive, flight, aircraft).watch
        self._in_air = flight.start.on == "air"
        self._knot = 0
        self._events: list[FlightEvent] = []

    def fly(self) -> FlightRecord:
        """Fly the legs in order, and return the recording."""
        self._engage()
        try:
            for number, leg in enumerate(self._flight.legs, start=1):
                self._fly_leg(number, leg)
        except InputError as error:
            if not self._guided or self._motion.time < _LEAST_DURATION:
                raise
            self._events.append(FlightEvent(self._motion.time, f"{ENDED}{error}"))  # where its navigator has led it
        time = self._motion.time
        if time < _LEAST_DURATION:
            raise InputError(
                f"the flight is over after {time:.2f} s, at the end of leg {number} ({leg.type}): a true motion needs "
                f"at least {_LEAST_DURATION:g} s. Use longer legs, or more of them."
            )
        if self._progress is not None:
            self._progress(1.0)
        return self._wait(over=True)

    def _wait(self, *, over: bool) -> FlightRecord:
        """Return what has been recorded; `pause` may say how to go on."""
        record = FlightRecord(self._link.poses, self._link.channels, tuple(self._events))
        if self._pause is not None and self._navigator is not None and (on := self._pause(record, over)) is not None:
            self._until, errors = on
            self._navigator.believe(errors)
        return record

    def _engage(self) -> None:
        """Let the pilot take over the trimmed aircraft."""
        start, pilot, commands = self._flight.start, self._pilot, self._executive
        self._link.sense()
        self._link.sense_slowly()
        pilot.standing = not self._in_air
        pilot.engage(
            self._motion,
            elevator=commands["fcs/elevator-cmd-norm"],
            aileron=commands["fcs/aileron-cmd-norm"],
            rudder=commands["fcs/rudder-cmd-norm"],
            throttle=0.0 if pilot.glides else commands["fcs/throttle-cmd-norm[0]"],
        )
        pilot.brakes = float(not self._in_air)
        pilot.gear = float(not self._in_air or not self._aircraft.performance.retractable_gear)
        if isinstance(start, RunwayStart):
            pilot.engines = start.engines == "running"
        else:
            pilot.heading, pilot.height = start.heading_deg * DEG, start.altitude_m
            _stir(self._executive, self._flight.turbulence)

    def _fly_leg(self, number: int, leg: LegBase) -> None:
        """Fly a leg; an `InputError` says why it cannot be flown."""
        import jsbsim

        name = f"leg {number} ({leg.type})"
        pilot, motion, events = self._pilot, self._motion, self._events
        events.append(FlightEvent(motion.time, f"{name} begins"))
        pilot.standing = pilot.standing and leg.stands_still
        leaves_ground = leg.begins == "runway" and leg.ends == "air"
        if leaves_ground:
            _stir(self._executive, self._flight.turbulence)
        try:
            self._steps(number, leg, motion.time + leg.timeout_s)
        except (LegError, jsbsim.BaseError, ArithmeticError, ValueError) as error:
            raise self._failure(name, error) from error
        if leaves_ground:
            self._in_air = True
            best_attitude_integrators(self._executive)
        self._take_remarks()
        if self._in_air:
            short = shortfall(name, leg, pilot, motion, turbulent=self._flight.turbulence is not None)
        events += [FlightEvent(motion.time, f"{name} ends"), *((short,) if self._in_air and short else ())]

    def _steps(self, number: int, leg: LegBase, deadline: float) -> None:
        """Step the model until the end of a leg: four of its steps for one of the autopilot."""
        link, pilot, motion = self._link, self._pilot, self._motion
        run, step, sense, command = link.steps(), pilot.step, link.sense, link.command
        for _ in leg.fly(pilot, motion, self._aircraft.performance):
            self._knot += 1
            motion.time = self._knot * INTERVAL
            if pilot.standing:
                link.stand()
            else:
                step(motion)
                command()
                run()
                run()
                run()
                run()
                sense()
                if not -1e4 < motion.height < 1e5:  # NaN fails this test, too
                    raise LegError("the model diverged", "gentler legs, or a better model")
            if self._knot % 3:
                continue
            self._take_remarks()
            link.sense_slowly()
            link.command_slowly()
            if motion.time > deadline:
                raise LegError(
                    f"not completed within its timeout_s of {leg.timeout_s:g} s",
                    "a target within the reach of the aircraft, or a longer timeout_s",
                )
            if self._in_air and pilot.may_touch and motion.on_wheels:
                self._in_air = False
                default_attitude_integrators(self._executive)
                self._executive["atmosphere/turb-type"] = 0  # turbulence is in the air only, as before the take-off
            if self._in_air:
                self._watch(leg, pilot, motion)
            if self._progress is not None and self._knot % 300 == 0:
                self._progress(_fraction(self._flight, number, motion.time))
            if motion.time >= self._until:
                self._wait(over=False)

    def _take_remarks(self) -> None:
        """Record what the leg notes."""
        self._events += [FlightEvent(self._motion.time, remark) for remark in self._pilot.remarks]
        self._pilot.remarks.clear()

    def _failure(self, name: str, error: Exception) -> InputError:
        """Return the error of a leg, with the state of the aircraft."""
        m = self._motion
        reason, remedy = (
            (error.reason, error.remedy)
            if isinstance(error, LegError)
            else (f"the model diverged ({error})", "gentler legs, or a better model")
        )
        if self._guided:  # what the pilot would see is believed, and what led here is no fault of the plan
            return InputError(f"{name}: {reason}")
        wind = "" if self._in_air else _wind_words(self._flight)
        return InputError(
            f"{name} failed at {m.time:.1f} s of the flight: {reason}. The {self._flight.aircraft} was at a height of "
            f"{m.height:.0f} m ({m.height_above_ground:.0f} m above ground), {m.cas / KNOT:.0f} kt calibrated, angle "
            f"of attack {m.alpha / DEG:.1f}°, roll {m.phi / DEG:.1f}°, pitch {m.theta / DEG:.1f}°, heading "
            f"{m.psi / DEG:.1f}°. Use {remedy}.{' ' + wind if wind else ''}"
        )


def _fraction(flight: FlightPlan, number: int, time: float) -> float:
    """Return the flown fraction of a flight: of its duration if the last leg gives it, otherwise of its legs."""
    end = getattr(flight.legs[-1], "until_s", None)
    return min(1.0, time / end) if end is not None else (number - 1) / len(flight.legs)


def _stir(executive: Any, turbulence: Turbulence | None) -> None:
    """Switch on the turbulence of a plan, if it has any."""
    if turbulence is not None:
        executive["atmosphere/turb-type"] = 4  # MIL-F-8785C, Dryden filters by Tustin's method
        executive["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = turbulence.wind_at_6m_mps / FOOT
        executive["atmosphere/turbulence/milspec/severity"] = turbulence.severity
