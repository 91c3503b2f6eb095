"""Statistics of an ensemble whose errors are given: percentiles, rates, the regulation, consistency, tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

import sinssim
from sinssim.experiments.ensembles.ensemble_errors import COMPONENTS, bytes_of, empty
from sinssim.experiments.ensembles.ensemble_plan import make_plan
from sinssim.experiments.ensembles.ensemble_result import EnsembleResult
from sinssim.experiments.ensembles.ensemble_run import EnsembleMedia
from sinssim.experiments.ensembles.ensemble_summary import part_121, summary_of
from tests.experiments.ensembles.examples import scenario

NMI_H = 1852.0 / 3600.0


def straight(rates_nmi_h: np.ndarray, hours: float = 1.0, failed: int = 0) -> EnsembleResult:
    """Return runs that drift north at constant rates; the first ones failed."""
    plan = make_plan(scenario(ensemble={"epoch_s": 1.0}))
    plan = replace(plan, epochs=np.linspace(0.0, 3600.0 * hours, 61))
    errors = empty(len(rates_nmi_h), 61, ())
    errors.number[:] = np.arange(len(rates_nmi_h))
    errors.end[:] = plan.epochs[-1]
    for vectors in (errors.position_ned, errors.velocity_ned, errors.attitude, errors.final):
        vectors[:] = 0.0
    errors.position_ned[:, :, 0] = np.outer(rates_nmi_h * NMI_H, plan.epochs)
    errors.final[:, 0] = errors.position_ned[:, -1, 0]
    for row in range(failed):
        errors.failure[row] = "it went away."
        errors.position_ned[row], errors.final[row] = np.nan, np.nan
    return EnsembleResult(plan, errors, media=EnsembleMedia())


def test_percentiles_and_rates_of_straight_lines() -> None:
    rates = np.linspace(0.01, 2.0, 200)
    result = straight(rates)
    numbers = summary_of(result)
    for definition in ("line", "end"):
        found = numbers["rate_nmi_h"][definition]
        assert found["cep"]["value"] == pytest.approx(np.percentile(rates, 50.0, method="median_unbiased"), rel=1e-12)
        assert found["r95"]["value"] == pytest.approx(np.percentile(rates, 95.0, method="median_unbiased"), rel=1e-12)
        assert found["cep"]["low"] < found["cep"]["value"] < found["cep"]["high"]
    assert result.r95.value[30] == pytest.approx(0.5 * result.r95.value[60], rel=1e-12)
    assert numbers["final_horizontal_m"]["cep"]["value"] == pytest.approx(result.cep.value[-1], rel=1e-12)
    assert [one["rank"] for one in numbers["named_runs"]] == [
        "worst", "worst 2", "worst 3", "worst 4", "worst 5", "median", "best",
    ]  # fmt: skip
    assert [one["run"] for one in numbers["named_runs"]] == [199, 198, 197, 196, 195, 99, 0]


@pytest.mark.parametrize(
    ("count", "ranks"),
    [(1, ["worst"]), (2, ["worst", "best"]), (4, ["worst", "worst 2", "median", "best"])],
)
def test_few_runs_have_a_median_and_a_best_one(count: int, ranks: list[str]) -> None:
    numbers = summary_of(straight(np.linspace(0.1, 1.0, count)))
    assert [one["rank"] for one in numbers["named_runs"]] == ranks


def test_failed_runs_come_first_and_count() -> None:
    result = straight(np.linspace(0.01, 1.0, 100), failed=6)
    numbers = summary_of(result)
    assert numbers["failed"] == 6
    assert numbers["rate_nmi_h"]["line"]["r95"]["value"] == np.inf
    assert np.isfinite(numbers["rate_nmi_h"]["line"]["cep"]["high"])
    assert [one["run"] for one in numbers["named_runs"]][:5] == [0, 1, 2, 3, 4]
    assert numbers["named_runs"][0]["failure"] == "it went away."
    assert numbers["named_runs"][-1]["rank"] == "best"
    assert numbers["named_runs"][-1]["run"] == 6
    assert np.isfinite(numbers["components"]["position_n_m"]["final_sigma"])


def test_a_short_run_ends_and_does_not_fail() -> None:
    """NaN after the end of a run does not count at an epoch; its rate is that of its own epochs."""
    result = straight(np.full(10, 1.0))
    result.errors.position_ned[0, 31:] = np.nan
    result.errors.end[0] = result.plan.epochs[30]
    result.errors.final[0, 0] = result.errors.position_ned[0, 30, 0]
    assert result.cep.runs[[30, 31]].tolist() == [10.0, 9.0]
    np.testing.assert_allclose(result.mean_rates, NMI_H, rtol=1e-12)
    np.testing.assert_allclose(result.end_rates, NMI_H, rtol=1e-12)


@pytest.mark.parametrize(
    ("rates", "failed", "verdict"),
    [
        (np.linspace(0.01, 1.9, 400), 0, "met"),
        (np.linspace(0.01, 3.0, 400), 0, "not met"),
        (np.linspace(0.01, 2.1, 400), 0, "undecided"),
        (np.linspace(0.01, 1.0, 20), 0, "undecided"),  # too few runs
        (np.linspace(0.01, 1.0, 100), 12, "not met"),  # 12 % failed
    ],
)
def test_the_rule_for_flights_up_to_ten_hours(rates: np.ndarray, failed: int, verdict: str) -> None:
    result = straight(rates, failed=failed)
    assert part_121(result, 3600.0).contents["verdict"] == verdict


def test_the_rule_beyond_ten_hours() -> None:
    """All errors are to the north: along the track of a course north, across that of a course east."""
    rates = np.linspace(0.01, 22.0 / 12.0, 400)  # up to 22 nmi after 12 h
    result = straight(rates, hours=12.0)
    for course, found in ((0.0, "met"), (0.5 * np.pi, "not met")):
        result.plan = replace(result.plan, course=course)
        told = part_121(result, 12.0 * 3600.0).contents
        assert told["verdict"] == found
        assert "20 nmi across" in told["rule"]
    result.plan = replace(result.plan, course=float("nan"))
    assert part_121(result, 12.0 * 3600.0).contents["verdict"] == "does not apply"
    result.plan = replace(result.plan, course=0.0, solution="aided")
    assert "aided" in part_121(result, 12.0 * 3600.0).contents["reason"]


def test_mean_squares_of_a_sound_filter() -> None:
    """NEES drawn from χ² of 3 degrees of freedom: mean 1, 95 % of the epochs in the band; the seed is fixed."""
    result = straight(np.full(50, 1.0))
    rng = np.random.default_rng(9)
    kept, result.errors = result.errors, empty(50, 61, (), ("attitude",))
    result.errors.put_runs(kept, 0)
    for name in COMPONENTS:
        result.errors.column(name)[:] = kept.column(name)
    result.errors.nees["attitude"][:] = rng.chisquare(3, size=(50, 61))
    result.errors.nees_freedom["attitude"][:] = 3.0
    result.errors.nees["attitude"][:, 0] = result.errors.nees_freedom["attitude"][:, 0] = np.nan
    found = summary_of(result)["nees"]["attitude"]
    assert found["mean"] == pytest.approx(1.0, abs=0.04)  # 4σ of 9000 degrees of freedom is 0.06
    assert found["share_in_band"] > 0.88
    assert np.isnan(result.nees["attitude"].value[0])


def test_a_run_of_the_ensemble_and_its_command() -> None:
    result = straight(np.full(3, 1.0))
    assert result.command(2) == f"sinssim run standing --set seed={result.member(2).seed}"
    for wrong in (3, -1, True):
        with pytest.raises(sinssim.InputError, match="3 runs from 0 to 2"):
            result.command(wrong)
    with pytest.raises(sinssim.InputError, match="quantity"):
        result.spread("speed")


def test_an_interrupted_ensemble_may_lack_its_first_runs() -> None:
    result = straight(np.linspace(0.1, 1.0, 8))
    result.errors.number[:] = np.arange(64, 72)
    numbers = summary_of(result)
    assert [one["run"] for one in numbers["named_runs"]][:2] == [71, 70]
    assert str(result.member(64).seed) in result.command(64)
    with pytest.raises(sinssim.InputError, match="8 runs from 64 to 71"):
        result.command(0)


def test_tables_for_other_programs(tmp_path) -> None:
    result = sinssim.ensemble(scenario(ensemble={"epoch_s": 10.0}), 4)
    by_epoch, by_run = (pq.read_table(file).to_pydict() for file in result.to_parquet(tmp_path / "out"))
    assert by_epoch["run"] == np.repeat(range(4), 4).tolist()
    assert by_epoch["time_s"][:4] == [0.0, 10.0, 20.0, 30.0]
    np.testing.assert_array_equal(by_epoch["position_n_m"], result.errors.position_ned[..., 0].ravel())
    assert by_run["seed"] == [result.member(n).seed for n in range(4)]
    final = np.array(by_run["end_rate_nmi_h"]) * NMI_H * 30.0
    np.testing.assert_allclose(final, result.final_horizontal, rtol=1e-15)  # two factors round


def test_groups_are_put_in_order() -> None:
    whole, part = empty(3, 4, ("a",), ("position",), ("gnss",)), empty(1, 4, ("a",), ("position",), ("gnss",))
    part.failure[0], part.number[0], part.values["a"][0], part.nis["gnss"][0] = "failed", 7, 8.0, 9.0
    part.position_ned[:] = 1.0
    whole.put(part, 2)
    assert whole.failed.tolist() == [False, False, True]
    assert whole.number.tolist() == [0, 0, 7]
    assert (whole.values["a"][2], whole.nis["gnss"][2, 0], whole.position_ned[2, 3, 2]) == (8.0, 9.0, 1.0)
    assert np.isnan(whole.position_ned[:2]).all()
    kept = (part.position_ned, part.velocity_ned, part.attitude, part.sigma, *part.nees.values(), *part.nis.values(),
            *part.nees_freedom.values(), *part.nis_freedom.values())  # fmt: skip
    assert bytes_of(1, 4, 1, 1) == sum(values.nbytes for values in kept if values is not None)
