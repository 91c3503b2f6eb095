"""What the files of a flight dynamics model say, and what its forces are: whether it can fly, and about how fast.

The lift is that of the model over the angle of attack, controls neutral. Its maximum gives the stall, and with the
weight the slowest level flight, V = √(2 W/(ρ S C_L)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from sinssim.errors import InputError, unknown_name
from sinssim.system.files import Draft, user_file
from sinssim.truth.flight.jsbsim_model import STEP, quiet
from sinssim.units import FOOT, KNOT

_POUND = 0.45359237  # kg
_DENSITY = 1.225  # of the air at sea level [kg/m³]
_G = 9.80665
_SWEEP = range(-4, 36)  # angles of attack of the sweep, degrees
_DROP = 0.98  # the lift has had its maximum where it falls below this share of it
_LEAST_LIFT = 0.3  # a lift coefficient below which nothing carries the weight
_AT = (150.0, 1500.0)  # airspeed and height of the sweep [kt, m]
_NEEDED = (
    "fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm", "fcs/elevator-pos-rad",
    "fcs/left-aileron-pos-rad", "fcs/rudder-pos-rad",
)  # fmt: skip
_LEAST_FEED = 0.002  # share of the fuel below which the tanks of an engine only pass it on
_SAFE = 0.9  # share of the angle of greatest lift that is not counted as stall yet


@dataclass(frozen=True)
class Survey:
    """The facts of a model."""

    name: str
    title: str  # what the model calls itself
    engines: tuple[str, ...]  # kind of each engine's file: "piston_engine" and so on; none of a glider
    mass_kg: float
    wing_m2: float
    lift_max: float  # greatest lift coefficient, controls and flaps neutral
    stall_alpha_deg: float  # angle of attack that counts as stall
    stall_kt: float  # slowest level flight at sea level by the lift, kt
    retractable: bool
    standing_height_m: float
    model_changes: dict[str, str]  # changes of the model that an autopilot needs


def package_models() -> dict[str, Path]:
    """Return the folders of the models in JSBSim's package by name."""
    import jsbsim

    place = Path(jsbsim.get_default_root_dir()) / "aircraft"
    return {path.name: path for path in sorted(place.iterdir()) if (path / f"{path.name}.xml").is_file()}


def engine_words(count: int) -> str:
    """Return a number of engines in words."""
    return {0: "no engine", 1: "1 engine"}.get(count, f"{count} engines")


def described_models() -> dict[str, str]:
    """Return the models of JSBSim's package with their engines and what they call themselves; a file with a fault must
    not hide the others."""
    sentences = {}
    for name, place in package_models().items():
        try:
            root = _definition(place)
            engines = engine_words(len(_engine_files(place, root)))
            title = " ".join((root.get("name") or "").split())
            sentences[name] = f"{title}, {engines}" if title else engines
        except InputError as error:
            sentences[name] = f"(cannot be used: {error})"
    return sentences


def find_model(model: str, folder: Path | None = None) -> Path:
    """Return the folder of a model: of JSBSim's package, or a folder with NAME/NAME.xml or NAME.xml inside.

    Raises:
        InputError: there is no such model; the message has similar names.
    """
    if folder is None:
        models = package_models()
        if model not in models:
            raise unknown_name("MODEL", model, models)
        return models[model]
    for place in (folder / model, folder):
        if (place / f"{model}.xml").is_file():
            if place.name != model:
                raise InputError(f"--from {folder}: the folder of the model {model} must have the name {model}.")
            return place
    raise InputError(f"--from {folder}: there is neither {model}/{model}.xml nor {model}.xml.")


def _definition(place: Path) -> ElementTree.Element:
    file = place / f"{place.name}.xml"
    try:
        return ElementTree.parse(user_file(file)).getroot()
    except ElementTree.ParseError as error:
        raise InputError(f"{file.name} is not XML: {error}") from error


def _engine_files(place: Path, root: ElementTree.Element) -> list[str]:
    """Return the names of the engines' files; the propulsion may be in a file of its own beside the model's."""
    propulsion = root.find("propulsion")
    if propulsion is not None and (file := propulsion.get("file")):
        beside = place / (file if file.endswith(".xml") else f"{file}.xml")
        if not beside.is_file():
            raise InputError(f"it needs the file {file}, which is not there")
        try:
            propulsion = ElementTree.parse(user_file(beside)).getroot()
        except ElementTree.ParseError as error:
            raise InputError(f"{beside.name} is not XML: {error}") from error
    return [] if propulsion is None else [element.get("file", "") for element in propulsion.findall("engine")]


