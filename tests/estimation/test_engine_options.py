"""The filter's engine is the one asked for: frame, algorithm, rates, radii, ellipsoid, gravity, route."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sinssim.data import Measurements
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.estimation.estimate import estimate
from sinssim.estimation.state_model import error_model
from sinssim.experiments.run.run_execution import run as run_scenario
from sinssim.scenario import load_scenario
from sinssim.strapdown.frames import FRAMES
from sinssim.strapdown.mechanization import Mechanization
from sinssim.strapdown.navigate import navigate
from sinssim.strapdown.navigation_error import navigation_error
from tests.estimation.worlds import biases_only, one_run, positions, velocities, weaving
from tests.slow import slow

SIGMA = biases_only("tactical")
MODEL = error_model(SIGMA, position=3.0, velocity=0.2, attitude=(1e-3, 1e-3, 3e-3))
RATES = (20.0, 10.0, 2.0)

OPTIONS: list[dict[str, Any]] = [
    *({"frame": frame} for frame in FRAMES),
    *({"frame": frame, "rates_hz": RATES} for frame in FRAMES),
    {"frame": "wander", "rates_hz": RATES, "slow_quantities": "extrapolate"},
    {"frame": "transverse", "route": (0.7, 0.1, 0.72, 0.14)},
    {"frame": "wander", "curvature": "spherical"},
    {"curvature": "simplified"},
    {"ellipsoid": "krasovsky-1940"},
    {"frame": "inertial", "gravity": "j2"},
    {"algorithm": "euler"},
]
MORE: list[dict[str, Any]] = [
    {"algorithm": "rotation-vector-2", "frame": "inertial"},
    {"algorithm": "poisson-3-ortho", "frame": "wander"},
]


@pytest.mark.parametrize("options", [*OPTIONS, *slow(*MORE)], ids=str)
def test_without_information_the_filter_is_the_engine(options: dict[str, Any]) -> None:
    """One reading without weight: the segments, with feedbacks of nothing between them, are `navigate` with the same
    options; another engine would differ by metres."""
    trajectory, ideal = weaving(60.0, 20.0)
    run = one_run(trajectory, ideal, MODEL, SIGMA, 3)
    place = positions(trajectory, ideal.time[400:401], np.random.default_rng(1))
    given = [replace(place, sigma=np.full((1, 3), 1e9))]
    found = estimate(run.imu, run.initial, given, MODEL, feedback_s=7.0, rate_hz=2.0, **options)
    assert found.innovations[0].accepted.all()
    alone = navigate(run.imu, run.initial, **options)
    rows = np.searchsorted(alone.time, found.time)
    reference = type(alone.state())(*(getattr(alone, name)[rows] for name in vars(alone.state())))
    error = navigation_error(reference, found.solution, ELLIPSOIDS[options.get("ellipsoid", "wgs84")])
    # rounding; an extrapolation begins anew in each segment, and holds its quantities for the first half second
    begins_anew = "slow_quantities" in options
    assert np.abs(error.position_ned).max() < (1e-2 if begins_anew else 1e-6)
    assert np.abs(error.velocity_ned).max() < (1e-3 if begins_anew else 1e-7)
    assert error.angle.max() < (1e-7 if begins_anew else 1e-12)


def test_options_change_the_engine() -> None:
    """Each of them moves the engine by more than rounding."""
    trajectory, ideal = weaving(60.0, 20.0)
    initial = trajectory.state(ideal.time[0])
    usual = navigate(ideal, initial)
    for options in (o for o in OPTIONS[len(FRAMES) :] if "route" not in o):  # a route changes rounding alone
        other = navigate(ideal, initial, **options)
        rows = np.searchsorted(usual.time, other.time)
        reference = type(usual.state())(*(getattr(usual, name)[rows] for name in vars(usual.state())))
        moved = np.abs(navigation_error(reference, other).position_ned).max()
        assert moved > 5e-8, options


@pytest.mark.parametrize("options", [{"frame": "inertial"}, {"frame": "wander"}, {"frame": "wander", "rates_hz": RATES},
                                     {"algorithm": "rotation-vector-2"}], ids=str)  # fmt: skip
def test_aided_estimates_hardly_depend_on_the_engine(options: dict[str, Any]) -> None:
    """The engines differ by their errors of integration alone, far below what the readings leave open."""
    trajectory, ideal = weaving(60.0, 20.0)
    run = one_run(trajectory, ideal, MODEL, SIGMA, 5)
    time, rng = ideal.time[20:-3:20] + 0.013, np.random.default_rng(2)  # between the samples
    given = [positions(trajectory, time, rng), velocities(trajectory, time, rng)]
    given[1] = replace(given[1], arrival=time + 0.3)
    usual, other = (estimate(run.imu, run.initial, given, MODEL, rate_hz=10.0, **o) for o in ({}, options))
    assert other.divergence is None
    common, mine, theirs = np.intersect1d(np.round(usual.time, 6), np.round(other.time, 6), return_indices=True)
    assert len(common) > 100
    np.testing.assert_allclose(other.sigma[theirs], usual.sigma[mine], rtol=0.01)
    for name, value in usual.parameters.items():
        spread = usual.sigma[mine][:, usual.model.slices[name]]
        assert np.abs((other.parameters[name][theirs] - value[mine]) / spread).max() < 0.1, name


def test_between_rows_the_attitude_follows_the_gyros() -> None:
    """Perfect sensors, rows of 0.2 s, whole attitudes 0.1 s after each: linear interpolation is off by 2e-4 rad."""
    trajectory, ideal = weaving(60.0, 20.0)
    time = ideal.time[2:-4:20]
    sigma = np.full((len(time), 3), 1e-3)
    given = Measurements("attitude", time, time, trajectory.state(time).q_nb, sigma)
    exact = error_model(SIGMA, position=1e-3, velocity=1e-4, attitude=1e-6)
    found = estimate(ideal, trajectory.state(ideal.time[0]), [given], exact, algorithm="rotation-vector-4")
    assert np.abs(found.innovations[0].value).max() < 1e-5


def test_the_options_of_a_scenario_reach_the_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    from sinssim.simulation import aided_run

    reached: dict[str, Any] = {}

    def kept(*args: Any, **options: Any) -> Any:
        reached.update(options)
        return estimate(*args, **options)

    monkeypatch.setattr(aided_run, "estimate", kept)
    wanted = [
        'navigation.algorithms=["euler", "quaternion"]', 'navigation.frame="transverse"',
        "navigation.route_deg=[88.0, 0.0, 88.0, 90.0]", 'navigation.curvature="simplified"',
        "navigation.rates_hz=[100.0, 50.0, 10.0]", 'navigation.slow_quantities="extrapolate"',
        'navigation.ellipsoid="krasovsky-1940"', 'navigation.gravity="j2"', "great_circle.duration_s=20.0",
        "aiding.gnss.outages_s=[]",
    ]  # fmt: skip
    run_scenario(load_scenario("polar_flight", wanted))
    of: Mechanization = reached["mechanization"]
    assert of == Mechanization(
        algorithm="euler", frame="transverse", route=of.route, curvature="simplified", ellipsoid="krasovsky-1940",
        gravity="j2", rates_hz=(100.0, 50.0, 10.0), slow_quantities="extrapolate",
    )  # fmt: skip
    assert of.route == pytest.approx(np.radians([88.0, 0.0, 88.0, 90.0]))


@pytest.mark.parametrize(
    "duration", [pytest.param(60.0, id="1min"), pytest.param(4500.0, id="75min", marks=pytest.mark.slow)]
)
def test_the_airliner_in_inertial_axes_is_the_airliner(duration: float) -> None:
    """σ within 1 %, errors within 0.1 σ; found 2e-11 and 2e-7, because both runs report relative to north."""
    shorter = ["flight.legs=[{type='hold', duration_s=60.0}]"] if duration < 4500.0 else []
    level, inertial = (
        run_scenario(load_scenario("aided_airliner", [f"navigation.frame='{frame}'", *shorter])).aided
        for frame in ("level", "inertial")
    )
    assert level is not None
    assert inertial is not None
    np.testing.assert_allclose(inertial.estimate.sigma, level.estimate.sigma, rtol=1e-6)
    difference = (inertial.state_errors - level.state_errors) / level.estimate.sigma
    assert np.abs(difference).max() < 1e-3
