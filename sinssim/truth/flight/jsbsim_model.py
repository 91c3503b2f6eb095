"""The aircraft in JSBSim: its model, the start on the runway or in the air, engines, limits."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import pi, tan
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from sinssim.content import find_content
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.system.files import user_file
from sinssim.truth.atmosphere import Air, WindVector
from sinssim.truth.flight.aircraft import Aircraft, load_aircraft
from sinssim.truth.flight.autopilot import HEADING, AircraftState, Autopilot, G
from sinssim.truth.flight.flight_plan import AirStart, FlightPlan, RunwayStart
from sinssim.truth.flight.leg import LegBase, LegError
from sinssim.units import DEG, FOOT

STEP = 1.0 / 120.0
"""JSBSim's step [s]."""

_SETTLING = 30.0  # time for the gear to come to rest before the log begins [s]

_POUND = 0.45359237  # kg
_PSF = 4.4482216152605 / 0.3048**2  # a pound-force per square foot [Pa]

# Properties set by JSBSim's trim.
_TRIMMED = (
    "fcs/pitch-trim-cmd-norm", "fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm",
    "fcs/throttle-cmd-norm[0]", "fcs/throttle-cmd-norm[1]",
)  # fmt: skip


WITHOUT_ENGINE = frozenset({"fcs/throttle-cmd-norm", "propulsion/total-fuel-lbs"})
"""Properties that a model without an engine lacks; their values are 0."""


@contextmanager
def quiet() -> Iterator[list[str]]:
    """Collect JSBSim's messages instead of printing them; return the messages, at most 200."""
    import jsbsim

    messages: list[str] = []

    class Collector(jsbsim.FGLogger):
        def set_level(self, level: Any) -> None:
            pass

        def file_location(self, filename: str, line: int) -> None:
            pass

        def message(self, message: str) -> None:
            if len(messages) < 200:
                messages.append(message)

        def format(self, format: Any) -> None:
            pass

        def flush(self) -> None:
            pass

    jsbsim.set_logger(Collector())
    try:
        yield messages
    finally:
        jsbsim.set_logger(jsbsim.DefaultLogger())


def model_folder(name: str, model: str) -> Path:
    """Return the folder of an aircraft's flight dynamics model: a folder of that name beside aircraft.toml, otherwise
    that of JSBSim's own aircraft."""
    import jsbsim

    file = find_content("aircraft", name)
    shipped = Path(jsbsim.get_default_root_dir()) / "aircraft"
    for folder in (file.parent / model, shipped / model):
        if (folder / f"{model}.xml").is_file():
            return folder
    raise InputError(
        f"{file}, key jsbsim_model: there is no model {model!r}, neither in a folder {model} with {model}.xml beside "
        f"this file nor among JSBSim's own models in {shipped}."
    )


@dataclass(frozen=True)
class Proportions:
    """Sizes of an aircraft over its length."""

    span: float
    chord: float  # mean, of the wing
    tail_span: float  # of the tailplane; 0: there is none, and the wing is a delta
    fin: float  # height of the fin above the fuselage
    swept: bool  # whether jets without propellers drive it


AIRLINER = Proportions(span=0.96, chord=0.14, tail_span=0.36, fin=0.16, swept=True)
"""Proportions of an aircraft whose own are not known."""

_SIZES = {"M": 1.0, "FT": FOOT, "IN": 0.0254, "M2": 1.0, "FT2": FOOT**2}
_ASPECT_OF_TAIL, _ASPECT_OF_FIN = 4.0, 1.3  # usual aspect ratios, of which a model has none


def proportions(name: str) -> Proportions:
    """Return the proportions of an aircraft by the metrics of its model.

    The length, which they lack, is that between the farthest places of the model, or twice the arm of the tail.
    """
    aircraft = load_aircraft(name)
    root = _changed_model(model_folder(name, aircraft.jsbsim_model), aircraft)

    def size(key: str) -> float:
        element = root.find(f"metrics/{key}")
        return 0.0 if element is None else float(element.text or 0.0) * _SIZES.get(element.get("unit", "FT"), FOOT)

    places = [
        float(place.findtext("x") or 0.0) * _SIZES.get(place.get("unit", "IN"), 0.0254)
        for place in root.iter("location")
    ]
    span, area = size("wingspan"), size("wingarea")
    if span <= 0.0 or area <= 0.0:
        return AIRLINER
    engines = {element.get("file", "") for element in root.iter("thruster")}
    length = max(2.0 * size("htailarm"), max(places) - min(places), 0.3 * span)
    return Proportions(
        span=span / length,
        chord=area / span / length,
        tail_span=(_ASPECT_OF_TAIL * size("htailarea")) ** 0.5 / length,
        fin=(_ASPECT_OF_FIN * size("vtailarea")) ** 0.5 / length,
        swept=bool(engines) and all("direct" in engine.lower() for engine in engines),
    )


