"""The filter in pyins' own world: motion, increments, errors of the sensors, fixes and errors of the start are pyins'.

Run where pyins is installed: `make test-pyins` makes an environment with it.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.alignment.alignment_budget import expected_errors
from sinssim.data import Array, ImuData, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import error_model
from sinssim.estimation.consistency import nees
from sinssim.estimation.estimate import estimate
from sinssim.sensors.imu.imu_section import Imu
from sinssim.strapdown.navigation_error import navigation_error
from tests.estimation.test_pyins_filter import at, errors_of, estimation_model, rms, rows_of, their_consistency

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:The copy keyword")]

SEEDS, BOTH = 120, 3
LENGTH, BEGINS = 420.0, 300.0  # s: two minutes without satellites at the end
SECONDS = np.arange(10.0, LENGTH, 10.0)
UNIT = Imu(
    grade="ideal", gyro_bias_sigma_deg_h=10.0, gyro_arw_deg_sqrt_h=0.1, gyro_scale_sigma_ppm=500.0,
    gyro_misalignment_sigma_arcsec=100.0, accel_bias_sigma_ug=1000.0, accel_vrw_mps_sqrt_h=0.03,
    accel_scale_sigma_ppm=500.0, accel_misalignment_sigma_arcsec=100.0,
)  # fmt: skip
SIGMA = expected_errors(UNIT).sigma
INITIAL = (3.0, 0.1, np.radians(0.1), np.radians(1.0))
FIX = (1.5, 0.05)


@cache
def motion() -> tuple[Any, Any]:
    """Return pyins' trajectory and increments without errors."""
    from pyins import sim

    return sim.generate_sine_velocity_motion(  # type: ignore[no-any-return]
        0.02, LENGTH + 0.02, [50.0, 14.0, 0.0], [60.0, 60.0, 0.0], [40.0, 40.0, 0.0], 60.0, sensor_type="increment"
    )


def world(seed: int) -> SimpleNamespace:
    """Return what a filter gets, and the truth at `SECONDS`."""
    from pyins import inertial_sensor, sim

    from tests.oracles import pyins_filter as pyins

    truth, readings = motion()[0], motion()[1].copy()
    rng = np.random.RandomState(seed)
    columns = {"gyro": pyins.READINGS[:3], "accel": pyins.READINGS[3:]}
    for name, triad in (("gyro", SIGMA.gyro), ("accel", SIGMA.accel)):
        model = inertial_sensor.EstimationModel(**estimation_model(triad))
        own = inertial_sensor.Parameters.from_EstimationModel(model, rng)
        readings[columns[name]] = own.apply(readings[columns[name]], "increment").to_numpy()
    at_fix = truth.iloc[50::50]
    at_fix = at_fix[at_fix.index <= BEGINS + 1e-6]
    position = sim.generate_position_measurements(at_fix, FIX[0], rng).to_numpy()
    velocity = sim.generate_ned_velocity_measurements(at_fix, FIX[1], rng).to_numpy()
    error = sim.generate_pva_error(INITIAL[0], INITIAL[1], np.degrees(INITIAL[2]), np.degrees(INITIAL[3]), rng)
    start = pyins.state_of(sim.perturb_pva(truth.iloc[0], error)[pyins.PVA].to_numpy(dtype=float)[None])
    time, rows = np.round(readings.index.to_numpy(), 9), readings.to_numpy()[1:]
    return SimpleNamespace(
        imu=ImuData(time, rows[:, :3], rows[:, 3:]),
        start=NavState(
            float(start.latitude[0]), float(start.longitude[0]), float(start.height[0]), start.velocity_ned[0],
            start.q_nb[0],
        ),
        fixes=(
            np.round(at_fix.index.to_numpy(), 9),
            np.column_stack([np.radians(position[:, :2]), position[:, 2]]),
            velocity,
        ),
        truth=pyins.state_of(truth[pyins.PVA].to_numpy()[at(time, SECONDS)]),
    )  # fmt: skip


