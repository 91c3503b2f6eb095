"""Aided flight across the pole: consistent all the way, in every frame that passes it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from sinssim import rotation
from sinssim.data import Array, NavState
from sinssim.estimation import Estimate, state_errors
from sinssim.estimation.consistency import nees
from sinssim.estimation.estimate import estimate
from sinssim.estimation.state_model import ErrorModel, error_model
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding_sensor import Vehicle
from sinssim.strapdown.frames import FRAMES
from sinssim.truth.motions.parked_and_great_circle import GreatCircle, Parked
from tests.estimation.worlds import balanced, biases_only, errors_of, one_run
from tests.oracles.transported import wrong_by
from tests.slow import slow

SIGMA = biases_only("laser-standard")
MODEL = error_model(SIGMA, position=5.0, velocity=0.1, attitude=(1.5e-4, 1.5e-4, 1.7e-3))
GNSS = Gnss(rate_hz=1.0, lever_arm_m=(-4.0, 0.0, -3.0), latency_s=0.2)
SPEED = 240.0


def over(latitude: float, duration: float) -> GreatCircle:
    """Return a flight along a meridian that is at a latitude in the middle of it."""
    return GreatCircle(np.radians(latitude) - SPEED * duration / 2.0 / 6.4e6, 0.3, 9000.0, 0.0, SPEED, duration)


class Flown(NamedTuple):
    """One aided flight and its errors in the filter's states."""

    estimate: Estimate
    errors: Array


def fly(trajectory: GreatCircle | Parked, seed: int, drawn: Array, rate_hz: float = 10.0, **options: Any) -> Flown:
    """Draw sensors and start by a seed and by errors in units of their σ, and estimate."""
    run = one_run(trajectory, trajectory.increments(rate_hz), MODEL, SIGMA, seed, drawn)
    true = trajectory.state(0.0)
    place = float(true.latitude), float(true.longitude), float(true.height)
    attitude = Rotation.from_quat(true.q_nb, scalar_first=True)
    there, velocity, wrong = wrong_by(place, true.velocity_ned, attitude, MODEL.sigma * drawn)
    initial = NavState(*map(np.asarray, there), velocity, wrong.as_quat(scalar_first=True))
    given = [r.measurements for r in GNSS.read(Vehicle(trajectory, seed))]
    found = estimate(run.imu, initial, given, MODEL, rate_hz=1.0, gate=None, **options)
    assert found.divergence is None
    return Flown(found, errors_of(found.model, found, trajectory, replace(run, initial=initial)))


def inside(values: Array, runs: int, size: int) -> float:
    """Return the fraction of epochs whose mean NEES over the runs is in its 95 % band."""
    lower, upper = chi2.ppf([0.025, 0.975], runs * size) / (runs * size)
    return float(np.mean((values > lower) & (values < upper)))


def ensemble(trajectory: GreatCircle, runs: int, frame: str, rate_hz: float = 10.0) -> tuple[Array, Array, Array]:
    """Return the NEES per state at every epoch, the rms of the navigation errors, and their σ."""
    total, squares, sigma = [], [], np.zeros(0)
    for seed, drawn in enumerate(balanced(runs, MODEL.size, 1)):
        one = fly(trajectory, seed, drawn, rate_hz, frame=frame)
        rows = one.estimate.rows
        total.append(nees(one.errors[rows], one.estimate.covariance) / MODEL.size)
        squares.append(one.errors[:, :9] ** 2)
        sigma = one.estimate.sigma[:, :9]
    return np.mean(total, axis=0), np.sqrt(np.mean(squares, axis=0)), sigma


@pytest.mark.parametrize(
    ("frame", "runs", "seconds"), [("wander", 16, 60.0), *slow(("wander", 20, 120.0), ("inertial", 20, 120.0))]
)
def test_consistent_across_the_pole(frame: str, runs: int, seconds: float) -> None:
    """Over 40 other ensembles of 20 runs of two minutes the fraction was 0.99 at least, and the mean 0.99 with σ 0.036:
    it fails by chance less than once in 10⁴ times."""
    values, _, _ = ensemble(over(90.0, seconds), runs, frame)
    assert inside(values, runs, MODEL.size) >= 0.9
    assert abs(values.mean() - 1.0) < 0.15 * np.sqrt(20.0 / runs)


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["inertial", "wander"])
def test_consistent_across_the_pole_for_twenty_minutes(frame: str) -> None:
    values, _, _ = ensemble(over(90.0, 1200.0), 100, frame, 20.0)
    assert inside(values, 100, MODEL.size) >= 0.9


