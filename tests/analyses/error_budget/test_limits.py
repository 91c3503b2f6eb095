"""Requirements solved backwards, and put in again."""

from __future__ import annotations

import math

import pytest

from sinssim.analyses.error_budget.budget_result import BudgetResult, answers, times_of
from sinssim.analyses.error_budget.covariance_budget import budget
from sinssim.errors import InputError
from sinssim.scenario import Scenario
from sinssim.statistics.requirements import parse_requirements
from tests.analyses.error_budget.worlds import PLACE, scenario
from tests.slow import slow

SIZES = {
    "gyro_bias": ("gyro_bias_sigma_deg_h", 0.01), "accel_bias": ("accel_bias_sigma_ug", 50.0),
    "gyro_arw": ("gyro_arw_deg_sqrt_h", 0.003), "accel_scale": ("accel_scale_sigma_ppm", 50.0),
}  # fmt: skip
GIVEN = {"gyro_ramp_deg_h_per_h": [0.005, 0.0, 0.0]}


def plan(**sizes: float) -> Scenario:
    """Return a vehicle at rest for twenty minutes with some other sizes."""
    imu = {key: sizes.get(name, value) for name, (key, value) in SIZES.items()}
    return scenario(parked={**PLACE, "duration_s": 1200.0}, imu={**imu, **GIVEN})


@pytest.fixture(scope="module")
def result() -> BudgetResult:
    """The budget at the usual instants and at 605 s."""
    return budget(plan(), times=(605.0,))


@pytest.mark.parametrize("text", [
    "r95(605 s) <= 300 m",
    *slow("heading(605 s) <= 25 arcsec", "velocity_north(end) <= 1.1 m/s", "cep(end) <= 0.3 nmi", "rate <= 2 nmi/h",
          "position_east(run) <= 450 m",
          "r95(run) <= 1.2 km"),
])  # fmt: skip
def test_the_largest_values_just_meet_the_requirement(result: BudgetResult, text: str) -> None:
    """Each is put into the scenario, whose own budget then meets the limit to 1e-6."""
    (requirement,) = parse_requirements([text])
    (answer,) = answers(result, [requirement], ["gyro_bias", "accel_bias"])
    assert answer.joint is not None
    checked = 0
    for one in (*answer.allowances[:3], answer.joint):
        if not one.possible or one.factor > 1e3 or any(s.name not in SIZES for s in one.sources):
            continue
        sizes = {s.name: value for s, value in zip(one.sources, one.values, strict=True)}
        (again,) = answers(budget(plan(**sizes), times=times_of([requirement])), [requirement])
        assert again.value == pytest.approx(requirement.limit, rel=1e-6)
        checked += 1
    assert checked >= 1


def test_a_requirement_that_no_single_source_can_meet(result: BudgetResult) -> None:
    (answer,) = answers(result, parse_requirements(["r95(end) <= 100 m"]), ["gyro_bias", "accel_bias"])
    assert not answer.met
    assert answer.margin < 0.0
    assert not any(one.possible for one in answer.allowances)
    for one in answer.allowances:
        assert one.without > 100.0
    assert 0.0 < answer.everything.factor < 1.0
    factors = {s.name: answer.everything.factor for s in result.sources}
    total, bias = result.scaled(factors)
    assert result.r95_of(total[-1:], bias[-1:])[0] == pytest.approx(100.0, rel=1e-6)


def test_sources_come_in_the_order_of_what_they_contribute_to_the_quantity(result: BudgetResult) -> None:
    """The order of R95 is another one."""
    ranked = [one.source.name for one in result.improvements(1200.0)]
    other = 0
    for k, quantity in (
        (0, "position_north(end) <= 9 km"),
        (4, "velocity_east(end) <= 9 m/s"),
        (8, "heading <= 1 deg"),
    ):
        (answer,) = answers(result, parse_requirements([quantity]))
        names = [one.sources[0].name for one in answer.allowances]
        shares = {name: float(rows[-1, k, k]) for name, rows in result.covariance.items()}
        shares |= {name: float(rows[-1, k] ** 2) for name, rows in result.mean.items()}
        assert names == sorted(names, key=lambda name: -shares[name])
        other += names != [name for name in ranked if name in names]
    assert other


def test_a_source_without_effect_may_have_any_size(result: BudgetResult) -> None:
    (answer,) = answers(result, parse_requirements(["heading(end) <= 1 deg"]))
    assert answer.met
    (scale,) = [one for one in answer.allowances if one.sources[0].name == "accel_scale"]
    assert scale.possible
    assert math.isinf(scale.factor)


def test_a_given_error_is_solved_with_its_sign(result: BudgetResult) -> None:
    """The mean square of a component: σ² + f² m² = limit²."""
    (answer,) = answers(result, parse_requirements(["tilt_north(end) <= 1 arcmin"]))
    (ramp,) = [one for one in answer.allowances if one.sources[0].name == "gyro_ramp_given"]
    limit, sigma, mean = math.radians(1.0 / 60.0), result.sigma()[-1, 6], result.bias[-1, 6]
    assert ramp.factor == pytest.approx(math.sqrt(limit**2 - sigma**2) / abs(mean), rel=1e-9)


def test_halving_a_source(result: BudgetResult) -> None:
    """The gain of the ranking is that of the halved scenario's own budget."""
    (gain,) = [one for one in result.improvements() if one.source.name == "accel_bias"]
    halved = budget(plan(accel_bias=25.0))
    assert result.r95[-1] - gain.gain == pytest.approx(halved.r95[-1], rel=1e-9)
    assert sum(one.share for one in result.improvements()) == pytest.approx(1.0)


def test_what_cannot_be_answered_is_refused_by_name(result: BudgetResult) -> None:
    with pytest.raises(InputError, match="3600 s lies outside the run, which lasts 1200 s"):
        answers(result, parse_requirements(["r95(1 h) <= 1 m"]))
    with pytest.raises(InputError, match=r"the budget has no time t = 606\.5 s"):
        answers(result, parse_requirements(["r95(606.5 s) <= 1 m"]))
    with pytest.raises(InputError, match=r"free: .*gyro_bais.*gyro_bias"):
        answers(result, parse_requirements(["r95(end) <= 1 m"]), ["gyro_bais"])
