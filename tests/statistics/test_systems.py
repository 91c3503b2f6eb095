"""Compared systems: rates of false alarm and detection, majority, growth after a fault, the shipped study."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.data import Array
from sinssim.errors import InputError
from sinssim.experiments.ensembles import run_seed
from sinssim.scenario import Scenario
from sinssim.statistics.chi_square import compare_systems, detection_probability, mid_value
from sinssim.units import DEG_H
from tests.slow import slow

STUDY = Path(__file__).parents[2] / "scenarios" / "compared_systems.py"
COVARIANCE = np.array([[[4.0, 1.5], [1.5, 1.0]], [[9.0, -2.0], [-2.0, 5.0]]])
TEAMS = 20_000


def draws(systems: int, seed: int = 3) -> Array:
    """Return errors of teams with the covariances, (T, n, 2, 2)."""
    numbers = np.random.default_rng(seed).normal(size=(TEAMS, systems, 2, 2))
    return np.asarray(np.einsum("eij,tnej->tnei", np.linalg.cholesky(COVARIANCE), numbers))


def within(share: float, probability: float, count: int) -> bool:
    """Return whether a share of draws is within 4.5 standard deviations of its probability."""
    return bool(abs(share - probability) < 4.5 * np.sqrt(probability * (1.0 - probability) / count))


@pytest.mark.parametrize("false_alarm", [0.05, 1e-3])
def test_false_alarms_are_as_frequent_as_stated(false_alarm: float) -> None:
    found = compare_systems(draws(3), COVARIANCE, false_alarm)
    for pair in range(3):
        for epoch in range(2):
            assert within(float(found.alarms[:, pair, epoch].mean()), false_alarm, TEAMS)


@pytest.mark.parametrize("size", [2.0, 5.0, 9.0])
def test_faults_are_found_as_often_as_predicted(size: float) -> None:
    effect = size * np.array([[1.0, 0.5], [-0.7, 1.0]])
    outputs = draws(2)
    outputs[:, 0] += effect
    predicted = detection_probability(effect, COVARIANCE, 0.01)
    found = compare_systems(outputs, COVARIANCE, 0.01).detected.mean(axis=0)
    assert all(within(f, p, TEAMS) for f, p in zip(found.tolist(), predicted.tolist(), strict=True))
    assert detection_probability(0.0 * effect, COVARIANCE, 0.01) == pytest.approx(0.01, rel=1e-9)


def test_three_systems_identify_the_faulty_one_by_majority() -> None:
    outputs = np.zeros((4, 3, 1, 2))
    outputs[0, 1] += 50.0  # the second
    outputs[1, 0, :, 0], outputs[1, 1, :, 0] = 50.0, -50.0  # two disagree with all: no majority
    outputs[2, 2, :, 1] = 3.0  # above one difference only
    outputs[2, 0, :, 1] = -1.0
    found = compare_systems(outputs, np.eye(2)[None] * 0.5, 1e-3)
    assert found.detected[:, 0].tolist() == [True, True, True, False]
    assert found.identified[:, 0].tolist() == [1, -1, -1, -1]
    assert (compare_systems(outputs[:, :2], np.eye(2)[None] * 0.5, 1e-3).identified == -1).all()  # two cannot


def test_mid_value_is_not_that_of_the_faulty_system() -> None:
    outputs = draws(3)
    sound = mid_value(outputs)
    outputs[:, 0] += 1e6
    assert mid_value(outputs) == pytest.approx(np.maximum(outputs[:, 1], outputs[:, 2]))
    assert np.var(sound) < np.var(outputs[:, 1])


def test_no_test_without_a_covariance() -> None:
    """At the start the systems have no errors, and their covariance is singular."""
    found = compare_systems(np.zeros((2, 2, 1, 2)), np.zeros((1, 2, 2)), 0.01)
    assert not found.alarms.any()


@pytest.mark.parametrize(
    ("outputs", "covariance", "false_alarm", "message"),
    [
        (np.zeros((3, 1, 5, 2)), np.zeros((5, 2, 2)), 0.01, "with two systems or more"),
        (np.zeros((3, 2, 5, 2)), np.zeros((4, 2, 2)), 0.01, r"covariance has the shape \(4, 2, 2\)"),
        (np.zeros((3, 2, 5, 2)), np.zeros((5, 2, 2)), 1.0, "must be a probability between 0 and 1"),
    ],
)
def test_what_is_refused(outputs: Array, covariance: Array, false_alarm: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        compare_systems(outputs, covariance, false_alarm)


FAULT = {"type": "bias-step", "from_s": 200.0, "gyro_deg_h": (0.0, 0.5, 0.0)}


def at_rest(**imu: Any) -> Scenario:
    """Return an hour of a vehicle at rest, heading north: the right gyro points east, its drift moves it north."""
    place = {"latitude_deg": 45.0, "longitude_deg": 10.0, "altitude_m": 0.0, "heading_deg": 0.0, "duration_s": 3000.0}
    return Scenario.model_validate(
        {"name": "systems", "parked": place, "imu": {"rate_hz": 1.0, **imu}, "navigation": {"vertical": "truth"}}
    )


def closed_form(time: Array) -> Array:
    """Return d R (t − sin ωt/ω) from the fault on, m; the mean radius is exact to 0.3 %."""
    radius, t = 6.371e6, np.maximum(time - 200.0, 0.0)
    omega = np.sqrt(9.806 / radius)
    return np.asarray(0.5 * DEG_H * radius * (t - np.sin(omega * t) / omega))


def test_difference_grows_as_the_closed_form() -> None:
    """Two systems without other errors: within 3.5 %, as the Earth's rotation by 12° is neglected."""
    one, other = (sinssim.run(at_rest(grade="ideal", **more)) for more in ({"faults": (FAULT,)}, {}))
    difference = one.errors["quaternion"].position_ned - other.errors["quaternion"].position_ned
    expected = closed_form(one.truth.time - one.truth.time[0])
    found = np.linalg.norm(difference[:, :2], axis=1)
    assert found == pytest.approx(expected, abs=0.035 * expected[-1])
    assert np.argmax(found > 1.0) == pytest.approx(np.argmax(expected > 1.0), abs=20)


