"""What a user is told before and after a run: states and why, unknown gravity, memory, what a search tries."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Measurements, measurements_at
from sinssim.errors import InputError
from sinssim.estimation import Block, ErrorModel
from sinssim.estimation.filter_result import Divergence, Innovations, Reasons
from sinssim.estimation.state_model import GRAVITY
from sinssim.logs.log_files import recorded_errors
from sinssim.scenario import Scenario, filter_model, run_memory, unknown_gravity
from sinssim.scenario.filter_model import Excitation, choice, hints, notes, weights
from sinssim.scenario.run_memory import check_memory, needed_memory
from sinssim.scenario.unknown_gravity import UnknownGravity, gravity_notes
from sinssim.simulation import aided_run as diagnosis
from sinssim.simulation.aided_run import _part
from tests.scenario.test_filter_states import standing

MOVED = Excitation(400.0, 0.25, 900.0)
"""400 s, ∫ω² dt of 0.25 rad²/s and ∫f² dt of 900 m²/s³."""
IMU = {
    "gyro_arw_deg_sqrt_h": 0.6, "accel_vrw_ug_sqrt_hz": 100.0, "gyro_bias_sigma_deg_h": 2.0,
    "gyro_scale_sigma_ppm": 100.0, "accel_bias_sigma_ug": 50.0, "accel_misalignment_sigma_arcsec": 3.0,
}  # fmt: skip


def noisy(**more: object) -> Scenario:
    scenario = standing("ideal", 100.0)
    return scenario.model_copy(update={"imu": type(scenario.imu)(grade="ideal", **{**IMU, **more})})


N, NA = math.radians(0.6) / 60.0, 100e-6 * 9.80665


def test_ratios_of_a_recorded_motion() -> None:
    """σ √∫u² dt/N of each block, and the block that d² = 0.3 leaves out."""
    arcsec = math.radians(3.0 / 3600.0)
    expected = {
        "gyro bias": math.radians(2.0 / 3600.0) * math.sqrt(3.0 * 400.0) / N,
        "accelerometer bias": 50e-6 * 9.80665 * math.sqrt(1200.0) / NA,
        "gyro scale": 1e-4 * 0.5 / N,
        "gyro misalignment": 0.0,
        "accelerometer scale": 0.0,
        "accelerometer misalignment": arcsec * math.sqrt(2.0) * 30.0 / NA,
    }
    found = {weight.block: weight for weight in weights(noisy(), MOVED)}
    assert {name: weight.ratio for name, weight in found.items()} == pytest.approx(expected, rel=1e-9)
    assert {name for name, weight in found.items() if weight.needed} == {
        "gyro bias",
        "accelerometer bias",
        "accelerometer misalignment",
    }
    # exactly at 0.3: σ 0.5/N = √0.3
    for factor, needed in ((0.99, False), (1.01, True)):
        ppm = factor * math.sqrt(0.3) * N / 0.5 * 1e6
        (own,) = (w for w in weights(noisy(gyro_scale_sigma_ppm=ppm), MOVED) if w.block == "gyro scale")
        assert own.needed == needed
    # a walk and a ramp count by what they are at the end
    walk = noisy(gyro_bias_sigma_deg_h=0.0, gyro_rrw_deg_h_sqrt_h=3.0)
    (own,) = (w for w in weights(walk, MOVED) if w.block == "gyro bias")
    assert own.ratio == pytest.approx(math.radians(3.0 / 3600.0) / 60.0 * 20.0 * math.sqrt(1200.0) / N, rel=1e-9)


def test_the_choice_in_words() -> None:
    lines = choice(noisy(gyro_scale_sigma_ppm=5e4), MOVED)
    assert lines == (
        "states chosen by the sensors and the recorded motion, with the signal-to-noise ratio of a 1σ error:",
        "  gyro bias                   a state   1.9",
        "  accelerometer bias          a state   17",
        "  gyro scale                  a state   143",
        "  accelerometer scale         left out  no such error",
        "  gyro misalignment           left out  no such error",
        "  accelerometer misalignment  a state   0.63",
    )
    assert choice(noisy())[0].startswith("states chosen by the sensors and the planned motion")
    assert "infinite, no noise" in choice(noisy(gyro_arw_deg_sqrt_h=0.0), MOVED)[1]


def test_what_a_filter_lacks_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filter_model, "excitation", lambda scenario: MOVED)
    scenario = noisy()
    poor = scenario.model_copy(update={"filter": scenario.filter.model_copy(update={"states": ("gyro bias",)})})
    assert list(hints(poor)) == [
        "filter.states lacks errors of the sensors that matter on this motion: accelerometer bias (17 times the noise "
        "over the run), accelerometer misalignment (0.63 times the noise over the run). Add them, or omit "
        "filter.states; they are then chosen automatically."
    ]
    assert list(hints(scenario)) == []
    # (4 % + 2 · 1 %²) of squares, times 0.5/N, is 5.2 times the noise; of accelerometers 3.0 times begins to matter
    large = noisy(gyro_scale_sigma_ppm=4e4, gyro_misalignment_sigma_arcsec=math.degrees(0.01) * 3600.0)
    times = (0.04**2 + 2.0 * 0.01**2) * 0.5 / N
    assert list(hints(large)) == [
        "The errors of the gyros are too large for a linear filter: products of scale factors (4e+04 ppm) and "
        "misalignments (10 mrad) with the attitude errors that such errors cause in turns, which no state describes, "
        f"make up to {times:.2g} times their noise over the run. Calibrate the sensors beforehand ([compensation])."
    ]
    for share, count in ((0.99, 0), (1.01, 1)):
        ppm = math.sqrt(3.0 * share * NA / 30.0) * 1e6
        assert len(list(hints(noisy(accel_scale_sigma_ppm=ppm, accel_misalignment_sigma_arcsec=0.0)))) == count


@pytest.mark.parametrize(("factor", "said"), [(1.01, True), (0.99, False)])
def test_gyros_that_drift_by_more_than_the_earth_turns(factor: float, said: bool) -> None:
    """Bias, instability and random walk over 100 s as 3, 4 and 12 parts of 13; 15.041 cos 48° = 10.06 deg/h."""
    part = factor * 15.041067 * math.cos(math.radians(48.0)) / 13.0
    imu = {"gyro_bias_sigma_deg_h": 3.0 * part, "gyro_instability_deg_h": 4.0 * part,
           "gyro_arw_deg_sqrt_h": 12.0 * part * math.sqrt(100.0 / 3600.0)}  # fmt: skip
    scenario = noisy(**imu)
    own = scenario.filter.model_copy(update={"alignment_s": 100.0, "alignment": "at-rest"})
    found = list(notes(scenario.model_copy(update={"filter": own})))
    assert found == ([
        "filter.alignment_s: the gyros drift by 10.2 deg/h (1σ), and the north component of the Earth's rate is 10.1 "
        "deg/h. Such gyros cannot find the heading, and the run will most likely fail. Use better gyros, or an initial "
        "heading and [aiding.magnetometer] in place of alignment_s."
    ] if said else [])  # fmt: skip


def test_unknown_gravity_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """30 mGal are 30.6 µg and make 0.018 m/s and 0.54 m in 60 s, 12 µg/√Hz 0.91 mm/s and 32 mm; over 222 s 38 times."""
    noise = 12e-6 * 9.80665
    of = UnknownGravity(np.array([10e-5, 20e-5, 20e-5]), 2.5e-5, 40e3, 222.0)
    scenario: Any = SimpleNamespace(gravity=SimpleNamespace(coefficients=lambda: SimpleNamespace(degree=120)))

    def found(density: float = noise, block: Block | None = None, **other: float) -> list[str]:
        monkeypatch.setattr(unknown_gravity, "unknown_gravity", lambda of_scenario: of._replace(**other))
        return list(gravity_notes(scenario, 40e-6 * 9.80665, density, block))

    start = (
        "true gravity ([gravity]), which differs from the known one by 30 mGal (rms along the plan, 30.6 µg); 2.5 mGal "
        "of it change along the way. The filter assumes a bias of 40 µg (1σ) and a noise of 12 µg/√Hz of the "
        "accelerometers. In 60 s without aiding, the disturbance makes 0.018 m/s and 0.54 m, and the noise 0.00091 m/s "
        "and 0.032 m. Over the run the disturbance is up to 38 times the noise: "
    )
    end = (
        "tilts and biases take it up and are wrong by it, beyond the 1σ of their sum, and the filter is then not "
        'consistent. Add "gravity disturbance" to filter.states or omit filter.states, set navigation.gravity_degree = '
        "120, or use a larger filter.inertial_noise_factor."
    )
    states = (
        "the filter has states for it, with a 1σ of 2.1″ of each deflection and of 20 mGal down, and a correlation "
        "distance of 40 km."
    )
    assert found() == [f"The filter does not know the {start}{end}"]
    assert found(block=Block(GRAVITY, (10e-5, 10e-5, 20e-5), correlation_distance=40e3)) == [
        f"The navigator does not know the {start}{states}"
    ]
    assert "change along the way" not in found(changing=0.9e-7)[0]
    scenario.gravity.coefficients = lambda: None
    assert "gravity_degree" not in found()[0]
    assert found(density=39.0 * noise) == []


def test_memory_of_a_plan() -> None:
    """500 s at 20 Hz, a filter of 10 Hz with 9 states, satellites of 3 Hz, which are not among its instants."""
    scenario = standing("ideal", 500.0, states=(), rate_hz=10.0)
    aiding = scenario.aiding.model_copy(update={"gnss": scenario.aiding.gnss.model_copy(update={"rate_hz": 3.0})})
    plain = scenario.model_copy(update={"aiding": aiding})
    assert plain.filter is not None
    matrix, epochs, rows, readings = 8.0 * 81.0, 13.0 * 500.0, 3.0 * 500.0, 6.0 * 500.0
    for smooth, backward, kept in ((False, False, 6.0 * rows), (True, False, 16.0 * rows), (False, True, 7.0 * rows)):
        own = plain.filter.model_copy(update={"smooth": smooth, "backward": backward})
        found, ways = needed_memory(plain.model_copy(update={"filter": own})), 2.0 if backward else 1.0
        assert (found.program, found.increments) == (pytest.approx(0.43e9), 64.0 * 10_000.0 * ways)
        assert found.filter == pytest.approx(epochs * (100.0 + 8.0 * 9.0) * ways + matrix * kept)
        assert found.readings == 104.0 * readings * ways
        assert found.stretch == pytest.approx(matrix * 8.0 * 13.0 * 64.0)
        beside = found.increments + found.filter + found.readings + found.stretch
        assert found.total == found.program + max(found.samples, beside)
    unwritten = needed_memory(plain, recorded=False)
    assert unwritten.program == pytest.approx(0.31e9)
    assert unwritten.samples < needed_memory(plain).samples


def test_errors_of_a_recorded_receiver() -> None:
    """All keys of [log.gnss] reach the states, in the units of [aiding.gnss]."""
    gnss = {
        "file": "x.csv", "format": "text", "time": "t", "use": ["position", "velocity"], "lever_arm_sigma_m": 0.3,
        "correlated_position_sigma_m": 2.0, "correlated_height_sigma_m": 4.0, "correlated_velocity_sigma_mps": 0.1,
        "correlation_time_s": 200.0, "time_offset_sigma_s": 0.05, "velocity_delay_sigma_s": 0.4,
    }  # fmt: skip
    described = SimpleNamespace(log=SimpleNamespace(others=(), gnss=SimpleNamespace(**gnss)))
    (satellites,) = recorded_errors(described.log)  # type: ignore[arg-type]
    found = {state.block: (state.sigma, state.correlation_time) for state in satellites.states() if any(state.sigma)}
    assert found == {
        "gnss-position bias": ((2.0, 2.0, 4.0), 200.0), "gnss-velocity bias": ((0.1, 0.1, 0.1), 200.0),
        "gnss lever arm": ((0.3, 0.3, 0.3), math.inf), "gnss time offset": ((0.05,), math.inf),
        "gnss-velocity delay": ((0.4,), math.inf),
    }  # fmt: skip
    only = SimpleNamespace(log=SimpleNamespace(others=(), gnss=SimpleNamespace(**{**gnss, "use": ["velocity"]})))
    (satellites,) = recorded_errors(only.log)  # type: ignore[arg-type]
    assert not any(state.block.startswith("gnss-position") for state in satellites.states() if any(state.sigma))


OWN = ErrorModel(
    (Block("position", 2.0), Block("velocity", 0.5), Block("attitude", 1e-3), Block("gyro bias", 0.1)), 1e-4, 1e-3
)


def test_parts_of_innovations_and_readings() -> None:
    i = Innovations("s", "baro-height", np.array([1.0, 2.0, 3.0]), np.array([[4.0], [5.0], [6.0]]),
                    np.array([[7.0], [8.0], [9.0]]), np.array([0.1, 0.2, 0.3]), np.array([True, False, True]),
                    Reasons(3, {1: "gate"}), 9.0)  # fmt: skip
    found = _part(i, 2.0)
    assert found.time.tolist() == [1.0, 2.0]
    assert (found.value.tolist(), found.lower.tolist(), found.nis.tolist()) == (
        [[4.0], [5.0]],
        [[7.0], [8.0]],
        [0.1, 0.2],
    )
    assert (found.accepted.tolist(), list(found.reason)) == ([True, False], ["", "gate"])
    m = Measurements("baro-height", np.array([1.0, 2.0, 3.0]), np.array([1.5, 2.5, 3.5]),
                     np.array([[4.0], [5.0], [6.0]]), np.array([[7.0], [8.0], [9.0]]),
                     correlation=np.ones((3, 1, 1)))  # fmt: skip
    some = measurements_at(m, np.array([True, False, True]))
    assert (some.time.tolist(), some.arrival.tolist()) == ([1.0, 3.0], [1.5, 3.5])
    assert (some.value.tolist(), some.sigma.tolist()) == ([[4.0], [6.0]], [[7.0], [9.0]])
    assert some.correlation is not None
    assert len(some.correlation) == 2
    assert measurements_at(m, np.ones(3, dtype=bool)) is m


@pytest.mark.parametrize(("consistent_for", "until"), [(0.0, 305.0), (310.0, 605.0), (700.0, 1205.0), (5000.0, 2000.0)])
def test_a_search_looks_at_the_first_time_that_shows_a_fault(
    monkeypatch: pytest.MonkeyPatch, consistent_for: float, until: float
) -> None:
    """300 s from the start at 5 s, doubled until the innovations speak against the filter, at most to the end."""
    seen: list[float] = []
    monkeypatch.setattr(diagnosis, "consistency", lambda found: SimpleNamespace(consistent=False))
    monkeypatch.setattr(diagnosis, "_consistent_until", lambda found, end: end < consistent_for)
    monkeypatch.setattr(diagnosis, "_diagnosis", lambda *given: seen.append(given[4]))
    monkeypatch.setattr(diagnosis, "replace", lambda found, **more: (found, more))
    start: Any = SimpleNamespace(imu=SimpleNamespace(time=np.array([5.0, 2000.0])))
    diagnosis.diagnosed("found", start, [], {"encoders": None})  # type: ignore[arg-type]
    assert seen == [until]


def test_what_is_said_of_too_little_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of 500 s on a machine of 0.431 GB, of which the program takes 0.43: the filter's part is the largest."""
    scenario = standing("ideal", 500.0, states=(), rate_hz=10.0)
    needed = needed_memory(scenario).total
    monkeypatch.setattr(run_memory, "machine_memory", lambda: 0.4312e9)
    with pytest.raises(InputError) as info:
        check_memory(scenario)
    text = str(info.value)
    assert text.startswith(
        f"filter.rate_hz = 10: a run of about 500 s with a filter of 9 states needs {needed / 1e9:.3g} GB of memory; "
        "this machine has 0.431 GB. A run of "
    )
    fits = float(text.removesuffix(" s would fit; lower rates need less, too.").split("A run of ")[1])
    parked = scenario.parked.model_copy(update={"duration_s": fits})
    assert needed_memory(scenario.model_copy(update={"parked": parked})).total == pytest.approx(0.4312e9, rel=1e-4)
    monkeypatch.setattr(run_memory, "machine_memory", lambda: needed)
    check_memory(scenario)


def test_a_backward_solution_that_cannot_be_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.simulation import aided_run
    from sinssim.simulation import backward_filter as backward

    forward: Any = SimpleNamespace(divergence=Divergence(3.0, "", "x"), remarks=("before",), backward=None)
    monkeypatch.setattr(aided_run, "replace", lambda one, **more: SimpleNamespace(**{**vars(one), **more}))
    imu: Any = None
    found = aided_run._with_backward(forward, imu, [], 0.0, {}, None)
    assert found.remarks == (
        "before", "There is no backward solution, because the filter diverged: the state to start from is not known.",
    )  # fmt: skip
    forward.divergence = None
    at = "The backward solution diverged at 12.3 s: it broke down."
    for end, remarks in ((None, ("before",)), (Divergence(12.34, "b 1", "it broke down"), ("before", at))):
        result = SimpleNamespace(divergence=end)
        monkeypatch.setattr(backward, "run_backward", lambda *given, result=result: result)
        found = aided_run._with_backward(forward, imu, [], 0.0, {}, None)
        assert found.remarks == remarks
        assert (found.backward is result) == (end is None)
