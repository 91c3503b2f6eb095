"""Which errors of the inertial sensors are states by default: against closed forms, and by the run's own tests."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.experiments.run.filter_summary import sentences
from sinssim.experiments.run.run_execution import run
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.filter_model import LEFT_OUT, choice, excitation, hints, notes, states, weights, with_states
from sinssim.scenario.filter_section import FILTER_STATES
from sinssim.scenario.planned_limits import expected_duration
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.grades import GRADES
from tests.slow import slow

AIDED = (
    "aided_airliner", "align_in_motion", "gyrocompassing", "in_flight_calibration", "mems_uav", "spoofed",
    "transfer_alignment",
)  # fmt: skip
OMEGA, G = 7.292115e-5, 9.80665
BIASES = ("gyro bias", "accelerometer bias")


def standing(grade: str, seconds: float = 60.0, **filter_: object) -> Scenario:
    return Scenario.model_validate(
        {
            "name": "standing",
            "seed": 4,
            "parked": {"latitude_deg": 48.0, "heading_deg": 70.0, "duration_s": seconds},
            "imu": {"grade": grade, "rate_hz": 20.0},
            "navigation": {
                "initial_error": {"velocity_sigma_mps": 0.1, "tilt_sigma_arcmin": 5.0, "heading_sigma_arcmin": 30.0}
            },
            "aiding": {"gnss": {}},
            "filter": filter_,
        }
    )


def test_weights_against_the_matched_filter() -> None:
    """Gyros of 5 ppm, 2″ and 0.002 °/√h, accelerometers of 100 ppm and 10 µg/√Hz, for an hour on the ground."""
    ratio = {w.block: w.ratio for w in weights(standing("laser-navigation", 3600.0))}
    gyro = np.radians(0.002) / 60.0
    assert ratio["gyro scale"] == pytest.approx(5e-6 * OMEGA * 60.0 / gyro, rel=1e-6)
    two_arcsec = np.radians(2.0 / 3600.0)
    assert ratio["gyro misalignment"] == pytest.approx(math.sqrt(2.0) * two_arcsec * OMEGA * 60.0 / gyro, rel=1e-6)
    assert ratio["gyro bias"] == pytest.approx(math.sqrt(3.0) * np.radians(0.0035 / 3600.0) * 60.0 / gyro, rel=1e-6)
    assert ratio["accelerometer scale"] == pytest.approx(1e-4 * 60.0 / 1e-5, rel=1e-6)


def test_choice_follows_grade_and_motion() -> None:
    """On the ground no gyro's scale factor shows; 1 % of a telephone's misalignment does, and in flight all do."""
    assert states(standing("laser-navigation", 3600.0)) == (
        *BIASES,
        "accelerometer scale",
        "accelerometer misalignment",
    )
    assert states(standing("ideal")) == ()
    assert states(load_scenario("mems_uav")) == tuple(FILTER_STATES)[:6]
    assert states(standing("tactical", states=("gyro bias",))) == ("gyro bias",)
    calibrated = load_scenario("mems_uav", ["compensation.accel_bias_sigma_ug=10.0"])
    assert states(calibrated) == ("accelerometer bias",)  # of the rest the calibration knows all
    noiseless = standing("tactical").model_copy(
        update={"imu": load_scenario("mems_uav", ["imu.gyro_arw_deg_sqrt_h=0.0"]).imu}
    )
    assert set(states(noiseless)) == set(tuple(FILTER_STATES)[:6])  # no noise hides anything


@pytest.mark.parametrize("name", ["align_in_motion", *slow("transfer_alignment")])
def test_planned_motion_is_the_flown_one(name: str) -> None:
    """∫ω² dt and ∫f² dt of the plan against the truth that is flown, to a factor of two and a half."""
    scenario = load_scenario(name)
    plan, sensed = excitation(scenario), fly(scenario).increments(100.0)
    step = np.diff(sensed.time)[:, None]
    assert 0.4 < plan.rate / float(np.sum(sensed.dtheta**2 / step)) < 2.5
    assert 0.4 < plan.force / float(np.sum(sensed.dvel**2 / step)) < 2.5
    assert plan.duration == pytest.approx(float(sensed.time[-1]), rel=0.05)


@pytest.mark.parametrize(
    "motion",
    [
        {"type": "coning", "half_angle_deg": 3.0, "frequency_hz": 2.0},
        {"type": "sculling", "angle_deg": 3.0, "displacement_mm": 2.0, "frequency_hz": 2.0},
        {"type": "spin-cone", "angle_deg": 5.0, "precession_deg_s": 10.0, "spin_deg_s": 40.0},
        {"type": "spin-rock", "axis": [0.0, 0.0, 1.0], "spin_deg_s": 5.0, "angle_deg": 2.0, "frequency_hz": 1.0},
    ],
)
def test_motions_in_closed_form(motion: dict[str, object]) -> None:
    scenario = Scenario.model_validate({"name": "m", "motion": {**motion, "duration_s": 10.0}})
    sensed = fly(scenario).increments(1000.0)
    flown = float(np.sum(sensed.dtheta**2 / np.diff(sensed.time)[:, None]))
    assert 0.9 < excitation(scenario).rate / flown < 1.1


@pytest.mark.parametrize("grade", GRADES)
def test_every_grade_is_consistent_by_default(grade: str) -> None:
    """A minute under satellites, the default states: the run's own verdict."""
    kept = run(standing(grade)).summary["filter"]
    assert kept["consistent"], kept["findings"]
    assert kept["hints"] == []


