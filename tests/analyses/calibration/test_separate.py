"""The separate method: design against the emulator, planted errors, drawn errors, published observability."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.calibration_problem import TriadNoise, covariance_of_integrals, errors_of, make_task
from sinssim.analyses.separate_calibration import _spans, linearise, right_jacobian
from sinssim.analyses.turntable_calibration import calibrate
from sinssim.analyses.turntable_dwells import planned
from sinssim.scenario.true_motion import fly
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_errors import ImuErrors
from tests.analyses.calibration.draws import ARCSECONDS, DEGREES, check, drawn, scenario

QUIET = {"gyro_arw_deg_sqrt_h": 0.0, "accel_vrw_ug_sqrt_hz": 0.0}


def test_design_is_the_derivative_of_the_emulator() -> None:
    """Each column against central differences of the emulated readings.

    The expected integral of a turn has the Earth's rate in the axes that the readings give; this part of the
    derivative, of the size of the Earth's rate over that of a turn, 4e-4, is left to the iteration.
    """
    described = scenario("separate", "six-positions-and-rates", dwell_s=10.0, imu={"grade": "ideal"})
    ideal = fly(described).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    order = _spans(task, True)[1]
    none = np.zeros(6 * len(task.attitude))
    _, design, _ = linearise(task, none, ideal, True, order)
    for k, one in enumerate(task.known):
        step = np.zeros(len(task.known))
        step[k] = 10.0 * one.size
        ends = [emulate(ideal, errors_of(task.known, sign * step)) for sign in (1.0, -1.0)]
        high, low = (linearise(task, none, imu, True, order)[0] for imu in ends)
        for triad in range(2):
            found = (high[triad] - low[triad]) / (2.0 * step[k])
            own = design[triad][:, :, k]
            assert found == pytest.approx(own, abs=(3e-3 if triad == 0 else 1e-6) * max(np.abs(own).max(), 1.0))


def test_errors_of_the_table_are_in_the_residuals_as_the_model_says() -> None:
    """With the true errors of block and table at degree level, nothing remains; the derivatives are differences."""
    described = scenario("separate", "six-positions-and-rates", seed=3, dwell_s=5.0, imu=QUIET, **DEGREES)
    result = calibrate(described)  # for the true values
    ideal = fly(described).increments(20.0)
    measured = emulate(ideal, described.imu, 3)
    task = make_task(described, described.calibration, measured, planned(described.turntable, measured.time))
    table = described.turntable.draw_errors(3)
    errors = np.concatenate([table.tilt, table.position.ravel(), table.axis.ravel()])
    imu, order = task.compensated(result.truth), _spans(task, True)[1]
    residual, _, of_table = linearise(task, errors, imu, True, order)
    assert np.abs(residual[0]).max() < 1e-7  # 0.02 arcsec of turns by up to a whole one
    assert np.abs(residual[1]).max() < 1e-9
    direction = np.random.default_rng(1).normal(size=len(errors))
    high, low = (linearise(task, errors + s * 1e-6 * direction, imu, True, order)[0] for s in (1.0, -1.0))
    for triad in range(2):
        found = -(high[triad] - low[triad]) / 2e-6
        assert found == pytest.approx(of_table[triad] @ direction, rel=1e-5, abs=2e-5)


@pytest.mark.parametrize("name", ["gyro bias y", "gyro scale z", "gyro misalignment xz", "accel bias x",
                                  "accel scale y", "accel misalignment zy"])  # fmt: skip
def test_one_planted_error_is_found_and_no_other(name: str) -> None:
    """Large errors, a hundred times those of the grade: the estimate is not linear in them, and still exact."""
    described = scenario("separate", "six-positions-and-rates", dwell_s=10.0, imu={"grade": "ideal"})
    ideal = fly(described).increments(20.0)
    task = make_task(described, described.calibration, ideal, planned(described.turntable, ideal.time))
    true = np.array([100.0 * one.size * (one.name == name) for one in task.known])
    from sinssim.analyses.separate_calibration import separate

    estimate = separate(
        make_task(described, described.calibration, emulate(ideal, errors_of(task.known, true)), task.dwells)
    )
    assert estimate.solution.observable.all()
    assert estimate.values / task.size == pytest.approx(true / task.size, abs=2e-3)  # of the grade's 1σ


def test_drawn_errors_are_within_their_covariance() -> None:
    """Two blocks on a table of arcseconds, two on one of degrees; fails by chance once in 10^5."""
    check(drawn(2, "separate", "six-positions-and-rates", dwell_s=30.0, **ARCSECONDS), 2e5)
    check(drawn(2, "separate", "six-positions-and-rates", dwell_s=30.0, **DEGREES), 2e5)


@pytest.mark.slow
@pytest.mark.parametrize("table", [ARCSECONDS, DEGREES], ids=["arcseconds", "degrees"])
@pytest.mark.parametrize("sequence", ["six-positions-and-rates", "24-positions"])
def test_a_hundred_draws(sequence: str, table: dict[str, float]) -> None:
    """Fails by chance once in 10^4."""
    results = drawn(100, "separate", sequence, **table)
    check(results, 1e4)
    ratio = [one.estimate.solution.chi_square / one.estimate.solution.degrees for one in results]
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 80.0 / 100.0))


def test_six_positions_alone_leave_the_gyros_scale_factors() -> None:
    """The Earth's rate is too small for the scale factors of gyros (Syed et al., Meas. Sci. Technol. 18 (2007) 1897):
    static positions determine the biases of the gyros, and everything of the accelerometers."""
    result = calibrate(scenario("separate", "six-positions", calibration={"use": "positions"}))
    lost = {name for name, seen in zip(result.names, result.observable, strict=True) if not seen}
    assert lost == {name for name in result.names if name.startswith(("gyro scale", "gyro misalignment"))}
    assert sorted(result.unobservable) == sorted(lost)
    assert result.values[[name in lost for name in result.names]] == pytest.approx(0.0, abs=1e-6)


def test_turns_about_two_axes_leave_the_third() -> None:
    """The turns between the six positions are about x and z: nothing of the y axis' rate is seen."""
    result = calibrate(scenario("separate", "six-positions"))
    assert result.unobservable == ["gyro scale y", "gyro misalignment xy", "gyro misalignment zy"]


