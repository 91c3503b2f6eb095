"""Scenarios as texts: the mistakes of one beside its lines, its plan, and the keys that it may have."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from sinssim.errors import SinssimError, SinssimWarning
from sinssim.scenario.load import scenario_of_text
from sinssim.scenario.schema import Key, Scenario, key_tables, value_text
from sinssim.toml_mistakes import key_lines, key_parts, parse_toml

_checking = threading.RLock()
"""Warnings are caught, and own content is found, in one thread at a time."""

_INCH, _WIDE = 92.0, 99.4  # px that a page draws an inch of a chart as, upright and across
_BULLET, _LINE = "\n  - ", re.compile(r"[,:]?\s*line (\d+)(?:, column \d+)?: ")
_SYMBOLS = {
    "deg": "°", "rad": "rad", "mrad": "mrad", "arcmin": "′", "arcsec": "″", "m": "m", "mm": "mm", "mm2": "mm²",
    "nm": "nm", "km": "km", "ft": "ft", "nmi": "nmi", "mps": "m/s", "mps2": "m/s²", "kt": "kt", "s": "s", "ms": "ms",
    "min": "min", "h": "h", "hz": "Hz", "ug": "µg", "mg": "mg", "g": "g", "ppm": "ppm", "percent": "%", "mgal": "mGal",
    "hpa": "hPa", "k": "K", "c": "°C", "kg": "kg", "deg2": "°²", "s2": "s²", "g2": "g²", "g3": "g³", "per": "",
    "sqrt": "√",
}  # fmt: skip
"""Words of the units in names of keys, and how they are written."""


def checked_text(text: str, file: Path) -> dict[str, Any]:
    """Return what `sinssim check` finds in the TOML text of a scenario, or `sinssim compare` at first in that of a
    study, as it is being edited; paths in it are relative to the folder of its file: `mistakes`, each with `line`, from
    1, 0 if it is not known, and `text`; `plan`, the lines of a sound scenario; `left`, a sentence on what was not
    checked, or "". Code that the scenario brings (`use`), and recorded files, are left to the command itself."""
    with _checking:
        checked = _checked(text, file)
        (first, *_) = checked["mistakes"] or [{"line": 0, "text": ""}]
        lines = ["", *text.split("\n")]
        # a key that is being written hides no other mistakes; without a header, keys would seem to be of another table
        if first["text"].startswith("TOML") and first["line"] < len(lines) and "[" not in lines[first["line"]]:
            lines[first["line"]] = ""
            others = _checked("\n".join(lines[1:]), file)["mistakes"]
            checked["mistakes"] += [other for other in others if other["line"] and not other["text"].startswith("TOML")]
        return checked


def _checked(text: str, file: Path) -> dict[str, Any]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SinssimWarning)
        try:
            if left := _left(data := parse_toml(text, file.name)):
                return {"mistakes": [], "plan": [], "left": left}
            if _is_study(data):
                return {"mistakes": [], "plan": _of_study(text, file), "left": ""}
            from sinssim.cli.commands.run import checked

            plan = _scenario(text, file)
            if plan.source.recorded:
                left = "The recorded files are read by the command: press Check."
                return {"mistakes": [], "plan": [], "left": left}
            remarks = [f"warning     {entry.message}" for entry in caught]
            return {"mistakes": [], "plan": [*checked(plan)[1], *remarks], "left": ""}
        except SinssimError as error:
            return {"mistakes": list(_mistakes(str(error), file.name, text)), "plan": [], "left": ""}


def plan_html(text: str, file: Path, width: float) -> str:
    """Return the plan of a sound scenario as HTML of a width, px: map, height and speed; "" if there is nothing to
    draw."""
    from sinssim.experiments.run.motion_exhibits import plan_charts
    from sinssim.recording.svg_chart import html_of

    with _checking:
        try:
            if _left(data := parse_toml(text, file.name)) or _is_study(data):
                return ""
            plan = plan_charts(_scenario(text, file))
            rows, heights = tuple((chart,) for chart in plan), (0.8 * width, 200.0, 180.0)  # below each other
            size = (width / _WIDE, sum(heights) / _INCH)
            return html_of(replace(plan, title="", rows=rows, size=size, widths=(), heights=heights))
        except SinssimError:
            return ""


def _scenario(text: str, file: Path) -> Scenario:
    return scenario_of_text(text, file.parent, source=file.name, name=file.stem)


def _is_study(data: dict[str, Any]) -> bool:
    return "parts" in data or "axes" in data


def _of_study(text: str, file: Path) -> list[str]:
    """Return what a study computes; the scenarios that it names are read when it starts."""
    from sinssim.experiments.studies.trade_schema import TradeStudy
    from sinssim.experiments.study import study_of_text

    study = study_of_text(text, file)
    if isinstance(study, TradeStudy):
        axes = " × ".join(f"{axis.title} ({len(axis.values)})" for axis in study.axes)
        kind = f"{'an' if study.cell == 'ensemble' else 'a'} {study.cell}"
        what = [f"scenario    {study.scenario}", f"cells       {study.size}, each {kind}: {axes}"]
    else:
        what = [f"part        {part.title}: {part.cases} navigations of each motion" for part in study.parts]
    return [f"study       {study.name}", *what]


def _left(data: dict[str, Any]) -> str:
    """Return why a text is not checked while it is written; "" if it is."""
    if data.get("use"):
        return "The scenario uses code of its own, which is not run while you write: press Check to check the file."
    return ""


def found_by_command(output: str, code: int, source: str, text: str) -> dict[str, Any]:
    """Return what the command has found in the file of a text, as `checked_text` does, from its output and its exit
    code; `source` names the file in its errors."""
    if not code:
        return {"mistakes": [], "plan": output.splitlines(), "left": ""}
    message = output.rpartition("sinssim: ")[2].strip()
    return {"mistakes": list(_mistakes(message, source, text)), "plan": [], "left": ""}


def _mistakes(message: str, source: str, text: str) -> Iterator[dict[str, Any]]:
    """Yield the mistakes of an error's message, each with its line in the text."""
    head, *several = message.split(_BULLET)
    lines = key_lines(text)
    for sentence in several or [head]:
        sentence = sentence.removeprefix(source)
        if place := _LINE.match(sentence):
            yield {"line": int(place[1]), "text": sentence[place.end() :].strip()}
        else:
            sentence = sentence.lstrip(",: ")
            yield {"line": _line_of(sentence, lines), "text": sentence}


