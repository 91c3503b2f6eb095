"""A walk: strides, rest and swing by their stated numbers, the closed course, closure, and its detection."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.experiments.run.filter_summary import sentences
from sinssim.rotation.quaternions import euler_from_quaternion
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.filter_model import with_states
from sinssim.scenario.true_motion import fly
from sinssim.simulation.aided_run import aid_run, readings_along
from sinssim.simulation.navigation_stage import first_state
from sinssim.simulation.truth_and_sensors import sense, truth_along
from sinssim.truth.motions.walk import SHOCK_S, WalkMotion
from sinssim.units import G0
from tests.truth.motions import ecef
from tests.truth.test_independent_integration import closure

SQUARE = [{"type": "straight", "distance_m": 7.0}, {"type": "turn", "angle_deg": 90.0}] * 4


def walk(*legs: dict[str, Any], **keys: Any) -> WalkMotion:
    return WalkMotion.model_validate({"type": "walk", "legs": list(legs), **keys})


def test_a_foot_stands_exactly_still_and_swings_as_stated() -> None:
    """Without scatter: 0.4 of a stride at rest; 600 °/s in the swing; 1 + 8 g where the sole is pressed most."""
    motion = walk({"type": "straight", "distance_m": 140.0}, length_scatter=0.0, duration_scatter=0.0).trajectory()
    assert motion.end == pytest.approx(110.0)
    time = np.arange(0.0, 11.0, 1e-3)
    state = motion.state(time)
    rest = np.linalg.norm(state.velocity_ned, axis=1) == 0.0
    phase = np.mod(time, 1.1)
    assert rest[phase < 0.4399].all()
    assert not rest[(phase > 0.4401) & (phase < 1.0999)].any()
    position = ecef(motion, time)[0]
    for stride in range(10):
        inside = (time > 1.1 * stride) & (phase < 0.4399) & (time < 1.1 * stride + 1.0)
        assert np.ptp(position[inside], axis=0).max() < 1e-8  # the rounding of Earth-fixed coordinates
    omega, force = motion.rates(time)
    assert np.degrees(np.abs(omega[:, 1]).max()) == pytest.approx(600.0, abs=0.05)
    instant = np.array([1.1 - 0.5 * SHOCK_S])  # the foot is not quite level, and the swing slows down
    assert np.linalg.norm(motion.rates(instant)[1]) / 9.81 == pytest.approx(9.0, abs=0.35)
    assert np.linalg.norm(force, axis=1).max() / G0 < 9.6
    assert state.height.max() == pytest.approx(0.12, abs=1e-3)
    pitch = euler_from_quaternion(state.q_nb)[1]
    assert pitch.min() < -4.0 * pitch.max() < -0.5  # the toe points down more than up
    step = np.linalg.norm(np.diff(position[np.searchsorted(time, 1.1 * np.arange(9) + 0.2)], axis=0), axis=1)
    np.testing.assert_allclose(step, 1.4, atol=1e-6)


def test_strides_scatter_by_the_seed_within_a_course_that_closes() -> None:
    """1500 strides: the 1σ of a sample has a relative 1σ of 1/√3000 = 1.8 %."""
    section = walk({"type": "straight", "distance_m": 2100.0})
    motion = section.motion(seed=4)
    lengths, durations = np.diff(motion._place[:, 0]), motion._duration / 0.6
    assert lengths.sum() == pytest.approx(2100.0, rel=1e-12)
    assert section.duration_s == pytest.approx(1500 * 1.1)
    assert motion._begin[-1] + motion._duration[-1] == pytest.approx(1500 * 1.1)
    assert lengths.std() / 1.4 == pytest.approx(0.05, rel=0.08)
    assert durations.std() / 1.1 == pytest.approx(0.03, rel=0.08)
    assert abs(np.corrcoef(lengths, durations)[0, 1]) < 4.0 / np.sqrt(1500.0)
    assert np.array_equal(lengths, np.diff(section.motion(seed=4)._place[:, 0]))
    assert not np.array_equal(lengths, np.diff(section.motion(seed=5)._place[:, 0]))
    square = walk(*SQUARE, heading_deg=30.0).motion(seed=2)
    np.testing.assert_allclose(square._place[-1], 0.0, atol=1e-12)
    assert square._heading[-1] == pytest.approx(2.0 * np.pi)
    corner = square._place[5 : 5 + 3]  # the footholds of a turn of 3.14 m lie on its arc about (7, 2)
    np.testing.assert_allclose(np.linalg.norm(corner - [7.0, 2.0], axis=1), 2.0)


def test_increments_lead_back_to_the_truth() -> None:
    """The independent integrator and the navigator, over 27 s at 1000 Hz."""
    motion = walk(*SQUARE).trajectory(seed=1)
    horizontal, attitude = closure(motion, 1000.0)
    assert horizontal < 1e-6
    assert attitude < 1e-11
    imu = motion.increments(1000.0)
    last = sinssim.navigate(imu, motion.state(0.0), gravity="normal")
    truth = motion.state(last.time)
    assert 6.4e6 * np.abs(last.latitude - truth.latitude).max() < 1e-7


@pytest.mark.slow
def test_an_hour_of_walking_closes() -> None:
    """The bar is 1e-5 m; the navigator comes ten times nearer."""
    side = [{"type": "straight", "distance_m": 1142.0}, {"type": "turn", "angle_deg": 90.0}]
    motion = walk(*side * 4).trajectory(seed=3)
    assert motion.end == pytest.approx(3600.0, abs=10.0)
    imu = motion.increments(1000.0)
    last = sinssim.navigate(imu, motion.state(0.0), gravity="normal")
    truth = motion.state(last.time)
    assert 6.4e6 * np.abs(last.latitude - truth.latitude).max() < 2e-6


def test_rest_on_foot_is_detected_and_holds_the_error() -> None:
    """30 m in 25 s with a MEMS IMU: hardly a stance is missed, no swing taken for one, and the aided error stays small.

    The free inertial error is that of an accelerometer's 2 mg or more: ½ 0.02 m/s² (35 s)² is 12 m."""
    scenario = load_scenario("foot_walk")
    assert scenario.motion is not None
    legs = [{"type": "stop", "duration_s": 10.0}, {"type": "straight", "distance_m": 30.0}]
    motion = {**scenario.motion.model_dump(), "legs": legs}
    aiding = {"zero_velocity": {"rate_hz": 20.0, "detect": True, "detector": "foot", "learn_s": [[0.0, 10.0]]}}
    run = sinssim.run(Scenario.model_validate({**scenario.contents(), "motion": motion, "aiding": aiding, "seed": 1}))
    detected = run.summary["filter"]["sensors"]["zero-velocity"]["detection"]
    assert detected["at_rest"] == pytest.approx(20 * (10.0 + 0.4 * 21 * 1.1), abs=10)
    assert detected["missed"] < 0.03 * detected["at_rest"]
    assert detected["in_motion"] == 0
    assert detected["readings"] == detected["at_rest"] - detected["missed"]
    (sentence,) = (text for text in sentences(run.summary["filter"]) if "rest was detected" in text)
    missed, rest, readings = detected["missed"], detected["at_rest"], detected["readings"]
    assert f"Of {rest} instants at rest {missed} ({100.0 * missed / rest:.2g} %) were missed; of {readings}" in sentence
    assert sentence.endswith("readings 0 (0 %) are in motion (false alarms).")
    assert run.summary["algorithms"]["quaternion"]["final_horizontal_error_m"] > 4.0
    assert run.summary["filter"]["aided"]["max_horizontal_error_m"] < 0.6  # 2 % of the way