def ours(given: SimpleNamespace) -> tuple[Array, Array]:
    """Return our filter's errors at `SECONDS`, and their covariance."""
    time, position, velocity = given.fixes
    told = [
        Measurements(kind=kind, time=time, arrival=time, value=value, sigma=np.full(value.shape, one))
        for kind, value, one in (("gnss-position", position, FIX[0]), ("gnss-velocity", velocity, FIX[1]))
    ]
    model = error_model(
        SIGMA, position=INITIAL[0], velocity=INITIAL[1], attitude=(INITIAL[2], INITIAL[2], INITIAL[3]),
        imu=[f"{triad} {what}" for triad in ("gyro", "accelerometer") for what in ("bias", "scale", "misalignment")],
        duration=LENGTH,
    )  # fmt: skip
    assert not model.untold
    found = estimate(given.imu, given.start, told, model, gate=None)
    kept = at(found.time[found.rows], SECONDS)
    rows = found.rows[kept]
    error = navigation_error(given.truth, rows_of(found.solution, rows), WGS84)
    return errors_of(error), found.covariance[kept][:, :9, :9]


def test_our_filter_is_consistent_in_their_world() -> None:
    """NEES of 120 runs, all axes and each group of them.

    The mean of 120 independent values of nine states at one epoch has 1080 degrees of freedom, that of three states
    360. A sound filter leaves each band once in a thousand times. The mean over the aided minutes varies less.
    """
    pytest.importorskip("pyins")
    runs = [ours(world(seed)) for seed in range(SEEDS)]
    errors, covariance = np.array([run[0] for run in runs]), np.array([run[1] for run in runs])
    aided = np.flatnonzero((SECONDS > 60.0) & (SECONDS <= BEGINS))
    print(f"\nNEES per degree of freedom in pyins' world, {SEEDS} runs, aided and at the end of the outage:")
    groups = {"all": slice(0, 9), "position": slice(0, 3), "velocity": slice(3, 6), "attitude": slice(6, 9)}
    for name, group in groups.items():
        size = group.stop - group.start
        values = np.array(
            [nees(e[:, group], p[:, group, group]) / size for e, p in zip(errors, covariance, strict=True)]
        )
        means = float(values[:, aided].mean()), float(values[:, -1].mean())
        low, high = chi2.ppf([0.0005, 0.9995], size * SEEDS) / (size * SEEDS)
        print(f"{name:8} {means[0]:.3f} {means[1]:.3f}, 99.9 % band {low:.2f} … {high:.2f}")
        assert low < means[0] < high, name
        assert low < means[1] < high, name


def test_their_filter_says_the_same_in_their_world() -> None:
    """pyins' own filter on the same runs: the same errors, σ and NEES, run by run."""
    pytest.importorskip("pyins")
    from tests.oracles import pyins_filter as pyins

    print()
    for seed in range(BOTH):
        given = world(seed)
        errors, covariance = ours(given)
        found = pyins.feedback_filter(
            given.imu, given.start, given.fixes, sigma=FIX, lever_arm=(0.0, 0.0, 0.0), initial=INITIAL,
            gyro=estimation_model(SIGMA.gyro), accel=estimation_model(SIGMA.accel), time_step=0.5,
        )  # fmt: skip
        rows = at(found.solution.time, SECONDS)
        theirs = errors_of(navigation_error(given.truth, rows_of(found.solution, rows), WGS84))
        settled = SECONDS > 60.0
        sigma = np.sqrt(np.einsum("kii->ki", covariance))
        apart = rms(((errors - theirs) / sigma)[settled])
        values = nees(errors, covariance) / 9.0, their_consistency(found, theirs, given.truth, rows)
        their_sigma = np.sqrt(np.einsum("kii->ki", found.covariance[rows]))[:, :6]
        print(
            f"seed {seed}: solutions apart by {100.0 * apart:.1f} % of σ; NEES at the end of the outage: ours "
            f"{values[0][-1]:.3f}, pyins {values[1][-1]:.3f}"
        )
        assert apart < 0.1  # of σ: that changes NEES by 1 % of its mean
        assert np.abs(sigma[settled, :6] / their_sigma[settled] - 1.0).max() < 0.01
        assert values[0][-1] == pytest.approx(values[1][-1], abs=0.1)