@pytest.mark.parametrize("teams", [15, *slow(80)])
def test_detection_time_is_the_predicted_one(teams: int) -> None:
    """Teams of two: the share that has detected agrees with the budget and the closed form at every tenth epoch.

    Each share fails by chance with 7e-6, and the closed form is 3.5 % off at most, which moves the probability by 6 %.
    """
    plan = at_rest(grade="laser-standard")
    result = sinssim.budget(plan)
    effect = np.zeros((len(result.time), 2))
    effect[:, 0] = closed_form(result.time)
    predicted = detection_probability(effect, result.total[:, :2, :2], 0.01)
    faulty = at_rest(grade="laser-standard", faults=(FAULT,))
    found = []
    for i in range(2 * teams):
        own = faulty if i % 2 == 0 else plan
        run = sinssim.run(own.model_copy(update={"seed": run_seed(4, i)}))
        rows = np.searchsorted(run.truth.time, result.time + run.truth.time[0] - 1e-6)
        found.append(run.errors["quaternion"].position_ned[rows, :2])
    outputs = np.array(found).reshape(teams, 2, len(result.time), 2)
    detected = compare_systems(outputs, result.total[:, :2, :2], 0.01).detected.mean(axis=0)
    spread = np.sqrt(np.maximum(predicted * (1.0 - predicted), 0.01) / teams)
    assert (np.abs(detected - predicted) < 4.5 * spread + 0.06)[::10].all()
    assert 250.0 < result.time[np.argmax(predicted > 0.5)] < 1500.0
    assert detected[-1] == 1.0


@pytest.mark.slow
def test_shipped_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A few teams; the rates of many are in docs/sensor-sets.md."""
    monkeypatch.setattr("sinssim.recording.figures.save", lambda figure, path: None)
    monkeypatch.setattr(sys, "argv", ["compared_systems.py", "-o", str(tmp_path), "--teams", "5"])
    monkeypatch.syspath_prepend(str(STUDY.parent))
    runpy.run_path(str(STUDY), run_name="__main__")
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    velocity = summary["velocity"]
    assert velocity["detection_s"] == pytest.approx(velocity["predicted_detection_s"], abs=400.0)
    assert velocity["detection_s"] <= velocity["identification_s"]
    assert velocity["identified_at_end"] == 1.0
    assert summary["r95_at_end_m"]["mid-value of three"] < summary["r95_at_end_m"]["the faulty system"]
    assert (tmp_path / "recording.rrd").stat().st_size > 10_000
    assert "<svg" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "three identify: median time, min" in capsys.readouterr().out