def loaded_model(name: str, aircraft: Aircraft, folder: str, fuel: float | None = None) -> Any:
    """Load an aircraft's flight dynamics model with its changes and its fuel, kg, and return JSBSim's executive.

    The model is copied into an empty folder without its sockets and log files, so that nothing outside affects the
    flight.
    """
    import jsbsim

    model = model_folder(name, aircraft.jsbsim_model)
    root = Path(jsbsim.get_default_root_dir())
    shutil.copytree(model, Path(folder) / model.name)
    definition = Path(folder) / model.name / f"{model.name}.xml"
    root_element = _changed_model(model, aircraft)
    for tag in ("input", "output"):
        for element in root_element.findall(tag):
            root_element.remove(element)
    if fuel is not None:
        _fill(root_element.findall("propulsion/tank"), fuel, model.name)
    ElementTree.ElementTree(root_element).write(definition, encoding="utf-8", xml_declaration=True)
    executive = jsbsim.FGFDMExec(str(root))
    executive.set_debug_level(0)
    if not executive.load_model_with_paths(model.name, folder, str(root / "engine"), str(root / "systems")):
        raise InputError(f"JSBSim cannot load the model {model}.")
    executive.set_dt(STEP)
    return executive


def _changed_model(model: Path, aircraft: Aircraft) -> ElementTree.Element:
    """Return the definition of a model in its folder, with an aircraft's changes."""
    try:
        root = ElementTree.parse(user_file(model / f"{model.name}.xml")).getroot()
    except ElementTree.ParseError as error:
        raise InputError(f"{model / model.name}.xml is not XML: {error}.") from error
    for path, text in aircraft.model_changes.items():
        elements = root.findall(path)
        if not elements:
            raise InputError(f"model_changes of {model.name}: {model.name}.xml has no element {path!r}.")
        for element in elements:
            element.text = text
            if not text:
                parent = next(parent for parent in root.iter() if element in parent)
                parent.remove(element)
    return root


def check_fuel(flight: FlightPlan) -> None:
    """Raise InputError if the tanks of the aircraft hold less fuel than a plan begins with."""
    if flight.start.fuel_kg is not None:
        aircraft = load_aircraft(flight.aircraft)
        model = model_folder(flight.aircraft, aircraft.jsbsim_model)
        tanks = _changed_model(model, aircraft).findall("propulsion/tank")
        _fill(tanks, flight.start.fuel_kg, model.name)


def _fill(tanks: list[ElementTree.Element], fuel: float, model: str) -> None:
    """Fill the tanks of a model with kilograms of fuel, each to the same share of its capacity."""
    filled = list[tuple[ElementTree.Element, float]]()
    for tank in tanks:
        capacity, contents = tank.find("capacity"), tank.find("contents")
        if capacity is not None and contents is not None and tank.get("type", "").upper() == "FUEL":  # not the oxidiser
            filled.append((contents, float(capacity.text or 0.0) * (1.0 if capacity.get("unit") == "KG" else _POUND)))
    most = sum(holds for _, holds in filled)
    if fuel > most:
        raise InputError(f"flight.start.fuel_kg = {fuel:g}: the tanks of the model {model} hold {most:.0f} kg.")
    for contents, holds in filled:
        contents.text = repr(holds * fuel / most)
        contents.set("unit", "KG")


def bring_to_start(executive: Any, flight: FlightPlan, aircraft: Aircraft, seed: int) -> None:
    """Bring the aircraft to the start: at rest on its wheels, or trimmed in the air, wind and seed set."""
    start, air = flight.start, flight.air()
    if not air.standard:
        _set_atmosphere(executive, air)
    executive["ic/lat-geod-deg"] = start.latitude_deg
    executive["ic/long-gc-deg"] = (start.longitude_deg + 180.0) % 360.0 - 180.0
    executive["ic/psi-true-deg"] = start.heading_deg % 360.0
    executive["simulation/randomseed"] = seed % 2**31
    extended = start.on == "runway" or not aircraft.performance.retractable_gear
    executive["gear/gear-cmd-norm"] = executive["gear/gear-pos-norm"] = float(extended)
    if isinstance(start, AirStart):
        _trim_in_the_air(executive, start, aircraft, air.wind(start.altitude_m))
    else:
        _settle_on_the_runway(executive, start, air.wind(start.altitude_m))


