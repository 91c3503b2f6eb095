"""A reference against the continuous truth that it was sampled from."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.data import NavSolution
from sinssim.logs.reference_solution import Reference
from sinssim.sensors.aiding_sensor import state_at
from tests.logs.drive import drive

TRUTH = drive(40.0)
ARM = (0.8, -0.4, -1.2)


def sampled(rate_hz: float, arm: tuple[float, float, float] = (0.0, 0.0, 0.0), *, whole: bool = True) -> Reference:
    time = np.arange(0.0, 39.99, 1.0 / rate_hz)
    place, block = state_at(TRUTH, time, arm), TRUTH.state(time)
    return Reference(
        "truth", time, place.latitude, place.longitude, place.height,
        place.velocity_ned if whole else None, block.q_nb if whole else None, lever_arm=arm,
    )  # fmt: skip


def solution(rate_hz: float = 100.0) -> NavSolution:
    time = np.arange(0.0, 39.9, 1.0 / rate_hz)
    s = TRUTH.state(time)
    return NavSolution(
        time, s.latitude, s.longitude, s.height, s.velocity_ned, s.q_nb, np.zeros(len(time)), "quaternion"
    )


@pytest.mark.parametrize(("rate", "metres"), [(50.0, 1e-6), (10.0, 1e-4), (4.0, 5e-3)])
def test_the_splines_pass_near_the_motion(rate: float, metres: float) -> None:
    error = sampled(rate).error_of(solution())
    assert np.nanmax(np.abs(error.position_ned)) < metres
    assert np.nanmax(error.speed) < 10.0 * metres
    assert np.nanmax(error.angle) < 10.0 * metres
    assert np.isfinite(error.position_ned).all(axis=1).mean() > 0.98


def test_the_interpolation_is_of_fourth_order() -> None:
    coarse, fine = (np.nanmax(sampled(rate).error_of(solution()).horizontal) for rate in (5.0, 10.0))
    assert coarse / fine > 10.0


@pytest.mark.parametrize("whole", [True, False])
def test_a_point_beside_the_block(whole: bool) -> None:
    """With its own attitude the reference is taken to the block, without one the solution to the reference's point."""
    error = sampled(20.0, ARM, whole=whole).error_of(solution())
    assert np.nanmax(np.abs(error.position_ned)) < 2e-3
    far = sampled(20.0, whole=whole)
    beside = Reference("beside", *(getattr(far, n) for n in ("time", "latitude", "longitude", "height")), lever_arm=ARM)
    assert np.nanmin(beside.error_of(solution()).horizontal) > 0.5
    if whole:
        assert np.nanmax(error.speed) < 5e-3
    else:
        assert np.isnan(error.velocity_ned).all()
        assert np.isnan(error.attitude).all()


def test_a_sparse_reference_is_known_near_its_rows_only() -> None:
    reference = sampled(1.0)
    error = reference.error_of(solution())
    known = np.isfinite(error.horizontal)
    assert np.abs(error.time[known] - np.round(error.time[known])).max() <= 0.0201
    assert 39 * 3 <= known.sum() <= 40 * 5  # every 10 ms up to 20 ms from a row, to rounding
    assert np.nanmax(error.horizontal) < 0.02


def test_nothing_is_known_in_a_gap_and_outside() -> None:
    whole = sampled(10.0)
    rows = (whole.time < 15.0) | (whole.time > 18.0)
    cut = Reference("cut", whole.time[rows], whole.latitude[rows], whole.longitude[rows], whole.height[rows])
    error = cut.error_of(solution())
    inside = (error.time > 15.0) & (error.time < 18.0)
    assert np.isnan(error.horizontal[inside]).all()
    assert np.nanmax(error.horizontal) < 1e-3
    assert cut.state_at(np.array([5.0])) is None  # it is not whole
    assert not cut.known(np.array([-0.1, 40.1])).any()


def test_its_own_uncertainty_is_interpolated() -> None:
    reference = sampled(10.0)
    sigma = np.column_stack((reference.time, 2.0 * reference.time, np.ones(len(reference.time))))
    own = Reference(
        "r", reference.time, reference.latitude, reference.longitude, reference.height, position_sigma=sigma
    )
    np.testing.assert_allclose(own.sigma_at(np.array([3.05])), [[3.05, 6.1, 1.0]], rtol=1e-12)
    assert reference.sigma_at(np.array([3.0])) is None