def test_24_positions_weigh_all_axes_alike() -> None:
    """An orthogonal design: Σ f_i = 0 and Σ f_i f_j = ⅓ 24 g² δ_ij, so that every bias has σ/√24, and every scale
    factor and misalignment √3 σ/(g √24), independent of each other (an orthogonal design is D-optimal: Kiefer, J. Roy.
    Statist. Soc. B 21 (1959) 272-319)."""
    result = calibrate(scenario("separate", "24-positions", calibration={"use": "positions"}, dwell_s=100.0))
    sigma = 10e-6 * 9.80665 / np.sqrt(100.0)
    gravity = 9.8101  # at 50°, 300 m: GRS80's 9.81070 less 3.086e-6 per metre
    accel = [k for k, one in enumerate(result.parameters) if one.triad == "accel"]
    expected = [
        sigma / np.sqrt(24.0) * (1.0 if result.parameters[k].field == "bias" else np.sqrt(3.0) / gravity) for k in accel
    ]
    assert result.sigma[accel] == pytest.approx(expected, rel=2e-4)
    block = result.covariance[np.ix_(accel, accel)]
    correlation = block / np.sqrt(np.outer(np.diag(block), np.diag(block)))
    assert correlation == pytest.approx(np.eye(12), abs=1e-3)


def test_covariance_of_integrals_against_a_simulated_process() -> None:
    """Instability over two separate spans: the closed form against the sum over small steps."""
    noise = TriadNoise(2e-6, 3e-6, 50.0, 1e-5, ())
    spans = np.array([[0.0, 40.0], [55.0, 75.0]])
    found = covariance_of_integrals(noise, spans, 0.0)
    t = np.arange(0.05, 75.0, 0.1)
    kernel = (3e-6) ** 2 * np.exp(-np.abs(t[:, None] - t) / 50.0) * 0.01
    inside = np.array([(t > a) & (t < b) for a, b in spans], dtype=float)
    expected = inside @ kernel @ inside.T + np.diag((2e-6) ** 2 * np.diff(spans)[:, 0] + 1e-10 / 6.0)
    assert found == pytest.approx(expected, rel=1e-4)


def test_right_jacobian_is_the_derivative_of_the_exponential() -> None:
    from scipy.spatial.transform import Rotation

    phi, delta = np.array([0.5, -1.2, 0.7]), 1e-6 * np.array([1.0, 2.0, -0.5])
    turned = (Rotation.from_rotvec(phi).inv() * Rotation.from_rotvec(phi + delta)).as_rotvec()
    assert right_jacobian(phi) @ delta == pytest.approx(turned, rel=1e-5)
    assert right_jacobian(np.zeros(3)) == pytest.approx(np.eye(3))


def test_nothing_is_found_without_errors() -> None:
    result = calibrate(scenario("separate", "24-positions", dwell_s=10.0, imu={"grade": "ideal"}))
    assert result.values / np.array([one.size for one in result.parameters]) == pytest.approx(0.0, abs=1e-4)
    assert isinstance(errors_of(result.parameters, result.values), ImuErrors)
