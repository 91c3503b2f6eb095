"""The systematic method: planted errors, drawn errors, its frame, published observability, navigation afterwards."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from sinssim import budget, navigate, rotation
from sinssim.analyses.calibration_problem import errors_of, make_task
from sinssim.analyses.calibration_result import compensation_text
from sinssim.analyses.systematic_calibration import in_accelerometer_frame, linearise, steps, systematic
from sinssim.analyses.turntable_calibration import calibrate
from sinssim.analyses.turntable_dwells import planned
from sinssim.scenario import Scenario
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.compensation import compensate
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.generated_imu_keys import TriadErrors
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.sensors.imu.imu_section import draw
from sinssim.statistics.percentiles import percentile
from tests.analyses.calibration.draws import ARCSECONDS, DEGREES, check, drawn, scenario
from tests.slow import slow

ARMS = {"accel_arms_mm": [[10.0, 20.0, -30.0], [30.0, -20.0, 20.0], [-20.0, 30.0, 10.0]]}


# of all 27, and of the parameters of one axis of each kind: each takes four passes of the filter
@pytest.mark.parametrize("of", ["x", *slow("xyz")])
def test_the_derivatives_of_the_innovations(of: str) -> None:
    """Each parameter's effect on the innovations against differences of emulated readings, noiseless."""
    described = scenario("systematic", "19-positions", dwell_s=10.0, imu={"gyro_arw_deg_sqrt_h": 0.003, **ARMS})
    ideal = fly(described).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    ends, observed = steps(task)
    q = task.attitude[0]
    _, design, _ = linearise(task, ideal, q, ends, observed)
    scale = np.abs(design).max(axis=0)
    for k, one in enumerate(task.known):
        if one.name[-1] not in of:
            continue
        size = np.zeros(len(task.known))
        size[k] = one.size
        readings = [emulate(ideal, errors_of(task.known, sign * size)) for sign in (1.0, -1.0)]
        high, low = (linearise(task, imu, q, ends, observed)[0] for imu in readings)
        found = (high - low) / (2.0 * size[k])
        # the derivative is taken along readings of 20 Hz: half a sample of a turn, squared
        assert np.abs(found - design[:, k]).max() < 5e-3 * scale[k], one.name


@pytest.mark.parametrize(
    "name", ["gyro scale x", "accel misalignment yx", *slow("gyro misalignment zy", "accel scale z")]
)
def test_one_planted_error_is_found_and_no_other(name: str) -> None:
    described = scenario("systematic", "19-positions", dwell_s=30.0, imu={"grade": "ideal"})
    ideal = fly(described).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    true = np.array([100.0 * one.size * (one.name == name) for one in task.known])
    measured = emulate(ideal, errors_of(task.known, true))
    estimate = systematic(make_task(described, described.calibration, measured, task.dwells))
    assert estimate.solution.observable.all()
    assert estimate.values / task.size == pytest.approx(true / task.size, abs=2e-3)  # of the grade's 1σ


def test_drawn_errors_are_within_their_covariance() -> None:
    """Two blocks on a table of degrees, with places of the accelerometers; fails by chance once in 10^5."""
    results = drawn(2, "systematic", "19-positions", dwell_s=30.0, imu=ARMS, **DEGREES)
    check(results, 1e5)
    assert all(one.observable.all() for one in results)
    assert len(results[0].names) == 27


@pytest.mark.slow
@pytest.mark.parametrize("table", [ARCSECONDS, DEGREES], ids=["arcseconds", "degrees"])
@pytest.mark.parametrize("grade", ["laser-standard", "mems-industrial"])
def test_a_hundred_draws(grade: str, table: dict[str, float]) -> None:
    """Fails by chance once in 10^4."""
    results = drawn(100, "systematic", "19-positions", imu={"grade": grade, **ARMS}, **table)
    check(results, 1e4)
    assert all(one.observable.all() for one in results)


def test_21_errors_are_observable() -> None:
    """19 positions determine 21 errors of a block: 24 less the three that define the frame. Ren et al. (Improving the
    measurement accuracy of SINS through calibration on horizontal three-axis turntable, Instrumentation Mesure
    Metrologie 18 (2019) 397-406) identify the same number. Six positions are not enough."""
    result = calibrate(scenario("systematic", "19-positions", dwell_s=60.0))
    assert len(result.names) == 21
    assert result.observable.all()
    few = calibrate(scenario("systematic", "six-positions", dwell_s=60.0))
    assert any("gyro scale y" in words for words in few.unobservable)


def test_a_table_that_only_stands_leaves_the_gyros() -> None:
    turns = [{"axis": [0.0, 0.0, 1.0], "angle_deg": 90.0}]
    result = calibrate(scenario("systematic", None, turns=turns, dwell_s=30.0))
    lost = " ".join(result.unobservable)
    for name in ("gyro scale x", "gyro scale y", "accel scale x", "accel misalignment yx"):
        assert name in lost


