"""The filter against pyins' feedback filter: on our readings, both filters; on pyins' own world, our filter.

Run where pyins is installed: `make test-pyins` makes an environment with it.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim import earth, rotation
from sinssim.alignment.budget import expected_errors
from sinssim.data import Array, ImuData, Measurements, NavSolution, NavState
from sinssim.earth.models import WGS84
from sinssim.estimation import error_model
from sinssim.estimation.checks.consistency import nees
from sinssim.estimation.estimate import estimate
from sinssim.estimation.result import Estimate
from sinssim.scenario import Scenario, load_scenario
from sinssim.scenario.sections.imu import ImuSection
from sinssim.simulation.execute import run
from sinssim.strapdown.nav_error import NavError, navigation_error

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:The copy keyword")]

ARCMIN = np.pi / 180.0 / 60.0
END, OUTAGE = 1560, (1200, 1500)  # s: the first of the two outages of the scenario, and a minute after it


def rows_of(s: NavSolution, k: Array) -> NavSolution:
    return NavSolution(
        s.time[k], s.latitude[k], s.longitude[k], s.height[k], s.velocity_ned[k], s.q_nb[k], np.zeros(len(k))
    )


def errors_of(error: NavError) -> Array:
    return np.column_stack([error.position_ned, error.velocity_ned, error.attitude])


def at(time: Array, seconds: Array) -> Array:
    """Return the rows at whole seconds; both filters have one after the fix of that second."""
    found = np.searchsorted(time, seconds - 1e-6)
    assert np.abs(time[found] - seconds).max() < 1e-6
    return found


def estimation_model(triad: Any) -> dict[str, Any]:
    """Return pyins' model of three sensors: a constant bias, white noise, scale factors and misalignments."""
    matrix = np.full((3, 3), float(np.max(triad.misalignment)))
    np.fill_diagonal(matrix, float(np.max(triad.scale)))
    return {"bias_sd": float(np.max(triad.bias)), "noise": float(triad.random_walk), "scale_misal_sd": matrix}


@pytest.fixture(scope="module")
def both() -> SimpleNamespace:
    """Both filters on increments and fixes of the airliner, without barometer and latency, with the same gravity."""
    pytest.importorskip("pyins")
    from tests.oracles import pyins_filter as pyins

    contents = load_scenario("aided_airliner").contents()
    del contents["aiding"]["baro"]
    # pyins has one σ for the three axes, and takes the rate in inertial space for that of the antenna about the block
    contents["aiding"]["gnss"].update(latency_s=0.0, height_sigma_m=1.5, lever_arm_m=[0.0, 0.0, 0.0])
    contents["navigation"]["vertical"] = "free"
    contents["filter"].update(smooth=False, gate=1e-12)  # pyins has no gate
    scenario = Scenario.model_validate(contents)
    own = run(scenario)
    count = END * 100
    measured = own.measured
    imu = ImuData(measured.time[: count + 1], measured.dtheta[:count], measured.dvel[:count])
    truth = own.trajectory.state(imu.time)
    fixes = {one.measurements.kind: one.measurements for one in own.aided.sensed}
    position, velocity = fixes["gnss-position"], fixes["gnss-velocity"]
    first = own.solutions["quaternion"]
    sigma, initial = expected_errors(scenario.imu).sigma, scenario.navigation.initial_error
    theirs = pyins.feedback_filter(
        pyins.same_gravity(imu, truth, earth.gravity_ned(truth.latitude, truth.height)),
        NavState(
            float(first.latitude[0]), float(first.longitude[0]), float(first.height[0]), first.velocity_ned[0],
            first.q_nb[0],
        ),
        (position.time, position.value, velocity.value),
        sigma=(float(position.sigma[0, 0]), float(velocity.sigma[0, 0])),
        lever_arm=scenario.aiding.gnss.lever_arm_m,
        initial=(
            initial.position_sigma_m, initial.velocity_sigma_mps, initial.tilt_sigma_arcmin * ARCMIN,
            initial.heading_sigma_arcmin * ARCMIN,
        ),
        gyro=estimation_model(sigma.gyro), accel=estimation_model(sigma.accel), time_step=0.5,
    )  # fmt: skip
    seconds = np.arange(1.0, END)
    mine, there = at(own.aided.estimate.time, seconds), at(theirs.solution.time, seconds)
    state = own.trajectory.state(seconds)
    return SimpleNamespace(
        seconds=seconds, truth=state, ours=own.aided.estimate, theirs=theirs, mine=mine, there=there,
        our_errors=errors_of(navigation_error(state, rows_of(own.aided.estimate.solution, mine), WGS84)),
        their_errors=errors_of(navigation_error(state, rows_of(theirs.solution, there), WGS84)),
    )  # fmt: skip