def _line_of(sentence: str, lines: dict[tuple[str, ...], int]) -> int:
    """Return the line of the key or table that a sentence names; 0 if it names none."""
    leg = re.match(r"leg (\d+)", sentence)
    words = [f"flight.legs.{leg[1]}"] if leg else re.findall(r"[a-z][\w.]*\w", sentence)
    for word in words:
        path = key_parts(word)
        for length in range(len(path), 0, -1):
            if path[:length] in lines and (length > 1 or len(path) == 1):
                return lines[path[:length]]
    return 0


def keys_of_scenarios() -> list[dict[str, Any]]:
    """Return the tables of a scenario with their keys, as `sinssim check --keys` shows them: for each table its path,
    whether the file may have several of it, the value of the key that says its kind, what it is, and its keys with
    name, unit, default in the notation of TOML, meaning with limits, and known values."""
    return [
        {"path": table.path, "array": table.array, "tag": table.tag, "about": table.about,
         "keys": [_key(table.path, key) for key in table.keys]}
        for table in key_tables()
    ]  # fmt: skip


def _key(table: str, key: Key) -> dict[str, Any]:
    default = None if key.default is None or key.required else value_text(key.default, key.field)
    return {"name": key.name, "unit": unit_of(key.name), "default": default, "about": key.notes,
            "required": key.required, "kind": key.field.get("type", ""),
            "values": _values(f"{table}.{key.name}".lstrip("."), key)}  # fmt: skip


def unit_of(key: str) -> str:
    """Return the unit in the name of a key as it is written: "gyro_arw_deg_sqrt_h" → "°/√h", "seed" → ""."""
    _, *words = key.split("_")
    while words and not all(word in _SYMBOLS for word in words):
        del words[0]
    unit = "/".join(_SYMBOLS[word] for word in words if word != "per")
    return unit.replace("√/", "√")


def _values(path: str, key: Key) -> list[str]:
    """Return the known values of a key, in the notation of TOML."""
    from sinssim.cli.commands.content import Listing, names_of

    listed = {
        "flight.aircraft": Listing.AIRCRAFT, "imu.grade": Listing.GRADES, "navigation.frame": Listing.FRAMES,
        "navigation.algorithms": Listing.ALGORITHMS, "filter.states": Listing.STATES,
    }  # fmt: skip
    if path in listed:
        names: list[Any] = list(names_of(listed[path]))
    elif key.field.get("type") == "boolean":
        names = [True, False]
    else:
        entries = key.field.get("items") or key.field
        names = entries.get("enum", []) if isinstance(entries, dict) else []
    return [value_text(name) for name in names]
