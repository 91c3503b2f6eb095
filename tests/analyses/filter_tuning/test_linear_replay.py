"""A replay with other noises against the filter itself with these noises, and of the pass against its innovations."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.analyses.filter_tuning_data import TuningData
from sinssim.estimation.linear_replay import Assumptions, LinearPass, densities_of, sources_of
from tests.analyses.filter_tuning.planted import written


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> TuningData:
    return TuningData(str(written(tmp_path_factory.mktemp("planted"), duration=40.0)), ())


OTHER = {"imu.accel_vrw_mps_sqrt_h": 4.0, "imu.gyro_bias_sigma_deg_h": 90.0, "aiding.gnss.height_sigma_m": 8.0}
"""Keys with values far from those of the scenario."""


def replayed(data: TuningData, of_pass: LinearPass, values: dict[str, float]) -> list:
    model, readings = data.assumed(values)
    ratio = {
        name: readings[name].sigma / checked.data.sigma
        for name, checked in zip(of_pass.names, of_pass.around.readings, strict=True)
        if name in readings
    }
    process = densities_of(model) / densities_of(of_pass.model)
    plain = Assumptions(np.ones(len(process)), np.ones(model.size), {})
    return of_pass.replay([plain, Assumptions(process, model.sigma / of_pass.model.sigma, ratio)], {})


def test_other_noises_are_those_of_a_filter_that_assumes_them(data: TuningData) -> None:
    """To second order in errors of a few metres: 2e-3 of σ, with other noises of sensors and readings."""
    first, other = data.run({}), data.run(OTHER)
    series, of_other = replayed(data, first, OTHER), replayed(data, other, {})
    assert {of.sensor for of in series} == {"gnss-position", "gnss-velocity"}
    for there, again in zip(of_other, series, strict=True):
        sigma = np.sqrt(np.einsum("mkk->mk", there.covariance[0]))
        np.testing.assert_allclose(np.einsum("mkk->mk", again.covariance[1]), sigma**2, rtol=2e-3)
        assert np.abs((again.value[1] - there.value[0]) / sigma).max() < 2e-3
        changed = again.covariance[0] / again.covariance[1] - 1.0  # by the noises, by far
        assert np.abs(np.einsum("mkk->mk", changed)).max() > 0.2


def test_the_innovations_are_those_of_the_pass(data: TuningData) -> None:
    """By the run's own innovations, which the filter computes one by one."""
    from sinssim.simulation.aided_run import aid_run
    from sinssim.simulation.navigation_stage import first_state

    of_pass = data.run({})
    series = of_pass.replay([Assumptions(np.ones(len(sources_of(of_pass.model))), np.ones(of_pass.model.size), {})], {})
    estimate = aid_run(
        data.scenario, data._truth.trajectory, data._sensed.imu, first_state(data.scenario, data._truth),
        data._sensed.errors, history=False,
    ).estimate  # fmt: skip
    for of, there in zip(series, estimate.innovations, strict=True):
        np.testing.assert_allclose(of.time, there.time, atol=1e-6)
        sigma = there.sigma_at(slice(None))
        assert np.abs((of.value[0] - there.value) / sigma).max() < 1e-3
        np.testing.assert_allclose(np.einsum("mkk->mk", of.covariance[0]), sigma**2, rtol=1e-4)


def test_readings_that_are_left_out_and_the_end(data: TuningData) -> None:
    of_pass = data.run({})
    plain = Assumptions(np.ones(len(sources_of(of_pass.model))), np.ones(of_pass.model.size), {})
    whole = of_pass.replay([plain], {})[0]
    gone = np.zeros(len(whole.time), dtype=bool)
    gone[3] = True
    less = of_pass.replay([plain], {"gnss-position": gone}, until=20.0)[0]
    assert less.row.tolist() == [row for row in whole.row[whole.time <= 20.0].tolist() if row != 3]
    np.testing.assert_array_equal(less.value[0, :3], whole.value[0, :3])
    assert np.abs(less.value[0, 3] - whole.value[0, 4]).max() > 0.0