def parts(seconds: Array) -> dict[str, Array]:
    """Return when the filters are aided and settled, and the outage."""
    begin, end = OUTAGE
    return {"aided": (seconds > 60.0) & (seconds <= begin), "outage": (seconds > begin) & (seconds <= end)}


def test_two_filters_agree_on_our_readings(both: SimpleNamespace) -> None:
    """Root mean squares of the errors while aided, and σ throughout, of position and velocity: 1 %.

    What the filters carry into an outage grows in it. There the two solutions are compared with each other: they differ
    by a tenth of their σ at most.
    """
    sigma = np.sqrt(np.einsum("kii->ki", both.theirs.covariance))[both.there, :6], both.ours.sigma[both.mine, :6]
    for name, part in parts(both.seconds).items():
        for group in (slice(0, 3), slice(3, 6)):
            rms = [np.sqrt(np.mean(np.square(e[part, group]))) for e in (both.their_errors, both.our_errors)]
            spread = [np.sqrt(np.mean(np.square(s[part, group]))) for s in sigma]
            apart = np.sqrt(np.mean(np.square((both.our_errors - both.their_errors)[part, group])))
            print(
                f"{name} {group}: rms pyins {rms[0]:.4g}, ours {rms[1]:.4g}; σ {spread[0]:.4g}, {spread[1]:.4g}; "
                f"apart by {apart:.3g}"
            )
            assert spread[1] == pytest.approx(spread[0], rel=0.01), (name, group)
            assert apart < 0.1 * spread[1], (name, group)
            if name == "aided":
                assert rms[1] == pytest.approx(rms[0], rel=0.01), group


def test_their_consistency_agrees(both: SimpleNamespace) -> None:
    """NEES of position, velocity and attitude, per degree of freedom."""
    angles = [np.stack(rotation.euler_from_quaternion(q), axis=-1) for q in (
        both.theirs.solution.q_nb[both.there], both.truth.q_nb)]  # fmt: skip
    turn = (angles[0] - angles[1] + np.pi) % (2.0 * np.pi) - np.pi
    theirs = nees(np.column_stack([both.their_errors[:, :6], turn]), both.theirs.covariance[both.there]) / 9.0
    kept = np.isin(both.ours.rows, both.mine)
    covariance, rows = both.ours.covariance[kept][:, :9, :9], both.ours.rows[kept]
    number = np.searchsorted(both.mine, rows)
    ours = nees(both.our_errors[number], covariance) / 9.0
    for name, part in parts(both.seconds).items():
        mean = float(np.mean(theirs[number][part[number]])), float(np.mean(ours[part[number]]))
        print(
            f"{name}: NEES per degree of freedom pyins {mean[0]:.3f}, ours {mean[1]:.3f}, {part[number].sum()} epochs"
        )
        assert mean[1] == pytest.approx(mean[0], abs=0.03), name


# --- everything from pyins, but the filter ----------------------------------------------------------------------------

SEEDS, LENGTH, BEGINS = 12, 420.0, 300.0
UNIT = ImuSection(
    grade="ideal", gyro_bias_sigma_deg_h=10.0, gyro_arw_deg_sqrt_h=0.1, gyro_scale_sigma_ppm=500.0,
    gyro_misalignment_sigma_arcsec=100.0, accel_bias_sigma_ug=1000.0, accel_vrw_mps_sqrt_h=0.03,
    accel_scale_sigma_ppm=500.0, accel_misalignment_sigma_arcsec=100.0,
)  # fmt: skip
INITIAL = (3.0, 0.1, np.radians(0.1), np.radians(1.0))
FIX = (1.5, 0.05)


