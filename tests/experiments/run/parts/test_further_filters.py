"""Filters side by side: the same readings, each filter's own keys, and the numbers of the table from the streams."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import sinssim
from sinssim.errors import InputError
from sinssim.exhibits import Table
from sinssim.scenario import Scenario
from sinssim.scenario.filter_model import with_first
from sinssim.simulation.navigation_stage import by_one, navigate
from sinssim.simulation.truth_comparison import FilterSolution

FILTER: dict[str, Any] = {"states": ["gyro bias", "accelerometer bias"], "gate": 0.0, "rate_hz": 2.0}
BASE: dict[str, Any] = {
    "name": "beside", "seed": 4,
    "great_circle": {"latitude_deg": 48.0, "longitude_deg": 11.0, "altitude_m": 3000.0, "course_deg": 30.0,
                     "speed_mps": 100.0, "duration_s": 40.0},
    "imu": {"grade": "laser-navigation", "rate_hz": 20.0}, "aiding": {"gnss": {}},
    "navigation": {"algorithms": ["quaternion"], "vertical": "free",
                   "initial_error": {"heading_sigma_arcmin": 30.0, "velocity_sigma_mps": 0.2}},
    "filter": FILTER,
    "filters": [{"name": "same"}, {"name": "invariant", "kind": "invariant"}, {"name": "few", "states": []}],
}  # fmt: skip


def scenario(**changes: Any) -> Scenario:
    """Return the scenario of these tests with other tables."""
    return Scenario(**{**BASE, **changes})


@cache
def flown() -> sinssim.Run:
    run = sinssim.run(scenario())
    assert isinstance(run, sinssim.Run)
    return run


def test_keys_that_are_left_out_are_those_of_filter() -> None:
    run = flown()
    assert run.aided is not None
    same, few = run.solutions["same"], run.solutions["few"]
    assert isinstance(same, FilterSolution)
    assert isinstance(few, FilterSolution)
    assert few.aided is not None
    np.testing.assert_array_equal(same.latitude, run.aided.estimate.solution.latitude)
    np.testing.assert_array_equal(same.q_nb, run.aided.estimate.solution.q_nb)
    assert [block.name for block in few.aided.estimate.model.blocks if block.name.endswith(" bias")] == []
    assert np.isinf(few.aided.estimate.innovations[0].bound)  # no gate, as in [filter]
    assert (same.kind, run.solutions["invariant"].kind) == ("error-state", "invariant")  # type: ignore[attr-defined]
    assert few.algorithm == "few"


def test_the_table_has_errors_and_their_covariance() -> None:
    """From the run's truth, and the filter's covariance at its stored rows, worked out here."""
    run = flown()
    numbers = run.summary["filters"]["invariant"]
    of = run.solutions["invariant"]
    truth = run.truth.trajectory.state(of.time)  # type: ignore[union-attr]
    north = (of.latitude - truth.latitude) * 6.3745e6  # radii of curvature at 48.0°, within 1e-3
    east = (of.longitude - truth.longitude) * 6.3930e6 * np.cos(truth.latitude)
    assert numbers["rms_horizontal_error_m"] == pytest.approx(np.sqrt(np.mean(north**2 + east**2)), rel=3e-3)
    turn = sinssim.rotation.multiply(truth.q_nb, sinssim.rotation.conjugate(of.q_nb))
    heading = 2.0 * turn[:, 3] * np.sign(turn[:, 0])
    assert numbers["rms_heading_error_arcmin"] == pytest.approx(np.degrees(np.sqrt(np.mean(heading**2))) * 60, rel=1e-4)
    estimate = of.aided.estimate  # type: ignore[attr-defined]
    sigma = estimate.sigma
    assert numbers["rms_horizontal_sigma_m"] == pytest.approx(np.sqrt(np.mean(sigma[:, 0] ** 2 + sigma[:, 1] ** 2)))
    assert numbers["rms_heading_sigma_arcmin"] == pytest.approx(np.degrees(np.sqrt(np.mean(sigma[:, 8] ** 2))) * 60)
    rows = estimate.rows
    errors = of.aided.state_errors[rows, :9]  # type: ignore[attr-defined]
    squares = [e @ np.linalg.inv(p[:9, :9]) @ e / 9 for e, p in zip(errors, estimate.covariance, strict=True)]
    assert numbers["nees_per_state"] == pytest.approx(np.mean(squares), rel=1e-4)
    assert (numbers["states"], numbers["kind"], numbers["diverged_s"]) == (15, "invariant", None)
    assert numbers["consistent"] is True
    assert 0.0 < numbers["processor_s"] < 60.0
    assert 0.0 < run.summary["filters"]["aided"]["processor_s"] < 60.0
    assert run.summary["filters"]["few"]["states"] == 9
    stream = next(of for of in run.parts["filters"].streams() if of.name == "filter_invariant")
    (vector,) = stream.vectors
    assert vector.columns[8] == "sigma_phi_d_rad"
    np.testing.assert_array_equal(vector.values[:, 8], sigma[:, 8])


def test_the_table_is_shown() -> None:
    part = flown().parts["filters"]
    (table,) = (item for item in part.exhibits() if isinstance(item, Table))
    assert [row[:3] for row in table.rows] == [
        ["aided", "error-state", "15"], ["same", "error-state", "15"], ["invariant", "invariant", "15"],
        ["few", "error-state", "9"],
    ]  # fmt: skip
    assert table.rows[0][3:9] == table.rows[1][3:9]  # the filter of [filter], and one with its keys
    assert [row[8] for row in table.rows][2] == "consistent"
    (table,) = (item for item in part.brief({}) if isinstance(item, Table))
    assert table.on == ("console",)


def test_they_are_no_inertial_solutions() -> None:
    """One of them is better than the aided solution with the draw of this seed, which says nothing about a model."""
    run = flown()
    assert run.aided is not None
    aided = float(np.sqrt(np.mean(run.aided.error_at(slice(None)).horizontal ** 2)))
    numbers = run.summary["filters"]
    assert min(numbers[name]["rms_horizontal_error_m"] for name in ("few", "invariant")) < aided
    assert not [remark for remark in run.summary["filter"]["remarks"] if "worse than" in remark]


def test_an_ensemble_of_one_of_them_is_that_with_its_keys() -> None:
    """The others keep theirs."""
    first = with_first(scenario(filter={**FILTER, "monitor_s": 30.0}), "few")
    assert first.filter is not None
    assert (first.filter.states, first.filter.monitor_s, first.filter.kind) == ((), 30.0, "error-state")
    by_name = {of.name: of for of in first.filters}
    assert by_name["invariant"].beside(first.filter).states == ("gyro bias", "accelerometer bias")
    assert with_first(first, "quaternion") is first
    named = sinssim.ensemble(scenario(ensemble={"solution": "few"}), runs=3)
    plain = sinssim.ensemble(scenario(filter={**FILTER, "states": []}, filters=[]), runs=3)
    assert all(named.summary[key] == plain.summary[key] for key in ("final_horizontal_m", "components", "nees", "nis"))
    assert named.summary["solution"] == "few"


def test_one_of_them_alone_navigates_by_the_first_algorithm() -> None:
    """As a guided flight wants it."""
    run = flown()
    alone = by_one(run.scenario, "invariant")
    assert (alone.navigation.algorithms, [of.name for of in alone.filters]) == (("quaternion",), ["invariant"])
    again = navigate(alone, run.sensed).solutions["invariant"]
    np.testing.assert_array_equal(again.velocity_ned, run.solutions["invariant"].velocity_ned)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": "quaternion"}, 'name = "quaternion" is the name of another solution of a run: choose another'),
        ({"name": "a", "smooth": True}, "smooth"),
        ({"name": "a", "kind": "invariant", "loop": "open"}, 'filters.1: kind = "invariant" feeds back after each'),
        ({"name": "a", "alignment": "in-motion", "alignment_s": 20.0}, "filters.1: alignment_s = 20 must be at least"),
        ({"name": "a", "kind": "particle"}, "Known: cubature, ensemble, error-state, invariant, unscented."),
    ],
)
def test_what_cannot_be_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as refused:
        scenario(filters=[change])
    assert message in str(refused.value)


def test_without_a_filter_there_is_none_beside_it() -> None:
    with pytest.raises(InputError, match=r"\[\[filters\]\] are beside that of \[filter\], whose keys they take: add"):
        scenario(filter=None, aiding=None)
