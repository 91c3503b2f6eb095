"""The trade study of one scenario whose keys take several values, `--vary KEY=VALUES`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from sinssim.content import find_content, list_content
from sinssim.errors import InputError, shortened
from sinssim.experiments.studies.trade_schema import MOST_CELLS, TradeStudy
from sinssim.scenario.overrides import override, parse_value
from sinssim.toml_mistakes import read_toml, validate

FORM = (
    "Write values with commas (50,100,200), a range START:STOP:STEP with its stop if it lies on the grid (0.5:2:0.25), "
    "or N values in equal ratios, START:STOP:logN (0.1:10:log5)."
)
"""How values are written."""
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"({_NUMBER}):({_NUMBER}):(?:log(\d{{1,6}})|({_NUMBER}))")
_PARTS = re.compile(r"""("(?:\\.|[^"\\])*"|'[^']*')|([\[{(])|([\]})])|(,)|[^"'\[{()}\],]+|["']""")
_DIGITS = 4
"""Significant digits of the values between the ends of a range in equal ratios."""


def sweep(scenario: str, vary: Sequence[str], settings: Sequence[str] = ()) -> TradeStudy:
    """Return the trade study of a scenario's file or name whose keys take several values, one axis "key.path=values" of
    `FORM` for each to vary, as from a file with these keys; it has the scenario's name with "-trade". Settings
    "key.path=value" are of the study (cell, runs, times_s, …) or else of the scenario in every cell."""
    data: dict[str, Any] = {"name": f"{_checked_scenario(scenario)}-trade", "scenario": scenario, "axes": []}
    for written in vary:
        key, _, values = (part.strip() for part in written.partition("="))
        if not key or not values:
            raise InputError(f"--vary {shortened(written)}: write KEY=VALUES, for example imu.rate_hz=50,100. {FORM}")
        data["axes"].append({"key": key, "values": _values(values, shortened(written))})
    overridden = set()
    for setting in settings:
        if setting.partition("=")[0].strip().partition(".")[0] in TradeStudy.model_fields:
            overridden.add(override(data, setting))
        else:
            data.setdefault("set", []).append(setting)
    try:
        return validate(TradeStudy, data, "", scenario, overridden)
    except InputError as error:  # there is no file that counts its axes
        keys = [axis["key"] for axis in data["axes"]]
        raise InputError(re.sub(r"axes\.(\d+)", lambda m: f"--vary {keys[int(m[1]) - 1]}", str(error))) from error


def _checked_scenario(scenario: str) -> str:
    """Return the name of a scenario; raise for a study."""
    if not scenario.endswith(".toml"):
        is_study = scenario in list_content("studies") and scenario not in list_content("scenarios")
    else:
        data = read_toml(find_content("scenarios", scenario))[1]
        is_study = "axes" in data or "parts" in data
    if is_study:
        raise InputError(
            f"--vary varies the keys of a scenario, but {shortened(scenario)} is a study, which has its own values. "
            "Change them with --set, for example --set axes.1.values=[1, 2]."
        )
    return re.sub(r"[^\w.-]", "-", Path(scenario).stem, flags=re.ASCII).lstrip("-_.")[:50] or "scenario"


def _values(written: str, axis: str) -> list[Any]:
    """Return the values of an axis."""
    values: list[Any] = []
    for item in _split(written):
        if not item:
            raise InputError(f"--vary {axis}: a value is missing beside a comma. {FORM}")
        if match := _RANGE.fullmatch(item):
            values += _range(match, axis)
        elif re.fullmatch(r"[^\s\[\"'{:]*:[^\"'\[{]*", item):
            raise InputError(f"--vary {axis}: {shortened(item)!r} is not a range of numbers. {FORM}")
        elif unit := re.fullmatch(rf"{_NUMBER}\s*([A-Za-zµ°%/][^\s]*)", item):
            raise InputError(
                f"--vary {axis}: {shortened(item)!r} has a unit, {unit[1]!r}; the unit is part of the key's name. "
                "Write the number alone."
            )
        else:
            values.append(parse_value(item, f"--vary {axis}"))
        if len(values) > MOST_CELLS:
            break
    return values


def _split(written: str) -> list[str]:
    """Return the parts between commas outside of quotes and brackets."""
    parts, depth = [""], 0
    for match in _PARTS.finditer(written):
        depth += bool(match[2]) - bool(match[3])
        if match[4] and depth <= 0:
            parts.append("")
        else:
            parts[-1] += match[0]
    return [part.strip() for part in parts]


def _range(match: re.Match[str], axis: str) -> list[Any]:
    """Return the values of a range; its steps are exact decimals, so that its stop is met."""
    start, stop = Decimal(match[1]), Decimal(match[2])
    if match[3] is not None:
        count = int(match[3])
        if not (start > 0 and stop > 0) or count < 2 or start == stop:
            raise InputError(
                f"--vary {axis}: {match[0]} needs two different positive ends and at least log2: values in equal "
                "ratios, the ends included."
            )
        _check_count(count, match[0], axis)
        ratio = float(stop) / float(start)
        between = (float(start) * ratio ** (k / (count - 1)) for k in range(1, count - 1))
        return [float(start), *(float(f"{value:.{_DIGITS}g}") for value in between), float(stop)]
    step = Decimal(match[4])
    if step == 0 or (stop - start) / step < 0:
        way = "must not be 0" if step == 0 else f"leads away from {match[2]}, so that there is no value"
        raise InputError(f"--vary {axis}: the step of {match[0]} {way}.")
    count = int((stop - start) / step) + 1
    _check_count(count, match[0], axis)
    whole = all(re.fullmatch(r"[-+]?\d+", text) for text in match.group(1, 2, 4))
    return [(int if whole else float)(start + k * step) for k in range(count)]


def _check_count(count: int, written: str, axis: str) -> None:
    if count > MOST_CELLS:
        raise InputError(
            f"--vary {axis}: {written} has {count} values, and a study has at most {MOST_CELLS} cells; give a larger "
            "step."
        )