def of_pyins(seed: int) -> tuple[Estimate, Array, Array]:
    """Return our filter's result in pyins' world, and the errors at its stored rows with their times."""
    from pyins import inertial_sensor, sim

    from tests.oracles import pyins_filter as pyins

    truth, readings = sim.generate_sine_velocity_motion(
        0.02, LENGTH + 0.02, [50.0, 14.0, 0.0], [60.0, 60.0, 0.0], [40.0, 40.0, 0.0], 60.0, sensor_type="increment"
    )
    rng = np.random.RandomState(seed)
    sigma = expected_errors(UNIT).sigma
    columns = {"gyro": pyins.READINGS[:3], "accel": pyins.READINGS[3:]}
    for name, triad in (("gyro", sigma.gyro), ("accel", sigma.accel)):
        model = inertial_sensor.EstimationModel(**estimation_model(triad))
        own = inertial_sensor.Parameters.from_EstimationModel(model, rng)
        readings[columns[name]] = own.apply(readings[columns[name]], "increment").to_numpy()
    at_fix = truth.iloc[50::50]
    at_fix = at_fix[at_fix.index <= BEGINS + 1e-6]
    position = sim.generate_position_measurements(at_fix, FIX[0], rng).to_numpy()
    velocity = sim.generate_ned_velocity_measurements(at_fix, FIX[1], rng).to_numpy()
    error = sim.generate_pva_error(INITIAL[0], INITIAL[1], np.degrees(INITIAL[2]), np.degrees(INITIAL[3]), rng)
    start = pyins.state_of(sim.perturb_pva(truth.iloc[0], error)[pyins.PVA].to_numpy(dtype=float)[None])
    when = np.round(at_fix.index.to_numpy(), 9)
    place = np.column_stack([np.radians(position[:, :2]), position[:, 2]])
    told = [
        Measurements(kind=kind, time=when, arrival=when, value=value, sigma=np.full(value.shape, one))
        for kind, value, one in (("gnss-position", place, FIX[0]), ("gnss-velocity", velocity, FIX[1]))
    ]
    rows = readings.to_numpy()[1:]
    imu = ImuData(np.round(readings.index.to_numpy(), 9), rows[:, :3], rows[:, 3:])
    model = error_model(
        sigma, position=INITIAL[0], velocity=INITIAL[1], attitude=(INITIAL[2], INITIAL[2], INITIAL[3]),
        imu=[f"{triad} {what}" for triad in ("gyro", "accelerometer") for what in ("bias", "scale", "misalignment")],
        duration=LENGTH,
    )  # fmt: skip
    assert not model.untold
    first = NavState(
        float(start.latitude[0]),
        float(start.longitude[0]),
        float(start.height[0]),
        start.velocity_ned[0],
        start.q_nb[0],
    )
    found = estimate(imu, first, told, model, gate=None)
    there = np.clip(np.searchsorted(imu.time, found.time[found.rows] - 1e-6), 0, len(truth) - 1)
    true = pyins.state_of(truth[pyins.PVA].to_numpy()[there])
    return found, errors_of(navigation_error(true, rows_of(found.solution, found.rows), WGS84)), found.time[found.rows]


def test_our_filter_is_consistent_in_their_world() -> None:
    """Motion, increments, errors of the sensors, fixes and initial errors are pyins'; twelve runs.

    The mean of twelve independent values at one epoch has 108 degrees of freedom. Its band is left by a sound filter
    once in a thousand times; the mean over the aided minutes varies less.
    """
    pytest.importorskip("pyins")
    aided, last = [], []
    for seed in range(SEEDS):
        found, error, time = of_pyins(seed)
        values = nees(error, found.covariance[:, :9, :9]) / 9.0
        aided.append(float(values[(time > 60.0) & (time <= BEGINS)].mean()))
        last.append(float(values[-1]))
        assert time[-1] > LENGTH - 1.5
    low, high = chi2.ppf([0.0005, 0.9995], 9 * SEEDS) / (9 * SEEDS)
    print(f"NEES per degree of freedom: aided {np.mean(aided):.3f}, end of the outage {np.mean(last):.3f}")
    assert low < np.mean(aided) < high
    assert low < np.mean(last) < high
