"""Linear models: known systems from their responses, known margins, and the airframe by JSBSim's own linearisation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from sinssim.errors import InputError
from sinssim.truth.aircraft_design.linear_model import (
    LATERAL,
    OMEGA,
    VERTICAL,
    FlownResponses,
    LinearModel,
    Trim,
    lift_lag,
    margins,
    realised,
)
from sinssim.truth.aircraft_design.loop_design import engine_response
from sinssim.truth.flight.autopilot import INTERVAL
from sinssim.truth.flight.flight_plan import FlightPlan
from sinssim.truth.flight.jsbsim_model import bring_to_start, loaded_model, quiet


def held(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete system of x' = A x + B u with u held for the autopilot's interval."""
    n, m = b.shape
    block = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * INTERVAL)
    return block[:n, :n], block[:n, n:]


def model_of(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> LinearModel:
    return LinearModel(*held(np.array(a, float), np.array(b, float)), np.array(c, float), inputs, outputs, 0.0)


def plan(aircraft: str, height: float, speed: float) -> FlightPlan:
    start = {"on": "air", "latitude_deg": 45.0, "longitude_deg": 0.0, "altitude_m": height, "airspeed_kt": speed}
    return FlightPlan.model_validate(
        {"aircraft": aircraft, "start": start, "legs": [{"type": "hold", "duration_s": 1.0}]}
    )


def test_a_known_system_is_recovered_from_its_step_responses() -> None:
    """s² + 2 s + 9 and a lag of 0.5 s with two inputs: poles −1 ± i√8 and −2; responses by 1/(s² + 2 s + 9)."""
    a = np.array([[0.0, 1.0, 0.0], [-9.0, -2.0, 0.0], [0.0, 0.0, -2.0]])
    known = model_of(
        a, [[0.0, 0.0], [1.0, 0.3], [0.0, 2.0]], [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]], ("u", "v"), ("y", "z")
    )
    steps = np.stack([known.step(name, 200) for name in ("u", "v")], axis=2)
    found = realised(steps, ("u", "v"), ("y", "z"))
    assert len(found.a) == 3
    assert found.misfit < 1e-8
    poles = sorted(found.poles(), key=lambda pole: (pole.real, pole.imag))
    assert poles == pytest.approx([-2.0, -1.0 - math.sqrt(8.0) * 1j, -1.0 + math.sqrt(8.0) * 1j], abs=1e-6)
    # at 1 rad/s the hold of 33 ms is a lag of half of it, to 1e-4
    hold = np.exp(-0.5j * INTERVAL)
    assert found.response(np.array([1.0]))[0, 0, 0] == pytest.approx(hold / (8.0 + 2.0j), rel=2e-4)


def test_margins_of_a_triple_lag() -> None:
    """2/(s + 1)³: phase −180° at √3 rad/s where its gain is 1/4: 12.04 dB; gain 1 at √(2^⅔ − 1), there 67.6°."""
    s = 1j * OMEGA
    found = margins(2.0 / (s + 1.0) ** 3)
    crossover = math.sqrt(2.0 ** (2.0 / 3.0) - 1.0)
    assert found.gain_db == pytest.approx(20.0 * math.log10(4.0), abs=0.02)
    assert found.crossover == pytest.approx(crossover, rel=2e-3)
    assert found.phase_deg == pytest.approx(180.0 - 3.0 * math.degrees(math.atan(crossover)), abs=0.1)
    integrator = margins(3.0 / s)
    assert (integrator.phase_deg, integrator.crossover) == pytest.approx((90.0, 3.0), rel=1e-3)
    assert math.isinf(integrator.gain_db)
    low = margins(0.1 / (s + 1.0))
    assert (math.isinf(low.phase_deg), low.crossover) == (True, 0.0)