def test_a_poor_filter_is_told_what_it_lacks(tmp_path: Path) -> None:
    result = run(standing("laser-standard", 300.0, states=BIASES), tmp_path / "poor")
    kept = result.summary["filter"]
    assert not kept["consistent"]  # 50 ppm and 5″ of g sit in the biases
    (hint,) = kept["hints"]
    assert "filter.states lacks errors of the sensors that matter on this motion: accelerometer scale (" in hint
    assert "gyro scale" not in hint
    assert hint in (tmp_path / "poor" / "report.html").read_text(encoding="utf-8")
    assert "chosen" not in (tmp_path / "poor" / "scenario.toml").read_text(encoding="utf-8")


def test_the_scenario_as_resolved(tmp_path: Path) -> None:
    """The run directory has the states and why, and loads back to what was run."""
    scenario = standing("laser-standard", 20.0)
    assert scenario.filter is not None
    assert scenario.filter.states is None
    result = run(scenario, tmp_path / "run")
    text = (tmp_path / "run" / "scenario.toml").read_text(encoding="utf-8")
    assert "#   gyro scale                  left out  " in text
    assert load_scenario(tmp_path / "run" / "scenario.toml") == result.scenario == with_states(scenario)
    assert choice(result.scenario) == ()
    assert len(choice(scenario)) == 1 + 6  # those that the sensors do not have are not listed


def test_what_cannot_be_is_said_before_the_run() -> None:
    (note,) = notes(load_scenario("gyrocompassing", ["imu.grade=consumer"]))
    assert "drift by 200 deg/h (1σ), and the north component of the Earth's rate is 9.67 deg/h" in note
    for grade in ("laser-navigation", "laser-standard", "tactical", "mems-tactical"):
        assert not list(notes(load_scenario("gyrocompassing", [f"imu.grade={grade}"])))


def test_errors_too_large_for_a_linear_filter() -> None:
    said = list(hints(load_scenario("in_flight_calibration", ["imu.grade=consumer"])))
    assert len(said) == 2
    assert "scale factors (1e+04 ppm) and misalignments (10 mrad)" in said[0]
    for grade in ("tactical", "mems-tactical", "laser-standard"):
        assert not list(hints(load_scenario("in_flight_calibration", [f"imu.grade={grade}"])))