def _set_atmosphere(executive: Any, air: Air) -> None:
    """Set the temperature's deviation (JSBSim's unit is the degree Rankine, 5/9 K) and the pressure at sea level."""
    executive["atmosphere/delta-T"] = 1.8 * air.isa_deviation
    executive["atmosphere/P-sl-psf"] = air.sea_level_pressure / _PSF


def _set_wind(executive: Any, wind: WindVector) -> None:
    """Set the steady wind of the initial conditions; JSBSim's direction is the one it blows towards."""
    executive["ic/vw-mag-fps"] = math.hypot(wind[0], wind[1]) / FOOT
    executive["ic/vw-dir-deg"] = math.degrees(math.atan2(wind[1], wind[0])) % 360.0


def widen_trim(executive: Any, stall_deg: float) -> bool:
    """Let JSBSim's trim look for angles of attack up to the stall, in a model that gives no limits of its own.

    It looks between −5° and 20° otherwise, and finds nothing where both ends have too little lift: the 737 at 20° has
    as much as at 8°, and could not be trimmed below 188 kt although it stalls at 155 kt.
    """
    if executive["aero/alpha-max-rad"] > executive["aero/alpha-min-rad"]:
        return False
    executive["aero/alpha-min-rad"], executive["aero/alpha-max-rad"] = -5.0 * DEG, stall_deg * DEG
    return True


_GLIDE_ROUNDS = 40  # of the glide's trim, at most
_GLIDE_STEP = (4.0, 6.0, 0.3)  # largest change of angle of attack, angle of climb, degrees, and elevator in a round
_GLIDE_PROBE = (0.05, 0.05, 0.005)  # changes for the derivatives
_STEADY = 1e-4  # of the accelerations, ft/s² and rad/s²


def trim_glide(executive: Any, stall_deg: float, begin: tuple[float, float, float] = (3.0, -3.0, 0.0)) -> bool:
    """Trim a steady glide at the airspeed and height of the initial conditions, which JSBSim's trim cannot: it balances
    the drag by the throttle.

    Newton's method finds angle of attack, angle of climb and elevator, from `begin`, degrees and fraction of full
    travel, without forces forward and down and without pitching moment; a step that does not reduce them is halved.

    Returns:
        Whether there is such a glide below the stall, `stall_deg`; the model is then in it.
    """

    def accelerations(at: Array) -> Array:
        executive["ic/gamma-deg"], executive["ic/alpha-deg"] = float(at[1]), float(at[0])
        executive["fcs/elevator-cmd-norm"] = float(at[2])
        executive.run_ic()
        names = ("udot-ft_sec2", "wdot-ft_sec2", "qdot-rad_sec2")
        return np.array([executive[f"accelerations/{name}"] for name in names])

    at = np.array(begin)
    left = accelerations(at)
    for _ in range(_GLIDE_ROUNDS):
        slopes = [(accelerations(at + step) - left) / step.sum() for step in np.diag(_GLIDE_PROBE)]
        change = np.linalg.lstsq(np.array(slopes).T, -left, rcond=None)[0]
        change *= min(1.0, *(most / max(abs(size), 1e-12) for most, size in zip(_GLIDE_STEP, change, strict=True)))
        while np.abs(change).max() > 1e-9 and not np.linalg.norm(accelerations(at + change)) < np.linalg.norm(left):
            change *= 0.5
        at = at + change
        left = accelerations(at)
        if np.abs(left).max() < _STEADY:
            return bool(at[0] < stall_deg and abs(at[2]) <= 1.0 and at[1] < 0.0)
    return False


