"""The budget of navigators that align themselves: against ensembles of runs, and what an alignment cancels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.data import Array
from sinssim.earth import radii
from sinssim.earth.ellipsoids import ELLIPSOIDS
from sinssim.experiments.ensembles.ensemble_execution import errors_of_runs
from sinssim.experiments.ensembles.ensemble_plan import TruthCache, make_plan
from sinssim.scenario import Scenario
from tests.analyses.error_budget.worlds import ALLOWED, scenario

_QUIET: dict[str, Any] = {
    "parked": {"latitude_deg": 50.0, "altitude_m": 300.0, "heading_deg": 30.0, "pitch_deg": 3.0, "duration_s": 500.0},
    "navigation": {"vertical": "truth", "alignment": {"duration_s": 200.0}},
}
_NOISES: dict[str, Any] = {
    "gyro_arw_deg_sqrt_h": 0.002, "gyro_instability_deg_h": 0.05, "gyro_correlation_time_s": 60.0,
    "gyro_rrw_deg_h_sqrt_h": 0.03, "gyro_flicker_deg_h": 0.01, "gyro_quantum_arcsec": 2.0,
    "accel_vrw_ug_sqrt_hz": 30.0, "accel_instability_ug": 20.0, "accel_correlation_time_s": 30.0,
    "accel_flicker_ug": 10.0, "accel_rrw_ug_sqrt_h": 30.0, "accel_quantum_mm_s": 0.1,
}  # fmt: skip
_ROCKING: dict[str, Any] = {
    "motion": {
        "type": "coning", "latitude_deg": 50.0, "half_angle_deg": 2.0, "frequency_hz": 0.1, "duration_s": 400.0,
    },
    "navigation": {
        "vertical": "truth",
        "alignment": {"method": "disturbed", "duration_s": 200.0},
        "initial_error": {"position_sigma_m": 20_000.0},  # the fit is given a wrong latitude
    },
}  # fmt: skip


def departures(plan: Scenario, runs: int) -> Array:
    """Return the departures of an ensemble from the budget, in standard errors, (E, 9), and check where it begins."""
    truths = TruthCache()
    made = make_plan(plan, truths)
    since = made.epochs - made.start
    alignment = plan.navigation.alignment
    assert alignment is not None
    after = since >= alignment.duration_s - 1e-9
    result = budget(plan, times=since[after].tolist())
    assert result.time[0] == pytest.approx(alignment.duration_s)
    errors = errors_of_runs(made, range(runs), truths)
    assert not any(errors.failure)
    found = np.concatenate([errors.position_ned, errors.velocity_ned, errors.attitude], axis=2)[:, after]
    rows = [result.row(t) for t in since[after]]
    sigma = result.sigma()[rows]
    square = np.sqrt(np.mean((found - result.bias[rows]) ** 2, axis=0))
    known = sigma > np.repeat((1e-3, 1e-7, 1e-9), 3)  # the held height and what drives it are exact
    return np.asarray(np.where(known, square / np.where(known, sigma, 1.0) - 1.0, 0.0) * np.sqrt(2.0 * runs))


@pytest.mark.parametrize(
    ("tables", "runs"),
    [
        ({**_QUIET, "imu": {"grade": "laser-navigation", "rate_hz": 5.0}}, 20),
        ({**_QUIET, "imu": {**_NOISES, "rate_hz": 5.0}}, 20),
        ({**_ROCKING, "imu": {"grade": "laser-navigation", "rate_hz": 10.0}}, 20),
    ],
    ids=["quiet", "noises", "disturbed"],
)
def test_runs_that_align_themselves(tables: dict[str, Any], runs: int) -> None:
    """Fails by chance with 0.3 % at most, see `ALLOWED`."""
    assert np.abs(departures(scenario(**tables), runs)).max() < ALLOWED


@pytest.mark.slow
@pytest.mark.parametrize("method", ["quiet", "disturbed"])
def test_long_runs_that_align_themselves(method: str) -> None:
    """N = 1000 over half an hour: the few independent instants of nine components give 3.5 by chance with 0.5 %."""
    plan = scenario(**(_QUIET if method == "quiet" else _ROCKING), imu={"grade": "laser-standard", "rate_hz": 10.0})
    source = plan.parked or plan.motion
    assert source is not None
    name = "parked" if plan.parked else "motion"
    plan = plan.model_copy(update={name: source.model_copy(update={"duration_s": 1800.0})})
    assert np.abs(departures(plan, 1000)).max() < 3.5


@pytest.mark.parametrize("tables", [_QUIET, _ROCKING], ids=["quiet", "disturbed"])
def test_the_tilt_cancels_the_bias_that_made_it(tables: dict[str, Any]) -> None:
    """Accelerometers' biases alone: g φ_E = b_N, so that the velocity stays what it is; independent tilts would not."""
    bias = {"accel_bias_sigma_ug": 100.0, "rate_hz": 5.0}
    tables = {**tables, "navigation": {**tables["navigation"], "initial_error": {}}}
    aligned = sinssim.budget(scenario(**tables, imu=bias))
    tilt = 100e-6 * 9.80665 / 9.81
    assert aligned.sigma()[0, 6:8] == pytest.approx(np.full(2, tilt), rel=0.05)
    free = {**tables["navigation"], "initial_error": {"tilt_sigma_arcmin": float(np.degrees(tilt) * 60.0)}}
    del free["alignment"]
    told = sinssim.budget(scenario(**{**tables, "navigation": free}, imu=bias))
    after = aligned.time[-1] - aligned.time[0]
    alone = told.sigma()[np.searchsorted(told.time, after), :2]
    assert np.all(aligned.sigma()[-1, :2] < 0.01 * alone)


def test_the_start_depends_on_the_given_latitude_by_its_derivative(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start whose velocity grows by 3, −5 and 7 m/s per radian: over a meridian of 6.38e6 m, 1e-6 m/s per metre."""
    from types import SimpleNamespace

    from sinssim.analyses.error_budget import aligned_start as own_alignment

    slope, turn = np.array([3.0, -5.0, 7.0]), 0.2
    q = np.array([1.0, 0.0, 0.0, 0.0])

    def aligned(*_: Any) -> Any:
        step = _[-1]
        half = 0.5 * turn * step
        return SimpleNamespace(velocity_ned=0.5 + slope * step, q_nb=np.array([np.cos(half), 0.0, 0.0, np.sin(half)]))

    monkeypatch.setattr(own_alignment, "_aligned", aligned)
    curve = SimpleNamespace(ellipsoid=ELLIPSOIDS["wgs84"])
    state = SimpleNamespace(q_nb=np.array([q, q]))
    motion: Any = SimpleNamespace(state=state, trajectory=curve)
    place = SimpleNamespace(latitude=np.array([0.7]), height=np.array([500.0]))
    monkeypatch.setattr(own_alignment, "rows_of", lambda *_: place)
    session: Any = SimpleNamespace(motion=motion, last=np.zeros((3, 17 - 9)))
    found = own_alignment._end(SimpleNamespace(), motion, session, 1, 9)  # type: ignore[arg-type]
    meridian = float(radii(np.array([0.7]), ELLIPSOIDS["wgs84"])[0][0]) + 500.0
    np.testing.assert_allclose(found[3:6, 0], slope / meridian, rtol=1e-6)
    np.testing.assert_allclose(found[6:9, 0], [0.0, 0.0, -turn / meridian], rtol=1e-6, atol=1e-18)