def test_frame_of_the_accelerometers() -> None:
    """The same sensors in another frame: readings of turned inputs are equal, and the defining angles vanish."""
    random = np.random.default_rng(3)
    tilt = 1e-2 * random.normal(size=(2, 3, 3))
    tilt[:, range(3), range(3)] = 0.0
    scale = 1e-2 * random.normal(size=(2, 3))
    arms = random.normal(size=(3, 3))
    errors = ImuErrors(
        TriadErrors(scale=scale[0], misalignment=tilt[0]), TriadErrors(scale=scale[1], misalignment=tilt[1]), arms
    )
    other, turn = in_accelerometer_frame(errors)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert not other.accel.misalignment[np.triu_indices(3)].any()
    u = random.normal(size=3)
    for own, moved in ((errors.gyro, other.gyro), (errors.accel, other.accel)):
        before = (1.0 + own.scale) * (u + own.misalignment @ u)
        after = (1.0 + moved.scale) * (turn @ u + moved.misalignment @ turn @ u)
        assert after == pytest.approx(before, abs=1e-14)
    assert other.arms @ turn == pytest.approx(arms)


FLIGHT = {"latitude_deg": 50.0, "course_deg": 60.0, "speed_mps": 230.0, "altitude_m": 9000.0, "duration_s": 3600.0}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["separate", "systematic"])
def test_free_inertial_navigation_after_a_calibration(method: str) -> None:
    """R95 of an hour's flight of a hundred calibrated units is that of the covariances that the calibration states.

    The separate method is on a table of arcseconds, the systematic one on a table of degrees. The band of R95 over a
    hundred runs has 99.9 %, that of the mean square four standard deviations. The budget takes the 1σ of each kind as
    independent.
    """
    sequence = "19-positions" if method == "systematic" else "six-positions-and-rates"
    results = drawn(100, method, sequence, dwell_s=180.0, **(DEGREES if method == "systematic" else ARCSECONDS))
    check(results, 1e4)
    contents = tomllib.loads(compensation_text(results[0]))["compensation"]
    sigma = {key: value for key, value in contents.items() if "_sigma_" in key}
    common = {"name": "f", "great_circle": FLIGHT, "imu": {"grade": "laser-standard", "rate_hz": 10.0},
              "navigation": {"vertical": "truth"}}  # fmt: skip
    plain = Scenario.model_validate(common)
    after = budget(Scenario.model_validate({**common, "compensation": sigma}))
    predicted, square = float(after.r95[-1]), after.sigma()[-1, :2] ** 2
    before = float(budget(plain).r95[-1])
    trajectory = fly(plain)
    ideal = trajectory.increments(10.0)
    start, height = trajectory.state(0.0), trajectory.state(ideal.time).height
    end = trajectory.state(float(ideal.time[-1]))
    errors = []
    for seed, one in enumerate(results):
        true = draw(plain.imu, seed)
        turn = in_accelerometer_frame(true)[1] if method == "systematic" else np.eye(3)
        measured = compensate(emulate(ideal, true, 1000 + seed), errors_of(one.parameters, one.values))
        own = type(start)(
            start.latitude, start.longitude, start.height, start.velocity_ned,
            rotation.multiply(start.q_nb, rotation.quaternion_from_dcm(turn.T)),
        )  # fmt: skip
        solution = navigate(measured, own, vertical="truth", height=height)
        north = (solution.latitude[-1] - end.latitude) * 6.38e6
        east = (solution.longitude[-1] - end.longitude) * 6.38e6 * np.cos(end.latitude)
        errors.append(float(np.hypot(north, east)))
    found = percentile(np.array(errors), 0.95, confidence=0.999)
    ratio = np.mean(np.square(errors)) / square.sum()
    print(
        method,
        "mean square over that of the budget",
        ratio,
        "R95 before",
        before,
        "predicted",
        predicted,
        "found",
        found,
    )
    assert found.low < predicted < found.high
    assert abs(ratio - 1.0) < 4.0 * np.sqrt(2.0 * np.sum(square**2) / 100.0) / square.sum()
    assert predicted < 0.7 * before


def test_a_nominal_heading_that_is_trusted_is_kept() -> None:
    """Half a degree off what the turns show, with a 1σ of 0.01°: the attitude stays, and the estimate comes to rest."""
    at = {"dwell_s": 10.0, "calibration": {"attitude_sigma_deg": 0.01}}
    described, flown = (scenario("systematic", "19-positions", heading_deg=h, **at) for h in (40.0, 40.5))
    ideal = fly(flown).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    found = systematic(task)
    assert found.iterations <= 5
    # the heading that is off is not in the errors of the sensors, but in the residuals
    assert np.abs(found.values / task.size).max() < 0.5
    assert found.solution.chi_square > 10.0


def test_progress_of_a_calibration() -> None:
    told: list[tuple[str, float]] = []
    calibrate(scenario("separate", "six-positions", dwell_s=5.0), progress=lambda *what: told.append(what))
    assert told == [("Calibrating", 0.0), ("Calibrating", 0.5), ("Calibrating", 1.0)]