def test_the_verdict_begins_with_its_reason() -> None:
    parts = {"divergence": None, "faults": [], "sensors": {}, "nees": {}, "noise": {}, "remarks": []}
    told = list(sentences({**parts, "consistent": False, "hints": ["The errors are too large."]}))
    assert told == ["The errors are too large.", "Therefore the filter is not consistent."]
    assert list(sentences({**parts, "consistent": False, "hints": []})) == ["The filter is not consistent."]


def test_sensors_without_errors_find_north_consistently() -> None:
    kept = run(load_scenario("gyrocompassing", ["imu.grade=ideal", "parked.duration_s=900.0"])).summary["filter"]
    assert kept["consistent"], kept["findings"]


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_a_wrong_noise_does_not_make_a_vehicle_move(factor: float) -> None:
    """Whether it stands still during the coarse alignment is judged by the grade, not by what the filter is told."""
    told = [f"filter.inertial_noise_factor={factor}", "parked.duration_s=200.0"]
    assert run(load_scenario("gyrocompassing", told)).aided is not None


@pytest.mark.slow
@pytest.mark.parametrize("name", AIDED)
@pytest.mark.parametrize("grade", GRADES)
def test_every_grade_in_every_aided_scenario(grade: str, name: str) -> None:
    """With default states the filter is consistent, or the program says in words why it cannot be.

    A right filter is said to be wrong by chance once in a hundred runs: two seeds together once in ten thousand.
    """
    scenario = load_scenario(name, [f"imu.grade={grade}", *(["aiding.gnss.ramps=[]"] if name == "spoofed" else [])])
    if list(notes(scenario)):
        assert (name, grade) in (("gyrocompassing", "mems-industrial"), ("gyrocompassing", "consumer"))
        with pytest.raises(InputError, match="gyros that sense the Earth's rate"):
            run(scenario)
        return
    kept = run(scenario).summary["filter"]
    if not kept["consistent"] and grade == "consumer":
        assert "too large for a linear filter" in kept["hints"][0]
    elif not kept["consistent"]:
        assert run(scenario.model_copy(update={"seed": 1001})).summary["filter"]["consistent"]
    assert max([0.0, *(w.ratio**2 for w in weights(scenario) if not w.needed)]) <= LEFT_OUT


def test_a_block_that_turns_far_between_predictions_is_reported() -> None:
    """A shoe: θ²/24 times the largest ratio of the gyros' scale factors and misalignments, from 3 on."""
    given = load_scenario("foot_walk", ["filter.rate_hz=10"])
    assert not list(notes(load_scenario("foot_walk")))
    (told,) = notes(given)
    angle = np.sqrt(given.source.turning(given.truth) / expected_duration(given)) / 10.0
    ratio = (
        angle**2 / 24.0 * max(w.ratio for w in weights(given) if w.block.startswith("gyro") and "bias" not in w.block)
    )
    assert told.startswith(f"filter.rate_hz = 10: the block turns by {np.degrees(angle):.0f} deg (rms)")
    assert f"by up to {ratio:.2g} times" in told
    least = 10.0 * np.sqrt(ratio / 3.0)
    assert told.endswith(f"Set filter.rate_hz = {10 * int(np.ceil(least / 10.0))} or more.")
    assert least < 40.0
    assert told in list(hints(given))


def test_errors_without_a_state_are_reported() -> None:
    """Each error that matters and is not named, with its ratio; none for the states by default."""
    given = ["imu.gyro_g_sensitivity_sigma_deg_h_per_g=100", 'filter.states=["gyro bias", "accelerometer bias"]']
    scenario = load_scenario("mems_uav", given)
    (told,) = notes(scenario)
    assert told.startswith("filter.states lacks errors of the sensors that matter on this motion: gyro scale (")
    assert "gyro g-sensitivity (" in told
    assert told in list(hints(scenario))
    assert not list(notes(load_scenario("mems_uav", given[:1])))
