"""Take-off and landing of a design: the circuit's geometry, what is tried in turn, and flights of shipped aircraft."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sinssim.content import list_content
from sinssim.errors import InputError
from sinssim.system.files import Draft
from sinssim.truth.aircraft_design import aircraft_design
from sinssim.truth.aircraft_design.acceptance_flight import circuit_plan
from sinssim.truth.flight.aircraft import load_aircraft
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import bring_to_start, loaded_model, quiet
from sinssim.truth.flight.jsbsim_simulation import fly_plan
from sinssim.truth.flight.leg import not_attained

DESIGNED = [
    name for name, file in list_content("aircraft").items() if file.read_text(encoding="utf-8").startswith("# Made by")
]
LANDING = [name for name in DESIGNED if load_aircraft(name).performance.approach_kt is not None]
KNOT = 1852.0 / 3600.0


def test_the_circuit_leads_beside_its_approach() -> None:
    """Abeam, a half circle of V²/(g tan φ) to the right ends on the centreline, 6 km and 50 s before the threshold."""
    performance = load_aircraft("737").performance
    legs: list[Any] = list(circuit_plan("737", performance, 3000.0).legs)
    assert [leg.type for leg in legs] == ["take_off", "turn", "waypoint", "turn", "land"]
    speed = performance.initial_climb_kt * KNOT
    radius = speed**2 / (9.80665 * math.tan(math.radians(performance.bank_deg)))
    east = math.radians(legs[2].longitude_deg) * 6378137.0 * math.cos(math.radians(45.0))
    assert east == pytest.approx(2.0 * radius, rel=0.01)
    north = math.radians(legs[2].latitude_deg - 45.0) * 6367382.0  # mean radius of the meridian there
    assert north == pytest.approx(-6000.0 - 50.0 * speed, rel=0.01)
    without = performance.model_copy(update={"approach_kt": None})
    assert [leg.type for leg in circuit_plan("737", without, 3000.0).legs] == ["take_off"]


def design(tmp_path: Path, thrust: float, fails: Any) -> tuple[str, Any, list[Any]]:
    """Return the sentence, the performance and what was flown of a design whose circuits fail as said."""
    made: Any = object.__new__(aircraft_design._Design)
    made._facts = SimpleNamespace(stall_kt=100.0)
    made._folder, made._report, made.aircraft = tmp_path, lambda *_: None, load_aircraft("737")
    made.aircraft = made.aircraft.model_copy(
        update={"performance": made.aircraft.performance.model_copy(update={"approach_kt": None})}
    )
    flown = []

    def circuit(performance: Any, runway: float) -> Any:
        flown.append((performance, runway))
        made.aircraft = made.aircraft.model_copy(update={"performance": performance})
        if word := fails(performance, runway):
            raise InputError(f"leg 5 (land) failed at 9.0 s of the flight: {word}. The 737 was at a height of 9 m.")
        return SimpleNamespace(events=())

    made._circuit = circuit
    made._change = lambda **new: setattr(made, "aircraft", made.aircraft.model_copy(update=new))
    return made.from_the_runway(thrust), made.aircraft.performance, flown


@pytest.fixture(autouse=True)
def height(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aircraft_design, "standing_height", lambda record: 3.048)


def test_the_first_approach_that_lands_is_kept(tmp_path: Path) -> None:
    """Of 8 m/s² the run takes half; each airspeed is tried with more and more brakes, on 3000 m, then on 5000 m."""

    def hard(p: Any, runway: float) -> str:
        return "the touchdown is too hard" if (p.approach_kt or 200.0) < 140.0 else ""

    words, kept, flown = design(tmp_path, 8.0, hard)
    assert words == "It takes off and lands in calm air on 3000 m; its approach is at 1.45 of the stall's airspeed."
    assert (kept.approach_kt, kept.braking, kept.standing_height_m, kept.takeoff_throttle) == (145.0, 0.3, 3.05, 0.5)
    assert [p.approach_kt for p, _ in flown] == [None, 130.0, 130.0, 130.0, 145.0]

    def long(p: Any, runway: float) -> str:
        return "it overruns" if p.approach_kt and (p.braking < 1.0 or runway < 5000.0) else ""

    words, kept, flown = design(tmp_path, 2.0, long)
    assert words == "It takes off and lands in calm air on 5000 m; its approach is at 1.3 of the stall's airspeed."
    assert [p.braking for p, _ in flown[1:4]] == [0.3, 0.6, 1.0]
    assert [runway for _, runway in flown] == [5000.0] + 12 * [3000.0] + 3 * [5000.0]
    assert (kept.approach_kt, kept.takeoff_throttle) == (130.0, 1.0)

    words, kept, flown = design(tmp_path, 2.0, lambda p, runway: "it overruns" if p.approach_kt else "")
    assert words == "It takes off, but does not land: it overruns."
    assert (kept.approach_kt, kept.takes_off, len(flown)) == (None, True, 25)


def test_what_cannot_take_off_or_land_says_why(tmp_path: Path) -> None:
    words, kept, _ = design(tmp_path, 8.0, lambda p, runway: "the engines do not start within 90 s")
    assert words == "It does not take off: the engines do not start within 90 s."
    assert kept.takes_off is False
    plan = FlightPlan.model_validate(
        {
            "aircraft": "sgs233", "start": {"on": "runway", "latitude_deg": 45.0, "longitude_deg": 0.0},
            "legs": [{"type": "take_off"}],
        }
    )  # fmt: skip
    with pytest.raises(InputError, match=r"flight\.legs\.1 \(take_off\): the aircraft sgs233 does not take off, as"):
        list(plan.reckoned())


@pytest.mark.parametrize(
    "name", [name if name == "B747" else pytest.param(name, marks=pytest.mark.slow) for name in LANDING]
)
def test_shipped_designs_take_off_and_land(name: str) -> None:
    assert {"A320", "787-8", "B747", "Concorde", "f15", "T38", "DHC6", "J3Cub"} <= set(LANDING)
    performance = load_aircraft(name).performance
    text = list_content("aircraft")[name].read_text(encoding="utf-8")
    record = fly_plan(circuit_plan(name, performance, 3000.0 if "in calm air on 3000 m" in text else 5000.0))
    assert not_attained(record.events) == []
    assert record.events[-1].text == "leg 5 (land) ends"


def test_the_propellers_turn_fast_for_a_take_off() -> None:
    """The levers of both propellers are forward on the runway."""
    aircraft = load_aircraft("DHC6")
    with quiet(), Draft() as folder:
        executive = loaded_model("DHC6", aircraft, str(folder.path))
        bring_to_start(executive, circuit_plan("DHC6", aircraft.performance, 3000.0), aircraft, 0)
        assert [executive[f"fcs/advance-cmd-norm[{engine}]"] for engine in range(2)] == [1.0, 1.0]