@pytest.mark.slow
def test_the_errors_are_those_of_a_flight_at_mid_latitude() -> None:
    """Same motion over the ground, same noise. What differs is the Earth's rate along the flight's axes, by which a
    heading is found at mid-latitude and not at a pole, and the velocities that are not used near the pole."""
    (_, polar, polar_sigma), (_, middle, middle_sigma) = (
        ensemble(over(latitude, 1200.0), 30, "inertial") for latitude in (90.0, 45.0)
    )
    for part in ([0, 1], [2], [3, 4], [5], [6, 7]):
        for one, other in ((polar, middle), (polar_sigma, middle_sigma)):
            ratio = np.sqrt(np.mean(one[:, part] ** 2) / np.mean(other[:, part] ** 2))
            assert abs(ratio - 1.0) < 0.05, part
    assert polar_sigma[-1, 8] > 1.2 * middle_sigma[-1, 8]


def test_every_frame_gives_the_same() -> None:
    """Over the pole itself; what differs is rounding."""
    drawn = np.random.default_rng(3).standard_normal(MODEL.size)
    flights = {name: fly(over(90.0, 60.0), 1, drawn, frame=name) for name in FRAMES if name != "level"}
    reference = flights.pop("inertial")
    assert reference.estimate.model.axes == "transported"
    assert np.degrees(reference.estimate.solution.latitude.max()) > 89.9997
    assert np.isfinite(reference.estimate.sigma).all()
    for name, one in flights.items():
        np.testing.assert_allclose(one.estimate.sigma, reference.estimate.sigma, rtol=1e-6, err_msg=name)
        assert np.abs((one.errors - reference.errors) / reference.estimate.sigma).max() < 1e-4, name


def test_near_the_pole_nothing_is_nonsense() -> None:
    """σ of velocity and attitude hardly change within a few seconds, whatever north does meanwhile."""
    one = fly(over(90.0, 60.0), 2, np.random.default_rng(4).standard_normal(MODEL.size), frame="wander")
    near = np.abs(one.estimate.time - 30.0) < 5.0
    level = np.hypot(one.estimate.sigma[near, 6], one.estimate.sigma[near, 7])
    assert level.max() < 1.05 * level.min()
    heading, speed = one.estimate.sigma[near, 8], np.hypot(one.estimate.sigma[near, 3], one.estimate.sigma[near, 4])
    assert heading.max() < 1.01 * heading.min()
    assert speed.max() < 1.5 * speed.min()
    # a velocity north, east, down has no meaning there, and is not used
    velocity = one.estimate.innovations[1]
    assert not velocity.accepted.any()
    assert "relative to north within 0.1° of a pole" in velocity.reason[10]
    assert np.isnan(velocity.nis).all()
    assert one.estimate.innovations[0].accepted.all()


@pytest.mark.parametrize("feedback_s", [*slow(2.0), 64.0])
def test_at_rest_on_the_pole(feedback_s: float) -> None:
    """Every correction turns north by any angle there, and state, covariance and history with it."""
    place = Parked(0.5 * np.pi, 0.3, 100.0, rotation.quaternion_from_euler(0.01, 0.02, 1.0), 60.0)
    values = []
    for seed in range(4):
        drawn = np.random.default_rng([6, seed]).standard_normal(MODEL.size)
        one = fly(place, seed, drawn, frame="wander", smooth=True, feedback_s=feedback_s)
        smoothed, rows = one.estimate.smoothed, one.estimate.rows
        assert smoothed is not None
        # without the turn the smoothed positions are off by what a feedback corrects, 5 σ and more
        assert np.abs(errors_of_smoothed(one.estimate.model, one, place) / smoothed.sigma[:, :9]).max() < 4.5
        values.append(nees(one.errors[rows], one.estimate.covariance).mean() / MODEL.size)
    # 4 runs of 15 states that hardly change, σ 0.18
    assert abs(np.mean(values) - 1.0) < 0.6


@pytest.mark.parametrize("loop", ["closed", "open"])
def test_smoothed_across_the_pole(loop: str) -> None:
    drawn = np.random.default_rng(5).standard_normal(MODEL.size)
    trajectory = over(90.0, 60.0)
    one = fly(trajectory, 3, drawn, frame="wander", loop=loop, smooth=True)
    smoothed = one.estimate.smoothed
    assert smoothed is not None
    rows = one.estimate.rows
    assert np.all(smoothed.sigma[:, :3].mean(axis=0) < one.estimate.sigma[rows][:, :3].mean(axis=0))
    errors = errors_of_smoothed(one.estimate.model, one, trajectory)
    # 3 σ of 3 × 60 correlated numbers: 4.5 is beyond them but for one case in a thousand
    assert np.abs(errors / smoothed.sigma[:, :9]).max() < 4.5


def errors_of_smoothed(model: ErrorModel, one: Flown, trajectory: GreatCircle | Parked) -> Array:
    """Return the navigation errors of the smoothed solution."""
    smoothed = one.estimate.smoothed
    assert smoothed is not None
    return state_errors(model, smoothed, trajectory.state(smoothed.time), {}, trajectory.ellipsoid)[:, :9]