def _trim_in_the_air(executive: Any, start: AirStart, aircraft: Aircraft, wind: WindVector) -> None:
    """Trim in calm air, then transfer the trimmed aircraft to the wind."""
    airspeed_kt = start.airspeed_kt or aircraft.performance.cruise_kt
    best_attitude_integrators(executive)
    executive["ic/h-sl-ft"] = start.altitude_m / FOOT
    executive["ic/vc-kts"] = airspeed_kt
    executive["ic/gamma-deg"] = 0.0
    executive.run_ic()
    # JSBSim's sea level differs slightly from the ellipsoid: correct the ellipsoidal height.
    executive["ic/h-sl-ft"] = 2.0 * start.altitude_m / FOOT - executive["position/geod-alt-ft"]
    executive["ic/vc-kts"] = airspeed_kt
    executive.run_ic()
    if aircraft.performance.glider:
        if not trim_glide(executive, aircraft.performance.stall_alpha_deg):
            raise InputError(f"there is no steady glide at {airspeed_kt:.0f} kt and {start.altitude_m:.0f} m.")
    else:
        _trim_level(executive, aircraft)
    if not any(wind):
        return
    commands = [name for name in _TRIMMED if executive.get_property_manager().hasNode(name)]
    settings = {name: executive[name] for name in commands}
    attitude = {axis: executive[f"attitude/{axis}-rad"] for axis in ("phi", "theta", "psi")}
    through_air = {axis: executive[f"velocities/v-{axis}-fps"] for axis in ("north", "east", "down")}
    _set_wind(executive, wind)
    executive["ic/phi-rad"] = attitude["phi"]
    executive["ic/theta-rad"] = attitude["theta"]
    executive["ic/psi-true-rad"] = attitude["psi"]
    executive["ic/vn-fps"] = through_air["north"] + wind[0] / FOOT
    executive["ic/ve-fps"] = through_air["east"] + wind[1] / FOOT
    executive["ic/vd-fps"] = through_air["down"] + wind[2] / FOOT
    executive.run_ic()
    executive["atmosphere/wind-down-fps"] = wind[2] / FOOT
    for name, value in settings.items():
        executive[name] = value
    if not aircraft.performance.glider:
        executive["propulsion/set-running"] = -1


def _trim_level(executive: Any, aircraft: Aircraft) -> None:
    """Trim level flight with the engines running."""
    import jsbsim

    executive["propulsion/set-running"] = -1
    try:
        executive["simulation/do_simple_trim"] = 1
    except jsbsim.BaseError:
        if not widen_trim(executive, aircraft.performance.stall_alpha_deg):
            raise
        executive.run_ic()
        executive["propulsion/set-running"] = -1
        executive["simulation/do_simple_trim"] = 1


def _settle_on_the_runway(executive: Any, start: RunwayStart, wind: WindVector) -> None:
    """Find the equilibrium on the wheels, then let engine and gear settle with brakes set."""
    executive["ic/terrain-elevation-ft"] = start.altitude_m / FOOT
    executive["ic/h-agl-ft"] = 6.0
    _set_wind(executive, wind)
    for engine in range(executive.get_propulsion().get_num_engines()):
        executive[f"fcs/advance-cmd-norm[{engine}]"] = 1.0  # levers of propellers forward, as for a take-off
    brakes = ("fcs/left-brake-cmd-norm", "fcs/right-brake-cmd-norm", "fcs/center-brake-cmd-norm")
    executive.run_ic()
    for brake in brakes:
        executive[brake] = 1.0
    executive["simulation/do_simple_trim"] = 2
    if start.engines == "running":
        executive["propulsion/set-running"] = -1
    for brake in brakes:
        executive[brake] = 1.0
    for _ in range(round(_SETTLING / STEP)):
        executive.run()


_ROTATIONAL = ("simulation/integrator/rate/rotational", "simulation/integrator/position/rotational")


def default_attitude_integrators(executive: Any) -> None:
    """Select Euler's integrators of the attitude, JSBSim's defaults, which the friction of the tyres needs."""
    for name in _ROTATIONAL:
        executive[name] = 1


def best_attitude_integrators(executive: Any) -> None:
    """Select JSBSim's best integrators of the attitude (Adams-Bashforth 4, Buss 2) instead of Euler's, its defaults.

    They are not used on the ground: the friction of the tyres is solved for Euler steps, and with any other integrator
    the aircraft creeps at centimetres per second with its brakes set.
    """
    rate, position = _ROTATIONAL
    executive[rate], executive[position] = 5, 6


_LIGHT_UP = 15.0  # speed of a turbine's high-pressure shaft at which the fuel is opened [% of N2]