@pytest.mark.parametrize(
    ("leg", "keys"),
    [
        ({"type": "turn", "angle_deg": 3600.0, "radius_m": 0.3}, {}),
        ({"type": "straight", "distance_m": 30.0}, {"stride_s": 10.0, "stance": 0.05, "swing_deg_s": 30.0}),
        ({"type": "stop", "duration_s": 5.0}, {}),
    ],
)
def test_a_walk_may_end_within_rounding_of_a_sample(leg: dict[str, Any], keys: dict[str, float]) -> None:
    """The last swing ends at a multiple of a sample but for 1e-14 s."""
    motion = walk(leg, **keys).trajectory(seed=1)
    imu = motion.increments(100.0)
    assert np.isfinite(imu.dvel).all()
    assert imu.time[-1] == pytest.approx(motion.end, abs=0.01)


def test_foot_walk_is_a_closed_kilometre() -> None:
    scenario = load_scenario("foot_walk")
    assert isinstance(scenario.motion, WalkMotion)
    strides = scenario.motion.motion(scenario.seed)._place
    assert np.linalg.norm(np.diff(strides, axis=0), axis=1).sum() == pytest.approx(1000.0, abs=1.0)  # chords
    np.testing.assert_allclose(strides[-1], 0.0, atol=1e-9)


def test_what_no_foot_does_is_refused() -> None:
    with pytest.raises(InputError, match=r"swing_deg_s = 900: in a swing of 0\.66 s the foot would pitch by more than"):
        load_scenario("foot_walk", ["motion.swing_deg_s=900.0"])
    with pytest.raises(InputError, match="0 is no turn"):
        load_scenario("foot_walk", ["motion.legs.3.angle_deg=0.0"])
    with pytest.raises(InputError, match="detector is for detect = true"):
        load_scenario("foot_walk", ["aiding.zero_velocity.detect=false", "aiding.zero_velocity.learn_s=[]"])


@pytest.mark.slow
def test_a_walk_does_not_show_the_heading() -> None:
    """The σ of the heading of a shoe with a telephone's sensors is that of the same filter along the true motion.

    It was half of that, and headings were wrong by five σ, when each stance's correction of the velocity counted as
    news of the heading."""
    scenario = with_states(load_scenario("foot_walk", ["imu.grade=consumer", "filter.diagnose=false"]))
    truth = truth_along(fly(scenario), scenario)
    sensed = sense(scenario, truth)
    assert sensed.errors is not None
    aiding = readings_along(scenario, truth.trajectory, sensed.imu)
    start = first_state(scenario, truth)
    found, along = (
        aid_run(scenario, truth.trajectory, imu, state, sensed.errors, aiding=aiding, history=False).estimate
        for imu, state in ((sensed.imu, start), (truth.ideal, truth.first))
    )
    for block, k in (("attitude", 2), ("gyro bias", 2)):
        at = found.model.slices[block].start + k
        assert found.sigma[-1, at] == pytest.approx(along.sigma[-1, at], rel=0.1)