def test_the_lag_of_the_lift_and_of_an_engine() -> None:
    """γ' = α/1.4 s, α' = q − γ' under an elevator that rotates; and an airspeed behind an engine's lag of 0.8 s."""
    a = np.array([[-1 / 1.4, 1.0, 0.0], [0.0, -3.0, 0.0], [1 / 1.4, 0.0, 0.0]])  # alpha, q, gamma
    lift = model_of(a, [[0.0], [-2.0], [0.0]], [[1.0, 0.0, 0.0], [0.0, 0.0, 80.0]], ("elevator",), ("alpha", "climb"))
    trim = Trim(0.05, 0.5, 0.0, 80.0, 70.0, 0.05)
    assert lift_lag(lift, trim) == pytest.approx(1.4, rel=1e-3)
    a = np.array([[-1 / 0.8, 0.0], [2.5, 0.0]])  # thrust's share, airspeed
    engine = model_of(a, [[1 / 0.8], [0.0]], [[0.0, 1.0]], ("throttle",), ("cas",))
    lag, thrust = engine_response(engine)
    assert thrust == pytest.approx(2.5, rel=1e-3)
    assert lag == pytest.approx(0.8, abs=0.3)  # the mean over half a second
    with pytest.raises(InputError, match="the throttle does not accelerate"):
        engine_response(model_of(a * [[1.0], [0.01]], [[1 / 0.8], [0.0]], [[0.0, 1.0]], ("throttle",), ("cas",)))


@pytest.fixture(scope="module")
def airliner() -> tuple[FlownResponses, LinearModel, LinearModel]:
    flown = FlownResponses(plan("737", 3000.0, 280.0))
    return flown, flown.linear(LATERAL, 10.0), flown.linear(VERTICAL, 12.0)


def test_another_manoeuvre_is_predicted(airliner: tuple[FlownResponses, LinearModel, LinearModel]) -> None:
    """Doublets of elevator and aileron that the models have not seen, two seconds each way, are met within 3 %."""
    flown, lateral, vertical = airliner
    for model, control, size in ((vertical, "elevator", 0.02), (lateral, "aileron", 0.05)):

        def doublet(step: int, size: float = size) -> float:
            return size if step < 60 else -size if step < 120 else 0.0

        known = flown.fly(lambda step, control=control: {control: doublet(step)}, model.outputs, 180)
        rest = flown.fly(lambda step: {}, model.outputs, 180)
        state, column, found = np.zeros(len(model.a)), model.b[:, model.inputs.index(control)], []
        for step in range(181):
            found.append(model.c @ state)
            state = model.a @ state + column * doublet(step)
        rate = model.outputs.index("q" if control == "elevator" else "p")
        change = (known - rest)[:, rate]
        assert np.abs(np.array(found)[:, rate] - change).max() < 0.03 * np.abs(change).max()


def test_the_short_period_and_the_dutch_roll_are_those_of_jsbsim(
    airliner: tuple[FlownResponses, LinearModel, LinearModel], tmp_path: object
) -> None:
    """JSBSim differentiates its accelerations by its states at the same trim, without actuators; and its trim's angle
    of attack and throttle are those that the responses began from."""
    import jsbsim

    flown, lateral, vertical = airliner
    with quiet():
        executive = loaded_model("737", flown._aircraft, str(tmp_path))
        bring_to_start(executive, plan("737", 3000.0, 280.0), flown._aircraft, 0)
        assert executive["aero/alpha-rad"] == pytest.approx(flown.trim.alpha, rel=1e-9)
        assert executive["fcs/throttle-cmd-norm[0]"] == pytest.approx(flown.trim.throttle, rel=1e-9)
        poles = np.linalg.eigvals(jsbsim.FGLinearization(executive).system_matrix)
    fast = [pole for pole in poles if pole.imag > 0.5]
    for model in (vertical, lateral):
        mine = [pole for pole in model.poles() if 0.5 < pole.imag < 10.0]
        assert min(abs(a - b) / abs(b) for a in mine for b in fast) < 0.05


def test_steps_of_one_interval_are_those_of_a_step_command() -> None:
    known = model_of([[-1.0]], [[1.0]], [[1.0]], ("u",), ("y",))
    assert known.step("u", 3)[:, 0] == pytest.approx([1.0 - math.exp(-k * INTERVAL) for k in range(4)])
