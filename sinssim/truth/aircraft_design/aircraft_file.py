"""The text of an aircraft.toml, with the rules and margins of a design beside its numbers."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.aircraft_design.acceptance_flight import LegErrors
from sinssim.truth.aircraft_design.loop_design import LEAST_DB, LEAST_DEG, LoopDesign
from sinssim.truth.aircraft_design.model_survey import Survey, engine_words
from sinssim.truth.flight.aircraft import Aircraft, Envelope
from sinssim.units import KNOT

_RULES = {
    "airspeed_scheduled": "by the growth of the responses with airspeed",
    "roll_rate_max_deg_s": "a fifth of full aileron, 4 to 30",
    "roll_acceleration_max_deg_s2": "the rate over two lags of the roll",
    "bank_rate": "three quarters of bank_gain, at most 1.2",
    "bank_gain": "half of the crossover of the roll loop, 0.5 to 2",
    "roll_feedforward": "share of the inverse of the response at 1 rad/s with the least cost",
    "roll_gain": "the largest with the margins",
    "roll_integral": "corner of 2 rad/s, or the inverse of the roll's lag",
    "heading_time_s": "damping 0.9 over the bank; at least 0.65 of the time to roll out of 25°; with the margins",
    "height_rate": "path_gain over 3.24: damping 0.9; less if the fastest usual climb needs a longer way to level off",
    "path_gain": "half of the inverse of its lags: 60° of phase",
    "vertical_acceleration_mps2": "1.2 height_rate times the fastest usual climb, 0.7 to 3",
    "load_time_s": "1.2 over the bandwidth of the pitch rate, 0.35 to 1.5",
    "lift_time_s": "measured: change of the path over angle of attack",
    "pitch_feedforward": "share of the inverse of the response at 1 rad/s with the least cost",
    "pitch_gain": "the largest with the margins",
    "pitch_integral": "corner of 2 rad/s",
    "speed_gain": "pole placement: damping 0.9",
    "speed_integral": "0.016: 1 m/s moves the throttle by a tenth in six seconds; less with a slow engine",
    "climb_throttle": "of a slow climb at constant airspeed",
    "throttle_lead_s": "by the same: the throttle moves before the climb",
    "throttle_rate": "0.4/s over the lag of the engines, 0.1 to 0.3",
    "yaw_feedforward": "rudder of the steady turn without sideslip",
    "yaw_gain": "least cost of a roll-in and of a gust from the side, with the margins",
    "sideslip_gain": "by the same",
    "sideslip_integral": "corner of 0.3 rad/s",
}
_RULES_OF_GLIDER = {
    **_RULES,
    "speed_gain": "airspeed to the sine of the descent: pole placement, damping 0.9",
    "speed_integral": "by the same",
    "climb_throttle": "gravity accelerates it",
    "throttle_lead_s": "of no effect",
    "throttle_rate": "of no effect",
}


def aircraft_text(
    aircraft: Aircraft,
    facts: Survey | None = None,
    design: LoopDesign | None = None,
    height: float = 0.0,
    errors: Iterable[LegErrors] = (),
    on_ground: str = "",
) -> str:
    """Return the contents of an aircraft.toml.

    Args:
        aircraft: the aircraft.
        facts: what its model says; without it the text has no comments.
        design: the design of its gains.
        height: of the design, m.
        errors: of the acceptance flight.
        on_ground: sentence on its take-off and landing.
    """
    data = aircraft.model_dump(exclude_none=True)
    lines = [f"{key} = {_value(data[key])}" for key in ("description", "jsbsim_model")]
    if facts is not None:
        lines[:0] = [
            f"# Made by `sinssim aircraft add {facts.name}` from JSBSim's model: {facts.mass_kg:.0f} kg, wing "
            f"{facts.wing_m2:.1f} m², {engine_words(len(facts.engines))}"
            f"{f' ({facts.engines[0]})' if facts.engines else ''}.",
        ]
    lines += ["", "[mounting]   # forward, right, down of the centre of gravity", *_table(data["mounting"])]
    if aircraft.model_changes:
        lines += [
            "",
            "[model_changes]   # no backlash, which makes any autopilot oscillate; engines burn the tanks with fuel",
        ]
        lines += [f"{_value(path)} = {_value(text)}" for path, text in aircraft.model_changes.items()]
    lines += ["", "[performance]"]
    if facts is not None:
        cruise = "is the best glide" if aircraft.performance.glider else "and rates are shares of the envelope"
        lines += [
            f"# Cruise {cruise}, the stall is 0.9 of the angle of greatest lift.",
            f"# The stall's airspeed is {facts.stall_kt:.0f} kt. {on_ground}",
        ]
    lines += _table(data["performance"])
    lines += ["", "[autopilot]"]
    if design is not None:
        lines += _margin_lines(design, height, glides=aircraft.performance.glider)
    rules = _RULES_OF_GLIDER if aircraft.performance.glider else _RULES
    lines += _table(data["autopilot"], rules if design is not None else {})
    if aircraft.envelope is not None:
        lines += ["", *_envelope_lines(aircraft.envelope)]
    if table := list(errors):
        lines += [
            "",
            f"# Largest errors in the acceptance flight at {height:.0f} m (height m, airspeed kt, heading °):",
        ]
        for of in table:
            shown = [
                f"{value:.2f}{unit}"
                for value, unit in ((of.height_m, " m"), (of.airspeed_kt, " kt"), (of.heading_deg, "°"))
                if value is not None
            ]
            lines.append(f"#   {of.leg}: {', '.join(shown)}")
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple | list):
        return f"[{', '.join(_value(item) for item in value)}]"
    return repr(value)


def _table(values: Mapping[str, object], rules: Mapping[str, str] | None = None) -> list[str]:
    notes = rules or {}
    return [f"{key} = {_value(value)}{f'   # {notes[key]}' if key in notes else ''}" for key, value in values.items()]


def _margin_lines(design: LoopDesign, height: float, *, glides: bool) -> list[str]:
    """Describe the rule of the gains and the margins that they leave."""
    lines = [
        f"# The largest gains that leave {LEAST_DB:g} dB and {LEAST_DEG:g}° at every trim of the linear models, "
        f"designed at {height:.0f} m.",
        f"# Roll lag {design.roll_lag:.2f} s, thrust {design.thrust:.2f} m/s² with a lag of {design.engine_lag:.2f} s"
        f"{': those of gravity and of the path' if glides else ''}.",
    ]
    for entry in design.margins:
        m = entry.margins
        gain = "no limit" if m.gain_db > 90.0 else f"{m.gain_db:.0f} dB"
        phase = "no crossover" if m.phase_deg > 180.0 else f"{m.phase_deg:.0f}° at {m.crossover:.1f} rad/s"
        lines.append(f"#   {entry.loop} at {entry.airspeed / KNOT:.0f} kt, {entry.height:.0f} m: {gain}, {phase}")
    return lines


def _envelope_lines(envelope: Envelope) -> list[str]:
    lines = ["[envelope]   # of the model, by JSBSim's trim"]
    lines += [f"{key} = {_value(getattr(envelope, key))}" for key in ("height_m", "min_kt", "max_kt", "airspeed_kt")]
    for key in ("climb_mps", "descent_mps"):
        lines += [f"{key} = [", *(f"    {_value(row)}," for row in getattr(envelope, key)), "]"]
    return lines


def check_place(folder: Path) -> None:
    """Raise InputError if the folder of a new aircraft exists or cannot be a name in a scenario."""
    if not re.fullmatch(r"[\w.-]+", folder.name):
        raise InputError(f"--out {folder}: the name of an aircraft has letters, digits, dots, hyphens and underscores.")
    if folder.exists():
        raise InputError(f"{folder} exists. Name another folder with --out, or remove it.")


def write_aircraft(folder: Path, text: str, model: Path | None) -> None:
    """Make the folder of an aircraft at once: its aircraft.toml, and a copy of its model unless it is of the package.

    Args:
        folder: the folder, which does not exist.
        text: contents of aircraft.toml.
        model: folder of the model to copy; None: the package's is used.
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with Draft(folder.parent) as draft:
            made = draft.path / "made"
            made.mkdir()
            (made / "aircraft.toml").write_text(text, encoding="utf-8")
            if model is not None:
                shutil.copytree(model, made / model.name)
            made.rename(folder)
    except OSError as error:
        raise InputError(f"{folder} cannot be made: {error.strerror}. Name another folder with --out.") from error