class Engines:
    """The engines of a model.

    A piston engine runs after magnetos and starter are on; a turbine after its starter has brought it to `_LIGHT_UP`
    and the fuel is open. The models of JSBSim then compute the start themselves.
    """

    def __init__(self, executive: Any) -> None:
        self._executive = executive
        manager = executive.get_property_manager()
        self._numbers = range(executive.get_propulsion().get_num_engines())
        self._running = [manager.get_node(f"propulsion/engine[{i}]/set-running") for i in self._numbers]
        self._shafts = [
            manager.get_node(f"propulsion/engine[{i}]/n2")
            for i in self._numbers
            if manager.hasNode(f"propulsion/engine[{i}]/n2")
        ]
        self._has_mixture = manager.hasNode("fcs/mixture-cmd-norm")
        self._mixture = executive["fcs/mixture-cmd-norm"] if self._has_mixture else 0.0

    @property
    def running(self) -> bool:
        """Whether every engine runs, and there is one."""
        return bool(self._running) and all(node.get_double_value() > 0.5 for node in self._running)

    @property
    def stopped(self) -> bool:
        """Whether no engine runs."""
        return all(node.get_double_value() < 0.5 for node in self._running)

    def switch(self, wanted: bool) -> None:
        """Move the switches towards a state of the engines; called again until it is reached."""
        e = self._executive
        e["propulsion/active_engine"] = -1  # all of them
        if not wanted:
            e["propulsion/starter_cmd"] = 0
            e["propulsion/magneto_cmd"] = 0
            e["propulsion/cutoff_cmd"] = 1
            if self._has_mixture:
                e["fcs/mixture-cmd-norm"] = 0.0
            return
        lit = all(shaft.get_double_value() >= _LIGHT_UP for shaft in self._shafts)
        e["propulsion/starter_cmd"] = float(not self.running)
        e["propulsion/magneto_cmd"] = 3  # both
        e["propulsion/cutoff_cmd"] = float(not lit)
        if self._has_mixture:
            e["fcs/mixture-cmd-norm"] = self._mixture if self._mixture > 0.0 else 1.0


_STALLED = 10  # updates beyond the stall's angle of attack after which the aircraft counts as stalled
_QUARTER = 6_371_009.0 * 0.5 * pi  # distance from the equator to a pole [m]


class Monitor:
    """What makes a leg fail although it goes on."""

    def __init__(self, executive: Any, flight: FlightPlan, aircraft: Aircraft) -> None:
        manager = executive.get_property_manager()
        units = range(executive.get_ground_reactions().get_num_gear_units())
        names = (f"{kind}/unit[{unit}]/WOW" for unit in units for kind in ("gear", "contact"))
        self._contacts = [manager.get_node(name).get_double_value for name in names if manager.hasNode(name)]
        glides = aircraft.performance.glider
        self._fuel = float if glides else manager.get_node("propulsion/total-fuel-lbs").get_double_value
        self._has_fuel = self._fuel() > 0.0
        self._stall = aircraft.performance.stall_alpha_deg * DEG
        self._stalled = 0
        causes = ["a higher airspeed", "a lower load factor"]
        if flight.turbulence is not None:
            causes.append("weaker turbulence")
        if flight.wind.gusts or flight.wind.down_mps:
            causes.append("weaker vertical wind and gusts")
        self._against_stall = ", ".join(causes[:-1]) + f" or {causes[-1]}"

    def watch(self, leg: LegBase, pilot: Autopilot, state: AircraftState) -> None:
        """Raise if a leg cannot be flown on; called ten times a second in the air."""
        if not pilot.may_touch and (state.height_above_ground < 0.0 or any(touch() for touch in self._contacts)):
            raise LegError("the aircraft hit the ground", "a greater height")
        self._stalled = self._stalled + 1 if state.alpha > self._stall else 0
        if self._stalled >= _STALLED:
            raise LegError("the aircraft stalled", self._against_stall)
        if self._has_fuel and self._fuel() <= 0.0:
            remedy = "a shorter flight, a lower airspeed, more fuel_kg at the start, or another aircraft"
            raise LegError("the fuel of the model is used up", remedy)
        if "heading" in leg.holds and pilot.lateral == HEADING:
            left = _QUARTER * (1.0 - abs(state.latitude) / (0.5 * pi))
            radius = state.ground_speed**2 / (G * tan(pilot.bank_limit))
            if left < radius:
                raise LegError(
                    f"the pole is {left / 1e3:.1f} km away, and a heading cannot be held within the turn radius of "
                    f"{radius / 1e3:.1f} km",
                    "a path farther from the pole, a waypoint beyond the pole, or [great_circle]",
                )
