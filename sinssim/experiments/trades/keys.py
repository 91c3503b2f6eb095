"""Words for a scenario's keys and their values: label and unit of a key, a value as TOML and as people read it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

_PRETTY = {
    "arcmin": "arcmin", "arcsec": "arcsec", "c": "°C", "deg": "deg", "deg2": "deg²", "g": "g", "g2": "g²", "g3": "g³",
    "h": "h", "hz": "Hz", "kt": "kt", "m": "m", "mm": "mm", "mm2": "mm²", "mps": "m/s", "mps2": "m/s²", "ms": "ms",
    "nm": "nm", "percent": "%", "ppm": "ppm", "s": "s", "s2": "s²", "ug": "µg",
}  # fmt: skip
"""Units in the names of keys, as they are printed."""
_WITHIN = {*_PRETTY, "sqrt", "per"}
_PLAIN = ("imu", "navigation", "flight")
"""Tables whose keys are clear without the table's name."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def unit_of(key: str) -> str:
    """Return the unit in the name of a key: "imu.gyro_bias_sigma_deg_h" → "deg/h"; "" without one."""
    name, tokens = _split(key.rpartition(".")[2])
    text, link = "", ""
    for token in tokens:
        if token in ("sqrt", "per"):
            link = "/√" if token == "sqrt" else "/"
        else:
            text += (link or ("/" if text else "")) + _PRETTY[token]
            link = ""
    return text if name else ""


def label_of(key: str) -> str:
    """Return the words of a key without its unit: "aiding.gnss.position_sigma_m" → "gnss position σ".

    The table's name is left out where the key is clear without it.
    """
    *tables, name = key.split(".")
    words = _split(name)[0]
    plain = words != "rate"  # a quantity of the tables, too
    above = [table for table in tables[-2:] if not (plain and table in _PLAIN and len(tables) == 1)]
    if above and (above[-1].isdecimal() or len(above) == 1):
        words = f"{' '.join(above)} {words}"
    elif above:
        words = f"{above[-1]} {words}"
    return re.sub(r"\bsigma\b", "σ", words.replace("_", " "))


def _split(name: str) -> tuple[str, list[str]]:
    """Return a key's name without its unit, and the parts of the unit."""
    tokens = name.split("_")
    for first in range(1, len(tokens)):
        if tokens[first] in _PRETTY and all(token in _WITHIN for token in tokens[first:]):
            return "_".join(tokens[:first]), tokens[first:]
    return name, []


def toml_text(value: Any) -> str:
    """Return a value as TOML in one line, as `--set` takes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_text, value))}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{_key_text(str(key))} = {toml_text(item)}' for key, item in value.items())}}}"
    return repr(value)


def _key_text(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def value_text(value: Any) -> str:
    """Return a value as people read it: "0.01", "on", "tactical" or "[1, 2]"."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return f"{value:.10g}".replace("-", "−") if isinstance(value, float) else str(value).replace("-", "−")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return toml_text(value)