def survey(place: Path) -> Survey:
    """Survey a model in its folder.

    Raises:
        InputError: the model cannot fly, with the reason.
    """
    root = _definition(place)
    if root.find("buoyant_forces") is not None:
        raise InputError("gas carries it, but the autopilot flies what wings carry")
    engines = _engine_files(place, root)
    with quiet() as messages, Draft() as folder:
        executive = _loaded(place, root, Path(folder.path), messages)
        manager = executive.get_property_manager()
        missing = [name for name in _NEEDED if not manager.hasNode(name)]
        if missing:
            raise InputError(f"it has no property {missing[0]}, which the autopilot needs")
        if manager.hasNode("propulsion/engine/collective-ctrl-rad"):
            raise InputError("a rotor carries it, but the autopilot does not command the pitch of its blades")
        lift, alpha = _greatest_lift(executive)
        weight, wing = executive["inertia/weight-lbs"] * _POUND, executive["metrics/Sw-sqft"] * FOOT**2
        if lift < _LEAST_LIFT or wing <= 0.0:
            raise InputError(
                f"its wings do not lift it: the greatest lift coefficient is {max(lift, 0.0) + 0.0:.2f} with a wing of "
                f"{wing:.1f} m²"
            )
        stall = math.sqrt(2.0 * weight * _G / (_DENSITY * wing * lift))
        return Survey(
            name=place.name,
            title=(root.get("name") or place.name).strip(),
            engines=tuple(_engine_kind(place, name) for name in engines),
            mass_kg=weight,
            wing_m2=wing,
            lift_max=lift,
            stall_alpha_deg=round(_SAFE * alpha, 1),
            stall_kt=stall / KNOT,
            retractable=any((e.text or "").strip() not in ("", "0") for e in root.iter("retractable")),
            standing_height_m=_standing_height(executive, root),
            model_changes={
                **({".//hysteresis_width": "0"} if root.findall(".//hysteresis_width") else {}),
                **_feeds(root),
            },
        )


def _feeds(root: ElementTree.Element) -> dict[str, str]:
    """Return the changes that let an engine burn what the tanks hold, if its own are empty in minutes because pumps of
    a simulator fill them: the engines then burn the fuller tanks."""
    tanks = [float(tank.findtext("contents") or 0.0) for tank in root.findall("propulsion/tank")]
    fullest = sorted(range(len(tanks)), key=lambda tank: -tanks[tank])
    changes = {}
    for number, engine in enumerate(root.findall("propulsion/engine")):
        feeds = [int(float(feed.text or 0)) for feed in engine.findall("feed")]
        fuel = sum(tanks[tank] for tank in feeds if 0 <= tank < len(tanks))
        if feeds and fuel < _LEAST_FEED * sum(tanks):
            changes[f"propulsion/engine[{number + 1}]/feed"] = str(fullest[number % len(fullest)])
    return changes


def _loaded(place: Path, root: ElementTree.Element, folder: Path, messages: list[str]) -> Any:
    """Load the model as flights do; the error of a faulty file names what JSBSim misses."""
    import shutil

    import jsbsim

    package = Path(jsbsim.get_default_root_dir())
    shutil.copytree(place, folder / place.name)
    for tag in ("input", "output"):
        for element in root.findall(tag):
            root.remove(element)
    ElementTree.ElementTree(root).write(folder / place.name / f"{place.name}.xml", encoding="utf-8")
    executive = jsbsim.FGFDMExec(str(package))
    executive.set_debug_level(0)
    try:
        loaded = executive.load_model_with_paths(
            place.name, str(folder), str(package / "engine"), str(package / "systems")
        )
        if not loaded:
            printed = [line for line in "".join(messages).splitlines() if line.strip()]
            raise InputError(_reason(" ".join(printed[-1:])))
        executive.set_dt(STEP)
        executive.run_ic()
    except jsbsim.BaseError as error:
        raise InputError(_reason(str(error))) from error
    return executive


def _reason(text: str) -> str:
    """Return the sentence of a load that failed."""
    words = text.replace("FGPropertyValue::GetValue()", "").split()
    reason = " ".join(words[-40:]).rstrip(".") or "JSBSim gives no reason"
    if "does not exist" in reason and "property" in reason:
        return f"it needs a simulator around it: {reason[reason.index('The property') :].replace('The', 'the', 1)}"
    return f"JSBSim cannot load it: {reason}"


def _greatest_lift(executive: Any) -> tuple[float, float]:
    """Return the first maximum of the lift coefficient over the angle of attack, and its angle, degrees."""
    speed, height = _AT
    executive["gear/gear-cmd-norm"] = executive["gear/gear-pos-norm"] = 0.0
    executive["ic/h-sl-ft"] = height / FOOT
    best, at = -math.inf, 0.0
    for alpha in _SWEEP:
        executive["ic/vc-kts"], executive["ic/gamma-deg"] = speed, 0.0
        executive["ic/alpha-deg"] = float(alpha)
        executive.run_ic()
        area = executive["aero/qbar-psf"] * executive["metrics/Sw-sqft"]
        lift = executive["forces/fwz-aero-lbs"] / area if area > 0.0 else 0.0
        if math.isfinite(lift) and lift > best:
            best, at = lift, float(alpha)
        elif lift < _DROP * best and alpha > 2:
            break
    return best, at


def _engine_kind(place: Path, name: str) -> str:
    """Return the kind of an engine by its file's first element."""
    import jsbsim

    for folder in (place / "Engines", place / "engines", place, Path(jsbsim.get_default_root_dir()) / "engine"):
        file = folder / f"{name}.xml"
        if file.is_file():
            try:
                return ElementTree.parse(user_file(file)).getroot().tag
            except ElementTree.ParseError:
                break
    return "engine"


def _standing_height(executive: Any, root: ElementTree.Element) -> float:
    """Return the height of the centre of gravity above the wheels, m."""
    heights = []
    for contact in root.findall("ground_reactions/contact"):
        location = contact.find("location")
        if contact.get("type") == "BOGEY" and location is not None:
            factor = {"IN": 0.0254, "FT": FOOT, "M": 1.0}.get(location.get("unit", "IN"), 0.0254)
            heights.append(factor * float(location.findtext("z") or 0.0))
    if not heights:
        return 1.5
    return round(max(0.1, float(executive["inertia/cg-z-in"]) * 0.0254 - min(heights)), 2)
