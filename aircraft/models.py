"""Writes aircraft/README.md: which models of JSBSim's package `sinssim aircraft add` makes an aircraft of.

python aircraft/models.py STORE designs every model whose result is not in the folder STORE yet, and then writes
the page; with the option --page it only writes the page. Half an hour on one core is enough.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

from sinssim.errors import InputError
from sinssim.truth.aircraft_design.acceptance_flight import acceptance_numbers
from sinssim.truth.aircraft_design.aircraft_design import DesignedAircraft
from sinssim.truth.aircraft_design.design_process import design_apart
from sinssim.truth.aircraft_design.model_survey import package_models

PAGE = Path(__file__).parent / "README.md"
HEAD = """# JSBSim's models

`sinssim aircraft add MODEL` makes an aircraft of {accepted} of {count} models in JSBSim's package. Each number is
the largest of the acceptance flight: height and heading of straight and level flight, airspeed of climb and descent;
margins are the least of pitch, roll and yaw at the trims. A glider holds no height.
The airspeed of the approach is that with which it takes off from a runway and lands on it.
`python aircraft/models.py` writes this page.

| model | cruise, kt | margins, dB and ° | height, m | airspeed, kt | heading, ° | approach, kt |
|---|---|---|---|---|---|---|
"""
TAIL = """
The others cannot be flown:

| model | reason |
|---|---|
"""


def result(model: str) -> dict[str, Any]:
    """Design a model; return the numbers of the page."""
    begun = time.monotonic()
    try:
        made = design_apart(model, None, lambda text, fraction: None)
    except InputError as error:
        return {"model": model, "reason": str(error), "seconds": round(time.monotonic() - begun, 1)}
    return {**_numbers(made), "seconds": round(made.seconds, 1), "text": made.text}


def _numbers(made: DesignedAircraft) -> dict[str, Any]:
    legs = acceptance_numbers(made.name, made.height, made.errors)["legs"]
    margins = [made.design.least(loop) for loop in ("pitch", "roll", "yaw")]
    return {
        "model": made.name,
        "cruise_kt": made.aircraft.performance.cruise_kt,
        "gain_db": min(float(m.gain_db) for m in margins),
        "phase_deg": min(float(m.phase_deg) for m in margins),
        "height_m": max(leg["height_m"] or 0.0 for leg in legs if leg["kind"] == "hold"),
        "approach_kt": made.aircraft.performance.approach_kt,
        "on_ground": made.on_ground,
        "glider": made.aircraft.performance.glider,
        "airspeed_kt": max(leg["airspeed_kt"] for leg in legs if leg["kind"] in ("climb", "descend")),
        "heading_deg": max(leg["heading_deg"] for leg in legs if leg["kind"] == "hold"),
        "legs": legs,
    }


def page(results: list[dict[str, Any]]) -> str:
    """Return the page of the results, which names the models without one."""
    flown = [one for one in results if "reason" not in one]
    text = HEAD.format(accepted=len(flown), count=len(results))
    for one in flown:
        gain = "–" if one["gain_db"] > 90.0 else f"{one['gain_db']:.0f}"
        height = "–" if one["glider"] else f"{one['height_m']:.1f}"
        approach = f"{one['approach_kt']:.0f}" if one["approach_kt"] else "–"
        text += (
            f"| {one['model']} | {one['cruise_kt']:.0f} | {gain}, {one['phase_deg']:.0f} | {height} | "
            f"{one['airspeed_kt']:.1f} | {one['heading_deg']:.2f} | {approach} |\n"
        )
    for one in flown:
        if not one["approach_kt"]:
            text += f"\n{one['model']}: {one['on_ground']}\n"
    text += TAIL
    for one in results:
        if "reason" in one:
            reason = one["reason"].removeprefix(f"the model {one['model']} cannot be flown: ").rstrip(".")
            text += f"| {one['model']} | {reason} |\n"
    if left := sorted(set(package_models()) - {one["model"] for one in results}):
        text += f"\nNot tried: {', '.join(left)}.\n"
    return text


def main() -> None:
    """Design the models that are not stored yet, and write the page."""
    store, *wanted = map(Path, sys.argv[1:])
    store.mkdir(parents=True, exist_ok=True)
    for model in [] if "--page" in sys.argv else [path.name for path in wanted] or package_models():
        file = store / f"{model}.json"
        if not file.is_file():
            file.write_text(json.dumps(result(model)), encoding="utf-8")
            print(model, json.loads(file.read_text(encoding="utf-8")).get("reason", "accepted"), flush=True)
    results = [json.loads(file.read_text(encoding="utf-8")) for file in sorted(store.glob("*.json"))]
    PAGE.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
